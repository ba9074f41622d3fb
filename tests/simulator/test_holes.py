"""Where steady states were missed once: displaced rest, vanishing stops, long periods; and next to resonance."""

from math import pi

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from frictionlab.errors import UsageError
from frictionlab.simulator import Base, Problem, coexisting, simulate, steady_state
from frictionlab.simulator.exact.solve import crest_of
from tests.desk import present
from tests.simulator.closed_form import of_modes
from tests.simulator.phases import settles_on
from tests.simulator.twin import problem_of


@settings(max_examples=25, deadline=None)
@example(r=0.74, share=0.5, cosine=0.344, sine=-0.007)
@given(r=st.floats(0.1, 3.0), share=st.floats(0.0, 1.0), cosine=st.floats(-0.5, 0.5), sine=st.floats(-0.5, 0.5))
def test_friction_over_half_the_range_of_the_force_always_brings_the_mass_to_rest(
    r: float, share: float, cosine: float, sine: float
) -> None:
    base = Base((1.0, cosine), (0.0, sine))
    f = base.at(np.linspace(0.0, 2 * pi, 20001))
    half, top = 0.5 * float(np.ptp(f)), float(np.abs(f).max())
    beta = half + max(1e-3, share) * (top - half)
    state = steady_state(Problem(r, beta + 1e-6, base=base))
    assert (state.outcome, state.energy_per_cycle) == ("stuck", 0.0)
    place = float(present(state.orbit).at(0.0)[0])
    assert f.max() - place <= beta + 2e-6
    assert place - f.min() <= beta + 2e-6
    assert place == 0.0 or "comes to rest" in state.verdict
    late = float(simulate(Problem(r, beta + 1e-6, base=base), cycles=200, keep=1).at(399 * pi)[0])
    assert late == pytest.approx(place, abs=0.05)  # it gets there like 1 / cycles at the edge of the places


@given(seed=st.integers(0, 2**32), count=st.sampled_from([2, 3, 16, 64]), falls=st.floats(0.0, 3.0))
def test_the_crest_of_a_sum_of_waves_is_no_lower_than_any_sample_and_no_higher_than_curvature_lets_it(
    seed: int, count: int, falls: float
) -> None:
    k = np.arange(1.0, count + 1.0)
    waves = k**-falls * np.exp(1j * np.random.default_rng(seed).uniform(0.0, 2 * pi, count))
    tau = np.linspace(0.0, 2 * pi, 8001)
    sampled, far = float((np.exp(1j * np.outer(tau, k)) @ waves).real.max()), 0.5 * (0.5 * tau[1]) ** 2
    assert -1e-13 * count <= crest_of(waves) - sampled <= far * float(k**2 @ np.abs(waves))
    flat = np.array([1.0, -0.25]) * np.exp(1j * k[:2] * k[-1])  # of fourth order
    assert crest_of(flat) == pytest.approx(0.75, rel=1e-12)


def test_unequal_break_away_forces_let_the_mass_rest_to_one_side() -> None:
    uneven = {"static_ratio_up": 1.6, "static_ratio_down": 1.0}
    state = steady_state(Problem(0.7, 0.8, law="coulomb+breakaway", parameters=uneven))
    assert state.outcome == "stuck"
    assert -0.28 - 1e-12 <= float(present(state.orbit).at(0.0)[0]) <= -0.2 + 1e-12  # 1 - 1.6 * 0.8 and 0.8 - 1


@pytest.mark.parametrize("over", [1e-3, 1e-6, 1e-9, 1e-12])
def test_at_resonance_stops_vanish_like_the_cube_root_of_what_friction_has_over(over: float) -> None:
    state = steady_state(Problem(1.0, 0.25 * pi * (1.0 + over)))
    assert state.outcome == "periodic"
    assert state.stuck_fraction == pytest.approx(0.672431 * over ** (1.0 / 3.0), rel=0.05)
    assert state.energy_per_cycle == pytest.approx(0.25 * pi**2, rel=3.0 * over ** (1.0 / 3.0))


UP_DOWN = {"static_ratio_up": 1.46966014, "static_ratio_down": 1.03045729}


