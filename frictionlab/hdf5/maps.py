"""A map that grows: results over a grid, written as they come, continued after whatever stopped them.

The tree, format version 1::

    /               attrs: format, format_version, frictionlab_version, identity, and what holds for the whole map
    /r, /beta ...   (n,) float64, dimension scales
    /KEY            over all axes; float64 (NaN: not known) or ASCII text of fixed length (empty: not known)
    /wall           over all axes, the same at each point: stored once, as the value of what is not written
    /warnings       over all axes, uint32: CF flag_masks and flag_meanings, and flag_sentences (one for each, in words)
    (each with units and long_name, from `frictionlab.schema`)

All datasets are contiguous and get their place in the file before the first point is solved. Points are solved in the
order in which they lie there, so that what is done is one number: results are written into their places by plain
writes, then synced, then the number is written to a note beside the file. Killed at any moment, file and note still
fit. Both are hidden beside the final file and take its name when the last point is in; the bytes do not tell how often
the work was interrupted.
"""

import hashlib
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
from numpy.typing import NDArray

from frictionlab import __version__
from frictionlab.errors import OutputError, UsageError
from frictionlab.files import OPEN_FLAGS, check_replaceable, put_in_place, remove_part, take_lock, write_whole
from frictionlab.hdf5.image import Image
from frictionlab.hdf5.nodes import root_attribute
from frictionlab.hdf5.seal import seal_of
from frictionlab.schema import STEADY_STATES

FORMAT = "frictionlab map"
FORMAT_VERSION = 1
SUFFIX = ".frictionlab-sweep"
NOTE = ".done"
Flags = Mapping[str, tuple[int, str]]  # meaning (one word) -> its bit and what it says


class GrowingMap:
    """A map's file while it grows, or a finished one to read; made by `growing_map` and `finished_map`.

    Attributes
    ----------
    done
        Points that are in the file, from the first on; after `checkpoint` they survive this process.
    """

    def __init__(
        self, path: Path, file: BinaryIO, identity: str, places: Mapping[str, tuple[np.dtype[Any], int]]
    ) -> None:
        self.path = path
        self.done = 0
        self._file = file
        self._identity = identity
        self._places = places

    def append(self, records: NDArray[np.void]) -> None:
        """Write the results of the next points: one record with all keys each."""
        for key, (dtype, place) in self._places.items():
            data = np.ascontiguousarray(records[key], dtype=dtype).tobytes()
            _write_at(self._file, data, place + self.done * dtype.itemsize)
        self.done += len(records)

    def read(self, start: int, stop: int) -> NDArray[np.void]:
        """The results of points ``start`` up to ``stop``, one record with all keys each."""
        records = np.empty(stop - start, dtype=[(key, dtype) for key, (dtype, _) in self._places.items()])
        for key, (dtype, place) in self._places.items():
            self._file.seek(place + start * dtype.itemsize)
            data = self._file.read(len(records) * dtype.itemsize)
            records[key] = np.frombuffer(data, dtype)
        return records

    def checkpoint(self) -> None:
        """Make sure that what is done outlives this process and this machine's power."""
        os.fsync(self._file.fileno())
        note = {"identity": self._identity, "frictionlab_version": __version__, "done": self.done}
        write_whole(_note_of(self.path), json.dumps(note).encode())

    def finish(self, *, force: bool) -> None:
        """Give the whole map its seal and its final name."""
        end = self._file.seek(0, os.SEEK_END)
        arrays = [(place, dtype.itemsize * self.done) for dtype, place in self._places.values() if self.done]
        _write_at(self._file, seal_of(self._file, end, arrays), end)
        self.checkpoint()
        check_replaceable(self.path, replace=force or is_map)
        put_in_place(self._file, part_of(self.path), self.path)
        _note_of(self.path).unlink()

    def discard(self) -> None:
        """Remove what is hidden; for a map that went into another kind of file."""
        remove_part(self._file, part_of(self.path))
        _note_of(self.path).unlink(missing_ok=True)


def part_of(path: Path) -> Path:
    """Where a map grows before it has its final name."""
    return path.with_name(f".{path.name}{SUFFIX}")


def _note_of(path: Path) -> Path:
    return path.with_name(f".{path.name}{SUFFIX}{NOTE}")


