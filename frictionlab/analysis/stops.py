"""Stops: two velocity thresholds and a shortest dwell, tied to the sensor's noise.

A mass comes to a stop with the velocity falling linearly (it is braked until it stands) and leaves it with the velocity
rising as the square of time (the spring's force has only just reached the friction's). So the moments at which the
speed passes two thresholds, v and 2 v, show where the stop itself begins and ends, and a turning point or a slow
passage that never stands comes out with a dwell of nothing.

A slip too slow for the thresholds leaves one stop in two places: the mean cycle shows it (`parted`).

Stops are arrays (2, m): begin and end in radians of tau from the first cycle's start. One that the end of the record
cuts in two goes on at its beginning: its end may lie beyond the last cycle.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from frictionlab.arrays import FloatArray, runs

TURN = 2.0 * math.pi
FLAT = 0.15  # of the way: how much the mass may move before and after, so that a creep is no slip
THIN = 4.0  # shortest dwells: a slip beside a shorter stop may be a slow passage
SEEN = 6.0  # errors of a step in the place of a stop
MARGIN = 1.0  # shortest dwells at either end of a stop, where the mass may still move
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

    @classmethod
    def of(cls, v_noise: float, resolution: float) -> "Thresholds":
        """For a velocity with this much noise (by tau) and this resolution (radians of tau)."""
        return cls(max(3.0 * v_noise, 1e-3), dwell=max(0.0075 * TURN, 0.3 * resolution), blur=resolution)


def pauses(v: FloatArray, still: float) -> FloatArray:
    """Runs of low speed, candidates for stops: where |v| passes 2 ``still``, ``still``, and both again, (4, m) points.

    ``v`` (n, points): velocity by tau, rows follow each other; a pause cut by the end goes on at the beginning.
    """
    speed = np.abs(v).ravel()
    begin, end = runs(speed < 2.0 * still)
    slow = np.flatnonzero(speed < still)
    first, past = np.searchsorted(slow, begin), np.searchsorted(slow, end)
    real = past > first
    index = np.array([begin[real], slow[first[real]], slow[past[real] - 1] + 1, end[real]])
    level = still * np.array([[2.0], [1.0], [1.0], [2.0]])
    inside = np.clip(index, 1, len(speed) - 1)
    before, after = speed[inside - 1], speed[inside]
    share = np.clip((level - before) / np.where(after == before, 1.0, after - before), 0.0, 1.0)
    every = np.where((index == 0) | (index == len(speed)), index + 0.0, inside - 1 + share)  # edges are themselves
    if every.shape[1] > 1 and every[0, 0] == 0.0 and every[3, -1] == len(speed):
        every[2:, -1] = every[2:, 0] + len(speed)
        every = every[:, 1:]
    return every


def stops_of(found: FloatArray, how: Thresholds, points: int) -> tuple[FloatArray, FloatArray]:
    """The pauses in which the mass stands for the shortest dwell, and lengths (k,) of shorter ones that may be stops.

    A slow passage has no time in which the mass stands. Pauses that are parted by less than the velocity's resolution
    are one.
    """
    step = TURN / points
    parted = found[0, 1:] - found[3, :-1] > how.blur / step
    first, last = np.concatenate([[True], parted]), np.concatenate([parted, [True]])
    if found.shape[1]:
        found = np.concatenate([found[:2, first], found[2:, last]])
    begin, end = 2.0 * found[1] - found[0], found[2] - _LEAVING * (found[3] - found[2])
    each = np.array([begin, end]) * step
    length = each[1] - each[0]
    doubtful = length[(length < how.dwell) & (length > 0.3 * how.dwell)]  # shorter ones are a slow passage
    return each[:, length >= how.dwell], doubtful


def per_cycle(found: FloatArray, cycles: int) -> tuple[FloatArray, FloatArray]:
    """Stops that begin in each cycle, and the fraction of each cycle spent standing, both (n,)."""
    first = np.clip((found[0] // TURN).astype(np.intp), 0, cycles - 1)
    count = np.bincount(first, minlength=cycles).astype(np.float64)
    stood = np.concatenate([[0.0], np.cumsum(found[1] - found[0])])
    knots, total = found.T.ravel(), np.stack([stood[:-1], stood[1:]], axis=1).ravel()
    edges = TURN * np.arange(2 * cycles + 1)
    stuck = np.diff(np.interp(edges, knots, total) if len(knots) else np.zeros(2 * cycles + 1)) / TURN
    return count, stuck[:cycles] + stuck[cycles:]


# Two stops in one ----------------------------------------------------------------------------------------------------

Move = tuple[float, float]
"""A move within a stop of the mean cycle that is no clear slip: its way (Y), and how long the stop is, in cycles."""


def parted(
    found: FloatArray, mean: FloatArray, *, noise: float, dwell: float, cycles: int
) -> tuple[FloatArray, Move | None]:
    """Part the stops in which the mean cycle stands in two places; return the largest move that may part one or not.

    Such is a slip beside a stop of less than `THIN` dwells, which may be a slow passage, and a step in the place of a
    stop that is too small to part it: a slip, or a creep. ``found`` (2, m): stops of all cycles; ``mean`` (p,): mean
    cycle as measured, with this much noise (rms) in a point; ``dwell``: shortest stop, radians of tau.
    """
    scale, split, moves = len(mean) / TURN, found, list[Move]()
    for begin, end in _of_the_middle(found, cycles):
        slip = _slip(mean, begin, end, noise, dwell)
        if slip is None:
            continue
        turns = TURN * (np.floor((split[0] - slip[0]) / TURN) + 1.0)  # taken out of each that holds it, in any cycle
        at, until = slip[0] + turns, slip[1] + turns
        inside = (at - split[0] > dwell) & (split[1] - until > dwell)
        first = np.concatenate([split[0], until[inside]])
        last = np.concatenate([np.where(inside, at, split[1]), split[1][inside]])
        split = np.array([first, last])[:, np.argsort(first, kind="stable")]
        if min(slip[0] - begin, end - slip[1]) < THIN * dwell:
            before, after = (mean[int(edge * scale) % len(mean)] for edge in slip)
            moves.append((abs(float(after - before)), (end - begin) / TURN))
    for begin, end in _of_the_middle(split, cycles):
        way = _hidden_step(mean, begin, end, noise, dwell)
        if way is not None:
            moves.append((way, (end - begin) / TURN))
    return split, max(moves, default=None)


def _of_the_middle(found: FloatArray, cycles: int) -> Iterator[tuple[float, float]]:
    """Stops that begin in the middle cycle, as radians from its start."""
    start = (cycles // 2) * TURN
    return ((begin - start, end - start) for begin, end in found.T.tolist() if start <= begin < start + TURN)


def _hidden_step(mean: FloatArray, begin: float, end: float, noise: float, dwell: float) -> float | None:
    """Size of the step in the place of a stop, where one is seen and explains more than a slope does."""
    scale = len(mean) / TURN
    edge = math.ceil(MARGIN * dwell * scale)
    x = mean[np.arange(math.ceil(begin * scale) + edge, math.floor(end * scale) - edge + 1) % len(mean)]
    n, least = len(x), max(2, edge)
    if n < 2 * least:
        return None
    before, k = np.cumsum(x)[:-1], np.arange(1.0, n)
    steps = (before[-1] + x[-1] - before) / (n - k) - before / k
    errors = np.abs(steps) * np.sqrt(k * (n - k) / n)  # times the noise
    best = least - 1 + int(np.argmax(errors[least - 1 : n - least]))
    ramp = np.arange(n) - 0.5 * (n - 1)
    slope = abs(float(np.dot(ramp, x))) / math.sqrt(float(np.dot(ramp, ramp)))
    return None if errors[best] < max(SEEN * noise, slope) else abs(float(steps[best]))


def _slip(mean: FloatArray, begin: float, end: float, noise: float, dwell: float) -> tuple[float, float] | None:
    """When a slip within a stop begins and ends (rad from the cycle's start), if there is one."""
    scale = len(mean) / TURN
    first, last, least = math.ceil(begin * scale), math.floor(end * scale), math.ceil(dwell * scale)
    if last - first < 2 * least + 1:
        return None
    x = mean[np.arange(first, last + 1) % len(mean)]
    before, after = float(x[:least].mean()), float(x[-least:].mean())
    way = after - before
    if abs(way) < 8.0 * noise:  # of a point of the mean cycle
        return None
    reach = least // 2
    width = 2 * reach + 1
    share = np.convolve(np.pad((x - before) / way, reach, mode="edge"), np.ones(width) / width, mode="valid")
    rough = FLAT + 2.0 * noise / math.sqrt(width) / abs(way)
    leaves = int(np.argmax(share > rough))
    comes = len(x) - int(np.argmax((share < 1.0 - rough)[::-1]))
    shorter = min(leaves, len(x) - comes)
    if comes - leaves >= 0.7 * shorter or shorter < least:  # a slip is shorter
        return None
    for stop in (x[:leaves], x[comes:]):  # its first and second half are in one place
        half = max(1, len(stop) // 2)
        apart = abs(float(stop[:half].mean()) - float(stop[-half:].mean()))
        if apart >= FLAT * abs(way) + 3.0 * noise * math.sqrt(2.0 / half):
            return None
    return (first + leaves) / scale, (first + comes) / scale
