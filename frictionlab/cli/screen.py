"""What is printed: tables for people on stdout; on stderr complaints, and on a terminal how far the work is.

Text that stood in a log or a file name is never trusted: control characters are shown, not sent to the terminal.
"""

import os
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import typer

from frictionlab.cli import complain, printable
from frictionlab.schema import Table, column_of
from frictionlab.tables import Row, plain
from frictionlab.tables.texts import kinds_of

WIDTH = 80  # letters in a line, where no terminal says another number
GAP = 2  # blanks between columns
LEAST_TEXT = 16  # letters that a text keeps in one line before it is folded
FEW = 3  # rows that are rather turned than robbed of columns
MOST_WARNINGS = 10  # lines
T = TypeVar("T")
Count = Callable[[int, int], None]
"""Called with what is done and what there is in all."""


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


@dataclass(frozen=True)
class Shown:
    """A column of the table of tests: its title, what stands in it, and how gladly it is kept in a narrow window."""

    title: str
    text: Callable[[Row], str]
    keep: int = 9


def print_tests(rows: Sequence[Row], columns: Sequence[Shown], headline: str) -> None:
    """Print one line a test, failures among them, within the window; the columns kept least gladly go first.

    Where all failed there is no table: each failure is a line on stderr.
    """
    good = [row for row in rows if row.get("status") != "failed"]
    if not good:
        for row in rows:
            complain(f"{row.get('source')}: {row.get('reason')}")
        return
    names = short_names([str(row.get("source")) for row in rows])
    for number, row in enumerate(rows):
        if row.get("status") == "failed":
            names[number] = printable(Path(str(row.get("source"))).name)
    texts = {c.title: [printable(c.text(row)) if row in good else "" for row in rows] for c in columns}
    filled = [c for c in columns if set(texts[c.title]) - {"", "-"}]
    width = _width() or WIDTH
    widest = max(map(len, names))
    while True:
        widths = [max(len(c.title), *map(len, texts[c.title])) for c in filled]
        spare = width - sum(widths) - GAP * len(widths)
        if spare >= min(widest, LEAST_TEXT) or len(filled) == 1:
            break
        filled.remove(min(filled, key=lambda c: c.keep))
    first = max(min(widest, spare), len("test"))
    typer.echo(_bold(headline))
    typer.echo(_bold(_joined(["test", *(c.title for c in filled)], [first, *widths])))
    for number, (name, row) in enumerate(zip(names, rows, strict=True)):
        cut = name if len(name) <= first else f"{name[: first - 8]}..{name[-6:]}"
        if row.get("status") == "failed":
            said = printable(f"failed: {row.get('reason')}")
            lines = textwrap.wrap(said, max(width - first - GAP, LEAST_TEXT), break_on_hyphens=False)
            typer.echo("\n".join(_joined([cut if not i else "", line], [first, 0]) for i, line in enumerate(lines)))
        else:
            typer.echo(_joined([cut, *(texts[c.title][number] for c in filled)], [first, *widths]))


def short_names(sources: Sequence[str]) -> list[str]:
    """The names of files without folder and suffix, where that tells them apart; else as they are."""
    stems = [printable(Path(source).name.removesuffix(".gz")) for source in sources]
    stems = [Path(stem).stem if Path(stem).suffix else stem for stem in stems]
    return stems if len(set(stems)) == len(set(sources)) else [printable(source) for source in sources]


def print_warnings(rows: Iterable[Row], *, verbose: bool = False, notes: Sequence[str] = ()) -> None:
    """Print the warnings of all rows on stderr, once for each cause with its count; at most ten lines, or all of them.

    On a terminal lines are folded; where that makes too many the rest is counted.
    """
    told = [(str(row.get("source") or ""), said) for row in rows for said in warnings_of(row)]
    sources = list(dict.fromkeys(source for source, _ in told))
    short = dict(zip(sources, short_names(sources), strict=True))
    lines: list[str] = []
    for sentence, where in kinds_of(told):
        count = f" ({len(where)} tests)" if len(where) > 1 else f" ({short[where[0]]})" if where[0] else ""
        lines += _folded_for(f"warning{count}: {sentence}")
        if verbose and len(where) > 1:
            lines += _folded_for(f"    in {', '.join(short[source] for source in where)}")
    lines += [line for note in notes for line in _folded_for(f"note: {note}")]
    shown = lines if verbose or len(lines) <= MOST_WARNINGS else lines[: MOST_WARNINGS - 1]
    for line in shown:
        typer.echo(line, err=True)
    if len(shown) < len(lines):
        typer.echo(f"... {len(lines) - len(shown)} more lines of warnings: -v shows them, --json has them", err=True)


def warnings_of(row: Row) -> list[str]:
    """The warnings of a row."""
    warnings = row.get("warnings")
    return [str(warning) for warning in warnings] if isinstance(warnings, (list, tuple)) else []


