"""The ingest command: exit status, one line per fault, outputs whole, JSON Lines and nothing else."""

import re
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest

from frictionlab.errors import UsageError
from frictionlab.hdf5 import read_recording
from frictionlab.verbs.one_test import ingest
from tests.desk import invoke, rows_of
from tests.logs.samples import sensortool, table, truth, write

DATA = truth(300)
HEADER = "time [s],mass [mm],base [mm]"
run = partial(invoke, "ingest")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write(tmp_path / "steel_N10_r0.5.csv", table(DATA, HEADER, ","))


def test_without_output_the_recording_stands_beside_its_log(log: Path) -> None:
    result = run(log, status=0)
    found = read_recording(log.with_suffix(".h5"))
    np.testing.assert_array_equal(found.mass_displacement, DATA.mass)
    assert "plain" in result.stdout


@pytest.mark.parametrize("output", ["out/", "out", "made/of/folders/"])
def test_into_a_folder(output: str, log: Path, tmp_path: Path) -> None:
    other = write(tmp_path / "b.csv.gz", table(DATA, HEADER, ","))
    run(log, other, "-o", f"{tmp_path}/{output}", status=0)
    assert sorted(p.name for p in (tmp_path / output).iterdir()) == ["b.h5", "steel_N10_r0.5.h5"]


def test_one_that_fails_is_told_and_the_others_go_on(log: Path, tmp_path: Path) -> None:
    bad = write(tmp_path / "bad.csv", "not a log\n")
    result = run(bad, log, tmp_path / "none.csv", "-o", tmp_path / "out", status=1)
    assert (tmp_path / "out" / "steel_N10_r0.5.h5").exists()
    assert not (tmp_path / "out" / "bad.h5").exists()
    said = [line.split() for line in result.stdout.splitlines()]
    assert said[0] == ["1", "of", "3", "logs", "ingested"]
    assert [line[0] for line in said[1:] if "failed:" in line] == ["bad.csv", "none.csv"]
    assert said[2][1:5] == ["failed:", "no", "lines", "of"]  # its name once, not twice
    assert "Traceback" not in result.output
    result = run(log, bad, "--json", "-o", tmp_path / "out", status=1)
    good, failed = rows_of(result)
    assert (good["source"], good["status"], failed["status"]) == (str(log), "ok", "failed")
    assert good["samples"] == good["lines_data"] == 300
    kinds = ("preamble", "header", "data", "blank", "comment", "quarantined")
    assert good["lines_read"] == sum(int(str(good[f"lines_{kind}"])) for kind in kinds)
    assert (good["separator"], good["decimal"], good["encoding"]) == (",", ".", "utf-8")


def test_a_dry_run_reports_and_writes_nothing(log: Path) -> None:
    before = sorted(log.parent.iterdir())
    assert "separator comma, decimal mark '.'" in run(log, "--dry-run", status=0).stdout
    (found,) = rows_of(run(log, "--dry-run", "--json"))
    assert found["output"] is None
    assert found["evidence"]
    assert sorted(log.parent.iterdir()) == before


def test_the_scene_and_its_overrides(log: Path, tmp_path: Path) -> None:
    log.write_text(table(DATA, "a,b,c", ","))
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[log]\ntime = "a"\nmass = "b"\nbase = 3\nunit = "um"\n'
        '[experiment]\nname_pattern = "{material}_N{normal_force_n}_r{nominal_frequency_ratio}"\n'
    )
    run(log, "--scene", scene, "--unit", "mm", status=0)
    found = read_recording(log.with_suffix(".h5"))
    np.testing.assert_array_equal(found.base_displacement, DATA.base)
    assert dict(found.experiment) == {"material": "steel", "normal_force_n": 10.0, "nominal_frequency_ratio": 0.5}
    with h5py.File(log.with_suffix(".h5")) as file:
        assert file["experiment"].attrs["normal_force"] == 10.0
        assert file["source/options"].attrs["unit"] == "mm"


