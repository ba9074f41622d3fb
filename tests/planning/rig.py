"""The laboratory that plans are tested in."""

from collections.abc import Mapping

from frictionlab.scene import Scene, scene_from_tables
from tests.inference.contacts import BASE_M, NATURAL_HZ

STIFFNESS = 1191.0


def scene(tables: Mapping[str, Mapping[str, object]] | None = None, /, **plan: object) -> Scene:
    """A rig that is known exactly, and a plan of twelve candidates unless the caller says otherwise."""
    known: dict[str, Mapping[str, object]] = {
        "rig": {"natural_frequency_hz": NATURAL_HZ, "stiffness_n_per_m": STIFFNESS, "damping_ratio": 0.0},
        "analysis": {"transient_s": 2.0, "cycles": "all"},
        "plan": {
            "frequency_ratios": [0.3, 0.5, 0.8, 1.4],
            "normal_forces_n": [0.5, 1.0, 1.5],
            "base_amplitudes_m": [BASE_M],
            "friction_coefficient": [0.6, 0.1],
            "step_m": 1.02 * 0.05 / 65520,
            **plan,
        },
    }
    return scene_from_tables({**known, **(tables or {})})
