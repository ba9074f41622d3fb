"""How a figure of this tool is known again: by who made it, as its file says; a photo is never replaced by a plot."""

import os
from collections.abc import Iterable
from pathlib import Path

from frictionlab.errors import UsageError
from frictionlab.files import refuse_inputs, refuse_protected

MAKER = "frictionlab"
METADATA = {
    ".pdf": {"CreationDate": None, "Producer": None, "Creator": MAKER},
    ".svg": {"Date": None, "Creator": MAKER},
    ".png": {"Software": MAKER},
}
"""What a file says of itself, without the time: same figure, same bytes."""
_MARKS = {
    ".png": b"tEXtSoftware\0frictionlab",
    ".pdf": b"/Creator (frictionlab)",
    ".svg": b"<dc:title>frictionlab</dc:title>",
}
_LARGEST = 1 << 27


def is_figure(path: Path) -> bool:
    """Whether this file is a figure that this tool has drawn."""
    mark = _MARKS.get(path.suffix)
    if mark is None or not path.is_file() or path.stat().st_size > _LARGEST:
        return False
    return mark in path.read_bytes()


def check_figures(paths: Iterable[Path], *, force: bool = False, inputs: Iterable[Path] = ()) -> None:
    """Refuse figures that would replace a file of another kind or an input, before the work.

    Raises
    ------
    UsageError
        One of them would.
    """
    places = list(paths)
    refuse_inputs(places, inputs)
    for path in places:
        if path.exists() and not (force or is_figure(path)):
            raise UsageError(f"{path}: exists and is no figure of frictionlab: draw elsewhere, or move it away")
        refuse_protected(path, force=force)
        _check_room(path)


def _check_room(path: Path) -> None:
    """Refuse a place where no folder is, nor can be made, or that cannot be written to."""
    above = next(parent for parent in (*path.parents, Path()) if os.path.lexists(parent))
    if not above.is_dir() or not os.access(above, os.W_OK):
        raise UsageError(
            f"{path}: {above} {'cannot be written to' if above.is_dir() else 'is no folder'}: draw elsewhere"
        )
