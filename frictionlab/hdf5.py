"""Recording <-> HDF5 file; h5py appears only here.

The tree, format version 1::

    /                     attrs: format = "frictionlab recording", format_version = 1, Conventions, title, created,
                                 frictionlab_version
    /time                 (n,) float64, units "s", dimension scale; start_time where it is known
    /mass_displacement    (n,) float64, units "m", long_name
    /base_displacement    (n,) float64, units "m", long_name
    /quality              (n,) uint8, flag_masks, flag_meanings (see frictionlab.recording.Quality)
    /source               attrs: files, sha256, size_bytes, lines_read, lines_preamble, lines_header, lines_data,
                                 lines_blank, lines_comment, lines_quarantined (all files together; they add up)
        /file_lines       (files, 7) int64: the same counts of each file
        /warnings         (w,) text
        /quarantined_file, /quarantined_line, /quarantined_text, /quarantined_reason    (q,) the first lines set aside
        /replaced_index, /replaced_mass, /replaced_base    (k,) what stood in the log where a value was bridged
        /dialect          attrs: what was found in the logs
        /options          attrs: what the user had said
    /experiment           attrs: material, normal_force (N), and whatever else is known of this test
    /entry                NXentry with hard links to the arrays in /entry/data (NXdata), for NeXus readers

The image of the file is built in memory and appears on the disk whole or not at all.
"""

import io
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

import h5py
import numpy as np

from frictionlab import __version__
from frictionlab.errors import RecordingError
from frictionlab.files import check_replaceable, write_whole
from frictionlab.recording import (
    Fact,
    LineCount,
    Quality,
    QuarantinedLine,
    Recording,
    Replaced,
    Source,
    SourceFile,
)

Compression = Literal["lzf", 1, 4, 9, None]
FORMAT = "frictionlab recording"
FORMAT_VERSION = 1
ARRAYS = {
    "mass_displacement": "displacement of the mass",
    "base_displacement": "displacement of the base",
}
_NORMAL_FORCE = ("normal_force_n", "normal_force")  # its name in a scene, and in the file, where units are SI
_TEXT = h5py.string_dtype()
_LONGEST_TEXT = 8000
_MOST_EXPANSION = 2000  # deflate cannot do better than about 1030


def write_recording(recording: Recording, path: Path, *, force: bool = False) -> None:
    """Write a recording to an HDF5 file, whole or not at all.

    Parameters
    ----------
    recording
        What to write.
    path
        Where; an existing recording there is replaced.
    force
        Replace whatever file stands there.

    Raises
    ------
    OutputError
        If the path holds another kind of file, or the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> t = np.arange(0.0, 1.0, 0.01)
    >>> path = Path(tempfile.mkdtemp()) / "test.h5"
    >>> write_recording(Recording(t, t, t, experiment={"material": "steel"}), path)
    >>> read_recording(path).experiment["material"]
    'steel'
    """
    write_whole(path, image_of(recording), replace=force or is_recording)


def check_writable(path: Path, *, force: bool = False) -> None:
    """Raise `OutputError` if a recording could not be written here; to be asked before the long work."""
    check_replaceable(path, replace=force or is_recording)


def is_recording(path: Path) -> bool:
    """Whether this file is a recording of this package."""
    try:
        with h5py.File(path, "r") as file:
            return _text(file.attrs.get("format")) == FORMAT
    except (OSError, RuntimeError, ValueError, KeyError):
        return False


def image_of(
    recording: Recording,
    *,
    created: datetime | None = None,
    precision: Literal["f8", "f4"] = "f8",
    compression: Compression = None,
) -> memoryview:
    """Build the bytes of a recording's file; only ``created`` differs between two images of one recording.

    ``precision`` and ``compression`` of the displacements are knobs of the trade (`frictionlab tradeoff`): commands
    write doubles as they are, which is fastest and loses nothing. gzip shuffles its bytes first.
    """
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", track_order=True) as file:
        _write_root(file, recording, created or datetime.now(UTC))
        _write_arrays(file, recording, precision, compression)
        _write_source(file.create_group("source", track_order=True), recording.source)
        _write_experiment(file.create_group("experiment", track_order=True), recording.experiment)
        _write_nexus(file)
    return buffer.getbuffer()


def read_recording(path: Path) -> Recording:
    """Read a recording from its HDF5 file.

    Raises
    ------
    RecordingError
        If it is not a recording, is of a newer format, or is damaged. Links out of the file are not followed.
    """
    try:
        size = path.stat().st_size
        with h5py.File(path, "r") as file:
            _check_format(file)
            return _read(file, size)
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from error
    except OSError as error:
        reason = error.strerror or "not an HDF5 file, or damaged"
        raise RecordingError(f"{path}: cannot be read as a recording ({reason}): run ingest first") from error
    except (KeyError, RuntimeError, ValueError, TypeError, OverflowError) as error:
        raise RecordingError(f"{path}: damaged recording ({error}): ingest its log again") from error


