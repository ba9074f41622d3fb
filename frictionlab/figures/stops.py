"""Stops per cycle in colours: whole numbers, each of its own colour while they are few, a mass at rest apart."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colorbar import Colorbar
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

Floats = NDArray[np.float64]
AT_REST = -1.0
"""Stands for a mass that rests during the whole cycle, in arrays of stops."""
SINGLE = 8  # stops up to which each number has a colour of its own; beyond, classes double
REST, NONE = "#B0B0B0", "#F2EFE6"


@dataclass(frozen=True)
class StopColours:
    """Classes of stops with their colours; ``edges`` (n + 1,) between the classes, ``names`` (n,).

    Examples
    --------
    >>> stop_colours(np.array([0.0, 2.0, AT_REST, np.nan])).names
    ('at rest', '0', '1', '2')
    >>> stop_colours(np.array([0.0, 131.0])).names[-3:]
    ('25-40', '41-72', '73-136')
    """

    edges: tuple[float, ...]
    names: tuple[str, ...]

    @property
    def mapped(self) -> dict[str, Any]:
        """The colours and their norm, for ``pcolormesh``."""
        rest = [REST] if self.names[0] == "at rest" else []
        none = [NONE] if self.edges[len(rest)] < 0.0 else []
        more = len(self.names) - len(rest) - len(none)
        shades = [*rest, *none, *colormaps["viridis_r"](np.linspace(0.05, 1.0, max(more, 1)))]
        return {"cmap": ListedColormap(shades[: len(self.names)]), "norm": BoundaryNorm(self.edges, len(self.names))}

    def bar(self, figure: Figure, mesh: Any, ax: Any) -> Colorbar:
        """A colour bar with the name of each class at its middle."""
        middles = [0.5 * (low + high) for low, high in zip(self.edges, self.edges[1:], strict=False)]
        bar = figure.colorbar(mesh, ax=ax, ticks=middles, spacing="uniform", aspect=30)
        bar.ax.set_yticklabels(self.names)
        bar.ax.tick_params(length=0)
        bar.ax.minorticks_off()
        return bar


def stop_colours(values: Floats) -> StopColours:
    """The classes that these stops per cycle need, up to the largest."""
    known = np.round(values[np.isfinite(values)])
    most = int(known.max(initial=0.0))
    edges = [-1.5] if np.any(known == AT_REST) else []
    names = ["at rest"] if edges else []
    for number in range(min(most, SINGLE) + 1):
        edges.append(number - 0.5)
        names.append(str(number))
    last, wide = SINGLE, SINGLE
    while last < most:
        edges.append(last + 0.5)
        names.append(f"{last + 1}-{last + wide}")
        last, wide = last + wide, 2 * wide if last > SINGLE else wide
    return StopColours((*edges, max(min(most, SINGLE), last if most > SINGLE else 0) + 0.5), tuple(names))
