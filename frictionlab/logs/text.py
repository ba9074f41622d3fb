"""The bytes of a log: unpacked, decoded so that digits and line ends are ASCII, hashed, cut into blocks of whole lines.

A log may be packed by gzip or zip, or be the one sheet of numbers in an Excel workbook, whose rows become lines with
all digits of their numbers. A file's first bytes say which. Memory is bounded whatever the file's size: a block holds a
few megabytes, and what unpacks to far more than a log of its size could is refused meanwhile, with the limit.
"""

import codecs
import gzip
import hashlib
import os
import re
import warnings
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import timedelta
from io import BufferedReader
from itertools import islice
from pathlib import Path
from typing import Any

from frictionlab.errors import LogError
from frictionlab.logs.containers import refuse_by_name

Progress = Callable[[int, int], None]
"""Called with bytes read and bytes in all."""
NUMBERS = "binary"
"""The encoding of a log that is no text."""
BLOCK = 1 << 22
FREE = 1 << 26
MOST_EXPANSION = 200
"""What is packed may grow to this many times its size (text of numbers reaches 10), and always to `FREE`."""
_HEAD = 1 << 18
_LONGEST_LINE = 1 << 24
_ROWS, _WIDEST = 2000, 256
_BOMS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_WIDE = re.compile("^utf[-_]?(16|32)", re.IGNORECASE)


@dataclass(frozen=True)
class Head:
    """The beginning of a log: decoded lines without their ends, how it is written, and what it is packed in ("")."""

    path: Path
    lines: tuple[str, ...]
    encoding: str
    newline: str
    package: str
    whole: bool
    evidence: tuple[str, ...]
    state: tuple[int, int]
    """Size and time of change when it was read."""

    @property
    def text_encoding(self) -> str:
        """The encoding of the lines that `Blocks` gives."""
        return "utf-8" if self.encoding.startswith("utf") else self.encoding


class _Counted:
    """A file that counts and hashes what is read of it."""

    def __init__(self, file: BufferedReader, total: int, progress: Progress | None = None) -> None:
        self.file, self.total, self.progress = file, total, progress
        self.digest, self.done = hashlib.sha256(), 0

    def read(self, size: int = -1) -> bytes:
        chunk = self.file.read(size)
        self.digest.update(chunk)
        self.done += len(chunk)
        if self.progress is not None:
            self.progress(self.done, self.total)
        return chunk


@dataclass
class Blocks:
    """Iterate over (bytes of whole lines ending in LF, whether it is the file's last, unended line).

    After the last block ``read`` is the file's size and ``sha256`` its digest, and the file is known not to have
    changed meanwhile.
    """

    head: Head
    progress: Progress | None = None
    read: int = 0
    sha256: str = ""

    def __iter__(self) -> Iterator[tuple[bytes, bool]]:
        with _open(self.head.path) as file:
            before = os.fstat(file.fileno())
            counted = _Counted(file, before.st_size, self.progress)
            yield from _whole_lines(_decoded(counted, self.head))
            while counted.read(BLOCK):  # what a package has behind its text, or all of one that is read from both ends
                pass
            after = os.fstat(file.fileno())
        if len({_state(before), _state(after), self.head.state}) > 1 or counted.done != after.st_size:
            raise LogError(f"{self.head.path.name}: changed while it was read: wait until it is written, ingest again")
        self.read, self.sha256 = counted.done, counted.digest.hexdigest()


def _state(stat: os.stat_result) -> tuple[int, int]:
    return stat.st_size, stat.st_mtime_ns


def read_head(path: Path, encoding: str | None = None) -> Head:
    """Read and decode the first 256 kB of a log.

    Raises
    ------
    LogError
        If the file cannot be read, is empty, or is not text.
    """
    raw = bytearray()
    with _open(path) as file:
        state = _state(os.fstat(file.fileno()))
        package = _package_of(file, path.name)
        for chunk in _unpacked(_Counted(file, state[0]), package, path.name):
            raw += chunk
            if len(raw) >= _HEAD:
                break
    whole = len(raw) < _HEAD
    raw = raw[:_HEAD]
    if not raw.strip(b"\0 \t\r\n\xef\xbb\xbf\xff\xfe"):
        raise LogError(f"{path.name}: empty: expected lines of numbers; got {state[0]} bytes without any")
    name, why = (encoding, "as given") if encoding else _encoding_of(bytes(raw))
    decoder = codecs.getincrementaldecoder(name)("replace" if name == "cp1252" else "strict")
    try:
        text = decoder.decode(bytes(raw))
    except UnicodeError as error:
        raise LogError(f"{path.name}: not {name} text ({error}): give --encoding") from error
    if whole and decoder.getstate()[0]:
        text += "\ufffd"  # part of a character at the end of the file
    newline = "\r" if "\r" in text and "\n" not in text else "\n"
    lines = [line.rstrip("\r") for line in text.split(newline)]
    if not whole or not lines[-1]:
        lines.pop()
    return Head(path, tuple(lines), name, newline, package, whole, (f"encoding {name}: {why}",), state)


