"""The clock of a recording: its sampling interval, and where it was set or stood still."""

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import RecordingError

_ODD = 0.1  # of a step that a clock may pass too much or too little before it counts as set
_CLEARLY, _FEW_BREAKS, _BREAKS_SHARE = 8.0, 20, 1e-4  # times the usual; more breaks than that are a clock that jitters
_PART = 1 << 13  # doubles that stay in the cache


def sampling_interval(time: NDArray[np.float64]) -> float:
    """Sampling interval [s] of increasing stamps (n,) [s], by least squares over all of them.

    Each stamp gets the number of steps passed since the first, so that missing samples do not stretch the interval.

    Examples
    --------
    >>> import numpy as np
    >>> round(sampling_interval(np.delete(np.arange(1000) * 0.004, [17, 500, 501])), 9)
    0.004
    """
    guess = _typical_step(time)
    if not guess > 0.0:
        raise RecordingError("no sampling rate: expected time stamps that increase; got no increasing step")
    smallest, largest = step_range(time)
    if (1.0 - _ODD) * guess < smallest and largest < (1.0 + _ODD) * guess:
        return _slope_over_index(time)
    steps = np.diff(time)
    if _quantised(steps):
        return _slope_over_index(time)
    count = np.zeros(len(time))
    count[1:] = np.cumsum(np.where(steps > 0, np.maximum(np.rint(steps / guess), 1.0), 0.0))
    breaks = clock_breaks(time, _pooled_slope(count, time, np.flatnonzero(steps > 1.5 * guess) + 1))
    return _pooled_slope(count, time, breaks)


def clock_breaks(time: NDArray[np.float64], interval: float) -> NDArray[np.intp]:
    """Samples before which the clock does not pass a whole number of intervals: it was set, or the logger paused.

    Parameters
    ----------
    time : (n,) array
        Increasing stamps [s].
    interval : float
        Sampling interval [s].

    Returns
    -------
    (m,) array
        Empty where more than a few steps are odd: such stamps jitter, or are coarse.

    Examples
    --------
    >>> time = np.arange(1000) * 0.004
    >>> time[700:] -= 0.001
    >>> clock_breaks(time, 0.004).tolist()
    [700]
    """
    smallest, largest = step_range(time)
    if (1.0 - _ODD) * interval < smallest and largest < (1.0 + _ODD) * interval:
        return np.zeros(0, np.intp)
    passed = np.diff(time) / interval
    off = np.abs(passed - np.maximum(np.rint(passed), 1.0))
    odd = np.flatnonzero(off > max(_ODD, _CLEARLY * float(np.median(off))))
    few = len(odd) <= max(_FEW_BREAKS, _BREAKS_SHARE * len(time))
    return odd + 1 if few and not _quantised(passed) else np.zeros(0, np.intp)


def _pooled_slope(count: NDArray[np.float64], time: NDArray[np.float64], breaks: NDArray[np.intp]) -> float:
    """Slope of time over count, one for all parts between the breaks, each with an offset of its own."""
    first = np.concatenate([[0], breaks]).astype(np.intp)
    size = np.diff(np.append(first, len(time)))
    about = [v - np.repeat(np.add.reduceat(v, first) / size, size) for v in (count, time - time[0])]
    square = float(np.dot(about[0], about[0]))
    return float(np.dot(*about)) / square if square > 0.0 else float((time[-1] - time[0]) / (count[-1] - count[0]))


def step_range(time: NDArray[np.float64]) -> tuple[float, float]:
    """Smallest and largest step between stamps (n,), n > 1; nan if one is. In parts that stay in the cache."""
    parts = (np.diff(time[start : start + _PART + 1]) for start in range(0, len(time) - 1, _PART))
    with np.errstate(invalid="ignore"):  # two infinite stamps: no step, and told by who asks
        smallest, largest = zip(*((part.min(), part.max()) for part in parts), strict=True)
    return float(np.min(smallest)), float(np.max(largest))


def _slope_over_index(time: NDArray[np.float64]) -> float:
    """Slope of the least-squares line through time over sample number.

    In parts that stay in the cache and are too short for the linear algebra library to wake its threads for.
    """
    n, total = len(time), 0.0
    ramp, centre = np.arange(float(_PART)), (n - 1) / 2.0
    for start in range(0, n, _PART):
        part = time[start : start + _PART] - time[0]  # stamps of an epoch are a thousand million seconds
        total += float(np.dot(ramp[: len(part)], part) + (start - centre) * part.sum())
    return total / (n * (n * n - 1.0) / 12.0)


def _typical_step(time: NDArray[np.float64]) -> float:
    """The median step [s]; the mean where the median is 0 (stamps coarser than the sampling interval)."""
    steps = len(time) - 1
    some = np.arange(0, steps, 1 if steps < 200_000 else steps // 100_000)
    return float(np.median(time[some + 1] - time[some])) or float((time[-1] - time[0]) / steps)


def _quantised(steps: NDArray[np.float64]) -> bool:
    """Stamps written so coarsely that many repeat: then each sample counts as one step."""
    return bool(np.count_nonzero(steps == 0.0) > 0.1 * len(steps))
