"""A log in SI units: its clock, its channels by role, and what is said of both."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.body import KEEP
from frictionlab.logs.clock import TimeBase, counted, time_base
from frictionlab.logs.columns import LogColumn
from frictionlab.logs.lines import texts_of
from frictionlab.logs.sensor import Channel, bridge, examine, unit_by_step
from frictionlab.logs.table import Table
from frictionlab.logs.timing import Timing, timing_of
from frictionlab.recording import Fact, Quality, QuarantinedLine, Replaced
from frictionlab.units import ACCELERATION, LENGTH, VOLTS, to_si


@dataclass(frozen=True)
class SensorLog:
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
            *_line_warnings(self.table),
            *self.timing.warnings,
            *self.base.warnings,
            *(w for c in self.channels.values() for w in c.warnings),
        ]

    @property
    def evidence(self) -> list[str]:
        """All reasons for reading it so."""
        return [*self.table.evidence, *self.timing.evidence, *(e for c in self.channels.values() for e in c.evidence)]


def examined(table: Table, options: LogOptions, roles: Sequence[str], *, accelerations: bool = False) -> SensorLog:
    """Convert a log to SI units, and examine clock and values: displacements, unless they are accelerations."""
    timing = timing_of(table, options)
    if timing.stamps is None:
        base = counted(table.samples, timing.interval, options.bridge_s)
    else:
        base = time_base(timing.stamps, table.name, bridge_s=options.bridge_s, stated_s=timing.stated_s)
    table = _without_stray(table, base)
    channels, replaced = {}, {}
    for role in roles:
        channel = (_acceleration if accelerations else _channel)(table, role, options)
        replaced[role] = bridge(base.time, channel, base.bridge, role)
        channels[role] = channel
    return SensorLog(table, timing, base, channels, replaced)


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
        raise LogError(f"{table.name}: column {column} is in {unit}: expected a length; {_what_to_give(unit, role)}")
    channel = examine(to_si(values, unit), role, options.measuring_range_m)
    channel.warnings[:0] = warnings
    _check_unit(channel, unit, role)
    return channel


def _acceleration(table: Table, role: str, options: LogOptions) -> Channel:
    """The values of an accelerometer in m/s^2, those that are none flagged."""
    column, values = table.columns[role], table.values.pop(role)
    unit = options.unit or column.unit
    if unit not in ACCELERATION:
        raise LogError(
            f"{table.name}: column {column} is an acceleration by its name; expected its unit, one of"
            f" {', '.join(ACCELERATION)}; got {unit or 'none'}: give --unit, such as --unit m/s^2"
        )
    flags = np.where(np.isnan(values), np.uint8(Quality.NO_VALUE), np.uint8(0)).astype(np.uint8)
    return Channel(to_si(values, unit), flags)


def _what_to_give(unit: str, role: str) -> str:
    if unit in VOLTS:
        return f"give what a volt of the sensor means: {role}_metres_per_volt in [log], --{role}-metres-per-volt"
    return "give --unit if it is one"


def _calibrated(
    values: NDArray[np.float64], column: LogColumn, role: str, options: LogOptions
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
    return values * (per_volt / VOLTS.get(column.unit, 1.0)) + offset


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


def with_still_one(sensors: SensorLog, role: str) -> SensorLog:
    """A log of one channel with the other one standing at 0."""
    n = len(sensors.base.time)
    sensors.channels[role] = Channel(np.zeros(n), np.zeros(n, np.uint8))
    sensors.replaced[role] = (np.zeros(0, np.int64), np.zeros(0))
    return sensors


def absolute(sensors: SensorLog) -> SensorLog:
    """Make the mass's displacement of a relative one and the base's."""
    if "relative" not in sensors.channels:
        return sensors
    relative, base = sensors.channels.pop("relative"), sensors.channels["base"]
    relative.evidence.append("mass is the relative displacement plus the base's")
    where, before = sensors.replaced.pop("relative")
    sensors.replaced["mass"] = where, before + base.values[where]
    sensors.channels["mass"] = replace(relative, values=relative.values + base.values)
    return sensors


def replaced_samples(parts: dict[str, tuple[NDArray[np.int64], NDArray[np.float64]]]) -> Replaced | None:
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
        said.append(f"the header is repeated (before line {where}): the logger was started again there")
    return said


def dialect_facts(sensors: SensorLog, options: LogOptions) -> dict[str, Fact]:
    """How the log was read, key by key, as the recording keeps it."""
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
