"""The response to a recorded base motion: mass and base over time, contact force, and the loop of friction."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from frictionlab.figures.style import BASE, GREY, PREDICTED, caution, look, new_figure

if TYPE_CHECKING:
    from frictionlab.base_motion import RecordResponse

MOST_POINTS = 4000  # of a line: more cannot be seen in print
MOST_STOPS = 200  # shaded one by one


def response_figure(answer: "RecordResponse") -> Figure:
    """Displacements over time with the stops shaded; below, the force of the contact over time and over the way."""
    with look():
        figure = new_figure(height=4.2)
        axes = figure.subplot_mosaic([["motion", "motion"], ["force", "loop"]], width_ratios=(1.8, 1.0))
        draw_displacements(answer, axes["motion"])
        draw_force(answer, axes["force"])
        draw_loop(answer, axes["loop"])
        caution(figure, answer.warnings)
    return figure


def draw_displacements(answer: "RecordResponse", ax: Axes) -> Axes:
    """Base and mass over time, in mm."""
    part = answer.recording
    time = part.time
    some = thinned(part.base_displacement)
    ax.plot(time[some], 1e3 * (part.base_displacement - part.base_displacement[0])[some], color=BASE, label="base")
    some = thinned(part.mass_displacement)
    ax.plot(time[some], 1e3 * part.mass_displacement[some], color=PREDICTED, label="mass, simulated")
    stops = answer.response.intervals_stuck / (2.0 * np.pi * answer.natural_frequency_hz) + time[0]
    for begin, end in stops if len(stops) <= MOST_STOPS else ():
        ax.axvspan(begin, end, color=GREY, alpha=0.25, linewidth=0.0)
    ax.set_xlabel("time [s]")
    ax.set_ylabel("displacement [mm]")
    ax.margins(y=0.18)
    ax.legend(loc="upper right", ncols=2)
    return ax


def draw_force(answer: "RecordResponse", ax: Axes) -> Axes:
    """Force of the contact over time."""
    some = thinned(answer.response.contact_force)
    ax.plot(answer.recording.time[some], answer.response.contact_force[some], color=PREDICTED, linewidth=0.8)
    ax.set_xlabel("time [s]")
    ax.set_ylabel("contact force over $kY$")
    return ax


def draw_loop(answer: "RecordResponse", ax: Axes) -> Axes:
    """Force of the contact over the way along the wall: its area is what friction dissipates."""
    response = answer.response
    way = response.relative_displacement if response.problem.wall == "base" else response.displacement
    last = slice(max(0, len(way) - MOST_POINTS), None)
    ax.plot(way[last], response.contact_force[last], color=PREDICTED, linewidth=0.6)
    ax.set_xlabel("mass over $Y$")
    ax.set_ylabel("contact force over $kY$")
    return ax


def thinned(values: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return indices that show a long line as it is: the least and the largest of each part, in order."""
    part = -(-2 * len(values) // MOST_POINTS)
    if part < 3:
        return np.arange(len(values))
    whole = len(values) // part * part
    rows = values[:whole].reshape(-1, part)
    begin = np.arange(0, whole, part)
    both = np.sort(np.stack([begin + rows.argmin(axis=1), begin + rows.argmax(axis=1)], axis=1), axis=1)
    return np.concatenate([both.ravel(), np.arange(whole, len(values))])
