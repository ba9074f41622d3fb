"""Do the real recordings of the frame say one thing however they are cut, filtered, sampled or declared?

Run: ``python -m tests.benchmarks.frame_cuts``; the result goes to results/frame_cuts.txt. Each line is one choice that
another user of the same rig could make: where to begin and to end, which cycles, how often to sample, which cut-off,
which sign, which published natural frequency. Beside each choice stand what `--law auto` finds and how far its friction
ratio lies from that of the whole record, over both uncertainties in quadrature.
"""

import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from frictionlab.errors import FrictionlabError
from frictionlab.inference import compare
from frictionlab.inference.comparison import Comparison
from frictionlab.logs import read_log
from frictionlab.recording import Recording
from frictionlab.scene import Scene, read_scene
from frictionlab.simulator.elastic import engine as elastic
from frictionlab.simulator.engine import compiled

FloatArray = NDArray[np.float64]
ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data"
RESULT = Path(__file__).parent / "results" / "frame_cuts.txt"
TESTS = ("frame_250g", "frame_450g")
ASKED = {"frame_250g": (0.012, 0.016), "frame_450g": (0.010, 0.016)}  # nrmse, and of cycles left out
MOST_PARAMETERS = 3
HEAD = (
    f"{'test':11s}{'choice':22s}{'found':24s}{'n':>2s} {'verdict':10s}{'nrmse':>6s}{'floor':>6s}{'out':>6s}"
    f"{'beta':>8s}{'u':>7s}{'apart':>6s}  {'':4s} parameters"
)


@dataclass(frozen=True)
class Choice:
    """One way to use a recording: what is done to it, and what the scene says otherwise."""

    name: str
    change: Callable[[Recording], Recording]
    tables: dict[str, dict[str, object]]


def as_it_is(recording: Recording) -> Recording:
    """The whole record."""
    return recording


def of_samples(recording: Recording, some: NDArray[np.bool_] | slice) -> Recording:
    """Some samples of a record."""
    return Recording(recording.time[some], recording.mass_displacement[some], recording.base_displacement[some])


def between(begin: float, end: float) -> Callable[[Recording], Recording]:
    """So much of a record, by the time in s since its first sample."""

    def cut(recording: Recording) -> Recording:
        since = recording.time - recording.time[0]
        chosen = (since >= begin) & (since <= end)
        return of_samples(recording, chosen)

    return cut


def every(count: int) -> Callable[[Recording], Recording]:
    """Every so manieth sample."""

    def thinned(recording: Recording) -> Recording:
        return of_samples(recording, slice(None, None, count))

    return thinned


def scaled(mass: float, base: float) -> Callable[[Recording], Recording]:
    """Both channels times a number."""

    def changed(recording: Recording) -> Recording:
        return Recording(recording.time, mass * recording.mass_displacement, base * recording.base_displacement)

    return changed


def smoothed(cutoff_hz: float) -> Callable[[Recording], Recording]:
    """Both channels through a low-pass filter that goes forth and back (no lag)."""

    def filtered(recording: Recording) -> Recording:
        stages = butter(4, cutoff_hz, fs=1.0 / float(np.diff(recording.time).mean()), output="sos")
        channels = recording.mass_displacement, recording.base_displacement
        mass, base = (sosfiltfilt(stages, channel) for channel in channels)
        return Recording(recording.time, mass, base)

    return filtered


def noisy(size_m: float, seed: int) -> Callable[[Recording], Recording]:
    """White noise on both channels."""

    def changed(recording: Recording) -> Recording:
        more = size_m * np.random.default_rng(seed).standard_normal((2, len(recording.time)))
        return Recording(recording.time, recording.mass_displacement + more[0], recording.base_displacement + more[1])

    return changed


def late(seconds: float) -> Callable[[Recording], Recording]:
    """The base's channel so much later."""

    def shifted(recording: Recording) -> Recording:
        base = np.interp(recording.time - seconds, recording.time, recording.base_displacement)
        inside = slice(3, -3)
        return Recording(recording.time[inside], recording.mass_displacement[inside], base[inside])

    return shifted


