"""A motion with an elastic contact as a list of phases: exact between its events, evaluated anywhere."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from frictionlab.simulator.elastic import engine as engines
from frictionlab.simulator.rigid import Trajectory

__all__ = ["ElasticMotion"]

Floats = NDArray[np.float64]


class ElasticMotion(Trajectory):
    """A motion of one problem, phase by phase: in each the same sliders slip; the mass moves one way, or none slips.

    The first number of a phase is how many sliders slip, and a stop a time in which none does: the mass may move in it.
    """

    directed: ClassVar[bool] = False

    @property
    def slipping(self) -> Floats:
        """How many sliders slip in each phase."""
        return self.phases[:, 0]

    @property
    def turning_points(self) -> tuple[Floats, Floats]:
        """Times (rad) at which the mass is at rest relative to the wall, and the displacement x there."""
        times = self.timeline.begins[self.phases[:, 4] == 0.0]
        return times, self.at(times)[0]

    def _evaluate(self, index: NDArray[np.intp], within: Floats) -> Floats:
        """Return z, v and the sliders' force at times within the phases of an index, a row each."""
        engine = engines.choose(0.05 * len(index))
        rig, _, force = engines.set_up(engine, self.problem)
        return self._evaluated(engine, rig, force, index, within)
