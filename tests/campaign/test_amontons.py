"""Amontons' law: kept, broken, and not tested."""

import numpy as np
import pytest
from scipy import stats

from frictionlab.campaign.amontons import amontons
from frictionlab.campaign.friction import FrictionFit
from frictionlab.estimate import Estimate


def fit_of(force: float, coefficient: float | None, error: float = 0.01, freedom: int = 10) -> FrictionFit:
    known = Estimate(coefficient, error)
    return FrictionFit("steel", force, (), known, known, known, None, None, freedom, 0.0, "")


def test_equal_coefficients_keep_the_law() -> None:
    found = amontons("steel", [fit_of(n, 0.6) for n in (1.0, 1.5, 2.0)])
    assert found.holds
    assert found.coefficient == pytest.approx(0.6)
    assert found.coefficient_se == pytest.approx(0.01 / np.sqrt(3))
    assert found.chi_square == pytest.approx(0.0)
    assert "may be the same under all 3 normal forces, as Amontons' law says" in found.verdict


def test_with_many_tests_p_is_that_of_chi_square() -> None:
    values = (0.60, 0.62, 0.585, 0.61)
    found = amontons("steel", [fit_of(n, c, freedom=10**7) for n, c in zip((1.0, 1.5, 2.0, 3.0), values, strict=True)])
    square = np.sum((np.array(values) - np.mean(values)) ** 2) / 0.01**2
    assert found.chi_square == pytest.approx(square)
    assert found.p == pytest.approx(stats.chi2.sf(square, 3), rel=1e-4)


def test_p_is_that_of_welch_for_errors_from_few_tests() -> None:
    samples = [[0.61, 0.63, 0.60, 0.64], [0.58, 0.57, 0.60], [0.66, 0.62, 0.65, 0.64, 0.63]]
    fits = [
        fit_of(n, float(np.mean(s)), float(np.std(s, ddof=1) / np.sqrt(len(s))), len(s) - 1)
        for n, s in zip((1.0, 2.0, 3.0), samples, strict=True)
    ]
    expected = stats.f_oneway(*samples, equal_var=False).pvalue
    assert amontons("steel", fits).p == pytest.approx(expected, rel=1e-9)


def test_a_falling_coefficient_breaks_the_law_and_the_trend_is_said() -> None:
    forces = (1.0, 1.5, 2.0, 3.0, 4.0)
    found = amontons("rubber", [fit_of(n, 0.8 * n**-0.3, 0.004) for n in forces])
    assert found.holds is False
    assert found.exponent == pytest.approx(-0.3, abs=1e-9)
    assert f"falls with normal force, by {1 - 2**-0.3:.1%} at each doubling" in found.verdict


def test_a_scattered_coefficient_has_no_trend() -> None:
    found = amontons("steel", [fit_of(n, c, 0.003) for n, c in ((1.0, 0.6), (1.5, 0.7), (2.0, 0.58), (3.0, 0.66))])
    assert found.holds is False
    assert "without a clear trend" in found.verdict


def test_one_force_or_none_is_no_test_of_the_law() -> None:
    assert "under one normal force only" in amontons("steel", [fit_of(1.0, 0.6)]).verdict
    assert amontons("steel", [fit_of(1.0, None)]).holds is None
