"""How the virtual friction changes while a test runs: drift, a jump, scatter from cycle to cycle, slow wandering."""

import math

import numpy as np
from numpy.typing import NDArray

from frictionlab.scene import Scene
from frictionlab.synthetic.base import wander
from frictionlab.synthetic.rig import VirtualTest

FloatArray = NDArray[np.float64]
HOUR = 3600.0


def cycle_friction_ratios(test: VirtualTest, scene: Scene) -> FloatArray:
    """Friction ratio of each cycle: drift, jump, scatter and wandering as the test's material has them; (cycles,)."""
    cycles = math.ceil(test.duration_s * test.drive_frequency_hz)
    start = np.arange(cycles) / test.drive_frequency_hz
    factor = 1 + test.friction_drift_per_hour * start / HOUR
    if test.jump_s is not None:
        factor = np.where(start >= test.jump_s, test.jump_factor, 1.0) * factor
    if test.friction_scatter:
        factor = factor * (1 + test.friction_scatter * test.draws(scene, "friction").standard_normal(cycles))
    if test.friction_wander:
        step, draws = 1.0 / test.drive_frequency_hz, test.draws(scene, "friction over time")
        factor = factor * (1 + wander(cycles, step, test.friction_wander, test.friction_wander_s or HOUR, draws))
    return test.friction_ratio * np.maximum(factor, 0.0)
