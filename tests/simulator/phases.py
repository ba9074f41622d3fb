"""What the pieces of a motion of exact phases say."""

from itertools import product

import numpy as np

from frictionlab.simulator import Motion
from frictionlab.simulator.exact.solve import sliders_of

SIDE, VELOCITY, KAPPA = 2, 4, 5  # columns of a piece of one mass with one contact


def sides(run: Motion) -> np.ndarray:
    """Direction of each piece: +1, -1 (slipping), 0 (holding)."""
    assert run.solver == "exact"
    return np.asarray(run.rows[:, SIDE])


def slipping(run: Motion) -> np.ndarray:
    """How many sliders slip in each piece: as many as its stiffness says."""
    springs, limits = (np.array(values) for values in sliders_of(run.problem.parameters))
    masks = np.array(list(product((0.0, 1.0), repeat=len(springs))))
    stiffness = (1.0 - masks) @ springs + np.outer(sides(run), masks @ limits) * run.problem.parameter("gradient")
    apart = np.abs(stiffness - run.rows[:, KAPPA, None])
    return np.asarray(masks.sum(axis=1)[apart.argmin(axis=1)])
