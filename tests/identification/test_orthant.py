"""What a bound takes away of a normal curve, several bounds that hang together at once."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import dblquad
from scipy.special import log_ndtr
from scipy.stats import multivariate_normal

from frictionlab.identification.orthant import log_orthant

FloatArray = NDArray[np.float64]


def matrix(rho: float, *deviations: float) -> FloatArray:
    """A covariance whose pairs all hang together alike."""
    k = len(deviations)
    return np.asarray((np.full((k, k), rho) + (1.0 - rho) * np.eye(k)) * np.outer(deviations, deviations))


@pytest.mark.parametrize("rho", [-0.99, -0.5, 0.0, 0.7, 0.99])
def test_two_dimensions_about_zero_are_the_arcsine(rho: float) -> None:
    """Sheppard 1899: 1/4 + asin(rho) / 2 pi."""
    found = float(np.exp(log_orthant(np.zeros(2), matrix(rho, 1.0, 3.0))))
    assert found == pytest.approx(0.25 + math.asin(rho) / (2.0 * math.pi), rel=1e-4)


@pytest.mark.parametrize("rho", [-0.4, 0.0, 0.6, 0.95])
def test_three_dimensions_about_zero_are_three_arcsines(rho: float) -> None:
    found = float(np.exp(log_orthant(np.zeros(3), matrix(rho, 1.0, 0.2, 5.0))))
    assert found == pytest.approx(0.125 + 3.0 * math.asin(rho) / (4.0 * math.pi), rel=1e-4)


def test_one_dimension_is_the_error_function_however_far() -> None:
    peaks = np.array([[-40.0], [-3.0], [0.0], [2.0], [30.0]])
    assert log_orthant(peaks, np.full((5, 1, 1), 4.0)) == pytest.approx(log_ndtr(peaks[:, 0] / 2.0), abs=1e-12)


@pytest.mark.parametrize("peak", [(-0.5, 0.3, 1.0), (1.5, -1.0, 0.2), (0.4, 0.4, -1.5)])
@pytest.mark.parametrize("rho", [-0.4, 0.8])
def test_three_dimensions_are_scipys_where_it_can(peak: tuple[float, ...], rho: float) -> None:
    covariance = matrix(rho, 1.0, 0.5, 2.0)
    whole = multivariate_normal.cdf(np.array(peak), np.zeros(3), covariance, abseps=1e-8, releps=1e-8)
    assert float(log_orthant(np.array(peak), covariance)) == pytest.approx(math.log(whole), abs=2e-4)


@pytest.mark.parametrize(("peak", "rho"), [((-6.0, -9.0), 0.9), ((-6.0, 2.0), -0.9), ((-20.0, -0.1), 0.3)])
def test_peaks_far_beyond_their_bounds_are_integrated_as_by_quadrature(peak: tuple[float, float], rho: float) -> None:
    covariance = matrix(rho, 1.0, 2.0)
    precision, mean = np.linalg.inv(covariance), np.array(peak)
    force = precision @ mean

    def curve(y: float, x: float) -> float:
        point = np.array([x, y])
        return math.exp(float(force @ point - 0.5 * point @ precision @ point - top))

    top = max(float(force @ p - 0.5 * p @ precision @ p) for p in np.mgrid[0:8:81j, 0:8:81j].reshape(2, -1).T)
    wanted = top + math.log(dblquad(curve, 0.0, 12.0, 0.0, 40.0)[0]) - 0.5 * float(mean @ force)
    wanted += 0.5 * float(np.linalg.slogdet(precision)[1]) - math.log(2.0 * math.pi)
    assert float(log_orthant(mean, covariance)) == pytest.approx(wanted, abs=2e-4)


def test_four_dimensions_that_do_not_hang_together_are_a_product() -> None:
    peak, deviations = np.array([-1.0, 0.3, 2.0, -4.0]), np.array([1.0, 0.5, 3.0, 1.0])
    found = float(log_orthant(peak, np.diag(deviations**2)))
    assert found == pytest.approx(float(log_ndtr(peak / deviations).sum()), abs=1e-3)


def test_many_curves_at_once_are_each_alone() -> None:
    rng = np.random.default_rng(4)
    roots = rng.standard_normal((7, 3, 3))
    covariances = roots @ np.swapaxes(roots, 1, 2) + 0.1 * np.eye(3)
    peaks = 2.0 * rng.standard_normal((7, 3))
    alone = [float(log_orthant(p, c)) for p, c in zip(peaks, covariances, strict=True)]
    assert log_orthant(peaks, covariances) == pytest.approx(alone, abs=1e-9)
