"""Plain text in columns: a header of names with or without units, comments, whatever separator and decimal mark."""

from frictionlab.logs.columns import columns_of
from frictionlab.logs.dialect import find_dialect
from frictionlab.logs.layouts.header import find_header, repeats
from frictionlab.logs.layouts.layout import Layout
from frictionlab.logs.lines import Head
from frictionlab.logs.options import LogOptions


def recognise(head: Head, options: LogOptions) -> Layout | None:
    """Read any log that has lines of numbers; the last resort, so it raises where nothing is found."""
    dialect = find_dialect(head.lines, options, head.path.name)
    header = find_header(head.lines, dialect)
    units = "with a units row" if header.units else "without units row"
    named = f"line {header.lines[0] + 1} names the columns, {units}" if header.titles else "no line names the columns"
    return Layout(
        name="plain",
        dialect=dialect,
        columns=columns_of(header.titles, header.units, dialect.fields),
        header=header.lines,
        body=header.body,
        is_header=repeats(head.lines, header.lines),
        evidence=(named,),
    )
