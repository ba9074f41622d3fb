"""The lines below the header: numbers out, every line accounted for.

A regular line becomes a sample. Every other line is looked at on its own and is blank, a comment, a repeated header,
a sample without a value, or quarantined with the reason; nothing falls through.
"""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.logs.cells import decimals, is_no_value, moment, number, plain
from frictionlab.logs.dialect import is_comment, split
from frictionlab.logs.lines import Bytes
from frictionlab.logs.store import Columns

KEEP = 10_000
"""So many quarantined lines are kept with their text; all of them are counted."""
COMPILE_FROM = 1 << 22
"""Logs from this size [bytes] are read by the compiled kernel; below, loading it takes longer than it saves."""
_LONGEST_KEPT = 300


@dataclass(frozen=True)
class Shape:
    """What a data line looks like.

    Parameters
    ----------
    separator, decimal
        One character each.
    fields
        Cells in a line.
    wanted
        Field numbers from 0 of the columns to read; a time column comes first.
    has_time
        Whether the first wanted column is time: a line without a stamp is quarantined.
    moments
        Whether the time column holds clock times instead of numbers.
    last_decimals
        Decimals that the last field of every line has; 0 if they vary.
    spare
        So many cells of text may follow the fields of a data line.
    is_header
        Says of a stripped line whether it is a header repeated in the body.
    encoding
        Of text kept for the record.
    """

    separator: str
    decimal: str
    fields: int
    wanted: tuple[int, ...]
    has_time: bool
    moments: bool = False
    last_decimals: int = 0
    spare: int = 0
    is_header: Callable[[str], bool] = field(default=lambda _: False)
    encoding: str = "utf-8"


@dataclass
class Lines:
    """Which line each sample stands on: samples that follow one another on consecutive lines share one anchor."""

    samples: list[int] = field(default_factory=list)
    numbers: list[int] = field(default_factory=list)
    size: int = 0

    def __len__(self) -> int:
        return self.size

    def add(self, first: int, count: int) -> None:
        """Append ``count`` samples on consecutive lines from ``first``."""
        if count and (not self.numbers or first != self.numbers[-1] + self.size - self.samples[-1]):
            self.samples.append(self.size)
            self.numbers.append(first)
        self.size += count

    def of(self, samples: NDArray[np.int64]) -> NDArray[np.int64]:
        """Line numbers from 1 of these samples."""
        at = np.searchsorted(self.samples, samples, side="right") - 1
        return np.asarray(np.array(self.numbers)[at] + samples - np.array(self.samples)[at])

    def samples_before(self, lines: NDArray[np.int64]) -> NDArray[np.int64]:
        """How many samples stand above each of these lines."""
        if not self.numbers:
            return np.zeros(len(lines), np.int64)
        at = np.searchsorted(self.numbers, lines, side="right") - 1
        ends = np.append(self.samples[1:], self.size)
        found = np.array(self.samples)[at] + lines - np.array(self.numbers)[at]
        return np.where(at < 0, 0, np.minimum(found, ends[at]))


@dataclass
class Body:
    """What was read: columns as in the file (their units), and what became of the lines.

    ``values`` are (n,) float64 for each wanted column, nan for no value; ``empty`` counts those, and ``cut``
    whether the last line was cut (which is no sign of a damaged log).
    """

    values: list[NDArray[np.float64]] = field(default_factory=list)
    lines: "Lines" = field(default_factory=Lines)
    empty: int = 0
    cut: int = 0
    counts: dict[str, int] = field(
        default_factory=lambda: dict.fromkeys(("data", "header", "blank", "comment", "quarantined"), 0)
    )
    quarantined: list[tuple[int, str, str]] = field(default_factory=list)
    headers: list[int] = field(default_factory=list)


@dataclass(frozen=True)
class _Verdict:
    kind: str
    values: tuple[float, ...] = ()
    reason: str = ""


