"""Numbers, errors and warnings as words for a page; what stood in a log is escaped by the templates."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from frictionlab.schema import Table
from frictionlab.tables import Row

UNKNOWN = "\N{EN DASH}"


@dataclass(frozen=True)
class Cell:
    """One cell: ``text`` as it is read, ``value`` by which it is sorted (None: text), ``title`` and ``link``."""

    text: str
    value: float | None = None
    title: str = ""
    link: str = ""
    is_number: bool = False


@dataclass(frozen=True)
class Head:
    """The head of a column; ``title``: its sentence."""

    text: str
    title: str = ""
    is_number: bool = False


@dataclass(frozen=True)
class Grid:
    """A table of a page: heads and rows of cells; ``failed``: the numbers of the rows that are failures."""

    heads: Sequence[Head]
    rows: Sequence[Sequence[Cell]]
    failed: frozenset[int] = frozenset()


def with_error(value: float | None, error: float | None = None, digits: int = 4) -> str:
    """A number whose digits follow its error, two of them; without an error, so many digits.

    Examples
    --------
    >>> with_error(0.123456, 0.0021), with_error(0.123456), with_error(None), with_error(1234.5, 120.0)
    ('0.1235 ± 0.0021', '0.1235', '–', '1230 ± 120')
    """
    if value is None or not math.isfinite(value):
        return UNKNOWN
    if error is None or not 0.0 < error < math.inf:
        return f"{value:.{digits}g}"
    places = 1 - math.floor(math.log10(error))
    if places < 0:
        value, error, places = round(value, places), round(error, places), 0
    return f"{value:.{places}f} ± {error:.{places}f}"


def number(value: object, error: object = None, digits: int = 4) -> Cell:
    """A cell with a number and, where it is known, its error."""
    known = float(value) if isinstance(value, (int, float)) and math.isfinite(value) else None
    own = float(error) if isinstance(error, (int, float)) else None
    return Cell(with_error(known, own, digits), known, is_number=True)


def words(value: object, title: str = "") -> Cell:
    """A cell with text."""
    return Cell(UNKNOWN if value in (None, "") else str(value), title=title)


def grid(table: Table, rows: Iterable[Row], names: Sequence[str]) -> Grid:
    """Some columns of a table; a number stands with its combined uncertainty, else its standard error, in one cell.

    Columns that no row knows are left out.
    """
    listed = list(rows)
    shown = [name for name in names if any(row.get(name) not in (None, "") for row in listed)]
    columns = [column for name in shown if (column := table.column(name)) is not None]
    heads = [Head(column.head, column.sentence, column.type.is_number) for column in columns]
    cells = [[_cell(row, column.name, is_number=column.type.is_number) for column in columns] for row in listed]
    return Grid(heads, cells)


def _cell(row: Row, name: str, *, is_number: bool) -> Cell:
    value = row.get(name)
    if is_number:
        return number(value, row.get(f"{name}_u") or row.get(f"{name}_se"))
    if isinstance(value, bool):
        return words("yes" if value else "no")
    return words(value, title=str(value) if value and len(str(value)) > 24 else "")


def grouped(warnings: Mapping[str, Sequence[str]]) -> list[str]:
    """Sentences for a page from groups of sources (sentence -> the tests it was given for), most tests first."""
    ordered = sorted(warnings.items(), key=lambda pair: -len(pair[1]))
    return [f"{sentence} ({_named(sources)})" for sentence, sources in ordered]


def _named(sources: Sequence[str]) -> str:
    first = ", ".join(sources[:3])
    return first if len(sources) <= 3 else f"{first} and {len(sources) - 3} more"
