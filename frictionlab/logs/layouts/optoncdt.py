"""Micro-Epsilon sensorTOOL, optoNCDT lasers: one file per sensor, six lines of preamble, padded names, epoch time.

Of the two time columns the epoch time is taken: it is a number, and it is what two sensors' files have in common.
"""

from dataclasses import replace

from frictionlab.logs.dialect import find_dialect
from frictionlab.logs.layouts.header import find_header
from frictionlab.logs.layouts.layout import Layout
from frictionlab.logs.layouts.plain import layout_of
from frictionlab.logs.layouts.preamble import as_time, start_in_name
from frictionlab.logs.lines import Head
from frictionlab.logs.options import LogOptions


def recognise(head: Head, options: LogOptions) -> Layout | None:
    """A column of epoch time beside a column of distance."""
    if not any("epoch time" in line.lower() and "distance" in line.lower() for line in head.lines[:200]):
        return None
    dialect = find_dialect(head.lines, options, head.path.name)
    layout = layout_of("optoNCDT sensorTOOL", head, dialect, find_header(head.lines, dialect))
    epoch = [c.index for c in layout.columns if c.name.lower().startswith("epoch")]
    if len(epoch) != 1 or dialect.kinds[epoch[0]] != "n":
        return layout
    evidence = ["columns of epoch time and distance"]
    start = start_in_name(head.path)
    if start is not None:
        evidence.append(f"the file's name says it began at {as_time(start)}")
    return replace(layout, prefer={"time": epoch[0]}, evidence=(*evidence, *layout.evidence))
