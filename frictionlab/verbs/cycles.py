"""The tests of a campaign -> the cycle of each, from its own recording, ready to be fitted together."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from frictionlab.analysis.measure import measure
from frictionlab.campaign import Cycle, Trial, cycle_of, recording_path
from frictionlab.hdf5 import read_recording
from frictionlab.identification import AUTO, predict
from frictionlab.scene import Scene
from frictionlab.tables import Row
from frictionlab.verbs.rows import rows_of

FEW = 3  # tests of a material up to which each is also fitted for itself, as a single comparison does


@dataclass(frozen=True)
class Recorded:
    """What the recordings of a campaign give: cycles and paths by source, rows of single comparisons and failures."""

    cycles: Mapping[str, Cycle]
    comparisons: tuple[Row, ...]
    paths: Mapping[str, Path]


def cycles_of(
    trials: Sequence[Trial], scene: Scene, *, folders: Sequence[Path], law: str | None, workers: int | None = 1
) -> Recorded:
    """Return the cycle of each short test whose recording is at hand.

    A mass that stands still tells no law, and a long test drifts: both are passed over. With law "auto" the ladder of a
    material's only test is climbed by itself, for there are no others to be left out.
    """
    wanted = [t for t in trials if not t.failed and not t.is_long and t.regime != "stuck" and t.material]
    paths = {path: trial for trial in wanted if (path := recording_path(trial, folders)) is not None}
    tests = Counter(trial.material for trial in paths.values())
    few = frozenset(path for path, trial in paths.items() if tests[trial.material] <= FEW)
    single = frozenset(path for path, trial in paths.items() if law == AUTO and tests[trial.material] == 1)
    rows = list(
        rows_of(
            list(paths),
            _Reading(scene, {path: (t.source, t.group) for path, t in paths.items()}, few, single),
            workers=workers,
        )
    )
    cycles = {cycle.source: cycle for row in rows if isinstance(cycle := row.get("cycle"), Cycle)}
    told = tuple({k: v for k, v in row.items() if k != "cycle"} for row in rows if len(row) > 1)
    return Recorded(cycles, told, {trial.source: path for path, trial in paths.items()})


@dataclass(frozen=True)
class Probes:
    """Gives single comparisons of tests, by their sources; where their recordings are is known."""

    scene: Scene
    paths: Mapping[str, Path]
    workers: int | None

    def __call__(self, sources: Sequence[str], law: str) -> list[Row]:
        """Return the rows of these tests under a law, or with a ladder of laws; a failed one has its reason."""
        rows = rows_of([self.paths[s] for s in sources], _Comparing(self.scene, law), workers=self.workers)
        return [{**row, "source": source} for source, row in zip(sources, rows, strict=True)]


@dataclass(frozen=True)
class _Comparing:
    """What is done to a recording that is probed, here or where a worker is."""

    scene: Scene
    law: str

    def __call__(self, path: Path) -> Row:
        return predict(measure(read_recording(path), self.scene), self.scene, law=self.law).row()


@dataclass(frozen=True)
class _Reading:
    """What is done to each recording, here or where a worker is."""

    scene: Scene
    tests: Mapping[Path, tuple[str, tuple[str, float]]]
    few: frozenset[Path]
    single: frozenset[Path]

    def __call__(self, path: Path) -> Row:
        (source, group), recording = self.tests[path], read_recording(path)
        measurement = measure(recording, self.scene)
        if path not in self.single:
            return {"cycle": cycle_of(source, group, measurement, self.scene, alone=path in self.few)}
        compared = predict(measurement, self.scene, law=AUTO)
        cycle = cycle_of(source, group, measurement, self.scene, alone=True, law=compared.law)
        return {**compared.row(), "source": source, "cycle": cycle}