def _write_root(file: h5py.File, recording: Recording, created: datetime) -> None:
    names = " + ".join(f.name for f in recording.source.files) or "made in memory"
    material = recording.experiment.get("material")
    file.attrs["format"] = FORMAT
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs["Conventions"] = "CF-1.11"
    file.attrs["title"] = _storable(f"Displacement of mass and base: {names}" + (f" ({material})" if material else ""))
    file.attrs["created"] = created.isoformat(timespec="seconds")
    file.attrs["frictionlab_version"] = __version__
    file.attrs["default"] = "entry"


def _write_arrays(file: h5py.File, recording: Recording, precision: str, compression: Compression) -> None:
    filters: dict[str, Any] = {} if compression is None else {"compression": compression, "shuffle": True}
    time = file.create_dataset("time", data=recording.time, **filters)
    time.attrs.update({"units": "s", "long_name": "time", "axis": "T"})
    if "start_time" in recording.source.dialect:
        time.attrs["start_time"] = str(recording.source.dialect["start_time"])
    time.make_scale("time")
    for name, words in ARRAYS.items():
        dataset = file.create_dataset(name, data=getattr(recording, name), dtype=precision, **filters)
        dataset.attrs.update({"units": "m", "long_name": words, "ancillary_variables": "quality"})
        dataset.dims[0].attach_scale(time)
    quality = file.create_dataset("quality", data=recording.quality)
    quality.attrs["long_name"] = "what was wrong at this sample"
    quality.attrs["flag_masks"] = np.array([flag.value for flag in Quality], np.uint8)
    quality.attrs["flag_meanings"] = " ".join(str(flag.name).lower() for flag in Quality)
    quality.dims[0].attach_scale(time)


def _write_source(group: h5py.Group, source: Source) -> None:
    group.attrs["files"] = np.array([_storable(f.name) for f in source.files], dtype=_TEXT)
    group.attrs["sha256"] = np.array([f.sha256 for f in source.files], dtype=_TEXT)
    group.attrs["size_bytes"] = np.array([f.size_bytes for f in source.files], np.int64)
    for kind in fields(LineCount):
        group.attrs[f"lines_{kind.name}"] = getattr(source.lines, kind.name)
    counts = np.array([astuple(f.lines) for f in source.files], np.int64).reshape(-1, len(fields(LineCount)))
    _dataset(group, "file_lines", counts)
    _dataset(group, "warnings", source.warnings)
    _dataset(group, "evidence", source.evidence)
    for kind_, values in _columns_of(source.quarantined).items():
        _dataset(group, f"quarantined_{kind_}", values)
    if source.replaced is not None:
        _dataset(group, "replaced_index", source.replaced.index)
        _dataset(group, "replaced_mass", source.replaced.mass, units="m")
        _dataset(group, "replaced_base", source.replaced.base, units="m")
    for name, facts in (("dialect", source.dialect), ("options", source.options)):
        _write_facts(group.create_group(name, track_order=True), facts)


def _columns_of(lines: Sequence[QuarantinedLine]) -> dict[str, Any]:
    return {
        "file": [line.file for line in lines],
        "line": np.array([line.number for line in lines], np.int64),
        "text": [line.text for line in lines],
        "reason": [line.reason for line in lines],
    }


def _dataset(group: h5py.Group, name: str, values: Any, units: str | None = None) -> None:
    if isinstance(values, np.ndarray):
        dataset = group.create_dataset(name, data=values)
    else:
        dataset = group.create_dataset(name, data=[_storable(v) for v in values], shape=(len(values),), dtype=_TEXT)
    if units is not None:
        dataset.attrs["units"] = units


def _write_experiment(group: h5py.Group, experiment: Mapping[str, Fact]) -> None:
    long, short = _NORMAL_FORCE
    facts = {short if key == long else key: value for key, value in experiment.items()}
    if short in facts:
        facts[f"{short}_units"] = "N"
    _write_facts(group, facts)


def _write_facts(group: h5py.Group, facts: Mapping[str, Fact]) -> None:
    for key, value in facts.items():
        group.attrs[_storable(key)] = _storable(value) if isinstance(value, str) else value


