"""A motion of exact phases, typed as what it is, and what its pieces say."""

from itertools import product

import numpy as np

from frictionlab.simulator import Problem, simulate
from frictionlab.simulator.exact.solve import Trajectory, sliders_of

KAPPA, SIDE = 4, 6  # columns of a piece of one mass with one contact


def phases_of(
    problem: Problem, *, cycles: int, x0: float = 0.0, v0: float = 0.0, tau0: float = 0.0, keep: int | None = None
) -> Trajectory:
    """As `simulate`, of a law with exact phases."""
    run = simulate(problem, cycles=cycles, x0=x0, v0=v0, tau0=tau0, keep=keep)
    assert isinstance(run, Trajectory)
    return run


def sides(run: Trajectory) -> np.ndarray:
    """Direction of each piece: +1, -1 (slipping), 0 (holding)."""
    return run.rows[:, SIDE]


def slipping(run: Trajectory) -> np.ndarray:
    """How many sliders slip in each piece: as many as its stiffness says."""
    springs, limits = (np.array(values) for values in sliders_of(run.problem.parameters))
    masks = np.array(list(product((0.0, 1.0), repeat=len(springs))))
    stiffness = (1.0 - masks) @ springs + np.outer(sides(run), masks @ limits) * run.problem.parameter("gradient")
    apart = np.abs(stiffness - run.rows[:, KAPPA, None])
    return np.asarray(masks.sum(axis=1)[apart.argmin(axis=1)])
