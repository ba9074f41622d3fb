"""Maps over frequency ratio x normal force: irregularity (thesis Fig. 4.5), stops per cycle with their prediction."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import BoundaryNorm, Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from frictionlab.campaign import Campaign, Verdict
from frictionlab.campaign.trials import levels, nearest
from frictionlab.figures.style import PAGE, VERMILION, new_figure

FloatArray = NDArray[np.float64]
CLIP = 0.1  # the colour scale ends this far below the maximum, as in Fig. 4.5
WIDE = 1.6  # a step over r = 1 this much wider than its neighbours is a band left out
MOST_STOPS = 8


@dataclass(frozen=True)
class _Map:
    """Values (forces, levels) over frequency ratio; ``ratios`` (levels,), ``forces`` (forces,) N; nan: not measured."""

    ratios: tuple[float, ...]
    forces: tuple[float, ...]
    values: FloatArray


def _map_of(campaign: Campaign, material: str, value: Callable[[Verdict], float | None]) -> _Map:
    fits = [f for f in campaign.fits if f.material == material]
    tests = [(f.normal_force_n, v) for f in fits for v in f.verdicts if not v.trial.is_long]
    ratios = levels([v.trial.r for _, v in tests])
    forces = tuple(sorted({force for force, _ in tests}))
    found: dict[tuple[int, int], list[float]] = {}
    for force, verdict in tests:
        number = value(verdict)
        if number is not None:
            place = forces.index(force), ratios.index(nearest(verdict.trial.r, ratios))
            found.setdefault(place, []).append(number)
    values = np.full((len(forces), len(ratios)), np.nan)
    for place, numbers in found.items():
        values[place] = float(np.mean(numbers))
    return _Map(ratios, forces, values)


def resonance_band(ratios: Sequence[float]) -> tuple[float, float] | None:
    """The band over r = 1 that a campaign left out: between its neighbours, if they are further apart than usual."""
    below, above = [r for r in ratios if r < 1], [r for r in ratios if r > 1]
    if not below or not above or 1.0 in ratios:
        return None
    low, high = max(below), min(above)
    steps = [b - a for a, b in pairwise(sorted(ratios)) if not a < 1 < b]
    near = [s for s in steps if s > 0]
    return (low, high) if near and high - low > WIDE * float(np.median(near)) else None


def _pieces(ratios: Sequence[float]) -> list[tuple[slice, FloatArray]]:
    """Stretches of levels without a band left out, each with the edges of its cells."""
    band = resonance_band(ratios)
    cut = len(ratios) if band is None else ratios.index(band[1])
    spans = [slice(0, cut), slice(cut, len(ratios))]
    return [(span, _edges(np.array(ratios[span]))) for span in spans if ratios[span]]


def _edges(centres: FloatArray) -> FloatArray:
    if len(centres) == 1:
        return np.array([centres[0] - 0.025, centres[0] + 0.025])
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]])


def _draw(ax: Axes, drawn: _Map, norm: Normalize, colours: str) -> QuadMesh:
    rows = np.arange(len(drawn.forces) + 1) - 0.5
    meshes = [
        ax.pcolormesh(edges, rows, drawn.values[:, span], norm=norm, cmap=colours, edgecolors="white", linewidth=0.3)
        for span, edges in _pieces(drawn.ratios)
    ]
    ax.grid(visible=False)
    if resonance_band(drawn.ratios) is not None:
        (_, left), (_, right) = _pieces(drawn.ratios)
        for edge in (left[-1], right[0]):
            ax.axvline(edge, color=VERMILION, linestyle=":", linewidth=1.2)
    ax.set_xlim(left=0)
    ax.set_yticks(range(len(drawn.forces)), [f"{force:g}" for force in drawn.forces])
    ax.set_ylabel("normal force [N]")
    return meshes[0]


def irregularity(campaign: Campaign) -> Figure:
    """Irregularity index, eq. (4.1), of the short tests; one colour scale for all materials."""
    maps = [_map_of(campaign, m, lambda v: v.trial.irregularity) for m in campaign.materials]
    every = np.concatenate([m.values[np.isfinite(m.values)] for m in maps])
    norm = Normalize(0.0, colour_limit(every))
    figure = new_figure(PAGE, 0.6 + 1.25 * len(maps))
    axes = figure.subplots(len(maps), 1, sharex=True, squeeze=False)[:, 0]
    for ax, drawn, material in zip(axes, maps, campaign.materials, strict=True):
        mesh = _draw(ax, drawn, norm, "viridis")
        ax.set_title(material)
    axes[-1].set_xlabel("frequency ratio r")
    figure.colorbar(
        mesh,
        ax=list(axes),
        label="irregularity index",
        aspect=30,
        extend="max" if norm.vmax < every.max() else "neither",
    )
    return figure


def colour_limit(values: FloatArray) -> float:
    """Where the colour scale ends: 0.1 below the maximum (section 4.3.1), or at it where that would cut half of it off.

    Examples
    --------
    >>> round(colour_limit(np.array([0.05, 0.4])), 9)
    0.3
    """
    top = float(values.max()) if len(values) else 0.0
    return top - CLIP if top > 2 * CLIP else max(top, 1e-6)


def stops(campaign: Campaign) -> Figure:
    """Stops per cycle: measured on the left, predicted by the fitted friction ratio on the right."""
    kinds: tuple[tuple[str, Callable[[Verdict], float | None]], ...] = (
        ("measured", lambda v: v.trial.stops),
        ("predicted", lambda v: v.predicted.stops if v.predicted is not None else None),
    )
    norm = BoundaryNorm(np.arange(-0.5, MOST_STOPS + 1), 256, extend="max")
    figure = new_figure(PAGE, 0.6 + 1.2 * len(campaign.materials))
    axes = figure.subplots(len(campaign.materials), 2, sharex=True, squeeze=False)
    for line, material in zip(axes, campaign.materials, strict=True):
        for ax, (kind, value) in zip(line, kinds, strict=True):
            mesh = _draw(ax, _map_of(campaign, material, value), norm, "viridis")
            ax.set_title(f"{material}, {kind}")
        line[1].set_ylabel("")
    for ax in axes[-1]:
        ax.set_xlabel("frequency ratio r")
    bar = figure.colorbar(mesh, ax=axes, label="stops per cycle", ticks=range(MOST_STOPS + 1), aspect=30)
    bar.ax.tick_params(length=0)
    return figure
