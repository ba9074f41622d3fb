"""The batch: one log, one recording, one measurement, one comparison; only what changed is done again."""

import contextlib
import json
import os
from math import cos, pi
from pathlib import Path

import numpy as np
import pytest

import frictionlab as fl
from frictionlab.errors import OutputError
from frictionlab.tables import write_rows
from tests.desk import MAKE, NAMED, ROOT, SCENE, Answer, invoke, rows_of, run_in, set_up, short_of
from tests.logs.samples import sensortool, truth, write

LOGS = ("steel_N1.25_r0.3.csv", "rubber_N1.25_r0.3.csv")
HOSTILE = (
    "`touch PWNED`.csv", "a&b.csv", "$(touch PWNED).csv", "$$(touch PWNED).csv", ";touch PWNED;.csv", "Test 1.csv",
    "steel (2).csv", "12:30.csv", "a.csv", "a.txt", "A.csv", "B.CSV", "it's \"so\".csv", "-rf.csv", "%s.csv",
    "100%.csv", "#1.csv", "grün.csv", "two\nlines.csv", "~.csv", "a.csv.txt",
)  # fmt: skip
CAMPAIGN = f"""{NAMED}broken_off = ["*PWNED*"]
[analysis]
transient_s = 10.0
[[synthetic.tests]]
material = "steel"
normal_forces_n = [1.25]
frequency_ratios = [0.7, 1.4]
friction_coefficient = 0.4
[synthetic]
duration_s = 20.0
"""
SHORT = fl.Scene().changed(analysis={"transient_s": 1.0}, rig={"natural_frequency_hz": 3.13})


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """A clone's top level with two logs, one of which has a name of its own kind."""
    set_up(tmp_path, "configs")
    (tmp_path / "logs").mkdir()
    for name in LOGS:
        (tmp_path / "logs" / name).write_bytes(short_of(ROOT / "sample_data" / name))
    return tmp_path


def make(desk: Path, *words: str) -> Answer:
    return make_without_scene(desk, "SCENE=configs/sample_data.toml", *words)


def make_without_scene(desk: Path, *words: str) -> Answer:
    return run_in(desk, [*MAKE, "LOGS=logs", "OUT=out", *words])


def times(folder: Path) -> dict[str, int]:
    """When each result was written."""
    return {str(p.relative_to(folder)): p.stat().st_mtime_ns for p in folder.rglob("*") if p.is_file()}


def log_text(seconds: float = 6.0, drive: float = 1.0) -> str:
    lines = ["time [s],mass [mm],base [mm]"]
    for i in range(int(seconds * 100)):
        y = 1.8 * cos(2 * pi * drive * i / 100)
        lines.append(f"{i / 100:.2f},{1.1 * y:.6f},{y:.6f}")
    return "\n".join(lines) + "\n"


