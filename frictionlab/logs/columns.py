"""Which column is what: names, units and roles of a log's columns.

Options win over the layout, the layout over names and units, names over elimination. A role is ``time``, ``mass``,
``base`` or ``relative`` (displacements; ``mass+2``: a second laser of it), or the name of a further channel.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from frictionlab.errors import LogError
from frictionlab.log_options import FURTHER, LASERS, LogOptions
from frictionlab.units import (
    ACCELERATION,
    LENGTH,
    NORMAL_FORCE,
    QUANTITIES,
    TIME,
    UNIT,
    VOLTS,
    known_unit,
    quantity_of,
    split_unit,
)

if TYPE_CHECKING:
    from frictionlab.logs.table import Log

_TIME = re.compile(
    r"t|x_value|elapsed|epoch|date ?time|clock|dt|"
    r"((acquisition|acq|relative|elapsed|epoch|abs|absolute|system|measurement|sample|sampling|log)[ _-]*)?"
    r"(times?|zeit(en)?|temps|tempo|tiempo|time ?stamps?)([ _-]*\d+)?|(time|(uhr|mess)?zeit|timestamp)\b.*|"
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
_NUMBERED = re.compile(r"(?:.*[\W_])?(?:mass|masse|massa|m|x)[ _-]?(\d{1,2})(?:[\W_].*)?", re.IGNORECASE)
_FRICTION = re.compile(r"f|ft|fx|fr|.*(friction|tangential|lateral|force|kraft|reib).*", re.IGNORECASE)
_COEFFICIENT = re.compile(
    r"cof|mu|µ|μ|.*(friction[ _-]coefficient|reib(ungs)?(zahl|wert|koeffizient)|coefficient.*friction).*", re.IGNORECASE
)
_SAYS = re.compile(  # what a column holds, by the words of its name
    r"(?P<force>force|kraft|reib|friction|tangential|\bnormal|\bload\b)|(?P<torque>torque|dreh?moment|\bmoment\b)"
    r"|(?P<acceleration>accel|(?<![^\W_])acc(?![^\W\d_])|beschleunig)|(?P<velocity>velocity|geschwindig)|(?P<angle>\bangle|winkel)",
    re.IGNORECASE,
)
_GROUPED = re.compile(r"\s*[-+]?\d{1,3}(?:(?:\.\d{3})+,|(?:,\d{3})+\.)\d+\s*", re.ASCII)
_CALIBRATE = "; for volts say what one is, --units 'mass=5 mm/V,base=5 mm/V'"
_ONE_EACH = (
    "if each sensor has its file, `frictionlab init FOLDER` lists them in pairs for `batch`, and `frictionlab ingest"
    " --mass-log FILE --base-log FILE -o NAME.h5` makes a recording of two; `frictionlab free-vibration` takes a tap"
)
_NAMES = {"time": _TIME, "mass": _MASS, "base": _BASE, "relative": _RELATIVE}


@dataclass(frozen=True)
class LogColumn:
    """A column: its number from 0, its title as written, its name without unit, its unit ("" if not said).

    ``kind``: ``n`` numbers, ``m`` moments, ``t`` text, ``e`` empty; ``stamps``: the time column of its own, if any.
    """

    index: int
    title: str
    name: str
    unit: str
    kind: str = "n"
    stamps: int | None = None

    def __str__(self) -> str:
        return f"{self.index + 1} ({self.title!r})" if self.title else f"{self.index + 1}"


def columns_of(titles: Sequence[str], units: Sequence[str], kinds: str) -> tuple[LogColumn, ...]:
    """Make columns from the cells of a header and of its units row, either of which may be missing."""
    columns = []
    for index, kind in enumerate(kinds):
        title = "".join(c if c.isprintable() else "?" for c in titles[index]) if index < len(titles) else ""
        name, unit = split_unit(title)
        below = units[index] if index < len(units) else ""
        alone = known_unit(title) if known_unit(title) in TIME else ""  # a column titled "ms" is time
        columns.append(LogColumn(index, title, name, below or unit or alone, kind))
    return tuple(columns)


def roles_named(titles: Sequence[str]) -> int:
    """Count the titles that name time, mass or base."""
    return sum(any(p.fullmatch(split_unit(t)[0]) for p in (_TIME, _MASS, _BASE)) for t in titles if t)


def by_option(columns: Sequence[LogColumn], said: str | int, role: str) -> LogColumn:
    """Find the column that a user named, by title, by name without unit, or by number from 1."""
    text = str(said).strip()
    folded, name = text.casefold(), split_unit(text)[0].casefold()
    titled = [c for c in columns if c.title.strip().casefold() == folded]
    matches = titled or [c for c in columns if c.name.casefold() in {folded, name} - {""}]
    if len(matches) == 1:
        return matches[0]
    if matches:
        raise LogError(f"{_flag(role)} {text!r}: several columns are called so: {_list(matches)}: give a number")
    if text.isascii() and text.isdecimal() and 1 <= int(text) <= len(columns):
        return columns[int(text) - 1]
    raise LogError(f"{_flag(role)} {text!r}: no such column; the log has {_list(columns)}")


def candidates(columns: Sequence[LogColumn], role: str) -> list[LogColumn]:
    """Give the columns whose name or unit says this role, time by its unit too."""
    units = TIME if role == "time" else LENGTH
    named = [c for c in columns if c.name and _NAMES[role].fullmatch(c.name) and (not c.unit or c.unit in units)]
    if role == "time" and not named:
        return [c for c in columns if c.unit in TIME]
    return named


def is_displacement(column: LogColumn) -> bool:
    """Whether a column may hold a displacement: its unit is a length, or is not said of what is no coefficient."""
    return column.unit in LENGTH or not (column.unit or _COEFFICIENT.fullmatch(column.name))


def _is_acceleration(column: LogColumn) -> bool:
    """Whether a column holds an acceleration, by its unit or, where none is said, by its name."""
    word = None if column.unit else _SAYS.search(column.name)
    return column.unit in ACCELERATION or (word is not None and word.lastgroup == "acceleration")


def _flag(role: str) -> str:
    return "--" + role.replace("_", "-")


def _list(columns: Sequence[LogColumn]) -> str:
    return ", ".join(map(str, columns))


def _pick(columns: Sequence[LogColumn], role: str) -> LogColumn | None:
    """Give the one column of this role; ``None`` if none says so; an error if several do."""
    found = candidates(columns, role)
    epochs = [c for c in found if role == "time" and c.name.lower().startswith("epoch")]
    found = epochs if len(epochs) == 1 else found  # what two sensors' logs have in common
    if len(found) > 1:
        both = f", or if all see one place --{role} {'+'.join(str(c.index + 1) for c in found)}" * (role != "time")
        raise LogError(f"which column is the {role}? {_list(found)} fit equally well: give --{role}{both}")
    return found[0] if found else None


def assign(
    log: "Log", options: LogOptions, roles: Sequence[str], *, further: bool = False
) -> tuple[dict[str, LogColumn], list[str]]:
    """Say which column is time, and which plays each role; with ``further`` also other channels; what is left out."""
    every, columns = log.layout.columns, _numeric(log, options)
    own, is_counted = {c.stamps for c in every} - {None}, options.sampling_rate_hz is not None and options.time is None
    found: dict[str, LogColumn] = {}
    for role in ("time", *roles):
        if (said := getattr(options, role)) is not None:
            whole = any(said in (c.title, c.name) for c in every)
            for number, name in enumerate([said] if whole else str(said).split("+"), 1):
                found[f"{role}+{number}" if number > 1 else role] = by_option(every, name, role)
    more, warnings = _further(every, columns, found, options) if further else ({}, [])
    more |= {role: column for role, column in found.items() if "+" in role}
    columns = _left(columns, more)
    free = _left(columns, found)
    if is_counted:
        warnings += _contradicted(log, next(iter(candidates(free, "time")), None), options.sampling_rate_hz or 0.0)
    elif "time" not in found and not own:
        time = _pick(free, "time") or ("interval_s" not in log.layout.facts and _time_by_values(free, log)) or None
        found |= {"time": time} if time else {}
    columns = [c for c in columns if c.index not in own or c in found.values()]
    lone = further and options.sampling_rate_hz is not None and len(columns) == 1 and is_displacement(columns[0])
    lone = lone and not candidates(columns, "time")
    # beside other channels, a bare number is a length only where its name says whose
    sure = [c for c in columns if not more or c.unit in LENGTH or candidates([c], "mass") or candidates([c], "base")]
    found = _with_displacements(sure, found, options, roles, log, alone=bool(more) or lone)
    _refuse_grouped(log, list(found.values()))
    warnings += _not_taken(_left(columns, found), found) if further else []
    found = {role: every[column.index] for role, column in (found | more).items()}
    first = next(iter(found.values())).stamps
    if first is not None and "time" not in found and not is_counted:  # each channel's own: the first one's is time
        others = {f"{role}_time": found[role].stamps for role in roles[1:] if role in found}
        apart = {role: every[index] for role, index in others.items() if index not in (None, first)}
        found = {"time": every[first]} | found | apart
    return found, warnings


def _refuse_grouped(log: "Log", columns: Sequence[LogColumn]) -> None:
    """Refuse marks between thousands in these columns: 1.027 may be either."""
    for cells in log.rows(400):
        for column in columns:
            if _GROUPED.fullmatch(cells[column.index]):
                raise LogError(
                    f"column {column} has marks between thousands: expected plain numbers; got"
                    f" {cells[column.index].strip()!r}: write the log without them"
                )


def _not_taken(columns: Sequence[LogColumn], found: Mapping[str, LogColumn]) -> list[str]:
    """Sentences of columns left over: lengths, other quantities of a channel, by their units or else by their names."""
    said, places = [], {role: found[role].index + 1 for role in LASERS if role in found}
    for quantity in dict.fromkeys(quantity_of(c.unit) for c in columns):
        options = " or ".join(_flag(role) for role in FURTHER if quantity and role.endswith(f"_{quantity}"))
        if unnamed := [c for c in columns if options and quantity_of(c.unit) == quantity and not channel_named(c)]:
            said.append(f"{quantity}, not taken, for no name says of what: {_list(unnamed)}: {options} takes one")
    for column in columns:
        word = _SAYS.search(column.name)
        laser = next((role for role in LASERS if column.unit in VOLTS and _NAMES[role].fullmatch(column.name)), "")
        said += [f"column {column} is not taken: say what a volt is, --units '{laser}=5 mm/V'"] if laser else []
        if column.unit in LENGTH:
            both = " or ".join(f"--{role} {number}+{column.index + 1}" for role, number in places.items())
            same = f"if it sees what another does, give both ({both}, or the same in [log])"
            said.append(f"column {column} is a length, and not taken: {same if both else 'name it if it is needed'}")
        if word is None or quantity_of(column.unit) not in ("", "voltage"):
            continue
        quantity = str(word.lastgroup)
        role = channel_named(replace(column, unit=UNIT[quantity])) or f"mass_{quantity}"
        unit = f"{role}=UNIT, which is one of {', '.join(QUANTITIES[quantity])}"
        unit = f"'{role}=50 {UNIT[quantity]}/V', or what a volt is" if column.unit else unit
        said.append(
            f"column {column} is not taken: by its name a {quantity}, by its unit none; if it is one, give"
            f" {_flag(role)} {column.index + 1} --units {unit}"
        )
    return said


def _contradicted(log: "Log", time: LogColumn | None, rate: float) -> list[str]:
    """A sentence where the stamps that a given sampling rate replaces have another rate."""
    stamps = log.beginning(time.index) if time is not None else np.zeros(0)
    step = float(stamps[-1] - stamps[0]) / (len(stamps) - 1) if len(stamps) > 1 else 0.0
    units = [time.unit] if time is not None and time.unit in TIME else list(TIME)
    if step <= 0.0 or any(abs(rate * step / TIME[unit] - 1.0) < 0.02 for unit in units):
        return []
    return [f"time: column {time} has steps of {step:.6g} {time.unit if time else ''}: {rate:g} Hz as given is taken"]


def _further(
    every: Sequence[LogColumn], columns: Sequence[LogColumn], found: dict[str, LogColumn], options: LogOptions
) -> tuple[dict[str, LogColumn], list[str]]:
    """The columns of further channels: named by an option, or by name and unit; what fits twice is left out."""
    said = {role: getattr(options, role) for role in FURTHER}
    more = {role: by_option(every, name, role) for role, name in said.items() if name is not None}
    fitting: dict[str, list[LogColumn]] = {}
    left = _left(columns, found | more)
    masses = candidates(left, "mass")  # "mass" beside "mass 2" is the first
    numbered = {_mass_number(c) for c in left} - {""} | {_mass_number(c) or "1" for c in masses if len(masses) > 1}
    for column in left:
        name = channel_named(column, numbered=len(numbered) > 1)
        if column.unit in ("", *VOLTS):  # what is said of a channel is of the column that is called so
            said_so = ((role, options.unit_of(role)[0]) for role in FURTHER)
            named = (role for role, unit in said_so if unit and channel_named(replace(column, unit=unit)) == role)
            name = next((role for role in named if "force" in role or _SAYS.search(column.name)), name)
        if name and name not in more:
            fitting.setdefault(name, []).append(column)
    lost = [role for role in FURTHER if options.unit_of(role)[1] and role not in more and role not in fitting]
    warnings = [
        f"{_list(several)} could each be {name.replace('_', ' ')}: none is taken"
        + (f"; give {_flag(name)}" if name in FURTHER else "; name them apart")
        for name, several in fitting.items()
        if len(several) > 1
    ]
    warnings += [f"{role}: a volt of it is declared, but no column is called so: give {_flag(role)}" for role in lost]
    return more | {name: several[0] for name, several in fitting.items() if len(several) == 1}, warnings


def channel_named(column: LogColumn, *, numbered: bool = True) -> str:
    """The further channel that a column is by its unit and its name; "" if it is none, or that is not clear.

    ``numbered``: whether several masses are numbered; then all but the first are further channels.
    """
    quantity, number = quantity_of(column.unit), _mass_number(column)
    if quantity in ("velocity", "acceleration"):
        if number or _MASS.fullmatch(column.name):
            return f"mass{f'_{number}' if number not in ('', '1') else ''}_{quantity}"
        return f"base_{quantity}" if _BASE.fullmatch(column.name) else ""
    if quantity == "force":
        if NORMAL_FORCE.fullmatch(column.name):
            return "normal_force"
        return "contact_force" if _FRICTION.fullmatch(column.name) else ""
    if is_displacement(column) and numbered and number not in ("", "1"):
        return f"mass_{number}_displacement"
    return quantity.replace(" ", "_") if quantity in ("torque", "angle", "angular velocity", "temperature") else ""


def _mass_number(column: LogColumn) -> str:
    """The number of the mass in a column's name: "2" of "mass 2"; "" where there is none."""
    match = _NUMBERED.fullmatch(column.name)
    return str(int(match[1])) if match and int(match[1]) else ""


