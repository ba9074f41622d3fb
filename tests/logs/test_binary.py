"""Binary logs, written by the libraries that own the formats, and packed ones: the same columns as the text."""

import gzip
import json
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Literal

import h5py
import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from nptdms import ChannelObject, TdmsWriter

from frictionlab.errors import LogError
from frictionlab.hdf5 import write_recording
from frictionlab.logs import LogOptions, read_log, read_mass_log, read_two_logs
from frictionlab.recording import Recording
from tests.logs.samples import assert_is, matlab, table, truth, zipped

DATA = truth(200)
TEXT = table(DATA, "time [s],mass [mm],base [mm]", ",").encode()
T, X, Y = DATA.columns


def workbook(path: Path, *rows: tuple[object, ...]) -> Path:
    book = openpyxl.Workbook(write_only=True)  # such a file does not say how wide its sheet is
    sheet = book.create_sheet()
    for row in rows:
        sheet.append(row)
    book.create_sheet("Notes").append(["nothing here"])
    book.save(path)
    return path


def assert_is_the_log(recording: Recording) -> None:
    assert_is(recording, DATA)
    assert recording.source.lines.data == len(DATA.rows)
    assert len(recording.source.files[0].sha256) == 64
    assert recording.source.files[0].size_bytes > 0


PACKED: dict[str, Callable[[bytes], bytes]] = {"gzip": gzip.compress, "zip": lambda data: zipped(data, "test.csv")}


