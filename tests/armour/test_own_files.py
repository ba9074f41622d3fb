"""What stands on the user's disk stays, whatever an output is called; the same work gives the same bytes anywhere."""

import stat
import sys
from pathlib import Path

import pytest
from typer.testing import Result

from frictionlab.errors import OutputError, SceneError
from frictionlab.figures import is_figure
from frictionlab.figures.plates import plates
from frictionlab.figures.style import new_figure, save
from frictionlab.scene import Scene, scene_from_tables
from frictionlab.synthetic import synthesize, virtual_tests
from frictionlab.tables import write_rows
from frictionlab.verbs.evaluate import evaluate
from frictionlab.verbs.inputs import names_of
from tests.armour.sound import sound
from tests.campaign.fabricate import SCENE as CAMPAIGN
from tests.campaign.fabricate import row as row_of
from tests.campaign.fabricate import small_campaign
from tests.desk import SAMPLE, SCENE, told_by
from tests.desk import invoke as run

PHOTO = b"\x89PNG\r\n\x1a\n a photo of the rig"
DRIVEN = ("simulate", "--base-motion", SAMPLE, "--natural-frequency", "3", "--beta", "0.2")


def refused(done: Result, words: str, code: int = 2) -> None:
    assert (done.exit_code, words in done.output) == (code, True), done.output


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recordings") / "a.h5"
    assert run("ingest", SAMPLE, "--scene", SCENE, "-o", path, "--quiet").exit_code == 0
    return path


def scene_of(*materials: str, **more: object) -> Scene:
    test = {"normal_forces_n": [1.0], "frequency_ratios": [0.5], "friction_coefficient": 0.5, **more}
    rig = {"mass_kg": 3.0, "stiffness_n_per_m": 1200.0}
    tests = [{**test, "material": m} for m in materials or ["steel"]]
    return scene_from_tables({"rig": rig, "synthetic": {"duration_s": 1.0, "tests": tests}})


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
        refused(run(command, recording, "--plot", tmp_path, "--scene", SCENE), "exists and is no figure of frictionlab")
        assert (tmp_path / name).read_bytes() == PHOTO
    photo = tmp_path / "photo.png"
    photo.write_bytes(PHOTO)
    for words in (("simulate", "--r", "0.5", "--beta", "0.4"), DRIVEN):
        refused(run(*words, "--plot", photo), "exists and is no figure of frictionlab")
        assert photo.read_bytes() == PHOTO
    assert run("simulate", "--r", "0.5", "--beta", "0.4", "--plot", photo, "--force").exit_code == 0
    assert is_figure(photo)


@pytest.mark.parametrize("force", [(), ("--force",)])
def test_no_output_replaces_what_is_read_nor_a_link_of_it(
    recording: Path, tmp_path: Path, force: tuple[str, ...]
) -> None:
    """``--force`` allows much, but not that."""
    sheet, scene, rows = (tmp_path / name for name in ("tests.csv", "scene.csv", "rows.csv"))
    sheet.write_text("log,material,normal_force_n\na.csv,steel,1.25\n")
    scene.write_text('[rig]\nnatural_frequency_hz = 3.1\nmass_kg = 3.0\n[experiment]\nsheet = "tests.csv"\n')
    assert run("compare-numeric", recording, "--scene", SCENE, "-o", rows, "--quiet").exit_code == 0
    of_scene, of_recording = tmp_path / "scene.h5", tmp_path / "recording.h5"
    of_scene.hardlink_to(scene)
    of_recording.hardlink_to(recording)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    of_test = ("analyze", "compare-numeric", "free-vibration", "explain")
    for words, places in (
        *(((command, recording), (scene, sheet, of_scene, of_recording)) for command in of_test),
        (("plan", "--law-file", rows), (scene, sheet, rows)),
        (DRIVEN, (of_scene,)),
        (("ingest", SAMPLE), (of_scene,)),
    ):
        for place in places:
            refused(run(*words, "--scene", scene, *force, "-o", place), "an output never replaces an input")
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_table_replaces_no_file_of_another_kind(recording: Path, tmp_path: Path) -> None:
    rows, log, other = (tmp_path / name for name in ("rows.h5", "mine.csv", "mine.h5"))
    rows.write_bytes(recording.read_bytes())
    log.write_text("time [s],base [m],mass [m]\n0,0,0\n")
    other.write_bytes(log.read_bytes())
    for words, place, told, code in (
        (("analyze", tmp_path / "none.h5"), rows, "exists and is no table of measurements", 2),
        (("plan", "--scene", SCENE), log, "exists", 2),
        (DRIVEN, other, "exists and is not a file of this kind", 1),
    ):
        before = place.read_bytes()
        refused(run(*words, "-o", place), told, code)
        assert place.read_bytes() == before


@pytest.mark.skipif(sys.platform == "win32", reason="modes are POSIX's")
def test_what_is_write_protected_or_private_stays_so(recording: Path, tmp_path: Path) -> None:
    rows, figure = tmp_path / "rows.csv", tmp_path / "a.png"
    words = ("analyze", recording, "--scene", SCENE, "-o", rows, "--plot", figure, "-q")
    assert run(*words).exit_code == 0
    rows.chmod(0o600)
    assert run(*words).exit_code == 0
    assert stat.S_IMODE(rows.stat().st_mode) == 0o600
    for path in (rows, figure):
        path.chmod(0o444)
        refused(run(*words), f"{path.name}: is write-protected")
        path.chmod(0o644)
    copy = tmp_path / "copy.h5"
    copy.write_bytes(recording.read_bytes())
    copy.chmod(0o444)
    again = ("ingest", SAMPLE, "--scene", SCENE, "-o", copy, "-q")
    refused(run(*again), "copy.h5: is write-protected", code=1)
    assert run(*again, "--force").exit_code == 0
    out = tmp_path / "out"
    assert run("campaign", rows, "-o", out, "-q").exit_code == 0
    (out / "friction.csv").chmod(0o444)
    refused(run("campaign", rows, "-o", out, "-q"), "friction.csv: is write-protected")


