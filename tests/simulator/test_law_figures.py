"""The force of a contact is drawn as it is."""

import numpy as np
import pytest

from frictionlab.figures.simulated import draw_contact_force
from frictionlab.figures.style import new_figure
from frictionlab.simulator import Problem, steady_state
from frictionlab.simulator.numeric import NumericMotion
from tests.simulator.numeric_oracle import cycle


def test_the_loop_of_force_over_displacement_has_the_energy_as_its_area() -> None:
    ax = new_figure().subplots()
    state = steady_state(Problem(0.5, 0.4))
    draw_contact_force(state, ax)
    x, n = (np.asarray(part, dtype=float) for part in ax.lines[0].get_data())
    assert np.sum(0.5 * (n[1:] + n[:-1]) * np.diff(x)) == pytest.approx(state.energy_per_cycle, rel=1e-3)


def test_a_lopsided_motion_of_an_even_contact_is_one_of_two() -> None:
    """LuGre's at r = 1/2 is: from its mirror image half a cycle later the motion is the mirror image again."""
    values = {"stiffness_ratio": 50.0, "bristle_damping": 0.1, "static_ratio": 1.4, "stribeck_speed": 0.2}
    lopsided = steady_state(Problem(0.5, 0.4, law="coulomb+lugre", parameters=values))
    assert lopsided.symmetric is False
    assert lopsided.problem.has_mirror_image
    motion = lopsided.orbit
    assert isinstance(motion, NumericMotion)
    start = -motion.state(np.pi)[:3]
    there = cycle(lopsided.problem, start, method="DOP853", rtol=1e-9)[:3]
    np.testing.assert_allclose(there, start, atol=1e-7)
    assert abs(there[0] - motion.state(0.0)[0]) > 0.1  # and it is not the same motion
