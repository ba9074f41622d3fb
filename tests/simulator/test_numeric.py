"""The integrated flow: order conditions, the rigid law and its limits, scipy as the slow twin, plain Python."""

from math import cos, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator import Base, Problem, last_cycle, laws, steady_state
from frictionlab.simulator.exact.motion import STAGES
from frictionlab.simulator.exact.solve import Flow, workspace
from frictionlab.simulator.laws.law import STILL, Contact, Parameter, Term
from frictionlab.simulator.laws.rate_state import rate_state
from frictionlab.simulator.numeric.integrated import Integrated
from frictionlab.simulator.numeric.radau import BERNSTEIN, MATRIX, NODES, WEIGHTS
from frictionlab.simulator.record import BaseRecord, respond
from tests.desk import present
from tests.simulator.twin import LAWS, TURN, Twin, start_of, steady

each_law = pytest.mark.parametrize("law", LAWS)


def problem(law: str, r: float = 0.7, beta: float = 0.5, **more: Any) -> Problem:
    """A problem with one of the laws, whose parameters can be overridden by `parameters`."""
    parameters = LAWS.get(law.removesuffix("+place"), {}) | more.pop("parameters", {})
    return Problem(r, beta, law=law, parameters=parameters, **more)


def test_the_tableau_fulfils_the_order_conditions() -> None:
    c = NODES[1:]
    for k in range(1, STAGES + 1):
        np.testing.assert_allclose(MATRIX @ c ** (k - 1), c**k / k, rtol=0, atol=1e-15)
    for k in range(1, 2 * STAGES):
        assert MATRIX[-1] @ c ** (k - 1) == pytest.approx(1.0 / k, abs=1e-15)
    assert np.sum(WEIGHTS * NODES**7) == pytest.approx(1.0, abs=1e-9)
    np.testing.assert_allclose(BERNSTEIN @ NODES, np.arange(8) / 7.0, atol=1e-13)


@each_law
def test_scipy_carries_the_orbit_back_to_its_start(law: str) -> None:
    more = {"wall": "base"} if law == "coulomb+dahl" else {"zeta": 0.03} if law == "coulomb+lugre" else {}
    gradient = {"gradient": 0.1} if law in ("coulomb+bouc-wen", "coulomb+stribeck") else {}
    asked = problem(law + "+place" * bool(gradient), r=0.6, parameters=gradient, **more)
    found = steady(asked)
    orbit, tau, twin = present(found.orbit), np.linspace(0.0, TURN, 10), Twin(asked)
    start = start_of(orbit)
    assert twin.run(tau.tolist(), start) == pytest.approx(start, abs=1e-9)
    assert np.transpose(orbit.at(tau)) == pytest.approx(np.array(twin.states)[:, :2], abs=1e-7)
    assert np.array(twin.forces)[1:, 0] == pytest.approx(orbit.force(tau)[1:], abs=1e-6)
    assert twin.friction + twin.viscous == pytest.approx(found.energy_taken, rel=1e-8)


@settings(max_examples=10, deadline=None)
@given(law=st.sampled_from(list(LAWS)), r=st.floats(0.3, 2.0), beta=st.floats(0.1, 0.8))
def test_whatever_the_drive_energy_in_is_energy_out(law: str, r: float, beta: float) -> None:
    found = steady(problem(law, r, beta, frame_damping_ratio=0.02, base=Base((1.0, 0.05), (0.0, 0.02))))
    if found.outcome == "periodic":
        assert present(found.closure_error) <= 1e-8 * max(present(found.energy_per_cycle), 1e-3)


@pytest.mark.parametrize(
    ("law", "neutral", "simpler"),
    [
        ("coulomb+logarithm", {"rate_strength": 0.0}, "coulomb"),
        ("coulomb+stribeck", {"static_ratio": 1.0}, "coulomb"),
        ("coulomb+bouc-wen", {"exponent": 1.0}, "coulomb+dahl"),
    ],
)
def test_a_law_that_does_nothing_is_the_simpler_one(law: str, neutral: dict[str, float], simpler: str) -> None:
    expected = steady_state(problem(simpler, r=0.5)).energy_per_cycle
    assert steady(problem(law, r=0.5, parameters=neutral)).energy_per_cycle == pytest.approx(expected, rel=1e-10)


