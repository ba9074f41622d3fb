"""Rows of results in files: CSV, JSON Lines and HDF5, whole or not at all, read back as written.

A row is a mapping from the schema's names to values. Not-known is ``null`` in JSON and an empty cell elsewhere (NaN in
HDF5's numbers); NaN and infinity appear in no text. What a column is says `frictionlab.schema`.

A file is of this tool's own kind if it begins as every file of that kind does: the first columns of the kind's schema,
all of them and in order (of JSON Lines the keys of the first row that did not fail), or in HDF5 the attribute
``format``. One column's name alone is no mark: neither a sheet with a ``log`` nor a raw log with a ``source`` is ours.

In HDF5 ``/rows`` holds an array per column, and ``/cycles/N`` the series behind row N.
"""

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, islice
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from frictionlab.errors import RecordingError, UsageError
from frictionlab.files import make_folder, refuse_outputs, write_whole
from frictionlab.schema import MOTIONS, OUTCOME, STEADY_STATES, TABLES, Table, Type, column_of, is_marked, table_of
from frictionlab.tables import texts
from frictionlab.tables.texts import CellError, checked, encodable, flat
from frictionlab.tables.texts import Row as Row
from frictionlab.tables.texts import json_line as json_line
from frictionlab.tables.texts import plain as plain

SUFFIXES = (".csv", ".jsonl", ".h5")
EITHER = ".csv, .jsonl or .h5 (a spreadsheet program opens .csv)"
ROWS, SERIES = "rows", "cycles"  # groups in HDF5


def write_rows(
    rows: Iterable[Row],
    path: Path,
    table: Table | None = None,
    *,
    force: bool = False,
    inputs: Iterable[Path] = (),
    series: Mapping[str, object] | None = None,
) -> None:
    """Write rows to a file, whole or not at all; its suffix says how. A missing folder is made.

    Parameters
    ----------
    rows : iterable of mappings
        CSV and JSON Lines are written as they come; HDF5 holds all rows first.
    path : Path
        ``.csv``, ``.jsonl`` or ``.h5``.
    table : Table, optional
        What the rows are: all its columns are written, then what else the rows hold. Without it the rows' own keys.
    force : bool
        Replace whatever file stands there; else only a table of the same kind.
    inputs : iterable of Path
        What was read: it is never replaced.
    series : mapping, optional
        What stands behind the rows, by the number of the row; only HDF5 holds it.

    Raises
    ------
    UsageError
        Another suffix, or a file of another kind or an input stands there.
    OutputError
        The file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "new" / "rows.csv"
    >>> write_rows([{"source": "a.h5", "cycles": 3, "warnings": ["short"]}], path)
    >>> read_rows(path)
    [{'source': 'a.h5', 'cycles': 3, 'warnings': ['short']}]
    """
    check_output(path, table, force=force, inputs=inputs)
    make_folder(path.parent)
    if _kind(path) == ".jsonl":
        write_whole(path, texts.in_pieces(json_line(row) + "\n" for row in rows))
        return
    names, rows = _columns(rows, table)
    if _kind(path) == ".csv":
        write_whole(path, texts.in_pieces(texts.csv_lines(rows, names)))
        return
    if table is None:
        raise UsageError(f"{path}: HDF5 says what its rows are: expected the table they belong to; got none")
    from frictionlab.hdf5 import write_tree

    every = list(rows)
    tree = {ROWS: {name: _array_of(name, every, table) for name in names}, SERIES: dict(series or {})}
    write_tree(tree, path, kind=table.format, force=force, columns=table.column)


def _columns(rows: Iterable[Row], table: Table | None) -> tuple[list[str], Iterable[Row]]:
    """The names of all columns; of rows that come one by one and of a known table, the first row says the last."""
    known = () if table is None else table.names
    if isinstance(rows, Sequence) or table is None:
        rows = list(rows)
        return list(dict.fromkeys(map(encodable, chain(known, *rows)))), rows
    coming = iter(rows)
    first = list(islice(coming, 1))
    return list(dict.fromkeys(map(encodable, chain(known, *first)))), chain(first, coming)


def _kind(path: Path) -> str:
    return path.suffix.lower()


def check_output(path: Path, table: Table | None = None, *, force: bool = False, inputs: Iterable[Path] = ()) -> None:
    """Refuse an output that could not be written, before the long work.

    Parameters as in `write_rows`.

    Raises
    ------
    UsageError
        Another suffix, no folder can be made there, or a file of another kind or an input stands there.
    """
    if _kind(path) not in SUFFIXES:
        raise UsageError(f"{path}: expected an output ending in {EITHER}; got {path.suffix or 'no suffix'}")
    if path.is_dir():
        raise UsageError(f"{path}: is a folder: give the name of a file in it")
    what = f"table of {table.kind} of frictionlab" if table else "table of frictionlab"
    refuse_outputs([path], partial(is_table, table=table), what, force=force, inputs=inputs)


