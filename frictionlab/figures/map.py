"""A map of steady states: energy, amplitude and stops per cycle, as lines over one axis or as colours over two."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from frictionlab.figures.stops import stop_colours
from frictionlab.figures.style import BLUE, PAGE, caution, look, new_figure

Floats = NDArray[np.float64]
PANELS = {
    "energy_per_cycle": "energy per cycle over $kY^2$",
    "response_amplitude": "amplitude over $Y$",
    "stops_per_cycle": "stops per cycle",
}
STOPS = "stops_per_cycle"
MANY, WIDE = 3, 10.0  # values of an axis, and how much larger the last is, from which its scale may be logarithmic
MOST = 95.0  # percentile where the colours end: a few points at resonance would bleach all others


@dataclass(frozen=True)
class StateMapDrawing:
    """What is drawn: the axes that vary, by name, and the columns of `PANELS` over them; nan: no steady state.

    Parameters
    ----------
    axes
        Name -> its values, going up; one axis or two.
    columns
        Key of `PANELS` -> array over the axes in their order; stops of a mass at rest: `stops.AT_REST`.
    title
        The law and what stays the same.
    warnings
        What is to be said of the points beside their numbers.
    """

    axes: Mapping[str, Floats]
    columns: Mapping[str, Floats]
    title: str
    warnings: Sequence[str] = ()


def map_figure(drawn: StateMapDrawing) -> Figure:
    """A panel for each of energy, amplitude and stops."""
    with look():
        figure = new_figure(PAGE, 2.6)
        panels = figure.subplots(1, len(PANELS))
        for ax, (key, words) in zip(panels, PANELS.items(), strict=True):
            draw_panel(drawn, key, ax).set_title(words)
        figure.suptitle(drawn.title, fontsize=8.0)
        caution(figure, drawn.warnings)
    return figure


def draw_panel(drawn: StateMapDrawing, key: str, ax: Axes) -> Axes:
    """One column over the axes; left white where there is no steady state."""
    names = list(drawn.axes)
    ax.set_xlabel(names[0])
    ax.set_xscale(_scale(drawn.axes[names[0]]))
    values = drawn.columns[key]
    if len(names) == 1:
        ax.plot(drawn.axes[names[0]], np.maximum(values, 0.0), color=BLUE, marker=".", markersize=2.5)
        return ax
    along, up = drawn.axes[names[0]], drawn.axes[names[1]]
    stops = stop_colours(values) if key == STOPS else None
    colours = {"norm": _colours(values)} if stops is None else stops.mapped
    mesh = ax.pcolormesh(along, up, values.T, shading="nearest", rasterized=True, **colours)
    ax.set_ylabel(names[1])
    ax.set_yscale(_scale(up))
    ax.grid(visible=False)
    beyond = np.nanmax(values, initial=0.0) > (mesh.norm.vmax or 0.0)
    if (figure := ax.get_figure(root=True)) is not None:
        if stops is not None:
            stops.bar(figure, mesh, ax)
        else:
            figure.colorbar(mesh, ax=ax, extend="max" if beyond else "neither")
    return ax


def _scale(values: Floats) -> str:
    """Logarithmic where each value is the same factor larger than the one before, and the last much larger."""
    if len(values) < MANY or values[0] <= 0.0 or values[-1] < WIDE * values[0]:
        return "linear"
    factors = values[1:] / values[:-1]
    return "log" if np.ptp(factors) < 1e-6 * factors[0] else "linear"


def _colours(values: Floats) -> Normalize:
    known = values[np.isfinite(values)]
    return Normalize(0.0, float(np.percentile(known, MOST)) if known.size else 1.0)


def varying(axes: Mapping[str, Sequence[float] | Floats]) -> dict[str, Floats]:
    """Those of the axes that have more than one value; the first if none has.

    Examples
    --------
    >>> list(varying({"r": (0.5, 1.0), "beta": (0.4,), "mu": (1.0,)}))
    ['r']
    """
    more = {name: np.asarray(along, dtype=np.float64) for name, along in axes.items() if len(along) > 1}
    return more or {name: np.asarray(along, dtype=np.float64) for name, along in list(axes.items())[:1]}
