"""What each source does to the energy, the amplitude and the base's amplitude of a mean cycle, to first order.

A sensor that bends is a cubic over its measuring range: its error, `linearity` times the range at the ends, changes the
gain of a motion about a place that nobody has noted by up to twice the linearity, and bends the cycle itself by its
swing over the range.
"""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from frictionlab.uncertainty.sources import Sources

FloatArray = NDArray[np.float64]
Shares = Mapping[str, float]
STATISTICAL = "noise and scatter"
BENT_GAIN = 2.0  # a cubic's gain half way to the end of its range, over its error at the end
BENT_CYCLE = 2.0  # a cubic's change of a cycle that fills its range


def combined(shares: Shares) -> float:
    """Combined standard uncertainty: the shares in quadrature.

    Examples
    --------
    >>> combined({"noise and scatter": 3.0, "lag": 4.0})
    5.0
    """
    return math.sqrt(sum(share**2 for share in shares.values()))


def cycle_budget(
    mass: FloatArray, base: FloatArray, sources: Sources, *, turn: float, unit: float
) -> dict[str, Shares]:
    """Return what each source adds to the numbers of a mean cycle, in the numbers' own units.

    Parameters
    ----------
    mass, base : ndarray of shape (p,)
        Mean cycle of x/Y and y/Y on equally spaced phases.
    sources : Sources
    turn : float
        Drive's angular frequency, rad/s.
    unit : float
        Y in m: the base's amplitude.

    Returns
    -------
    dict
        Of ``energy_per_cycle`` (k Y^2), ``response_amplitude`` (Y) and ``base_amplitude_m`` (m): source -> standard
        uncertainty.
    """
    energy = abs(_loop(mass, base))
    amplitude = 0.5 * float(np.ptp(mass))
    bent_mass, bent_base = (_bent(size, sources, unit) for size in (amplitude, 0.5 * float(np.ptp(base))))
    late = abs(_loop(_derivative(mass), base)) * turn * sources.lag
    mixed = 0.5 * abs(float(np.ptp(mass + 1e-6 * base)) - float(np.ptp(mass))) / 1e-6
    return {
        "energy_per_cycle": {
            "gain of the mass sensor": energy * sources.mass_gain,
            "gain of the base sensor": energy * sources.base_gain,
            "linearity of the sensors": energy * math.hypot(bent_mass, bent_base),
            "lag between the channels": late,
        },
        "response_amplitude": {
            "gain of the mass sensor": amplitude * sources.mass_gain,
            "gain of the base sensor": amplitude * sources.base_gain,
            "linearity of the sensors": amplitude * math.hypot(bent_mass, bent_base),
            "crosstalk": math.hypot(mixed, amplitude * _along(mass, base)) * sources.crosstalk,
        },
        "base_amplitude_m": {
            "gain of the base sensor": unit * sources.base_gain,
            "linearity of the sensors": unit * bent_base,
            "crosstalk": unit * abs(_along(mass, base)) * sources.crosstalk,
        },
    }


def _bent(size: float, sources: Sources, unit: float) -> float:
    """Relative uncertainty of a swing (in Y) by a sensor that bends."""
    half_range = 0.5 * sources.measuring_range / unit if sources.measuring_range else 0.0
    filled = min(1.0, size / half_range) if half_range > 0.0 else 1.0
    return sources.linearity * math.hypot(BENT_GAIN * (1.0 - filled), BENT_CYCLE * filled)


def _along(mass: FloatArray, base: FloatArray) -> float:
    """Part of the mass's motion that goes with the base's, over the base's."""
    return float(np.dot(mass, base) / np.dot(base, base))


def _loop(mass: FloatArray, base: FloatArray) -> float:
    """Integral of base d(mass) once round."""
    return float(np.dot(base, _derivative(mass))) * 2.0 * math.pi / len(mass)


def _derivative(cycle: FloatArray) -> FloatArray:
    """Derivative by tau of a cycle on equally spaced phases, by its harmonics."""
    lines = np.fft.rfft(cycle)
    return np.asarray(np.fft.irfft(1j * np.arange(len(lines)) * lines, len(cycle)))
