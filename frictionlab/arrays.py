"""Arrays over phase and time: their types, runs of a mask, a cycle moved along its phase, the clock of time stamps.

Of the clock: its sampling interval, and where it was set or stood still.
"""

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import RecordingError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.intp]

_LONGEST = 20.0  # times its samples that a record may last before it has a jump
_ODD = 0.1  # of a step that a clock may pass too much or too little before it counts as set
_CLEARLY, _FEW_BREAKS, _BREAKS_SHARE = 8.0, 20, 1e-4  # times the usual; more breaks than that are a clock that jitters


def runs(mask: NDArray[np.bool_]) -> tuple[IntArray, IntArray]:
    """First and one-past-last index of each run of True."""
    edges = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)


def shifted(cycle: FloatArray, phase: float = 0.0, order: int = 0, times: int = 1) -> FloatArray:
    """Return a cycle (p,), or its derivative by the phase of an order, so much later in it (rad), at times p points.

    By its harmonics: phases are equally spaced.

    Examples
    --------
    >>> round(float(shifted(np.cos(np.arange(8) * np.pi / 4.0), order=1)[2]), 6)
    -1.0
    """
    lines = np.fft.rfft(cycle)
    turns = 1j * np.arange(len(lines))
    return np.asarray(times * np.fft.irfft(lines * turns**order * np.exp(turns * phase), times * len(cycle)))


def sampling_interval(time: FloatArray) -> float:
    """Sampling interval [s] of increasing stamps (n,) [s], by least squares over all of them.

    Each stamp gets the number of steps passed since the first, so that missing samples do not stretch the interval.

    Examples
    --------
    >>> round(sampling_interval(np.delete(np.arange(1000) * 0.004, [17, 500, 501])), 9)
    0.004
    """
    steps, guess = np.diff(time), 0.0
    if len(steps):
        some = steps[:: max(1, len(steps) // 100_000)]
        guess = float(np.median(some)) or float((time[-1] - time[0]) / len(steps))  # coarse stamps repeat
    if not guess > 0.0:
        raise RecordingError("no sampling rate: expected time stamps that increase; got no increasing step")
    n = len(time)
    if _is_even(steps, guess) or _is_quantised(steps):
        del steps  # of a long log every column is dear
        count = np.linspace(-0.5 * (n - 1), 0.5 * (n - 1), n)
        count *= time - time[0]
        return float(count.sum()) * 12.0 / (n * (n * n - 1.0))
    interval, count = guess, np.zeros(n)
    for _ in range(2):  # the usual step of coarse stamps is far from their interval
        holes = holes_of(time, interval)
        passed = np.append(0.0, steps > 0)
        passed[holes] = np.rint(steps[holes - 1] / interval)
        count = np.cumsum(passed)
        interval = _pooled_slope(count, time, holes)
    return _pooled_slope(count, time, clock_breaks(time, interval))


def holes_of(time: FloatArray, interval: float, resolution: float = 0.0) -> IntArray:
    """Samples (m,) before which some are missing: one step is long, and the next eight stamps do not make it good.

    Of stamps (n,) that jitter only one is late, and beside a hole only what is late beyond it is another;
    ``interval``, ``resolution``: between samples and of the stamps [s].

    Examples
    --------
    >>> holes_of(np.array([0, 1, 2, 2.8, 4.4, 5, 6, 7, 8, 9, 10, 11, 12, 15, 16.0]) * 0.002, 0.002).tolist()
    [13]
    """
    passed = np.diff(time) / interval
    at = np.flatnonzero(passed > 1.5 + resolution / interval) + 1
    late = np.append(0.0, np.cumsum(np.minimum(passed, 10.0) - 1.0))  # a clock set by years: 9 steps
    begin, end = np.maximum(at - 8, 0), np.minimum(at + 8, len(time))

    def rises(late: FloatArray) -> FloatArray:
        total = np.cumsum(np.append(0.0, late))
        return np.asarray((total[end] - total[at]) / (end - at) - (total[at] - total[begin]) / (at - begin))

    rise = rises(late)
    largest = rise > 0.5  # of those within eight samples
    for k in range(1, min(9, len(at))):
        near = at[k:] - at[:-k] <= 8
        largest[k:] &= ~(near & (rise[k:] < rise[:-k]))
        largest[:-k] &= ~(near & (rise[:-k] <= rise[k:]))
    holes = np.zeros(len(time))
    holes[at[largest]] = np.rint(np.minimum(rise, passed[at - 1] - 1.0)[largest])  # of two side by side each its own
    lasting: IntArray = at[largest | (rises(late - np.cumsum(holes)) > 0.5)]
    return lasting


def clock_breaks(time: FloatArray, interval: float) -> IntArray:
    """Samples (m,) before which the clock passes no whole number of intervals [s]: it was set, or the logger paused.

    Empty where more than a few steps between the increasing stamps (n,) [s] are odd: such stamps jitter, or are coarse.

    Examples
    --------
    >>> time = np.arange(1000) * 0.004
    >>> time[700:] -= 0.001
    >>> clock_breaks(time, 0.004).tolist()
    [700]
    """
    passed = np.diff(time) / interval
    if _is_even(passed, 1.0) or _is_quantised(passed):
        return np.zeros(0, np.intp)
    off = np.abs(passed - np.maximum(np.rint(passed), 1.0))
    odd = np.flatnonzero(off > max(_ODD, _CLEARLY * float(np.median(off))))
    few = len(odd) <= max(_FEW_BREAKS, _BREAKS_SHARE * len(time))
    return odd + 1 if few else np.zeros(0, np.intp)


def step_range(time: FloatArray) -> tuple[float, float]:
    """Smallest and largest step between stamps (n,), n > 1; nan if one is."""
    with np.errstate(invalid="ignore"):  # two infinite stamps: no step
        steps = np.diff(time)
    return float(steps.min()), float(steps.max())


def jump_in(time: FloatArray, interval: float) -> str:
    """What to say of stamps (n,) [s] that jump so far that even steps would fill the memory; "" of all others."""
    count = float(time[-1] - time[0]) / interval
    if count <= max(1e6, _LONGEST * len(time)):
        return ""
    at = int(np.argmax(np.diff(time)))
    jump = f"the stamps jump from {time[at]:.6g} to {time[at + 1]:.6g} s"
    return f"{jump}: {len(time)} samples would become {count:.3g}, one every {interval:.3g} s"


def _is_even(steps: FloatArray, usual: float) -> bool:
    return bool((1.0 - _ODD) * usual < steps.min() and steps.max() < (1.0 + _ODD) * usual)


def _is_quantised(steps: FloatArray) -> bool:
    """Stamps written so coarsely that many repeat: then each sample counts as one step."""
    return bool(np.count_nonzero(steps == 0.0) > 0.1 * len(steps))


def _pooled_slope(count: FloatArray, time: FloatArray, breaks: IntArray) -> float:
    """Slope of time over count, one for all parts between the breaks, each with an offset of its own."""
    first = np.concatenate([[0], breaks]).astype(np.intp)
    size = np.diff(np.append(first, len(time)))
    about = [v - np.repeat(np.add.reduceat(v, first) / size, size) for v in (count, time - time[0])]
    square = float(np.dot(about[0], about[0]))
    return float(np.dot(*about)) / square if square > 0.0 else float((time[-1] - time[0]) / count[-1])
