"""The layouts of logs that are known by name, and any log that has lines of numbers.

A layout of its own is a function ``(head, options) -> LogLayout | None`` in `LAYOUTS` that says whether a log is of its
kind and, if so, where its header is, what its columns are and what its preamble states.

- sensorTOOL (Micro-Epsilon optoNCDT): one file per sensor, six lines of preamble, padded names; of the two time columns
  the epoch time is taken: it is a number, and it is what two sensors' files have in common
- LabVIEW (.lvm): separator and decimal mark are stated in the file header; a segment header may come again further
  down; a last column of comments may be there or not on each line; ``X_Columns`` says whether time is written once
  (One), for each channel (Multi), or not at all (No; it is then counted by ``Delta_X``)
- NI: rows that begin with a label, a time column per channel
- PicoScope: ``Time,Channel A`` / ``(ms),(V)`` / a blank line; over-range is the infinity sign
- catman ASCII (HBM): TAB, decimal comma, dozens of header lines; names and units stand among other rows
- units row: a row of units below the names (oscilloscopes, servo drives, many loggers)
- plain: a header of names with or without units, comments, whatever separator and decimal mark
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.cells import moment, number, plain
from frictionlab.logs.columns import LogColumn, columns_of, roles_named
from frictionlab.logs.dialect import Dialect, find_dialect, split
from frictionlab.logs.header import (
    LogLayout,
    as_time,
    believable,
    find_header,
    start_in_name,
    stated_facts,
)
from frictionlab.logs.lines import Head
from frictionlab.units import known_unit, split_unit

_BRACKETED = re.compile(r'\s*"?\([^()]*\)"?(\s*[,;\t]\s*"?\([^()]*\)"?)+\s*')
_MANY = 8


def columns_of_text(head: Head, options: LogOptions) -> LogLayout:
    """Read any log that has lines of numbers; the last resort, so it raises where nothing is found."""
    dialect = find_dialect(head.lines, options, head.path.name)
    name, why = _maker(head, dialect)
    header = find_header(head.lines, dialect, deep=name == "catman ASCII")
    name = name or ("units-row" if header.units else "plain")
    if name == "plain" and not header.titles and (options.mass is None or options.base is None):
        _check_names(head, dialect)
    units = "with a units row" if header.units else "without units row"
    named = f"line {header.lines[0] + 1} names the columns, {units}" if header.titles else "no line names the columns"
    again = {head.lines[i].strip() for i in header.lines}
    layout = LogLayout(
        name=name,
        dialect=dialect,
        columns=columns_of(header.titles, header.units, dialect.fields),
        header=header.lines,
        body=header.body,
        facts=stated_facts(head.lines[: header.body], dialect.decimal),
        is_header=lambda line: line in again,
        evidence=(*why, named),
    )
    epoch = [c.index for c in layout.columns if c.name.lower().startswith("epoch")]
    if name != "optoNCDT sensorTOOL" or len(epoch) != 1 or dialect.kinds[epoch[0]] != "n":
        return layout
    return replace(layout, prefer={"time": epoch[0]})


def _maker(head: Head, dialect: Dialect) -> tuple[str, tuple[str, ...]]:
    """Whose program wrote a log, and by what that is seen; "" where it may be any."""
    lines = head.lines
    if any("epoch time" in line.lower() and "distance" in line.lower() for line in lines[:200]):
        start = start_in_name(head.path)
        began = () if start is None else (f"the file's name says it began at {as_time(start)}",)
        return "optoNCDT sensorTOOL", ("columns of epoch time and distance", *began)
    units_below = len(lines) > 3 and _BRACKETED.fullmatch(lines[1]) and not lines[2].strip()
    if units_below and lines[0].lower().lstrip('"').startswith("time"):
        return "PicoScope", ("line 1 names channels, line 2 holds units in brackets, line 3 is blank",)
    above = lines[: dialect.first]
    if any("catman" in line.lower() for line in above):
        return "catman ASCII", ("the header names catman",)
    wide = sum(line.count("\t") == dialect.fields - 1 for line in above)
    if dialect.separator == "\t" and dialect.fields > 1 and wide >= _MANY:
        return "catman ASCII", (f"{wide} header rows as wide as the data",)
    return "", ()


def _check_names(head: Head, dialect: Dialect) -> None:
    """Refuse names that do not fit the numbers below them: most often decimal commas separated by commas."""
    above = [(i, line) for i, line in enumerate(head.lines[: dialect.first]) if line.strip()]
    names = split(above[-1][1], dialect.separator) if above else []
    if roles_named(names) > 1 and len(names) != dialect.fields:
        raise LogError(
            f"{head.path.name}: line {above[-1][0] + 1} names {len(names)} columns, the lines below have "
            f"{dialect.fields} fields: are these decimal commas separated by commas? Export with another separator, or "
            "give --time, --mass and --base by number"
        )


_END = "***End_of_Header***"
_SEPARATORS = {"tab": "\t", "comma": ",", "semicolon": ";"}
_KEYS = frozenset(
    "LabVIEW Measurement|Writer_Version|Reader_Version|Separator|Decimal_Separator|Multi_Headings|X_Columns|Time_Pref|"
    "Operator|Description|Date|Time|Project|Channels|Samples|Y_Unit_Label|X_Unit_Label|X_Dimension|Y_Dimension|X0|"
    "Delta_X|Test_Name|Test_Numbers|Test_Series|UUT_M/N|UUT_S/N|UUT_Name|Model_Number|Serial_Number|Notes|X_Value|"
    f"{_END}".split("|")
)


def labview(head: Head, options: LogOptions) -> LogLayout | None:
    """Begins with ``LabVIEW Measurement`` or holds the end-of-header mark."""
    if not any(line.startswith((_END, "LabVIEW Measurement")) for line in head.lines[:100]):
        return None
    names = next((i for i, line in enumerate(head.lines) if _key(line) == "X_Value"), None)
    if names is None:
        return None
    said = {_key(line): line for line in head.lines[:names]}
    options = _as_stated(options, said)
    found = find_dialect(head.lines[names + 1 :], options, head.path.name)
    dialect = replace(found, first=found.first + names + 1)
    titles = [plain(c) for c in head.lines[names].split(dialect.separator)]
    units = [known_unit(c) for c in said.get("Y_Unit_Label", "").split(dialect.separator)[1:]]
    columns = _labview_columns(titles, units, dialect.fields)
    times = [c.index for c in columns if c.title == "X_Value"]
    return LogLayout(
        name="LabVIEW lvm",
        dialect=dialect,
        columns=columns,
        header=(names,),
        body=names + 1,
        facts=_labview_facts(said, dialect.separator, dialect.decimal),
        time_of=_times_left_of(columns, times) if len(times) > 1 else {},
        is_header=lambda line: _key(line) in _KEYS,
        spare=1 if titles[-1:] == ["Comment"] and len(titles) > dialect.fields else 0,
        evidence=(f"the LabVIEW header states separator and decimal mark; line {names + 1} names the channels",),
    )


def _key(line: str) -> str:
    return line.replace(";", "\t").replace(",", "\t").partition("\t")[0].strip()


def _as_stated(options: LogOptions, said: Mapping[str, str]) -> LogOptions:
    separator = _SEPARATORS.get(said.get("Separator", "").removeprefix("Separator").strip("\t ,;").lower(), "\t")
    decimal = said.get("Decimal_Separator", "").removeprefix("Decimal_Separator").strip("\t ")
    stated = replace(options, separator=options.separator or separator)
    return replace(stated, decimal=options.decimal or (decimal if decimal in (".", ",") else None))


def _labview_columns(titles: list[str], units: list[str], fields: int) -> tuple[LogColumn, ...]:
    """Channels have units in their order; each ``X_Value`` is time in seconds."""
    columns, left = [], list(units)
    for column in columns_of(titles, (), fields):
        if column.title == "X_Value":
            columns.append(replace(column, unit="s"))
        elif column.title == "Comment":
            columns.append(column)
        else:
            unit = left.pop(0) if left else ""
            columns.append(replace(column, unit=column.unit or unit))
    return tuple(columns)


def _times_left_of(columns: Sequence[LogColumn], times: Sequence[int]) -> dict[int, int]:
    """Give each channel the time column to its left."""
    channels = [c.index for c in columns if c.index not in times and any(t < c.index for t in times)]
    return {index: max(t for t in times if t < index) for index in channels}


def _labview_facts(said: Mapping[str, str], separator: str, decimal: str) -> dict[str, float | str]:
    facts: dict[str, float | str] = {}
    cells = said.get("Delta_X", "").split(separator)[1:]
    steps = [n for c in cells if (n := number(c, decimal)) is not None and believable(n)]
    if steps:
        facts["interval_s"] = steps[0]
    date, time = (said.get(key, "").split(separator)[1:2] for key in ("Date", "Time"))
    if date and time and (start := moment(f"{plain(date[0])} {plain(time[0])}")) is not None:
        facts["start_s"] = start
    return facts


_LABELS = ("timestamp", "interval", "channel name", "unit")


def ni(head: Head, options: LogOptions) -> LogLayout | None:
    """Rows labelled ``Channel name`` and ``Interval``."""
    first = [plain(line.split(",")[0].split(";")[0].split("\t")[0]).lower() for line in head.lines[:60]]
    if "channel name" not in first or "interval" not in first:
        return None
    dialect = find_dialect(head.lines, options, head.path.name)
    rows = {
        label: (i, [plain(c) for c in split(head.lines[i], dialect.separator)])
        for i, label in enumerate(first)
        if label in _LABELS and i < dialect.first
    }
    if "channel name" not in rows or "interval" not in rows:
        return None
    names, units = rows["channel name"], rows.get("unit", (0, []))
    columns = _ni_columns(names[1], units[1], dialect.fields)
    header = tuple(sorted({names[0], units[0]} if "unit" in rows else {names[0]}))
    return LogLayout(
        name="NI",
        dialect=dialect,
        columns=columns,
        header=header,
        body=max(i for i, _ in rows.values()) + 1,
        facts=_ni_facts(rows, dialect.decimal),
        time_of=_times_left_of(columns, [c.index for c in columns if c.name == "time"]),
        is_header=lambda line: plain(line.partition(dialect.separator)[0]).lower() in _LABELS,
        evidence=(f"rows labelled {', '.join(rows)}",),
    )


def _ni_columns(names: Sequence[str], units: Sequence[str], fields: int) -> tuple[LogColumn, ...]:
    """A column under a label, or without a name, is time; a label column that the data lacks is left out."""
    if len(names) == fields + 1:
        names, units = names[1:], units[1:]
    columns = []
    for i in range(fields):
        title = names[i] if i < len(names) else ""
        unit = known_unit(units[i]) if i < len(units) else ""
        if title.lower() in ("channel name", ""):
            columns.append(LogColumn(i, "time", "time", "s"))
        else:
            columns.append(replace(LogColumn(i, title, *split_unit(title)), unit=unit or split_unit(title)[1]))
    return tuple(columns)


def _ni_facts(rows: dict[str, tuple[int, list[str]]], decimal: str) -> dict[str, float | str]:
    facts: dict[str, float | str] = {}
    intervals = [n for c in rows["interval"][1][1:] if (n := number(c, decimal)) is not None and believable(n)]
    starts = [m for c in rows.get("timestamp", (0, []))[1][1:] if (m := moment(c)) is not None]
    if intervals:
        facts["interval_s"] = intervals[0]
    if starts:
        facts["start_s"] = starts[0]
    return facts


LAYOUTS: tuple[Callable[[Head, LogOptions], LogLayout | None], ...] = (labview, ni)
"""Before `columns_of_text`, which reads what is left."""


def find_layout(head: Head, options: LogOptions) -> LogLayout:
    """Give the first layout that recognises a log."""
    found = (recognise(head, options) for recognise in LAYOUTS)
    return next((layout for layout in found if layout is not None), None) or columns_of_text(head, options)
