"""Mutated logs by the thousand: a recording or a clear error, never a traceback, a hang or a line unaccounted for.

    python -m tests.logs.fuzz --count 100000 [--seed 1] [--keep build/fuzz]

A case that fails is kept as a file; its number makes it again.
"""

import argparse
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from frictionlab.errors import FrictionlabError
from frictionlab.logs import LogOptions, read_log
from tests.logs.samples import CLEAN, truth, write

ROWS = 40
LONGEST_S = 20
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
    try:
        recording = read_log(path, options)
    except FrictionlabError as error:
        if not str(error) or "Traceback" in str(error):
            raise AssertionError("an error without words") from error
        return "refused"
    lines, encoding = recording.source.lines, str(recording.source.dialect["encoding"])
    aligned = "alignment" in recording.source.dialect  # a time column per channel: samples are those in common
    if lines.read != lines_of(raw, encoding) or (lines.data != len(recording) and not aligned):
        raise AssertionError(f"{lines} for {lines_of(raw, encoding)} lines and {len(recording)} samples")
    return "damaged" if recording.source.warnings else "read"


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


def main() -> int:
    """Run the cases, print what became of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--keep", type=Path, default=Path("build/fuzz"))
    given = parser.parse_args()
    seen: dict[str, int] = {}
    warnings.simplefilter("error")
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(given.first, given.first + given.count):
            raw, suffix, options = case(given.seed, number)
            try:
                with no_hang(LONGEST_S):
                    outcome = check(raw, suffix, options, Path(folder))
            except Exception:  # noqa: BLE001 - every fault of every kind is what is looked for
                outcome = "FAULT"
                given.keep.mkdir(parents=True, exist_ok=True)
                (given.keep / f"{given.seed}_{number}{suffix}").write_bytes(raw)
                sys.stdout.write(f"case {number}, {options}:\n{traceback.format_exc()}\n")
            seen[outcome] = seen.get(outcome, 0) + 1
    sys.stdout.write(f"{given.count} mutated logs in {time.perf_counter() - begin:.0f} s: {seen}\n")
    return 1 if "FAULT" in seen else 0


if __name__ == "__main__":
    sys.exit(main())
