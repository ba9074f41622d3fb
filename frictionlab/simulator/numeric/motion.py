"""A motion as the steps that made it: the polynomial of each step is the motion, evaluated anywhere."""

from dataclasses import dataclass, replace
from math import pi, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.errors import SimulationError
from frictionlab.simulator.numeric import layout, machine, tableau
from frictionlab.simulator.problem import Base, Problem
from frictionlab.simulator.timeline import absolute

__all__ = ["STOP_SHARE", "NumericMotion", "ringing", "stop_speed"]

TURN = 2.0 * pi
STOP_SHARE = 1e-3  # of the drive's largest rate: slower slip is none, where the contact always creeps
DWELL = 10.0  # a stop lasts at least so many times as long as that speed, over the drive's rate: else it is a turn
Floats = NDArray[np.float64]


def stop_speed(problem: Problem) -> tuple[float, float]:
    """Slip speed below which a contact that creeps is at rest, and the shortest stop, rad.

    The speed is 1/1000 of the drive's largest rate, or what an elastic contact of the same stiffness would yield,
    ``1 / (1 + kappa)`` of it, if that is more. A turn passes that speed too; a stop lasts ten times as long.
    """
    share = max(STOP_SHARE, 1.0 / (1.0 + problem.parameter("stiffness_ratio", np.inf)))
    pairs = zip(*problem.force, strict=True)
    rate = sum(k * float(np.hypot(c, s)) for k, (c, s) in enumerate(pairs, 1))
    return share * rate, DWELL * share


def ringing(problem: Problem) -> float:
    """Period (rad) in which the mass rings on the contact's spring: slip that lasts no longer is part of a stop."""
    return TURN * problem.r / sqrt(1.0 + problem.parameter("stiffness_ratio"))


