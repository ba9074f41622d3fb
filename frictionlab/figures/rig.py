"""The drawing of the rig that the documents show: what moves, what is measured, what rubs.

python -m frictionlab.figures.rig configs/rig.svg
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.figures.style import BASE, BLACK, BLUE, MEASURED, VERMILION, look, new_figure, save

BACK = {"arrowstyle": "<->", "lw": 1.2}


def rig_figure() -> Figure:
    """The frame as one mass on a spring, its moving base, the contact with a fixed wall, and the two lasers."""
    with look():
        figure = new_figure(6.4, 2.6)
        ax = figure.subplots()
        draw_rig(ax)
    return figure


def draw_rig(ax: Axes) -> Axes:
    """Base on the left, spring k and dashpot c, mass m, and the contact that presses on it from above."""
    _box(ax, (0.0, 0.4, 1.0, 1.8), "base", BASE)
    _box(ax, (4.0, 0.4, 1.8, 1.8), "mass m", MEASURED)
    _spring(ax, 1.0, 4.0, 1.75)
    _dashpot(ax, 1.0, 4.0, 0.85)
    _box(ax, (4.55, 2.2, 0.7, 0.3), "", VERMILION)
    ax.annotate("", (4.9, 2.5), (4.9, 3.15), arrowprops={"arrowstyle": "->", "lw": 1.2})
    ax.text(5.05, 2.85, "normal force N, the contact held by a wall", va="center")
    ax.text(5.95, 2.32, "friction force F = friction coefficient times N", va="center", color=VERMILION)
    for x, word, color in ((0.5, "y(t): base, laser 1", BASE), (4.9, "x(t): mass, laser 2", BLUE)):
        ax.annotate("", (x - 0.7, 0.1), (x + 0.7, 0.1), arrowprops={**BACK, "color": color})
        ax.text(x, -0.12, word, ha="center", va="top", color=color)
    ax.set(xlim=(-0.8, 9.4), ylim=(-0.5, 3.3), aspect="equal")
    ax.set_axis_off()
    return ax


def _box(ax: Axes, place: tuple[float, float, float, float], word: str, color: str) -> None:
    left, low, width, height = place
    ax.fill_between((left, left + width), low, low + height, facecolor=color, alpha=0.25, edgecolor=BLACK)
    ax.text(left + width / 2, low + height / 2, word, ha="center", va="center")


def _spring(ax: Axes, left: float, right: float, height: float) -> None:
    turns = np.linspace(left + 0.6, right - 0.6, 13)
    zigzag = height + 0.18 * np.array([0, *(1, -1) * 5, 1, 0])
    ax.plot([left, *turns, right], [height, *zigzag, height], color=BLACK)
    ax.text((left + right) / 2, height + 0.27, "spring k", ha="center")


def _dashpot(ax: Axes, left: float, right: float, height: float) -> None:
    middle = (left + right) / 2
    ax.plot((left, middle), (height, height), color=BLACK)
    ax.plot((middle, middle), (height - 0.12, height + 0.12), color=BLACK, lw=2.0)
    ax.plot((middle + 0.3, middle - 0.2), (height + 0.2, height + 0.2), color=BLACK)
    ax.plot((middle + 0.3, middle - 0.2), (height - 0.2, height - 0.2), color=BLACK)
    ax.plot((middle + 0.3, middle + 0.3), (height - 0.2, height + 0.2), color=BLACK)
    ax.plot((middle + 0.3, right), (height, height), color=BLACK)
    ax.text(middle + 0.42, height + 0.1, "dashpot c", ha="left")


if __name__ == "__main__":
    save(rig_figure(), Path(sys.argv[1]))
