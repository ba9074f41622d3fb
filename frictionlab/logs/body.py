"""The lines below the header: numbers out, every line accounted for.

A regular line becomes a sample. Every other line is looked at on its own and is blank, a comment, a repeated header,
a sample without a value, or quarantined with the reason; nothing falls through.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import csv

from frictionlab.errors import LogError
from frictionlab.logs.cells import decimals, is_no_value, moment, number, plain
from frictionlab.logs.dialect import is_comment, split

KEEP = 10_000
"""So many quarantined lines are kept with their text; all of them are counted."""
_LONGEST_KEPT = 300
_NUL, _LF, _CR, _QUOTE = b'\0\n\r"'
_OTHER_BLANKS = b"\v\f"
_ASCII = bytes(range(128)) + b"?" * 128
_BLANK_ENDS = re.compile(rb" +(?=\r?\n)")


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
class Body:
    """What was read: columns as in the file (their units), and what became of the lines.

    ``values`` are (n,) float64 for each wanted column, nan for no value; ``empty`` counts those, and ``cut``
    whether the last line was cut (which is no sign of a damaged log). ``first`` is the number of the first line, and
    ``others`` are those of the lines that hold no sample, increasing.
    """

    first: int
    values: list[NDArray[np.float64]] = field(default_factory=list)
    others: list[int] = field(default_factory=list)
    empty: int = 0
    cut: int = 0
    counts: dict[str, int] = field(
        default_factory=lambda: dict.fromkeys(("data", "header", "blank", "comment", "quarantined"), 0)
    )
    quarantined: list[tuple[int, str, str]] = field(default_factory=list)
    headers: list[int] = field(default_factory=list)

    def lines_of(self, samples: NDArray[np.int64]) -> NDArray[np.int64]:
        """Line numbers from 1 of these samples."""
        before = np.array(self.others, np.int64) - self.first - np.arange(len(self.others))  # samples above each
        return np.asarray(samples + self.first + np.searchsorted(before, samples, side="right"))

    @property
    def restarts(self) -> NDArray[np.int64]:
        """Samples before which a header was repeated."""
        lines = np.array(self.headers, np.int64)
        return np.unique(lines - self.first - np.searchsorted(self.others, lines))


@dataclass(frozen=True)
class _Verdict:
    kind: str
    values: tuple[float, ...] = ()
    reason: str = ""


def judge(line: bytes, shape: Shape) -> _Verdict:
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


class Reader:
    """Read the body of a log block by block; `finish` gives what was read.

    The numbers of regular lines are parsed by pyarrow, to the nearest double. It is silent about none of the faults
    that matter but these, which are looked for in the bytes: a number cut short, quotes, NULs, lone carriage returns,
    and words that it takes for numbers (nan, inf). Whatever line is not regular is judged on its own.
    """

    def __init__(self, shape: Shape, first_line: int, size: int = 0) -> None:
        self.shape, self.next_line = shape, first_line
        self.body = Body(first_line)
        self._size = size  # bytes of the log: how much memory to take
        self._columns = np.empty((len(shape.wanted), 0))

    def read(self, block: bytes) -> None:
        """Read a block of whole lines."""
        plain_block = self._without_blanks(block)
        ends = np.flatnonzero(np.frombuffer(plain_block, np.uint8) == _LF)
        odd = np.arange(len(ends)) if self.shape.moments else self._suspicious(plain_block, ends)
        values, odd = self._numbers(plain_block, ends, odd)
        if len(odd):
            values = self._with_odd(values, len(ends), block, odd)
        self._take(values, self._size * len(ends) // len(block))
        self.next_line += len(ends)

    def _without_blanks(self, block: bytes) -> bytes:
        """The block with one blank where runs of them part the cells, and none at the ends of its lines."""
        if self.shape.separator == " ":
            block = block.replace(b"\t", b" ").replace(b"\r\n", b"\n")
            while b"  " in block:
                block = block.replace(b"  ", b" ")
            return block.replace(b" \n", b"\n").replace(b"\n ", b"\n").removeprefix(b" ")
        return _BLANK_ENDS.sub(b"", block) if b" " in block else block

    def _suspicious(self, block: bytes, ends: NDArray[np.intp]) -> NDArray[np.intp]:
        """Lines that pyarrow may take for what they are not: with quotes, NULs, lone CRs, a last number cut short."""
        text = np.frombuffer(block, np.uint8)
        returns = b"\r" in block
        signs = (_QUOTE, _NUL, *(_OTHER_BLANKS if self.shape.separator == " " else b""))
        found = [np.flatnonzero(text == byte) for byte in signs if byte in block]
        if returns:
            at = np.flatnonzero(text == _CR)
            found.append(at[text[at + 1] != _LF])
        odd = [np.searchsorted(ends, at) for at in found]
        if self.shape.last_decimals:
            last = ends - (text[ends - 1] == _CR) if returns else ends
            mark = text[np.maximum(last - self.shape.last_decimals - 1, 0)]
            odd.append(np.flatnonzero(mark != ord(self.shape.decimal)))
        return np.unique(np.concatenate(odd)) if odd else np.zeros(0, np.intp)

    def _numbers(
        self, block: bytes, ends: NDArray[np.intp], odd: NDArray[np.intp]
    ) -> tuple[list[NDArray[np.float64]], NDArray[np.intp]]:
        """The wanted columns of all lines but the odd ones, and these, with those that turned out to be."""
        regular = np.delete(np.arange(len(ends)), odd)
        for attempt in range(3):
            text = _lines_of(block, ends, regular) if len(regular) < len(ends) else block
            try:
                values = self._parsed(text, len(regular))
                break
            except pa.ArrowInvalid:
                regular = regular[self._parsable(text, len(regular))] if attempt == 0 else regular[:0]
        finite = np.isfinite(values).all(axis=0) if values else np.ones(0, bool)
        if not finite.all():
            values, regular = [column[finite] for column in values], regular[finite]
        return values, np.delete(np.arange(len(ends)), regular)

    def _parsed(self, text: bytes, lines: int) -> list[NDArray[np.float64]]:
        """The wanted columns of these lines as doubles; raises where one line is not of numbers as expected."""
        if not lines:
            return [np.zeros(0) for _ in self.shape.wanted]
        table = self._csv(text, pa.float64())
        if table.num_rows != lines:
            raise pa.ArrowInvalid(f"expected {lines} rows; got {table.num_rows}")
        return [table[str(index)].to_numpy() for index in self.shape.wanted]

    def _parsable(self, text: bytes, lines: int) -> NDArray[np.bool_]:
        """Which of these lines have as many fields as all, and numbers in those that are wanted."""
        import pyarrow.compute as pc  # noqa: PLC0415 - 0.1 s that sound logs need not wait for

        sound = np.ones(lines, bool)

        def pass_over(row: Any) -> str:
            sound[row.number - 1] = False
            return "skip"

        table = self._csv(text.translate(_ASCII), pa.binary(), pass_over)  # the rows passed over must be text
        mark = re.escape(self.shape.decimal)
        pattern = rf"^[ \t]*[+-]?(\d+{mark}?\d*|{mark}\d+)([eE][+-]?\d+)?[ \t]*$"
        good = np.ones(table.num_rows, bool)
        for index in self.shape.wanted:
            good &= pc.match_substring_regex(table[str(index)], pattern).to_numpy()
        sound[sound] = good
        return sound

    def _csv(self, text: bytes, kind: Any, pass_over: Callable[[Any], str] | None = None) -> Any:
        names = [str(index) for index in range(self.shape.fields)]
        wanted = [names[index] for index in dict.fromkeys(self.shape.wanted)]
        return csv.read_csv(
            pa.BufferReader(text),
            csv.ReadOptions(column_names=names, block_size=len(text) + 1, use_threads=False),
            csv.ParseOptions(
                delimiter=self.shape.separator,
                quote_char=False,
                ignore_empty_lines=False,
                invalid_row_handler=pass_over,
            ),
            csv.ConvertOptions(
                column_types=dict.fromkeys(wanted, kind),
                include_columns=wanted,
                null_values=[],
                decimal_point=self.shape.decimal,
                check_utf8=False,
            ),
        )

    def _with_odd(
        self, values: list[NDArray[np.float64]], count: int, block: bytes, odd: NDArray[np.intp]
    ) -> list[NDArray[np.float64]]:
        """Judge the lines that are not regular, and put those that are data in their places."""
        more: list[tuple[float, ...]] = []
        is_data = np.ones(count, bool)
        is_regular = np.ones(count, bool)
        is_regular[odd] = False
        lines = block.split(b"\n")
        for i in odd.tolist():
            verdict = judge(lines[i], self.shape)
            if verdict.kind == "data":
                more.append(verdict.values)
                self.body.empty += sum(map(math.isnan, verdict.values))
            else:
                is_data[i] = False
                self._note(self.next_line + i, lines[i], verdict)
        if not more:
            return values
        merged = np.empty((len(values), int(is_data.sum())))
        merged[:, is_regular[is_data]] = values
        merged[:, ~is_regular[is_data]] = np.array(more).T
        return list(merged)

    def _take(self, values: list[NDArray[np.float64]], expected: int) -> None:
        """Add the next samples; so many are expected in all, by the lines of this block."""
        start = self.body.counts["data"]
        stop = start + len(values[0])
        if stop > self._columns.shape[1]:
            grown = np.empty((len(values), max(stop, int(1.02 * expected), 3 * stop // 2)))
            grown[:, :start] = self._columns[:, :start]
            self._columns = grown
        for column, more in zip(self._columns, values, strict=True):
            column[start:stop] = more
        self.body.counts["data"] = stop

    def _note(self, line: int, text: bytes, verdict: _Verdict) -> None:
        self.body.counts[verdict.kind] += 1
        self.body.others.append(line)
        if verdict.kind == "header":
            self.body.headers.append(line)
        if verdict.kind == "quarantined" and len(self.body.quarantined) < KEEP:
            kept = text[:_LONGEST_KEPT].decode(self.shape.encoding, "replace").rstrip("\r\n")
            self.body.quarantined.append((line, kept, verdict.reason))

    def take_unended(self, text: bytes) -> None:
        """Add the last line of a file that does not end in a line end: data only if it is provably whole."""
        verdict = judge(text, self.shape)
        if verdict.kind == "data" and not self.shape.last_decimals:
            verdict = _Verdict("quarantined", reason="the file ends inside this line: it may be cut")
        if verdict.kind == "data":
            self.body.empty += sum(map(math.isnan, verdict.values))
            self._take([np.array([value]) for value in verdict.values], 0)
        else:
            self._note(self.next_line, text, verdict)
            self.body.cut += verdict.kind == "quarantined"
        self.next_line += 1

    def finish(self) -> Body:
        """What was read, the columns where they were put."""
        self.body.values = [column[: self.body.counts["data"]] for column in self._columns]
        if self.body.counts["data"] + len(self.body.others) != self.next_line - self.body.first:
            raise LogError("lines do not add up: this is a fault of frictionlab, please report it with the log")
        return self.body


def _lines_of(block: bytes, ends: NDArray[np.intp], chosen: NDArray[np.intp]) -> bytes:
    """These lines of a block, runs of them in one piece."""
    starts = np.concatenate([[0], ends[:-1] + 1]) if len(ends) else ends
    breaks = np.flatnonzero(np.diff(chosen) > 1) + 1
    return b"".join(block[starts[run[0]] : ends[run[-1]] + 1] for run in np.split(chosen, breaks) if len(run))
