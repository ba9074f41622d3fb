"""Numbers over two axes: of a campaign over frequency ratio x normal force, and of a map of steady states."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from frictionlab.arrays import FloatArray
from frictionlab.campaign import Campaign
from frictionlab.campaign.friction import Verdict
from frictionlab.campaign.trials import Trial, levels
from frictionlab.errors import UsageError
from frictionlab.figures.style import AT_REST, BLUE, GREY, MEASURED, StopColours, drawing, panels
from frictionlab.schema import AMPLITUDE, ENERGY, STEADY_STATES, STOPS
from frictionlab.simulator import StateMap
from frictionlab.simulator.sweep import Grid, named

SQUARE = 6.0  # points: side of a test's square in a map
FEW = 8  # classes of stops for which a low figure has space
PANELS = {c.name: c.head for c in STEADY_STATES.columns if c.name in (ENERGY, AMPLITUDE, STOPS)}
"""Columns of a map of steady states -> what they are."""
PERCENTILE = 95.0  # percentile where the colours end: a few points at resonance would bleach all others
Value = Callable[[Verdict], float | None]


def _tests(campaign: Campaign, material: str, value: Value) -> FloatArray:
    """Frequency ratio, normal force [N] and a value (3, n) of the short tests of a material; NaN: not known."""
    fits = [f for f in campaign.fits if f.material == material]
    tests = [(v.trial.r, f.normal_force_n, value(v)) for f in fits for v in f.verdicts if not v.trial.is_long]
    return np.array(tests, dtype=np.float64).reshape(-1, 3).T


def _is_map(tests: FloatArray) -> bool:
    """Whether both frequency ratio and normal force vary: less is drawn as a line."""
    return min(len(levels(tests[0].tolist())), len(set(tests[1].tolist()))) > 1


def varies(campaign: Campaign, known: Callable[[Trial], float | None]) -> bool:
    """Whether a material has a number at two frequency ratios or two normal forces: less is no map."""
    every = [_tests(campaign, material, lambda verdict: known(verdict.trial)) for material in campaign.materials]
    settings = [max(len(levels(r.tolist())), len(set(force.tolist()))) for r, force, _ in every]
    return any(count > 1 and np.isfinite(one[2]).any() for one, count in zip(every, settings, strict=True))


def irregularity(campaign: Campaign) -> Figure:
    """Irregularity index of the short tests.

    Equation (4.1), of each test, on one scale for all materials.
    """
    return _grid(campaign, {"": lambda verdict: verdict.trial.irregularity}, "irregularity index")


def stops(campaign: Campaign) -> Figure:
    """Stops per cycle.

    Measured on the left; on the right as the fitted law predicts it, where it has a steady state.
    """

    def measured(verdict: Verdict) -> float | None:
        return AT_REST if verdict.trial.regime == "stuck" else verdict.trial.stops

    def predicted(verdict: Verdict) -> float | None:
        found = verdict.predicted
        return None if found is None else found.stops_per_cycle if found.energy_per_cycle else AT_REST

    return _grid(campaign, {", measured": measured, ", predicted": predicted}, "stops per cycle")


def _grid(campaign: Campaign, columns: Mapping[str, Value], quantity: str) -> Figure:
    """A row a material, with the tests of each column; one colour scale for all."""
    rows = [[_tests(campaign, material, value) for value in columns.values()] for material in campaign.materials]
    every = np.concatenate([one[2][np.isfinite(one[2])] for row in rows for one in row])
    classes = StopColours(every) if quantity == "stops per cycle" else None
    limit = colour_limit(every)
    colours: dict[str, Any] = classes.mapped if classes else {"norm": Normalize(0.0, limit), "cmap": "viridis"}
    high = len(classes.names) > FEW if classes else not _is_map(rows[0][0])
    with drawing(0.6 + 1.25 * max(len(rows), 2 if high else 1)) as figure:
        axes = figure.subplots(len(rows), len(columns), sharex=True, squeeze=False)
        squares = None
        for line, row, material in zip(axes, rows, campaign.materials, strict=True):
            for ax, tests, words in zip(line, row, columns, strict=True):
                if _is_map(tests):
                    forces, places = np.unique(tests[1], return_inverse=True)
                    edges = {"linewidths": 0.3, "edgecolors": GREY}
                    squares = ax.scatter(tests[0], places, c=tests[2], s=SQUARE**2, marker="s", **edges, **colours)
                    ax.set_yticks(range(len(forces)), [f"{each:.4g}" for each in forces])
                    ax.set(ylabel="normal force [N]", xlabel="frequency ratio r", xlim=(0.0, None))
                    ax.set_ylim(-0.6, len(forces) - 0.4)
                else:
                    _draw_line(ax, tests, quantity, max(0.0, float(every.max(initial=0.0))), whole=classes is not None)
                ax.set_title(f"{material}{words}")
                ax.label_outer()
        if squares is not None and classes is not None:
            classes.bar(figure, squares, axes).set_label(quantity)
        elif squares is not None:
            extend = "max" if limit < every.max() else "neither"
            figure.colorbar(squares, ax=axes, label=quantity, aspect=30, extend=extend)
    return figure


def _draw_line(ax: Axes, tests: FloatArray, quantity: str, most: float, *, whole: bool) -> None:
    """Values over force or frequency ratio, up to the largest of all materials."""
    over_force = len(levels(tests[0].tolist())) < 2
    along, values = tests[:, np.argsort(tests[int(over_force)])][[int(over_force), 2]]
    values = np.where(values == AT_REST, 0.0, values)
    ax.plot(along, values, "o" if over_force else "o-", color=MEASURED, markersize=3.0, linewidth=0.6)
    top = most or 1.0
    ax.set(xlabel="normal force [N]" if over_force else "frequency ratio r", ylabel=quantity)
    ax.set(xlim=(0.0, 1.05 * max(along)), ylim=(-0.06 * top, 1.12 * top))
    ax.yaxis.set_major_locator(MaxNLocator(4, integer=whole))


def colour_limit(values: FloatArray) -> float:
    """Where a colour scale of these numbers ends: above it are a few, as of the most irregular test."""
    known = values[np.isfinite(values)]
    return max(float(np.percentile(known, PERCENTILE)) if known.size else 1.0, 1e-6)


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
                top = colour_limit(values)
                colours: dict[str, Any] = classes.mapped if classes else {"norm": Normalize(0.0, top)}
                mesh = ax.pcolormesh(along, rest[0][1], values.T, shading="nearest", rasterized=True, **colours)
                if classes:
                    classes.bar(figure, mesh, ax)
                else:
                    figure.colorbar(mesh, ax=ax, extend="max" if np.nanmax(values, initial=0.0) > top else "neither")
                ax.set_ylabel(rest[0][0])
                ax.grid(visible=False)
            else:
                ax.plot(along, np.maximum(values, 0.0), color=BLUE, marker=".", markersize=2.5)
    return figure