@pytest.mark.parametrize("kind", PACKED)
def test_a_packed_log_is_the_log_or_is_refused(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, raw = tmp_path / "log.bin", PACKED[kind](TEXT)
    path.write_bytes(raw)
    recording = read_log(path)
    assert_is_the_log(recording)
    assert recording.source.dialect["compression"] == kind
    assert recording.source.files[0].size_bytes == path.stat().st_size
    for size in range(40, len(raw) - 1, 391):
        path.write_bytes(raw[:size])
        with pytest.raises(LogError, match=rf"{kind} data|empty|no lines|lines of data|not utf|two ways|more than one"):
            read_log(path)
    monkeypatch.setattr("frictionlab.logs.text.FREE", 1 << 16)
    path.write_bytes(PACKED[kind](b"t [s],x [mm],y [mm]\n" + b"0,0,0\n" * 400_000))
    with pytest.raises(LogError, match=r"unpacks to more than .* accepted are 0.0655 MB, or 50 times the file"):
        read_log(path)


def test_a_zip_of_two_logs_is_refused_with_their_names(tmp_path: Path) -> None:
    path = tmp_path / "logs.zip"
    path.write_bytes(zipped(TEXT, "one.csv", "two.csv"))
    with pytest.raises(LogError, match=r"archive of 2 files \(one.csv, two.csv\): expected one log"):
        read_log(path)


@pytest.mark.parametrize("version", ["4", "5", "7.3"])
def test_matlab_of_every_version(version: Literal["4", "5", "7.3"], tmp_path: Path) -> None:
    path = matlab(tmp_path / "log.mat", version, t=T, x=X, y=Y)
    recording = read_log(path, LogOptions(unit="mm"))
    assert_is_the_log(recording)
    assert recording.source.dialect["layout"] == "MATLAB"

    vector = np.atleast_2d(T).T
    mass, base = (matlab(tmp_path / f"{name}.mat", version, t=vector, **{name: v}) for name, v in (("x", X), ("y", Y)))
    assert_is(read_two_logs(mass, base, LogOptions(unit="mm", lag_s=0.0)), DATA)


def test_a_matrix_has_a_column_for_each_channel(tmp_path: Path) -> None:
    path = matlab(tmp_path / "log.mat", "7.3", data=np.array([T, X, Y]))
    options = LogOptions(time="data1", mass="data2", base=3, unit="mm")
    assert_is_the_log(read_log(path, options))
    path = matlab(tmp_path / "named.mat", "7.3", t=T, x=X, y=Y)
    with h5py.File(path, "r+") as file:
        file["x"].attrs["units"] = file["y"].attrs["units"] = "mm"
    assert_is_the_log(read_log(path))


def test_matlab_that_holds_no_vectors_is_named(tmp_path: Path) -> None:
    path = matlab(tmp_path / "log.mat", "5", note="steel on brass")
    with pytest.raises(LogError, match=r"got note \(char\): save the columns of tables"):
        read_log(path)
    path.write_bytes(path.read_bytes()[:150])
    with pytest.raises(LogError, match=r"damaged|expected vectors|empty"):
        read_log(path)
    alone = read_mass_log(matlab(tmp_path / "tap.mat", "5", t=T, x=X), LogOptions(unit="mm"))
    assert np.array_equal(alone.mass_displacement, DATA.mass)
    assert not alone.base_displacement.any()


def test_a_row_without_a_stamp_is_set_aside_and_a_missing_value_flagged(tmp_path: Path) -> None:
    t, x = T.copy(), X.copy()
    t[7], x[20] = np.nan, np.inf
    recording = read_log(matlab(tmp_path / "log.mat", "5", t=t, x=x, y=Y), LogOptions(unit="mm"))
    assert len(recording) == 199
    assert recording.source.quarantined[0].number == 8
    assert recording.flag_counts()["no_value"] == 1


def test_excel_with_dates_and_a_hole(tmp_path: Path) -> None:
    start = datetime(2024, 9, 14, 2, 16, 47, tzinfo=UTC).replace(tzinfo=None)
    rows: list[tuple[object, ...]] = [
        (start + timedelta(seconds=0.004 * i), None if i == 9 else x, y)
        for i, (x, y) in enumerate(zip(X.tolist(), Y.tolist(), strict=True))
    ]
    recording = read_log(workbook(tmp_path / "log.xlsx", ("Date time", "mass [mm]", "base [mm]"), *rows))
    assert recording.time == pytest.approx(DATA.time, abs=2e-6)
    assert recording.flag_counts()["no_value"] == 1
    assert recording.source.dialect["start_time"] == "2024-09-14T02:16:47.000+00:00"


def test_a_recording_is_no_log_and_excel_with_two_sheets_of_numbers_is_asked_about(tmp_path: Path) -> None:
    write_recording(Recording(DATA.time, DATA.mass, DATA.base), tmp_path / "a.h5")
    with pytest.raises(LogError, match="a recording of frictionlab, not a log"):
        read_log(tmp_path / "a.h5")
    book = openpyxl.Workbook()
    for sheet in (book.active, book.create_sheet("second")):
        for row in DATA.rows:
            sheet.append([float(cell) for cell in row])
    book.save(tmp_path / "log.xlsx")
    with pytest.raises(LogError, match=r"several sheets hold numbers \('Sheet', 'second'\)"):
        read_log(tmp_path / "log.xlsx")


def test_parquet_with_moments_and_words(tmp_path: Path) -> None:
    start = np.datetime64("2024-09-14T02:16:47.000000000")
    stamps = start + (np.round(T * 1e9)).astype("timedelta64[ns]")
    columns = {"stamp": stamps, "mass_mm": X, "base_mm": Y, "note": ["ok"] * len(T)}
    pq.write_table(pa.table(columns), tmp_path / "log.parquet")
    recording = read_log(tmp_path / "log.parquet", LogOptions(time="stamp"))
    assert recording.time == pytest.approx(DATA.time, abs=1e-6)
    assert np.array_equal(recording.mass_displacement, DATA.mass)
    pq.write_table(pa.table({"t": T, "x": X, "y": Y}), tmp_path / "log.parquet")
    assert_is_the_log(read_log(tmp_path / "log.parquet", LogOptions(unit="mm")))


def test_a_parquet_file_that_asks_for_too_much_memory_is_refused(tmp_path: Path) -> None:
    zeros = pa.table({"x": np.zeros(40_000_000, np.int8)})
    pq.write_table(zeros, tmp_path / "log.parquet")
    with pytest.raises(LogError, match=r"asks for 0.32 GB of numbers: accepted are 0.268 GB"):
        read_log(tmp_path / "log.parquet")


def test_tdms_states_its_rate_and_units(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, facts = tmp_path / "log.tdms", {"wf_increment": 0.004, "unit_string": "mm"}
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("rig", "mass", X, facts), ChannelObject("rig", "base", Y, facts)])
    recording = read_log(path)
    assert np.array_equal(recording.mass_displacement, DATA.mass)
    assert recording.sampling_rate_hz == pytest.approx(250.0)
    path.write_bytes(b"TDSm" + bytes(100))
    with pytest.raises(LogError, match="a damaged tdms file"):
        read_log(path)
    monkeypatch.setattr("frictionlab.logs.containers.find_spec", lambda _: None)
    with pytest.raises(LogError, match=r"needs npTDMS: pip install npTDMS"):
        read_log(path)


CONTENT: dict[str, object] = {"t": T, "mass [mm]": X, "base [mm]": Y}
ROWS = [{"t": t, "mass [mm]": x, "base [mm]": y} for t, x, y in zip(T.tolist(), X.tolist(), Y.tolist(), strict=True)]
LISTS = {name: np.asarray(values).tolist() for name, values in CONTENT.items()}


@pytest.mark.parametrize(
    ("content", "options"),
    [
        (LISTS, LogOptions()),
        (ROWS, LogOptions()),
        ({"data": ROWS}, LogOptions()),
        ({"columns": list(LISTS), "data": np.column_stack(list(CONTENT.values())).tolist()}, LogOptions()),  # type: ignore[arg-type]
        ({"columns": ["t", "x", "y"], "units": ["s", "mm", "mm"], "data": list(LISTS.values())}, LogOptions()),
        ({"run": LISTS, "note": "x"}, LogOptions(variable="run")),
        ([LISTS, LISTS], LogOptions(test=2)),
        ({"a": LISTS, "b": LISTS}, LogOptions(test="1")),
        (dict(zip("txy", LISTS.values(), strict=True)) | {"units": {"x": "mm", "y": "mm"}}, LogOptions()),
    ],
)
def test_json_of_any_shape_is_the_log(content: object, options: LogOptions, tmp_path: Path) -> None:
    (tmp_path / "log.json").write_text(json.dumps(content))
    assert_is_the_log(read_log(tmp_path / "log.json", options))


