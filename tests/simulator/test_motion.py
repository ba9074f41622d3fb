"""A motion: phases against the textbook at 50 digits, events, evaluated anywhere, what sensors would show of it."""

from math import acos, cos, nextafter, pi, sin

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.errors import SimulationError
from frictionlab.simulator import Base, Problem, last_cycle, simulate, steady_state
from frictionlab.simulator.exact.answer import gap
from frictionlab.simulator.exact.phase import CHATTER
from frictionlab.simulator.exact.solve import Flow
from tests.simulator.phases import VELOCITY, sides
from tests.simulator.twin import Twin

RATIOS = st.floats(0.01, 30.0)
DAMPINGS = st.sampled_from([0.0, 1e-9, 0.01, 0.3, 0.999999, 1.0, 1.000001, 3.0, 10.0])


def few_of(zeta: float, few: float) -> float:
    """What rounding may do; of critical damping two rates are parted by 1e-10 of zeta (design, "One engine")."""
    return max(few, 1e-9) if abs(zeta - 1.0) < 1e-10 else few


def from_rest(r: float, zeta: float, k: int, t: float) -> mp.mpc:
    """Motion from rest under exp(i k t), at 50 digits: the integral of the free motion against the force, solved."""
    with mp.workdps(50):
        r, zeta, t = mp.mpf(r), mp.mpf(zeta), mp.mpf(t)
        if zeta == 1 or (zeta == 0 and k * r == 1):
            zeta += mp.mpf(10) ** -30  # the limit, to more digits than are compared
        root = mp.sqrt(mp.mpc(zeta * zeta - 1))
        l1, l2, s = (-zeta + root) / r, (-zeta - root) / r, mp.mpc(0, k)
        parts = [mp.exp(a * t) / ((a - b) * (a - c)) for a, b, c in ((s, l1, l2), (l1, s, l2), (l2, s, l1))]
        return sum(parts) / r**2


@pytest.mark.parametrize("zeta", [0.0, 1e-12, 1e-3, 0.5, 1.0 - 1e-12, 1.0, 1.0 + 1e-12, 2.0, 10.0])
@pytest.mark.parametrize("r", [0.01, 0.5, 1.0 - 1e-12, nextafter(1, 0), 1.0, 1.0 + 1e-9, 1.2, 3.0, 10.0])
def test_motion_from_rest_agrees_with_fifty_digits_also_through_resonance(r: float, zeta: float) -> None:
    runs = [simulate(Problem(r, 0.0, zeta=zeta, base=base), cycles=1) for base in (Base(), Base((0.0,), (1.0,)))]
    for t in (0.3 * min(r, 1.0), 0.7, pi):
        found, truth = complex(*(float(run.at(t)[0]) for run in runs)), from_rest(r, zeta, 1, t)
        few = few_of(zeta, 5e-15 * (1.0 + t / r))
        assert abs(found - complex(truth)) <= few * (abs(truth) + min(1.0, t * t / (r * r))) + 1e-19


@settings(deadline=None, max_examples=40)
@given(r=RATIOS, zeta=DAMPINGS, t=st.floats(0.01, 2.0), u=st.floats(0.01, 2.0))
def test_two_slides_in_a_row_are_one(r: float, zeta: float, t: float, u: float) -> None:
    problem = Problem(r, 0.0, zeta=zeta)
    whole = simulate(problem, cycles=1, x0=0.2, v0=-0.3, tau0=0.4)
    (x, last), (v, speed) = whole.at(np.array([0.4 + t, 0.4 + t + u]))
    rest = simulate(problem, cycles=1, x0=float(x), v0=float(v), tau0=0.4 + t).at(0.4 + t + u)
    few = few_of(zeta, 1e-12)
    assert float(rest[0]) == pytest.approx(float(last), abs=few * (1 + 1 / r))
    assert float(rest[1]) == pytest.approx(float(speed), abs=few * (1 + 1 / r**2))


@given(r=st.floats(0.001, 3.0), k=st.integers(1, 1000))
def test_the_distance_from_resonance_has_no_rounding_in_its_product(r: float, k: int) -> None:
    with mp.workdps(50):
        truth = 1 - mp.mpf(k) * mp.mpf(r)
        assert gap(r, float(k)) == pytest.approx(float(truth), rel=3e-16, abs=0.0 if truth else 1e-300)


TURN = 2 * pi


