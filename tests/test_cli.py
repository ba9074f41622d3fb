"""The habits of every command: statuses, one-line errors, JSON Lines; the reader's options mean the same anywhere."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import frictionlab as fl
from frictionlab.cli.options import ANALYSIS, LOG, Settings
from frictionlab.simulator import compiled
from frictionlab.simulator.laws import TERMS
from tests.desk import BIN, SAMPLE, Run, invoke, rows_of

FRICTIONLAB = BIN / "frictionlab"


def test_a_misspelt_command_is_told_what_was_meant_and_completion_knows_all(run: Run) -> None:
    assert "Did you mean 'analyze'?" in run("analize", status=2).stderr
    for words, found in (("frictionlab fre", "free-vibration"), ("frictionlab analyze --nat", "--natural-frequency")):
        asked = {"_FRICTIONLAB_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
        told = subprocess.run([FRICTIONLAB], env={**os.environ, **asked}, capture_output=True, text=True, check=False)
        assert told.stdout.split() == [found]


def test_the_machine_code_of_all_versions_is_removed_and_nothing_else(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiled, "FOLDER", tmp_path / "simulator-2")
    for name in ("simulator-1", "simulator-2", "other"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "code").write_bytes(bytes(2_000_000))
    assert run("--clear-cache").stdout == f"{tmp_path}: 4 MB of machine code removed\n"
    assert [path.name for path in tmp_path.iterdir()] == ["other"]


def test_old_names_are_taken_and_the_new_ones_said(run: Run) -> None:
    new = json.loads(run("simulate", "--r", "0.5", "--beta", "0.4", "--mu", "1.5", "--zeta", "0.01", "--json").stdout)
    names = "--friction-ratio 0.4 --static-ratio=1.5 --contact-damping-ratio 0.01"
    old = run("simulate", "--r", "0.5", *names.split(), "--json")
    assert json.loads(old.stdout) | {"wall_s": new["wall_s"]} == new
    assert "note: --friction-ratio is now --beta; the old name is taken until the next version" in old.stderr
    assert "--static-ratio is now --mu" in old.stderr
    assert "note: compare is now compare-numeric;" in run("compare", "gone.h5").stderr


ONE, PLACE = ("--r", "0.5", "--beta", "0.4"), ("--law", "coulomb+place", "--parameter", "gradient=0.05")
REFUSED: list[tuple[tuple[str, ...], str]] = [
    (("--r", "0"), "expected a finite number >= 1e-06"),
    (("--mu", "0.5"), "mu is static over kinetic friction, 1 or more; the friction coefficient is --coefficient"),
    (("-o", "/dev/null/row.csv"), "/dev/null is no folder"),
    (("--law", "coulomb+place"), "gradient (relative change"),
    (("--parameter", "gradient"), "--parameter: expected NAME=VALUE; got 'gradient'"),
    ((*PLACE, "--parameter", "gradient=0.1"), "--parameter gradient: given twice"),
    (("--law", "coulomb+place", "--parameter", "gradient=steep"), "expected a number; got 'steep'"),
    (("--parameter", "beta=0.3"), "give --beta 0.3"),
    (("--mu", "1.2", "--parameter", "static_ratio_up=1.1"), "--mu and --parameter static_ratio_up say the same"),
    (("--parameter", "frame_damping_ratio=-1"), "frame_damping_ratio; expected a finite number >= 0"),
    ((*PLACE, "--solver", "thesis"), "thesis run: law coulomb+place"),
]
CONTRADICTING: list[tuple[tuple[str, ...], str]] = [
    ((), "expected --r R (a steady state) or --base-motion FILE"),
    (("--r", "0.5", "--unit", "mm"), "--unit: belongs to --base-motion"),
    (("--r", "0.5", "--base-motion", "a.csv"), "got both"),
    (("--cycles", "3", "--base-motion", "a.csv"), "--cycles: a recorded base is followed once"),
    (("--base-motion", "a.csv", "-o", "a.xlsx"), "expected a recording, a name ending in .h5"),
]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("analyze", "a.h5", "--natural-frequency", "5,3"), "'--natural-frequency': expected a number; got '5,3'"),
        (("simulate", "--r", "0.5", "--beta", "1", "--cycles", "0"), "'--cycles' / '-N': expected 1 or more; got '0'"),
        (("simulate", "--r", "0.5", "--beta", "1", "--wall", "left"), "'left' is not one of 'fixed', 'base'"),
        (("sweep", "--r", "0.5", "--beta", "1", "-o", "m.csv", "--workers", "99999"), ", 32 for each core; got 99999"),
        (("show", "none"), "none: there is no such file"),
        (
            ("simulate", "--coefficient", "0.3", "--base-motion", "a.csv"),
            "expected --beta BETA (friction force over k Y), or, all of",
        ),
        (("predict", "--law-file", "a", "--normal-force", "400g"), "'--normal-force': expected a number; got '400g'"),
        (("batch", ".", "-o", "--campaign"), "looks like an option: if it is meant, give ./--campaign"),
        (("sweep", "--r", "1", "--beta", "1", "--law", "coulomb+place", "-o", "m.csv"), "usually -0.1 to 0.1; got"),
        (("sweep", "--r", "1:0.5:0.1", "--beta", "0.2", "-o", "m.csv"), "expected START:STOP:STEP, going up"),
        (("sweep", "--r", "0.5:0.5:0.1", "--beta", "0.1:2:20", "-o", "m.csv"), "got '0.1:2:20', whose step is 20"),
        (("analyze", str(SAMPLE), "--cycles", "window:1_0"), "got 'window:1_0'"),
        (("simulate", "--r", "1_0", "--beta", "0.4"), "'--r': expected"),
        (("sweep", "--r", "\u0661", "--beta", "0.4", "-o", "m.csv"), "--r: expected"),
        (
            ("simulate", "--r", "0.5", "--beta", "0.4", "--law", "coulomb+place", "--parameter", "gradient=0.\uff15"),
            "expected a number; got '0.\uff15'",
        ),
        *((("simulate", *ONE, *said), told) for said, told in REFUSED),
        *((("simulate", "--beta", "0.4", *said), told) for said, told in CONTRADICTING),
    ],
)
def test_a_value_that_an_option_does_not_take_is_told_in_plain_words(
    run: Run, words: tuple[str, ...], told: str
) -> None:
    done = run(*words)
    assert (done.exit_code, done.stdout, told in " ".join(done.stderr.split())) == (2, "", True), done.stderr
    assert not re.search("Input should|Value error", done.stderr)


@pytest.mark.skipif(sys.platform == "win32", reason="there nobody can remove a folder that is worked in")
def test_a_working_folder_that_is_gone_is_said(tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    script = f'cd "$1" && rmdir "$1" && "{FRICTIONLAB}" init'
    done = subprocess.run(["sh", "-c", script, "-", gone], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 1
    assert done.stderr == "frictionlab: the folder that is worked in is no longer there: change into one that is\n"


LINES = "\n".join(f"{4000 * i}|{1.5 + 0.001 * (i % 7):.3f}|{2.25 + 0.001 * (i % 5):.3f}" for i in range(100))
LOG_TEXT = f"t|mass|base\n{LINES}\n"
SAID = {"separator": "pipe", "time_unit": "µs", "unit": "µm", "mass": "2", "bridge_s": 0.1}


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "log.txt"
    path.write_text(LOG_TEXT)
    return path


def ingested(log: Path, *words: str) -> dict[str, object]:
    row: dict[str, object] = json.loads(invoke("ingest", log, "--dry-run", "--json", *words, status=0).stdout)
    return row


def test_an_option_means_the_same_wherever_it_is_said(log: Path) -> None:
    (log.parent / "scene.toml").write_text(
        "[log]\n" + "".join(f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in SAID.items())
    )
    by_scene = ingested(log, "--scene", str(log.parent / "scene.toml"))
    flags = {key: words.flags for key, (_, words) in LOG.items()}
    by_line = ingested(log, *(word for key, value in SAID.items() for word in (flags[key], str(value))))
    recording = fl.ingest(log, None, **SAID)  # type: ignore[arg-type]
    assert by_line == by_scene
    assert by_line["sampling_rate_hz"] == pytest.approx(250.0, rel=1e-9)
    assert recording.sampling_rate_hz == pytest.approx(250.0, rel=1e-9)
    assert float(recording.mass_displacement[0]) == pytest.approx(1.5e-6, rel=1e-12)
    assert recording.source.options == {**fl.LogOptions(**SAID).given()}  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("command", "settings", "named"),
    [
        ("ingest", LOG, "--separator --decimal --encoding --time --mass --base --unit --time-unit --sampling-rate"),
        ("analyze", ANALYSIS, "--natural-frequency --transient --cycles --padding"),
        ("compare-numeric", ANALYSIS, "--natural-frequency --transient --cycles --padding"),
    ],
)
def test_every_key_of_a_table_is_an_option_with_its_words(command: str, settings: Settings, named: str) -> None:
    helped = " ".join(invoke(command, "--help-all").stdout.split())
    for _, words in settings.values():
        assert f" {words.flags} {words.takes} " in helped
        assert words.words in helped
    assert set(named.split()) <= {words.flags for _, words in settings.values()}
    assert settings is ANALYSIS or list(settings) == list(fl.LogOptions.model_fields)


def test_laws_are_listed_with_parameters_and_one_is_drawn(tmp_path: Path) -> None:
    every = rows_of(invoke("laws", "--json"))
    assert [row["law"] for row in every] == list(TERMS)
    assert all(
        set(parameter) > {"words", "low", "high", "usual"} for row in every for parameter in row["parameters"].values()
    )
    listed = invoke("laws").stdout.splitlines()
    assert [line.split()[0] for line in listed[1:-1]] == list(TERMS)
    figure = tmp_path / "loop.svg"
    done = invoke("laws", "place", "--plot", figure)
    assert (done.exit_code, figure.exists()) == (0, True)
    assert done.stdout.splitlines()[2].startswith("place: friction varying along the path: ")
    assert invoke("laws", "coulomb+nothing").exit_code == 2
