"""What is told of several inputs while they are done one by one, and the exit status that follows from it."""

from collections.abc import Iterable

import typer

from frictionlab.cli.output import complain
from frictionlab.cli.standard_output import LostOutputError, standard_output
from frictionlab.tables import Row, json_line
from frictionlab.verbs.rows import FAILED

STOPPED = 128 + 2  # the exit status that shells give to what Ctrl-C has stopped


class Rows(list[Row]):
    """The rows of the inputs that are done."""

    stopped = False  # whether Ctrl-C came before the last
    lost: LostOutputError | None = None  # why standard output took no more before the last


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
        seen.lost = error
        if not error.is_closed:
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


def numbers_of(row: Row) -> Row:
    """The row of a steady state as it stands on a screen: warnings are told below it, and growth where it is known."""
    hidden = {"warnings"} | ({"growth_per_cycle"} if row.get("growth_per_cycle") is None else set())
    return {key: value for key, value in row.items() if key not in hidden}


def tell_warnings(row: Row) -> None:
    """Print the warnings of a row on stderr; every command tells them by this, unless ``--json`` or ``--quiet``."""
    warnings = row.get("warnings")
    source = f"{row['source']}: " if "source" in row else ""
    for sentence in warnings if isinstance(warnings, (list, tuple)) else ():
        complain(f"{source}warning: {sentence}")


def exit_status(rows: Iterable[Row]) -> None:
    """Leave with status 1 if some input failed (contract: 0 all well, 1 some input failed), as shells do if stopped."""
    if isinstance(rows, Rows) and rows.stopped:
        raise typer.Exit(STOPPED)
    if isinstance(rows, Rows) and rows.lost is not None:
        raise typer.Exit(rows.lost.status)
    if any(row.get("status") == FAILED for row in rows):
        raise typer.Exit(1)
