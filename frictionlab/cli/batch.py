"""``frictionlab batch``: a folder of logs through the whole chain; ``frictionlab campaign``: many tests, one report."""

from collections.abc import Iterable, Sequence
from fnmatch import fnmatch
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from frictionlab.cli import complain, printable, screen
from frictionlab.cli.options import AnalysisSettings, Inputs, check_law, scene_of
from frictionlab.errors import AnalysisError
from frictionlab.schema import COMPARISONS, FRICTION, GRAVE, MATERIAL_LAWS, MEASUREMENTS, with_error
from frictionlab.tables import Row, check_output, read_rows, write_rows
from frictionlab.tables.texts import few_of, kinds_of
from frictionlab.verbs.inputs import failure, files_of, tables_in

if TYPE_CHECKING:
    from frictionlab.campaign import Campaign
    from frictionlab.scene import Scene
    from frictionlab.verbs.chain import Batch

TABLE = "comparisons.jsonl"
FEW = 3  # tests left out, up to which each is named
NO_SCENE = (
    "no scene: there is no frictionlab.toml in the working folder or beside the input, and none is given (--scene FILE;"
    " make: SCENE=FILE): all settings are defaults and the rig is not known; `frictionlab init` writes one to fill in"
)


def batch(
    logs: list[Path],
    *,
    output: Path | None = None,
    campaign: bool = False,
    law: str | None = None,
    settings: AnalysisSettings,
    again: bool = False,
    wide: bool = False,
    work: Inputs,
) -> None:
    """Take logs through the whole chain: recordings, measurements, comparisons, figures; redo only what changed.

    A log that fails is a line of the table and the others go on. A log is looked at by its size and the time of its
    last change.

    Example: frictionlab batch my_logs --scene my_scene.toml -o my_results
    """
    from frictionlab.scene.text import RESULTS
    from frictionlab.verbs.chain import batch as plan

    check_law(law)
    scene = work.scene_for(logs[0], {}, ())
    if not (scene.files or work.quiet):
        complain(NO_SCENE)
    if output is None:  # beside the raw data, not among them
        raw = logs[0].resolve() if logs[0].is_dir() else logs[0].resolve().parent
        output = Path(".." if raw == Path.cwd() else "") / f"{raw.name}{RESULTS}"
    single = None if campaign else law
    todo = plan(files_of(logs), scene, output=output, compare=not campaign, law=single, again=again, **settings)
    work.note_not_read(logs, scene)
    for copy, log in () if work.quiet or work.as_json else todo.copies.items():
        complain(f"note: {copy.name} is the same as {log.name}, byte for byte: it is counted once")
    others = sorted({stamp.stem for stamp in (output / "made").glob("*.json")} - {*todo.names.values()})
    if others and not (work.quiet or work.as_json):
        names = few_of(others)
        complain(f"note: {output} has results of logs that are not given ({names}): if they were renamed, remove these")
    _check(todo, campaign=campaign)
    made = _do(todo, work)
    rows = todo.rows()
    good = [row for row in rows if row.get("status") == "ok"]
    if campaign:
        if 0 < len(good) < len(rows) and not work.as_json:
            typer.echo(screen.headline(rows, "logs measured"))
            screen.print_tests([row for row in rows if row.get("status") != "ok"], screen.MEASURED, "")
        if made.ended:  # a report of the tests done until then would look like one of all
            complain("the campaign is not evaluated: the same command goes on from here")
        else:
            _evaluate(todo, rows, law, work, again=again)
    else:
        if not work.as_json:
            _show(todo, made, law, wide=wide)
        write_rows(good, output / TABLE)
    if not (work.as_json or work.quiet):
        screen.print_warnings(rows, verbose=work.verbose, notes=screen.assumed(todo.scene, rows))
    broken_off = todo.scene.experiment.broken_off  # that such a test failed is no fault
    made[:] = [row for row in made if not any(fnmatch(Path(str(row["source"])).name, some) for some in broken_off)]
    screen.exit_status(made)


