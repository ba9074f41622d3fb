"""What all files have in common: text and facts in and out, and nothing read that is not what it claims to be."""

import re
from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from frictionlab.errors import RecordingError
from frictionlab.recording import Fact

TEXT = h5py.string_dtype()
_SHAPES = {1: "(n,)", 2: "(n, m)"}
_LONGEST_TEXT = 8000
_DEFLATE = 1100  # times smaller than what it holds: deflate cannot do better than about 1030
_FREE, _MOST_EXPANSION = 1 << 28, 100  # an array may claim so many bytes, or so many times those of the whole file


def storable(words: str) -> str:
    r"""Text that HDF5 can hold: NUL and lone surrogates are written as ``\x00``, and an attribute has at most 64 kB."""
    return re.sub("[\x00\ud800-\udfff]", lambda m: m[0].encode("unicode_escape").decode(), words[:_LONGEST_TEXT])


def text(value: Any) -> str:
    """What h5py gives for text, as text."""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def write_dataset(
    group: h5py.Group, name: str, values: Any, units: str | None = None, long_name: str | None = None
) -> None:
    """Add numbers (an array) or texts (a sequence), with what a reader's tool shows beside them."""
    if isinstance(values, np.ndarray):
        dataset = group.create_dataset(name, data=values)
    else:
        dataset = group.create_dataset(name, data=[storable(v) for v in values], shape=(len(values),), dtype=TEXT)
    if units is not None:
        dataset.attrs["units"] = units
    if long_name is not None:
        dataset.attrs["long_name"] = long_name


def write_facts(group: h5py.Group, facts: Mapping[str, Fact]) -> None:
    """Add words and numbers as attributes."""
    for key, value in facts.items():
        group.attrs[storable(key)] = storable(value) if isinstance(value, str) else value


def node_inside(group: h5py.Group, name: str) -> Any:
    """A member of a group that is in this file, not behind a link out of it."""
    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        raise RecordingError(f"{group.name}: expected {name!r} in this file; got nothing, or a link elsewhere")
    return group[name]


def group_inside(parent: h5py.Group, name: str) -> h5py.Group:
    """A group that is in this file."""
    group = node_inside(parent, name)
    if not isinstance(group, h5py.Group):
        raise RecordingError(f"/{name}: expected a group; got a dataset")
    return group


def dataset_inside(group: h5py.Group, name: str, size: int, *, dimensions: int | None = 1) -> h5py.Dataset:
    """A dataset whose numbers are in this file and are no more than a file of ``size`` bytes can hold."""
    dataset = node_inside(group, name)
    if not isinstance(dataset, h5py.Dataset) or dataset.is_virtual or dataset.external:
        raise RecordingError(f"{name}: expected an array stored in this file; got something else")
    if dimensions is not None and dataset.ndim != dimensions:
        raise RecordingError(f"{name}: expected shape {_SHAPES[dimensions]}; got {dataset.shape}")
    stored = int(dataset.id.get_storage_size())
    if dataset.nbytes > max(_FREE, _MOST_EXPANSION * size) or dataset.nbytes > _DEFLATE * stored:
        raise RecordingError(f"{name}: claims {dataset.nbytes} bytes in a file of {size} that stores {stored} of it")
    return dataset


def array_inside(
    group: h5py.Group, name: str, dtype: type[np.generic], size: int, *, dimensions: int = 1
) -> np.ndarray:
    """Numbers of this kind that are in this file."""
    dataset = dataset_inside(group, name, size, dimensions=dimensions)
    if dataset.dtype.kind != np.dtype(dtype).kind:
        raise RecordingError(f"{name}: expected {np.dtype(dtype)}; got {dataset.dtype}")
    return np.asarray(dataset[...], dtype=dtype)


def texts_inside(group: h5py.Group, name: str, size: int) -> list[str]:
    """Texts that are in this file."""
    return [text(value) for value in dataset_inside(group, name, size)[...]]


def facts_of(group: h5py.Group) -> dict[str, Fact]:
    """The attributes of a group: words and numbers, and nothing else."""
    return {key: _fact(value) for key, value in group.attrs.items()}


def _fact(value: Any) -> Fact:
    if isinstance(value, (str, bytes)):
        return text(value)
    number = np.asarray(value)
    if number.ndim or number.dtype.kind not in "iufb":
        raise RecordingError(f"expected a word or a number; got {value!r}")
    return int(number) if number.dtype.kind in "iu" else float(number)
