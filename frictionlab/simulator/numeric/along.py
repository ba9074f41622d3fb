"""A contact with a state of its own along a given motion: its law's formula, stepped until the cycle repeats.

Steps are those of the two-stage diagonally implicit Runge-Kutta method of order 2 with ``g = 1 - sqrt(1/2)``, L-stable
(R. Alexander, SIAM J. Numer. Anal. 14 (1977) 1006); each stage is solved by Newton's method with the law's own slopes.
"""

from math import isfinite, pi, sqrt
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.compiled import compiled
from frictionlab.simulator.numeric.flow import rig_of
from frictionlab.simulator.numeric.radau import Oscillator, contact_at
from frictionlab.simulator.prescribed import shifted
from frictionlab.simulator.problem import Problem

STAGE = 1.0 - sqrt(0.5)
POINTS = 2048  # of a cycle, at least
MOST = 60  # of Newton's steps: a state that is an exponent of the rate comes near by one e-fold each
SAME = 1e-9  # of a state: it repeats
CYCLES = 40  # after which it must


@compiled
def solve_stage(law: Any, rig: Oscillator, z: float, v: float, state: FloatArray, h: float, rates: FloatArray) -> bool:
    """Write the rates of the state that solves ``x = state + h rates(x)``; False where none is found."""
    w, age = state[0], state[1]
    for _ in range(MOST):
        side = v if rig.size < 4 else w
        c = contact_at(law, rig, -1.0 if side < 0.0 else 1.0, z, v, w, age)
        off, late = w - state[0] - h * c[6], age - state[1] - h * c[11]
        a, b, d, e = 1.0 - h * c[9], -h * c[10], -h * c[14], 1.0 - h * c[15]
        whole = a * e - b * d
        dw, dage = (e * off - b * late) / whole, (a * late - d * off) / whole
        w, age = w - dw, age - dage
        rates[0], rates[1] = (w - state[0]) / h, (age - state[1]) / h
        if not (isfinite(w) and isfinite(age)):
            return False
        if abs(dw) <= 1e-12 * (rig.scale[2] + abs(w)) and abs(dage) <= 1e-12 * (1.0 + abs(age)):
            return True
    return False


@compiled
def carry_along(law: Any, rig: Oscillator, motion: FloatArray, state: FloatArray, force: FloatArray) -> bool:
    """Carry the state (2,) once round a motion (4, p): place and speed at the points, and a stage after them."""
    points = motion.shape[1]
    h, rates, begun = 2.0 * pi / points, np.zeros((2, 2)), np.zeros(2)
    for i in range(points):
        j = (i + 1) % points
        side = motion[1, i] if rig.size < 4 else state[0]
        side = -1.0 if side < 0.0 else 1.0
        force[i] = contact_at(law, rig, side, motion[0, i], motion[1, i], state[0], state[1])[0]
        if not solve_stage(law, rig, motion[2, i], motion[3, i], state, STAGE * h, rates[0]):
            return False
        begun[:] = state + (1.0 - STAGE) * h * rates[0]
        if not solve_stage(law, rig, motion[0, j], motion[1, j], begun, STAGE * h, rates[1]):
            return False
        state[:] = begun + STAGE * h * rates[1]
    return True


def force_along(problem: Problem, place: FloatArray) -> FloatArray:
    """Return the force (p,) of a contact with a state of its own, its dashpot apart, as `prescribed.force_under` does.

    Raises
    ------
    SimulationError
        Its state cannot be carried on.
    """
    times = -(-POINTS // len(place))
    fine = np.fft.irfft(np.fft.rfft(place), times * len(place)) * times
    after = STAGE * 2.0 * pi / len(fine)
    motion = np.array([shifted(fine, phase, order) for phase in (0.0, after) for order in (0, 1)])
    law, rig = rig_of(problem, 1e-9)
    state, force = np.array([0.0, 1.0]), np.zeros(len(fine))
    for _ in range(CYCLES):
        before = state.copy()
        if not carry_along(law, rig, motion, state, force):
            break
        if np.all(np.abs(state - before) <= SAME * (np.abs(state) + rig.scale[2:])):
            return force[::times]
    raise SimulationError(
        f"law {problem.law.name}, parameters {problem.parameters}: its force under a given motion does not repeat, or"
        " cannot be found; do: a stiffness_ratio or slip_distance that is less extreme"
    )
