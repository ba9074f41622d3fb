"""Several inputs, one by one: one that fails becomes a line with its reason, the others go on."""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import typer

from frictionlab.cli.output import complain
from frictionlab.errors import FrictionlabError, SceneError, UsageError
from frictionlab.tables import Row, json_line

FAILED = "failed"


def rows_of(inputs: Iterable[Path], job: Callable[[Path], Row]) -> Iterator[Row]:
    """Do the job on each input in order and yield its row; a failed one yields its source, status and reason.

    Faults of the scene or of the command line concern all inputs and are raised.
    """
    for path in inputs:
        try:
            yield job(path)
        except (SceneError, UsageError):
            raise
        except (FrictionlabError, OSError) as error:
            yield failure(path, error)


def failure(path: Path, error: Exception) -> Row:
    """The row of an input that failed, as in the contract."""
    reason = f"{error.strerror}" if isinstance(error, OSError) and error.strerror else str(error)
    return {"source": str(path), "status": FAILED, "reason": reason}


def report_rows(rows: Iterable[Row], *, as_json: bool) -> list[Row]:
    """Print each row as it comes: JSON Lines on stdout, or the failures alone on stderr; return them all."""
    seen = []
    for row in rows:
        if as_json:
            typer.echo(json_line(row))
        elif row.get("status") == FAILED:
            complain(f"{row['source']}: {row['reason']}")
        seen.append(row)
    return seen


def exit_status(rows: Iterable[Row]) -> None:
    """Leave with status 1 if some input failed (contract: 0 all well, 1 some input failed)."""
    if any(row.get("status") == FAILED for row in rows):
        raise typer.Exit(1)
