"""Numbers over two axes: of a campaign over frequency ratio x normal force, and of a map of steady states."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import BoundaryNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from frictionlab.arrays import FloatArray
from frictionlab.campaign import Campaign, Verdict
from frictionlab.campaign.trials import levels, nearest
from frictionlab.figures.style import (
    AT_REST,
    BLUE,
    MEASURED,
    PAGE,
    VERMILION,
    caution,
    look,
    new_figure,
    stop_colours,
)

CLIP = 0.1  # the colour scale ends this far below the maximum, as in Fig. 4.5
GAP = 1.6  # a step over r = 1 this much wider than its neighbours is a band left out
LEAST = 2  # values on both axes that a map needs
FEW = 8  # classes of stops for which a low figure has room
PANELS = {
    "energy_per_cycle": "energy per cycle over $kY^2$",
    "response_amplitude": "amplitude over $Y$",
    "stops_per_cycle": "stops per cycle",
}
STOPS = "stops_per_cycle"
MANY, MUCH_LARGER = 3, 10.0  # values of an axis, and how much larger the last is, from which it may be logarithmic
PERCENTILE = 95.0  # percentile where the colours end: a few points at resonance would bleach all others


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
        values[place] = float(np.median(numbers))
    return _Map(ratios, forces, values)


def resonance_band(ratios: Sequence[float]) -> tuple[float, float] | None:
    """The band over r = 1 that a campaign left out: between its neighbours, if they are further apart than usual."""
    below, above = [r for r in ratios if r < 1], [r for r in ratios if r > 1]
    if not below or not above or 1.0 in ratios:
        return None
    low, high = max(below), min(above)
    steps = [b - a for a, b in pairwise(sorted(ratios)) if not a < 1 < b]
    near = [s for s in steps if s > 0]
    return (low, high) if near and high - low > GAP * float(np.median(near)) else None


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


def varies(campaign: Campaign) -> bool:
    """Whether a material has two frequency ratios or two normal forces: less is no map."""
    maps = [_map_of(campaign, material, lambda _: 0.0) for material in campaign.materials]
    return any(len(one.ratios) > 1 or len(one.forces) > 1 for one in maps)


def _draw(ax: Axes, drawn: _Map, colours: dict[str, Any], quantity: str) -> QuadMesh | None:
    """A map, or a line where only one of frequency ratio and normal force varies."""
    if min(len(drawn.forces), len(drawn.ratios)) < LEAST:
        over_force = len(drawn.ratios) < LEAST
        along = drawn.forces if over_force else drawn.ratios
        values = np.where(drawn.values == AT_REST, 0.0, drawn.values).ravel()
        ax.plot(along, values, "o" if over_force else "o-", color=MEASURED, markersize=3.0, linewidth=0.6)
        ax.set(xlabel="normal force [N]" if over_force else "frequency ratio r", ylabel=quantity)
        top = float(np.nanmax(values, initial=0.0)) or 1.0
        ax.set(xlim=(0.0, 1.05 * max(along)), ylim=(-0.06 * top, 1.12 * top))
        ax.yaxis.set_major_locator(MaxNLocator(4, integer=isinstance(colours["norm"], BoundaryNorm)))
        return None
    rows = np.arange(len(drawn.forces) + 1) - 0.5
    meshes = [
        ax.pcolormesh(edges, rows, drawn.values[:, span], edgecolors="white", linewidth=0.3, **colours)
        for span, edges in _pieces(drawn.ratios)
    ]
    ax.grid(visible=False)
    if resonance_band(drawn.ratios) is not None:
        (_, left), (_, right) = _pieces(drawn.ratios)
        for edge in (left[-1], right[0]):
            ax.axvline(edge, color=VERMILION, linestyle=":", linewidth=1.2)
    ax.set_xlim(left=0)
    ax.set_yticks(range(len(drawn.forces)), [f"{force:.4g}" for force in drawn.forces])
    ax.set(ylabel="normal force [N]", xlabel="frequency ratio r")
    return meshes[0]


def irregularity(campaign: Campaign) -> Figure:
    """Irregularity index, eq. (4.1), of the short tests; one colour scale for all materials."""
    maps = [_map_of(campaign, m, lambda v: v.trial.irregularity) for m in campaign.materials]
    every = np.concatenate([m.values[np.isfinite(m.values)] for m in maps])
    colours = {"norm": Normalize(0.0, colour_limit(every)), "cmap": "viridis"}
    figure = new_figure(PAGE, 0.6 + 1.25 * max(len(maps), 2 if len(maps[0].forces) < LEAST else 1))
    axes = figure.subplots(len(maps), 1, sharex=True, squeeze=False)[:, 0]
    mesh = None
    for ax, drawn, material in zip(axes, maps, campaign.materials, strict=True):
        mesh = _draw(ax, drawn, colours, "irregularity") or mesh
        ax.set_title(material)
        ax.label_outer()
    if mesh is not None:
        extend = "max" if colour_limit(every) < every.max() else "neither"
        figure.colorbar(mesh, ax=list(axes), label="irregularity index", aspect=30, extend=extend)
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
        ("measured", lambda v: AT_REST if v.trial.regime == "stuck" else v.trial.stops),
        ("predicted", _predicted_stops),
    )
    maps = [[_map_of(campaign, material, value) for _, value in kinds] for material in campaign.materials]
    every = np.concatenate([one.values.ravel() for pair in maps for one in pair])
    scale = stop_colours(every)
    figure = new_figure(PAGE, 0.6 + 1.2 * max(len(maps), 2 if len(scale.names) > FEW else 1))
    axes = figure.subplots(len(maps), 2, sharex=True, squeeze=False)
    mesh = None
    for line, pair, material in zip(axes, maps, campaign.materials, strict=True):
        for ax, drawn, (kind, _) in zip(line, pair, kinds, strict=True):
            mesh = _draw(ax, drawn, scale.mapped, "stops per cycle") or mesh
            ax.set_title(f"{material}, {kind}")
            ax.label_outer()
    if mesh is not None:
        scale.bar(figure, mesh, axes).set_label("stops per cycle")
    return figure


def _predicted_stops(verdict: Verdict) -> float | None:
    found = verdict.predicted
    return None if found is None else found.stops if found.energy > 0.0 else AT_REST


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

    axes: Mapping[str, FloatArray]
    columns: Mapping[str, FloatArray]
    title: str
    warnings: Sequence[str] = ()


def map_figure(drawn: StateMapDrawing) -> Figure:
    """A panel for each of energy, amplitude and stops; left white where there is no steady state."""
    with look():
        figure = new_figure(PAGE, 2.6)
        for ax, (key, words) in zip(figure.subplots(1, len(PANELS)), PANELS.items(), strict=True):
            (name, along), *rest = drawn.axes.items()
            ax.set(title=words, xlabel=name, xscale=_scale(along))
            if rest:
                _draw_plane(figure, ax, (along, rest[0][1]), drawn.columns[key], key)
                ax.set(ylabel=rest[0][0], yscale=_scale(rest[0][1]))
            else:
                ax.plot(along, np.maximum(drawn.columns[key], 0.0), color=BLUE, marker=".", markersize=2.5)
        figure.suptitle(drawn.title, fontsize=8.0)
        caution(figure, drawn.warnings)
    return figure


def _draw_plane(figure: Figure, ax: Axes, axes: tuple[FloatArray, FloatArray], values: FloatArray, key: str) -> None:
    """One column over two axes, with its colour bar."""
    if key == STOPS:
        stops = stop_colours(values)
        mesh = ax.pcolormesh(*axes, values.T, shading="nearest", rasterized=True, **stops.mapped)
        stops.bar(figure, mesh, ax)
    else:
        known = values[np.isfinite(values)]
        top = float(np.percentile(known, PERCENTILE)) if known.size else 1.0
        mesh = ax.pcolormesh(*axes, values.T, shading="nearest", rasterized=True, norm=Normalize(0.0, top))
        figure.colorbar(mesh, ax=ax, extend="max" if known.max(initial=0.0) > top else "neither")
    ax.grid(visible=False)


def _scale(values: FloatArray) -> str:
    """Logarithmic where each value is the same factor larger than the one before, and the last much larger."""
    if len(values) < MANY or values[0] <= 0.0 or values[-1] < MUCH_LARGER * values[0]:
        return "linear"
    factors = values[1:] / values[:-1]
    return "log" if np.ptp(factors) < 1e-6 * factors[0] else "linear"


def varying(axes: Mapping[str, Sequence[float] | FloatArray]) -> dict[str, FloatArray]:
    """Those of the axes that have more than one value; the first if none has.

    Examples
    --------
    >>> list(varying({"r": (0.5, 1.0), "beta": (0.4,), "mu": (1.0,)}))
    ['r']
    """
    more = {name: np.asarray(along, dtype=np.float64) for name, along in axes.items() if len(along) > 1}
    return more or {name: np.asarray(along, dtype=np.float64) for name, along in list(axes.items())[:1]}
