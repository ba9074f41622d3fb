"""The one way into an HDF5 file that exists, and the seal by which this package knows a file that it wrote.

The HDF5 library believes what a file says of itself: of 360 recordings with a few bytes changed seven made it loop for
ever in C, where nothing in Python can end it. A file with its seal is as it was written, and costs 1 ms per 2 MB to
check; one whose seal is broken is refused; one without (of others, or changed by other tools, which drop what stands
behind the HDF5 part) is first tried by another process (`frictionlab.hdf5.trial`), and nothing of it is read that is
not what it claims to be. A seal: SHA-256 of all before, and `MARK`.
"""

import hashlib
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from frictionlab import __version__
from frictionlab.errors import RecordingError
from frictionlab.files import check_regular
from frictionlab.hdf5 import trial
from frictionlab.recording import Fact

FORMAT_VERSION = 1
TEXT = h5py.string_dtype()
NO_FILE = (OSError, RuntimeError, ValueError, KeyError, TypeError, OverflowError)
"""What h5py raises on a file that is none of ours, or damaged."""
MARK = b"frictionlab-seal"
_SEAL = 32 + len(MARK)
_BLOCK = 1 << 20
_SHAPES = {1: "(n,)", 2: "(n, m)"}
_LONGEST_TEXT = 8000
_DEFLATE = 1100  # times smaller than what it holds: deflate cannot do better than about 1030
_FREE, _MOST_EXPANSION = 1 << 28, 100  # an array may claim so many bytes, or so many times those of the whole file


def new_file(fill: Callable[[h5py.File], None], **attributes: object) -> tuple[memoryview, bytes]:
    """The bytes of a new file that ``fill`` makes in memory (a full disk would end the process), and its seal."""
    memory = BytesIO()
    with h5py.File(memory, "w", track_order=True) as file:
        file.attrs.update({**attributes, "frictionlab_version": __version__})
        fill(file)
    image = memory.getbuffer()
    return image, hashlib.sha256(image).digest() + MARK


def is_whole(path: Path) -> bool | None:
    """Whether a file is as it was written; None if it has no seal."""
    digest, left = hashlib.sha256(), path.stat().st_size - _SEAL
    with path.open("rb") as file:
        file.seek(max(left, 0))
        seal = file.read()
        if len(seal) != _SEAL or not seal.endswith(MARK):
            return None
        file.seek(0)
        while block := file.read(min(left, _BLOCK)):
            digest.update(block)
            left -= len(block)
    return seal.startswith(digest.digest())


@contextmanager
def to_read(path: Path) -> Iterator[h5py.File]:
    """Open a file to read, once it is sure that this ends.

    Nothing is locked: a file of this package appears whole, and a writer's lock outlives the moment it does.

    Raises
    ------
    OSError
        It is not there, is no file, or is not HDF5.
    RecordingError
        It is not as it was written, or reading it does not end.
    """
    check_regular(path)
    if not h5py.is_hdf5(path):
        raise OSError("not an HDF5 file, or damaged")
    state = path.stat()
    if fault := _fault(path.absolute(), (state.st_dev, state.st_ino, state.st_size, state.st_mtime_ns)):
        raise RecordingError(f"damaged: {fault}")
    with h5py.File(path, "r", locking=False) as file:
        yield file


@lru_cache(maxsize=256)
def _fault(path: Path, _state: tuple[int, ...]) -> str:
    """What is wrong with a file in this state, by its seal or by its trial; empty where nothing is."""
    whole = is_whole(path)
    if whole is False:
        return "its bytes are not those that were written"
    return "" if whole else trial.tried(path)[0]


@contextmanager
def opened(path: Path, kind: str, remedy: str) -> Iterator[tuple[h5py.File, int]]:
    """Open a file of this kind to read: the file, and its size in bytes; any kind where none is said.

    Raises
    ------
    RecordingError
        If it is of another kind or a newer format, or is damaged, whether that shows here or while it is read.
    """
    try:
        with to_read(path) as file:
            if kind:
                _check_format(file, kind, remedy)
            yield file, path.stat().st_size
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from error
    except OSError as error:
        what, reason = f"as {kind} " if kind else "", error.strerror or "not an HDF5 file, or damaged"
        raise RecordingError(f"{path}: cannot be read {what}({reason}): {remedy}") from error
    except NO_FILE as error:  # an OSError is dealt with above
        raise RecordingError(f"{path}: damaged {kind or 'file'} ({error}): {remedy}") from error


