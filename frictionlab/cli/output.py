"""What is printed: JSON Lines for programs, tables for people, complaints on stderr.

Text that stood in a log or a file name is never trusted: control characters are shown, not sent to the terminal.
"""

import json
import math
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import typer

Row = Mapping[str, object]


def json_line(row: Row) -> str:
    """One JSON object on one line; NaN and infinity become ``null``, as does whatever is not known.

    Examples
    --------
    >>> json_line({"r": 0.5, "energy_per_cycle": math.nan, "warnings": ()})
    '{"r": 0.5, "energy_per_cycle": null, "warnings": []}'
    """
    return json.dumps({key: _plain(value) for key, value in row.items()}, allow_nan=False)


def _plain(value: object) -> object:
    """The JSON twin of a value: numpy scalars and arrays, paths, tuples and mappings included."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    return str(value) if isinstance(value, Path) else value


def printable(text: str) -> str:
    r"""Show control characters instead of sending them to the terminal.

    Examples
    --------
    >>> printable("steel\x1b[31m")
    'steel\\x1b[31m'
    """
    return "".join(c if c.isprintable() or c == " " else c.encode("unicode_escape").decode() for c in text)


def complain(text: str) -> None:
    """Print one line of complaint on stderr."""
    typer.echo(f"frictionlab: {printable(text)}", err=True)


def cell(value: object) -> str:
    """A value as it stands in a table: six significant digits, a dash for not known.

    Examples
    --------
    >>> [cell(v) for v in (None, math.nan, 2.12604226639334, 0, True, "steel")]
    ['-', '-', '2.12604', '0', 'yes', 'steel']
    """
    value = _plain(value)
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    return printable(str(value))


def print_table(rows: Iterable[Row], columns: Sequence[str] | Mapping[str, str]) -> None:
    """Print rows as a table on stdout: drawn on a terminal, plain aligned text elsewhere.

    Parameters
    ----------
    rows : iterable of mappings
        A key that a row lacks is shown as a dash.
    columns : sequence or mapping
        The keys to show in order; a mapping gives each its title.
    """
    titles = dict(columns) if isinstance(columns, Mapping) else {key: key for key in columns}
    body = [[cell(row.get(key)) for key in titles] for row in rows]
    if sys.stdout.isatty():
        _draw_table(list(titles.values()), body)
    else:
        _align_table(list(titles.values()), body)


def _draw_table(titles: list[str], body: list[list[str]]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table()
    for title in titles:
        table.add_column(Text(title))
    for line in body:
        table.add_row(*(Text(text) for text in line))
    Console(no_color=bool(os.environ.get("NO_COLOR"))).print(table)


def _align_table(titles: list[str], body: list[list[str]]) -> None:
    widths = [max(len(line[i]) for line in [titles, *body]) for i in range(len(titles))]
    for line in [titles, *body]:
        typer.echo("  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip())
