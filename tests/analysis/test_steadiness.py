"""Whether a motion is steady: transients, beats, trends, jumps, irregular cycles."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.analysis import steadiness
from frictionlab.analysis.signals import Stretch
from frictionlab.analysis.steadiness import irregularity_floor, irregularity_index
from tests.analysis import naive
from tests.desk import present


@pytest.mark.parametrize(("decay", "low", "high"), [(0.3, 15.0, 30.0), (2.0, 2.0, 6.0), (None, 0.0, 0.0)])
def test_the_transient_ends_where_mass_and_base_repeat(decay: float | None, low: float, high: float) -> None:
    """A free vibration of the size of the motion has fallen to half a per cent after 5.3 / decay."""
    t = np.arange(0.0, 70.0, 0.004)
    rng = np.random.default_rng(1)
    base = 1e-3 * np.cos(2 * np.pi * t) + 1e-6 * rng.standard_normal(len(t))
    free = 0.0 if decay is None else 1e-3 * np.exp(-decay * t) * np.cos(19.7 * t)
    start, settled = steadiness.transient([Stretch(0.0, 0.004, 1e-3 * np.sin(2 * np.pi * t) + free, base)], 0.0)
    assert low <= start <= high
    assert settled == start


def test_a_drive_that_starts_late_is_part_of_the_transient() -> None:
    t = np.arange(0.0, 60.0, 0.004)
    base = np.where(t < 12.0, 0.0, 1e-3 * np.sin(2 * np.pi * t))
    assert 11.0 < steadiness.transient([Stretch(0.0, 0.004, 0.5 * base, base)], 0.0)[0] < 15.0


@pytest.mark.parametrize("per_hour", [-0.5, -0.05, 0.2, 0.5])
@pytest.mark.parametrize("seconds", [300.0, 900.0, 1800.0])
def test_a_drift_to_the_end_is_no_transient(seconds: float, per_hour: float) -> None:
    """Of 900 s half was cut, as not settled: friction that wears, its start-up over after 5.3 times 3 s."""
    t = np.arange(0.0, seconds, 0.01)
    wear, rng = per_hour * t / 3600.0, np.random.default_rng(7)
    mass = (1 - wear) * np.sin(2 * np.pi * t + wear * (1 - wear)) + np.exp(-t / 3.0) * np.cos(19.7 * t)
    mass, base = (1e-3 * x + 1e-6 * rng.standard_normal(len(t)) for x in (mass, np.cos(2 * np.pi * t)))
    start, settled = steadiness.transient([Stretch(0.0, 0.01, mass, base)], 0.0)
    assert 13.0 < start < 30.0
    assert settled == start


def test_a_free_vibration_that_repeats_with_the_drive_is_part_of_the_transient() -> None:
    """At r = 1/2 it looks alike in every cycle: from 13 s on it moved the mean cycle by 2.5 standard errors."""
    rng, size, time = np.random.default_rng(8), 0.013, 13.0
    for seconds in (40.0, 80.0):
        t = np.arange(0.0, seconds, 0.004)
        base, free = np.cos(3 * np.pi * t), size * np.exp(-t / time) * np.cos(6 * np.pi * t)
        mass, base = (1e-3 * x + 1e-6 * rng.standard_normal(len(t)) for x in (np.sin(3 * np.pi * t) + free, base))
        start, settled = steadiness.transient([Stretch(0.0, 0.004, mass, base)], 0.0)
        assert settled is not None
        assert start == pytest.approx(min(settled, seconds / 2))
        assert 0.4e-3 < size * math.exp(-settled / time) < 2.5e-3


def test_of_a_motion_that_never_settles_half_is_left() -> None:
    t = np.arange(0.0, 40.0, 0.004)
    base = np.cos(2 * np.pi * t)
    length, settled = steadiness.transient([Stretch(0.0, 0.004, base * (1 + 0.02 * t), base)], 0.0)
    assert length == pytest.approx(20.0)
    assert settled is None


@pytest.mark.parametrize("seed", range(5))
def test_noise_does_not_jump(seed: int) -> None:
    assert len(steadiness.jumps(1 + 0.05 * np.random.default_rng(seed).standard_normal(400), noise=0.01)) == 0


def test_a_trend_is_found_with_honest_confidence() -> None:
    generator, time = np.random.default_rng(3), np.arange(0.0, 1800.0, 10.0)
    hits, slope = 0, 1e-4
    for _ in range(400):
        trend = present(steadiness.linear_trend(time, 1 + slope * time + 0.05 * generator.standard_normal(len(time))))
        hits += trend.low < slope < trend.high
    assert 0.92 < hits / 400 < 0.98


def test_autocorrelated_residuals_widen_the_confidence() -> None:
    generator, time = np.random.default_rng(4), np.arange(0.0, 1800.0, 10.0)
    value = np.zeros(180)
    for j in range(1, 180):
        value[j] = 0.7 * value[j - 1] + generator.standard_normal()
    wide = present(steadiness.linear_trend(time, value))
    shuffled = present(steadiness.linear_trend(time, generator.permutation(value)))
    assert wide.slope_se > 1.7 * shuffled.slope_se
    assert steadiness.linear_trend(time[:5], value[:5]) is None


WAVE = np.sin(2 * math.pi * np.arange(200) / 200)


@settings(max_examples=20, deadline=None)
@given(st.integers(2, 5), st.integers(3, 12), st.integers(0, 10_000))
def test_against_the_sums_of_the_equation(cycles: int, points: int, seed: int) -> None:
    rows = np.random.default_rng(seed).normal(size=(cycles, points))
    assert irregularity_index(rows) == pytest.approx(naive.irregularity_index(rows), rel=1e-12)


def test_no_pair_is_made_across_a_gap() -> None:
    rows = np.outer([1.0, 1.1, 5.0, 5.5], WAVE)
    assert irregularity_index(rows, (slice(0, 2), slice(2, 4))) == pytest.approx(0.1)


def test_what_has_no_index() -> None:
    assert irregularity_index(WAVE[None]) is None
    assert irregularity_index(np.zeros((4, 10))) is None
    assert irregularity_floor(np.zeros((4, 10)), 0.1) is None


def test_floor_is_what_noise_gives() -> None:
    rows = np.tile(WAVE, (300, 1)) + 1e-3 * np.random.default_rng(6).standard_normal((300, 200))
    floor = irregularity_floor(rows, 1e-3)
    assert irregularity_index(rows) == pytest.approx(floor, rel=0.01)
