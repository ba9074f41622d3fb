"""The maps of the thesis's chapter 3 under other contact laws: energy, amplitude and stops over r and beta.

`python -m tests.benchmarks.chapter3 FOLDER` draws them with the chapter. Each law has parameters of a size that
contacts have; friction of rate and state is solved on every second point, for it costs a hundred times as much.
"""

import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from frictionlab.figures.style import GREY, PAGE, headline, look, new_figure
from frictionlab.simulator import sweep
from frictionlab.simulator.laws import law_of
from tests.benchmarks.law_loops import RATE_STATE

Floats = NDArray[np.float64]
LAWS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "coulomb": {},
        "coulomb+place": {"gradient": 0.1},
        "coulomb+speed": {"contact_damping_ratio": 0.05},
        "coulomb+breakaway": {"static_ratio_up": 1.3, "static_ratio_down": 1.3},
        "coulomb+compliance": {"stiffness_ratio": 20.0},
        "coulomb+rate-state": RATE_STATE,
    }
)
SLOW = ("coulomb+rate-state",)  # solved on a coarser grid
EDGES = (-1.0, 0.5, 2.5, 4.5, 6.5, 8.5, 12.5, 1000.0)  # stops per cycle that share a colour
NAMES = ("0", "1-2", "3-4", "5-6", "7-8", "9-12", "more")
WIDE = 30  # letters above a panel
CHANGE = 0.3  # relative change at which the colours end


@dataclass(frozen=True)
class LawMap:
    """Steady states of one law over frequency ratio and friction ratio.

    Parameters
    ----------
    r, beta : ndarray
        The grid.
    energy, amplitude, stops : ndarray of shape (r, beta)
        Energy per cycle (k Y^2), response amplitude (Y), stops per cycle; NaN where there is no steady state.
    """

    r: Floats
    beta: Floats
    energy: Floats
    amplitude: Floats
    stops: Floats


def compute(columns: int = 72, rows: int = 32) -> dict[str, LawMap]:
    """Solve the maps on a grid of so many frequency and friction ratios."""
    return {law: solved(law, columns, rows) for law in LAWS}


def solved(law: str, columns: int, rows: int) -> LawMap:
    """Solve one law's map; every second row and column of a law that takes long."""
    step = 2 if law in SLOW else 1
    r, beta = np.geomspace(0.1, 2.5, columns)[::step], np.linspace(0.03, 0.97, rows)[::step]
    axes = {name: (value,) for name, value in LAWS[law].items()}
    found = sweep(r.tolist(), beta.tolist(), law=law, parameters=axes).datasets()
    keys = ("energy_per_cycle", "response_amplitude", "stops_per_cycle")
    energy, amplitude, stops = (found[key].reshape(len(r), len(beta)) for key in keys)
    return LawMap(r, beta, energy, amplitude, stops)


def change(mapped: LawMap, plain: LawMap, values: Floats, reference: Floats) -> Floats:
    """Return the relative change from plain friction at the points that both maps have."""
    rows, columns = np.searchsorted(plain.r, mapped.r * (1.0 - 1e-12)), np.searchsorted(plain.beta, mapped.beta - 1e-12)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(values / reference[np.ix_(rows, columns)] - 1.0)


def panel(ax: Axes, mapped: LawMap, values: Floats, colours: Colormap, norm: Normalize) -> QuadMesh:
    """Draw one map; where there is no steady state it stays grey."""
    ax.set_facecolor(GREY)
    mesh = ax.pcolormesh(mapped.r, mapped.beta, values.T, cmap=colours, norm=norm, rasterized=True)
    ax.set_xscale("log")
    ax.set_xticks([0.1, 0.2, 0.5, 1.0, 2.0], ["0.1", "0.2", "0.5", "1", "2"])
    ax.minorticks_off()
    ax.set(xlim=(mapped.r[0], mapped.r[-1]), ylim=(mapped.beta[0], mapped.beta[-1]))
    ax.grid(visible=False)
    return mesh


def words(law: str) -> str:
    """Say a law and its parameters, by their symbols, in a panel's title."""
    own = law_of(law)
    shown = ", ".join(f"{own.parameter(name).symbol} = {value:g}" for name, value in LAWS[law].items())
    return f"{law.removeprefix('coulomb+')}\n{textwrap.fill(shown, WIDE)}"


def draw_change(maps: Mapping[str, LawMap], key: str, quantity: str) -> Figure:
    """Plain friction's map of `energy` or `amplitude`, and by how much each law changes it."""
    with look():
        figure = new_figure(PAGE, 4.2)
        axes = figure.subplots(2, 3, sharex=True, sharey=True)
        plain = maps["coulomb"]
        reference = np.asarray(getattr(plain, key))
        top = float(np.nanquantile(reference, 0.98))
        shades, both = colormaps["viridis"], colormaps["RdBu_r"]
        meshes = []
        for ax, (law, mapped) in zip(axes.ravel(), maps.items(), strict=True):
            values = np.asarray(getattr(mapped, key))
            if law == "coulomb":
                meshes.append(panel(ax, mapped, values, shades, Normalize(0.0, top)))
            else:
                off = change(mapped, plain, values, reference)
                meshes.append(panel(ax, mapped, off, both, Normalize(-CHANGE, CHANGE)))
            ax.set_title(words(law), fontsize=7)
        label_edges(axes)
        figure.colorbar(meshes[0], ax=axes[:, 0], location="left", shrink=0.7, label=quantity, extend="max")
        figure.colorbar(
            meshes[1], ax=axes[:, 2], shrink=0.7, label="change from coulomb", format="{x:+.0%}", extend="both"
        )
        headline(figure, f"{quantity}: plain friction, and by how much each law changes it (grey: no steady state)")
        return figure


def draw_stops(maps: Mapping[str, LawMap]) -> Figure:
    """Stops per cycle under each law."""
    with look():
        figure = new_figure(PAGE, 4.2)
        axes = figure.subplots(2, 3, sharex=True, sharey=True)
        colours = ListedColormap(["#FFFFFF", *(colormaps["viridis"](np.linspace(0.0, 1.0, len(NAMES) - 1)))])
        norm = BoundaryNorm(EDGES, len(NAMES))
        for ax, (law, mapped) in zip(axes.ravel(), maps.items(), strict=True):
            mesh = panel(ax, mapped, mapped.stops, colours, norm)
            ax.set_title(words(law), fontsize=7)
        label_edges(axes)
        middles = [0.5 * (a + b) for a, b in pairwise(EDGES)]
        bar = figure.colorbar(mesh, ax=axes, shrink=0.7, ticks=middles, spacing="uniform", label="stops per cycle")
        bar.ax.set_yticklabels(NAMES)
        headline(
            figure, "stops per cycle under each law (white: none, or the contact never slips; grey: no steady state)"
        )
        return figure


def draw_all(maps: Mapping[str, LawMap]) -> dict[str, Figure]:
    """All figures of the maps, by the names of their files."""
    return {
        "map_of_energy_by_law": draw_change(maps, "energy", "energy per cycle over k Y²"),
        "map_of_amplitude_by_law": draw_change(maps, "amplitude", "response amplitude over Y"),
        "map_of_stops_by_law": draw_stops(maps),
    }


def label_edges(axes: NDArray[np.object_]) -> None:
    """Name the axes at the figure's edges only."""
    for ax in axes[-1]:
        ax.set_xlabel("frequency ratio $r$")
    for ax in axes[:, 0]:
        ax.set_ylabel(r"friction ratio $\beta$")
