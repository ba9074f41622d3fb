"""Recording <-> HDF5 file.

The tree, format version 1::

    /                     attrs: format = "frictionlab recording", format_version = 1, Conventions, title, created,
                                 frictionlab_version
    /time                 (n,) float64, units "s", dimension scale; start_time where it is known
    /mass_displacement    (n,) float64, units "m", long_name; absent where not measured, as every channel
    /base_displacement    (n,) float64, units "m", long_name
    /mass_velocity, /contact_force, /normal_force ...    (n,) float64, units, long_name, sensor: any further channel
                          (a simulated contact's force has units "m" where it is over the stiffness)
    /quality              (n,) uint8, flag_masks, flag_meanings (see frictionlab.recording.Quality)
    /source               attrs: files, sha256, size_bytes, lines_read, lines_preamble, lines_header, lines_data,
                                 lines_blank, lines_comment, lines_quarantined (all files together; they add up)
        /file_lines       (files, 7) int64: the same counts of each file
        /warnings         (w,) text
        /quarantined_file, /quarantined_line, /quarantined_text, /quarantined_reason    (q,) the first lines set aside

        /dialect          attrs: what was found in the logs
        /options          attrs: what the user had said
    /experiment           attrs: material, normal_force (N), and whatever else is known of this test

Behind the HDF5 part, where other programs do not look, stands its seal (`frictionlab.hdf5.opening`).
"""

from dataclasses import astuple, fields
from datetime import UTC, datetime
from os import PathLike
from pathlib import Path

import h5py
import numpy as np

from frictionlab import recording as model
from frictionlab.errors import RecordingError
from frictionlab.files import check_replaceable, write_whole
from frictionlab.hdf5 import opening
from frictionlab.hdf5.opening import TEXT, array_inside, group_inside, storable, text, write_dataset, write_facts
from frictionlab.recording import DISPLACEMENTS, Channel, LineCount, Recording, Source, quantity_named
from frictionlab.units import UNIT

FORMAT = "frictionlab recording"
_NORMAL_FORCE = ("normal_force_n", "normal_force")  # its name in a scene, and in the file, where units are SI
_QUARANTINED = {"file": np.str_, "line": np.int64, "text": np.str_, "reason": np.str_}
"""Columns of the quarantined lines; the model calls the second ``number``."""


def write_recording(recording: Recording, path: Path, *, force: bool = False) -> None:
    """Write a recording to an HDF5 file, whole or not at all; one there is replaced, with ``force`` whatever is there.

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
    write_whole(path, pieces_of(recording), replace=force or is_recording)


def check_writable(path: Path, *, force: bool = False) -> None:
    """Raise `OutputError` if a recording could not be written here; to be asked before the long work."""
    check_replaceable(path, replace=force or is_recording)


def is_recording(path: Path) -> bool:
    """Whether this file is a recording of this package."""
    return opening.format_of(path) == FORMAT


def pieces_of(recording: Recording, *, created: datetime | None = None) -> tuple[memoryview, bytes]:
    """Give the bytes of a recording's file, and its seal; two files of one recording differ in ``created`` alone."""

    def fill(file: h5py.File) -> None:
        names, measured = " + ".join(f.name for f in recording.source.files) or "made in memory", recording.measured()
        words = ", ".join(map(_words, measured)) if {*measured} != {*DISPLACEMENTS} else "Displacement of mass and base"
        material = recording.experiment.get("material")
        title = storable(f"{words}: {names}" + (f" ({material})" if material else ""))
        when = (created or datetime.now(UTC)).isoformat(timespec="seconds")
        file.attrs.update({"Conventions": "CF-1.11", "title": title, "created": when})
        _write_arrays(file, recording)
        _write_source(file.create_group("source", track_order=True), recording.source)
        long, short = _NORMAL_FORCE
        facts = {short if key == long else key: value for key, value in recording.experiment.items()}
        facts |= {f"{short}_units": "N"} if short in facts else {}
        write_facts(file.create_group("experiment", track_order=True), facts)

    return opening.new_file(fill, format=FORMAT, format_version=opening.FORMAT_VERSION)


def read_recording(path: str | PathLike[str]) -> Recording:
    """Read a recording from its HDF5 file.

    Raises
    ------
    RecordingError
        If it is not a recording, is of a newer format, or is damaged. Links out of the file are not followed.
    """
    with opening.opened(Path(path), FORMAT, "run ingest on its log; a log in HDF5 is one itself") as (file, size):
        return _read(file, size)


