"""Mutated logs by the thousand: a recording or a clear error, never a traceback, a hang or a line unaccounted for.

Each is read twice, in blocks and line by line, with one result.

    python -m tests.logs.fuzz --count 100000 [--seed 1] [--workers 2] [--keep build/fuzz]

A case that fails is kept as a file; its number makes it again.
"""

import gzip
import sys
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np

from frictionlab.errors import FrictionlabError
from frictionlab.logs import LogOptions, read_log
from frictionlab.logs.lines import Reader
from frictionlab.recording import Recording
from tests.armour.mutations import cut, flipped
from tests.logs.samples import CLEAN, truth

ROWS = 40
JUNK = (
    "\0", "\0" * 30, "nan", "inf", "1e999", "-1e400", "∞", "---", "+FFFFFFF", "203.50", "203,50", "abc", "é", "\ufeff",
    "=cmd|' /C calc'!A0", "\x1b[31m", "1.2.3", "1,2,3", ";;;;", "\t\t", '"', "'", "\r", "\n", "\r\n", "\x85", "\u2028",
    "#", "***End_of_Header***", "X_Value", "9" * 400, "0x1F", "1_000", "٣", "-", "+", ".", ",", "e", " ", "\x1a",
)  # fmt: skip

Mutation = Callable[[bytes, np.random.Generator], bytes]


def _drop(raw: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(raw)))
    return raw[:at] + raw[at + int(rng.integers(1, 80)) :]


def _put_in(raw: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(raw)))
    junk = rng.bytes(int(rng.integers(1, 40))) if rng.random() < 0.3 else JUNK[int(rng.integers(len(JUNK)))].encode()
    return raw[:at] + junk + raw[at:]


def _lines(change: Callable[[list[bytes], int, int], object]) -> Mutation:
    """A mutation that changes the list of lines at one of them, with another in mind."""

    def mutation(raw: bytes, rng: np.random.Generator) -> bytes:
        lines = raw.split(b"\n")
        change(lines, *(int(i) for i in rng.integers(len(lines), size=2)))
        return b"\n".join(lines)

    return mutation


def _cell(raw: bytes, rng: np.random.Generator) -> bytes:
    lines, separator = raw.split(b"\n"), (b",", b";", b"\t")[int(rng.integers(3))]
    at = int(rng.integers(len(lines)))
    cells = lines[at].split(separator)
    cells[int(rng.integers(len(cells)))] = JUNK[int(rng.integers(len(JUNK)))].encode()
    lines[at] = separator.join(cells)
    return b"\n".join(lines)


def _swap(raw: bytes, rng: np.random.Generator) -> bytes:
    marks = [b",", b";", b"\t", b".", b" ", b"\n", b"\r\n"]
    a, b = rng.choice(len(marks), 2, replace=False)
    return raw.replace(marks[int(a)], marks[int(b)])


def _wide(raw: bytes, rng: np.random.Generator) -> bytes:
    codec = ("utf-16", "utf-16-le", "utf-16-be", "utf-8-sig", "utf-32")[int(rng.integers(5))]
    return raw.decode("latin-1").encode(codec)


MUTATIONS: tuple[Mutation, ...] = (
    flipped, cut, _drop, _put_in, _put_in, _put_in, _cell, _cell, _swap, _wide,
    _lines(lambda lines, i, _: lines.insert(i, lines[i])),
    _lines(lambda lines, i, _: lines.__setitem__(slice(i, i + 2), [b"".join(lines[i : i + 2])])),
    _lines(lambda lines, i, _: lines.pop(i)),
    _lines(lambda lines, i, to: lines.insert(to, lines.pop(i))),
    _lines(lambda lines, i, _: lines.insert(i, lines[0])),
)  # fmt: skip
OPTIONS = (
    LogOptions(), LogOptions(), LogOptions(unit="mm", time_unit="s"), LogOptions(time=1, mass=2, base=3),
    LogOptions(sampling_rate_hz=250.0), LogOptions(most_damage=1.0), LogOptions(separator=";", decimal=","),
)  # fmt: skip


def case(seed: int, number: int) -> tuple[bytes, str, LogOptions]:
    """Make a mutated log, the suffix of its name and the options to read it with."""
    rng = np.random.default_rng((seed, number))
    names = list(CLEAN)
    make, encoding, _ = CLEAN[names[int(rng.integers(len(names)))]]
    raw = make(truth(ROWS, seed=int(rng.integers(5)))).encode(encoding)
    for _ in range(int(rng.integers(1, 5))):
        raw = MUTATIONS[int(rng.integers(len(MUTATIONS)))](raw, rng) or b"\n"
    return raw, ".csv.gz" if rng.random() < 0.05 else ".csv", OPTIONS[int(rng.integers(len(OPTIONS)))]


def lines_of(raw: bytes, encoding: str) -> int:
    """Count lines the slow and obvious way, as the encoding found has them."""
    text = raw.decode(encoding if encoding.startswith(("utf-16", "utf-32")) else "latin-1", "replace")
    if "\n" not in text[: 1 << 18]:
        text = text.replace("\r", "\n")
    return text.count("\n") + (not text.endswith("\n"))


def check(raw: bytes, suffix: str, options: LogOptions, folder: Path) -> str:
    """Read one case; the outcome in a word. Whatever else is raised is a fault."""
    path = folder / f"case{suffix}"
    path.write_bytes(gzip.compress(raw, mtime=0) if suffix.endswith(".gz") else raw)
    recording = _read(path, options)
    with patch.object(Reader, "_regular", lambda *_: None):  # every line is judged on its own
        judged = _read(path, options)
    if isinstance(recording, str) or isinstance(judged, str):
        if recording != judged:
            raise AssertionError(f"two ways to read, two results: {recording} and {judged}")
        return "refused"
    _compare(recording, judged)
    lines, encoding = recording.source.lines, str(recording.source.dialect["encoding"])
    aligned = "alignment" in recording.source.dialect  # a time column per channel: samples are those in common
    if lines.read != lines_of(raw, encoding) or (lines.data != len(recording) and not aligned):
        raise AssertionError(f"{lines} for {lines_of(raw, encoding)} lines and {len(recording)} samples")
    return "damaged" if recording.source.warnings else "read"


def _read(path: Path, options: LogOptions) -> Recording | str:
    """Give the recording, or the words of the error."""
    try:
        return read_log(path, options)
    except FrictionlabError as error:
        if not str(error) or "Traceback" in str(error):
            raise AssertionError("an error without words") from error
        return str(error)


def _compare(one: Recording, other: Recording) -> None:
    np.testing.assert_array_equal(one.time, other.time)
    np.testing.assert_array_equal(one.quality, other.quality)
    np.testing.assert_equal(dict(one.measured()), dict(other.measured()))
    for name in ("files", "dialect", "quarantined", "warnings", "evidence"):
        if getattr(one.source, name) != getattr(other.source, name):
            raise AssertionError(f"two ways to read, two kinds of {name}")


if __name__ == "__main__":
    from tests.armour import fuzz

    sys.exit(fuzz.main([fuzz.TEXT]))
