"""One phase of a structure: which sliders hold, and the linear motion in between, in modal coordinates.

Every contact is one slider or several: a rigid contact is one whose spring is infinite. While a rigid slider holds, its
displacement is fixed and leaves the equations; an elastic one that holds adds its spring; one that slips adds a
constant force, and with a gradient a stiffness.
"""

from dataclasses import dataclass
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.elastic.sliders import sliders_of
from frictionlab.simulator.several.first_event import held_over, modes_over
from frictionlab.simulator.structure import Structure

Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class Slider:
    """A part of a contact: a spring (infinite: rigid) to an anchor that slips at a limit.

    Parameters
    ----------
    contact : int
        Number of its contact, from 0.
    row : ndarray of shape (n,)
        Its displacement is ``s = row q - follow f``.
    follow : float
        1 where it rubs against the base.
    spring, limit, gradient : float
        Over k_1, k_1 Y and 1 / Y: it slips with the force ``+- limit (1 + gradient s)``.
    up, down : float
        Static over kinetic friction force.
    """

    contact: int
    row: FloatArray
    follow: float
    spring: float
    limit: float
    gradient: float
    up: float
    down: float

    @property
    def is_rigid(self) -> bool:
        """Whether it does not yield before it slips."""
        return self.spring == inf

    def anchor(self, place: float, side: float) -> float:
        """Return where the anchor of an elastic slider is that slips at a displacement."""
        return place - side * self.limit / self.spring * (1.0 + self.gradient * place)


def sliders_in(structure: Structure) -> tuple[Slider, ...]:
    """Return the sliders of all contacts."""
    found = []
    for number, contact in enumerate(structure.contacts):
        springs: tuple[float, ...] = (inf,)
        limits: tuple[float, ...] = (contact.beta,)
        if contact.law.kind == "elastic":
            springs, limits = sliders_of(contact)
        for spring, limit in zip(springs, limits, strict=True):
            found.append(
                Slider(
                    *(number, structure.row(contact), float(contact.against == "base"), spring, limit),
                    *(contact.parameter("gradient"), *contact.static_ratios),
                )
            )
    return tuple(found)


class Station(NamedTuple):
    """A moment: phase of the drive (rad), displacements, velocities (n,) and anchors of the sliders (s,)."""

    tau: float
    q: FloatArray
    v: FloatArray
    anchors: FloatArray


def drive_of(structure: Structure, tau: float) -> FloatArray:
    """Return the base's displacement f and its first three derivatives (4,)."""
    k, lines = structure.harmonics
    return np.asarray((lines @ np.exp(k * tau)).real)


