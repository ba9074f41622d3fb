"""Stamps -> one time base: restarts, stray and repeated stamps, missing samples, sampling rate.

No stamp is moved unless the clock forces it (it restarted, or it is too coarse to tell samples apart), and then a
warning says so.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.recording import LATEST_S, Quality
from frictionlab.sampling import sampling_interval, step_range

_MOST_STRAY = 0.05
_STATED_TOLERANCE = 1e-4
_SHORTEST_BRIDGE = 3.5
"""Steps: a hole of up to three missing samples is always short."""


@dataclass
class TimeBase:
    """Time of each sample and what was found on the way.

    Parameters
    ----------
    time
        (n,) s, increasing; strictly so except at samples flagged duplicated.
    quality
        (n,) uint8 bits of `Quality`.
    stray
        Indices into the stamps given of samples left out: their stamps run backward.
    interval
        Sampling interval by a straight line through all stamps [s].
    bridge
        Holes up to this long are short [s].
    missing
        Samples missing in all holes.
    """

    time: NDArray[np.float64]
    quality: NDArray[np.uint8]
    stray: NDArray[np.int64]
    interval: float = 0.0
    bridge: float = 0.0
    missing: int = 0
    warnings: list[str] = field(default_factory=list)


def counted(samples: int, interval: float, bridge_s: float) -> TimeBase:
    """Time counted at a known interval [s], for a log without stamps."""
    none = np.zeros(0, np.int64)
    with np.errstate(over="ignore", invalid="ignore"):  # the recording refuses what is not finite
        time = np.arange(samples, dtype=np.float64) * np.float64(interval)
    return TimeBase(time, np.zeros(samples, np.uint8), none, interval, max(bridge_s, _SHORTEST_BRIDGE * interval))


def time_base(stamps: NDArray[np.float64], name: str, *, bridge_s: float, stated_s: float | None = None) -> TimeBase:
    """Make a time base of stamps [s].

    Parameters
    ----------
    stamps
        (n,) finite, as in the log.
    name
        Of the log, for messages.
    bridge_s
        Holes up to this long are short.
    stated_s
        The sampling interval that the log states, to be checked.

    Raises
    ------
    LogError
        If the stamps do not increase, or are beyond all time.
    """
    if len(stamps) and not max(-stamps.min(), stamps.max()) < LATEST_S:
        raise LogError(f"{name}: time: expected seconds; got {np.abs(stamps).max():g}: damaged, or in another unit")
    base = TimeBase(stamps, np.zeros(len(stamps), np.uint8), np.zeros(0, np.int64))
    if len(stamps) > 1 and step_range(stamps)[0] < 0.0:
        stray, restarts = _backward(stamps, np.diff(stamps), name)
        time = np.delete(stamps, stray)
        base = TimeBase(time, np.zeros(len(time), np.uint8), stray)
        if len(restarts):
            _join(base, restarts - np.searchsorted(stray, restarts))
    if len(base.time) < 2 or not base.time[-1] > base.time[0]:
        raise LogError(f"{name}: the time stamps do not increase: give --time, or --sampling-rate")
    _flag_holes(base, bridge_s)
    if stated_s is not None and abs(stated_s / base.interval - 1.0) > _STATED_TOLERANCE:
        base.warnings.append(
            f"the log states a sampling interval of {stated_s:.9g} s, its stamps are {base.interval:.9g} s apart: "
            "the stamps are taken"
        )
    return base


def _backward(
    stamps: NDArray[np.float64], steps: NDArray[np.float64], name: str
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Find stray stamps and restarts of the clock, as indices."""
    stray: list[int] = []
    restarts: list[int] = []
    falls = np.flatnonzero(steps < 0.0) + 1
    if len(falls) > max(5.0, _MOST_STRAY * len(stamps)):
        raise LogError(
            f"{name}: the time stamps run backward {len(falls)} times in {len(stamps)} samples: expected increasing "
            "stamps; give --time, or --sampling-rate"
        )
    last = len(stamps) - 1
    for i in falls.tolist():
        before = i - 2 if i - 1 not in stray else i - 3
        if i in stray or i - 1 in stray:
            continue
        if i < last and stamps[i + 1] >= stamps[i - 1]:
            stray.append(i)  # it alone is behind
        elif before >= 0 and stamps[i] >= stamps[before]:
            stray.append(i - 1)  # the one before was ahead
        elif i == last:
            stray.append(i)
        else:
            restarts.append(i)
    return np.array(stray, np.int64), np.array(restarts, np.int64)


