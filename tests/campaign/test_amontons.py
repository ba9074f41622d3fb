"""Amontons' law: kept, broken, and not tested."""

import numpy as np
import pytest
from scipy import stats

from frictionlab.campaign import AmontonsTest
from frictionlab.campaign.laws import amontons, amontons_of
from frictionlab.estimate import Estimate


def judged(forces: tuple[float, ...], values: list[float], error: float = 0.01, tests: int = 10) -> AmontonsTest:
    covariance = np.diag(np.full(len(forces), error**2))
    return amontons("steel", np.array(forces), np.array(values), covariance, tests, Estimate(0.6, 0.01))


def test_equal_coefficients_keep_the_law() -> None:
    found = judged((1.0, 1.5, 2.0), [0.6] * 3)
    assert found.holds
    assert (found.coefficient, found.coefficient_se) == (0.6, 0.01)
    assert found.chi_square == pytest.approx(0.0)
    assert "may be the same under all 3 normal forces, as Amontons' law says" in found.verdict


def test_p_is_that_of_chi_square_with_many_tests_and_of_an_analysis_of_variance_with_few() -> None:
    values = [0.60, 0.62, 0.585, 0.61]
    found = judged((1.0, 1.5, 2.0, 3.0), values, tests=10**7)
    square = np.sum((np.array(values) - np.mean(values)) ** 2) / 0.01**2
    assert found.chi_square == pytest.approx(square)
    assert found.p == pytest.approx(stats.chi2.sf(square, 3), rel=1e-4)
    samples = np.array([[0.61, 0.63, 0.60, 0.64], [0.58, 0.57, 0.60, 0.59], [0.66, 0.62, 0.65, 0.64]])
    error = float(np.sqrt(samples.var(axis=1, ddof=1).mean() / 4))
    few = judged((1.0, 2.0, 3.0), samples.mean(axis=1).tolist(), error, tests=9)
    assert few.p == pytest.approx(stats.f_oneway(*samples).pvalue, rel=1e-9)


def test_what_all_forces_share_does_not_count_against_the_law() -> None:
    values, own = np.array([0.60, 0.62, 0.585]), np.diag(np.full(3, 0.01**2))
    forces = np.array([1.0, 1.5, 2.0])
    alone, shared = (
        amontons("steel", forces, values, covariance, 10, Estimate(0.6, 0.01)) for covariance in (own, own + 0.1**2)
    )
    assert shared.p == pytest.approx(alone.p, rel=1e-6)


def test_a_falling_coefficient_breaks_the_law_and_the_trend_is_said() -> None:
    forces = (1.0, 1.5, 2.0, 3.0, 4.0)
    found = judged(forces, [0.8 * n**-0.3 for n in forces], 0.004)
    assert found.holds is False
    assert found.exponent == pytest.approx(-0.3, abs=1e-9)
    assert f"falls with normal force, by {1 - 2**-0.3:.1%} at each doubling" in found.verdict


def test_a_scattered_coefficient_has_no_trend() -> None:
    found = judged((1.0, 1.5, 2.0, 3.0), [0.6, 0.7, 0.58, 0.66], 0.003)
    assert found.holds is False
    assert "without a clear trend" in found.verdict


def test_one_force_or_none_is_no_test_of_the_law() -> None:
    assert "under one normal force only" in judged((1.0,), [0.6]).verdict
    assert amontons_of("steel", [], {}, None).holds is None
