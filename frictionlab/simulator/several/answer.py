"""The motion of a structure as its pieces, and the numbers of a steady state."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import ceil, inf, pi

import numpy as np
from numpy.typing import ArrayLike

from frictionlab.arrays import FloatArray
from frictionlab.simulator.motion import Timeline, bisected
from frictionlab.simulator.several.flow import Flow, Piece
from frictionlab.simulator.structure import Contact, Structure

TURN = 2.0 * pi
NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)
CREEP = 1e-10  # Y in a cycle: a contact that slips no further is at rest, at the edge of where it holds
PANEL = 1.0  # over the fastest rate of a phase: 16 nodes of it integrate to rounding


@dataclass(frozen=True)
class ContactNumbers:
    """What a contact does in a cycle: energy over k_1 Y^2, stops, share of the time without slip."""

    mass: int
    against: int | str
    law: str
    energy_per_cycle: float
    stops_per_cycle: float
    stuck_fraction: float


@dataclass(frozen=True)
class StructureMotion:
    """A motion of a structure, piece by piece: exact between its events, evaluated anywhere.

    Parameters
    ----------
    flow : Flow
    pieces : tuple of Piece
    timeline : Timeline
        When they are.
    """

    flow: Flow
    pieces: tuple[Piece, ...]
    timeline: Timeline

    @property
    def start(self) -> float:
        """Begin of the motion, rad."""
        return self.timeline.start

    @property
    def end(self) -> float:
        """End of the motion (or of its first period), rad."""
        return self.timeline.end

    def at(self, tau: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return displacements and velocities (k, n) of the masses at times tau (k,), over Y.

        Raises
        ------
        SimulationError
            A time lies outside the motion.

        Examples
        --------
        >>> from frictionlab.simulator.several import steady
        >>> state = steady(Structure.of_storeys(0.5, [1.0, 1.0], [1.0, 1.0], [0.02, 0.02]))
        >>> state.motion.at([0.0, 1.0])[0].shape
        (2, 2)
        """
        _, _, index, since = self.timeline.place(np.atleast_1d(tau), None)
        n = self.flow.structure.masses
        q, v = np.empty((len(index), n)), np.empty((len(index), n))
        for i in np.unique(index):
            here = index == i
            q[here], v[here] = self.pieces[i].motion.after(since[here])
        return q, v

    def force(self, tau: ArrayLike) -> FloatArray:
        """Return the forces (k, c) of the contacts on their masses, against the motion, over k_1 Y, at times (k,)."""
        _, _, index, since = self.timeline.place(np.atleast_1d(tau), None)
        force = np.empty((len(index), len(self.flow.structure.contacts)))
        for i in np.unique(index):
            force[index == i] = self.flow.contact_forces(self.pieces[i], since[index == i])
        return force

    def stops_of(self, contact: int) -> FloatArray:
        """Begin and end of each stop (m, 2), rad, of a contact (from 0); stops that go on across a cut are one."""
        return self.timeline.spans(np.array(list(self.flow.holds(self.pieces, contact))))


@dataclass(frozen=True)
class StructureState:
    """The steady state of a structure; numbers that do not exist are None.

    Parameters
    ----------
    structure : Structure
    outcome : {"periodic", "stuck", "unbounded", "not found"}
        "stuck": no contact ever slips.
    motion : StructureMotion or None
        Over one period.
    energy_per_cycle : float or None
        Area of the loop of base over the first mass's displacement (2.18), over k_1 Y^2.
    contact_energy_per_cycle, frame_energy_per_cycle : float or None
        What all contacts and all dashpots of the frame take.
    response_amplitudes : tuple of float
        (max - min) / 2 of each mass's displacement over Y.
    contacts : tuple of ContactNumbers
    period_cycles : int or None
    floquet_multiplier : float or None
        The largest, signed if real; its modulus if it is one of a complex pair.
    closure_error : float or None
        |energy put in by the base - energy taken| per cycle.
    residual : float or None
        By how much the state misses itself after one period.
    warnings : tuple of str
    """

    structure: Structure
    outcome: str
    motion: StructureMotion | None = None
    energy_per_cycle: float | None = None
    contact_energy_per_cycle: float | None = None
    frame_energy_per_cycle: float | None = None
    response_amplitudes: tuple[float, ...] = ()
    contacts: tuple[ContactNumbers, ...] = ()
    period_cycles: int | None = None
    floquet_multiplier: float | None = None
    closure_error: float | None = None
    residual: float | None = None
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<StructureState r = {self.structure.r:g}, {self.structure.masses} masses: {self.verdict}>"

    @property
    def regime(self) -> str | None:
        """What all contacts together do: "continuous", "stick-slip" or "stuck"."""
        if self.motion is None:
            return None
        if all(contact.stuck_fraction >= 1.0 for contact in self.contacts):
            return "stuck" if self.contacts else "continuous"
        return "stick-slip" if any(contact.stuck_fraction for contact in self.contacts) else "continuous"

    @property
    def verdict(self) -> str:
        """What was found, as a sentence."""
        if self.motion is None:
            said = {"unbounded": "There is no steady state: the motion grows at resonance, and friction is too weak."}
            return said.get(self.outcome, "No orbit is told: none was found from rest.")
        cycles = "cycle" if self.period_cycles == 1 else f"{self.period_cycles} cycles"
        return (
            f"The motion repeats every {cycles}: {self.regime}, {self.energy_per_cycle:.10g} k Y^2 per cycle (exact)."
        )

    def row(self) -> dict[str, object]:
        """Return the contract's keys of a steady state; what is of one contact is the first one's, or None."""
        first = self.contacts[0] if self.contacts else None
        rubs = self.structure.contacts[0] if first else None
        return {
            "r": self.structure.r,
            "beta": rubs.beta if rubs else 0.0,
            "mu": max(rubs.static_ratios) if rubs else 1.0,
            "zeta": rubs.parameter("contact_damping_ratio") if rubs else 0.0,
            "wall": "base" if rubs and rubs.against == "base" else "fixed",
            "solver": "exact",
            "outcome": self.outcome,
            "energy_per_cycle": self.energy_per_cycle,
            "response_amplitude": self.response_amplitudes[0] if self.response_amplitudes else None,
            "stops_per_cycle": first.stops_per_cycle if first else None,
            "stuck_fraction": first.stuck_fraction if first else None,
            "regime": self.regime,
            "symmetric": None,
            "period_cycles": self.period_cycles,
            "floquet_multiplier": self.floquet_multiplier,
            "closure_error": self.closure_error,
            "residual": self.residual,
            "growth_per_cycle": None,
            "contact_energy_per_cycle": self.contact_energy_per_cycle,
            "frame_energy_per_cycle": self.frame_energy_per_cycle,
            "warnings": list(self.warnings),
            "law": rubs.law.name if rubs else None,
            "parameters": dict(zip((p.name for p in rubs.law.parameters), rubs.numbers, strict=True)) if rubs else {},
            "response_amplitudes": list(self.response_amplitudes),
            "contacts": [dict(vars(contact)) for contact in self.contacts],
        }


