"""What a column and a table are; the columns of the one list, ``columns.csv``: name, type, unit, title and a sentence.

A table names its columns (in `frictionlab.schema`); the list says what they are. ``X_se`` and ``X_u`` need no line of
their own: they are the errors of ``X``; nor do ``X_low`` and ``X_high``, the ends of its band. What a
name means in one table alone stands in the list as ``TABLE:NAME``.
"""

import csv
import math
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

_CF_UNITS = {"": "1", "kY²": "1", "Y": "1", "kY²/h": "h-1", "1/h": "h-1"}
"""Units as CF conventions (UDUNITS) write them, where a reader's table says what a number is counted in."""


class Type(Enum):
    """What stands in the cells of a column; beside it every cell may be empty, for what is not known."""

    NUMBER = "number"
    WHOLE = "whole number"
    YES_NO = "yes/no"
    TEXT = "text"
    SENTENCES = "list of sentences"
    OBJECT = "object"

    @property
    def is_number(self) -> bool:
        """Whether the cells can be reckoned with."""
        return self in (Type.NUMBER, Type.WHOLE)


@dataclass(frozen=True)
class Column:
    """One column, the same in every file and table it stands in.

    Attributes
    ----------
    name
        Key in JSON, head in CSV, name of the dataset in HDF5.
    type
        What its cells hold.
    unit
        As readers write it: ``Hz``, ``kY²`` (k Y^2), empty for a plain number and for text.
    title
        Short, for tables on a screen; no two columns of a table have the same.
    sentence
        What it is, in plain English.
    error_of
        Name of the column whose error this is; empty if it is none.

    Examples
    --------
    >>> force = Column("normal_force_n", Type.NUMBER, "N", "normal force", "Force that presses the contact together.")
    >>> force.head, force.units
    ('normal force [N]', 'N')
    """

    name: str
    type: Type
    unit: str
    title: str
    sentence: str
    error_of: str = ""

    @property
    def head(self) -> str:
        """The title with its unit; of an error without, for the number that it belongs to has the same."""
        return f"{self.title} [{self.unit}]" if self.unit and not self.error_of else self.title

    @property
    def units(self) -> str:
        """The unit as a file says it (CF conventions); ``1`` for a plain number, empty for what is no number."""
        has_unit = self.type.is_number or self.type is Type.YES_NO
        return _CF_UNITS.get(self.unit, self.unit) if has_unit else ""


@dataclass(frozen=True)
class Table:
    """One kind of table.

    Attributes
    ----------
    kind
        Its name, in the plural.
    sentence
        What one row is.
    columns
        All its columns, in order.
    lead
        So many of them, from the first on, are the mark by which a file is known to be of this kind: all of them, in
        this order, before any other column.
    shown
        Names of the columns for a screen, the most telling first: those that find no room are left out from the end.
    shown_where_known
        Those of the shown columns that are left out where no row knows them.
    series
        Columns of the arrays that may stand behind a row (one value per cycle, a mean cycle), in HDF5 only.
    takes_facts
        Whether columns of the user's own (facts of a test, from a sheet) may follow.
    """

    kind: str
    sentence: str
    columns: tuple[Column, ...]
    lead: int
    shown: tuple[str, ...]
    shown_where_known: tuple[str, ...] = ()
    series: tuple[Column, ...] = ()
    takes_facts: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all its columns, in order."""
        return tuple(column.name for column in self.columns)

    @property
    def mark(self) -> tuple[str, ...]:
        """The names that stand first in every file of this kind."""
        return self.names[: self.lead]

    @property
    def format(self) -> str:
        """What an HDF5 file of this kind calls itself."""
        return f"frictionlab {self.kind}"

    def row(self, result: object) -> dict[str, object]:
        """The row of a result that has an attribute for each column; NaN is not known, which is None."""
        values = ((name, getattr(result, name)) for name in self.names)
        return {name: None if isinstance(value, float) and math.isnan(value) else value for name, value in values}

    def column(self, name: str) -> Column | None:
        """The column of this name, of the rows or of the series behind them; None if it is the user's own."""
        return next((column for column in (*self.columns, *self.series) if column.name == name), None)


def _listed() -> dict[str, Column]:
    """The columns of the list by name; ``TABLE:NAME`` is what a name means in that table alone."""
    with Path(__file__).with_name("columns.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))[1:]
    return {key: Column(key.rpartition(":")[2], Type(kind), unit, title, said) for key, kind, unit, title, said in rows}


COLUMNS = _listed()
_OF_ANOTHER = {
    "se": "Standard error of {}: noise, and the scatter from cycle to cycle or test to test.",
    "u": "Combined standard uncertainty of {}: its standard error, and what sensors, clock and rig add.",
    "low": "Lower end of the 95 % band of {}: errors of the law, and the scatter from test to test.",
    "high": "Upper end of the 95 % band of {}: errors of the law, and the scatter from test to test.",
}


def column_named(name: str, table: str = "") -> Column:
    """The column of a name in a table; of ``X_se`` and ``X_u`` the error of ``X``, of ``X_low`` an end of its band.

    Examples
    --------
    >>> column_named("friction_force_n_u").head
    'friction u'
    """
    for key in (f"{table}:{name}", name):
        if key in COLUMNS:
            return COLUMNS[key]
    stem, _, ending = name.rpartition("_")
    of, sentence = COLUMNS[stem], _OF_ANOTHER[ending].format(stem)
    return Column(name, Type.NUMBER, of.unit, f"{of.title} {ending}", sentence, stem)
