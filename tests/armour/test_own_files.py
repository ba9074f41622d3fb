"""What stands on the user's disk stays: no output replaces an input, a link of one, or a file that is not ours."""

import json
import os
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from frictionlab.cli import app
from frictionlab.errors import OutputError, SceneError
from frictionlab.figures.mark import is_figure
from frictionlab.figures.style import new_figure, save
from frictionlab.scene import Scene, scene_from_tables
from frictionlab.synthetic import synthesize, virtual_tests
from tests.desk import ROOT

SAMPLE = ROOT / "sample_data" / "steel_N1.25_r0.3.csv"
SCENE = ROOT / "configs" / "sample_data.toml"
PHOTO = b"\x89PNG\r\n\x1a\n a photo of the rig"


def run(*words: str | Path) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recordings") / "a.h5"
    assert run("ingest", SAMPLE, "--scene", SCENE, "-o", path, "--quiet").exit_code == 0
    return path


def scene_of(material: str = "steel", **more: object) -> Scene:
    test = {"material": material, "normal_forces_n": [1.0], "frequency_ratios": [0.5], "friction_coefficient": 0.5}
    rig = {"mass_kg": 3.0, "stiffness_n_per_m": 1200.0}
    return scene_from_tables({"rig": rig, "synthetic": {"duration_s": 1.0, "tests": [{**test, **more}]}})


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_a_figure_replaces_figures_of_this_tool_alone(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_bytes(PHOTO)
    with pytest.raises(OutputError, match="exists and is not a file of this kind"):
        save(new_figure(), path)
    assert path.read_bytes() == PHOTO
    save(new_figure(), path, force=True)
    assert is_figure(path)
    save(new_figure(), path)


def test_plots_keep_photos_and_are_refused_before_the_work(recording: Path, tmp_path: Path) -> None:
    named = {
        "analyze": "a.measurement.png",
        "compare-numeric": "a.comparison.png",
        "free-vibration": "a.free_vibration.png",
    }
    for command, name in named.items():
        (tmp_path / name).write_bytes(PHOTO)
        done = run(command, recording, "--plot", tmp_path, "--scene", SCENE)
        assert (done.exit_code, "exists and is no figure of frictionlab" in done.output) == (2, True), done.output
        assert (tmp_path / name).read_bytes() == PHOTO
    photo = tmp_path / "photo.png"
    photo.write_bytes(PHOTO)
    for words in (
        ("simulate", "--r", "0.5", "--beta", "0.4"),
        ("simulate", "--base-motion", SAMPLE, "--natural-frequency", "3", "--beta", "0.2"),
    ):
        done = run(*words, "--plot", photo)
        assert (done.exit_code, "exists and is no figure of frictionlab" in done.output) == (2, True), done.output
        assert photo.read_bytes() == PHOTO
    assert run("simulate", "--r", "0.5", "--beta", "0.4", "--plot", photo, "--force").exit_code == 0
    assert is_figure(photo)


def test_a_table_never_replaces_its_inputs_nor_a_link_of_one(recording: Path, tmp_path: Path) -> None:
    link = tmp_path / "rows.h5"
    os.link(recording, link)
    before = recording.read_bytes()
    for command in ("analyze", "compare-numeric", "free-vibration"):
        for force in ((), ("--force",)):
            done = run(command, recording, "--scene", SCENE, "-o", link, *force)
            assert done.exit_code == 2, done.output
            assert "an output never replaces an input" in done.output
    assert link.read_bytes() == before


def test_an_existing_recording_as_output_is_refused_before_the_work(recording: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.h5"
    other.write_bytes(recording.read_bytes())
    done = run("analyze", tmp_path / "none.h5", "-o", other)
    assert done.exit_code == 2, done.output
    assert "exists and is no table of measurements" in done.output


def test_a_plan_never_replaces_the_comparisons_it_reads(recording: Path, tmp_path: Path) -> None:
    rows = tmp_path / "comparisons.csv"
    assert run("compare-numeric", recording, "--scene", SCENE, "-o", rows, "--quiet").exit_code == 0
    before = rows.read_bytes()
    done = run("plan", "--scene", SCENE, "--measured", rows, "-o", rows, "--force")
    assert done.exit_code == 2, done.output
    assert "an output never replaces an input" in done.output
    done = run("plan", "--scene", SCENE, "-o", rows)
    assert done.exit_code == 2, done.output
    assert "exists" in done.output
    assert rows.read_bytes() == before


def test_a_base_motion_that_looks_like_an_answer_is_kept(tmp_path: Path) -> None:
    log = tmp_path / "mine.csv"
    log.write_text("time [s],base [m],mass [m]\n0,0,0\n")
    done = run("simulate", "--base-motion", SAMPLE, "--natural-frequency", "3", "--beta", "0.2", "-o", log)
    assert done.exit_code != 0, done.output
    assert log.read_text().startswith("time [s],base [m],mass [m]\n0")


def test_synthesize_keeps_a_truth_that_is_not_its_own(tmp_path: Path) -> None:
    mine = json.dumps({"log": "a.csv", "verdict": "years of work"}) + "\n"
    (tmp_path / "truth.jsonl").write_text(mine)
    with pytest.raises(OutputError, match=r"truth\.jsonl: exists and is not a file of this kind"):
        list(synthesize(scene_of(), tmp_path))
    assert (tmp_path / "truth.jsonl").read_text() == mine
    assert [path.name for path in tmp_path.iterdir()] == ["truth.jsonl"]  # refused before the work
    (tmp_path / "truth.jsonl").unlink()
    for _ in range(2):
        assert len(list(synthesize(scene_of(), tmp_path))) == 1


@pytest.mark.parametrize("word", ["../../escaped", "/escaped", "a\\b", "a\0b", "a\nb", "x" * 300, "", "C:steel"])
def test_a_name_that_leaves_the_folder_is_refused(word: str) -> None:
    with pytest.raises(SceneError, match=r"synthetic\.tests\.0\.material: expected a word that can name a file"):
        virtual_tests(scene_of(word))
    if word:
        with pytest.raises(SceneError, match=r"synthetic\.tests\.0\.label: expected a word that can name a file"):
            virtual_tests(scene_of(label=word))


def test_a_material_need_not_be_ascii(tmp_path: Path) -> None:
    (test,) = synthesize(scene_of("Stähl S355"), tmp_path)
    assert (tmp_path / test.log).read_text(encoding="utf-8").splitlines()[1].startswith("# material Stähl S355")


def test_a_campaign_keeps_foreign_figures_and_says_so_before_it_writes(tmp_path: Path, recording: Path) -> None:
    rows, out = tmp_path / "rows.jsonl", tmp_path / "out"
    assert run("analyze", recording, "--scene", SCENE, "-o", rows, "--quiet").exit_code == 0
    (out / "figures").mkdir(parents=True)
    (out / "figures" / "ranking.png").write_bytes(PHOTO)
    done = run("campaign", rows, "--scene", SCENE, "-o", out)
    assert done.exit_code != 0
    assert "ranking.png: exists" in done.output
    assert (out / "figures" / "ranking.png").read_bytes() == PHOTO
    assert not (out / "friction.csv").exists()


def test_a_batch_refuses_a_foreign_table_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "comparisons.jsonl").write_text('{"log": "mine"}\n')
    done = run("batch", SAMPLE, "--scene", SCENE, "-o", tmp_path)
    assert done.exit_code == 2, done.output
    assert sorted(path.name for path in tmp_path.iterdir()) == ["comparisons.jsonl"]
