"""What the pieces of a motion of exact phases say."""

import numpy as np

from frictionlab.simulator import Motion, SteadyState, simulate
from tests.desk import present

TURN = 2.0 * np.pi

SIDE, VELOCITY = 2, 4  # columns of a piece of one mass with one contact


def sides(run: Motion) -> np.ndarray:
    """Direction of each piece: +1, -1 (slipping), 0 (holding)."""
    assert run.solver == "exact"
    return np.asarray(run.rows[:, SIDE])


def settles_on(state: SteadyState, cycles: int, within: float, x0: float = 0.0) -> bool:
    """Whether the run from rest at a place is on the orbit after so many cycles."""
    late, orbit = simulate(state.problem, cycles=cycles, keep=1, x0=x0), present(state.orbit)
    tau = np.linspace(0.0, TURN, 50)
    x = late.at(np.minimum(late.start + tau, late.end))[0]
    starts = TURN * np.arange(state.period_cycles or 1)
    return bool(min(np.abs(x - orbit.at(tau + start)[0]).max() for start in starts) < within)
