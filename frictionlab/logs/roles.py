"""Which column plays which role: options win over the layout, the layout over names, names over elimination."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.columns import LogColumn, by_option, candidates, is_displacement, is_relative, pick, unassigned
from frictionlab.logs.layouts import Layout
from frictionlab.units import VOLTS

Beginning = Callable[[int], NDArray[np.float64]]
"""Gives the first numbers of a column, by its index."""
_EVEN = 0.2
_FEWEST = 8


def assign(
    layout: Layout, options: LogOptions, roles: Sequence[str], file: str, beginning: Beginning
) -> dict[str, LogColumn]:
    """Say which column is time, and which plays each of these roles (``mass``, ``base``, ``relative``).

    Raises
    ------
    LogError
        It cannot be told: the columns and what to give are named.
    """
    columns = _numeric(layout, options)
    found: dict[str, LogColumn] = {}
    for role in ("time", *roles):
        said = getattr(options, role)
        if said is not None:
            found[role] = by_option(layout.columns, said, role, file)
        elif role in layout.prefer:
            found[role] = layout.columns[layout.prefer[role]]
    if options.sampling_rate_hz is not None and options.time is None:
        found.pop("time", None)
    elif "time" not in found and not layout.time_of and (time := _time(columns, found, layout, beginning, file)):
        found["time"] = time
    if layout.time_of:
        times = set(layout.time_of.values())
        columns = [c for c in columns if c.index not in times or c in found.values()]
    found = _with_displacements(columns, found, options, roles, file)
    found = {role: layout.columns[column.index] for role, column in found.items()}
    return _with_own_times(layout, found, roles) if layout.time_of else found


def possible(layout: Layout, options: LogOptions, beginning: Beginning, file: str) -> list[LogColumn]:
    """Columns that may hold a displacement: in a length or in no unit (any, where one is given), no time."""
    columns = _numeric(layout, options)
    times = {c.index for c in candidates(columns, "time")} | set(layout.time_of.values())
    if options.time is not None:
        times.add(by_option(layout.columns, options.time, "time", file).index)
    elif not times and options.sampling_rate_hz is None and (time := _time_by_values(columns, beginning)):
        times.add(time.index)
    return [c for c in columns if c.index not in times and (is_displacement(c) or options.unit is not None)]


def _numeric(layout: Layout, options: LogOptions) -> list[LogColumn]:
    """The columns of numbers; volts count as bare numbers where a calibration says what they mean."""
    columns = [c for c in layout.columns if layout.dialect.kinds[c.index] in "nm"]
    if options.mass_metres_per_volt is options.base_metres_per_volt is None:
        return columns
    return [replace(c, unit="") if c.unit in VOLTS else c for c in columns]


def _time(
    columns: Sequence[LogColumn], found: dict[str, LogColumn], layout: Layout, beginning: Beginning, file: str
) -> LogColumn | None:
    """The column of time by its name or unit, else by its numbers where nothing else says the rate."""
    time = pick(_left(columns, found), "time", file)
    if time is None and "interval_s" not in layout.facts:
        time = _time_by_values(_left(columns, found), beginning)
    return time


def _time_by_values(columns: Sequence[LogColumn], beginning: Beginning) -> LogColumn | None:
    """The one column without a name and a unit whose numbers rise in even steps."""
    rising = [c for c in columns if not c.title and not c.unit and _rises(beginning(c.index))]
    return rising[0] if len(rising) == 1 else None


def _rises(values: NDArray[np.float64]) -> bool:
    steps = np.diff(values)
    if len(steps) < _FEWEST or not steps.min() > 0.0:
        return False
    return bool(np.ptp(steps) <= _EVEN * np.median(steps))


def _with_own_times(layout: Layout, found: dict[str, LogColumn], roles: Sequence[str]) -> dict[str, LogColumn]:
    """Give each channel its own time column, where the user named none: ``time`` is the first channel's."""
    if "time" in found:
        return found
    own = [layout.time_of.get(found[role].index) for role in roles]
    if own[0] is None:
        return found
    others = zip(roles[1:], own[1:], strict=True)
    more = {f"{role}_time": layout.columns[time] for role, time in others if time not in (None, own[0])}
    return {"time": layout.columns[own[0]], **found, **more}


def _left(columns: Sequence[LogColumn], found: dict[str, LogColumn]) -> list[LogColumn]:
    taken = {c.index for c in found.values()}
    return [c for c in columns if c.index not in taken]


def _with_displacements(
    columns: Sequence[LogColumn], found: dict[str, LogColumn], options: LogOptions, roles: Sequence[str], file: str
) -> dict[str, LogColumn]:
    times = candidates(columns, "time")
    fits = [c for c in _left(columns, found) if (is_displacement(c) or options.unit is not None) and c not in times]
    for role in roles:
        if role not in found and len(roles) > 1 and (named := pick(_left(fits, found), role, file)):
            found[role] = named
    missing = [role for role in roles if role not in found]
    left = _left(fits, found)
    if len(missing) == 1 and len(left) == 1:
        found[missing[0]] = left[0]
    elif missing and left:
        raise unassigned(left, file, found.get("time"))
    elif missing:
        others = ", ".join(f"{c} in {c.unit or 'no unit'}" for c in columns if c not in found.values()) or "none"
        raise LogError(
            f"{file}: no column for {' and '.join(missing)}: expected a displacement in m, mm or um; got {others}: "
            "give --mass, --base and --unit, or --mass-log and --base-log if there is one file per sensor"
            + _volts(columns)
        )
    _check_absolute(found, options, file)
    order = [role for role in ("time", *roles) if role in found]
    if len({found[r].index for r in order}) < len(order):
        raise LogError(f"{file}: one column cannot play two roles: {', '.join(f'{r} = {found[r]}' for r in order)}")
    return {role: found[role] for role in order}


def _volts(columns: Sequence[LogColumn]) -> str:
    """What to give for a log in volts."""
    if not any(c.unit in VOLTS for c in columns):
        return ""
    return "; for volts give the sensors' calibration, mass_metres_per_volt and base_metres_per_volt, in [log]"


def _check_absolute(found: dict[str, LogColumn], options: LogOptions, file: str) -> None:
    """Refuse a relative displacement that nobody said is the mass's own."""
    mass = found.get("mass")
    if mass is not None and options.mass is None and is_relative(mass):
        raise LogError(
            f"{file}: column {mass} is a relative displacement by its name: if it is mass minus base, give --relative "
            f"{mass.index + 1}; if it is the mass's own, --mass {mass.index + 1}"
        )