@pytest.mark.timeout(180)
def test_a_changed_log_redoes_its_chain_alone_and_a_broken_one_is_named(desk: Path) -> None:
    first = make(desk, "-j2")
    assert first.returncode == 0, first.stderr
    assert "2 of 2 logs" in first.stdout
    stems = [Path(log).stem for log in LOGS]
    assert {p.name for p in (desk / "out" / "figures").iterdir()} == {
        f"{stem}.{kind}.png" for stem in stems for kind in ("measurement", "comparison")
    }
    for folder, suffix in (("recordings", "h5"), ("measurements", "jsonl"), ("comparisons", "jsonl")):
        assert {p.name for p in (desk / "out" / folder).iterdir()} == {f"{stem}.{suffix}" for stem in stems}
    before = times(desk / "out")
    log = desk / "logs" / LOGS[0]
    os.utime(log, (log.stat().st_mtime - 1e6,) * 2)  # replaced by an older one
    again = invoke("batch", desk / "logs", "--scene", SCENE, "-o", desk / "out")
    assert "1 of 2 logs" in again.stdout
    there = {Path(name).name for name, at in times(desk / "out").items() if before.get(name) != at and "/" in name}
    written = {name.split(".comparison")[0].split(".measurement")[0] for name in there}
    assert written == {stems[0], f"{stems[0]}.h5", f"{stems[0]}.jsonl", f"{stems[0]}.json"}
    assert again.stdout.splitlines()[-4].startswith("test ")
    assert again.stdout.splitlines()[-1] == f"recordings, measurements, comparisons and figures are in {desk}/out/"
    told = json.loads((desk / "out" / "comparisons" / f"{stems[0]}.jsonl").read_text())
    alone = fl.compare(log, ROOT / "configs" / "sample_data.toml")
    assert told["friction_ratio"] == alone.friction_ratio
    log.write_text("time [s],mass [mm]\n0.000,1.500\n0.004,1.501\n")
    broken = invoke("batch", desk / "logs", "--scene", SCENE, "-o", desk / "out", "--workers", "1")
    assert broken.exit_code != 0
    assert f"{LOGS[0]}  failed: " in broken.stdout
    assert f"\n{stems[1]} " in broken.stdout, "a name of 17 letters is whole"
    (desk / "logs" / LOGS[1]).unlink()
    renamed = invoke("batch", desk / "logs", "--scene", SCENE, "-o", desk / "out", "--workers", "1")
    assert f"results of logs that are not given ({stems[1]})" in " ".join(renamed.stderr.split())


@pytest.mark.timeout(180)
def test_make_runs_nothing_that_stands_in_a_name(desk: Path) -> None:
    (desk / "logs" / LOGS[0]).rename(desk / "logs" / "$(touch PWNED) it's.csv")
    (desk / "logs" / LOGS[1]).unlink()
    for name in HOSTILE:
        (desk / "logs" / name).write_text("")
    (desk / "logs").rename(desk / "my `touch PWNED` logs")
    words = ["LOGS=my `touch PWNED` logs", "OUT=out of $$(touch PWNED)", "SCENE=configs/sample_data.toml"]
    done = run_in(desk, [*MAKE, *words])
    assert not list(desk.rglob("PWNED"))
    assert done.returncode != 0
    assert done.stdout.count("  failed: ") == len(HOSTILE)
    assert (desk / "out of $(touch PWNED)" / "comparisons" / "$(touch PWNED) it's.jsonl").exists()


@pytest.mark.timeout(180)
def test_a_virtual_campaign_is_made_from_its_scene_and_not_made_again(desk: Path) -> None:
    """Among its logs is one whose name is a command, and which was broken off: it is a row of the campaign."""
    (desk / "small.toml").write_text(CAMPAIGN)
    logs = desk / "my `touch PWNED`" / "logs"
    logs.mkdir(parents=True)
    (logs / "$(touch PWNED).csv").write_text("")
    words = ("campaign", "CAMPAIGN_SCENE=small.toml", "CAMPAIGN=my `touch PWNED`")
    first = make(desk, *words)
    assert first.returncode == 0, "it ends well, for its scene says which test was broken off"
    assert "ingest and analyze: 3 of 3 logs" in first.stdout
    assert "evaluate the campaign: 3 tests" in first.stdout
    assert first.stdout.splitlines()[-1] == "the report is my `touch PWNED`/report.html"
    assert {p.name for p in logs.parent.glob("*.csv")} == {
        f"{name}.csv" for name in ("measurements", "friction", "laws", "left_out", "ranking", "drift")
    }
    assert "2 of 3 logs measured" in first.stdout
    assert "$(touch PWNED).csv" in (logs.parent / "measurements.csv").read_text()
    second = make(desk, *words)
    assert second.stdout.startswith("ingest and analyze: 1 of 3 logs to do\n")
    assert "evaluate" not in second.stdout
    assert second.stdout.splitlines()[-1] == first.stdout.splitlines()[-1]
    table = next(line for line in first.stdout.splitlines() if line.startswith("material"))
    assert table in second.stdout.splitlines(), "the friction is said each time"
    assert not list(desk.rglob("PWNED"))
    (logs / "other.csv").write_text("")
    again = ("batch", "--campaign", "--scene", desk / "small.toml", "-o", logs.parent, logs, "--workers", "1")
    assert invoke(*again).exit_code != 0, "a log that failed and was not broken off is a fault"


