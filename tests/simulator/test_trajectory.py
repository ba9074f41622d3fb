"""A motion evaluated anywhere: phases join, times wrap, cycles count without losing phase."""

from math import pi

import numpy as np
import pytest

from frictionlab.errors import SimulationError
from frictionlab.simulator import Base, Problem, simulate, steady_state

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
def test_motion_is_continuous_and_its_velocity_its_derivative(problem: Problem) -> None:
    run = simulate(problem, cycles=4, x0=0.3, v0=-0.2)
    joints = run.begins[1:]
    x0, v0 = run.at(joints - 1e-9)
    x1, v1 = run.at(joints + 1e-9)
    np.testing.assert_allclose(x0, x1, atol=1e-7)
    np.testing.assert_allclose(v0, v1, atol=1e-5 / problem.r**2)
    tau = np.linspace(0.01, 4 * TURN - 0.01, 977)
    slope = (run.at(tau + 1e-6)[0] - run.at(tau - 1e-6)[0]) / 2e-6
    np.testing.assert_allclose(slope, run.at(tau)[1], atol=1e-4 / problem.r**2)
    assert run.at(0.0)[0] == pytest.approx(0.3, abs=1e-15)
    assert run.at(0.0)[1] == pytest.approx(-0.2, abs=1e-15)


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


def test_stops_are_where_the_mass_rests() -> None:
    run = simulate(Problem(0.1, 0.4), cycles=3)
    middle = run.stops.mean(axis=1)
    assert np.abs(run.at(middle)[1]).max() == 0.0
    assert (run.stops[:, 1] > run.stops[:, 0]).all()


def test_arrays_cannot_be_written_to() -> None:
    run = simulate(Problem(0.5, 0.4), cycles=1)
    with pytest.raises(ValueError, match="read-only"):
        run.rows[0, 1] = 1.0
