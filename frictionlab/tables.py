"""Rows of results in files: JSON Lines and CSV, whole or not at all, read back as they were written.

A row is a mapping from the contract's keys to values. Not-known is ``null`` in JSON and an empty cell in CSV; NaN and
infinity appear in neither.
"""

import contextlib
import csv
import io
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path

from frictionlab.errors import UsageError
from frictionlab.files import write_whole

Row = Mapping[str, object]
SENTENCES = " | "  # between the sentences of a list in one CSV cell
SUFFIXES = (".csv", ".jsonl")
TEXT_KEYS = frozenset(
    {
        "source",
        "status",
        "reason",
        "material",
        "regime",
        "energy_rule",
        "model",
        "solver",
        "outcome",
        "wall",
        "criterion",
        "accuracy",
        "knob",
        "setting",
        "quantity",
        "reference",
    }
)
MARKS = frozenset(
    {"source", "outcome", "criterion", "friction_ratio", "knob", "slope_per_hour", "log"}
)  # one is in every table
LIST_KEYS = frozenset({"warnings"})
LINES_AT_ONCE = 1000


def plain(value: object) -> object:
    """The JSON twin of a value: numpy scalars and arrays, paths, tuples and mappings included; NaN becomes None."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    return str(value) if isinstance(value, Path) else value


def json_line(row: Row) -> str:
    """One JSON object on one line; NaN and infinity become ``null``, as does whatever is not known.

    Examples
    --------
    >>> json_line({"r": 0.5, "energy_per_cycle": math.nan, "warnings": ()})
    '{"r": 0.5, "energy_per_cycle": null, "warnings": []}'
    """
    return json.dumps({key: plain(value) for key, value in row.items()}, allow_nan=False)


def write_rows(rows: Iterable[Row], path: Path, columns: Sequence[str] | None = None, *, force: bool = False) -> None:
    """Write rows to a ``.jsonl`` or ``.csv`` file, whole or not at all.

    Parameters
    ----------
    rows : iterable of mappings
    path : Path
        Its suffix says how.
    columns : sequence of str, optional
        The columns of a CSV, in order; by default all keys in the order they first appear, for which all rows are held.
    force : bool
        Replace whatever file stands there; else only a table of this tool.

    Raises
    ------
    UsageError
        Another suffix, no such folder, or a file of another kind stands there.
    OutputError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "rows.csv"
    >>> write_rows([{"source": "a.h5", "cycles": 3, "warnings": ["short"]}], path)
    >>> read_rows(path)
    [{'source': 'a.h5', 'cycles': 3, 'warnings': ['short']}]
    """
    check_output(path, force=force)
    write_whole(path, _pieces(_json_lines(rows) if path.suffix == ".jsonl" else _csv_lines(rows, columns)))


def check_output(path: Path, *, force: bool = False) -> None:
    """Refuse an output that could not be written, before the long work.

    Raises
    ------
    UsageError
        Another suffix, no such folder, or a file of another kind stands there; the message says which.
    """
    if path.suffix not in SUFFIXES:
        raise UsageError(f"{path}: expected an output ending in {' or '.join(SUFFIXES)}; got {path.suffix!r}")
    if not path.parent.is_dir():
        raise UsageError(f"{path}: there is no folder {path.parent}: make it first")
    if path.exists() and not (force or is_table(path)):
        raise UsageError(f"{path}: exists and is no table of frictionlab: choose another output, or give --force")


def is_table(path: Path) -> bool:
    """Whether this file is a table of this tool: an empty one, or one whose first line has a key that marks them."""
    try:
        with path.open(encoding="utf-8") as file:
            first = file.readline(1 << 20)
        keys = json.loads(first) if path.suffix == ".jsonl" and first else next(csv.reader([first]), ())
    except (OSError, ValueError, csv.Error):
        return False
    return not first or not MARKS.isdisjoint(keys if isinstance(keys, (dict, list)) else ())


def _pieces(lines: Iterator[str]) -> Iterator[bytes]:
    """The lines in pieces of some hundred kilobytes, so that a table of any length passes through little memory."""
    while piece := "".join(islice(lines, LINES_AT_ONCE)):
        yield piece.encode(errors="backslashreplace")  # a file name need not be text


def _json_lines(rows: Iterable[Row]) -> Iterator[str]:
    return (json_line(row) + "\n" for row in rows)


def _csv_lines(rows: Iterable[Row], columns: Sequence[str] | None) -> Iterator[str]:
    if columns is None:
        rows = list(rows)
        columns = list(dict.fromkeys(key for row in rows for key in row))
    yield _csv_line(columns)
    for row in rows:
        yield _csv_line([_cell(row.get(key)) for key in columns])


def _csv_line(cells: Sequence[str]) -> str:
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(cells)
    return line.getvalue()


def _cell(value: object) -> str:
    value = plain(value)
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list):
        return SENTENCES.join(map(str, value))
    return repr(value) if isinstance(value, float) else str(value)


def read_rows(path: Path) -> list[dict[str, object]]:
    """Read the rows of a ``.jsonl`` or ``.csv`` file as :func:`write_rows` wrote them.

    Raises
    ------
    UsageError
        The file is not there, is of another kind, or a line of it is damaged.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise UsageError(f"{path}: cannot be read ({error.strerror}): give the path of an existing result") from error
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: expected a result as UTF-8 text; byte {error.start} is not") from error
    return _read_csv(text) if path.suffix == ".csv" else [_object(path, n, line) for n, line in _lines(text)]


def _lines(text: str) -> Iterable[tuple[int, str]]:
    return ((number, line) for number, line in enumerate(text.splitlines(), 1) if line.strip())


def _object(path: Path, number: int, line: str) -> dict[str, object]:
    try:
        row = json.loads(line)
    except json.JSONDecodeError as error:
        raise UsageError(f"{path}, line {number}: expected a JSON object; {error}") from error
    if not isinstance(row, dict):
        raise UsageError(f"{path}, line {number}: expected a JSON object; got {line[:60]!r}")
    return row


def _read_csv(text: str) -> list[dict[str, object]]:
    return [{key: _value(key, cell) for key, cell in row.items()} for row in csv.DictReader(io.StringIO(text))]


def _value(key: str, cell: str) -> object:
    if key in LIST_KEYS:
        return cell.split(SENTENCES) if cell else []
    if cell == "" or key in TEXT_KEYS:
        return cell or None
    if cell in ("true", "false"):
        return cell == "true"
    for number in (int, float):
        with contextlib.suppress(ValueError):
            return number(cell)
    return cell
