"""Rigid laws beside plain Coulomb friction, and each term's limit: both walls, harmonics, the frame's own dashpot."""

from math import pi
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.errors import UsageError
from frictionlab.simulator import Base, Problem, steady_state
from tests.desk import present
from tests.simulator.twin import TURN, Twin, problem_of

HARMONICS = Base((1.0, 0.15, 0.05), (0.0, 0.1, 0.03))
LAWS = [
    Problem(0.5, 0.4),
    Problem(0.23, 0.35),
    Problem(0.7, 0.9),
    Problem(0.6, 0.5, 1.2, 1.7),
    Problem(0.17, 0.25, 2.5, 0.02),
    problem_of(0.7, 0.5, gradient=-0.06, contact_damping_ratio=0.03),
    problem_of(0.6, 0.5, static_ratio_up=1.3, static_ratio_down=1.05),
    problem_of(0.8, 0.4, frame_damping_ratio=0.05),
    problem_of(0.45, 0.5, gradient=0.08, static_ratio_up=1.1, contact_damping_ratio=0.02, frame_damping_ratio=0.03),
    problem_of(1.6, 0.3, "base", gradient=0.1, frame_damping_ratio=0.1),
    problem_of(0.6, 0.3, "fixed", Base((1.0, 0.15)), gradient=0.05, frame_damping_ratio=0.04),
    problem_of(1.3, 0.5, "base", Base((1.0, 0.1)), gradient=-0.1, contact_damping_ratio=0.05),
    problem_of(0.9, 0.75, "base", HARMONICS, gradient=1e-7, static_ratio_up=1.0 + 1e-6, contact_damping_ratio=1e-7),
]


@pytest.mark.parametrize("problem", LAWS, ids=repr)
def test_the_slow_twin_carries_the_orbit_back_to_its_start(problem: Problem) -> None:
    state, twin = steady_state(problem, solver="exact"), Twin(problem)
    assert state.period_cycles == 1
    orbit, tau = present(state.orbit), np.linspace(0.0, TURN, 10)
    way = np.transpose(orbit.at(tau))
    twin.run(tau.tolist(), way[0])
    assert np.array(twin.states) == pytest.approx(way, abs=1e-9)
    assert np.array(twin.forces)[:, 0] == pytest.approx(orbit.force(tau), abs=1e-8)
    assert twin.loop == pytest.approx(state.energy_per_cycle, rel=1e-8)
    assert twin.friction + twin.viscous == pytest.approx(state.contact_energy_per_cycle, rel=1e-8)
    assert twin.stuck == pytest.approx(TURN * (state.stuck_fraction or 0.0), abs=1e-7)
    assert twin.stops == state.stops_per_cycle
    swing = 0.5 * float(np.ptp(orbit.at(np.linspace(0.0, TURN, 4001))[0]))  # the mass's own, where the wall moves too
    assert swing <= present(state.response_amplitude) == pytest.approx(swing, rel=1e-5)


@st.composite
def exact_problems(draw: st.DrawFn) -> Problem:
    """Any sum of rigid terms, or one elastic slider or four in place of break-away; either wall."""
    numbers = {
        "gradient": st.floats(-0.15, 0.15), "contact_damping_ratio": st.sampled_from([0.02, 0.1, 1.5]),
        "frame_damping_ratio": st.sampled_from([0.0, 0.03, 1.2]), "static_ratio_up": st.sampled_from([1.0, 1.2]),
        "static_ratio_down": st.sampled_from([1.0, 1.1]),
    }  # fmt: skip
    own = {name: draw(number) for name, number in numbers.items() if draw(st.booleans())}
    if draw(st.booleans()):
        own = {name: value for name, value in own.items() if "static" not in name}
        own |= {"stiffness_ratio": draw(st.floats(0.1, 300.0))}
        own |= {"sliders": 4, "chi": -0.4} if draw(st.booleans()) else {}
    wall, base = "base" if draw(st.booleans()) else "fixed", Base((1.0, draw(st.sampled_from([0.0, 0.1]))))
    return problem_of(draw(st.floats(0.03, 20.0)), draw(st.floats(0.01, 0.999)), wall, base, **own)  # type: ignore[arg-type] # of two


