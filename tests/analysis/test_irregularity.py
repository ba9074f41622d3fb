import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.analysis.steadiness import irregularity_floor, irregularity_index
from tests.analysis import naive

WAVE = np.sin(2 * math.pi * np.arange(200) / 200)


def test_index_known_by_construction() -> None:
    sizes = np.array([1.0, 1.2, 0.9, 0.9])
    expected = np.mean(np.abs(np.diff(sizes)) / sizes[:-1])
    assert irregularity_index(np.outer(sizes, WAVE)) == pytest.approx(expected, rel=1e-12)


def test_a_motion_that_repeats_has_index_zero() -> None:
    assert irregularity_index(np.tile(WAVE, (5, 1))) == 0.0


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
