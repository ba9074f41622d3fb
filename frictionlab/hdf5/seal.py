"""The seal behind a file's HDF5 part: a digest by which this package knows again what it wrote.

The HDF5 library believes what a file says of itself: of 360 recordings with a few bytes changed seven made it loop for
ever in C, where nothing in Python can end it. A file with its seal is as it was written, and costs 0.1 ms to check; one
whose seal is broken is refused; one without (of others, or changed by other tools, which drop what stands behind the
HDF5 part) is first tried by another process (`frictionlab.hdf5.trial`).

The digest leaves the large arrays out: they hold plain numbers, lead nowhere, and would cost their reading twice.

Layout, all whole numbers 64 bits, little-endian::

    start and length of each array left out | BLAKE2b (32 bytes) of all else and of these numbers | their count | MARK
"""

import hashlib
import os
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

MARK = b"frictionlab seal"
_END = struct.Struct("<Q16s")
_DIGEST = 32
_MOST = 1000  # arrays left out
_BLOCK = 1 << 20

Extent = tuple[int, int]
"""Start and length in bytes."""


class Seal:
    """The digest of a file while its bytes are written, in order.

    Examples
    --------
    >>> seal = Seal()
    >>> seal.add(b"head")
    >>> seal.leave_out(4, 80)
    >>> len(seal.bytes())
    72
    """

    def __init__(self) -> None:
        self._digest = hashlib.blake2b(digest_size=_DIGEST)
        self._out: list[Extent] = []

    def add(self, data: bytes | memoryview) -> None:
        """Take in the next bytes."""
        self._digest.update(data)

    def leave_out(self, start: int, length: int) -> None:
        """Pass over an array."""
        self._out.append((start, length))

    def bytes(self) -> bytes:
        """What is to stand behind the file."""
        out = b"".join(struct.pack("<QQ", *extent) for extent in self._out)
        self._digest.update(out)
        return out + self._digest.digest() + _END.pack(len(self._out), MARK)


def seal_of(file: BinaryIO, length: int, left_out: Sequence[Extent]) -> bytes:
    """The seal of the first ``length`` bytes of a file, without these arrays."""
    seal = Seal()
    for start, stop in _between(left_out, length):
        for block in _blocks(file, start, stop):
            seal.add(block)
    for extent in sorted(left_out):
        seal.leave_out(*extent)
    return seal.bytes()


def is_whole(path: Path) -> bool | None:
    """Whether a file is as it was written; None if it has no seal."""
    with path.open("rb", buffering=0) as file:
        size = os.fstat(file.fileno()).st_size
        end = _read_at(file, max(size - _END.size, 0), _END.size)
        if len(end) < _END.size or not end.endswith(MARK):
            return None
        count = _END.unpack(end)[0]
        length = size - _END.size - _DIGEST - 16 * count
        if count > _MOST or length < 0:
            return False
        numbers = struct.unpack(f"<{2 * count}Q", _read_at(file, length, 16 * count))
        out = list(zip(numbers[::2], numbers[1::2], strict=True))
        return _fit(out, length) and seal_of(file, length, out) == _read_at(file, length, size - length)


def _fit(extents: Sequence[Extent], length: int) -> bool:
    """Whether they follow each other inside a file of this length."""
    ends = [0, *(start + size for start, size in extents)]
    return all(end <= start for end, (start, _) in zip(ends, extents, strict=False)) and ends[-1] <= length


def _between(left_out: Sequence[Extent], length: int) -> Iterator[tuple[int, int]]:
    """Start and stop of what is not left out."""
    at = 0
    for start, size in sorted(left_out):
        yield at, start
        at = start + size
    yield at, length


def _blocks(file: BinaryIO, start: int, stop: int) -> Iterator[bytes]:
    while start < stop and (block := _read_at(file, start, min(_BLOCK, stop - start))):
        yield block
        start += len(block)


def _read_at(file: BinaryIO, start: int, length: int) -> bytes:
    file.seek(start)
    return file.read(length)
