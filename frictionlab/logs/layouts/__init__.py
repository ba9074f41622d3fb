"""The layouts of logs that are known by name; here they are registered, special ones first.

A layout is a function ``(head, options) -> Layout | None`` that says whether a log is of its kind and, if so, where its
header is, what its columns are and what its preamble states. To add one, write it and add it to `LAYOUTS`.
"""

from collections.abc import Callable

from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.layouts import plain
from frictionlab.logs.layouts.labview import labview
from frictionlab.logs.layouts.layout import Layout
from frictionlab.logs.layouts.ni import ni
from frictionlab.logs.lines import Head

LAYOUTS: tuple[Callable[[Head, LogOptions], Layout | None], ...] = (
    plain.optoncdt,
    labview,
    ni,
    plain.picoscope,
    plain.catman,
    plain.units_row,
    plain.plain,
)


def find_layout(head: Head, options: LogOptions) -> Layout:
    """Give the first layout that recognises a log."""
    for recognise in LAYOUTS:
        layout = recognise(head, options)
        if layout is not None:
            return layout
    raise LogError(f"{head.path.name}: no known layout; expected lines of numbers in columns")
