"""The batch: one log, one recording, one measurement, one comparison; only what changed is done again."""

import os
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.desk import BIN, MAKE, ROOT, run_in, set_up

if TYPE_CHECKING:
    from subprocess import CompletedProcess

LOGS = ("steel_N1.25_r0.3.csv", "aramid_N1.25_r1.2.csv")


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """A clone's top level with two logs, one of which has a name of its own kind."""
    set_up(tmp_path, "configs")
    (tmp_path / "logs").mkdir()
    for name in LOGS:
        (tmp_path / "logs" / name).write_bytes((ROOT / "sample_data" / name).read_bytes())
    return tmp_path


def make(desk: Path, *words: str) -> "CompletedProcess[str]":
    return run_in(desk, [*MAKE, "LOGS=logs", "OUT=out", *words])


def work(done: "CompletedProcess[str]") -> list[str]:
    """What was done, as (command, input) words."""
    lines = [line.split() for line in done.stdout.splitlines() if line.startswith(str(BIN / "frictionlab"))]
    return [f"{words[1]} {Path(words[2]).stem}" for words in lines]


@pytest.mark.timeout(180)
def test_touching_one_log_redoes_that_chain_alone(desk: Path) -> None:
    first = make(desk, "-j2")
    assert first.returncode == 0, first.stderr
    assert len(work(first)) == 6
    assert {p.name for p in (desk / "out" / "figures").iterdir()} == {
        f"{Path(log).stem}.{kind}.png" for log in LOGS for kind in ("measurement", "comparison")
    }
    assert work(make(desk)) == []
    log = desk / "logs" / LOGS[0]
    later = log.stat().st_mtime + 60
    os.utime(log, (later, later))
    for recording in (desk / "out").rglob("aramid*"):
        os.utime(recording, (later, later))
    stem = Path(LOGS[0]).stem
    assert sorted(work(make(desk))) == [f"analyze {stem}", f"compare-numeric {stem}", f"ingest {stem}"]


@pytest.mark.timeout(180)
def test_a_broken_log_is_named_and_the_others_go_on(desk: Path) -> None:
    (desk / "logs" / LOGS[0]).write_text("time [s],mass [mm]\n0.000,1.500\n0.004,1.501\n")
    done = make(desk)
    assert done.returncode != 0
    assert f"{Path(LOGS[0]).stem}.jsonl (the reason stands above)" in done.stderr
    assert LOGS[0] in done.stderr
    assert "aramid_N1.25_r1.2" in done.stdout.splitlines()[-2]


def test_a_folder_without_logs_is_said(desk: Path) -> None:
    done = make(desk, "LOGS=nowhere")
    assert done.returncode == 2
    assert "no logs in nowhere: expected *.csv" in done.stderr


def test_help_lists_every_documented_target(desk: Path) -> None:
    helped = make(desk, "help").stdout
    assert all(f"make {target} " in helped for target in ("all", "test", "check", "sample-data", "clean"))
