"""Steady states: 50 digits, orbits solved for and waited for, refusals; chapter 3 of the thesis as physics."""

from math import nextafter, pi

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator import Base, Problem, last_cycle, simulate, steady_state, sweep, thesis_run
from tests.desk import present
from tests.simulator.closed_form import continuous_amplitude, continuous_energy, friction_limit, viscous_energy
from tests.simulator.phases import settles_on, sides

DAMPED = st.builds(
    lambda r, beta, zeta, mu, even, third: Problem(r, beta, mu, zeta, base=Base((1.0, even), (0.0, 0.0, third))),
    *(st.floats(*ends) for ends in ((0.15, 3.0), (0.05, 0.8), (0.1, 2.0), (1.0, 1.2), (-0.2, 0.2), (-0.1, 0.1))),
)


@settings(max_examples=15, deadline=None)
@given(problem=DAMPED)
def test_a_long_run_from_rest_arrives_at_the_orbit(problem: Problem) -> None:
    state = steady_state(problem)
    if state.outcome == "stuck":
        assert sides(simulate(problem, cycles=200, keep=1)).tolist() == [0.0]
        return
    assert state.outcome == "periodic"
    assert settles_on(state, 300, 1e-8)


def test_harmonics_and_phase_of_the_base_count() -> None:
    plain, shifted = Problem(0.6, 0.3), Problem(0.6, 0.3, base=Base((np.cos(1.0),), (np.sin(1.0),)))
    a, b = steady_state(plain), steady_state(shifted)
    assert b.energy_per_cycle == pytest.approx(a.energy_per_cycle or 0.0, rel=1e-13)
    odd = steady_state(Problem(0.6, 0.3, base=Base((1.0, 0.0, 0.1))))
    even = steady_state(Problem(0.6, 0.3, base=Base((1.0, 0.1))))
    assert odd.symmetric
    assert even.symmetric is False


UNBOUNDED = [Problem(1.0, beta) for beta in (0.0, 1e-12, 0.4, nextafter(pi / 4, 0.0))]
UNBOUNDED += [Problem(0.5, 0.01, base=Base((1.0, 0.1)))]  # of which the 2nd harmonic resonates


def test_unbounded_is_said_and_its_neighbours_are_solved() -> None:
    for problem in UNBOUNDED:
        state = steady_state(problem)
        assert (state.outcome, state.energy_per_cycle, state.orbit) == ("unbounded", None, None)
        assert "no steady state" in state.verdict
    assert steady_state(Problem(1.0, pi / 4 + 1e-3)).outcome == "periodic"
    assert steady_state(Problem(1.0, 0.5, zeta=1e-3)).outcome == "periodic"
    near = steady_state(Problem(1.0 + 1e-9, 0.5))
    assert near.response_amplitude == pytest.approx(np.sqrt(0.25 - 4 * 0.25 / pi**2) / 1e-9, rel=1e-6)


def test_the_continuum_is_recognised_and_a_run_from_rest_creeps_to_its_edge() -> None:
    state = steady_state(Problem(0.5, 0.2))
    assert state.outcome == "periodic"
    assert state.floquet_multiplier == pytest.approx(1.0, abs=1e-9)
    assert any("continuum" in warning for warning in state.warnings)
    lengths = []
    for cycles in (50, 100, 200):  # the stops of Fig. 3.2b after so many cycles, from the design
        stops = simulate(Problem(0.5, 0.2), cycles=cycles + 1, keep=2).stops
        lengths.append((stops[:, 1] - stops[:, 0]).max())
    assert lengths == pytest.approx([0.138, 0.099, 0.070], abs=1.5e-3)
    assert not steady_state(Problem(0.5, 0.34)).warnings


def test_what_is_not_known_is_refused() -> None:
    with pytest.raises(SimulationError, match="at least one that is not zero"):
        Base((0.0,))
    with pytest.raises(UsageError, match="cycles, keep"):
        simulate(Problem(1.0, 0.4), cycles=0)


def test_a_hundred_cycles_are_not_steady() -> None:
    waited = last_cycle(Problem(0.95, 0.1), cycles=100)
    assert waited.outcome == "not settled"
    assert waited.energy_per_cycle == pytest.approx(7.39, abs=5e-3)
    assert steady_state(Problem(0.95, 0.1)).energy_per_cycle == pytest.approx(4.070974, abs=5e-7)
    assert last_cycle(Problem(0.5, 0.4), cycles=100).outcome == "periodic"