def test_json_lines_are_a_log_and_bytes_that_are_no_text_are_none(tmp_path: Path) -> None:
    rows = zip((np.arange(50) / 100).tolist(), np.sin(np.arange(50)).tolist(), strict=True)
    (path := tmp_path / "a.jsonl").write_text("".join(f'{{"t_s": {t}, "x_mm": {x}, "y_mm": 1.5}}\n' for t, x in rows))
    np.testing.assert_allclose(read_log(path).mass_displacement, 1e-3 * np.sin(np.arange(50)), rtol=1e-12)
    (path := tmp_path / "a.csv").write_bytes(np.random.default_rng(1).bytes(5000))
    with pytest.raises(LogError, match=r"not text: 1\d% of its bytes are no characters"):
        read_log(path)


def test_arrays_of_numpy_are_the_log(tmp_path: Path) -> None:
    np.savez(tmp_path / "log.npz", t=T, x=X, y=Y)
    assert_is_the_log(read_log(tmp_path / "log.npz", LogOptions(unit="mm")))
    np.save(tmp_path / "log.npy", np.column_stack([T, X, Y]))
    assert_is_the_log(read_log(tmp_path / "log.npy", LogOptions(unit="mm", time=1, mass=2, base=3)))
    table = np.array(list(zip(T, X, Y, strict=True)), dtype=[("t", "f8"), ("x", "f8"), ("y", "f8")])
    np.save(tmp_path / "table.npy", table)
    assert_is_the_log(read_log(tmp_path / "table.npy", LogOptions(unit="mm")))
    np.save(tmp_path / "one.npy", X)
    alone = read_log(tmp_path / "one.npy", LogOptions(unit="mm", sampling_rate_hz=100.0))
    assert list(alone.measured()) == ["mass_displacement"]
    np.save(tmp_path / "bad.npy", np.array([{}], dtype=object), allow_pickle=True)
    with pytest.raises(LogError, match="a damaged numpy file"):
        read_log(tmp_path / "bad.npy")


def test_cells_and_structures_of_matlab_are_tests(tmp_path: Path) -> None:
    cells = {name: np.empty(2, dtype=object) for name in ("t", "x", "y")}
    for name, values in (("t", T), ("x", X), ("y", Y)):
        cells[name][0], cells[name][1] = values[:150], values
    path = matlab(tmp_path / "log.mat", "5", **cells)
    with pytest.raises(LogError, match=r"holds 2 tests: which one\? give --test 1 to --test 2"):
        read_log(path, LogOptions(unit="mm"))
    assert_is_the_log(read_log(path, LogOptions(unit="mm", test=2)))
    assert len(read_log(path, LogOptions(unit="mm", test=1))) == 150
    with pytest.raises(LogError, match="--test 3: expected one of 1 to 2"):
        read_log(path, LogOptions(unit="mm", test=3))
    for name in ("t", "x", "y"):  # of one length, they were "no arrays of numbers"
        cells[name][0] = cells[name][1]
    assert_is_the_log(read_log(matlab(path, "5", **cells), LogOptions(unit="mm", test=1)))
    table, columns = np.empty(2, dtype=object), np.empty(3, dtype=object)
    table[:] = [np.stack([T, Y, X], axis=1), np.stack([T, X, Y], axis=1)[:150]]
    columns[:] = [T, Y, X]
    for test, made in ((1, table), (None, columns)):
        which = LogOptions(test=test, time=1, mass=3, base=2, unit="mm")
        assert_is_the_log(read_log(matlab(path, "5", log=made), which))
    with h5py.File(path, "w") as file:  # as MATLAB 7.3 has them: references
        for name, of in (("t", T), ("x", X), ("y", Y)):
            parts = [file.create_dataset(f"#refs#/{name}{i}", data=of[None, :n]).ref for i, n in enumerate((150, None))]
            file.create_dataset(name, data=parts, dtype=h5py.ref_dtype).attrs["MATLAB_class"] = np.bytes_("cell")
    assert_is_the_log(read_log(path, LogOptions(unit="mm", test=2)))
    path = matlab(tmp_path / "two.mat", "5", first={"t": T, "x": X, "y": Y}, second={"p": T})
    assert_is_the_log(read_log(path, LogOptions(unit="mm", variable="first")))
    with pytest.raises(LogError, match="--variable 'third': expected one of first, second"):
        read_log(path, LogOptions(variable="third"))