def possible(log: "Log", options: LogOptions) -> list[LogColumn]:
    """Columns that may hold a displacement: in a length or in no unit (any, where one is given), no time."""
    columns = _numeric(log, options)
    times = {c.index for c in candidates(columns, "time")} | {c.stamps for c in columns if c.stamps is not None}
    if options.time is not None:
        times.add(by_option(log.layout.columns, options.time, "time").index)
    elif not times and options.sampling_rate_hz is None and (time := _time_by_values(columns, log)):
        times.add(time.index)
    return [c for c in columns if c.index not in times and is_displacement(c)]


def acceleration_in(log: "Log", options: LogOptions) -> LogColumn | None:
    """The column of the base's acceleration, where there is no displacement, or where it was named as the base."""
    columns = log.layout.columns
    named = options.base_acceleration if options.base is None else options.base
    if named is not None:
        column = by_option(columns, named, "base")
        said = options.unit in ACCELERATION or options.base_acceleration is not None
        return column if said or _is_acceleration(column) else None
    alone = all(map(_is_acceleration, possible(log, options)))
    return next((column for column in columns if alone and _is_acceleration(column)), None)


def _numeric(log: "Log", options: LogOptions) -> list[LogColumn]:
    """The columns of numbers; volts count as bare numbers where a calibration says what they mean."""
    columns = [c for c in log.layout.columns if c.kind in "nm"]
    calibrated = any(options.unit_of(role)[1] for role in LASERS)
    return [replace(c, unit="") if calibrated and c.unit in VOLTS else c for c in columns]


