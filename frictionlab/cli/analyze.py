"""``frictionlab analyze``: recording -> measurement."""

from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from frictionlab.cli.budget import Budget, print_budgets
from frictionlab.cli.drawing import Figures, figure_places
from frictionlab.cli.inputs import exit_status
from frictionlab.cli.logs import Files, expanded, result_names
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
from frictionlab.cli.output import print_good
from frictionlab.cli.recordings import rows_told
from frictionlab.schema import MEASUREMENTS
from frictionlab.tables import Row, check_output, write_rows

if TYPE_CHECKING:
    from frictionlab.analysis.measurement import Measurement
    from frictionlab.scene import Scene

FIGURE = "measurement"
SERIES = "series"  # travels with a row from its worker and is taken off before anybody sees the row


@takes(*ANALYSIS)
def analyze(
    recordings: Annotated[list[Path], typer.Argument(metavar="RECORDING...", help=RECORDINGS)],
    *,
    scene: SceneFile = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FILE",
            help="A table: .csv .jsonl .xlsx .parquet, or .h5 with the series.",
        ),
    ] = None,
    as_json: AsJson = False,
    plot: PlotFolder = None,
    report: Annotated[
        Path | None, typer.Option("--report", metavar="FOLDER", help="Write a page of each recording into this folder.")
    ] = None,
    budget: Budget = False,
    settings: Mapping[str, object],
    workers: Workers = None,
    scheduler: Scheduler = None,
    accuracy: Accuracy = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Measure recordings: drive, response, energy per cycle, irregularity, stops, regime, each with its error.

    Example: frictionlab analyze build/recordings/*.h5 --scene configs/sample_data.toml -o build/measurements.csv
    """
    from frictionlab.verbs.inputs import scene_given

    what = scene_given(scene_of(scene, accuracy, beside=recordings[0], quiet=quiet), settings, ("analysis", "rig"))
    recordings = expanded(recordings, recordings=True)
    if output is not None:
        check_output(output, MEASUREMENTS, force=force, inputs=[*recordings, *what.files])
    plots = figure_places(plot, recordings, (FIGURE,), force=force)
    pages = {} if report is None else _pages(report, recordings)
    with_series = output is not None and output.suffix == ".h5"
    series: dict[str, object] = {}
    rows = rows_told(
        recordings,
        partial(_row, plots=plots, pages=pages, force=force, with_series=with_series),
        scene=what,
        title="analyze",
        as_json=as_json,
        quiet=quiet,
        workers=workers,
        scheduler=scheduler,
        sifted=partial(_put_apart, series=series),
    )
    if output is not None:
        write_rows(rows, output, MEASUREMENTS, force=force, inputs=[*recordings, *what.files], series=series)
    if not (as_json or quiet):
        print_good(rows, MEASUREMENTS)
    if budget and not (as_json or quiet):
        print_budgets(rows)
    exit_status(rows)


def _pages(folder: Path, recordings: list[Path]) -> dict[Path, Path]:
    """The page of each recording, under a name that no other has."""
    return {path: folder / f"{name}.html" for path, name in result_names(recordings).items()}


def _row(
    path: Path,
    *,
    scene: "Scene",
    plots: Figures | None,
    pages: Mapping[Path, Path],
    files: Files,
    force: bool,
    with_series: bool,
) -> Row:
    from frictionlab.verbs.measuring import analyze

    file = files.get(path, path)
    measurement = analyze(file, scene)
    if plots is not None:
        _draw(measurement, path, plots[path][FIGURE], force=force)
    if path in pages:
        from frictionlab.verbs.presenting import sheet

        sheet(measurement, file, pages[path], scene, force=force)
    series = {SERIES: _series(measurement)} if with_series else {}
    return {**measurement.row(), "source": str(path), **series}


def _put_apart(rows: Iterable[Row], series: dict[str, object]) -> Iterator[Row]:
    """The rows without their series, which go into the other place under the number of the row."""
    for number, row in enumerate(rows):
        if SERIES in row:
            series[str(number)] = row[SERIES]
        yield {key: value for key, value in row.items() if key != SERIES}


def _draw(measurement: "Measurement", path: Path, figure: Path, *, force: bool) -> None:
    from frictionlab.verbs.presenting import plot

    plot(measurement, figure, title=path.name, force=force)


def _series(measurement: "Measurement") -> dict[str, object]:
    from dataclasses import fields

    import numpy as np

    series = {f.name: np.asarray(getattr(measurement.series, f.name), dtype=float) for f in fields(measurement.series)}
    cycle = {f.name: getattr(measurement.cycle, f.name) for f in fields(measurement.cycle)}
    tree: dict[str, object] = {**series, "mean_cycle": cycle}
    if measurement.trend is not None:
        tree["trend"] = {f.name: getattr(measurement.trend, f.name) for f in fields(measurement.trend)}
    return tree
