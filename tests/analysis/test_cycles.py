import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.analysis import cycles, signals

N, FREQUENCY = 20_000, 0.00734567


def base_of(turns: np.ndarray) -> np.ndarray:
    """A base with offset and harmonics whose fundamental has its tops at whole turns."""
    angle = 2 * math.pi * turns
    return 0.4 + np.cos(angle) + 0.05 * np.cos(2 * angle + 1) + 0.02 * np.sin(3 * angle)


def test_interpolation_is_exact_for_cubics_between_uneven_positions() -> None:
    i = np.arange(50.0)
    cubic = 1 + 0.3 * i - 0.02 * i**2 + 0.001 * i**3
    at = np.array([0.0, 0.1, 1.0, 7.3, 24.999, 47.5, 48.9, 49.0])
    np.testing.assert_allclose(cycles.interpolate(cubic, at), 1 + 0.3 * at - 0.02 * at**2 + 0.001 * at**3, rtol=1e-12)


def test_noise_left_by_interpolation_is_as_stated() -> None:
    generator = np.random.default_rng(0)
    values = cycles.interpolate(generator.standard_normal(400_000), generator.uniform(2, 399_990, 400_000))
    assert values.var() == pytest.approx(cycles.INTERPOLATED, rel=0.01)


def test_cycles_start_where_the_fundamental_rises_through_zero() -> None:
    cut = cycles.cut(base_of(FREQUENCY * np.arange(N) + 0.3), FREQUENCY * (1 + 2e-5), noise=1e-6)
    turns = FREQUENCY * cut.start + 0.3
    np.testing.assert_allclose(turns + 0.25, np.rint(turns + 0.25), atol=1e-6)
    np.testing.assert_allclose(cut.end - cut.start, 1 / FREQUENCY, rtol=1e-6)
    np.testing.assert_array_equal(cut.start[1:], cut.end[:-1])
    assert cut.frequency == pytest.approx(FREQUENCY, rel=1e-7)
    assert not cut.drifts


def test_the_cut_follows_a_drive_that_drifts() -> None:
    i = np.arange(N)
    turns = FREQUENCY * i + 1.5e-9 * (i - N / 2) ** 2  # 0.8 % change of speed over the test
    cut = cycles.cut(base_of(turns), FREQUENCY, noise=1e-6)
    at = np.interp(cut.start, i, turns)
    assert cut.drifts
    np.testing.assert_allclose(at + 0.25, np.rint(at + 0.25), atol=2e-4)
    constant = cycles.cut(base_of(FREQUENCY * i), FREQUENCY, noise=1e-6)
    assert cut.frequency_se > 100 * constant.frequency_se


@settings(max_examples=25, deadline=None)
@given(st.floats(0.0005, 0.05), st.floats(0, 1))
def test_full_cycles_fill_the_record(frequency: float, phase: float) -> None:
    cut = cycles.cut(base_of(frequency * np.arange(N) + phase), frequency, noise=1e-6)
    assert N * frequency - 2 <= len(cut) <= N * frequency
    assert cut.frequency == pytest.approx(frequency, rel=1e-5)


def test_folding_is_interpolating_evenly_from_start_to_end() -> None:
    signal = np.random.default_rng(1).standard_normal(500_000)  # more than is folded at a time
    start = np.arange(3.0, 499_000.0, 97.3)
    rows = cycles.fold(signal, start, start + 97.3, 104)
    for number in (0, 700, len(start) - 1):
        at = start[number] + 97.3 * np.arange(104) / 104
        np.testing.assert_allclose(rows[number], cycles.interpolate(signal, at), atol=1e-9)


def test_stamps_written_coarsely_are_even() -> None:
    even, stray = signals.evenly(np.round(np.arange(500) / 300.0, 3), 1 / 300.0, {"mass": np.ones(500)})
    assert (stray, len(even["mass"])) == (0.0, 500)
