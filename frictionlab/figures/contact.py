"""What the contact does: its force recovered from the motion, the identified law over it, what is left, the ladder."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.figures.style import BASE, MEASURED, PAGE, PREDICTED, headline, look, new_figure
from frictionlab.identification import ContactForce

TURN = 2.0 * np.pi


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
    ax.axhspan(-contact.floor, contact.floor, color=BASE, alpha=0.25, lw=0, label="standard error")
    if contact.residual is not None:
        ax.plot(turns, contact.residual, color=MEASURED, lw=1.0)
    if contact.law_velocity is not None:
        stands = np.abs(contact.law_velocity) < 1e-9
        ax.fill_between(turns, 0, 1, where=stands, transform=ax.get_xaxis_transform(), color=BASE, alpha=0.15, lw=0)
    ax.set(xlabel="drive cycle, ωt / 2π (stops shaded)", ylabel="measured - predicted, x / Y", xlim=(0, 1))
    return ax


def draw_ladder(contact: ContactForce, ax: Axes) -> Axes:
    """Misfit of each law tried over its number of parameters; the one required is ringed."""
    for name, (count, nrmse, _) in contact.laws.items():
        chosen = name == contact.law
        ax.plot(count, 100 * nrmse, "o", color=PREDICTED if chosen else MEASURED, ms=7 if chosen else 4)
        if chosen or count <= 2:
            ax.annotate(name, (count, 100 * nrmse), textcoords="offset points", xytext=(6, 2), fontsize=6)
    ax.set(xlabel="parameters of the law", ylabel="nrmse [%]", yscale="log")
    ax.margins(x=0.35)
    return ax


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


def _closed(values: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
    return np.append(values, values[:1])
