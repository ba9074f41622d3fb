"""From one log, or one log per sensor, to a recording."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.logs.align import Aligned, align
from frictionlab.logs.clock import TimeBase, counted, time_base
from frictionlab.logs.columns import Column, by_option
from frictionlab.logs.lines import Progress, texts_of
from frictionlab.logs.options import LogOptions
from frictionlab.logs.sensor import Channel, bridge, examine, unit_by_step
from frictionlab.logs.table import KEEP, Table, displacements, layout_in, read_table
from frictionlab.logs.timing import Timing, timing_of
from frictionlab.logs.units import LENGTH, VOLTS, to_si
from frictionlab.recording import Fact, QuarantinedLine, Recording, Replaced, Source

_ACCELERATION = re.compile(
    r"(.*[\W_])?(acc|accel|acceleration|accelerometer|beschleunigung)([\W_\d].*)?", re.IGNORECASE
)
_ACCELERATION_UNIT = re.compile(r"m/s\^?2|m/s²|m\*?s\^-2|\[g\]|\(g\)|\bgal\b", re.IGNORECASE)


@dataclass(frozen=True)
class _Sensors:
    """A log in SI units: its time base and its channels by role."""

    table: Table
    timing: Timing
    base: TimeBase
    channels: dict[str, Channel]
    replaced: dict[str, tuple[NDArray[np.int64], NDArray[np.float64]]]

    @property
    def warnings(self) -> list[str]:
        """All sentences about this log."""
        return [
            *self.timing.warnings,
            *self.base.warnings,
            *(w for c in self.channels.values() for w in c.warnings),
        ]

    @property
    def evidence(self) -> list[str]:
        """All reasons for reading it so."""
        return [*self.table.evidence, *self.timing.evidence, *(e for c in self.channels.values() for e in c.evidence)]


def read_log(path: Path, options: LogOptions | None = None, *, progress: Progress | None = None) -> Recording:
    r"""Read a log that holds both channels.

    Parameters
    ----------
    path
        The log: text, packed or not, or a binary one of a kind that is registered.
    options
        What the log does not say itself, or says wrongly.
    progress
        Called with bytes read and bytes in all.

    Returns
    -------
    Recording
        In SI units, one sample for each data line, damage flagged.

    Raises
    ------
    LogError
        If it cannot be read, can be read in more than one way, or is damaged beyond use.

    Examples
    --------
    >>> import tempfile
    >>> log = Path(tempfile.mkdtemp()) / "test.csv"
    >>> _ = log.write_text("t [s];mass [mm];base [mm]\n" + "".join(f"0,{i:02};1,5;-2,25\n" for i in range(50)))
    >>> recording = read_log(log)
    >>> len(recording), float(recording.mass_displacement[0]), recording.source.dialect["decimal"]
    (50, 0.0015, ',')
    """
    options = options or LogOptions()
    roles = ("mass" if options.relative is None else "relative", "base")
    table = read_table(path, options, roles, progress)
    if "base_time" in table.values:
        times = table.values["time"], table.values.pop("base_time")
        if not np.array_equal(*times):
            return _read_own_times(table, times[1], options)
    return _recording(_absolute(_examined(table, options, roles)), options)


def read_mass_log(path: Path, options: LogOptions | None = None) -> Recording:
    """Read a log of a free vibration: both channels, or the mass alone, whose base then stands at 0.

    Raises
    ------
    LogError
        As `read_log`; where the log has no base, what is wrong with its mass.
    """
    options = options or LogOptions()
    if len(displacements(path, options)) > 1:
        return read_log(path, options)
    sensors = _examined(read_table(path, replace(options, base=None), ("mass",)), options, ("mass",))
    return _recording(_with_still_one(sensors, "base"), options)


def read_base_log(path: Path, options: LogOptions | None = None) -> Recording:
    """Read the motion of a base: from a log of both channels, or from one column of any table; the mass stands at 0.

    Raises
    ------
    LogError
        As `read_log`; or the base is given as an acceleration.
    """
    options = options or LogOptions()
    _refuse_acceleration(path, options)
    if options.base is None and len(displacements(path, options)) > 1:
        return read_log(path, options)
    return _recording(
        _with_still_one(_examined(read_table(path, options, ("base",)), options, ("base",)), "mass"), options
    )


def _refuse_acceleration(path: Path, options: LogOptions) -> None:
    """Say what to do with an acceleration where there is no displacement, or where it was named as the base."""
    columns = layout_in(path, options).columns
    if options.base is not None:
        columns = (by_option(columns, options.base, "base", path.name),)
    elif displacements(path, options) and not all(map(_is_acceleration, displacements(path, options))):
        return
    found = [column for column in columns if _is_acceleration(column)]
    if found:
        raise LogError(
            f"{path.name}: column {found[0]} is an acceleration: expected a displacement of the base in m, mm or um; "
            "do: record the displacement, or integrate twice (take the mean off, high-pass below the slowest motion of "
            "interest before each integration, look for drift) and give that column by --base with its --unit"
        )


def _is_acceleration(column: Column) -> bool:
    return bool(_ACCELERATION.fullmatch(column.name) or _ACCELERATION_UNIT.search(column.title))


def _with_still_one(sensors: _Sensors, role: str) -> _Sensors:
    """A log of one channel with the other one standing at 0."""
    n = len(sensors.base.time)
    sensors.channels[role] = Channel(np.zeros(n), np.zeros(n, np.uint8))
    sensors.replaced[role] = (np.zeros(0, np.int64), np.zeros(0))
    return sensors


def _absolute(sensors: _Sensors) -> _Sensors:
    """Make the mass's displacement of a relative one and the base's."""
    if "relative" not in sensors.channels:
        return sensors
    relative, base = sensors.channels.pop("relative"), sensors.channels["base"]
    relative.evidence.append("mass is the relative displacement plus the base's")
    where, before = sensors.replaced.pop("relative")
    sensors.replaced["mass"] = where, before + base.values[where]
    sensors.channels["mass"] = replace(relative, values=relative.values + base.values)
    return sensors


def _recording(sensors: _Sensors, options: LogOptions) -> Recording:
    mass, base = sensors.channels["mass"], sensors.channels["base"]
    return Recording(
        time=sensors.base.time,
        mass_displacement=mass.values,
        base_displacement=base.values,
        quality=sensors.base.quality | mass.quality | base.quality,
        source=Source(
            files=(sensors.table.file,),
            dialect=_dialect(sensors, options),
            options=options.given(),
            quarantined=sensors.table.quarantined,
            warnings=tuple(_line_warnings(sensors.table) + sensors.warnings),
            evidence=tuple(sensors.evidence),
            replaced=_replaced(sensors.replaced),
        ),
    )


def read_two_logs(
    mass_log: Path, base_log: Path, options: LogOptions | None = None, *, progress: Progress | None = None
) -> Recording:
    """Read one log per sensor and put both on the mass's clock.

    Parameters
    ----------
    mass_log, base_log
        One log of the mass, one of the base, each with its own clock and rate.
    options
        ``lag_s`` where the clocks' difference is known.
    progress
        Called with bytes read and bytes in all of each log.

    Returns
    -------
    Recording
        The samples of the mass's log that lie inside both logs; the base is interpolated to them, and
        ``source.dialect`` says how the logs were aligned, how sure that is and what was trimmed.

    Raises
    ------
    LogError
        As `read_log`, and if the logs do not overlap.
    """
    options = options or LogOptions()
    one = replace(options, base=None)
    two = replace(options, mass=None)
    mass = _examined(read_table(mass_log, one, ("mass",), progress), options, ("mass",))
    base = _examined(read_table(base_log, two, ("base",), progress), options, ("base",))
    aligned = _aligned(mass, base, options)
    return _recording_of_two(mass, base, aligned, options)


def _aligned(mass: _Sensors, base: _Sensors, options: LogOptions, *, one_clock: bool = False) -> Aligned:
    one = mass.base, mass.timing, mass.channels["mass"]
    return align(one, (base.base, base.timing, base.channels["base"]), options, one_clock=one_clock)


def _read_own_times(table: Table, base_time: NDArray[np.float64], options: LogOptions) -> Recording:
    """Read a log whose channels have stamps of their own, on one clock."""
    there = np.isfinite(base_time)
    base = replace(
        table,
        columns={"time": table.columns["base_time"], "base": table.columns["base"]},
        values={"time": base_time[there], "base": table.values["base"][there]},
        samples=int(there.sum()),
    )
    columns = {role: table.columns[role] for role in ("time", "mass")}
    mass = replace(table, columns=columns, values={role: table.values[role] for role in columns})
    one, two = _examined(mass, options, ("mass",)), _examined(base, options, ("base",))
    one, two = (replace(s, table=replace(s.table, file=table.file)) for s in (one, two))  # one file, counted once
    return _recording_of_two(one, two, _aligned(one, two, options, one_clock=True), options)


def _recording_of_two(mass: _Sensors, base: _Sensors, aligned: Aligned, options: LogOptions) -> Recording:
    said = [
        f"{sensors.table.name}: {sentence}"
        for sensors in (mass, base)
        for sentence in _line_warnings(sensors.table) + sensors.warnings
    ]
    why = [f"{sensors.table.name}: {sentence}" for sensors in (mass, base) for sentence in sensors.evidence]
    facts = _dialect(mass, options) | {
        f"base_log_{key}": value for key, value in _dialect(base, options).items() if not key.startswith("base_")
    }
    facts |= {key: value for key, value in _dialect(base, options).items() if key.startswith("base_")}
    return Recording(
        time=aligned.time,
        mass_displacement=aligned.mass,
        base_displacement=aligned.base,
        quality=aligned.quality,
        source=Source(
            files=tuple(dict.fromkeys((mass.table.file, base.table.file))),
            dialect=facts | aligned.facts,
            options=options.given(),
            quarantined=tuple(dict.fromkeys((*mass.table.quarantined, *base.table.quarantined))),
            warnings=(*dict.fromkeys(said), *aligned.warnings),
            evidence=tuple(dict.fromkeys(why)),
        ),
    )


def _examined(table: Table, options: LogOptions, roles: Sequence[str]) -> _Sensors:
    """Convert a log to SI units, and examine clock and values."""
    timing = timing_of(table, options)
    if timing.stamps is None:
        base = counted(table.samples, timing.interval, options.bridge_s)
    else:
        base = time_base(timing.stamps, table.name, bridge_s=options.bridge_s, stated_s=timing.stated_s)
    table = _without_stray(table, base)
    channels, replaced = {}, {}
    for role in roles:
        channel = _channel(table, role, options)
        replaced[role] = bridge(base.time, channel, base.bridge, role)
        channels[role] = channel
    return _Sensors(table, timing, base, channels, replaced)


def _without_stray(table: Table, base: TimeBase) -> Table:
    """Quarantine the lines whose stamps run backward."""
    if not len(base.stray):
        return table
    numbers = table.lines.of(base.stray).tolist()
    room = max(0, KEEP - len(table.quarantined))
    texts = texts_of(table.head, numbers[:room])
    more = [QuarantinedLine(table.name, n, texts.get(n, ""), "the time stamp runs backward") for n in numbers[:room]]
    lines = table.file.lines
    lines = replace(lines, data=lines.data - len(numbers), quarantined=lines.quarantined + len(numbers))
    return replace(
        table,
        file=replace(table.file, lines=lines),
        values={role: np.delete(values, base.stray) for role, values in table.values.items()},
        samples=table.samples - len(numbers),
        quarantined=tuple(sorted((*table.quarantined, *more), key=lambda q: q.number)),
    )


def _channel(table: Table, role: str, options: LogOptions) -> Channel:
    column, values = table.columns[role], table.values.pop(role)
    warnings = []
    calibrated = _calibrated(values, column, role, options)
    if calibrated is not None:
        return examine(calibrated, role, options.measuring_range_m)
    unit = options.unit or column.unit
    if not unit:
        found = unit_by_step(values)
        if found is None:
            raise LogError(f"{table.name}: the unit of column {column} is not said: give --unit, such as --unit mm")
        unit = found[0]
        warnings.append(f"{role}: no unit is said; the sensor's step says {unit} ({found[1] * 1e3:g} mm range)")
    elif options.unit and column.unit and options.unit != column.unit:
        warnings.append(f"{role}: the log says {column.unit}, --unit says {options.unit}: {options.unit} is taken")
    if unit not in LENGTH:
        raise LogError(f"{table.name}: column {column} is in {unit}: expected a length; give --unit if it is one")
    channel = examine(to_si(values, unit), role, options.measuring_range_m)
    channel.warnings[:0] = warnings
    _check_unit(channel, unit, role)
    return channel


def _calibrated(
    values: NDArray[np.float64], column: Column, role: str, options: LogOptions
) -> NDArray[np.float64] | None:
    """Metres of a sensor's volts (bare numbers count as volts), where its calibration is given; else ``None``."""
    known = {
        "mass": (options.mass_metres_per_volt, options.mass_offset_m),
        "base": (options.base_metres_per_volt, options.base_offset_m),
    }
    per_volt, offset = known.get(role, (None, 0.0))
    if per_volt is None:
        return None
    if column.unit and column.unit not in VOLTS:
        raise LogError(
            f"column {column} is in {column.unit}: {role}_metres_per_volt is for one in volts: leave it out of [log]"
        )
    return values * (VOLTS.get(column.unit, 1.0) * per_volt) + offset


