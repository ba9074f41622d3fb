"""One log: opened as far as its beginning shows where things stand, and read, every line accounted for.

A regular line becomes a sample. Every other line is looked at on its own and is blank, a comment, a repeated header,
a sample without a value, or quarantined with the reason; nothing falls through.
"""

import hashlib
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import csv

from frictionlab.arrays import FloatArray
from frictionlab.errors import FrictionlabError, LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.columns import LogColumn, assign
from frictionlab.logs.containers import read_container
from frictionlab.logs.dialect import LogLayout, decimals, is_comment, is_no_value, moment, number, plain, split
from frictionlab.logs.layouts import find_layout
from frictionlab.logs.text import Text, read_text
from frictionlab.recording import LineCount, SourceFile

KEEP = 10_000
"""So many quarantined lines are kept with their text; all of them are counted."""
_LONGEST_KEPT = 300
_PARTS, _FEW = 16, 32  # a block with an odd line is cut in so many parts, down to so few lines, which are judged alone
_LF, _CR = b"\n\r"
_BLANK_ENDS = re.compile(rb" +(?=\r?\n)")
_MOST_EMPTY = 0.25
"""Share of all values (time, mass and base) that may be missing: not much more than half of one channel."""


@contextmanager
def naming(*logs: Path) -> Iterator[None]:
    """Of whatever is wrong with logs their names are said first."""
    try:
        yield
    except (FrictionlabError, OSError) as error:
        unread = f"cannot be read ({getattr(error, 'strerror', '')}): give the path of a log"
        reason = unread if isinstance(error, OSError) else error
        raise LogError(f"{' and '.join(log.name for log in logs)}: {reason}") from error


@dataclass
class Body:
    """What was read: columns as in the file, (n,) each by role, nan for no value, and what became of the lines.

    ``cut``: number of the last line where it was cut (no sign of a damaged log), 0: it was not; ``first``: number of
    the first line; ``rows``: how many hold a sample; ``others``: number and kind of those that hold none, increasing;
    ``quarantined``: number, text and fault of the first of them; ``above``: how many lines of which kind stand above.
    """

    first: int
    rows: int = 0
    values: dict[str, FloatArray] = field(default_factory=dict)
    others: dict[int, str] = field(default_factory=dict)
    cut: int = 0
    quarantined: list[tuple[int, str, str]] = field(default_factory=list)
    above: Counter[str] = field(default_factory=Counter)

    @property
    def counts(self) -> Counter[str]:
        """How many lines are of which kind."""
        return self.above + Counter({"data": self.rows, **Counter(self.others.values())})

    def lines_of(self, samples: NDArray[np.int64]) -> NDArray[np.int64]:
        """Line numbers from 1 of these samples."""
        before = np.array(list(self.others), np.int64) - self.first - np.arange(len(self.others))  # samples above each
        return np.asarray(samples + self.first + np.searchsorted(before, samples, side="right"))

    def samples_at(self, lines: Sequence[int]) -> NDArray[np.int64]:
        """The samples on these lines, or the next ones below."""
        return np.asarray(np.array(lines, np.int64) - self.first - np.searchsorted(list(self.others), lines))

    @property
    def restarts(self) -> list[int]:
        """Lines of the first samples below repeated headers."""
        below = np.unique(self.samples_at([number for number, kind in self.others.items() if kind == "header"]))
        return list(self.lines_of(below[below < self.rows]).tolist())

    def part(self, first: int, stop: int) -> "Body":
        """The lines from one number up to another, not included."""
        a, b = self.samples_at([first, stop]).tolist()
        return Body(
            first=first,
            rows=b - a,
            values={role: column[a:b] for role, column in self.values.items()},
            others={number: kind for number, kind in self.others.items() if first <= number < stop},
            cut=self.cut if first <= self.cut < stop else 0,
            quarantined=[line for line in self.quarantined if first <= line[0] < stop],
        )