def test_every_name_has_results_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    drives = {name: 0.8 + 0.02 * n for n, name in enumerate(HOSTILE)}
    for name, drive in drives.items():
        (tmp_path / "logs" / name).write_text(log_text(drive=drive))
    work = fl.batch(tmp_path / "logs", SHORT, output=tmp_path / "out", compare=False)
    with contextlib.closing(work.each(workers=2)) as stopped:
        next(stopped)
    assert not list((tmp_path / "out" / "made").glob("part.*")), "no parts are left"
    rows = dict(zip(work.due, work.run(), strict=True))
    assert {log.name for log in rows} == set(HOSTILE)
    for log, row in rows.items():
        assert row["drive_frequency_hz"] == pytest.approx(drives[log.name], rel=1e-3)
        assert Path(str(row["source"])).exists()
    assert len({row["source"] for row in rows.values()}) == len(HOSTILE)
    assert fl.batch(tmp_path / "logs", SHORT, output=tmp_path / "out", compare=False).due == ()


def test_rows_name_their_recordings_from_where_they_are_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Made in one folder, told in another."""
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "a.csv").write_text(log_text(drive=0.9))
    monkeypatch.chdir(tmp_path / "logs")
    assert [row["status"] for row in fl.batch("a.csv", SHORT, output="../out", compare=False).run()] == ["ok"]
    monkeypatch.chdir(tmp_path)
    work = fl.batch("logs", SHORT, output="out", compare=False)
    assert work.due == ()
    (row,) = work.rows()
    assert row["source"] == str(Path("out/recordings/a.h5"))


def test_what_is_made_again_and_what_is_not(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    for name in ("one.csv", "two.csv"):
        (tmp_path / "logs" / name).write_text(log_text())
    sheet = tmp_path / "logs" / "tests.csv"
    sheet.write_text("log,material\none,steel\ntwo,rubber\n")
    scene = fl.scene_from_tables(
        {"analysis": {"transient_s": 1.0}, "experiment": {"sheet": "tests.csv"}}, folder=tmp_path / "logs"
    )

    def due(scene: fl.Scene = scene) -> list[str]:
        work = fl.batch(tmp_path / "logs", scene, output=tmp_path / "out", compare=False)
        names = [log.stem for log in work.due]
        list(work.run())
        return names

    assert due() == ["one", "two"]
    assert due() == []
    sheet.write_text("log,material\none,steel\ntwo,aramid\n")
    assert due() == ["two"]
    assert due(scene.changed(synthetic={"seed": 3})) == []
    assert due(scene.changed(analysis={"cycles": "last"})) == ["one", "two"]
    assert due() == ["one", "two"]
    (tmp_path / "out" / "recordings" / "one.h5").unlink()
    assert due() == ["one"]
    (tmp_path / "logs" / "two.csv").write_text(log_text(7.0))
    (tmp_path / "out" / "made" / "one.json").write_text("{damaged")
    assert due() == ["one", "two"]


def test_logs_of_one_sensor_each_are_tests_in_pairs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each was a failure of the batch, and a paragraph of `init`: the thesis's own sensors write such logs."""
    logs, data, named = tmp_path / "logs", truth(2000), {"steel_2N_x.csv": 1, "steel_2N_y.csv": 2}
    logs.mkdir()
    for start, late in (("16-47.647", 0), ("16-47.947", 300)):
        write(logs / f"protocol_02-{start}.csv", sensortool(data, 1 + (late > 0), ";", late_ms=late))
    for name, column in named.items():
        rows = "".join(f"{row[0]},{row[column]}\n" for row in data.rows)
        write(logs / name, f"t [s],Distance1 (mm)\n{rows}")
    monkeypatch.setattr("frictionlab.verbs.starting.MOST_READ", 2)  # of the others only the names are looked at
    shown = invoke("init", logs, status=0).stdout
    assert shown.splitlines()[0] == "2 tests"
    assert "check which is the mass's (`log`)" in " ".join(shown.split())
    assert [row["log"] for row in fl.read_rows(logs / "pairs.csv")] == ["steel_2N_x.csv", "protocol_02-16-47.647.csv"]
    scene = fl.read_scene(logs / "frictionlab.toml")
    work = fl.batch(logs, scene, output=tmp_path / "out", compare=False)
    assert [row["status"] for row in work.run()] == ["ok", "ok"]
    found = fl.read_recording(work.results(logs / "steel_2N_x.csv")["recording"])
    np.testing.assert_array_equal(found.base_displacement, data.base)
    write(logs / "steel_2N_y.csv", f"{(logs / 'steel_2N_y.csv').read_text()}8,1\n")
    again = fl.batch(logs, scene, output=tmp_path / "out", compare=False)
    assert [log.name for log in again.due] == ["steel_2N_x.csv"]
    told = rows_of(invoke("ingest", logs, "--dry-run", "--json", status=0))
    assert [Path(row["source"]).name for row in told] == [log.name for log in work.logs]


