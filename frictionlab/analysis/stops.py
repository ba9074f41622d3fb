"""Stops and regime: two velocity thresholds and a shortest dwell, tied to the sensor's noise."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True)
class Thresholds:
    """When the mass counts as standing.

    ``slow``, ``still``: velocities (by tau) below which a stop may last and must have come; ``dwell``: the shortest
    stop, radians of tau.
    """

    slow: float
    still: float
    dwell: float


@dataclass(frozen=True)
class Stop:
    """Stops of consecutive cycles: ``begin`` and ``end`` (m,) in radians of tau from the first cycle's start."""

    begin: FloatArray
    end: FloatArray


def find_stops(v: FloatArray, thresholds: Thresholds) -> Stop:
    """Find the stops in consecutive cycles.

    A stop is a run of |v| below ``slow`` that falls below ``still`` somewhere and lasts at least ``dwell``.

    Parameters
    ----------
    v : (n, points) array
        Velocity by tau, one cycle a row; rows follow each other.
    """
    speed = np.abs(v).ravel()
    step = 2.0 * math.pi / v.shape[1]
    begin, end = runs(speed < thresholds.slow)
    if len(begin) == 0:
        return Stop(np.zeros(0), np.zeros(0))
    least = np.minimum.reduceat(speed, begin)
    long_enough = (least < thresholds.still) & ((end - begin) * step >= thresholds.dwell)
    return Stop(begin[long_enough] * step, end[long_enough] * step)


def runs(mask: BoolArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First and one-past-last index of each run of True.

    Examples
    --------
    >>> [edge.tolist() for edge in runs(np.array([True, False, True, True]))]
    [[0, 2], [1, 4]]
    """
    edges = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)


def thresholds(v_noise: float, resolution: float) -> Thresholds:
    """Thresholds for a velocity with this much noise (by tau) and this resolution (radians of tau)."""
    still = max(3.0 * v_noise, 1e-3)
    return Thresholds(slow=2.0 * still, still=still, dwell=max(2.0 * math.pi * 0.015, 2.0 * resolution))


def joined(parts: list[Stop], first_cycles: list[int]) -> Stop:
    """The stops of several blocks of cycles, counted from the first cycle; one that a block's edge cut is whole."""
    turn = 2.0 * math.pi
    begin = np.concatenate([part.begin + turn * first for part, first in zip(parts, first_cycles, strict=True)])
    end = np.concatenate([part.end + turn * first for part, first in zip(parts, first_cycles, strict=True)])
    touching = np.flatnonzero(begin[1:] - end[:-1] < 1e-9)
    return Stop(np.delete(begin, touching + 1), np.delete(end, touching))


def per_cycle(found: Stop, cycles: int) -> tuple[FloatArray, FloatArray]:
    """Stops of each cycle (counted where their middle lies) and the fraction of each cycle spent standing, (n,)."""
    turn = 2.0 * math.pi
    middle = np.clip((0.5 * (found.begin + found.end) // turn).astype(np.intp), 0, cycles - 1)
    count = np.bincount(middle, minlength=cycles).astype(np.float64)
    edges = turn * np.arange(cycles + 1)
    stood = np.concatenate([[0.0], np.cumsum(found.end - found.begin)])
    knots = np.stack([found.begin, found.end], axis=1).ravel()
    total = np.stack([stood[:-1], stood[1:]], axis=1).ravel()
    passed = np.interp(edges, knots, total) if len(knots) else np.zeros(cycles + 1)
    return count, np.diff(passed) / turn
