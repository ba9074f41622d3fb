"""A plan for the laboratory: the order that saves changes, in words, and a sheet with a line and a log's name for each.

``[experiment] sheet`` reads the same file after the tests.
"""

from itertools import groupby

from frictionlab.planning.plan import Plan, PlannedTest
from frictionlab.scene import Scene


def running_order(plan: Plan) -> tuple[PlannedTest, ...]:
    """The tests so that each normal force is set once, and each motion of the base once for it."""
    return tuple(sorted(plan.tests, key=_setting))


def _setting(test: PlannedTest) -> tuple[float, ...]:
    return test.normal_force_n, test.base_amplitude_m, test.frequency_ratio, test.duration_s


def sheet_rows(plan: Plan, scene: Scene) -> list[dict[str, object]]:
    """Return the rows of a sheet: the log's name and the facts of each test, in the order to run them."""
    material = scene.experiment.material or "contact"
    rows: list[dict[str, object]] = []
    for number, test in enumerate(running_order(plan), 1):
        name = f"{material}_N{test.normal_force_n:g}_r{test.frequency_ratio:g}_Y{1e3 * test.base_amplitude_m:g}mm"
        rows.append(
            {
                "log": f"{number:02d}_{name}.csv",
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
            lines.append(f"  {_note(repeats[0])} ({_which([str(test.rank) for test in repeats])})")
    return lines


def _which(ranks: list[str]) -> str:
    """Ranks in words: of one test, or of one that is run several times."""
    if len(ranks) == 1:
        return f"test {ranks[0]}"
    return f"tests {', '.join(ranks[:-1])} and {ranks[-1]}: record it {len(ranks)} times, each begun anew"


def _note(test: PlannedTest) -> str:
    return (
        f"Drive at {test.drive_frequency_hz:.4g} Hz with {1e3 * test.base_amplitude_m:g} mm, record {test.duration_s:g}"
        f" s; {_expect(test)}"
    )


def _expect(test: PlannedTest) -> str:
    """What to expect of the motion, in words."""
    if test.response_m is None:
        return "no steady motion is expected"
    words = {"continuous": "it slides without stops", "stuck": "the mass stands still"}
    moves = words.get(test.regime or "", "it sticks and slips")
    return f"the mass should swing {1e3 * test.response_m:.2g} mm to each side; {moves}"
