"""Factors between the dimensionless parameters of a law and those in newtons, metres and seconds."""

import math

from frictionlab.scene import Scene
from frictionlab.simulator.laws import Parameter

UNITS = {(1, 1): "m/s", (1, 0): "m", (-1, 0): "1/m"}  # by powers of Y and omega


def to_physical(parameter: Parameter, scene: Scene, *, amplitude: float, turn: float) -> tuple[float | None, str]:
    """Return the factor from a dimensionless parameter to the physical one, and its unit.

    The factor is None where the scene lacks the stiffness or the natural frequency that it needs.

    Parameters
    ----------
    parameter : Parameter
    scene : Scene
        ``[rig]``: stiffness and natural frequency.
    amplitude, turn : float
        Y [m] and omega [rad/s] of the test.

    Examples
    --------
    >>> from frictionlab.scene import Scene
    >>> from frictionlab.simulator.laws import law_of
    >>> to_physical(law_of("coulomb+place").parameter("gradient"), Scene(), amplitude=0.5, turn=1.0)
    (2.0, '1/m')
    """
    rig = scene.rig
    return factor_of(parameter, rig.stiffness, rig.natural_frequency, amplitude=amplitude, turn=turn)


def factor_of(
    parameter: Parameter, stiffness: float | None, frequency: float | None, *, amplitude: float, turn: float
) -> tuple[float | None, str]:
    """As `to_physical`, for a frame of this stiffness (N/m) and natural frequency (Hz)."""
    if parameter.name == "beta":
        return None if stiffness is None else stiffness * amplitude, "N"
    if parameter.name == "stiffness_ratio":
        return stiffness, "N/m"
    if parameter.name == "bristle_damping":  # over k / omega
        return None if stiffness is None else stiffness / turn, "N s/m"
    if parameter.name == "contact_damping_ratio":  # over twice the root of stiffness and mass
        if stiffness is None or not frequency:
            return None, "N s/m"
        return 2.0 * stiffness / (2.0 * math.pi * frequency), "N s/m"
    unit = UNITS.get((parameter.lengths, parameter.rates))
    return (1.0, "") if unit is None else (amplitude**parameter.lengths * turn**parameter.rates, unit)
