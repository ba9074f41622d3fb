"""Standard output that is full, closed, or left by who read it: one line or none, never a traceback or a hang."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.armour.sound import sound

COMMANDS = {
    "help": ["--help"],
    "ingest": ["ingest", "a.csv", "-o", "b.h5"],
    "analyze": ["analyze", "a.h5", "--natural-frequency", "6", "--transient", "0.5", "--json"],
    "sweep": ["sweep", "--r", "0.5,0.6", "--beta", "0.4", "-o", "map.csv", "--json"],
    "show recording": ["show", "a.h5"],
}


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    (tmp_path / "a.h5").write_bytes(sound("recording"))
    (tmp_path / "a.csv").write_text(
        "time [s],mass [mm],base [mm]\n" + "".join(f"{n / 100},{n % 7},{n % 5}\n" for n in range(300))
    )
    return tmp_path


def run(words: Sequence[str], desk: Path, shell: str) -> subprocess.CompletedProcess[str]:
    """Run a command with its standard output as the shell says."""
    script = f'"$0" -m frictionlab "$@" {shell}'
    command = ["bash", "-c", script, sys.executable, *words]
    return subprocess.run(command, cwd=desk, check=False, capture_output=True, text=True, timeout=100)


@pytest.mark.parametrize("name", list(COMMANDS))
def test_a_full_disk_is_told_in_one_line(name: str, desk: Path) -> None:
    done = run(COMMANDS[name], desk, ">/dev/full")
    told = [line for line in done.stderr.splitlines() if "warning" not in line and "note:" not in line]
    assert done.returncode == 1
    assert len(told) == 1, done.stderr
    assert told[0].startswith("frictionlab: standard output: No space left on device")


@pytest.mark.parametrize("name", ["help", "analyze"])
def test_a_reader_that_leaves_is_no_fault(name: str, desk: Path) -> None:
    done = run(COMMANDS[name], desk, "> >(true); echo $? >status")
    assert (desk / "status").read_text().strip() in ("0", "141")
    assert not [line for line in done.stderr.splitlines() if "warning" not in line and "note:" not in line]


@pytest.mark.parametrize("closed", [">&-", "2>&-"])
def test_closed_streams_are_no_fault(closed: str, desk: Path) -> None:
    done = run(COMMANDS["analyze"], desk, closed)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
