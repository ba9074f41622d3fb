"""From one log, or one log per sensor, to a recording: what was read is examined, converted to SI, put together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import DOUBTED, LogError
from frictionlab.log_options import FURTHER, LASERS, LogOptions
from frictionlab.logs.align import align
from frictionlab.logs.clock import Clock, clock_of
from frictionlab.logs.columns import acceleration_in, possible
from frictionlab.logs.sensor import Sensed, bridge, examine, flag_dead, together, unit_by_step
from frictionlab.logs.table import Log, naming, open_log, read_table
from frictionlab.recording import Channel, Fact, QuarantinedLine, Recording, Source, quantity_named
from frictionlab.units import LENGTH, QUANTITIES, UNIT, VOLTS, quantity_of, to_si

_SENTINELS = (9999.0, 99999.0, 999999.0, 9999.9, 9999.99, 999.99)


@dataclass(frozen=True)
class SensorLog:
    """A log in SI units: its clock, and its channels by role."""

    log: Log
    clock: Clock
    channels: dict[str, Sensed]


def read_log(path: Path, options: LogOptions | None = None) -> Recording:
    r"""Read a log that holds both displacements, or further channels: one sample for each line of data, damage flagged.

    It may be text, packed or not, or binary of a kind that is registered; ``options`` say what it does not, or says
    wrongly. Refused are logs that cannot be read, or in more than one way, or are damaged beyond use.

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
    with naming(path):
        return _read(open_log(path, options), options)


def _read(log: Log, options: LogOptions) -> Recording:
    roles = ("mass" if options.relative is None else "relative", "base")
    read_table(log, options, roles, further=True)
    if "base_time" in log.columns:
        base_time = log.body.values.pop("base_time")
        if not np.array_equal(log.body.values["time"], base_time):
            return _read_own_times(log, base_time, options)
    sensors = _examined(log, options)
    if "relative" in sensors.channels:  # to the mass's displacement, by the base's
        relative, base = sensors.channels.pop("relative"), sensors.channels["base"]
        log.evidence.append("mass is the relative displacement plus the base's")
        sensors.channels["mass"] = replace(relative, values=relative.values + base.values)
    return _recording([sensors], options)


def read_mass_log(path: Path, options: LogOptions | None = None) -> Recording:
    """Read a log of a free vibration, as `read_log`: all channels, or the mass alone, whose base then stands at 0."""
    options = options or LogOptions()
    with naming(path):
        log = open_log(path, options)
        if len(possible(log, options)) != 1 or any(getattr(options, role) is not None for role in FURTHER):
            return _read(log, options)
        return _recording([_examined(read_table(log, options, ("mass",)), options)], options, still="base")


def read_base_log(path: Path, options: LogOptions | None = None) -> Recording:
    """Read the motion of a base, as `read_log`: of both channels, or of one column of any table; the mass stands at 0.

    Where it is an acceleration, it is the channel ``base_acceleration``, and no displacement of the base is there.
    """
    options = options or LogOptions()
    with naming(path):
        log = open_log(path, options)
        column, own, roles = acceleration_in(log, options), options, ["base"]
        if column is not None:
            units = f"base_acceleration={options.unit}" if options.unit else options.units
            own, roles = options.but(base=None, base_acceleration=column.index + 1, unit=None, units=units), []
        elif options.base is None and len(possible(log, options)) > 1:
            return _read(log, options)
        sensors = _examined(read_table(log, own, roles, further=not roles), own)
        return _recording([sensors], options, still="mass")


def read_two_logs(mass_log: Path, base_log: Path, options: LogOptions | None = None) -> Recording:
    """Read one log per sensor, each with its own clock and rate, and put both on the mass's clock.

    Kept are the samples of the mass's log inside both; the base is interpolated to them, and ``source.dialect`` says
    how they were aligned, how sure that is, what was trimmed. Refused as by `read_log`, and if they do not overlap.
    """
    options = options or LogOptions()
    logs = []
    for path, role in ((mass_log, "mass"), (base_log, "base")):
        with naming(path):
            logs.append(_examined(read_table(open_log(path, options), options, (role,)), options))
    with naming(mass_log, base_log):
        return _recording(logs, options)


def _read_own_times(log: Log, base_time: FloatArray, options: LogOptions) -> Recording:
    """Read a log whose channels have stamps of their own, on one clock; further channels are left out."""
    there, values = np.isfinite(base_time), log.body.values
    logs = []
    for role, column, time, own in (
        ("mass", "time", values["time"], values["mass"]),
        ("base", "base_time", base_time[there], values["base"][there]),
    ):
        columns = {"time": log.columns[column], role: log.columns[role]}
        of_role = replace(log, columns=columns, body=replace(log.body, values={"time": time, role: own}))
        logs.append(_examined(of_role, options, is_whole=False))
    return _recording(logs, options, one_clock=True)


