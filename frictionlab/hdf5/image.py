"""A new HDF5 file as the bytes it shall have: built in memory, and written by who knows how to write a file whole.

A full disk in the middle of a write ends the process in the HDF5 library; so it writes to memory. Arrays get their
place in the file at once but stay where they are: they are written from there, never copied.
"""

import mmap
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from frictionlab import __version__
from frictionlab.hdf5.opening import seal_of

_BYTES = 1 << 28
"""For all but the arrays; memory that is not written to costs nothing."""


class Image:
    """The bytes of a file, once `new_file` has built it.

    Parameters
    ----------
    size
        Bytes of the arrays that will go into the file.
    """

    def __init__(self, size: int = 0) -> None:
        flags = (getattr(mmap, name, 0) for name in ("MAP_PRIVATE", "MAP_ANONYMOUS", "MAP_NORESERVE"))
        posix = {"flags": sum(flags)} if hasattr(mmap, "MAP_PRIVATE") else {}
        self._memory = _Memory(-1, 2 * size + _BYTES, **posix)
        self._placed: list[tuple[int, NDArray[Any]]] = []

    @contextmanager
    def new_file(self, **attributes: object) -> Iterator[h5py.File]:
        """Open the file to be built; its root has these attributes and the version of this package."""
        with h5py.File(self._memory, "w", track_order=True) as file:
            file.attrs.update({**attributes, "frictionlab_version": __version__})
            yield file

    def place(self, group: h5py.Group, name: str, values: NDArray[Any]) -> h5py.Dataset:
        """Add an array that is written from where it stands; it must not change until then."""
        if not values.size:
            return group.create_dataset(name, data=values)
        properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        properties.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)  # it has its place before anything is written there
        properties.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        dataset = group.create_dataset(name, values.shape, values.dtype, dcpl=properties)
        self._placed.append((dataset.id.get_offset(), values))
        return dataset

    def pieces(self) -> Iterator[memoryview]:
        """The bytes of the file, in order, its seal last."""
        memory, placed = memoryview(self._memory), sorted(self._placed, key=lambda place: place[0])
        starts = [*(offset for offset, _ in placed), self._memory.end]
        ends = [0, *(offset + values.nbytes for offset, values in placed)]
        parts = [memory[end:start] for end, start in zip(ends, starts, strict=True)]
        for part, (_, values) in zip(parts, placed, strict=False):
            yield part
            yield np.ascontiguousarray(values).reshape(-1).view(np.uint8).data
        yield parts[-1]
        yield memoryview(seal_of(parts, [(offset, values.nbytes) for offset, values in placed]))


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
