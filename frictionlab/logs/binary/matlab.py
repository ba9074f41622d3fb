"""MATLAB's .mat: versions 4 to 7 by scipy, 7.3 (HDF5) by h5py: vectors, also in structures one level deep."""

import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.hdf5 import arrays_inside, is_recording
from frictionlab.logs.binary.mat5 import check_elements
from frictionlab.logs.binary.sheet import Sheet, check_size, most_bytes, sheet_of_arrays

_READ = (
    "double",
    "single",
    "logical",
    "struct",
    *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
)
"""Kinds of variables, as scipy calls them, that are read: others hold no vector, and their readers trust the file."""


def is_matlab(first: bytes, path: Path) -> bool:
    """Whether a file is one of MATLAB, of any version; or another HDF5 file of arrays."""
    if first.startswith((b"MATLAB 5.0", b"MATLAB 7.3", b"\x89HDF\r\n\x1a\n")):
        return True
    return path.suffix.lower() == ".mat" and b"\0" in first[:20]


def read_matlab(path: Path) -> Sheet:
    """Read the vectors of a file.

    Raises
    ------
    LogError
        Damaged, of another kind, or without arrays of numbers: what is there is named.
    """
    with path.open("rb") as file:
        first = file.read(1024)
    if b"\x89HDF" in first:
        return _read_hdf5(path)
    if 0 not in first[:4]:  # no MATLAB 4 file, as SciPy tells it: whatever the words before its version say
        check_elements(path, most_bytes(path.stat().st_size))
    return _read_plain(path)


def _read_hdf5(path: Path) -> Sheet:
    if is_recording(path):
        raise LogError("a recording of frictionlab, not a log: give it to `frictionlab analyze`")
    arrays, scalars = arrays_inside(path, check_size)
    return _sheet(arrays, scalars, "no arrays of numbers")


def _read_plain(path: Path) -> Sheet:
    from scipy.io import loadmat, whosmat  # noqa: PLC0415 - 0.2 s that other logs need not wait for

    listed = whosmat(str(path))
    check_size(sum(int(np.prod(shape)) for _, shape, _ in listed), path.stat().st_size)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # duplicate names, objects it passes over
        wanted = [name for name, _, kind in listed if kind in _READ]
        found = loadmat(str(path), squeeze_me=True, struct_as_record=True, variable_names=wanted)
    arrays: dict[str, NDArray[np.float64]] = {}
    scalars: dict[str, float] = {}
    for name, value in found.items():
        if not name.startswith("__"):
            _gather(name, value, arrays, scalars, deep=True)
    others = ", ".join(f"{name} ({kind})" for name, _, kind in listed) or "nothing"
    return _sheet(arrays, scalars, others)


def _sheet(arrays: Mapping[str, NDArray[np.float64]], scalars: Mapping[str, float], others: str) -> Sheet:
    if not arrays:
        raise LogError(
            f"expected vectors of numbers such as t, x, y; got {others}: tables, timetables, datetimes "
            "and other objects cannot be read: save their columns as plain vectors (x = T.x; save log.mat t x y)"
        )
    return sheet_of_arrays("MATLAB", arrays, scalars)


def _gather(
    name: str, value: object, arrays: dict[str, NDArray[np.float64]], scalars: dict[str, float], *, deep: bool
) -> None:
    """Sort a variable under arrays or scalars; the fields of a structure each, one level deep."""
    array = np.asarray(value)
    if array.dtype.names is not None:
        for field in array.dtype.names if deep and array.size == 1 else ():
            _gather(f"{name}.{field}", array.item()[array.dtype.names.index(field)], arrays, scalars, deep=False)
    elif array.dtype.kind in "fiu":
        if array.size == 1:
            scalars[name] = float(array.ravel()[0])
        elif array.size > 1:
            arrays[name] = array.astype(np.float64)
