"""The tests of a campaign -> the mean cycle of each, from its own recording, ready to be fitted together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Traces
from frictionlab.campaign import Trial, recording_path
from frictionlab.hdf5 import read_recording
from frictionlab.inference.observations import CycleObservation, observe
from frictionlab.scene import Scene
from frictionlab.tables import Row
from frictionlab.verbs.rows import rows_of

NO_TRACES = Traces(*[np.zeros(0)] * 10)  # what figures show of a measurement; a campaign of hundreds holds none


def observations_of(
    trials: Sequence[Trial], scene: Scene, *, folders: Sequence[Path], workers: int | None = 1
) -> dict[str, CycleObservation]:
    """Return the mean cycle of each short test whose recording is at hand, by source.

    A mass that stands still says nothing of a law, and a long test drifts: both are passed over.
    """
    wanted = [t for t in trials if not t.failed and not t.is_long and t.regime != "stuck" and t.material]
    tests = {path: trial for trial in wanted if (path := recording_path(trial, folders)) is not None}
    rows = rows_of(list(tests), _Reading(scene, tests), workers=workers)
    found = [observation for row in rows if isinstance(observation := row.get("observation"), CycleObservation)]
    return {observation.measurement.source: observation for observation in found}


@dataclass(frozen=True)
class _Reading:
    """What is done to each recording, here or where a worker is."""

    scene: Scene
    tests: Mapping[Path, Trial]

    def __call__(self, path: Path) -> Row:
        trial = self.tests[path]
        measured = measure(read_recording(path), self.scene)
        named = replace(
            measured,
            source=trial.source,
            material=trial.material,
            normal_force_n=trial.normal_force_n,
            traces=NO_TRACES,
        )
        return {"observation": observe(named, self.scene)}
