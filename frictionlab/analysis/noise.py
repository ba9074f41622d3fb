"""What the sensor adds: noise and step, estimated from the recording itself."""

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
_ORDER = 6
_GAIN = math.comb(2 * _ORDER, _ORDER)  # variance of the 6th difference of unit white noise
_BLOCK = 64
_PART = 128  # blocks looked at together


def white_noise(signal: FloatArray) -> float:
    """Rms of the white noise in a smooth signal, quantisation included, from its sixth differences.

    A sinusoid of period P samples leaves (2 pi / P)^6 of its amplitude in them: nothing at 60 samples a period. The
    median over blocks keeps shocks and kinks out.

    Parameters
    ----------
    signal : (n,) array, n >= 16

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> t = np.arange(20_000) / 500
    >>> round(white_noise(np.cos(2 * np.pi * 3 * t) + 1e-3 * rng.standard_normal(len(t))), 4)
    0.001
    """
    blocks = (len(signal) - _ORDER) // _BLOCK
    if blocks < 8:
        return math.sqrt(float(_power(signal).mean()) / _GAIN)
    means = np.empty(blocks)
    for first in range(0, blocks, _PART):  # in parts that stay in the cache
        last = min(first + _PART, blocks)
        part = _power(signal[first * _BLOCK : last * _BLOCK + _ORDER])
        means[first:last] = part.reshape(last - first, _BLOCK).mean(axis=1)
    return math.sqrt(float(np.median(means)) / _MEDIAN_OVER_MEAN / _GAIN)


def _power(signal: FloatArray) -> FloatArray:
    """Squares of the sixth differences (n - 6,) of a signal (n,)."""
    for _ in range(_ORDER):
        signal = signal[1:] - signal[:-1]
    return signal * signal


def rounding_left(noise: float, step: float) -> float:
    """Rms of what rounding leaves in a mean of many values of one place: what noise does not average away.

    Noise of rms s before rounding leaves ``step exp(-2 pi^2 s^2 / step^2) / (sqrt(2) pi)`` [Widrow and Kollar 2008,
    ch. 5]; a sensor without noise shows the same value every time.

    Parameters
    ----------
    noise : float
        Rms of noise and rounding together, of one sample.
    step : float
        The sensor's step; 0: none.

    Examples
    --------
    >>> round(rounding_left(0.2, 1.0), 3), rounding_left(1.0, 1.0) < 1e-8
    (0.225, True)
    """
    if not step > 0.0:
        return 0.0
    variance = max((noise / step) ** 2 - 1.0 / 12.0, 0.0)
    return step / (math.sqrt(2.0) * math.pi) * math.exp(-2.0 * math.pi**2 * variance)


def as_white(rounding: float, step: float, stroke: float, samples: float) -> float:
    """Rms of white noise that would disturb the low harmonics of a cycle as much as rounding of this rms.

    Rounding follows the place: where a cycle passes fewer levels than it has samples, it is spread over fewer points.
    """
    return rounding * math.sqrt(samples / min(samples, max(stroke / step, 1.0))) if step > 0.0 else 0.0


def _median_over_mean() -> float:
    """Median over mean of a block's mean power: chi-squared with the block's effective degrees of freedom."""
    lags = np.arange(1, _ORDER + 1)
    rho = np.array([math.comb(2 * _ORDER, _ORDER + int(k)) for k in lags]) / _GAIN
    freedom = _BLOCK / (1.0 + 2.0 * float(np.sum((1.0 - lags / _BLOCK) * rho * rho)))
    return float((1.0 - 2.0 / (9.0 * freedom)) ** 3)  # Wilson and Hilferty 1931


_MEDIAN_OVER_MEAN = _median_over_mean()


def sensor_step(signal: FloatArray) -> float:
    """Smallest step the sensor's values take; 0 when they are not quantised.

    Values that fall on few levels repeat; the step is the least distance between neighbouring levels. Levels that are
    closer than a tenth of the usual distance are rounding in the log's text and are merged.

    Examples
    --------
    >>> sensor_step(np.round(np.sin(np.arange(500.0)) / 0.01) * 0.01)
    0.01
    >>> sensor_step(np.sin(np.arange(500.0)))
    0.0
    """
    levels = np.unique(signal[:20_000])
    if len(levels) < 2 or len(levels) > 0.9 * min(len(signal), 20_000):
        return 0.0
    gaps = np.diff(levels)
    real = gaps[gaps > 0.1 * np.median(gaps)]
    return float(np.round(np.percentile(real, 10), 12))
