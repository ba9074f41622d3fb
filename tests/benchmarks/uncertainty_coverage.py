"""Does the combined uncertainty cover the truth when sensors and rig are off by what is declared of them?

Run: ``python -m tests.benchmarks.uncertainty_coverage [DRAWS [FIRST [filtered]]]``; the result goes to
results/uncertainty_coverage.txt, of draws from another FIRST than 0 to results/uncertainty_coverage_FIRST.txt, of
filtered ones to results/uncertainty_coverage_filtered.txt.
Every draw is one test of 30 s at 250 Hz with its own lag, gains, curvature of both sensors, crosstalk either way,
natural frequency and frame damping, each drawn from the uncertainty that its scene declares, mains hum on the mass's
sensor, and its own noise and scatter of friction. ``filtered``: in every other draw each channel has a low-pass filter
of its own, drawn and declared. No two draws share a random number.
"""

import math
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frictionlab import compare
from frictionlab.analysis.channels import low_pass
from frictionlab.analysis.measurement import measure
from frictionlab.recording import Recording
from frictionlab.simulator import Problem, steady_state
from frictionlab.simulator.sweep import warm_up
from tests.inference.contacts import NATURAL_HZ, recorded, scene

FloatArray = NDArray[np.float64]
RESULTS = Path(__file__).parent / "results"
POINTS = ((0.1, 0.4), (0.2, 0.4), (0.3, 0.4), (0.5, 0.4), (0.7, 0.3), (0.9, 0.3), (1.2, 0.3), (1.6, 0.3), (2.0, 0.2))
LAG_S, GAIN, LINEARITY, CROSSTALK = 0.001, 0.001, 0.0005, 0.0005
FREQUENCY, DAMPING, DAMPING_U = 0.002, 0.005, 0.001
HUM_M, MAINS_HZ = 2e-6, 50.0
TABLES: dict[str, dict[str, object]] = {
    "rig": {"natural_frequency_hz_u": FREQUENCY * NATURAL_HZ, "damping_ratio": DAMPING, "damping_ratio_u": DAMPING_U},
    "sensors": {"lag_s_u": LAG_S, "gain_error": GAIN, "linearity": LINEARITY, "crosstalk": CROSSTALK},
}
FILTERS_HZ, ORDERS = (15.0, 60.0), (1, 2, 4)
QUANTITIES = ("energy", "amplitude", "friction ratio")


