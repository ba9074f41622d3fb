import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.analysis import energy
from frictionlab.analysis.measurement import used_cycles
from frictionlab.errors import AnalysisError, UsageError
from tests.analysis import naive

TAU = 2 * math.pi * np.arange(64) / 64


@settings(max_examples=50, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 4), min_size=1, max_size=4))
def test_area_of_fourier_series_in_closed_form(harmonics: list[tuple[float, float, float, float]]) -> None:
    """The loop integral of y dx is pi sum k (a_k d_k - b_k c_k)."""
    x, y, expected = np.zeros(256), np.zeros(256), 0.0
    tau = 2 * math.pi * np.arange(256) / 256
    for k, (a, b, c, d) in enumerate(harmonics, 1):
        y += a * np.cos(k * tau) + b * np.sin(k * tau)
        x += c * np.cos(k * tau) + d * np.sin(k * tau)
        expected += math.pi * k * (a * d - b * c)
    assert energy.loop_area(x[None], y[None])[0] == pytest.approx(expected, abs=1e-4)


def test_richardson_beats_the_polygon() -> None:
    x, y = 0.5 * np.sin(TAU), np.cos(TAU)
    polygon, area = naive.shoelace(x, y), energy.loop_area(x[None], y[None])[0]
    assert abs(polygon / (0.5 * math.pi) - 1) == pytest.approx(1.6e-3, rel=0.01)
    assert abs(area / (0.5 * math.pi) - 1) < 4e-6


def test_energy_input_is_the_loop_of_a_cosine_base() -> None:
    tau = TAU - math.pi / 2
    x = (0.3 * np.sin(tau) - 0.2 * np.cos(tau) + 0.1 * np.sin(3 * tau))[None]
    assert energy.energy_input(x)[0] == pytest.approx(0.3 * math.pi, rel=1e-12)
    assert energy.loop_area(x, np.cos(tau)[None])[0] == pytest.approx(0.3 * math.pi, rel=1e-4)


def test_noise_of_a_loop_is_as_stated() -> None:
    generator = np.random.default_rng(2)
    x, y, sx, sy = 0.5 * np.sin(TAU), np.cos(TAU), 0.02, 0.01
    areas = energy.loop_area(
        x + sx * generator.standard_normal((4000, 64)), y + sy * generator.standard_normal((4000, 64))
    )
    assert areas.std() == pytest.approx(energy.loop_area_noise(x, y, sx, sy, 64.0), rel=0.05)


def test_rules_choose_their_cycles() -> None:
    edges = np.arange(0.0, 11.0) * 2.0  # ten cycles of 2 s
    assert used_cycles(edges, "last") == slice(9, 10)
    assert used_cycles(edges, "all") == slice(0, 10)
    assert used_cycles(edges, "window:5") == slice(8, 10)
    assert used_cycles(edges, "window:6") == slice(7, 10)
    assert used_cycles(edges, "window:600") == slice(0, 10)
    with pytest.raises(UsageError, match=r"cycles: expected 'last', 'all' or 'window:SECONDS' .*; got 'first'"):
        used_cycles(edges, "first")
    with pytest.raises(AnalysisError, match="window of 1 s is shorter than one cycle"):
        used_cycles(edges, "window:1")


def test_one_cycle_carries_the_scatter_of_all() -> None:
    values = np.random.default_rng(1).normal(2.0, 0.1, 200)
    mean = energy.mean_over(values, slice(199, 200), noise=0.001)
    assert mean.value == values[-1]
    assert mean.se == pytest.approx(0.1, rel=0.15)
    assert energy.mean_over(values[:1], slice(0, 1), noise=0.02).se == 0.02