def _check_format(file: h5py.File, kind: str, remedy: str) -> None:
    found, version = text(file.attrs.get("format", "no format")), file.attrs.get("format_version")
    if found != kind:
        raise RecordingError(f"expected a file of {kind}; got {found!r}: {remedy}")
    if version is None or int(version) > FORMAT_VERSION:
        raise RecordingError(f"expected format_version {FORMAT_VERSION}; got {version}: update frictionlab")


def format_of(path: Path) -> str:
    """What an HDF5 file calls itself in its attribute ``format``; empty for any other file."""
    try:
        with to_read(path) as file:
            return text(file.attrs.get("format", ""))
    except NO_FILE:
        return ""


def storable(words: str, longest: int | None = _LONGEST_TEXT) -> str:
    r"""Text that HDF5 can hold, NUL and lone surrogates as ``\x00``; an attribute's is cut, for it has 64 kB."""
    return re.sub("[\x00\ud800-\udfff]", lambda m: m[0].encode("unicode_escape").decode(), words[:longest])


def text(value: Any) -> str:
    """What h5py gives for text, as text."""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def write_dataset(group: h5py.Group, name: str, values: Any, **attributes: str) -> None:
    """Add numbers (an array) or texts (a sequence), with what a reader's tool shows beside them."""
    if isinstance(values, np.ndarray):
        dataset = group.create_dataset(name, data=values)
    else:
        dataset = group.create_dataset(name, data=[storable(v, None) for v in values], shape=(len(values),), dtype=TEXT)
    dataset.attrs.update(attributes)


def write_facts(group: h5py.Group, facts: Mapping[str, Fact]) -> None:
    """Add words and numbers as attributes."""
    for key, value in facts.items():
        group.attrs[storable(key)] = storable(value) if isinstance(value, str) else value


def facts_of(group: h5py.Group) -> dict[str, Fact]:
    """The attributes of a group: words and numbers, and nothing else."""
    found: dict[str, Fact] = {}
    for key, value in group.attrs.items():
        number = np.asarray(value)
        if isinstance(value, (str, bytes)):
            found[key] = text(value)
        elif number.ndim or number.dtype.kind not in "iufb":
            raise RecordingError(f"expected a word or a number; got {value!r}")
        else:
            found[key] = int(number) if number.dtype.kind in "iu" else float(number)
    return found


def node_inside(group: h5py.Group, name: str) -> Any:
    """A member of a group that is in this file, not behind a link out of it."""
    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        raise RecordingError(f"{group.name}: expected {name!r} in this file; got nothing, or a link elsewhere")
    return group[name]


def group_inside(parent: h5py.Group, name: str) -> h5py.Group:
    """A group that is in this file."""
    if isinstance(group := node_inside(parent, name), h5py.Group):
        return group
    raise RecordingError(f"/{name}: expected a group; got a dataset")


def array_inside(
    group: h5py.Group, name: str, size: int, dtype: type[np.generic] | None = np.float64, *, dimensions: int | None = 1
) -> Any:
    """Numbers of this type, or texts as a list, that are in this file and no more than its ``size`` bytes can hold.

    ``dtype`` None: whatever is there.
    """
    dataset = node_inside(group, name)
    if not isinstance(dataset, h5py.Dataset) or dataset.is_virtual or dataset.external:
        raise RecordingError(f"{name}: expected an array stored in this file; got something else")
    if dimensions is not None and dataset.ndim != dimensions:
        raise RecordingError(f"{name}: expected shape {_SHAPES[dimensions]}; got {dataset.shape}")
    stored = int(dataset.id.get_storage_size())
    if dataset.nbytes > max(_FREE, _MOST_EXPANSION * size) or dataset.nbytes > _DEFLATE * stored:
        raise RecordingError(f"{name}: claims {dataset.nbytes} bytes in a file of {size} that stores {stored} of it")
    is_text = h5py.check_string_dtype(dataset.dtype) is not None
    if dtype is None or (dtype is np.str_ and is_text):
        return [text(words) for words in dataset[()]] if is_text else dataset[()]
    if dataset.dtype.kind != np.dtype(dtype).kind:
        raise RecordingError(f"{name}: expected {np.dtype(dtype)}; got {dataset.dtype}")
    return np.asarray(dataset[...], dtype=dtype)
