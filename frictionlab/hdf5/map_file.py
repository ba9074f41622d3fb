"""A map that grows: results over a grid, written as they come, continued after whatever stopped them.

The tree, format version 1::

    /               attrs: format, format_version, frictionlab_version, identity, and what holds for the whole map
    /r, /beta ...   (n,) float64, dimension scales
    /KEY            over all axes; float64 (NaN: not known) or ASCII text of fixed length (empty: not known)
    /wall           over all axes, the same at each point: stored once, as the value of what is not written
    /warnings       over all axes, uint32: CF flag_masks and flag_meanings, and flag_sentences (one for each, in words)
    (each with units and long_name, from `frictionlab.schema`)

While it grows the map is a journal hidden beside its final file: a line that says whose it is, then one record of
fixed length a point, in the order of the grid. Killed at any moment, what is whole of it is kept. When the last point
is in, the file is made of it; its bytes do not depend on how often the work was interrupted.
"""

import hashlib
import json
import math
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
from filelock import lock_descriptor
from numpy.typing import NDArray

from frictionlab import __version__
from frictionlab.arrays import FloatArray
from frictionlab.errors import OutputError, UsageError
from frictionlab.files import OPEN_FLAGS, WINDOWS, write_whole
from frictionlab.hdf5.opening import format_of, new_file, root_attribute, to_read
from frictionlab.schema import STEADY_STATES

FORMAT = "frictionlab map"
FORMAT_VERSION = 1
SUFFIX = ".frictionlab-sweep"


@dataclass(frozen=True)
class MapLayout:
    """What a map's file is made of beside its numbers.

    ``axes``: name and values of each dimension, the last one fastest; ``kinds``: key and type (``float64``, ``S11``) of
    each dataset; ``attributes``: what holds for the whole map; ``words``: what a dimension is that `frictionlab.schema`
    does not list, a law's parameter; ``flags``: of each key that holds flags, meaning -> its bit and what it says.
    """

    axes: Mapping[str, FloatArray]
    kinds: Mapping[str, str]
    attributes: Mapping[str, str]
    words: Mapping[str, str] = field(default_factory=dict)
    flags: Mapping[str, Mapping[str, tuple[int, str]]] = field(default_factory=dict)

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """Of one record."""
        return np.dtype(list(self.kinds.items()))

    @property
    def shape(self) -> tuple[int, ...]:
        """Points along each dimension."""
        return tuple(len(values) for values in self.axes.values())

    @property
    def identity(self) -> str:
        """What distinguishes one map from another: its values, keys and version, as a SHA-256."""
        about = [list(self.axes), dict(self.kinds), dict(self.attributes), __version__]
        content = hashlib.sha256(json.dumps(about).encode())
        for values in self.axes.values():
            content.update(np.asarray(values, dtype="<f8").tobytes())
        return content.hexdigest()

    def fill(self, records: NDArray[np.void], tree: h5py.File) -> None:
        """Put a file of these results together, one column in memory at a time."""
        tree.attrs.update({**self.attributes, "identity": self.identity})
        scales = []
        for name, values in self.axes.items():
            axis = tree.create_dataset(name, data=np.asarray(values, dtype=np.float64))
            axis.make_scale(name)
            axis.attrs.update(_described(name) or {"units": "1", "long_name": self.words.get(name, name)})
            scales.append(axis)
        data = [tree.create_dataset(key, data=records[key].reshape(self.shape)) for key in self.kinds]
        for key in (name for name in self.attributes if STEADY_STATES.column(name) is not None):
            word = self.attributes[key].encode()
            data.append(tree.create_dataset(key, self.shape, f"S{len(word)}", fillvalue=word))
        for dataset in data:
            for dimension, scale in zip(dataset.dims, scales, strict=True):
                dimension.attach_scale(scale)
            key = dataset.name.lstrip("/")
            dataset.attrs.update(_described(key))
            if flags := self.flags.get(key):  # as CF conventions have them, and each in words
                dataset.attrs["flag_masks"] = np.array([bit for bit, _ in flags.values()], dataset.dtype)
                dataset.attrs["flag_meanings"] = " ".join(flags)
                dataset.attrs["flag_sentences"] = [sentence for _, sentence in flags.values()]


def _described(name: str) -> dict[str, str]:
    column = STEADY_STATES.column(name)
    return {} if column is None else {"units": column.units, "long_name": column.sentence}