@contextmanager
def growing_map(
    path: Path,
    axes: Mapping[str, NDArray[np.float64]],
    kinds: Mapping[str, str],
    attributes: Mapping[str, str],
    *,
    words: Mapping[str, str] | None = None,
    flags: Mapping[str, Flags] | None = None,
    resume: bool = False,
    force: bool = False,
) -> Iterator[GrowingMap]:
    """Open a map beside its final path, new or where it was left; leaving the context saves what is done.

    Parameters
    ----------
    path
        Its final place.
    axes
        Name and values of each dimension, in order; the last one is the fastest.
    kinds
        Key and type (``float64``, ``S11``) of each dataset.
    attributes
        What holds for the whole map.
    words
        What a dimension is, by its name, where `frictionlab.schema` does not list it: a law's parameter, without unit.
    flags
        Of each key that holds flags: meaning (one word) -> its bit and what it says.
    resume
        Continue a map of the same values that was left unfinished; without one, begin.
    force
        Begin anew over an unfinished map.

    Raises
    ------
    UsageError
        An unfinished map stands there and neither is said, or it is of other values or another version.
    OutputError
        Another process works on it, or the disk has no room for all of it.
    """
    path = Path(os.path.realpath(path))
    identity = identity_of(axes, kinds, attributes)
    with _locked(path) as file:
        done = _done_before(path, identity, resume=resume, force=force)
        if not done:
            _begin(path, file, axes, kinds, {**attributes, "identity": identity}, words or {}, flags or {})
        grown = GrowingMap(path, file, identity, _places_in(file, kinds))
        grown.done = done
        try:
            grown.checkpoint()
            yield grown
        finally:
            if not (file.closed or _is_gone(path, file)):
                _leave(grown)


def _leave(grown: GrowingMap) -> None:
    """Save what is done, if anything is; a map that never began leaves no trace."""
    if grown.done:
        grown.checkpoint()
    else:
        grown.discard()


def identity_of(
    axes: Mapping[str, NDArray[np.float64]], kinds: Mapping[str, str], attributes: Mapping[str, str]
) -> str:
    """What tells one map from another: its values, keys and version, as a SHA-256."""
    content = hashlib.sha256(json.dumps([list(axes), dict(kinds), dict(attributes), __version__]).encode())
    for values in axes.values():
        content.update(np.asarray(values, dtype="<f8").tobytes())
    return content.hexdigest()


def is_map(path: Path) -> bool:
    """Whether this file is a map of this package."""
    return root_attribute(path, "format") == FORMAT


@contextmanager
def finished_map(
    path: Path, axes: Mapping[str, NDArray[np.float64]], kinds: Mapping[str, str], attributes: Mapping[str, str]
) -> Iterator[GrowingMap | None]:
    """Open the whole map of just these values to read it, if that is what stands there and none is growing."""
    identity = identity_of(axes, kinds, attributes)
    if (
        _note_of(Path(os.path.realpath(path))).exists()
        or not is_map(path)
        or root_attribute(path, "identity") != identity
    ):
        yield None
        return
    with path.open("rb", buffering=0) as file:
        whole = GrowingMap(path, file, identity, _places_in(file, kinds))
        whole.done = math.prod(len(values) for values in axes.values())
        yield whole


@contextmanager
def _locked(path: Path) -> Iterator[BinaryIO]:
    part = part_of(path)
    try:
        descriptor = os.open(part, os.O_RDWR | os.O_CREAT | OPEN_FLAGS, 0o666)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror}): choose another folder") from error
    with os.fdopen(descriptor, "r+b", buffering=0) as file:
        if not take_lock(file):
            raise OutputError(f"{path}: another sweep is writing it just now: wait for it, or stop it")
        if _is_gone(path, file):
            raise OutputError(f"{path}: another sweep has just finished it: look at it first")
        yield file


def _is_gone(path: Path, file: BinaryIO) -> bool:
    try:
        here, ours = part_of(path).lstat(), os.fstat(file.fileno())
    except FileNotFoundError:
        return True
    return (here.st_dev, here.st_ino) != (ours.st_dev, ours.st_ino)


