"""A look through a MATLAB 5 file before scipy reads it: its reader ends the whole process on a damaged type code.

The file is a row of elements, each a type, a size and its data; a matrix holds elements, and a compressed element one
matrix [MathWorks, "MAT-File Format"].
"""

import math
import mmap
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from frictionlab.errors import LogError

_HEAD = 128
_MATRIX, _COMPRESSED = 14, 15
_TYPES = frozenset({1, 2, 3, 4, 5, 6, 7, 9, 12, 13, _MATRIX, _COMPRESSED, 16, 17, 18})
_FLAGS, _SIZES, _NAMES = 6, 5, (1, 16)  # what the first three parts of a variable are made of
_BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8}
_CLASSES, _NUMBERS = range(1, 19), range(6, 16)
_SPARSE = 5  # its reader ends the process on a damaged one: none is read
_DEEPEST = 16
Data = bytes | mmap.mmap


def check_elements(path: Path, most_bytes: int) -> None:
    """Refuse a file whose elements are not those of MATLAB, or unpack to more than so many bytes.

    Raises
    ------
    LogError
        With the byte at which it is damaged.
    """
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        order = "<" if data[126:128] == b"IM" else ">"
        _check(data, _HEAD, len(data), order, most_bytes, 0)


def _check(data: Data, begin: int, end: int, order: str, most_bytes: int, depth: int, *, nested: bool = False) -> None:
    if depth > _DEEPEST:
        raise LogError(f"nested more than {_DEEPEST} deep near byte {begin}")
    for kind, start, stop in _elements(data, begin, end, order):
        if kind == _MATRIX:
            _check_matrix(data, start, stop, order, nested=nested)
            _check(data, start, stop, order, most_bytes, depth + 1, nested=True)
        elif kind == _COMPRESSED:
            inside = _unpacked(data[start:stop], most_bytes)
            _check(inside, 0, len(inside), order, most_bytes, depth + 1, nested=nested)


def _check_matrix(data: Data, begin: int, end: int, order: str, *, nested: bool) -> None:
    """Refuse a matrix of numbers whose parts, flags and size do not fit one another."""
    parts = list(_elements(data, begin, end, order))
    if not parts:
        return
    if parts[0][0] != _FLAGS or parts[0][2] - parts[0][1] != 8:
        raise LogError(f"damaged near byte {begin}: a variable without its flags")
    flags = struct.unpack_from(f"{order}I", data, parts[0][1])[0]
    kind, is_complex = flags & 0xFF, bool(flags & 0x800)
    if kind not in _CLASSES or (is_complex and kind not in _NUMBERS):
        raise LogError(f"damaged near byte {begin}: a variable of class {kind}")
    if kind == _SPARSE and nested:
        raise LogError(f"a sparse matrix inside another variable near byte {begin}: keep t, x, y as plain vectors")
    if kind not in _NUMBERS:
        return
    if len(parts) != 4 + is_complex:
        raise LogError(f"damaged near byte {begin}: expected {4 + is_complex} parts of a variable; got {len(parts)}")
    if parts[2][0] not in _NAMES:
        raise LogError(f"damaged near byte {begin}: a variable without its name")
    numbers = _size(data, *parts[1], order)
    for kind_of_part, first, last in parts[3:]:
        if kind_of_part not in _BYTES or numbers * _BYTES[kind_of_part] != last - first:
            raise LogError(f"damaged near byte {first}: expected {numbers} numbers; got {last - first} bytes")


def _size(data: Data, kind: int, start: int, stop: int, order: str) -> int:
    """How many numbers a matrix says that it has."""
    sizes = struct.unpack_from(f"{order}{(stop - start) // 4}i", data, start)
    if kind != _SIZES or len(sizes) < 2 or min(sizes) < 0:
        raise LogError(f"damaged near byte {start}: expected the sizes of a variable; got {sizes}")
    return math.prod(sizes)


def _elements(data: Data, begin: int, end: int, order: str) -> Iterator[tuple[int, int, int]]:
    """Type, first byte and end of the data of each element."""
    at = begin
    while at + 8 <= end:
        kind, size = struct.unpack_from(f"{order}II", data, at)
        start = at + 8
        if kind >> 16:  # a small element: its size, its type, its data in eight bytes
            kind, size, start = kind & 0xFFFF, kind >> 16, at + 4
        if kind not in _TYPES or start + size > end or (start == at + 4 and size > 4):
            raise LogError(f"damaged near byte {at}: an element of type {kind} and {size} bytes")
        yield kind, start, start + size
        at = start + size if kind == _COMPRESSED else at + 8 + (0 if start == at + 4 else -(-size // 8) * 8)


def _unpacked(packed: bytes, most_bytes: int) -> bytes:
    engine = zlib.decompressobj()
    inside = engine.decompress(packed, most_bytes + 1)
    if len(inside) > most_bytes or not engine.eof:
        raise LogError(f"a compressed variable that is cut, or unpacks to more than {most_bytes} bytes")
    return inside
