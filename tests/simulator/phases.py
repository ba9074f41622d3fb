"""What the pieces of a motion of exact phases say."""

import numpy as np

from frictionlab.simulator import Motion

SIDE, VELOCITY = 2, 4  # columns of a piece of one mass with one contact


def sides(run: Motion) -> np.ndarray:
    """Direction of each piece: +1, -1 (slipping), 0 (holding)."""
    assert run.solver == "exact"
    return np.asarray(run.rows[:, SIDE])
