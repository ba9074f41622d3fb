"""Mutated logs by the thousand: a recording or a clear error, never a traceback, a hang or a line unaccounted for.

Each is read twice, in blocks and line by line, with one result.

    python -m tests.logs.fuzz --count 100000 [--seed 1] [--workers 2] [--keep build/fuzz]

A case that fails is kept as a file; its number makes it again.
"""

import argparse
import os
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from itertools import repeat
from multiprocessing import get_context
from pathlib import Path
from unittest.mock import patch

import numpy as np

from frictionlab.errors import FrictionlabError
from frictionlab.logs import LogOptions, read_log
from frictionlab.logs.lines import Reader
from frictionlab.recording import Recording
from tests.logs.samples import CLEAN, truth, write

ROWS = 40
LONGEST_S = 20
PART = 500
JUNK = (
    "\0", "\0" * 30, "nan", "inf", "1e999", "-1e400", "∞", "---", "+FFFFFFF", "203.50", "203,50", "abc", "é", "\ufeff",
    "=cmd|' /C calc'!A0", "\x1b[31m", "1.2.3", "1,2,3", ";;;;", "\t\t", '"', "'", "\r", "\n", "\r\n", "\x85", "\u2028",
    "#", "***End_of_Header***", "X_Value", "9" * 400, "0x1F", "1_000", "٣", "-", "+", ".", ",", "e", " ", "\x1a",
)  # fmt: skip

Mutation = Callable[[bytes, np.random.Generator], bytes]


def _flip(raw: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(raw)))
    return raw[:at] + bytes([int(rng.integers(256))]) + raw[at + 1 :]


def _cut(raw: bytes, rng: np.random.Generator) -> bytes:
    return raw[: int(rng.integers(len(raw)))] or raw


def _drop(raw: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(raw)))
    return raw[:at] + raw[at + int(rng.integers(1, 80)) :] or raw


def _junk(raw: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(raw)))
    return raw[:at] + JUNK[int(rng.integers(len(JUNK)))].encode() + raw[at:]


def _bytes(raw: bytes, rng: np.random.Generator) -> bytes:
    at = int(rng.integers(len(raw)))
    return raw[:at] + rng.bytes(int(rng.integers(1, 40))) + raw[at:]


def _line(raw: bytes, rng: np.random.Generator, change: Callable[[list[bytes], int], None]) -> bytes:
    lines = raw.split(b"\n")
    change(lines, int(rng.integers(len(lines))))
    return b"\n".join(lines)


def _double(raw: bytes, rng: np.random.Generator) -> bytes:
    return _line(raw, rng, lambda lines, i: lines.insert(i, lines[i]))


def _merge(raw: bytes, rng: np.random.Generator) -> bytes:
    return _line(raw, rng, lambda lines, i: lines.__setitem__(slice(i, i + 2), [b"".join(lines[i : i + 2])]))


def _lose(raw: bytes, rng: np.random.Generator) -> bytes:
    return _line(raw, rng, lambda lines, i: lines.__delitem__(i))


def _move(raw: bytes, rng: np.random.Generator) -> bytes:
    to = int(rng.integers(raw.count(b"\n") + 1))
    return _line(raw, rng, lambda lines, i: lines.insert(to, lines.pop(i)))


def _header_again(raw: bytes, rng: np.random.Generator) -> bytes:
    return _line(raw, rng, lambda lines, i: lines.insert(i, lines[0]))


def _cell(raw: bytes, rng: np.random.Generator) -> bytes:
    word = JUNK[int(rng.integers(len(JUNK)))].encode()
    separator = (b",", b";", b"\t")[int(rng.integers(3))]

    def change(lines: list[bytes], i: int) -> None:
        cells = lines[i].split(separator)
        cells[int(rng.integers(len(cells)))] = word
        lines[i] = separator.join(cells)

    return _line(raw, rng, change)


def _swap(raw: bytes, rng: np.random.Generator) -> bytes:
    marks = [b",", b";", b"\t", b".", b" ", b"\n", b"\r\n"]
    a, b = rng.choice(len(marks), 2, replace=False)
    return raw.replace(marks[int(a)], marks[int(b)])


def _wide(raw: bytes, rng: np.random.Generator) -> bytes:
    codec = ("utf-16", "utf-16-le", "utf-16-be", "utf-8-sig", "utf-32")[int(rng.integers(5))]
    return raw.decode("latin-1").encode(codec)


MUTATIONS: tuple[Mutation, ...] = (
    _flip, _flip, _cut, _drop, _junk, _junk, _bytes, _double, _merge, _lose, _move, _header_again, _cell, _cell, _swap,
    _wide,
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
    if suffix.endswith(".gz"):
        write(path, raw.decode("latin-1"), "latin-1")
    else:
        path.write_bytes(raw)
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


@contextmanager
def no_hang(seconds: int) -> Iterator[None]:
    """Raise if the body takes longer."""

    def late(*_: object) -> None:
        raise TimeoutError(f"hangs: longer than {seconds} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def run(seed: int, numbers: range, keep: Path) -> tuple[Counter[str], list[str]]:
    """Check some cases; how often each outcome was seen, and what is to be said of those that failed."""
    warnings.simplefilter("error")
    seen, faults = Counter[str](), []
    with tempfile.TemporaryDirectory() as folder:
        for number in numbers:
            raw, suffix, options = case(seed, number)
            try:
                with no_hang(LONGEST_S):
                    seen[check(raw, suffix, options, Path(folder))] += 1
            except Exception:  # noqa: BLE001 - every fault of every kind is what is looked for
                seen["FAULT"] += 1
                keep.mkdir(parents=True, exist_ok=True)
                (keep / f"{seed}_{number}{suffix}").write_bytes(raw)
                faults.append(f"case {number}, {options}:\n{traceback.format_exc()}")
    return seen, faults


def main() -> int:
    """Run the cases, print what became of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--keep", type=Path, default=Path("build/fuzz"))
    given = parser.parse_args()
    last, seen, begin = given.first + given.count, Counter[str](), time.perf_counter()
    parts = [range(at, min(at + PART, last)) for at in range(given.first, last, PART)]
    with ProcessPoolExecutor(given.workers, mp_context=get_context("spawn")) as pool:
        for more, faults in pool.map(run, repeat(given.seed), parts, repeat(given.keep)):
            seen += more
            sys.stdout.write("".join(f"{fault}\n" for fault in faults))
            if seen.total() % 10_000 < PART:
                sys.stdout.write(f"{seen.total()} of {given.count} after {time.perf_counter() - begin:.0f} s\n")
            sys.stdout.flush()
    sys.stdout.write(f"{given.count} mutated logs in {time.perf_counter() - begin:.0f} s: {dict(seen)}\n")
    return 1 if seen["FAULT"] else 0


if __name__ == "__main__":
    sys.exit(main())
