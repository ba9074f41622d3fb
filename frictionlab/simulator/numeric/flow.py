"""The integrated flow of a problem or a structure: it carries a state and its slopes, and records the motion."""

import functools
from dataclasses import dataclass
from functools import cached_property
from math import inf, pi, sqrt
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.compiled import callback, numba, record_of
from frictionlab.simulator.exact.motion import WORK
from frictionlab.simulator.exact.phase import CONTACTS, DONE, MISSING, PULLS, SLIDERS, STEEP, TIRED, make_phase
from frictionlab.simulator.exact.solve import feel_acceleration, system_of
from frictionlab.simulator.laws import TERMS, Friction, Term, formula_of
from frictionlab.simulator.laws.law import ContactForce
from frictionlab.simulator.meter import Meter
from frictionlab.simulator.motion import Motion, Nodes, Timeline
from frictionlab.simulator.numeric import radau
from frictionlab.simulator.numeric.radau import COUNT, MATRIX, NODES, WEIGHTS, Stepper
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.structure import Structure

TURN = 2.0 * pi
FIRST = 0.3  # rad of the faster of drive's harmonics and free vibration: first step tried
CAP = 3_000_000  # steps before a run is given up
STEPS = 256  # of a cycle that are recorded at first
STOP_SHARE = 1e-3  # of the drive's largest rate: slower slip is none, where the contact always creeps
DWELL = 10.0  # a stop lasts at least so many times as long as that speed, over the drive's rate: else it is a turn
TOUCH = 1e-13  # rad: a shorter stick of a rigid contact is a touch, not a stop


def stop_limits(contact: Friction, r: float, rate: float, own_time: float = 1.0) -> tuple[float, float, float]:
    """Slip speed below which a contact is at rest, the shortest stop, and the longest slip that is part of one (rad).

    A contact that creeps is at rest where it slips slower than 1/1000 of the drive's largest rate, or than an elastic
    contact of the same stiffness would yield. A turn passes that speed too; a stop lasts ten times as long.
    """
    if contact.law.kind != "inner" or contact.beta == 0.0:
        return 0.5, TOUCH, 0.0
    kappa = contact.parameter("stiffness_ratio", inf)
    share = max(STOP_SHARE, 1.0 / (1.0 + kappa))
    return share * rate, DWELL * share * own_time, TURN * r / sqrt(1.0 + kappa)


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