def is_table(path: Path, table: Table | None = None) -> bool:
    """Whether this file is of this kind (without one: of any kind of this tool), by its mark; an empty one is."""
    kinds = TABLES if table is None else (table,)
    try:
        if not path.is_file() or path.stat().st_size == 0:
            return path.is_file()
        if _kind(path) == ".h5":
            from frictionlab.hdf5 import format_of

            return format_of(path) in {kind.format for kind in kinds}
        names = texts.names_in(path)
    except (OSError, ValueError, TypeError, RecursionError, csv.Error):
        return False
    if names == OUTCOME:
        return True
    nearest = table_of(names)  # a map begins as a single state does: the kind with most of the columns counts
    return any(is_marked(names, kind) and (table is None or nearest is kind) for kind in kinds)


def has_rows(path: Path) -> bool:
    """Whether this HDF5 file is a table of this tool, with a line for each row: no map over axes, and no motion."""
    from frictionlab.hdf5 import format_of

    found = format_of(path)
    return any(kind.format == found for kind in TABLES if kind not in (STEADY_STATES, MOTIONS))


def read_rows(path: str | PathLike[str], table: Table | None = None) -> list[dict[str, object]]:
    """Read the rows of a file as :func:`write_rows` wrote them, columns added or moved by hand included.

    Raises
    ------
    UsageError
        The file is not there or is of another kind, or a line of it is damaged; the message names it.
    RecordingError
        An HDF5 file that holds no rows, or is damaged.
    """
    path = Path(path)
    if not path.is_file():
        raise UsageError(f"{path}: cannot be read (no such file): give the path of an existing result")
    if _kind(path) not in SUFFIXES:
        raise UsageError(f"{path}: expected a result ending in {EITHER}; got {path.suffix or 'no suffix'}")
    if _kind(path) == ".h5":
        from frictionlab.hdf5 import format_of, read_tree

        found = format_of(path)
        kind = table or next((kind for kind in TABLES if kind.format == found), None)
        if kind is None:
            raise UsageError(f"{path}: expected a table of frictionlab; got {found or 'another file'}")
        return list(rows_of(read_tree(path, kind=kind.format), path, kind))
    try:
        read = texts.read_csv if _kind(path) == ".csv" else texts.read_json_lines
        return list(read(path, table))
    except OSError as error:
        raise UsageError(f"{path}: cannot be read ({error.strerror}): give the path of an existing result") from error


def _array_of(name: str, rows: Sequence[Row], table: Table) -> object:
    """A column as HDF5 holds it: texts (empty: not known), or floats (NaN: not known)."""
    column, cells = column_of(name, table), [flat(row.get(name)) for row in rows]
    if column is not None:
        is_text = column.type in (Type.TEXT, Type.SENTENCES, Type.OBJECT)
    else:
        is_text = any(isinstance(cell, str) for cell in cells) or all(cell is None for cell in cells)
    if is_text:
        return ["" if cell is None else str(cell) for cell in cells]
    return np.array([float("nan") if cell is None else float(cell) for cell in cells])


def rows_of(tree: Mapping[str, Any], path: Path, table: Table) -> Iterator[dict[str, object]]:
    """The rows of a file's tree; `RecordingError` where there are none, or a cell is not what its column says."""
    if ROWS not in tree:
        raise RecordingError(f"{path}: expected a table with rows; got a {table.kind}: open it with `frictionlab show`")
    columns = tree[ROWS]
    if not isinstance(columns, Mapping) or any(np.ndim(values) != 1 for values in columns.values()):
        raise RecordingError(f"{path}: damaged {table.format}: expected a group of columns under {ROWS!r}")
    lengths = {len(values) for values in columns.values()}
    if len(lengths) > 1:
        raise RecordingError(f"{path}: damaged {table.format}: columns of {min(lengths)} and of {max(lengths)} rows")
    for number, line in enumerate(zip(*columns.values(), strict=True), 1):
        row: dict[str, object] = {}
        for name, cell in zip(columns, line, strict=True):
            column = column_of(name, table)
            value = cell.item() if hasattr(cell, "item") else cell
            if column is not None and column.type is Type.WHOLE and isinstance(value, float) and value.is_integer():
                value = int(value)
            try:
                row[name] = checked(None if value == "" else value, column)
            except CellError as error:
                raise RecordingError(f"{path}, row {number}: {error}: make it again") from error
        yield row
