"""The arrays of an HDF5 file made by others (MATLAB 7.3 and the like), by name."""

from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import FrictionlabError, RecordingError
from frictionlab.hdf5.nodes import NO_FILE
from frictionlab.hdf5.opening import to_read

Arrays = dict[str, NDArray[np.float64]]


def arrays_inside(path: Path, check_size: Callable[[int, int], None]) -> tuple[Arrays, dict[str, float]]:
    """Read the numeric arrays at the root of a file and one group deep (``group.name``), and its single numbers.

    Parameters
    ----------
    path
        The file.
    check_size
        Called with how many numbers all arrays hold and the file's size in bytes; raises if that is too much.

    Raises
    ------
    RecordingError
        If it is no HDF5 file, or damaged. Links out of the file are not followed.
    """
    try:
        with to_read(path) as file:
            found = dict(_datasets(file))
            check_size(sum(int(d.size) for d in found.values()), path.stat().st_size)
            arrays = {name: np.asarray(d[()], dtype=np.float64) for name, d in found.items() if d.size > 1}
            single = {name: float(np.ravel(d[()])[0]) for name, d in found.items() if d.size == 1}
    except FrictionlabError:
        raise
    except NO_FILE as error:
        raise RecordingError(f"an HDF5 file that cannot be read ({error}): save it again") from error
    return arrays, single


def _datasets(file: h5py.File) -> Iterator[tuple[str, h5py.Dataset]]:
    for name in file:
        if name.startswith("#"):  # MATLAB's own
            continue
        node = _inside(file, name)
        if isinstance(node, h5py.Group):
            inner = {f"{name}.{key}": _inside(node, key) for key in node}
            yield from ((key, d) for key, d in inner.items() if isinstance(d, h5py.Dataset) and _is_numeric(d))
        elif isinstance(node, h5py.Dataset) and _is_numeric(node):
            yield name, node


def _inside(group: h5py.Group, name: str) -> h5py.Group | h5py.Dataset | None:
    """A node of this file; ``None`` for a link that leads out of it or nowhere."""
    link = group.get(name, getlink=True)
    return group.get(name) if isinstance(link, h5py.HardLink) else None


def _is_numeric(dataset: h5py.Dataset) -> bool:
    kind = dataset.attrs.get("MATLAB_class", b"double")
    is_number = isinstance(kind, bytes) and kind.startswith((b"double", b"single", b"int", b"uint"))
    stored_here = not dataset.is_virtual and not dataset.external
    return dataset.dtype.kind in "fiu" and is_number and stored_here and "MATLAB_empty" not in dataset.attrs