@dataclass
class Log:
    """A log, and what is to be said of it, as far as it is read.

    ``name``, ``size`` in bytes, ``sha256``: of its file; ``layout``: where things stand in it; ``text``, or for a
    container ``arrays``: what it holds; ``columns``: which play a role (``time``, ``mass``, ``base``, a further
    channel; ``time`` is missing in a log without stamps); ``body``: their numbers in the file's units and what became
    of the lines; ``evidence``: why it is read so.
    """

    name: str
    size: int
    sha256: str
    layout: LogLayout
    text: Text | None = None
    arrays: tuple[FloatArray, ...] = ()
    columns: dict[str, LogColumn] = field(default_factory=dict)
    body: Body = field(default_factory=lambda: Body(1))
    warnings: list[str] = field(default_factory=list)
    evidence: list[str] = field(default_factory=list)

    @property
    def file(self) -> SourceFile:
        """The log as a recording names it, with what became of its lines."""
        counts = self.body.counts
        return SourceFile(self.name, self.sha256, self.size, LineCount(read=counts.total(), **counts))

    def rows(self, most: int | None = None) -> Iterator[list[str]]:
        """The cells of the first lines of data."""
        layout = self.layout
        lines = self.text.lines[layout.first :] if self.text is not None else ()
        rows = (split(line, layout.separator) for line in lines[:most])
        return (cells for cells in rows if len(cells) == layout.fields)

    def numbers(self, most: int | None = None) -> FloatArray:
        """The numbers of the first lines, or of all at hand (rows, columns); NaN where a cell is none."""
        if self.arrays:
            return _finite(np.stack([column[:most] for column in self.arrays], axis=1))
        decimal, fields = self.layout.decimal, self.layout.fields
        cells = [[number(cell, decimal) for cell in row] for row in self.rows(most)]
        return _finite(np.array(cells, np.float64).reshape(-1, fields))

    def beginning(self, index: int) -> FloatArray:
        """The first numbers of a column, by its index."""
        some = self.numbers(200)[:, index]
        return some[np.isfinite(some)]

    def set_aside(self, samples: NDArray[np.int64], reason: str) -> None:
        """Quarantine the lines of these samples, whose values are taken out already."""
        body = self.body
        lines = body.lines_of(samples).tolist()
        kept = lines[: max(0, KEEP - len(body.quarantined))]
        texts = dict.fromkeys(kept, "") if self.text is None else self.text.texts_of(kept, _LONGEST_KEPT)
        body.quarantined = sorted([*body.quarantined, *((line, texts[line], reason) for line in kept)])
        body.others = dict(sorted((body.others | dict.fromkeys(lines, "quarantined")).items()))
        body.rows -= len(lines)


def open_log(path: Path, options: LogOptions) -> Log:
    """Find out where things stand in a log, text or binary."""
    if (found := read_container(path, options)) is not None:
        layout, arrays = found
        with path.open("rb") as raw:
            sha256 = hashlib.file_digest(raw, "sha256").hexdigest()
        log = Log(path.name, path.stat().st_size, sha256, layout, arrays=arrays)
    else:
        text = read_text(path, options.encoding)
        layout = find_layout(text, options)
        log = Log(path.name, text.size, text.sha256, layout, text, evidence=[*text.evidence])
    log.evidence += [f"layout {layout.name}", *layout.evidence]
    return log


def read_table(log: Log, options: LogOptions, roles: Sequence[str], *, further: bool = False) -> Log:
    """Read the columns of these roles and time, if there is one; with ``further`` all channels. A log is read once."""
    log.columns, log.warnings = assign(log, options, roles, further=further)
    log.evidence += [f"{role} is column {c}, in {c.unit or 'a unit not said'}" for role, c in log.columns.items()]
    log.body = body = _of_arrays(log) if log.text is None else _of_text(log, log.text, options.test)
    data, bad = body.rows, body.counts["quarantined"] - (body.cut > 0)
    first = "no line was quarantined"
    if body.quarantined:
        line, text, reason = body.quarantined[0]
        first = f"first: line {line}: {reason}: {text[:80]!r}"
    if data < 2:
        raise LogError(f"{data} lines of data: expected at least 2; {first}")
    share = bad / (data + bad)
    if share > options.most_damage:
        raise LogError(
            f"damaged beyond use: {bad} of {data + bad} lines cannot be read ({share:.0%}; accepted are "
            f"{options.most_damage:.0%}); {first}"
        )
    empty = sum(int(np.isnan(column).sum()) for column in body.values.values())
    if empty > _MOST_EMPTY * data * len(body.values):
        raise LogError(f"damaged beyond use: {empty} values in {data} lines are missing: expected most of them")
    return log


