"""Results (numbers, series, rows) <-> HDF5 file, as a tree of mappings."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from frictionlab.errors import RecordingError
from frictionlab.files import write_whole
from frictionlab.hdf5.image import Image
from frictionlab.hdf5.nodes import (
    FORMAT_VERSION,
    dataset_inside,
    facts_of,
    group_inside,
    node_inside,
    opened,
    root_attribute,
    text,
    write_dataset,
    write_facts,
)
from frictionlab.schema import Column

Describe = Callable[[str], Column | None]


def _undescribed(_name: str) -> Column | None:
    return None


def write_tree(
    tree: Mapping[str, object], path: Path, *, kind: str, force: bool = False, columns: Describe = _undescribed
) -> None:
    """Write a result (numbers, series, maps) to an HDF5 file, whole or not at all.

    Parameters
    ----------
    tree
        What to write, nested as the file shall be: a mapping becomes a group, an array or a list of text a dataset, a
        word or a number an attribute.
    kind
        What the file is, such as ``"frictionlab measurements"``; an existing file of this kind is replaced.
    force
        Replace whatever file stands there.
    columns
        What the dataset of a name is: it gives each its ``units`` and ``long_name``.

    Raises
    ------
    OutputError
        If the path holds another kind of file, or the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "result.h5"
    >>> write_tree({"series": {"energy": np.ones(3), "rule": "all"}}, path, kind="frictionlab example")
    >>> read_tree(path, kind="frictionlab example")["series"]
    {'rule': 'all', 'energy': array([1., 1., 1.])}
    """
    image = Image(_bytes_of(tree))
    with image.new_file(format=kind, format_version=FORMAT_VERSION) as file:
        _write_branch(file, tree, columns)
    write_whole(path, image.pieces(), replace=force or (lambda old: root_attribute(old, "format") == kind))


def format_of(path: Path) -> str:
    """What an HDF5 file calls itself in its attribute ``format``; empty for any other file."""
    return root_attribute(path, "format")


def read_tree(path: Path, *, kind: str) -> dict[str, Any]:
    """Read back what :func:`write_tree` wrote; text datasets come as lists.

    Raises
    ------
    RecordingError
        If the file is of another kind, or damaged. Links out of the file are not followed.
    """
    with opened(path, kind, "make it again") as (file, size):
        return _read_branch(file, size, set())


def _bytes_of(tree: Mapping[str, object]) -> int:
    """At most so many bytes; a text has up to four a character, and what HDF5 notes about each."""
    size = 0
    for value in tree.values():
        if isinstance(value, Mapping):
            size += _bytes_of(value)
        elif isinstance(value, (list, tuple)):
            size += sum(4 * len(str(words)) + 64 for words in value)
        else:
            size += getattr(value, "nbytes", 0)
    return size


def _write_branch(group: h5py.Group, tree: Mapping[str, object], columns: Describe) -> None:
    for name, value in tree.items():
        if isinstance(value, Mapping):
            _write_branch(group.create_group(name, track_order=True), value, columns)
        elif isinstance(value, (str, int, float)):
            write_facts(group, {name: value})
        elif isinstance(value, np.ndarray):
            _write_column(group, name, value, columns(name))
        elif isinstance(value, (list, tuple)):
            _write_column(group, name, [str(words) for words in value], columns(name))
        else:
            raise TypeError(f"{name}: expected an array, texts, a word or a number; got {type(value).__name__}")


def _write_column(group: h5py.Group, name: str, values: object, column: Column | None) -> None:
    if column is None:
        write_dataset(group, name, values)
    else:
        write_dataset(group, name, values, units=column.units, long_name=column.sentence)


def _read_branch(group: h5py.Group, size: int, seen: set[int]) -> dict[str, Any]:
    at = h5py.h5o.get_info(group.id).addr
    if at in seen:
        raise RecordingError(f"{group.name}: is the same group as one above: expected a tree")
    seen.add(at)
    tree: dict[str, Any] = dict(facts_of(group))
    for name in group:
        if isinstance(node_inside(group, name), h5py.Group):
            tree[name] = _read_branch(group_inside(group, name), size, seen)
            continue
        dataset = dataset_inside(group, name, size, dimensions=None)
        is_text = h5py.check_string_dtype(dataset.dtype) is not None
        tree[name] = [text(words) for words in dataset[()]] if is_text else dataset[()]
    return tree
