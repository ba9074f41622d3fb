"""The lines below the header: numbers out, every line accounted for.

A regular line becomes a sample. Every other line is looked at on its own and is blank, a comment, a repeated header,
a sample without a value, or quarantined with the reason; nothing falls through.
"""

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import csv

from frictionlab.errors import LogError
from frictionlab.logs.columns import LogColumn
from frictionlab.logs.dialect import decimals, is_comment, is_no_value, moment, number, plain, split
from frictionlab.logs.layouts import LogLayout

KEEP = 10_000
"""So many quarantined lines are kept with their text; all of them are counted."""
_LONGEST_KEPT = 300
_PARTS, _FEW = 16, 32  # a block with an odd line is cut in so many parts, down to so few lines, which are judged alone
_LF, _CR = b"\n\r"
_BLANK_ENDS = re.compile(rb" +(?=\r?\n)")


@dataclass
class Body:
    """What was read: columns as in the file, (n,) each, nan for no value, and what became of the lines.

    ``cut``: number of the last line where it was cut (no sign of a damaged log), 0: it was not; ``first``: number of
    the first line; ``others``: number and kind of the lines that hold no sample, increasing; ``texts``: of lines that
    the clock may set aside, by their numbers; ``above``: how many lines of which kind stand above the first.
    """

    first: int
    values: list[NDArray[np.float64]] = field(default_factory=list)
    others: dict[int, str] = field(default_factory=dict)
    cut: int = 0
    quarantined: list[tuple[int, str, str]] = field(default_factory=list)
    texts: dict[int, str] = field(default_factory=dict)
    above: Counter[str] = field(default_factory=Counter)

    @property
    def counts(self) -> Counter[str]:
        """How many lines are of which kind."""
        return self.above + Counter({"data": len(self.values[0]), **Counter(self.others.values())})

    def set_aside(self, samples: NDArray[np.int64], reason: str) -> None:
        """Quarantine the lines of these samples."""
        lines = self.lines_of(samples).tolist()
        more = [(n, self.texts.get(n, ""), reason) for n in lines[: max(0, KEEP - len(self.quarantined))]]
        self.quarantined = sorted([*self.quarantined, *more])
        self.others = dict(sorted((self.others | dict.fromkeys(lines, "quarantined")).items()))
        self.values = [np.delete(column, samples) for column in self.values]

    def lines_of(self, samples: NDArray[np.int64]) -> NDArray[np.int64]:
        """Line numbers from 1 of these samples."""
        before = np.array(list(self.others), np.int64) - self.first - np.arange(len(self.others))  # samples above each
        return np.asarray(samples + self.first + np.searchsorted(before, samples, side="right"))

    def samples_at(self, lines: Sequence[int]) -> NDArray[np.int64]:
        """The samples on these lines, or the next ones below."""
        return np.asarray(np.array(lines, np.int64) - self.first - np.searchsorted(list(self.others), lines))

    @property
    def restarts(self) -> NDArray[np.int64]:
        """Samples before which a header was repeated."""
        found = np.unique(self.samples_at([number for number, kind in self.others.items() if kind == "header"]))
        return found[found < len(self.values[0])]

    def part(self, first: int, stop: int) -> "Body":
        """The lines from one number up to another, not included."""
        a, b = self.samples_at([first, stop]).tolist()
        return Body(
            first=first,
            values=[column[a:b] for column in self.values],
            others={number: kind for number, kind in self.others.items() if first <= number < stop},
            cut=self.cut if first <= self.cut < stop else 0,
            quarantined=[line for line in self.quarantined if first <= line[0] < stop],
        )


