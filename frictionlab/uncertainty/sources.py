"""The sources of uncertainty of one test: what a scene declares, and stated defaults for the rest, never zero."""

import math
from dataclasses import dataclass

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
    the two channels; ``linearity``: share of a sensor's measuring range; ``measuring_range``: that range in m, None
    where it is not known; ``damping_ratio``: of the frame; ``crosstalk``: share of one channel in the other.
    ``assumed``: scene keys of those that nobody has declared.
    """

    mass_gain: float
    base_gain: float
    linearity: float
    measuring_range: float | None
    lag: float
    crosstalk: float
    natural_frequency: float
    damping_ratio: float
    stiffness: float
    normal_force: float
    assumed: tuple[str, ...] = ()

    @property
    def gain(self) -> float:
        """Relative uncertainty of the mass sensor's gain over the base's."""
        return math.hypot(self.mass_gain, self.base_gain)


def sources_of(
    scene: Scene, sampling_rate_hz: float, *, normal_force_n: float | None = None, lag_s_u: float | None = None
) -> Sources:
    """Return what is known of one test.

    Parameters
    ----------
    scene : Scene
        ``[sensors]``, and the ``_u`` keys of ``[rig]`` and ``[experiment]``.
    sampling_rate_hz : float
        Two channels that are not said to be sampled together may be apart by half a sampling interval either way.
    normal_force_n : float, optional
        Of this test.
    lag_s_u : float, optional
        Standard uncertainty of the alignment of two logs, as their recording has it; a scene's own wins.
    """
    sensors, rig = scene.sensors, scene.rig
    lag = lag_s_u if sensors.lag_s_u is None else sensors.lag_s_u
    frequency = _relative(rig.natural_frequency_hz_u, rig.natural_frequency)
    damping = UNKNOWN_DAMPING if rig.damping_ratio is None else DAMPING * rig.damping_ratio
    stiffness = _relative(rig.stiffness_n_per_m_u, rig.stiffness)
    normal = _relative(scene.experiment.normal_force_n_u, normal_force_n or scene.experiment.normal_force_n)
    declared = {
        "sensors.lag_s_u": lag,
        "rig.natural_frequency_hz_u": frequency,
        "rig.damping_ratio_u": rig.damping_ratio_u,
        "rig.stiffness_n_per_m_u": stiffness,
        "experiment.normal_force_n_u": normal,
    }
    return Sources(
        mass_gain=sensors.gain_error,
        base_gain=sensors.gain_error,
        linearity=sensors.linearity,
        measuring_range=scene.log.measuring_range_m,
        lag=0.5 / sampling_rate_hz / math.sqrt(3.0) if lag is None else lag,
        crosstalk=sensors.crosstalk,
        natural_frequency=NATURAL_FREQUENCY if frequency is None else frequency,
        damping_ratio=damping if rig.damping_ratio_u is None else rig.damping_ratio_u,
        stiffness=STIFFNESS if stiffness is None else stiffness,
        normal_force=NORMAL_FORCE if normal is None else normal,
        assumed=tuple(name for name, value in declared.items() if value is None),
    )


def _relative(uncertainty: float | None, value: float | None) -> float | None:
    return None if uncertainty is None or not value else uncertainty / value
