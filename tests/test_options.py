"""The reader's options have one home: said in a scene, on the command line or in a notebook they mean the same."""

import json
from dataclasses import fields
from pathlib import Path

import pytest
from typer.testing import CliRunner

import frictionlab as fl
from frictionlab.cli import app
from frictionlab.cli.options import ANALYSIS, LOG

LINES = "\n".join(f"{4000 * i}|{1.5 + 0.001 * (i % 7):.3f}|{2.25 + 0.001 * (i % 5):.3f}" for i in range(100))
LOG_TEXT = f"t|mass|base\n{LINES}\n"
SAID = {"separator": "pipe", "time_unit": "µs", "unit": "µm", "mass": "2", "bridge_s": 0.1}


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "log.txt"
    path.write_text(LOG_TEXT)
    return path


def ingested(log: Path, *words: str) -> dict[str, object]:
    done = CliRunner().invoke(app, ["ingest", str(log), "--dry-run", "--json", *words])
    assert done.exit_code == 0, done.output
    row: dict[str, object] = json.loads(done.stdout)
    return row


def test_an_option_means_the_same_wherever_it_is_said(log: Path) -> None:
    (log.parent / "scene.toml").write_text(
        "[log]\n" + "".join(f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in SAID.items())
    )
    by_scene = ingested(log, "--scene", str(log.parent / "scene.toml"))
    flags = {setting.key: setting.flag for setting in LOG}
    by_line = ingested(log, *(word for key, value in SAID.items() for word in (flags[key], str(value))))
    recording = fl.ingest(log, None, **SAID)  # type: ignore[arg-type]
    assert by_line == by_scene
    assert by_line["sampling_rate_hz"] == pytest.approx(250.0, rel=1e-9)
    assert recording.sampling_rate_hz == pytest.approx(250.0, rel=1e-9)
    assert float(recording.mass_displacement[0]) == pytest.approx(1.5e-6, rel=1e-12)
    assert recording.source.options == {**fl.LogOptions(**SAID).given()}  # type: ignore[arg-type]


def test_every_key_of_the_log_table_is_an_option_of_ingest() -> None:
    helped = CliRunner().invoke(app, ["ingest", "--help-all"], env={"COLUMNS": "200"}).stdout
    helped = " ".join(helped.split())
    assert [setting.key for setting in LOG] == [f.name for f in fields(fl.LogOptions)]
    for setting in LOG:
        assert f" {setting.flag} {setting.metavar} " in helped
        assert setting.words in helped
    for flag in ("--separator", "--decimal", "--encoding", "--time", "--mass", "--base", "--unit", "--time-unit"):
        assert f" {flag} " in helped
    assert "--sampling-rate HZ" in helped


@pytest.mark.parametrize("command", ["analyze", "compare-numeric"])
def test_both_commands_take_the_overrides_of_analysis(command: str) -> None:
    helped = CliRunner().invoke(app, [command, "--help-all"], env={"COLUMNS": "200"}).stdout
    helped = " ".join(helped.split())
    for setting in ANALYSIS:
        assert f" {setting.flag} {setting.metavar} " in helped
    for flag in ("--natural-frequency HZ", "--transient S", "--cycles RULE", "--padding N"):
        assert flag in helped


def test_a_wrong_option_is_one_line_that_names_it(log: Path) -> None:
    done = CliRunner().invoke(app, ["ingest", str(log), "--unit", "parsec", "--time-unit", "mm"])
    assert done.exit_code == 2
    first, second = done.stderr.splitlines()
    assert first.startswith("frictionlab: setting: log.unit: expected a unit of displacement, one of m, mm")
    assert second.startswith("frictionlab: setting: log.time_unit: expected a unit of time, one of s, ms")
