"""One log file: opened as far as its beginning shows where things stand, and read, every line accounted for.

Also a table over frequency (amplitude and phase of a steady motion) in any dialect of a log.
"""

import hashlib
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import FrictionlabError, LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.columns import LogColumn, assign, candidates, columns_of
from frictionlab.logs.containers import Sheet, read_binary
from frictionlab.logs.dialect import Dialect, decimals, is_comment, number, split
from frictionlab.logs.layouts import LogLayout, find_layout
from frictionlab.logs.lines import KEEP, Body, Reader
from frictionlab.logs.text import Text, read_text
from frictionlab.recording import FrequencyTable, LineCount, QuarantinedLine, SourceFile
from frictionlab.units import LENGTH, QUANTITIES, known_unit

_MOST_EMPTY = 0.25
"""Share of all values (time, mass and base) that may be missing: not much more than half of one channel."""


@contextmanager
def naming(*logs: Path) -> Iterator[None]:
    """Of whatever is wrong with logs their names are said first."""
    try:
        yield
    except FrictionlabError as error:
        raise LogError(f"{' and '.join(log.name for log in logs)}: {error}") from error


@dataclass(frozen=True)
class OpenLog:
    """A log of ``size`` bytes with this digest, and where things stand in it: a text, or a sheet of numbers."""

    name: str
    layout: LogLayout
    size: int
    sha256: str
    text: Text | None = None
    sheet: Sheet | None = None

    def rows(self, most: int | None = None) -> Iterator[list[str]]:
        """The cells of the first lines of data."""
        dialect = self.layout.dialect
        lines = self.text.lines[dialect.first :] if self.text is not None else ()
        rows = (split(line, dialect.separator) for line in lines[:most])
        return (cells for cells in rows if len(cells) == dialect.fields)

    def numbers(self, most: int | None = None) -> FloatArray:
        """The numbers of the first lines, or of all at hand (rows, columns); NaN where a cell is none."""
        decimal, fields = self.layout.dialect.decimal, self.layout.dialect.fields
        if self.sheet is not None:
            found = np.stack([column[:most] for column in self.sheet.values], axis=1)
        else:
            cells = [[number(cell, decimal) for cell in row] for row in self.rows(most)]
            found = np.array(cells, np.float64).reshape(-1, fields)
        return _finite(found)

    def beginning(self, index: int) -> FloatArray:
        """The first numbers of a column, by its index."""
        some = self.numbers(200)[:, index]
        return some[np.isfinite(some)]


def open_log(path: Path, options: LogOptions) -> OpenLog:
    """Find out where things stand in a log, text or binary."""
    sheet = read_binary(path, options)
    if sheet is None:
        text = read_text(path, options.encoding)
        return OpenLog(path.name, find_layout(text, options), text.size, text.sha256, text=text)
    fields = len(sheet.titles)
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
    with path.open("rb") as raw:
        sha256 = hashlib.file_digest(raw, "sha256").hexdigest()
    return OpenLog(path.name, layout, path.stat().st_size, sha256, sheet=sheet)


@dataclass(frozen=True)
class LogTable:
    """A log's columns in the file's units, by role (``time``, ``mass``, ``base``, further channels).

    ``columns``: which they are; ``time`` is missing in a log without stamps. ``values``: (n,) each, nan where the log
    has no value; whoever reads on takes them out. ``body``: which line each stands on.
    """

    log: OpenLog
    columns: dict[str, LogColumn]
    values: dict[str, FloatArray]
    body: Body
    warnings: tuple[str, ...] = ()

    @property
    def file(self) -> SourceFile:
        """The log as a recording names it, with what became of its lines."""
        counts = self.body.counts
        return SourceFile(self.log.name, self.log.sha256, self.log.size, LineCount(read=counts.total(), **counts))

    @property
    def quarantined(self) -> Iterator[QuarantinedLine]:
        """The first lines that are quarantined."""
        return (QuarantinedLine(self.log.name, *line) for line in self.body.quarantined)


def read_table(log: OpenLog, options: LogOptions, roles: Sequence[str], *, further: bool = False) -> LogTable:
    """Read the columns of these roles and time, if there is one; with ``further`` all channels. A log is read once."""
    columns, warnings = assign(log, options, roles, further=further)
    if log.text is not None:
        body = _of_text(log, log.text, columns, options.test)
    elif log.sheet is not None:
        body = _of_sheet(log.sheet, columns)
    data, bad = body.counts["data"], body.counts["quarantined"] - (body.cut > 0)
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
    empty = sum(int(np.isnan(column).sum()) for column in body.values)
    if empty > _MOST_EMPTY * data * len(body.values):
        raise LogError(f"damaged beyond use: {empty} values in {data} lines are missing: expected most of them")
    return LogTable(log, columns, dict(zip(columns, body.values, strict=True)), body, tuple(warnings))