def _folded_for(text: str) -> list[str]:
    """A line for stderr, folded where that is a terminal."""
    text = printable(text)
    if not sys.stderr.isatty():
        return [f"frictionlab: {text}"]
    return textwrap.wrap(text, shutil.get_terminal_size().columns, subsequent_indent="    ", break_on_hyphens=False)


def print_table(
    rows: Iterable[Row], columns: Table | Sequence[str] | Mapping[str, str], *, elsewhere: str = "--json and -o give"
) -> None:
    """Print rows as a table of aligned text on stdout.

    No number is ever cut. What is too wide for the terminal is, of a few rows, turned; of many, left out from the end,
    and named.

    Parameters
    ----------
    rows : iterable of mappings
        A key that a row lacks is shown as a dash.
    columns : Table, sequence or mapping
        A table of the schema, of which the columns for a screen are shown; or the keys to show in order; or their
        titles by key.
    elsewhere : str
        What gives all columns where some do not fit.
    """
    told = list(rows)
    heads = _heads(columns, told)
    lines = [list(heads.values()), *([cell(row.get(key)) for key in heads] for row in told)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    kept = len(widths)
    while _width() and kept > 1 and sum(widths[:kept]) + GAP * (kept - 1) > _width():
        kept -= 1
    if kept < len(widths) and len(told) <= FEW:
        print_turned(told, heads)
        return
    for number, line in enumerate(lines):
        text = _joined(line[:kept], widths[:kept])
        typer.echo(text if number else _bold(text))
    if kept < len(widths):
        typer.echo(f"does not fit: {', '.join(lines[0][kept:])} ({elsewhere} all columns)")


def print_turned(rows: Iterable[Row], columns: Table | Mapping[str, str]) -> None:
    """Print rows one below the other, a line for each of their values; of a schema's table, of all its columns."""
    for number, row in enumerate(rows):
        heads = {name: _head(name, columns) for name in row} if isinstance(columns, Table) else dict(columns)
        widest = max(map(len, heads.values()), default=0)
        if number:
            typer.echo()
        for key, head in heads.items():
            typer.echo(_joined([head, cell(row.get(key))], [widest, 0]))


def paragraph(text: str, *, indent: str = "") -> None:
    """Print a sentence on stdout, in lines that fit the terminal; whole elsewhere."""
    width = _width()
    lines = textwrap.wrap(text, width, subsequent_indent=indent, break_on_hyphens=False) if width else [text]
    typer.echo("\n".join(lines))


def _bold(text: str) -> str:
    bold = sys.stdout.isatty() and not os.environ.get("NO_COLOR")
    return typer.style(text, bold=True) if bold else text


def _joined(texts: Sequence[str], widths: Sequence[int]) -> str:
    return (" " * GAP).join(text.ljust(width) for text, width in zip(texts, widths, strict=True)).rstrip()


def _heads(columns: Table | Sequence[str] | Mapping[str, str], rows: Sequence[Row]) -> dict[str, str]:
    if not isinstance(columns, Table):
        return dict(columns) if isinstance(columns, Mapping) else {key: printable(key) for key in columns}
    known = {key for row in rows for key, value in row.items() if plain(value) is not None}
    names = [name for name in columns.shown if name in known or name not in columns.where_known]
    own = {column.name for column in columns.columns}  # a map has columns of its own: the parameters of its law
    more = dict.fromkeys(key for row in rows for key in row if columns.kind in ("map", "motion") and key not in own)
    return {name: _head(name, columns) for name in (*more, *names)}


def _head(name: str, table: Table | Mapping[str, str]) -> str:
    column = column_of(name, table) if isinstance(table, Table) else None
    return printable(name) if column is None else column.head


def _width() -> int:
    """Letters in a line of the terminal; 0 in a pipe, where any length goes."""
    return shutil.get_terminal_size().columns if sys.stdout.isatty() else 0


def track(items: Iterable[T], *, total: int, title: str, quiet: bool = False) -> Iterator[T]:
    """Yield the items and show how many are done, if ``quiet`` is not set."""
    with count(title, quiet=quiet, total=total) as progress:
        for number, item in enumerate(items, 1):
            yield item
            if progress is not None:
                progress(number, total)


@contextmanager
def count(
    title: str, *, quiet: bool = False, total: int | None = None, in_bytes: bool = False
) -> Iterator[Count | None]:
    """Give a function that shows how much is done, with speed and time left; None where nothing is to be shown."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich import progress as bars
    from rich.console import Console
    from rich.markup import escape

    counted = (bars.MofNCompleteColumn(), bars.TimeRemainingColumn())
    done = (bars.DownloadColumn(), bars.TransferSpeedColumn()) if in_bytes else counted
    columns = (bars.TextColumn("{task.description}"), bars.BarColumn(), *done)
    with bars.Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(escape(title.encode("ascii", "backslashreplace").decode()), total=total)
        yield lambda done, total: progress.update(task, completed=done, total=total)
