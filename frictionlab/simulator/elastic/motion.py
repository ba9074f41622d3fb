"""A motion with an elastic contact as a list of phases: exact between its events, evaluated anywhere."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.simulator.elastic import engine as engines
from frictionlab.simulator.motion import Motion, Timeline, cycles_of
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.rigid import recorded

__all__ = ["ElasticMotion", "from_phases"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ElasticMotion(Motion):
    """A motion of one problem, phase by phase: in each the same sliders slip; the mass moves one way, or none slips.

    Parameters
    ----------
    problem : Problem
        What moves.
    phases : ndarray of shape (n, 8)
        Of each phase: sliders that slip, start (rad, within its cycle), duration, z, v, a, stiffness of the oscillator,
        force of the sliders over k Y at its start.
    timeline : Timeline
        When the phases are.
    """

    problem: Problem
    phases: Floats
    timeline: Timeline

    @property
    def slipping(self) -> Floats:
        """How many sliders slip in each phase."""
        return self.phases[:, 0]

    @property
    def stops(self) -> Floats:
        """Begin and end of each time in which no slider slips, rad, shape (m, 2); the mass may move in it."""
        return self.timeline.spans(self.slipping == 0.0)

    @property
    def turning_points(self) -> tuple[Floats, Floats]:
        """Times (rad) at which the mass is at rest relative to the wall, and the displacement x there."""
        times = self.timeline.begins[self.phases[:, 4] == 0.0]
        return times, self.at(times)[0]

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
        engine.kernel.evaluate(rig, force, engine.flat(self.phases[index]), engine.flat(within), states)
        return np.asarray(states, dtype=np.float64).reshape(-1, 3)


def from_phases(
    problem: Problem, record: Any, count: int, *, periodic: bool, mirror: bool, first: int = 0
) -> ElasticMotion:
    """Build a motion from the kernel's record; `mirror` appends the second, mirrored half of a period.

    `first` is the cycle in which the record begins.
    """
    rows = recorded(record, count, mirror=mirror, directed=False)
    cycle = first + cycles_of(rows[:, 1], rows[:, 2])
    for column in (rows, cycle):
        column.setflags(write=False)
    return ElasticMotion(problem, rows, Timeline(cycle, rows[:, 1], rows[:, 2], periodic))
