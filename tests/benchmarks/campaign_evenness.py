"""Are the p-values of equal tests even? Groups of tests whose friction is the same, one material at one force each.

Run: ``python -m tests.benchmarks.campaign_evenness [GROUPS] [FIRST SEED]``; the result goes to
results/campaign_evenness.txt. Each line has so many groups of ten tests, at frequency ratios and phases (at which
friction changes in each cycle) drawn anew, of a rig that is as its scene declares: sensors are exact but for noise.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import stats

from frictionlab.analysis.measure import measure
from frictionlab.campaign import cycle_of
from frictionlab.campaign.joined import join
from frictionlab.simulator import Problem
from frictionlab.simulator.laws import law_of
from tests.identification.contacts import NATURAL_HZ, recorded, scene

RESULT = Path(__file__).parent / "results" / "campaign_evenness.txt"
TESTS = 10
GROUP = ("steel", 1.0)


@dataclass(frozen=True)
class Case:
    """Scatter of friction from cycle to cycle, length of a test (s), the range of its frequency ratio."""

    scatter: float
    seconds: float
    ratios: tuple[float, float]

    def __str__(self) -> str:
        low, high = self.ratios
        return f"scatter {100 * self.scatter:4g} %, {self.seconds:g} s, r {low:g} to {high:g}"


CASES = (
    Case(0.0, 40.0, (0.25, 0.85)),
    Case(0.003, 40.0, (0.25, 0.85)),
    Case(0.003, 40.0, (1.2, 2.2)),
    Case(0.02, 40.0, (0.25, 0.85)),
    Case(0.02, 90.0, (1.2, 2.2)),
    Case(0.02, 70.0, (0.06, 0.2)),
)


def p_of(case: Case, seed: int, number: int) -> float:
    """The p-value of one group of equal tests."""
    generator = np.random.default_rng([20261122, seed, number])
    known = scene(sensors={"gain_error": 1e-6, "lag_s_u": 1e-7, "linearity": 0.0}, rig={"natural_frequency_hz_u": 1e-6})
    cycles = []
    for i in range(TESTS):
        seen = recorded(
            Problem(float(generator.uniform(*case.ratios)), 0.36),
            generator,
            scatter=case.scatter,
            seconds=case.seconds,
            change=float(generator.uniform(0.0, 2.0 * np.pi)),
            start=float(generator.uniform(0.0, 2.0 * np.pi)),
        )
        cycles.append(cycle_of(f"{i}", GROUP, measure(seen, known), known))
    p = join(cycles, law_of("coulomb"), {}, {GROUP: 0.36}).evenness(GROUP)[2]
    return 1.0 if p is None else p


def line(name: str, values: list[float]) -> str:
    """One line of the table."""
    p = np.array(values)
    low = ", ".join(f"{int((p < level).sum())} below {level}" for level in (0.01, 0.05))
    rest = ", ".join(f"{np.mean(p < level):.0%} below {level}" for level in (0.25, 0.5, 0.75))
    return f"{name:40s} {len(p):4d} groups: {low}; {rest}; Kolmogorov-Smirnov {stats.kstest(p, 'uniform').pvalue:.2g}"


def main() -> None:
    """Draw the groups and write the table."""
    groups, first = (int(sys.argv[i]) if len(sys.argv) > i else default for i, default in ((1, 100), (2, 0)))
    found = [[p_of(case, seed, number) for seed in range(first, first + groups)] for number, case in enumerate(CASES)]
    lines = [
        f"{TESTS} tests a group, seeds {first} to {first + groups - 1}, natural frequency {NATURAL_HZ} Hz",
        *(line(str(case), values) for case, values in zip(CASES, found, strict=True)),
        line("all", [p for values in found for p in values]),
    ]
    RESULT.write_text("\n".join(lines) + "\n", encoding="utf-8")
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
