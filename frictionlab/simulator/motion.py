"""A motion made of phases: when they are, what every solver's motion offers, and the energies of one."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.problem import Problem

TURN = 2.0 * np.pi
NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
PANEL = 0.5  # of the shortest of natural and drive's time scale: far below rounding between events
BISECTIONS = 50  # of an interval: to rounding


@dataclass(frozen=True)
class Timeline:
    """The phases of a motion in time.

    The phase of the drive is kept apart from the count of cycles, so that the millionth cycle is as exact as the first.

    Parameters
    ----------
    cycle : ndarray of shape (n,)
        Cycle in which each phase begins, counted from the start of the motion.
    tau : ndarray of shape (n,)
        Its start, rad, within its cycle.
    duration : ndarray of shape (n,)
        Its length, rad.
    periodic : bool
        Whether the motion repeats after its last phase: then it is defined at all times.
    """

    cycle: NDArray[np.int64]
    tau: FloatArray
    duration: FloatArray
    periodic: bool

    @property
    def begins(self) -> FloatArray:
        """Start of each phase, rad."""
        return np.asarray(self.cycle * TURN + self.tau, dtype=np.float64)

    @property
    def start(self) -> float:
        """Begin of the motion, rad."""
        return float(self.begins[0])

    @property
    def end(self) -> float:
        """End of the motion (or of its first period), rad."""
        return float(self.begins[-1] + self.duration[-1])

    def spans(self, held: NDArray[np.bool_]) -> FloatArray:
        """Return begin and end, rad, shape (m, 2), of the times in which phases hold; those in a row are one."""
        fresh = held & ~np.concatenate(([False], held[:-1]))
        last = held & ~np.concatenate((held[1:], [False]))
        return np.column_stack((self.begins[fresh], (self.begins + self.duration)[last]))

    def place(
        self, tau: ArrayLike, cycle: ArrayLike | None
    ) -> tuple[tuple[int, ...], FloatArray, NDArray[np.intp], FloatArray]:
        """Return the shape of times; flat: phase of the drive, number of the phase, and time since that began.

        Parameters
        ----------
        tau, cycle : array_like
            Times, rad, counted from the starts of cycles, if these are given.

        Raises
        ------
        SimulationError
            If a time lies outside a motion that does not repeat.
        """
        times = np.asarray(tau, dtype=np.float64)
        turns = np.zeros_like(times) if cycle is None else np.asarray(cycle, dtype=np.float64)
        if times.shape != turns.shape:
            times, turns = np.broadcast_arrays(times, turns)
        local, turns = self._fold(times.ravel(), turns.ravel())
        first = self.cycle[0]
        begins = (self.cycle - first) * TURN + self.tau
        index = np.maximum(np.searchsorted(begins, turns * TURN + local, side="right") - 1, 0)
        within = local - self.tau[index] + (turns + first - self.cycle[index]) * TURN
        return times.shape, local, index, np.maximum(within, 0.0)

    def _fold(self, tau: FloatArray, turns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return times as a phase of the drive in the motion's first cycle, and whole turns since; a period repeats."""
        low, first = float(self.tau[0]), int(self.cycle[0])
        high = float((self.cycle[-1] - first) * TURN + self.tau[-1] + self.duration[-1])
        turns = turns - (0.0 if self.periodic else float(first))
        whole = np.floor((tau - low) / TURN)
        local, turns = tau - whole * TURN, turns + whole
        if self.periodic:
            return local, np.mod(turns, max(1.0, float(round((high - low) / TURN))))
        total = turns * TURN + local
        slack = 1e-12 * (1.0 + abs(high) + np.abs(total))
        if not np.all((total >= low - slack) & (total <= high + slack)):
            begin, end = first * TURN + low, first * TURN + high
            earliest, latest = np.min(tau, initial=np.inf), np.max(tau, initial=-np.inf)
            raise SimulationError(
                f"trajectory: at(tau); expected times between {begin:.6g} and {end:.6g} rad; got times from "
                f"{earliest:.6g} to {latest:.6g}; do: ask within the motion, or simulate longer"
            )
        return local, turns


