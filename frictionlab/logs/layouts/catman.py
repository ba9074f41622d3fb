"""HBM catman ASCII: latin-1, TAB, decimal comma, dozens of header lines; names and units stand among other rows."""

from dataclasses import replace

from frictionlab.logs.dialect import find_dialect
from frictionlab.logs.layouts.header import find_header
from frictionlab.logs.layouts.layout import Layout
from frictionlab.logs.layouts.plain import layout_of
from frictionlab.logs.lines import Head
from frictionlab.logs.options import LogOptions

_MANY = 8


def recognise(head: Head, options: LogOptions) -> Layout | None:
    """The word catman in the first lines, or many rows of words as wide as the data above tabbed numbers."""
    dialect = find_dialect(head.lines, options, head.path.name)
    above = head.lines[: dialect.first]
    named = any("catman" in line.lower() for line in above)
    wide = sum(line.count("\t") == dialect.fields - 1 for line in above)
    if not named and not (dialect.separator == "\t" and dialect.fields > 1 and wide >= _MANY):
        return None
    layout = layout_of("catman ASCII", head, dialect, find_header(head.lines, dialect, deep=True))
    said = "the header names catman" if named else f"{wide} header rows as wide as the data"
    return replace(layout, evidence=(said, *layout.evidence))
