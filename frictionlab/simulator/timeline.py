"""When the phases of a motion are: the one thing that all motions made of phases tell alike."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.errors import SimulationError
from frictionlab.simulator.problem import Problem

__all__ = ["PhasedMotion", "Timeline", "absolute", "cycles_of"]

TURN = 2.0 * np.pi
Floats = NDArray[np.float64]


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
    tau: Floats
    duration: Floats
    periodic: bool

    @property
    def begins(self) -> Floats:
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

    def spans(self, held: NDArray[np.bool_]) -> Floats:
        """Return begin and end, rad, shape (m, 2), of the times in which phases hold; those in a row are one."""
        fresh = held & ~np.concatenate(([False], held[:-1]))
        last = held & ~np.concatenate((held[1:], [False]))
        return np.column_stack((self.begins[fresh], (self.begins + self.duration)[last]))

    def place(
        self, tau: ArrayLike, cycle: ArrayLike | None
    ) -> tuple[tuple[int, ...], Floats, NDArray[np.intp], Floats]:
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

    def _fold(self, tau: Floats, turns: Floats) -> tuple[Floats, Floats]:
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


class PhasedMotion(ABC):
    """What every motion made of phases offers: its times, and its displacement and velocity at any of them."""

    problem: Problem

    @property
    @abstractmethod
    def timeline(self) -> Timeline:
        """When its phases are."""

    @abstractmethod
    def _evaluate(self, index: NDArray[np.intp], within: Floats) -> Floats:
        """Return z, v and what else the motion has, a row each, at the given times within the given phases."""

    @property
    def start(self) -> float:
        """Begin of the motion, rad."""
        return self.timeline.start

    @property
    def end(self) -> float:
        """End of the motion (or of its first period), rad."""
        return self.timeline.end

    def at(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> tuple[Floats, Floats]:
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
        z, v = self._evaluate(index, within)[:, :2].T
        x, v = absolute(self.problem, local, z, v)
        return x.reshape(shape), v.reshape(shape)


def cycles_of(tau: Floats, duration: Floats) -> NDArray[np.int64]:
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


def absolute(problem: Problem, tau: Floats, z: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Return displacement and velocity of the mass at phases of the drive, from those relative to the wall."""
    if problem.wall == "base":
        return z + problem.base.at(tau), v + problem.base.rate_at(tau)
    return z, v
