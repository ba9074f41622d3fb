"""Motions from initial conditions at the edges: a million cycles, tiny and huge starts, thousands of stops."""

import math

import mpmath
import numpy as np
import pytest

from frictionlab.errors import SimulationError
from frictionlab.simulator import Problem, simulate, steady_state

MILLION = 1_000_000
TURN = 2 * math.pi


def test_after_a_million_cycles_the_phase_of_the_drive_is_kept() -> None:
    """Without friction x = (cos tau - cos(tau / r)) / (1 - r^2) is exact for ever; a cycle costs a few roundings."""
    r = 0.7
    run = simulate(Problem(r=r, beta=0.0), cycles=MILLION, keep=1)
    x, _ = run.at([0.0, 1.0, TURN], cycle=MILLION - 1)
    with mpmath.workdps(50):
        ratio = mpmath.mpf(r)
        for late, got in zip((0, 1, 2 * mpmath.pi), x.tolist(), strict=True):
            tau = 2 * mpmath.pi * (MILLION - 1) + late
            exact = (mpmath.cos(tau) - mpmath.cos(tau / ratio)) / (1 - ratio**2)
            assert abs(got - exact) < 2e-15 * MILLION


@pytest.mark.parametrize(("r", "beta", "cycles"), [(0.5, 0.4, 300_000), (0.95, 0.1, 100_000), (0.01, 0.4, 1000)])
def test_the_last_of_very_many_cycles_is_the_orbit_that_was_solved_for(r: float, beta: float, cycles: int) -> None:
    late = np.linspace(0.0, TURN, 9)
    run = simulate(Problem(r=r, beta=beta), cycles=cycles, keep=1)
    orbit = steady_state(Problem(r=r, beta=beta)).orbit
    assert orbit is not None
    for waited, solved in zip(run.at(late, cycle=cycles - 1), orbit.at(late), strict=True):
        np.testing.assert_allclose(waited, solved, rtol=0, atol=1e-11)


def test_unbounded_motion_grows_as_the_balance_of_energy_says() -> None:
    """At r = 1: pi X from the drive less 4 beta X to friction, so X grows by pi - 4 beta each cycle."""
    beta, late = 0.4, np.linspace(0.0, TURN, 5000)
    run = simulate(Problem(r=1.0, beta=beta), cycles=10_001, keep=2)
    first, second = (float(np.ptp(run.at(late, cycle=c)[0])) / 2 for c in (9999, 10_000))
    assert second - first == pytest.approx(math.pi - 4 * beta, rel=1e-4)
    assert first == pytest.approx(10_000 * (math.pi - 4 * beta), rel=1e-3)


@pytest.mark.parametrize("r", [2e4, 1e5])
def test_a_huge_start_of_a_mass_driven_far_above_resonance_swings_back_without_a_stop(r: float) -> None:
    """The free vibration x0 cos(tau / r): a step as long as the bound of v''' holds was taken for a slide's end."""
    run, tau = simulate(Problem(r=r, beta=0.1), cycles=2, x0=1e9), np.linspace(0.0, 2 * TURN, 20)
    np.testing.assert_allclose(run.at(tau)[1], -1e9 / r * np.sin(tau / r), rtol=1e-6)
    assert not len(run.stops)


@pytest.mark.parametrize("tiny", [5e-324, 1e-300, 1e-100, 1e-17])
def test_a_start_too_small_to_matter_does_not_matter(tiny: float) -> None:
    late = np.linspace(0.0, 6 * math.pi, 50)
    rest = simulate(Problem(r=0.5, beta=0.4), cycles=3).at(late)
    for x0, v0 in ((tiny, 0.0), (0.0, tiny), (-tiny, -tiny)):
        moved = simulate(Problem(r=0.5, beta=0.4), cycles=3, x0=x0, v0=v0).at(late)
        np.testing.assert_allclose(moved, rest, rtol=0, atol=1e-13)


@pytest.mark.parametrize("huge", [1e3, 1e6, 1e9, 1e12, 1e15])
@pytest.mark.parametrize("r", [0.3, 1.0, 2.5])
def test_a_huge_start_swings_as_the_free_frame_and_loses_four_beta_a_swing(huge: float, r: float) -> None:
    """Drive and friction are a share 1/huge of the motion: x = x0 cos(tau / r) but for O(1)."""
    late = np.linspace(0.0, 4 * math.pi, 23)
    x, v = simulate(Problem(r=r, beta=0.4), cycles=2, x0=huge).at(late)
    slack = 60.0 + 1e-13 * huge
    np.testing.assert_allclose(x, huge * np.cos(late / r), rtol=0, atol=slack)
    np.testing.assert_allclose(v, -huge / r * np.sin(late / r), rtol=0, atol=slack / min(r, 1.0))


def test_free_swings_lose_four_beta_each_as_coulomb_found() -> None:
    """A drive so fast that it does nothing (r = 1e4): each natural period takes 4 beta off the amplitude."""
    r, beta = 1e4, 0.3
    period = round(r)
    run = simulate(Problem(r=r, beta=beta), cycles=3 * period, x0=100.0, keep=3 * period)
    tops = [float(run.at([0.0], cycle=n * period)[0][0]) for n in range(3)]
    np.testing.assert_allclose(tops, [100.0, 100.0 - 4 * beta, 100.0 - 8 * beta], atol=1e-3)


@pytest.mark.parametrize("value", [math.nan, math.inf, -1e300, 1e150])
@pytest.mark.parametrize("where", [(1, 0, 0), (0, 1, 0), (0, 0, 1)])
def test_a_start_that_no_double_holds_squared_is_refused(where: tuple[int, int, int], value: float) -> None:
    x0, v0, tau0 = (value if there else 0.0 for there in where)
    tau0 *= math.inf if tau0 else 1.0  # any time is a phase
    with pytest.raises(SimulationError, match=r"initial conditions; expected finite numbers of size up to 1e\+100"):
        simulate(Problem(r=0.5, beta=0.4), cycles=1, x0=x0, v0=v0, tau0=tau0)


def test_thousands_of_stops_in_one_cycle_are_each_there() -> None:
    """r = 1e-4: each stop lies after the one before, sticks within the limit of friction, and all are told."""
    run = simulate(Problem(r=1e-4, beta=0.4), cycles=2, keep=1)
    stops = run.stops
    assert len(stops) > 3000
    assert (stops[:, 1] > stops[:, 0]).all()
    assert (stops[1:, 0] > stops[:-1, 1]).all()
    for ends in stops.T:
        x, v = run.at(np.clip(ends, run.start, run.end))
        assert (np.abs(np.cos(ends) - x) <= 0.4 + 1e-9).all()
        assert (np.abs(v) < 1e-6).all()
