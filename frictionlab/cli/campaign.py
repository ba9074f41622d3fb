"""``frictionlab campaign``: many measurements -> tables, figures, one report."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

import typer

from frictionlab.cli.inputs import exit_status, tables_in
from frictionlab.cli.options import scene_of
from frictionlab.cli.output import complain, print_table, print_warnings, printable
from frictionlab.cli.progress import track
from frictionlab.errors import AnalysisError, UsageError
from frictionlab.schema import FRICTION, LAW_PARAMETERS, MATERIAL_LAWS, RANKING
from frictionlab.tables import Row
from frictionlab.verbs.rows import FAILED, failure

if TYPE_CHECKING:
    from frictionlab.campaign import Campaign
    from frictionlab.scene import Scene

T = TypeVar("T")


class Watch(Protocol):
    """Wraps a sequence to show progress over it."""

    def __call__(self, items: Sequence[T], /) -> Iterable[T]:
        """The same items, watched."""


def campaign(
    measurements: list[Path],
    output: Path,
    *,
    scene: Path | None = None,
    law: str | None = None,
    workers: int | None = None,
    verbose: bool = False,
    force: bool = False,
    quiet: bool = False,
) -> None:
    """Evaluate a whole campaign: friction per material and force, Amontons' law, ranking, drift, report.

    Example: frictionlab campaign build/measurements/*.jsonl --scene configs/campaign.toml -o build/campaign
    """
    from frictionlab.campaign.output import check_folder

    what = scene_of(scene, beside=measurements[0], quiet=quiet)
    measurements = tables_in(measurements)
    _refuse_recordings(measurements)
    rows, unread = _rows_of(measurements)
    refuse_failures(rows)
    check_folder(output, force=force, inputs=[*measurements, *what.files])
    write_campaign(
        rows,
        what,
        output,
        folders=[path.parent for path in measurements],
        law=law,
        workers=workers,
        force=force,
        quiet=quiet,
    )
    if not quiet:
        print_warnings(rows, verbose=verbose)
    exit_status(unread)


def refuse_failures(rows: Sequence[Row]) -> None:
    """Refuse a campaign without a single measurement: its report would be empty, and take the place of a full one.

    Raises
    ------
    AnalysisError
        As said.
    """
    from frictionlab.campaign.laws import is_comparison

    good = [row for row in rows if row.get("status") != FAILED]
    if not good:
        count = f"all {len(rows)} failed" if rows else "there are none"
        raise AnalysisError(f"campaign: no test to evaluate, {count}: no report is written")
    if all(map(is_comparison, good)):
        raise AnalysisError(
            "campaign: comparisons, and no measurements that they belong to: give what `frictionlab analyze -o` wrote"
            " too: no report is written"
        )


def write_campaign(
    rows: Sequence[Row],
    scene: "Scene",
    output: Path,
    *,
    folders: Sequence[Path],
    law: str | None = None,
    workers: int | None = 1,
    force: bool = False,
    quiet: bool,
) -> None:
    """Evaluate rows of measurements, write tables, figures and report, and print what they say."""
    from frictionlab.verbs.evaluate import evaluate
    from frictionlab.verbs.presenting import publish

    result = evaluate(rows, scene, folders=folders, law=law, workers=workers, watch=_watch("fit", quiet=quiet))
    publish(result, output, force=force, watch=_watch("draw", quiet=quiet))
    if not quiet:
        _tell(result, output)


def _watch(title: str, *, quiet: bool) -> "Watch":
    def watch(items: Sequence[T]) -> Iterable[T]:
        return track(items, total=len(items), title=title, quiet=quiet)

    return watch


def _refuse_recordings(paths: Sequence[Path]) -> None:
    """One sentence for any number of recordings."""
    from frictionlab.campaign.reading import IS_RECORDING
    from frictionlab.hdf5 import is_recording

    found = [path for path in paths if path.is_file() and is_recording(path)]
    if found:
        more = f" and {len(found) - 1} others" if len(found) > 1 else ""
        raise UsageError(f"{found[0]}{more}: {IS_RECORDING}")


def _rows_of(paths: Sequence[Path]) -> tuple[list[Row], list[Row]]:
    """The rows of all files, and the failures of those that cannot be read (they are rows too: none goes missing)."""
    from frictionlab.campaign import read_measurements

    rows: list[Row] = []
    unread: list[Row] = []
    for path in paths:
        try:
            rows += read_measurements(path)
        except Exception as error:  # noqa: BLE001  # a file that cannot be read is a row, whatever the reason
            unread.append(failure(path, error))
            reason = str(unread[-1]["reason"])
            complain(reason if reason.startswith(str(path)) else f"{path}: {reason}")
    return [*rows, *unread], unread


def _tell(result: "Campaign", folder: Path) -> None:
    from frictionlab.campaign.output import friction_row, law_row, parameter_row, ranking_row

    elsewhere = f"the tables in {printable(str(folder))} have"
    print_table([friction_row(fit) for fit in result.fits], FRICTION, elsewhere=elsewhere)
    typer.echo()
    print_table([ranking_row(rank) for rank in result.ranking], RANKING, elsewhere=elsewhere)
    typer.echo()
    if result.laws:
        print_table([law_row(law) for law in result.laws], MATERIAL_LAWS, elsewhere=elsewhere)
        typer.echo()
    if result.parameters:
        print_table([parameter_row(parameter) for parameter in result.parameters], LAW_PARAMETERS)
        typer.echo()
    for test in result.amontons:
        typer.echo(printable(test.verdict))
    for note in result.notes:
        typer.echo(printable(note))
    typer.echo(f"{folder / 'report.html'} shows all results")
