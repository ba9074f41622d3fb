"""How a log is written, found from the log: what its cells say, separator, decimal mark, where the numbers begin.

Each pair of separator and decimal mark is a hypothesis. Under it a line is a row of cells; the hypothesis is as good as
the share of the text that it turns into numbers over the longest run of lines of one shape. Two hypotheses that do
equally well and disagree about the numbers are an error that shows both, never a guess.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import lru_cache
from typing import NamedTuple

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.columns import LogColumn

COMMENTS = ("#", "%", "//", "!")
NAMES = {",": "comma", ";": "semicolon", "\t": "TAB", "|": "pipe", " ": "blanks"}
_QUOTED_COMMAS = re.compile(r'"-?\d+,\d+"\s*,')
_SEPARATORS = ("\t", ";", ",", "|", " ")
_LOOK_AT = 400
_WORD = re.compile(r"[^ \t\v\f\r\n]+")  # the blanks of both readers; str.split knows many more
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
_NO_VALUE = re.compile(
    r"|[-‒–—]+|[-+]?nan|#?n/?a|#(?:div/0|num|value|ref)!|null|none|[-+]?inf(?:inity)?|[-+]?∞|x{3,}|[-+]?f{4,}|-?1\.#\w+|overflow|over|error|#+",
    re.IGNORECASE,
)
_MOMENT = re.compile(
    r"(?:(?:(?P<y>\d{4})[-/.](?P<m>\d{1,2})[-/.](?P<d>\d{1,2})|(?P<a>\d{1,2})(?P<sign>[./])(?P<b>\d{1,2})[./](?P<c>\d{4}))"
    r"(?:[T _]\s*|,\s*))?"
    r"(?P<H>\d{1,4}):(?P<M>\d{2})(?::(?P<S>\d{2}(?:[.,]\d*)?))?"
    r"\s*(?:Z|(?P<east>[+-]\d{2}):?(?P<past>\d{2})|(?P<half>[AaPp])\.?[Mm]\.?)?",
    re.ASCII,
)


def plain(cell: str) -> str:
    """Strip blanks and the quotes around a cell."""
    stripped = cell.strip()
    if len(stripped) >= 2 and stripped[0] == stripped[-1] and stripped[0] in "\"'":
        return stripped[1:-1].strip()
    return stripped


def number(cell: str, decimal: str) -> float | None:
    """Read a plain decimal number as Python's ``float`` does; ``None`` if the cell is none.

    Overflow gives infinity; digits beyond ASCII, underscores and marks between thousands are refused.
    """
    text = plain(cell).replace("\u2212", "-")
    if decimal != ".":
        if "." in text:
            return None
        text = text.replace(decimal, ".")
    if not _NUMBER.fullmatch(text):
        return None
    return float(text.replace("d", "e").replace("D", "e"))


def is_no_value(cell: str) -> bool:
    """Whether a cell says that there is no value: empty, dashes, nan, infinity, Keyence's +FFFFFFF and XXXXXXX."""
    return _NO_VALUE.fullmatch(plain(cell)) is not None


def moment(cell: str) -> float | None:
    """Read a clock time, with or without its date, as seconds (since 1970 UTC, or since midnight); else ``None``.

    A date with slashes that begins with its day or month has its month first, as in the USA, unless that is none.
    """
    match = _MOMENT.fullmatch(plain(cell))
    if match is None:
        return None
    hour, minute, seconds = int(match["H"]), int(match["M"]), float((match["S"] or "0").replace(",", "."))
    if minute > 59 or not seconds < 61.0 or (match["half"] and not 1 <= hour <= 12):
        return None
    if match["half"]:
        hour = hour % 12 + 12 * (match["half"] in "pP")
    if match["east"]:
        hour, minute = hour - int(match["east"]), minute - int(match["east"][0] + match["past"])
    clock, year = hour * 3600 + minute * 60 + seconds, match["y"] or match["c"]
    if year is None:
        return clock
    month, day = (match["m"], match["d"]) if match["y"] else (match["a"], match["b"])
    if match["sign"] == "." or (match["sign"] and int(month) > 12):
        month, day = day, month
    try:
        return datetime(int(year), int(month), int(day), tzinfo=UTC).timestamp() + clock
    except ValueError:  # no such day
        return None


