"""Every column of every table: its name, type, unit, title and a sentence; the one home of these facts.

From here follow the files (CSV, JSON Lines, Excel, HDF5 with ``units`` and ``long_name``), and what ``show`` and
the commands print. The facts are two lists beside this file:

- ``columns.csv``: a column a line. ``X_se`` and ``X_u`` need none: they are the errors of ``X``; nor do ``X_low`` and
  ``X_high``, the ends of its band. What a name means in one table alone stands as ``TABLE:NAME``.
- ``tables.toml``: the kinds of tables: which columns stand in each, and which of them a screen shows.
"""

import csv
import html
import io
import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

_CF_UNITS = {"": "1", "kY²": "1", "Y": "1", "kY²/h": "h-1", "1/h": "h-1"}
"""Units as CF conventions (UDUNITS) write them, where a reader's table says what a number is counted in."""
_OF_ANOTHER = {
    "se": "Standard error of {}: noise, and the scatter from cycle to cycle or test to test.",
    "u": "Combined standard uncertainty of {}: its standard error, and what sensors, clock and rig add.",
    "low": "Lower end of the 95 % band of {}: errors of the law, and the scatter from test to test.",
    "high": "Upper end of the 95 % band of {}: errors of the law, and the scatter from test to test.",
}
MOST = 20  # rows in a notebook's table


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
    """One column, the same in every file and table it stands in; ``error_of``: the column whose error this is."""

    name: str  # key in JSON, head in CSV, name of the dataset in HDF5
    type: Type  # what its cells hold
    unit: str  # as readers write it: Hz, kY² (k Y^2), empty for a plain number and for text
    title: str  # short, for tables on a screen; no two columns of a table have the same
    sentence: str  # what it is, in plain English
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
    """One kind of table; ``tables.toml`` lists them and says what each of these is."""

    kind: str
    sentence: str
    columns: tuple[Column, ...]
    lead: int
    shown: tuple[str, ...]
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


def _read_columns() -> dict[str, Column]:
    with Path(__file__).with_name("columns.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))[1:]
    return {key: Column(key.rpartition(":")[2], Type(kind), unit, title, said) for key, kind, unit, title, said in rows}


_COLUMNS = _read_columns()


def _column_named(name: str, table: str = "") -> Column:
    """The column of a name in a table; of ``X_se`` and ``X_u`` the error of ``X``, of ``X_low`` an end of its band."""
    for key in (f"{table}:{name}", name):
        if key in _COLUMNS:
            return _COLUMNS[key]
    stem, _, ending = name.rpartition("_")
    of, sentence = _COLUMNS[stem], _OF_ANOTHER[ending].format(stem)
    return Column(name, Type.NUMBER, of.unit, f"{of.title} {ending}", sentence, stem)


def _read_tables() -> dict[str, Table]:
    listed: Mapping[str, dict[str, Any]] = tomllib.loads(
        Path(__file__).with_name("tables.toml").read_text(encoding="utf-8")
    )
    found = {}
    for kind, facts in listed.items():
        first = listed[facts["like"]]["columns"] if "like" in facts else ""
        columns, series = (
            tuple(_column_named(name, kind) for name in names.split())
            for names in (f"{first} {facts['columns']}", facts.get("series", ""))
        )
        shown = tuple(facts.get("shown", "").split())
        takes_facts = facts.get("takes_facts", False)
        found[kind] = Table(kind, facts["sentence"], columns, facts["lead"], shown, series, takes_facts)
    return found


_TABLES = _read_tables()
TABLES = tuple(_TABLES.values())
MEASUREMENTS, COMPARISONS = _TABLES["measurements"], _TABLES["comparisons"]
LAWS = _TABLES["laws"]
FREE_VIBRATIONS = _TABLES["free vibrations"]
TESTS, FRICTION, RANKING = _TABLES["tests"], _TABLES["friction"], _TABLES["ranking"]
DRIFTS, LEFT_OUT = _TABLES["drifts"], _TABLES["left out"]
MATERIAL_LAWS, LAW_PARAMETERS = _TABLES["material laws"], _TABLES["law parameters"]
STEADY_STATES, MOTIONS, RESPONSES = _TABLES["map"], _TABLES["motion"], _TABLES["response"]
PREDICTIONS, PLANS, TRADES = _TABLES["predictions"], _TABLES["plan"], _TABLES["trade"]
OUTCOME = ("source", "status", "reason")
"""All that a row has whose input failed."""
_AMPLITUDE = ("response_amplitude", "response_amplitude_m")
PREDICTED = (*_AMPLITUDE, "energy_per_cycle", "energy_per_cycle_j", "stops_per_cycle")
PREDICTED_RECORD = (*_AMPLITUDE, "record_energy", "record_energy_j", "record_stops")
"""What a law predicts of a steady cycle, and of a whole record (largest displacement), each with its band."""


def is_marked(names: Sequence[str], table: Table) -> bool:
    """Whether columns of these names bear the mark of a kind: all of its first columns, first and in order."""
    return tuple(names[: table.lead]) == table.mark


def table_of(names: Sequence[str]) -> Table | None:
    """The kind of table that columns of these names belong to; None if to none.

    Columns may be added, taken away behind the mark, or moved by hand: the kind is that which has most of them.
    """
    known = set(names)
    fitting = [table for table in TABLES if known.issuperset(table.mark)]
    return max(fitting, key=lambda t: (len(known & set(t.names)), -len(t.names)), default=None)


def column_of(name: str, table: Table | None = None) -> Column | None:
    """The column of this name in a table or, without one, in the first that has it; None for a user's own column."""
    found = (t.column(name) for t in (TABLES if table is None else (table,)))
    return next((column for column in found if column is not None), None)


class Result:
    """A result that is one row or several: it turns itself into a frame of pandas, and shows itself in a notebook."""

    def rows(self) -> list[dict[str, object]]:
        """Its rows, with the keys of JSON; of most results one."""
        row: Any = getattr(self, "row", dict)
        return [row()]

    def to_pandas(self) -> "pd.DataFrame":
        """Return its rows as a frame."""
        import pandas as pd  # noqa: PLC0415 - a result that nobody turns into a frame does not wait for pandas

        return pd.DataFrame(self.rows())

    def _repr_html_(self) -> str:
        """A small table of what is known, and the figure, as SVG, where there is one."""
        import frictionlab  # noqa: PLC0415 - figures are drawn by a part of the package above this one

        frame = self.to_pandas().dropna(axis="columns", how="all")
        table = frame.T if len(frame) == 1 else frame
        shown: str = table.to_html(max_rows=MOST, max_cols=MOST // 2, header=len(frame) != 1, index=len(frame) == 1)
        image = io.StringIO()
        try:
            frictionlab.plot(self).savefig(image, format="svg")
        except frictionlab.UsageError:  # a result that has no figure
            image = io.StringIO()
        return f"<p>{html.escape(repr(self))}</p>{shown}{''.join(image.getvalue().partition('<svg')[1:])}"
