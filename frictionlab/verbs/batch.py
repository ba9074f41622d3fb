"""Logs -> recordings, measurements, comparisons and figures in one folder; only what changed is made again."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path

from frictionlab.chain.names import logs_of, names_of
from frictionlab.chain.steps import COMPARE, MEASURE, Chain
from frictionlab.scene import Scene
from frictionlab.tables import Row
from frictionlab.verbs.each import rows_of
from frictionlab.verbs.failures import FAILED
from frictionlab.verbs.given import AnyScene, FilePath, scene_given


@dataclass(frozen=True)
class Batch:
    """A plan of what is to be done: all logs, and those of them whose results are not up to date.

    Attributes
    ----------
    logs : tuple of Path
        All logs, in order.
    due : tuple of Path
        Those that are new, have changed, or lack a result.
    chain : Chain
        What is done to each.
    """

    logs: tuple[Path, ...]
    due: tuple[Path, ...]
    chain: Chain = field(repr=False)

    def run(self, *, workers: int | None = None, scheduler: str | None = None) -> Iterator[Row]:
        """Do what is due and yield the row of each such log, in order; one that fails has its reason in its row."""
        made = rows_of(self.due, self.chain, workers=workers, scheduler=scheduler)
        for log, row in zip(self.due, made, strict=True):
            self.chain.keep_failure(log, row)
            yield row

    def rows(self) -> list[Row]:
        """The rows of all logs that have one, in order."""
        return [row for log in self.logs if (row := self.chain.row(log)) is not None]

    def missing(self) -> list[Path]:
        """The files of rows that are not there because their logs failed."""
        return [self.chain.row_file(log) for log in self.logs if (self.chain.row(log) or FAILURE)["status"] == FAILED]


FAILURE: Row = {"status": FAILED}


def batch(
    logs: FilePath | Iterable[FilePath],
    scene: AnyScene = None,
    *,
    output: FilePath = "build",
    compare: bool = True,
    again: bool = False,
) -> Batch:
    """Plan what a folder of logs needs: what is new or has changed, log by log; ``run`` does it.

    Parameters
    ----------
    logs : str, Path or iterable of them
        Logs, or folders of them.
    scene : Scene, str, Path or None
        A change of it makes all results again, a change of a test's facts those of that test.
    output : str or Path
        Folder of the results: ``recordings``, ``measurements``, ``comparisons`` and ``figures``.
    compare : bool
        Whether each measurement is compared with its prediction; a campaign compares them all together instead.
    again : bool
        Make everything again.

    Raises
    ------
    UsageError
        There are no logs.
    SceneError
        The scene is refused.
    """
    known = scene_given(scene)
    places = [logs] if isinstance(logs, (str, PathLike)) else list(logs)
    found = logs_of([Path(place) for place in places], beside=_no_logs(known))
    chain = Chain(known, Path(output), names_of(found), COMPARE if compare else MEASURE)
    return Batch(tuple(found), tuple(log for log in found if again or not chain.is_fresh(log)), chain)


def _no_logs(scene: Scene) -> list[Path]:
    """Files that stand among the logs and are none: the sheet."""
    return [scene.folder / scene.experiment.sheet] if scene.experiment.sheet else []
