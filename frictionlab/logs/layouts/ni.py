"""NI-type CSV: rows that begin with a label (Timestamp, Interval, Channel name, Unit), a time column per channel.

::

    Timestamp,2024-05-01 10:00:00,Timestamp,2024-05-01 10:00:00
    Interval,0.0005,Interval,0.0005
    Channel name,"Mass",Channel name,"Base"
    Unit,"mm",Unit,"mm"
    0,1.25,0,0.5
"""

from collections.abc import Sequence
from dataclasses import replace

from frictionlab.log_options import LogOptions
from frictionlab.logs.cells import moment, number, plain
from frictionlab.logs.columns import LogColumn
from frictionlab.logs.dialect import find_dialect, split
from frictionlab.logs.layouts.layout import Layout
from frictionlab.logs.layouts.preamble import believable
from frictionlab.logs.lines import Head
from frictionlab.units import known_unit, split_unit

_LABELS = ("timestamp", "interval", "channel name", "unit")


def ni(head: Head, options: LogOptions) -> Layout | None:
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
    columns = _columns(names[1], units[1], dialect.fields)
    header = tuple(sorted({names[0], units[0]} if "unit" in rows else {names[0]}))
    return Layout(
        name="NI",
        dialect=dialect,
        columns=columns,
        header=header,
        body=max(i for i, _ in rows.values()) + 1,
        facts=_facts(rows, dialect.decimal),
        time_of=_time_of(columns),
        is_header=lambda line: plain(line.partition(dialect.separator)[0]).lower() in _LABELS,
        evidence=(f"rows labelled {', '.join(rows)}",),
    )


def _columns(names: Sequence[str], units: Sequence[str], fields: int) -> tuple[LogColumn, ...]:
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


def _time_of(columns: Sequence[LogColumn]) -> dict[int, int]:
    """Give each channel the time column to its left."""
    times = [c.index for c in columns if c.name == "time"]
    return {c.index: max(t for t in times if t < c.index) for c in columns if any(t < c.index for t in times)}


def _facts(rows: dict[str, tuple[int, list[str]]], decimal: str) -> dict[str, float | str]:
    facts: dict[str, float | str] = {}
    intervals = [n for c in rows["interval"][1][1:] if (n := number(c, decimal)) is not None and believable(n)]
    starts = [m for c in rows.get("timestamp", (0, []))[1][1:] if (m := moment(c)) is not None]
    if intervals:
        facts["interval_s"] = intervals[0]
    if starts:
        facts["start_s"] = starts[0]
    return facts