@dataclass(frozen=True)
class NumericMotion(Motion):
    """A motion as steps: displacements, velocities and inner states (m, size, 8) at the nodes of each.

    `rows` (m, 3 c): of each contact side (0: it holds), stiffness and constant force of its springs. `flow`: what
    moves, with its laws' formulas. Displacements are relative to the base where contacts follow it.
    """

    problem: Problem
    timeline: Timeline
    rows: FloatArray
    values: FloatArray
    flow: "Flow"
    solver: ClassVar[str] = "numeric"

    @cached_property
    def times(self) -> FloatArray:
        """Times of all nodes, rad, shape (m, 8)."""
        return np.asarray(self.timeline.begins[:, None] + self.timeline.duration[:, None] * NODES)

    @cached_property
    def _seen(self) -> FloatArray:
        """Force and slip of each contact at all nodes (2, m, c, 8)."""
        return self.flow.observe(self.flow.drive_at(self.times), self.rows, self.values)

    @property
    def nodes(self) -> Nodes:
        """Those of the steps, where the motion is known without interpolation."""
        n, tau, weight = self.flow.masses, self.times[:, 1:].ravel(), self.timeline.duration[:, None] * MATRIX[-1]
        parts = (self.values[:, :n], self.values[:, n : 2 * n], self._seen[0])
        q, v, force = (part[..., 1:].swapaxes(1, 2).reshape(len(tau), part.shape[1]) for part in parts)
        return Nodes(tau, weight.ravel(), *self.flow.from_wall(tau, q, v), force)

    def state(self, tau: ArrayLike) -> FloatArray:
        """Return displacements, velocities and inner states, as the flow has them, at times tau, shape (..., size)."""
        shape, _, index, within = self.timeline.place(tau, None)
        return self._states(index, within).reshape(*shape, self.values.shape[1])

    def evaluate(self, tau: FloatArray, index: NDArray[np.intp], within: FloatArray) -> tuple[FloatArray, ...]:
        """Return x, v of the first mass and the force of the first contact (k,) at times within steps of an index."""
        q, v, force = self._all(tau, index, within)
        return q[:, 0], v[:, 0], force[:, 0]

    def all_at(self, tau: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return displacements, velocities (k, n) and forces (k, c) of all masses and contacts: see `Motion.all_at`."""
        _, local, index, within = self.timeline.place(np.atleast_1d(tau), None)
        return self._all(local, index, within)

    def stops_of(self, contact: int) -> FloatArray:
        """Begin and end of each stop (m, 2), rad, of a contact (from 0): as `stop_limits` says.

        A periodic motion's stop across its end is listed once, its end beyond it.
        """
        law = self.flow.structure.contacts[contact]
        slow, shortest, ringing = stop_limits(law, self.problem.r, self.flow.drive_rate)
        spans = slow_times(self.times.ravel(), self._seen[1][:, contact].ravel(), slow, ringing)
        if self.timeline.periodic and len(spans) > 1 and spans[0, 0] == self.start and spans[-1, 1] >= self.end - 1e-12:
            spans[-1, 1] = spans[0, 1] + self.end - self.start
            spans = spans[1:]
        return spans[spans[:, 1] - spans[:, 0] > shortest]

    def _all(
        self, tau: FloatArray, index: NDArray[np.intp], within: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        states, n = self._states(index, within), self.flow.masses
        force = self.flow.observe(self.flow.drive_at(tau[:, None]), self.rows[index], states[:, :, None])[0, ..., 0]
        q, v = self.flow.from_wall(tau, states[:, :n], states[:, n : 2 * n])
        return q, v, force

    def _states(self, index: NDArray[np.intp], within: FloatArray) -> FloatArray:
        """The polynomials through the nodes' values (k, size), at times within the steps of an index: barycentric."""
        theta = np.clip(within / self.timeline.duration[index], 0.0, 1.0)
        gap = theta[:, None] - NODES
        hit = gap == 0.0
        share = WEIGHTS / np.where(hit, 1.0, gap)
        share = np.where(hit.any(axis=1)[:, None], hit * 1.0, share)
        return np.asarray(np.einsum("mi,mki->mk", share, self.values[index]) / share.sum(axis=1)[:, None])


class LostError(SimulationError):
    """From this state the motion cannot be carried on: friction turns negative, or steps become too short."""


class Flow:
    """The integrated flow of a problem or structure, to a tolerance of each step; steps tried are booked on a meter.

    Its state: displacements and velocities (n,) of the masses, anchors of elastic sliders (s,), inner states of laws.
    """

    def __init__(self, what: Problem | Structure, rtol: float, *, steps: int = CAP, meter: Meter | None = None) -> None:
        self.structure = what if isinstance(what, Structure) else Structure.of(what)
        self.what, self.rtol, self.meter = what, rtol, meter
        self.problem = what if isinstance(what, Problem) else what.first_contact
        self.systems, self.works, contacts = system_of(self.structure), record_of(WORK), self.structure.contacts
        system, n = self.systems[0], self.structure.masses
        self.masses, self.sliders, h = n, int(system["sliders"]), int(system["harmonics"])
        self.follows = self.structure.follows_base
        if self.follows:
            feel_acceleration(self.systems)
            system["lines"][:h] *= -(np.arange(1.0, h + 1.0) ** 2)
        waves = 1j * np.arange(1, h + 1) * system["push"][:n, 1:] + system["push"][:n, :1]
        self._sizes = np.abs(waves * system["lines"][:h])  # (n, h): of the forces on the masses
        terms = [formula_of(contact) for contact in contacts]
        self.rubbing = self._rubbing(terms, rtol)
        padded = [(term or TERMS["coulomb"]).contact for term in terms] + [TERMS["coulomb"].contact] * CONTACTS
        self.formulas = tuple(map(_compiled, padded[:CONTACTS]))
        self.steps, size = record_of(radau.STEPS), int(system["sliders"]) - self.sliders + 2 * n
        self.clock = self.steps.view(np.recarray)[0]
        self.clock.components, self.clock.most = size, steps
        self.scale = np.insert(
            self.rubbing[0]["scale"][:size], 2 * n, np.full(self.sliders, self.rubbing[0]["scale"][0])
        )
        self.log = np.zeros((0, 2 + 3 * len(contacts) + COUNT * size))

    def _rubbing(self, terms: list[Term | None], rtol: float) -> Any:
        """The laws' numbers; what count as states of their own goes behind the sliders of elastic contacts."""
        system, n, r, rubbing = self.systems[0], self.masses, self.structure.r, record_of(radau.RUBBING)
        law, reach = rubbing[0], float(self._sizes.sum(axis=1).max(initial=0.0)) * min(1.0, 1.0 / r**2)
        scale = [reach] * n + [reach / min(1.0, r)] * n
        for c, (term, contact) in enumerate(zip(terms, self.structure.contacts, strict=True)):
            law["at"][c], law["states"][c] = len(scale), -1 if term is None else term.states
            law["beta"][c] = contact.beta
            if term is None or term.contact is None:
                continue
            own = law["own"][c]
            own[: len(term.parameters)] = [contact.parameter(p.name) for p in term.parameters]
            law["gradient"][c], law["narrow"][c] = contact.parameter("gradient"), term.narrow(contact.parameters)
            system["gradient"][c] = 0.0  # the formula is given it
            if term.states:
                bend = term.contact(own, 1.0, contact.beta, 0.0, 0.0, 0.0, 1.0)[4]
                scale += [contact.beta / bend or 1.0, 1.0][: term.states]
        system["sliders"] = self.sliders + len(scale) - 2 * n
        if system["sliders"] > SLIDERS:
            raise SimulationError(f"structure: sliders and states of laws; expected at most {SLIDERS}; got more")
        law["scale"][: len(scale)], law["force"], law["tolerance"] = scale, reach, rtol
        return rubbing

    @property
    def _ages(self) -> NDArray[np.int64]:
        """Where ages stand in a state."""
        law = self.rubbing[0]
        return np.asarray(self.sliders + law["at"][law["states"] == 2] + 1)

    @property
    def carrier(self) -> Stepper:
        """What is carried, as the compiled flow takes it."""
        return Stepper(self.formulas, self.systems, self.works, self.rubbing, self.steps, self.log)

    @property
    def drive_rate(self) -> float:
        """Largest rate of the forces that drive the masses, by the sum of their harmonics."""
        return float((self._sizes @ np.arange(1.0, self._sizes.shape[1] + 1.0)).max())

    @property
    def signs(self) -> FloatArray:
        """What the mirror image of a state is multiplied by, component by component: an age by 1, all others by -1."""
        signs = np.full(len(self.scale), -1.0)
        signs[self._ages] = 1.0
        return signs

    def rest_state(self, tau: float = 0.0) -> FloatArray:
        """Masses at rest with relaxed springs, contacts unloaded; one that has an age has its steady one."""
        f, rate = float(self.structure.base.at(tau)), float(self.structure.base.rate_at(tau))
        q, v = (-np.full(self.masses, x) if self.follows else np.zeros(self.masses) for x in (f, rate))
        return self.rest_at(q, v, f)

    def rest_at(self, q: FloatArray, v: FloatArray, f: float) -> FloatArray:
        """The same at displacements and velocities (n,), what drives being f."""
        system, state = self.systems[0], np.concatenate((q, v, np.zeros(len(self.scale) - 2 * self.masses)))
        first = 2 * self.masses + system["first"]
        for c in range(int(system["contacts"])):
            state[first[c] : first[c + 1]] = system["row"][c, : self.masses] @ q - system["follow"][c] * f
        state[self._ages] = 1.0
        return state

    def from_wall(self, tau: FloatArray, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacements and velocities (k, n) as they are seen from the wall, at times tau."""
        if not self.follows:
            return q, v
        base = self.structure.base
        return q + base.at(tau)[:, None], v + base.rate_at(tau)[:, None]

    def drive_at(self, tau: FloatArray) -> FloatArray:
        """Return what drives, and its first two derivatives (3, ...), at times."""
        turns = 1j * np.arange(1, int(self.systems[0]["harmonics"]) + 1)
        waves = self.systems[0]["lines"][: len(turns)] * np.exp(tau[..., None] * turns)
        return np.stack([(waves * turns**order).sum(axis=-1).real for order in range(3)])

    def observe(self, drive: FloatArray, rows: FloatArray, values: FloatArray) -> FloatArray:
        """Return force and slip of the contacts (2, m, c, k) in states (m, size, k) within steps.

        `drive` (3, m, k): what drives then, and its first two derivatives.
        """
        found = np.zeros((2, len(rows), len(self.structure.contacts), values.shape[2]))
        given, contacts, states = (np.ascontiguousarray(part) for part in (drive.swapaxes(0, 1), rows, values))
        while radau.observe(self.carrier, given, contacts, states, found) < len(rows):
            make_phase(self.systems, self.works)
        return found

    def carry(self, state: FloatArray, span: float, *, tau0: float = 0.0) -> FloatArray:
        """Return the state that another one becomes over a span of time from tau0 on.

        Raises LostError where the motion cannot be carried on, SimulationError where the steps allowed are used up.
        """
        self.set_state(state)
        for begun in np.arange(0.0, span - 1e-9, TURN):
            self._advance(tau0, float(min(TURN, span - begun)), tangent=False)
        return self.state()

    def carry_with_tangent(self, state: FloatArray, span: float) -> tuple[FloatArray, FloatArray]:
        """Return the state that another one becomes from tau = 0 on, and the slopes (n, n) of it over that one.

        Slopes of anchors that have not slipped are 0: they stay wherever they are.
        """
        size, n, slopes = len(self.scale), self.masses, np.eye(len(self.scale))
        slipped = np.ones(size, np.bool_)
        slipped[2 * n : 2 * n + self.sliders] = False
        self.set_state(state)
        for begun in np.arange(0.0, span - 1e-9, TURN):
            self._advance(0.0, float(min(TURN, span - begun)), tangent=True)
            slopes = self.works[0]["jacobian"][:size, :size] @ slopes
            slipped[2 * n : 2 * n + self.sliders] |= self.works[0]["slipped"][: self.sliders] != 0
        return self.state(), np.asarray(slopes * slipped * slipped[:, None])

    def record(self, state: FloatArray, tau0: float, cycles: int, *, periodic: bool, first: int = 0) -> NumericMotion:
        """Return the motion over some cycles from a state; `first` is the count of cycles that it begins with."""
        rows, size = STEPS * cycles, self.log.shape[1]
        while True:
            self.log = np.empty((rows, size))
            self.clock.rows, cuts = 0, [0]
            self.set_state(state)
            for _ in range(cycles):
                self._advance(tau0, TURN, tangent=False)
                cuts.append(int(self.clock.rows))
            if cuts[-1] <= rows:
                break
            rows = cuts[-1]
        begin, length, contacts, values = self.recorded()
        self.log = np.empty((0, size))
        cycle = first + np.repeat(np.arange(cycles), np.diff(cuts))
        cycle.setflags(write=False)
        return NumericMotion(self.problem, Timeline(cycle, begin, length, periodic), contacts, values, self)

    def recorded(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return start (m,), length (m,), rows (m, 3 c) and values (m, size, 8) of the steps recorded last."""
        log, cut = self.log[: self.clock.rows].copy(), 2 + 3 * len(self.structure.contacts)
        log.setflags(write=False)
        return log[:, 0], log[:, 1], log[:, 2:cut], log[:, cut:].reshape(len(log), -1, COUNT)

    def failure(self, code: int, what: str, most: str) -> SimulationError:
        """Return the error of a run of what was simulated that ended so; `most`: the steps that it might take."""
        contacts = self.structure.contacts
        said = {
            PULLS: "friction turns negative within the motion; expected at least 0; do: a smaller gradient or"
            " rate_strength",
            STEEP: "friction changes along the path faster than the spring's force; do: a smaller gradient",
            TIRED: f"expected fewer than {most}; got more: the contact rings, hardly anything damps it, or"
            " the law is too stiff; do: take the law that this one tends to (a rigid contact for a stiffness without"
            " end), or loosen rtol",
        }
        stalled = (
            "steps became too short; expected a law that can be integrated; got one too stiff; do: report these"
            " numbers, or take a law that holds where this one nearly does"
        )
        all_breaks = (term.breaks(contact.parameters) for contact in contacts for term in contact.law.terms)
        breaks = next(filter(None, all_breaks), "")
        why = breaks if breaks and code != PULLS else said.get(code, stalled)
        kind = SimulationError if code == TIRED else LostError
        laws = ", ".join(f"law {contact.law.name}, parameters {contact.parameters}" for contact in contacts)
        return kind(f"simulation of {what}: {laws}: {why}")

    def state(self) -> FloatArray:
        """Return the state at hand."""
        work, n = self.works[0], self.masses
        return np.concatenate((work["q"][:n], work["v"][:n], work["anchor"][: len(self.scale) - 2 * n]))

    def set_state(self, state: FloatArray) -> None:
        """Set the state; steps begin as if nothing had gone before."""
        work, n = self.works[0], self.masses
        fastest = 1.0 if n == 1 else float(self.structure.natural_frequencies[-1])
        self.clock.next = FIRST * min(self.structure.r / fastest, 1.0) / self.structure.base.harmonics
        work["q"][:n], work["v"][:n], work["anchor"][: len(state) - 2 * n] = np.split(state, (n, 2 * n))

    def _advance(self, tau: float, span: float, *, tangent: bool) -> None:
        """Carry the state, and its slopes, from a phase of the drive over at most a cycle."""
        before, rows, begin, code = self.clock.tried, self.clock.rows, self.state(), MISSING
        next_step = self.clock.next
        while code == MISSING:
            self.works[0]["tau"] = tau
            code, _, _ = radau.carry(self.carrier, np.array([tau, tau + span]), np.zeros((0, 4)), 0, 0, tangent)
            if code == MISSING:  # it has met a phase of several masses for the first time
                make_phase(self.systems, self.works)
                self.set_state(begin)
                self.clock.rows, self.clock.next = rows, next_step
        if self.meter is not None:
            self.meter.take(float(self.clock.tried - before))
        if code != DONE:
            raise self.failure(code, f"a motion at r = {self.structure.r!r}", f"{self.clock.most} steps")


@functools.cache
def _compiled(contact: ContactForce) -> Any:
    """A law's formula, compiled."""
    number = numba.float64
    return callback(contact, numba.types.UniTuple(number, 16)(number[::1], *(number,) * 6))


def warm_up() -> None:
    """Load the compiled flow, or compile it."""
    Flow(Problem(0.5, 0.4), 1e-6).carry(np.zeros(2), 0.1)
