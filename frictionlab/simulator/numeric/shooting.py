"""Steady states of numeric laws: Newton on the map of a half, one or several cycles; waiting where Newton gets lost."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import pi

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.simulator.meter import WAITED_CYCLES, WAITED_STEPS
from frictionlab.simulator.numeric import layout
from frictionlab.simulator.numeric.machine import LostError, Machine
from frictionlab.simulator.problem import Problem

TURN = 2.0 * pi
LONGEST = 8  # cycles of a period
TRIES = (2, 4, 16, 64, 256)  # cycles after which Newton is tried though nothing repeats yet
HELD_AFTER = 16  # cycles after which a contact that holds is believed to hold
NEWTON = 15  # maps of one search
CLOSE = 1e-3  # a run has nearly repeated: Newton may finish it
NEAR = 0.1  # how far Newton may move from there, over the size of the motion
CONVERGED = 1e-11  # of the motion's size: rounding of the steps' ends
ALMOST = 1e-8  # and what is taken if nothing better comes


@dataclass(frozen=True)
class Orbit:
    """A fixed point of a map of the motion.

    Parameters
    ----------
    state : ndarray of shape (n,)
        z, v and inner states at tau = 0.
    cycles : int
        Cycles of its period.
    mirrored : bool
        Whether half a cycle later the motion is its own negative.
    residual : float
        By how much the state misses itself, over its size.
    slopes : ndarray of shape (n, n)
        Derivative of the map of a period.
    awaited : bool
        False if the run from rest was still far from it when waiting ended.
    """

    state: FloatArray
    cycles: int
    mirrored: bool
    residual: float
    slopes: FloatArray
    awaited: bool = True

    @property
    def multiplier(self) -> float:
        """What a small disturbance is multiplied by in one period: the largest; its modulus if it is complex."""
        if not np.all(np.isfinite(self.slopes)):
            return float("inf")
        values = np.linalg.eigvals(self.slopes)
        top = values[np.argmax(np.abs(values))]
        return float(top.real) if abs(top.imag) < 1e-12 * abs(top) else float(abs(top))

    @property
    def is_exact(self) -> bool:
        """Whether the state repeats; else it creeps on, and the contact holds."""
        return self.residual <= ALMOST

    @property
    def is_stable(self) -> bool:
        """Whether a small disturbance does not grow."""
        return abs(self.multiplier) < 1.0 + 1e-9


def is_weakening(problem: Problem) -> bool:
    """Whether friction may fall with speed: then motions may coexist, or last several cycles."""
    p = problem.parameters
    return problem.beta > 0.0 and (
        max(problem.mu, p.get("static_ratio", 1.0)) > 1.0
        or p.get("rate_strength", 0.0) < 0.0
        or p.get("evolution_effect", 0.0) > p.get("direct_effect", 0.0)
        or problem.parameter("gradient") != 0.0
    )


def propagate(
    machine: Machine, state: FloatArray, span: float, *, slopes: bool = False, tau0: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Carry a state from tau0 over a span, cycle by cycle; the state reached and, if asked for, its slopes."""
    machine.put(state)
    for begun in np.arange(0.0, span - 1e-9, TURN):
        machine.carry(tau0, float(min(TURN, span - begun)), slopes=slopes)
    matrix = np.array(machine.room.slopes).reshape(layout.WIDTH, layout.WIDTH)
    return machine.state, matrix[: machine.size, : machine.size]


def find_orbit(machine: Machine, start: FloatArray | None, is_held: Callable[[FloatArray], bool]) -> Orbit | None:
    """Find the steady state: that of a neighbour, or the one that the motion from rest settles on.

    Where friction does not weaken with speed, the first stable orbit that Newton finds is the answer. Where it does,
    the run from rest is followed until it nearly repeats after 1 to 8 cycles, and Newton may only finish it. A contact
    that only creeps may creep on for ever: if it holds over the whole cycle, as `is_held` tells, that is the answer.
    """
    mirrored = machine.problem.has_mirror_image
    state = machine.rest_state() if start is None else start
    if start is not None or not is_weakening(machine.problem):
        if start is None:
            state = propagate(machine, state, TURN)[0]
        found = newton(machine, state, 1, mirrored=mirrored)
        if found is not None and found.is_stable:
            return found
    return settle(machine, machine.rest_state(), is_held)