class Phase:
    """The linear equations while sliders keep their modes (0 holds, +-1 slips up or down).

    Parameters
    ----------
    structure : Structure
    sliders : tuple of Slider
    modes : tuple of int

    Raises
    ------
    SimulationError
        A direction has no stiffness left: friction falls along the path faster than springs pull.
    """

    def __init__(self, structure: Structure, sliders: tuple[Slider, ...], modes: tuple[int, ...]) -> None:
        self.structure, self.sliders, self.modes = structure, sliders, modes
        self.inertia = structure.r**2 * structure.mass
        self.held = [s for s, mode in zip(sliders, modes, strict=True) if mode == 0 and s.is_rigid]
        self._forces()
        self._constraints()
        self._modes()
        self.pushes = np.array([self._push(k + 1.0) for k in range(structure.base.harmonics)]).T

    def _forces(self) -> None:
        """Stiffness and damping of the phase; the force by f and f', by anchors, and alone; of contacts the same.

        A contact's force is ``forms @ (q, v, anchors, f, f', f'', 1)`` (c, 2 n + s + 4), but for held rigid ones.
        """
        structure, n, count = self.structure, self.structure.masses, len(self.sliders)
        stiffness, damping = structure.stiffness.copy(), structure.r * structure.damping
        by_drive = np.column_stack((structure.stiffness.sum(axis=1), structure.r * structure.damping.sum(axis=1)))
        forms = np.zeros((len(structure.contacts), 2 * n + count + 4))
        for number, contact in enumerate(structure.contacts):
            row, follow = structure.row(contact), float(contact.against == "base")
            dashpot = 2.0 * structure.r * contact.parameter("contact_damping_ratio")
            forms[number, n : 2 * n] += dashpot * row
            forms[number, 2 * n + count + 1] -= dashpot * follow
        for e, (slider, mode) in enumerate(zip(self.sliders, self.modes, strict=True)):
            if mode == 0 and slider.is_rigid:
                forms[slider.contact] = 0.0
                continue
            spring = slider.spring if mode == 0 else mode * slider.limit * slider.gradient
            forms[slider.contact, :n] += spring * slider.row
            forms[slider.contact, 2 * n + count] -= spring * slider.follow
            forms[slider.contact, 2 * n + e] -= spring if mode == 0 else 0.0
            forms[slider.contact, -1] += mode * slider.limit
        rows = np.array([structure.row(contact) for contact in structure.contacts]).reshape(-1, n)
        self.stiffness, self.damping = stiffness + rows.T @ forms[:, :n], damping + rows.T @ forms[:, n : 2 * n]
        self.by_anchor = -rows.T @ forms[:, 2 * n : 2 * n + count]
        self.by_drive = by_drive - rows.T @ forms[:, 2 * n + count : 2 * n + count + 2]
        self.alone = -rows.T @ forms[:, -1]
        self.forms = forms

    def _constraints(self) -> None:
        """Free directions (n, p), what carries held contacts along (n, h), and the forces that hold them."""
        n, count = self.structure.masses, len(self.sliders)
        rows = np.array([s.row for s in self.held]).reshape(-1, n)
        self.follow = np.array([s.follow for s in self.held])
        self.carried = np.linalg.pinv(rows) if len(rows) else np.zeros((n, 0))
        self.rows = rows
        self.free = np.linalg.svd(rows)[2][len(rows) :].T if len(rows) else np.eye(n)
        self.by_inertia = np.linalg.inv(self.inertia)
        accelerations = self.by_inertia @ np.column_stack(
            (-self.stiffness, -self.damping, self.by_anchor, self.by_drive, np.zeros(n), self.alone)
        )
        if len(rows):
            compliance = rows @ self.by_inertia @ rows.T
            asked = rows @ accelerations
            asked[:, 2 * n + count + 2] -= self.follow
            holding = np.linalg.solve(compliance, asked)
            accelerations = accelerations - self.by_inertia @ rows.T @ holding
            for slider, form in zip(self.held, holding, strict=True):
                self.forms[slider.contact] = form
        self.accelerations = accelerations

    def _modes(self) -> None:
        """Modes of the free directions: rates (d,), shapes (2 p, d), and what a force excites (d, n)."""
        free, p = self.free, self.free.shape[1]
        inertia = free.T @ self.inertia @ free
        stiffness = free.T @ self.stiffness @ free
        if p and np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))[0] <= 0.0:
            raise SimulationError(
                "structure: gradient; expected so small that every mass keeps a stiffness; got friction that changes"
                " along the path faster than the springs' force; do: take a smaller gradient"
            )
        matrix = np.zeros((2 * p, 2 * p))
        matrix[:p, p:] = np.eye(p)
        matrix[p:, :p] = -np.linalg.solve(inertia, stiffness)
        matrix[p:, p:] = -np.linalg.solve(inertia, free.T @ self.damping @ free)
        self.rates, self.shapes = np.linalg.eig(matrix.astype(np.complex128))
        self.inverse = np.linalg.inv(self.shapes)
        if p and np.linalg.cond(self.shapes) > 1e7:
            raise SimulationError(
                "structure: a mode is critically damped, and two of its rates are one; do: change a damping_ratio by"
                " one in a million"
            )
        self.excited = self.inverse[:, p:] @ np.linalg.solve(inertia, free.T)
        self.both = np.kron(np.eye(2), free)
        self.outward = self.both @ self.shapes

    def _push(self, k: float) -> Complexes:
        """The force (n,) of a harmonic e^(i k tau) of the base, what it carries along taken into account."""
        along = self.carried @ self.follow
        force = self.by_drive[:, 0] + 1j * k * self.by_drive[:, 1] + 0j
        force += (k * k * self.inertia - 1j * k * self.damping - self.stiffness) @ along
        return np.asarray(force)

    def motion_from(self, at: Station) -> "ModalMotion":
        """Return the motion from a moment on."""
        base = self.structure.base
        turns = np.arange(1, base.harmonics + 1)
        waves = base.lines * np.exp(1j * turns * at.tau)
        rest = self.carried @ (self.rows @ at.q - self.follow * float(waves.real.sum()))
        constant = np.asarray(
            self.excited @ (self.by_anchor @ at.anchors + self.alone - self.stiffness @ rest), np.complex128
        )
        start = np.asarray(self.inverse @ np.concatenate((self.free.T @ at.q, self.free.T @ at.v)))
        both = self.pushes * waves
        lines = 0.5 * self.excited @ np.hstack((both, both.conj()))
        return ModalMotion(self, at, start, constant, lines, np.concatenate((turns, -turns)).astype(np.float64), rest)

    def in_modes(self, forms: FloatArray) -> tuple[Complexes, Complexes, FloatArray]:
        """Return linear forms over (q, v, anchors, f, f', f'', 1) as rows over the modes, over harmonics, and the rest.

        The rest (e, n + s + 1) is over what is carried along at rest, the anchors, and alone.
        """
        n, count = self.structure.masses, len(self.sliders)
        rows = forms[:, : 2 * n] @ self.both @ self.shapes
        k = np.arange(1, self.structure.base.harmonics + 1)
        along = self.carried @ self.follow
        by_f = forms[:, 2 * n + count] + forms[:, :n] @ along
        by_rate = forms[:, 2 * n + count + 1] + forms[:, n : 2 * n] @ along
        waves = np.outer(by_f, k**0) + 1j * np.outer(by_rate, k) - np.outer(forms[:, 2 * n + count + 2], k * k)
        return rows, waves, np.column_stack((forms[:, :n], forms[:, 2 * n : 2 * n + count], forms[:, -1]))


