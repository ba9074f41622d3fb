"""Does the combined uncertainty cover the truth when sensors and rig are off by what is declared of them?

Run: ``python -m tests.benchmarks.uncertainty_coverage [DRAWS]``; the result goes to results/uncertainty_coverage.txt.
Every draw is one test of 30 s at 250 Hz with its own lag, gain, natural frequency and frame damping, each drawn from
the uncertainty that its scene declares, and its own noise and scatter of friction.
"""

import math
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from frictionlab.analysis.measure import measure
from frictionlab.identification import predict
from frictionlab.simulator import Problem, observe, steady_state
from frictionlab.simulator.engine import compiled
from tests.identification.contacts import NATURAL_HZ, recorded, scene

RESULT = Path(__file__).parent / "results" / "uncertainty_coverage.txt"
POINTS = ((0.1, 0.4), (0.3, 0.4), (0.5, 0.4), (0.8, 0.3), (1.2, 0.3), (2.0, 0.2))
LAG_S, GAIN, FREQUENCY, DAMPING, DAMPING_U = 0.001, 0.001, 0.002, 0.005, 0.001
TABLES: dict[str, Mapping[str, object]] = {
    "rig": {"natural_frequency_hz_u": FREQUENCY * NATURAL_HZ, "damping_ratio": DAMPING, "damping_ratio_u": DAMPING_U},
    "sensors": {"lag_s_u": LAG_S, "gain_error": GAIN},
}
QUANTITIES = ("energy", "amplitude", "friction ratio")


def scores_of(r: float, beta: float, seed: int) -> tuple[float, float, float]:
    """Error over combined uncertainty of energy, amplitude and friction ratio of one draw."""
    generator = np.random.default_rng([18, seed])
    detuned, damped, late, mass, base = generator.standard_normal(5)
    truth = Problem(r / (1.0 + FREQUENCY * detuned), beta, frame_damping_ratio=max(0.0, DAMPING + DAMPING_U * damped))
    shown = observe(steady_state(truth))
    gains = 1.0 + GAIN * mass, 1.0 + GAIN * base
    drive = r / truth.r
    recording = recorded(
        truth, generator, seconds=30.0, lag_s=LAG_S * float(late), gain=float(gains[0] / gains[1]), tuned=drive
    )
    measured = measure(recording, scene(**TABLES))
    found = predict(measured, scene(**TABLES))
    pairs = (
        (measured.energy_per_cycle, measured.energy_per_cycle_u, shown.energy_per_cycle),
        (measured.response_amplitude, measured.response_amplitude_u, shown.response_amplitude),
        (found.friction_ratio, found.friction_ratio_u, beta),
    )
    one, two, three = ((value - true) / u if u and true is not None else math.nan for value, u, true in pairs)
    return one, two, three


def shares(scores: np.ndarray) -> list[str]:
    """Of the scores (draws, 3) of each quantity: coverage at two levels, rms and mean."""
    lines = []
    for name, score in zip(QUANTITIES, scores.T, strict=True):
        inside = [100 * float(np.mean(np.abs(score) < limit)) for limit in (1.0, 1.96)]
        rms = math.sqrt(float(np.mean(score**2)))
        lines.append(f"{name:16s}{inside[0]:8.0f}{inside[1]:8.0f}{rms:7.2f}{score.mean():7.2f}")
    return lines


def main(draws: int) -> None:
    """Write the table."""
    compiled()
    lines = [f"{draws} draws a motion; share of truths in % within 1 and 1.96 combined uncertainties"]
    lines.append(f"{'r':>5s}{'beta':>6s}  {'quantity':16s}{'68.3 %':>8s}{'95.0 %':>8s}{'rms':>7s}{'mean':>7s}")
    every = []
    for r, beta in POINTS:
        every.append(np.array([scores_of(r, beta, seed) for seed in range(draws)]))
        lines += [f"{r:5g}{beta:6g}  {line}" for line in shares(every[-1])]
        sys.stdout.write(lines[-1] + "\n")
        sys.stdout.flush()
    lines += [f"{'all':>11s}  {line}" for line in shares(np.concatenate(every))]
    RESULT.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
