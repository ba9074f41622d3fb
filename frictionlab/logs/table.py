"""One log file read: its columns as they stand in the file, and the account of its lines."""

import hashlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.body import KEEP, Body, Lines, Reader, Shape, runs
from frictionlab.logs.cells import decimals, number
from frictionlab.logs.columns import Beginning, LogColumn, assign, columns_of, possible
from frictionlab.logs.containers import read_binary
from frictionlab.logs.dialect import Dialect, is_comment, split
from frictionlab.logs.header import LogLayout
from frictionlab.logs.layouts import find_layout
from frictionlab.logs.lines import NUMBERS, Blocks, Head, Progress, read_head
from frictionlab.logs.sheet import Sheet
from frictionlab.recording import LineCount, QuarantinedLine, SourceFile
from frictionlab.units import known_unit

_BEGINNING = 200
_MOST_EMPTY = 0.25
"""Share of all values (time, mass and base) that may be missing: not much more than half of one channel."""


@dataclass(frozen=True)
class LogTable:
    """A log's columns in the file's units.

    Parameters
    ----------
    file
        Name, hash, size and line counts.
    head, layout
        What was found.
    columns
        Role (``time``, ``mass``, ``base``) to column; ``time`` is missing in a log without stamps.
    values
        Role to (n,) float64 in the file's unit; nan where the log has no value.
    samples, lines
        How many there are, and which line each stands on.
    restarts
        Samples before which a header was repeated.
    quarantined
        The first quarantined lines.
    beginning
        Gives the first numbers of any column, by index.
    """

    file: SourceFile
    head: Head
    layout: LogLayout
    columns: dict[str, LogColumn]
    values: dict[str, NDArray[np.float64]]
    samples: int
    lines: Lines
    restarts: NDArray[np.int64]
    quarantined: tuple[QuarantinedLine, ...]
    evidence: tuple[str, ...]
    beginning: Beginning
    warnings: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """The file's name."""
        return self.file.name


def _beginning_of_text(head: Head, layout: LogLayout) -> Beginning:
    dialect = layout.dialect

    def beginning(index: int) -> NDArray[np.float64]:
        rows = (split(line, dialect.separator) for line in head.lines[dialect.first :][:_BEGINNING])
        found = (number(cells[index], dialect.decimal) for cells in rows if len(cells) == dialect.fields)
        return np.array([value for value in found if value is not None and np.isfinite(value)])

    return beginning


def _beginning_of_sheet(sheet: Sheet) -> Beginning:
    return lambda index: sheet.values[index][:_BEGINNING][np.isfinite(sheet.values[index][:_BEGINNING])]


def read_table(
    path: Path, options: LogOptions, roles: Sequence[str], progress: Progress | None = None, *, further: bool = False
) -> LogTable:
    """Read the columns of these roles (``mass``, ``base``) and time, if there is one; with ``further`` all channels.

    Raises
    ------
    LogError
        If the log cannot be read, its columns cannot be told, or too much of it is damaged.
    """
    sheet = read_binary(path, options)
    if sheet is not None:
        return _table_of(sheet, path, options, roles, further=further)
    head = read_head(path, options.encoding)
    layout = find_layout(head, options)
    beginning = _beginning_of_text(head, layout)
    columns, warnings = assign(layout, options, roles, path.name, beginning, further=further)
    shape = _shape(head, layout, columns)
    blocks = Blocks(head, progress)
    try:
        body = _read_body(blocks, layout, shape)
    except OSError as error:
        raise LogError(f"{path}: cannot be read to its end ({error.strerror})") from error
    _check_damage(body, options, path.name)
    return LogTable(
        file=SourceFile(path.name, blocks.sha256, blocks.read, _count(head, layout, body)),
        head=head,
        layout=layout,
        columns=columns,
        values=dict(zip(columns, body.values, strict=True)),
        samples=len(body.lines),
        lines=body.lines,
        restarts=np.unique(body.lines.samples_before(np.array(body.headers, np.int64))),
        quarantined=tuple(QuarantinedLine(path.name, *line) for line in body.quarantined),
        evidence=(
            *head.evidence,
            f"layout {layout.name}",
            *layout.dialect.evidence,
            *layout.evidence,
            *_roles(columns),
        ),
        beginning=beginning,
        warnings=tuple(warnings),
    )


