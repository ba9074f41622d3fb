"""Least squares inside bounds, its slopes spared: against closed forms, and against scipy's."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import least_squares, lsq_linear

from frictionlab.identification.coordinates import Coordinate, strains
from frictionlab.identification.descent import Misfit, Place, descend, inside

FloatArray = NDArray[np.float64]
Curve = Callable[[FloatArray], FloatArray | None]


def _place(misfit: Misfit, point: FloatArray) -> Place:
    residual = misfit.residual(point)
    assert residual is not None
    return Place(point, residual, misfit.slopes(point), strains(misfit.coordinates, point))


def _of(data: FloatArray, curve: Curve, coordinates: tuple[Coordinate, ...]) -> tuple[Misfit, list[int]]:
    """The misfit of a curve to data, slopes by central differences; and how often slopes were asked for."""
    asked: list[int] = []

    def residual(point: FloatArray) -> FloatArray | None:
        there = curve(point)
        return None if there is None else data - there

    def slopes(point: FloatArray) -> FloatArray:
        asked.append(1)
        return np.stack([_slope(curve, point, step) for step in 1e-6 * np.eye(len(point))], axis=1)

    return Misfit(coordinates, residual, slopes), asked


def _slope(curve: Curve, point: FloatArray, step: FloatArray) -> FloatArray:
    """By a difference to one side, or to the other where the curve ends."""
    here = curve(point)
    assert here is not None
    for side in (step, -step):
        there = curve(point + side)
        if there is not None:
            return np.asarray((there - here) / side.sum())
    return np.zeros_like(here)


def _decay(point: FloatArray) -> FloatArray:
    t = np.linspace(0.0, 3.0, 40)
    return np.asarray(200.0 * np.exp(point[0] - np.exp(point[1]) * t) * np.cos((3.0 + point[2]) * t))


def test_a_straight_problem_is_solved_in_a_few_steps_with_its_slopes_asked_for_once() -> None:
    matrix = np.random.default_rng(3).standard_normal((20, 3))
    data = matrix @ np.array([0.5, -0.3, 0.2])
    free = tuple(Coordinate(name, "") for name in "abc")
    misfit, asked = _of(data, lambda point: matrix @ point, free)
    found = descend(misfit, _place(misfit, np.zeros(3)), most=20)
    exact = np.linalg.solve(matrix.T @ matrix + np.eye(3), matrix.T @ data)
    assert found.point == pytest.approx(exact, abs=1e-3)
    assert found.slopes == pytest.approx(matrix, abs=1e-6)
    assert len(asked) == 2  # at the start, and at the end: the point returned is the best by true slopes


@given(st.integers(0, 10_000))
def test_the_least_inside_bounds_is_scipys(seed: int) -> None:
    draw = np.random.default_rng(seed)
    n = int(draw.integers(1, 9))
    matrix, data = draw.standard_normal((n + 4, n)), 2.0 * draw.standard_normal(n + 4)
    low, high = -draw.exponential(0.7, n) * draw.integers(0, 2, n), draw.exponential(0.7, n) + 1e-3
    found = inside(matrix.T @ matrix, -matrix.T @ data, low, high)
    twin = lsq_linear(matrix, data, bounds=(low - 1e-12, high), method="bvls", tol=1e-14)
    assert np.all((found >= low) & (found <= high))
    assert np.sum((matrix @ found - data) ** 2) == pytest.approx(2.0 * twin.cost, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(("low", "tail"), [(-12.0, np.inf), (0.1, np.inf), (-12.0, 1.0)])
def test_a_bent_problem_ends_where_scipys_does(low: float, tail: float) -> None:
    """Free, with a bound that it meets, and with a prior that has tails."""
    data = _decay(np.array([0.4, -0.6, 0.3])) + np.random.default_rng(5).standard_normal(40)
    known = tuple(Coordinate(name, "", low=low if name == "b" else -12.0, tail=tail) for name in "abc")
    misfit, asked = _of(data, _decay, known)
    start = np.array([0.0, 0.2, 0.0])
    found = descend(misfit, _place(misfit, start), most=60)

    def residuals(point: FloatArray) -> FloatArray:
        return np.concatenate([data - _decay(point), strains(known, point)])

    bounds = np.array([c.low for c in known]) - 1e-12, np.full(3, np.inf)
    twin = least_squares(residuals, start, bounds=bounds, xtol=1e-14, ftol=1e-14)
    missed = max(1.0, 2.0 * twin.cost / len(data))  # what misses the data is sought less sharply
    assert found.squares == pytest.approx(2.0 * twin.cost, rel=1e-6 * min(missed, 100.0))
    error = np.sqrt(missed * np.diag(np.linalg.inv(found.slopes.T @ found.slopes + np.eye(3))))
    assert np.all(np.abs(found.point - twin.x) < 0.05 * error)
    assert found.true
    assert twin.njev is not None
    assert len(asked) < twin.njev


def test_where_nothing_is_foretold_the_way_goes_round() -> None:
    """A curve that ends before the best point: the nearest that can be reached from the start is given."""
    data = _decay(np.array([0.4, 0.3, 0.0]))
    free = tuple(Coordinate(name, "") for name in "abc")
    misfit, _ = _of(data, lambda point: None if point[1] > 0.2 else _decay(point), free)
    begun = _place(misfit, np.zeros(3))
    found = descend(misfit, begun, most=60)
    assert 0.15 < found.point[1] <= 0.2
    assert found.squares < 0.1 * begun.squares
