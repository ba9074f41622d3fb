"""A smooth motion without its sensor's noise: the smoothest curve that leaves no more than the noise behind."""

import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

FloatArray = NDArray[np.float64]
SMOOTHEST, FACTOR = 1e10, 8.0  # penalties are tried from here (beyond, doubles do not do) downwards, by this factor
BIAS = 0.05  # share of the noise's power up to which the curve may be wrong
ORDER = 3


def denoised(signal: FloatArray, noise: float) -> FloatArray:
    """Return the smooth curve behind evenly sampled values: a discrete smoothing spline of fifth degree.

    It minimises ``sum (y - s)^2 + p sum (third difference of s)^2`` [Whittaker 1923; Eilers 2003]. The penalty p is the
    largest one whose residual is still what noise alone would leave, ``noise^2`` times the mean of (1 - H)^2 with
    H = 1 / (1 + p (2 sin(w / 2))^6) the curve's gain at frequency w.

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
    if not noise > 0.0 or len(signal) < 8:
        return signal
    penalty = SMOOTHEST
    while penalty > 1e-3:
        curve = _curve(signal, penalty)
        if float(np.mean((signal - curve) ** 2)) <= (1.0 + BIAS) * noise**2 * _left(penalty):
            return curve
        penalty /= FACTOR
    return signal


def _curve(signal: FloatArray, penalty: float) -> FloatArray:
    """Solve the normal equations: unit plus penalty times D'D, D the third differences, as a band of seven."""
    n = len(signal)
    weights = np.array([(-1) ** k * math.comb(ORDER, k) for k in range(ORDER + 1)], dtype=np.float64)
    bands = np.zeros((ORDER + 1, n))
    for lag in range(ORDER + 1):
        for k in range(ORDER + 1 - lag):
            first = k + lag  # row of the upper band, column j = i + lag, i = k, k + 1, ..., k + n - 1 - ORDER
            bands[ORDER - lag, first : first + n - ORDER] += penalty * weights[k] * weights[k + lag]
    bands[ORDER] += 1.0
    return np.asarray(solveh_banded(bands, signal, overwrite_ab=True, check_finite=False))


def _left(penalty: float) -> float:
    """Share of the power of white noise that the curve leaves as residual: the mean of (1 - H)^2."""
    w = np.pi * (np.arange(4096) + 0.5) / 4096
    # the cut-off may be far below the grid: frequencies are taken evenly in the logarithm there
    w = np.concatenate([np.geomspace(1e-6, w[0], 2000), w[1:]])
    gain = 1.0 / (1.0 + penalty * (2.0 * np.sin(0.5 * w)) ** 6)
    return float(np.trapezoid((1.0 - gain) ** 2, w) / np.pi)
