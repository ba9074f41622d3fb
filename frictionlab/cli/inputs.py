"""Several inputs, one by one: one that fails becomes a line with its reason, the others go on."""

import contextlib
import os
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path

import typer

from frictionlab.cli.output import complain
from frictionlab.errors import FrictionlabError, SceneError, UsageError
from frictionlab.tables import Row, json_line

FAILED = "failed"
PACKAGE = Path(__file__).parents[1]
STOPPED = 128 + 2  # the exit status that shells give to what Ctrl-C has stopped


class Rows(list[Row]):
    """The rows of the inputs that are done."""

    stopped = False  # whether Ctrl-C came before the last
    lost = False  # whether standard output took no more before the last


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
    """The row of one input, in this folder or in that one; a failed one is told, not raised.

    Whatever a job raises stays with its input, a fault of the program too: the others go on and no row is lost.
    """
    try:
        with contextlib.nullcontext() if folder is None else _inside(folder):
            return job(path)
    except (SceneError, UsageError):
        raise
    except Exception as error:  # noqa: BLE001  # the one place where what nobody foresaw becomes a row
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
    reason = reason_of(error)
    for name in (str(path), path.name):
        reason = reason.removeprefix(f"{name}: ")
    return {"source": str(path), "status": FAILED, "reason": reason}


def reason_of(error: Exception) -> str:
    """Why something failed, as a sentence: what this package says, what the system says, or a fault of the program.

    Examples
    --------
    >>> reason_of(KeyError("µs"))
    "a fault of the program, not of the input: KeyError: 'µs': please report it with the input"
    """
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    if isinstance(error, (FrictionlabError, OSError)):
        return str(error)
    if isinstance(error, MemoryError):
        return "not enough memory: give it a machine with more, or a shorter log"
    steps = [s for s in traceback.extract_tb(error.__traceback__) if PACKAGE in Path(s.filename).parents]
    steps = [s for s in steps if s.filename != __file__]
    place = f" ({Path(steps[-1].filename).relative_to(PACKAGE.parent)}, line {steps[-1].lineno})" if steps else ""
    said = f"{type(error).__name__}: {error}".removesuffix(": ")
    return f"a fault of the program, not of the input: {said}{place}: please report it with the input"


def report_rows(rows: Iterable[Row], *, as_json: bool, quiet: bool = False) -> Rows:
    """Tell each row as it comes and return them all: JSON Lines on stdout, or failures and warnings on stderr.

    Ctrl-C and a standard output that takes no more (a full disk, a pipe that was closed) end it; the rows until then
    are returned, so that the command can still write them.
    """
    seen = Rows()
    try:
        for row in rows:
            seen.append(row)
            _tell(row, as_json=as_json, quiet=quiet)
    except KeyboardInterrupt:
        seen.stopped = True
        complain(f"stopped: {len(seen)} inputs are done, the others are not")
    except LostOutputError as error:
        seen.lost = True
        complain(f"{error}: {len(seen)} inputs are done, the others are not")
    return seen


def _tell(row: Row, *, as_json: bool, quiet: bool) -> None:
    if as_json:
        with standard_output():
            typer.echo(json_line(row))
    elif row.get("status") == FAILED:
        complain(f"{row['source']}: {row['reason']}")
    elif not quiet:
        tell_warnings(row)


def tell_warnings(row: Row) -> None:
    """Print the warnings of a row on stderr; every command tells them by this, unless ``--json`` or ``--quiet``."""
    warnings = row.get("warnings")
    source = f"{row['source']}: " if "source" in row else ""
    for sentence in warnings if isinstance(warnings, (list, tuple)) else ():
        complain(f"{source}warning: {sentence}")


class LostOutputError(Exception):
    """Standard output takes no more."""


@contextlib.contextmanager
def standard_output() -> Iterator[None]:
    """Turn what the system says of standard output into `LostOutputError`; what was not printed is dropped."""
    try:
        yield
        sys.stdout.flush()
    except OSError as error:
        drop_output()
        raise LostOutputError(f"standard output: {error.strerror or error}") from error


def drop_output() -> None:
    """Let what is still to be printed go nowhere, so that nothing is raised again when Python leaves."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def exit_status(rows: Iterable[Row]) -> None:
    """Leave with status 1 if some input failed (contract: 0 all well, 1 some input failed), 130 after Ctrl-C."""
    if isinstance(rows, Rows) and rows.stopped:
        raise typer.Exit(STOPPED)
    if isinstance(rows, Rows) and rows.lost:
        raise typer.Exit(1)
    if any(row.get("status") == FAILED for row in rows):
        raise typer.Exit(1)