def texts_of(head: Head, numbers: Sequence[int]) -> dict[int, str]:
    """Fetch the texts of some lines, by their numbers from 1; cut to 300 characters."""
    found, line = dict[int, str](), 1
    for block, _ in Blocks(head) if numbers and head.encoding != NUMBERS else ():
        count = block.count(b"\n") + (not block.endswith(b"\n"))
        here = [n for n in numbers if line <= n < line + count]
        rows = block.split(b"\n") if here else []
        found |= {n: rows[n - line][:300].decode(head.text_encoding, "replace").rstrip("\r") for n in here}
        line += count
    return found


def _open(path: Path) -> BufferedReader:
    try:
        if not path.is_file():
            other = "it is a pipe or a device" if path.exists() else "no such file"
            what = "it is a folder" if path.is_dir() else other
            raise LogError(f"{path}: cannot be read ({what}): give the path of a log")
        return path.open("rb")
    except OSError as error:
        raise LogError(f"{path}: cannot be read ({error.strerror})") from error


def _encoding_of(raw: bytes) -> tuple[str, str]:
    for bom, name in _BOMS:
        if raw.startswith(bom):
            return name, "byte order mark"
    zeros = raw[0::2].count(0), raw[1::2].count(0)
    for name, (some, other) in (("utf-16-le", zeros[::-1]), ("utf-16-be", zeros)):
        if some > 0.4 * len(raw) / 2 and other < 0.05 * len(raw):
            return name, "every second byte is 0"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(raw)
    except UnicodeDecodeError as error:
        return "cp1252", f"byte {error.start} is not UTF-8"
    return "utf-8", "plain ASCII" if raw.isascii() else "decodes without a fault"


def _decoded(file: _Counted, head: Head) -> Iterator[bytes]:
    """Chunks in an encoding whose digits, separators and line ends are ASCII bytes."""
    decode = codecs.getincrementaldecoder(head.encoding)("replace").decode if _WIDE.match(head.encoding) else None
    mark = codecs.BOM_UTF8 if head.encoding == "utf-8-sig" else b""
    for chunk in _unpacked(file, head.package, head.path.name):
        text = chunk.removeprefix(mark) if decode is None else decode(chunk).encode("utf-8", "replace")
        mark = b""
        yield text.replace(b"\r", b"\n") if head.newline == "\r" else text
    if decode is not None:
        yield decode(b"", final=True).encode("utf-8", "replace")


def _whole_lines(chunks: Iterator[bytes]) -> Iterator[tuple[bytes, bool]]:
    rest = b""
    for chunk in chunks:
        cut = chunk.rfind(b"\n") + 1
        if cut:
            yield (rest + chunk[:cut] if rest else chunk[:cut]), False
            rest = chunk[cut:]
            continue
        rest += chunk
        if len(rest) > _LONGEST_LINE:
            raise LogError(f"a line longer than {_LONGEST_LINE} bytes: expected a log of lines")
    if rest:
        yield rest, True


def _package_of(file: BufferedReader, name: str) -> str:
    """Name the package of an open file, "" for plain text; a kind of file that is known and not read is refused."""
    first = file.read(1 << 12)
    found = "gzip" if first.startswith(b"\x1f\x8b") else ""
    if first.startswith(b"PK"):
        found = "xlsx" if _is_workbook(file) else "zip" if first.startswith((b"PK\x03\x04", b"PK\x05\x06")) else ""
    file.seek(0)
    if not found:
        refuse_by_name(first, name)
    return found


def _unpacked(file: _Counted, package: str, name: str) -> Iterator[bytes]:
    """The text of a log in chunks.

    Raises
    ------
    LogError
        The package is damaged, holds no single log, or unpacks to more than it may.
    """
    done, chunks = 0, {"": _plain, "gzip": _gzip, "zip": _zip, "xlsx": _workbook}[package](file)
    try:
        for chunk in chunks:
            done += len(chunk)
            if package:
                _check_expansion(done, file)
            yield chunk
    except LogError as error:
        raise LogError(f"{name}: {error}") from error
    except EOFError as error:
        raise LogError(
            f"{name}: the {package} data ends early: the file was cut; unpack what is there yourself and ingest that"
        ) from error
    except (zlib.error, zipfile.BadZipFile, OSError, RuntimeError, UnicodeDecodeError) as error:
        if not package:
            raise
        raise LogError(f"{name}: damaged {package} data near byte {file.done}: {error}") from error