def _table_of(sheet: Sheet, path: Path, options: LogOptions, roles: Sequence[str], *, further: bool) -> LogTable:
    """Give the columns of a binary log as a table; its rows are its lines."""
    state = path.stat()
    layout = layout_of_sheet(sheet)
    columns, warnings = assign(layout, options, roles, path.name, _beginning_of_sheet(sheet), further=further)
    values = {role: _finite(sheet.values[column.index]) for role, column in columns.items()}
    rows = len(sheet.values[0])
    stamped = np.isfinite(values["time"]) if "time" in values else np.ones(rows, bool)
    lost = np.flatnonzero(~stamped)
    lines = Lines()
    for start, stop in runs(stamped):
        lines.add(start + 1, stop - start)
    body = Body(
        values=[column[stamped] for column in values.values()],
        lines=lines,
        empty=sum(int(np.isnan(column[stamped]).sum()) for column in values.values()),
        quarantined=[(int(row) + 1, "", "no time stamp") for row in lost[:KEEP]],
    )
    body.counts |= {"data": rows - len(lost), "quarantined": len(lost)}
    _check_damage(body, options, path.name)
    with path.open("rb") as raw:
        sha256 = hashlib.file_digest(raw, "sha256").hexdigest()
    file = SourceFile(path.name, sha256, state.st_size, LineCount(read=rows, **body.counts))
    head = Head(path, (), NUMBERS, "", "", whole=True, evidence=(), state=(state.st_size, state.st_mtime_ns))
    return LogTable(
        file=file,
        head=head,
        layout=layout,
        columns=columns,
        values=dict(zip(columns, body.values, strict=True)),
        samples=len(lines),
        lines=lines,
        restarts=np.zeros(0, np.int64),
        quarantined=tuple(QuarantinedLine(path.name, *line) for line in body.quarantined),
        evidence=(f"layout {layout.name}", *layout.evidence, *_roles(columns)),
        beginning=_beginning_of_sheet(sheet),
        warnings=tuple(warnings),
    )


def _finite(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """A copy, nan where the log has no number."""
    return np.where(np.isfinite(values), values, np.nan)


def layout_of_sheet(sheet: Sheet) -> LogLayout:
    """Say of a binary log's columns what a layout says of a text's."""
    fields = len(sheet.titles)
    kinds = "".join("m" if i in sheet.moments else "n" for i in range(fields))
    units = [known_unit(unit) for unit in sheet.units]
    return LogLayout(
        name=sheet.layout,
        dialect=Dialect("", "", fields, kinds, 0, ()),
        columns=columns_of(sheet.titles, units, fields),
        header=(),
        body=0,
        facts=sheet.facts,
        evidence=(f"{fields} columns of {len(sheet.values[0])} numbers",),
    )


def _roles(columns: dict[str, LogColumn]) -> list[str]:
    return [f"{role} is column {column}, in {column.unit or 'a unit not said'}" for role, column in columns.items()]


def layout_in(path: Path, options: LogOptions) -> LogLayout:
    """Say where things stand in a log, text or binary."""
    sheet = read_binary(path, options)
    return find_layout(read_head(path, options.encoding), options) if sheet is None else layout_of_sheet(sheet)


def read_beginning(path: Path, options: LogOptions) -> tuple[tuple[LogColumn, ...], NDArray[np.float64] | None]:
    """Return a file's columns and all of its numbers (rows, columns), NaN where a cell is none; None for a long text.

    Raises
    ------
    LogError
        No table of numbers is found in it.
    """
    sheet = read_binary(path, options)
    if sheet is not None:
        return layout_of_sheet(sheet).columns, np.stack([_finite(column) for column in sheet.values], axis=1)
    head = read_head(path, options.encoding)
    layout = find_layout(head, options)
    dialect = layout.dialect
    if not head.whole:
        return layout.columns, None
    rows = [split(line, dialect.separator) for line in head.lines[dialect.first :]]
    cells = [[number(cell, dialect.decimal) for cell in row] for row in rows if len(row) == dialect.fields]
    return layout.columns, np.array([[np.nan if n is None else n for n in row] for row in cells])


def displacements(path: Path, options: LogOptions) -> list[LogColumn]:
    """Columns of a log that may hold a displacement: in a length or in no unit (any, where one is given), no time."""
    sheet = read_binary(path, options)
    if sheet is not None:
        return possible(layout_of_sheet(sheet), options, _beginning_of_sheet(sheet), path.name)
    head = read_head(path, options.encoding)
    layout = find_layout(head, options)
    return possible(layout, options, _beginning_of_text(head, layout), path.name)


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


def _read_body(blocks: Blocks, layout: LogLayout, shape: Shape) -> Body:
    reader = Reader(shape, layout.body + 1, blocks.head.state[0])
    for text, unended in _below_header(blocks, layout.body):
        if unended:
            reader.take_unended(text)
        else:
            reader.read(text)
    return reader.finish()


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
