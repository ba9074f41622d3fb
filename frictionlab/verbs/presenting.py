"""What is shown: a result as a figure, a campaign as tables, figures and report."""

import contextlib
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from frictionlab.errors import AnalysisError, UsageError
from frictionlab.figures import FORMATS, check_figures
from frictionlab.files import make_folder
from frictionlab.verbs.inputs import FilePath, names_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from matplotlib.figure import Figure

    from frictionlab.campaign import Campaign
    from frictionlab.figures.plates import Plate

FIGURES = {
    "Recording": "recorded.recording_figure",
    "Measurement": "recorded.measurement_figure",
    "Comparison": "judged.comparison_figure",
    "ContactForce": "judged.contact_figure",
    "WholeRecord": "recorded.record_figure",
    "SteadyState": "simulated.motion_figure",
    "StructureState": "simulated.structure_figure",
    "RecordResponse": "simulated.response_figure",
    "Plan": "planned.plan_figure",
    "Prediction": "planned.prediction_figure",
    "FreeVibration": "recorded.free_vibration_figure",
    "Campaign": "plates.campaign_figure",
}
"""Kind of result, or of those in a sequence -> the function of `frictionlab.figures` that draws it."""
TITLED = ("Recording", "Measurement", "ContactForce", "WholeRecord", "FreeVibration")
"""Those whose figure takes a title."""


@overload
def plot(result: object, path: None = None, *, title: str | None = None) -> "Figure": ...
@overload
def plot(result: object, path: FilePath, *, title: str | None = None, force: bool = False) -> Path: ...
def plot(
    result: object, path: FilePath | None = None, *, title: str | None = None, force: bool = False
) -> "Path | Figure":
    """Draw a result: into a file, whose path is returned, or as a figure of matplotlib for a notebook.

    Parameters
    ----------
    result : Recording, Measurement, Comparison, Campaign, SteadyState, RecordResponse, Plan, Prediction, ...
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
    figure = _figure_of(result, title)
    if place is None:
        return figure
    from frictionlab.figures.style import save

    make_folder(place.parent)
    save(figure, place, force=force)
    return place


def _figure_of(result: Any, title: str | None) -> "Figure":
    kind = type(result[0] if isinstance(result, (list, tuple)) and result else result).__name__
    if kind not in FIGURES:
        raise UsageError(f"plot: expected one of {', '.join(FIGURES)}; got a {kind}")
    if kind == "StructureState" and result.motion is None:
        raise UsageError(f"plot: there is no motion to draw (outcome {result.outcome})")
    if kind == "SteadyState" and result.orbit is None:
        raise UsageError(f"plot: there is no motion to draw (outcome {result.outcome}, solver {result.solver})")
    if kind == "Comparison" and not len(result.tau) and not result.over_frequency:
        raise UsageError("plot: there is no steady cycle to draw; do: plot its whole record (comparison.record)")
    module, _, name = FIGURES[kind].partition(".")
    draw: Callable[..., Figure] = getattr(import_module(f"frictionlab.figures.{module}"), name)
    return draw(result, title) if title and kind in TITLED else draw(result)


def figure_places(
    plot: Path, inputs: "Sequence[Path]", kinds: "Sequence[str]", *, force: bool = False
) -> dict[Path, dict[str, Path]]:
    """Name the figures of each input (input -> kind -> file) and refuse, before the work, those that cannot be.

    ``plot`` is a folder, or for one input a file: it holds the first kind of figure, the others stand beside it.

    Raises
    ------
    UsageError
        A file for several inputs, a suffix of another kind of file, or a figure that would replace something else.
    """
    if plot.is_dir() or not plot.suffix:
        places = {path: {kind: plot / f"{n}.{kind}.png" for kind in kinds} for path, n in names_of(inputs).items()}
    elif len(inputs) > 1 and plot.suffix in FORMATS:
        raise UsageError(f"--plot {plot}: expected a folder for the figures of {len(inputs)} inputs; got a file's name")
    else:
        beside = {kind: plot.with_name(f"{plot.stem}.{kind}{plot.suffix}") for kind in kinds[1:]}
        places = {inputs[0]: {kinds[0]: plot, **beside}}
    check_figures([file for figures in places.values() for file in figures.values()], inputs=inputs, force=force)
    return places


def publish(
    campaign: "Campaign",
    folder: FilePath,
    *,
    force: bool = False,
    watch: "Callable[[Sequence[Plate]], Iterable[Plate]]" = iter,
) -> Path:
    """Write a campaign's tables, figures and report into a folder, and return the report's path.

    Parameters
    ----------
    campaign : Campaign
    folder : str or Path
        Made if it is not there.
    force : bool
        Replace files of these names that are not an earlier campaign's.
    watch : callable
        Wraps the figures while they are drawn, to show progress.

    Raises
    ------
    OutputError
        The folder cannot be written, or holds other files of these names.
    """
    from frictionlab.campaign.files import REPORT, check_folder, write_tables
    from frictionlab.figures.plates import plates
    from frictionlab.report import write_report

    place = Path(folder)
    check_folder(place, force=force)
    drawn = plates(campaign)
    check_figures([path for plate in drawn for path in plate.files(place / "figures")], force=force)
    write_tables(campaign, place)
    for plate in watch(drawn):
        plate.save(place / "figures", force=force)
    write_report(campaign, drawn, place)
    _write_sheets(campaign, place / "tests", force=force)
    return place / REPORT


def _write_sheets(campaign: "Campaign", folder: Path, *, force: bool) -> None:
    """A page per test, with what its recording shows where that is at hand."""
    from frictionlab.analysis.measure import measure
    from frictionlab.campaign.files import recording_of
    from frictionlab.report.page_of_test import sheet_name, sheets_of, write_sheet

    make_folder(folder)
    for number, sheet in enumerate(sheets_of(campaign), 1):
        recording, page = None if sheet.trial.failed else recording_of(sheet.trial, campaign.folders), sheet
        if recording is not None:
            # measured under another scene, it was possible: the page says that nothing is drawn
            with contextlib.suppress(AnalysisError):
                page = replace(sheet, measurement=measure(recording, campaign.scene), recording=recording)
        write_sheet(page, folder / sheet_name(number, sheet.trial), back="../report.html#tests", force=force)