def _examined(log: Log, options: LogOptions, *, is_whole: bool = True) -> SensorLog:
    """Convert a log to SI units, and examine its clock and its values; ``is_whole``: all that its lines hold."""
    clock, values = clock_of(log, options), log.body.values
    if len(clock.stray):
        values = {role: np.delete(column, clock.stray) for role, column in values.items()}
        if is_whole:
            log.set_aside(clock.stray, "the time stamp runs backward")
    log.body.values = {}
    if log.text is not None:
        log.text.content = b""  # as large as the log: not kept while its values are examined
    counts = log.body.counts
    if counts["quarantined"]:
        number, _, reason = log.body.quarantined[0]
        said = f"{counts['quarantined']} of {counts.total()} lines are quarantined; line {number}: {reason}"
        log.warnings.append(said)
    if restarts := log.body.restarts:
        log.warnings.append(
            f"the header is repeated (before line {', '.join(map(str, restarts[:5]))}): the logger was started again "
            f"there; where another test begins, --test 1 to --test {len(restarts) + 1} reads one"
        )
    channels = {role: _channel(log, role, values.pop(role), options) for role in [*values]}
    flag_dead(clock.time, channels)
    for channel in channels.values():
        bridge(clock.time, channel, clock.bridge)
    for place in LASERS:
        lasers = [role for role in channels if role.partition("+")[0] == place]
        if len(lasers) > 1:
            channels[place] = together([channels.pop(role) for role in lasers])
    log.warnings += [*clock.warnings, *(sentence for channel in channels.values() for sentence in channel.warnings)]
    log.evidence += [*clock.evidence, *(sentence for channel in channels.values() for sentence in channel.evidence)]
    return SensorLog(log, clock, channels)


def _channel(log: Log, role: str, values: FloatArray, options: LogOptions) -> Sensed:
    """A channel in SI units: by its calibration, its unit, or the step that shows which laser it is."""
    column, role = log.columns[role], role.partition("+")[0]
    is_laser = role in LASERS
    quantity = "displacement" if is_laser else quantity_named(role)
    a = "a length" if quantity == "displacement" else f"a{'n' * (quantity[0] == 'a')} {quantity}"
    said, per_volt, sign = options.unit_of(role)
    written = "" if column.unit in ("-", "1") else column.unit
    unit = said or written or (options.unit or "" if quantity == "displacement" else "")
    warnings = _without_sentinels(values, role)
    if per_volt is not None:
        if written and written not in VOLTS:
            raise LogError(
                f"column {column} is in {_named(written)}: expected volts, for which the units of {role} say"
                f" {per_volt:g} {unit} each: leave that out"
            )
        values = values * (per_volt / VOLTS.get(written, 1.0))
    # whoever names volts, or the grams of a load, in another unit knows their sensor
    overruled = (*VOLTS, "g") if quantity == "force" else tuple(VOLTS)
    wrong = next((u for u in (unit, written) if u and quantity_of(u) != quantity and not (said and u in overruled)), "")
    if wrong:
        example = f'{role} = "{"5 mm" if is_laser else f"50 {UNIT[quantity]}"}/V"'
        raise LogError(
            f"column {column} is in {_named(wrong)}: expected {a}, one of {', '.join(QUANTITIES[quantity])}: take"
            f" another by --{role.replace('_', '-')}, or correct the unit in the log's head"
            + (f", or give what a volt is, such as {example} in [log.units]" if wrong in VOLTS else "")
            + (f", or if the grams are a load say --units {role}=gf" if wrong == "g" and quantity == "force" else "")
        )
    unknown = column.title.endswith(("]", "}")) and not column.unit  # what stands there is no unit of the table
    if not unit and is_laser and not unknown and (by_step := unit_by_step(values)) is not None:
        unit = by_step[0]
        warnings.append(f"{role}: no unit is said; the sensor's step says {unit} ({by_step[1] * 1e3:g} mm range)")
    if not unit:
        known = UNIT[quantity]
        how = "--unit, such as --unit mm" if is_laser else f'--units {role}={known}, or [log.units] {role} = "{known}"'
        fault = "known" if unknown else "said"
        raise LogError(f"the unit of column {column} is not {fault}: expected {a}: give {how}")
    if per_volt is None and said and written and written != said:
        warnings.append(f"{role}: the log says {written}, the options say {said}: {said} is taken")
    elif per_volt is None and said and unknown:
        warnings.append(f"{role}: the unit in {column.title!r} is not known; the options say {said}, which is taken")
    values = to_si(values, unit) * sign
    sensed = examine(values, role, quantity, measuring_range=options.measuring_range_m, warnings=warnings)
    if is_laser and per_volt is None and sensed.range is None and unit in ("m", "mm", "um"):
        by_step = unit_by_step(values, LENGTH[unit])
        if by_step is not None and by_step[0] != unit:
            sensed.warnings.append(
                f"{role}: {DOUBTED}: the log says {unit}, but its values step like those of a laser in {by_step[0]}"
                f' ({by_step[1] * 1e3:g} mm range): give unit = "{by_step[0]}" in [log] (ingest: --unit), or, if {unit}'
                " is right, measuring_range_m"
            )
    return sensed


