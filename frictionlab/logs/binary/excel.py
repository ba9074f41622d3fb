"""Excel workbooks (.xlsx) as text: the rows of the one sheet with numbers, cells parted by TAB.

Numbers are written with all their digits, so that reading them back gives the same doubles; the text then goes the way
of every other log, with its header, units, preamble and odd lines. A line of the log is a row of the sheet.
"""

import warnings
import zipfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import date, datetime, time, timedelta
from io import BufferedReader
from itertools import islice
from typing import TYPE_CHECKING, Any

from frictionlab.errors import LogError

if TYPE_CHECKING:
    from openpyxl import Workbook

_MOST_BYTES = 1 << 29
"""A workbook may unpack to 100 times its size, and always to this."""
_LOOK_AT = 200
_WIDEST = 256
_ROWS = 2000


def is_workbook(file: BufferedReader) -> bool:
    """Whether a zip archive is an Excel workbook; an OpenDocument sheet is refused by name."""
    try:
        with zipfile.ZipFile(file) as archive:
            names = archive.namelist()
            if "mimetype" in names and archive.read("mimetype").startswith(b"application/vnd.oasis"):
                raise LogError("an OpenDocument file: save it as .xlsx or .csv")
            if "xl/workbook.xml" not in names:
                return False
            _check_size(archive)
    except (zipfile.BadZipFile, OSError, EOFError, ValueError, RuntimeError):
        return False  # RuntimeError: encrypted, or packed in a way that is not known
    return True


def _check_size(archive: zipfile.ZipFile) -> None:
    packed = sum(i.compress_size for i in archive.infolist())
    large = sum(i.file_size for i in archive.infolist())
    if large > max(_MOST_BYTES, 100 * packed):
        raise LogError(
            f"a workbook of {packed} bytes that unpacks to {large}: accepted are {max(_MOST_BYTES, 100 * packed)}: "
            "save it as .csv if it is a log"
        )


def rows_as_text(file: BufferedReader) -> Iterator[bytes]:
    """Give the rows of the one sheet that holds numbers, as UTF-8 lines of tabbed cells.

    Raises
    ------
    LogError
        Damaged, or no sheet or several with numbers.
    """
    with _opened(file) as book:
        sheet = _with_numbers(book)
        width = min(sheet.max_column or 1, _WIDEST)
        rows = sheet.iter_rows(values_only=True, max_col=width)
        while block := list(islice(rows, _ROWS)):
            yield "".join("\t".join(_text(cell) for cell in row) + "\n" for row in block).encode()


@contextmanager
def _opened(file: BufferedReader) -> "Iterator[Workbook]":
    from openpyxl import load_workbook  # noqa: PLC0415 - 0.2 s that other logs need not wait for

    file.seek(0)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # extensions of Excel that are of no use here
            yield load_workbook(file, read_only=True, data_only=True)
    except (LogError, MemoryError):
        raise
    except Exception as error:
        raise LogError(
            f"a damaged Excel workbook ({type(error).__name__}: {error}): save it again, or as .csv"
        ) from error


def _with_numbers(book: "Workbook") -> Any:
    sheets = [sheet for sheet in book.worksheets if _has_numbers(sheet)]
    names = ", ".join(repr(sheet.title) for sheet in sheets)
    if len(sheets) > 1:
        raise LogError(f"several sheets hold numbers ({names}): which is the log? Keep one, or save it as .csv")
    if not sheets:
        raise LogError("no sheet holds rows of numbers: expected a log")
    return sheets[0]


def _has_numbers(sheet: Any) -> bool:
    rows = islice(sheet.iter_rows(values_only=True, max_col=_WIDEST), _LOOK_AT)
    return sum(_numbers(row) > 0 for row in rows) >= 2


def _numbers(row: Sequence[object]) -> int:
    return sum(isinstance(cell, (int, float)) and not isinstance(cell, bool) for cell in row)


def _text(cell: object) -> str:
    if cell is None:
        return ""
    if isinstance(cell, datetime):
        return cell.isoformat(sep=" ", timespec="microseconds")
    if isinstance(cell, time):
        return cell.isoformat(timespec="microseconds")
    if isinstance(cell, date):
        return cell.isoformat()
    if isinstance(cell, timedelta):
        return repr(cell.total_seconds())
    if isinstance(cell, float):
        return repr(cell)
    return " ".join(str(cell).split())