@pytest.mark.parametrize(
    ("problem", "solver", "period"),
    [
        (Problem(0.5121197761124843, 0.07441647649423469, 3.6826938397865323), "exact", 1),  # Den Hartog's is one too
        (Problem(0.6234660581699062, 0.20550050936337488, 3.0411110863917155), "exact", 3),
        (Problem(0.3167453932053987, 0.18109537586196128, 2.2410659501989008), "exact", 1),
        (Problem(0.46886842, 0.17425558, 3.04799425), "exact", 1),  # another has as many phases, stands at the section
        (Problem(0.7, 0.5, 1.5), "closed-form", 1),
        (Problem(0.32, 0.2, 3.0), "exact", 1),
        (Problem(0.38, 0.2, 3.0), "exact", 4),
        (Problem(0.44, 0.2, 3.0), "exact", 3),
        (Problem(0.5, 0.2, 3.0), "exact", 1),
        (Problem(0.3484, 0.188, 1.75), "exact", 1),
        (Problem(0.23875384, 0.04104896, 3.80918095), "exact", 9),
        (Problem(0.41673743, 0.16038866, law="coulomb+breakaway", parameters=UP_DOWN), "exact", 56),
        (Problem(0.38250899937296645, 0.1415393568670356, 3.023029111229053), "exact", 51),  # leaves one of 22 cycles
    ],
    ids=repr,
)
def test_with_static_friction_the_orbit_told_is_the_one_that_rest_settles_on(
    problem: Problem, solver: str, period: int
) -> None:
    state = steady_state(problem)
    assert (state.solver, state.period_cycles) == (solver, period)
    assert abs(state.floquet_multiplier or 0.0) <= 1.0
    assert settles_on(state, 1500, 1e-6)


def sticky(ratio: float, **numbers: float) -> dict[str, float]:
    """Break-away by the same ratio both ways, beside other numbers of a contact."""
    return {"static_ratio_up": ratio, "static_ratio_down": ratio, **numbers}


COEXISTING = [  # problem, starts, outcome and period of each motion
    (problem_of(0.38, 0.2, **sticky(3.0)), 24, {("periodic", 4), ("periodic", 5)}),
    (problem_of(0.3, 0.9, **sticky(1.3)), 10, {("periodic", 1), ("stuck", 1)}),
    (problem_of(0.3, 0.9, **sticky(1.3, stiffness_ratio=400.0)), 19, {("periodic", 7), ("stuck", 1)}),
    # Newton comes to the elastic orbit by trials of 3 and 4 cycles too: told is its shortest period
    (problem_of(0.38, 0.2, **sticky(3.0, stiffness_ratio=50.0)), 19, {("periodic", 1)}),
    (problem_of(0.5, 0.4, stiffness_ratio=50.0), 6, {("periodic", 1)}),  # motions draw nearer: there is one
    (problem_of(0.5, 0.4), 6, {("periodic", 1)}),
    (
        Problem(0.3, 0.9, law="coulomb+stribeck", parameters={"static_ratio": 1.3, "stribeck_speed": 0.05}),
        *(6, {("periodic", 1), ("stuck", 1)}),
    ),
    (
        Problem(0.5, 0.4, law="coulomb+logarithm", parameters={"rate_strength": 0.05, "rate_speed": 0.01}),
        *(6, {("periodic", 1)}),
    ),
]


@pytest.mark.parametrize(("problem", "starts", "expected"), COEXISTING, ids=lambda value: getattr(value, "law", None))
def test_motions_that_coexist_are_found_whole_with_their_shares(
    problem: Problem, starts: int, expected: set[tuple[str, int]]
) -> None:
    """An orbit found on half a cycle is mirrored: half of it was told as the whole."""
    found = coexisting(problem, starts=starts)
    assert sorted((each.state.outcome, each.state.period_cycles or 1) for each in found) == sorted(expected)
    shares = [attractor.share for attractor in found]
    assert sum(shares) == pytest.approx(1.0)
    assert shares == sorted(shares, reverse=True)
    for state in (attractor.state for attractor in found if attractor.state.outcome == "periodic"):
        assert abs(state.floquet_multiplier or 0.0) < 1.0
        cycles, orbit = state.period_cycles or 1, present(state.orbit)
        assert orbit.end - orbit.start == pytest.approx(2.0 * pi * cycles, abs=1e-12)
        if problem.law.kind != "elastic":  # no inner state: displacement and velocity say all
            x, v = (float(value) for value in orbit.at(0.0))
            run = simulate(problem, cycles=cycles, x0=x, v0=v)
            tau = np.linspace(0.0, 2.0 * pi * cycles * (1.0 - 1e-9), 50)
            assert np.abs(run.at(tau)[0] - orbit.at(tau)[0]).max() < (1e-7 if orbit.solver == "numeric" else 1e-11)


