"""A motion with an elastic contact as a list of phases: exact between its events, evaluated anywhere."""

from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.simulator.elastic import engine as engines
from frictionlab.simulator.elastic.layout import ELASTIC_PHASE
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.timeline import PhasedMotion, Timeline, cycles_of

__all__ = ["ElasticMotion", "from_phases"]

TURN = 2.0 * pi
GRID = 16
NEWTON_STEPS = 6
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ElasticMotion(PhasedMotion):
    """A motion of one problem, phase by phase: in each the same sliders slip; the mass moves one way, or none slips.

    Parameters
    ----------
    problem : Problem
        What moves.
    phases : ndarray of shape (n, 8)
        Of each phase: sliders that slip, start (rad, within its cycle), duration, z, v, a, stiffness of the oscillator,
        force of the sliders over k Y at its start.
    cycle : ndarray of shape (n,)
        Cycle in which the phase begins, counted from the start of the motion.
    periodic : bool
        Whether the motion repeats after its last phase: then it is defined at all times.
    """

    problem: Problem
    phases: Floats
    cycle: NDArray[np.int64]
    periodic: bool = False

    @property
    def slipping(self) -> Floats:
        """How many sliders slip in each phase."""
        return self.phases[:, 0]

    @property
    def timeline(self) -> Timeline:
        """When its phases are."""
        return Timeline(self.cycle, self.phases[:, 1], self.phases[:, 2], self.periodic)

    @property
    def stops(self) -> Floats:
        """Begin and end of each time in which no slider slips, rad, shape (m, 2); the mass may move in it."""
        return self.timeline.spans(self.slipping == 0.0)

    @property
    def turning_points(self) -> tuple[Floats, Floats]:
        """Times (rad) at which the mass is at rest relative to the wall, and the displacement x there.

        A held contact that rings turns within its phase: its turns are found on a grid of GRID points a ring.
        """
        times = np.sort(
            np.concatenate((self.timeline.begins[self.phases[:, 4] == 0.0], *map(self._turns_of, self._held)))
        )
        return times, self.at(times)[0]

    @property
    def _held(self) -> NDArray[np.intp]:
        return np.flatnonzero(self.slipping == 0.0)

    def _turns_of(self, phase: int) -> Floats:
        """Return the times within a phase at which the velocity changes sign: bracketed, then Newton."""
        span, stiffness = self.phases[phase, [2, 6]]
        count = int(GRID * span * np.sqrt(stiffness) / (TURN * self.problem.r)) + 3
        within = np.linspace(0.0, span, count)[(1 if self.phases[phase, 4] == 0.0 else 0) :]
        v = self._evaluate(np.full(len(within), phase), within)[:, 1]
        low = np.flatnonzero(v[:-1] * v[1:] < 0.0)
        first, last = within[low], within[low + 1]
        times = first + (last - first) * v[low] / (v[low] - v[low + 1])
        for _ in range(NEWTON_STEPS if len(times) else 0):
            times = np.clip(times - self._velocity_over_slope(phase, times), first, last)
        return np.asarray(self.timeline.begins[phase] + times, dtype=np.float64)

    def _velocity_over_slope(self, phase: int, within: Floats) -> Floats:
        """Return v / v' at times within a phase, the slope from the equation of motion."""
        problem = self.problem
        z, v, pull = self._evaluate(np.full(len(within), phase), within).T
        tau = (self.phases[phase, 1] + within)[:, None] * np.arange(1, len(problem.force[0]) + 1)
        push = np.cos(tau) @ np.array(problem.force[0]) + np.sin(tau) @ np.array(problem.force[1])
        thick = 2.0 * (problem.zeta + problem.frame_damping_ratio) * problem.r
        slope = (push - z - pull - thick * v) / problem.r**2
        return np.asarray(np.divide(v, slope, out=np.zeros_like(v), where=slope != 0.0), dtype=np.float64)

    def force(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> Floats:
        """Return the force n of the contact on the mass over k Y: its sliders and its dashpot; times as for `at`."""
        shape, _, index, within = self.timeline.place(tau, cycle)
        _, v, pull = self._evaluate(index, within).T
        return np.asarray(pull + 2.0 * self.problem.zeta * self.problem.r * v, dtype=np.float64).reshape(shape)

    def _evaluate(self, index: NDArray[np.intp], within: Floats) -> Floats:
        """Return z, v and the sliders' force at times within the phases of an index, a row each."""
        engine = engines.choose(0.05 * len(index))
        rig, _, force = engines.set_up(engine, self.problem)
        states = engine.zeros(3 * len(index))
        engine.kernel.evaluate_elastic(rig, force, engine.flat(self.phases[index]), engine.flat(within), states)
        return np.asarray(states, dtype=np.float64).reshape(-1, 3)


def from_phases(
    problem: Problem, record: Any, count: int, *, periodic: bool, mirror: bool, first: int = 0
) -> ElasticMotion:
    """Build a motion from the kernel's record; `mirror` appends the second, mirrored half of a period.

    `first` is the cycle in which the record begins.
    """
    rows = np.array(record[: ELASTIC_PHASE * count], dtype=np.float64).reshape(count, ELASTIC_PHASE)
    if mirror:
        flip, later = np.array([1.0, 1, 1, -1, -1, -1, 1, -1, 1]), np.array([0.0, pi, 0, 0, 0, 0, 0, 0, 0])
        rows = np.vstack((rows, rows * flip + later))
    rows += 0.0
    cycle = first + cycles_of(rows[:, 1], rows[:, 2])
    for column in (rows, cycle):
        column.setflags(write=False)
    return ElasticMotion(problem, rows, cycle, periodic)
