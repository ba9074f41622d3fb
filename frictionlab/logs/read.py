"""From one log, or one log per sensor, to a recording."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError, RecordingError
from frictionlab.log_options import LogOptions
from frictionlab.logs.align import Aligned, align
from frictionlab.logs.channels import SensorLog, absolute, dialect_facts, examined, replaced_samples, with_still_one
from frictionlab.logs.columns import LogColumn, by_option
from frictionlab.logs.lines import Progress
from frictionlab.logs.table import Table, displacements, layout_in, read_table
from frictionlab.recording import Recording, Source
from frictionlab.units import ACCELERATION

_ACCELERATION = re.compile(
    r"(.*[\W_])?(acc|accel|acceleration|accelerometer|beschleunigung)([\W_\d].*)?", re.IGNORECASE
)
_ACCELERATION_UNIT = re.compile(r"m/s\^?2|m/s²|m\*?s\^-2|\[g\]|\(g\)|\bgal\b", re.IGNORECASE)


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
    return _recording(absolute(examined(table, options, roles)), options)


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
    sensors = examined(read_table(path, replace(options, base=None), ("mass",)), options, ("mass",))
    return _recording(with_still_one(sensors, "base"), options)


def read_base_log(path: Path, options: LogOptions | None = None) -> Recording:
    """Read the motion of a base: from a log of both channels, or from one column of any table; the mass stands at 0.

    Raises
    ------
    LogError
        As `read_log`; or the base is given as an acceleration (`read_base_acceleration`).
    """
    options = options or LogOptions()
    if options.base is None and len(displacements(path, options)) > 1:
        return read_log(path, options)
    return _recording(
        with_still_one(examined(read_table(path, options, ("base",)), options, ("base",)), "mass"), options
    )


def read_base_acceleration(path: Path, options: LogOptions | None = None) -> Recording | None:
    """Read the motion of a base that is given as an acceleration; None where it is a displacement.

    The recording's ``base_displacement`` then holds m/s^2: it is for whoever integrates it, and for nobody else.

    Raises
    ------
    LogError
        As `read_log`.
    """
    options = options or LogOptions()
    column = _acceleration_in(path, options)
    if column is None:
        return None
    options = replace(options, base=column.index + 1)
    sensors = examined(read_table(path, options, ("base",)), options, ("base",), accelerations=True)
    return _recording(with_still_one(sensors, "mass"), options)


def _acceleration_in(path: Path, options: LogOptions) -> LogColumn | None:
    """The column of the base's acceleration, where there is no displacement, or where it was named as the base."""
    columns = layout_in(path, options).columns
    if options.base is not None:
        columns = (by_option(columns, options.base, "base", path.name),)
    elif displacements(path, options) and not all(map(_is_acceleration, displacements(path, options))):
        return None
    if options.unit in ACCELERATION and options.base is not None:
        return columns[0]
    return next((column for column in columns if _is_acceleration(column)), None)


def _is_acceleration(column: LogColumn) -> bool:
    return bool(_ACCELERATION.fullmatch(column.name) or _ACCELERATION_UNIT.search(column.title))


def _recording(sensors: SensorLog, options: LogOptions) -> Recording:
    mass, base = sensors.channels["mass"], sensors.channels["base"]
    with _told_of(sensors.table.name):
        return Recording(
            time=sensors.base.time,
            mass_displacement=mass.values,
            base_displacement=base.values,
            quality=sensors.base.quality | mass.quality | base.quality,
            source=Source(
                files=(sensors.table.file,),
                dialect=dialect_facts(sensors, options),
                options=options.given(),
                quarantined=sensors.table.quarantined,
                warnings=tuple(sensors.warnings),
                evidence=tuple(sensors.evidence),
                replaced=replaced_samples(sensors.replaced),
            ),
        )


@contextmanager
def _told_of(log: str) -> Iterator[None]:
    """Say of which log it is what makes no recording."""
    try:
        yield
    except RecordingError as error:
        raise LogError(f"{log}: {error}") from error


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
    mass = examined(read_table(mass_log, one, ("mass",), progress), options, ("mass",))
    base = examined(read_table(base_log, two, ("base",), progress), options, ("base",))
    aligned = _aligned(mass, base, options)
    return _recording_of_two(mass, base, aligned, options)


def _aligned(mass: SensorLog, base: SensorLog, options: LogOptions, *, one_clock: bool = False) -> Aligned:
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
    one, two = examined(mass, options, ("mass",)), examined(base, options, ("base",))
    one, two = (replace(s, table=replace(s.table, file=table.file)) for s in (one, two))  # one file, counted once
    return _recording_of_two(one, two, _aligned(one, two, options, one_clock=True), options)


def _recording_of_two(mass: SensorLog, base: SensorLog, aligned: Aligned, options: LogOptions) -> Recording:
    said = [f"{sensors.table.name}: {sentence}" for sensors in (mass, base) for sentence in sensors.warnings]
    why = [f"{sensors.table.name}: {sentence}" for sensors in (mass, base) for sentence in sensors.evidence]
    facts = dialect_facts(mass, options) | {
        f"base_log_{key}": value for key, value in dialect_facts(base, options).items() if not key.startswith("base_")
    }
    facts |= {key: value for key, value in dialect_facts(base, options).items() if key.startswith("base_")}
    with _told_of(f"{mass.table.name} and {base.table.name}"):
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
