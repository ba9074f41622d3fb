"""What a log may be packed in: compressed text, or an Excel workbook whose rows are text; unpacked piece by piece.

Each kind is known by the first bytes of the file. Memory stays bounded: what unpacks to far more than a log of its size
could is refused while it is unpacked, with the limit. Numbers of a workbook are written
with all their digits, so that reading them back gives the same doubles; a line of the log is a row of the sheet.
"""

import gzip
import hashlib
import warnings
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import date, datetime, time, timedelta
from io import BufferedReader
from itertools import islice
from typing import TYPE_CHECKING, Any

from frictionlab.errors import LogError
from frictionlab.logs.containers import refuse_by_name

if TYPE_CHECKING:
    from openpyxl import Workbook


_MOST_BYTES = 1 << 29
"""A workbook may unpack to 100 times its size, and always to this."""
_ROWS_LOOKED_AT = 200
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
            packed, large = (
                sum(getattr(i, size) for i in archive.infolist()) for size in ("compress_size", "file_size")
            )
            if large > max(_MOST_BYTES, 100 * packed):
                raise LogError(
                    f"a workbook of {packed} bytes that unpacks to {large}: accepted are "
                    f"{max(_MOST_BYTES, 100 * packed)}: save it as .csv if it is a log"
                )
    except (zipfile.BadZipFile, OSError, EOFError, ValueError, RuntimeError):
        return False  # RuntimeError: encrypted, or packed in a way that is not known
    return True


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
    sheets = []
    for sheet in book.worksheets:
        rows = islice(sheet.iter_rows(values_only=True, max_col=_WIDEST), _ROWS_LOOKED_AT)
        if sum(any(type(cell) in (int, float) for cell in row) for row in rows) >= 2:
            sheets.append(sheet)
    names = ", ".join(repr(sheet.title) for sheet in sheets)
    if len(sheets) > 1:
        raise LogError(f"several sheets hold numbers ({names}): which is the log? Keep one, or save it as .csv")
    if not sheets:
        raise LogError("no sheet holds rows of numbers: expected a log")
    return sheets[0]


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


BLOCK = 1 << 22
MOST_EXPANSION = 200
"""Packed text may grow to this many times what was read of it (text of numbers reaches 10), and always to `FREE`."""
FREE = 1 << 26
_LOOK_AT = 1 << 12
_DAMAGED = (zlib.error, zipfile.BadZipFile, OSError, RuntimeError, UnicodeDecodeError)
"""RuntimeError is a zip archive's that is encrypted, or packed in a way that is not known."""


Progress = Callable[[int, int], None]
"""Called with bytes read and bytes in all."""


class Counted:
    """A file that counts and hashes what is read of it."""

    def __init__(self, file: BufferedReader, total: int, progress: Progress | None) -> None:
        self.file, self.total, self.progress = file, total, progress
        self.digest = hashlib.sha256()
        self.done = 0

    def read(self, size: int = -1) -> bytes:
        """Read and count."""
        chunk = self.file.read(size)
        self.digest.update(chunk)
        self.done += len(chunk)
        if self.progress is not None:
            self.progress(self.done, self.total)
        return chunk


def package_of(file: BufferedReader, name: str) -> str:
    """Name the package of an open file, "" for plain text; the file stands at its start before and after.

    Raises
    ------
    LogError
        A kind of file that is known and not read: it is named.
    """
    first = file.read(_LOOK_AT)
    if first.startswith(b"\x1f\x8b"):
        found = "gzip"
    elif first.startswith(b"PK") and is_workbook(file):
        found = "xlsx"
    else:
        found = "zip" if first.startswith((b"PK\x03\x04", b"PK\x05\x06")) else ""
    file.seek(0)
    if not found:
        refuse_by_name(first, name)
    return found


def unpacked(package: str, file: Counted) -> Iterator[bytes]:
    """Give the text in a file of this package, a block at a time.

    Raises
    ------
    LogError
        The file is damaged, holds no single log, or unpacks to more than it may.
    """
    done = 0
    try:
        for chunk in {"gzip": _gzip, "zip": _zip, "xlsx": _workbook}[package](file):
            done += len(chunk)
            most = max(FREE, MOST_EXPANSION * file.done)
            if done > most:
                raise LogError(
                    f"unpacks to more than {most / 1e6:.3g} MB after {file.done} of its {file.total} bytes: accepted "
                    f"are {FREE / 1e6:.3g} MB, or {MOST_EXPANSION} times what was read: expected a packed log; unpack "
                    "it yourself if it is one"
                )
            yield chunk
    except EOFError as error:
        raise LogError(
            f"the {package} data ends early: the file was cut; unpack what is there yourself and ingest that"
        ) from error
    except _DAMAGED as error:
        if isinstance(error, LogError):
            raise
        raise LogError(f"damaged {package} data near byte {file.done}: {error}") from error


def _gzip(file: Counted) -> Iterator[bytes]:
    with gzip.GzipFile(fileobj=file, mode="rb") as inside:  # type: ignore[call-overload] # it needs no more than read
        while chunk := inside.read(BLOCK):
            yield chunk


def _zip(file: Counted) -> Iterator[bytes]:
    """Unpack the one log in a zip archive."""
    with zipfile.ZipFile(file.file) as archive:
        names = [name for name in archive.namelist() if name and not name.endswith("/")]
        names = [name for name in names if not name.startswith("__MACOSX/")]  # a Mac adds them by itself
        if len(names) != 1:
            shown = ", ".join(names[:5]) or "none"
            raise LogError(f"a zip archive of {len(names)} files ({shown}): expected one log: unpack it first")
        packed = archive.getinfo(names[0]).compress_size
        with archive.open(names[0]) as member:
            while chunk := member.read(1 << 16):
                file.done = min(packed, file.file.tell())
                yield chunk
    _rewind(file)


def _workbook(file: Counted) -> Iterator[bytes]:
    """Give the rows of a spreadsheet as lines of tabbed text."""
    file.done = file.total  # it is read from both ends
    yield from rows_as_text(file.file)
    _rewind(file)


def _rewind(file: Counted) -> None:
    """Let the file be read from its start, so that its size is counted as that of any other."""
    file.file.seek(0)
    file.done = 0