def test_a_log_that_fails_leaves_no_old_results_and_is_tried_again(tmp_path: Path) -> None:
    log = tmp_path / "a.csv"
    for text, status in ((log_text(), "ok"), ("", "failed"), ("", "failed"), (log_text(), "ok")):
        log.write_text(text)
        work = fl.batch(log, SHORT, output=tmp_path / "out", compare=False)
        assert [row["status"] for row in work.run()] == [status]
        assert [row["status"] for row in work.rows()] == [status]
        assert (tmp_path / "out" / "recordings" / "a.h5").exists() == (status == "ok")
    mine = tmp_path / "out" / "recordings" / "a.h5"
    mine.write_text("mine")
    (row,) = fl.batch(log, SHORT, output=tmp_path / "out", compare=False, again=True).run()
    assert (row["status"], mine.read_text()) == ("failed", "mine")


@pytest.mark.parametrize("compare", [False, True])
def test_a_full_disk_keeps_what_stood(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, compare: bool) -> None:
    (tmp_path / "a.csv").write_text(log_text())
    how = {"output": tmp_path / "out", "compare": compare}
    assert [row["status"] for row in fl.batch(tmp_path / "a.csv", SHORT, **how).run()] == ["ok"]  # type: ignore[arg-type]
    before = {name: (tmp_path / "out" / name).read_bytes() for name in times(tmp_path / "out")}
    written = write_rows

    def no_space(rows: object, path: Path, **options: object) -> None:
        if path.name.startswith("comparison" if compare else "measurement"):
            raise OutputError(f"{path}: No space left on device")
        written(rows, path, **options)  # type: ignore[arg-type]

    monkeypatch.setattr("frictionlab.verbs.chain.write_rows", no_space)
    (row,) = fl.batch(tmp_path / "a.csv", SHORT, again=True, **how).run()  # type: ignore[arg-type]
    assert row["status"] == "failed"
    assert {name: (tmp_path / "out" / name).read_bytes() for name in times(tmp_path / "out")} == before


def test_make_takes_the_scene_that_is_given_or_beside_the_logs_and_no_other_rigs(desk: Path) -> None:
    (desk / "logs" / LOGS[1]).unlink()
    done = make_without_scene(desk)
    assert done.returncode == 2
    assert "no scene: there is no frictionlab.toml" in done.stderr
    assert "the natural frequency is not known" in done.stderr
    (desk / "logs" / "frictionlab.toml").write_text("[rigs]\n")
    done = make_without_scene(desk)
    assert "scene logs/frictionlab.toml, line 1: rigs: unknown key; did you mean rig?" in done.stderr
    assert "nowhere.toml: cannot be read" in make(desk, "SCENE=nowhere.toml").stderr
    said = invoke("batch", "nowhere", "--scene", SCENE).stderr
    assert "no logs in nowhere: there is no such file or folder: expected *.csv" in said
