"""What every solver's motion offers, whatever it is made of, and the energies of one."""

from itertools import pairwise
from math import ceil, pi
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.simulator.problem import Problem

__all__ = ["Energies", "Motion", "energies_of", "nodes_of"]

Floats = NDArray[np.float64]
NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
PANEL = 0.5  # of the shortest of natural and drive's time scale: far below rounding between events


class Motion(Protocol):
    """A motion of one problem, to be asked at any time between its start and its end; at all times if periodic."""

    @property
    def problem(self) -> Problem:
        """What moves."""

    @property
    def start(self) -> float:
        """Begin of the motion, rad."""

    @property
    def end(self) -> float:
        """End of the motion (or of its first period), rad."""

    @property
    def periodic(self) -> bool:
        """Whether the motion repeats after its end."""

    @property
    def stops(self) -> Floats:
        """Begin and end of each stop, rad, shape (m, 2): times in which the contact does not slip."""

    @property
    def turning_points(self) -> tuple[Floats, Floats]:
        """Times (rad) at which the mass turns relative to the wall, and the displacement x there."""

    def at(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> tuple[Floats, Floats]:
        """Return displacement x over Y (absolute) and velocity x' at times tau (rad), counted from a cycle's start."""

    def force(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> Floats:
        """Return the force of the contact on the mass, against the motion, over k Y, at times tau."""


class Energies(NamedTuple):
    """Energies per cycle over k Y^2: the loop's area (2.18), what the contact takes, what the frame's dashpot takes."""

    loop: float | None
    contact: float | None
    frame: float | None


def energies_of(problem: Problem, taken: float | None, motion: Motion | None) -> Energies:
    """Return the energies of a motion whose contact and dashpots take so much per cycle.

    The loop encloses what is taken where the wall stands and the frame has no dashpot; with a wall that moves with a
    base of one harmonic ``r^2`` times its area is taken, for ``F = -r^2 f'' = r^2 f``. Else it is integrated.

    Examples
    --------
    >>> energies_of(Problem(0.5, 0.2, wall="base"), 1.0, None)
    Energies(loop=4.0, contact=1.0, frame=0.0)
    """
    if taken is None:
        return Energies(None, None, None)
    if not problem.frame_damping_ratio and (problem.wall == "fixed" or problem.base.harmonics == 1):
        return Energies(taken if problem.wall == "fixed" else taken / problem.r**2, taken, 0.0)
    if motion is None:
        return Energies(None, None, None)
    times, weights = nodes_of(motion)
    base, ends = problem.base, np.array([motion.start, motion.end])
    (x, v), rate, f, x_end = motion.at(times), problem.base.rate_at(times), base.at(ends), motion.at(ends)[0]
    cycles = round((motion.end - motion.start) / (2.0 * pi))
    area = float(f[1] * x_end[1] - f[0] * x_end[0]) - float(np.sum(weights * rate * x))  # of f dx, by parts
    frame = 2.0 * problem.frame_damping_ratio * problem.r * float(np.sum(weights * (v - rate) ** 2)) / cycles
    return Energies(area / cycles, taken - frame, frame)


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
