"""Several inputs, one by one: one that fails becomes a row with its reason, the others go on."""

import contextlib
import os
import traceback
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path

from frictionlab.errors import FrictionlabError, SceneError, UsageError
from frictionlab.tables import Row
from frictionlab.workers import Lost, run_each

FAILED = "failed"
PACKAGE = Path(__file__).parents[1]


def rows_of(
    inputs: Sequence[Path], job: Callable[[Path], Row], *, workers: int | None = 1, scheduler: str | None = None
) -> Iterator[Row]:
    """Do the job on each input and yield its row, in order; a failed one yields its source, status and reason.

    Faults of the scene or of the command line concern all inputs and are raised. With workers or a scheduler the job
    travels by pickle (a function of a module, with `functools.partial`) and runs in the folder of the same name there.
    """
    one = partial(row_of, job, folder=None if scheduler is None else Path.cwd())
    for path, row in zip(inputs, run_each(one, inputs, workers=workers, scheduler=scheduler), strict=True):
        yield {"source": str(path), "status": FAILED, "reason": row.reason} if isinstance(row, Lost) else row


def row_of(job: Callable[[Path], Row], path: Path, *, folder: Path | None) -> Row:
    """The row of one input, in this folder or in that one; a failed one gives its reason and is not raised.

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
    """The row of an input that failed, as in the contract; its source stands beside the reason, not in it again."""
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
    steps = [s for s in steps if Path(s.filename).name != "rows.py"]
    place = f" ({Path(steps[-1].filename).relative_to(PACKAGE.parent)}, line {steps[-1].lineno})" if steps else ""
    said = f"{type(error).__name__}: {error}".removesuffix(": ")
    return f"a fault of the program, not of the input: {said}{place}: please report it with the input"