def _done_before(path: Path, identity: str, *, resume: bool, force: bool) -> int:
    """How many points an earlier run has left in the hidden file."""
    note = _note_of(path)
    if not note.exists():
        return 0
    try:
        left = json.loads(note.read_text(encoding="utf-8"))
        done, before, version = int(left["done"]), left["identity"], left["frictionlab_version"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise OutputError(f"{note}: cannot be read ({error}): remove it, and the sweep begins anew") from error
    if not done or (force and not resume):
        return 0
    if not resume:
        raise UsageError(
            f"{path}: a sweep was stopped here after {done} points: give --resume to continue it, --force to begin anew"
        )
    if before != identity:
        raise UsageError(
            f"{path}: the sweep that was stopped here has other values, or was begun by another build (version "
            f"{version}; here {__version__}): give the values it was begun with, or --force without --resume to begin "
            "anew"
        )
    return done


def _begin(
    path: Path,
    file: BinaryIO,
    axes: Mapping[str, NDArray[np.float64]],
    kinds: Mapping[str, str],
    attributes: Mapping[str, str],
    words: Mapping[str, str],
    flags: Mapping[str, Flags],
) -> None:
    """Lay a new map out, or leave nothing of it."""
    try:
        _lay_out(file, axes, kinds, attributes, words, flags)
    except BaseException as error:
        remove_part(file, part_of(path))
        if isinstance(error, OSError):
            raise OutputError(f"{path}: no room for the map ({error.strerror}): free some") from error
        raise


def _lay_out(
    file: BinaryIO,
    axes: Mapping[str, NDArray[np.float64]],
    kinds: Mapping[str, str],
    attributes: Mapping[str, str],
    words: Mapping[str, str],
    flags: Mapping[str, Flags],
) -> None:
    """Give every dataset its place; nothing but the axes is in it yet."""
    shape = tuple(len(values) for values in axes.values())
    image = Image(math.prod(shape) * sum(np.dtype(kind).itemsize for kind in kinds.values()))
    with image.new_file(format=FORMAT, format_version=FORMAT_VERSION) as tree:
        tree.attrs.update(attributes)
        scales = []
        for name, values in axes.items():
            axis = tree.create_dataset(name, data=np.asarray(values, dtype=np.float64))
            axis.make_scale(name)
            axis.attrs.update(_described(name) or {"units": "1", "long_name": words.get(name, name)})
            scales.append(axis)
        for key, kind in kinds.items():
            data = image.keep_room(tree, key, shape, np.dtype(kind))
            _give_axes(data, scales)
            data.attrs.update(_flagged(flags.get(key, {}), np.dtype(kind)))
        for key in (name for name in attributes if STEADY_STATES.column(name) is not None):
            word = attributes[key].encode()
            _give_axes(tree.create_dataset(key, shape, f"S{len(word)}", fillvalue=word), scales)
    _reserve(file, image.size)
    for at, part in image.parts():
        _write_at(file, part, at)


def _give_axes(data: h5py.Dataset, scales: Iterable[h5py.Dataset]) -> None:
    """Say what its dimensions are, and what it holds."""
    for dimension, scale in zip(data.dims, scales, strict=True):
        dimension.attach_scale(scale)
    data.attrs.update(_described(data.name.lstrip("/")))


def _described(name: str) -> dict[str, str]:
    column = STEADY_STATES.column(name)
    return {} if column is None else {"units": column.units, "long_name": column.sentence}


def _flagged(flags: Flags, dtype: np.dtype[Any]) -> dict[str, Any]:
    """The attributes of a dataset of flags, as CF conventions have them, and each flag in words; none without flags."""
    if not flags:
        return {}
    masks = np.array([bit for bit, _ in flags.values()], dtype)
    said = [sentence for _, sentence in flags.values()]
    return {"flag_masks": masks, "flag_meanings": " ".join(flags), "flag_sentences": said}


def _reserve(file: BinaryIO, size: int) -> None:
    """Take the room on the disk now, so that a full one is told before the work and not after it."""
    os.ftruncate(file.fileno(), 0)
    os.ftruncate(file.fileno(), size)
    if hasattr(os, "posix_fallocate"):
        os.posix_fallocate(file.fileno(), 0, size)


def _places_in(file: BinaryIO, kinds: Mapping[str, str]) -> dict[str, tuple[np.dtype[Any], int]]:
    with h5py.File(file, "r") as tree:
        return {key: (np.dtype(kind), int(tree[key].id.get_offset())) for key, kind in kinds.items()}


def _write_at(file: BinaryIO, data: bytes | memoryview, place: int) -> None:
    file.seek(place)
    view, written = memoryview(data), 0
    while written < len(view):
        written += file.write(view[written:])