def _check_unit(channel: Channel, unit: str, role: str) -> None:
    """Warn where the sensor's step fits another unit than the one said."""
    if channel.range is not None or unit not in ("m", "mm", "um"):
        return
    found = unit_by_step(channel.values, LENGTH[unit])
    if found is not None and found[0] != unit:
        channel.warnings.append(
            f"{role}: the log says {unit}, but its step fits an optoNCDT of {found[1] * 1e3:g} mm range read in "
            f"{found[0]}: check the unit, and give --unit {found[0]} if so"
        )


def _replaced(parts: dict[str, tuple[NDArray[np.int64], NDArray[np.float64]]]) -> Replaced | None:
    """Put what was replaced in the two channels side by side; nan where that channel was sound."""
    index = np.union1d(parts["mass"][0], parts["base"][0])
    if not len(index):
        return None
    columns = {}
    for role, (where, values) in parts.items():
        columns[role] = np.full(len(index), np.nan)
        columns[role][np.searchsorted(index, where)] = values
    return Replaced(index, columns["mass"], columns["base"])


def _line_warnings(table: Table) -> list[str]:
    lines = table.file.lines
    said = []
    if lines.quarantined:
        first = table.quarantined[0]
        said.append(f"{lines.quarantined} of {lines.read} lines are quarantined; line {first.number}: {first.reason}")
    if len(table.restarts):
        where = ", ".join(str(n) for n in table.lines.of(table.restarts).tolist()[:5])
        said.append(f"the header is repeated (before line {where}): the logger was restarted")
    return said


def _dialect(sensors: _Sensors, options: LogOptions) -> dict[str, Fact]:
    table, dialect = sensors.table, sensors.table.layout.dialect
    facts: dict[str, Fact] = {
        "layout": table.layout.name,
        "encoding": table.head.encoding,
        "compression": table.head.package or "none",
        "separator": dialect.separator,
        "decimal": dialect.decimal,
        "header_lines": " ".join(str(i + 1) for i in table.layout.header),
        "first_data_line": table.lines.numbers[0],
    }
    for role, column in table.columns.items():
        facts[f"{role}_column"] = column.title or str(column.index + 1)
        facts[f"{role}_column_number"] = column.index + 1
    facts |= {f"{role}_unit": options.unit or c.unit for role, c in table.columns.items() if role in sensors.channels}
    facts |= sensors.timing.facts
    facts |= {"sampling_rate_hz": 1.0 / sensors.base.interval, "bridge_s": sensors.base.bridge}
    facts |= {"missing_samples": sensors.base.missing}
    for role, channel in sensors.channels.items():
        facts |= {f"{role}_step_m": channel.step} if channel.step else {}
        facts |= {f"{role}_measuring_range_m": channel.range} if channel.range else {}
    return facts