def _write_arrays(file: h5py.File, recording: Recording) -> None:
    time = file.create_dataset("time", data=recording.time)
    time.attrs.update({"units": "s", "long_name": "time", "axis": "T"})
    if "start_time" in recording.source.dialect:
        time.attrs["start_time"] = str(recording.source.dialect["start_time"])
    time.make_scale("time")
    for channel in recording.channels:
        dataset = file.create_dataset(channel.name, data=channel.values)
        words = {"units": channel.unit, "long_name": _words(channel.name), "ancillary_variables": "quality"}
        dataset.attrs.update(words | ({"sensor": storable(channel.sensor)} if channel.sensor else {}))
        dataset.dims[0].attach_scale(time)
    quality = file.create_dataset("quality", data=recording.quality)
    quality.attrs["long_name"] = "what was wrong at this sample"
    quality.attrs["flag_masks"] = np.array([flag.value for flag in model.Quality], np.uint8)
    quality.attrs["flag_meanings"] = " ".join(str(flag.name).lower() for flag in model.Quality)
    quality.dims[0].attach_scale(time)


def _words(name: str) -> str:
    """What a channel is, in words: "displacement of the mass", "normal force"."""
    place, _, quantity = name.rpartition("_")
    if place.startswith(("mass", "base", "contact")):
        return f"{quantity} of the {place}".replace("_", " ")
    return name.replace("_", " ")


def _write_source(group: h5py.Group, source: Source) -> None:
    group.attrs["files"] = np.array([storable(f.name) for f in source.files], dtype=TEXT)
    group.attrs["sha256"] = np.array([f.sha256 for f in source.files], dtype=TEXT)
    group.attrs["size_bytes"] = np.array([f.size_bytes for f in source.files], np.int64)
    for kind in fields(LineCount):
        group.attrs[f"lines_{kind.name}"] = getattr(source.lines, kind.name)
    counts = np.array([astuple(f.lines) for f in source.files], np.int64).reshape(-1, len(fields(LineCount)))
    write_dataset(group, "file_lines", counts)
    write_dataset(group, "warnings", source.warnings)
    write_dataset(group, "evidence", source.evidence)
    lines = [astuple(line) for line in source.quarantined]
    for place, (name, kind_) in enumerate(_QUARANTINED.items()):
        column = [line[place] for line in lines]
        write_dataset(group, f"quarantined_{name}", column if kind_ is np.str_ else np.array(column, kind_))

    for name, facts in (("dialect", source.dialect), ("options", source.options)):
        write_facts(group.create_group(name, track_order=True), facts)


def _read(file: h5py.File, size: int) -> Recording:
    named = [name for name in file if quantity_named(name)]
    names = named if {*named} - {*DISPLACEMENTS} else DISPLACEMENTS  # nothing else makes up for one that is missing
    long, short = _NORMAL_FORCE
    facts = opening.facts_of(group_inside(file, "experiment"))
    return Recording(
        array_inside(file, "time", size),
        quality=array_inside(file, "quality", size, np.uint8),
        source=_read_source(group_inside(file, "source"), size),
        experiment={long if key == short else key: value for key, value in facts.items() if key != f"{short}_units"},
        channels=tuple(_read_channel(file, name, size) for name in names),
    )


def _read_channel(file: h5py.File, name: str, size: int) -> Channel:
    values = array_inside(file, name, size)
    unit, known = text(file[name].attrs.get("units", "")), UNIT[quantity_named(name)]
    if unit not in (known, "m" if name == "contact_force" else known):
        raise RecordingError(f"{name}: expected it in {known}; got {unit!r}: convert it, with its attribute units")
    return Channel(name, values, text(file[name].attrs.get("sensor", "")), unit)


def _read_source(group: h5py.Group, size: int) -> Source:
    counts = array_inside(group, "file_lines", size, np.int64, dimensions=2)
    named = zip(group.attrs["files"], group.attrs["sha256"], group.attrs["size_bytes"], counts, strict=True)
    columns = [array_inside(group, f"quarantined_{name}", size, kind) for name, kind in _QUARANTINED.items()]

    return Source(
        files=tuple(
            model.SourceFile(text(n), text(sha), int(bytes_), LineCount(*(int(c) for c in row)))
            for n, sha, bytes_, row in named
        ),
        dialect=opening.facts_of(group_inside(group, "dialect")),
        options=opening.facts_of(group_inside(group, "options")),
        quarantined=tuple(
            model.QuarantinedLine(file, int(line), words, why) for file, line, words, why in zip(*columns, strict=True)
        ),
        warnings=tuple(array_inside(group, "warnings", size, np.str_)),
        evidence=tuple(array_inside(group, "evidence", size, np.str_)),
    )