def energies(flow: Flow, pieces: Sequence[Piece]) -> dict[str, float | FloatArray]:
    """Return ``input``, ``loop``, ``frame`` and ``contacts`` (c,): energies over k_1 Y^2 of a motion, in all.

    The base works against springs, dashpots and what rubs against it; the loop is the integral of f dx_1 (2.18).
    """
    structure, base = flow.structure, flow.structure.base
    rows = np.array([structure.row(contact) for contact in structure.contacts]).reshape(-1, structure.masses)
    follow = np.array([float(contact.against == "base") for contact in structure.contacts])
    put_in, loop, frame, contacts = 0.0, 0.0, 0.0, np.zeros(len(rows))
    damping = structure.r * structure.damping
    for piece in pieces:
        fastest = max(np.abs(piece.motion.phase.rates).max(initial=0.0), base.harmonics)
        edges = np.linspace(0.0, piece.length, ceil(piece.length * fastest / PANEL) + 1)
        half = 0.5 * np.diff(edges)
        times = ((edges[:-1] + half)[:, None] + half[:, None] * NODES).ravel()
        weights = (half[:, None] * WEIGHTS).ravel()
        tau = piece.motion.at.tau + times
        q, v = piece.motion.after(times)
        f, rate, forces = base.at(tau), base.rate_at(tau), flow.contact_forces(piece, times)
        slip = v - rate[:, None]
        on_base = (f[:, None] - q) @ structure.stiffness.sum(axis=0) - slip @ damping.sum(axis=0) - forces @ follow
        put_in += float(weights @ (on_base * rate))
        loop += float(weights @ (f * v[:, 0]))
        frame += float(weights @ np.einsum("ki,ij,kj->k", slip, damping, slip))
        contacts += weights @ (forces * (v @ rows.T - np.outer(rate, follow)))
    return {"input": put_in, "loop": loop, "frame": frame, "contacts": contacts}


def ranges(flow: Flow, pieces: Sequence[Piece]) -> FloatArray:
    """Return least and largest displacement (n, 2) of each mass over a motion."""
    n = flow.structure.masses
    found = np.column_stack((np.full(n, inf), np.full(n, -inf)))
    for piece in pieces:
        fastest = max(np.abs(piece.motion.phase.rates).max(initial=0.0), flow.structure.base.harmonics)
        times = np.linspace(0.0, piece.length, 9 + ceil(8.0 * piece.length * fastest))
        q, v = piece.motion.after(times)
        for mass in range(n):
            turns = np.flatnonzero(v[:-1, mass] * v[1:, mass] < 0.0)
            at = bisected(partial(_speed, piece, mass), times[turns], times[turns + 1])
            values = np.concatenate((q[[0, -1], mass], piece.motion.after(at)[0][:, mass]))
            found[mass] = min(found[mass, 0], values.min()), max(found[mass, 1], values.max())
    return found


def _speed(piece: Piece, mass: int, times: FloatArray) -> FloatArray:
    return piece.motion.after(times)[1][:, mass]


def contact_numbers(motion: StructureMotion, number: int, contact: Contact, energy: float) -> ContactNumbers:
    """Return what a contact does in a cycle of a periodic motion; a stop across the period's end is one."""
    cycles = (motion.end - motion.start) / TURN
    stops = motion.stops_of(number)
    stuck = float(np.sum(stops[:, 1] - stops[:, 0])) / (cycles * TURN)
    count = len(stops)
    if count > 1 and stops[0, 0] <= motion.start + 1e-12 and stops[-1, 1] >= motion.end - 1e-12:
        count -= 1
    whole = stuck >= 1.0 - 1e-12 or energy <= CREEP * contact.beta
    return ContactNumbers(
        *(contact.mass, contact.against, contact.law.name, energy),
        *(0.0 if whole else count / cycles, 1.0 if whole else stuck),
    )