def _time_by_values(columns: Sequence[LogColumn], log: "Log") -> LogColumn | None:
    """The one column of clock times, whatever its name; else without name and unit, whose numbers rise evenly."""

    def rises(index: int) -> bool:
        steps = np.diff(log.beginning(index))
        return len(steps) >= 8 and steps.min() > 0.0 and bool(np.ptp(steps) <= 0.2 * np.median(steps))

    moments = [c for c in columns if c.kind == "m"]
    found = moments or [c for c in columns if not c.title and not c.unit and rises(c.index)]
    return found[0] if len(found) == 1 else None


def _left(columns: Sequence[LogColumn], found: dict[str, LogColumn]) -> list[LogColumn]:
    taken = {c.index for c in found.values()}
    return [c for c in columns if c.index not in taken]


def _with_displacements(
    columns: Sequence[LogColumn],
    found: dict[str, LogColumn],
    options: LogOptions,
    roles: Sequence[str],
    log: "Log",
    *,
    alone: bool,
) -> dict[str, LogColumn]:
    """The columns of these roles; ``alone``: one of them, or none, will do."""
    times = candidates(columns, "time")
    fits = [c for c in _left(columns, found) if is_displacement(c) and c not in times]
    for role in roles:
        if role not in found and len(roles) > 1 and (named := _pick(_left(fits, found), role)):
            found[role] = named
    missing = [role for role in roles if role not in found]
    left = _left(fits, found)
    if len(left) == 1 and (len(missing) == 1 or (missing and alone)):
        found[missing[0]] = left[0]
    elif missing and (left or not alone):
        _refuse_grouped(log, log.layout.columns)
        if ratios := [c for c in columns if c.unit not in LENGTH and _COEFFICIENT.fullmatch(c.name)]:
            raise LogError(
                f"column {ratios[0]} is a coefficient of friction by its name: expected what it was worked out from;"
                " got the result: export the friction force in N (and the normal force, or give it as"
                " experiment.normal_force_n)"
            )
        if left:
            raise _unassigned(left, found.get("time"))
        others = ", ".join(f"{c} in {c.unit or 'no unit'}" for c in columns if c not in found.values()) or "none"
        sensed = [(f"{missing[0]}_{quantity_of(c.unit)}", c.index + 1) for c in columns]
        do = [f"if it is the {missing[0]}'s, give {_flag(role)} {n}" for role, n in sensed if role in FURTHER]
        raise LogError(
            f"no column for {' and '.join(missing)}: expected a displacement in m, mm or um; got {others}: "
            f"{'; '.join(do) or 'correct the units in its head'}; {_ONE_EACH}"
            + (_CALIBRATE if any(c.unit in VOLTS for c in columns) else "")
        )
    mass = found.get("mass")
    is_relative = mass is not None and _RELATIVE.fullmatch(mass.name) and "time" not in mass.name.lower()
    if mass is not None and options.mass is None and is_relative:
        raise LogError(
            f"column {mass} is a relative displacement by its name: if it is mass minus base, give --relative "
            f"{mass.index + 1}; if it is the mass's own, --mass {mass.index + 1}"
        )
    order = [role for role in ("time", *roles) if role in found]
    if len({found[r].index for r in order}) < len(order):
        raise LogError(f"one column cannot play two roles: {', '.join(f'{r} = {found[r]}' for r in order)}")
    return {role: found[role] for role in order}


def _unassigned(columns: Sequence[LogColumn], time: LogColumn | None) -> LogError:
    """Mass and base cannot be distinguished: all that has to be given."""
    one, two = columns[0].index + 1, columns[-1].index + 1
    order = f"--mass {one} --base {two}, or --mass {two} --base {one}" if len(columns) == 2 else "--mass and --base"
    if len(columns) == 1:
        order = f"--mass {one}, --base {one} or what else it is (--angle {one} --units angle=deg)"
    more = [] if time is not None else ["--time or --sampling-rate where no column says it is the time"]
    more += ["--unit, such as --unit mm, for none says its unit"] if not any(c.unit for c in columns) else []
    more += [_ONE_EACH] * (len(columns) == 1)
    rest = f"; and {', '.join(more)}" if more else ""
    known = f" (time is {time})" if time is not None else ""
    return LogError(
        f"which column is the mass, which the base? {_list(columns)} could be either{known}: give {order}, "
        f"a name or a number from 1{rest}"
    )
