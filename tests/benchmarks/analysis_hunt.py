"""Wrong and unwarned, hunted: quiet sensors over a grid, and random motions for their stops and for relative columns.

Run: ``python -m tests.benchmarks.analysis_hunt quiet|drawn_quiet|stops|thin|relative [FIRST [END [SEED]]]``; each
writes a table to results/analysis_hunt_*.txt. A number is wrong where it is off by more than four of its standard
errors; stops are wrong where fewer are counted than last 2 % of a cycle, or more than there are (two that a slip parts
of less than the `smallest_slip` that a measurement states are one). Wrong and without a warning that names the
quantity is what is hunted.
"""

import itertools
import math
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import FrictionlabError
from frictionlab.recording import Recording
from frictionlab.simulator import Problem, SteadyState, steady_state
from tests.analysis.hostile import ALL, as_read, changed, motion, seen
from tests.analysis.seen import STEP_M

RESULTS = Path(__file__).parent / "results"
FAR = 4.0  # standard errors
LEAST = 0.02  # of a cycle: a stop that must be counted
RATES, SIZES, NOISES = (500.0, 1000.0, 2000.0, 4000.0), (0.1e-3, 0.4e-3, 1.8e-3), (0.025e-6, 0.08e-6, 0.16e-6, 0.31e-6)
MOTIONS = tuple(itertools.product((0.1, 0.15, 0.2, 0.3, 0.5, 0.7, 0.9, 1.2, 1.6), (0.3, 0.6)))
WORDS = {"energy": "energy_per_cycle", "amplitude": "response_amplitude", "stops": "stops_per_cycle"}


@dataclass(frozen=True)
class Found:
    """What one case came to: ``wrong`` names what is off, ``said`` what is warned of, ``words`` the numbers."""

    wrong: tuple[str, ...]
    said: tuple[str, ...]
    words: str

    @property
    def unwarned(self) -> tuple[str, ...]:
        """What is wrong without a warning that names it."""
        return tuple(what for what in self.wrong if not any(WORDS[what] in sentence for sentence in self.said))


def lengths(state: SteadyState, way: float = 0.0) -> np.ndarray:
    """Lengths of the stops of a cycle, in cycles; those that a slip of less than ``way`` parts are one."""
    if state.orbit is None or not len(state.orbit.stops):
        return np.zeros(0)
    whole = state.orbit.end - state.orbit.start
    place = state.orbit.at(state.orbit.stops.mean(axis=1))[0]
    spans = [[*span, x] for span, x in zip(state.orbit.stops.tolist(), place.tolist(), strict=True)]
    joined = spans[:1]
    for begin, end, x in spans[1:]:
        if abs(x - joined[-1][2]) <= way:
            joined[-1][1] = end
        else:
            joined.append([begin, end, x])
    wraps = abs(joined[-1][2] - joined[0][2]) <= max(way, 1e-12) and len(joined) > 1
    if wraps:
        joined[-1][1] = joined.pop(0)[1] + whole
    return np.array([end - begin for begin, end, _ in joined]) / (2.0 * math.pi)


def judged(m: Measurement, r: float, beta: float) -> Found:
    """One measurement of a plain Coulomb motion against its truth."""
    state = steady_state(Problem(r, beta))
    of, every = motion(r, beta), lengths(state, m.smallest_slip)
    sure = np.count_nonzero(every >= LEAST) / (state.period_cycles or 1)
    wrong = []
    if abs(m.energy_per_cycle - of.energy) > FAR * m.energy_per_cycle_se:
        wrong.append("energy")
    if abs(m.response_amplitude - of.amplitude) > FAR * m.response_amplitude_se:
        wrong.append("amplitude")
    if not sure - 0.05 <= m.stops_per_cycle <= of.stops + 0.05:
        wrong.append("stops")
    words = (
        f"energy {100 * (m.energy_per_cycle / of.energy - 1):+.4f} ({100 * m.energy_per_cycle_se / of.energy:.4f}) %,"
        f" amplitude {100 * (m.response_amplitude / of.amplitude - 1):+.4f}"
        f" ({100 * m.response_amplitude_se / of.amplitude:.4f}) %, stops {m.stops_per_cycle:.2f} of {of.stops:g}"
        f" ({', '.join(f'{100 * length:.2f}' for length in np.sort(lengths(state)))} %)"
    )
    return Found(tuple(wrong), m.warnings, words)


def measured(recording: Recording, r: float, beta: float) -> Found:
    """One case; a refusal is told, not wrong."""
    try:
        return judged(measure(recording, ALL), r, beta)
    except FrictionlabError as error:
        return Found((), (f"refused: {error}",), "refused")


def quiet(first: int, end: int, _: int) -> Iterator[tuple[str, Found]]:
    """Sensors with less noise than their step: 864 cases of 40 s."""
    cases = list(itertools.product(RATES, SIZES, NOISES, MOTIONS))
    for rate, size, noise, (r, beta) in cases[first:end]:
        recording = as_read(seen(motion(r, beta), noise=noise, size=size, rate=rate, seconds=40.0))
        yield (
            f"{rate:g} Hz, {1e3 * size:g} mm, {1e6 * noise:g} um, r {r:g}, beta {beta:g}",
            measured(recording, r, beta),
        )


