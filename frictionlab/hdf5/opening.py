"""The one way into an HDF5 file that exists: nothing but a whole file reaches the library."""

import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import h5py

from frictionlab.errors import RecordingError
from frictionlab.files import check_regular
from frictionlab.hdf5.seal import is_whole
from frictionlab.hdf5.trial import check_survivable

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_HEAD = 48


@contextmanager
def to_read(path: Path) -> Iterator[h5py.File]:
    """Open a file to read, once it is sure that this ends.

    Nothing is locked: a file of this package appears whole, and a writer's lock outlives the moment it does.

    Raises
    ------
    OSError
        It is not there, is no file, is not HDF5, or shorter than it says.
    RecordingError
        It is not as it was written, or reading it does not end.
    """
    check_regular(path)
    _check_length(path)
    whole = is_whole(path)
    if whole is False:
        raise RecordingError("damaged: its bytes are not those that were written")
    if whole is None:
        check_survivable(path)
    with h5py.File(path, "r", locking=False) as file:
        yield file


def _check_length(path: Path) -> None:
    """Raise if there is no HDF5 in a file, or less of it than its head says."""
    with path.open("rb", buffering=0) as file:
        size = os.fstat(file.fileno()).st_size
        file.seek(_start(file, size))
        says = _length(file.read(_HEAD))
    if says is not None and says > size:
        raise OSError(f"has {size} bytes, and says {says}")


def _start(file: BinaryIO, size: int) -> int:
    """Where HDF5 begins: at the first byte, or at 512, 1024 ... behind what others put before it."""
    start = 0
    while start < size:
        file.seek(start)
        if file.read(len(_SIGNATURE)) == _SIGNATURE:
            return start
        start = max(2 * start, 512)
    raise OSError("not an HDF5 file, or damaged")


def _length(head: bytes) -> int | None:
    """Where the file ends, as its head says; None where that is said in another way."""
    if len(head) < _HEAD:
        return None
    version, width, narrow = head[8], head[13], head[9]
    if version == 0 and width == 8:
        return int(struct.unpack_from("<Q", head, 40)[0])
    if version in (2, 3) and narrow == 8:
        return int(struct.unpack_from("<Q", head, 28)[0])
    return None