@pytest.mark.parametrize(
    "problem",
    [
        Problem(0.1, 0.4),
        Problem(0.7, 0.5),
        Problem(0.3, 0.2, 1.5, 0.1),
        Problem(0.6, 0.3, wall="base", base=Base((1.0, 0.1))),
    ],
    ids=["stops", "continuous", "static", "moving wall"],
)
def test_motion_from_anywhere_is_the_slow_twin_and_has_no_jumps(problem: Problem) -> None:
    tau = np.linspace(0.0, 2.0 * TURN, 21)
    run, twin = simulate(problem, cycles=2, x0=0.3, v0=-0.2), Twin(problem)
    twin.run(tau.tolist(), np.array([0.3, -0.2]))
    assert np.transpose(run.at(tau)) == pytest.approx(np.array(twin.states), abs=1e-8)
    before, after = (run.at(run.begins[1:] + side)[0] for side in (-1e-9, 1e-9))
    np.testing.assert_allclose(before, after, atol=1e-7)


def test_an_orbit_is_defined_at_all_times_a_run_only_within() -> None:
    orbit = steady_state(Problem(0.3, 0.6)).orbit
    assert orbit is not None
    tau = np.linspace(-20.0, 20.0, 50)
    np.testing.assert_allclose(orbit.at(tau + 3 * TURN)[0], orbit.at(tau)[0], atol=1e-13)
    run = simulate(Problem(0.3, 0.6), cycles=2)
    with pytest.raises(SimulationError, match="expected times between 0 and"):
        run.at(4.1 * pi)
    with pytest.raises(SimulationError, match="ask within the motion"):
        simulate(Problem(0.3, 0.6), cycles=5, keep=1).at(0.0)


def test_times_counted_from_a_cycle_are_times_counted_from_the_start() -> None:
    run = simulate(Problem(0.4, 0.2), cycles=7, tau0=1.0)
    tau = np.linspace(1.0, 1.0 + TURN - 1e-9, 40)
    for cycle in range(7):
        np.testing.assert_allclose(run.at(tau, cycle=cycle)[0], run.at(tau + cycle * TURN)[0], atol=1e-12)


def test_a_late_part_of_a_run_is_the_same_whether_the_rest_was_kept() -> None:
    whole, part = simulate(Problem(0.23, 0.3), cycles=9), simulate(Problem(0.23, 0.3), cycles=9, keep=2)
    tau = np.linspace(7 * TURN, 9 * TURN, 60)
    np.testing.assert_array_equal(whole.at(tau[:-1])[0], part.at(tau[:-1])[0])
    assert part.cycle.min() == 7


def test_arrays_cannot_be_written_to() -> None:
    run = simulate(Problem(0.5, 0.4), cycles=1)
    with pytest.raises(ValueError, match="read-only"):
        run.rows[0, 1] = 1.0


HARMONICS, TAU = Base((1.0, 0.1, 0.05), (0.0, 0.02)), np.linspace(0.0, TURN, 4001)


def test_a_mass_that_does_not_move_shows_no_loop() -> None:
    for wall in ("fixed", "base"):
        seen = steady_state(Problem(0.5, 1.5, wall=wall, frame_damping_ratio=0.1, base=HARMONICS))
        assert seen.energy_per_cycle == pytest.approx(0.0, abs=1e-14)
        assert seen.regime == "stuck"
        assert seen.response_amplitude == pytest.approx(
            float(np.ptp(HARMONICS.at(TAU))) / 2 * (wall == "base"), rel=1e-5
        )


@pytest.mark.parametrize(
    ("law", "parameters", "solver"),
    [
        ("coulomb+compliance", {"stiffness_ratio": 50.0}, "exact"),
        ("coulomb+stribeck", {"static_ratio": 1.2, "stribeck_speed": 0.1}, "numeric"),
    ],
)
def test_a_run_of_another_law_comes_to_its_steady_state(law: str, parameters: dict[str, float], solver: str) -> None:
    problem = Problem(0.4, 0.5, law=law, parameters=parameters)
    last, steady = last_cycle(problem, cycles=20), steady_state(problem)
    assert (last.outcome, last.solver) == ("periodic", solver)
    assert last.energy_per_cycle == pytest.approx(steady.energy_per_cycle, rel=1e-6)
    assert last.stops_per_cycle == steady.stops_per_cycle


