"""How the elastic search begins and ends: what it starts from, what it costs, what sliders hold that never slip."""

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.simulator import Base, Problem
from frictionlab.simulator.elastic import engine, run, steady
from frictionlab.simulator.elastic.phases import first_point, time_to, turn_after
from frictionlab.simulator.elastic.starts import secant
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.layout import Point, State
from frictionlab.simulator.kernel.motion import local_force, motion_at


@pytest.fixture(autouse=True)
def in_plain_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compiling takes longer than all of this file."""
    monkeypatch.setattr(engine, "choose", lambda _: engine.plain())


def looks_of(problem: Problem) -> float:
    """How many looks at a phase the search for a steady state takes."""
    machine = engine.plain()
    parts, room = engine.set_up(machine, problem), engine.make_elastic_room(machine, problem, 4000)
    room.meter[0] = 1e15
    machine.kernel.steady_elastic(*parts, room, [0.0] * layout.ROW)
    return 1e15 - float(room.meter[0])


@settings(max_examples=40, deadline=None)
@given(
    t=st.floats(0.0, 3.0),
    r=st.floats(0.05, 4.0),
    zeta=st.floats(0.0, 1.5),
    v=st.floats(-1.0, 1.0),
    even=st.sampled_from([0.0, 0.2]),
)
def test_a_look_gives_the_slides_motion_and_the_rate_of_its_acceleration(
    t: float, r: float, zeta: float, v: float, even: float
) -> None:
    law: dict[str, Any] = {"law": "coulomb+compliance", "parameters": {"stiffness_ratio": 3.0}}
    problem = Problem(r, 0.3, zeta=zeta, base=Base((1.0, even)), **law)
    rig, _, force = engine.set_up(engine.plain(), problem)
    push, rate = local_force(0.7, force)
    start = State(0.1, v, (push - 0.1 - 2 * zeta * r * v) / r**2)
    now = motion_at(t, rig.plain, force, start)
    h = 1e-5 * min(r, 1.0)
    slope = (motion_at(t + h, rig.plain, force, start).a - now.a) / h
    assert now.bend == pytest.approx(slope, abs=1e-3 * (1.0 + abs(start.a)) / r**3)
    if t == 0.0:
        assert first_point(rig.plain, start, rate).bend == pytest.approx(now.bend, rel=1e-9, abs=1e-9)


@given(speed=st.floats(0.1, 1.0), gain=st.floats(-1.0, 1.0), bend=st.floats(-1.0, 1.0), h=st.floats(1e-4, 0.08))
def test_the_present_rates_tell_when_a_way_is_made_and_when_the_mass_turns(
    speed: float, gain: float, bend: float, h: float
) -> None:
    way = h * (speed + h * (gain / 2 + h * bend / 6))
    assert time_to(way, speed, gain, bend) == pytest.approx(h, rel=1e-6)
    now = Point(0.0, 1e-3 * speed, -1.0, bend)
    rest = turn_after(now.v, now.a, now.bend)
    assert now.v + rest * (now.a + rest * now.bend / 2) == pytest.approx(0.0, abs=1e-12)
    assert turn_after(speed, 1.0, bend) == np.inf


@pytest.mark.parametrize("size", [0.01, 0.03, 0.2, 4.0])
def test_stiffness_and_loss_to_one_harmonic_are_those_of_the_loop(size: float) -> None:
    problem = Problem(0.6, 0.3, law="coulomb+iwan", parameters={"stiffness_ratio": 20.0, "sliders": 3, "chi": -0.4})
    _, sliders, _ = engine.set_up(engine.plain(), problem)
    phase = (np.arange(20_000) + 0.5) * pi / 20_000
    total = 0j
    for kappa, beta in zip(sliders.stiffness, sliders.strength, strict=True):
        crest = min(beta, kappa * size)  # on the way down from the crest; the way up is its mirror image
        force = np.maximum(crest - kappa * size * (1 - np.cos(phase)), -beta)
        total += 2 / (pi * size) * np.sum(force * np.exp(-1j * phase)) * (pi / 20_000)
    assert secant(sliders, size) == pytest.approx(total, rel=1e-4)


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
    assert looks_of(problem.with_parameters({"frame_damping_ratio": 0.0899809})) < 9000


@pytest.mark.parametrize("sliders", [1, 4, 12])
def test_a_search_takes_a_handful_of_cycles(sliders: int) -> None:
    parameters = {"stiffness_ratio": 10.0, "sliders": sliders, "chi": -0.3}
    problem = Problem(0.6, 0.4, law="coulomb+iwan", parameters=parameters, base=Base((1.0, 0.1)))
    assert looks_of(problem) < 12 * (4 + 2 * sliders) * 5 * 2  # cycles, phases of each, looks at each, harmonics


def shifted(problem: Problem, cycles: int, **start: float) -> tuple[Any, Any]:
    """A late cycle of a run, and the steady state."""
    return run(problem, cycles=cycles, keep=1, **start), steady(problem)


def amplitude(motion: Any) -> float:
    x, _ = motion.at(np.linspace(motion.start, motion.end, 4001))
    return float(0.5 * np.ptp(x))


def test_without_a_gradient_what_never_slips_is_relaxed_and_the_orbit_only_shifted() -> None:
    base = Base((1.0, 0.15), (0.0, 0.0, 0.05))
    parameters = {"stiffness_ratio": 4.0, "sliders": 5, "chi": -0.3}
    problem = Problem(0.5, 0.9, law="coulomb+iwan", parameters=parameters, base=base, frame_damping_ratio=0.05)
    late, state = shifted(problem, 60)
    assert state.orbit is not None
    tau = np.linspace(0.0, 2 * pi, 50)
    apart = late.at(late.start + tau)[0] - state.orbit.at(tau)[0]
    assert float(np.ptp(apart)) < 1e-10
    assert state.floquet_multiplier is not None
    assert abs(state.floquet_multiplier) < 0.9  # a force that nothing changes is no direction of the map
    machine = engine.plain()
    parts, room = engine.set_up(machine, problem), engine.make_elastic_room(machine, problem, 400)
    machine.kernel.steady_elastic(*parts, room, [0.0] * layout.ROW)
    kappa, beta, start, tally = parts[1].stiffness, parts[1].strength, room.start, room.tally
    held = [i for i in range(5) if parts[1].slips[i] == 0.0]
    assert len(held) == 2
    residues = {i: start[2 + 2 * i] - kappa[i] * start[0] for i in held}
    shift = sum(residues.values()) / (1.0 + sum(kappa[i] for i in held))  # of the orbit, from all of them relaxed
    for i in held:
        assert room.kinds[i] == layout.OUTER
        offset = residues[i] - kappa[i] * shift
        most, least = (offset + kappa[i] * (z + shift) for z in (tally[layout.HIGH], tally[layout.LOW]))
        at_its_limit = min(abs(most - beta[i]), abs(least + beta[i])) < 1e-8 * beta[i]
        assert at_its_limit or abs(offset) < 1e-9 * beta[i]


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
