"""Files appear whole or not at all, whatever ends the work, and on any system: nothing of POSIX alone is needed."""

import errno
import os
import signal
import sys
import time
from collections.abc import Callable, Iterable
from functools import partial
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

from frictionlab import files
from frictionlab.campaign.files import read_measurements
from frictionlab.errors import OutputError
from frictionlab.files import SUFFIX, check_replaceable, write_whole
from frictionlab.tables import write_rows
from tests.desk import ROOT, told_by


def leftovers(folder: Path) -> list[Path]:
    return list(folder.glob(f".*{SUFFIX}"))


def test_replacing_can_be_refused_or_asked(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    write_whole(path, memoryview(b"mine"), replace=False)
    refusal = "exists and is not a file of this kind: choose another output, or give --force"
    with pytest.raises(OutputError, match=refusal):
        write_whole(path, b"new", replace=False)
    with pytest.raises(OutputError, match=refusal):
        write_whole(path, b"new", replace=lambda p: p.read_bytes() == b"yours")
    write_whole(path, b"new", replace=lambda p: p.read_bytes() == b"mine")
    assert path.read_bytes() == b"new"
    assert leftovers(tmp_path) == []


def test_a_symbolic_link_is_followed(tmp_path: Path) -> None:
    (tmp_path / "real").write_bytes(b"old")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    write_whole(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_bytes() == b"new"


def test_what_cannot_hold_a_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="no such folder"):
        write_whole(tmp_path / "none" / "a", b"")
    with pytest.raises(OutputError, match="got something else"):
        write_whole(tmp_path, b"")
    with pytest.raises(OutputError, match="got something else"):
        check_replaceable(Path(os.devnull), replace=True)
    with pytest.raises(OutputError, match=r"could not be written .*what stood there before is untouched"):
        write_whole(tmp_path / ("x" * 300), b"")


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO])
def test_a_fault_at_every_step_leaves_the_old_file(code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.bin"
    write_whole(path, b"old")
    monkeypatch.setattr(files, "_BLOCK", 1)
    new = bytes(range(30))
    for steps in range(len(new) + 2):  # each byte, the sync and the rename
        with monkeypatch.context() as patch:
            _fail_after(patch, steps, code)
            with pytest.raises(OutputError, match=os.strerror(code)):
                write_whole(path, new)
        assert path.read_bytes() == b"old"
        assert leftovers(tmp_path) == []
    with monkeypatch.context() as patch:
        _fail_after(patch, len(new) + 2, code)
        write_whole(path, new)
    assert path.read_bytes() == new


def _fail_after(patch: pytest.MonkeyPatch, steps: int, code: int) -> None:
    """Let the write, sync or rename after so many good ones fail."""
    left = steps

    def counted(inner: Callable[..., object]) -> Callable[..., object]:
        def call(*args: object) -> object:
            nonlocal left
            left -= 1
            if left < 0:
                raise OSError(code, os.strerror(code))
            return inner(*args)

        return call

    patch.setattr(os, "write", counted(os.write))
    patch.setattr(files, "_sync", counted(os.fsync))
    patch.setattr(files, "_rename", counted(os.replace))


def forked(work: Callable[[], object]) -> int:
    """A child that does this and leaves; its number."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            work()
            code = 0
        finally:
            os._exit(code)
    return child


def write_all(path: Path, payloads: Iterable[bytes]) -> None:
    for payload in payloads:
        write_whole(path, payload)


def test_kills_leave_a_whole_file(tmp_path: Path) -> None:
    """A child writes one whole file after the other and is killed; what stands there is always one of them."""
    path = tmp_path / "a.bin"
    payloads = [bytes([k]) * (1 << 18) for k in range(5)]
    write_whole(path, payloads[0])
    draw = np.random.default_rng(1)
    for _ in range(30):
        child = forked(partial(write_all, path, cycle(payloads)))
        time.sleep(draw.uniform(0.0, 0.006))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        assert path.read_bytes() in payloads
    left = leftovers(tmp_path)
    assert left
    write_whole(tmp_path / "b.bin", b"")
    assert leftovers(tmp_path) == left  # their writers may live
    for part in left:
        os.utime(part, (0.0, time.time() - 3700.0))
    write_whole(tmp_path / "b.bin", b"")
    assert leftovers(tmp_path) == []


def test_two_writers_at_once_leave_one_of_both_files(tmp_path: Path) -> None:
    path, payloads = tmp_path / "a.bin", [bytes([k]) * 100_000 for k in range(4)]
    children = [forked(partial(write_all, path, [own] * 50)) for own in payloads]
    assert [os.waitpid(child, 0)[1] for child in children] == [0] * 4
    assert path.read_bytes() in payloads
    assert leftovers(tmp_path) == []


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


@pytest.mark.skipif(sys.platform == "win32", reason="there it is so anyway")
def test_help_starts_where_posix_is_missing(tmp_path: Path) -> None:
    assert len(told_by(WITHOUT + HELP, cwd=tmp_path).split()) > 10


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


def test_outputs_are_the_same_bytes_on_every_system() -> None:
    for path in (ROOT / "frictionlab").rglob("*.py"):
        for line in path.read_text(encoding="utf-8").splitlines():
            assert ".write_text(" not in line or ">>>" in line or "newline=" in line, f"{path}: {line}"
