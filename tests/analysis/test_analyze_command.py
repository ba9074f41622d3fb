"""The command: rows, files, figures, exit statuses."""

import json
import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from frictionlab.hdf5 import read_tree, write_recording
from frictionlab.schema import MEASUREMENTS
from tests.analysis.seen import NATURAL_HZ, recording_of, steady
from tests.desk import invoke

HZ = ["--natural-frequency", str(NATURAL_HZ)]
LATE = [*HZ, "--transient", "20"]


run = partial(invoke, "analyze")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recordings")
    write_recording(recording_of(0.5, 0.4, seed=1, seconds=40.0, rate=250.0), path / "one.h5")
    write_recording(recording_of(1.2, 0.3, seed=2, seconds=40.0, rate=250.0), path / "two.h5")
    write_recording(recording_of(1.2, 0.3, seed=3, seconds=6.0, rate=250.0), path / "short.h5")
    return path


def test_the_h5_output_keeps_the_series(folder: Path, tmp_path: Path) -> None:
    output = tmp_path / "measurements.h5"
    assert run(folder / "one.h5", folder / "short.h5", folder / "two.h5", *LATE, "-o", output, "-q").exit_code == 1
    tree = read_tree(output, kind=MEASUREMENTS.format)
    _, _, energy, _ = steady(0.5, 0.4)
    assert tree["rows"]["status"] == ["ok", "failed", "ok"]
    assert math.isnan(tree["rows"]["energy_per_cycle"][1])
    assert sorted(tree["cycles"]) == ["0", "2"]
    np.testing.assert_allclose(tree["cycles"]["0"]["energy"], energy, rtol=5e-3)
    assert len(tree["cycles"]["0"]["mean_cycle"]["tau"]) >= 64
    assert run(folder / "one.h5", *HZ, "-o", output, "-q").exit_code == 0  # its own kind is replaced


def test_overrides_reach_the_measurement(folder: Path) -> None:
    words = ("--transient", 5, "--cycles", "window:10", "--padding", 1, "--json")
    row = json.loads(run(folder / "one.h5", *HZ, *words).stdout)
    assert (row["transient_s"], row["energy_rule"]) == (5.0, "window:10")
    late = json.loads(run(folder / "one.h5", *LATE, "--json").stdout)
    assert row["drive_frequency_hz"] == pytest.approx(late["drive_frequency_hz"], rel=1e-6)
    assert row["cycles"] > late["cycles"]


def test_without_a_transient_it_is_found_and_all_settled_cycles_are_used(folder: Path) -> None:
    short, one = (json.loads(run(folder / name, *HZ, "--json").stdout) for name in ("short.h5", "one.h5"))
    assert (short["status"], one["energy_rule"], one["transient_s"]) == ("ok", "all", 0.0)
    assert one["energy_per_cycle"] == pytest.approx(steady(0.5, 0.4)[2], rel=1e-3)


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (("--transient", -1), "analysis.transient_s"),
        (("--cycles", "first"), "expected 'last', 'all' or 'window:SECONDS'"),
        (("--padding", 0), "analysis.padding"),
        (("--natural-frequency", 0), "rig.natural_frequency_hz"),
        (("-o", "result.txt"), "expected an output ending in"),
        (("-o", "/dev/null/result.h5"), "/dev/null is no folder"),
        (("--scene", "nothing.toml"), "scene nothing.toml: cannot be read"),
    ],
)
def test_a_wrong_command_line_is_said_in_one_line(folder: Path, words: tuple[object, ...], fault: str) -> None:
    result = run(folder / "one.h5", *words)
    assert result.exit_code == 2
    assert fault in result.stderr
    assert len(result.stderr.splitlines()) == 1
