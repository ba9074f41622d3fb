"""Campaign -> tables, figures and report in one folder."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from frictionlab.campaign import Campaign
from frictionlab.campaign.output import REPORT, check_folder, write_tables
from frictionlab.figures.campaign import Plate, plates
from frictionlab.figures.mark import check_figures
from frictionlab.report import write_report
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
    return place / REPORT
