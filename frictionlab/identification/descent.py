"""Least squares with priors inside bounds, sparing the slopes: what a fit pays for is derivatives of steady states.

Gauss and Newton's step, exact inside the bounds (an active set), in no coordinate longer than a reach that grows where
the sum of squares falls as foretold, and shrinks where it does not (a trust region). Between two steps the slopes are
not asked for again but corrected by what the step has shown (C. G. Broyden, Math. Comp. 19 (1965) 577); they are where
a step disappoints, and at the end, so that the point returned is the best by true slopes.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from frictionlab.identification.coordinates import Coordinate, strain_slopes, strains

FloatArray = NDArray[np.float64]
ENOUGH = 1e-7  # of the sum of squares: a step that is foretold to gain less is not made ...
MISSED = 100.0  # ... times squares over data up to this: values that miss the data are so much less sure
GOOD, POOR = 0.75, 0.25  # gained over foretold, from which steps may be longer, and below which they must be shorter
LONGER, SHORTER = 2.0, 0.25
REACH = 1.0  # deviations of its prior that any coordinate may go in the first step
LEAST = 1e-9  # the same, where no shorter step is tried


@dataclass(frozen=True)
class Misfit:
    """What is made least: data minus prediction, whitened and weighed, at any point.

    ``residual``: point -> (m,), None where there is no prediction; ``slopes``: point -> (m, n), the prediction's.
    """

    coordinates: tuple[Coordinate, ...]
    residual: Callable[[FloatArray], FloatArray | None]
    slopes: Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Place:
    """A point reached: its residual, slopes of the prediction, and whether these are true there or corrected ones."""

    point: FloatArray
    residual: FloatArray
    slopes: FloatArray
    strain: FloatArray
    true: bool = True

    @property
    def squares(self) -> float:
        """Sum of squares, priors counted."""
        return float(self.residual @ self.residual + self.strain @ self.strain)

    def moved(self, point: FloatArray, residual: FloatArray, strain: FloatArray) -> Self:
        """Return the place after a step, its slopes corrected by what the step has shown."""
        step = point - self.point
        shown = (self.residual - residual) - self.slopes @ step
        return replace(
            self,
            point=point,
            residual=residual,
            strain=strain,
            slopes=self.slopes + np.outer(shown, step / float(step @ step)),
            true=False,
        )


def descend(misfit: Misfit, start: Place, *, most: int) -> Place:
    """Return the best place near a start, its slopes true; `most`: how often the residual may be asked for."""
    here, reach = start, REACH
    for _ in range(most):
        step, foretold = _step(misfit.coordinates, here, reach)
        missed = min(max(here.squares / len(here.residual), 1.0), MISSED)
        if foretold <= ENOUGH * missed * here.squares or reach < LEAST:
            if here.true:
                return _last(misfit, here, step)
            here, reach = _true(misfit, here), max(reach, LEAST)
            continue
        here, reach = _after(misfit, here, step, foretold, reach)
    return here if here.true else _true(misfit, here)


def _last(misfit: Misfit, here: Place, step: FloatArray) -> Place:
    """The place after a step too short to change slopes, if it leads down."""
    point = here.point + step
    residual, strain = misfit.residual(point), strains(misfit.coordinates, point)
    if residual is None or residual @ residual + strain @ strain > here.squares:
        return here
    return replace(here, point=point, residual=residual, strain=strain)


def _true(misfit: Misfit, here: Place) -> Place:
    return replace(here, slopes=misfit.slopes(here.point), true=True)


def _after(misfit: Misfit, here: Place, step: FloatArray, foretold: float, reach: float) -> tuple[Place, float]:
    """The place after a step, or the same one where it does not lead down; and how far the next may go."""
    point, length = here.point + step, float(np.abs(step).max())
    residual, strain = misfit.residual(point), strains(misfit.coordinates, point)
    squares = math.inf if residual is None else float(residual @ residual + strain @ strain)
    ratio = (here.squares - squares) / foretold
    if residual is None or ratio <= 0.0:
        return (here, SHORTER * length) if here.true else (_true(misfit, here), reach)
    there = here.moved(point, residual, strain)
    if ratio < POOR:
        return _true(misfit, there), SHORTER * length if here.true else reach
    return there, max(reach, LONGER * length) if ratio > GOOD else reach


def _step(coordinates: tuple[Coordinate, ...], here: Place, reach: float) -> tuple[FloatArray, float]:
    """The step to the least of the sum of squares as slopes foretell it, and by how much it falls."""
    bent = strain_slopes(coordinates, here.point)
    curvature = here.slopes.T @ here.slopes + np.diag(bent**2)
    slope = bent * here.strain - here.slopes.T @ here.residual
    low = np.maximum(np.array([c.low for c in coordinates]) - here.point, -reach)
    high = np.minimum(np.array([c.high for c in coordinates]) - here.point, reach)
    step = inside(curvature, slope, low, high)
    return step, -float(2.0 * slope @ step + step @ curvature @ step)


def inside(curvature: FloatArray, slope: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the x (n,) of the least ``x C x / 2 + g x`` with ``low <= x <= high``, from 0 on, by an active set.

    Bounds are met one at a time, and left one at a time, the one that is pulled from most first: each step leads down.

    Examples
    --------
    >>> bowl, none = np.array([[2.0, 1.0], [1.0, 2.0]]), np.full(2, np.inf)
    >>> inside(bowl, np.array([-3.0, 0.0]), -none, none).tolist()
    [2.0, -1.0]
    >>> inside(bowl, np.array([-3.0, 0.0]), np.array([-9.0, 0.0]), none).tolist()
    [1.5, 0.0]
    """
    x = np.zeros(len(slope))
    held = ((low >= 0.0) & (slope > 0.0)) | ((high <= 0.0) & (slope < 0.0))
    for _ in range(8 * len(x)):
        way = np.zeros(len(x))
        pull = curvature @ x + slope
        way[~held] = np.linalg.solve(curvature[np.ix_(~held, ~held)], -pull[~held])
        room = np.where(way < 0.0, low - x, high - x)
        share = np.divide(room, way, out=np.full(len(x), np.inf), where=way != 0.0)
        first = int(np.argmin(share))
        if share[first] < 1.0:
            x = x + share[first] * way
            x[first] = low[first] if way[first] < 0.0 else high[first]
            held[first] = True
            continue
        x, pull = x + way, pull + curvature @ way
        pulled = np.where(held, np.where(x <= low, -pull, pull), 0.0)
        if pulled.max(initial=0.0) <= 0.0:
            break
        held[int(np.argmax(pulled))] = False
    return x
