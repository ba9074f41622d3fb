"""``frictionlab sweep``: a map of steady states."""

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from frictionlab.cli import LostOutputError, complain
from frictionlab.cli.options import named_values, values_of
from frictionlab.cli.screen import count
from frictionlab.cli.work import figure_file
from frictionlab.errors import UsageError
from frictionlab.schema import STEADY_STATES
from frictionlab.tables import check_output, json_line

if TYPE_CHECKING:
    from collections.abc import Generator

    import numpy as np

    from frictionlab.maps import Grid, MapWarnings, Step

AXES = ("r", "beta", "mu", "zeta")
MOST_AXES = 2  # of a figure


def sweep(
    *,
    r: str,
    beta: str,
    output: Path,
    law: str | None = None,
    parameter: list[str] | None = None,
    mu: str | None = None,
    zeta: str | None = None,
    wall: Literal["fixed", "base"] = "fixed",
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    as_json: bool = False,
    plot: Path | None = None,
    force: bool = False,
    quiet: bool = False,
) -> None:
    """Map steady states over frequency ratio, friction ratio, static friction, damping and parameters of a law.

    Each takes a list (0.1,0.2), a range with both ends (0.1:0.9:0.1), or one number; so does --parameter, as in
    --parameter gradient=0:0.1:0.02. A range may go by a factor: stiffness_ratio=10:1e6:x10. What is solved is saved as
    it goes; --resume continues after Ctrl-C or a power cut and ends in the same file.

    Example: frictionlab sweep --r 0.02:2.5:0.01 --beta 0.1:0.9:0.1 -o map.h5
    """
    from frictionlab import maps

    said = named_values(parameter, {"mu": mu, "zeta": zeta})
    four = zip(AXES, (r, beta, mu or "1", zeta or "0"), strict=True)
    axes = {name: tuple(values_of(text, f"--{name}")) for name, text in four}
    more = tuple((name, tuple(values_of(text, f"--parameter {name}"))) for name, text in said.items())
    grid = maps.Grid(axes["r"], axes["beta"], axes["mu"], axes["zeta"], wall, law or "coulomb", more)
    check_output(output, STEADY_STATES, force=force, rows=len(grid))
    figure = figure_file(plot, "map", force=force)
    columns = {} if figure is None else _columns(grid, figure)
    steps = maps.make_map(grid, output, workers=workers, scheduler=scheduler, resume=resume, force=force)
    outcomes, warned = _follow(grid, steps, output, columns, as_json=as_json, quiet=quiet)
    if not (as_json or quiet):
        told = ", ".join(f"{number} {outcome}" for outcome, number in outcomes.most_common())
        typer.echo(f"{len(grid)} steady states ({told}) are in {output}")
    if figure is not None:
        _draw(grid, columns, warned, figure, force=force)
    if outcomes[maps.FAILED]:
        raise typer.Exit(1)


def _follow(
    grid: "Grid",
    steps: "Generator[Step]",
    output: Path,
    columns: "dict[str, np.ndarray]",
    *,
    as_json: bool,
    quiet: bool,
) -> "tuple[Counter[str], MapWarnings]":
    """Print each step as it comes and keep what is drawn; return how many points have which outcome, and warnings."""
    from frictionlab import maps

    outcomes: Counter[str] = Counter()
    warned = maps.MapWarnings()
    done = 0
    try:
        with count("sweep", quiet=quiet) as progress:
            for step in steps:
                done = step.done
                for row in maps.rows(grid, step) if as_json else ():
                    typer.echo(json_line(row))
                for sentence in maps.faults(grid, step):
                    complain(sentence)
                outcomes.update(step.records["outcome"].astype(str).tolist())
                warned.add(grid, step.start, step.records["warnings"])
                for key, column in columns.items():
                    column[step.start : step.done] = step.records[key]
                if progress is not None:
                    progress(step.done, step.total)
    except (KeyboardInterrupt, LostOutputError) as error:
        steps.close()  # which saves what is solved
        why = "note: standard output takes no more" if isinstance(error, LostOutputError) else "stopped"
        complain(f"{why}: {done} of {len(grid)} points are saved beside {output}: give --resume to continue")
        raise
    for sentence in () if as_json or quiet else warned.sentences():
        complain(f"warning: {sentence}")
    return outcomes, warned


def _columns(grid: "Grid", figure: Path) -> "dict[str, np.ndarray]":
    """Empty columns for what is drawn, and for the outcomes; refuses a map of too many axes before the work."""
    import numpy as np

    from frictionlab.figures.grids import PANELS, varying

    axes = varying(grid.axes())
    if len(axes) > MOST_AXES:
        raise UsageError(
            f"--plot {figure}: expected one or two axes with several values; got {', '.join(axes)}: draw a map"
            " of fewer axes, or leave --plot out"
        )
    return {key: np.full(len(grid), np.nan) for key in PANELS} | {"outcome": np.zeros(len(grid), dtype="S10")}


def _draw(grid: "Grid", columns: "dict[str, np.ndarray]", warned: "MapWarnings", place: Path, *, force: bool) -> None:
    from frictionlab.figures.grids import PANELS, STOPS, StateMapDrawing, varying
    from frictionlab.figures.style import AT_REST
    from frictionlab.verbs.presenting import plot

    axes = varying(grid.axes())
    columns[STOPS][columns["outcome"] == b"stuck"] = AT_REST
    drawn = {key: columns[key].reshape([len(along) for along in axes.values()]) for key in PANELS}
    fixed = [f"{name} = {along[0]:g}" for name, along in grid.axes().items() if name not in axes]
    title = ", ".join([grid.law, f"wall {grid.wall}", *fixed])
    plot(StateMapDrawing(axes, drawn, title, tuple(warned.sentences())), place, force=force)
