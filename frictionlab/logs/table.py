"""One log file: opened as far as its beginning shows where things stand, and read, every line accounted for."""

import hashlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.body import KEEP, Body, Reader, Shape
from frictionlab.logs.cells import decimals, number
from frictionlab.logs.columns import LogColumn, assign, columns_of
from frictionlab.logs.containers import read_binary
from frictionlab.logs.dialect import Dialect, is_comment, split
from frictionlab.logs.header import LogLayout
from frictionlab.logs.layouts import find_layout
from frictionlab.logs.lines import NUMBERS, Blocks, Head, read_head
from frictionlab.logs.sheet import Sheet
from frictionlab.logs.unpack import Progress
from frictionlab.recording import LineCount, QuarantinedLine, SourceFile
from frictionlab.units import known_unit

_BEGINNING = 200
_MOST_EMPTY = 0.25
"""Share of all values (time, mass and base) that may be missing: not much more than half of one channel."""


@dataclass(frozen=True)
class OpenLog:
    """A log whose beginning is read: where things stand in it; all of its numbers where it is no text."""

    path: Path
    head: Head
    layout: LogLayout
    sheet: Sheet | None

    @property
    def name(self) -> str:
        """The file's name."""
        return self.path.name

    def beginning(self, index: int) -> NDArray[np.float64]:
        """The first numbers of a column, by its index."""
        if self.sheet is not None:
            some = self.sheet.values[index][:_BEGINNING]
            return some[np.isfinite(some)]
        found = (self._number(cells[index]) for cells in self._rows(_BEGINNING))
        return np.array([value for value in found if value is not None and np.isfinite(value)])

    def numbers(self) -> NDArray[np.float64] | None:
        """All numbers (rows, columns), NaN where a cell is none; None for a long text."""
        if self.sheet is not None:
            return np.stack([_finite(column) for column in self.sheet.values], axis=1)
        if not self.head.whole:
            return None
        rows = [[self._number(cell) for cell in cells] for cells in self._rows(None)]
        return np.array([[np.nan if n is None else n for n in row] for row in rows])

    def _rows(self, most: int | None) -> Iterator[list[str]]:
        dialect = self.layout.dialect
        rows = (split(line, dialect.separator) for line in self.head.lines[dialect.first :][:most])
        return (cells for cells in rows if len(cells) == dialect.fields)

    def _number(self, cell: str) -> float | None:
        return number(cell, self.layout.dialect.decimal)


def open_log(path: Path, options: LogOptions) -> OpenLog:
    """Find out where things stand in a log, text or binary.

    Raises
    ------
    LogError
        It cannot be read, no table of numbers is found in it, or it can be read in more than one way.
    """
    sheet = read_binary(path, options)
    if sheet is None:
        head = read_head(path, options.encoding)
        return OpenLog(path, head, find_layout(head, options), None)
    fields, state = len(sheet.titles), path.stat()
    kinds = "".join("m" if i in sheet.moments else "n" for i in range(fields))
    layout = LogLayout(
        name=sheet.layout,
        dialect=Dialect("", "", fields, kinds, 0, ()),
        columns=columns_of(sheet.titles, [known_unit(unit) for unit in sheet.units], fields),
        header=(),
        body=0,
        facts=sheet.facts,
        evidence=(f"{fields} columns of {len(sheet.values[0])} numbers",),
    )
    head = Head(path, (), NUMBERS, "", "", whole=True, evidence=(), state=(state.st_size, state.st_mtime_ns))
    return OpenLog(path, head, layout, sheet)


@dataclass(frozen=True)
class LogTable:
    """A log's columns in the file's units.

    Parameters
    ----------
    log
        What was found at its beginning.
    file
        Name, hash, size and line counts.
    columns
        Role (``time``, ``mass``, ``base``) to column; ``time`` is missing in a log without stamps.
    values
        Role to (n,) float64 in the file's unit; nan where the log has no value.
    samples
        How many there are.
    body
        Which line each stands on.
    quarantined
        The first quarantined lines.
    """

    log: OpenLog
    file: SourceFile
    columns: dict[str, LogColumn]
    values: dict[str, NDArray[np.float64]]
    samples: int
    body: Body
    quarantined: tuple[QuarantinedLine, ...]
    evidence: tuple[str, ...]
    warnings: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The file's name."""
        return self.file.name


def read_table(
    log: OpenLog, options: LogOptions, roles: Sequence[str], progress: Progress | None = None, *, further: bool = False
) -> LogTable:
    """Read the columns of these roles (``mass``, ``base``) and time, if there is one; with ``further`` all channels.

    Raises
    ------
    LogError
        If the log cannot be read, its columns cannot be told, or too much of it is damaged.
    """
    columns, warnings = assign(log, options, roles, further=further)
    body, file = _of_text(log, columns, progress) if log.sheet is None else _of_sheet(log, log.sheet, columns)
    _check_damage(body, options, log.name)
    found = [f"{role} is column {column}, in {column.unit or 'a unit not said'}" for role, column in columns.items()]
    layout = log.layout
    return LogTable(
        log=log,
        file=file,
        columns=columns,
        values=dict(zip(columns, body.values, strict=True)),
        samples=body.counts["data"],
        body=body,
        quarantined=tuple(QuarantinedLine(log.name, *line) for line in body.quarantined),
        evidence=(*log.head.evidence, f"layout {layout.name}", *layout.dialect.evidence, *layout.evidence, *found),
        warnings=tuple(warnings),
    )


