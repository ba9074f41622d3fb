"""The tree of any HDF5 file as lines of text."""

from collections.abc import Iterator
from pathlib import Path

import h5py

from frictionlab.errors import RecordingError
from frictionlab.hdf5.nodes import NO_FILE, text
from frictionlab.hdf5.opening import to_read


def describe(path: Path) -> list[str]:
    """The tree of any HDF5 file as lines of text: groups, datasets with shape and units, attributes.

    Links out of the file are named, not followed.

    Raises
    ------
    RecordingError
        If the file is not HDF5, or is damaged.
    """
    try:
        with to_read(path) as file:
            return [*_attribute_lines(file, ""), *_tree_lines(file, "", set())]
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from error
    except NO_FILE as error:
        reason = getattr(error, "strerror", None) or "not an HDF5 file, or damaged"
        raise RecordingError(f"{path}: cannot be read ({reason})") from error


def _tree_lines(group: h5py.Group, indent: str, seen: set[int]) -> Iterator[str]:
    """The members of a group; of one that has several names, or is inside itself, only once."""
    seen.add(h5py.h5o.get_info(group.id).addr)
    for name in group:
        link = group.get(name, getlink=True)
        if isinstance(link, (h5py.ExternalLink, h5py.SoftLink)):
            yield f"{indent}{name} -> {getattr(link, 'filename', '')}{link.path} (not followed)"
            continue
        node = group[name]
        if isinstance(node, h5py.Group) and h5py.h5o.get_info(node.id).addr in seen:
            yield f"{indent}{name}/ (the same group as one above)"
        elif isinstance(node, h5py.Group):
            yield f"{indent}{name}/"
            yield from _attribute_lines(node, f"{indent}  ")
            yield from _tree_lines(node, f"{indent}  ", seen)
        elif isinstance(node, h5py.Dataset):
            units = text(node.attrs.get("units", ""))
            yield f"{indent}{name} {node.shape} {node.dtype}{f' [{units}]' if units else ''}"


def _attribute_lines(node: h5py.Group, indent: str) -> Iterator[str]:
    for key, value in node.attrs.items():
        yield f"{indent}{key} = {value.tolist() if hasattr(value, 'tolist') else value}"
