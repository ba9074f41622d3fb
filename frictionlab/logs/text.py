"""The text of a log: read once, unpacked, decoded so that digits and line ends are ASCII, hashed.

A log may be packed by gzip or zip, or be the one sheet of numbers in an Excel workbook, whose rows become lines with
all digits of their numbers. A file's first bytes say which. What unpacks to far more than a log of its size could is
refused with the limit.
"""

import codecs
import hashlib
import io
import os
import re
import warnings
import zipfile
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import timedelta
from gzip import GzipFile
from itertools import islice
from pathlib import Path, PurePath
from typing import Any

import numpy as np

from frictionlab.errors import LogError

FREE, MOST_EXPANSION = 1 << 26, 50
"""What is packed may grow to so many bytes, or to this many times its size (text of numbers reaches 10)."""
_BLOCK = 1 << 22
_HEAD = 1 << 18
_LONGEST_LINE = 1 << 24
_WIDEST = 256  # columns of a workbook
_PACKED = {"gzip": (b"\x1f\x8b",), "zip": (b"PK\x03\x04", b"PK\x05\x06")}
_BOMS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_NO_TEXT = bytes({*range(1, 32), 127} - set(b"\t\n\v\f\r\x1b"))  # a logger that lost power leaves zeros
MOST_SIGNS = 0.05  # share of such bytes in a text; of random bytes it is a tenth
_WIDE = re.compile("^utf[-_]?(16|32)", re.IGNORECASE)


@dataclass
class Text:
    """The text of a log, of a file of ``size`` bytes with this digest.

    ``content``: its lines, ending in LF, in an encoding whose digits and separators are ASCII bytes; ``lines``: the
    first 256 kB of them, decoded, without their ends; ``whole``: whether those are all; ``package``: what it is packed
    in, or "".
    """

    size: int
    sha256: str
    content: bytes
    lines: tuple[str, ...]
    whole: bool
    encoding: str
    package: str
    evidence: tuple[str, ...]

    @property
    def content_encoding(self) -> str:
        """The encoding of ``content``."""
        return "utf-8" if self.encoding.startswith("utf") else self.encoding

    def blocks(self, skip: int) -> Iterator[bytes]:
        """Some megabytes of whole lines each, from the line of this index on; the last line may be unended."""
        start, size = 0, len(self.content)
        for _ in range(skip):
            start = self.content.find(b"\n", start) + 1 or size
        while start < size:
            stop = self.content.rfind(b"\n", start, start + _BLOCK) + 1
            stop = stop or self.content.find(b"\n", start + _BLOCK) + 1 or size
            if stop - start > _LONGEST_LINE:
                raise LogError(f"a line longer than {_LONGEST_LINE} bytes: expected a log of lines")
            yield self.content[start:stop]
            start = stop

    def texts_of(self, numbers: Sequence[int], longest: int) -> dict[int, str]:
        """The texts of some lines, by their numbers from 1; cut to so many bytes."""
        ends = np.flatnonzero(np.frombuffer(self.content, np.uint8) == ord("\n"))
        starts = {n: int(ends[n - 2]) + 1 if n > 1 else 0 for n in numbers}
        cut = {n: self.content[at : at + longest].partition(b"\n")[0] for n, at in starts.items()}
        return {n: line.decode(self.content_encoding, "replace").rstrip("\r") for n, line in cut.items()}


def read_text(path: Path, encoding: str | None = None) -> Text:
    """Read a log; refused if it is empty, is not text, or changes meanwhile."""
    raw = _read(path)
    package, unpacked = _unpacked(raw, path.name)
    size, sha256 = len(raw), hashlib.sha256(raw).hexdigest()
    del raw  # of a packed log both would be in memory
    head = unpacked[:_HEAD]
    if not head.strip(b"\0 \t\r\n\xef\xbb\xbf\xff\xfe"):
        raise LogError(f"empty: expected lines of numbers; got {size} bytes without any")
    name, why = (encoding, "as given") if encoding else _encoding_of(head)
    share = 1.0 - len(head.translate(None, _NO_TEXT)) / len(head)
    if name == "cp1252" and share > MOST_SIGNS:
        raise LogError(f"not text: {share:.0%} of its bytes are no characters: export the log as text, such as .csv")
    decoder = codecs.getincrementaldecoder(name)("replace" if name == "cp1252" else "strict")
    try:
        text = decoder.decode(head)
    except UnicodeError as error:
        raise LogError(f"not {name} text ({error}): give --encoding") from error
    whole = len(unpacked) < _HEAD
    if whole and decoder.getstate()[0]:
        text += "\ufffd"  # part of a character at the end of the file
    newline = "\r" if "\r" in text and "\n" not in text else "\n"
    lines = [line.rstrip("\r") for line in text.split(newline)]
    if not whole or not lines[-1]:
        lines.pop()
    content = unpacked.removeprefix(codecs.BOM_UTF8) if name == "utf-8-sig" else unpacked
    if _WIDE.match(name):
        content = unpacked.decode(name, "replace").encode("utf-8", "replace")
    if newline == "\r":
        content = content.replace(b"\r", b"\n")
    return Text(size, sha256, content, tuple(lines), whole, name, package, (f"encoding {name}: {why}",))


def _read(path: Path) -> bytes:
    with path.open("rb") as file:
        before = os.fstat(file.fileno())
        raw = file.read()
        after = os.fstat(file.fileno())
    if before.st_mtime_ns != after.st_mtime_ns or not before.st_size == after.st_size == len(raw):
        raise LogError("changed while it was read: wait until it is written, ingest again")
    return raw


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


