"""A share of the mutated logs of `tests.logs.fuzz`, logs cut at any byte, and what happens to files on a disk."""

import errno
import hashlib
import os
from pathlib import Path

import pytest

from frictionlab.errors import LogError
from frictionlab.logs import LogOptions, read_log
from tests.logs.fuzz import case, check, lines_of
from tests.logs.samples import table, truth, write

TEXT = table(truth(200), "time [s],mass [mm],base [mm]", ",")


def test_mutated_logs_are_read_or_refused(tmp_path: Path) -> None:
    assert {"refused", "damaged"} <= {check(*case(1, number), tmp_path) for number in range(120)}


def test_a_log_cut_at_any_byte_is_read_or_refused(tmp_path: Path) -> None:
    raw = TEXT[:2000].encode()
    path = tmp_path / "log.csv"
    read = 0
    for size in range(0, len(raw), 37):
        path.write_bytes(raw[:size])
        try:
            recording = read_log(path, LogOptions(unit="mm"))
        except LogError:
            continue
        lines = recording.source.lines
        assert lines.read == lines_of(raw[:size], "utf-8")
        assert len(recording) == lines.data >= raw[:size].count(b"\n") - 1
        read += 1
    assert read > 1800 // 37


def test_an_endless_line_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(b"time [s],mass [mm],base [mm]\n" + b"0.1,1,2\n0.2,1,2\n0.3,1,2\n" + b"7" * (1 << 25))
    with pytest.raises(LogError, match="a line longer than"):
        read_log(path)


def test_a_log_that_changes_while_it_is_read_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "log.csv", TEXT)
    state = os.fstat

    def grown(descriptor: int) -> os.stat_result:
        with path.open("a") as file:
            file.write("9.0,1,2\n")
        return state(descriptor)

    monkeypatch.setattr("frictionlab.logs.text.os.fstat", grown)
    with pytest.raises(LogError, match="changed while it was read"):
        read_log(path)


def test_a_disk_that_fails_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "log.csv", TEXT)

    def fail(*_: object) -> int:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(Path, "open", fail)
    with pytest.raises(LogError, match=r"log\.csv: cannot be read \(Input/output error\)"):
        read_log(path)


def test_the_digest_is_that_of_the_file_as_it_is(tmp_path: Path) -> None:
    for name in ("log.csv", "log.csv.gz"):
        path = write(tmp_path / name, TEXT)
        (file,) = read_log(path).source.files
        assert file.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
        assert file.size_bytes == path.stat().st_size
