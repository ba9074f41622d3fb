"""What the pieces of a motion of exact phases say."""

import numpy as np

from frictionlab.simulator import Motion, SteadyState, simulate
from frictionlab.simulator.exact.phase import SIDE
from tests.desk import present

TURN = 2.0 * np.pi

VELOCITY = SIDE + 2  # column of a piece of one mass with one contact


def sides(run: Motion) -> np.ndarray:
    """Direction of each piece: +1, -1 (slipping), 0 (holding)."""
    assert run.solver == "exact"
    return np.asarray(run.rows[:, SIDE])


def settles_on(state: SteadyState, cycles: int, within: float, x0: float = 0.0) -> bool:
    """Whether motion and force of the run from rest at a place are those of the orbit after so many cycles."""
    late, orbit = simulate(state.problem, cycles=cycles, keep=1, x0=x0), present(state.orbit)
    tau = np.linspace(0.0, TURN, 50)
    now = np.minimum(late.start + tau, late.end)
    seen, starts = np.array([late.at(now)[0], late.force(now)]), TURN * np.arange(state.period_cycles or 1)
    away = [np.abs(seen - [orbit.at(tau + start)[0], orbit.force(tau + start)]).max() for start in starts]
    return bool(min(away) < within)
