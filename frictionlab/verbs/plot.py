"""A result -> its figure in a file."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from frictionlab.analysis.measurement import Measurement
from frictionlab.base_motion import RecordResponse
from frictionlab.errors import UsageError
from frictionlab.figures.comparison import comparison_figure
from frictionlab.figures.contact import contact_figure
from frictionlab.figures.measurement import measurement_figure
from frictionlab.figures.motion import motion_figure
from frictionlab.figures.plan import plan_figure
from frictionlab.figures.record import record_figure
from frictionlab.figures.response import response_figure
from frictionlab.figures.style import save
from frictionlab.files import make_folder
from frictionlab.identification import Comparison, ContactForce, WholeRecord
from frictionlab.planning import Plan
from frictionlab.simulator import SteadyState
from frictionlab.verbs.given import FilePath

FIGURES: dict[type, Callable[[Any, str | None], Any]] = {
    Measurement: lambda result, title: measurement_figure(result, title or result.source),
    Comparison: lambda result, _title: comparison_figure(result),
    ContactForce: contact_figure,
    WholeRecord: lambda result, title: record_figure(result, title or "whole record"),
    SteadyState: lambda result, _title: motion_figure(result),
    RecordResponse: lambda result, _title: response_figure(result),
    Plan: lambda result, _title: plan_figure(result),
}
SUFFIXES = (".pdf", ".svg", ".png")


def plot(
    result: Measurement | Comparison | ContactForce | WholeRecord | SteadyState | RecordResponse | Plan,
    path: FilePath,
    *,
    title: str | None = None,
    force: bool = False,
) -> Path:
    """Draw a measurement, a comparison, a whole record, a steady state or a response into a file, and return its path.

    Parameters
    ----------
    result : Measurement, Comparison, ContactForce, WholeRecord, SteadyState, RecordResponse or Plan
    path : str or Path
        Ends in ``.pdf``, ``.svg`` or ``.png``; its folder is made if it is not there.
    title : str, optional
        Of a measurement's or a record's figure; by default its source.
    force : bool
        Replace whatever file stands there; else only a figure of this tool.

    Raises
    ------
    UsageError
        Another suffix, another kind of result, or a steady state without a motion.
    OutputError
        The file cannot be written, or another kind of file stands there.
    """
    place = Path(path)
    if place.suffix not in SUFFIXES:
        raise UsageError(f"{place}: expected a figure ending in {', '.join(SUFFIXES)}; got {place.suffix!r}")
    if type(result) not in FIGURES:
        known = ", ".join(kind.__name__ for kind in FIGURES)
        raise UsageError(f"plot: expected one of {known}; got a {type(result).__name__}")
    if isinstance(result, SteadyState) and result.orbit is None:
        raise UsageError(f"{place}: there is no motion to draw (outcome {result.outcome}, solver {result.solver})")
    if isinstance(result, Comparison) and not len(result.tau):
        raise UsageError(f"{place}: there is no steady cycle to draw; do: plot its whole record (comparison.record)")
    make_folder(place.parent)
    save(FIGURES[type(result)](result, title), place, force=force)
    return place
