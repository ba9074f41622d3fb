"""A plan: the tests chosen, what to expect of each, and the order that saves changes, as steps and as a sheet.

``[experiment] sheet`` reads the same file after the tests.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby

from frictionlab.scene import Scene
from frictionlab.schema import PLANS, Result
from frictionlab.uncertainty import NOT_KNOWN, Estimate, Flat


@dataclass(frozen=True)
class PlannedTest:
    """One test of a plan, or a candidate that was not chosen (``rank`` None).

    ``expected``: law parameter -> standard error of this test alone, what a fit calls ``se`` where sensors and rig
    are as they are known; ``expected_u``: the same with what is not known of them; ``cumulative`` and
    ``cumulative_u``: both after this and all better ones, and with friction that differs from test to test.
    ``coefficient``: the friction coefficient with its combined uncertainty as a comparison of this test alone would
    state it, with gains, stiffness and normal force; ``friction_coefficient_u_after``: after all better ones too.

    ``log_bayes``: logarithm of the Bayes factor to expect, from this test alone, for the law over plain Coulomb
    friction, or over the law it is planned against; ``log_bayes_against``: for that law, if it is the one that holds;
    ``log_bayes_after``: for the one of the two that holds after this and all better tests, the lesser of both ways.

    ``laboratory_s``: laboratory time that this test adds; ``total_s``: of the plan so far; ``values``: the law's
    parameters that are to be found, as they are expected in this test; ``told``: whether this test alone does.
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
    coefficient: Estimate = NOT_KNOWN
    friction_coefficient_u_after: float | None = None
    log_bayes: float | None = None
    log_bayes_against: float | None = None
    log_bayes_after: float | None = None

    friction_coefficient = Flat("coefficient")
    friction_coefficient_u = Flat("coefficient", "u")

    def row(self) -> dict[str, object]:
        """The contract's keys: a line of JSON or of a table."""
        return PLANS.row(self)


@dataclass(frozen=True)
class Plan(Result):
    """A plan: ``tests``, best first; ``others``: candidates that were not chosen; ``notes``: what was assumed.

    ``against``: the law from which ``law`` is to be distinguished, if that was asked.
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


def running_order(plan: Plan) -> tuple[PlannedTest, ...]:
    """The tests so that each normal force is set once, and each motion of the base once for it."""
    return tuple(sorted(plan.tests, key=_setting))


def _setting(test: PlannedTest) -> tuple[float, ...]:
    return test.normal_force_n, test.base_amplitude_m, test.frequency_ratio, test.duration_s


def sheet_rows(plan: Plan, scene: Scene) -> list[dict[str, object]]:
    """Return the rows of a sheet: the log's name and the facts of each test, in the order to run them.

    A material that the scene does not name is an empty cell, to be filled in.
    """
    material = scene.experiment.material
    rows: list[dict[str, object]] = []
    for number, test in enumerate(running_order(plan), 1):
        name = f"N{test.normal_force_n:g}_r{test.frequency_ratio:g}_Y{1e3 * test.base_amplitude_m:g}mm"
        rows.append(
            {
                "log": f"{number:02d}_{material or 'test'}_{name}.csv",
                "material": material,
                "normal_force_n": test.normal_force_n,
                "nominal_frequency_ratio": test.frequency_ratio,
                "duration_s": test.duration_s,
                "note": _note(test),
            }
        )
    return rows


def steps(plan: Plan) -> list[str]:
    """Return what to do in the laboratory, a line each, in the order to run the tests."""
    lines = []
    for force, tests in groupby(running_order(plan), key=lambda test: test.normal_force_n):
        lines.append(f"Set a normal force of {force:g} N.")
        for _, same in groupby(tests, key=_setting):
            repeats = list(same)
            *others, last = (str(test.rank) for test in repeats)
            which = f"tests {', '.join(others)} and {last}: record it {len(repeats)} times, each begun anew"
            lines.append(f"  {_note(repeats[0])} ({which if others else f'test {last}'})")
    return lines


def _note(test: PlannedTest) -> str:
    """What to set, and what to expect of the motion."""
    expected = "no steady motion is expected"
    if test.response_m is not None:
        words = {"continuous": "it slides without stops", "stuck": "the mass stands still"}
        moves = words.get(test.regime or "", "it sticks and slips")
        expected = f"the mass should swing {1e3 * test.response_m:.2g} mm to each side; {moves}"
    drive = f"Drive at {test.drive_frequency_hz:.4g} Hz with {1e3 * test.base_amplitude_m:g} mm"
    return f"{drive}, record {test.duration_s:g} s; {expected}"