class GrowingMap:
    """A map while it grows; made by `growing_map`. ``done``: points that are in the journal, from the first on."""

    def __init__(self, path: Path, file: BinaryIO, layout: MapLayout, begin: int) -> None:
        self.path = path
        self._file, self._layout, self._begin = file, layout, begin
        self.done = max(0, file.seek(0, os.SEEK_END) - begin) // layout.dtype.itemsize

    def append(self, records: NDArray[np.void]) -> None:
        """Write the results of the next points: one record with all keys each."""
        data = memoryview(np.ascontiguousarray(records, self._layout.dtype).tobytes())
        try:
            self._file.seek(self._begin + self.done * self._layout.dtype.itemsize)
            while data:
                data = data[self._file.write(data) :]
        except OSError as error:
            raise OutputError(
                f"{self.path}: {self.done} points are kept, no more can be written ({error.strerror}): free some space"
                " and give --resume"
            ) from error
        self.done += len(records)

    def read(self, start: int, stop: int) -> NDArray[np.void]:
        """The results of points ``start`` up to ``stop``, one record with all keys each."""
        dtype = self._layout.dtype
        self._file.seek(self._begin + start * dtype.itemsize)
        return np.frombuffer(self._file.read((stop - start) * dtype.itemsize), dtype)

    def checkpoint(self) -> None:
        """Make sure that what is done outlives this process and this machine's power."""
        os.fsync(self._file.fileno())

    def finish(self, *, force: bool) -> None:
        """Make the map's file of the whole journal."""
        records = np.memmap(self._file, self._layout.dtype, "r", self._begin, (self.done,))
        pieces = new_file(partial(self._layout.fill, records), format=FORMAT, format_version=FORMAT_VERSION)
        write_whole(self.path, pieces, replace=force or is_map)
        del records
        self.discard()

    def discard(self) -> None:
        """Remove the journal."""
        if WINDOWS:  # an open file cannot be removed there
            self._file.close()
        part_of(self.path).unlink(missing_ok=True)


def part_of(path: Path) -> Path:
    """Where a map grows before it has its final name."""
    return path.with_name(f".{path.name}{SUFFIX}")


def is_map(path: Path) -> bool:
    """Whether this file is a map of this package."""
    return format_of(path) == FORMAT


@contextmanager
def growing_map(path: Path, layout: MapLayout, *, resume: bool = False, force: bool = False) -> Iterator[GrowingMap]:
    """Open a map beside its final path, new or where it was left; leaving the context saves what is done.

    Parameters
    ----------
    path
        Its final place.
    layout
        What it is made of.
    resume
        Continue a map of the same values that was left unfinished; without one, begin.
    force
        Begin anew over an unfinished map.

    Raises
    ------
    UsageError
        An unfinished map stands there and neither is said, or it is of other values or another version.
    OutputError
        Another process works on it, or the disk has no space for all of it.
    """
    path = Path(os.path.realpath(path))
    try:
        descriptor = os.open(part_of(path), os.O_RDWR | os.O_CREAT | OPEN_FLAGS, 0o666)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written ({error.strerror}): choose another folder") from error
    with os.fdopen(descriptor, "r+b", buffering=0) as file:
        if not lock_descriptor(descriptor, blocking=False):
            raise OutputError(f"{path}: another sweep is writing it just now: wait for it, or stop it")
        if _is_gone(path, file):
            raise OutputError(f"{path}: another sweep has just finished it: look at it first")
        grown = _continued(path, file, layout, resume=resume, force=force) or _begun(path, file, layout)
        try:
            yield grown
        finally:
            if not (file.closed or _is_gone(path, file)):
                if grown.done:
                    grown.checkpoint()
                else:
                    grown.discard()  # a map that never began leaves no trace


def finished_map(path: Path, layout: MapLayout) -> NDArray[np.void] | None:
    """The points of a whole map of just these values, one record each, if one stands there and none is growing."""
    growing = part_of(Path(os.path.realpath(path))).exists()
    if growing or not is_map(path) or root_attribute(path, "identity") != layout.identity:
        return None
    records = np.empty(math.prod(layout.shape), layout.dtype)
    with to_read(path) as tree:
        for key in layout.kinds:
            records[key] = tree[key][...].reshape(-1)
    return records


def _is_gone(path: Path, file: BinaryIO) -> bool:
    try:
        here, ours = part_of(path).lstat(), os.fstat(file.fileno())
    except FileNotFoundError:
        return True
    return (here.st_dev, here.st_ino) != (ours.st_dev, ours.st_ino)


def _continued(path: Path, file: BinaryIO, layout: MapLayout, *, resume: bool, force: bool) -> GrowingMap | None:
    """The map that an earlier run has left in the journal; None where a new one shall begin."""
    head = file.readline(4096)
    try:
        about = json.loads(head)
        identity, version = str(about["identity"]), str(about["frictionlab_version"])
    except (ValueError, KeyError, TypeError):
        return None  # killed before its first line was whole
    left = GrowingMap(path, file, layout, len(head))
    if not left.done or (force and not resume):
        return None
    if not resume:
        raise UsageError(
            f"{path}: a sweep was stopped here after {left.done} points: give --resume to continue it, --force to begin"
            " anew"
        )
    if identity != layout.identity:
        raise UsageError(
            f"{path}: the sweep that was stopped here has other values, or was begun by another build (version "
            f"{version}; here {__version__}): give the values it was begun with, or --force without --resume to begin "
            "anew"
        )
    return left


def _begun(path: Path, file: BinaryIO, layout: MapLayout) -> GrowingMap:
    """A new journal, where the disk has space for it and for the file that is made of it."""
    head = json.dumps({"identity": layout.identity, "frictionlab_version": __version__}).encode() + b"\n"
    os.ftruncate(file.fileno(), 0)
    file.seek(0)
    file.write(head)
    begun, free = GrowingMap(path, file, layout, len(head)), shutil.disk_usage(path.parent).free
    if free < (size := 2 * math.prod(layout.shape) * layout.dtype.itemsize):
        begun.discard()
        raise OutputError(f"{path}: no space for the map: expected {size} bytes; got {free}: free some")
    return begun