def _named(unit: str) -> str:
    """A unit with what it is one of: "kip (force)"."""
    quantity = quantity_of(unit)
    return f"{unit} ({quantity})" if quantity else unit


def _without_sentinels(values: FloatArray, role: str) -> list[str]:
    """Make nan of the numbers by which loggers say "no value" (9999, -9999 ...), where all others are far from them."""
    said = []
    for extreme in (float(np.nanmax(values, initial=-np.inf)), float(np.nanmin(values, initial=np.inf))):
        if abs(extreme) not in _SENTINELS:
            continue
        none = values == extreme
        rest = values[~none & np.isfinite(values)]
        if len(rest) and np.abs(rest - extreme).min() > 0.5 * abs(extreme):
            values[none] = np.nan
            said.append(f"{role}: {np.count_nonzero(none)} values of {extreme:g} say that there is none")
    return said


def _recording(
    logs: Sequence[SensorLog], options: LogOptions, *, still: str = "", one_clock: bool = False
) -> Recording:
    """The recording of one log, or of the mass's and the base's; sentences about one of two begin with its name.

    ``still``: a channel that the log lacks, which stands at 0; ``one_clock``: both are columns of one file.
    """
    first, facts, warnings = logs[0], _facts(logs[0], options), list[str]()
    if len(logs) == 1:
        time = first.clock.time
        quality = np.bitwise_or.reduce([first.clock.quality, *(c.quality for c in first.channels.values())])
        values = {role: sensed.values for role, sensed in first.channels.items()}
        values |= {still: np.zeros(len(time))} if still else {}
    else:
        mass, base = ((each.clock, each.channels[role]) for each, role in zip(logs, ("mass", "base"), strict=True))
        (time, x, y, quality), how, warnings = align(mass, base, options, one_clock=one_clock)
        values = {"mass": x, "base": y}
        of_base = sorted(_facts(logs[1], options).items(), key=lambda fact: fact[0].startswith("base_"))
        facts |= {key if key.startswith("base_") else f"base_log_{key}": value for key, value in of_base} | how
    named = [(f"{each.log.name}: " if len(logs) > 1 else "", each.log) for each in logs]
    lines = (QuarantinedLine(log.name, *line) for _, log in named for line in log.body.quarantined)
    source = Source(
        files=tuple(dict.fromkeys(log.file for _, log in named)),
        dialect=facts,
        options=options.given(),
        quarantined=tuple(dict.fromkeys(lines)),
        warnings=(*dict.fromkeys(name + sentence for name, log in named for sentence in log.warnings), *warnings),
        evidence=tuple(dict.fromkeys(name + sentence for name, log in named for sentence in log.evidence)),
    )
    for array in (time, quality, *values.values()):
        array.flags.writeable = False  # handed over: none of them is copied
    channels = [
        Channel(f"{role}_displacement", of) if role in LASERS else Channel(role, of, first.log.columns[role].title)
        for role, of in values.items()
    ]
    return Recording(time, quality=quality, source=source, channels=channels)


def _facts(sensors: SensorLog, options: LogOptions) -> dict[str, Fact]:
    """How the log was read, key by key, as the recording keeps it."""
    log, clock, text = sensors.log, sensors.clock, sensors.log.text
    facts: dict[str, Fact] = {
        "layout": log.layout.name,
        "encoding": text.encoding if text is not None else "binary",
        "compression": (text.package if text is not None else "") or "none",
        "separator": log.layout.separator,
        "decimal": log.layout.decimal,
        "header_lines": " ".join(str(i + 1) for i in log.layout.header),
        "first_data_line": int(log.body.lines_of(np.zeros(1, np.int64))[0]),
    }
    for role, column in log.columns.items():
        facts |= {f"{role}_column": column.title or str(column.index + 1), f"{role}_column_number": column.index + 1}
    seen = {role: column for role, column in log.columns.items() if role in sensors.channels}
    facts |= {f"{role}_unit": options.unit_of(role)[0] or column.unit for role, column in seen.items()}
    facts |= clock.facts | {"sampling_rate_hz": 1.0 / clock.interval, "bridge_s": clock.bridge}
    facts["missing_samples"] = clock.missing
    for role, channel in sensors.channels.items():
        facts |= {f"{role}_step_m": channel.step} if channel.step else {}
        facts |= {f"{role}_measuring_range_m": channel.range} if channel.range else {}
    return facts
