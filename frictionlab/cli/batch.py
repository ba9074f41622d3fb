"""``frictionlab batch``: a folder of logs through the whole chain; what `make` calls."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from frictionlab.cli.campaign import refuse_failures, write_campaign
from frictionlab.cli.inputs import Rows, exit_status, report_rows
from frictionlab.cli.logs import opened
from frictionlab.cli.options import AsJson, Quiet, SceneFile, Scheduler, Workers, scene_of
from frictionlab.cli.output import complain, printable
from frictionlab.cli.progress import track
from frictionlab.cli.show import show
from frictionlab.errors import UsageError
from frictionlab.schema import COMPARISONS
from frictionlab.tables import Row, check_output
from frictionlab.verbs.rows import FAILED

if TYPE_CHECKING:
    from frictionlab.scene import Scene
    from frictionlab.verbs.chain import Batch

TABLE = "comparisons.jsonl"
NO_SCENE = (
    "no scene: there is no frictionlab.toml in the working folder or beside the logs, and none is given (--scene FILE;"
    " make: SCENE=FILE): all settings are defaults and the rig is not known; `frictionlab init` writes one to fill in"
)


def batch(
    logs: Annotated[list[Path], typer.Argument(metavar="FOLDER_OR_LOG...", help="Logs, folders of them, patterns.")],
    *,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FOLDER", help="Where all results go.")],
    scene: SceneFile = None,
    campaign: Annotated[
        bool, typer.Option("--campaign", help="Measure all tests, then evaluate them together up to report.html.")
    ] = False,
    law: Annotated[
        str | None,
        typer.Option("--law", metavar="LAW", help="With --campaign: as campaign's, a law or auto."),
    ] = None,
    again: Annotated[bool, typer.Option("--again", help="Make everything again, changed or not.")] = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Take logs through the whole chain: recordings, measurements, comparisons, figures; redo only what changed.

    A log that fails is told and the others go on. A log is looked at by its size and the time of its last change.

    Example: frictionlab batch my_logs --scene my_scene.toml -o my_results
    """
    from frictionlab.scene import find_scene
    from frictionlab.verbs.chain import batch as plan

    if law is not None and not campaign:
        raise UsageError("--law: a batch climbs the ladder of laws with --campaign only; compare-numeric does so too")
    what = scene_of(scene, beside=logs[0], quiet=quiet)
    if scene is None and find_scene(logs[0]) is None and not quiet:
        complain(NO_SCENE)
    work = plan(opened(logs), what, output=output, compare=not campaign, again=again)
    _check(work, output, campaign=campaign)
    rows = _do(work, workers=workers, scheduler=scheduler, as_json=as_json, quiet=quiet)
    if campaign:
        _evaluate(work, what, output, law=law, workers=workers, quiet=quiet or as_json)
    else:
        _tell(work, output, quiet=quiet or as_json)
    exit_status(rows)


def _check(work: "Batch", output: Path, *, campaign: bool) -> None:
    """Refuse, before the work, a folder that holds other files where results go."""
    if campaign:
        from frictionlab.campaign.output import check_folder

        check_folder(output, inputs=[*work.logs, *work.chain.scene.files])
    else:
        check_output(output / TABLE, COMPARISONS, inputs=[*work.logs, *work.chain.scene.files])


def _do(work: "Batch", *, workers: int | None, scheduler: str | None, as_json: bool, quiet: bool) -> Rows:
    """Do what is due and tell each log; with --json the rows of all logs, of those that had not changed too."""
    if work.due and not (as_json or quiet):
        typer.echo(f"{' and '.join(_joined(work.chain.steps))}: {len(work.due)} of {len(work.logs)} logs")
    made = work.run(workers=workers, scheduler=scheduler)
    watched = track(made, total=len(work.due), title="batch", quiet=quiet or as_json)
    rows = _in_order(work, watched) if as_json else watched
    return report_rows(rows, as_json=as_json, quiet=quiet)


def _in_order(work: "Batch", made: Iterator[Row]) -> Iterator[Row]:
    """The rows of all logs: what is made now, and in between what stands there already."""
    due = set(work.due)
    for log in work.logs:
        row = next(made) if log in due else work.chain.row(log)
        if row is not None:
            yield row


def _joined(steps: tuple[str, ...]) -> tuple[str, str]:
    return ", ".join(steps[:-1]), steps[-1]


def _tell(work: "Batch", output: Path, *, quiet: bool) -> None:
    """Put all comparisons in one table and show it."""
    from frictionlab.tables import write_rows

    write_rows(work.rows(), output / TABLE)
    if not quiet:
        show(output / TABLE)
        for log in work.logs:
            if (work.chain.row(log) or {"status": FAILED})["status"] == FAILED:
                complain(f"failed: {work.chain.row_file(log)} (the reason stands above)")
        typer.echo(
            printable(f"recordings, measurements, comparisons and figures are in {output}{'/' * bool(output.name)}")
        )


def _evaluate(
    work: "Batch", scene: "Scene", output: Path, *, law: str | None, workers: int | None, quiet: bool
) -> None:
    """Evaluate all tests together, if any of them, the scene, or the law asked for has changed since."""
    from frictionlab.verbs.chain import digest, is_fresh, write_stamp

    rows = work.rows()
    stamp = {
        "rows": digest(rows),
        "law": law,
        "scene": digest(scene.model_dump(mode="json", exclude={"synthetic", "plan"})),
    }
    report, mark = output / "report.html", output / "made.json"
    if not is_fresh(mark, stamp, [report]):
        refuse_failures(rows)
        if not quiet:
            typer.echo(f"evaluate the campaign: {len(rows)} tests")
        folders = [output / "measurements", output / "recordings"]
        write_campaign(rows, scene, output, folders=folders, law=law, workers=workers, quiet=quiet)
        write_stamp(mark, stamp)
    if not quiet:
        typer.echo(printable(f"the report is {report}"))
