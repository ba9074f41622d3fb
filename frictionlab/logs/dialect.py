"""How a log is written, found from the log: separator, decimal mark, number of fields, where the numbers begin.

Each pair of separator and decimal mark is a hypothesis. Under it a line is a row of cells; the hypothesis is as good as
the share of the text that it turns into numbers over the longest run of lines of one shape. Two hypotheses that do
equally well and disagree about the numbers are an error that shows both, never a guess.
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.cells import is_no_value, moment, number, plain

COMMENTS = ("#", "%", "//", "!")
NAMES = {",": "comma", ";": "semicolon", "\t": "TAB", "|": "pipe", " ": "blanks"}
_SEPARATORS = ("\t", ";", ",", "|", " ")
_LOOK_AT = 400
_WORD = re.compile(r"[^ \t\v\f\r\n]+")  # the blanks of both readers; str.split knows many more


@dataclass(frozen=True)
class Dialect:
    """How the numbers of a log are written.

    Parameters
    ----------
    separator, decimal
        One character each; " " stands for any run of blanks and tabs.
    fields
        Cells of a data line.
    kinds
        One letter for each field: ``n`` number, ``m`` moment (a clock time), ``t`` text, ``e`` always empty.
    first
        Index from 0 of the first data line.
    example
        The cells of that line.
    evidence
        Sentences on why.
    """

    separator: str
    decimal: str
    fields: int
    kinds: str
    first: int
    example: tuple[str, ...]
    evidence: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Reading:
    """One hypothesis and how well it does."""

    dialect: Dialect
    share: float
    """Of the run's characters, those in cells that are numbers or moments."""
    run: int
    """Lines of its shape."""
    values: tuple[tuple[str, ...], ...]
    """What the first lines of the run say, for telling two readings apart."""


def split(line: str, separator: str) -> list[str]:
    """Split a line into its cells; quotes protect a separator inside them."""
    if separator == " ":
        return _WORD.findall(line)
    if '"' not in line:
        return line.split(separator)
    cells, held = [], ""
    for piece in line.split(separator):
        held = f"{held}{separator}{piece}" if held else piece
        if held.count('"') % 2 == 0:
            cells.append(held)
            held = ""
    return [*cells, held] if held else cells


def is_comment(line: str) -> bool:
    """Whether a line is a comment."""
    return line.lstrip(' "').startswith(COMMENTS)


@lru_cache(maxsize=4)
def find_dialect(lines: tuple[str, ...], options: LogOptions, name: str) -> Dialect:
    """Find the dialect of a log from its first lines.

    Raises
    ------
    LogError
        If no line holds numbers, or two readings fit equally well.
    """
    readings = [r for pair in _hypotheses(options) if (r := _read_as(lines, *pair)) is not None]
    if not readings:
        raise LogError(f"{name}: no lines of numbers found in its first {len(lines)}: expected a log of numbers")
    best = max(readings, key=lambda r: (r.share, r.run))
    rivals = [r for r in readings if r.share > best.share - 0.02 and 2 * r.run >= best.run]
    rivals = _distinct(rivals)
    if len(rivals) > 1:
        rivals = _with_matching_header(rivals, lines) or rivals
    if len(rivals) > 1:
        raise LogError(_both(rivals, name))
    return rivals[0].dialect


def _hypotheses(options: LogOptions) -> Iterable[tuple[str, str]]:
    for separator in (options.separator,) if options.separator else _SEPARATORS:
        for decimal in (options.decimal,) if options.decimal else (".", ","):
            if separator != decimal:
                yield separator, decimal


@lru_cache(maxsize=2048)  # a separator that a line lacks leaves it whole: one cell, asked about again and again
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
    shape = _longest_run(kinds)
    if "n" not in shape:
        return None
    fitting = [k for k, kind in enumerate(kinds) if _merge(shape, kind) == shape]
    steady = [k for k in fitting if len(fitting) < 3 or sum(j in fitting for j in range(k + 1, k + 4)) >= 2]
    start = (steady or fitting)[0]
    return _reading([rows[k] for k in fitting if k >= start], shape, separator, decimal)


def _longest_run(kinds: Sequence[str]) -> str:
    """Give the shape of the longest run of lines of one shape that has numbers."""
    best, longest, shape, run = "", 0, "", 0
    for kind in kinds:
        merged = _merge(shape, kind) if run else None
        shape, run = (kind, 1) if merged is None else (merged, run + 1)
        if "n" in shape and run > longest:
            best, longest = shape, run
    return best


def _merge(shape: str, kinds: str) -> str | None:
    """One shape for a run and its next line, or ``None`` if they differ; an empty cell fits everything."""
    if shape == kinds:
        return shape
    if len(shape) != len(kinds):
        return None
    pairs = list(zip(shape, kinds, strict=True))
    if any(a != b and "e" not in (a, b) for a, b in pairs):
        return None
    return "".join(b if a == "e" else a for a, b in pairs)


def _reading(rows: list[tuple[int, list[str]]], shape: str, separator: str, decimal: str) -> _Reading:
    first, cells = rows[0]
    known = total = 0
    for _, row in rows:
        sizes = [len(plain(cell)) for cell in row]
        total += sum(sizes)
        known += sum(size for size, kind in zip(sizes, shape, strict=True) if kind in "nm")
    values = tuple(
        tuple(f"{number(c, decimal)}" if k == "n" else plain(c) for c, k in zip(row, shape, strict=True) if plain(c))
        for _, row in rows[:50]
    )
    share = known / total if total else 0.0
    evidence = (
        f"separator {NAMES[separator]}, decimal mark {decimal!r}: of the first lines {len(rows)} have "
        f"{shape.count('n')} numbers in {len(shape)} fields, from line {first + 1}"
    )
    return _Reading(
        Dialect(separator, decimal, len(shape), shape, first, tuple(plain(c) for c in cells), (evidence,)),
        share,
        len(rows),
        values,
    )


def _distinct(readings: list[_Reading]) -> list[_Reading]:
    """Of readings that say the same, keep the first."""

    def same(a: _Reading, b: _Reading) -> bool:
        shared = min(len(a.values), len(b.values))
        return a.values[-shared:] == b.values[-shared:] or set(a.values) == set(b.values)

    kept: list[_Reading] = []
    for reading in sorted(readings, key=lambda r: -r.share):
        if not any(same(reading, other) for other in kept):
            kept.append(reading)
    return kept


def _with_matching_header(rivals: list[_Reading], lines: Sequence[str]) -> list[_Reading]:
    """Keep the reading that has as many fields as the line of words above the numbers; of several, the widest."""
    kept = []
    for reading in rivals:
        dialect = reading.dialect
        above = [line for line in lines[: dialect.first] if line.strip()]
        if above and _names(above[-1], dialect) == dialect.fields:
            kept.append(reading)
    widest = max((r.dialect.fields for r in kept), default=0)
    best = [r for r in kept if r.dialect.fields == widest]
    return best if len(best) == 1 else []


def _names(line: str, dialect: Dialect) -> int:
    cells = split(line.lstrip("#%! "), dialect.separator)
    return len(cells) if Counter(kind_of(c, dialect.decimal) for c in cells)["t"] else 0


def _both(rivals: list[_Reading], name: str) -> str:
    shown = "; or ".join(
        f"separator {NAMES[r.dialect.separator]} and decimal mark {r.dialect.decimal!r} "
        f"(line {r.dialect.first + 1}: {' | '.join(r.values[0])})"
        for r in rivals[:3]
    )
    return f"{name}: can be read in more than one way: {shown}: say which by --separator and --decimal"
