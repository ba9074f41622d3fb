"""Campaign -> tables, figures and report in one folder."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from frictionlab.analysis.measure import measure
from frictionlab.campaign import Campaign
from frictionlab.campaign.output import REPORT, check_folder, write_tables
from frictionlab.campaign.responses import recording_of
from frictionlab.errors import AnalysisError
from frictionlab.figures.campaign import Plate, plates
from frictionlab.figures.mark import check_figures
from frictionlab.files import make_folder
from frictionlab.report import write_report
from frictionlab.report.sheet import Sheet, sheet_name, sheets_of, write_sheet
from frictionlab.verbs.given import FilePath


def publish(
    campaign: Campaign,
    folder: FilePath,
    *,
    force: bool = False,
    watch: Callable[[Sequence[Plate]], Iterable[Plate]] = iter,
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


def _write_sheets(campaign: Campaign, folder: Path, *, force: bool) -> None:
    """A page per test, with what its recording shows where that is at hand."""
    make_folder(folder)
    plain = sheets_of(campaign.trials, campaign.verdicts, campaign.comparisons, campaign.scene, campaign.rigs)
    for number, sheet in enumerate(plain, 1):
        path = folder / sheet_name(number, sheet.trial)
        write_sheet(_with_recording(sheet, campaign), path, back="../report.html#tests", force=force)


def _with_recording(sheet: Sheet, campaign: Campaign) -> Sheet:
    recording = None if sheet.trial.failed else recording_of(sheet.trial, campaign.folders)
    if recording is None:
        return sheet
    try:
        measured = measure(recording, campaign.scene)
    except AnalysisError:
        return sheet  # measured under another scene, it was possible: the page says that nothing is drawn
    return replace(sheet, measurement=measured, recording=recording)