def _check_expansion(done: int, file: _Counted) -> None:
    packed = file.done or file.total  # of one that is read from both ends nothing is counted yet
    if done > (most := max(FREE, MOST_EXPANSION * packed)):
        raise LogError(
            f"unpacks to more than {most / 1e6:.3g} MB after {packed} of its {file.total} bytes: accepted are "
            f"{FREE / 1e6:.3g} MB, or {MOST_EXPANSION} times what was read: expected a packed log; unpack it yourself "
            "if it is one"
        )


def _plain(file: _Counted) -> Iterator[bytes]:
    return iter(lambda: file.read(BLOCK), b"")


def _gzip(file: _Counted) -> Iterator[bytes]:
    with gzip.GzipFile(fileobj=file, mode="rb") as inside:  # type: ignore[call-overload] # it needs no more than read
        while chunk := inside.read(BLOCK):
            yield chunk


def _zip(file: _Counted) -> Iterator[bytes]:
    """Unpack the one log in a zip archive."""
    with zipfile.ZipFile(file.file) as archive:
        names = [name for name in archive.namelist() if name and not name.endswith("/")]
        names = [name for name in names if not name.startswith("__MACOSX/")]  # a Mac adds them by itself
        if len(names) != 1:
            shown = ", ".join(names[:5]) or "none"
            raise LogError(f"a zip archive of {len(names)} files ({shown}): expected one log: unpack it first")
        with archive.open(names[0]) as member:
            while chunk := member.read(1 << 16):
                yield chunk
    file.file.seek(0)


def _is_workbook(file: BufferedReader) -> bool:
    """Whether a zip archive is an Excel workbook; an OpenDocument sheet is refused by name."""
    try:
        with zipfile.ZipFile(file) as archive:
            names = archive.namelist()
            if "mimetype" in names and archive.read("mimetype").startswith(b"application/vnd.oasis"):
                raise LogError("an OpenDocument file: save it as .xlsx or .csv")
            if "xl/workbook.xml" not in names:
                return False
            packed = sum(member.compress_size for member in archive.infolist())
            large = sum(member.file_size for member in archive.infolist())
    except (zipfile.BadZipFile, OSError, EOFError, ValueError, RuntimeError):
        return False  # RuntimeError: encrypted, or packed in a way that is not known
    if large > (most := max(FREE, MOST_EXPANSION * packed)):
        raise LogError(
            f"a workbook of {packed} bytes that unpacks to {large}: accepted are {most}: save it as .csv if it is a log"
        )
    return True


def _workbook(file: _Counted) -> Iterator[bytes]:
    """Give the rows of the one sheet that holds numbers, as UTF-8 lines of tabbed cells."""
    from openpyxl import load_workbook  # noqa: PLC0415 - 0.2 s that other logs need not wait for

    file.file.seek(0)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # extensions of Excel that are of no use here
            sheet = _with_numbers(load_workbook(file.file, read_only=True, data_only=True))
            rows = sheet.iter_rows(values_only=True, max_col=min(sheet.max_column or 1, _WIDEST))
            while block := list(islice(rows, _ROWS)):
                yield "".join("\t".join(_cell_text(cell) for cell in row) + "\n" for row in block).encode()
    except (LogError, MemoryError):
        raise
    except Exception as error:
        raise LogError(
            f"a damaged Excel workbook ({type(error).__name__}: {error}): save it again, or as .csv"
        ) from error
    file.file.seek(0)


def _with_numbers(book: Any) -> Any:
    sheets = []
    for sheet in book.worksheets:
        rows = islice(sheet.iter_rows(values_only=True, max_col=_WIDEST), 200)
        if sum(any(type(cell) in (int, float) for cell in row) for row in rows) >= 2:
            sheets.append(sheet)
    if len(sheets) > 1:
        names = ", ".join(repr(sheet.title) for sheet in sheets)
        raise LogError(f"several sheets hold numbers ({names}): which is the log? Keep one, or save it as .csv")
    if not sheets:
        raise LogError("no sheet holds rows of numbers: expected a log")
    return sheets[0]


def _cell_text(cell: object) -> str:
    if cell is None:
        return ""
    return " ".join(str(cell.total_seconds() if isinstance(cell, timedelta) else cell).split())
