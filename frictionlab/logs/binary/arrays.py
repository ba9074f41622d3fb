"""Containers of arrays: MATLAB's .mat, foreign HDF5, NumPy's .npy and .npz, JSON."""

import json
import warnings
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from frictionlab.errors import LogError
from frictionlab.hdf5 import arrays_inside, is_recording
from frictionlab.hdf5.trial import fault_of
from frictionlab.log_options import LogOptions
from frictionlab.logs.binary.sheet import FREE_BYTES, Sheet, check_size, sheet_of

_READ = (
    *("double", "single", "logical", "struct", "cell"),
    *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
)
"""Kinds of MATLAB's variables, as scipy calls them, that are read: others hold no vector."""


def is_matlab(first: bytes, path: Path) -> bool:
    """Whether a file is one of MATLAB, of any version; or another HDF5 file of arrays."""
    if first.startswith((b"MATLAB 5.0", b"MATLAB 7.3", b"\x89HDF\r\n\x1a\n")):
        return True
    return path.suffix.lower() == ".mat" and b"\0" in first[:20]


def read_matlab(path: Path, options: LogOptions) -> Sheet:
    """Read the arrays of a file: versions 4 to 7 by scipy, 7.3 (HDF5) by h5py.

    Raises
    ------
    LogError
        Damaged, of another kind, or without arrays of numbers: what is there is named.
    """
    with path.open("rb") as file:
        is_hdf5 = b"\x89HDF" in file.read(1024)
    if is_hdf5:
        if is_recording(path):
            raise LogError("a recording of frictionlab, not a log: give it to `frictionlab analyze`")
        arrays, scalars = arrays_inside(path, check_size)
        return sheet_of("MATLAB", {**_nested(arrays), **scalars}, options)
    if fault := fault_of(path):
        raise LogError(f"damaged: {fault}: save it again")
    from scipy.io import loadmat, whosmat  # noqa: PLC0415 - 0.2 s that other logs need not wait for

    listed = whosmat(str(path))
    check_size(sum(int(np.prod(shape)) for _, shape, _ in listed), path.stat().st_size)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # duplicate names, objects it passes over
        wanted = [name for name, _, kind in listed if kind in _READ]
        found = loadmat(str(path), simplify_cells=True, variable_names=wanted)
    content = {name: value for name, value in found.items() if not name.startswith("__")}
    others = ", ".join(f"{name} ({kind})" for name, _, kind in listed) or "nothing"
    return sheet_of("MATLAB", content, options, others)


def _nested(arrays: dict[str, Any]) -> dict[str, Any]:
    """Arrays of one group under its name."""
    tree: dict[str, Any] = {}
    for name, array in arrays.items():
        group, _, key = name.partition(".")
        if key:
            tree.setdefault(group, {})[key] = array
        else:
            tree[name] = array
    return tree


def is_numpy(first: bytes, path: Path) -> bool:
    """Whether a file is an array of NumPy, or an archive of them."""
    return first.startswith(b"\x93NUMPY") or (first.startswith(b"PK") and path.suffix.lower() == ".npz")


def read_numpy(path: Path, options: LogOptions) -> Sheet:
    """Read the arrays of a file; none that holds Python objects is.

    Raises
    ------
    LogError
        Damaged, larger than it may be, or without arrays of numbers.
    """
    if path.suffix.lower() == ".npz":
        with zipfile.ZipFile(path) as archive:
            check_size(sum(member.file_size for member in archive.infolist()) // 8, path.stat().st_size)
        with np.load(path, allow_pickle=False) as found:
            return sheet_of("NumPy", dict(found), options)
    array = np.load(path, allow_pickle=False, mmap_mode="r")
    check_size(int(array.size), path.stat().st_size)
    return sheet_of("NumPy", {path.stem: np.array(array)} if array.dtype.names is None else np.array(array), options)


def is_json(first: bytes, path: Path) -> bool:
    """Whether a file is JSON: by its name, which ends in .json, and its first sign."""
    return path.suffix.lower() == ".json" and first.lstrip()[:1] in (b"{", b"[")


def read_json(path: Path, options: LogOptions) -> Sheet:
    """Read arrays by name, records (a mapping a row), columns with data, or a list of tests.

    Raises
    ------
    LogError
        Damaged, larger than it may be, or without arrays of numbers.
    """
    if path.stat().st_size > FREE_BYTES:
        raise LogError(f"more than {FREE_BYTES / 1e6:.0f} MB of JSON: save it as text or Parquet")
    return sheet_of("JSON", json.loads(path.read_bytes()), options)
