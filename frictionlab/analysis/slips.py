"""Slips too slow for the velocity's threshold: one stop in two places is two stops."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.stops import TURN, Stops

FloatArray = NDArray[np.float64]
CLEAR = 8.0  # way of a slip over the noise of one point of the mean cycle
FLAT = 0.15  # of the way: how much the mass may move before and after, so that a creep is no slip
THIN = 4.0  # shortest dwells: a slip beside a shorter stop may be a slow passage
SEEN = 6.0  # errors of a step in the place of a stop
MARGIN = 1.0  # shortest dwells at either end of a stop, where the mass may still move
SHARE = 0.7  # of the stops before and after, which a slip is shorter than


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
