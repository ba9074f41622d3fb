"""A recording's file: what the contract says, opened by the real readers, refused where it is not what it claims."""

import os
import tempfile
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from frictionlab.errors import OutputError, RecordingError
from frictionlab.hdf5 import is_recording, read_recording, read_tree, write_recording, write_tree
from frictionlab.hdf5.recordings import pieces_of
from frictionlab.recording import LineCount, Quality, QuarantinedLine, Recording, Source, SourceFile
from tests.armour.mutations import new_array, put, virtual

T = np.arange(500, dtype=np.float64) * np.float64(0.004)
SOURCE = Source(
    files=(SourceFile("ü.csv", "ab" * 32, 1234, LineCount(504, 1, 1, 500, 0, 1, 1)), SourceFile("b.csv", "cd" * 32, 9)),
    dialect={"separator": "\t", "sampling_rate_hz": 250.0, "mass_column_number": 2},
    options={"unit": "mm"},
    quarantined=(QuarantinedLine("ü.csv", 7, "x\0\ud800<b>µ", "not a number"),),
    warnings=("one", "two"),
    evidence=("why",),
)
QUALITY = np.zeros(500, np.uint8)
QUALITY[3] = Quality.ERROR_CODE | Quality.INTERPOLATED
RECORDING = Recording(
    T + 17.0, 1e-3 * np.sin(T), 1e-3 * np.cos(T), QUALITY, SOURCE,
    {"material": "steel", "normal_force_n": 10.0, "repeat": 2},
)  # fmt: skip


@pytest.fixture
def path(tmp_path: Path) -> Path:
    place = tmp_path / "test.h5"
    write_recording(RECORDING, place)
    return place


def test_what_is_written_is_read(path: Path) -> None:
    found = read_recording(path)
    for name in ("time", "mass_displacement", "base_displacement", "quality"):
        np.testing.assert_array_equal(getattr(found, name), getattr(RECORDING, name))
    assert dict(found.experiment) == dict(RECORDING.experiment)
    assert found.source.files == SOURCE.files
    assert (found.source.dialect, found.source.options) == (SOURCE.dialect, SOURCE.options)
    assert (found.source.warnings, found.source.evidence) == (SOURCE.warnings, SOURCE.evidence)
    assert found.source.quarantined == (QuarantinedLine("ü.csv", 7, r"x\x00\ud800<b>µ", "not a number"),)


@settings(max_examples=6, deadline=None)
@given(
    st.lists(st.floats(-9e8, 9e8), min_size=2, max_size=40),
    st.dictionaries(
        st.text(min_size=1, max_size=20).filter(lambda s: "\0" not in s and s.isprintable()),
        st.text(max_size=50),
        max_size=4,
    ),
)
def test_any_recording_goes_there_and_back(values: list[float], facts: dict[str, str]) -> None:
    facts.pop("normal_force", None)
    recording = Recording(
        np.arange(float(len(values))), np.array(values), np.array(values[::-1]), source=Source(dialect=facts)
    )
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "a.h5"
        write_recording(recording, place)
        found = read_recording(place)
    np.testing.assert_array_equal(found.mass_displacement, values)
    assert list(found.source.dialect) == list(facts)


def test_the_tree_is_the_contracts(path: Path) -> None:
    with h5py.File(path) as file:
        assert file.attrs["format"] == "frictionlab recording"
        assert file.attrs["format_version"] == 1
        assert file.attrs["Conventions"] == "CF-1.11"
        assert {"title", "created", "frictionlab_version"} <= set(file.attrs)
        assert file["time"].is_scale
        for name, units in (("time", "s"), ("mass_displacement", "m"), ("base_displacement", "m")):
            assert file[name].dtype == np.float64
            assert file[name].attrs["units"] == units
            assert file[name].attrs["long_name"]
        assert file["quality"].dtype == np.uint8
        assert file["quality"].attrs["flag_masks"].tolist() == [1, 2, 4, 8, 16, 32, 64, 128]
        meanings = "error_code out_of_range held interpolated duplicated gap_before no_value not_bridged"
        assert file["quality"].attrs["flag_meanings"] == meanings
        source = file["source"].attrs
        kinds = ("preamble", "header", "data", "blank", "comment", "quarantined")
        assert source["lines_read"] == sum(source[f"lines_{kind}"] for kind in kinds) == 504
        assert file["source/quarantined_line"][...].tolist() == [7]
        assert file["experiment"].attrs["material"] == "steel"
        assert file["experiment"].attrs["normal_force"] == 10.0
        assert file["experiment"].attrs["normal_force_units"] == "N"


def test_only_created_differs_between_two_runs() -> None:
    when = datetime(2026, 1, 1, tzinfo=UTC)
    image = b"".join(pieces_of(RECORDING, created=when))
    assert b"".join(pieces_of(RECORDING, created=when)) == image
    other = b"".join(pieces_of(RECORDING, created=datetime(2027, 2, 3, tzinfo=UTC)))
    seal = 32 + 16  # its digest differs with it
    assert image[:-seal].replace(b"2026-01-01", b"2027-02-03") == other[:-seal]


