"""The figures of the contact laws draw what the laws are."""

from pathlib import Path

import numpy as np
import pytest

from frictionlab.figures.simulated import draw_contact_force
from frictionlab.figures.style import new_figure
from frictionlab.simulator import Problem, steady_state
from frictionlab.simulator.laws import TERMS
from frictionlab.simulator.numeric import NumericMotion
from tests.benchmarks import law_loops as laws
from tests.simulator.numeric_oracle import cycle


def test_the_loop_of_force_over_displacement_has_the_energy_as_its_area() -> None:
    ax = new_figure().subplots()
    state = steady_state(Problem(0.5, 0.4))
    draw_contact_force(state, ax)
    x, n = (np.asarray(part, dtype=float) for part in ax.lines[0].get_data())
    assert np.sum(0.5 * (n[1:] + n[:-1]) * np.diff(x)) == pytest.approx(state.energy_per_cycle, rel=1e-3)


def test_every_law_of_the_contract_is_drawn() -> None:
    assert {name.split("+")[-1] for name in laws.LAWS} == set(TERMS)
    for name, parameters in laws.LAWS.items():
        Problem(0.5, 0.4, law=name, parameters=parameters)


def test_a_lopsided_motion_of_an_even_contact_is_drawn_as_one_of_two() -> None:
    """LuGre's at r = 1/2 is: from its mirror image half a cycle later the motion is the mirror image again."""
    lopsided = laws.solved("coulomb+lugre", *laws.LOOPS)
    assert laws.name_of(lopsided) == "lugre, or its mirror image"
    assert laws.name_of(laws.solved("coulomb+place", *laws.LOOPS)) == "place"
    assert laws.name_of(laws.solved("coulomb+dahl", *laws.LOOPS)) == "dahl"
    motion = lopsided.orbit
    assert isinstance(motion, NumericMotion)
    start = -motion.state(np.pi)[:3]
    there = cycle(lopsided.problem, start, method="DOP853", rtol=1e-9)[:3]
    np.testing.assert_allclose(there, start, atol=1e-7)
    assert abs(there[0] - motion.state(0.0)[0]) > 0.1  # and it is not the same motion


def test_both_figures_appear(tmp_path: Path) -> None:
    laws.draw_all(tmp_path, ("coulomb", "coulomb+speed"))
    assert {path.name for path in tmp_path.glob("*.png")} == {"laws_force.png", "laws_slow.png"}
