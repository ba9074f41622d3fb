"""The layouts of logs that are known by name, each one small module; here they are registered, special ones first.

A layout module has one function, ``recognise(head, options) -> Layout | None``, that says whether a log is of its kind
and, if so, where its header is, what its columns are and what its preamble tells. To add a layout, write its module and
add it to `LAYOUTS`.
"""

from collections.abc import Callable

from frictionlab.errors import LogError
from frictionlab.logs.layouts import catman, labview, ni, optoncdt, picoscope, plain, units_row
from frictionlab.logs.layouts.layout import Layout
from frictionlab.logs.lines import Head
from frictionlab.logs.options import LogOptions

LAYOUTS: tuple[Callable[[Head, LogOptions], Layout | None], ...] = (
    optoncdt.recognise,
    labview.recognise,
    ni.recognise,
    picoscope.recognise,
    catman.recognise,
    units_row.recognise,
    plain.recognise,
)


def find_layout(head: Head, options: LogOptions) -> Layout:
    """Give the first layout that recognises a log."""
    for recognise in LAYOUTS:
        layout = recognise(head, options)
        if layout is not None:
            return layout
    raise LogError(f"{head.path.name}: no known layout; expected lines of numbers in columns")


__all__ = ["LAYOUTS", "Layout", "find_layout"]
