import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.analysis.signals import sensor_step, white_noise


@settings(max_examples=20, deadline=None)
@given(st.floats(1e-7, 1.0), st.integers(0, 1000))
def test_noise_is_found_under_a_motion(noise: float, seed: int) -> None:
    t = np.arange(30_000) / 500
    signal = np.cos(2 * math.pi * 2 * t) + noise * np.random.default_rng(seed).standard_normal(len(t))
    assert white_noise(signal) == pytest.approx(math.hypot(noise, 1e-9), rel=0.03)


def test_quantisation_counts_as_noise() -> None:
    signal = np.random.default_rng(1).normal(0, 0.8, 50_000)
    assert white_noise(np.round(signal)) == pytest.approx(math.sqrt(0.64 + 1 / 12), rel=0.02)


def test_shocks_and_kinks_stay_out() -> None:
    generator = np.random.default_rng(2)
    signal = np.abs(np.sin(np.arange(20_000) / 100)) + 1e-4 * generator.standard_normal(20_000)
    signal[::2000] += 1.0
    assert white_noise(signal) == pytest.approx(1e-4, rel=0.15)


def test_the_sensors_step_is_read_off_its_levels() -> None:
    signal = np.cumsum(np.random.default_rng(3).normal(0, 1, 5000))
    assert sensor_step(np.round(signal / 0.778) * 0.778) == pytest.approx(0.778)
    assert sensor_step(signal) == 0.0