def test_a_figure_that_finds_no_room_is_refused_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("mine")
    refused(
        run("analyze", "none.h5", "--plot", tmp_path / "taken" / "figures"), "taken is no folder: choose another output"
    )
    write_rows(small_campaign()[:3], rows := tmp_path / "small.jsonl")
    for words in (("synthesize", "--scene", SCENE), ("tradeoff",), ("campaign", rows)):
        done = run(*words, "-o", tmp_path / "taken")
        assert (done.exit_code, "taken" in done.output, "Errno" in done.output) == (1, True, False), done.output
        assert "folder cannot be made" in done.output


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("analyze", ""), "got an empty one"),
        (("ingest", "a.csv", "-o", ""), "'-o': expected a name or a value; got an empty one"),
        (("synthesize", "--scene", "", "-o", "x"), "'--scene': expected a name or a value; got an empty one"),
    ],
)
def test_an_empty_name_is_not_the_folder_that_is_worked_in(
    words: tuple[str, ...], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    refused(run(*words), told)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "mine"),
    [
        ("truth.jsonl", '{"log": "a.csv", "verdict": "years of work"}\n'),
        ("steel_N1_r0.5.csv", "time [s],mass [mm],base [mm]\n0,1,2\n"),
    ],
)
def test_synthesize_keeps_a_truth_and_a_log_that_are_not_its_own(name: str, mine: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(mine)
    with pytest.raises(OutputError, match=rf"{name}: exists and is not a file of this kind"):
        list(synthesize(scene_of(), tmp_path))
    assert (tmp_path / name).read_text() == mine
    assert [path.name for path in tmp_path.iterdir()] == [name]  # refused before the work
    (tmp_path / name).unlink()
    for _ in range(2):
        assert len(list(synthesize(scene_of(), tmp_path))) == 1


def test_logs_are_told_apart_on_any_disk() -> None:
    """Some disks see neither case nor how an accent is written: one log would replace the other there."""
    for one, other in (("steel", "steel"), ("Steel", "steel"), ("St\u00e4hl", "Sta\u0308hl")):
        with pytest.raises(SceneError, match=r"the same test stands twice: .*_N1_r0\.5\.csv"):
            virtual_tests(scene_of(one, other))
    assert list(names_of([Path("x/st\u00e4hl.csv"), Path("x/sta\u0308hl.csv")]).values())[1].endswith("~2")


def test_materials_whose_letters_no_file_name_has_keep_figures_of_their_own() -> None:
    rows = [row for name in ("\u94a2", "\u94dc") for row in (row_of(name, 1.0, r, 0.5) for r in (0.3, 0.7, 1.3))]
    names = [plate.name for plate in plates(evaluate(rows, scene_from_tables(CAMPAIGN)))]
    assert {"energy__", "energy__~2"} <= set(names)
    assert len(names) == len(set(names))


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


@pytest.mark.parametrize("name", ["figures/stops.png", "report.html"])
def test_a_campaign_keeps_foreign_files_and_says_so_before_it_writes(name: str, tmp_path: Path) -> None:
    rows, mine = tmp_path / "rows.jsonl", tmp_path / "out" / name
    write_rows(small_campaign()[:3], rows)
    mine.parent.mkdir(parents=True)
    mine.write_bytes(PHOTO)
    refused(run("campaign", rows, "-o", tmp_path / "out"), f"{mine.name}: exists and is no ")
    assert mine.read_bytes() == PHOTO
    assert [path for path in (tmp_path / "out").rglob("*") if path.is_file()] == [mine]


def test_a_batch_refuses_a_foreign_table_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "comparisons.jsonl").write_text('{"log": "mine"}\n')
    run("batch", SAMPLE, "--scene", SCENE, "-o", tmp_path, status=2)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["comparisons.jsonl"]


SCRIPT = """
import sys
from typer.testing import CliRunner
from frictionlab.cli import app

def run(*words):
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output

drive = ("--natural-frequency", "6", "--transient", "0.5", "-q")
for words in (("-o", "m.csv", "--plot", "m.svg"), ("-o", "m.jsonl"), ("-o", "m.h5")):
    run("analyze", "a.h5", *drive, *words)
run("simulate", "--r", "0.3", "--beta", "0.4", "-o", "motion.h5", "--plot", "motion.pdf")
run("sweep", "--r", "0.5,0.7", "--beta", "0.2,0.4", "-o", "map.h5", "-q", "--workers", sys.argv[1])
"""
PLAIN = {"PYTHONHASHSEED": "0", "LC_ALL": "C", "TZ": "UTC", "OMP_NUM_THREADS": "1"}
OTHER = {"PYTHONHASHSEED": "7", "LC_ALL": "C.UTF-8", "TZ": "Asia/Kathmandu", "OMP_NUM_THREADS": "4", "COLUMNS": "40"}


def made(folder: Path, environment: dict[str, str], workers: int) -> dict[str, bytes]:
    folder.mkdir()
    (folder / "a.h5").write_bytes(sound("recording"))
    told_by(SCRIPT, str(workers), cwd=folder, **environment)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_results_are_the_same_bytes_everywhere(tmp_path: Path) -> None:
    plain, other = made(tmp_path / "one", PLAIN, 1), made(tmp_path / "two", OTHER, 2)
    assert sorted(plain) == sorted(other)
    assert len(plain) == 8
    assert [name for name in plain if plain[name] != other[name]] == []
