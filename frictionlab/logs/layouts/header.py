"""The header above the numbers: a row of names, perhaps a row of units, whatever stands above it is preamble."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from frictionlab.logs.cells import plain
from frictionlab.logs.dialect import Dialect, is_comment, kind_of, split
from frictionlab.logs.units import known_unit

_DAMAGED_ABOVE = 5


@dataclass(frozen=True)
class Header:
    """Names, units ("" where not said), the lines they stand on, and the first line below them; indices from 0."""

    titles: tuple[str, ...]
    units: tuple[str, ...]
    lines: tuple[int, ...]
    body: int


def find_header(lines: Sequence[str], dialect: Dialect) -> Header:
    """Look upward from the first data line for units and names."""
    units: tuple[str, ...] = ()
    rows: list[int] = []
    damaged = 0
    for i in range(dialect.first - 1, -1, -1):
        cells = _cells(lines[i], dialect)
        if not any(cells):
            continue
        if _is_units_row(cells, dialect) and not units:
            units = tuple(known_unit(c) for c in cells)
            rows.append(i)
        elif _is_names_row(cells, dialect):
            rows.append(i)
            return Header(tuple(cells), units, tuple(sorted(rows)), rows[0] + 1)
        elif rows or damaged >= _DAMAGED_ABOVE or not any(kind_of(c, dialect.decimal) == "n" for c in cells):
            break
        else:
            damaged += 1
    return Header((), units, tuple(sorted(rows)), max(rows) + 1 if rows else dialect.first)


def _cells(line: str, dialect: Dialect) -> list[str]:
    text = line.lstrip().lstrip("#%!").lstrip("/") if is_comment(line) else line
    cells = [plain(c) for c in split(text, dialect.separator)]
    if is_comment(line) and len(cells) != dialect.fields and dialect.separator != " ":
        cells = [plain(c) for c in text.split()]
    while len(cells) > dialect.fields and not cells[-1]:
        cells.pop()
    return cells


def _is_units_row(cells: Sequence[str], dialect: Dialect) -> bool:
    named = [c for c in cells if c]
    return bool(named) and len(cells) <= dialect.fields and all(known_unit(c) for c in named) and _wide(cells, dialect)


def _is_names_row(cells: Sequence[str], dialect: Dialect) -> bool:
    kinds = [kind_of(c, dialect.decimal) for c in cells]
    return _wide(cells, dialect) and kinds.count("t") >= max(1, kinds.count("n"))


def _wide(cells: Sequence[str], dialect: Dialect) -> bool:
    """As many cells as a data line; one less where its last is always empty."""
    spare = len(dialect.kinds) - len(dialect.kinds.rstrip("e"))
    return dialect.fields - spare <= len(cells) <= dialect.fields


def repeats(lines: Sequence[str], rows: Sequence[int]) -> Callable[[str], bool]:
    """Make a function that says whether a stripped line is one of these header lines again."""
    texts = {lines[i].strip() for i in rows}
    return lambda line: line in texts
