"""Means of a few correlated cycles, noise and step of a sensor, stamps that jump."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import toeplitz
from scipy.stats import multivariate_normal

from frictionlab.analysis.signals import (
    SHARES,
    WANDERS,
    evenly,
    pair_squares,
    pair_variances,
    sensor_step,
    student,
    variance_inflation,
    white_noise,
)
from frictionlab.errors import AnalysisError

FloatArray = NDArray[np.float64]


def autocorrelation(share: float, wander: float, n: int) -> FloatArray:
    """Of ``(1 - share) f[k] + share f[k+1]``, written out."""
    lag = np.arange(n)

    def of_friction(k: NDArray[np.int64]) -> FloatArray:
        return np.where(k == 0, 1.0, float(wander) ** np.abs(k))

    found = (share**2 + (1 - share) ** 2) * of_friction(lag)
    found = found + share * (1 - share) * (of_friction(lag + 1) + of_friction(lag - 1))
    return np.asarray(found / found[0])


def test_likelihood_and_mean_are_those_of_the_covariance_written_out() -> None:
    """Ratios of the likelihood of a series, its mean free (Gauss), against scipy's of all differences of neighbours."""
    n, series = 9, np.random.default_rng(3).standard_normal(9)
    differences = np.eye(n)[1:] - np.eye(n)[:-1]
    square, size = pair_squares(series[:, None])
    ours, wanted, spread = size[:, 0] - 0.5 * square[:, 0], [], []
    for share, wander in [(s, w) for w in WANDERS for s in SHARES]:
        covariance = toeplitz(autocorrelation(share, wander, n))
        wanted.append(multivariate_normal.logpdf(differences @ series, cov=differences @ covariance @ differences.T))
        spread.append(covariance.sum() / n**2)
    assert np.diff(ours) == pytest.approx(np.diff(wanted), abs=1e-8)
    assert pair_variances(n)[:, 0] == pytest.approx(spread, rel=1e-12)


@pytest.mark.parametrize(("share", "wander"), [(0.0, 0.0), (0.25, 0.0), (0.5, 0.0), (-0.6, 0.0), (0.5, 0.6)])
def test_the_error_of_a_mean_covers_wherever_friction_changes_in_a_cycle(share: float, wander: float) -> None:
    """Rms of error over stated error of 600 means of 63 cycles; friction that changes in mid-cycle had 0.8."""
    n, rng = 63, np.random.default_rng(7)
    root = np.linalg.cholesky(toeplitz(autocorrelation(share, wander, n)))
    series = root @ rng.standard_normal((n, 600))
    score = series.mean(axis=0) / np.sqrt(
        series.var(axis=0, ddof=1) / n * variance_inflation(series) * student(n - 1.0)
    )
    assert math.sqrt(float(np.mean(score**2))) == pytest.approx(1.0, abs=0.1)


def test_friction_that_wanders_over_thirty_cycles_is_seen_in_four_hundred() -> None:
    """Rms of error over stated error: 1.7 where no wander over more than 20 cycles was thought of."""
    root: FloatArray = np.asarray(np.linalg.cholesky(toeplitz(autocorrelation(0.0, 0.97, 400))))
    series: FloatArray = np.asarray(root @ np.random.default_rng(5).standard_normal((400, 300)))
    score = series.mean(axis=0) / np.sqrt(
        series.var(axis=0, ddof=1) / 400.0 * variance_inflation(series) * student(399.0)
    )
    assert math.sqrt(float(np.mean(score**2))) < 1.35


def test_a_series_that_does_not_vary_is_not_inflated() -> None:
    assert variance_inflation(np.ones((6, 2))).tolist() == [1.0, 1.0]
    rounded: FloatArray = 0.7 + 1e-16 * np.arange(6.0)[:, None]
    assert variance_inflation(rounded).tolist() == [1.0]


@settings(max_examples=20, deadline=None)
@given(st.floats(1e-7, 1.0), st.integers(0, 1000))
def test_noise_is_found_under_a_motion(noise: float, seed: int) -> None:
    t = np.arange(30_000) / 500
    signal = np.cos(2 * math.pi * 2 * t) + noise * np.random.default_rng(seed).standard_normal(len(t))
    assert white_noise(signal) == pytest.approx(math.hypot(noise, 1e-9), rel=0.03)


def test_shocks_and_kinks_stay_out() -> None:
    generator = np.random.default_rng(2)
    signal = np.abs(np.sin(np.arange(20_000) / 100)) + 1e-4 * generator.standard_normal(20_000)
    signal[::2000] += 1.0
    assert white_noise(signal) == pytest.approx(1e-4, rel=0.15)


def test_the_sensors_step_is_read_off_its_levels() -> None:
    signal = np.cumsum(np.random.default_rng(3).normal(0, 1, 5000))
    assert sensor_step(np.round(signal / 0.778) * 0.778) == pytest.approx(0.778)
    assert sensor_step(signal) == 0.0


def test_unflagged_jumps_are_refused_by_size() -> None:
    t = np.arange(2000) / 250
    t[1000:] += 1.7e9
    with pytest.raises(AnalysisError, match=r"jump from 3.996 to 1.7e\+09 s, unflagged: 2000 samples would become"):
        evenly(t, 0.004, {"mass": t})


def test_a_sensor_at_rest_for_long_has_the_step_of_its_motion() -> None:
    """Only the first 20,000 samples were looked at: 0 was found."""
    signal = np.concatenate([np.zeros(20_000), np.round(1e3 * np.sin(np.arange(20_000) * 0.01))])
    assert sensor_step(signal) == 1.0
