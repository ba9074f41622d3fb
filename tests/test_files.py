"""Files appear whole or not at all: disk full at every write, kills at random moments, two writers, leftovers."""

import errno
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from frictionlab import files
from frictionlab.errors import OutputError
from frictionlab.files import SUFFIX, check_replaceable, write_whole


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


def test_kills_leave_a_whole_file(tmp_path: Path) -> None:
    """A child writes one whole file after the other and is killed; what stands there is always one of them."""
    path = tmp_path / "a.bin"
    payloads = [bytes([k]) * (1 << 18) for k in range(5)]
    write_whole(path, payloads[0])
    draw = np.random.default_rng(1)
    for _ in range(30):
        child = os.fork()
        if child == 0:
            _write_for_ever(path, payloads)
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


def _write_for_ever(path: Path, payloads: list[bytes]) -> None:
    try:
        while True:
            for payload in payloads:
                write_whole(path, payload)
    finally:
        os._exit(1)


def test_two_writers_at_once_leave_one_of_both_files(tmp_path: Path) -> None:
    path = tmp_path / "a.bin"
    children = []
    for k in range(4):
        child = os.fork()
        if child == 0:
            code = 1
            try:
                for _ in range(50):
                    write_whole(path, bytes([k]) * 100_000)
                code = 0
            finally:
                os._exit(code)
        children.append(child)
    assert [os.waitpid(child, 0)[1] for child in children] == [0] * 4
    assert path.read_bytes() in [bytes([k]) * 100_000 for k in range(4)]
    assert leftovers(tmp_path) == []
