"""``frictionlab compare-numeric``: measured over predicted."""

from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from frictionlab.cli.budget import Budget, print_budgets
from frictionlab.cli.drawing import Figures, figure_places
from frictionlab.cli.inputs import exit_status
from frictionlab.cli.logs import Files, expanded
from frictionlab.cli.options import (
    ANALYSIS,
    RECORDINGS,
    Accuracy,
    AsJson,
    Force,
    PlotFolder,
    Quiet,
    SceneFile,
    Scheduler,
    Workers,
    scene_of,
    takes,
)
from frictionlab.cli.output import print_good, print_table
from frictionlab.cli.recordings import rows_told
from frictionlab.schema import COMPARISONS, LAWS, RECORD_LAWS
from frictionlab.tables import Row, check_output, write_rows

if TYPE_CHECKING:
    from frictionlab.identification import Comparison, ContactForce, WholeRecord
    from frictionlab.scene import Scene

    Drawable = Comparison | ContactForce | WholeRecord | None

PARAMETERS = {
    "parameter": "parameter",
    "value": "value",
    "se": "se",
    "u": "u",
    "told": "told by this test",
    "lower": "lower 95 %",
    "upper": "upper 95 %",
}
MOVED = {"moved": "moved", "value": "value", "u": "u", "known_to": "known before to"}


@takes(*ANALYSIS)
def compare_numeric(
    recordings: Annotated[list[Path], typer.Argument(metavar="RECORDING...", help=RECORDINGS)],
    *,
    scene: SceneFile = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write here: .csv .jsonl .xlsx .parquet .h5"),
    ] = None,
    as_json: AsJson = False,
    plot: PlotFolder = None,
    law: Annotated[
        str | None,
        typer.Option(
            "--law",
            metavar="LAW",
            help="Contact law, like coulomb+place+speed, or auto: the simplest that the recording requires.",
        ),
    ] = None,
    budget: Budget = False,
    beta: Annotated[
        float | None,
        typer.Option("--beta", min=0.0, help="Predict with this friction ratio instead of identifying it."),
    ] = None,
    whole: Annotated[
        bool,
        typer.Option("--whole", help="Compare the whole record too, from its first sample, under the measured base."),
    ] = False,
    fit: Annotated[
        Literal["cycle", "whole"],
        typer.Option(
            "--fit",
            help="What the law is fitted to: the mean steady cycle, or the whole record (a sweep has no cycle).",
        ),
    ] = "cycle",
    solver: Annotated[
        Literal["auto", "closed-form", "exact", "numeric", "thesis"] | None,
        typer.Option("--solver", help="In place of the scene's."),
    ] = None,
    settings: Mapping[str, object],
    workers: Workers = None,
    scheduler: Scheduler = None,
    accuracy: Accuracy = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Identify the friction, predict the steady cycle with the simulator, and draw measured over predicted.

    Example: frictionlab compare-numeric build/recordings/steel_N1.25_r0.3.h5 --scene configs/sample_data.toml --plot .
    """
    from frictionlab.verbs.inputs import scene_given

    what = scene_given(
        scene_of(scene, accuracy, beside=recordings[0], quiet=quiet),
        {**settings, "solver": solver},
        ("model", "analysis", "rig"),
    )
    check_law(law)
    recordings = expanded(recordings, recordings=True)
    kinds = ("comparison", "contact", *(("record",) if whole or fit == "whole" else ()))
    plots = figure_places(plot, recordings, kinds, force=force)
    if output is not None:
        check_output(output, COMPARISONS, force=force, inputs=[*recordings, *what.files])
    rows = rows_told(
        recordings,
        partial(_row, law=law, beta=beta, plots=plots, whole=whole, fit=fit, force=force),
        scene=what,
        title="compare",
        as_json=as_json,
        quiet=quiet,
        workers=workers,
        scheduler=scheduler,
    )
    if output is not None:
        write_rows(rows, output, COMPARISONS, force=force, inputs=[*recordings, *what.files])
    if not (as_json or quiet):
        _print_parts(print_good(rows, COMPARISONS))
    if budget and not (as_json or quiet):
        print_budgets(rows)
    exit_status(rows)


def check_law(law: str | None) -> None:
    """Refuse a law that does not exist, before the work."""
    from frictionlab.simulator.laws import law_of

    if law is not None and law != "auto":
        law_of(law)


def _print_parts(rows: Iterable[Row]) -> None:
    """Print the parameters of laws beyond Coulomb's, what a whole record moved beside them, and the ladder of laws."""
    for row in rows:
        parameters, laws = row.get("parameters"), row.get("laws")
        if isinstance(parameters, Mapping) and (laws or len(parameters) > 2):
            typer.echo(f"\n{row['source']}: {row['law']}")
            print_table([{"parameter": name, **values} for name, values in parameters.items()], PARAMETERS)
        moved = row.get("nuisances")
        if isinstance(moved, Mapping) and moved and row.get("record_nrmse") is not None:
            typer.echo(f"\n{row['source']}: what the fit moved beside the law (natural frequency and gain: relative)")
            print_table([_moved(name, values) for name, values in moved.items()], MOVED)
        required, record_laws = row.get("cycle_law") or row["law"], row.get("record_laws")
        if isinstance(laws, (list, tuple)):
            typer.echo(f"\n{row['source']}: laws in the order tried; the recording requires {required}")
            print_table(laws, LAWS)
        if isinstance(record_laws, (list, tuple)):
            typer.echo(f"\n{row['source']}: laws tried on the whole record, which requires {row['law']}")
            print_table(record_laws, RECORD_LAWS)


def _moved(name: str, values: Mapping[str, float]) -> Row:
    """One line of what a fit moved; a lag in milliseconds."""
    if name != "lag_s":
        return {"moved": name, **values}
    return {"moved": "lag [ms]", **{key: 1e3 * value for key, value in values.items()}}


def _row(
    path: Path,
    *,
    scene: "Scene",
    law: str | None,
    beta: float | None,
    plots: Figures | None,
    files: Files,
    whole: bool,
    fit: Literal["cycle", "whole"],
    force: bool,
) -> Row:
    from frictionlab.verbs.judging import compare

    comparison = compare(files.get(path, path), scene, law=law, friction_ratio=beta, whole=whole, fit=fit)
    if plots is not None:
        drawn: dict[str, Drawable] = {
            "comparison": comparison if len(comparison.tau) else None,
            "contact": comparison.contact,
            "record": comparison.record,
        }
        for kind, place in plots[path].items():
            _draw(drawn[kind], place, title=None if kind == "comparison" else path.name, force=force)
    return {**comparison.row(), "source": str(path)}


def _draw(result: "Drawable", path: Path, title: str | None, *, force: bool) -> None:
    from frictionlab.verbs.presenting import plot

    if result is not None:
        plot(result, path, title=title, force=force)
