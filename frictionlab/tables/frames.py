"""Rows in Excel files, by pandas, and in HDF5: ``/rows`` holds an array per column.

``/cycles/N`` of an HDF5 file holds the series behind row N.
"""

import io
import re
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionlab.errors import RecordingError, UsageError
from frictionlab.schema import MOTIONS, STEADY_STATES, Table, Type, column_of, table_of
from frictionlab.tables import SHEET_ROWS
from frictionlab.tables.texts import CellError, Row, checked, fitting, flat, harmless, unquoted

if TYPE_CHECKING:
    import pandas as pd

ROWS, SERIES = "rows", "cycles"
WITHOUT_ROWS = (STEADY_STATES, MOTIONS)
"""Tables whose HDF5 files hold no rows but a map over its axes, or a motion."""
MOST_BYTES = 1 << 30  # unpacked, of a spreadsheet that is read
LONGEST_CELL = 32_767  # characters that Excel holds
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the date on everything in a spreadsheet: the same rows give the same bytes


def excel_bytes(rows: Iterable[Row], names: Sequence[str]) -> bytes:
    """An Excel file with one sheet of these rows; `UsageError` where there are more than it holds."""
    import openpyxl

    lines = [[_excel_cell(row.get(name)) for name in names] for row in islice(rows, SHEET_ROWS + 1)]
    if len(lines) > SHEET_ROWS:
        raise UsageError(f"expected at most {SHEET_ROWS} rows in a spreadsheet; got more: write .csv")
    book = openpyxl.Workbook(write_only=True)
    book.properties.created = book.properties.modified = datetime(*_EPOCH)  # noqa: DTZ001 (a fixed date, no moment)
    sheet = book.create_sheet("frictionlab")
    sheet.append([_excel_cell(name) for name in names])
    for line in lines:
        sheet.append(line)
    file, dated = io.BytesIO(), io.BytesIO()
    book.save(file)
    with zipfile.ZipFile(file) as old, zipfile.ZipFile(dated, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "docProps/core.xml":
                data = re.sub(rb"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", b"1980-01-01T00:00:00Z", data)
            new.writestr(zipfile.ZipInfo(name, _EPOCH), data, zipfile.ZIP_DEFLATED)
    return dated.getvalue()


def _excel_cell(value: object) -> bool | int | float | str | None:
    single = flat(value)
    if isinstance(single, int) and not isinstance(single, bool) and abs(single) > 1 << 53:
        return str(single)
    single = harmless(single) if isinstance(single, str) else single
    if isinstance(single, str) and len(single) > LONGEST_CELL:
        raise UsageError(f"expected at most {LONGEST_CELL} characters in a spreadsheet's cell; got more: write .csv")
    return single


def read_excel(path: Path, table: Table | None) -> Iterator[dict[str, object]]:
    """The rows of the first sheet of an Excel file; `UsageError` where it, or a cell, is none."""
    frame = _frame_of(path)
    names = [unquoted(str(name)) for name in frame.columns]
    kind = table or table_of(names)
    columns = [column_of(name, kind) for name in names]
    for number, line in enumerate(frame.astype(object).where(frame.notna(), None).to_numpy().tolist(), 2):
        cells = (unquoted(cell) if isinstance(cell, str) else cell for cell in line)
        known = (c if c is None or isinstance(c, (bool, int, float)) else str(c) for c in cells)  # a date is text
        yield fitting(zip(names, known, columns, strict=True), checked, f"{path}, row {number}")


def names_in_excel(path: Path) -> tuple[str, ...]:
    """The names of the columns of an Excel file; none of a file that is none."""
    try:
        return tuple(unquoted(str(name)) for name in _frame_of(path, 0).columns)
    except UsageError:
        return ()


def _frame_of(path: Path, rows: int | None = None) -> "pd.DataFrame":
    """The first sheet; whatever openpyxl raises of a damaged file, which no list of exceptions holds, is its fault."""
    import pandas as pd

    try:
        with zipfile.ZipFile(path) as parts:
            size = sum(part.file_size for part in parts.infolist())
        most = rows if size <= MOST_BYTES else 0
        frame = pd.read_excel(path, dtype=object, nrows=most, keep_default_na=False, na_values=[""], engine="openpyxl")
    except Exception as error:
        said = str(error).partition("\n")[0][:200] or type(error).__name__
        raise UsageError(f"{path}: expected a table as .xlsx; cannot be read ({said})") from error
    if size > MOST_BYTES:
        raise UsageError(f"{path}: expected a table as .xlsx; cannot be read (claims {size} bytes unpacked)")
    return frame


def array_of(name: str, rows: Sequence[Row], table: Table) -> object:
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