def _of_text(log: OpenLog, text: Text, columns: dict[str, LogColumn], test: str | int | None) -> Body:
    """The columns of a text; ``test``: of those that a repeated header parts, what stands above it is preamble."""
    layout, encoding, size = log.layout, text.content_encoding, len(text.content)
    # decimals of the last number of a line, if nearly all first lines agree: then one with fewer was cut. Where
    # trailing zeros are left out, a tenth of the lines have fewer.
    found = Counter(decimals(cells[-1], layout.dialect.decimal) for cells in log.rows(2000))
    found.pop(None, None)
    usual, times = found.most_common(1)[0] if found else (0, 0)
    last_decimals = usual or 0 if times >= 0.97 * found.total() else 0

    reader = Reader(layout, columns, first=layout.body, last_decimals=last_decimals, encoding=encoding, size=size)
    for block in text.blocks(layout.body):
        reader.read(block)
    body = reader.finish()
    if test is not None:
        starts, often = [body.first, *body.lines_of(body.restarts).tolist()], len(body.restarts) + 1
        if not 1 <= int(test) <= often:
            raise LogError(f"--test {test}: expected 1 to {often}, as often as the log has its header")
        first, *following = starts[int(test) - 1 :]
        heads = (number for number, kind in body.others.items() if kind == "header" and number >= first)
        body = body.part(first, next(heads) if following else reader.next_line)
    if "time" in columns and (falls := np.flatnonzero(np.diff(body.values[0]) < 0.0)).size:
        body.texts = text.texts_of(body.lines_of(np.union1d(falls, falls + 1)[:KEEP]).tolist())
    text.content = b""  # as large as the log: not kept while its values are examined
    body.above = Counter(header=len(layout.header), preamble=body.first - 1 - layout.body)
    for i in set(range(min(layout.body, len(text.lines)))).difference(layout.header):
        line = text.lines[i]
        body.above["blank" if not line.strip() else "comment" if is_comment(line) else "preamble"] += 1
    return body


def _of_sheet(sheet: Sheet, columns: dict[str, LogColumn]) -> Body:
    """The columns of a binary log; its rows are its lines."""
    values = {role: _finite(sheet.values[column.index]) for role, column in columns.items()}
    rows = len(sheet.values[0])
    stamped = np.isfinite(values["time"]) if "time" in values else np.ones(rows, bool)
    lost = (np.flatnonzero(~stamped) + 1).tolist()
    return Body(
        first=1,
        values=[column[stamped] for column in values.values()],
        others=dict.fromkeys(lost, "quarantined"),
        quarantined=[(row, "", "no time stamp") for row in lost[:KEEP]],
    )


def _finite(values: FloatArray) -> FloatArray:
    """A copy, nan where the log has no number."""
    return np.where(np.isfinite(values), values, np.nan)


# Tables over frequency -----------------------------------------------------------------------------------------------

_OVER_FREQUENCY: dict[str, tuple[str, Mapping[str, float], str]] = {
    "r": (r"r|frequency[ _]ratio", dict.fromkeys(("", "-", "1"), 1.0), "r has no unit"),
    "frequency": (
        r"(drive[ _])?(frequency|freq)|f|omega|(erreger)?frequenz",
        {"hz": 1.0, "khz": 1e-3, "rad/s": 2.0 * np.pi},
        "[Hz] or [rad/s]",
    ),
    "amplitude": (
        r"((response|mass)[ _])?(amplitude|amp)([ _]ratio)?|transmissibility|x ?/ ?y",
        LENGTH,
        "[Y] (over the base's amplitude) or a length such as [mm]",
    ),
    "phase": (r"phase([ _](angle|lag))?|phi", QUANTITIES["angle"], "[deg] or [rad]"),
    "base_amplitude": (r"base[ _](amplitude|amp)(_m)?|basisamplitude", LENGTH, "a length such as [mm]"),
}
"""Of each column: its names, how many of its units make that of a `FrequencyTable`, and what is expected in words."""
_COLUMNS = ("drive", "drive_u", "amplitude", "amplitude_u", "phase", "phase_u", "base_amplitude")
_PART_OF_Y = re.compile(r"[\[({<]\s*(Y|-|1|x/y)\s*[\])}>]|^x ?/ ?y", re.IGNORECASE)


