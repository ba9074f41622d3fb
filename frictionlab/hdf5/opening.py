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
from frictionlab.hdf5.nodes import text
from frictionlab.hdf5.seal import is_whole
from frictionlab.hdf5.trial import fault_of

FORMAT_VERSION = 1
NO_FILE = (OSError, RuntimeError, ValueError, KeyError, TypeError, OverflowError)
"""What h5py raises on a file that is none of ours, or damaged."""
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
    if whole is None and (fault := fault_of(path)):
        raise RecordingError(f"damaged: {fault}")
    with h5py.File(path, "r", locking=False) as file:
        yield file


@contextmanager
def opened(path: Path, kind: str, remedy: str) -> Iterator[tuple[h5py.File, int]]:
    """Open a file of this kind to read: the file, and its size in bytes.

    Raises
    ------
    RecordingError
        If it is of another kind or a newer format, or is damaged, whether that shows here or while it is read.
    """
    try:
        with to_read(path) as file:
            _check_format(file, kind, remedy)
            yield file, path.stat().st_size
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from error
    except OSError as error:
        reason = error.strerror or "not an HDF5 file, or damaged"
        raise RecordingError(f"{path}: cannot be read as {kind} ({reason}): {remedy}") from error
    except NO_FILE as error:  # an OSError is dealt with above
        raise RecordingError(f"{path}: damaged {kind} ({error}): {remedy}") from error


def _check_format(file: h5py.File, kind: str, remedy: str) -> None:
    found, version = text(file.attrs.get("format")), file.attrs.get("format_version")
    if found != kind:
        raise RecordingError(f"expected a file of {kind}; got {found!r}: {remedy}")
    if version is None or int(version) > FORMAT_VERSION:
        raise RecordingError(f"expected format_version {FORMAT_VERSION}; got {version}: update frictionlab")


def root_attribute(path: Path, name: str) -> str:
    """An attribute of a file's root as text; empty if there is none, or no such file."""
    try:
        with to_read(path) as file:
            return text(file.attrs.get(name, ""))
    except NO_FILE:
        return ""


def _check_length(path: Path) -> None:
    """Raise if there is no HDF5 in a file, or less of it than its head says."""
    with path.open("rb", buffering=0) as file:
        size = os.fstat(file.fileno()).st_size
        file.seek(_start(file, size))
        head = file.read(_HEAD)
    if len(head) < _HEAD:
        return
    version, width, narrow = head[8], head[13], head[9]
    where = 40 if version == 0 and width == 8 else 28 if version in (2, 3) and narrow == 8 else None
    if where is not None and (says := int(struct.unpack_from("<Q", head, where)[0])) > size:
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
