"""Do the stated standard errors cover the truth? Noise realisations of two motions.

Run: ``python -m tests.benchmarks.analysis_coverage [DRAWS]`` (1,000 if not said); the result goes to
results/analysis_coverage.txt. Every draw is one test of 20 s at 250 Hz through the optoNCDT's noise and step, measured
over all its cycles and identified.
"""

import math
import sys
from pathlib import Path

import numpy as np

from frictionlab.analysis.measure import measure
from frictionlab.inference import predict
from frictionlab.recording import Recording
from tests.analysis.seen import BASE_M, NATURAL_HZ, scene, steady, through_laser

DRAWS, SECONDS, RATE = 1000, 20.0, 250.0
CASES = ((0.5, 0.4, "stick-slip"), (0.8, 0.3, "continuous"))
QUANTITIES = ("drive frequency", "energy per cycle", "friction ratio", "amplitude")
RESULT = Path(__file__).parent / "results" / "analysis_coverage.txt"


def errors_over_stated(r: float, beta: float, draws: int) -> np.ndarray:
    """Error over stated standard error of frequency, energy, friction ratio and amplitude, (draws, 4)."""
    _, orbit, energy, amplitude = steady(r, beta)
    generator = np.random.default_rng(20261121)
    t = np.arange(round(SECONDS * RATE)) / RATE
    tau = 2 * math.pi * r * NATURAL_HZ * t
    mass, base = BASE_M * orbit.at(np.mod(tau, 2 * math.pi))[0], BASE_M * np.cos(tau)
    what, scores = scene("all", 0.0), np.empty((draws, 4))
    for j in range(draws):
        m = measure(Recording(t, through_laser(mass, generator), through_laser(base, generator)), what)
        c = predict(m, what)
        scores[j] = (
            (m.drive_frequency_hz - r * NATURAL_HZ) / (m.drive_frequency_hz_se or math.nan),
            (m.energy_per_cycle - energy) / m.energy_per_cycle_se,
            (c.friction_ratio - beta) / (c.friction_ratio_se or math.nan),
            (m.response_amplitude - amplitude) / m.response_amplitude_se,
        )
    return scores


def main() -> None:
    """Write the table."""
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else DRAWS
    lines = [f"{draws} draws of {SECONDS:g} s at {RATE:g} Hz; share of truths within 1 and 1.96 stated standard errors"]
    lines.append(f"{'motion':34s}{'quantity':18s}{'68.3 %':>8s}{'95.0 %':>8s}{'rms':>7s}{'mean':>7s}")
    for r, beta, words in CASES:
        scores = errors_over_stated(r, beta, draws)
        for name, score in zip(QUANTITIES, scores.T, strict=True):
            inside = [100 * float(np.mean(np.abs(score) < limit)) for limit in (1.0, 1.96)]
            title = f"r = {r}, beta = {beta}, {words}"
            lines.append(
                f"{title:34s}{name:18s}{inside[0]:8.1f}{inside[1]:8.1f}"
                f"{math.sqrt(float(np.mean(score**2))):7.2f}{float(score.mean()):7.2f}"
            )
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text("\n".join(lines) + "\n")
    sys.stdout.write(RESULT.read_text())


if __name__ == "__main__":
    main()
