"""What sensors would show of a motion, whatever law, wall and dashpot; the last of a number of cycles from rest."""

from math import pi

import numpy as np
import pytest

from frictionlab.simulator import Base, Problem, last_cycle, steady_state
from frictionlab.simulator.problem import COSINE, Wall
from tests.desk import present

HARMONICS = Base((1.0, 0.1, 0.05), (0.0, 0.02))


def polygon(problem: Problem, points: int = 200_000) -> float:
    """The loop's area by many points, as a measurement finds it."""
    orbit = present(steady_state(problem).orbit)
    tau = np.linspace(0.0, 2 * pi, points, endpoint=False)
    x, f = orbit.at(tau)[0], problem.base.at(tau)
    return float(0.5 * np.sum(f * (np.roll(x, -1) - np.roll(x, 1))))


@pytest.mark.parametrize("frame", [0.0, 0.04])
@pytest.mark.parametrize("base", [COSINE, HARMONICS])
@pytest.mark.parametrize("wall", ["fixed", "base"])
@pytest.mark.parametrize("r", [0.3, 1.4])
def test_the_energy_seen_is_the_area_of_the_loop(r: float, wall: Wall, base: Base, frame: float) -> None:
    problem = Problem(r, 0.3, zeta=0.01, wall=wall, base=base, frame_damping_ratio=frame)
    seen = steady_state(problem).energy_per_cycle
    assert seen == pytest.approx(polygon(problem), rel=2e-9)


def test_what_is_seen_is_dissipated_where_the_wall_stands_and_the_frame_has_no_dashpot() -> None:
    state = steady_state(Problem(0.5, 0.4))
    assert state.energy_per_cycle == state.contact_energy_per_cycle
    assert (state.stops_per_cycle, state.regime) == (2.0, "stick-slip")
    damped = steady_state(Problem(0.5, 0.4, frame_damping_ratio=0.05))
    assert damped.contact_energy_per_cycle == pytest.approx(4 * 0.4 * present(damped.response_amplitude), rel=1e-12)


def test_a_mass_that_does_not_move_shows_no_loop() -> None:
    for wall in ("fixed", "base"):
        seen = steady_state(Problem(0.5, 1.5, wall=wall, frame_damping_ratio=0.1, base=HARMONICS))
        assert seen.energy_per_cycle == pytest.approx(0.0, abs=1e-14)
        assert seen.regime == "stuck"


def test_what_does_not_exist_is_none() -> None:
    assert steady_state(Problem(1.0, 0.3)).energy_per_cycle is None
    run = last_cycle(Problem(0.95, 0.1, frame_damping_ratio=0.001), cycles=5)
    assert run.outcome == "not settled"
    seen = present(run.energy_per_cycle)
    assert seen > 0.0


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
