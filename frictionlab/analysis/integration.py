"""A displacement from an acceleration, integrated in the frequency domain; a motion without its sensor's noise.

The latter is the smoothing spline that is expected to be nearest to it.
"""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

FloatArray = NDArray[np.float64]
SMOOTHEST, ROUGHEST = 1e10, 1e-3  # penalties between which the best is looked for: beyond, doubles do not do
COARSE, FINE = 8.0, 2.0  # factors between the penalties tried, first and then beside the best
HIGH_PASS = 8  # of the high-pass: |H| = 1 / (1 + (f_c / f)^8), without a shift of phase
AROUND = 6.0  # periods of the slowest motion kept: so much rest is put before and after the record
ORDER = 4  # of the differences that a spline keeps small


def denoised(signal: FloatArray, noise: float) -> FloatArray:
    """Return the smooth curve behind evenly sampled values: a discrete smoothing spline of seventh degree.

    It minimises ``sum (y - s)^2 + p sum (fourth difference of s)^2`` [Whittaker 1923; Eilers 2003], with the penalty of
    `best_penalty`.

    Parameters
    ----------
    signal : ndarray of shape (n,)
    noise : float
        Rms of the sensor's white noise; 0: the signal is returned as it is.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> truth = np.cos(2 * np.pi * np.arange(5000) / 250)
    >>> curve = denoised(truth + 1e-3 * rng.standard_normal(5000), 1e-3)
    >>> bool(np.std(curve - truth) < 3e-4)
    True
    """
    penalty = best_penalty(signal, noise)
    return spline(signal, penalty) if penalty else signal


def best_penalty(signal: FloatArray, noise: float) -> float:
    """Return the penalty whose curve is expected to be nearest to the truth; 0 where no smoothing helps.

    The expected square of its error is ``mean (y - s)^2 - noise^2 + 2 noise^2 mean H`` (Stein 1981), with
    ``H = 1 / (1 + p (2 sin(w / 2))^8)`` the curve's gain at frequency w; noise^2 without any smoothing.
    """
    if not noise > 0.0 or len(signal) < 8:
        return 0.0

    def risk(penalty: float) -> float:
        return float(np.mean((signal - spline(signal, penalty)) ** 2)) / noise**2 - 1.0 + 2.0 * gain_kept(penalty)

    least, best, penalty = 1.0, 0.0, SMOOTHEST
    while penalty > ROUGHEST:
        here = risk(penalty)
        if here < least:
            least, best = here, penalty
        elif best:
            break
        penalty /= COARSE
    beside = [best * FINE**k for k in (-2, -1, 1, 2)] if best else []
    return min(((least, best), *((risk(p), p) for p in beside)))[1]


def spline(signal: FloatArray, penalty: float) -> FloatArray:
    """Return the curve of a penalty: the normal equations, unit plus penalty times D'D, as a band of seven."""
    n = len(signal)
    weights = np.array([(-1) ** k * math.comb(ORDER, k) for k in range(ORDER + 1)], dtype=np.float64)
    bands = np.zeros((ORDER + 1, n))
    for lag in range(ORDER + 1):
        for k in range(ORDER + 1 - lag):
            first = k + lag  # row of the upper band, column j = i + lag, i = k, k + 1, ..., k + n - 1 - ORDER
            bands[ORDER - lag, first : first + n - ORDER] += penalty * weights[k] * weights[k + lag]
    bands[ORDER] += 1.0
    return np.asarray(solveh_banded(bands, signal, overwrite_ab=True, check_finite=False))


def gain_kept(penalty: float) -> float:
    """Mean of the curve's gain over all frequencies: the share of white noise's freedom that it keeps."""
    w = np.pi * (np.arange(4096) + 0.5) / 4096
    # the cut-off may be far below the grid: frequencies are taken evenly in the logarithm there
    w = np.concatenate([np.geomspace(1e-6, w[0], 2000), w[1:]])
    gain = 1.0 / (1.0 + penalty * (2.0 * np.sin(0.5 * w)) ** (2 * ORDER))
    return float(np.trapezoid(gain, w) / np.pi)


def integrated(signal: FloatArray, rate: float, highpass_hz: float, *, times: int = 2) -> FloatArray:
    """Return an evenly sampled signal (n,) integrated over time, without what is slower than a frequency.

    Mean and straight line are taken off first; then each frequency is divided by ``2 pi i f`` once or twice and
    multiplied by the high-pass. What a record holds before its start and after its end is not known: rest is put there,
    and the first and last period of the slowest motion kept are doubtful.

    Parameters
    ----------
    signal : ndarray of shape (n,)
        Such as an acceleration, m/s^2.
    rate : float
        Samples per second.
    highpass_hz : float
    times : int
        1: a displacement from a velocity; 2: from an acceleration.

    Examples
    --------
    >>> t = np.arange(4000) / 200.0
    >>> size = np.clip(t / 4, 0, 1) * np.clip((20 - t) / 4, 0, 1)
    >>> y = 1e-3 * size**3 * np.sin(2 * np.pi * 2.0 * t)
    >>> acceleration = np.gradient(np.gradient(y, t), t)
    >>> bool(np.abs(integrated(acceleration, 200.0, 0.3) - y).max() < 1e-5)
    True
    """
    n = len(signal)
    line = np.polynomial.Polynomial.fit(np.arange(n), signal, 1)
    around = math.ceil(AROUND * rate / highpass_hz)
    padded = np.zeros(n + 2 * around)
    padded[around : around + n] = signal - line(np.arange(n))
    f = np.asarray(np.fft.rfftfreq(len(padded), 1.0 / rate), dtype=np.float64)
    moved = np.fft.irfft(np.fft.rfft(padded) * (-1j) ** times * gain(f, highpass_hz, times), len(padded))
    return np.asarray(moved[around : around + n])


def gain(f: FloatArray, highpass_hz: float, times: int = 2) -> FloatArray:
    """Size of the integral over that of the signal at frequencies f [Hz]: ``|H| / (2 pi f)^times``."""
    share = f / highpass_hz
    return np.asarray(share ** (HIGH_PASS - times) / (1.0 + share**HIGH_PASS) / (2.0 * np.pi * highpass_hz) ** times)


def integrated_noise(noise: float, rate: float, highpass_hz: float, *, times: int = 2) -> float:
    """Return the rms that white noise of a sensor (rms of a sample) is integrated to."""
    f = np.geomspace(1e-2 * highpass_hz, 0.5 * rate, 4000)
    return math.sqrt(2.0 * noise**2 / rate * float(np.trapezoid(gain(f, highpass_hz, times) ** 2, f)))
