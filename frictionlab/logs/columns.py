"""Which column is what: names, units and roles of a log's columns."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from frictionlab.errors import LogError
from frictionlab.units import LENGTH, TIME, known_unit, split_unit

_TIME = re.compile(
    r"t|x_value|elapsed|epoch|date ?time|clock|dt|"
    r"((acquisition|acq|relative|elapsed|epoch|abs|absolute|system|measurement|sample|sampling|log)[ _-]*)?"
    r"(times?|zeit(en)?|temps|tempo|tiempo|time ?stamps?)([ _-]*\d+)?|(time|zeit|messzeit|timestamp)\b.*|"
    r"sekunden|seconds|millis(econds)?",
    re.IGNORECASE,
)
_MASS = re.compile(
    r"x|x_?m|m|(.*[\W_])?(mass|masse|massa|oscillator|response|slider)(\d*[\W_].*)?\d*|top", re.IGNORECASE
)
_BASE = re.compile(
    r"y|y_?b|b|(.*[\W_])?(base|basis|ground|excitation|foundation|shaker|table|foot|plate)(\d*[\W_].*)?\d*",
    re.IGNORECASE,
)
_RELATIVE = re.compile(r"(.*[\W_])?(rel|relative|relativ)(\d*[\W_].*)?\d*|x ?[-–−] ?y|mass ?[-–−] ?base", re.IGNORECASE)
_NAMES = {"time": _TIME, "mass": _MASS, "base": _BASE, "relative": _RELATIVE}


@dataclass(frozen=True)
class LogColumn:
    """A column: its number from 0, its title as written, its name without unit, its unit ("" if not said)."""

    index: int
    title: str
    name: str
    unit: str

    def __str__(self) -> str:
        return f"{self.index + 1} ({self.title!r})" if self.title else f"{self.index + 1}"


def columns_of(titles: Sequence[str], units: Sequence[str], fields: int) -> tuple[LogColumn, ...]:
    """Make columns from the cells of a header and of its units row, either of which may be missing."""
    columns = []
    for index in range(fields):
        title = titles[index] if index < len(titles) else ""
        name, unit = split_unit(title)
        below = units[index] if index < len(units) else ""
        alone = known_unit(title) if known_unit(title) in TIME else ""  # a column titled "ms" is time
        columns.append(LogColumn(index, title, name, below or unit or alone))
    return tuple(columns)


def roles_named(titles: Sequence[str]) -> int:
    """Count the titles that name time, mass or base."""
    return sum(any(p.fullmatch(split_unit(t)[0]) for p in (_TIME, _MASS, _BASE)) for t in titles if t)


def by_option(columns: Sequence[LogColumn], said: str | int, role: str, file: str) -> LogColumn:
    """Find the column that a user named, by title, by name without unit, or by number from 1."""
    text = str(said).strip()
    folded = text.casefold()
    for matches in (
        [c for c in columns if c.title.strip().casefold() == folded],
        [
            c
            for c in columns
            if c.name.casefold() == folded or split_unit(text)[0].casefold() == c.name.casefold() != ""
        ],
    ):
        if len(matches) == 1:
            return matches[0]
        if matches:
            raise LogError(f"{file}: --{role} {text!r}: several columns are called so: {_list(matches)}: give a number")
    if text.isdecimal() and 1 <= int(text) <= len(columns):
        return columns[int(text) - 1]
    raise LogError(f"{file}: --{role} {text!r}: no such column; the log has {_list(columns)}")


def candidates(columns: Sequence[LogColumn], role: str) -> list[LogColumn]:
    """Give the columns whose name or unit says this role, time by its unit too."""
    named = [c for c in columns if c.name and _NAMES[role].fullmatch(c.name) and _unit_fits(c, role)]
    if role == "time" and not named:
        return [c for c in columns if c.unit in TIME]
    return named


def is_displacement(column: LogColumn) -> bool:
    """Whether a column may hold a displacement: its unit is a length or is not said."""
    return column.unit in LENGTH or not column.unit


def is_relative(column: LogColumn) -> bool:
    """Whether a column's name says that it is mass minus base.

    Examples
    --------
    >>> [is_relative(LogColumn(0, name, name, "")) for name in ("rel", "Relative displacement", "x-y", "mass", "laser")]
    [True, True, True, False, False]
    """
    return _RELATIVE.fullmatch(column.name) is not None and "time" not in column.name.lower()


def _unit_fits(column: LogColumn, role: str) -> bool:
    return not column.unit or column.unit in (TIME if role == "time" else LENGTH)


def _list(columns: Sequence[LogColumn]) -> str:
    return ", ".join(str(c) for c in columns)


def pick(columns: Sequence[LogColumn], role: str, file: str) -> LogColumn | None:
    """Give the one column of this role; ``None`` if none says so; an error if several do."""
    found = candidates(columns, role)
    if len(found) > 1:
        raise LogError(f"{file}: which column is the {role}? {_list(found)} fit equally well: give --{role}")
    return found[0] if found else None


def unassigned(columns: Sequence[LogColumn], file: str, time: LogColumn | None) -> LogError:
    """Say that mass and base cannot be told apart, and all that has to be given."""
    one, two = (columns[0].index + 1, columns[1].index + 1) if len(columns) > 1 else (columns[0].index + 1, 0)
    order = f"--mass {one} --base {two}, or --mass {two} --base {one}" if len(columns) == 2 else "--mass and --base"
    more = [] if time is not None else ["--time or --sampling-rate where no column says it is the time"]
    more += ["--unit where the sensor's step does not tell it"] if not any(c.unit for c in columns) else []
    rest = f"; and {', '.join(more)}" if more else ""
    known = f" (time is {time})" if time is not None else ""
    return LogError(
        f"{file}: which column is the mass, which the base? {_list(columns)} could be either{known}: give {order}, "
        f"a name or a number from 1{rest}"
    )
