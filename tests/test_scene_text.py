"""Scenes as text: every key documented, one to fill in, one that is read back; found by its name."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import frictionlab as fl
from frictionlab.errors import UsageError
from frictionlab.scene import Scene, find_scene, read_scene, scene_from_tables
from frictionlab.scene.text import tables_of_keys, template, to_toml, value_text
from tests.desk import ROOT, Run, log_of, short_of

CONFIGS = ROOT / "configs"


def test_every_key_has_its_sentence() -> None:
    missing = [f"{t.head} {key}" for t in tables_of_keys() for key, (words, _) in t.keys.items() if not words]
    assert not missing
    assert {table.head for table in tables_of_keys()} >= {f"[{name}]" for name in Scene().model_dump()}


def test_the_template_is_a_scene_of_defaults_and_so_is_it_with_its_defaults_switched_on() -> None:
    assert scene_from_tables(tomllib.loads(template())) == Scene()
    plain = re.sub(r"(?m)^# \[\[.*\n(?:#.*\n)*", "", template())
    on = re.sub(r"(?m)^# (?=[a-z]\w* = \S)", "", plain)
    assert len(re.findall(r"(?m)^[a-z]", on)) > 30
    assert scene_from_tables(tomllib.loads(on)) == Scene()


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*.toml")), ids=lambda path: path.name)
def test_a_scene_is_read_back_from_its_text(path: Path) -> None:
    scene = read_scene(path)
    assert path.name == "all_keys.toml" or scene.rig.natural_frequency is not None
    assert scene_from_tables(tomllib.loads(to_toml(scene)), folder=scene.folder) == scene


@settings(max_examples=50, suppress_health_check=[HealthCheck.too_slow])  # on a busy machine its letters take long
@given(
    st.recursive(
        st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False)
        | st.text(st.characters(exclude_categories=["Cs"])),
        lambda inner: st.lists(inner, max_size=3)
        | st.dictionaries(st.text(st.characters(exclude_categories=["Cs"])), inner, max_size=3),
        max_leaves=5,
    )
)  # fmt: skip
def test_any_value_is_read_back_from_its_text(value: object) -> None:
    assert tomllib.loads(f"key = {value_text(value)}")["key"] == value


def test_show_prints_a_scene_that_can_be_pasted(run: Run) -> None:
    pasted = scene_from_tables(tomllib.loads(run("show", CONFIGS / "sample_data.toml").stdout))
    assert pasted.model_dump() == read_scene(CONFIGS / "sample_data.toml").model_dump()


def test_init_writes_a_scene_once(run: Run, tmp_path: Path) -> None:
    assert 'next: frictionlab batch "my tests"' in run("init", "my tests", status=0).stdout
    path = tmp_path / "my tests" / "frictionlab.toml"
    assert read_scene(path) == Scene()
    path.write_text("[rig]\nmass_kg = 2.0\n")
    assert "give --force" in run("init", "my tests", status=2).stderr
    assert run("init", "my tests", "--force", "--all", "--quiet").stdout == ""
    assert path.read_text(encoding="utf-8") == template()
    with pytest.raises(UsageError, match="exists: fill it in"):
        fl.init(tmp_path / "my tests")


def tap(path: Path, seed: float, tuned: float = 1.0) -> None:
    t = np.arange(3000) / 250.0
    log_of(path, {"t [s]": t, "mass [m]": 1e-3 * np.exp(-0.01 * 19.67 * t) * np.cos(19.67 * tuned * t + seed)})


def test_init_finds_taps_names_and_sheet(run: Run, tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    for log in (ROOT / "sample_data").glob("steel*.csv"):
        (logs / log.name).write_bytes(log.read_bytes())
    tap(logs / "tap1.csv", 0.0)
    (logs / "broken.csv").write_text("file;g\nsteel_N1.25_r0.3.csv;9\nsteel_N1.25_r1.2.csv;9\n")
    (logs / "more").mkdir()
    tap(logs / "more" / "steel.csv", 1.0)
    assert run("init", "logs/more").stdout.endswith("next: frictionlab free-vibration logs/more\n")
    (logs / "more" / "frf.csv").write_text("r,amplitude [Y]\n0.5,1.1\n0.8,1.6\n")
    assert run("init", "logs/more", "--force").stdout.endswith("next: frictionlab compare-numeric logs/more/frf.csv\n")
    (logs / "plan.csv").write_text("log,material\n09_steel_N1.25_r0.3,steel\n")  # of tests to come
    (logs / "results").mkdir()  # of a campaign: no logs, whatever their suffix
    (logs / "results" / "measurements.csv").write_text("source\n")
    done = run("init", "logs", status=0)
    assert done.stdout.splitlines()[0] == "2 tests, 1 tap, 3 not read"
    assert "not read: broken.csv: it names the logs: as a sheet" in done.stdout
    assert "not read: more: logs of a folder in the folder" in done.stdout
    assert "not read: plan.csv: a sheet none of whose logs is here" in done.stdout
    assert "natural frequency 3.13" in done.stdout
    assert done.stdout.splitlines()[-1] == "next: frictionlab batch logs --campaign"
    scene = read_scene(logs / "frictionlab.toml")
    assert scene.rig.natural_frequency == pytest.approx(19.67 / (2 * np.pi), rel=1e-3)
    assert scene.experiment.name_pattern == "{material}_N{normal_force_n}_r{nominal_frequency_ratio}"
    assert scene.experiment.taps == ["tap1.csv"]
    written = (logs / "frictionlab.toml").read_text(encoding="utf-8")
    of_taps = run("free-vibration", "logs/tap1.csv").stdout.split("[rig]\n")[1]
    assert of_taps in written, "one tap has one uncertainty"
    assert re.search(
        r"transient_s = .*; the last of the tests looked at settles after [\d.]+ s\n\n\[sensors\]", written
    )
    tap(logs / "tap2.csv", 0.0, 1.05)
    said = run("init", "logs", "--force").stdout
    assert "warning: tap2.csv: natural_frequency_hz: the tap at" in said
    (logs / "tap2.csv").unlink()
    (logs / "tests.csv").write_text("log,material\nsteel_N1.25_r0.3,steel\n")
    fl.init(logs, force=True, mass_kg=3.08, normal_force_n=1.25)
    scene = read_scene(logs / "frictionlab.toml")
    assert (scene.experiment.sheet, scene.rig.mass_kg, scene.experiment.normal_force_n) == ("tests.csv", 3.08, 1.25)
    assert [log.name for log in fl.batch(logs, scene, output=tmp_path / "out").logs] == [
        *("broken.csv", "steel_N1.25_r0.3.csv", "steel_N1.25_r1.2.csv")
    ]


@pytest.mark.usefixtures("one_format")
def test_init_of_a_tribometer_asks_for_no_frame_and_its_campaign_is_made(run: Run, tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    t = np.arange(2500) / 250.0
    columns = {"time [s]": t, "displacement [mm]": 2.0 * np.sin(2 * np.pi * t)}
    columns["friction force [N]"] = 0.6 * np.tanh(30.0 * np.cos(2 * np.pi * t))
    for name, force in (("brass_2N", 2.0), ("brass_3N", 3.0)):
        log_of(tmp_path / "logs" / f"{name}.csv", {**columns, "normal force [N]": np.full(len(t), force)})
    done = run("init", "logs")
    assert done.stdout.splitlines()[::3] == ["2 tests", "next: frictionlab batch logs --campaign"]
    assert "to fill in" not in done.stdout
    assert read_scene(tmp_path / "logs" / "frictionlab.toml").rig.kind == "prescribed"
    (tmp_path / "logs" / "frame.csv").write_bytes(short_of(ROOT / "sample_data" / "steel_N1.25_r0.3.csv"))
    assert "warning: brass_2N.csv, brass_3N.csv: a force and no base" in run("init", "logs", "--force").stdout
    (tmp_path / "logs" / "frame.csv").unlink()
    fl.init(tmp_path / "logs", force=True)
    assert run("batch", "logs", "--campaign", "-o", "together").exit_code == 0
    assert run("batch", "logs", "-o", "each").exit_code == 0


@pytest.mark.usefixtures("one_format")
def test_a_copy_of_a_log_counts_once_in_a_campaign(run: Run, tmp_path: Path) -> None:
    places = [tmp_path / name for name in ("a.csv", "steel_N1.25_r0.3.csv")]
    for place in places:
        place.write_bytes(short_of(ROOT / "sample_data" / "steel_N1.25_r0.3.csv"))
    command = ("batch", *places, "--campaign", "--scene", CONFIGS / "sample_data.toml", "-o", "out")
    done = run(*command)
    said = done.stdout.splitlines()
    assert said[2].startswith("material ")
    assert said[-3].startswith("steel: measured under one normal force only")
    assert run(*command).stdout.splitlines() == said[2:], "read from its files it says the same"
    assert "note: a.csv is the same as steel_N1.25_r0.3.csv, byte for byte: it is counted once" in done.stderr
    assert [log.name for log in fl.batch(places, compare=False).logs] == ["a.csv"]
    alone = ("batch", *places, "--scene", CONFIGS / "sample_data.toml", "-o", "out")
    assert "of an earlier run: add --campaign" in run(*alone).stderr
    assert "of an earlier run" not in run(*alone).stderr
    assert "of an earlier run" in run(*alone, "--law", "coulomb").stderr


def test_a_scene_is_found_by_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "logs").mkdir()
    monkeypatch.chdir(tmp_path)
    log = Path("logs") / "a.csv"
    assert find_scene(log) is None
    fl.init("logs")
    assert find_scene(log) == Path("logs") / "frictionlab.toml"
    assert find_scene(Path("logs")) == Path("logs") / "frictionlab.toml"
    recording = Path("logs_results") / "recordings" / "a.h5"
    assert find_scene(recording) == tmp_path / "logs" / "frictionlab.toml", "results belong to their logs' scene"
    assert find_scene() is None
    fl.init()
    assert find_scene(log) == Path("frictionlab.toml")


def test_commands_use_the_scene_they_find_and_say_so(run: Run, tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    sample = ROOT / "sample_data" / "steel_N1.25_r0.3.csv"
    (tmp_path / "logs" / sample.name).write_bytes(sample.read_bytes())
    assert "natural frequency is not known" in run("analyze", f"logs/{sample.name}").stderr
    (tmp_path / "logs" / "frictionlab.toml").write_text("[rig]\nnatural_frequency_hz = 3.13\n")
    done = run("analyze", f"logs/{sample.name}", status=0)
    assert done.stderr.splitlines()[0].startswith("frictionlab: scene: logs/frictionlab.toml is used")
    assert "natural frequency" not in done.stderr
    assert run("analyze", f"logs/{sample.name}", "--quiet").stderr == ""
    (tmp_path / "frictionlab.toml").write_text("[rig]\nmass = 1\n[analysis]\ncycle = 1\n")
    refused = run("ingest", f"logs/{sample.name}", status=2)
    first, second = refused.stderr.splitlines()[1:]
    assert "scene frictionlab.toml, line 2: rig.mass: unknown key; did you mean mass_kg? expected one of" in first
    assert "scene frictionlab.toml, line 4: analysis.cycle: unknown key; did you mean cycles? expected" in second