def choices() -> Iterator[Choice]:
    """Every way tried."""
    for transient in (2.0, 0.0, 1.0, 3.0, 4.0, 5.0, 5.5, 6.0):
        yield Choice(f"transient {transient:g} s", as_it_is, {"analysis": {"transient_s": transient}})
    for begin, end in ((0.0, 5.0), (5.0, 10.0), (2.0, 7.0), (3.0, 8.0), (1.0, 9.0), (4.0, 10.0)):
        yield Choice(f"only {begin:g} to {end:g} s", between(begin, end), {"analysis": {"transient_s": 0.0}})
    for cycles in ("window:4", "window:6", "last"):
        yield Choice(f"cycles {cycles}", as_it_is, {"analysis": {"cycles": cycles}})
    for count in (2, 4):
        yield Choice(f"at {250 / count:g} Hz", every(count), {})
    for cutoff in (60.0, 30.0, 15.0):
        yield Choice(f"below {cutoff:g} Hz", smoothed(cutoff), {})
    yield Choice("other sign", scaled(-1.0, -1.0), {})
    for size in (2e-6, 20e-6):
        yield Choice(f"{1e6 * size:g} um of noise", noisy(size, 14), {})
    for seconds in (-4e-3, 4e-3):
        yield Choice(f"base {1e3 * seconds:+g} ms", late(seconds), {})
    for hertz in (3.115, 3.145):
        yield Choice(f"{hertz:g} Hz", as_it_is, {"rig": {"natural_frequency_hz": hertz}})
    yield Choice("frame's damping open", as_it_is, {"rig": {"damping_ratio": None}})
    yield Choice("base as measured", as_it_is, {"model": {"base_harmonics": 9}})


def judged(found: Comparison, test: str) -> str:
    """Whether a result is what was asked for."""
    rung = next(rung for rung in found.laws or () if rung["law"] == found.law)
    nrmse, left_out = ASKED[test]
    good = (
        (found.response_nrmse or math.inf) <= nrmse
        and float(str(rung["held_out_nrmse"])) <= left_out
        and len(found.parameters) <= MOST_PARAMETERS
        and found.verdict == "explained"
    )
    return "" if good else "out"


def line_of(name: str, found: Comparison, test: str, whole: Comparison) -> str:
    """One choice as a line."""
    rung = next(rung for rung in found.laws or () if rung["law"] == found.law)
    beta, u = found.friction_ratio or math.nan, found.friction_ratio_u or math.nan
    apart = (beta - (whole.friction_ratio or math.nan)) / math.hypot(u, whole.friction_ratio_u or math.nan)
    told = [f"{n} {p['value']:.4g}({p['u'] or 0.0:.2g})" for n, p in found.parameters.items() if n != "beta"]
    percent = (found.response_nrmse, found.response_floor, float(str(rung["held_out_nrmse"])))
    return (
        f"{test:11s}{name:22s}{found.law:24s}{len(found.parameters):2d} {found.verdict or '-':10s}"
        + "".join(f"{100 * (value or math.nan):6.2f}" for value in percent)
        + f"{beta:8.3f}{u:7.3f}{apart:+6.1f}  {judged(found, test):4s} {', '.join(told)}".rstrip()
    )


def main() -> None:
    """Write the table."""
    compiled()
    elastic.compiled()
    scene = read_scene(ROOT / "configs" / "frame.toml")
    lines = [HEAD]
    for test in TESTS:
        recording = read_log(DATA / f"{test}.csv")
        whole = compare(recording, scene, law="auto")
        for choice in choices():
            lines.append(tried(choice, recording, scene, test, whole))
            sys.stdout.write(lines[-1] + "\n")
            sys.stdout.flush()
    RESULT.write_text("\n".join(lines) + "\n")


def tried(choice: Choice, recording: Recording, scene: Scene, test: str, whole: Comparison) -> str:
    """What one choice gives, as a line."""
    try:
        found = compare(choice.change(recording), scene.changed(**choice.tables), law="auto")
    except FrictionlabError as fault:
        return f"{test:11s}{choice.name:22s}refused: {fault}"
    return line_of(choice.name, found, test, whole)


if __name__ == "__main__":
    main()
