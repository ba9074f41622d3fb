"""Stops: two velocity thresholds and a shortest dwell, tied to the sensor's noise.

A mass comes to a stop with the velocity falling linearly (it is braked until it stands) and leaves it with the velocity
rising as the square of time (the spring's force has only just reached the friction's). So the moments at which the
speed passes two thresholds, v and 2 v, tell where the stop itself begins and ends, and a turning point or a slow
passage that never stands comes out with a dwell of nothing.

A slip too slow for the thresholds leaves one stop in two places: the mean cycle tells (`parted`, `unclear`).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray

IntArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]
TURN = 2.0 * math.pi
DOUBT = 0.3  # of the shortest stop: shorter ones are a slow passage
CLEAR = 8.0  # way of a slip over the noise of one point of the mean cycle
FLAT = 0.15  # of the way: how much the mass may move before and after, so that a creep is no slip
THIN = 4.0  # shortest dwells: a slip beside a shorter stop may be a slow passage
SEEN = 6.0  # errors of a step in the place of a stop
MARGIN = 1.0  # shortest dwells at either end of a stop, where the mass may still move
SHARE = 0.7  # of the stops before and after, which a slip is shorter than
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


def parted(found: Stops, mean: FloatArray, *, noise: float, dwell: float, cycles: int) -> Stops:
    """Part the stops in which the mean cycle stands in two places.

    Parameters
    ----------
    found : Stops
        Of all cycles.
    mean : (p,) array
        Mean cycle as measured.
    noise : float
        Rms of the noise of one of its points.
    dwell : float
        Shortest stop, radians of tau.
    cycles : int
        Number of cycles.

    Examples
    --------
    >>> place = np.where(np.arange(400) < 40, 0.0, np.where(np.arange(400) < 80, 0.01, np.arange(400) * 0.01))
    >>> one = Stops(np.array([0.0]), np.array([1.2]))
    >>> two = parted(one, place, noise=1e-4, dwell=0.05, cycles=1)
    >>> [edge.round(2).tolist() for edge in (two.begin, two.end)]
    [[0.0, 0.66], [0.6, 1.2]]
    """
    slips = [_slip(mean, begin, end, noise, dwell) for begin, end in _of_the_middle(found, cycles)]
    for first, last in (slip for slip in slips if slip is not None):
        found = _with(found, first, last, dwell)
    return found


@dataclass(frozen=True)
class Move:
    """A move within a stop of the mean cycle that is no clear slip.

    ``way`` (Y), and how long the stop is, in cycles.
    """

    way: float
    length: float


def unclear(found: Stops, split: Stops, mean: FloatArray, *, noise: float, dwell: float, cycles: int) -> Move | None:
    """Return the largest move within a stop that may part it or not: stops as they were, and as `parted` left them.

    A slip beside a stop of less than `THIN` dwells may be a slow passage; a step in the place of a stop that is too
    small to part it may be a slip, or a creep.
    """
    moves = [_hidden(mean, begin, end, noise, dwell) for begin, end in _of_the_middle(split, cycles)]
    for begin, end in _of_the_middle(found, cycles):
        slip = _slip(mean, begin, end, noise, dwell)
        if slip is not None and min(slip[0] - begin, end - slip[1]) < THIN * dwell:
            scale = len(mean) / TURN
            ends = [mean[int(edge * scale) % len(mean)] for edge in slip]
            moves.append(Move(abs(float(ends[1] - ends[0])), (end - begin) / TURN))
    return max((move for move in moves if move is not None), key=lambda move: move.way, default=None)


def smallest(noise: float, points: float) -> float:
    """Way of the smallest step that is seen in the middle of a stop of a tenth of a cycle, of so many points.

    Examples
    --------
    >>> round(smallest(1e-4, 1000.0), 6)
    0.00012
    """
    return SEEN * noise * 2.0 / math.sqrt(max(1.0, 0.1 * points))


def _of_the_middle(found: Stops, cycles: int) -> Iterator[tuple[float, float]]:
    """Stops that begin in the middle cycle, as radians from its start."""
    start = (cycles // 2) * TURN
    for begin, end in zip(found.begin.tolist(), found.end.tolist(), strict=True):
        if start <= begin < start + TURN:
            yield begin - start, end - start


def _hidden(mean: FloatArray, begin: float, end: float, noise: float, dwell: float) -> Move | None:
    """The step in the place of a stop, where one is seen and tells more than a slope does."""
    scale = len(mean) / TURN
    edge = math.ceil(MARGIN * dwell * scale)
    x = mean[np.arange(math.ceil(begin * scale) + edge, math.floor(end * scale) - edge + 1) % len(mean)]
    n, least = len(x), max(2, edge)
    if n < 2 * least:
        return None
    before = np.cumsum(x)[:-1]
    k = np.arange(1.0, n)
    steps = (before[-1] + x[-1] - before) / (n - k) - before / k
    told = np.abs(steps) * np.sqrt(k * (n - k) / n)  # over the noise: errors
    inner = slice(least - 1, n - least)
    best = least - 1 + int(np.argmax(told[inner]))
    ramp = np.arange(n) - 0.5 * (n - 1)
    slope = abs(float(np.dot(ramp, x))) / math.sqrt(float(np.dot(ramp, ramp)))
    if told[best] < max(SEEN * noise, slope):
        return None
    return Move(abs(float(steps[best])), (end - begin) / TURN)


def _slip(mean: FloatArray, begin: float, end: float, noise: float, dwell: float) -> tuple[float, float] | None:
    """When a slip within a stop begins and ends (rad from the cycle's start), if there is one."""
    scale = len(mean) / TURN
    first, last = math.ceil(begin * scale), math.floor(end * scale)
    least = math.ceil(dwell * scale)
    if last - first < 2 * least + 1:
        return None
    x = mean[np.arange(first, last + 1) % len(mean)]
    before, after = float(x[:least].mean()), float(x[-least:].mean())
    way = after - before
    if abs(way) < CLEAR * noise:
        return None
    reach = least // 2
    width = 2 * reach + 1
    share = np.convolve(np.pad((x - before) / way, reach, mode="edge"), np.ones(width) / width, mode="valid")
    rough = FLAT + 2.0 * noise / math.sqrt(width) / abs(way)
    leaves = int(np.argmax(share > rough))
    comes = len(x) - int(np.argmax((share < 1.0 - rough)[::-1]))
    short = comes - leaves < SHARE * min(leaves, len(x) - comes)
    if not (short and min(leaves, len(x) - comes) >= least and _is_flat(x[:leaves], way, noise)):
        return None
    return ((first + leaves) / scale, (first + comes) / scale) if _is_flat(x[comes:], way, noise) else None


def _is_flat(x: FloatArray, way: float, noise: float) -> bool:
    """Whether the first and the second half of a stop are in one place."""
    half = max(1, len(x) // 2)
    apart = abs(float(x[:half].mean()) - float(x[-half:].mean()))
    return apart < FLAT * abs(way) + 3.0 * noise * math.sqrt(2.0 / half)


def _with(found: Stops, first: float, last: float, dwell: float) -> Stops:
    """The stops with this slip taken out of each that holds it, in whatever cycle."""
    turns = np.floor((found.begin - first) / TURN) + 1.0
    at, until = first + TURN * turns, last + TURN * turns
    inside = (at - found.begin > dwell) & (found.end - until > dwell)
    begin = np.concatenate([found.begin, until[inside]])
    end = np.concatenate([np.where(inside, at, found.end), found.end[inside]])
    order = np.argsort(begin, kind="stable")
    return Stops(begin[order], end[order])
