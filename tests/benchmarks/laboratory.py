"""The laboratory whose tests the benchmarks of `plan` plan and make: its rig, its sensors, its contact."""

from collections.abc import Mapping

from frictionlab.scene import Scene, scene_from_tables
from tests.inference.contacts import BASE_M, NATURAL_HZ

STIFFNESS, COEFFICIENT = 1191.0, 0.6
STEP_M = 1.02 * 0.05 / 65520  # of the sensors
KNOWN = {"rig": {"natural_frequency_hz_u": 3e-4}, "sensors": {"lag_s_u": 1e-5}}


def laboratory(plan: Mapping[str, object], *, law: str = "coulomb", declared: bool = True) -> Scene:
    """A rig with its keys of ``[plan]``; ``declared``: whether it says how sure natural frequency and lag are."""
    known = KNOWN if declared else {"rig": {}, "sensors": {}}
    rig = {"natural_frequency_hz": NATURAL_HZ, "stiffness_n_per_m": STIFFNESS, "damping_ratio": 0.0}
    basic = {"base_amplitudes_m": [BASE_M], "friction_coefficient": [COEFFICIENT, 0.1], "step_m": STEP_M}
    return scene_from_tables(
        {
            "rig": {**rig, **known["rig"]},
            "sensors": known["sensors"],
            "model": {"law": law},
            "analysis": {"transient_s": 2.0, "cycles": "all"},
            "plan": {**basic, **plan},
        }
    )
