"""Several inputs, one by one: one that fails becomes a line with its reason, the others go on."""

import contextlib
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path

import typer

from frictionlab.cli.output import complain
from frictionlab.errors import FrictionlabError, SceneError, UsageError
from frictionlab.tables import Row, json_line

FAILED = "failed"
STOPPED = 128 + 2  # the exit status that shells give to what Ctrl-C has stopped


class Rows(list[Row]):
    """The rows of the inputs that are done."""

    stopped = False  # whether Ctrl-C came before the last


def rows_of(
    inputs: Sequence[Path], job: Callable[[Path], Row], *, workers: int | None = 1, scheduler: str | None = None
) -> Iterator[Row]:
    """Do the job on each input and yield its row, in order; a failed one yields its source, status and reason.

    Faults of the scene or of the command line concern all inputs and are raised. With workers or a scheduler the job
    travels by pickle (a function of a module, with `functools.partial`) and runs in this folder's twin there.
    """
    from frictionlab.workers import Lost, run_each

    one = partial(row_of, job, folder=None if scheduler is None else Path.cwd())
    for path, row in zip(inputs, run_each(one, inputs, workers=workers, scheduler=scheduler), strict=True):
        yield {"source": str(path), "status": FAILED, "reason": row.reason} if isinstance(row, Lost) else row


def row_of(job: Callable[[Path], Row], path: Path, *, folder: Path | None) -> Row:
    """The row of one input, in this folder or in that one; a failed one is told, not raised."""
    try:
        with contextlib.nullcontext() if folder is None else _inside(folder):
            return job(path)
    except (SceneError, UsageError):
        raise
    except (FrictionlabError, OSError) as error:
        return failure(path, error)


def _inside(folder: Path) -> contextlib.AbstractContextManager[None]:
    if not os.access(folder, os.X_OK):
        raise UsageError(
            f"{folder}: a worker of the cluster does not see this folder: expected the same files there as here; "
            "do: work in a folder that all machines share"
        )
    return contextlib.chdir(folder)


def failure(path: Path, error: Exception) -> Row:
    """The row of an input that failed, as in the contract; its source is told beside the reason, not in it again."""
    reason = f"{error.strerror}" if isinstance(error, OSError) and error.strerror else str(error)
    for name in (str(path), path.name):
        reason = reason.removeprefix(f"{name}: ")
    return {"source": str(path), "status": FAILED, "reason": reason}


def report_rows(rows: Iterable[Row], *, as_json: bool) -> Rows:
    """Print each row as it comes: JSON Lines on stdout, or the failures alone on stderr; return them all.

    Ctrl-C ends it; the rows until then are returned, so that the command can still write them.
    """
    seen = Rows()
    try:
        for row in rows:
            if as_json:
                typer.echo(json_line(row))
            elif row.get("status") == FAILED:
                complain(f"{row['source']}: {row['reason']}")
            seen.append(row)
    except KeyboardInterrupt:
        seen.stopped = True
        complain(f"stopped: {len(seen)} inputs are done, the others are not")
    return seen


def exit_status(rows: Iterable[Row]) -> None:
    """Leave with status 1 if some input failed (contract: 0 all well, 1 some input failed), 130 after Ctrl-C."""
    if isinstance(rows, Rows) and rows.stopped:
        raise typer.Exit(STOPPED)
    if any(row.get("status") == FAILED for row in rows):
        raise typer.Exit(1)