def test_motions_from_no_start_are_refused() -> None:
    with pytest.raises(UsageError, match="starts; expected at least 1; got 0"):
        coexisting(Problem(0.5, 0.4), starts=0)


@pytest.mark.parametrize(
    ("law", "parameters", "beta", "said"),
    [
        ("coulomb+stribeck", {"static_ratio": 1.3, "stribeck_speed": 0.05}, 0.9, "The mass never moves"),
        ("coulomb+logarithm", {"rate_strength": -0.05, "rate_speed": 0.01}, 1.2, "The mass never moves"),
        ("coulomb+dahl", {"stiffness_ratio": 50.0}, 5.0, "holds all the time: it yields, and creeps"),
        ("coulomb+compliance", {"stiffness_ratio": 50.0}, 1.5, "only yields elastically"),
    ],
)
def test_what_stuck_means_is_said_for_each_kind_of_contact(
    law: str, parameters: dict[str, float], beta: float, said: str
) -> None:
    state = steady_state(Problem(0.5, beta, law=law, parameters=parameters))
    assert state.outcome == "stuck"
    assert said in state.verdict


@pytest.mark.parametrize(
    "problem",
    [
        problem_of(0.4689669, 0.20974344, static_ratio_up=1.22424753, static_ratio_down=1.49454725),  # chaos
        Problem(1.0 - 1e-9, 0.3, 1.3),  # near to resonance
        Problem(1.0 + 3e-6, 0.45, 1.9),
        Problem(0.5 * (1.0 + 1e-7), 0.15, 1.6, base=Base((1.0, 0.3), (0.0, 0.1))),
    ],
)
def test_a_motion_of_which_no_cycle_of_thousands_repeats_is_refused_by_name(problem: Problem) -> None:
    state = steady_state(problem)
    assert state.outcome == "not found"
    assert "was not seen to settle on an orbit within the work allowed" in state.verdict


def test_a_contact_that_holds_on_a_moving_wall_holds_from_cycle_to_cycle() -> None:
    uneven = {"static_ratio_up": 1.2, "static_ratio_down": 1.1}
    run = simulate(Problem(0.4, 0.3, wall="base", law="coulomb+breakaway", parameters=uneven), cycles=6)
    assert np.ptp(run.stops[-1]) > 4.0 * pi


def test_the_motion_told_next_to_resonance_is_where_rest_goes_in_the_end() -> None:
    state = steady_state(Problem(1.0001, 0.1, 1.9))
    assert settles_on(state, 400_000, 1e-6 * (state.response_amplitude or 0.0))


@settings(max_examples=20, deadline=None)
@given(
    n=st.integers(1, 3),
    away=st.floats(-13.0, -2.5).map(lambda power: 10.0**power),
    side=st.sampled_from([-1.0, 1.0]),
    share=st.floats(0.05, 0.95),
    damped=st.sampled_from([0.0, 1e-12, 1e-6]),
    more=st.tuples(*[st.floats(-0.3, 0.3)] * 5),
)
def test_energies_close_next_to_the_resonance_of_any_harmonic(
    n: int, away: float, side: float, share: float, damped: float, more: tuple[float, ...]
) -> None:
    base = Base((1.0, 0.4 + more[0], 0.4 + more[1]), more[2:])
    drive = float(np.hypot(base.cosine[n - 1], base.sine[n - 1]))
    r = (1.0 + side * away) / n
    problem = Problem(r, 0.25 * np.pi * share * drive, 1.0, damped, base=base)
    state, lost = steady_state(problem), of_modes(problem)
    if state.outcome == "not found":  # as above
        assert lost > 1e-9
        return
    assert state.outcome == "periodic"
    error = present(state.closure_error) / present(state.energy_per_cycle)
    assert error <= max(1e-12, lost)
    assert any("good to about" in w for w in state.warnings) or error <= 1e-10
