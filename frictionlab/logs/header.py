"""What a layout says of a log, its header of names and units, and what the lines above state: interval, start."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from frictionlab.logs.cells import moment, number, plain
from frictionlab.logs.columns import LogColumn, roles_named
from frictionlab.logs.dialect import Dialect, is_comment, kind_of, split
from frictionlab.units import TIME, known_unit

_DAMAGED_ABOVE = 5


@dataclass(frozen=True)
class LogLayout:
    """Where things stand in a log.

    Parameters
    ----------
    name
        Of the layout.
    dialect
        Separator, decimal mark, shape of a data line.
    columns
        One for each field.
    header
        Indices from 0 of the lines that are header: names and units.
    body
        Index from 0 of the first line below the header.
    facts
        What the preamble tells: ``interval_s``, ``start_s`` (seconds since 1970 UTC), ``sensor``.
    prefer
        Columns of a role, by index, where the layout knows better than the names.
    time_of
        For each channel its own time column, by index, where a log has several.
    spare
        So many cells of text may follow the fields of a data line.
    is_header
        Says of a stripped line in the body whether it is a header repeated.
    evidence
        Sentences on why.
    """

    name: str
    dialect: Dialect
    columns: tuple[LogColumn, ...]
    header: tuple[int, ...]
    body: int
    facts: Mapping[str, float | str] = field(default_factory=dict)
    prefer: Mapping[str, int] = field(default_factory=dict)
    time_of: Mapping[int, int] = field(default_factory=dict)
    spare: int = 0
    is_header: Callable[[str], bool] = field(default=lambda _: False)
    evidence: tuple[str, ...] = ()


@dataclass(frozen=True)
class Header:
    """Names, units ("" where not said), the lines they stand on, and the first line below them; indices from 0."""

    titles: tuple[str, ...]
    units: tuple[str, ...]
    lines: tuple[int, ...]
    body: int


def find_header(lines: Sequence[str], dialect: Dialect, *, deep: bool = False) -> Header:
    """Look upward from the first data line for units and names.

    Parameters
    ----------
    lines
        The first lines of the log.
    dialect
        How its numbers are written.
    deep
        Whether names and units may stand anywhere above, among other rows as wide as the data; else the names are the
        nearest row of words.
    """
    rows = _rows_above(lines, dialect, deep=deep)
    units = next(((i, cells) for i, cells in rows if _is_units_row(cells)), None)
    names = [(i, cells) for i, cells in rows if units is None or i != units[0]]
    best = max(names, key=lambda row: (roles_named(row[1]), row[0]), default=None) if deep else next(iter(names), None)
    if best is not None and units is not None and not deep and units[0] < best[0] - 2:
        units = None
    chosen = sorted({row[0] for row in (best, units) if row is not None})
    return Header(
        titles=tuple(best[1]) if best else (),
        units=tuple(known_unit(cell) for cell in units[1]) if units else (),
        lines=tuple(chosen),
        body=max(i for i, _ in rows) + 1 if rows else dialect.first,
    )


def _rows_above(lines: Sequence[str], dialect: Dialect, *, deep: bool) -> list[tuple[int, list[str]]]:
    """Rows of words as wide as the data, nearest first; a few damaged data lines may stand below them."""

    def is_words(cells: Sequence[str]) -> bool:
        kinds = [kind_of(c, dialect.decimal) for c in cells]
        return kinds.count("t") >= max(1, kinds.count("n") + kinds.count("m"))

    rows: list[tuple[int, list[str]]] = []
    damaged = 0
    for i in range(dialect.first - 1, -1, -1):
        cells = _cells(lines[i], dialect)
        if not any(cells):
            continue
        units = _is_units_row(cells)
        if _wide(cells, dialect) and (units or is_words(cells)):
            if damaged and not units and not roles_named(cells):
                break
            rows.append((i, cells))
            if not (deep or units):
                break
        elif not deep:
            damaged += 1
            if damaged > _DAMAGED_ABOVE:
                break
    return rows


def _cells(line: str, dialect: Dialect) -> list[str]:
    text = line.lstrip().lstrip("#%!").lstrip("/").strip() if is_comment(line) else line
    cells = [plain(c) for c in split(text, dialect.separator)]
    if is_comment(line) and len(cells) != dialect.fields and len(text.split()) == dialect.fields:
        cells = text.split()
    while len(cells) > dialect.fields and not cells[-1]:
        cells.pop()
    return cells


def _is_units_row(cells: Sequence[str]) -> bool:
    named = [c for c in cells if c]
    return bool(named) and all(known_unit(c) for c in named) and roles_named(cells) < 2


def _wide(cells: Sequence[str], dialect: Dialect) -> bool:
    """As many cells as a data line; fewer where its last are always empty, one more where comments may follow."""
    spare = len(dialect.kinds) - len(dialect.kinds.rstrip("e"))
    return dialect.fields - spare <= len(cells) <= dialect.fields


_INTERVAL = re.compile(r"(samp\w*[ _-]*)?(time[ _-]*)?(interval|period)|delta_x|dt|abtastintervall", re.IGNORECASE)
_RATE = re.compile(r"samp\w*[ _-]*(rate|frequency)|abtastrate|messrate", re.IGNORECASE)
_UNIT = re.compile(r"^(.*?)\s*[\[(]?\s*(s|sec|ms|us|µs|ns|hz|khz|1/s)?\s*[\])]?\s*[:=]?$", re.IGNORECASE)
_IN_NAME = re.compile(r"(\d{4})-(\d{2})-(\d{2})[_T ](\d{2})-(\d{2})-(\d{2}(?:\.\d+)?)")
_SHORTEST_S, _LONGEST_S = 1e-9, 1e5
_HERTZ = {"hz": 1.0, "khz": 1e3, "1/s": 1.0, "": 1.0}


def stated_facts(lines: Sequence[str], decimal: str) -> dict[str, float | str]:
    """Read ``interval_s`` and ``start_s`` from lines of the form "key <separator> value", where they are stated.

    Examples
    --------
    >>> stated_facts(["Sampling time interval(ms),0.5", "made by hand"], ".")
    {'interval_s': 0.0005}
    """
    facts: dict[str, float | str] = {}
    for line in lines:
        cells = [plain(cell) for cell in re.split(r"[;\t:=]|,(?!\d)|(?<=\D),", line.lstrip("#%! "), maxsplit=1)]
        if len(cells) < 2 or len(line) > 500:
            continue
        interval = _interval(cells[0], re.split(r"[;\t]|, ?(?=\D)", cells[1])[0], decimal)
        if interval is not None:
            facts.setdefault("interval_s", interval)
    return facts


def _interval(key: str, value: str, decimal: str) -> float | None:
    match = _UNIT.match(key)
    name, unit = (match[1].strip(), (match[2] or "").lower()) if match else (key, "")
    amount, _, behind = value.strip().partition(" ")
    found = number(amount, decimal) if decimal == "." else number(amount, decimal) or number(amount, ".")
    if found is None or not 0.0 < found < float("inf"):
        return None
    unit = unit or behind.strip("[]() ").lower()
    interval = 0.0
    if _RATE.fullmatch(name) and unit in _HERTZ:
        interval = 1.0 / (found * _HERTZ[unit])
    elif _INTERVAL.fullmatch(name) and (known_unit(unit) in TIME or not unit):
        interval = found / TIME[known_unit(unit) or "s"]
    return interval if believable(interval) else None


def believable(interval_s: float) -> bool:
    """Whether samples may be so far apart [s]; a damaged preamble states anything."""
    return _SHORTEST_S < interval_s < _LONGEST_S


def start_in_name(path: Path) -> float | None:
    """When the record began, as the file's name says it [s since 1970, as if UTC].

    Examples
    --------
    >>> start_in_name(Path("protocol_optoNCDT-ILD1420_1970-01-02_00-00-01.500.csv"))
    86401.5
    """
    match = _IN_NAME.search(path.name)
    if match is None:
        return None
    return moment(f"{match[1]}-{match[2]}-{match[3]} {match[4]}:{match[5]}:{match[6]}")


def as_time(start_s: float) -> str:
    """Write a moment for people."""
    return datetime.fromtimestamp(start_s, UTC).isoformat(sep=" ", timespec="milliseconds").removesuffix("+00:00")
