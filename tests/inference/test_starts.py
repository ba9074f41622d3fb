"""The friction ratio that a loop tells, of a rigid contact and of one that yields before it slips."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from frictionlab.inference.starts import elastic_friction_ratios, strokes_of
from frictionlab.simulator import Problem, steady_state

TAU = 2 * np.pi * np.arange(4096) / 4096


def force_of_slider(slid: NDArray[np.float64], beta: float, stiffness: float) -> NDArray[np.float64]:
    """The contact's force over a motion, point by point: the slow twin; two rounds, the second is steady."""
    force, found = 0.0, []
    for step in np.tile(np.diff(slid, prepend=slid[-1]), 2):
        force = min(max(force + stiffness * step, -beta), beta)
        found.append(force)
    return np.array(found[len(slid) :])


@pytest.mark.parametrize(("r", "stiffness"), [(0.3, 3.0), (0.3, 40.0), (0.7, 10.0), (1.3, 25.0)])
def test_the_energy_of_an_elastic_contact_tells_its_friction_ratio(r: float, stiffness: float) -> None:
    state = steady_state(Problem(r, 0.4, law="coulomb+compliance", parameters={"stiffness_ratio": stiffness}))
    assert state.orbit is not None
    assert state.energy_per_cycle is not None
    found = elastic_friction_ratios(strokes_of(state.orbit.at(TAU)[0]), state.energy_per_cycle, stiffness)
    assert min(abs(beta - 0.4) for beta in found) < 2e-4


@given(
    st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3),
    st.floats(0.05, 0.6),
    st.floats(2.0, 30.0),
)
@settings(max_examples=40)
def test_strokes_take_in_what_a_slider_takes_in_of_any_motion(
    parts: list[float], beta: float, stiffness: float
) -> None:
    tau = TAU[::8]
    slid = np.cos(tau) + parts[0] * np.sin(3 * tau) + parts[1] * np.cos(2 * tau) + parts[2] * np.sin(7 * tau)
    force = force_of_slider(slid, beta, stiffness)
    before = np.roll(force, 1)
    work = float(np.sum(0.5 * (force + before) * np.diff(slid, prepend=slid[-1])))
    slipped = np.maximum(strokes_of(slid) - 2 * beta / stiffness, 0.0)
    assert 2 * beta * slipped.sum() == pytest.approx(work, rel=0.01, abs=0.01)


def test_a_contact_too_soft_for_the_energy_has_no_friction_ratio() -> None:
    """A slider takes in at most kappa X^2, at beta = kappa X / 2 (set dE / dbeta = 0 in 4 beta (X - beta / kappa))."""
    strokes = np.array([2.0])
    assert elastic_friction_ratios(strokes, 1.01, 1.0) == ()
    assert elastic_friction_ratios(strokes, 0.9999, 1.0) == pytest.approx([0.495, 0.505], abs=1e-3)