class ModalMotion(NamedTuple):
    """The motion of a phase from a moment on: its modes' start, constant and harmonic excitation."""

    phase: Phase
    at: Station
    start: Complexes
    constant: Complexes
    lines: Complexes
    turns: FloatArray
    rest: FloatArray

    @property
    def drive(self) -> tuple[Complexes, Complexes, Complexes, FloatArray]:
        """The modes' start and excitation, as `first_event` takes them."""
        return self.start, self.constant, self.lines, self.turns

    def after(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacements and velocities (k, n) at times (k,) after the motion's begin."""
        phase, times = self.phase, np.ascontiguousarray(times, dtype=np.float64)
        w = modes_over(times, phase.rates, self.drive)
        both = (w @ phase.outward.T).real
        n, base = phase.structure.masses, phase.structure.base
        along, tau = phase.carried @ phase.follow, self.at.tau + times
        q, v = both[:, :n] + self.rest, both[:, n:]
        if along.any():
            q, v = q + np.outer(base.at(tau), along), v + np.outer(base.rate_at(tau), along)
        return q, v

    def tangent(self, span: float) -> FloatArray:
        """Return the derivative of (q, v, anchors) after a span by those at the begin."""
        phase, n, count = self.phase, self.phase.structure.masses, len(self.phase.sliders)
        grown, held = np.exp(phase.rates * span), held_over(span, phase.rates)
        carried = phase.carried @ phase.rows
        start = phase.inverse @ phase.both.T
        constant = phase.excited @ np.hstack((-phase.stiffness @ carried, phase.by_anchor))
        ways = np.zeros((len(phase.rates), 2 * n + count), np.complex128)
        ways[:, : 2 * n] = grown[:, None] * start
        ways[:, :n] += held[:, None] * constant[:, :n]
        ways[:, 2 * n :] += held[:, None] * constant[:, n:]
        whole = np.zeros((2 * n + count, 2 * n + count))
        whole[: 2 * n] = (phase.outward @ ways).real
        whole[:n, :n] += carried
        whole[2 * n :, 2 * n :] = np.eye(count)
        return whole
