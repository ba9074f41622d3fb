"""How errors grow: with the number of cycles, towards resonance, with noise; beside each what was to be expected."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.figures.style import PAGE, PALETTE, look, new_figure, save

if TYPE_CHECKING:
    from frictionlab.tradeoff.stability import Growth

FLOOR = 1e-17  # an error of zero is drawn here


def stability_figure(panels: Sequence[Sequence["Growth"]]) -> Figure:
    """One panel for each cause of error."""
    with look():
        figure = new_figure(PAGE, 2.8)
        for growths, ax in zip(panels, figure.subplots(1, len(panels)).ravel().tolist(), strict=True):
            draw_growth(growths, ax)
    return figure


def draw_growth(growths: Sequence["Growth"], ax: Axes) -> Axes:
    """Errors as points, what was to be expected as dashed lines of the same colour."""
    for growth, color in zip(growths, PALETTE, strict=False):
        ax.plot(growth.x, np.maximum(growth.error, FLOOR), "o", markersize=3.0, color=color, label=growth.name)
        ax.plot(growth.x, growth.law, "--", linewidth=0.8, color=color)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel(growths[0].x_name)
    ax.set_ylabel("error")
    ax.set_title(f"dashed: {growths[0].law_name}")
    ax.legend(fontsize=5.5)
    return ax


def main(folder: Path) -> None:
    """Measure and draw; used by ``make stability``."""
    from frictionlab.tradeoff import stability  # noqa: PLC0415 - the room it draws is heavy

    folder.mkdir(parents=True, exist_ok=True)
    panels = (stability.over_cycles(), stability.towards_resonance(), stability.with_noise())
    save(stability_figure(panels), folder / "stability.png", force=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
