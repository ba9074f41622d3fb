"""Is the evidence between two laws that a plan promises the evidence that its tests then give?

Run: ``python -m tests.benchmarks.plan_evidence [REPEATS]``; the result goes to results/plan_evidence.txt. Each planned
test is recorded REPEATS times with either law; both laws are fitted to each recording as a ladder fits them, and the
medians of the differences of log evidence stand beside the promise: of each test, and of all tests of a plan together.
"""

import math
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Measurement
from frictionlab.identification.family import family_of
from frictionlab.identification.fit import Fit, fit, log_evidence
from frictionlab.identification.identify import forward_of
from frictionlab.identification.ladder import trial_values
from frictionlab.identification.observed import observe_cycle
from frictionlab.identification.valleys import start_at
from frictionlab.planning import Plan, PlannedTest, plan_tests
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.simulator.engine import compiled
from frictionlab.simulator.laws import law_of
from frictionlab.uncertainty import sources_of
from tests.benchmarks.laboratory import COEFFICIENT, STIFFNESS, laboratory
from tests.identification.contacts import BASE_M, recorded

FloatArray = NDArray[np.float64]
RESULT = Path(__file__).parent / "results" / "plan_evidence.txt"
RATIOS = [0.2, 0.3, 0.4, 0.47, 0.55, 0.7, 0.8, 1.2, 1.5, 1.8]  # at 1/2 a gradient tells very much, in a narrow band
FORCES = [0.5, 1.0, 1.5]
NEAR = 1.3  # asked: promised over achieved, or its inverse
TESTS = 2  # of each plan
PLACE, SPEED, BREAK = "coulomb+place", "coulomb+speed", "coulomb+breakaway"


@dataclass(frozen=True)
class Case:
    """Two laws in one laboratory; ``expected``: values of their parameters; ``plan``: keys of ``[plan]``."""

    law: str
    against: str
    expected: Mapping[str, float]
    plan: Mapping[str, object] = field(default_factory=dict)


POOR = {"noise_m": 20e-6, "duration_s": 20.0, "cycle_scatter": 0.01}
CASES = (
    Case(PLACE, SPEED, {"gradient": 3e-4, "contact_damping_ratio": 1e-4}, POOR),
    Case(PLACE, SPEED, {"gradient": 1e-3, "contact_damping_ratio": 3e-4}, POOR),
    Case(PLACE, SPEED, {"gradient": 0.01, "contact_damping_ratio": 0.01}),
    Case(PLACE, SPEED, {"gradient": 0.01, "contact_damping_ratio": 0.01}, {"duration_s": 10.0, "cycle_scatter": 0.01}),
    Case("coulomb", PLACE, {"gradient": 2e-4}, {"cycle_scatter": 0.01}),
    Case("coulomb", SPEED, {"contact_damping_ratio": 2e-4}, {"cycle_scatter": 0.01, "duration_s": 30.0}),
    Case("coulomb", BREAK, {"static_ratio_up": 1.05, "static_ratio_down": 1.05}, {"duration_s": 30.0}),
    Case(SPEED, BREAK, {"contact_damping_ratio": 0.01, "static_ratio_up": 1.1, "static_ratio_down": 1.1}),
    Case(PLACE, BREAK, {"gradient": 0.03, "static_ratio_up": 1.1, "static_ratio_down": 1.1}, {"duration_s": 20.0}),
    Case("coulomb+place+speed", SPEED, {"gradient": 1e-3, "contact_damping_ratio": 0.02}, {"duration_s": 20.0}),
)


def rig(case: Case) -> Scene:
    """The laboratory, and what it may set."""
    ranges = {"frequency_ratios": RATIOS, "normal_forces_n": FORCES, "most_repeats": 1}
    return laboratory({**ranges, "expected": case.expected, **case.plan})


def planned(case: Case) -> Plan:
    """The plan that a case asks for."""
    return plan_tests(rig(case), law=case.law, against=case.against, tests=TESTS)


def log_bayes(case: Case, test: PlannedTest, law: str, seed: int, of: int) -> float:
    """Difference of log evidence for the law that holds, of one recording of a test."""
    what, other = rig(case), case.against if law == case.law else case.law
    measured = measure(_recorded(case, what, test, law, seed, of), what)
    fits = {name: _fitted(case, measured, what, name, test.normal_force_n) for name in (law, other)}
    return log_evidence(fits[law]) - log_evidence(fits[other])


