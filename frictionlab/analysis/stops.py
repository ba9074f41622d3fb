"""Stops: two velocity thresholds and a shortest dwell, tied to the sensor's noise.

A mass comes to a stop with the velocity falling linearly (it is braked until it stands) and leaves it with the velocity
rising as the square of time (the spring's force has only just reached the friction's). So the moments at which the
speed passes two thresholds, v and 2 v, tell where the stop itself begins and ends, and a turning point or a slow
passage that never stands comes out with a dwell of nothing.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]
TURN = 2.0 * math.pi
DOUBT = 0.3  # of the shortest stop: shorter ones are a slow passage
_LEAVING = 1.0 / (math.sqrt(2.0) - 1.0)  # v = j t^2 / 2: time from the stop to v, over the time from v to 2 v


@dataclass(frozen=True)
class Thresholds:
    """When the mass counts as standing.

    ``still``: velocity (by tau) it must fall below; the second threshold is twice that; ``dwell``: the shortest stop,
    ``blur``: the shortest motion between two stops, radians of tau.
    """

    still: float
    dwell: float
    blur: float = 0.0


@dataclass(frozen=True)
class Stops:
    """Stops of consecutive cycles: ``begin`` and ``end`` (m,) in radians of tau from the first cycle's start.

    A stop that the end of the record cuts in two goes on at its beginning: its end may lie beyond the last cycle.
    """

    begin: FloatArray
    end: FloatArray


@dataclass(frozen=True)
class Pauses:
    """Runs of low speed, candidates for stops: crossings of both thresholds (m,) in points from the first cycle on.

    ``outer_begin`` <= ``inner_begin`` <= ``inner_end`` <= ``outer_end``: of 2 v, v, v, 2 v.
    """

    outer_begin: FloatArray
    inner_begin: FloatArray
    inner_end: FloatArray
    outer_end: FloatArray


def thresholds(v_noise: float, resolution: float) -> Thresholds:
    """Thresholds for a velocity with this much noise (by tau) and this resolution (radians of tau)."""
    return Thresholds(max(3.0 * v_noise, 1e-3), dwell=max(0.0075 * TURN, 0.3 * resolution), blur=resolution)


def pauses(v: FloatArray, still: float) -> Pauses:
    """Find the runs of |v| below twice ``still`` that fall below ``still``.

    Parameters
    ----------
    v : (n, points) array
        Velocity by tau, one cycle a row; rows follow each other.
    """
    speed = np.abs(v).ravel()
    begin, end = runs(speed < 2.0 * still)
    slow = np.flatnonzero(speed < still)
    first, past = np.searchsorted(slow, begin), np.searchsorted(slow, end)
    real = past > first
    begin, end, first, past = begin[real], end[real], first[real], past[real]
    inner_begin, inner_end = slow[first], slow[past - 1] + 1
    return Pauses(
        _crossing(speed, begin, 2.0 * still),
        _crossing(speed, inner_begin, still),
        _crossing(speed, inner_end, still),
        _crossing(speed, end, 2.0 * still),
    )


def _crossing(speed: FloatArray, index: IntArray, level: float) -> FloatArray:
    """Where the speed passes a level between the points before and at ``index``; the edge itself at the edges."""
    inside = np.clip(index, 1, len(speed) - 1)
    before, after = speed[inside - 1], speed[inside]
    step = after - before
    share = np.clip((level - before) / np.where(step == 0.0, 1.0, step), 0.0, 1.0)
    return np.where((index == 0) | (index == len(speed)), index + 0.0, inside - 1 + share)


def joined(parts: list[Pauses], firsts: list[int], cycles: int, points: int) -> Pauses:
    """Pauses of several blocks of cycles as one list; one that a block's edge cuts is whole, the ends join too."""
    shifted = [
        np.stack([p.outer_begin, p.inner_begin, p.inner_end, p.outer_end]) + first * points
        for p, first in zip(parts, firsts, strict=True)
    ]
    every = np.concatenate(shifted, axis=1)
    touching = np.flatnonzero(np.abs(every[0, 1:] - every[3, :-1]) < 1e-6)
    every[2:, touching] = every[2:, touching + 1]  # two blocks: a pause is never as long as a block
    every = np.delete(every, touching + 1, axis=1)
    total = float(cycles * points)
    if every.shape[1] > 1 and every[0, 0] == 0.0 and every[3, -1] == total:
        every[2:, -1] = every[2:, 0] + total
        every = every[:, 1:]
    return Pauses(*every)


def stops_of(found: Pauses, how: Thresholds, points: int) -> Stops:
    """The pauses in which the mass stands for at least the shortest dwell; those that only a ripple parts are one."""
    begin, end = _edges(found, how, points)
    stands = end - begin >= how.dwell
    return Stops(begin[stands], end[stands])


def doubtful(found: Pauses, how: Thresholds, points: int) -> FloatArray:
    """Lengths (m,) of the pauses that may be stops and are too short to tell, radians of tau."""
    begin, end = _edges(found, how, points)
    length = end - begin
    return length[(length < how.dwell) & (length > DOUBT * how.dwell)]


def _edges(found: Pauses, how: Thresholds, points: int) -> tuple[FloatArray, FloatArray]:
    """Where the mass would stand from and to in each pause, radians of tau; a slow passage has no time between."""
    step = TURN / points
    found = _without_ripple(found, how.blur / step)
    begin = found.inner_begin + (found.inner_begin - found.outer_begin)
    end = found.inner_end - _LEAVING * (found.outer_end - found.inner_end)
    return begin * step, end * step


def _without_ripple(found: Pauses, blur: float) -> Pauses:
    """Join neighbours that are parted by less than the velocity's resolution (points)."""
    if len(found.outer_begin) < 2:
        return found
    parted = found.outer_begin[1:] - found.outer_end[:-1] > blur
    first, last = np.concatenate([[True], parted]), np.concatenate([parted, [True]])
    return Pauses(found.outer_begin[first], found.inner_begin[first], found.inner_end[last], found.outer_end[last])


def runs(mask: BoolArray) -> tuple[IntArray, IntArray]:
    """First and one-past-last index of each run of True.

    Examples
    --------
    >>> [edge.tolist() for edge in runs(np.array([True, False, True, True]))]
    [[0, 2], [1, 4]]
    """
    edges = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)


def per_cycle(found: Stops, cycles: int) -> tuple[FloatArray, FloatArray]:
    """Stops that begin in each cycle, and the fraction of each cycle spent standing, both (n,)."""
    first = np.clip((found.begin // TURN).astype(np.intp), 0, cycles - 1)
    count = np.bincount(first, minlength=cycles).astype(np.float64)
    edges = TURN * np.arange(2 * cycles + 1)
    stood = np.concatenate([[0.0], np.cumsum(found.end - found.begin)])
    knots = np.stack([found.begin, found.end], axis=1).ravel()
    total = np.stack([stood[:-1], stood[1:]], axis=1).ravel()
    passed = np.interp(edges, knots, total) if len(knots) else np.zeros(2 * cycles + 1)
    stuck = np.diff(passed) / TURN
    return count, stuck[:cycles] + stuck[cycles:]
