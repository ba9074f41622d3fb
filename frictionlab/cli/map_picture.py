"""``frictionlab sweep --plot``: the figure of a map, gathered while its points are solved."""

from pathlib import Path
from typing import TYPE_CHECKING

from frictionlab.cli.drawing import figure_file
from frictionlab.errors import UsageError
from frictionlab.files import make_folder

if TYPE_CHECKING:
    from collections.abc import Generator

    from frictionlab.figures.map import StateMapDrawing
    from frictionlab.maps import Grid, Step

MOST_AXES = 2


class MapPicture:
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
        for step in steps:
            for key, column in self._columns.items():
                column[step.start : step.done] = step.records[key]
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
