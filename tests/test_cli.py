"""The habits of every command: exit statuses, one-line errors, JSON Lines that are nothing else."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.desk import BIN, SAMPLE, Run

FRICTIONLAB = BIN / "frictionlab"


def test_a_misspelt_command_is_told_what_was_meant_and_completion_knows_all(run: Run) -> None:
    done = run("analize")
    assert done.returncode == 2
    assert "Did you mean 'analyze'?" in done.stderr
    for words, found in (("frictionlab fre", "free-vibration"), ("frictionlab analyze --nat", "--natural-frequency")):
        asked = {"_FRICTIONLAB_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
        told = subprocess.run([FRICTIONLAB], env={**os.environ, **asked}, capture_output=True, text=True, check=False)
        assert told.stdout.split() == [found]


def test_old_names_are_taken_and_the_new_ones_said(run: Run) -> None:
    new = json.loads(run("simulate", "--r", "0.5", "--beta", "0.4", "--mu", "1.5", "--zeta", "0.01", "--json").stdout)
    names = "--friction-ratio 0.4 --static-ratio=1.5 --contact-damping-ratio 0.01"
    old = run("simulate", "--r", "0.5", *names.split(), "--json")
    assert json.loads(old.stdout) | {"wall_s": new["wall_s"]} == new
    assert "note: --friction-ratio is now --beta; the old name is taken until the next version" in old.stderr
    assert "--static-ratio is now --mu" in old.stderr
    assert "note: compare is now compare-numeric;" in run("compare", "gone.h5").stderr


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("analyze", "a.h5", "--natural-frequency", "5,3"), "'--natural-frequency': expected a number; got '5,3'"),
        (("simulate", "--r", "0.5", "--beta", "1", "--cycles", "0"), "'--cycles': expected 1 or more; got '0'"),
        (("simulate", "--r", "0.5", "--beta", "1", "--wall", "left"), "'left' is not one of 'fixed', 'base'"),
        (("sweep", "--r", "0.5", "--beta", "1", "-o", "m.csv", "--workers", "99999"), ", 32 for each core; got 99999"),
        (("show", "none"), "none: there is no such file"),
        (("predict", "--law-file", "a", "--normal-force", "400g"), "which weighs 3.923 N: give 3.923"),
        (("batch", ".", "-o", "--campaign"), "looks like an option: if it is meant, give ./--campaign"),
        (
            ("sweep", "--r", "1", "--beta", "1", "--law", "coulomb+place", "-o", "m.csv"),
            "usually -0.1 to 0.1; got",
        ),
        (("analyze", "--colour"), "No such option: --colour"),
        (("analyze",), "Missing argument"),
        (("sweep", "--r", "1:0.5:0.1", "--beta", "0.2", "-o", "m.csv"), "going up, with both ends; got '1:0.5:0.1'"),
        (("analyze", str(SAMPLE), "--cycles", "window:1_0"), "got 'window:1_0'"),
    ],
)
def test_a_value_that_an_option_does_not_take_is_told_in_plain_words(
    run: Run, words: tuple[str, ...], told: str
) -> None:
    done = run(*words)
    assert (done.returncode, told in " ".join(done.stderr.split())) == (2, True), done.stderr
    assert not re.search("Input should|Value error", done.stderr)


@pytest.mark.skipif(sys.platform == "win32", reason="there nobody can remove a folder that is worked in")
def test_a_working_folder_that_is_gone_is_said(tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    script = f'cd "$1" && rmdir "$1" && "{FRICTIONLAB}" init'
    done = subprocess.run(["sh", "-c", script, "-", gone], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 1
    assert done.stderr == "frictionlab: the folder that is worked in is no longer there: change into one that is\n"