def settle(machine: Machine, begin: FloatArray, is_held: Callable[[FloatArray], bool]) -> Orbit | None:
    """Follow the run from a state until Newton can finish it: when it nearly repeats, and at times in any case."""
    past, close = [begin], CLOSE
    for waited in range(1, WAITED_CYCLES + 1):
        if machine.room.tally[layout.STEPS] > WAITED_STEPS:
            return None
        past = [*past[-LONGEST:], propagate(machine, past[-1], TURN)[0]]
        misses = [_distance(machine, past[-1], other) for other in past[-2::-1]]
        cycles = next((n for n, miss in enumerate(misses, 1) if miss < close), 0)
        close = min(close, 0.1 * misses[cycles - 1]) if cycles else close
        if cycles or waited in TRIES:
            found = _finish(machine, past[-1], cycles or 1)
            if found is not None:
                return found
        if waited >= HELD_AFTER and waited in TRIES and misses[0] < CLOSE and is_held(past[-1]):
            return _creeping(machine, past[-1], misses[0])
    found = newton(machine, past[-1], 1, mirrored=False)
    return replace(found, awaited=False) if found is not None and found.is_stable else None


def _creeping(machine: Machine, state: FloatArray, miss: float) -> Orbit:
    """A state that nearly repeats, as it is."""
    slopes = propagate(machine, state, TURN, slopes=True)[1]
    return Orbit(state, 1, mirrored=False, residual=miss, slopes=slopes)


def _finish(machine: Machine, state: FloatArray, cycles: int) -> Orbit | None:
    """The stable orbit close to a state, of as few cycles as it has; None if there is none."""
    counts = [n for n in range(1, cycles + 1) if cycles % n == 0]
    alike = cycles == 1 and machine.problem.has_mirror_image
    for count, mirrored in [(1, True)] * alike + [(n, False) for n in counts]:
        found = newton(machine, state, count, mirrored=mirrored)
        if found is not None and found.is_stable and _distance(machine, found.state, state) < NEAR:
            return found
    return None


def _size(machine: Machine, state: FloatArray) -> FloatArray:
    """What each component is compared with."""
    return np.array(machine.room.scale[: machine.size]) + np.abs(state)


def _distance(machine: Machine, one: FloatArray, other: FloatArray) -> float:
    return float(np.max(np.abs(one - other) / _size(machine, one)))


def newton(machine: Machine, state: FloatArray, cycles: int, *, mirrored: bool) -> Orbit | None:
    """Newton's method on the map of a period, or of half a period mirrored; None if it does not converge."""
    sign = np.ones(machine.size)
    span = TURN * cycles
    if mirrored:
        sign[:3], span = -1.0, pi
    best: tuple[float, FloatArray, FloatArray] | None = None
    for _ in range(NEWTON):
        try:
            reached, slopes = propagate(machine, state, span, slopes=True)
        except LostError:
            return None
        reached, slopes = sign * reached, sign[:, None] * slopes
        miss = _distance(machine, state, reached)
        if not np.isfinite(miss):
            return None
        if best is not None and miss >= best[0] and best[0] < ALMOST:
            break
        if best is None or miss < best[0]:
            best = miss, state, slopes
        if miss < CONVERGED:
            break
        state = _next(machine, state, reached, slopes, miss)
    if best is None or best[0] > ALMOST:
        return None
    whole = best[2] @ best[2] if mirrored else best[2]
    return Orbit(best[1], cycles, mirrored, best[0], whole)


def _next(machine: Machine, state: FloatArray, reached: FloatArray, slopes: FloatArray, miss: float) -> FloatArray:
    """Newton's next state, not absurdly far away; the state reached where there is none."""
    try:
        change = np.linalg.solve(np.eye(machine.size) - slopes, reached - state)
    except np.linalg.LinAlgError:
        return reached
    if not np.all(np.isfinite(change)):
        return reached
    new = state + change * min(1.0, (10.0 + 1e3 * miss) / (_distance(machine, state, state + change) + 1e-300))
    if machine.is_smooth and abs(new[1]) < 1e-13 * machine.room.scale[1]:
        new[1] = 0.0
    return np.asarray(new)
