"""A contact with a state of its own along a given motion: its law's formula, stepped until the cycle repeats.

Steps are those of the two-stage diagonally implicit Runge-Kutta method of order 2 with ``g = 1 - sqrt(1/2)``, L-stable
(R. Alexander, SIAM J. Numer. Anal. 14 (1977) 1006); each stage is solved by Newton's method with the law's own slopes.

The flows that carry masses do not serve: between all samples of a given motion they would make a step of seven stages,
and a fit asks for hundreds of cycles.
"""

from math import isfinite, pi, sqrt

import numpy as np

from frictionlab.arrays import FloatArray, shifted
from frictionlab.errors import SimulationError
from frictionlab.simulator.compiled import compiled, inner
from frictionlab.simulator.exact.flow import call_formula
from frictionlab.simulator.numeric.integrated import Integrated
from frictionlab.simulator.problem import Problem

STAGE = 1.0 - sqrt(0.5)
POINTS = 2048  # of a cycle, at least
MOST = 60  # of Newton's steps: a state that is an exponent of the rate comes near by one e-fold each
SAME = 1e-9  # of a state: it repeats
CYCLES = 40  # after which it must


@compiled
def solve_stage(law: int, own: FloatArray, grip: FloatArray, motion: FloatArray, state: FloatArray, h: float) -> bool:
    """Make a state (2,), in which a step of h is begun, its end, at a place and speed; False where none is found.

    `grip`: friction ratio, gradient, sizes of the two states, and 1 where the second is an age.
    """
    w, age, z, v = state[0], state[1], motion[0], motion[1]
    for _ in range(MOST):
        c = call_formula(law, (own, side_of(grip, v, w), grip[0] * (1.0 + grip[1] * z), z, v, w, age))
        off, late = w - state[0] - h * c[6], age - state[1] - h * c[11]
        a, b, d, e = 1.0 - h * c[9], -h * c[10], -h * c[14], 1.0 - h * c[15]
        whole = a * e - b * d
        dw, dage = (e * off - b * late) / whole, (a * late - d * off) / whole
        w, age = w - dw, age - dage
        if not (isfinite(w) and isfinite(age)):
            return False
        if abs(dw) <= 1e-12 * (grip[2] + abs(w)) and abs(dage) <= 1e-12 * (1.0 + abs(age)):
            state[0], state[1] = w, age
            return True
    return False


@inner
def side_of(grip: FloatArray, v: float, w: float) -> float:
    """Return the side on which a contact is."""
    return -1.0 if (w if grip[4] else v) < 0.0 else 1.0


@compiled
def carry_along(
    law: int, own: FloatArray, grip: FloatArray, motion: FloatArray, state: FloatArray, force: FloatArray
) -> bool:
    """Carry the state (2,) once round a motion (p, 2, 2): place and speed at the points, and a stage after them."""
    h, begun, stage = 2.0 * pi / len(motion), np.zeros(2), np.zeros(2)
    for i in range(len(motion)):
        (z, v), j = motion[i, 0], (i + 1) % len(motion)
        friction, side = grip[0] * (1.0 + grip[1] * z), side_of(grip, v, state[0])
        force[i] = call_formula(law, (own, side, friction, z, v, state[0], state[1]))[0]
        stage[:] = state
        if not solve_stage(law, own, grip, motion[i, 1], stage, STAGE * h):
            return False
        begun[:] = state + (1.0 - STAGE) / STAGE * (stage - state)
        if not solve_stage(law, own, grip, motion[j, 0], begun, STAGE * h):
            return False
        state[:] = begun
    return True


def force_along(problem: Problem, place: FloatArray) -> FloatArray:
    """Return the force (p,) of a contact with a state of its own, its dashpot apart, as `prescribed.force_under` does.

    Raises
    ------
    SimulationError
        Its state cannot be carried on.
    """
    times = -(-POINTS // len(place))
    points = times * len(place)
    after = STAGE * 2.0 * pi / points
    motion = np.array([[shifted(place, phase, order, times) for order in (0, 1)] for phase in (0.0, after)])
    flow = Integrated(problem, 1e-9)
    law, state, force = flow.law, np.array([0.0, 1.0]), np.zeros(points)
    size = law["scale"][2:4] * (1.0, 1.0 if law["states"][0] > 1 else 0.0)
    grip = np.array([problem.beta, problem.parameter("gradient"), *size, law["states"][0] > 1], np.float64)
    for _ in range(CYCLES):
        before = state.copy()
        if not carry_along(int(law["formula"][0]), law["own"][0], grip, np.moveaxis(motion, 2, 0).copy(), state, force):
            break
        if np.all(np.abs(state - before) <= SAME * (np.abs(state) + size)):
            return force[::times]
    raise SimulationError(
        f"law {problem.law.name}, parameters {problem.parameters}: its force under a given motion does not repeat, or"
        " cannot be found; do: a stiffness_ratio or slip_distance that is less extreme"
    )
