"""How near the truth: 60 motions, r = 0.05 to 2.5, through the optoNCDT's noise and step; then ten times the noise.

Run: ``python -m tests.benchmarks.analysis_accuracy``; the result goes to results/analysis_accuracy.txt. Tests of 90 s
at 500 Hz, base amplitude 1.8 mm, all cycles after 20 s. Stops are judged where each lasts at least 2 % of a cycle.
"""

import math
import sys
from pathlib import Path

import numpy as np

from frictionlab.analysis.measure import measure
from frictionlab.inference import predict
from frictionlab.simulator import Motion
from tests.analysis.seen import NOISE_M, recording_of, scene, steady

RATIOS = (0.05, 0.08, 0.1, 0.13, 0.17, 0.2, 0.25, 0.3, 0.42, 0.5, 0.6, 0.7, 0.8, 0.95, 1.1, 1.2, 1.4, 1.7, 2.0, 2.5)
FRICTIONS = (0.1, 0.4, 0.75)
LIMITS = {"r": 1e-5, "energy": 2e-3, "amplitude": 3e-3, "friction": 1e-2, "stops": 0.05, "nrmse": 1e-2}
RESULT = Path(__file__).parent / "results" / "analysis_accuracy.txt"


def shortest_stop(orbit: Motion) -> float:
    """Length of the shortest stop, in cycles; infinite without stops."""
    spans = orbit.stops.tolist()
    if len(spans) > 1 and abs(spans[-1][1] - spans[0][0] - (orbit.end - orbit.start)) < 1e-9:
        spans[-1][1] += spans.pop(0)[1] - orbit.start
    return min((end - begin for begin, end in spans), default=math.inf) / (2 * math.pi)


def errors(r: float, beta: float, noise: float, seed: int) -> dict[str, float]:
    """What is off, each as its limit counts it; stops are nan where some are too short to be told."""
    state, orbit, energy, amplitude = steady(r, beta)
    m = measure(recording_of(r, beta, seed=seed, noise=noise), scene())
    c = predict(m, scene())
    told = shortest_stop(orbit) >= 0.02
    return {
        "r": abs((m.frequency_ratio or math.nan) - r),
        "energy": abs(m.energy_per_cycle / energy - 1),
        "amplitude": abs(m.response_amplitude / amplitude - 1),
        "friction": abs(c.friction_ratio / beta - 1),
        "stops": abs(m.stops_per_cycle - (state.stops_per_cycle or 0.0)) if told else math.nan,
        "nrmse": c.response_nrmse if c.response_nrmse is not None else math.nan,
    }


def table(noise: float) -> list[str]:
    """Worst and median error of each quantity, where the worst is, and what is over its limit."""
    points = [(r, beta) for r in RATIOS for beta in FRICTIONS]
    found = [errors(r, beta, noise, seed) for seed, (r, beta) in enumerate(points)]
    lines = [
        f"noise {1e6 * noise:g} um, {len(points)} motions",
        f"{'quantity':12s}{'limit':>9s}{'median':>10s}{'worst':>10s}  at",
    ]
    for name, limit in LIMITS.items():
        column = np.array([row[name] for row in found])
        worst = int(np.nanargmax(column))
        over = [f"({r:g}, {beta:g})" for (r, beta), value in zip(points, column, strict=True) if value > limit]
        lines.append(
            f"{name:12s}{limit:9.0e}{np.nanmedian(column):10.1e}{column[worst]:10.1e}  r, beta = {points[worst]}"
            + (f"; over the limit: {', '.join(over)}" if over else "")
        )
    return lines


def main() -> None:
    """Write the tables."""
    RESULT.parent.mkdir(exist_ok=True)
    RESULT.write_text("\n".join([*table(NOISE_M), "", *table(10 * NOISE_M)]) + "\n")
    sys.stdout.write(RESULT.read_text())


if __name__ == "__main__":
    main()