def decimals(cell: str, decimal: str) -> int | None:
    """How many digits follow the decimal mark of a plain number; ``None`` if it has an exponent or is none."""
    text = plain(cell)
    value = number(text, decimal)
    if value is None or math.isinf(value) or not set("eEdD").isdisjoint(text):
        return None
    return len(text.partition(decimal)[2])


@dataclass(frozen=True)
class LogLayout:
    """How a log is written and where things stand in it; lines are counted from 0.

    ``separator``: " " stands for any run of blanks and tabs; ``kinds``: a letter for each cell of a data line, ``n``
    number, ``m`` moment (a clock time), ``t`` text, ``e`` always empty; ``first``: the first data line, ``example``:
    its cells; ``columns``: one for each cell; ``header``: lines of names and units; ``body``: the first line below
    them; ``facts``: what the preamble states, ``interval_s``, ``start_s`` (since 1970 UTC); ``spare``: so many cells of
    text may follow a data line; ``is_header``: whether a stripped line in the body is a header repeated.
    """

    separator: str
    decimal: str
    kinds: str
    first: int = 0
    example: tuple[str, ...] = ()
    evidence: tuple[str, ...] = ()
    name: str = ""
    columns: tuple[LogColumn, ...] = ()
    header: tuple[int, ...] = ()
    body: int = 0
    facts: Mapping[str, float] = field(default_factory=dict)
    spare: int = 0
    is_header: Callable[[str], bool] = field(default=lambda _: False)

    @property
    def fields(self) -> int:
        """Cells of a data line."""
        return len(self.kinds)


class _Reading(NamedTuple):
    """A hypothesis: the share of the characters of its run of lines that are in cells of numbers; what they say."""

    dialect: LogLayout
    share: float
    run: int
    values: tuple[tuple[str, ...], ...]

    def agrees(self, other: "_Reading") -> bool:
        """Whether both say the same numbers."""
        both = min(len(self.values), len(other.values))
        return self.values[-both:] == other.values[-both:] or set(self.values) == set(other.values)

    def is_headed(self, lines: Sequence[str]) -> bool:
        """Whether the line of words above the numbers has as many fields."""
        above = [line for line in lines[: self.dialect.first] if line.strip()]
        cells = split(above[-1].lstrip("#%! "), self.dialect.separator) if above else []
        return len(cells) == self.dialect.fields and any(kind_of(c, self.dialect.decimal) == "t" for c in cells)


def split(line: str, separator: str) -> list[str]:
    """Split a line into its cells; quotes protect a separator inside them."""
    if separator == " ":
        return _WORD.findall(line)
    if '"' not in line:
        return line.split(separator)
    cells, quoted = [], ""
    for piece in line.split(separator):
        quoted = f"{quoted}{separator}{piece}" if quoted else piece
        if quoted.count('"') % 2 == 0:
            cells.append(quoted)
            quoted = ""
    return [*cells, quoted] if quoted else cells


def is_comment(line: str) -> bool:
    """Whether a line is a comment."""
    return line.lstrip(' "').startswith(COMMENTS)