def test_a_neighbour_is_a_start() -> None:
    what, beside = problem("coulomb+dahl"), problem("coulomb+dahl", beta=0.501)
    for near in (steady(beside), last_cycle(beside, cycles=1)):  # a cycle from rest says of no other start
        assert steady(what, near=near).energy_per_cycle == pytest.approx(steady(what).energy_per_cycle, rel=1e-9)


def test_a_loose_tolerance_sees_no_stop_where_a_slide_begins() -> None:
    """At release a slide moves like t^2: the polynomial of a long step dips below zero there, the motion does not."""
    found = steady(problem("coulomb+stribeck", r=0.3), rtol=1e-6)
    assert len(present(found.orbit).recorded) < 100
    assert found.stops_per_cycle == 2.0


def test_what_has_no_steady_motion_is_said() -> None:
    held = steady(problem("coulomb+stribeck", beta=0.95))
    assert (held.outcome, held.regime, held.energy_per_cycle) == ("stuck", "stuck", 0.0)
    assert steady(problem("coulomb+dahl", r=1.0)).outcome == "unbounded"
    assert steady(problem("coulomb+logarithm", r=1.0)).outcome == "periodic"  # friction grows with speed


def test_the_weakest_friction_takes_what_it_does_on_the_motion_without() -> None:
    """x = cos(tau) / (1 - r^2): the energy is the integral of n(v) v over a cycle."""
    tau, weak = np.linspace(0.0, 2.0 * np.pi, 4001), {"rate_strength": 0.05, "rate_speed": 0.1}
    speed = np.abs(np.sin(tau)) / (1.0 - 0.3**2)
    taken = 1e-12 * float(np.trapezoid((1.0 + 0.05 * np.log1p(speed / 0.1)) * speed, tau))
    found = steady(Problem(0.3, 1e-12, law="coulomb+logarithm", parameters=weak))
    assert found.energy_per_cycle == pytest.approx(taken, rel=1e-4)
    assert "good to about" in found.warnings[-1]


def test_what_cannot_be_integrated_is_refused() -> None:
    with pytest.raises(SimulationError, match="friction turns negative"):
        steady(problem("coulomb+logarithm", parameters={"rate_strength": -0.3, "rate_speed": 0.001}))
    with pytest.raises(UsageError, match="rtol; expected between"):
        steady(Problem(0.5, 0.4), rtol=0.1)


def test_a_narrow_stribeck_curve_is_not_stepped_over() -> None:
    """A step from v = 0.66 to 0 saw nothing of a curve that stands below 0.0126: the energies were 4e-5 apart."""
    curve = {"stiffness_ratio": 962.0, "bristle_damping": 0.73, "static_ratio": 1.87, "stribeck_speed": 0.0126}
    asked = problem("coulomb+lugre", 0.409, 0.108, parameters=curve)
    found, tight = steady(asked), steady(asked, rtol=1e-10)
    assert found.energy_per_cycle == pytest.approx(tight.energy_per_cycle, rel=1e-9)
    assert present(found.closure_error) < 1e-10


def test_newton_finds_the_large_motion_close_to_resonance_and_what_rest_approaches_slowly() -> None:
    found = steady(problem("coulomb+dahl", 1.0015, 0.5766, parameters={"stiffness_ratio": 120.0}))
    exact = present(steady_state(Problem(1.0015, 0.5766)).energy_per_cycle)
    assert found.energy_per_cycle == pytest.approx(exact, rel=0.02)
    creeping = {"stiffness_ratio": 60.0, "gradient": 0.05}
    asked = problem("coulomb+dahl+place", 0.15, 0.226, parameters=creeping, wall="base", base=Base((1.0, 0.03)))
    slow = steady(asked)
    assert slow.outcome in ("stuck", "periodic")
    assert present(slow.closure_error) < 1e-9


def test_rate_and_state_friction_makes_two_stops_where_coulombs_makes_six() -> None:
    """Thesis section 4.3.1: at r = 0.1, while the direct effect outweighs the evolution."""
    slow = {"stiffness_ratio": 1000.0, "direct_effect": 0.06, "slip_distance": 0.02}
    stops = {
        b: steady(problem("coulomb+rate-state", 0.1, 0.4, parameters=slow | {"evolution_effect": b})).stops_per_cycle
        for b in (0.03, 0.09)
    }
    assert steady_state(Problem(0.1, 0.4)).stops_per_cycle == 6.0
    assert stops == {0.03: 2.0, 0.09: 6.0}


