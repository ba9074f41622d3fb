"""Figures: ``draw(result, ax) -> ax``. A figure draws only what a result already holds.

matplotlib is imported by the modules below and nowhere else, always through its object interface: no pyplot, no global
state. Here stands, without it, how a figure of this tool is known again: by who made it, as its file says. So a photo
is never replaced by a plot.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from frictionlab.errors import UsageError
from frictionlab.files import refuse_inputs, refuse_unwritable

FORMATS: Mapping[str, Mapping[str, Any]] = {
    ".pdf": {"metadata": {"CreationDate": None, "Producer": None, "Creator": "frictionlab"}},
    ".svg": {"metadata": {"Date": None, "Creator": "frictionlab"}},
    ".png": {"metadata": {"Software": "frictionlab"}, "pil_kwargs": {"compress_level": 3}},  # 8 % larger, 25 % faster
}
"""Suffix -> how matplotlib writes it; what a file says of itself lacks the time: same figure, same bytes."""
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
    """Refuse, before the work, what is no figure's name, or would replace an input or a file of another kind.

    Raises
    ------
    UsageError
        Of the first of them.
    """
    places = list(paths)
    for path in places:
        if path.suffix not in FORMATS:
            raise UsageError(
                f"{path}: expected a figure ending in .pdf, .svg or .png, or a folder; got {path.suffix!r}"
            )
    refuse_inputs(places, inputs)
    for path in places:
        if path.exists() and not (force or is_figure(path)):
            raise UsageError(f"{path}: exists and is no figure of frictionlab: draw elsewhere, or move it away")
        refuse_unwritable(path, force=force)
