"""The time column of a log in seconds, and the one time base made of it.

Unit found or said, what the log states about its clock; restarts, stray and repeated stamps, missing samples, sampling
rate. No stamp is moved unless the clock forces it (it restarted, or it is too coarse to part samples), and then a
warning says so.
"""

import re
from dataclasses import dataclass, field
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray, holes_of, sampling_interval, step_range
from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.dialect import moment, plain
from frictionlab.logs.table import Log
from frictionlab.recording import LATEST_S, Fact, Quality
from frictionlab.units import TIME, to_si

_MOST_STRAY = 0.05
_DOUBTED_HZ = 20_000.0  # of a log shorter than a second: the unit of its time may be wrong
_STATED_TOLERANCE = 1e-4
_SHORTEST_BRIDGE = 3.5
"""Steps: a hole of up to three missing samples is always short."""
_LOW_HZ, _HIGH_HZ = 10.0, 10_000.0
"""Sampling rates that a rig of this kind is logged at; three decades, so that of s, ms and us one fits."""
_EPOCH_S = (1e8, 1e10)
"""Stamps between these [s] count from 1970 (1973 to 2286)."""
_FRACTION = re.compile(r"[.,](\d+)\s*(?:Z|[AaPp]\.?[Mm]\.?)?$")


@dataclass
class Clock:
    """Time (n,) of each sample [s], strictly increasing except where flagged duplicated, and its quality bits (n,).

    ``stray``: indices into the stamps given of samples left out, as they run backward; ``interval`` between samples [s]
    by a straight line through all stamps; ``bridge``: holes up to this long are short [s]; ``missing``: samples in all
    holes; ``written``: the log has stamps, else samples are counted; ``start_s``: the first stamp in seconds since 1970
    UTC (or local midnight), None: not known, ``resolution_s``: how fine.
    """

    time: FloatArray
    quality: NDArray[np.uint8]
    stray: NDArray[np.int64]
    interval: float = 0.0
    bridge: float = 0.0
    missing: int = 0
    warnings: list[str] = field(default_factory=list)
    written: bool = True
    start_s: float | None = None
    resolution_s: float = 0.0
    facts: dict[str, Fact] = field(default_factory=dict)
    evidence: tuple[str, ...] = ()


def time_base(stamps: FloatArray, *, bridge_s: float, stated_s: float | None = None) -> Clock:
    """Make a time base of stamps (n,) [s]; ``stated_s``: the sampling interval that the log states, to be checked.

    Refused are stamps that do not increase, or are beyond all time.
    """
    if len(stamps) and not max(-stamps.min(), stamps.max()) < LATEST_S:
        raise LogError(f"time: expected seconds; got {np.abs(stamps).max():g}: damaged, or in another unit")
    base = Clock(stamps, np.zeros(len(stamps), np.uint8), np.zeros(0, np.int64))
    if len(stamps) > 1 and step_range(stamps)[0] < 0.0:
        stray, restarts = _backward(stamps)
        time = np.delete(stamps, stray)
        base = Clock(time, np.zeros(len(time), np.uint8), stray)
        if len(restarts):  # each part of a clock that restarted follows on the one before, one step later
            steps = np.diff(time)
            step = float(np.median(steps[steps > 0.0]))
            restarts = restarts - np.searchsorted(stray, restarts)
            for i in restarts.tolist():
                time[i:] += time[i - 1] + step - time[i]
            base.quality[restarts] |= np.uint8(Quality.GAP_BEFORE | Quality.NOT_BRIDGED)
            where = ", ".join(f"{time[i]:.6g} s" for i in restarts.tolist()[:5])
            base.warnings.append(
                f"the clock restarted (at {where}; {len(restarts)} in all): what follows is put one step later; how "
                "long the interruption was is not known, and no cycle is cut across it"
            )
    if len(base.time) < 2 or not base.time[-1] > base.time[0]:
        raise LogError("the time stamps do not increase: give --time, or --sampling-rate")
    _flag_holes(base, bridge_s)
    if stated_s is not None and abs(stated_s / base.interval - 1.0) > _STATED_TOLERANCE:
        base.warnings.append(
            f"the log states a sampling interval of {stated_s:.9g} s, its stamps are {base.interval:.9g} s apart: "
            "the stamps are taken"
        )
    return base


