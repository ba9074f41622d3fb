"""What the contact does: its force recovered from the motion, the identified law over it, what is left, the ladder."""

import math
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

from frictionlab.figures.style import BASE, MEASURED, PAGE, PREDICTED, headline, look, new_figure
from frictionlab.identification import ContactForce

FloatArray = NDArray[np.float64]
TURN = 2.0 * np.pi
STILL = 1e-9  # of omega Y: a contact that is slower stands
SHORTEST = 0.1  # of a cycle: a slide that has room for its name
RIGHT = 0.62  # of the ladder's width: where the names stand
WORDS = 0.09  # of the ladder's height: a line of words


def draw_force(contact: ContactForce, ax: Axes, *, over_speed: bool) -> Axes:
    """Force of the contact over displacement or speed: as recovered, no law assumed, and as the law has it."""
    way = contact.velocity if over_speed else contact.displacement
    ax.plot(_closed(way), _closed(contact.force), color=MEASURED, lw=2.0, alpha=0.55, label="recovered from the motion")
    law_way = contact.law_velocity if over_speed else contact.law_displacement
    if law_way is not None and contact.law_force is not None:
        ax.plot(_closed(law_way), _closed(contact.law_force), color=PREDICTED, lw=1.0, label=contact.law)
    ax.set(xlabel="speed, v / ωY" if over_speed else "displacement, x / Y", ylabel="force of the contact, n / kY")
    return ax


def draw_residual(contact: ContactForce, ax: Axes) -> Axes:
    """What the law misses over the cycle, stops shaded; the band is the standard error of the mean cycle."""
    turns = contact.tau / TURN
    for edge in (-contact.floor, contact.floor):
        ax.axhline(edge, color=BASE, lw=0.8, ls=":", label="standard error of the mean cycle" if edge > 0.0 else None)
    if contact.residual is not None:
        ax.plot(turns, contact.residual, color=MEASURED, lw=1.0)
    if contact.law_velocity is not None:
        _draw_ways(turns, contact.law_velocity, ax)
    ax.set(xlabel="drive cycle, ωt / 2π (stops shaded)", ylabel="measured - predicted, x / Y", xlim=(0, 1))
    ax.margins(y=0.2)
    ax.legend(loc="lower right", fontsize=6)
    return ax


def _draw_ways(turns: FloatArray, velocity: FloatArray, ax: Axes) -> None:
    """Shade the stops, and say of each slide which way it goes."""
    above = ax.get_xaxis_transform()
    way = np.where(np.abs(velocity) < STILL, 0, np.sign(velocity)).astype(int)
    ax.fill_between(turns, 0, 1, where=way == 0, transform=above, color=BASE, alpha=0.2, lw=0)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(way)) + 1, [len(way)]])
    for first, after in pairwise(starts.tolist()):
        if way[first] != 0 and after - first > SHORTEST * len(way):
            middle = 0.5 * (turns[first] + turns[after - 1])
            words = "slides up" if way[first] > 0 else "slides down"
            ax.text(middle, 0.97, words, transform=above, ha="center", va="top", fontsize=6)


def draw_ladder(contact: ContactForce, ax: Axes) -> Axes:
    """Misfit of each law tried over its number of parameters; the one required is ringed."""
    best = contact.laws[contact.law][2] if contact.law in contact.laws else 0.0
    told = sorted(contact.laws.items(), key=lambda law: -law[1][1])
    heights = _apart([math.log10(nrmse) for _, (_, nrmse, _) in told])
    for (name, (count, nrmse, evidence)), height in zip(told, heights, strict=True):
        chosen = name == contact.law
        color = PREDICTED if chosen else MEASURED
        ax.plot(count, 100 * nrmse, "o", color=color, ms=7 if chosen else 4)
        words = f"{name.removeprefix('coulomb') or 'coulomb'} ({'required' if chosen else f'{evidence - best:+.0f}'})"
        ax.annotate(
            words, (count, 100 * nrmse), (RIGHT, 100 * 10**height), xycoords="data",
            textcoords=("axes fraction", "data"), fontsize=6, va="center", color=color,
            arrowprops={"arrowstyle": "-", "lw": 0.3, "color": BASE},
        )  # fmt: skip
    ax.set(xlabel="parameters of the law (log evidence against required)", ylabel="nrmse [%]", yscale="log")
    counts = [count for count, _, _ in contact.laws.values()]
    ax.set_xlim(min(counts) - 0.3, max(counts) + (max(counts) - min(counts) + 1) * (1.0 / RIGHT - 1.0) * 1.4)
    ax.set_xticks(sorted(set(counts)))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_minor_formatter(FuncFormatter(lambda value, _: f"{value:g}" if _first(value) in (2, 5) else ""))
    return ax


def _first(value: float) -> int:
    """First digit of a number."""
    return int(f"{value:e}"[0])


def _apart(heights: list[float]) -> list[float]:
    """The same heights, highest first, moved up as far as words need to be read beside each other."""
    if not heights:
        return []
    step = max(max(heights) - min(heights), 0.3) * WORDS
    found = [heights[-1]]
    for height in heights[-2::-1]:
        found.append(max(height, found[-1] + step))
    return found[::-1]


def contact_figure(contact: ContactForce, title: str | None = None) -> Figure:
    """Force over displacement and speed, the residual, and the ladder where one was climbed."""
    with look():
        figure = new_figure(PAGE, 5.0)
        panels = figure.subplot_mosaic([["x", "v"], ["left", "ladder" if contact.laws else "left"]])
        draw_force(contact, panels["x"], over_speed=False).legend(loc="best", fontsize=6)
        draw_force(contact, panels["v"], over_speed=True)
        draw_residual(contact, panels["left"])
        if contact.laws:
            draw_ladder(contact, panels["ladder"])
        name = (title or contact.source).replace("\\", "/").rsplit("/", 1)[-1]
        headline(figure, f"{name}: {contact.law}")
        return figure


def _closed(values: FloatArray) -> FloatArray:
    return np.append(values, values[:1])
