"""Any HDF5 file as a tree: results and maps written, read, the arrays of others, the tree as lines of text."""

import pickle
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import FrictionlabError, RecordingError
from frictionlab.files import write_whole
from frictionlab.hdf5 import opening, trial
from frictionlab.hdf5.opening import array_inside, group_inside, node_inside, opened, text, write_dataset
from frictionlab.schema import STEADY_STATES, Column

MAP = "frictionlab map"
Describe = Callable[[str], Column | None]


def write_tree(
    tree: Mapping[str, object], path: Path, *, kind: str, force: bool = False, columns: Describe = lambda _: None
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
    pieces = opening.new_file(
        lambda file: _write_branch(file, tree, columns), format=kind, format_version=opening.FORMAT_VERSION
    )
    write_whole(path, pieces, replace=force or (lambda old: opening.format_of(old) == kind))


def read_tree(path: Path, *, kind: str) -> dict[str, Any]:
    """Read back what :func:`write_tree` wrote; text datasets come as lists.

    Raises
    ------
    RecordingError
        If the file is of another kind, or damaged. Links out of the file are not followed.
    """
    with opened(path, kind, "make it again") as (file, size):
        return _read_branch(file, size, set())


def _write_branch(group: h5py.Group, tree: Mapping[str, object], columns: Describe) -> None:
    for name, value in tree.items():
        if isinstance(value, Mapping):
            _write_branch(group.create_group(name, track_order=True), value, columns)
        elif isinstance(value, (str, int, float)):
            opening.write_facts(group, {name: value})
        elif isinstance(value, (np.ndarray, list, tuple)):
            values = value if isinstance(value, np.ndarray) else list(map(str, value))
            write_dataset(group, name, values, **_described(columns(name)))
        else:
            raise TypeError(f"{name}: expected an array, texts, a word or a number; got {type(value).__name__}")


def _read_branch(group: h5py.Group, size: int, seen: set[int]) -> dict[str, Any]:
    at = h5py.h5o.get_info(group.id).addr
    if at in seen:
        raise RecordingError(f"{group.name}: is the same group as one above: expected a tree")
    seen.add(at)
    tree: dict[str, Any] = dict(opening.facts_of(group))
    for name in group:
        if isinstance(node_inside(group, name), h5py.Group):
            tree[name] = _read_branch(group_inside(group, name), size, seen)
        else:
            tree[name] = array_inside(group, name, size, None, dimensions=None)
    return tree


def describe(path: Path) -> list[str]:
    """The tree of any HDF5 file as lines of text: groups, datasets with shape and units, attributes.

    Links out of the file are named, not followed.

    Raises
    ------
    RecordingError
        If the file is not HDF5, or is damaged.
    """
    with opened(path, "", "save it again") as (file, _):
        return [*_attribute_lines(file, ""), *_tree_lines(file, "", set())]


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


def arrays_inside(path: Path, check_size: Callable[[int, int], None]) -> dict[str, Any]:
    """Read the numeric arrays at the root of a file, and those one group deep as a mapping under the group's name.

    The attribute ``units`` of arrays stands beside them, in a mapping ``units`` by their names. MATLAB's cells of them
    are arrays of objects.

    ``check_size`` is called with how many numbers all arrays hold and the file's size in bytes, and may raise.

    Raises
    ------
    RecordingError
        If it is no HDF5 file, or damaged. Links out of the file are not followed.
    """
    found, tree = dict[str, list[h5py.Dataset]](), dict[str, Any]()

    def take(name: str, node: h5py.Group | h5py.Dataset) -> None:
        is_cell = node.attrs.get("MATLAB_class") == b"cell"  # of references
        parts = [node.file[place] for place in node[()].ravel()] if is_cell else [node]
        if all(map(_is_numeric, parts)) and name.count("/") < 2 and not name.startswith("#"):  # MATLAB's own
            found[name] = parts

    try:
        with opening.to_read(path) as file:
            file.visititems(take)  # no links
            check_size(sum(int(part.size) for parts in found.values() for part in parts), path.stat().st_size)
            for name, parts in found.items():
                group, _, own = name.rpartition("/")
                place, arrays = tree.setdefault(group, {}) if group else tree, np.empty(len(parts), dtype=object)
                for i, part in enumerate(parts):
                    arrays[i] = np.asarray(part[()], dtype=np.float64).squeeze()
                place[own] = arrays[0] if len(arrays) == 1 else arrays
                if units := text(parts[0].attrs.get("units", "")):
                    place.setdefault("units", {})[own] = units
            return tree
    except FrictionlabError:
        raise
    except opening.NO_FILE as error:
        raise RecordingError(f"an HDF5 file that cannot be read ({error}): save it again") from error


def matlab_inside(path: Path) -> tuple[dict[str, Any], str]:
    """The variables of a MATLAB file of version 4 to 7 that may hold vectors, by name; all, with their kinds, in words.

    Structures are mappings, cells are arrays of objects. `RecordingError` where it is damaged.
    """
    fault, output = trial.tried(path)
    content, words = (None, fault) if fault else pickle.loads(output)  # noqa: S301 - by a process of ours
    if content is None:
        raise RecordingError(f"damaged: {words}: save it again")
    return content, words


def _is_numeric(dataset: Any) -> bool:
    if not isinstance(dataset, h5py.Dataset) or dataset.is_virtual or dataset.external:
        return False
    kind = dataset.attrs.get("MATLAB_class", b"double")
    is_number = isinstance(kind, bytes) and kind.startswith((b"double", b"single", b"int", b"uint"))
    return dataset.dtype.kind in "fiu" and is_number and "MATLAB_empty" not in dataset.attrs


def write_map(
    datasets: Mapping[str, NDArray[Any]],
    path: Path,
    *,
    axes: Mapping[str, FloatArray],
    attributes: Mapping[str, str],
    words: Mapping[str, str],
    flags: Mapping[str, Mapping[str, tuple[int, str]]],
    force: bool = False,
) -> None:
    """Write a map of steady states, an array over all axes for each key, whole or not at all.

    The tree, format version 1::

        /               attrs: format, format_version, frictionlab_version, and what holds for the whole map
        /r, /beta ...   (n,) float64, dimension scales
        /KEY            over all axes; float64 (NaN: not known) or ASCII text of fixed length (empty: not known)
        /wall           over all axes, the same at each point: stored once, as the value of what is not written
        /warnings       over all axes, uint32: CF flag_masks and flag_meanings, and flag_sentences (one for each)
        (each with units and long_name, from `frictionlab.schema`)

    ``axes``: name and values of each dimension, the last one fastest; ``attributes``: what holds for the whole map;
    ``words``: what a dimension is that `frictionlab.schema` does not list, a law's parameter; ``flags``: of each key
    that holds flags, meaning -> its bit and what it says.
    """

    def fill(tree: h5py.File) -> None:
        tree.attrs.update(attributes)
        shape, scales = tuple(len(values) for values in axes.values()), []
        for name, values in axes.items():
            axis = tree.create_dataset(name, data=np.asarray(values, dtype=np.float64))
            axis.make_scale(name)
            described = _described(STEADY_STATES.column(name))
            axis.attrs.update(described or {"units": "1", "long_name": words.get(name, name)})
            scales.append(axis)
        plain = {key: v.astype(np.bytes_) if v.dtype.kind == "U" else v for key, v in datasets.items()}
        data = {key: tree.create_dataset(key, data=values) for key, values in plain.items()}
        for key in (name for name in attributes if STEADY_STATES.column(name) is not None):
            word = attributes[key].encode()
            data[key] = tree.create_dataset(key, shape, f"S{len(word)}", fillvalue=word)
        for key, dataset in data.items():
            for dimension, scale in zip(dataset.dims, scales, strict=True):
                dimension.attach_scale(scale)
            dataset.attrs.update(_described(STEADY_STATES.column(key)))
            if meanings := flags.get(key):  # as CF conventions have them, and each in words
                dataset.attrs["flag_masks"] = np.array([bit for bit, _ in meanings.values()], dataset.dtype)
                dataset.attrs["flag_meanings"] = " ".join(meanings)
                dataset.attrs["flag_sentences"] = [sentence for _, sentence in meanings.values()]

    pieces = opening.new_file(fill, format=MAP, format_version=opening.FORMAT_VERSION)
    write_whole(path, pieces, replace=force or is_map)


def _described(column: Column | None) -> dict[str, str]:
    """What a reader's tool shows beside the numbers of a column."""
    return {} if column is None else {"units": column.units, "long_name": column.sentence}


def is_map(path: Path) -> bool:
    """Whether this file is a map of this package."""
    return opening.format_of(path) == MAP
