"""Every column of every table: its name, type, unit, range, title and a sentence; the one home of these facts.

From here follow the files (CSV, JSON Lines, HDF5 with ``units`` and ``long_name``), what ``show`` and the
commands print, labels of figures, and what a campaign takes for possible. The facts stand in ``columns.toml`` beside
this file. Code reaches numbers by attributes of results, and a row's cells by the names below.
"""

import csv
import html
import io
import math
import re
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
GRAVE = re.compile(
    r"strained|not settled|would give it|contradict|wrong|damag|does not explain|misfit|stands still|gap"
    r"|times what|the fit moved|changes its sign|not at hand|used up|repeats|swapped|dead|jump off|quarantined"
    r"|folded down|asks? for|does not hold|the law is that of"
)
OF_LAWS = re.compile(r"(verdict|friction_ratio: known only|laws?)\b")  # what follows from data that are broken
MOST = 20  # rows in a notebook's table
ROUNDING_OF_ZERO = 1e-13  # what is smaller, its error too, is no number


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
    attribute: str  # of the results that hold it; the name, unless the column was renamed
    type: Type  # what its cells hold
    unit: str  # as readers write it: Hz, kY² (k Y^2), empty for a plain number and for text
    title: str  # short, for tables on a screen; no two columns of a table have the same
    sentence: str  # what it is, in plain English
    range: tuple[float, ...] = ()  # the least and the largest number that it can be, generously; of its errors at most
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
    """One kind of table; ``columns.toml`` lists them and says what each of these is."""

    kind: str
    sentence: str
    columns: tuple[Column, ...]
    lead: int
    shown: tuple[str, ...]
    series: tuple[Column, ...] = ()

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

    def row(self, result: object, **more: object) -> dict[str, object]:
        """The row of a result with an attribute for each column not in ``more``; NaN is not known, which is None."""
        values = ((c.name, more[c.name] if c.name in more else getattr(result, c.attribute)) for c in self.columns)
        return {name: None if isinstance(value, float) and math.isnan(value) else value for name, value in values}

    def column(self, name: str) -> Column | None:
        """The column of this name, of the rows or of the series behind them; None if it is the user's own."""
        return next((column for column in (*self.columns, *self.series) if column.name == name), None)


_FACTS: dict[str, Any] = tomllib.loads(Path(__file__).with_name("columns.toml").read_text(encoding="utf-8"))


_COLUMNS: dict[str, Column] = {}  # by what they are called in the tables' lists
for _key, _kind, _unit, _numbers, _title, _sentence in csv.reader(io.StringIO(_FACTS.pop("columns"))):
    _name, _, _attribute = _key.partition("=")
    _plain, _limits = _name.rpartition(":")[2], tuple(map(float, _numbers.split()))
    _COLUMNS[_name] = Column(_plain, _attribute or _plain, Type(_kind), _unit, _title, _sentence, _limits)
LINES: list[list[str]] = list(csv.reader(io.StringIO(_FACTS.pop("lines").strip())))
"""The columns of tables of one line a test: kind of table, title, key, keep, form, error, times."""


def banded(bands: Mapping[str, tuple[float | None, ...]]) -> dict[str, object]:
    """Return the columns of numbers with the ends of their bands: of X these are ``X``, ``X_low`` and ``X_high``."""
    return {f"{name}{end}": band[i] for name, band in bands.items() for i, end in enumerate(("", "_low", "_high"))}


def _column_named(name: str, table: str = "") -> Column:
    """The column of a name in a table; of ``X_se`` and ``X_u`` the error of ``X``, of ``X_low`` an end of its band."""
    for key in (f"{table}:{name}", name):
        if key in _COLUMNS:
            return _COLUMNS[key]
    stem, _, end = name.rpartition("_")
    of, sentence = _COLUMNS[stem], _OF_ANOTHER[end].format(stem)
    limits = of.range and (0.0, of.range[-1])
    return Column(name, f"{of.attribute}_{end}", Type.NUMBER, of.unit, f"{of.title} {end}", sentence, limits, stem)


def _table_of(kind: str, facts: dict[str, Any]) -> Table:
    first = _FACTS[facts["like"]]["columns"] if "like" in facts else ""
    columns, series = (
        tuple(_column_named(name, kind) for name in names.split())
        for names in (f"{first} {facts['columns']}", facts.get("series", ""))
    )
    return Table(kind, facts["sentence"], columns, facts["lead"], tuple(facts["shown"].split()), series)


