"""Slips too slow for the velocity's threshold: one stop in two places is two stops."""

import math

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.stops import TURN, Stops

FloatArray = NDArray[np.float64]
CLEAR = 8.0  # way of a slip over the noise of one point of the mean cycle
FLAT = 0.15  # of the way: how much the mass may move before and after, so that a creep is no slip
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
    middle = cycles // 2
    slips = []
    for begin, end in zip(found.begin, found.end, strict=True):
        if middle * TURN <= begin < (middle + 1) * TURN:
            slip = _slip(mean, begin - middle * TURN, end - middle * TURN, noise, dwell)
            slips += [slip] if slip is not None else []
    for first, last in slips:
        found = _with(found, first, last, dwell)
    return found


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