def _of_arrays(log: Log) -> Body:
    """The columns of a container; its rows are its lines."""
    values = {role: _finite(log.arrays[column.index]) for role, column in log.columns.items()}
    stamped = np.isfinite(values["time"]) if "time" in values else np.ones(len(log.arrays[0]), bool)
    lost = (np.flatnonzero(~stamped) + 1).tolist()
    return Body(
        first=1,
        rows=int(np.count_nonzero(stamped)),
        values={role: column[stamped] for role, column in values.items()},
        others=dict.fromkeys(lost, "quarantined"),
        quarantined=[(row, "", "no time stamp") for row in lost[:KEEP]],
    )


def _of_text(log: Log, text: Text, test: str | int | None) -> Body:
    """The columns of a text; ``test``: of those that a repeated header parts, what stands above it is preamble."""
    layout = log.layout
    # decimals of the last number of a line, if nearly all first lines agree: then one with fewer was cut. Where
    # trailing zeros are left out, a tenth of the lines have fewer.
    found = Counter(decimals(cells[-1], layout.decimal) for cells in log.rows(2000))
    found.pop(None, None)
    usual, times = found.most_common(1)[0] if found else (0, 0)
    last_decimals = usual or 0 if times >= 0.97 * found.total() else 0

    reader = Reader(layout, log.columns, last_decimals=last_decimals, encoding=text.content_encoding)
    for block in text.blocks(layout.body):
        reader.read(block)
    body = reader.finish()
    if test is not None:
        starts = [body.first, *body.restarts]
        if not 1 <= int(test) <= len(starts):
            raise LogError(f"--test {test}: expected 1 to {len(starts)}, as often as the log has its header")
        first, *following = starts[int(test) - 1 :]
        heads = (number for number, kind in body.others.items() if kind == "header" and number >= first)
        body = body.part(first, next(heads) if following else reader.next_line)
    body.above = Counter(header=len(layout.header), preamble=body.first - 1 - layout.body)
    for i in set(range(min(layout.body, len(text.lines)))).difference(layout.header):
        line = text.lines[i]
        body.above["blank" if not line.strip() else "comment" if is_comment(line) else "preamble"] += 1
    return body


