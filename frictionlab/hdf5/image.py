"""A new HDF5 file as the bytes it shall have: built in memory, and written by who knows how to write a file whole.

A full disk in the middle of a write ends the process in the HDF5 library; so it writes to memory.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from frictionlab import __version__
from frictionlab.hdf5.opening import Extent, seal_of


class Image:
    """The bytes of a file, once `new_file` has built it."""

    def __init__(self) -> None:
        self._memory = BytesIO()
        self._placed: list[Extent] = []

    @contextmanager
    def new_file(self, **attributes: object) -> Iterator[h5py.File]:
        """Open the file to be built; its root has these attributes and the version of this package."""
        with h5py.File(self._memory, "w", track_order=True) as file:
            file.attrs.update({**attributes, "frictionlab_version": __version__})
            yield file

    def place(self, group: h5py.Group, name: str, values: NDArray[Any]) -> h5py.Dataset:
        """Add an array that the seal leaves out."""
        dataset = group.create_dataset(name, data=values)
        if values.size:
            self._placed.append((dataset.id.get_offset(), values.nbytes))
        return dataset

    def pieces(self) -> Iterator[memoryview]:
        """The bytes of the file, its seal last."""
        memory, placed = self._memory.getbuffer(), np.array(sorted(self._placed), dtype=np.int64).reshape(-1, 2)
        starts, ends = [*placed[:, 0], len(memory)], [0, *placed.sum(axis=1)]
        yield memory
        parts = [memory[end:start] for end, start in zip(ends, starts, strict=True)]
        yield memoryview(seal_of(parts, [(start, size) for start, size in placed.tolist()]))
