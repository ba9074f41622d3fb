"""PicoScope: ``Time,Channel A`` / ``(ms),(V)`` / a blank line / numbers; over-range is the infinity sign."""

import re
from dataclasses import replace

from frictionlab.logs.dialect import find_dialect
from frictionlab.logs.layouts.header import find_header
from frictionlab.logs.layouts.layout import Layout
from frictionlab.logs.layouts.plain import layout_of
from frictionlab.logs.lines import Head
from frictionlab.logs.options import LogOptions

_UNITS = re.compile(r'\s*"?\([^()]*\)"?(\s*[,;\t]\s*"?\([^()]*\)"?)+\s*')


def recognise(head: Head, options: LogOptions) -> Layout | None:
    """Units in brackets on line 2, then a blank line."""
    if len(head.lines) < 4 or not _UNITS.fullmatch(head.lines[1]) or head.lines[2].strip():
        return None
    if not head.lines[0].lower().lstrip('"').startswith("time"):
        return None
    dialect = find_dialect(head.lines, options, head.path.name)
    layout = layout_of("PicoScope", head, dialect, find_header(head.lines, dialect))
    return replace(layout, evidence=("line 1 names channels, line 2 holds units in brackets, line 3 is blank",))