def judge(line: Bytes, shape: Shape) -> _Verdict:
    """Say what one line is, and read it if it is data."""
    text = line.decode(shape.encoding if shape.encoding.isascii() else "utf-8", "replace").rstrip("\r\n")
    if "\0" in text:
        return _Verdict("quarantined", reason="NUL bytes")
    stripped = text.strip()
    if not stripped.strip(shape.separator + "; ,\t\"'\x1a"):
        return _Verdict("blank")
    if shape.is_header(stripped):
        return _Verdict("header")
    if is_comment(text):
        return _Verdict("comment")
    cells = split(text, shape.separator)
    if not shape.fields <= len(cells) <= shape.fields + shape.spare:
        return _Verdict("quarantined", reason=f"expected {shape.fields} fields; got {len(cells)}")
    return _judge_cells(cells, shape)


def _judge_cells(cells: list[str], shape: Shape) -> _Verdict:
    values = []
    for place, index in enumerate(shape.wanted):
        is_time = shape.has_time and place == 0
        value = moment(cells[index]) if is_time and shape.moments else number(cells[index], shape.decimal)
        if value is None and is_no_value(cells[index]):
            value = math.nan
        if value is None:
            return _Verdict("quarantined", reason=f"field {index + 1}: not a number: {plain(cells[index])[:40]!r}")
        if not math.isfinite(value):
            if is_time:
                return _Verdict("quarantined", reason=f"no time stamp: {plain(cells[index])[:40]!r}")
            value = math.nan
        values.append(value)
    if _is_cut(cells[shape.fields - 1], shape):
        return _Verdict("quarantined", reason=f"last number cut: expected {shape.last_decimals} decimals")
    return _Verdict("data", tuple(values))


def _is_cut(cell: str, shape: Shape) -> bool:
    """Whether the last number of a line has lost digits, where all lines have the same number of decimals."""
    if not shape.last_decimals or shape.fields - 1 not in shape.wanted:
        return False
    found = decimals(cell, shape.decimal)
    return found is not None and found < shape.last_decimals


@dataclass(frozen=True)
class Parsed:
    """A block's regular lines as (wanted, rows) values, their place in the store, and the lines to be looked at.

    ``odd`` holds (line of the block from 0, text) of each line that is not regular.
    """

    values: NDArray[np.float64]
    start: int
    lines: int
    odd: Sequence[tuple[int, Bytes]] = ()