@pytest.mark.parametrize("engine", ["h5netcdf", "netcdf4"])
def test_xarray_opens_it(engine: str, path: Path) -> None:
    with xr.open_dataset(path, engine=engine, decode_times=False) as data:
        assert dict(data.sizes) == {"time": 500}
        assert list(data.coords) == ["time"]
        assert data["mass_displacement"].attrs["units"] == "m"
        assert data["mass_displacement"].attrs["long_name"] == "displacement of the mass"
        np.testing.assert_array_equal(data["mass_displacement"].sel(time=slice(17.1, 17.2)).time, (T + 17)[25:51])
        np.testing.assert_array_equal(data["base_displacement"], RECORDING.base_displacement)
    with xr.open_dataset(path, engine=engine, group="experiment") as data:
        assert data.attrs["material"] == "steel"
    with xr.open_dataset(path, engine=engine) as data:  # without being asked anything
        assert data["mass_displacement"].dims == ("time",)


def test_an_existing_recording_is_replaced_and_nothing_else(path: Path, tmp_path: Path) -> None:
    write_recording(RECORDING, path)
    other = tmp_path / "notes.txt"
    other.write_text("mine")
    with pytest.raises(OutputError, match="not a file of this kind"):
        write_recording(RECORDING, other)
    with h5py.File(tmp_path / "other.h5", "w"):
        pass
    with pytest.raises(OutputError, match="not a file of this kind"):
        write_recording(RECORDING, tmp_path / "other.h5")
    write_recording(RECORDING, other, force=True)
    assert is_recording(other)


LINK = "got nothing, or a link elsewhere"
BREAK: list[tuple[Callable[[h5py.File], object], str]] = [
    (lambda f: f.attrs.modify("format", "another"), "expected a file of frictionlab recording; got 'another'"),
    (lambda f: f.attrs.modify("format_version", 2), "format_version 1; got 2: update frictionlab"),
    (lambda f: f.pop("mass_displacement"), "expected 'mass_displacement' in this file"),
    (lambda f: put(f, "time", ["a"] * 500), "time: expected .*float64"),
    (lambda f: put(f, "time", np.zeros((5, 100))), r"time: expected shape \(n,\); got \(5, 100\)"),
    (lambda f: put(f, "mass_displacement", h5py.ExternalLink("other.h5", "/mass_displacement")), LINK),
    (lambda f: put(f, "mass_displacement", h5py.SoftLink("/base_displacement")), LINK),
    (
        lambda f: new_array(f, "mass_displacement", shape=(500,), dtype="f8", external=[("/etc/passwd", 0, 4000)]),
        "expected an array stored in this",
    ),
    (lambda f: virtual(f, "mass_displacement"), "expected an array stored in this file"),
    (
        lambda f: new_array(f, "mass_displacement", shape=(1 << 40,), dtype="f8", chunks=(1 << 20,)),
        "claims 8796093022208 bytes in a file of",
    ),
    (lambda f: f["source/file_lines"].write_direct(np.ones((2, 7), np.int64)), "do not add up"),
    (lambda f: f["time"].write_direct(RECORDING.time[::-1].copy()), "expected increasing stamps"),
]


@pytest.mark.parametrize(("change", "words"), BREAK)
def test_a_file_that_is_not_what_it_claims_is_refused(
    change: Callable[[h5py.File], object], words: str, path: Path
) -> None:
    with h5py.File(path, "r+") as file:
        change(file)
    with pytest.raises(RecordingError, match=rf"test\.h5: .*{words}"):
        read_recording(path)


def test_what_is_no_hdf5_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="cannot be read as frictionlab recording"):
        read_recording(tmp_path / "none.h5")
    (tmp_path / "text.h5").write_text("time,mass,base\n")
    with pytest.raises(RecordingError, match="not an HDF5 file, or damaged"):
        read_recording(tmp_path / "text.h5")


def test_no_prefix_of_a_file_is_taken_for_a_recording(tmp_path: Path) -> None:
    """Prefixes of the HDF5 part; behind it stands the seal alone. Each that has a head is tried by a process."""
    path = tmp_path / "test.h5"
    write_recording(Recording(T[:9], T[:9], T[:9], QUALITY[:9], SOURCE, RECORDING.experiment), path)
    with h5py.File(path, "r+"):
        pass  # leaves the seal out
    size = path.stat().st_size
    for left in (size - 1, size - 8, *range(size - 511, 8, -size // 4), 7, 1, 0):
        os.truncate(path, left)
        with pytest.raises(RecordingError, match=r"test\.h5: (damaged|cannot be read as frictionlab recording)"):
            read_recording(path)


def test_a_result_of_many_texts_has_room(tmp_path: Path) -> None:
    names = ["x" * 70_000, *(f"a recording, Übung {k}" for k in range(19_999))]
    tree = {"rows": {"source": names, "energy": np.arange(20_000.0)}}
    write_tree(tree, tmp_path / "a.h5", kind="frictionlab example")
    assert read_tree(tmp_path / "a.h5", kind="frictionlab example")["rows"]["source"] == tree["rows"]["source"]
