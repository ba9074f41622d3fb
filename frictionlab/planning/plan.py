"""A plan: the tests chosen, with what to expect of each."""

from collections.abc import Mapping
from dataclasses import dataclass

from frictionlab.schema import PLANS
from frictionlab.schema.result import Result


@dataclass(frozen=True)
class PlannedTest:
    """One test of a plan, or a candidate that was not chosen (``rank`` None).

    ``expected``: law parameter -> standard error of this test alone, what a fit calls ``se`` where sensors and rig
    are as they are known; ``expected_u``: the same with what is not known of them; ``cumulative`` and
    ``cumulative_u``: both after this and all better ones, and with friction that differs from test to test. The
    friction coefficient is told as ``beta`` of this test.

    ``log_bayes``: logarithm of the Bayes factor to expect, from this test alone, for the law over plain Coulomb
    friction, or over the law it is to be told from; ``log_bayes_against``: for that law, if it is the one that holds;
    ``log_bayes_after``: for the one of the two that holds after this and all better tests, the lesser of both ways.

    ``laboratory_s``: laboratory time that this test adds; ``total_s``: of the plan so far; ``values``: the law's
    parameters that are to be found, as they are expected in this test; ``told``: whether this test alone tells them.
    """

    rank: int | None
    frequency_ratio: float
    normal_force_n: float
    base_amplitude_m: float
    duration_s: float
    regime: str | None
    response_m: float | None
    expected: Mapping[str, float | None]
    expected_u: Mapping[str, float | None]
    cumulative: Mapping[str, float | None] | None
    cumulative_u: Mapping[str, float | None] | None
    laboratory_s: float
    total_s: float | None
    drive_frequency_hz: float
    values: Mapping[str, float]
    told: Mapping[str, bool]
    log_bayes: float | None = None
    log_bayes_against: float | None = None
    log_bayes_after: float | None = None

    def row(self) -> dict[str, object]:
        """The contract's keys: a line of JSON or of a table."""
        return PLANS.row(self)


@dataclass(frozen=True)
class Plan(Result):
    """A plan: ``tests``, best first; ``others``: candidates that were not chosen; ``notes``: what was assumed.

    ``against``: the law from which ``law`` is to be told, if that was asked.
    """

    law: str
    against: str | None
    tests: tuple[PlannedTest, ...]
    others: tuple[PlannedTest, ...]
    notes: tuple[str, ...]

    def rows(self) -> list[dict[str, object]]:
        """One row for each test chosen, best first."""
        return [test.row() for test in self.tests]

    def __repr__(self) -> str:
        apart = "" if self.against is None else f" against {self.against}"
        first = [f"r = {t.frequency_ratio:g} at {t.normal_force_n:g} N" for t in self.tests[:3]]
        more = ", ..." if len(self.tests) > len(first) else ""
        return f"<Plan {self.law}{apart}: {len(self.tests)} tests, {', '.join(first)}{more}>"
