"""The integrated flow of a problem: it carries a state and its slopes, and records the motion, step by step."""

import functools
from dataclasses import dataclass
from functools import cached_property
from math import hypot, inf, pi, sqrt
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.compiled import callback, numba
from frictionlab.simulator.laws import TERMS
from frictionlab.simulator.laws.law import ContactForce
from frictionlab.simulator.meter import Meter
from frictionlab.simulator.motion import Motion, Nodes, Timeline
from frictionlab.simulator.numeric import radau
from frictionlab.simulator.numeric.radau import (
    COUNT,
    MATRIX,
    NODES,
    STAGES,
    WEIGHTS,
    WIDTH,
    Forcing,
    Oscillator,
    Work,
    contacts,
)
from frictionlab.simulator.problem import Base, Problem

TURN = 2.0 * pi
FIRST = 0.3  # rad of the faster of drive's harmonics and free vibration: first step tried
CAP = 3_000_000  # steps before a run is given up
STEPS = 256  # of a cycle that are recorded at first
STOP_SHARE = 1e-3  # of the drive's largest rate: slower slip is none, where the contact always creeps
DWELL = 10.0  # a stop lasts at least so many times as long as that speed, over the drive's rate: else it is a turn
TOUCH = 1e-13  # rad: a shorter stick of a rigid contact is a touch, not a stop


def stop_limits(problem: Problem, rate: float, own_time: float = 1.0) -> tuple[float, float, float]:
    """Slip speed below which a contact is at rest, the shortest stop, and the longest slip that is part of one (rad).

    A contact that creeps is at rest where it slips slower than 1/1000 of the drive's largest rate, or than an elastic
    contact of the same stiffness would yield. A turn passes that speed too; a stop lasts ten times as long.
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
    contacts(law, rig, np.repeat(side, len(states) // max(1, len(side))), states, found)
    return found.reshape(2, len(side), *values.shape[2:])


@dataclass(frozen=True)
class NumericMotion(Motion):
    """A motion of one problem as steps: z, v and inner states (n, 4, 8) at the nodes of each, and its side; 0: at rest.

    `rig`: the law's formula, compiled, and the problem's numbers.
    """

    problem: Problem
    timeline: Timeline
    side: FloatArray
    values: FloatArray
    rig: tuple[Any, Oscillator]
    solver: ClassVar[str] = "numeric"

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
        tau, values = self.times[:, 1:], self.values[:, :, 1:]
        x, v, force = self._seen(tau, self.side, values)
        weight = self.timeline.duration[:, None] * MATRIX[-1]
        return Nodes(*(part.ravel() for part in (tau, weight, x, v, force)))

    def _seen(self, tau: FloatArray, side: FloatArray, values: FloatArray) -> tuple[FloatArray, ...]:
        """Displacement, velocity and the contact's force, of states (n, 4, ...) at times (n, ...), a side each of n."""
        z, v, problem = values[:, 0], values[:, 1], self.problem
        held = side.reshape(-1, *(1,) * (z.ndim - 1)) == 0.0
        force = np.where(held, Base(*problem.force).at(tau) - z, contact_along(*self.rig, side, values)[0])
        return (
            (z, v, force)
            if problem.wall == "fixed"
            else (z + problem.base.at(tau), v + problem.base.rate_at(tau), force)
        )

    def state(self, tau: ArrayLike) -> FloatArray:
        """Return z, v and the inner states (relative to the wall) at times tau, shape (..., 4)."""
        shape, _, index, within = self.timeline.place(tau, None)
        return self._states(index, within).reshape(*shape, WIDTH)

    def evaluate(self, tau: FloatArray, index: NDArray[np.intp], within: FloatArray) -> tuple[FloatArray, ...]:
        """Return x, v and the contact's force (k,) at times within the steps of an index."""
        return self._seen(tau, self.side[index], self._states(index, within))

    @property
    def stops(self) -> FloatArray:
        """Begin and end of each stop, rad, shape (m, 2): as `stop_limits` says.

        A periodic motion's stop across its end is listed once, its end beyond it.
        """
        pairs = enumerate(zip(*self.problem.force, strict=True), 1)
        slow, shortest, ringing = stop_limits(self.problem, sum(k * float(np.hypot(c, s)) for k, (c, s) in pairs))
        spans = slow_times(self.times.ravel(), self.slip.ravel(), slow, ringing)
        if self.timeline.periodic and len(spans) > 1 and spans[0, 0] == self.start and spans[-1, 1] >= self.end - 1e-12:
            spans[-1, 1] = spans[0, 1] + self.end - self.start
            spans = spans[1:]
        return spans[spans[:, 1] - spans[:, 0] > shortest]

    def _states(self, index: NDArray[np.intp], within: FloatArray) -> FloatArray:
        """The polynomials through the nodes' values (m, 4), at times within the steps of an index: barycentric."""
        theta = np.clip(within / self.timeline.duration[index], 0.0, 1.0)
        gap = theta[:, None] - NODES
        hit = gap == 0.0
        share = WEIGHTS / np.where(hit, 1.0, gap)
        share = np.where(hit.any(axis=1)[:, None], hit * 1.0, share)
        return np.asarray(np.einsum("mi,mki->mk", share, self.values[index]) / share.sum(axis=1)[:, None])


