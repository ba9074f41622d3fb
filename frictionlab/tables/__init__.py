"""Rows of results in files: CSV, JSON Lines, Excel and HDF5, whole or not at all, read back as written.

A row is a mapping from the schema's names to values. Not-known is ``null`` in JSON and an empty cell elsewhere (NaN in
HDF5's numbers); NaN and infinity appear in no text. What a column is says `frictionlab.schema`.

A file is of this tool's own kind if it begins as every file of that kind does: the first columns of the kind's schema,
all of them and in order (of JSON Lines the keys of the first row that did not fail), or in HDF5 the attribute
``format``. One column's name alone is no mark: neither a sheet with a ``log`` nor a raw log with a ``source`` is ours.
"""

import csv
import os
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain, islice
from os import PathLike
from pathlib import Path

from frictionlab.errors import UsageError
from frictionlab.files import make_folder, refuse_inputs, refuse_unwritable, write_whole
from frictionlab.schema import OUTCOME, TABLES, Table, is_marked, table_of
from frictionlab.tables import texts
from frictionlab.tables.texts import Row, encodable, json_line, plain

__all__ = ["SUFFIXES", "Row", "check_output", "has_rows", "is_table", "json_line", "plain", "read_rows", "write_rows"]

SUFFIXES = (".csv", ".jsonl", ".h5", ".xlsx")
EITHER = ".csv, .jsonl, .h5 or .xlsx"
SHEET_ROWS = (1 << 20) - 1  # of a spreadsheet, beside its head


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
        CSV and JSON Lines are written as they come; the others hold all rows first.
    path : Path
        ``.csv``, ``.jsonl``, ``.h5`` or ``.xlsx``.
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
    from frictionlab.tables import frames

    if _kind(path) == ".xlsx":
        write_whole(path, frames.excel_bytes(rows, names))
        return
    if table is None:
        raise UsageError(f"{path}: HDF5 says what its rows are: expected the table they belong to; got none")
    from frictionlab.hdf5 import write_tree

    every = list(rows)
    tree = {frames.ROWS: {n: frames.array_of(n, every, table) for n in names}, frames.SERIES: dict(series or {})}
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


def check_output(
    path: Path,
    table: Table | None = None,
    *,
    force: bool = False,
    inputs: Iterable[Path] = (),
    rows: int = 0,
) -> None:
    """Refuse an output that could not be written, before the long work.

    Parameters as in `write_rows`; ``rows``: how many there will be, where that is known.

    Raises
    ------
    UsageError
        Another suffix, no folder can be made there, or a file of another kind or an input stands there.
    """
    if _kind(path) not in SUFFIXES:
        raise UsageError(f"{path}: expected an output ending in {EITHER}; got {path.suffix or 'no suffix'}")
    if _kind(path) == ".xlsx" and rows > SHEET_ROWS:
        raise UsageError(f"{path}: a spreadsheet holds {SHEET_ROWS} rows, not {rows}: write .csv")
    if path.is_dir():
        raise UsageError(f"{path}: is a folder: give the name of a file in it")
    refuse_inputs([path], inputs)
    if os.path.lexists(path) and not (force or is_table(path, table)):
        what = f"table of {table.kind} of frictionlab" if table else "table of frictionlab"
        raise UsageError(f"{path}: exists and is no {what}: choose another output, or give --force")
    refuse_unwritable(path, force=force)


def is_table(path: Path, table: Table | None = None) -> bool:
    """Whether this file is of this kind (without one: of any kind of this tool), by its mark; an empty one is."""
    kinds = TABLES if table is None else (table,)
    try:
        if not path.is_file() or path.stat().st_size == 0:
            return path.is_file()
        if _kind(path) == ".h5":
            return _format_of(path) in {kind.format for kind in kinds}
        if _kind(path) == ".xlsx":
            from frictionlab.tables import frames

            names = frames.names_in_excel(path)
        else:
            names = texts.names_in_csv(path) if _kind(path) == ".csv" else texts.names_in_json(path)
    except (OSError, ValueError, KeyError, RecursionError, csv.Error):
        return False
    if names == OUTCOME:
        return True
    nearest = table_of(names)  # a map begins as a single state does: the kind with most of the columns counts
    return any(is_marked(names, kind) and (table is None or nearest is kind) for kind in kinds)


def has_rows(path: Path) -> bool:
    """Whether this HDF5 file is a table of this tool, with a line for each row."""
    from frictionlab.tables import frames

    found = _format_of(path)
    return any(kind.format == found for kind in TABLES if kind not in frames.WITHOUT_ROWS)


def _format_of(path: Path) -> str:
    from frictionlab.hdf5 import format_of

    return format_of(path)


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
        from frictionlab.hdf5 import read_tree
        from frictionlab.tables import frames

        found = _format_of(path)
        kind = table or next((kind for kind in TABLES if kind.format == found), None)
        if kind is None:
            raise UsageError(f"{path}: expected a table of frictionlab; got {found or 'another file'}")
        return list(frames.rows_of(read_tree(path, kind=kind.format), path, kind))
    try:
        if _kind(path) == ".xlsx":
            from frictionlab.tables import frames

            return list(frames.read_excel(path, table))
        return list((texts.read_csv if _kind(path) == ".csv" else texts.read_json_lines)(path, table))
    except OSError as error:
        raise UsageError(f"{path}: cannot be read ({error.strerror}): give the path of an existing result") from error