@lru_cache(maxsize=4)
def find_dialect(lines: tuple[str, ...], options: LogOptions) -> LogLayout:
    """Find the dialect of a log from its first lines; refused if none holds numbers, or two fit equally well."""
    pairs = [
        (separator, decimal)
        for separator in ((options.separator,) if options.separator else _SEPARATORS)
        for decimal in ((options.decimal,) if options.decimal else (".", ","))
        if separator != decimal
    ]
    readings = [r for pair in pairs if (r := _read_as(lines, *pair)) is not None]
    if not readings:
        quoted = any(_QUOTED_COMMAS.search(line) for line in lines)
        hint = '; cells like "0,12" have a decimal comma in quotes, between commas: save it with semicolons' * quoted
        raise LogError(f"no lines of numbers found in its first {len(lines)}: expected a log of numbers{hint}")
    best = max(readings, key=lambda r: (r.share, r.run))
    rivals: list[_Reading] = []
    for reading in sorted(readings, key=lambda r: -r.share):
        fits = reading.share > best.share - 0.02 and 2 * reading.run >= best.run
        if fits and not any(reading.agrees(other) for other in rivals):
            rivals.append(reading)
    if len(rivals) > 1:  # that with most fields whose line of words above the numbers has as many
        headed = [r.dialect.fields for r in rivals if r.is_headed(lines)]
        widest = [r for r in rivals if r.is_headed(lines) and r.dialect.fields == max(headed)]
        rivals = widest if len(widest) == 1 else rivals
    if len(rivals) > 1:
        shown = "; or ".join(
            f"separator {NAMES[r.dialect.separator]} and decimal mark {r.dialect.decimal!r} "
            f"(line {r.dialect.first + 1}: {' | '.join(r.values[0])})"
            for r in rivals[:3]
        )
        raise LogError(f"can be read in more than one way: {shown}: say which by --separator and --decimal")
    return rivals[0].dialect


@lru_cache(maxsize=2048)  # a separator that a line lacks leaves it whole: one cell, looked at again and again
def kind_of(cell: str, decimal: str) -> str:
    """Classify a cell: ``n`` number, ``m`` moment, ``e`` no value, ``t`` text."""
    if number(cell, decimal) is not None:
        return "n"
    if is_no_value(cell):
        return "e"
    return "m" if moment(cell) is not None else "t"


def _read_as(lines: Sequence[str], separator: str, decimal: str) -> _Reading | None:
    """Find the longest run of lines of one shape under a hypothesis, and the first line that has this shape."""
    rows = [
        (i, split(line, separator)) for i, line in enumerate(lines[:_LOOK_AT]) if line.strip() and not is_comment(line)
    ]
    kinds = ["".join(kind_of(cell, decimal) for cell in cells) for _, cells in rows]
    shape, longest, here, run_length = "", 0, "", 0
    for kind in kinds:  # the shape of the longest run of lines of one shape that has numbers
        merged = _merge(here, kind) if run_length else None
        here, run_length = (kind, 1) if merged is None else (merged, run_length + 1)
        if "n" in here and run_length > longest:
            shape, longest = here, run_length
    if not shape:
        return None
    fitting = [k for k, kind in enumerate(kinds) if _merge(shape, kind) == shape]
    steady = [k for k in fitting if len(fitting) < 3 or sum(j in fitting for j in range(k + 1, k + 4)) >= 2]
    run = [rows[k] for k in fitting if k >= (steady or fitting)[0]]
    first, cells = run[0]
    sizes = [(len(plain(cell)), kind in "nm") for _, row in run for cell, kind in zip(row, shape, strict=True)]
    known, total = sum(size for size, counts in sizes if counts), sum(size for size, _ in sizes)
    values = tuple(
        tuple(f"{number(c, decimal)}" if k == "n" else plain(c) for c, k in zip(row, shape, strict=True) if plain(c))
        for _, row in run[:50]
    )
    evidence = (
        f"separator {NAMES[separator]}, decimal mark {decimal!r}: of the first lines {len(run)} have "
        f"{shape.count('n')} numbers in {len(shape)} fields, from line {first + 1}"
    )
    dialect = LogLayout(separator, decimal, shape, first, tuple(plain(c) for c in cells), (evidence,))
    return _Reading(dialect, known / total if total else 0.0, len(run), values)


def _merge(shape: str, kinds: str) -> str | None:
    """One shape for a run and its next line, or ``None`` if they differ; an empty cell fits everything."""
    if shape == kinds:
        return shape
    if len(shape) != len(kinds) or any(a != b and "e" not in (a, b) for a, b in zip(shape, kinds, strict=True)):
        return None
    return "".join(b if a == "e" else a for a, b in zip(shape, kinds, strict=True))
