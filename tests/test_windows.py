"""Nothing of POSIX alone is needed to start: the parts of Windows that can be had without Windows."""

import subprocess
import sys
from pathlib import Path

import pytest

from frictionlab import files
from tests.desk import ROOT

WITHOUT = """
import os, sys
for name in ("fcntl", "resource", "pwd", "grp", "termios", "tty", "pty"):
    sys.modules[name] = None
for name in ("fork", "pread", "pwrite", "pwritev", "posix_fallocate", "sched_getaffinity", "O_CLOEXEC", "O_NOFOLLOW"):
    if hasattr(os, name):
        delattr(os, name)
"""
HELP = """
from typer.testing import CliRunner
from frictionlab.cli import SUMMARIES, app
import frictionlab.files, frictionlab.hdf5.maps, frictionlab.logs, frictionlab.workers.local, frictionlab.maps
for words in (["--help"], *([name, "--help"] for name in SUMMARIES)):
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    print(done.output.split()[1])
"""


def run(code: str, folder: Path) -> "subprocess.CompletedProcess[str]":
    line = [sys.executable, "-c", code]
    return subprocess.run(line, cwd=folder, capture_output=True, text=True, check=False, timeout=100)


@pytest.mark.skipif(sys.platform == "win32", reason="there it is so anyway")
def test_help_starts_where_posix_is_missing(tmp_path: Path) -> None:
    done = run(WITHOUT + HELP, tmp_path)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.split()) > 10


def test_the_package_runs_as_a_module(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "frictionlab", "--version"], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("frictionlab ")


LACKING = ("fcntl", "resource", "pwd", "grp", "termios")


def test_no_module_imports_what_windows_lacks() -> None:
    """Not when it is loaded; a function may, behind a question."""
    lacking = [
        f"{path.relative_to(ROOT)}:{number}"
        for path in (ROOT / "frictionlab").rglob("*.py")
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if line.startswith(tuple(f"{word} {name}" for word in ("import", "from") for name in LACKING))
    ]
    assert not lacking


def test_a_file_is_replaced_where_an_open_one_cannot_be_renamed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on Windows: the temporary file is closed before it is renamed or removed, and no folder is synced."""
    monkeypatch.setattr(files, "WINDOWS", True)
    renamed = files._rename

    def rename(part: Path, final: Path) -> None:
        assert not any(Path(f"/proc/self/fd/{n}").resolve() == part for n in range(3, 64)), "it is open"
        renamed(part, final)

    monkeypatch.setattr(files, "_rename", rename)
    for text in (b"one", b"two"):
        files.write_whole(tmp_path / "a.txt", text)
    assert (tmp_path / "a.txt").read_bytes() == b"two"
    with pytest.raises(ZeroDivisionError, match="by zero"):
        files.write_whole(tmp_path / "a.txt", (bytes([1 // n]) for n in (1, 0)))
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
