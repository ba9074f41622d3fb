"""``frictionlab compare-numeric``: measured over predicted."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from frictionlab.cli.inputs import exit_status, report_rows
from frictionlab.cli.options import (
    ANALYSIS,
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
from frictionlab.cli.output import print_table
from frictionlab.cli.progress import track
from frictionlab.schema import COMPARISONS
from frictionlab.tables import Row, check_output, write_rows

if TYPE_CHECKING:
    from frictionlab.comparison import Comparison
    from frictionlab.scene import Scene


@takes(*ANALYSIS)
def compare_numeric(
    recordings: Annotated[list[Path], typer.Argument(metavar="RECORDING...", help="Recordings made by ingest.")],
    *,
    scene: SceneFile = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write here: .csv .jsonl .xlsx .parquet .h5"),
    ] = None,
    as_json: AsJson = False,
    plot: PlotFolder = None,
    beta: Annotated[
        float | None,
        typer.Option("--beta", min=0.0, help="Predict with this friction ratio instead of identifying it."),
    ] = None,
    solver: Annotated[
        Literal["auto", "closed-form", "exact", "thesis"] | None,
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
    from frictionlab.verbs.each import rows_of
    from frictionlab.verbs.given import scene_given

    what = scene_given(
        scene_of(scene, accuracy, beside=recordings[0], quiet=quiet),
        {**settings, "solver": solver},
        ("model", "analysis", "rig"),
    )
    job = partial(_row, scene=what, beta=beta, plot=plot)
    if output is not None:
        check_output(output, COMPARISONS, force=force, inputs=recordings)
    made = rows_of(recordings, job, workers=workers, scheduler=scheduler)
    rows = report_rows(track(made, total=len(recordings), title="compare", quiet=quiet), as_json=as_json, quiet=quiet)
    if output is not None:
        write_rows(rows, output, COMPARISONS, force=force, inputs=recordings)
    if not (as_json or quiet):
        print_table([row for row in rows if row["status"] == "ok"], COMPARISONS)
    exit_status(rows)


def _row(path: Path, *, scene: "Scene", beta: float | None, plot: Path | None) -> Row:
    from frictionlab.verbs.compare import compare

    comparison = compare(path, scene, friction_ratio=beta)
    if plot is not None:
        _draw(comparison, plot / f"{path.stem}.comparison.png")
    return {**comparison.row(), "source": str(path)}


def _draw(comparison: "Comparison", path: Path) -> None:
    from frictionlab.verbs.plot import plot

    plot(comparison, path)
