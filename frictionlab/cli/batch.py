"""``frictionlab batch``: a folder of logs through the whole chain; what `make` calls."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from frictionlab.cli.campaign import refuse_failures, write_campaign
from frictionlab.cli.inputs import Rows, exit_status, opened, report_rows
from frictionlab.cli.options import ANALYSIS, check_law, scene_of, takes
from frictionlab.cli.output import complain, print_table, print_tests, print_warnings, printable
from frictionlab.cli.progress import track
from frictionlab.cli.work import COMPARED, MEASURED, assumed, headline
from frictionlab.schema import COMPARISONS, MEASUREMENTS
from frictionlab.tables import Row, check_output, read_rows, write_rows

if TYPE_CHECKING:
    from frictionlab.verbs.chain import Batch

TABLE = "comparisons.jsonl"
NO_SCENE = (
    "no scene: there is no frictionlab.toml in the working folder or beside the logs, and none is given (--scene FILE;"
    " make: SCENE=FILE): all settings are defaults and the rig is not known; `frictionlab init` writes one to fill in"
)


@takes(*ANALYSIS)
def batch(
    logs: list[Path],
    *,
    output: Path | None = None,
    scene: Path | None = None,
    campaign: bool = False,
    law: str | None = None,
    settings: Mapping[str, object],
    again: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    as_json: bool = False,
    wide: bool = False,
    verbose: bool = False,
    quiet: bool = False,
) -> None:
    """Take logs through the whole chain: recordings, measurements, comparisons, figures; redo only what changed.

    A log that fails is a line of the table and the others go on. A log is looked at by its size and the time of its
    last change.

    Example: frictionlab batch my_logs --scene my_scene.toml -o my_results
    """
    from frictionlab.scene import find_scene
    from frictionlab.verbs.chain import batch as plan

    check_law(law)
    what = scene_of(scene, beside=logs[0], quiet=quiet or as_json)
    if scene is None and find_scene(logs[0]) is None and not quiet:
        complain(NO_SCENE)
    output = _beside(logs) if output is None else output
    single = None if campaign else law
    work = plan(opened(logs), what, output=output, compare=not campaign, law=single, again=again, **settings)
    _check(work, output, campaign=campaign)
    rows = _do(work, workers=workers, scheduler=scheduler, as_json=as_json, quiet=quiet)
    if campaign:
        failed = [row for row in work.rows() if row.get("status") != "ok"]
        if failed and not as_json:
            print_tests(work.rows(), MEASURED, headline(work.rows(), "logs measured"))
        _evaluate(work, output, law=law, workers=workers, quiet=quiet or as_json)
    else:
        write_rows([row for row in work.rows() if row.get("status") == "ok"], output / TABLE)
    if not as_json:
        _show(work, rows, output, campaign=campaign, wide=wide)
        if not quiet:
            print_warnings(work.rows(), verbose=verbose, notes=assumed(work.chain.scene, work.rows()))
    exit_status(rows)


def _beside(logs: list[Path]) -> Path:
    """Where results go that nobody named a place for: beside the raw data, not among them."""
    first = logs[0].resolve()
    return Path(f"{first.name if first.is_dir() else first.parent.name}_results")


def _check(work: "Batch", output: Path, *, campaign: bool) -> None:
    """Refuse, before the work, a folder that holds other files where results go."""
    if campaign:
        from frictionlab.campaign.output import check_folder

        check_folder(output, inputs=[*work.logs, *work.chain.scene.files])
    else:
        check_output(output / TABLE, COMPARISONS, inputs=[*work.logs, *work.chain.scene.files])


def _do(work: "Batch", *, workers: int | None, scheduler: str | None, as_json: bool, quiet: bool) -> Rows:
    """Do what is due; with --json the rows of all logs, of those that had not changed too."""
    if work.due and not (as_json or quiet):
        steps = work.chain.steps
        typer.echo(f"{', '.join(steps[:-1])} and {steps[-1]}: {len(work.due)} of {len(work.logs)} logs")
    made = work.run(workers=workers, scheduler=scheduler)
    watched = track(made, total=len(work.due), title="batch", quiet=quiet or as_json)
    return report_rows(_in_order(work, watched) if as_json else watched, as_json=as_json)


def _in_order(work: "Batch", made: Iterator[Row]) -> Iterator[Row]:
    """The rows of all logs: what is made now, and in between what stands there already."""
    due = set(work.due)
    for log in work.logs:
        row = next(made) if log in due else work.chain.row(log)
        if row is not None:
            yield row


def _show(work: "Batch", made: Rows, output: Path, *, campaign: bool, wide: bool) -> None:
    """Print the table of all logs, those that had not changed too, and where the results are."""
    if campaign:
        typer.echo(printable(f"the report is {output / 'report.html'}"))
        return
    failed = {str(row["source"]): row for row in made if row.get("status") != "ok"}
    rows: list[Row] = []
    for log in work.logs:
        row = failed.get(str(log)) or work.chain.row(log)
        if row is not None and row.get("status") == "ok":
            measured = read_rows(work.chain.results(log)["measurement"], MEASUREMENTS)[0]
            row = {**measured, **row}
        rows += [] if row is None else [row]
    good = [row for row in rows if row.get("status") == "ok"]
    if wide and good:
        print_table(good, COMPARISONS)
    print_tests([row for row in rows if not (wide and row in good)], COMPARED, headline(rows, "logs"))
    if good:
        where = f"{output}{'/' * bool(output.name)}"
        typer.echo(printable(f"recordings, measurements, comparisons and figures are in {where}"))


def _evaluate(work: "Batch", output: Path, *, law: str | None, workers: int | None, quiet: bool) -> None:
    """Evaluate all tests together, if any of them, the scene, or the law asked for has changed since."""
    from frictionlab.verbs.chain import NOT_MEASURED_BY, digest, is_fresh, write_stamp

    rows, scene = work.rows(), work.chain.scene
    stamp = {
        "rows": digest(rows),
        "law": law,
        "scene": digest(scene.model_dump(mode="json", exclude=NOT_MEASURED_BY)),
    }
    report, mark = output / "report.html", output / "made.json"
    if is_fresh(mark, stamp, [report]):
        return
    refuse_failures(rows)
    if not quiet:
        typer.echo(f"evaluate the campaign: {len(rows)} tests")
    folders = [output / "measurements", output / "recordings"]
    write_campaign(rows, scene, output, folders=folders, law=law, workers=workers, quiet=quiet)
    write_stamp(mark, stamp)
