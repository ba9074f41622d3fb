"""Nothing of POSIX alone is needed to start: the parts of Windows that can be had without Windows."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from frictionlab import files
from frictionlab.campaign.files import read_measurements
from frictionlab.tables import write_rows
from tests.desk import ROOT

POSIX = ("fcntl", "resource", "pwd", "grp", "termios")
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
from frictionlab.cli import COMMANDS, app
import frictionlab.files, frictionlab.hdf5.trees, frictionlab.logs, frictionlab.workers, frictionlab.maps
for words in (["--help"], *([name, "--help"] for name in COMMANDS)):
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


def test_a_table_made_under_windows_names_its_recordings_here_too(tmp_path: Path) -> None:
    for suffix in (".csv", ".jsonl"):
        path = tmp_path / f"m{suffix}"
        write_rows([{"source": "my logs\\steel_N1_r0.3.h5", "status": "failed", "reason": "short"}], path)
        (row,) = read_measurements(path)
        assert row["source"] == "my logs/steel_N1_r0.3.h5"


def test_source_is_of_every_system() -> None:
    """No module imports what Windows lacks when it is loaded; text has its encoding; outputs are written as bytes."""
    lacking = tuple(f"{word} {name}" for word in ("import", "from") for name in POSIX)
    for path in (ROOT / "frictionlab").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        for line in text.splitlines():
            assert not line.startswith(lacking), f"{path}: {line}"
            assert ".write_text(" not in line or ">>>" in line or "newline=" in line, f"{path}: {line}"
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Call) and _is_text(node):
                assert "encoding" in {word.arg for word in node.keywords}, f"{path}:{node.lineno}"


def _is_text(call: ast.Call) -> bool:
    """Whether a call opens, reads or writes text."""
    if not isinstance(call.func, ast.Attribute):
        return isinstance(call.func, ast.Name) and call.func.id == "open"
    modes = [a.value for a in call.args if isinstance(a, ast.Constant) and isinstance(a.value, str)]
    of_package = getattr(call.func.value, "id", "") in ("os", "TdmsFile", "archive")
    of_file = call.func.attr == "open" and not of_package and not any("b" in mode for mode in modes)
    return of_file or call.func.attr in ("read_text", "write_text")