@each_law
def test_the_slopes_of_a_cycle_are_those_of_differences(law: str) -> None:
    """Through slides, stops and releases; the multiplier of an orbit is made of them."""
    flow = Integrated(problem(law + "+place", 0.6, 0.5, parameters={"gradient": 0.1}), 1e-10)
    start = flow.carried(flow.rest(), 0.0, 2.0)[0]
    slopes = flow.carried(start, 0.0, 3.0, derived=True)[1]
    steps = np.diag(1e-6 * flow.law["scale"][: len(start)])
    if len(start) == 2 and start[1] == 0.0:
        steps[1] = 0.0
    for step in steps[steps.any(axis=1)]:
        apart = flow.carried(start + step, 0.0, 3.0)[0] - flow.carried(start - step, 0.0, 3.0)[0]
        np.testing.assert_allclose(slopes @ step, 0.5 * apart, rtol=1e-4, atol=1e-5 * float(np.max(step)))


def test_a_search_that_got_lost_leaves_nothing_behind() -> None:
    """Newton once shrank the step to nothing, and the run that took over then began with it: steps "too short"."""
    law = {"direct_effect": 0.0059, "evolution_effect": 0.0877, "slip_distance": 0.0064, "reference_speed": 0.0098}
    flow = Integrated(problem("coulomb+rate-state", 1.5, 0.19, parameters=law | {"stiffness_ratio": 93.8}), 1e-8)
    before = flow.carried(flow.rest(), 0.0, 1.0)[0]
    workspace()[0]["steps"]["next"] = 1e-30
    np.testing.assert_array_equal(flow.carried(flow.rest(), 0.0, 1.0)[0], before)


@each_law
def test_without_friction_every_law_is_the_free_oscillator(law: str) -> None:
    state = steady(Problem(0.5, 0.0, law=law, parameters=LAWS[law]))
    assert state.energy_per_cycle == pytest.approx(0.0, abs=1e-12)
    assert state.response_amplitude == pytest.approx(4.0 / 3.0, rel=1e-8)


JUMPS = {"direct_effect": 0.05, "evolution_effect": 0.2, "reference_speed": 0.1, "stiffness_ratio": 50.0}
CRITICAL = 0.15 * 0.4 / 50.0  # slip distance at which 50 is the critical stiffness, (b - a) beta / D_c


@pytest.mark.parametrize("distance", [1e-6, 0.4 * CRITICAL])
def test_a_contact_too_soft_for_its_fall_of_friction_slips_in_jumps_and_is_refused_by_name(distance: float) -> None:
    asked = problem("coulomb+rate-state", 0.3, 0.4, parameters=JUMPS | {"slip_distance": distance})
    with pytest.raises(SimulationError, match=r"slips in jumps; expected stiffness_ratio above .* got 50: "):
        steady(asked)


@pytest.mark.parametrize(("share", "runs_away"), [(0.5, True), (2.0, False)])
def test_a_massless_contact_runs_away_below_the_critical_stiffness(share: float, *, runs_away: bool) -> None:
    """By scipy: the contact alone, its spring pulled at V0, slightly off its steady slip (Ruina 1983)."""
    own = np.array([0.05, 0.2, share * CRITICAL, 0.1, 50.0])

    def flow(_t: float, y: Any) -> tuple[float, float]:
        done = rate_state(own, 1.0, 0.4, 0.0, 0.1, float(y[0]), float(y[1]))
        return done[6], done[11]

    def is_fast(_t: float, y: Any) -> float:
        return rate_state(own, 1.0, 0.4, 0.0, 0.1, float(y[0]), float(y[1]))[5] - 1e6

    fast: Any = is_fast
    fast.terminal = True
    run = solve_ivp(flow, (0.0, 5.0), (0.4, 1.001), method="Radau", rtol=1e-8, atol=1e-10, events=fast)
    assert (run.status == 1) is runs_away


def waves(own: Any, side: float, friction: float, z: float, _v: float, _w: float, _age: float) -> Contact:
    """Friction ``beta (1 + a cos(q z))``: of a plate with waves."""
    a, q = own[0], own[1]
    factor = 1.0 + a * cos(q * z)
    return (side * friction * factor, side * factor, -side * friction * a * q * sin(q * z), 0.0, 0.0, side, *STILL)


