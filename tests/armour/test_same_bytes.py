"""The same work gives the same bytes in every environment: hash seed, locale, time zone, threads, folder, workers."""

import os
import subprocess
import sys
from pathlib import Path

from tests.armour.sound import sound

SCRIPT = """
import sys
from typer.testing import CliRunner
from frictionlab.cli import app

def run(*words):
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output

drive = ("--natural-frequency", "6", "--transient", "0.5", "-q")
for words in (("-o", "m.csv", "--plot", "m.svg"), ("-o", "m.jsonl"), ("-o", "m.h5"), ("-o", "m.xlsx")):
    run("analyze", "a.h5", *drive, *words)
run("simulate", "--r", "0.3", "--beta", "0.4", "-o", "motion.h5", "--plot", "motion.pdf")
run("sweep", "--r", "0.5,0.7", "--beta", "0.2,0.4", "-o", "map.h5", "-q", "--workers", sys.argv[1])
"""
PLAIN = {"PYTHONHASHSEED": "0", "LC_ALL": "C", "TZ": "UTC", "OMP_NUM_THREADS": "1"}
OTHER = {"PYTHONHASHSEED": "7", "LC_ALL": "C.UTF-8", "TZ": "Asia/Kathmandu", "OMP_NUM_THREADS": "4", "COLUMNS": "40"}


def made(folder: Path, environment: dict[str, str], workers: int) -> dict[str, bytes]:
    folder.mkdir()
    (folder / "a.h5").write_bytes(sound("recording"))
    command = [sys.executable, "-c", SCRIPT, str(workers)]
    done = subprocess.run(
        command, cwd=folder, env=os.environ | environment, check=False, capture_output=True, text=True, timeout=100
    )
    assert done.returncode == 0, done.stderr
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_results_are_the_same_bytes_everywhere(tmp_path: Path) -> None:
    plain, other = made(tmp_path / "one", PLAIN, 1), made(tmp_path / "two", OTHER, 2)
    assert sorted(plain) == sorted(other)
    assert len(plain) == 9
    assert [name for name in plain if plain[name] != other[name]] == []