def _unpacked(raw: bytes, name: str) -> tuple[str, bytes]:
    """What a file is packed in, "" for plain text, and its text; a kind that is known and not read is refused."""
    most, file = max(FREE, MOST_EXPANSION * len(raw)), io.BytesIO(raw)
    package = next((kind for kind, magic in _PACKED.items() if raw.startswith(magic)), "")
    if not package:
        refuse_by_name(raw[: 1 << 12], name)
        return "", raw
    try:
        if package == "gzip":
            text = GzipFile(fileobj=file).read(most + 1)
        else:
            package, text = _of_archive(zipfile.ZipFile(file), most)
    except LogError:
        raise
    except EOFError as error:
        raise LogError(
            f"the {package} data ends early: the file was cut; unpack what is there yourself and ingest that"
        ) from error
    except (zlib.error, zipfile.BadZipFile, OSError, RuntimeError, ValueError) as error:
        # RuntimeError: encrypted, or packed in a way that is not known
        raise LogError(f"damaged {package} data: {error}") from error
    if len(text) > most:
        raise LogError(
            f"unpacks to more than {most / 1e6:.3g} MB from {len(raw)} bytes: accepted are {FREE / 1e6:.3g} MB, or "
            f"{MOST_EXPANSION} times the file: expected a packed log; unpack it yourself if it is one"
        )
    return package, text


def _of_archive(archive: zipfile.ZipFile, most: int) -> tuple[str, bytes]:
    """What a zip archive is, and the text of the one log or sheet in it, up to a few bytes more than accepted."""
    names = [name for name in archive.namelist() if name and not name.endswith("/")]
    names = [name for name in names if not name.startswith("__MACOSX/")]  # a Mac adds them by itself
    if "mimetype" in names and archive.read("mimetype").startswith(b"application/vnd.oasis"):
        raise LogError("an OpenDocument file: save it as .xlsx or .csv")
    if "xl/workbook.xml" in names:
        large = sum(member.file_size for member in archive.infolist())
        if large > most:
            raise LogError(
                f"a workbook that unpacks to {large} bytes: accepted are {most}: save it as .csv if it is a log"
            )
        return "xlsx", _sheet_as_text(archive, most)
    if len(names) != 1:
        shown = ", ".join(names[:5]) or "none"
        raise LogError(f"a zip archive of {len(names)} files ({shown}): expected one log: unpack it first")
    return "zip", archive.open(names[0]).read(most + 1)


def _sheet_as_text(archive: zipfile.ZipFile, most: int) -> bytes:
    """The rows of the one sheet that holds numbers, as UTF-8 lines of tabbed cells."""
    from openpyxl import load_workbook  # noqa: PLC0415 - 0.2 s that other logs need not wait for

    text = bytearray()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # extensions of Excel that are of no use here
            sheet = _with_numbers(load_workbook(archive.fp, read_only=True, data_only=True))
            if sheet.max_column is None:  # not every program that writes workbooks says how wide a sheet is
                sheet.calculate_dimension(force=True)
            for row in sheet.iter_rows(values_only=True, max_col=min(sheet.max_column or 1, _WIDEST)):
                cells = (cell.total_seconds() if isinstance(cell, timedelta) else cell for cell in row)
                words = ("" if cell is None else " ".join(str(cell).split()) for cell in cells)
                text += ("\t".join(words) + "\n").encode()
                if len(text) > most:
                    break
    except (LogError, MemoryError):
        raise
    except Exception as error:
        raise LogError(
            f"a damaged Excel workbook ({type(error).__name__}: {error}): save it again, or as .csv"
        ) from error
    return bytes(text)


def _with_numbers(book: Any) -> Any:
    sheets = []
    for sheet in book.worksheets:
        rows = islice(sheet.iter_rows(values_only=True, max_col=_WIDEST), 200)
        if sum(any(type(cell) in (int, float) for cell in row) for row in rows) >= 2:
            sheets.append(sheet)
    if len(sheets) != 1:
        titles = ", ".join(repr(sheet.title) for sheet in sheets)
        several = f"several sheets hold numbers ({titles}): which is the log? Keep one, or save it as .csv"
        raise LogError(several if sheets else "no sheet holds rows of numbers: expected a log")
    return sheets[0]


_KINDS = (
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an Excel 97 file (.xls), or another old Office file: save it as .xlsx"),
    (b"RIFF", "a sound file (WAV, AVI): its samples have no unit of length: export the displacement as text"),
    *((magic, "packed: unpack it first") for magic in (b"7z\xbc\xaf\x27\x1c", b"Rar!", b"BZh", b"\xfd7zXZ\0")),
    (b"MDF     ", "an ASAM MDF measurement: export it as text or as MATLAB"),
    (b"SQLite format 3", "a database (SQLite): export the log as text"),
    (b"ARROW1", "an Arrow (Feather) file: save it as Parquet"),
    (b"CDF", "a netCDF 3 file: save it as text, MATLAB or Parquet"),
    (b"source,status,reason,", "a table of results, not a log: `frictionlab show` and `frictionlab campaign` read it"),
)  # fmt: skip

_SUFFIXES = {".toml": "a scene (give it to --scene)", ".jsonl": "a table of results", ".md": "a text to read"}


def refuse_by_name(first: bytes, name: str) -> None:
    r"""Raise for a file whose first bytes are those of a kind that is not read."""
    if (kind := _SUFFIXES.get(PurePath(name).suffix.lower())) is not None:
        raise LogError(f"{kind}, not a log")
    for magic, words in _KINDS:
        if first.startswith(magic):
            raise LogError(words)
