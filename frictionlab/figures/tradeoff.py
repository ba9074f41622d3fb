"""What accuracy costs: error over time of the settings of each knob, with the front that none beats and the default."""

import math
from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.figures.style import BLUE, GREY, PAGE, VERMILION, look, new_figure

if TYPE_CHECKING:
    from frictionlab.tradeoff.setting import Setting

FLOOR = 1e-16  # an error of zero is drawn here
PLACES = ((5, 4), (5, -8), (5, 12))  # of a label beside its point, in turn: neighbours often lie on one spot


def family_figure(knobs: Sequence[Sequence["Setting"]]) -> Figure:
    """One panel for each knob of a family."""
    with look():
        columns = min(2, len(knobs))
        rows = math.ceil(len(knobs) / columns)
        figure = new_figure(PAGE, 2.6 * rows)
        panels = figure.subplots(rows, columns, squeeze=False).ravel().tolist()
        for settings, ax in zip(knobs, panels, strict=False):
            draw_knob(settings, ax)
        for ax in panels[len(knobs) :]:
            ax.set_axis_off()
    return figure


def draw_knob(settings: Sequence["Setting"], ax: Axes) -> Axes:
    """Settings as points, the Pareto front as a line through those that none beats, the default as a ring."""
    from frictionlab.tradeoff.setting import pareto_front  # noqa: PLC0415 - the room it draws is heavy

    front = falling(pareto_front(settings))
    ax.plot([s.seconds for s in front], [_drawn(s) for s in front], color=BLUE, linewidth=0.8, zorder=1)
    for s, place in zip(settings, cycle(PLACES), strict=False):
        ax.plot(s.seconds, _drawn(s), "o", markersize=4.0, color=GREY if s.dominated else BLUE, zorder=2)
        if s.default:
            ax.plot(s.seconds, _drawn(s), "o", markersize=9.0, markerfacecolor="none", color=VERMILION, zorder=3)
        ax.annotate(s.setting, (s.seconds, _drawn(s)), place, textcoords="offset points", fontsize=5.5)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.margins(x=0.25, y=0.15)
    ax.set_xlabel("time [s]")
    ax.set_ylabel(f"relative error of {settings[0].quantity}", fontsize=6.5)
    ax.set_title(f"{settings[0].knob} (ring: default)")
    return ax


def falling(front: Sequence["Setting"]) -> list["Setting"]:
    """Those of a front, from the fastest on, that err less than all faster ones."""
    return [s for i, s in enumerate(front) if all(s.error < faster.error for faster in front[:i])]


def _drawn(setting: "Setting") -> float:
    return max(setting.error, FLOOR)