def drawn(first: int, end: int, seed: int) -> Iterator[tuple[float, float, np.random.Generator]]:
    """Random motions: r = 0.05 to 2.5 logarithmically, beta = 0.1 to 0.75, steady states only."""
    for index in range(first, end):
        generator = np.random.default_rng([18, seed, index])
        r, beta = float(np.exp(generator.uniform(math.log(0.05), math.log(2.5)))), float(generator.uniform(0.1, 0.75))
        state = steady_state(Problem(r, beta))
        if state.orbit is not None and state.outcome == "periodic":
            yield r, beta, generator


def is_thin(r: float, beta: float) -> bool:
    """Whether a motion has a stop of 1.8 to 2.6 % of a cycle, or two stops parted by a slip of less than 0.005 Y."""
    state = steady_state(Problem(r, beta))
    every = lengths(state)
    if state.orbit is None or not len(every):
        return False
    place = state.orbit.at(state.orbit.stops.mean(axis=1))[0]
    way = np.abs(np.diff(np.append(place, place[:1])))
    return bool(np.any((every > 0.018) & (every < 0.026)) or np.any((way > 1e-9) & (way < 0.005)))


def stops(first: int, end: int, seed: int) -> Iterator[tuple[str, Found]]:
    """Random motions through the optoNCDT's noise, 60 s at 500 Hz."""
    for r, beta, generator in drawn(first, end, seed):
        recording = seen(motion(r, beta), seconds=60.0, seed=int(generator.integers(1 << 31)))
        yield f"r {r:.6g}, beta {beta:.6g}", measured(recording, r, beta)


def thin(first: int, end: int, seed: int) -> Iterator[tuple[str, Found]]:
    """The same of those alone whose stops are thin."""
    for r, beta, generator in drawn(first, end, seed):
        if is_thin(r, beta):
            recording = seen(motion(r, beta), seconds=60.0, seed=int(generator.integers(1 << 31)))
            yield f"r {r:.6g}, beta {beta:.6g}", measured(recording, r, beta)


def drawn_quiet(first: int, end: int, seed: int) -> Iterator[tuple[str, Found]]:
    """Random motions through sensors of 0.03 to 0.4 of a step of noise, 40 s at 1 to 4 kHz, base 0.1 to 1.8 mm."""
    for r, beta, generator in drawn(first, end, seed):
        rate, size = float(generator.choice(RATES[1:])), 1e-4 * 18.0 ** float(generator.uniform())
        noise = STEP_M * 0.03 * (0.4 / 0.03) ** float(generator.uniform())
        one = as_read(seen(motion(r, beta), noise=noise, size=size, rate=rate, seconds=40.0, seed=first))
        words = f"{rate:g} Hz, {1e3 * size:.3g} mm, {1e6 * noise:.2g} um, r {r:.6g}, beta {beta:.6g}"
        yield words, measured(one, r, beta)


def relative(first: int, end: int, seed: int) -> Iterator[tuple[str, Found]]:
    """The same with the mass's column relative to the base, and as it is: the first must be named, the second not."""
    for r, beta, generator in drawn(first, end, seed):
        one = seen(motion(r, beta), seconds=40.0, seed=int(generator.integers(1 << 31)))
        for name, mass in (("relative", one.mass_displacement - one.base_displacement), ("right", None)):
            said = measure(changed(one, mass=mass), ALL).warnings
            named = any("relative to the base" in sentence for sentence in said)
            wrong = ("amplitude",) if named != (name == "relative") else ()
            yield f"{name}, r {r:.6g}, beta {beta:.6g}", Found(wrong, () if wrong else said, f"named: {named}")


HUNTS = {
    "quiet": (quiet, 864),
    "drawn_quiet": (drawn_quiet, 400),
    "stops": (stops, 400),
    "thin": (thin, 3000),
    "relative": (relative, 200),
}


def main(what: str, first: int = 0, end: int | None = None, seed: int = 1) -> None:
    """Write the table: how many, how many wrong, each that is wrong with what was said."""
    hunt, many = HUNTS[what]
    counts: Counter[str] = Counter()
    lines = []
    for name, found in hunt(first, many if end is None else end, seed):
        counts["cases"] += 1
        counts["wrong"] += bool(found.wrong)
        counts["wrong and unwarned"] += bool(found.unwarned)
        counts["with a warning"] += bool(found.said)
        if found.wrong:
            said = "; ".join(sentence[:70] for sentence in found.said) or "-"
            how = "UNWARNED" if found.unwarned else "warned"
            lines.append(f"{how:9s} {name}: {', '.join(found.wrong)}: {found.words}: {said}")
    head = f"{what} {first} to {end or many}, seed {seed}: " + ", ".join(
        f"{count} {name}" for name, count in counts.items()
    )
    (RESULTS / f"analysis_hunt_{what}.txt").write_text("\n".join([head, *lines]) + "\n")
    sys.stdout.write("\n".join([head, *lines]) + "\n")


if __name__ == "__main__":
    main(sys.argv[1], *(int(word) for word in sys.argv[2:]))