class Reader:
    """Read the body of a log block by block; `finish` gives what was read."""

    def __init__(self, shape: Shape, first_line: int, *, compiled: bool) -> None:
        self.shape, self.next_line, self.compiled = shape, first_line, compiled
        self.body = Body()
        self.store = Columns(len(shape.wanted))
        self._regular = _regular_line(shape)
        self._rank = np.argsort(np.argsort(shape.wanted))

    def read(self, block: Bytes) -> None:
        """Read a block at once."""
        if not self.compiled:
            self.take(self._parse_plain(block))
            return
        lines = self.count(block)
        if not self.store.has_room(lines):
            self.store.grow(lines)
        self.take(self.parse(block, self.store.reserve(lines), lines))

    def count(self, block: Bytes) -> int:
        """Count the lines of a block: for so many there must be room in the store before it is parsed."""
        from frictionlab.logs.kernel import count_lines  # noqa: PLC0415 - loading the compiler is for large logs only

        return count_lines(block)

    def parse(self, block: Bytes, start: int, lines: int) -> Parsed:
        """Parse the regular lines of a block into the place reserved for it; safe to call from several threads."""
        from frictionlab.logs.kernel import parse_lines  # noqa: PLC0415

        shape = self.shape
        target = np.full(shape.fields, -1, np.int64)
        target[list(shape.wanted)] = np.arange(len(shape.wanted))
        data = self.store.data
        rows, odd = parse_lines(
            block, shape.separator, shape.decimal, target, shape.last_decimals, (data, start, lines)
        )
        texts = [(line, block[begin:end]) for begin, end, line in odd.tolist()]
        return Parsed(data[:, start : start + rows], start, lines, texts)

    def _parse_plain(self, block: Bytes) -> Parsed:
        rows: list[tuple[float, ...]] = []
        odd: list[tuple[int, Bytes]] = []
        lines = bytes(block).split(b"\n")[:-1]
        for i, line in enumerate(lines):
            match = self._regular.fullmatch(line)
            if match is None:
                odd.append((i, line))
            else:
                rows.append(tuple(map(self._number, match.groups())))
        values = np.array(rows, np.float64).reshape(-1, len(self.shape.wanted)).T
        return Parsed(values[self._rank], -1, len(lines), odd)

    def _number(self, digits: Bytes) -> float:
        return float(digits if self.shape.decimal == "." else digits.replace(b",", b"."))

    def take(self, parsed: Parsed) -> None:
        """Add a parsed block; blocks come in the order of the file."""
        values = parsed.values
        if parsed.odd:
            values = self._with_odd(values, parsed.lines, parsed.odd)
        else:
            self.body.lines.add(self.next_line, parsed.lines)
        if parsed.start < 0:
            self.store.append(values)
        else:
            self.store.settle(parsed.start, values)
        self.body.counts["data"] += values.shape[1]
        self.next_line += parsed.lines

    def _with_odd(
        self, values: NDArray[np.float64], count: int, odd: Sequence[tuple[int, Bytes]]
    ) -> NDArray[np.float64]:
        """Judge the lines that are not regular, and put those that are data in their places."""
        more: list[tuple[float, ...]] = []
        is_data = np.ones(count, bool)
        is_regular = np.ones(count, bool)
        for i, text in odd:
            is_regular[i] = False
            verdict = judge(text, self.shape)
            if verdict.kind == "data":
                more.append(verdict.values)
                self.body.empty += sum(map(math.isnan, verdict.values))
            else:
                is_data[i] = False
                self._note(self.next_line + i, text, verdict)
        for start, stop in runs(is_data):
            self.body.lines.add(self.next_line + start, stop - start)
        if not more:
            return values
        merged = np.empty((len(values), int(is_data.sum())))
        merged[:, is_regular[is_data]] = values
        merged[:, ~is_regular[is_data]] = np.array(more).T
        return merged

    def _note(self, line: int, text: Bytes, verdict: _Verdict) -> None:
        self.body.counts[verdict.kind] += 1
        if verdict.kind == "header":
            self.body.headers.append(line)
        if verdict.kind == "quarantined" and len(self.body.quarantined) < KEEP:
            kept = text[:_LONGEST_KEPT].decode(self.shape.encoding, "replace").rstrip("\r\n")
            self.body.quarantined.append((line, kept, verdict.reason))

    def take_unended(self, text: Bytes) -> None:
        """Add the last line of a file that does not end in a line end: data only if it is provably whole."""
        verdict = judge(text, self.shape)
        if verdict.kind == "data" and not self.shape.last_decimals:
            verdict = _Verdict("quarantined", reason="the file ends inside this line: it may be cut")
        if verdict.kind == "data":
            self.body.empty += sum(map(math.isnan, verdict.values))
            self.take(Parsed(np.array([verdict.values]).T, -1, 1))
            return
        self._note(self.next_line, text, verdict)
        self.body.cut += verdict.kind == "quarantined"
        self.next_line += 1

    def finish(self) -> Body:
        """Put the blocks together."""
        self.body.values = self.store.columns()
        if self.body.counts["data"] != len(self.body.lines):
            raise LogError("lines do not add up: this is a fault of frictionlab, please report it with the log")
        return self.body


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Start and end of each run of true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _regular_line(shape: Shape) -> re.Pattern[bytes]:
    """Build the pattern of a regular line, with one group for each wanted column in the order of the fields."""
    mark, separator = re.escape(shape.decimal), re.escape(shape.separator)
    other = r"[^\s\"\0]+" if shape.separator == " " else rf"[^{separator}\"\0\r]*"
    parts = []
    for index in range(shape.fields):
        least = shape.last_decimals if index == shape.fields - 1 else 0
        fraction = rf"{mark}\d{{{least},{max(least, 18)}}}"
        digits = rf"\d{{1,18}}{fraction}" if least else rf"(?:\d{{1,18}}(?:{fraction})?|{mark}\d{{1,18}})"
        value = rf"([+-]?{digits}(?:[eE][+-]?\d{{1,2}})?)"
        parts.append(value if index in shape.wanted else other)
    blank, joint = (r"[ \t]*", r"[ \t]+") if shape.separator == " " else (" *", f" *{separator} *")
    return re.compile((blank + joint.join(parts) + blank + "\r?").encode())
