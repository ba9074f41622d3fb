"""Recordings on a command line, done one by one: by workers, with progress, each row told as it comes."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from frictionlab.cli.budget import tell_assumed
from frictionlab.cli.inputs import Rows, report_rows
from frictionlab.cli.logs import on_disk
from frictionlab.cli.progress import track
from frictionlab.tables import Row

if TYPE_CHECKING:
    from frictionlab.scene import Scene


def rows_told(
    recordings: Sequence[Path],
    job: Callable[..., Row],
    *,
    scene: "Scene",
    title: str,
    as_json: bool,
    quiet: bool,
    workers: int | None,
    scheduler: str | None,
    warns: bool = True,
    sifted: Callable[[Iterable[Row]], Iterable[Row]] = iter,
) -> Rows:
    """Make the row of each recording, tell it, and return them all.

    ``job``: makes a row of a path, its ``scene`` and ``files``, where what stands on no disk has been put; ``warns``:
    whether warnings are told on stderr; ``sifted``: what the rows pass through before they are told.
    """
    from frictionlab.verbs.rows import rows_of

    with on_disk(recordings) as files:
        made = rows_of(recordings, partial(job, scene=scene, files=files), workers=workers, scheduler=scheduler)
        watched = track(sifted(made), total=len(recordings), title=title, quiet=quiet)
        rows = report_rows(watched, as_json=as_json, quiet=quiet or not warns)
    tell_assumed(scene, rows, quiet=quiet or as_json)
    return rows
