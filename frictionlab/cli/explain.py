"""``frictionlab explain``: recording -> which law it requires, as a short text with one figure."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

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
from frictionlab.cli.recordings import rows_told
from frictionlab.schema import COMPARISONS
from frictionlab.tables import Row, check_output, write_rows

if TYPE_CHECKING:
    from frictionlab.scene import Scene

FIGURE = "contact"


@takes(*ANALYSIS)
def explain(
    recordings: Annotated[list[Path], typer.Argument(metavar="RECORDING...", help=RECORDINGS)],
    *,
    scene: SceneFile = None,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write the comparisons here, as compare-numeric does."),
    ] = None,
    as_json: AsJson = False,
    plot: PlotFolder = None,
    settings: Mapping[str, object],
    workers: Workers = None,
    scheduler: Scheduler = None,
    accuracy: Accuracy = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Say which friction law a recording requires, in a dozen lines: values in newtons, and what it does not tell.

    Example: frictionlab explain build/recordings/steel_N1.25_r0.3.h5 --scene configs/sample_data.toml --plot .
    """
    from frictionlab.verbs.inputs import scene_given

    what = scene_given(
        scene_of(scene, accuracy, beside=recordings[0], quiet=quiet), settings, ("model", "analysis", "rig")
    )
    recordings = expanded(recordings, recordings=True)
    plots = figure_places(plot, recordings, (FIGURE,), force=force)
    if output is not None:
        check_output(output, COMPARISONS, force=force, inputs=[*recordings, *what.files])
    rows = rows_told(
        recordings,
        partial(_row, plots=plots, force=force),
        scene=what,
        title="explain",
        as_json=as_json,
        quiet=quiet,
        workers=workers,
        scheduler=scheduler,
        warns=False,  # the text holds them
    )
    if output is not None:
        write_rows(rows, output, COMPARISONS, force=force, inputs=[*recordings, *what.files])
    if not (as_json or quiet):
        _print_texts(rows)
    exit_status(rows)


def _print_texts(rows: Sequence[Row]) -> None:
    """Print what each recording says, an empty line between two."""
    texts = [text for row in rows if isinstance(text := row.get("text"), list)]
    for i, text in enumerate(texts):
        typer.echo("\n".join(([""] if i else []) + [str(line) for line in text]))


def _row(path: Path, *, scene: "Scene", plots: Figures | None, files: Files, force: bool) -> Row:
    from frictionlab.verbs.judging import explain as told_of
    from frictionlab.verbs.presenting import plot

    told = told_of(files.get(path, path), scene)
    if plots is not None and told.contact is not None:
        plot(told.contact, plots[path][FIGURE], title=path.name, force=force)
    return {**told.row(), "source": str(path)}