_TABLES = {kind: _table_of(kind, facts) for kind, facts in _FACTS.items()}
TABLES = tuple(_TABLES.values())
MEASUREMENTS, COMPARISONS = _TABLES["measurements"], _TABLES["comparisons"]
LAWS, FREE_VIBRATIONS = _TABLES["laws"], _TABLES["free vibrations"]
TESTS, FRICTION, RANKING = _TABLES["tests"], _TABLES["friction"], _TABLES["ranking"]
DRIFTS, LEFT_OUT = _TABLES["drifts"], _TABLES["left out"]
MATERIAL_LAWS = _TABLES["material laws"]
STEADY_STATES, MOTIONS, RESPONSES = _TABLES["map"], _TABLES["motion"], _TABLES["response"]
PREDICTIONS, PLANS, TRADES = _TABLES["predictions"], _TABLES["plan"], _TABLES["trade"]
OUTCOME = ("source", "status", "reason")
"""All that a row has whose input failed."""
ENERGY, AMPLITUDE, RATIO = "energy_per_cycle", "response_amplitude", "frequency_ratio"
STOPS, BASE, REGIME = "stops_per_cycle", "base_amplitude_m", "regime"
"""Columns that code names: of rows, tables, budgets and sentences."""
ESTIMATED = {
    "drive": "drive_frequency_hz",
    "ratio": RATIO,
    "base_amplitude": BASE,
    "energy": ENERGY,
    "energy_joules": f"{ENERGY}_j",
    "amplitude": AMPLITUDE,
}
"""Attribute that holds a number with its errors -> its column."""
EXPECTED = (f"predicted_force_{ENERGY}_j", "predicted_friction_coefficient")  # by the law of a material alone
PREDICTED = (AMPLITUDE, f"{AMPLITUDE}_m", ENERGY, f"{ENERGY}_j", STOPS)
PREDICTED_RECORD = (AMPLITUDE, f"{AMPLITUDE}_m", "record_energy", "record_energy_j", "record_stops")
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


def attribute_of(name: str) -> str:
    """The attribute of results that holds what stands in the column of this name."""
    return _column_named(name).attribute


def value_of(result: object, name: str) -> Any:
    """Return what a result holds for the column of this name."""
    return getattr(result, attribute_of(name))


def with_error(value: object, error: object, times: float = 1.0) -> str:
    """A number with its uncertainty: as many digits as the uncertainty has a right to, two where it begins with 1 or 2.

    Examples
    --------
    >>> with_error(4.4712e-3, 2.1e-5, 1e3), with_error(0.7721, 0.0771), with_error(0.35, None), with_error(None, 1.0)
    ('4.471 ± 0.021', '0.77 ± 0.08', '0.35', '-')
    >>> with_error(-8e-18, 1e-17)
    '0'
    """
    if not isinstance(value, (int, float)) or not math.isfinite(value):
        return "-"
    number = times * value
    size = times * error if isinstance(error, (int, float)) and math.isfinite(error) else 0.0
    if size <= 0.0:
        return f"{number:.4g}"
    place = math.floor(math.log10(float(f"{size:.1e}")))
    digits = max(0, (1 if f"{size:.1e}"[0] in "12" else 0) - place)
    if max(abs(number), size) < ROUNDING_OF_ZERO:
        return "0"
    return f"{number:.{digits}f} ± {size:.{digits}f}"


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
        """What a screen shows of its rows, numbers with their uncertainty; and the figure, as SVG, if there is one."""
        every, alone = self.to_pandas(), len(self.rows()) == 1
        kind = table_of([str(name) for name in every])
        shown = [name for name in (kind.shown if kind else map(str, every)) if name in every and name[-2:] != "_u"]
        frame = every[shown].dropna(axis="columns", how="all")
        for name in {*shown} & {str(name)[:-2] for name in every if str(name)[-2:] == "_u"} & {*frame}:
            pairs = zip(every[name], every[f"{name}_u"], strict=True)
            frame[name] = [with_error(value, u) for value, u in pairs]
        frame = frame.rename(columns={column.name: column.head for column in kind.columns} if kind else {})
        return in_html(self, (frame.T if alone else frame).to_html(max_rows=MOST, header=not alone, index=alone))


def in_html(result: object, table: str = "") -> str:
    """A result's words, its table, and its figure as SVG, if there is one."""
    import frictionlab  # noqa: PLC0415 - figures are drawn by a part of the package above this one

    image = io.StringIO()
    try:
        frictionlab.plot(result).savefig(image, format="svg")
    except frictionlab.UsageError:  # a result that has no figure
        image = io.StringIO()
    return f"<p>{html.escape(repr(result))}</p>{table}{''.join(image.getvalue().partition('<svg')[1:])}"