class Motion(ABC):
    """A motion of one problem, made of phases: evaluated anywhere between its start and its end, or ever if periodic.

    Parameters
    ----------
    problem : Problem
        What moves.
    timeline : Timeline
        When its phases are.
    """

    problem: Problem
    timeline: Timeline

    @property
    @abstractmethod
    def stops(self) -> FloatArray:
        """Begin and end of each stop, rad, shape (m, 2): times in which the contact does not slip."""

    @property
    @abstractmethod
    def turning_points(self) -> tuple[FloatArray, FloatArray]:
        """Times (rad) at which the mass turns relative to the wall, and the displacement x there."""

    @abstractmethod
    def force(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> FloatArray:
        """Return the force of the contact on the mass, against the motion, over k Y, at times tau."""

    @abstractmethod
    def _evaluate(self, index: NDArray[np.intp], within: FloatArray) -> FloatArray:
        """Return z, v and what else the motion has, a row each, at the given times within the given phases."""

    @property
    def kinks(self) -> FloatArray:
        """Times (rad) between which the motion is smooth."""
        return np.concatenate((self.stops.ravel(), self.turning_points[0]))

    @property
    def start(self) -> float:
        """Begin of the motion, rad."""
        return self.timeline.start

    @property
    def end(self) -> float:
        """End of the motion (or of its first period), rad."""
        return self.timeline.end

    def at(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> tuple[FloatArray, FloatArray]:
        """Return displacement x and velocity x' of the mass at any times, to rounding.

        Parameters
        ----------
        tau : array_like
            Times, rad; counted from the start of `cycle` if that is given.
        cycle : array_like of int, optional
            Cycle that each time is counted from; keeps the phase exact in late cycles.

        Returns
        -------
        x, v : ndarray of the shape of tau
            Displacement over Y (absolute, also with a moving wall), and its derivative with respect to tau.

        Raises
        ------
        SimulationError
            If a time lies outside the motion.

        Examples
        --------
        >>> from frictionlab.simulator import Problem, simulate
        >>> run = simulate(Problem(r=0.5, beta=0.4), cycles=2)
        >>> x, v = run.at([0.0, 1.0])
        >>> float(x[0]), float(v[0])
        (0.0, 0.0)
        """
        shape, local, index, within = self.timeline.place(tau, cycle)
        x, v = self._evaluate(index, within)[:, :2].T
        if self.problem.wall == "base":
            x, v = x + self.problem.base.at(local), v + self.problem.base.rate_at(local)
        return x.reshape(shape), v.reshape(shape)


def cycles_of(tau: FloatArray, duration: FloatArray) -> NDArray[np.int64]:
    """Return the cycle in which each phase begins, counted from the first: from starts within a cycle, and lengths.

    A phase ends where the next one begins, or whole turns later. A phase without length (two sliders that give way at
    once) begins no cycle, one that fills a cycle does.

    Examples
    --------
    >>> cycles_of(np.array([1.0, 2.0, 2.0, 0.0]), np.array([1.0, 4e-16, TURN - 2.0, TURN])).tolist()
    [0, 0, 0, 1]
    """
    turns = np.round((tau[:-1] + duration[:-1] - tau[1:]) / TURN).astype(np.int64)
    return np.concatenate((np.zeros(1, np.int64), np.cumsum(turns)))


def bisected(rate: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray) -> FloatArray:
    """Return where a rate changes its sign, once in each interval."""
    falls = rate(low) > 0.0
    for _ in range(BISECTIONS if len(low) else 0):
        middle = 0.5 * (low + high)
        same = (rate(middle) > 0.0) == falls
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return 0.5 * (low + high)


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
    cycles = round((motion.end - motion.start) / (TURN))
    area = float(f[1] * x_end[1] - f[0] * x_end[0]) - float(np.sum(weights * rate * x))  # of f dx, by parts
    frame = 2.0 * problem.frame_damping_ratio * problem.r * float(np.sum(weights * (v - rate) ** 2)) / cycles
    return Energies(area / cycles, taken - frame, frame)


def nodes_of(motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Gauss-Legendre nodes and weights from the motion's start to its end, in panels cut at its events."""
    problem = motion.problem
    longest = PANEL * min(problem.r, 1.0 / problem.base.harmonics)
    marks = np.unique(np.clip(np.concatenate((motion.kinks, (motion.start, motion.end))), motion.start, motion.end))
    cuts = [np.linspace(a, b, ceil((b - a) / longest) + 1)[:-1] for a, b in pairwise(marks)]
    edges = np.concatenate((*cuts, [motion.end]))
    half = 0.5 * np.diff(edges)
    times = (edges[:-1] + half)[:, None] + half[:, None] * NODES
    return times.ravel(), (half[:, None] * WEIGHTS).ravel()
