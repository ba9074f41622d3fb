"""The force of the contact recovered from the motion: no law assumed."""

import math

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measurement import Measurement

FloatArray = NDArray[np.float64]
FADE = 25.0  # harmonics above this fade out: noise times k^2 rules there


def contact_force(measurement: Measurement, frame_damping_ratio: float = 0.0) -> FloatArray:
    """Force of the contact on the mass over the measured cycle: what the equation of motion leaves for it.

    ``n = y - x - 2 zeta_f r (x' - y') - r^2 x''`` of the mean cycle without its noise.

    Parameters
    ----------
    measurement : Measurement
        With a frequency ratio.
    frame_damping_ratio : float
        Of the frame's own dashpot.

    Returns
    -------
    ndarray of shape (p,)
        Over k Y, at the phases of ``measurement.cycle.tau``; positive against a motion in the positive direction.
    """
    cycle, r = measurement.cycle, measurement.frequency_ratio or math.nan
    mass, base = np.fft.rfft(cycle.mass_smooth), np.fft.rfft(cycle.base)
    k = np.arange(len(mass))
    fade = np.exp(-((k / FADE) ** 2))
    dashpot = 2.0j * frame_damping_ratio * r * k
    force = base * (1.0 + dashpot) - mass * (1.0 + dashpot - (r * k) ** 2)
    return np.asarray(np.fft.irfft(fade * force, len(cycle.tau)))
