"""Numbers over two axes: of a campaign over frequency ratio x normal force, and of a map of steady states."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from frictionlab.arrays import FloatArray
from frictionlab.campaign import Campaign
from frictionlab.campaign.friction import Verdict
from frictionlab.campaign.trials import Trial, levels, nearest
from frictionlab.errors import UsageError
from frictionlab.figures.style import AT_REST, BLUE, MEASURED, VERMILION, StopColours, drawing, panels, plain_numbers
from frictionlab.schema import AMPLITUDE, ENERGY, STEADY_STATES, STOPS
from frictionlab.simulator import StateMap
from frictionlab.simulator.sweep import Grid, named

CLIP = 0.1  # the colour scale ends this far below the maximum, as in Fig. 4.5
GAP = 1.6  # a step over r = 1 this much wider than its neighbours is a band left out
FEW = 8  # classes of stops for which a low figure has space
PANELS = {c.name: c.head for c in STEADY_STATES.columns if c.name in (ENERGY, AMPLITUDE, STOPS)}
"""Columns of a map of steady states -> what they are."""
MANY, MUCH_LARGER = 3, 10.0  # values of an axis, and how much larger the last is, from which it may be logarithmic
PERCENTILE = 95.0  # percentile where the colours end: a few points at resonance would bleach all others
Value = Callable[[Verdict], float | None]


@dataclass(frozen=True)
class _Map:
    """Values (forces, levels) over frequency ratio; ``ratios`` (levels,), ``forces`` (forces,) N; nan: not measured."""

    ratios: tuple[float, ...]
    forces: tuple[float, ...]
    values: FloatArray

    @property
    def is_line(self) -> bool:
        """Whether only one of frequency ratio and normal force varies."""
        return len(self.forces) < 2 or len(self.ratios) < 2


def _map_of(campaign: Campaign, material: str, value: Value) -> _Map:
    fits = [f for f in campaign.fits if f.material == material]
    tests = [(f.normal_force_n, v) for f in fits for v in f.verdicts if not v.trial.is_long]
    ratios = levels([v.trial.r for _, v in tests])
    forces = tuple(sorted({force for force, _ in tests}))
    found: defaultdict[tuple[float, float], list[float]] = defaultdict(list)
    for force, verdict in tests:
        found[force, nearest(verdict.trial.r, ratios)] += [] if (number := value(verdict)) is None else [number]
    values = np.array([[np.median(found[force, r] or [np.nan]) for r in ratios] for force in forces])
    return _Map(ratios, forces, values)


def varies(campaign: Campaign, known: Callable[[Trial], float | None]) -> bool:
    """Whether a material has a number at two frequency ratios or two normal forces: less is no map."""
    maps = [_map_of(campaign, material, lambda verdict: known(verdict.trial)) for material in campaign.materials]
    return any(one.values.size > 1 and np.isfinite(one.values).any() for one in maps)


def has_map(campaign: Campaign) -> bool:
    """Whether a material varies in both frequency ratio and normal force: else there are lines in place of maps."""
    return any(not _map_of(campaign, material, lambda _: 0.0).is_line for material in campaign.materials)


def irregularity(campaign: Campaign) -> Figure:
    """Irregularity index of the short tests.

    Equation (4.1), on one scale for all materials. Between dotted lines nothing was measured, near resonance.
    """
    return _grid(campaign, {"": lambda verdict: verdict.trial.irregularity}, "irregularity index")


def stops(campaign: Campaign) -> Figure:
    """Stops per cycle.

    Measured on the left; on the right as the fitted law predicts it. Blank: not measured,
    or no steady state.
    """

    def measured(verdict: Verdict) -> float | None:
        return AT_REST if verdict.trial.regime == "stuck" else verdict.trial.stops

    def predicted(verdict: Verdict) -> float | None:
        found = verdict.predicted
        return None if found is None else found.stops_per_cycle if found.energy_per_cycle else AT_REST

    return _grid(campaign, {", measured": measured, ", predicted": predicted}, "stops per cycle")


def _grid(campaign: Campaign, columns: Mapping[str, Value], quantity: str) -> Figure:
    """A row a material, with a map of each column; one colour scale for all."""
    maps = [[_map_of(campaign, material, value) for value in columns.values()] for material in campaign.materials]
    every = np.concatenate([one.values[np.isfinite(one.values)] for row in maps for one in row])
    classes = StopColours(every) if quantity == "stops per cycle" else None
    limit = colour_limit(every)
    colours: dict[str, Any] = classes.mapped if classes else {"norm": Normalize(0.0, limit), "cmap": "viridis"}
    high = len(classes.names) > FEW if classes else maps[0][0].is_line
    with drawing(0.6 + 1.25 * max(len(maps), 2 if high else 1)) as figure:
        axes = figure.subplots(len(maps), len(columns), sharex=True, squeeze=False)
        mesh = None
        for line, row, material in zip(axes, maps, campaign.materials, strict=True):
            for ax, drawn, words in zip(line, row, columns, strict=True):
                if drawn.is_line:
                    _draw_line(ax, drawn, quantity, max(0.0, float(every.max(initial=0.0))), whole=classes is not None)
                else:
                    mesh = _draw_map(ax, drawn, colours)
                ax.set_title(f"{material}{words}")
                ax.label_outer()
        if mesh is not None and classes is not None:
            classes.bar(figure, mesh, axes).set_label(quantity)
        elif mesh is not None:
            extend = "max" if limit < every.max() else "neither"
            figure.colorbar(mesh, ax=axes, label=quantity, aspect=30, extend=extend)
    return figure


def _draw_line(ax: Axes, drawn: _Map, quantity: str, most: float, *, whole: bool) -> None:
    """Values over force or frequency ratio, up to the largest of all materials."""
    over_force = len(drawn.ratios) < 2
    along = drawn.forces if over_force else drawn.ratios
    values = np.where(drawn.values == AT_REST, 0.0, drawn.values).ravel()
    ax.plot(along, values, "o" if over_force else "o-", color=MEASURED, markersize=3.0, linewidth=0.6)
    top = most or 1.0
    ax.set(xlabel="normal force [N]" if over_force else "frequency ratio r", ylabel=quantity)
    ax.set(xlim=(0.0, 1.05 * max(along)), ylim=(-0.06 * top, 1.12 * top))
    ax.yaxis.set_major_locator(MaxNLocator(4, integer=whole))


def _draw_map(ax: Axes, drawn: _Map, colours: Mapping[str, Any]) -> QuadMesh:
    """Cells over both axes; a band that was left out over resonance is blank between dotted lines."""
    band, values = resonance_band(drawn.ratios), drawn.values
    cut = len(drawn.ratios) if band is None else drawn.ratios.index(band[1])
    stretches = [np.array(stretch) for stretch in (drawn.ratios[:cut], drawn.ratios[cut:]) if stretch]
    edges = np.concatenate([_edges(stretch) for stretch in stretches])
    if band is not None:
        values = np.insert(values, cut, np.nan, axis=1)
        for edge in edges[cut : cut + 2]:
            ax.axvline(edge, color=VERMILION, linestyle=":", linewidth=1.2)
    rows = np.arange(len(drawn.forces) + 1) - 0.5
    mesh = ax.pcolormesh(edges, rows, values, edgecolors="white", linewidth=0.3, **colours)
    ax.grid(visible=False)
    ax.set_xlim(left=0)
    ax.set_yticks(range(len(drawn.forces)), [f"{force:.4g}" for force in drawn.forces])
    ax.set(ylabel="normal force [N]", xlabel="frequency ratio r")
    return mesh


def resonance_band(ratios: Sequence[float]) -> tuple[float, float] | None:
    """The band over r = 1 that a campaign left out: between its neighbours, if they are further apart than usual."""
    below, above = [r for r in ratios if r < 1], [r for r in ratios if r > 1]
    if not below or not above or 1.0 in ratios:
        return None
    low, high = max(below), min(above)
    steps = [b - a for a, b in pairwise(sorted(ratios)) if not a < 1 < b and b > a]
    return (low, high) if steps and high - low > GAP * float(np.median(steps)) else None


def _edges(centres: FloatArray) -> FloatArray:
    if len(centres) == 1:
        return np.array([centres[0] - 0.025, centres[0] + 0.025])
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2 * centres[0] - middle[0]], middle, [2 * centres[-1] - middle[-1]]])


def colour_limit(values: FloatArray) -> float:
    """Where the colour scale ends: 0.1 below the maximum (section 4.3.1), or at it where that would cut half of it off.

    Examples
    --------
    >>> round(colour_limit(np.array([0.05, 0.4])), 9), colour_limit(np.array([0.1, 0.15]))
    (0.3, 0.15)
    """
    top = float(values.max()) if len(values) else 0.0
    return top - CLIP if top > 2 * CLIP else max(top, 1e-6)


def check_axes(grid: Grid) -> Mapping[str, FloatArray]:
    """The axes that a map is drawn over, those of several values; `UsageError` where there are more than two."""
    every = grid.axes()
    axes = {name: along for name, along in every.items() if len(along) > 1} or {"r": every["r"]}
    if len(axes) > 2:
        raise UsageError(f"plot: expected one or two axes with several values; got {', '.join(axes)}")
    return axes


def state_map_figure(found: StateMap) -> Figure:
    """A panel for each of energy, amplitude and stops over one axis or two; white where there is no steady state."""
    grid, columns = found.grid, named(found.numbers)
    axes = check_axes(grid)
    fixed = [f"{name} = {along[0]:g}" for name, along in grid.axes().items() if name not in axes]
    at_rest, shape = columns["outcome"] == "stuck", [len(along) for along in axes.values()]
    (name, along), *rest = axes.items()
    with drawing(2.6, ", ".join([grid.law, f"wall {grid.wall}", *fixed]), found.warnings) as figure:
        for ax, (key, words) in zip(panels(figure, len(PANELS), across=3), PANELS.items(), strict=True):
            values = np.where(at_rest & (key == STOPS), AT_REST, columns[key]).reshape(shape)
            ax.set(title=f"{words}{', white: none' * bool(rest)}", xlabel=name)
            if rest:
                classes = StopColours(values) if key == STOPS else None
                known = values[np.isfinite(values)]
                top = float(np.percentile(known, PERCENTILE)) if known.size else 1.0
                colours: dict[str, Any] = classes.mapped if classes else {"norm": Normalize(0.0, top)}
                mesh = ax.pcolormesh(along, rest[0][1], values.T, shading="nearest", rasterized=True, **colours)
                if classes:
                    classes.bar(figure, mesh, ax)
                else:
                    figure.colorbar(mesh, ax=ax, extend="max" if known.max(initial=0.0) > top else "neither")
                ax.set_ylabel(rest[0][0])
                ax.grid(visible=False)
            else:
                ax.plot(along, np.maximum(values, 0.0), color=BLUE, marker=".", markersize=2.5)
            for axis, scale, places in zip(("x", "y"), (ax.set_xscale, ax.set_yscale), axes.values(), strict=False):
                if _is_logarithmic(places):
                    scale("log")
                    plain_numbers(getattr(ax, f"{axis}axis"))
    return figure


def _is_logarithmic(values: FloatArray) -> bool:
    """Whether each value is the same factor larger than the one before, and the last much larger."""
    if len(values) < MANY or values[0] <= 0.0 or values[-1] < MUCH_LARGER * values[0]:
        return False
    factors = values[1:] / values[:-1]
    return bool(np.ptp(factors) < 1e-6 * factors[0])
