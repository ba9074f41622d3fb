"""The command over logs and recordings."""

import json
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from frictionlab.cli import errors_in_one_line
from frictionlab.cli.free_vibration import free_vibration
from frictionlab.hdf5 import write_recording
from frictionlab.recording import Recording
from tests.analysis.test_free_vibration import HZ, RATE, viscous

app = typer.Typer()
app.command()(errors_in_one_line(free_vibration))


@pytest.fixture
def decays(tmp_path: Path) -> list[str]:
    generator, paths = np.random.default_rng(1), []
    for number in range(2):
        x = viscous(0.0055 + 0.001 * number) + 1e-6 * generator.standard_normal(round(25 * RATE))
        t = np.arange(len(x)) / RATE
        paths.append(tmp_path / f"tap{number}.csv")
        table = np.column_stack([t, 1e3 * x, np.zeros(len(t))])
        np.savetxt(paths[-1], table, "%.6f", ",", header="time [s],mass [mm],base [mm]", comments="")
    write_recording(Recording(t, x, 0 * x), tmp_path / "tap2.h5")
    return [str(path) for path in (*paths, tmp_path / "tap2.h5")]


def test_each_decay_and_the_average_as_json(decays: list[str]) -> None:
    result = CliRunner().invoke(app, [*decays, "--json"])
    rows = [json.loads(line) for line in result.stdout.splitlines()]
    assert result.exit_code == 0
    assert [row["source"] for row in rows] == decays
    assert [row["damping_ratio"] for row in rows] == pytest.approx([0.0055, 0.0065, 0.0065], rel=0.01)
    assert rows[0]["mean_natural_frequency_hz"] == pytest.approx(HZ, rel=1e-3)
    assert rows[1]["natural_frequency_hz"] == pytest.approx(rows[2]["natural_frequency_hz"], rel=1e-6)


def test_a_snippet_to_paste(decays: list[str]) -> None:
    result = CliRunner().invoke(app, decays)
    assert result.exit_code == 0
    assert "[rig]\nnatural_frequency_hz = 3.12" in result.stdout
    assert "over 3 tests" in result.stdout


def test_a_log_without_a_decay_fails_and_the_others_go_on(decays: list[str], tmp_path: Path) -> None:
    bad = tmp_path / "flat.csv"
    bad.write_text("time [s],mass [mm],base [mm]\n" + "".join(f"{i / 100},{1.0},{0.0}\n" for i in range(500)))
    result = CliRunner().invoke(app, [str(bad), decays[0], "--json"])
    rows = [json.loads(line) for line in result.stdout.splitlines()]
    assert result.exit_code == 1
    assert rows[0]["status"] == "failed"
    assert "half-cycles above the noise" in rows[0]["reason"]
    assert rows[1]["status"] == "ok"