@settings(deadline=None, max_examples=30)
@given(r=st.floats(0.05, 20.0), share=st.floats(1e-6, 1.0 - 1e-9))
def test_below_the_limit_the_closed_form_is_the_orbit(r: float, share: float) -> None:
    beta = share * friction_limit(r)
    assume(beta >= 1e-9)
    assume(r != 1.0)  # there the motion grows without bound: test_steady_state.py
    state = steady_state(Problem(r, beta), solver="exact")
    assert state.stops_per_cycle == 0
    assert state.energy_per_cycle == pytest.approx(continuous_energy(r, beta), rel=1e-10)
    assert state.response_amplitude == pytest.approx(continuous_amplitude(r, beta), rel=1e-10)


@settings(deadline=None, max_examples=30)
@example(0.6)
@example(0.984375)
@example(1.2)
@given(r=st.floats(0.05, 20.0))
def test_at_the_limit_stops_grow_from_nothing_and_the_energy_does_not_jump(r: float) -> None:
    limit = friction_limit(r)
    if limit < 1e-6 or abs(r - 1.0) < 1e-3:
        return
    below, *above = (steady_state(Problem(r, limit * (1 + d))) for d in (-1e-9, 1e-9, 1e-6, 1e-3))
    assert (below.solver, below.stops_per_cycle, below.stuck_fraction) == ("closed-form", 0.0, 0.0)
    solved = steady_state(below.problem, solver="exact")
    assert present(below.floquet_multiplier) == pytest.approx(present(solved.floquet_multiplier), abs=1e-9)
    if "not found" in [state.outcome for state in above]:  # refused by name next to resonance: the map has a kink there
        assert abs(r - 1.0) < 0.05
        return
    assert {state.solver for state in above} == {"exact"}
    assert all((state.stops_per_cycle or 0) > 0 for state in above)
    stuck = [present(state.stuck_fraction) for state in above]
    assert stuck == sorted(stuck)
    few = 1e-8 + 3e-9 / (1.0 - r) ** 2  # friction of 1e-9 more: next to resonance the motion answers by so much
    assert above[0].energy_per_cycle == pytest.approx(below.energy_per_cycle, rel=few)


def test_continuous_motion_under_strong_friction_is_where_the_thesis_has_it() -> None:
    """Fig. 3.4: at beta = 0.8 for r from 0.77 to 0.95; at beta = 0.9 every motion stops."""
    ratios = np.linspace(0.5, 1.2, 71)
    stops = sweep(ratios.tolist(), [0.8, 0.9]).datasets()["stops_per_cycle"][:, :, 0, 0]
    continuous = ratios[stops[:, 0] == 0.0]
    assert (continuous.min(), continuous.max()) == pytest.approx((0.77, 0.95), abs=0.015)
    assert (stops[:, 1] > 0.0).all()


def test_the_thesis_method_converges_to_the_exact_orbit() -> None:
    exact = steady_state(Problem(0.5, 0.4)).energy_per_cycle
    errors = []
    for rtol in (1e-3, 1e-5, 1e-7):
        run = thesis_run(Problem(0.5, 0.4), cycles=30, rtol=rtol, atol=rtol * 1e-3)
        assert run.stops_per_cycle == 2.0
        errors.append(abs((run.energy_per_cycle or 0.0) / exact - 1.0) if exact else 1.0)
    assert errors[0] < 2e-3  # default tolerances
    assert errors[2] < 1e-5
    assert errors[2] < errors[0]


def test_the_thesis_viscous_oscillator_and_what_has_not_settled() -> None:
    run = thesis_run(Problem(0.8, 0.0, zeta=0.3), cycles=15, rtol=1e-6, atol=1e-9)
    assert run.energy_per_cycle == pytest.approx(viscous_energy(0.8, 0.3), rel=1e-4)
    assert (run.closure_error or 0.0) < 1e-5 * viscous_energy(0.8, 0.3)
    state = last_cycle(Problem(0.95, 0.1), cycles=20, solver="thesis")
    assert (state.outcome, state.solver) == ("not settled", "thesis")
    with pytest.raises(SimulationError, match="cycles; expected >= 1"):
        thesis_run(Problem(0.5, 0.4), cycles=0)
