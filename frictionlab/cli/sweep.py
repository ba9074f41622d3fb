"""``frictionlab sweep``: a map of steady states."""

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import typer

from frictionlab.cli.drawing import figure_file
from frictionlab.cli.inputs import STOPPED
from frictionlab.cli.options import named_values, values_of
from frictionlab.cli.output import complain
from frictionlab.cli.progress import count
from frictionlab.cli.standard_output import LostOutputError
from frictionlab.errors import UsageError
from frictionlab.files import make_folder
from frictionlab.schema import STEADY_STATES
from frictionlab.tables import check_output, json_line

if TYPE_CHECKING:
    from collections.abc import Generator

    from frictionlab.figures.map import StateMapDrawing
    from frictionlab.maps import Grid, Step

AXES = ("r", "beta", "mu", "zeta")
VALUES = "START:STOP:STEP"
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
    grid = maps.Grid(**axes, wall=wall, law=law or "coulomb", parameters=more)
    check_output(output, STEADY_STATES, force=force, rows=len(grid))
    picture = None if plot is None else _MapPicture(grid, plot, force=force)
    steps = maps.make_map(grid, output, workers=workers, scheduler=scheduler, resume=resume, force=force)
    outcomes = _follow(grid, steps if picture is None else picture.seen(steps), output, as_json=as_json, quiet=quiet)
    if not (as_json or quiet):
        told = ", ".join(f"{number} {outcome}" for outcome, number in outcomes.most_common())
        typer.echo(f"{len(grid)} steady states ({told}) are in {output}")
    if picture is not None:
        picture.draw()
    if outcomes[maps.FAILED]:
        raise typer.Exit(1)


def _follow(grid: "Grid", steps: "Generator[Step]", output: Path, *, as_json: bool, quiet: bool) -> "Counter[str]":
    """Print each step of the sweep as it comes; return how many points have which outcome."""
    from frictionlab import maps

    outcomes: Counter[str] = Counter()
    warned = maps.Warned()
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
                if progress is not None:
                    progress(step.done, step.total)
    except KeyboardInterrupt:
        _leave(steps, f"stopped: {done} of {len(grid)} points are saved beside {output}")
        raise typer.Exit(STOPPED) from None
    except LostOutputError:
        _leave(steps, f"note: standard output takes no more: {done} of {len(grid)} points are saved beside {output}")
        raise
    for sentence in () if as_json or quiet else warned.sentences():
        complain(f"warning: {sentence}")
    return outcomes


def _leave(steps: "Generator[Step]", words: str) -> None:
    """Save what is solved, and say what to do with it."""
    steps.close()
    complain(f"{words}: give --resume to continue")


class _MapPicture:
    """A figure of a map to be: refuses what cannot be drawn before the work, remembers what is drawn.

    Raises
    ------
    UsageError
        No figure's suffix, another kind of file stands there, or more than two axes vary.
    """

    def __init__(self, grid: "Grid", plot: Path, *, force: bool) -> None:
        import numpy as np

        from frictionlab.figures.map import PANELS, varying
        from frictionlab.maps import Warned

        path = figure_file(plot, "map", force=force) or plot
        self.axes = varying(grid.axes())
        if len(self.axes) > MOST_AXES:
            raise UsageError(
                f"--plot {path}: expected one or two axes with several values; got {', '.join(self.axes)}: draw a map"
                " of fewer axes, or leave --plot out"
            )
        self._grid, self._path, self._force = grid, path, force
        self._warned = Warned()
        self._columns = {key: np.full(len(grid), np.nan) for key in PANELS}

    def seen(self, steps: "Generator[Step]") -> "Generator[Step]":
        """The same steps, remembered."""
        from frictionlab.figures.map import STOPS
        from frictionlab.figures.stops import AT_REST

        for step in steps:
            for key, column in self._columns.items():
                column[step.start : step.done] = step.records[key]
            resting = step.records["outcome"] == b"stuck"
            self._columns[STOPS][step.start : step.done][resting] = AT_REST
            self._warned.add(self._grid, step.start, step.records["warnings"])
            yield step

    def draw(self) -> None:
        """Draw what was seen."""
        from frictionlab.figures.map import map_figure
        from frictionlab.figures.style import save

        make_folder(self._path.parent)
        save(map_figure(self._drawing()), self._path, force=self._force)

    def _drawing(self) -> "StateMapDrawing":
        from frictionlab.figures.map import StateMapDrawing

        shape = tuple(len(along) for along in self.axes.values())
        fixed = [f"{name} = {along[0]:g}" for name, along in self._grid.axes().items() if name not in self.axes]
        columns = {key: column.reshape(shape) for key, column in self._columns.items()}
        title = ", ".join([self._grid.law, f"wall {self._grid.wall}", *fixed])
        return StateMapDrawing(self.axes, columns, title, tuple(self._warned.sentences()))