def _write_nexus(file: h5py.File) -> None:
    entry = file.create_group("entry", track_order=True)
    entry.attrs.update({"NX_class": "NXentry", "default": "data"})
    data = entry.create_group("data", track_order=True)
    data.attrs.update({"NX_class": "NXdata", "signal": "mass_displacement", "axes": "time"})
    data.attrs["auxiliary_signals"] = np.array(["base_displacement"], dtype=_TEXT)
    for name in ("time", "mass_displacement", "base_displacement", "quality"):
        data[name] = file[name]
    entry["title"] = file.attrs["title"]


def _storable(text: str) -> str:
    r"""Text that HDF5 can hold: NUL and lone surrogates are written as ``\x00``, and an attribute has at most 64 kB."""
    return re.sub("[\x00\ud800-\udfff]", lambda m: m[0].encode("unicode_escape").decode(), text[:_LONGEST_TEXT])


def _check_format(file: h5py.File) -> None:
    found, version = _text(file.attrs.get("format")), file.attrs.get("format_version")
    if found != FORMAT:
        raise RecordingError(f'expected format "{FORMAT}"; got {found!r}: run ingest on the log first')
    if version is None or int(version) > FORMAT_VERSION:
        raise RecordingError(f"expected format_version {FORMAT_VERSION}; got {version}: update frictionlab")


def _read(file: h5py.File, size: int) -> Recording:
    arrays = {name: _array(file, name, np.float64, size) for name in ("time", *ARRAYS)}
    return Recording(
        time=arrays["time"],
        mass_displacement=arrays["mass_displacement"],
        base_displacement=arrays["base_displacement"],
        quality=_array(file, "quality", np.uint8, size),
        source=_read_source(_group(file, "source"), size),
        experiment=_read_experiment(_group(file, "experiment")),
    )


def _inside(group: h5py.Group, name: str) -> Any:
    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        raise RecordingError(f"{group.name}: expected {name!r} in this file; got nothing, or a link elsewhere")
    return group[name]


def _group(parent: h5py.Group, name: str) -> h5py.Group:
    group = _inside(parent, name)
    if not isinstance(group, h5py.Group):
        raise RecordingError(f"/{name}: expected a group; got a dataset")
    return group


def _dataset_inside(group: h5py.Group, name: str, size: int) -> h5py.Dataset:
    dataset = _inside(group, name)
    if not isinstance(dataset, h5py.Dataset) or dataset.is_virtual or dataset.external:
        raise RecordingError(f"{name}: expected an array stored in this file; got something else")
    if dataset.ndim != 1 and name != "file_lines":
        raise RecordingError(f"{name}: expected one dimension; got shape {dataset.shape}")
    if dataset.nbytes > _MOST_EXPANSION * size:
        raise RecordingError(f"{name}: claims {dataset.nbytes} bytes in a file of {size}")
    return dataset


def _array(group: h5py.Group, name: str, dtype: type[np.generic], size: int) -> np.ndarray:
    dataset = _dataset_inside(group, name, size)
    if dataset.dtype.kind != np.dtype(dtype).kind:
        raise RecordingError(f"{name}: expected {np.dtype(dtype)}; got {dataset.dtype}")
    return np.asarray(dataset[...], dtype=dtype)


def _texts(group: h5py.Group, name: str, size: int) -> list[str]:
    return [_text(value) for value in _dataset_inside(group, name, size)[...]]


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _read_source(group: h5py.Group, size: int) -> Source:
    counts = _array(group, "file_lines", np.int64, size)
    named = zip(group.attrs["files"], group.attrs["sha256"], group.attrs["size_bytes"], counts, strict=True)
    quarantined = zip(
        _texts(group, "quarantined_file", size),
        _array(group, "quarantined_line", np.int64, size).tolist(),
        _texts(group, "quarantined_text", size),
        _texts(group, "quarantined_reason", size),
        strict=True,
    )
    return Source(
        files=tuple(
            SourceFile(_text(n), _text(sha), int(bytes_), LineCount(*(int(c) for c in row)))
            for n, sha, bytes_, row in named
        ),
        dialect=_facts(_group(group, "dialect")),
        options=_facts(_group(group, "options")),
        quarantined=tuple(QuarantinedLine(*line) for line in quarantined),
        warnings=tuple(_texts(group, "warnings", size)),
        evidence=tuple(_texts(group, "evidence", size)),
        replaced=_read_replaced(group, size),
    )


def _read_replaced(group: h5py.Group, size: int) -> Replaced | None:
    if "replaced_index" not in group:
        return None
    return Replaced(
        _array(group, "replaced_index", np.int64, size),
        _array(group, "replaced_mass", np.float64, size),
        _array(group, "replaced_base", np.float64, size),
    )


def _read_experiment(group: h5py.Group) -> dict[str, Fact]:
    long, short = _NORMAL_FORCE
    facts = {long if key == short else key: value for key, value in _facts(group).items()}
    facts.pop(f"{short}_units", None)
    return facts


