"""``frictionlab simulate --all``: every steady state that motions from many starts settle on."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from frictionlab.cli.drawing import figure_file
from frictionlab.cli.inputs import numbers_of, tell_warnings
from frictionlab.cli.output import print_turned
from frictionlab.errors import UsageError
from frictionlab.files import make_folder
from frictionlab.schema import MOTIONS
from frictionlab.tables import Row, check_output, json_line, write_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frictionlab.simulator import Attractor, Problem

All = Annotated[
    bool,
    typer.Option(
        "--all", help="All steady states that 200 starts (numeric laws: 50) settle on, with their shares (basin_share)."
    ),
]


def print_all(
    problem: "Problem", output: Path | None, plot: Path | None, *, force: bool, as_json: bool, quiet: bool
) -> None:
    """Find, print, write and draw them: one row each, the most visited first."""
    from frictionlab.simulator.coexisting import coexisting

    plot = figure_file(plot, "coexisting", force=force)
    if output is not None:
        check_output(output, MOTIONS, force=force)
        if output.suffix == ".h5":
            raise UsageError(f"{output}: --all gives rows without motions; expected .csv, .jsonl, .xlsx or .parquet")
    start = time.perf_counter()
    found = coexisting(problem)
    asked = {"wall_s": time.perf_counter() - start, "law": problem.law.name, "parameters": problem.parameters}
    rows: list[Row] = [each.state.row() | asked | {"basin_share": each.share} for each in found]
    for row in rows if as_json else ():
        typer.echo(json_line(row))
    if not (as_json or quiet):
        print_turned(map(numbers_of, rows), MOTIONS)
        for each in found:
            typer.echo(f"{each.share:.3g} of the starts: {each.state.verdict}")
        told = dict.fromkeys(said for each in found for said in each.state.warnings if said not in each.state.verdict)
        tell_warnings({"warnings": list(told)})
    if output is not None:
        write_rows(rows, output, MOTIONS, force=force)
    if plot is not None:
        _draw(found, plot, force=force)


def _draw(found: "Sequence[Attractor]", path: Path, *, force: bool) -> None:
    from frictionlab.figures.coexisting import coexisting_figure
    from frictionlab.figures.style import save

    make_folder(path.parent)
    save(coexisting_figure(found), path, force=force)
