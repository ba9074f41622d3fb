"""How the search for an orbit of elastic contacts ends: what it costs, what sliders hold that never slip."""

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest

from frictionlab.simulator import Base, Problem
from frictionlab.simulator import simulate as run
from frictionlab.simulator.exact.solve import solved, steady, system_of_one


def looks_of(problem: Problem) -> float:
    """How many looks at a phase the search for a steady state takes."""
    return solved(system_of_one(problem)).spent


def test_a_contact_that_hardly_slips_takes_a_handful_of_cycles() -> None:
    # it took 110,000 looks at a phase: started elsewhere, its vibration dies out by what little slips
    base = Base((1.0, -0.05245721561649713), (0.0, 0.0, 0.061263856394369154))
    problem = Problem(
        1.489346183764216,
        1.0520595440064922,
        base=base,
        law="coulomb+compliance",
        parameters={"stiffness_ratio": 7232.497},
    )
    assert looks_of(problem.with_parameters({"frame_damping_ratio": 0.0899809})) < 40_000


@pytest.mark.parametrize("sliders", [1, 4, 12])
def test_a_search_takes_a_handful_of_cycles(sliders: int) -> None:
    parameters = {"stiffness_ratio": 10.0, "sliders": sliders, "chi": -0.3}
    problem = Problem(0.6, 0.4, law="coulomb+iwan", parameters=parameters, base=Base((1.0, 0.1)))
    assert looks_of(problem) < 12 * (4 + 2 * sliders) * 5 * 2  # cycles, phases of each, looks at each, harmonics


def shifted(problem: Problem, cycles: int, **start: Any) -> tuple[Any, Any]:
    """A late cycle of a run, and the steady state."""
    return run(problem, cycles=cycles, keep=1, **start), steady(problem)


def amplitude(motion: Any) -> float:
    x, _ = motion.at(np.linspace(motion.start, motion.end, 4001))
    return float(0.5 * np.ptp(x))


def test_with_a_gradient_what_never_slips_holds_what_the_motion_from_rest_leaves() -> None:
    # Newton's orbit has a slider that only just touches its limit: it is not the one that rest comes to
    parameters = {
        "stiffness_ratio": 0.8034819640601791,
        "sliders": 3,
        "chi": -0.38365531963430444,
        "gradient": -0.133942357463257,
    }
    problem = Problem(1.322143446588725, 1.1493546184824242, law="coulomb+iwan+place", parameters=parameters)
    problem = problem.with_parameters({"frame_damping_ratio": 0.07379479418479876})
    late, state = shifted(problem, 150)
    assert state.orbit is not None
    tau = np.linspace(0.0, 2 * pi, 50)
    np.testing.assert_allclose(late.at(late.start + tau)[0], state.orbit.at(tau)[0], atol=1e-9)


def test_on_a_moving_wall_the_search_begins_at_rest_on_the_wall() -> None:
    parameters = {"stiffness_ratio": 1.0, "sliders": 3, "chi": -0.4, "gradient": 0.1}
    problem = Problem(1.5, 0.9, law="coulomb+iwan+place", parameters=parameters, wall="base", frame_damping_ratio=0.05)
    on_the_wall, state = shifted(problem, 100, x0=float(cos(0.0)), v0=float(-sin(0.0)))
    assert state.orbit is not None
    tau = np.linspace(0.0, 2 * pi, 50)
    np.testing.assert_allclose(on_the_wall.at(on_the_wall.start + tau)[0], state.orbit.at(tau)[0], atol=1e-9)


def test_with_break_away_the_orbit_is_the_one_that_rest_settles_on() -> None:
    # a search that carried the motion on from Newton's trials came to another one, of energy 0.36815
    parameters = {
        "stiffness_ratio": 174.6358790914,
        "static_ratio_up": 1.2638205197503,
        "static_ratio_down": 1.326786918658,
    }
    base = Base((1.0, 0.0014414262567462033, 0.0), (0.0, 0.0, -0.07219565353094892))
    law = "coulomb+compliance+breakaway"
    late, state = shifted(
        Problem(0.06341084881420596, 0.09842763921765396, law=law, parameters=parameters, base=base), 80
    )
    assert state.energy_per_cycle == pytest.approx(0.366301, abs=1e-6)
    assert state.orbit is not None
    tau = np.linspace(0.0, 2 * pi, 50)
    np.testing.assert_allclose(late.at(late.start + tau)[0], state.orbit.at(tau)[0], atol=1e-9)


def settled_on(problem: Problem, cycles: int, within: int) -> tuple[float, Any]:
    """How far a late motion from rest is from the steady state after so many cycles of it, and that state."""
    late, state = run(problem, cycles=cycles + within, keep=within), steady(problem)
    assert state.orbit is not None
    tau = np.linspace(0.0, 2 * pi, 40)
    orbit = [state.orbit.at(tau + 2 * pi * i)[0] for i in range(within)]
    motion = late.at(late.start + tau)[0]
    return min(float(np.max(abs(motion - one))) for one in orbit), state


def test_with_break_away_and_gradient_the_orbit_holds_what_rest_leaves() -> None:
    # a search that took the first orbit close by told the energy 4e-5 off
    parameters = {"stiffness_ratio": 0.19122238263780167, "sliders": 4.0, "chi": -0.7834686064859966}
    parameters |= {"gradient": -0.18135282385048504, "contact_damping_ratio": 0.01473978378323338}
    parameters |= {"static_ratio_up": 1.4491830523903007, "static_ratio_down": 1.0418150844224923}
    law = "coulomb+iwan+place+speed+breakaway"
    problem = Problem(1.9966684304040216, 0.21153953529101732, law=law, parameters=parameters, wall="base")
    late, state = shifted(problem, 600, x0=1.0)
    assert state.energy_taken == pytest.approx(0.41380151358, abs=1e-10)
    assert state.orbit is not None
    tau = np.linspace(0.0, 2 * pi, 50)
    np.testing.assert_allclose(late.at(late.start + tau)[0], state.orbit.at(tau)[0], atol=1e-9)


def test_with_break_away_an_orbit_of_seven_cycles_is_not_taken_for_one_of_two_beside_it() -> None:
    parameters = {"static_ratio_up": 1.2749633156028937, "static_ratio_down": 1.244413424921524}
    problem = Problem(
        0.19145588878011086,
        0.5061793110697208,
        base=Base((1.0, 0.17982654807900456, 0.0), (0.0, 0.0, -0.03174933091937436)),
        law="coulomb+compliance+breakaway",
        parameters=parameters | {"stiffness_ratio": 18.899445520381267},
    )
    off, state = settled_on(problem, 600, 7)
    assert state.period_cycles == 7
    assert off < 1e-9


@pytest.mark.parametrize("sliders", [1, 6])
def test_with_break_away_rest_is_followed_only_until_it_is_drawn_to_an_orbit(sliders: int) -> None:
    parameters = {"stiffness_ratio": 10.0, "sliders": sliders, "chi": -0.3}
    parameters |= {"static_ratio_up": 1.3, "static_ratio_down": 1.2}
    problem = Problem(0.6, 0.4, law="coulomb+iwan+breakaway", parameters=parameters, base=Base((1.0, 0.1)))
    assert looks_of(problem) < 12 * (4 + 2 * sliders) * 14 * 2  # cycles, phases of each, looks at each, harmonics
