"""A log as blocks of whole lines: unpacked, decoded to an encoding whose digits and line ends are ASCII, hashed.

Memory is bounded whatever the file's size: a block holds a few megabytes, and a file that unpacks to far more than it
should is refused.
"""

import codecs
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path

from frictionlab.errors import LogError
from frictionlab.logs.unpack import BLOCK, Counted, Progress, package_of, unpacked

HEAD = 1 << 18
LONGEST_LINE = 1 << 24
NUMBERS = "binary"
"""The encoding of a log that is no text."""
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
            counted = Counted(file, before.st_size, self.progress)
            yield from _whole_lines(_decoded(counted, self.head))
            while counted.read(BLOCK):  # a compressed file may have padding
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
    with _open(path) as file:
        state = _state(os.fstat(file.fileno()))
        package = package_of(file, path.name)
        raw = bytearray()
        for chunk in _raw(Counted(file, state[0], None), package, path.name):
            raw += chunk
            if len(raw) >= HEAD:
                break
    whole = len(raw) < HEAD
    raw = raw[:HEAD]
    if not raw.strip(b"\0 \t\r\n\xef\xbb\xbf\xff\xfe"):
        raise LogError(f"{path.name}: empty: expected lines of numbers; got {state[0]} bytes without any")
    name, evidence = (encoding, "as given") if encoding else _encoding_of(bytes(raw))
    text = _decode(bytes(raw), name, path, whole=whole)
    newline = "\r" if "\r" in text and "\n" not in text else "\n"
    lines = [line.rstrip("\r") for line in text.split(newline)]
    if not whole or not lines[-1]:
        lines.pop()
    return Head(path, tuple(lines), name, newline, package, whole, (f"encoding {name}: {evidence}",), state)


def texts_of(head: Head, numbers: Sequence[int]) -> dict[int, str]:
    """Fetch the texts of some lines, by their numbers from 1; cut to 300 characters."""
    wanted, found, line = sorted(numbers), dict[int, str](), 1
    encoding = "utf-8" if head.encoding.startswith("utf") else head.encoding
    for block, _ in Blocks(head) if wanted and head.encoding != NUMBERS else ():
        count = block.count(b"\n") + (not block.endswith(b"\n"))
        here = [n for n in wanted if line <= n < line + count]
        rows = block.split(b"\n") if here else []
        found |= {n: rows[n - line][:300].decode(encoding, "replace").rstrip("\r") for n in here}
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


def _raw(file: Counted, package: str, name: str) -> Iterator[bytes]:
    """The file's text in chunks, unpacked."""
    if not package:
        while chunk := file.read(BLOCK):
            yield chunk
        return
    try:
        yield from unpacked(package, file)
    except LogError as error:
        raise LogError(f"{name}: {error}") from error


def _encoding_of(raw: bytes) -> tuple[str, str]:
    for bom, name in _BOMS:
        if raw.startswith(bom):
            return name, "byte order mark"
    even, odd = raw[0::2].count(0), raw[1::2].count(0)
    if odd > 0.4 * len(raw) / 2 and even < 0.05 * len(raw):
        return "utf-16-le", "every second byte is 0"
    if even > 0.4 * len(raw) / 2 and odd < 0.05 * len(raw):
        return "utf-16-be", "every second byte is 0"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(raw)
    except UnicodeDecodeError as error:
        return "cp1252", f"byte {error.start} is not UTF-8"
    return "utf-8", "plain ASCII" if raw.isascii() else "decodes without a fault"


def _decode(raw: bytes, encoding: str, path: Path, *, whole: bool) -> str:
    """Decode the head; part of a character at the end of a whole file stands as a replacement character."""
    decoder = codecs.getincrementaldecoder(encoding)("replace" if encoding == "cp1252" else "strict")
    try:
        text = decoder.decode(raw)
    except UnicodeError as error:
        raise LogError(f"{path.name}: not {encoding} text ({error}): give --encoding") from error
    return text + "\ufffd" if whole and decoder.getstate()[0] else text


def _decoded(file: Counted, head: Head) -> Iterator[bytes]:
    """Chunks in an encoding whose digits, separators and line ends are ASCII bytes."""
    chunks = _raw(file, head.package, head.path.name)
    if head.encoding == "utf-8-sig" or _WIDE.match(head.encoding):
        chunks = _as_utf8(chunks, head.encoding)
    if head.newline == "\r":
        chunks = (chunk.replace(b"\r", b"\n") for chunk in chunks)
    return chunks


def _as_utf8(chunks: Iterator[bytes], encoding: str) -> Iterator[bytes]:
    if encoding == "utf-8-sig":
        yield next(chunks, b"").removeprefix(codecs.BOM_UTF8)
        yield from chunks
        return
    decoder = codecs.getincrementaldecoder(encoding)("replace")
    for chunk in chunks:
        yield decoder.decode(chunk).encode("utf-8", "replace")
    yield decoder.decode(b"", final=True).encode("utf-8", "replace")


def _whole_lines(chunks: Iterator[bytes]) -> Iterator[tuple[bytes, bool]]:
    rest = b""
    for chunk in chunks:
        cut = chunk.rfind(b"\n") + 1
        if cut:
            yield (rest + chunk[:cut] if rest else chunk[:cut]), False
            rest = chunk[cut:]
            continue
        rest += chunk
        if len(rest) > LONGEST_LINE:
            raise LogError(f"a line longer than {LONGEST_LINE} bytes: expected a log of lines")
    if rest:
        yield rest, True