@dataclass(frozen=True)
class NumericMotion:
    """A motion of one problem, step by step.

    Parameters
    ----------
    problem : Problem
        What moves.
    begin, length : ndarray of shape (n,)
        Start and length of each step, rad.
    side : ndarray of shape (n,)
        Sign of the phase the step belongs to; 0: the mass rests.
    values : ndarray of shape (n, 8, 4)
        z, v and the inner states at the nodes of each step.
    slip : ndarray of shape (n, 8)
        Speed at which the contact slips there.
    periodic : bool
        Whether the motion repeats after its end: then it is defined at all times.
    """

    problem: Problem
    begin: Floats
    length: Floats
    side: Floats
    values: Floats
    slip: Floats
    periodic: bool = False

    @property
    def start(self) -> float:
        """Begin of the motion, rad."""
        return float(self.begin[0])

    @property
    def end(self) -> float:
        """End of the motion (or of its first period), rad."""
        return float(self.begin[-1] + self.length[-1])

    def later(self, shift: float) -> "NumericMotion":
        """The same motion, its time counted on by a shift of whole cycles, rad."""
        return replace(self, begin=self.begin + shift)

    @property
    def times(self) -> Floats:
        """Times of all nodes, rad, shape (n, 8)."""
        times: Floats = self.begin[:, None] + self.length[:, None] * np.array(tableau.NODES)
        return times

    def state(self, tau: ArrayLike) -> Floats:
        """Return z, v and the inner states (relative to the wall) at times tau, shape (..., 4)."""
        times = np.asarray(tau, dtype=np.float64)
        index, theta = self._place(times.ravel())
        states: Floats = _interpolate(self.values[index], theta).reshape(*times.shape, layout.WIDTH)
        return states

    def at(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> tuple[Floats, Floats]:
        """Return displacement x and velocity x' of the mass at any times.

        Parameters
        ----------
        tau : array_like
            Times, rad; counted from the start of `cycle` if that is given.
        cycle : array_like of int, optional

        Returns
        -------
        x, v : ndarray of the shape of tau
            Displacement over Y (absolute, also with a moving wall), and its derivative with respect to tau.

        Raises
        ------
        SimulationError
            If a time lies outside the motion.
        """
        times = _counted(tau, cycle)
        both = self.state(times)
        return absolute(self.problem, times, both[..., 0], both[..., 1])

    def force(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> Floats:
        """Return the force of the contact on the mass, against the motion, over k Y, at times tau."""
        times = _counted(tau, cycle)
        flat = times.ravel()
        index, theta = self._place(flat)
        states = np.ascontiguousarray(_interpolate(self.values[index], theta))
        held = self.side[index] == 0.0
        pull = Base(*self.problem.force).at(flat) - states[:, 0]
        sliding = machine.forces_of(self.problem, self.side[index], states)
        return np.where(held, pull, sliding).reshape(times.shape)

    @property
    def stops(self) -> Floats:
        """Begin and end of each stop, rad, shape (m, 2).

        Without inner states the mass truly rests; a contact with inner states creeps, and a stop is a time in which it
        slips slower than `stop_speed` tells, `ringing` included. A periodic motion's stop across its end is told once,
        its end beyond it.
        """
        slow, shortest = (0.0, 0.0) if self._is_smooth else stop_speed(self.problem)
        spans = _below(self.times.ravel(), np.repeat(self.side == 0.0, layout.NODES) * 1.0, 0.5, above=True)
        if not self._is_smooth:
            spans = _joined(_below(self.times.ravel(), self.slip.ravel(), slow), ringing(self.problem))
        if self.periodic and len(spans) > 1 and spans[0, 0] == self.start and spans[-1, 1] >= self.end - 1e-12:
            spans[-1, 1] = spans[0, 1] + self.end - self.start
            spans = spans[1:]
        return spans[spans[:, 1] - spans[:, 0] > max(shortest, 1e-13)]

    @property
    def turning_points(self) -> tuple[Floats, Floats]:
        """Times (rad) at which the mass turns relative to the wall, or starts or ends a stop, and x there."""
        v, times = self.values[:, :, 1].ravel(), self.times.ravel()
        at_rest = times[v == 0.0]
        over = np.flatnonzero(v[:-1] * v[1:] < 0.0)
        low, high, falling = times[over], times[over + 1], v[over] > 0.0
        for _ in range(50 if len(over) else 0):
            middle = 0.5 * (low + high)
            same = (self.state(middle)[:, 1] > 0.0) == falling
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        found = np.unique(np.concatenate((at_rest, 0.5 * (low + high))))
        z = self.state(found)[:, 0]
        fresh = np.concatenate(([True], np.diff(found) > 1e-12)) if len(found) else np.zeros(0, dtype=bool)
        rests = np.concatenate(([False], np.diff(z) == 0.0, [False])) if len(found) else np.zeros(1, dtype=bool)
        kept = found[fresh & ~(rests[:-1] & rests[1:])]
        return kept, self.at(kept)[0]

    @property
    def _is_smooth(self) -> bool:
        return self.problem.law.kind != "inner" or self.problem.beta == 0.0

    def _place(self, times: Floats) -> tuple[NDArray[np.intp], Floats]:
        """Step of each time, and the share of it that has passed."""
        start, end = self.start, self.end
        if self.periodic:
            times = start + np.mod(times - start, end - start)
        slack = 1e-12 * (1.0 + abs(end))
        if not np.all((times >= start - slack) & (times <= end + slack)):
            raise SimulationError(
                f"motion: at(tau); expected times between {start:.6g} and {end:.6g} rad; got times from "
                f"{np.min(times):.6g} to {np.max(times):.6g}; do: ask within the motion, or simulate longer"
            )
        index = np.clip(np.searchsorted(self.begin, times, side="right") - 1, 0, len(self.begin) - 1)
        return index, np.clip((times - self.begin[index]) / self.length[index], 0.0, 1.0)


def _joined(spans: Floats, gap: float) -> Floats:
    """Spans with those between which less than a gap lies made one."""
    if len(spans) < 2:
        return spans
    apart = spans[1:, 0] - spans[:-1, 1] >= gap
    begins, ends = np.concatenate(([True], apart)), np.concatenate((apart, [True]))
    return np.column_stack((spans[begins, 0], spans[ends, 1]))


def _counted(tau: ArrayLike, cycle: ArrayLike | None) -> Floats:
    """Times, rad, from the start of the motion's count of cycles."""
    times = np.asarray(tau, dtype=np.float64)
    return times if cycle is None else times + TURN * np.asarray(cycle, dtype=np.float64)


def _interpolate(values: Floats, theta: Floats) -> Floats:
    """The polynomials through the nodes' values, shape (m, 8, 4), at shares theta (m,) of their steps: barycentric."""
    gap = theta[:, None] - np.array(tableau.NODES)
    hit = gap == 0.0
    share = np.array(tableau.WEIGHTS) / np.where(hit, 1.0, gap)
    share = np.where(hit.any(axis=1)[:, None], hit * 1.0, share)
    return np.asarray(np.einsum("mi,mik->mk", share, values) / share.sum(axis=1)[:, None])


def _below(times: Floats, values: Floats, limit: float, *, above: bool = False) -> Floats:
    """Spans of time in which samples lie below a limit (or above), its crossings by a straight line, shape (m, 2)."""
    held = (values > limit) if above else (values < limit)
    if not held.any():
        return np.zeros((0, 2))
    change = np.flatnonzero(held[1:] != held[:-1])
    step = values[change + 1] - values[change]
    share = np.where(step == 0.0, 0.5, (limit - values[change]) / np.where(step == 0.0, 1.0, step))
    at = times[change] + share * (times[change + 1] - times[change])
    edges = np.concatenate((times[:1] if held[0] else [], at, times[-1:] if held[-1] else []))
    return edges.reshape(-1, 2)