class Reader:
    """Read the body of a log block by block; `finish` gives what was read.

    The numbers of regular lines are parsed by pyarrow, to the nearest double. It is silent about none of the faults
    that matter but these, which are looked for in the bytes: a number cut short, quotes, NULs, lone carriage returns,
    and words that it takes for numbers (nan, inf). A block that holds one is cut in parts, and the last few lines
    around an odd one are judged on their own.

    ``columns``: those to read, by role, ``time`` first; ``last_decimals``: that the last field of every line has, 0 if
    they vary.
    """

    def __init__(
        self, layout: LogLayout, columns: Mapping[str, LogColumn], *, last_decimals: int = 0, encoding: str = "utf-8"
    ) -> None:
        self.layout, self.encoding = layout, encoding
        self.wanted = [column.index for column in columns.values()]
        self.has_time = "time" in columns
        self.moments = self.has_time and columns["time"].kind == "m"
        self.last_decimals = last_decimals if self.layout.fields - 1 in self.wanted else 0
        self.next_line = layout.body + 1
        self.body = Body(self.next_line)
        self._parts: dict[str, list[FloatArray]] = {role: [] for role in columns}
        self._signs = b'"\0' + (b"\v\f" if self.layout.separator == " " else b"")

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
            self._take(values)
            self.next_line += lines
        elif lines <= _FEW:
            self._judge(block.split(b"\n")[:-1])
        else:
            ends = np.flatnonzero(np.frombuffer(block, np.uint8) == _LF) + 1
            cuts = [0, *ends[np.linspace(0, lines, _PARTS + 1).astype(int)[1:] - 1].tolist()]
            for start, stop in pairwise(cuts):
                self.read(block[start:stop])

    def finish(self) -> Body:
        """What was read."""
        for role, parts in self._parts.items():
            self.body.values[role] = np.concatenate([np.zeros(0), *parts])
            parts.clear()  # of a long log every column is dear
        if self.body.rows + len(self.body.others) != self.next_line - self.body.first:
            raise LogError("lines do not add up: this is a fault of frictionlab, please report it with the log")
        return self.body

    def _take(self, values: Sequence[FloatArray]) -> None:
        """Add the next samples of each column."""
        self.body.rows += len(values[0])
        for parts, more in zip(self._parts.values(), values, strict=True):
            parts.append(more)

    def _regular(self, block: bytes, lines: int) -> list[FloatArray] | None:
        """The wanted columns where all lines are regular; None where pyarrow may take one for what it is not."""
        mark, text = self.layout.decimal, block
        if self.layout.separator == " ":  # one blank where runs of them part the cells, none at the ends of lines
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
        names = [str(index) for index in range(self.layout.fields)]
        wanted = [names[index] for index in self.wanted]
        convert = csv.ConvertOptions(
            column_types=dict.fromkeys(wanted, pa.float64()),
            include_columns=list(dict.fromkeys(wanted)),
            null_values=[],
            decimal_point=mark,
            check_utf8=False,
        )
        parse = csv.ParseOptions(delimiter=self.layout.separator, quote_char=False, ignore_empty_lines=False)
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
            self._take(list(np.array(rows).T))

    def _kind_of(self, line: bytes) -> tuple[str, str, list[float]]:
        """What one line is, why it is set aside, and its numbers if it is data."""
        text = line.decode(self.encoding, "replace").rstrip("\r\n")
        stripped = text.strip()
        if "\0" in text:
            return "quarantined", "NUL bytes", []
        if not stripped.strip(self.layout.separator + "; ,\t\"'\x1a"):
            return "blank", "", []
        if self.layout.is_header(stripped):
            return "header", "", []
        if is_comment(text):
            return "comment", "", []
        cells, fields = split(text, self.layout.separator), self.layout.fields
        if not fields <= len(cells) <= fields + self.layout.spare:
            return "quarantined", f"expected {fields} fields; got {len(cells)}", []
        values = self._values_of(cells)
        return ("quarantined", values, []) if isinstance(values, str) else ("data", "", values)

    def _values_of(self, cells: Sequence[str]) -> list[float] | str:
        """The wanted numbers of a line, nan where it has no value; or why it is no sample."""
        values = []
        for place, index in enumerate(self.wanted):
            is_time, cell = self.has_time and place == 0, cells[index]
            value = moment(cell) if is_time and self.moments else number(cell, self.layout.decimal)
            if value is None and not is_no_value(cell):
                return f"field {index + 1}: not a number: {plain(cell)[:40]!r}"
            if value is None or not math.isfinite(value):
                if is_time:
                    return f"no time stamp: {plain(cell)[:40]!r}"
                value = math.nan
            values.append(value)
        found = decimals(cells[self.layout.fields - 1], self.layout.decimal) if self.last_decimals else None
        if found is not None and found < self.last_decimals:
            return f"last number cut: expected {self.last_decimals} decimals"
        return values


def _count(block: bytes, sign: int) -> int:
    """How often a byte stands in a block; `bytes.count` is five times as slow where there are many."""
    return int(np.count_nonzero(np.frombuffer(block, np.uint8) == sign))


def _finite(values: FloatArray) -> FloatArray:
    """A copy, nan where the log has no number."""
    return np.where(np.isfinite(values), values, np.nan)