def _check(todo: "Batch", *, campaign: bool) -> None:
    """Refuse, before the work, a frame of several masses, and a folder that holds other files where results go."""
    read = [*todo.logs, *todo.scene.files]
    if not campaign:
        check_output(todo.folder / TABLE, COMPARISONS, inputs=read)
        return
    from frictionlab.campaign.files import check_folder
    from frictionlab.inference.observations import refuse_several

    refuse_several(todo.scene)
    check_folder(todo.folder, inputs=read)


def _do(todo: "Batch", work: Inputs) -> screen.Rows:
    """Do what is due; with --json the rows of all logs, of those that had not changed too."""
    quiet = work.as_json or work.quiet
    if todo.due and not quiet:
        typer.echo(f"{', '.join(todo.steps[:-1])} and {todo.steps[-1]}: {len(todo.due)} of {len(todo.logs)} logs to do")
    made = todo.each(workers=work.workers, scheduler=work.scheduler)
    if not work.as_json:
        return screen.report_rows(screen.track(made, total=len(todo.due), title="batch", quiet=quiet), as_json=False)
    due = set(todo.due)
    every = (next(made) if log in due else todo.row(log) for log in todo.logs)
    return screen.report_rows((row for row in every if row is not None), as_json=True)


def _show(todo: "Batch", made: screen.Rows, law: str | None, *, wide: bool) -> None:
    """Print the table of all logs, those that had not changed too, and where the results are."""
    from frictionlab.verbs.chain import stamp_at

    failed = {str(row["source"]): row for row in made if row.get("status") != "ok"}
    rows: list[Row] = []
    for log in todo.logs:
        row = failed.get(str(log)) or todo.row(log)
        if row is not None and row.get("status") == "ok":
            row = {**read_rows(todo.results(log)["measurement"], MEASUREMENTS)[0], **row}
        rows += [] if row is None else [row]
    good = [row for row in rows if row.get("status") == "ok"]
    screen.print_tests(rows, screen.COMPARED, screen.headline(rows, "logs"), COMPARISONS if wide else None)
    if good:
        where = f"{todo.folder}{'/' * bool(todo.folder.name)}"
        typer.echo(printable(f"recordings, measurements, comparisons and figures are in {where}"))
    is_other = todo.due or stamp_at(todo.folder / "made.json").get("law") != law
    if is_other and (todo.folder / "report.html").exists():
        complain(f"note: report.html, friction.csv, laws in {todo.folder} are of an earlier run: add --campaign")


def _evaluate(todo: "Batch", rows: Sequence[Row], law: str | None, work: Inputs, *, again: bool) -> None:
    """Evaluate all tests together, if any of them, the scene, or the law asked for has changed since, or ``again``."""
    from frictionlab.verbs.chain import digest, made_by, stamp_at, write_stamp

    stamp: Row = {"rows": digest(rows), "law": law, "scene": made_by(todo.scene)}
    report, mark, quiet = todo.folder / "report.html", todo.folder / "made.json", work.quiet or work.as_json
    made = stamp_at(mark)
    if again or not report.exists() or made != {**stamp, "said": made.get("said")}:
        if not quiet:
            typer.echo(f"evaluate the campaign: {len(rows)} tests")
        folders = [todo.folder / "measurements", todo.folder / "recordings"]
        result = _write_campaign(
            rows, todo.scene, todo.folder, folders=folders, law=law, workers=work.workers, quiet=quiet
        )
        made = {**stamp, "said": _said(result)}
        write_stamp(mark, made)
    if not work.as_json:
        _print_campaign(todo.folder, made["said"], quiet=quiet)


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
    from frictionlab.campaign.files import check_folder, read_measurements
    from frictionlab.verbs.evaluate import recordings_beside

    what = scene_of(scene, beside=measurements[0], quiet=quiet)
    paths = files_of(measurements, tables_in)
    rows: list[Row] = []
    unread: list[Row] = []
    for path in paths:
        try:
            rows += read_measurements(path)
        except Exception as error:  # noqa: BLE001  # a file that cannot be read is a row, whatever the reason
            unread.append(failure(path, error))
    for source, reason in ((str(row["source"]), str(row["reason"])) for row in unread if rows):
        complain(reason if reason.startswith(source) else f"{source}: {reason}")
    rows += unread
    check_folder(output, force=force, inputs=[*paths, *what.files])
    folders = [place for path in paths for place in recordings_beside(path)]
    result = _write_campaign(rows, what, output, folders=folders, law=law, workers=workers, force=force, quiet=quiet)
    if not (what.files or quiet):
        complain(NO_SCENE)
    _print_campaign(output, _said(result), quiet=quiet)
    if not quiet:
        screen.print_warnings(rows, verbose=verbose)
    screen.exit_status(unread)


