"""What tests of every part take: a folder like a fresh clone, commands run in it as a user runs them, values."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import pytest
from typer.testing import CliRunner, Result

from frictionlab.arrays import FloatArray
from frictionlab.cli import app

ROOT = Path(__file__).parents[1]
SAMPLE, SCENE = ROOT / "sample_data" / "steel_N1.25_r0.3.csv", ROOT / "configs" / "sample_data.toml"
BIN = Path(sys.executable).parent
T = TypeVar("T")
NAMED = """
[rig]
mass_kg = 3.0799
stiffness_n_per_m = 1191.0
[experiment]
name_pattern = "{material}_N{normal_force_n}_r{nominal_frequency_ratio}"
"""
STOREYS = """
[[rig.masses]]
mass_kg = 2.0
stiffness_n_per_m = 800.0
damping_ratio = 0.01
[[rig.masses]]
mass_kg = 1.0
stiffness_n_per_m = 400.0
"""
Answer = subprocess.CompletedProcess[str]
Run = Callable[..., Result]
MAKE = ("make", f"BIN={BIN}", f"FRICTIONLAB={BIN / 'frictionlab'}")
"""With the environment that runs the tests: nothing is installed."""
OF_MAKE = {
    *("MAKEFLAGS", "MAKELEVEL", "MFLAGS"),
    *("LOGS", "SCENE", "OUT", "CAMPAIGN", "CAMPAIGN_SCENE", "CAMPAIGN_LOGS"),
}
"""What a make that runs the tests puts into their environment."""


def truths(folder: Path) -> list[dict[str, Any]]:
    """What is known of the virtual tests of a folder."""
    return [json.loads(line) for line in (folder / "truth.jsonl").read_text(encoding="utf-8").splitlines()]


def present(value: T | None) -> T:
    """What could be None, and is not."""
    assert value is not None
    return value


def until(condition: Callable[[], T], seconds: float = 30.0) -> T:
    """What a condition says once it holds, or after so many seconds."""
    late = time.monotonic() + seconds
    while not (found := condition()) and time.monotonic() < late:
        time.sleep(0.05)
    return found


def published(path: str) -> Path:
    """What others have published, where it was fetched: one folder a repository; else the test is skipped."""
    found = Path(os.environ.get("FRICTIONLAB_PUBLIC_DATA", "nowhere")) / path
    if not found.exists():
        pytest.skip(f"{path} is not here: fetch the repository and name its folder in FRICTIONLAB_PUBLIC_DATA")
    return found


def short_of(log: Path) -> bytes:
    """The first 30 s of a sample log."""
    return b"".join(log.read_bytes().splitlines(keepends=True)[:7503])


def log_of(path: Path, columns: Mapping[str, FloatArray]) -> Path:
    """Write a log of these columns under their titles."""
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    path.write_text("\n".join([",".join(columns), *(",".join(f"{v:.9g}" for v in row) for row in rows)]) + "\n")
    return path


def set_up(folder: Path, *names: str) -> Path:
    """Put the Makefile and these parts of the project into a folder."""
    for name in ("Makefile", *names):
        (folder / name).symlink_to(ROOT / name)
    (folder / "pyproject.toml").touch()
    os.utime(folder / "pyproject.toml", (0, 0))  # older than the environment
    return folder


def run_in(folder: Path | None, words: Sequence[str], **environment: str) -> Answer:
    """Run a command there; not as a child of the make that may be running the tests."""
    alone = {key: value for key, value in os.environ.items() if key not in OF_MAKE} | environment
    return subprocess.run(words, cwd=folder, env=alone, capture_output=True, text=True, check=False, timeout=170)


def told_by(code: str, *words: str, cwd: Path | None = None, **environment: str) -> str:
    """What Python code prints in a process of its own."""
    done = run_in(cwd, [sys.executable, "-c", code, *words], **environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


def invoke(*words: object, status: int | None = None, **how: Any) -> Result:
    """What a command says and returns, run in this process: a second sooner than as one of its own.

    ``status``: what it must end with.
    """
    done = CliRunner().invoke(app, [str(word) for word in words], **how)
    assert status in (None, done.exit_code), done.output
    return done


def rows_of(told: Result) -> list[dict[str, Any]]:
    """The lines of JSON that a command printed, and nothing else; NaN and Infinity are none."""

    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"{constant} is no JSON")

    return [json.loads(line, parse_constant=refuse) for line in told.stdout.splitlines()]