@settings(deadline=None, max_examples=60)
@given(
    r=st.floats(0.02, 10.0),
    zeta=st.sampled_from([0.0, 0.0, 0.03, 1.0, 4.0]),
    tau=st.floats(0.0, 6.28),
    z=st.floats(-1.5, 1.5),
    v=st.floats(0.001, 3.0),
    third=st.floats(-0.3, 0.3),
)
def test_before_the_end_of_a_slide_the_velocity_keeps_its_sign(
    r: float, zeta: float, tau: float, z: float, v: float, third: float
) -> None:
    problem = Problem(r, 0.3, zeta=zeta, base=Base((1.0, 0.0, third), (0.0, 0.1, 0.0)))
    run = simulate(problem, cycles=1, x0=z, v0=v, tau0=tau)
    t, few = float(run.rows[0, 1]), 1e-9 if zeta == 1.0 else 1e-13  # critically damped rates are parted
    before = run.at(tau + np.linspace(0.0, t * (1 - 1e-9), 500))[1]
    assert sides(run)[0] == 1.0
    assert before.min() > -few * (v + 1.0 / r)
    if len(run.rows) > 1:
        assert run.rows[1, VELOCITY] == 0.0
        assert abs(float(run.at(tau + t * (1 - 1e-15))[1])) <= few * (v + 1.0 / r**2)
        assert sides(run)[1] <= 0.0


@pytest.mark.parametrize("depth", [1e-3, 1e-6, 1e-9, 1e-12, -1e-3, -1e-6, -1e-9, -1e-12])
@pytest.mark.parametrize("r", [0.02, 0.05, 0.5])
def test_a_grazing_stop_is_met_or_passed_as_it_must_be(r: float, depth: float) -> None:
    # about the mean speed of a rising force the mass vibrates freely: its least speed is close to `depth`
    tau, least = 1.5 * pi, 0.6 * r
    gain = -(1.0 - depth) * sin(least / r) / r
    x, v = cos(tau) - 0.1 - r * r * gain, 1.0 - (1.0 - depth) * cos(least / r)
    run = simulate(Problem(r, 0.1), cycles=1, x0=x, v0=v, tau0=tau)
    t, times = float(run.rows[0, 1]), np.linspace(0.0, 2.0 * least, 20001)
    a, b = x + 0.1 - cos(tau) / (1 - r * r), r * (v + sin(tau) / (1 - r * r))
    speeds = -np.sin(tau + times) / (1 - r * r) + (b * np.cos(times / r) - a * np.sin(times / r)) / r
    if speeds.min() > 0.0:
        assert t >= 2.0 * least or speeds.min() < 1e-8  # between two samples it may dip below
    else:
        assert run.rows[1, VELOCITY] == 0.0
        assert t <= times[int(np.argmax(speeds <= 0.0))]


def test_at_rest_the_decision_comes_before_the_search() -> None:
    held = simulate(Problem(0.5, 0.4), cycles=1, x0=0.7)  # |cos 0 - 0.7| = 0.3 <= 0.4: sticks
    assert sides(held)[0] == 0.0
    assert held.rows[0, 1] == pytest.approx(acos(0.3), abs=1e-15)  # until cos(tau) - 0.7 = -0.4
    assert sides(held)[1] == -1.0
    free = simulate(Problem(0.5, 0.4), cycles=1, x0=0.5)
    assert sides(free)[0] == 1.0
    static = simulate(Problem(0.5, 0.4, mu=1.5), cycles=1, x0=0.5)
    assert sides(static)[0] == 0.0


@settings(deadline=None, max_examples=40)
@given(z=st.floats(-0.9, 0.9), hold=st.floats(0.01, 0.9), tau=st.floats(0.0, 6.28), second=st.floats(-0.4, 0.4))
def test_a_release_is_the_first_time_the_pull_passes_the_limit(
    z: float, hold: float, tau: float, second: float
) -> None:
    for base in (Base((1.0,), (0.2,)), Base((1.0, second), (0.2, 0.0))):
        if abs(float(base.at(tau)) - z) > hold * (1 - 1e-9):
            continue
        run = simulate(Problem(0.5, hold, base=base), cycles=1, x0=z, tau0=tau)
        t = float(run.rows[0, 1])
        side = float(sides(run)[1]) if len(run.rows) > 1 else 0.0
        pull = base.at(tau + np.linspace(0.0, t, 4000)) - z
        assert sides(run)[0] == 0.0
        assert np.abs(pull).max() <= hold + 1e-12
        assert (side == 0.0) == (t == pytest.approx(2 * pi, abs=1e-12))
        if side:
            assert pull[-1] * side == pytest.approx(hold, abs=1e-12)


def test_chatter_is_named_with_its_place() -> None:
    with pytest.raises(SimulationError, match=r"r = 0\.5: law .*'beta': 0\.4.*: events without end"):
        Flow(Problem(0.5, 0.4)).refuse(CHATTER)