def _facts(group: h5py.Group) -> dict[str, Fact]:
    return {key: _fact(value) for key, value in group.attrs.items()}


def _fact(value: Any) -> Fact:
    if isinstance(value, (str, bytes)):
        return _text(value)
    number = np.asarray(value)
    if number.ndim or number.dtype.kind not in "iufb":
        raise RecordingError(f"expected a word or a number; got {value!r}")
    return int(number) if number.dtype.kind in "iu" else float(number)


def describe(path: Path) -> list[str]:
    """The tree of any HDF5 file as lines of text: groups, datasets with shape and units, attributes.

    Links out of the file are named, not followed.

    Raises
    ------
    RecordingError
        If the file is not HDF5, or is damaged.
    """
    try:
        with h5py.File(path, "r") as file:
            return [*_attribute_lines(file, ""), *_tree_lines(file, "")]
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not an HDF5 file, or damaged"
        raise RecordingError(f"{path}: cannot be read ({reason})") from error


def _tree_lines(group: h5py.Group, indent: str) -> Iterator[str]:
    for name in group:
        link = group.get(name, getlink=True)
        if isinstance(link, (h5py.ExternalLink, h5py.SoftLink)):
            yield f"{indent}{name} -> {getattr(link, 'filename', '')}{link.path} (not followed)"
            continue
        node = group[name]
        if isinstance(node, h5py.Group):
            yield f"{indent}{name}/"
            yield from _attribute_lines(node, f"{indent}  ")
            yield from _tree_lines(node, f"{indent}  ")
        elif isinstance(node, h5py.Dataset):
            units = _text(node.attrs.get("units", ""))
            yield f"{indent}{name} {node.shape} {node.dtype}{f' [{units}]' if units else ''}"


def _attribute_lines(node: h5py.Group, indent: str) -> Iterator[str]:
    for key, value in node.attrs.items():
        yield f"{indent}{key} = {value.tolist() if hasattr(value, 'tolist') else value}"


def write_tree(tree: Mapping[str, object], path: Path, *, kind: str, force: bool = False) -> None:
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
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", track_order=True) as file:
        file.attrs.update({"format": kind, "format_version": FORMAT_VERSION, "frictionlab_version": __version__})
        _write_branch(file, tree)
    write_whole(path, buffer.getbuffer(), replace=force or (lambda old: _kind_of(old) == kind))


def read_tree(path: Path, *, kind: str) -> dict[str, Any]:
    """Read back what :func:`write_tree` wrote; text datasets come as lists.

    Raises
    ------
    RecordingError
        If the file is of another kind, or damaged. Links out of the file are not followed.
    """
    try:
        with h5py.File(path, "r") as file:
            _check_kind(file, kind)
            return _read_branch(file, path.stat().st_size)
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from error
    except (OSError, KeyError, RuntimeError, ValueError, TypeError) as error:
        raise RecordingError(f"{path}: cannot be read as {kind} ({error}): make it again") from error


def _check_kind(file: h5py.File, kind: str) -> None:
    found = _text(file.attrs.get("format", "an unknown kind"))
    if found != kind:
        raise RecordingError(f"expected a file of {kind}; got {found}")


def _kind_of(path: Path) -> str:
    try:
        with h5py.File(path, "r") as file:
            return _text(file.attrs.get("format"))
    except (OSError, RuntimeError, ValueError, KeyError):
        return ""


def _write_branch(group: h5py.Group, tree: Mapping[str, object]) -> None:
    for name, value in tree.items():
        if isinstance(value, Mapping):
            _write_branch(group.create_group(name, track_order=True), value)
        elif isinstance(value, (str, int, float)):
            group.attrs[name] = _storable(value) if isinstance(value, str) else value
        elif isinstance(value, np.ndarray):
            group.create_dataset(name, data=value)
        elif isinstance(value, (list, tuple)):
            group.create_dataset(name, data=[_storable(str(text)) for text in value], dtype=_TEXT)
        else:
            raise TypeError(f"{name}: expected an array, texts, a word or a number; got {type(value).__name__}")


def _read_branch(group: h5py.Group, size: int) -> dict[str, Any]:
    tree: dict[str, Any] = {key: _fact(value) for key, value in group.attrs.items()}
    for name in group:
        if isinstance(_inside(group, name), h5py.Group):
            tree[name] = _read_branch(_group(group, name), size)
            continue
        dataset = _dataset_inside(group, name, size)
        is_text = h5py.check_string_dtype(dataset.dtype) is not None
        tree[name] = [_text(text) for text in dataset[()]] if is_text else dataset[()]
    return tree
