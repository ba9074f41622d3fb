"""Rows in Excel and Parquet files, by pandas."""

import io
import re
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionlab.errors import UsageError
from frictionlab.schema import Table, Type, column_of, table_of
from frictionlab.tables import SHEET_ROWS
from frictionlab.tables.cells import CellError, checked, flat, harmless, unquoted
from frictionlab.tables.row import Row

if TYPE_CHECKING:
    import pandas as pd

MOST_BYTES = 1 << 30  # unpacked, of a spreadsheet that is read
LONGEST_CELL = 32_767  # characters that Excel holds
_DTYPES = {Type.NUMBER: "Float64", Type.WHOLE: "Int64", Type.YES_NO: "boolean"}
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the date on everything in a spreadsheet: the same rows give the same bytes


def parquet_bytes(rows: Iterable[Row], names: Sequence[str], table: Table | None) -> bytes:
    """A Parquet file of these rows, each column of its own type."""
    import pandas as pd

    told = [{name: flat(row.get(name)) for name in names} for row in rows]
    columns = {name: _series([row[name] for row in told], _dtype(name, table)) for name in names}
    file = io.BytesIO()
    pd.DataFrame(columns).to_parquet(file, index=False)
    return file.getvalue()


def _dtype(name: str, table: Table | None) -> str | None:
    column = column_of(name, table)
    return None if column is None else _DTYPES.get(column.type, "string")


def _series(values: Sequence[object], dtype: str | None) -> "pd.Series[Any]":
    import pandas as pd

    known = [value for value in values if value is not None]
    if dtype is None:  # the user's own: numbers if all are, else text
        dtype = "Float64" if known and not any(isinstance(value, (str, bool)) for value in known) else "string"
    if dtype == "string":
        values = [None if value is None else str(value) for value in values]
    return pd.Series(list(values), dtype=dtype)


def excel_bytes(rows: Iterable[Row], names: Sequence[str]) -> bytes:
    """An Excel file with one sheet of these rows.

    Raises
    ------
    UsageError
        There are more rows than a sheet holds.
    """
    import openpyxl

    book = openpyxl.Workbook(write_only=True)
    book.properties.created = book.properties.modified = datetime(*_EPOCH)  # noqa: DTZ001 (a fixed date, no moment)
    sheet = book.create_sheet("frictionlab")
    sheet.append([_excel_cell(name) for name in names])
    for number, row in enumerate(rows):
        if number >= SHEET_ROWS:
            raise UsageError(f"expected at most {SHEET_ROWS} rows in a spreadsheet; got more: write .csv or .parquet")
        sheet.append([_excel_cell(row.get(name)) for name in names])
    file = io.BytesIO()
    book.save(file)
    return _dated(file)


def _excel_cell(value: object) -> bool | int | float | str | None:
    single = flat(value)
    if isinstance(single, int) and not isinstance(single, bool) and abs(single) > 1 << 53:
        return str(single)
    return _storable(single)[:LONGEST_CELL] if isinstance(single, str) else single


def _storable(words: str) -> str:
    r"""A text without what XML cannot hold: control characters are written as ``\x07``."""
    kept = (c if c >= " " or c in "\t\n\r" else c.encode("unicode_escape").decode() for c in harmless(words))
    return "".join(c if c not in "￾￿" else "�" for c in kept)


def _dated(book: io.BytesIO) -> bytes:
    """The same spreadsheet with one date on all of its parts."""
    made = io.BytesIO()
    with zipfile.ZipFile(book) as old, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "docProps/core.xml":
                data = _without_dates(data)
            new.writestr(zipfile.ZipInfo(name, _EPOCH), data, zipfile.ZIP_DEFLATED)
    return made.getvalue()


def _without_dates(core: bytes) -> bytes:
    return re.sub(rb"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", b"1980-01-01T00:00:00Z", core)


def read_excel(path: Path, table: Table | None) -> Iterator[dict[str, object]]:
    """The rows of the first sheet of an Excel file.

    Raises
    ------
    UsageError
        The file is none, or damaged, or a cell is not what its column says.
    """
    return _rows_of(path, _excel_frame, table, quoted=True)


def read_parquet(path: Path, table: Table | None) -> Iterator[dict[str, object]]:
    """The rows of a Parquet file.

    Raises
    ------
    UsageError
        The file is none, or damaged, or a cell is not what its column says.
    """
    return _rows_of(path, _parquet_frame, table, quoted=False)


def _excel_frame(path: Path, rows: int | None = None) -> "pd.DataFrame":
    import pandas as pd

    with zipfile.ZipFile(path) as parts:
        size = sum(part.file_size for part in parts.infolist())
    if size > MOST_BYTES:
        raise ValueError(f"claims {size} bytes unpacked")
    return pd.read_excel(path, dtype=object, nrows=rows, keep_default_na=False, na_values=[""], engine="openpyxl")


def _parquet_frame(path: Path, rows: int | None = None) -> "pd.DataFrame":
    import pandas as pd
    from pyarrow import parquet

    if rows == 0:
        return pd.DataFrame(columns=parquet.read_schema(path).names)
    return pd.read_parquet(path)


def _rows_of(
    path: Path, frame_of: "Callable[[Path], pd.DataFrame]", table: Table | None, *, quoted: bool
) -> Iterator[dict[str, object]]:
    with _told(path):
        frame = frame_of(path)
        names = [unquoted(str(name)) if quoted else str(name) for name in frame.columns]
        cells = frame.astype(object).where(frame.notna(), None).to_numpy()
    kind = table or table_of(names)
    for number, line in enumerate(cells.tolist(), 2):
        try:
            pairs = zip(names, line, strict=True)
            yield {name: _value(cell, name, kind, quoted=quoted) for name, cell in pairs}
        except CellError as error:
            raise UsageError(f"{path}, row {number}: {error}: correct it, or make the file again") from error


@contextmanager
def _told(path: Path) -> Iterator[None]:
    """Tell whatever openpyxl and pyarrow raise of a damaged file, which no list of exceptions holds, as its fault."""
    try:
        yield
    except Exception as error:
        raise UsageError(f"{path}: expected a table as {path.suffix}; cannot be read ({_first(error)})") from error


def _first(error: BaseException) -> str:
    return str(error).partition("\n")[0][:200] or type(error).__name__


def _value(cell: object, name: str, table: Table | None, *, quoted: bool) -> object:
    value = unquoted(cell) if quoted and isinstance(cell, str) else cell
    known = value if isinstance(value, (bool, int, float, str, list)) or value is None else str(value)
    return checked(known, column_of(name, table))


def names_in_excel(path: Path) -> tuple[str, ...]:
    """The names in the head of a spreadsheet; none of a file that is none."""
    return _names(path, _excel_frame)


def names_in_parquet(path: Path) -> tuple[str, ...]:
    """The names of a Parquet file's columns; none of a file that is none."""
    return _names(path, _parquet_frame)


def _names(path: Path, frame_of: "Callable[..., pd.DataFrame]") -> tuple[str, ...]:
    try:
        with _told(path):
            return tuple(unquoted(str(name)) for name in frame_of(path, 0).columns)
    except UsageError:
        return ()