def _backward(stamps: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Find stray stamps and restarts of the clock, as indices."""
    stray, restarts = list[int](), list[int]()
    falls = np.flatnonzero(np.diff(stamps) < 0.0) + 1
    if len(falls) > max(5.0, _MOST_STRAY * len(stamps)):
        raise LogError(
            f"the time stamps run backward {len(falls)} times in {len(stamps)} samples: expected increasing "
            "stamps; give --time, or --sampling-rate"
        )
    last = len(stamps) - 1
    for i in falls.tolist():
        if i in stray or i - 1 in stray:
            continue
        if i < last and stamps[i + 1] >= stamps[i - 1]:
            stray.append(i)  # it alone is behind
        elif i > 1 and stamps[i] >= stamps[i - 2]:
            stray.append(i - 1)  # the one before was ahead
        else:
            (stray if i == last else restarts).append(i)
    return np.array(stray, np.int64), np.array(restarts, np.int64)


def _flag_holes(base: Clock, bridge_s: float) -> None:
    base.interval = sampling_interval(base.time)
    base.bridge = max(bridge_s, _SHORTEST_BRIDGE * base.interval)
    smallest, largest = step_range(base.time)
    if smallest > 0.0 and largest <= 1.5 * base.interval:
        return
    steps = np.diff(base.time)
    repeated = steps == 0.0
    coarse = np.count_nonzero(repeated) > 0.1 * len(steps)
    base.resolution_s = float(steps[steps > 0.0].min()) if coarse else 0.0
    holes = holes_of(base.time, base.interval, base.resolution_s)
    if len(holes):
        passed = steps[holes - 1]
        long = holes[passed > base.bridge]
        base.quality[holes] |= np.uint8(Quality.GAP_BEFORE)
        base.quality[long] |= np.uint8(Quality.NOT_BRIDGED)
        base.missing = int(np.maximum(np.rint(passed / base.interval) - 1, 1).sum())
        base.warnings.append(f"{base.missing} samples are missing in {len(holes)} places (flagged gap_before)")
        base.warnings += [
            f"a gap of {steps[i - 1]:.6g} s after {base.time[i - 1]:.6g} s is longer than {base.bridge:.3g} s: no cycle"
            " is cut across it"
            for i in long[:5].tolist()
        ]
    if coarse:  # a straight line through the stamps, between holes
        time = np.empty_like(base.time)
        for part in np.split(np.arange(len(time)), np.flatnonzero(base.quality & np.uint8(Quality.GAP_BEFORE))):
            count = np.arange(len(part)) * base.interval
            time[part] = count + (base.time[part] - count).mean()
        base.time = np.maximum.accumulate(time)
        base.warnings.append(
            f"time stamps are {base.resolution_s:.3g} s coarse, samples {base.interval:.6g} s apart: samples are"
            " counted along a straight line through the stamps"
        )
    elif repeated.any():
        base.quality[1:][repeated] |= np.uint8(Quality.DUPLICATED)
        base.warnings.append(f"{np.count_nonzero(repeated)} time stamps repeat the one before (flagged duplicated)")


def clock_of(log: Log, options: LogOptions) -> Clock:
    """Make the clock of a log, of its stamps or by counting its samples."""
    stated_s, start_s = log.layout.facts.get("interval_s"), log.layout.facts.get("start_s")
    if "time" not in log.columns:
        return _counted(log, options, stated_s, start_s)
    values, column = log.body.values.pop("time"), log.columns["time"]
    first, warnings = float(values[0]), list[str]()
    # what one more in the last digit of a stamp means: 0.001 for 12.345 and 1:02:03.456; doubles show a microsecond
    shown = [plain(row[column.index]) for row in log.rows(50)]
    digits = [len(match[1]) for cell in shown if (match := _FRACTION.search(cell))]
    resolution = 10.0 ** -max(digits, default=0) if shown else 1e-6
    if column.kind == "m":
        cells, start_s = log.layout.example, first
        if first < 172800.0:  # they show no date: it may stand in a column, and midnight passes
            values = values + 86400.0 * np.cumsum(np.append(False, np.diff(values) < -43200.0))
            start_s += next(filter(None, (moment(f"{plain(cell)} 0:00") for cell in cells)), 0.0)
        evidence = ["the time column holds clock times: the first one is 0 in the recording"]
        unit, stamps = "clock time", values - first
    else:
        unit, evidence, warnings = _unit(log, values, options)
        if _EPOCH_S[0] < first / TIME[unit] < _EPOCH_S[1]:
            stamps, start_s, resolution = to_si(values - first, unit), first / TIME[unit], resolution / TIME[unit]
            evidence.append("stamps count from 1970: the first one is 0 in the recording")
        else:
            stamps, resolution = to_si(values, unit), 1e-3
    clock = time_base(stamps, bridge_s=options.bridge_s, stated_s=stated_s)
    clock.warnings[:0] = warnings
    clock.evidence = tuple(evidence)
    clock.start_s, clock.facts, clock.resolution_s = start_s, {"time_unit": unit}, max(resolution, clock.resolution_s)
    if start_s is not None and start_s >= _EPOCH_S[0]:
        clock.facts["start_time"] = datetime.fromtimestamp(start_s, UTC).isoformat(timespec="milliseconds")
    return clock


def _unit(log: Log, values: FloatArray, options: LogOptions) -> tuple[str, list[str], list[str]]:
    """The unit of a numeric time column, as said or by the sampling rate it would mean; evidence; warnings."""
    column, asked = log.columns["time"], options.time_unit
    if asked is not None:
        differs = column.unit not in ("", asked)
        return asked, [], [f"time: the log says {column.unit}, --time-unit says {asked}: {asked} is taken"] * differs
    steps = np.diff(values[:200_000])
    step, length = float(np.median(steps)) or float(np.mean(steps)), float(values[-1] - values[0])
    rates = {unit: TIME[unit] / step if step > 0.0 else 0.0 for unit in TIME}
    if column.unit:
        if column.unit not in TIME:
            raise LogError(f"time column {column} is in {column.unit}: give --time, or --time-unit")
        # doubted where it makes a log far faster and shorter than one of a machine, and seconds would not
        rate, seconds = rates[column.unit], length / TIME[column.unit]
        doubted = rate >= _DOUBTED_HZ and seconds <= 1.0 and _LOW_HZ <= rates["s"] < _HIGH_HZ
        said = (
            f"time: column {column} says {column.unit}: {rate:.6g} samples a second for {seconds:.3g} s; in s it would"
            f' be {rates["s"]:.6g} for {length:.3g} s: if that is so, do: time_unit = "s" in [log] of the scene, or'
            " `frictionlab ingest` with --time-unit s"
        )
        return column.unit, [], [said] if doubted else []
    for unit in ("s", "ms", "us", "ns"):
        if _LOW_HZ <= rates[unit] < _HIGH_HZ:
            unknown = column.title.endswith(("]", "}"))  # what stands there is no unit of the table
            why = f"time: no {'known ' * unknown}unit is said; in {unit} the sampling rate is {rates[unit]:.6g} Hz"
            return unit, [why], [why] if unknown or unit != "s" else []
    raise LogError(f"the unit of time column {column} is not said and its steps of {step:g} fit none: give --time-unit")


def _counted(log: Log, options: LogOptions, stated_s: float | None, start_s: float | None) -> Clock:
    """Time counted at a known interval, for a log without stamps."""
    rate, warnings = options.sampling_rate_hz, list[str]()
    if rate is not None:
        interval, said = 1.0 / rate, f"{rate:g} Hz as given"
        if stated_s is not None and abs(rate * stated_s - 1.0) > _STATED_TOLERANCE:
            warnings.append(f"the log states a sampling interval of {stated_s:.9g} s: {said} is taken")
    elif stated_s is not None:
        interval, said = stated_s, f"{stated_s:.9g} s apart as the log states"
    else:
        in_hz = any(c.unit in ("hz", "khz") for c in log.layout.columns)
        of_drive = "; a table over frequency is for compare-numeric, with amplitude [Y] or phase [deg]" if in_hz else ""
        raise LogError("no time column found: give --time, or --sampling-rate" + of_drive)
    with np.errstate(over="ignore", invalid="ignore"):  # the recording refuses what is not finite
        time = np.arange(log.body.rows, dtype=np.float64) * np.float64(interval)
    return Clock(
        *(time, np.zeros(len(time), np.uint8), np.zeros(0, np.int64)),
        interval=interval,
        bridge=max(options.bridge_s, _SHORTEST_BRIDGE * interval),
        warnings=warnings,
        written=False,
        start_s=start_s,
        facts={"time_unit": "counted"},
        evidence=(f"time is counted: samples {said}",),
    )
