"""The friction ratio read off the loop: where a fit begins.

``E = beta * path`` for any Coulomb steady state (friction work is the friction force times the distance slid), which is
``beta = E / (4 X)`` for cycles with two turning points, eq. (2.23).
"""

import math

import numpy as np

from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import AnalysisError
from frictionlab.simulator.problem import Wall


def loop_friction_ratio(measurement: Measurement, wall: Wall = "fixed") -> float:
    """Friction ratio as energy over the path slid.

    With a wall that moves with the base the path is that of mass over base, and the force that drives it r^2 times.

    Raises
    ------
    AnalysisError
        The mass stands still, or takes in no energy.
    """
    if measurement.regime == "stuck":
        raise AnalysisError(
            "no friction ratio: the mass stands still, which tells only that friction is at least the spring's force:"
            " measure with less normal force or more base amplitude"
        )
    if not measurement.energy_per_cycle > 0.0:
        raise AnalysisError(
            f"no friction ratio: the loop's energy is {measurement.energy_per_cycle:.3g} k Y^2; expected more than 0:"
            " are the columns of mass and base the right way round?"
        )
    cycle, slid, force = measurement.cycle, measurement.cycle.mass_smooth, 1.0
    if wall == "base":
        order = np.arange(1, len(cycle.base_cosine) + 1)
        phase = np.outer(cycle.tau, order)
        slid = slid - np.cos(phase) @ cycle.base_cosine - np.sin(phase) @ cycle.base_sine
        force = (measurement.frequency_ratio or math.nan) ** 2
    path = float(np.abs(np.diff(slid, append=slid[:1])).sum())
    return force * measurement.energy_per_cycle / path