def test_one_file_per_sensor(tmp_path: Path) -> None:
    mass = write(tmp_path / "mass.csv", sensortool(DATA, 1, ";"))
    base = write(tmp_path / "base.csv", sensortool(DATA, 2, ";", late_ms=100))
    result = run("--mass-log", mass, "--base-log", base, "-o", tmp_path / "both.h5", "--json", status=0)
    (row,) = rows_of(result)
    assert (row["alignment"], row["lag_s"], row["trimmed_mass_samples"]) == ("absolute time", -0.1, 25)
    assert len(read_recording(tmp_path / "both.h5").source.files) == 2
    run(tmp_path / "both.h5", "-o", tmp_path / "again" / "both.h5", status=0)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ([], "got no logs"),
        (["--mass-log", "a.csv"], "expected both --mass-log and --base-log"),
        (["a.csv", "--mass-log", "b.csv", "--base-log", "c.csv"], "either LOG"),
        (
            ["a.csv", "b.csv", "-o", "one.h5"],
            "expected a folder for 2 logs; got the name of a file (one file per sensor: --mass",
        ),
        (["*.csv"], "*.csv: no file fits this pattern"),
        (["a.csv", "-o", "one.csv"], "a recording is an HDF5 file: expected a name ending in .h5, or a folder"),
        (["a.h5"], "never replaces an input"),
        (["a.csv", "--decimal", ";"], "decimal mark"),
        (["a.csv", "--unit", "parsec"], "setting: log.unit: expected a unit of displacement, one of m, mm"),
        (["a.csv", "--sampling-rate", "-5"], "sampling_rate_hz: expected more than 0"),
    ],
)
def test_a_wrong_command_line_is_status_2(
    words: list[str], reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = run(*words, status=2)
    assert re.search(re.escape(reason), result.stderr), result.stderr
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.parametrize(("name", "more"), [("other.csv", b""), ("again/{}", b"\n")])
def test_the_recording_of_another_log_is_not_replaced_without_force(
    log: Path, tmp_path: Path, name: str, more: bytes
) -> None:
    """Another log has another name or other bytes: two folders may hold logs of one name."""
    place, other = tmp_path / "a.h5", log.parent / name.format(log.name)
    other.parent.mkdir(exist_ok=True)
    other.write_bytes(log.read_bytes() + more)
    assert [run(log, "-o", place).exit_code for _ in range(2)] == [0, 0]
    assert f"holds the recording of {log.name}" in run(other, "-o", place, status=1).stderr
    assert run(other, "-o", place, "--force").exit_code == 0


def test_text_from_logs_is_escaped_and_warnings_name_their_log(log: Path) -> None:
    lines = log.read_text().splitlines()
    lines[50] = "\x1b[31mred\x1b[0m\x07"
    del lines[100:150]
    log.write_text("\n".join(lines) + "\n")
    result = run(log, "--dry-run", status=0)
    assert "\x1b" not in result.output
    assert r"\x1b[31mred" in result.output
    assert re.search(r"warning \(steel_N10_r0\.5\): a gap of 0\.204 s after", result.stderr)
    quiet = run(log, "--quiet")
    assert (quiet.exit_code, quiet.stdout.splitlines()[0], quiet.stderr) == (0, "1 of 1 logs ingested", "")


def test_no_input_is_ever_replaced(tmp_path: Path) -> None:
    mass = write(tmp_path / "m.csv", sensortool(DATA, 1, ";"))
    base = write(tmp_path / "b.h5", sensortool(DATA, 2, ";"))
    (link := tmp_path / "link.h5").hardlink_to(base)
    (soft := tmp_path / "soft.h5").symlink_to(mass)
    before, pair = (mass.read_bytes(), base.read_bytes()), ("--mass-log", mass, "--base-log", base)
    for output in (base, link, soft):
        assert "never replaces an input" in run(*pair, "-o", output, "--force", status=2).stderr
    assert (mass.read_bytes(), base.read_bytes()) == before
    with pytest.raises(UsageError, match="never replaces an input"):
        ingest(mass, base_log=base, output=link, force=True)


def test_like_named_logs_have_recordings_of_their_own(tmp_path: Path) -> None:
    text = table(DATA, HEADER, ",")
    logs = [tmp_path / folder / "a.csv" for folder in ("x", "y")]
    for path in logs:
        path.parent.mkdir()
        write(path, text)
    result = run(*logs, "-o", tmp_path / "both", "--json")
    assert [Path(str(row["output"])).name for row in rows_of(result)] == ["a.csv.h5", "a.csv~2.h5"]
    assert run(*logs).exit_code == 0
    assert all(path.with_suffix(".h5").exists() for path in logs)


def test_files_that_are_no_logs_and_rows_of_the_sheet_without_one_are_named(log: Path) -> None:
    write(log.with_name("more.json"), "{}")
    write(log.with_name("sheet.csv"), f"log,material\n{log.name},steel\nrun9.csv,steel\n")
    write(log.with_name("scene.toml"), "[experiment]\nsheet = 'sheet.csv'\n")
    noted = run(log.parent, "--dry-run", "--scene", log.with_name("scene.toml"), status=0)
    assert "note: passed over: more.json: no log by its name: give the file itself, or save it as CSV" in noted.stderr
    assert "note: rows of sheet.csv without a log, 1 in all: run9.csv" in noted.stderr
    assert "sheet of facts" not in noted.stderr
    assert "note: passed over: sheet.csv: a sheet of facts that the scene" in run(log.parent, "--dry-run").stderr
