"""Figures: `plot` draws a result, and only what it already holds.

matplotlib is imported by the modules below and nowhere else, always through its object interface: no pyplot, no global
state. Here stands, without it, how a figure of this tool is known again: by who made it, as its file says. So a photo
is never replaced by a plot.
"""

import inspect
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from frictionlab.errors import UsageError
from frictionlab.files import make_folder, refuse_outputs

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    """Refuse (`UsageError`), before the work, no figure's name, an input, or a file of another kind."""
    places = list(paths)
    for path in places:
        if path.suffix not in FORMATS:
            raise UsageError(
                f"{path}: expected a figure ending in .pdf, .svg or .png, or a folder; got {path.suffix!r}"
            )
    refuse_outputs(places, is_figure, "figure of frictionlab", force=force, inputs=inputs)


FIGURES = {
    "Recording": "recorded.recording_figure",
    "Measurement": "recorded.measurement_figure",
    "Comparison": "judged.comparison_figure",
    "ContactForce": "judged.contact_figure",
    "WholeRecord": "recorded.record_figure",
    "StateMap": "grids.state_map_figure",
    "SteadyState": "simulated.motion_figure",
    "RecordResponse": "simulated.response_figure",
    "Prediction": "simulated.prediction_figure",
    "FreeVibration": "recorded.free_vibration_figure",
    "Campaign": "plates.campaign_figure",
}
"""Kind of result -> the function that draws it."""


@overload
def plot(result: object, path: None = None, *, title: str | None = None) -> "Figure": ...
@overload
def plot(result: object, path: str | PathLike[str], *, title: str | None = None, force: bool = False) -> Path: ...
def plot(
    result: object, path: str | PathLike[str] | None = None, *, title: str | None = None, force: bool = False
) -> "Path | Figure":
    """Draw a result: into a file, whose path is returned, or as a figure of matplotlib for a notebook.

    Parameters
    ----------
    result : Recording, Measurement, Comparison, Campaign, SteadyState, RecordResponse, Prediction, FreeVibration, ...
    path : str or Path, optional
        Ends in ``.pdf``, ``.svg`` or ``.png``; its folder is made if it is not there.
    title : str, optional
        Of a measurement's or a record's figure; by default its source.
    force : bool
        Replace whatever file stands there; else only a figure of this tool.

    Raises
    ------
    UsageError
        Another suffix, another kind of result, or a result that holds no motion.
    OutputError
        The file cannot be written, or another kind of file stands there.
    """
    place = None if path is None else Path(path)
    if place is not None and place.suffix not in FORMATS:
        raise UsageError(f"{place}: expected a figure ending in {', '.join(FORMATS)}; got {place.suffix!r}")
    results = list(result) if isinstance(result, (list, tuple)) else [result]
    kind = type(results[0] if results else result).__name__
    if kind not in FIGURES:
        raise UsageError(f"plot: expected one of {', '.join(FIGURES)}; got a {kind}")
    if len(results) > 1 and kind != "FreeVibration":  # the taps of one log are one figure
        raise UsageError(f"plot: expected one {kind}; got {len(results)}: plot each by itself")
    module, _, name = FIGURES[kind].partition(".")
    draw: Callable[..., Figure] = getattr(import_module(f"{__name__}.{module}"), name)
    drawn = results if kind == "FreeVibration" else results[0]
    takes_title = title and len(inspect.signature(draw).parameters) > 1
    figure = draw(drawn, title) if takes_title else draw(drawn)
    if place is None:
        return figure
    from frictionlab.figures.style import save  # noqa: PLC0415 - matplotlib, which a refusal does not need

    make_folder(place.parent)
    return save(figure, place, force=force)
