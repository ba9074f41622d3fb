"""The seal behind a file's HDF5 part: a digest by which this package recognises what it wrote.

The HDF5 library believes what a file says of itself: of 360 recordings with a few bytes changed seven made it loop for
ever in C, where nothing in Python can end it. A file with its seal is as it was written, and costs 0.1 ms to check; one
whose seal is broken is refused; one without (of others, or changed by other tools, which drop what stands behind the
HDF5 part) is first tried by another process (`frictionlab.hdf5.trial`).

The digest leaves the large arrays out: they hold plain numbers, lead nowhere, and would have to be read twice.

Layout, all whole numbers 64 bits, little-endian::

    start and length of each array left out | BLAKE2b (32 bytes) of all else and of these numbers | their count | MARK
"""

import hashlib
import os
import struct
from collections.abc import Iterable, Sequence
from pathlib import Path

MARK = b"frictionlab seal"
_END = struct.Struct("<Q16s")
_DIGEST = 32
_MOST = 1000  # arrays left out

Extent = tuple[int, int]
"""Start and length in bytes."""


def seal_of(parts: Iterable[bytes | memoryview], left_out: Sequence[Extent]) -> bytes:
    """The seal of a file: of its bytes between the arrays left out, and of where these stand.

    Examples
    --------
    >>> len(seal_of([b"head", b"tail"], [(4, 80)]))
    72
    """
    digest = hashlib.blake2b(digest_size=_DIGEST)
    for part in parts:
        digest.update(part)
    out = b"".join(struct.pack("<QQ", *extent) for extent in left_out)
    digest.update(out)
    return out + digest.digest() + _END.pack(len(left_out), MARK)


def is_whole(path: Path) -> bool | None:
    """Whether a file is as it was written; None if it has no seal."""
    with path.open("rb") as file:

        def read(start: int, length: int) -> bytes:
            file.seek(start)
            return file.read(length)

        size = os.fstat(file.fileno()).st_size
        end = read(max(size - _END.size, 0), _END.size)
        if len(end) < _END.size or not end.endswith(MARK):
            return None
        count = _END.unpack(end)[0]
        length = size - _END.size - _DIGEST - 16 * count
        if count > _MOST or length < 0:
            return False
        numbers = struct.unpack(f"<{2 * count}Q", read(length, 16 * count))
        out = list(zip(numbers[::2], numbers[1::2], strict=True))
        starts = [start for start, _ in out] + [length]
        ends = [0] + [start + size for start, size in out]
        if any(end > start for end, start in zip(ends, starts, strict=True)):
            return False
        parts = (read(end, start - end) for end, start in zip(ends, starts, strict=True))
        return seal_of(parts, out) == read(length, size - length)
