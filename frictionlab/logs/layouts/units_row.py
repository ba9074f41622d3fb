"""Logs with a row of units below the names: oscilloscopes, servo drives, many loggers."""

from frictionlab.logs.dialect import find_dialect
from frictionlab.logs.layouts.header import find_header
from frictionlab.logs.layouts.layout import Layout
from frictionlab.logs.layouts.plain import layout_of
from frictionlab.logs.lines import Head
from frictionlab.logs.options import LogOptions


def recognise(head: Head, options: LogOptions) -> Layout | None:
    """A row as wide as the data that holds nothing but units."""
    dialect = find_dialect(head.lines, options, head.path.name)
    header = find_header(head.lines, dialect)
    return layout_of("units-row", head, dialect, header) if header.units else None