@settings(max_examples=120, deadline=None)
@given(problem=exact_problems())
def test_energies_close_and_the_orbit_repeats_under_any_exact_law(problem: Problem) -> None:
    state = steady_state(problem, solver="exact")
    if state.outcome != "periodic":
        assert state.outcome in ("stuck", "unbounded") or state.warnings
        return
    held = 1e-13 if state.problem.law.kind == "elastic" else 0.0  # of what springs give back
    assert present(state.closure_error) <= 1e-11 * present(state.energy_taken) + held
    size = 1.0 + present(state.response_amplitude)
    assert present(state.residual) < 1e-11 * size
    orbit, tau = present(state.orbit), np.linspace(0.0, TURN, 50)
    ends, _ = orbit.at(orbit.start + TURN * (state.period_cycles or 1) * np.array([0.0, 1.0 - 1e-15]))
    assert ends[0] == pytest.approx(ends[1], abs=1e-9 * size)
    if state.symmetric:
        (x, v), (opposite, back) = orbit.at(tau), orbit.at(tau + pi)
        np.testing.assert_allclose(opposite, -x, atol=1e-12 * size)
        np.testing.assert_allclose(back, -v, atol=1e-10 * (np.abs(v).max() + 1e-3))


@pytest.mark.parametrize(
    "problem",
    [
        Problem(0.5, 0.4, law="coulomb+place", parameters={"gradient": 0.1}),
        problem_of(0.5, 0.4, static_ratio_up=1.2),
        Problem(0.5, 0.4, frame_damping_ratio=0.02),
    ],
)
def test_the_thesis_method_refuses_what_the_thesis_did_not_simulate(problem: Problem) -> None:
    with pytest.raises(UsageError, match=r"thesis run: law coulomb.*do: use another solver"):
        steady_state(problem, solver="thesis")


def test_a_gradient_too_steep_is_declined_by_name() -> None:
    for gradient, words in ((3.0, "runs away"), (2.0, "below 0")):
        state = steady_state(Problem(0.7, 0.4, law="coulomb+place", parameters={"gradient": gradient}))
        assert state.outcome == "not found"
        assert state.orbit is None
        assert words in state.warnings[0]
        assert "gradient" in state.verdict


def test_the_closed_form_holds_only_where_neither_turn_stops() -> None:
    uneven = {"static_ratio_up": 1.1926408799438506, "static_ratio_down": 1.0764467552437835}
    problem = Problem(1.524802235908342, 0.6253508332094486, law="coulomb+breakaway", parameters=uneven)
    state = steady_state(problem)
    assert state.solver == "exact"
    assert state.symmetric is False
    assert present(state.closure_error) <= 1e-11 * present(state.energy_taken)


@pytest.mark.parametrize(
    ("r", "beta", "more", "order"),
    [  # where the mass stops
        (0.45, 0.5, {"base": HARMONICS}, 1.0),
        (0.9, 0.7, {"wall": "base"}, 1.0),
        (0.45, 0.5, {"frame_damping_ratio": 0.02}, 1.0),
        # one turn has no stop: there the force takes a time of kappa^(-1/2) to change its sign
        (0.9, 0.75, {"wall": "base", "base": HARMONICS, "frame_damping_ratio": 0.02}, 0.5),
    ],
)
def test_a_stiff_contact_becomes_rigid_in_the_limits_order(
    r: float, beta: float, more: dict[str, Any], order: float
) -> None:
    rigid, tau = steady_state(Problem(r, beta, **more)), np.linspace(0.0, TURN, 200)
    assert rigid.stops_per_cycle == 2.0 * order

    def apart(stiffness: float) -> float:
        values = {"stiffness_ratio": stiffness}
        stiff = steady_state(Problem(r, beta, law="coulomb+compliance", parameters=values, **more))
        return float(np.abs(present(stiff.orbit).at(tau)[0] - present(rigid.orbit).at(tau)[0]).max())

    assert np.log10(apart(1e3) / apart(1e7)) / 4.0 == pytest.approx(order, abs=0.06)
