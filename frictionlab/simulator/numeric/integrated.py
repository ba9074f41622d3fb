"""The integrated flow of a problem or a structure: it carries a state and its slopes, and records the motion."""

from dataclasses import replace
from math import inf, sqrt
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator import row as places
from frictionlab.simulator.compiled import address_of
from frictionlab.simulator.exact.flow import FORMULA
from frictionlab.simulator.exact.motion import COUNT
from frictionlab.simulator.exact.phase import CHATTER, DONE, PULLS, SIDE, SLIDERS, STEEP
from frictionlab.simulator.exact.solve import Flow, Search, workspace
from frictionlab.simulator.laws import TERMS, formula_of
from frictionlab.simulator.motion import Motion
from frictionlab.simulator.notes import Note
from frictionlab.simulator.numeric import radau
from frictionlab.simulator.numeric.radau import NODES
from frictionlab.simulator.problem import STATE, Meter, Problem
from frictionlab.simulator.state import SteadyState, from_numbers
from frictionlab.simulator.structure import Structure, frame_of

TURN = 2.0 * np.pi
FIRST = 0.3  # rad of the faster of drive's harmonics and free vibration: first step tried
MOST, LONGEST = 200_000, 3_000_000  # steps of a search for a steady state, some seconds; and of a run of many cycles
ALLOWED, LONGEST_FIRST = 20_000.0, 0.5  # steps that may be tried between two samples, or within so long (rad)
NEARBY = 2_000  # the same of one that begins at a neighbour's orbit, some thirty cycles: rest is as quick else
RTOL = 1e-8
FINEST, COARSEST = 1e-12, 1e-3
FOLLOWED, BESIDE = 2, 0.1  # cycles that rest is followed where friction weakens; how near an orbit must be then
TIGHTEN, TIGHTER = 0.03, 2  # where the two energies differ by more than the tolerance: how much finer, how many times
CLOSED, SMALLEST = 1e-9, 1e-15  # and what is always good enough, over the energy and over k Y^2
REFINING = 14  # periods' steps that an orbit by finer steps takes: it may cost half of what the search may
STEPS = 256  # of a cycle that are recorded at first
STOP_SHARE = 1e-3  # of the drive's largest rate: slower slip is none, where the contact always creeps
DWELL = 10.0  # a stop lasts at least so many times as long as that speed, over the drive's rate: else it is a turn


