"""A new HDF5 file as the bytes it shall have: built in memory, and written by who knows how to write a file whole.

Arrays get their place in the file at once but stay where they are: they are written from there, never copied.
"""

import mmap
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from frictionlab import __version__
from frictionlab.hdf5.seal import Seal

_ROOM = 1 << 28
"""Bytes for all but the arrays; memory that is not written to costs nothing."""


class Image:
    """The bytes of a file, once `new_file` has built it.

    Parameters
    ----------
    room
        Bytes of the arrays that will go into the file.
    """

    def __init__(self, room: int = 0) -> None:
        self._memory = _Memory(-1, 2 * room + _ROOM, flags=_FLAGS)
        self._placed: list[tuple[int, NDArray[Any]]] = []
        self._rooms: list[tuple[int, int]] = []

    @contextmanager
    def new_file(self, **attributes: object) -> Iterator[h5py.File]:
        """Open the file to be built; its root has these attributes and the version of this package."""
        with h5py.File(self._memory, "w", track_order=True) as file:
            file.attrs.update({**attributes, "frictionlab_version": __version__})
            yield file

    def place(self, group: h5py.Group, name: str, values: NDArray[Any]) -> h5py.Dataset:
        """Add an array that is written from where it stands; it must not change until then."""
        values = np.ascontiguousarray(values)
        if not values.size:
            return group.create_dataset(name, data=values)
        dataset = group.create_dataset(name, values.shape, values.dtype, dcpl=placed_at_once())
        self._placed.append((dataset.id.get_offset(), values))
        return dataset

    def keep_room(self, group: h5py.Group, name: str, shape: tuple[int, ...], dtype: np.dtype[Any]) -> h5py.Dataset:
        """Add an array that somebody else writes, later, where it has its place."""
        dataset = group.create_dataset(name, shape, dtype, dcpl=placed_at_once())
        self._rooms.append((dataset.id.get_offset(), dataset.nbytes))
        return dataset

    @property
    def size(self) -> int:
        """Bytes of the file."""
        return self._memory.end

    def parts(self) -> Iterator[tuple[int, memoryview]]:
        """Start and bytes of all that is not such an array."""
        at, memory = 0, memoryview(self._memory)
        for start, length in sorted(self._rooms):
            yield at, memory[at:start]
            at = start + length
        yield at, memory[at : self.size]

    def pieces(self) -> Iterator[memoryview]:
        """The bytes of the file, in order, its seal last."""
        at, memory, seal = 0, memoryview(self._memory), Seal()
        for offset, values in sorted(self._placed, key=lambda placed: placed[0]):
            seal.add(memory[at:offset])
            seal.leave_out(offset, values.nbytes)
            yield memory[at:offset]
            yield values.reshape(-1).view(np.uint8).data
            at = offset + values.nbytes
        seal.add(memory[at : self._memory.end])
        yield memory[at : self._memory.end]
        yield memoryview(seal.bytes())


def placed_at_once() -> Any:
    """Property list of a dataset that has its place in the file before anything is written there."""
    properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
    properties.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
    return properties


_FLAGS = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | getattr(mmap, "MAP_NORESERVE", 0)


class _Memory(mmap.mmap):
    """Memory that h5py takes for a file: its end is where writing ended, not where the memory does."""

    end = 0

    def seek(self, position: int, whence: int = 0) -> int:  # type: ignore[override] # mmap's gives None until 3.13
        place = position + (0, self.tell(), self.end)[whence]
        super().seek(place)
        return place

    def write(self, data: Any) -> int:
        written = super().write(data)
        self.end = max(self.end, self.tell())
        return written

    def readinto(self, buffer: Any) -> int:
        data = self.read(len(buffer))
        buffer[: len(data)] = data
        return len(data)

    def truncate(self, size: int) -> int:
        self.end = size
        return size