def _of_text(log: OpenLog, columns: dict[str, LogColumn], progress: Progress | None) -> tuple[Body, SourceFile]:
    blocks = Blocks(log.head, progress)
    reader = Reader(_shape(log.head, log.layout, columns), log.layout.body + 1, log.head.state[0])
    try:
        for text, unended in _below_header(blocks, log.layout.body):
            if unended:
                reader.take_unended(text)
            else:
                reader.read(text)
    except OSError as error:
        raise LogError(f"{log.path}: cannot be read to its end ({error.strerror})") from error
    body = reader.finish()
    return body, SourceFile(log.name, blocks.sha256, blocks.read, _count(log.head, log.layout, body))


def _of_sheet(log: OpenLog, sheet: Sheet, columns: dict[str, LogColumn]) -> tuple[Body, SourceFile]:
    """The columns of a binary log; its rows are its lines."""
    values = {role: _finite(sheet.values[column.index]) for role, column in columns.items()}
    rows = len(sheet.values[0])
    stamped = np.isfinite(values["time"]) if "time" in values else np.ones(rows, bool)
    lost = (np.flatnonzero(~stamped) + 1).tolist()
    body = Body(
        first=1,
        values=[column[stamped] for column in values.values()],
        others=lost,
        empty=sum(int(np.isnan(column[stamped]).sum()) for column in values.values()),
        quarantined=[(row, "", "no time stamp") for row in lost[:KEEP]],
    )
    body.counts |= {"data": rows - len(lost), "quarantined": len(lost)}
    with log.path.open("rb") as raw:
        sha256 = hashlib.file_digest(raw, "sha256").hexdigest()
    return body, SourceFile(log.name, sha256, log.head.state[0], LineCount(read=rows, **body.counts))


def _finite(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """A copy, nan where the log has no number."""
    return np.where(np.isfinite(values), values, np.nan)


def _shape(head: Head, layout: LogLayout, columns: dict[str, LogColumn]) -> Shape:
    dialect = layout.dialect
    wanted = tuple(c.index for c in columns.values())
    return Shape(
        separator=dialect.separator,
        decimal=dialect.decimal,
        fields=dialect.fields,
        wanted=wanted,
        has_time="time" in columns,
        moments="time" in columns and dialect.kinds[columns["time"].index] == "m",
        last_decimals=_last_decimals(head, layout) if dialect.fields - 1 in wanted else 0,
        spare=layout.spare,
        is_header=layout.is_header,
        encoding="utf-8" if head.encoding.startswith("utf") else head.encoding,
    )


def _last_decimals(head: Head, layout: LogLayout) -> int:
    """Decimals of the last number of a line, if (nearly) all lines at hand agree; else 0.

    Where trailing zeros are left out, a tenth of the lines have fewer; where they are not, only a cut line has.
    """
    dialect = layout.dialect
    rows = (split(line, dialect.separator) for line in head.lines[dialect.first :])
    found = Counter(decimals(cells[-1], dialect.decimal) for cells in rows if len(cells) == dialect.fields)
    found.pop(None, None)
    if not found:
        return 0
    usual, times = found.most_common(1)[0]
    return usual or 0 if times >= 0.97 * found.total() else 0


def _below_header(blocks: Blocks, skip: int) -> Iterator[tuple[bytes, bool]]:
    """Give the blocks without the first ``skip`` lines of the log."""
    for block, unended in blocks:
        at = 0
        while skip and at < len(block):
            end = block.find(b"\n", at)
            at, skip = (len(block) if end < 0 else end + 1), skip - 1
        if at < len(block):
            yield (block[at:] if at else block), unended


def _count(head: Head, layout: LogLayout, body: Body) -> LineCount:
    counts = dict(body.counts)
    counts["header"] += len(layout.header)
    preamble = 0
    for i, line in enumerate(head.lines[: layout.body]):
        if i in layout.header:
            continue
        kind = "blank" if not line.strip() else "comment" if is_comment(line) else "preamble"
        if kind == "preamble":
            preamble += 1
        else:
            counts[kind] += 1
    return LineCount(read=sum(counts.values()) + preamble, preamble=preamble, **counts)


def _check_damage(body: Body, options: LogOptions, name: str) -> None:
    data, bad = body.counts["data"], body.counts["quarantined"] - body.cut
    empty = body.empty
    if data < 2:
        raise LogError(f"{name}: {data} lines of data: expected at least 2; {_first(body)}")
    share = bad / (data + bad)
    if share > options.most_damage:
        raise LogError(
            f"{name}: damaged beyond use: {bad} of {data + bad} lines cannot be read ({share:.0%}; accepted are "
            f"{options.most_damage:.0%}); {_first(body)}"
        )
    if empty > _MOST_EMPTY * data * len(body.values):
        raise LogError(f"{name}: damaged beyond use: {empty} values in {data} lines are missing: expected most of them")


def _first(body: Body) -> str:
    if not body.quarantined:
        return "no line was quarantined"
    line, text, reason = body.quarantined[0]
    return f"first: line {line}: {reason}: {text[:80]!r}"