def _join(base: TimeBase, restarts: NDArray[np.int64]) -> None:
    """Let each part of a clock that restarted follow on the one before, one step later, marked as a hole."""
    steps = np.diff(base.time)
    step = float(np.median(steps[steps > 0.0]))
    time = base.time.copy()
    for i in restarts.tolist():
        time[i:] += time[i - 1] + step - time[i]
        base.quality[i] |= Quality.GAP_BEFORE | Quality.NOT_BRIDGED
    base.time = time
    where = ", ".join(f"{time[i]:.6g} s" for i in restarts.tolist()[:5])
    base.warnings.append(
        f"the clock restarted (at {where}; {len(restarts)} in all): what follows is put one step later; how long the "
        "interruption was is not known, and no cycle is cut across it"
    )


def _flag_holes(base: TimeBase, bridge_s: float) -> None:
    base.interval = sampling_interval(base.time)
    base.bridge = max(bridge_s, _SHORTEST_BRIDGE * base.interval)
    smallest, largest = step_range(base.time)
    if smallest > 0.0 and largest <= 1.5 * base.interval:
        return
    steps = np.diff(base.time)
    repeated = steps == 0.0
    coarse = np.count_nonzero(repeated) > 0.1 * len(steps)
    resolution = float(steps[steps > 0.0].min()) if coarse else 0.0
    if steps.max() > 1.5 * base.interval + resolution:
        _flag_missing(base, steps, steps > 1.5 * base.interval + resolution)
    if coarse:
        _recount(base, resolution)
    elif repeated.any():
        base.quality[1:][repeated] |= np.uint8(Quality.DUPLICATED)
        base.warnings.append(f"{np.count_nonzero(repeated)} time stamps repeat the one before (flagged duplicated)")


def _flag_missing(base: TimeBase, steps: NDArray[np.float64], holes: NDArray[np.bool_]) -> None:
    long = holes & (steps > base.bridge)
    base.quality[1:][holes] |= np.uint8(Quality.GAP_BEFORE)
    base.quality[1:][long] |= np.uint8(Quality.NOT_BRIDGED)
    base.missing = int(np.maximum(np.rint(steps[holes] / base.interval) - 1, 1).sum())
    base.warnings.append(f"{base.missing} samples are missing in {np.count_nonzero(holes)} places (flagged gap_before)")
    for i in np.flatnonzero(long)[:5].tolist():
        base.warnings.append(
            f"a gap of {steps[i]:.6g} s after {base.time[i]:.6g} s is longer than {base.bridge:.3g} s: no cycle is cut "
            "across it"
        )


def _recount(base: TimeBase, resolution: float) -> None:
    """Replace stamps too coarse to tell samples apart by a straight line through them, between holes."""
    holes = np.flatnonzero(base.quality & np.uint8(Quality.GAP_BEFORE))
    time = np.empty_like(base.time)
    for part in np.split(np.arange(len(time)), holes):
        count = np.arange(len(part)) * base.interval
        time[part] = count + (base.time[part] - count).mean()
    base.time = np.maximum.accumulate(time)
    base.warnings.append(
        f"time stamps are {resolution:.3g} s coarse, samples {base.interval:.6g} s apart: samples are counted along a "
        "straight line through the stamps"
    )
