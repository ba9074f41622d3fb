"""What is printed: tables for people on stdout, complaints on stderr.

Text that stood in a log or a file name is never trusted: control characters are shown, not sent to the terminal.
"""

import os
import shutil
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence

import typer

from frictionlab.schema import Table, column_of
from frictionlab.tables import Row, plain

GAP = 2  # blanks between columns
LEAST_TEXT = 16  # characters that a text keeps in one line before it is told in several
FEW = 3  # rows that are rather turned than robbed of columns


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
    >>> [cell(v) for v in (None, math.nan, 2.12604226639334, 0, True, "steel", ["a", "b"], {"beta": 0.4})]
    ['-', '-', '2.12604', '0', 'yes', 'steel', 'a; b', 'beta = 0.4']
    """
    value = plain(value)
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list) and all(isinstance(item, str) for item in value):
        return printable("; ".join(map(str, value))) or "-"
    if isinstance(value, dict):
        return ", ".join(f"{printable(str(key))} = {cell(item)}" for key, item in value.items()) or "-"
    return printable(str(value))


def print_table(
    rows: Iterable[Row], columns: Table | Sequence[str] | Mapping[str, str], *, elsewhere: str = "--json and -o give"
) -> None:
    """Print rows as a table on stdout: drawn on a terminal, plain aligned text elsewhere.

    No number is ever cut. What is too wide for the terminal is made narrower by telling long texts in several lines;
    then, of a few rows, by turning the table; then by leaving out the last columns, and saying which.

    Parameters
    ----------
    rows : iterable of mappings
        A key that a row lacks is shown as a dash.
    columns : Table, sequence or mapping
        A table of the schema, of which the columns for a screen are shown; or the keys to show in order; or their
        titles by key.
    elsewhere : str
        What gives all columns where some find no room.
    """
    told = list(rows)
    heads = _heads(columns, told)
    width = _width()
    widths = _fitted(heads, told, width)
    if widths is None and len(told) <= FEW:
        print_turned(told, heads)
        return
    gone: list[str] = []
    while widths is None and len(heads) > 1:
        gone.insert(0, heads.pop(list(heads)[-1]))
        widths = _fitted(heads, told, width)
    _print_lines(heads, told, widths or [width or LEAST_TEXT])
    if gone:
        typer.echo(f"no room for: {', '.join(gone)} ({elsewhere} all columns)")


def print_good(rows: Iterable[Row], columns: Table | Mapping[str, str]) -> list[Row]:
    """Print the rows of inputs that did not fail, if there are any; return them."""
    good = [row for row in rows if row.get("status") == "ok"]
    if good:
        print_table(good, columns)
    return good


def print_turned(rows: Iterable[Row], columns: Table | Mapping[str, str]) -> None:
    """Print rows one below the other, a line for each of their values; of a schema's table, of all its columns."""
    for number, row in enumerate(rows):
        heads = _turned_heads(columns, row)
        widest = max(map(len, heads.values()), default=0)
        if number:
            typer.echo()
        room = max(_width() - widest - GAP, LEAST_TEXT)
        for key, head in heads.items():
            lines = _folded(cell(row.get(key)), room) if _width() and _is_text(key, [row]) else [cell(row.get(key))]
            for part, text in enumerate(lines):
                typer.echo(f"{'' if part else head:<{widest}}{' ' * GAP}{text}".rstrip())


def _heads(columns: Table | Sequence[str] | Mapping[str, str], rows: Sequence[Row]) -> dict[str, str]:
    if isinstance(columns, Table):
        known = {key for row in rows for key, value in row.items() if plain(value) is not None}
        names = (name for name in columns.shown if name in known or name not in columns.shown_where_known)
        return {name: _head(name, columns) for name in (*_own_axes(columns, rows), *names)}
    return dict(columns) if isinstance(columns, Mapping) else {key: key for key in columns}


def _own_axes(table: Table, rows: Sequence[Row]) -> Iterable[str]:
    """Columns that a map has beside those of the schema: the parameters of its law."""
    known = {column.name for column in table.columns}
    return dict.fromkeys(key for row in rows for key in row if table.kind in ("map", "motion") and key not in known)


def _turned_heads(columns: Table | Mapping[str, str], row: Row) -> dict[str, str]:
    return {name: _head(name, columns) for name in row} if isinstance(columns, Table) else dict(columns)


def _head(name: str, table: Table) -> str:
    column = column_of(name, table)
    return printable(name) if column is None else column.head


def paragraph(text: str, *, indent: str = "") -> None:
    """Print a sentence on stdout, in lines that fit the terminal; whole elsewhere."""
    width = _width()
    lines = textwrap.wrap(text, width, subsequent_indent=indent, break_on_hyphens=False) if width else [text]
    typer.echo("\n".join(lines))


def _width() -> int:
    """Characters in a line of the terminal; 0 in a pipe, where any length goes."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else 0


def _fitted(heads: Mapping[str, str], rows: Sequence[Row], width: int) -> list[int] | None:
    """The width of each column so that all fit; None if they cannot. Numbers and heads keep theirs, texts may give."""
    full = [max(len(line) for line in (head, *(cell(row.get(key)) for row in rows))) for key, head in heads.items()]
    frame = _frame(len(heads))
    spare = width - frame - sum(full)
    if not width or spare >= 0:
        return full
    for i in sorted(range(len(full)), key=lambda i: -full[i]):
        key, head = list(heads.items())[i]
        if _is_text(key, rows):
            given = max(LEAST_TEXT, len(head), full[i] + spare)
            spare, full[i] = spare + full[i] - min(given, full[i]), min(given, full[i])
    return full if spare >= 0 else None


def _frame(columns: int) -> int:
    """Characters that stand between and about the columns."""
    return 3 * columns + 1 if sys.stdout.isatty() else GAP * (columns - 1)


def _is_text(key: str, rows: Sequence[Row]) -> bool:
    return all(isinstance(plain(row.get(key)), (str, list, dict, type(None))) for row in rows)


def _print_lines(heads: Mapping[str, str], rows: Sequence[Row], widths: Sequence[int]) -> None:
    body = [[cell(row.get(key)) for key in heads] for row in rows]
    if sys.stdout.isatty():
        _draw_table(list(heads.values()), body, widths)
    else:
        _align_table([list(heads.values()), *body], widths)


def _draw_table(titles: Sequence[str], body: Sequence[Sequence[str]], widths: Sequence[int]) -> None:
    from rich.console import Console
    from rich.table import Table as Drawn
    from rich.text import Text

    table = Drawn()
    for title, width in zip(titles, widths, strict=True):
        table.add_column(Text(title), width=width, no_wrap=False, overflow="fold")
    for line in body:
        table.add_row(*(Text(text) for text in line))
    Console(no_color=bool(os.environ.get("NO_COLOR")), width=_width() or None).print(table)


def _align_table(lines: Sequence[Sequence[str]], widths: Sequence[int]) -> None:
    for line in lines:
        folded = [_folded(text, width) for text, width in zip(line, widths, strict=True)]
        for part in range(max(map(len, folded))):
            cells = ("".join(texts[part : part + 1]).ljust(width) for texts, width in zip(folded, widths, strict=True))
            typer.echo((" " * GAP).join(cells).rstrip())


def _folded(text: str, width: int) -> list[str]:
    return textwrap.wrap(text, width, break_on_hyphens=False) if len(text) > width else [text]
