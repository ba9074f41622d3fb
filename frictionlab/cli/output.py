"""What is printed: tables for people on stdout, complaints on stderr.

Text that stood in a log or a file name is never trusted: control characters are shown, not sent to the terminal.
"""

import os
import sys
from collections.abc import Iterable, Mapping, Sequence

import typer

from frictionlab.tables import Row, plain


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
    >>> import math
    >>> [cell(v) for v in (None, math.nan, 2.12604226639334, 0, True, "steel")]
    ['-', '-', '2.12604', '0', 'yes', 'steel']
    """
    value = plain(value)
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
