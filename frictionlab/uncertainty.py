"""What a laboratory knows of its sensors, clock and rig, as standard uncertainties (GUM, JCGM 100: type B).

A scene declares them (``[sensors]``, ``_u`` keys of ``[rig]`` and ``[experiment]``). What it leaves out gets
the default that stands here, never zero.
"""

import math
from dataclasses import dataclass

from frictionlab.analysis.measurement import Measurement
from frictionlab.scene import Scene

NATURAL_FREQUENCY = 0.002  # relative: two publications of one frame say 3.115 and 3.130 Hz
DAMPING = 0.1  # relative: of a damping ratio that is given without its uncertainty
UNKNOWN_DAMPING = 0.005  # of a frame whose damping ratio nobody has measured
STIFFNESS = 0.005  # relative
NORMAL_FORCE = 0.01  # relative


@dataclass(frozen=True)
class Sources:
    """Standard uncertainties of one test, each of one cause.

    ``mass_gain``, ``base_gain``, ``natural_frequency``, ``stiffness``, ``normal_force``: relative; ``lag``: s between
    the two channels; ``linearity``: share of a sensor's range; ``damping_ratio``: of the frame; ``crosstalk``: share of
    one channel in the other. ``assumed``: those that the scene does not declare.
    """

    mass_gain: float
    base_gain: float
    linearity: float
    lag: float
    crosstalk: float
    natural_frequency: float
    damping_ratio: float
    stiffness: float
    normal_force: float
    assumed: tuple[str, ...] = ()


def sources_of(measurement: Measurement, scene: Scene) -> Sources:
    """Return what a scene declares of one test, with the stated defaults for the rest."""
    sensors, rig = scene.sensors, scene.rig
    half_step = 0.5 / measurement.sampling_rate_hz / math.sqrt(3.0)
    frequency, damping = _relative(rig.natural_frequency_hz_u, rig.natural_frequency), rig.damping_ratio_u
    unknown = UNKNOWN_DAMPING if rig.damping_ratio is None else DAMPING * rig.damping_ratio
    normal = _relative(scene.experiment.normal_force_n_u, measurement.normal_force_n)
    stiffness = _relative(rig.stiffness_n_per_m_u, rig.stiffness)
    assumed = {
        "sensors.lag_s_u": sensors.lag_s_u,
        "rig.natural_frequency_hz_u": frequency,
        "rig.damping_ratio_u": damping,
        "rig.stiffness_n_per_m_u": stiffness,
        "experiment.normal_force_n_u": normal,
    }
    return Sources(
        mass_gain=sensors.gain_error,
        base_gain=sensors.gain_error,
        linearity=sensors.linearity,
        lag=half_step if sensors.lag_s_u is None else sensors.lag_s_u,
        crosstalk=sensors.crosstalk,
        natural_frequency=NATURAL_FREQUENCY if frequency is None else frequency,
        damping_ratio=unknown if damping is None else damping,
        stiffness=STIFFNESS if stiffness is None else stiffness,
        normal_force=NORMAL_FORCE if normal is None else normal,
        assumed=tuple(name for name, value in assumed.items() if value is None),
    )


def _relative(uncertainty: float | None, value: float | None) -> float | None:
    return None if uncertainty is None or not value else uncertainty / value
