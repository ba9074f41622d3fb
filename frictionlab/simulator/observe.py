"""What two displacement sensors, one on the mass and one on the base, would show of a steady state."""

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, pi

import numpy as np
from numpy.typing import NDArray

from frictionlab.simulator.motion import Motion
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.state import Regime, SteadyState

__all__ = ["Observation", "nodes_of", "observe"]

NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
PANEL = 0.5  # of the shortest of natural and drive's time scale: far below rounding between events
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Observation:
    """The numbers of a measurement, of a motion that is simulated; None where the state has none.

    Parameters
    ----------
    energy_per_cycle : float or None
        Area of the loop of base over mass displacement, over k Y^2, eq. (2.18): the integral of f dx.
    response_amplitude : float or None
        (max - min) / 2 of the mass's displacement over Y.
    stops_per_cycle : float or None
        Stops relative to the wall, per cycle.
    regime : str or None
        "continuous", "stick-slip" or "stuck".
    """

    energy_per_cycle: float | None
    response_amplitude: float | None
    stops_per_cycle: float | None
    regime: Regime | None


def observe(state: SteadyState) -> Observation:
    """Return what sensors would show of a steady state.

    The loop of base over mass encloses the energy dissipated only where the wall stands and the frame has no dashpot;
    with a dashpot the base's work is not done by the spring alone, and with a wall that moves with the base friction
    works along x - y.

    Examples
    --------
    >>> from frictionlab.simulator import Problem, steady_state
    >>> state = steady_state(Problem(0.5, 0.2, wall="base"))
    >>> round(observe(state).energy_per_cycle / state.energy_per_cycle, 12)
    4.0
    """
    return Observation(_loop_energy(state), state.response_amplitude, state.stops_per_cycle, state.regime)


def _loop_energy(state: SteadyState) -> float | None:
    """Energy by the loop, eq. (2.18): from the energy dissipated where one follows from the other, else integrated."""
    factor = _loop_over_dissipated(state.problem)
    if state.energy_per_cycle is None or factor is not None:
        return None if state.energy_per_cycle is None or factor is None else factor * state.energy_per_cycle
    return None if state.orbit is None else _loop_area(state.orbit)


def _loop_over_dissipated(problem: Problem) -> float | None:
    """Ratio of the loop's energy to the energy dissipated, where the equation of motion fixes it."""
    if problem.wall == "fixed":
        return None if problem.frame_damping_ratio else 1.0
    return 1.0 / problem.r**2 if problem.base.harmonics == 1 else None  # F = -r^2 f'' = r^2 f


def _loop_area(motion: Motion) -> float:
    """Integral of f dx per cycle: by parts, so that it rests on the displacement, between the events."""
    times, weights = nodes_of(motion)
    base, ends = motion.problem.base, np.array([motion.start, motion.end])
    f, x = base.at(ends), motion.at(ends)[0]
    area = float(f[1] * x[1] - f[0] * x[0]) - float(np.sum(weights * base.rate_at(times) * motion.at(times)[0]))
    return area / round((motion.end - motion.start) / (2.0 * pi))


def nodes_of(motion: Motion) -> tuple[Floats, Floats]:
    """Gauss-Legendre nodes and weights from the motion's start to its end, in panels cut at its events."""
    problem = motion.problem
    longest = PANEL * min(problem.r, 1.0 / problem.base.harmonics)
    events = np.concatenate((motion.stops.ravel(), motion.turning_points[0], (motion.start, motion.end)))
    marks = np.unique(np.clip(events, motion.start, motion.end))
    cuts = [np.linspace(a, b, ceil((b - a) / longest) + 1)[:-1] for a, b in pairwise(marks)]
    edges = np.concatenate((*cuts, [motion.end]))
    half = 0.5 * np.diff(edges)
    times = (edges[:-1] + half)[:, None] + half[:, None] * NODES
    return times.ravel(), (half[:, None] * WEIGHTS).ravel()
