"""An acceleration integrated twice: what is left of it, and what its noise makes of the displacement."""

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ORDER = 8  # of the high-pass: |H| = 1 / (1 + (f_c / f)^8), without a shift of phase
AROUND = 6.0  # periods of the slowest motion kept: so much rest is put before and after the record


def displacement_of(acceleration: FloatArray, rate: float, highpass_hz: float) -> FloatArray:
    """Return the displacement (n,) of evenly sampled accelerations, without what is slower than a frequency.

    Mean and straight line are taken off first; then each frequency is divided by ``-(2 pi f)^2`` and multiplied by the
    high-pass. What a record holds before its start and after its end is not known: rest is put there, and the first and
    last period of the slowest motion kept are doubtful.

    Parameters
    ----------
    acceleration : ndarray of shape (n,)
        m/s^2.
    rate : float
        Samples per second.
    highpass_hz : float

    Examples
    --------
    >>> t = np.arange(4000) / 200.0
    >>> size = np.clip(t / 4, 0, 1) * np.clip((20 - t) / 4, 0, 1)
    >>> y = 1e-3 * size**3 * np.sin(2 * np.pi * 2.0 * t)
    >>> acceleration = np.gradient(np.gradient(y, t), t)
    >>> bool(np.abs(displacement_of(acceleration, 200.0, 0.3) - y).max() < 1e-5)
    True
    """
    n = len(acceleration)
    line = np.polynomial.Polynomial.fit(np.arange(n), acceleration, 1)
    around = math.ceil(AROUND * rate / highpass_hz)
    padded = np.zeros(n + 2 * around)
    padded[around : around + n] = acceleration - line(np.arange(n))
    f = np.asarray(np.fft.rfftfreq(len(padded), 1.0 / rate), dtype=np.float64)
    moved = np.fft.irfft(np.fft.rfft(padded) * -gain(f, highpass_hz), len(padded))
    return np.asarray(moved[around : around + n])


def gain(f: FloatArray, highpass_hz: float) -> FloatArray:
    """Displacement over acceleration, in size, at frequencies f [Hz]: s^2; ``|H| / (2 pi f)^2``."""
    share = f / highpass_hz
    return np.asarray(share ** (ORDER - 2) / (1.0 + share**ORDER) / (2.0 * np.pi * highpass_hz) ** 2)


def noise_of_displacement(noise: float, rate: float, highpass_hz: float) -> float:
    """Return the rms displacement [m] that white noise of an accelerometer [m/s^2 rms a sample] is integrated to."""
    f = np.geomspace(1e-2 * highpass_hz, 0.5 * rate, 4000)
    return math.sqrt(2.0 * noise**2 / rate * float(np.trapezoid(gain(f, highpass_hz) ** 2, f)))
