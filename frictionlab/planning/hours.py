"""Laboratory time of a set of tests: run in the order that saves changes, each weight put on once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.planning.candidates import Candidate
from frictionlab.scene import Scene

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.intp]


@dataclass(frozen=True)
class LaboratoryTime:
    """What tests cost, s: ``running`` (n,) each time; ``change_force``, ``change_drive`` once for each of their groups.

    ``force``, ``drive`` (n,): number of the group that shares a normal force, or that and the motion of the base.
    """

    running: FloatArray
    force: IntArray
    drive: IntArray
    change_force: float
    change_drive: float

    def more(self, order: Sequence[int]) -> FloatArray:
        """Time (n,) that each candidate would add to tests already chosen."""
        chosen = np.asarray(order, dtype=np.intp)
        new_force = ~np.isin(self.force, self.force[chosen])
        new_drive = ~np.isin(self.drive, self.drive[chosen])
        return np.asarray(self.running + self.change_force * new_force + self.change_drive * new_drive)

    def total(self, order: Sequence[int]) -> float:
        """Time of some tests together."""
        chosen = np.asarray(order, dtype=np.intp)
        changes = self.change_force * len(set(self.force[chosen])) + self.change_drive * len(set(self.drive[chosen]))
        return float(self.running[chosen].sum()) + changes


def laboratory_time(scene: Scene, tests: Sequence[Candidate]) -> LaboratoryTime:
    """Return what tests cost by ``[plan]``."""
    plan = scene.plan
    forces = {force: i for i, force in enumerate(dict.fromkeys(t.normal_force_n for t in tests))}
    drives = {drive: i for i, drive in enumerate(dict.fromkeys(_drive(t) for t in tests))}
    return LaboratoryTime(
        np.array([t.duration_s + plan.setup_s for t in tests]),
        np.array([forces[t.normal_force_n] for t in tests]),
        np.array([drives[_drive(t)] for t in tests]),
        plan.change_force_s,
        plan.change_drive_s,
    )


def _drive(test: Candidate) -> tuple[float, float, float]:
    return (test.normal_force_n, test.base_amplitude_m, test.frequency_ratio)