def read_frequency_table(path: Path, options: LogOptions | None = None) -> FrequencyTable | None:
    r"""Read a table of amplitude, phase or both over ``r`` or ``frequency [Hz]``; None for a file that is none.

    Columns: ``amplitude [Y]`` or in a length, ``phase [deg]`` or ``[rad]`` of the mass behind the base, and ``base
    amplitude [mm]``; a column's standard uncertainty has its name with ``_u``, and its unit where it names none. A time
    column makes it a log.

    Raises
    ------
    LogError
        A column is there twice, without a unit or in a wrong one; or no row holds numbers.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "sweep.csv"
    >>> _ = path.write_text("r;phase [deg];phase_u [deg]\n0,5;10,5;0,5\n0,8;25;0,5\n1,2;150;0,5\n")
    >>> table = read_frequency_table(path)
    >>> table.drive.tolist(), np.rad2deg(table.phase).round(9).tolist()
    ([0.5, 0.8, 1.2], [10.5, 25.0, 150.0])
    """
    try:
        log = open_log(path, options or LogOptions())
    except LogError:
        return None  # whoever reads it as a log says why
    with naming(path):
        return _over_frequency(log)


def _over_frequency(log: OpenLog) -> FrequencyTable | None:
    columns = log.layout.columns
    found = _by_name(columns)
    drives = [name for name in ("r", "frequency") if name in found]
    if not drives or not {"amplitude", "phase"} & set(found) or candidates(columns, "time"):
        return None
    if log.text is not None and not log.text.whole:
        raise LogError("a table over frequency of more than 256 kB: expected some hundred rows")
    numbers, used = log.numbers(), {c.index for c in found.values()}
    said = [f"column {c} is not used" for c in columns if c.index not in used]
    said += ["r is taken, frequency [Hz] is not used"] if len(drives) > 1 else []
    names = {key: key.replace("drive", drives[0]) for key in _COLUMNS}
    values = dict.fromkeys(_COLUMNS, np.full(len(numbers), np.nan))
    values |= {key: _in_si(numbers[:, found[n].index], found, n) for key, n in names.items() if n in found}
    phase = values["phase"]
    kept = np.isfinite(values["drive"]) & (np.isfinite(values["amplitude"]) | np.isfinite(phase))
    if not kept.any():
        raise LogError(f"a table over frequency: no row has numbers of {drives[0]} and a response")
    said += [f"{np.count_nonzero(~kept)} of {len(kept)} rows lack a number"] if not kept.all() else []
    if (phase[kept & np.isfinite(phase)] < 0.0).all() and np.isfinite(phase[kept]).any():
        values["phase"] = -phase
        said.append("phase: every one is below 0: taken as those of x over y, whose mass is behind by minus them")
    column = found.get("amplitude")
    return FrequencyTable(
        source=log.name,
        is_ratio=drives[0] == "r",
        in_metres=column is not None and column.unit in LENGTH,
        said=tuple(said),
        **{key: column[kept] for key, column in values.items()},
    )


def _by_name(columns: tuple[LogColumn, ...]) -> dict[str, LogColumn]:
    """The columns of a table over frequency by name, their uncertainties as ``NAME_u``."""
    found: dict[str, LogColumn] = {}
    for column in columns:
        plain = re.sub(r"[ _]u$", "", column.name)
        of_error = plain != column.name or column.title.endswith("_u")
        for name, (pattern, *_) in _OVER_FREQUENCY.items():
            if not re.fullmatch(pattern, plain.removesuffix("_u"), re.IGNORECASE):
                continue
            key = f"{name}_u" if of_error else name
            if key in found:
                raise LogError(f"columns {found[key]} and {column} are both {key}: expected one")
            found[key] = column
    return found


def _in_si(values: FloatArray, found: Mapping[str, LogColumn], name: str) -> FloatArray:
    """The numbers of a column in r, Hz, Y or m, and rad; an error without a unit has that of its number."""
    column, name = found[name], name.removesuffix("_u")
    column = column if column.unit or _PART_OF_Y.search(column.title) else found.get(name, column)
    if name == "amplitude" and _PART_OF_Y.search(column.title):
        return values.copy()
    _, known, expected = _OVER_FREQUENCY[name]
    if column.unit not in known:
        got = column.unit or "no unit"
        raise LogError(f"column {column}: expected {expected}; got {got}: name the unit in the head")
    return values / known[column.unit]