class Integrated(Flow):
    """The flow of a problem or structure by steps.

    `rtol`: tolerance of the polynomial of each step, over the size of each component; 1e-12 to 1e-3. Where the two
    energies of a steady state differ by more, steps are made finer, twice at most.
    """

    solver = "numeric"
    most, longest = MOST, LONGEST

    def __init__(self, what: Problem | Structure, rtol: float = RTOL) -> None:
        if not FINEST <= rtol <= COARSEST:
            raise UsageError(f"numeric solver: rtol; expected between 1e-12 and 1e-3; got {rtol!r}")
        super().__init__(what)
        self.frame, self.rtol = frame_of(what), rtol
        system, n, h = self.systems[0], self.masses, int(self.systems[0]["harmonics"])
        waves = 1j * np.arange(1, h + 1) * system["push"][:n, 1:] + system["push"][:n, :1]
        self._sizes = np.abs(waves * system["lines"][:h])  # (n, h): of the forces on the masses
        fastest = 1.0 if n == 1 else float(self.frame.natural_frequencies[-1])
        self.law = system["law"]
        self.law["first"] = FIRST * min(what.r / fastest, 1.0) / h
        self._set_laws()
        self.components = 2 * n + int(system["sliders"]) - self.sliders
        self.width, self.each = SIDE + self.contacts + COUNT * (self.components + 2 * self.contacts), STEPS
        self.drive_rate, self.drive_time = float((self._sizes @ np.arange(1.0, h + 1.0)).max()), 1.0

    def _set_laws(self) -> None:
        """Write the laws' numbers; what count as states of their own goes behind the sliders of elastic contacts."""
        system, n, r, law, contacts = self.systems[0], self.masses, self.frame.r, self.law, self.frame.contacts
        terms, reach = [formula_of(contact) for contact in contacts], self._sizes.sum(axis=1).max(initial=0.0)
        reach = float(reach) * min(1.0, 1.0 / r**2)
        scale = [reach] * n + [reach / min(1.0, r)] * n
        for c, (term, contact) in enumerate(zip(terms, contacts, strict=True)):
            law["at"][c], law["states"][c] = len(scale), -1 if term is None else term.states
            law["beta"][c] = contact.beta
            if term is None or term.contact is None:
                continue
            law["formula"][c] = address_of(term.contact, FORMULA)
            own = law["own"][c]
            own[: len(term.parameters)] = [contact.parameter(p.name) for p in term.parameters]
            law["gradient"][c], law["narrow"][c] = contact.parameter("gradient"), term.narrow(contact.parameters)
            system["gradient"][c] = 0.0  # the formula is given it
            if term.states:
                bend = term.contact(own, 1.0, contact.beta, 0.0, 0.0, 0.0, 1.0)[4]
                scale += [contact.beta / bend or 1.0, 1.0][: term.states]
        system["sliders"] = self.sliders + len(scale) - 2 * n
        self.ages = self.sliders - 2 * n + law["at"][law["states"] == 2] + 1  # behind displacements and velocities
        if system["sliders"] > SLIDERS:
            raise SimulationError(f"structure: sliders and states of laws; expected at most {SLIDERS}; got more")
        law["scale"][: len(scale)], law["force"], law["tolerance"] = scale, reach, self.rtol
        system["mirror"][self.ages] = 1
        system["advance"], system["look"] = radau.INTEGRATOR, radau.LOOKER
        self.formulas: list[Any] = [(term or TERMS["coulomb"]).contact for term in terms]
        for c, contact in enumerate(contacts):
            if law["states"][c] == 0:  # friction that grows with speed without end bounds every motion
                fast = self.formulas[c](tuple(law["own"][c].tolist()), 1.0, contact.beta, 0.0, 1e300, 0.0, 1.0)[0]
                system["brake"][c] = max(contact.beta, fast)

    def _slow_share(self, contact: int) -> float:
        """Return the share of the drive's largest rate below which the slip of a contact that creeps is none.

        It is 1/1000, or what an elastic contact of the same stiffness would yield at.
        """
        return max(STOP_SHARE, 1.0 / (1.0 + self.frame.contacts[contact].parameter("stiffness_ratio", inf)))

    def stop_limits(self, contact: int) -> tuple[float, float]:
        """As of the exact flow; a contact that creeps is at rest in a turn, too: a stop lasts ten times as long."""
        if self.law["states"][contact] <= 0:
            return super().stop_limits(contact)
        kappa = self.frame.contacts[contact].parameter("stiffness_ratio", inf)
        return TURN * self.what.r / sqrt(1.0 + kappa), DWELL * self._slow_share(contact) * self.drive_time

    def held_in(self, begins: FloatArray, pieces: FloatArray, contact: int) -> FloatArray:
        """As of the exact flow; of a contact that creeps the times in which it is slow, ends by a straight line."""
        if self.law["states"][contact] <= 0:
            return super().held_in(begins, pieces, contact)
        times = (begins[:, None] + pieces[:, 1:2] * NODES).ravel()
        first = self.width - COUNT * (self.contacts - contact)  # slip at the nodes stands last
        size = np.abs(pieces[:, first : first + COUNT].ravel())
        slow = self._slow_share(contact) * self.drive_rate
        held = size < slow
        change = np.flatnonzero(held[1:] != held[:-1])
        share = (slow - size[change]) / (size[change + 1] - size[change])
        at = times[change] + share * (times[change + 1] - times[change])
        edges = np.concatenate((times[:1][held[:1]], at, times[-1:][held[-1:]]))
        return edges.reshape(-1, 2)

    def stored(self, sample: FloatArray, f: float) -> FloatArray:
        """As of the exact flow; what is in the spring of a contact with a state of its own its force at rest says."""
        stored, first = super().stored(sample, f), self.sliders - 2 * self.masses
        for c, contact in enumerate(self.frame.contacts):
            if self.law["states"][c] > 0:
                own, w = tuple(self.law["own"][c].tolist()), workspace()[0]["anchor"][first + self.law["at"][c]]
                force = float(self.formulas[c](own, 1.0, contact.beta, 0.0, 0.0, float(w), 1.0)[0])
                stored[c] = 0.5 * force**2 / contact.parameter("stiffness_ratio")
        return stored

    def along(
        self, time: FloatArray, cubics: FloatArray, q: FloatArray, v: FloatArray, left: float = inf
    ) -> tuple[Motion, FloatArray]:
        """As of the exact flow; what counts as small is over what drives in the record."""
        n, law, steps = self.masses, self.law, np.diff(time)
        push = np.array([self.systems[0]["push"][:n] @ cubics[:, k : k + 2].T for k in (0, 1)])  # and its slope
        rms = [float(np.sqrt(2.0 * np.max(x**2 @ steps) / (time[-1] - time[0]))) for x in push]
        size, rate = float(np.abs(push[0]).max()), float(np.abs(cubics[:, 1]).max())
        law["scale"][:n], law["scale"][n : 2 * n] = min(size, 1.0), min(size, max(rate, 1e-3 * size))
        law["force"], law["first"], self.drive_rate, self.drive_time = size, LONGEST_FIRST, rms[1], rms[0] / rms[1]
        return super().along(time, cubics, q, v, min(left, ALLOWED * max(1.0, float(steps.max()) / LONGEST_FIRST)))

    def rest_at(self, q: FloatArray, v: FloatArray, f: float) -> FloatArray:
        """As of the exact flow; a contact that has an age has its steady one."""
        y = super().rest_at(q, v, f)
        y[2 * self.masses + self.ages] = 1.0
        return y

    def steady(
        self, _solver: str = "auto", *, meter: Meter | None = None, near: SteadyState | None = None
    ) -> SteadyState:
        """Return the steady state that rest settles on, or a neighbour's branch: see `steady_state`."""
        weakens, spent = self.what.weakens, STATE
        rest = self.carried(self.rest(), 0.0, TURN, FOLLOWED)[0] if weakens else self.rest()
        size, n, starts = self.law["scale"], 2 * self.masses, [(rest, False, inf), (rest, True, inf)]
        scale = np.concatenate((size[:n], np.full(self.sliders, size[0]), size[n : self.size - self.sliders]))
        if near is not None and near.orbit is not None and near.orbit.section is not None:
            starts.insert(0, (near.orbit.section, False, NEARBY))
        for start, waits, most in starts:
            left = min(most, inf if meter is None else meter.left - spent)
            found = self.solved(start, waits=waits, left=left)
            spent += found.spent
            outcome, away = found.rows[0, places.OUTCOME], np.abs(found.ys[0] - start) / (scale + np.abs(start))
            settles = not weakens or start is not rest or (away.max() < BESIDE and found.legs[0]["tau"] == 0.0)
            if outcome == places.UNBOUNDED or (outcome == places.PERIODIC and settles):
                break
        if meter is not None:
            meter.take(spent)
        return self.state_of(found)

    def state_of(self, found: Search) -> SteadyState:
        """Return what a search has found, by finer steps where its two energies differ by more than the tolerance."""
        code, what, flow = int(found.rows[0, places.OUTCOME]), self.what, self
        terms = ((term, contact.parameters) for contact in self.frame.contacts for term in contact.law.terms)
        passive = int(Note.NOT_PASSIVE) * any(term.gives(values | {"r": what.r}) for term, values in terms)
        self.refuse({places.CHATTERED: CHATTER, places.RUNAWAY: STEEP, places.PULLING: PULLS}.get(code, DONE))
        if code not in (places.PERIODIC, places.STUCK):
            structure = what if isinstance(what, Structure) else None
            state = from_numbers(self.problem, found.rows[0], solver="numeric", structure=structure)
            return replace(state, notes=state.notes | passive)
        for _ in range(TIGHTER + 1):
            tau = float(found.legs[0]["tau"])
            begun = flow.carried(found.ys[0], tau, TURN - tau)[0] if tau else found.ys[0]
            motion = replace(flow.recorded(found.ys[0], tau, found.cycles, periodic=True), section=begun)
            off, size = abs(float(motion.sums["gap"])), motion.taken
            closed = off <= max(flow.rtol, CLOSED) * size or off < SMALLEST
            dear = REFINING * len(motion.recorded) > MOST
            if closed or dear or flow.rtol * TIGHTEN < FINEST:
                break
            flow = Integrated(what, flow.rtol * TIGHTEN)
            better = flow.solved(begun, waits=found.cycles > 1)
            if (better.rows[0, places.OUTCOME], better.cycles) != (places.PERIODIC, found.cycles):
                break
            found = better
        return flow.described(found, motion, passive)
