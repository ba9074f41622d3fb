"""``frictionlab show``: what is in a recording, a scene or a result."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from frictionlab.errors import FrictionlabError, UsageError

MOST = 100  # rows on a terminal

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from frictionlab.tables import Row


def show(file: Path) -> None:
    """Show what is in a recording (.h5), a scene (.toml) or a result (.csv, .jsonl, .xlsx, .parquet, .h5).

    Example: frictionlab show configs/frame.toml
    """
    readers = _readers()
    suffix = file.suffix.lower()
    if not file.exists():
        raise UsageError(f"{file}: there is no such file: give the path of a recording, scene or result")
    if not file.is_file():
        raise UsageError(f"{file}: expected a file; got a folder or a device: give the path of a file")
    if suffix not in readers:
        raise UsageError(f"{file}: expected one of {', '.join(readers)}; got {file.suffix or 'no suffix'}")
    try:
        readers[suffix](file)
    except OSError as error:
        if isinstance(error, FrictionlabError):
            raise
        raise UsageError(f"{file}: cannot be read ({error.strerror}): give the path of an existing file") from error


def _readers() -> "Mapping[str, Callable[[Path], None]]":
    tables = dict.fromkeys((".csv", ".jsonl", ".xlsx", ".parquet"), _show_rows)
    return {**tables, ".toml": _show_scene, ".h5": _show_tree}


def _show_scene(file: Path) -> None:
    from frictionlab.scene import read_scene
    from frictionlab.scene.text import to_toml

    for line in to_toml(read_scene(file)).splitlines():
        typer.echo(line)


def _show_tree(file: Path) -> None:
    from frictionlab.cli.output import printable
    from frictionlab.tables import has_rows

    if has_rows(file):
        _show_rows(file)
        return
    from frictionlab.hdf5 import describe

    for line in describe(file):
        typer.echo(printable(line))


def _show_rows(file: Path) -> None:
    from frictionlab.cli.output import print_table
    from frictionlab.schema import table_of

    rows = _rows_of(file)
    good = [row for row in rows if row.get("status") != "failed"]
    names = list(dict.fromkeys(key for row in good for key in row))
    table = table_of(names)
    if good:
        seen = good[:MOST] if sys.stdout.isatty() else good
        print_table(seen, names if table is None else table, elsewhere="a wider window, or a pipe, has")
        if len(seen) < len(good):
            typer.echo(f"the first {len(seen)} of {len(good)} rows; a pipe has all, as in: frictionlab show ... | more")
    else:
        typer.echo("no rows" if not rows else "no row without a failure")
    for row in rows:
        _tell(row)
    _tell_alike(rows)


def _rows_of(file: Path) -> "list[Row]":
    from frictionlab.tables import read_rows

    try:
        return list(read_rows(file))
    except UsageError as error:
        hint = f"; if it is a log, `frictionlab ingest --dry-run {file}` tells what is in it"
        raise UsageError(f"{error}{hint if file.suffix == '.csv' else ''}") from error


def _tell(row: "Row") -> None:
    from frictionlab.cli.output import printable, warnings_of

    source = row.get("source")
    if row.get("status") == "failed":
        typer.echo(f"{printable(str(source))}: failed: {printable(str(row.get('reason')))}")
    for warning in warnings_of(row) if source is not None else ():
        typer.echo(f"{printable(str(source))}: {printable(warning)}")


def _tell_alike(rows: "list[Row]") -> None:
    """Print the warnings of rows without a source (points of a map), those of a kind once."""
    from frictionlab.cli.output import kinds_of, printable, warnings_of

    numbered = enumerate(rows, 1)
    found = [(f"row {i}", said) for i, row in numbered if row.get("source") is None for said in warnings_of(row)]
    for sentence, sources in kinds_of(found):
        more = f" and {len(sources) - 1} more" if len(sources) > 1 else ""
        typer.echo(f"{sources[0]}{more}: {printable(sentence)}")
