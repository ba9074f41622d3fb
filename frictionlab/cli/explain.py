"""``frictionlab explain``: recording -> which law it requires, as a short text with one figure."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from frictionlab.cli.inputs import Files, expanded
from frictionlab.cli.options import ANALYSIS, takes
from frictionlab.cli.output import complain, printable
from frictionlab.cli.work import Work
from frictionlab.schema import COMPARISONS
from frictionlab.tables import Row

if TYPE_CHECKING:
    from frictionlab.cli.drawing import Figures
    from frictionlab.scene import Scene

MOST = 12  # lines, where not all are asked for


@takes(*ANALYSIS)
def explain(recordings: list[Path], *, settings: Mapping[str, object], work: Work) -> None:
    """Say which friction law a recording requires, in a dozen lines: values in newtons, and what is not known.

    Example: frictionlab explain build/recordings/steel_N1.25_r0.3.h5 --scene configs/sample_data.toml --plot .
    """
    scene = work.scene_for(recordings[0], settings, ("model", "analysis", "rig"))
    inputs = expanded(recordings, recordings=True)
    plots = work.places(inputs, scene, COMPARISONS, ("contact",))
    rows, _ = work.rows(inputs, partial(_row, plots=plots, force=work.force), scene, "explain")
    work.write(rows, inputs, scene, COMPARISONS)
    for number, row in enumerate(() if work.as_json else rows):
        text = row.get("text")
        if not isinstance(text, list):
            complain(f"{row['source']}: {row['reason']}")
            continue
        lines = [printable(str(line)) for line in text]
        shown = lines if work.wide or len(lines) <= MOST else lines[: MOST - 1]
        typer.echo("\n".join([*([""] if number else []), *shown]))
        if len(shown) < len(lines):
            typer.echo(f"... {len(lines) - len(shown)} more lines: --wide")
    work.leave(rows)


def _row(path: Path, *, scene: "Scene", plots: "Figures | None", files: Files, force: bool) -> Row:
    from frictionlab.verbs.judging import explain

    told = explain(files.get(path, path), scene)
    if plots is not None and told.contact is not None:
        from frictionlab.verbs.presenting import plot

        plot(told.contact, plots[path]["contact"], title=path.name, force=force)
    return {**told.row(), "source": str(path)}
