"""No event is stepped over, the decision at v = 0 comes first, and chatter has a name."""

from math import acos, cos, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.errors import SimulationError
from frictionlab.simulator import Base, Problem, simulate
from frictionlab.simulator.exact.phase import CHATTER
from frictionlab.simulator.exact.solve import Flow
from tests.simulator.phases import sides


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
    t, few = float(run.duration[0]), 1e-9 if zeta == 1.0 else 1e-13  # critically damped rates are parted
    before = run.at(tau + np.linspace(0.0, t * (1 - 1e-9), 500))[1]
    assert sides(run)[0] == 1.0
    assert before.min() > -few * (v + 1.0 / r)
    if len(run.duration) > 1:
        assert run.rows[1, 3] == 0.0
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
    t, times = float(run.duration[0]), np.linspace(0.0, 2.0 * least, 20001)
    a, b = x + 0.1 - cos(tau) / (1 - r * r), r * (v + sin(tau) / (1 - r * r))
    speeds = -np.sin(tau + times) / (1 - r * r) + (b * np.cos(times / r) - a * np.sin(times / r)) / r
    if speeds.min() > 0.0:
        assert t >= 2.0 * least or speeds.min() < 1e-8  # between two samples it may dip below
    else:
        assert run.rows[1, 3] == 0.0
        assert t <= times[int(np.argmax(speeds <= 0.0))]


def test_at_rest_the_decision_comes_before_the_search() -> None:
    held = simulate(Problem(0.5, 0.4), cycles=1, x0=0.7)  # |cos 0 - 0.7| = 0.3 <= 0.4: sticks
    assert sides(held)[0] == 0.0
    assert held.duration[0] == pytest.approx(acos(0.3), abs=1e-15)  # until cos(tau) - 0.7 = -0.4
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
        t = float(run.duration[0])
        side = float(sides(run)[1]) if len(run.duration) > 1 else 0.0
        pull = base.at(tau + np.linspace(0.0, t, 4000)) - z
        assert sides(run)[0] == 0.0
        assert np.abs(pull).max() <= hold + 1e-12
        assert (side == 0.0) == (t == pytest.approx(2 * pi, abs=1e-12))
        if side:
            assert pull[-1] * side == pytest.approx(hold, abs=1e-12)


def test_chatter_is_named_with_its_place() -> None:
    with pytest.raises(SimulationError, match=r"r = 0\.5: law .*'beta': 0\.4.*: events without end"):
        Flow(Problem(0.5, 0.4)).refuse(CHATTER)
