"""Steady states and motions at the edges of what can be asked: 50 digits, an exact limit, or a named refusal."""

import math
from typing import Any

import mpmath
import numpy as np
import pytest

from frictionlab.errors import SimulationError
from frictionlab.simulator import Problem, simulate, steady_state
from frictionlab.simulator.exact.solve import Flow
from frictionlab.simulator.sweep import warm_up
from tests.desk import present


@pytest.mark.parametrize("beta", [1.0, math.nextafter(1.0, 2.0), 10.0, 1e300])
@pytest.mark.parametrize("r", [1e-3, 0.5, 1.0, 1e3])
@pytest.mark.parametrize("mu", [1.0, 10.0])
@pytest.mark.parametrize("zeta", [0.0, 1e-9, 10.0])
def test_friction_stronger_than_the_drive_holds_the_mass(beta: float, r: float, mu: float, zeta: float) -> None:
    state = steady_state(Problem(r=r, beta=beta, mu=mu, zeta=zeta))
    assert (state.outcome, state.regime) == ("stuck", "stuck")
    assert (state.energy_per_cycle, state.response_amplitude, state.stops_per_cycle) == (0.0, 0.0, 0.0)
    assert state.stuck_fraction == 1.0


@pytest.mark.parametrize("mu", [1.0, 2.0, 10.0])
def test_static_friction_holds_a_mass_at_rest_exactly_up_to_its_limit(mu: float) -> None:
    """From rest |cos(tau)| <= 1: it sticks for mu beta >= 1, and moves for anything less."""
    assert steady_state(Problem(r=0.7, beta=1.0 / mu, mu=mu)).outcome == "stuck"
    assert steady_state(Problem(r=0.7, beta=(1.0 - 1e-9) / mu, mu=mu)).outcome != "stuck"


@pytest.mark.parametrize("r", [30.0, 100.0, 1e3, 1e5])
def test_a_fast_drive_moves_the_mass_by_the_inverse_square(r: float) -> None:
    """r -> infinity: the spring is nothing; X = sqrt(1 - (beta pi / 2)^2) / r^2 while motion is continuous."""
    state = steady_state(Problem(r=r, beta=0.3))
    share = math.sqrt(1 - (0.3 * math.pi / 2) ** 2)
    assert state.response_amplitude == pytest.approx(share / r**2, rel=3 / r**2 + 1e-12)


def test_a_search_without_end_is_given_up_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hardly any friction, thousands of slides a cycle: nothing settles. It took minutes; now some million looks."""
    law = {"static_ratio_up": 10.0, "static_ratio_down": 10.0}
    spent: list[float] = []
    solved = Flow.solved

    def counted(self: Flow, **asked: Any) -> Any:
        found = solved(self, **asked)
        spent.append(found.spent)
        return found

    monkeypatch.setattr(Flow, "solved", counted)
    state = steady_state(Problem(1e-3, 1e-12, law="coulomb+breakaway", parameters=law))
    assert state.outcome == "not found"
    assert "the search was given up after a second of work" in state.verdict
    assert 0.0 < sum(spent) < 1.2e7


@pytest.mark.parametrize("zeta", [1e2, 1e4, 1e6])
@pytest.mark.parametrize("r", [1e-3, 0.5, 100.0])
def test_a_dashpot_stronger_than_any_spring_leaves_the_textbook_s_creep(r: float, zeta: float) -> None:
    """2 zeta r x' = cos(tau) - beta sgn(x'), the rest negligible: a first-order equation whose stops are known."""
    state = steady_state(Problem(r=r, beta=0.4, zeta=zeta))
    thick, moving = 2.0 * zeta * r, 2.0 * math.acos(0.4)
    few = 2.0 / thick + 2.0 * r / zeta
    half = 2.0 * math.sin(0.5 * moving) - 0.4 * moving  # the way of half a cycle, times 2 zeta r
    if few < 0.02:
        assert state.response_amplitude == pytest.approx(0.5 * half / thick, rel=few)
        assert state.stops_per_cycle == 2.0
    assert present(state.closure_error) <= 1e-12 * present(state.energy_per_cycle)


@pytest.mark.parametrize(("beta", "is_said"), [(1e-10, True), (1e-8, False)])
def test_energies_that_do_not_close_are_said_under_numeric_laws_too(beta: float, *, is_said: bool) -> None:
    """Friction of 1e-10 under steps of 1e-8: its work is known to 1e-5 only, and that is told. Weaker: refused."""
    law = {"static_ratio": 1.2, "stribeck_speed": 1e-3}
    state = steady_state(Problem(1.7, beta, law="coulomb+stribeck", parameters=law))
    off = present(state.closure_error) / present(state.energy_per_cycle)
    assert any("energies in and out differ" in said for said in state.warnings) == is_said == (off > 1e-6)


@pytest.mark.parametrize(
    ("r", "beta", "law", "parameters"),
    [
        (1e-3, 1e-12, "coulomb+compliance", {"stiffness_ratio": 1e9}),
        (1e-3, 1e-12, "coulomb+stribeck", {"static_ratio": 1.2, "stribeck_speed": 1e-6}),
    ],
)
def test_stiff_and_steep_laws_are_solved_or_refused_by_name(
    r: float, beta: float, law: str, parameters: dict[str, float]
) -> None:
    """The first took ten seconds, for room that no motion needs; the second minutes: the time limit would end it."""
    warm_up(law)
    try:
        state = steady_state(Problem(r, beta, law=law, parameters=parameters))
    except SimulationError as error:
        assert "more steps than allowed" in str(error) or "events without end" in str(error)  # noqa: PT017 - as is right
    else:
        assert state.outcome == "periodic" or "was not seen to settle" in state.verdict or "given up" in state.verdict


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
    orbit = present(steady_state(Problem(r=r, beta=beta)).orbit)
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
