"""A motion made of phases: when they are, its values at any time, stops, and sums."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.problem import Problem

TURN = 2.0 * np.pi


@dataclass(frozen=True)
class Motion:
    """A motion of one problem, made of phases: evaluated anywhere between its start and its end, or ever if periodic.

    The phase of the drive is kept apart from the count of cycles, so that the millionth cycle is as exact as the first.

    Parameters
    ----------
    problem : Problem
        What moves; of several masses, as the first contact has it.
    flow : frictionlab.simulator.exact.solve.Flow
        What carried it, and evaluates it.
    recorded : ndarray of shape (m, columns)
        Its phases, exact pieces or steps, as the flow recorded them: start (rad, within its cycle), length, and more.
    periodic : bool
        Whether it repeats after its last phase: then it is defined at all times.
    mirror : bool
        Whether the mirrored half of a cycle follows.
    first : int
        The cycle that it begins with.
    twin : bool
        Whether it is the mirror image, half a cycle later, of what is recorded; rows and sums are of that.
    section : ndarray of shape (size,), optional
        Of a steady motion that is integrated: its state at phase 0 of the drive, where a search close by begins.
    """

    problem: Problem
    flow: Any
    recorded: FloatArray
    periodic: bool
    mirror: bool = False
    first: int = 0
    twin: bool = False
    section: FloatArray | None = None

    @cached_property
    def rows(self) -> FloatArray:
        """All phases, as `recorded` has them."""
        rows: FloatArray = self.flow.mirrored(self.recorded) if self.mirror else self.recorded.view()
        rows.setflags(write=False)
        return rows

    @cached_property
    def cycle(self) -> NDArray[np.int64]:
        """Cycle in which each phase begins; one ends where the next begins, or whole turns later.

        A phase without length (two sliders that give way at once) begins no cycle, one that fills a cycle does.
        """
        turns = np.round((self.rows[:-1, :2].sum(axis=1) - self.rows[1:, 0]) / TURN).astype(np.int64)
        return self.first + np.concatenate((np.zeros(1, np.int64), np.cumsum(turns)))

    @property
    def begins(self) -> FloatArray:
        """Start of each phase, rad."""
        return np.asarray(self.cycle * TURN + self.rows[:, 0], dtype=np.float64)

    @property
    def start(self) -> float:
        """Begin of the motion, rad."""
        return float(self.begins[0])

    @property
    def end(self) -> float:
        """End of the motion (or of its first period), rad."""
        return float(self.begins[-1] + self.rows[-1, 1])

    @property
    def solver(self) -> str:
        """What carried it: "exact" or "numeric"."""
        return str(self.flow.solver)

    @cached_property
    def sums(self) -> Any:
        """What it does in all, energies, ways and ranges, by the names of `exact.account.NUMBERS`."""
        return self.flow.sums(self.rows if self.mirror else self.recorded)

    @property
    def taken(self) -> float:
        """What contacts and the frame's dashpots take in all, k Y^2."""
        return float(self.sums["contact"].sum() + self.sums["frame"])

    @property
    def stops(self) -> FloatArray:
        """Begin and end of each stop of the first contact, rad, shape (m, 2): times in which it does not slip."""
        return self.stops_of(0)

    def stops_of(self, contact: int) -> FloatArray:
        """Begin and end of each stop (m, 2), rad, of a contact (from 0); stops that go on across a cut are one."""
        period = (self.start, self.end) if self.periodic else None
        stops: FloatArray = self.flow.stops(self.flow.held_in(self.begins, self.rows, contact), contact, period)
        return stops - (np.pi if self.twin else 0.0)

    def place(
        self, tau: ArrayLike, cycle: ArrayLike | None = None
    ) -> tuple[tuple[int, ...], NDArray[np.intp], FloatArray]:
        """Return the shape of times (rad, from cycles if given); flat: number of the phase, time within.

        A time is a phase of the drive in the motion's first cycle, and whole turns since; a period repeats.

        Raises
        ------
        SimulationError
            A time lies outside a motion that does not repeat.
        """
        times = np.asarray(tau, dtype=np.float64)
        turns = np.zeros_like(times) if cycle is None else np.asarray(cycle, dtype=np.float64)
        if times.shape != turns.shape:
            times, turns = np.broadcast_arrays(times, turns)
        since, begins, shape = self.cycle - self.first, self.rows[:, 0], times.shape
        low, high = float(begins[0]), float(since[-1] * TURN + self.rows[-1, :2].sum())
        times, whole = times.ravel(), np.floor((times.ravel() - low) / TURN)
        local, turns = times - whole * TURN, turns.ravel() + whole
        if self.periodic:
            turns = np.mod(turns, max(1.0, float(round((high - low) / TURN))))
        else:
            turns = turns - float(self.first)
            total, slack = turns * TURN + local, 1e-12 * (1.0 + abs(high))
            if not np.all((total >= low - slack) & (total <= high + slack)):
                earliest, latest = np.min(times, initial=np.inf), np.max(times, initial=-np.inf)
                raise SimulationError(
                    f"trajectory: at(tau); expected times between {self.start:.6g} and {self.end:.6g} rad; got times"
                    f" from {earliest:.6g} to {latest:.6g}; do: ask within the motion, or simulate longer"
                )
        index = np.maximum(np.searchsorted(since * TURN + begins, turns * TURN + local, side="right") - 1, 0)
        within = local - begins[index] + (turns - since[index]) * TURN
        return shape, index, np.maximum(within, 0.0)

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
        shape, q, v, _ = self._evaluated(tau, cycle)
        return q[:, 0].reshape(shape), v[:, 0].reshape(shape)

    def _evaluated(self, tau: ArrayLike, cycle: ArrayLike | None = None) -> tuple[Any, ...]:
        """The shape of times; flat: displacements, velocities (k, n) of the masses, forces (k, c) of the contacts."""
        later, sign = (np.pi, -1.0) if self.twin else (0.0, 1.0)
        shape, index, within = self.place(np.asarray(tau, dtype=np.float64) + later, cycle)
        q, v, force = self.flow.evaluate(self.rows, index, within)
        return shape, sign * q, sign * v, sign * force

    def force(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> FloatArray:
        """Return the force of the contact on the mass, against the motion, over k Y, at any times: see `at`.

        Examples
        --------
        >>> from frictionlab.simulator import Problem, steady_state
        >>> steady_state(Problem(r=0.7, beta=0.5)).orbit.force([0.0, 3.0]).tolist()
        [0.5, -0.5]
        """
        shape, _, _, force = self._evaluated(tau, cycle)
        return force[:, 0].reshape(shape) if force.shape[1] else np.zeros(shape)

    def all_at(self, tau: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return displacements and velocities (k, n) of the masses, over Y, and forces (k, c) of the contacts on them.

        At times tau (k,): see `at`.

        Examples
        --------
        >>> from frictionlab.simulator import Structure, steady_state
        >>> state = steady_state(Structure.of_storeys(0.5, [1.0, 1.0], [1.0, 1.0], [0.02, 0.02]))
        >>> [part.shape for part in state.orbit.all_at([0.0, 1.0])]
        [(2, 2), (2, 2), (2, 0)]
        """
        return self._evaluated(np.atleast_1d(tau))[1:]