def _write_campaign(
    rows: Sequence[Row], scene: "Scene", output: Path, *, force: bool = False, quiet: bool, **asked: Any
) -> "Campaign":
    """Evaluate rows of measurements, as ``evaluate`` is asked to, and write tables, figures and report.

    Where all tests failed none is written: an empty report would take the place of a full one.
    """
    from frictionlab.verbs.evaluate import evaluate, publish

    fitting, drawing = (partial(screen.track, title=title, quiet=quiet) for title in ("fit", "draw"))
    result = evaluate(rows, scene, watch=fitting, **asked)
    if len(result.failures) == len(result.trials):
        kinds = kinds_of((trial.source, str(trial.reason)) for trial in result.failures)
        reasons = "; ".join(f"{reason} ({screen.counted(len(where), 'test')})" for reason, where in kinds)
        raise AnalysisError(f"campaign: all {len(result.trials)} tests failed: {reasons}: no report is written")
    publish(result, output, force=force, watch=drawing)
    return result


def _said(result: "Campaign") -> list[str]:
    """What is said of a campaign below its tables: who ranks where, what of Amontons' law, and what is doubtful."""
    placed = [rank for rank in result.ranking if rank.rank is not None] if len(result.materials) > 1 else []
    orders = [
        f"by {criterion}: {', '.join(f'{r.rank} {r.material}' for r in placed if r.criterion == criterion)}"
        for criterion in dict.fromkeys(rank.criterion for rank in placed)
    ]
    slopes = [
        f"drift of {printable(Path(d.trial.source).stem)}: {with_error(d.relative.value, d.relative.error, 100.0)} %/h"
        f" of the energy, {d.note if d.relative.value is None else d.verdict}"
        for d in result.drifts
    ]
    notes = [(f"{fit.material} at {fit.normal_force_n:.4g} N", str(fit.note)) for fit in result.fits if fit.note]
    doubts = [note for note in result.notes if GRAVE.search(note)]
    doubts += [f"{note} ({', '.join(where)})" for note, where in kinds_of(notes)]
    out = [v for fit in result.fits for v in fit.verdicts if v.excluded is not None and not v.trial.is_long]
    doubts += [f"{Path(v.trial.source).stem} is left out: {v.excluded}" for v in out if len(out) <= FEW]
    return [*orders, *slopes, *(test.verdict for test in result.amontons), *(f"! {note}" for note in doubts)]


def _print_campaign(folder: Path, said: Iterable[str], *, quiet: bool) -> None:
    """Print friction by material and force, and the laws tried; unless ``quiet``, what is said of them."""
    screen.print_table(read_rows(folder / "friction.csv", FRICTION), screen.FITTED)
    if laws := read_rows(folder / "laws.csv", MATERIAL_LAWS):
        typer.echo()
        screen.print_table(laws, MATERIAL_LAWS)
    if not quiet:
        for sentence in said:
            screen.paragraph(sentence, indent="  ")
        typer.echo(printable(f"the report is {folder / 'report.html'}"))
