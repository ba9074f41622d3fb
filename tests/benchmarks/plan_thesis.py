"""The thesis's own campaign judged: what its 450 tests told, and how much a tenth of them would have told.

Run: ``python -m tests.benchmarks.plan_thesis``; the result goes to results/plan_thesis.txt. The tests are those of
configs/campaign.toml (section 4.2.3): three materials, five normal forces, thirty frequency ratios, of each the last
15 s. Friction and its scatter are those of the virtual rig there; that it differs from test to test as much as from
cycle to cycle is assumed. Nothing of this is measured.
"""

import math
import sys
from pathlib import Path

import numpy as np

from frictionlab.planning import Plan, PlannedTest, plan_tests
from frictionlab.scene import Scene, read_scene, scene_from_tables
from frictionlab.simulator.engine import compiled

RESULT = Path(__file__).parent / "results" / "plan_thesis.txt"
CAMPAIGN = Path(__file__).parents[2] / "configs" / "campaign.toml"
USED_S, TENTH = 15.0, 15
LAWS = ("coulomb", "coulomb+place+speed")
EXPECTED = {"gradient": 0.03, "contact_damping_ratio": 0.03}


def material_scene(campaign: Scene, material: str, *, differs: bool) -> Scene:
    """All short tests of one material as the candidates of a plan."""
    groups = [g for g in campaign.synthetic.tests if g.material == material and g.label == "short"]
    scatter = min(g.friction_scatter for g in groups)
    forces = sorted({force for g in groups for force in g.normal_forces_n})
    ratios = sorted({r for g in groups for r in g.frequency_ratios})
    plan: dict[str, object] = {
        "frequency_ratios": ratios,
        "normal_forces_n": forces,
        "base_amplitudes_m": [campaign.synthetic.base_amplitude_m],
        "duration_s": campaign.analysis.planned_transient_s + USED_S,
        "sampling_rate_hz": campaign.synthetic.sampling_rate_hz,
        "noise_m": campaign.synthetic.noise_m,
        "step_m": campaign.synthetic.step_m,
        "cycle_scatter": scatter,
        "repeatability": scatter if differs else 0.0,
        "friction_coefficient": [groups[0].friction_coefficient, 0.2 * groups[0].friction_coefficient],
        "most_repeats": 1,
        "expected": EXPECTED,
    }
    rig = {"mass_kg": campaign.rig.mass_kg, "stiffness_n_per_m": campaign.rig.stiffness_n_per_m, "damping_ratio": 0.0}
    return scene_from_tables({"rig": rig, "analysis": {"transient_s": campaign.analysis.transient_s}, "plan": plan})


def error(test: PlannedTest, name: str) -> float:
    """Combined uncertainty after a test and all better ones; of friction, in per cent of it."""
    after = (test.cumulative_u or {})[name] or math.nan
    return 100.0 * after / test.values[name] if name == "beta" else after


def judged(campaign: Scene, material: str, law: str, *, differs: bool) -> tuple[list[str], Plan]:
    """Lines of one material under one law, and its plan."""
    what = material_scene(campaign, material, differs=differs)
    every = plan_tests(what, law=law, tests=10_000)
    tenth = plan_tests(what, law=law, tests=TENTH)
    lines = []
    for name in every.tests[0].expected:
        whole, some = error(every.tests[-1], name), error(tenth.tests[-1], name)
        words = {"beta": "friction, %"}.get(name, name)
        lines.append(
            f"{material:8s}{law:21s}{'yes' if differs else 'no':>8s}  {words:22s}{len(every.tests):6d}{whole:10.2g}"
            f"{some:10.2g}{some / whole:7.2f}"
        )
    return lines, tenth


def table(campaign: Scene) -> list[str]:
    """Lines: what all tests tell, what the best tenth tells, how many tell nearly all."""
    lines = [
        f"{'':8s}{'':21s}{'friction':>8s}  {'':22s}{'':6s}{'all':>10s}{'best':>10s}",
        f"{'material':8s}{'law':21s}{'differs':>8s}  {'parameter':22s}{'tests':>6s}{'tell':>10s}{TENTH:>10d}  ratio",
    ]
    where = ["", "The best tenth (frequency ratio and normal force, in the order of the plan), friction that differs:"]
    for material in ("steel", "rubber", "aramid"):
        for law in LAWS:
            for differs in (False, True):
                more, tenth = judged(campaign, material, law, differs=differs)
                lines += more
                sys.stdout.write("\n".join(more) + "\n")
            said = ", ".join(f"{t.frequency_ratio:g} {t.normal_force_n:g} N" for t in tenth.tests)
            where.append(f"{material}, {law}: {said}")
            where.append(f"  below r = 1: {np.mean([t.frequency_ratio < 1 for t in tenth.tests]):.0%}")
    return [*lines, *where]


def main() -> None:
    """Write the table."""
    compiled()
    RESULT.write_text("\n".join(table(read_scene(CAMPAIGN))) + "\n")


if __name__ == "__main__":
    main()