class LostError(SimulationError):
    """From this state the motion cannot be carried on: friction turns negative, or steps become too short."""


class Flow:
    """The integrated flow of a problem, to a tolerance of each step; the steps tried are booked on a meter."""

    def __init__(self, problem: Problem, rtol: float, *, steps: int = CAP, meter: Meter | None = None) -> None:
        self.problem, self.rtol, self.meter = problem, rtol, meter
        self.law, self.rig = rig_of(problem, rtol)
        sizes = [hypot(c, s) for c, s in zip(*problem.force, strict=True)]
        bounds = [sum(k**n * c for k, c in enumerate(sizes, 1)) for n in (1, 2)]
        self.drive = Forcing(*(np.array(column, dtype=float) for column in (*problem.force, bounds)))
        size, reduced = self.rig.size, STAGES * (self.rig.size - 1)
        self.scale = self.rig.scale[:size]  # what counts as small of each component: errors are relative to it
        shapes: tuple[tuple[int, ...], ...] = (
            *((WIDTH, COUNT), (WIDTH, COUNT), (STAGES,), (WIDTH, STAGES), (WIDTH - 1, WIDTH, STAGES)),
            *((reduced, reduced), (WIDTH, STAGES), (2, reduced), (2, COUNT), (0, 3 + WIDTH * COUNT)),
        )
        clock = np.zeros(1, radau.CLOCK).view(np.recarray)[0]
        clock.most = steps
        self.work = Work(np.zeros(WIDTH), np.eye(WIDTH), clock, *(np.zeros(shape) for shape in shapes))

    def rest_state(self, tau: float = 0.0) -> FloatArray:
        """The mass at rest with a relaxed spring, the contact unloaded; one that has an age has its steady one."""
        state = np.zeros(self.rig.size)
        if self.problem.wall == "base":
            state[:2] = -float(self.problem.base.at(tau)), -float(self.problem.base.rate_at(tau))
        state[3:] = 1.0
        return state

    def carry(self, state: FloatArray, span: float, *, tau0: float = 0.0) -> FloatArray:
        """Return the state that another one becomes over a span of time from tau0 on.

        Raises LostError where the motion cannot be carried on, SimulationError where the steps allowed are used up.
        """
        return self._carried(state, span, tau0, tangent=False)

    def carry_with_tangent(self, state: FloatArray, span: float) -> tuple[FloatArray, FloatArray]:
        """Return the state that another one becomes from tau = 0 on, and the slopes (n, n) of it over that one."""
        reached, size = self._carried(state, span, 0.0, tangent=True), self.rig.size
        return reached, self.work.tangent[:size, :size].copy()

    def record(self, state: FloatArray, tau0: float, cycles: int, *, periodic: bool, first: int = 0) -> NumericMotion:
        """Return the motion over some cycles from a state; `first` is the count of cycles that it begins with."""
        rows, size = STEPS * cycles, 3 + WIDTH * COUNT
        while True:
            self.work = self.work._replace(log=np.empty((rows, size)))
            self.work.clock.rows, cuts = 0, [0]
            self._begin(state)
            for _ in range(cycles):
                self._advance(tau0, TURN, tangent=False)
                cuts.append(int(self.work.clock.rows))
            if cuts[-1] <= rows:
                break
            rows = cuts[-1]
        begin, length, side, values = self.recorded()
        self.work = self.work._replace(log=np.empty((0, size)))
        cycle = first + np.repeat(np.arange(cycles), np.diff(cuts))
        cycle.setflags(write=False)
        return NumericMotion(self.problem, Timeline(cycle, begin, length, periodic), side, values, (self.law, self.rig))

    def recorded(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return start (n,), length (n,), side (n,) and values (n, 4, 8) of the steps recorded last."""
        log = self.work.log[: self.work.clock.rows].copy()
        log.setflags(write=False)
        return log[:, 0], log[:, 1], log[:, 2], log[:, 3:].reshape(-1, WIDTH, COUNT)

    def failure(self, code: int, what: str, most: str) -> SimulationError:
        """Return the error of a run of what was simulated that ended so; `most`: the steps that it might take."""
        problem = self.problem
        said = {
            radau.NEGATIVE: "friction turns negative within the motion; expected at least 0; do: a smaller gradient or"
            " rate_strength",
            radau.TOO_MANY: f"expected fewer than {most}; got more: the contact rings, hardly anything damps it, or"
            " the law is too stiff; do: take the law that this one tends to (a rigid contact for a stiffness without"
            " end), or loosen rtol",
            radau.STALLED: "steps became too short; expected a law that can be integrated; got one too stiff; do:"
            " report these numbers, or take a law that holds where this one nearly does",
        }
        breaks = next(filter(None, (term.breaks(problem.parameters) for term in problem.law.terms)), "")
        why = breaks if breaks and code != radau.NEGATIVE else said[code]
        kind = SimulationError if code == radau.TOO_MANY else LostError
        return kind(f"simulation of {what}: law {problem.law.name}, parameters {problem.parameters}: {why}")

    def _carried(self, state: FloatArray, span: float, tau0: float, *, tangent: bool) -> FloatArray:
        """Carry a state cycle by cycle."""
        self._begin(state)
        for begun in np.arange(0.0, span - 1e-9, TURN):
            self._advance(tau0, float(min(TURN, span - begun)), tangent=tangent)
        return self.work.state[: self.rig.size].copy()

    def _begin(self, state: FloatArray) -> None:
        """Set the state; its slopes over itself are then 1, and steps begin as if nothing had gone before."""
        self.work.clock.next = FIRST * min(self.problem.r, 1.0) / self.problem.base.harmonics
        self.work.state[:] = 0.0
        self.work.state[: self.rig.size] = state
        self.work.tangent[:] = np.eye(WIDTH)

    def _advance(self, tau: float, span: float, *, tangent: bool) -> None:
        """Carry the state, and its slopes, from a phase of the drive over at most a cycle."""
        before = self.work.clock.tried
        code = radau.carry(self.law, self.rig, self.drive, self.work, tau, span, int(tangent))
        if self.meter is not None:
            self.meter.take(float(self.work.clock.tried - before))
        if code != radau.FINE:
            raise self.failure(code, f"a motion at r = {self.problem.r!r}", f"{self.work.clock.most} steps")


@functools.cache
def _compiled(contact: ContactForce) -> Any:
    """A law's formula, compiled."""
    number = numba.float64
    return callback(contact, numba.types.UniTuple(number, 16)(number[::1], *(number,) * 6))


def rig_of(problem: Problem, rtol: float) -> tuple[Any, Oscillator]:
    """A law's formula, compiled, and the numbers of a problem; without friction every law is none."""
    r, p, terms = problem.r, problem.parameters, problem.law.terms
    term = next((term for term in terms if term.kind in ("smooth", "inner") and problem.beta > 0.0), TERMS["coulomb"])
    if problem.law.kind == "elastic" or term.contact is None:
        raise SimulationError(
            f"simulation: law {problem.law.name}: the integrated flow does not know it; do: leave the solver to choose"
        )
    own = np.array([p[parameter.name] for parameter in term.parameters])
    bend = term.contact(own, 1.0, problem.beta, 0.0, 0.0, 0.0, 1.0)[4] if term.states else 1.0
    reach = problem.force_size * min(1.0, 1.0 / r**2)
    scale = np.array([reach, reach / min(1.0, r), problem.beta / bend or 1.0, 1.0])
    dashpots = 2.0 * problem.zeta * r, 2.0 * problem.frame_damping_ratio * r
    numbers = (r, problem.beta, problem.parameter("gradient"), *dashpots, *problem.static_ratios, term.narrow(p))
    return _compiled(term.contact), Oscillator(own, *numbers, 2 + term.states, rtol, scale)


def warm_up() -> None:
    """Load the compiled flow, or compile it."""
    Flow(Problem(0.5, 0.4), 1e-6).carry(np.zeros(2), 0.1)
