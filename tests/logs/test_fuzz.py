"""A share of the mutated logs of `tests.logs.fuzz`, and a log cut at any byte."""

import errno
import hashlib
import os
from pathlib import Path

import pytest

from frictionlab.errors import LogError
from frictionlab.logs import LogOptions, read_log
from tests.logs.fuzz import LONGEST_S, case, check, lines_of, no_hang
from tests.logs.samples import sensortool, table, truth, write

PART = 100


@pytest.mark.parametrize("part", range(3))
def test_mutated_logs_are_read_or_refused(part: int, tmp_path: Path) -> None:
    outcomes = []
    for number in range(part * PART, (part + 1) * PART):
        raw, suffix, options = case(1, number)
        with no_hang(LONGEST_S):
            outcomes.append(check(raw, suffix, options, tmp_path))
    assert {"refused", "damaged"} <= set(outcomes)


def test_a_log_cut_at_any_byte_is_read_or_refused(tmp_path: Path) -> None:
    raw = table(truth(70), "time [s],mass [mm],base [mm]", ",").encode()
    assert 1900 < len(raw) < 2200
    path = tmp_path / "log.csv"
    read = 0
    for size in range(0, len(raw), 7):
        path.write_bytes(raw[:size])
        try:
            recording = read_log(path, LogOptions(unit="mm"))
        except LogError:
            continue
        lines = recording.source.lines
        assert lines.read == lines_of(raw[:size], "utf-8")
        assert len(recording) == lines.data >= raw[:size].count(b"\n") - 1
        read += 1
    assert read > 1800 // 7


def test_a_compressed_log_cut_anywhere_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv.gz", table(truth(200), "time [s],mass [mm],base [mm]", ","))
    raw = path.read_bytes()
    for size in range(1, len(raw) - 1, 37):
        path.write_bytes(raw[:size])
        with pytest.raises(LogError, match=r"gzip data|no lines of numbers|empty|not utf|lines of data"):
            read_log(path)


def test_a_gzip_bomb_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frictionlab.logs.text.FREE", 1 << 16)
    path = write(tmp_path / "log.csv.gz", "time [s],mass [mm],base [mm]\n" + "0,0,0\n" * 200_000)
    with pytest.raises(LogError, match=r"unpacks to more than .* accepted are 0.0655 MB, or 50 times the file"):
        read_log(path)


def test_an_endless_line_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(b"time [s],mass [mm],base [mm]\n" + b"0.1,1,2\n0.2,1,2\n0.3,1,2\n" + b"7" * (1 << 25))
    with pytest.raises(LogError, match="a line longer than"):
        read_log(path)


def test_a_log_that_changes_while_it_is_read_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "log.csv", table(truth(200), "time [s],mass [mm],base [mm]", ","))
    state = os.fstat

    def grown(descriptor: int) -> os.stat_result:
        with path.open("a") as file:
            file.write("9.0,1,2\n")
        return state(descriptor)

    monkeypatch.setattr("frictionlab.logs.text.os.fstat", grown)
    with pytest.raises(LogError, match="changed while it was read"):
        read_log(path)


def test_a_disk_that_fails_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "log.csv", table(truth(200), "time [s],mass [mm],base [mm]", ","))

    def fail(*_: object) -> int:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(Path, "open", fail)
    with pytest.raises(LogError, match=r"log\.csv: cannot be read \(Input/output error\)"):
        read_log(path)


def test_the_digest_is_that_of_the_file_as_it_is(tmp_path: Path) -> None:
    for name in ("log.csv", "log.csv.gz"):
        path = write(tmp_path / name, table(truth(200), "time [s],mass [mm],base [mm]", ","))
        (file,) = read_log(path).source.files
        assert file.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
        assert file.size_bytes == path.stat().st_size


def test_a_sensortool_log_cut_at_many_bytes(tmp_path: Path) -> None:
    raw = sensortool(truth(40), 1, ";").encode()
    path = tmp_path / "log.csv"
    for size in range(0, len(raw), 13):
        path.write_bytes(raw[:size])
        with pytest.raises(LogError, match=r"\w+"):  # any words will do: one channel is no recording
            read_log(path)
