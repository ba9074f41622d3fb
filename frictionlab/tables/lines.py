"""Rows as lines of text: JSON Lines and CSV."""

import csv
import io
import json
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from frictionlab.errors import UsageError
from frictionlab.schema import OUTCOME, Column, Table, column_of, table_of
from frictionlab.tables.cells import CellError, Row, cell_of, checked, encodable, harmless, plain, unquoted, value_of

LINES_AT_ONCE = 1000
_DEEPEST = 100  # objects and lists inside each other, of a row
FAILED = tuple(column.name for column in OUTCOME)
FIRST_BYTES = 1 << 20  # of a file, in which its mark must be found


def json_line(row: Row) -> str:
    """One JSON object on one line; NaN and infinity become ``null``, as does whatever is not known.

    Examples
    --------
    >>> json_line({"r": 0.5, "energy_per_cycle": float("nan"), "warnings": ()})
    '{"r": 0.5, "energy_per_cycle": null, "warnings": []}'
    """
    return json.dumps({key: plain(value) for key, value in row.items()}, allow_nan=False)


def in_pieces(lines: Iterator[str]) -> Iterator[bytes]:
    """The lines in pieces of some hundred kilobytes, so that a table of any length passes through little memory."""
    while piece := "".join(islice(lines, LINES_AT_ONCE)):
        yield piece.encode()


def json_lines(rows: Iterable[Row]) -> Iterator[str]:
    """One line per row."""
    return (json_line(row) + "\n" for row in rows)


def csv_lines(rows: Iterable[Row], names: Sequence[str]) -> Iterator[str]:
    """The head, then one line per row."""
    yield _csv_line([harmless(name) for name in names])
    for row in rows:
        yield _csv_line([cell_of(row.get(name)) for name in names])


def _csv_line(cells: Sequence[str]) -> str:
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(cells)
    return line.getvalue()


def read_json_lines(path: Path, table: Table | None) -> Iterator[dict[str, object]]:
    """The rows of a ``.jsonl`` file.

    Raises
    ------
    UsageError
        A line is no JSON object, or a value is not what its column says.
    """
    for number, line in enumerate(_text_of(path).split("\n"), 1):
        if line.strip():
            yield _checked_row(path, number, _object(path, number, line), table)


def _checked_row(path: Path, number: int, row: dict[str, object], table: Table | None) -> dict[str, object]:
    try:
        return {encodable(key): checked(value, column_of(key, table)) for key, value in row.items()}
    except (CellError, RecursionError) as error:
        said = "nested too deep" if isinstance(error, RecursionError) else error
        raise UsageError(f"{path}, line {number}: {said}: correct it, or make the file again") from error


def _check_depth(row: object, line: str) -> None:
    """Raise `RecursionError` for what is nested deeper than any result; how deep JSON itself goes depends on Python."""
    level: list[Any]
    level, depth = [row] if line.count("{") + line.count("[") > _DEEPEST else [], 0
    while level:
        depth += 1
        if depth > _DEEPEST:
            raise RecursionError
        inner = [value.values() if isinstance(value, dict) else value for value in level]
        level = [value for values in inner for value in values if isinstance(value, (dict, list))]


def _object(path: Path, number: int, line: str) -> dict[str, object]:
    try:
        row = json.loads(line)
        _check_depth(row, line)
    except (ValueError, RecursionError) as error:
        said = "nested too deep" if isinstance(error, RecursionError) else error
        raise UsageError(f"{path}, line {number}: expected a JSON object; {said}") from error
    if not isinstance(row, dict):
        raise UsageError(f"{path}, line {number}: expected a JSON object; got {line[:60]!r}")
    return row


def read_csv(path: Path, table: Table | None) -> Iterator[dict[str, object]]:
    """The rows of a ``.csv`` file.

    Raises
    ------
    UsageError
        A line has another number of cells than the head, or a cell is not what its column says.
    """
    reader = csv.reader(io.StringIO(_text_of(path), newline=""))
    try:
        names = [unquoted(name) for name in next(reader, [])]
        _check_names(path, names)
        kind = table or table_of(names)
        columns = [(name, column_of(name, kind)) for name in names]
        for cells in reader:
            if cells:
                yield _csv_row(path, reader.line_num, columns, cells)
    except csv.Error as error:
        raise UsageError(f"{path}, line {reader.line_num}: expected comma-separated cells; {error}") from error


def _check_names(path: Path, names: Sequence[str]) -> None:
    twice = sorted({name for name in names if name and names.count(name) > 1})
    if twice:
        raise UsageError(f"{path}, line 1: expected each column once; got {twice[0][:60]!r} more than once")


def _csv_row(
    path: Path, number: int, columns: Sequence[tuple[str, Column | None]], cells: Sequence[str]
) -> dict[str, object]:
    if len(cells) != len(columns):
        raise UsageError(f"{path}, line {number}: expected {len(columns)} cells as in the head; got {len(cells)}")
    try:
        pairs = zip(columns, cells, strict=True)
        return {name: value_of(cell, column) for (name, column), cell in pairs if name}
    except CellError as error:
        raise UsageError(f"{path}, line {number}: {error}: correct it, or make the file again") from error


def _text_of(path: Path) -> str:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            return file.read()
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: expected a result as UTF-8 text; byte {error.start} is not") from error


def names_in_csv(path: Path) -> tuple[str, ...]:
    """The names in the head of a ``.csv`` file; none of a file that is no text."""
    with path.open(encoding="utf-8-sig", newline="") as file:
        first = file.readline(FIRST_BYTES)
    return tuple(unquoted(name) for name in next(csv.reader([first]), []))


def names_in_json(path: Path) -> tuple[str, ...]:
    """The keys of the first row of a ``.jsonl`` file that did not fail; if all did, those of a failed one."""
    found: tuple[str, ...] = ()
    with path.open(encoding="utf-8") as file:
        for line in file.read(FIRST_BYTES).split("\n"):
            row = json.loads(line) if line.strip() else dict.fromkeys(found)
            found = tuple(row) if isinstance(row, dict) else ("",)
            if found and found != FAILED:
                break
    return found
