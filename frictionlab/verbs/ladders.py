"""The tests of a campaign -> which law each requires, each from its own recording."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from frictionlab.campaign import Trial, recording_path
from frictionlab.scene import Scene
from frictionlab.tables import Row
from frictionlab.verbs.compare import compare
from frictionlab.verbs.each import rows_of

AUTO = "auto"


def ladders_of(trials: Sequence[Trial], scene: Scene, *, folders: Sequence[Path], workers: int | None = 1) -> list[Row]:
    """Return the ladder of laws of each short test whose recording is at hand; one that has none is a failed row.

    A mass that stands still tells no law, and a long test drifts: both are passed over.
    """
    paths = {
        path: trial.source
        for trial in trials
        if not trial.failed and not trial.is_long and trial.regime != "stuck" and trial.material
        if (path := recording_path(trial, folders)) is not None
    }
    return list(rows_of(list(paths), _Climbing(scene, paths), workers=workers))


@dataclass(frozen=True)
class _Climbing:
    """What is done to each recording, here or where a worker is: its row bears the source that the campaign knows."""

    scene: Scene
    sources: Mapping[Path, str]

    def __call__(self, path: Path) -> Row:
        return {**compare(path, self.scene, law=AUTO).row(), "source": self.sources[path]}