def _recorded(case: Case, what: Scene, test: PlannedTest, law: str, seed: int, of: int) -> Recording:
    beta = COEFFICIENT * test.normal_force_n / (STIFFNESS * BASE_M)
    generator = np.random.default_rng([37, seed, round(1e3 * test.frequency_ratio), round(1e3 * beta), len(law)])
    start, change = 2.0 * math.pi * np.array([generator.random(), (seed + generator.random()) / of])
    own = {name: value for name, value in case.expected.items() if name in _names(law)}
    return recorded(
        Problem(test.frequency_ratio, beta, law=law, parameters=own),
        generator,
        scatter=what.plan.cycle_scatter,
        seconds=test.duration_s,
        noise=what.plan.noise_m,
        start=start,
        change=change,
    )


def _names(law: str) -> set[str]:
    return {p.name for p in law_of(law).own}


def _fitted(case: Case, measured: Measurement, what: Scene, law: str, force: float) -> Fit:
    """The best fit of a law: its further terms begin where they do nothing, where they are expected, and at trials."""
    observed, sources = observe_cycle(measured), sources_of(what, what.plan.sampling_rate_hz)
    forward = forward_of(family_of(measured, what, law), measured, sources, observed)
    beta = COEFFICIENT * force / (STIFFNESS * BASE_M)
    new = [c for c in forward.coordinates if c.law and c.name != "beta"]
    trials = trial_values(new)[:2] if new else []
    expected = {c.name: case.expected[c.name] for c in new}
    rest = {c.name: c.value(max(c.low, 0.0)) for c in new}
    starts = [start_at(forward, {"beta": beta, **values}) for values in (rest, expected, *trials)]
    return min((fit(forward, observed, [s], excess=1.0) for s in starts), key=lambda f: f.cost)


def lines_of(case: Case, repeats: int) -> list[str]:
    """Promise and achievement of one plan, both ways: of each test, and of all together."""
    found, lines = planned(case), []
    for law in (case.law, case.against):
        promises = [(t.log_bayes if law == case.law else t.log_bayes_against) or math.nan for t in found.tests]
        got = np.array([[log_bayes(case, t, law, seed, repeats) for seed in range(repeats)] for t in found.tests])
        names = [f"{t.frequency_ratio:g}, {t.normal_force_n:g} N" for t in found.tests]
        rows = [*zip(names, promises, got, strict=True), ("both", math.fsum(promises), got.sum(axis=0))]
        lines += [_line(case, law, *row) for row in rows]
    return lines


def _line(case: Case, law: str, test: str, promise: float, got: FloatArray) -> str:
    low, middle, high = np.quantile(got, [0.1, 0.5, 0.9])
    both = f"{law} holds, not {case.against if law == case.law else case.law}"
    return f"{both:58s}{test:14s}{promise:11.3g}{middle:11.3g}{promise / middle:8.2f}   {low:.3g} to {high:.3g}"


HEAD = f"{'':58s}{'test':14s}{'promised':>11s}{'achieved':>11s}{'ratio':>8s}   8 of 10 recordings"


def summary(lines: list[str]) -> str:
    """How many promises of sets that decide hold."""
    both = [line for line in lines if line[58:].startswith("both")]
    told = [float(line[94:102]) for line in both if float(line[83:94]) > 5.0]
    inside = sum(1.0 / NEAR <= ratio <= NEAR for ratio in told)
    return (
        f"{inside} of {len(told)} sets that decide within {1 / NEAR:.2f} to {NEAR:g}; median {np.median(told):.2f},"
        f" from {min(told):.2f} to {max(told):.2f}"
    )


def main(repeats: int, cases: tuple[Case, ...] = CASES) -> None:
    """Write the table."""
    compiled()
    begin, lines = time.process_time(), []
    for case in cases:
        lines += lines_of(case, repeats)
        sys.stdout.write("\n".join(lines[-6:]) + "\n")
        sys.stdout.flush()
    if len(cases) == len(CASES):
        head = f"{repeats} recordings a test and law: medians of the difference of log evidence"
        cost = f"{time.process_time() - begin:.0f} CPU s"
        RESULT.write_text("\n".join([head, HEAD, *lines, "", summary(lines), cost]) + "\n")


if __name__ == "__main__":
    some = CASES[int(sys.argv[2]) : int(sys.argv[3])] if len(sys.argv) > 3 else CASES
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 8, some)
