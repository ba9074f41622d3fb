"""The last of a number of cycles from rest, whatever law and solver."""

import pytest

from frictionlab.simulator import Problem, last_cycle, steady_state
from frictionlab.simulator.problem import Wall


@pytest.mark.parametrize("frame", [0.0, 0.05])
@pytest.mark.parametrize("wall", ["fixed", "base"])
def test_quadrature_over_a_motion_agrees_with_the_sum_over_its_phases(wall: Wall, frame: float) -> None:
    problem = Problem(0.6, 0.3, zeta=0.02, wall=wall, frame_damping_ratio=frame)
    slow, fast = last_cycle(problem, cycles=40), steady_state(problem)
    for key in ("energy_per_cycle", "response_amplitude", "stuck_fraction"):
        assert getattr(slow, key) == pytest.approx(getattr(fast, key), rel=1e-7, abs=1e-9)
    assert (slow.outcome, slow.stops_per_cycle, slow.regime) == (fast.outcome, fast.stops_per_cycle, fast.regime)
    assert slow.closure_error == pytest.approx(0.0, abs=1e-9)


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