class Sensors:
    """Two sensors that are off by so many standard uncertainties (7,): gains, curvatures, crosstalk, hum.

    ``filters``: keys of ``[sensors]`` that say what low-pass filter each channel has.
    """

    def __init__(self, drawn: FloatArray, filters: Mapping[str, float]) -> None:
        self.filters = filters
        self.gain, self.bent, self.mixed, self.hum = drawn[:2] * GAIN, drawn[2:4], drawn[4:6] * CROSSTALK, drawn[6]

    def __call__(self, t: FloatArray, mass: FloatArray, base: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What they show of a motion [m]."""
        shown = mass + self.mixed[0] * base, base + self.mixed[1] * mass
        one, two = (
            (1.0 + gain) * (x + LINEARITY * bent * 2.0 * x**3 / (0.5 * np.ptp(x)) ** 2)
            for x, gain, bent in zip(shown, self.gain, self.bent, strict=True)
        )
        one = one + HUM_M * self.hum * np.sin(2.0 * math.pi * MAINS_HZ * t + 0.3)
        return self._filtered(t, one, "mass"), self._filtered(t, two, "base")

    def _filtered(self, t: FloatArray, signal: FloatArray, role: str) -> FloatArray:
        """Through the channel's analog filter, by the spectrum of the signal and its mirror image."""
        if not self.filters:
            return signal
        both = np.concatenate([signal, signal[::-1]])
        frequency = np.asarray(np.fft.rfftfreq(len(both), float(t[1] - t[0])), dtype=np.float64)
        passed = low_pass(frequency, self.filters[f"{role}_filter_hz"], int(self.filters[f"{role}_filter_order"]))
        return np.asarray(np.fft.irfft(np.fft.rfft(both) * passed, len(both))[: len(signal)])


def filters_of(generator: np.random.Generator) -> dict[str, float]:
    """Draw a low-pass filter for each channel."""
    drawn: dict[str, float] = {}
    for role in ("mass", "base"):
        drawn[f"{role}_filter_hz"] = float(generator.uniform(*FILTERS_HZ))
        drawn[f"{role}_filter_order"] = int(generator.choice(ORDERS))
    return drawn


def off_as_declared(
    nominal: Problem,
    generator: np.random.Generator,
    *,
    seconds: float,
    hum: bool = True,
    filters: Mapping[str, float] | None = None,
) -> tuple[Problem, Recording]:
    """A contact in a rig whose sensors and frame are off by what `TABLES` declare: what is true, and its recording."""
    detuned, damped, late, *drawn = generator.standard_normal(10)
    ratio, frame = nominal.r / (1.0 + FREQUENCY * detuned), max(0.0, DAMPING + DAMPING_U * damped)
    truth = nominal._but(r=ratio).with_parameters({"frame_damping_ratio": frame})
    sensors = Sensors(np.array([*drawn[:6], drawn[6] if hum else 0.0]), filters or {})
    lag, tuned = LAG_S * float(late), nominal.r / truth.r
    return truth, recorded(truth, generator, seconds=seconds, lag_s=lag, tuned=tuned, sensors=sensors)


def scores_of(r: float, beta: float, seed: int, *, filtered: bool = False) -> tuple[float, float, float]:
    """Error over combined uncertainty of energy, amplitude and friction ratio of one draw."""
    generator = np.random.default_rng([18, round(1000 * r), seed])
    filters = filters_of(np.random.default_rng([19, round(1000 * r), seed])) if filtered and seed % 2 else {}
    truth, recording = off_as_declared(Problem(r, beta), generator, seconds=30.0, filters=filters)
    what = scene(**{**TABLES, "sensors": {**TABLES["sensors"], **filters}})
    shown = steady_state(truth)
    measured = measure(recording, what)
    found = compare(measured, what)
    pairs = (
        (measured.energy_per_cycle, measured.energy_per_cycle_u, shown.energy_per_cycle),
        (measured.response_amplitude, measured.response_amplitude_u, shown.response_amplitude),
        (found.friction_ratio, found.friction_ratio_u, beta),
    )
    one, two, three = ((value - true) / u if u and true is not None else math.nan for value, u, true in pairs)
    return one, two, three


def shares(scores: FloatArray) -> list[str]:
    """Of the scores (draws, 3) of each quantity: coverage at two levels, rms and mean."""
    lines = []
    for name, score in zip(QUANTITIES, scores.T, strict=True):
        inside = [100 * float(np.mean(np.abs(score) < limit)) for limit in (1.0, 1.96)]
        rms = math.sqrt(float(np.mean(score**2)))
        lines.append(f"{name:16s}{inside[0]:8.0f}{inside[1]:8.0f}{rms:7.2f}{score.mean():7.2f}")
    return lines


def table(scores: FloatArray) -> str:
    """The table of scores (points, draws, 3)."""
    lines = [f"{scores.shape[1]} draws a motion; share of truths in % within 1 and 1.96 combined uncertainties"]
    lines.append(f"{'r':>5s}{'beta':>6s}  {'quantity':16s}{'68.3 %':>8s}{'95.0 %':>8s}{'rms':>7s}{'mean':>7s}")
    for (r, beta), some in zip(POINTS, scores, strict=True):
        lines += [f"{r:5g}{beta:6g}  {line}" for line in shares(some)]
    lines += [f"{'all':>11s}  {line}" for line in shares(scores.reshape(-1, len(QUANTITIES)))]
    return "\n".join(lines) + "\n"


def main(draws: int, first: int = 0, *, filtered: bool = False) -> None:
    """Write the table, and again after every tenth round of all motions: a study that is cut short is one of fewer."""
    warm_up("coulomb")
    rounds: list[list[tuple[float, float, float]]] = []
    kind = "_filtered" if filtered else f"_{first}" if first else ""
    place = RESULTS / f"uncertainty_coverage{kind}.txt"
    for seed in range(first, first + draws):
        rounds.append([scores_of(r, beta, seed, filtered=filtered) for r, beta in POINTS])
        if len(rounds) % 10 == 0 or len(rounds) == draws:
            place.write_text(table(np.array(rounds).swapaxes(0, 1)))
            sys.stdout.write(f"{len(rounds)} rounds\n")
            sys.stdout.flush()


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:3] or ("225",)), filtered="filtered" in sys.argv)
