"""How the search for an orbit of elastic contacts ends: what it costs, what sliders hold that never slip."""

from math import pi
from typing import Any

import numpy as np
import pytest

from frictionlab.simulator import Base, Problem, steady_state
from frictionlab.simulator import simulate as run
from frictionlab.simulator.exact.solve import Flow

UP_DOWN = {"static_ratio_up": 1.3, "static_ratio_down": 1.2}


def looks_of(problem: Problem) -> float:
    """How many looks at a phase the search for a steady state takes."""
    return Flow(problem).solved().spent


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


@pytest.mark.parametrize(("sliders", "looks"), [(1, 5), (4, 5), (12, 5), (1, 14), (6, 14)])
def test_a_search_takes_a_handful_of_cycles(sliders: int, looks: int) -> None:
    """With break-away rest is followed only until it is drawn to an orbit: more looks at a phase."""
    law, own = ("coulomb+iwan", {}) if looks == 5 else ("coulomb+iwan+breakaway", UP_DOWN)
    parameters = {"stiffness_ratio": 10.0, "sliders": sliders, "chi": -0.3} | own
    problem = Problem(0.6, 0.4, law=law, parameters=parameters, base=Base((1.0, 0.1)))
    assert looks_of(problem) < 12 * (4 + 2 * sliders) * looks * 2  # cycles, phases of each, looks at each, harmonics


def of(law: str, r: float, beta: float, parameters: dict[str, float], **more: Any) -> Problem:
    return Problem(r, beta, law=f"coulomb+{law}", parameters=parameters, **more)


SETTLING = {  # problem, displacement that the motion begins at (at rest on the wall), cycles, period
    # Newton's orbit has a slider that only just touches its limit: it is not the one that rest comes to
    "with a gradient what never slips holds what rest leaves": (
        of(
            *("iwan+place", 1.322143446588725, 1.1493546184824242),
            {
                "stiffness_ratio": 0.8034819640601791,
                "sliders": 3,
                "chi": -0.38365531963430444,
                "gradient": -0.133942357463257,
            },
            frame_damping_ratio=0.07379479418479876,
        ),
        *(0.0, 150, 1),
    ),
    "on a moving wall the search begins at rest on the wall": (
        of(
            *("iwan+place", 1.5, 0.9, {"stiffness_ratio": 1.0, "sliders": 3, "chi": -0.4, "gradient": 0.1}),
            wall="base",
            frame_damping_ratio=0.05,
        ),
        *(1.0, 100, 1),
    ),
    # a search that carried the motion on from Newton's trials came to another one, of energy 0.36815
    "with break-away the orbit is the one that rest settles on": (
        of(
            *("compliance+breakaway", 0.06341084881420596, 0.09842763921765396),
            {
                "stiffness_ratio": 174.6358790914,
                "static_ratio_up": 1.2638205197503,
                "static_ratio_down": 1.326786918658,
            },
            base=Base((1.0, 0.0014414262567462033, 0.0), (0.0, 0.0, -0.07219565353094892)),
        ),
        *(0.0, 80, 1),
    ),
    # a search that took the first orbit close by told the energy 4e-5 off
    "with break-away and gradient the orbit holds what rest leaves": (
        of(
            *("iwan+place+speed+breakaway", 1.9966684304040216, 0.21153953529101732),
            {
                "stiffness_ratio": 0.19122238263780167,
                "sliders": 4.0,
                "chi": -0.7834686064859966,
                "gradient": -0.18135282385048504,
                "contact_damping_ratio": 0.01473978378323338,
                "static_ratio_up": 1.4491830523903007,
                "static_ratio_down": 1.0418150844224923,
            },
            wall="base",
        ),
        *(1.0, 600, 1),
    ),
    "an orbit of seven cycles is not taken for one of two beside it": (
        of(
            *("compliance+breakaway", 0.19145588878011086, 0.5061793110697208),
            {
                "static_ratio_up": 1.2749633156028937,
                "static_ratio_down": 1.244413424921524,
                "stiffness_ratio": 18.899445520381267,
            },
            base=Base((1.0, 0.17982654807900456, 0.0), (0.0, 0.0, -0.03174933091937436)),
        ),
        *(0.0, 607, 7),
    ),
    "uneven break-away may hold, yet rest settles on a motion that slips": (
        of(
            *("compliance+breakaway", 0.5986, 0.735),
            {"static_ratio_up": 1.29, "static_ratio_down": 1.47, "stiffness_ratio": 87.2},
        ),
        *(0.0, 500, 1),
    ),
    "an orbit of many cycles is found": (
        of(
            *("iwan+breakaway", 3.51, 1.0735),
            {
                "static_ratio_up": 1.434,
                "static_ratio_down": 1.383,
                "stiffness_ratio": 209.5,
                "sliders": 2,
                "chi": -0.56,
            },
        ),
        *(0.0, 126, 18),
    ),
}


@pytest.mark.parametrize("why", SETTLING)
def test_the_steady_state_is_where_the_motion_from_rest_comes(why: str) -> None:
    problem, x0, cycles, period = SETTLING[why]
    state, late = steady_state(problem), run(problem, cycles=cycles, keep=1, x0=x0)
    assert state.orbit is not None
    assert state.period_cycles == period
    tau = np.linspace(0.0, 2 * pi, 50)
    away = [np.abs(late.at(late.start + tau)[0] - state.orbit.at(tau + 2 * pi * i)[0]).max() for i in range(period)]
    assert min(away) < 1e-9
