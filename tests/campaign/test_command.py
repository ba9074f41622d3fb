"""The command, as a user runs it."""

import json
from pathlib import Path

import pytest

from frictionlab.hdf5 import write_tree
from frictionlab.tables import read_rows, write_rows
from tests.campaign.fabricate import small_campaign
from tests.desk import NAMED, Run, invoke


def test_measurements_in_several_files_one_of_them_damaged(run: Run, tmp_path: Path) -> None:
    rows = small_campaign()
    write_rows(rows[:20], tmp_path / "a.csv")
    write_rows(rows[20:], tmp_path / "b.jsonl")
    (tmp_path / "c.jsonl").write_text("{damaged\n")
    (tmp_path / "scene.toml").write_text(NAMED)
    done = run("campaign", "a.csv", "b.jsonl", "c.jsonl", "--scene", "scene.toml", "-o", "out", status=1)
    assert "c.jsonl: c.jsonl" not in done.stderr
    assert "c.jsonl, line 1: expected a JSON object" in done.stderr
    told = read_rows(tmp_path / "out" / "measurements.csv")
    assert len(told) == len(rows) + 1
    failed = {row["source"]: row["reason"] for row in told if row["status"] == "failed"}
    assert set(failed) == {"c.jsonl", rows[-1]["source"]}
    assert failed[rows[-1]["source"]] == rows[-1]["reason"]
    assert [row["tests"] for row in read_rows(tmp_path / "out" / "friction.csv")] == [5] * 9
    shown = done.stdout.splitlines()
    assert max(map(len, shown[:10])) <= 80
    assert shown[0].split() == ["material", "N", "[N]", "tests", "F", "[N]", "mu"]
    assert any(line.startswith("by energy: 1 ") for line in shown)
    assert "%/h of the energy, " in done.stdout
    assert "rubber" in done.stdout
    assert (tmp_path / "out" / "report.html").stat().st_size > 100_000
    figures = {path.name for path in (tmp_path / "out" / "figures").iterdir()}
    assert figures == {f"{name.partition('.')[0]}.{end}" for name in figures for end in ("svg", "pdf", "png")}
    assert "irregularity.pdf" in figures


@pytest.mark.parametrize(
    ("name", "line", "fault"),
    [
        ("gone.jsonl", None, "all 1 tests failed: there is no such file"),
        ("m.jsonl", {"source": "a.csv", "status": "failed", "reason": "no drive"}, "all 1 tests failed: no drive (1"),
        ("m.jsonl", {"source": "a.h5", "status": "ok"}, "tests failed: no material"),
        ("m.jsonl", {**small_campaign()[0], "frequency_ratio": None}, "tests failed: no frequency_ratio: give [rig]"),
    ],
)
def test_where_nothing_can_be_evaluated_no_report_takes_the_place_of_one(
    run: Run, tmp_path: Path, name: str, line: dict[str, object] | None, fault: str
) -> None:
    if line is not None:
        (tmp_path / name).write_text(json.dumps(line) + "\n")
    done = run("campaign", name, "-o", "out", "--quiet")
    assert (done.exit_code, done.stdout) == (1, "")
    assert fault in done.stderr
    assert not (tmp_path / "out" / "report.html").exists()


def test_recordings_are_answered_in_one_sentence(run: Run, tmp_path: Path) -> None:
    for name in ("a.h5", "b.h5", "c.h5"):
        write_tree({}, tmp_path / name, kind="frictionlab recording")
    done = run("campaign", "a.h5", "b.h5", "c.h5", "-o", "out", status=1)
    (said,) = done.stderr.strip().splitlines()
    assert "all 3 tests failed: a recording; campaign evaluates measurements: `frictionlab analyze" in said


def test_a_campaign_that_was_stopped_is_not_evaluated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One of 13 logs was done: a report of one test stood there as if it were all."""
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "steel_N1_r0.3.csv").write_text("")
    (tmp_path / "scene.toml").write_text(NAMED)

    def interrupted() -> object:
        raise KeyboardInterrupt

    monkeypatch.setattr("frictionlab.verbs.chain.Batch.each", lambda *_, **__: iter(interrupted, None))
    done = invoke("batch", tmp_path / "logs", "--campaign", "--scene", tmp_path / "scene.toml", "-o", tmp_path / "out")
    assert done.exit_code == 130
    assert "stopped: 0 inputs are done" in done.stderr
    assert "not evaluated: the same command goes on" in done.stderr
    assert not (tmp_path / "out" / "report.html").exists()
