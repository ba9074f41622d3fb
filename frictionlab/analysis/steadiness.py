"""Whether a motion is steady: when it settled, whether it beats, whether it jumps between coexisting motions."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.stops import runs

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Beating:
    """A slow modulation: ``period`` in cycles, ``depth``: amplitude of the modulation over the mean."""

    period: float
    depth: float


def settled_at(distance: FloatArray, *, floor: float) -> int | None:
    """Index of the first cycle from which the motion stays as near its final cycle as it ever comes.

    Parameters
    ----------
    distance : (n,) array
        Rms distance of each cycle from the mean of the last ones, over the rms of that mean.
    floor : float
        Distance that sensor noise alone gives.

    Returns
    -------
    int or None
        None where the last quarter itself is not settled (fewer than four cycles in it, or it still moves).
    """
    n = len(distance)
    tail = distance[n - max(4, n // 4) :]
    if n < 8:
        return None
    level = float(np.median(tail))
    least = max(3.0 * floor, 0.02)
    earlier, later = (float(np.median(part)) for part in np.array_split(tail, 2))
    if earlier > max(2.0 * later, least):
        return None
    limit = max(3.0 * level, least)
    outside = np.flatnonzero(distance > limit)
    first = int(outside[-1]) + 1 if len(outside) else 0
    return first if first < n - len(tail) // 2 else None


def beating(series: FloatArray, *, noise: float, least: float = 0.02) -> Beating | None:
    """Find a slow modulation in a per-cycle series.

    Parameters
    ----------
    series : (n,) array
        A positive quantity per cycle, such as the response amplitude.
    noise : float
        Standard error of one value.
    least : float
        Modulations shallower than this share of the mean are not reported.
    """
    n = len(series)
    mean = float(series.mean())
    if n < 12 or mean <= 0.0:
        return None
    u = np.arange(n) - 0.5 * (n - 1)
    about = series - mean - u * (np.dot(u, series) / np.dot(u, u))
    power = np.abs(np.fft.rfft(about * np.hanning(n))) ** 2
    power[:2] = 0.0
    peak = int(np.argmax(power))
    share = float(power[max(0, peak - 2) : peak + 3].sum() / max(power.sum(), 1e-300))
    depth = math.sqrt(power[peak]) * 4.0 / n / mean
    real = share > 0.6 and depth > least and depth * mean > 3.0 * noise
    return Beating(n / peak, depth) if real and peak < n // 2 else None


def growth(series: FloatArray, *, least: float = 1e-3) -> float:
    """Relative change of a positive per-cycle series (n,) from its first to its last cycle along a straight line.

    0 where the line is not clear (eight standard errors, a half of the variance), the change less than ``least``, or
    the cycles fewer than 12.

    Examples
    --------
    >>> round(growth(np.linspace(1.0, 1.02, 50)), 4)
    0.0198
    """
    n = len(series)
    if n < 12:
        return 0.0
    u = np.arange(n) - 0.5 * (n - 1)
    slope = float(np.dot(u, series) / np.dot(u, u))
    left = series - series.mean() - slope * u
    error = math.sqrt(float(np.dot(left, left)) / (n - 2) / float(np.dot(u, u)))
    change = slope * (n - 1) / float(series.mean())
    clear = abs(slope) > 8.0 * error and float(np.var(left)) < 0.5 * float(np.var(series))
    return change if clear and abs(change) > least else 0.0


def jumps(series: FloatArray, *, noise: float, width: int = 5, least: float = 0.05) -> NDArray[np.intp]:
    """Find sudden lasting changes in a per-cycle series: cycles where the medians before and after differ.

    A jump is a difference between the medians of ``width`` cycles on either side of more than ``least``, eight times
    the scatter within them, and eight times the sensor's noise.

    Returns
    -------
    (m,) array
        Index of the first cycle after each jump.
    """
    n = len(series)
    if n < 2 * width:
        return np.zeros(0, dtype=np.intp)
    windows = np.lib.stride_tricks.sliding_window_view(series, width)
    middle = np.median(windows, axis=1)
    spread = np.median(np.abs(windows - middle[:, None]), axis=1) / 0.6745
    step = np.abs(middle[width:] - middle[:-width])
    within = np.maximum(spread[width:], spread[:-width])
    begin, end = runs(step > np.maximum(8.0 * np.maximum(within, noise), least))
    mean = windows.mean(axis=1)
    sharp = np.abs(mean[width:] - mean[:-width])  # medians say whether, means say where
    peaks = [b + int(np.argmax(sharp[b:e])) for b, e in zip(begin, end, strict=True)]
    return np.array(peaks, dtype=np.intp) + width