WAVES = Term(
    "waves",
    "friction of a wavy plate",
    "n = s beta (1 + a cos(q z))",
    (Parameter("height", "a", "of the waves", usual=(0.0, 0.3)), Parameter("number", "q", "of them", usual=(1.0, 9.0))),
    kind="smooth",
    contact=waves,
    weakens=lambda p: p["height"] > 0.0,
)


def test_a_new_law_is_one_term_in_the_list_of_laws(monkeypatch: pytest.MonkeyPatch) -> None:
    """The drill of issue 26: nothing but its file and the list knows it; scipy carries its motion to the same place."""
    monkeypatch.setitem(laws.TERMS, "waves", WAVES)
    asked = Problem(1.0, 0.3, law="coulomb+waves", parameters={"height": 0.2, "number": 6.0}, zeta=0.02)
    assert asked.law.name == "coulomb+waves+speed"
    found = steady_state(asked._but(r=0.5))
    assert present(found.closure_error) < 1e-9 * present(found.energy_per_cycle)
    start = start_of(present(found.orbit))
    assert Twin(asked._but(r=0.5)).run([0.0, TURN], start) == pytest.approx(start, abs=1e-8)
    base = BaseRecord(np.arange(7.0), np.sin(np.arange(7.0)) ** 3)
    twin = Twin(asked, CubicSpline(base.time, base.values))
    twin.run(base.time.tolist())
    assert respond(asked, base).displacement == pytest.approx(np.array(twin.states)[:, 0], abs=1e-8)


def test_a_lopsided_motion_of_an_even_contact_is_one_of_two() -> None:
    """LuGre's at r = 1/2 is: from its mirror image half a cycle later the motion is the mirror image again."""
    values = {"stiffness_ratio": 50.0, "bristle_damping": 0.1, "static_ratio": 1.4, "stribeck_speed": 0.2}
    lopsided = steady_state(Problem(0.5, 0.4, law="coulomb+lugre", parameters=values))
    assert lopsided.symmetric is False
    assert lopsided.problem.has_mirror_image
    motion = present(lopsided.orbit)
    start = -start_of(motion, np.pi)
    there = Twin(lopsided.problem).run([0.0, TURN], start)
    assert there == pytest.approx(start, abs=1e-7)
    assert abs(there[0] - start_of(motion)[0]) > 0.1  # and it is not the same motion


def test_a_mass_at_rest_at_the_section_is_at_rest_to_rounding() -> None:
    """The base turns there too: a search left 1e-22 of slip, and its orbit was never that of the motion followed."""
    values = {"static_ratio": 1.4, "stribeck_speed": 0.5639353540363419, "stribeck_exponent": 0.99943726}
    found = steady_state(Problem(0.5, 0.3265626, zeta=0.0055, law="coulomb+stribeck", parameters=values))
    motion = present(found.orbit)
    assert (found.outcome, found.stops_per_cycle) == ("periodic", 1.0)
    assert Twin(found.problem).run([0.0, TURN], start_of(motion)) == pytest.approx(start_of(motion), abs=1e-7)


def test_an_event_at_the_begin_of_a_step_moves_the_tangent_by_the_base_as_it_is_then() -> None:
    """The base's motion of the step's end stood there, and the derivative was 0.68 for 0.42."""
    start, problem = np.array([cos(5.0) - 0.4, 0.0]), Problem(0.5, 0.4)
    flows = (Flow(problem), Integrated(problem, 1e-10))
    exact, integrated = (flow.carried(start, 5.0, 1.0, derived=True)[1] for flow in flows)
    assert integrated == pytest.approx(exact, abs=1e-6)


@pytest.mark.parametrize("degrees", [0, 45, 135, 270])
def test_what_friction_brakes_at_resonance_does_not_depend_on_where_the_base_begins(degrees: int) -> None:
    """The momentary friction stood in for its bound: "unbounded" at five of eight phases."""
    numbers = {"stiffness_ratio": 50.0, "bristle_damping": 0.1, "static_ratio": 1.2, "stribeck_speed": 0.3}
    base = Base((cos(np.deg2rad(degrees)),), (sin(np.deg2rad(degrees)),))
    state = steady_state(Problem(1.0, 0.9, law="coulomb+lugre", parameters=numbers, base=base))
    assert state.outcome == "periodic"
    assert state.energy_per_cycle == pytest.approx(0.10010768, rel=1e-5)