class Reader:
    """Read the body of a log block by block; `finish` gives what was read.

    The numbers of regular lines are parsed by pyarrow, to the nearest double. It is silent about none of the faults
    that matter but these, which are looked for in the bytes: a number cut short, quotes, NULs, lone carriage returns,
    and words that it takes for numbers (nan, inf). A block that holds one is cut in parts, and the last few lines
    around an odd one are judged on their own.

    ``columns``: those to read, by role, ``time`` first; ``last_decimals``: that the last field of every line has, 0 if
    they vary; ``size``: bytes of the log, for the memory to take; ``first``: the line to begin at, by its index.
    """

    def __init__(
        self,
        layout: LogLayout,
        columns: Mapping[str, LogColumn],
        *,
        first: int,
        last_decimals: int = 0,
        encoding: str = "utf-8",
        size: int = 0,
    ) -> None:
        self.layout, self.dialect, self.encoding = layout, layout.dialect, encoding
        self.wanted = [column.index for column in columns.values()]
        self.has_time = "time" in columns
        self.moments = self.has_time and self.dialect.kinds[self.wanted[0]] == "m"
        self.last_decimals = last_decimals if self.dialect.fields - 1 in self.wanted else 0
        self.next_line = first + 1
        self.body = Body(self.next_line)
        self._size, self._data, self._columns = size, 0, np.empty((len(self.wanted), 0))
        self._signs = b'"\0' + (b"\v\f" if self.dialect.separator == " " else b"")

    def read(self, block: bytes) -> None:
        """Read a block of whole lines; the last line of a log may have no end."""
        if not block.endswith(b"\n"):
            cut = block.rfind(b"\n") + 1
            if cut:
                self.read(block[:cut])
            self._judge([block[cut:]], unended=True)
            return
        lines = _count(block, _LF)
        values = self._regular(block, lines)
        if values is not None:
            self._take(values, self._size * lines // len(block))
            self.next_line += lines
        elif lines <= _FEW:
            self._judge(block.split(b"\n")[:-1])
        else:
            ends = np.flatnonzero(np.frombuffer(block, np.uint8) == _LF) + 1
            cuts = [0, *ends[np.linspace(0, lines, _PARTS + 1).astype(int)[1:] - 1].tolist()]
            for start, stop in pairwise(cuts):
                self.read(block[start:stop])

    def _regular(self, block: bytes, lines: int) -> list[NDArray[np.float64]] | None:
        """The wanted columns where all lines are regular; None where pyarrow may take one for what it is not."""
        mark, text = self.dialect.decimal, block
        if self.dialect.separator == " ":  # one blank where runs of them part the cells, none at the ends of lines
            text = text.replace(b"\t", b" ").replace(b"\r\n", b"\n")
            while b"  " in text:
                text = text.replace(b"  ", b" ")
            text = text.replace(b" \n", b"\n").replace(b"\n ", b"\n").removeprefix(b" ")
        elif b" " in text:
            text = _BLANK_ENDS.sub(b"", text)
        if self.moments or any(text.find(sign) >= 0 for sign in self._signs):
            return None
        returns = _count(text, _CR) if b"\r" in text else 0
        if returns or self.last_decimals:
            signs = np.frombuffer(text, np.uint8)
            last = np.flatnonzero(signs == _LF)
            ended = signs[last - 1] == _CR if returns else np.zeros(1, bool)
            if np.count_nonzero(ended) != returns:
                return None
            last = last - ended
            if self.last_decimals and (signs[np.maximum(last - self.last_decimals - 1, 0)] != ord(mark)).any():
                return None
        names = [str(index) for index in range(self.dialect.fields)]
        wanted = [names[index] for index in self.wanted]
        convert = csv.ConvertOptions(
            column_types=dict.fromkeys(wanted, pa.float64()),
            include_columns=list(dict.fromkeys(wanted)),
            null_values=[],
            decimal_point=mark,
            check_utf8=False,
        )
        parse = csv.ParseOptions(delimiter=self.dialect.separator, quote_char=False, ignore_empty_lines=False)
        try:
            how = csv.ReadOptions(column_names=names, block_size=len(text) + 1, use_threads=False)
            table = csv.read_csv(pa.BufferReader(text), how, parse, convert)
        except pa.ArrowInvalid:
            return None
        values = [table[name].to_numpy() for name in wanted]
        return values if table.num_rows == lines and all(np.isfinite(v).all() for v in values) else None

    def _judge(self, lines: Sequence[bytes], *, unended: bool = False) -> None:
        """Read each line if it is data; ``unended``: the file ends inside it, and it is so only if provably whole."""
        rows: list[list[float]] = []
        for line in lines:
            kind, reason, row = self._kind_of(line)
            if unended and kind == "data" and not self.last_decimals:
                kind, reason = "quarantined", "the file ends inside this line: it may be cut"
            if kind == "data":
                rows.append(row)
            else:
                self.body.others[self.next_line] = kind
            if kind == "quarantined":
                self.body.cut = self.next_line if unended else 0
                if len(self.body.quarantined) < KEEP:
                    text = line[:_LONGEST_KEPT].decode(self.encoding, "replace").rstrip("\r\n")
                    self.body.quarantined.append((self.next_line, text, reason))
            self.next_line += 1
        if rows:
            self._take(list(np.array(rows).T), 0)

    def _take(self, values: Sequence[NDArray[np.float64]], expected: int) -> None:
        """Add the next samples; so many are expected in all, by the lines of this block."""
        start = self._data
        stop = self._data = start + len(values[0])
        if stop > self._columns.shape[1]:
            grown = np.empty((len(values), max(int(1.02 * expected), 3 * stop // 2)))
            grown[:, :start] = self._columns[:, :start]
            self._columns = grown
        for column, more in zip(self._columns, values, strict=True):
            column[start:stop] = more

    def _kind_of(self, line: bytes) -> tuple[str, str, list[float]]:
        """What one line is, why it is set aside, and its numbers if it is data."""
        text = line.decode(self.encoding if self.encoding.isascii() else "utf-8", "replace").rstrip("\r\n")
        stripped = text.strip()
        if "\0" in text:
            return "quarantined", "NUL bytes", []
        if not stripped.strip(self.dialect.separator + "; ,\t\"'\x1a"):
            return "blank", "", []
        if self.layout.is_header(stripped):
            return "header", "", []
        if is_comment(text):
            return "comment", "", []
        cells, fields = split(text, self.dialect.separator), self.dialect.fields
        if not fields <= len(cells) <= fields + self.layout.spare:
            return "quarantined", f"expected {fields} fields; got {len(cells)}", []
        values = self._values_of(cells)
        return ("quarantined", values, []) if isinstance(values, str) else ("data", "", values)

    def _values_of(self, cells: Sequence[str]) -> list[float] | str:
        """The wanted numbers of a line, nan where it has no value; or why it is no sample."""
        values = []
        for place, index in enumerate(self.wanted):
            is_time, cell = self.has_time and place == 0, cells[index]
            value = moment(cell) if is_time and self.moments else number(cell, self.dialect.decimal)
            if value is None and not is_no_value(cell):
                return f"field {index + 1}: not a number: {plain(cell)[:40]!r}"
            if value is None or not math.isfinite(value):
                if is_time:
                    return f"no time stamp: {plain(cell)[:40]!r}"
                value = math.nan
            values.append(value)
        found = decimals(cells[self.dialect.fields - 1], self.dialect.decimal) if self.last_decimals else None
        if found is not None and found < self.last_decimals:
            return f"last number cut: expected {self.last_decimals} decimals"
        return values

    def finish(self) -> Body:
        """What was read."""
        self.body.values = [column[: self._data] for column in self._columns]
        if self._data + len(self.body.others) != self.next_line - self.body.first:
            raise LogError("lines do not add up: this is a fault of frictionlab, please report it with the log")
        return self.body


def _count(block: bytes, sign: int) -> int:
    """How often a byte stands in a block; `bytes.count` is five times as slow where there are many."""
    return int(np.count_nonzero(np.frombuffer(block, np.uint8) == sign))
