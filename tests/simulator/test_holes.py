"""Where steady states were missed once: motions that come to rest displaced, stops about to vanish, long periods."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.simulator import Base, Problem, coexisting, simulate, steady_state


def test_a_mass_that_rests_displaced_is_stuck() -> None:
    state = steady_state(Problem(0.74, 1.179, base=Base((1.0, 0.344), (0.0, -0.007))))
    assert state.outcome == "stuck"
    assert state.energy_per_cycle == 0.0
    assert state.orbit is not None
    x = float(state.orbit.at(0.0)[0])
    assert x > 0.1
    assert "comes to rest" in state.verdict


@settings(max_examples=60, deadline=None)
@given(r=st.floats(0.1, 3.0), share=st.floats(0.0, 1.0), cosine=st.floats(-0.5, 0.5), sine=st.floats(-0.5, 0.5))
def test_friction_over_half_the_range_of_the_force_always_brings_the_mass_to_rest(
    r: float, share: float, cosine: float, sine: float
) -> None:
    base = Base((1.0, cosine), (0.0, sine))
    f = base.at(np.linspace(0.0, 2 * pi, 20001))
    half, top = 0.5 * float(np.ptp(f)), float(np.abs(f).max())
    beta = half + max(1e-3, share) * (top - half)
    state = steady_state(Problem(r, beta + 1e-6, base=base))
    assert state.outcome == "stuck"
    assert state.orbit is not None
    place = float(state.orbit.at(0.0)[0])
    assert f.max() - place <= beta + 2e-6
    assert place - f.min() <= beta + 2e-6
    late = float(simulate(Problem(r, beta + 1e-6, base=base), cycles=200, keep=1).at(399 * pi)[0])
    assert late == pytest.approx(place, abs=0.05)  # it gets there like 1 / cycles at the edge of the places


def test_unequal_break_away_forces_let_the_mass_rest_to_one_side() -> None:
    uneven = {"static_ratio_up": 1.6, "static_ratio_down": 1.0}
    state = steady_state(Problem(0.7, 0.8, law="coulomb+breakaway", parameters=uneven))
    assert state.outcome == "stuck"
    assert state.orbit is not None
    assert -0.28 - 1e-12 <= float(state.orbit.at(0.0)[0]) <= -0.2 + 1e-12  # 1 - 1.6 * 0.8 and 0.8 - 1


@pytest.mark.parametrize("over", [1e-3, 1e-6, 1e-9, 1e-12])
def test_at_resonance_stops_vanish_like_the_cube_root_of_what_friction_has_over(over: float) -> None:
    state = steady_state(Problem(1.0, 0.25 * pi * (1.0 + over)))
    assert state.outcome == "periodic"
    assert state.stuck_fraction == pytest.approx(0.672431 * over ** (1.0 / 3.0), rel=0.05)
    assert state.energy_per_cycle == pytest.approx(0.25 * pi**2, rel=3.0 * over ** (1.0 / 3.0))


def test_an_orbit_is_told_with_its_shortest_period() -> None:
    state = steady_state(Problem(0.3484, 0.188, 1.75))
    assert state.period_cycles == 1
    assert state.floquet_multiplier == pytest.approx(0.93954, abs=1e-4)


def test_an_orbit_of_nine_cycles_is_found() -> None:
    state = steady_state(Problem(0.23875384, 0.04104896, 3.80918095))
    assert state.period_cycles == 9
    assert state.closure_error == pytest.approx(0.0, abs=1e-12)


def test_motions_that_coexist_are_found_with_their_shares() -> None:
    found = coexisting(Problem(0.38, 0.2, 3.0), starts=24)
    assert {attractor.state.period_cycles for attractor in found} == {4, 5}
    assert sum(attractor.share for attractor in found) == pytest.approx(1.0)
    assert found[0].share >= found[1].share
    assert [attractor.share for attractor in coexisting(Problem(0.5, 0.4))] == [1.0]
