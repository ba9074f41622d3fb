"""A plan as a sheet for the laboratory: one line a test, with the name its log should have.

``[experiment] sheet`` reads the same file after the tests.
"""

from frictionlab.planning.plan import Plan
from frictionlab.scene import Scene


def sheet_rows(plan: Plan, scene: Scene) -> list[dict[str, object]]:
    """Return the rows of a sheet: the log's name and the facts of each test, in the order of the plan."""
    material = scene.experiment.material or "contact"
    rows: list[dict[str, object]] = []
    for test in plan.tests:
        name = f"{material}_N{test.normal_force_n:g}_r{test.frequency_ratio:g}_Y{1e3 * test.base_amplitude_m:g}mm"
        rows.append(
            {
                "log": f"{test.rank:02d}_{name}.csv",
                "material": material,
                "normal_force_n": test.normal_force_n,
                "nominal_frequency_ratio": test.frequency_ratio,
                "duration_s": test.duration_s,
                "note": f"base amplitude {1e3 * test.base_amplitude_m:g} mm; expect {test.regime}",
            }
        )
    return rows
