"""A motion as the steps that made it: the polynomial of each step is the motion, evaluated anywhere."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import inf, pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.arrays import FloatArray
from frictionlab.simulator.motion import Motion, Nodes, Timeline, bisected
from frictionlab.simulator.numeric.radau import MATRIX, NODES, WEIGHTS, WIDTH, Oscillator, contacts
from frictionlab.simulator.problem import Base, Problem

STOP_SHARE = 1e-3  # of the drive's largest rate: slower slip is none, where the contact always creeps
DWELL = 10.0  # a stop lasts at least so many times as long as that speed, over the drive's rate: else it is a turn
TOUCH = 1e-13  # rad: a shorter stick of a rigid contact is a touch, not a stop


def stop_limits(problem: Problem, rate: float, own_time: float = 1.0) -> tuple[float, float, float]:
    """Slip speed below which a contact is at rest, the shortest stop, and the longest slip that is part of one (rad).

    Without inner states the mass truly rests. A contact that creeps is at rest where it slips slower than 1/1000 of the
    drive's largest rate, or than an elastic contact of the same stiffness would yield, ``1 / (1 + kappa)`` of it, if
    that is more. A turn passes that speed too; a stop lasts ten times as long, in the drive's own time. In a stop the
    mass rings on the contact's spring.
    """
    if problem.law.kind != "inner" or problem.beta == 0.0:
        return 0.5, TOUCH, 0.0
    kappa = problem.parameter("stiffness_ratio", inf)
    share = max(STOP_SHARE, 1.0 / (1.0 + kappa))
    return share * rate, DWELL * share * own_time, 2.0 * pi * problem.r / sqrt(1.0 + kappa)


def slow_times(times: FloatArray, slip: FloatArray, slow: float, gap: float) -> FloatArray:
    """Spans of time (m, 2) in which samples of slip are slow, ends by a straight line; made one across shorter gaps."""
    size = np.abs(slip)
    held = size < slow
    if not held.any():
        return np.zeros((0, 2))
    change = np.flatnonzero(held[1:] != held[:-1])
    at = times[change] + (slow - size[change]) / (size[change + 1] - size[change]) * (times[change + 1] - times[change])
    edges = np.concatenate((times[:1] if held[0] else [], at, times[-1:] if held[-1] else []))
    spans = edges.reshape(-1, 2)
    apart = spans[1:, 0] - spans[:-1, 1] >= gap
    begins, ends = np.concatenate(([True], apart)), np.concatenate((apart, [True]))
    return np.column_stack((spans[begins, 0], spans[ends, 1]))


def contact_along(law: Any, rig: Oscillator, side: FloatArray, values: FloatArray) -> FloatArray:
    """Force of the contact on the mass, and its slip (2, ...): of states (n, 4) or (n, 4, 8), a side each of n.

    At rest, side 0, neither is known from the state: both are 0 here.
    """
    states = np.ascontiguousarray(np.moveaxis(values, 1, -1)).reshape(-1, values.shape[1])
    found = np.zeros((2, len(states)))
    contacts(law, rig, np.repeat(side, len(states) // len(side)), states, found)
    return found.reshape(2, len(side), *values.shape[2:])


@dataclass(frozen=True)
class NumericMotion(Motion):
    """A motion of one problem, step by step.

    Parameters
    ----------
    problem : Problem
        What moves.
    timeline : Timeline
        When the steps are.
    side : ndarray of shape (n,)
        Sign of the phase that each step belongs to; 0: the mass rests.
    values : ndarray of shape (n, 4, 8)
        z, v and the inner states at the nodes of each step.
    rig : (callable, Oscillator)
        The law's formula, compiled, and the problem's numbers.
    """

    problem: Problem
    timeline: Timeline
    side: FloatArray
    values: FloatArray
    rig: tuple[Any, Oscillator]

    @cached_property
    def times(self) -> FloatArray:
        """Times of all nodes, rad, shape (n, 8)."""
        return np.asarray(self.timeline.begins[:, None] + self.timeline.duration[:, None] * NODES)

    @cached_property
    def slip(self) -> FloatArray:
        """Speed at which the contact slips, at all nodes (n, 8)."""
        return np.asarray(contact_along(*self.rig, self.side, self.values)[1])

    @property
    def nodes(self) -> Nodes:
        """Those of the steps, where the motion is known without interpolation."""
        tau, values, held = self.times[:, 1:], self.values[:, :, 1:], self.side[:, None] == 0.0
        force = np.where(held, self._pull(tau) - values[:, 0], contact_along(*self.rig, self.side, values)[0])
        weight = self.timeline.duration[:, None] * MATRIX[-1]
        moved = self._moved(tau)
        parts = (tau, weight, values[:, 0] + moved[0], values[:, 1] + moved[1], force)
        return Nodes(*(part.ravel() for part in parts))

    def _pull(self, tau: FloatArray) -> FloatArray:
        return np.asarray(Base(*self.problem.force).at(tau))

    def state(self, tau: ArrayLike) -> FloatArray:
        """Return z, v and the inner states (relative to the wall) at times tau, shape (..., 4)."""
        shape, _, index, within = self.timeline.place(tau, None)
        return self._evaluate(index, within).reshape(*shape, WIDTH)

    def force(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> FloatArray:
        """Return the force of the contact on the mass, against the motion, over k Y, at times tau."""
        shape, local, index, within = self.timeline.place(tau, cycle)
        states, sides = self._evaluate(index, within), self.side[index]
        force = contact_along(*self.rig, sides, states)[0]
        return np.where(sides == 0.0, self._pull(local) - states[:, 0], force).reshape(shape)

    @property
    def stops(self) -> FloatArray:
        """Begin and end of each stop, rad, shape (m, 2): as `stop_limits` says.

        A periodic motion's stop across its end is told once, its end beyond it.
        """
        pairs = enumerate(zip(*self.problem.force, strict=True), 1)
        slow, shortest, ringing = stop_limits(self.problem, sum(k * float(np.hypot(c, s)) for k, (c, s) in pairs))
        spans = slow_times(self.times.ravel(), self.slip.ravel(), slow, ringing)
        if self.timeline.periodic and len(spans) > 1 and spans[0, 0] == self.start and spans[-1, 1] >= self.end - 1e-12:
            spans[-1, 1] = spans[0, 1] + self.end - self.start
            spans = spans[1:]
        return spans[spans[:, 1] - spans[:, 0] > shortest]

    @property
    def range(self) -> tuple[float, float]:
        """Least and largest displacement x of the mass."""
        x, v = self.values[:, :2].swapaxes(0, 1) + self._moved(self.times)
        x = np.append(x, self.at(self._zeros(v, lambda tau: self.at(tau)[1]))[0])
        return float(x.min()), float(x.max())

    def _zeros(self, speeds: FloatArray, rate: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """Times within steps at which a rate, whose values at the nodes are given, changes its sign."""
        step, node = np.nonzero(speeds[:, :-1] * speeds[:, 1:] < 0.0)
        return bisected(rate, self.times[step, node], self.times[step, node + 1])

    def _evaluate(self, index: NDArray[np.intp], within: FloatArray) -> FloatArray:
        """The polynomials through the nodes' values (m, 4), at times within the steps of an index: barycentric."""
        theta = np.clip(within / self.timeline.duration[index], 0.0, 1.0)
        gap = theta[:, None] - NODES
        hit = gap == 0.0
        share = WEIGHTS / np.where(hit, 1.0, gap)
        share = np.where(hit.any(axis=1)[:, None], hit * 1.0, share)
        return np.asarray(np.einsum("mi,mki->mk", share, self.values[index]) / share.sum(axis=1)[:, None])
