"""The commands that measure: rows, files, figures, exit statuses; free vibrations of logs and recordings."""

import json
import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from frictionlab.hdf5 import read_tree, write_recording
from frictionlab.recording import Recording
from frictionlab.scene import read_scene
from frictionlab.schema import MEASUREMENTS
from tests.analysis.seen import NATURAL_HZ, motion, seen, steady
from tests.analysis.test_free_vibration import HZ as TAP_HZ
from tests.analysis.test_free_vibration import RATE, decaying
from tests.desk import invoke, rows_of
from tests.logs.samples import log

HZ = ["--natural-frequency", str(NATURAL_HZ)]
LATE = [*HZ, "--transient", "20"]
run = partial(invoke, "analyze")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recordings")
    write_recording(seen(motion(0.5, 0.4), seed=1, seconds=40.0, rate=250.0), path / "one.h5")
    write_recording(seen(motion(1.2, 0.3), seed=2, seconds=40.0, rate=250.0), path / "two.h5")
    write_recording(seen(motion(1.2, 0.3), seed=3, seconds=6.0, rate=250.0), path / "short.h5")
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


@pytest.fixture(scope="module")
def decays(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    tmp_path, generator, paths = tmp_path_factory.mktemp("decays"), np.random.default_rng(1), []
    for number in range(2):
        x = decaying(0.0055 + 0.001 * number) + 1e-6 * generator.standard_normal(round(25 * RATE))
        t = np.arange(len(x)) / RATE
        paths.append(log(tmp_path / f"tap{number}.csv", "time [s],mass [mm],base [mm]", t, 1e3 * x, 0 * x))
    write_recording(Recording(t, x, 0 * x), tmp_path / "tap2.h5")
    return [str(path) for path in (*paths, tmp_path / "tap2.h5")]


def test_each_decay_and_the_average_as_json(decays: list[str]) -> None:
    rows = rows_of(invoke("free-vibration", *decays, "--json", status=0))
    assert [row["source"] for row in rows] == decays
    assert [row["damping_ratio"] for row in rows] == pytest.approx([0.0055, 0.0065, 0.0065], rel=0.01)
    assert rows[0]["mean_natural_frequency_hz"] == pytest.approx(TAP_HZ, rel=1e-3)
    assert rows[1]["natural_frequency_hz"] == pytest.approx(rows[2]["natural_frequency_hz"], rel=1e-6)


def test_what_it_prints_to_paste_is_a_scene(decays: list[str], tmp_path: Path) -> None:
    done = invoke("free-vibration", *decays, status=0)
    shown = done.stdout
    assert "[rig]\nnatural_frequency_hz = 3.12" in shown
    assert "average of 3 taps" in shown
    assert "the median of all" not in done.stderr
    scene = tmp_path / "scene.toml"
    scene.write_text(shown[shown.index("[rig]") :])
    assert read_scene(scene).rig.natural_frequency_hz == pytest.approx(TAP_HZ, rel=1e-3)
    assert read_scene(scene).rig.damping_ratio_u == pytest.approx(4e-4, rel=0.5)  # they differ: 0.0055, 0.0065, 0.0065


def test_taps_that_contradict_each_other_are_named(decays: list[str], tmp_path: Path) -> None:
    t, x, y = np.loadtxt(decays[0], delimiter=",", skiprows=1).T
    other = log(tmp_path / "other.csv", "time [s],mass [mm],base [mm]", 1.1 * t, x, y)  # of another mass
    said = invoke("free-vibration", *decays, other).stderr
    assert "(other): natural_frequency_hz: the tap at" in said
    assert "is -9.1 % from the median of all 4 taps" in said
    assert said.count("the median of all") == 1


def test_a_log_of_the_mass_alone_with_several_taps(tmp_path: Path) -> None:
    x = np.concatenate([decaying(0.0055, 5e-6), decaying(0.0055, 5e-6)])
    x += 1e-6 * np.random.default_rng(2).standard_normal(len(x))
    taps = log(tmp_path / "taps.csv", "time [s],mass [mm]", np.arange(len(x)) / RATE, 1e3 * x)
    scene = tmp_path / "scene.toml"
    scene.write_text("[rig]\nmass_kg = 3.0\n[experiment]\nnormal_force_n = 2.0\n")
    files = ("--plot", tmp_path / "figures", "-o", tmp_path / "taps.jsonl", "--scene", scene)
    row = json.loads(invoke("free-vibration", taps, "--json", *files, status=0).stdout)
    assert [tap["damping_ratio"] for tap in row["taps"]] == pytest.approx([0.0055] * 2, rel=0.01)
    assert not {"measured", "fitted", "time"} & row["taps"][0].keys()
    assert row["taps"][0]["friction_n"] == pytest.approx(row["stiffness_n_per_m"] * row["taps"][0]["friction_m"])
    assert row["damping_ratio"] == row["mean_damping_ratio"] == pytest.approx(0.0055, rel=0.005)
    assert row["friction_m"] == pytest.approx(5e-6, rel=0.02)
    assert row["friction_n"] == pytest.approx(5e-6 * 3.0 * (2 * np.pi * TAP_HZ) ** 2, rel=0.02)
    assert row["friction_coefficient"] == pytest.approx(row["friction_n"] / 2.0)
    assert (tmp_path / "figures" / "taps.free_vibration.png").stat().st_size > 10_000
    lines = [json.loads(line) for line in (tmp_path / "taps.jsonl").read_text().splitlines()]
    assert [(line["tap"], line["status"]) for line in lines] == [(1, "ok"), (2, "ok")]


def test_the_friction_of_an_angle_is_in_degrees_and_no_newtons(tmp_path: Path) -> None:
    x = decaying(0.0055, 5e-6)
    x += 1e-6 * np.random.default_rng(2).standard_normal(len(x))
    swing = log(tmp_path / "swing.csv", "time [s],angle [rad]", np.arange(len(x)) / RATE, x)
    (tmp_path / "scene.toml").write_text('[rig]\nmass_kg = 3.0\nrestoring = "pendulum"\n')
    command = ("free-vibration", swing, "--scene", tmp_path / "scene.toml")
    shown = invoke(*command).stdout
    assert "F/k [deg]" in shown
    assert " deg. For a scene" in shown
    assert "um" not in shown
    assert json.loads(invoke(*command, "--json").stdout)["friction_n"] is None
