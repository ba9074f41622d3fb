"""A whole record over its prediction: over time with a zoom, period by period, and where the two part."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.figures.response import thinned
from frictionlab.figures.style import (
    BASE,
    GREY,
    MEASURED,
    PAGE,
    PREDICTED,
    VERMILION,
    caution,
    headline,
    look,
    new_figure,
)
from frictionlab.inference import WholeRecord

ZOOM = 3  # periods of the drive that the zoom shows
FLAT = 0.01  # relative: friction is drawn over at least so much up and down
MANY = 200  # periods, beyond which points are drawn small


def record_figure(record: WholeRecord, title: str = "whole record") -> Figure:
    """The record, a zoom of its worst periods, energy per cycle measured against predicted, misfit over time."""
    with look():
        figure = new_figure(PAGE, 5.6)
        axes = figure.subplot_mosaic([["all"] * 3, ["zoom"] * 3, ["energy", "friction", "misfit"]])
        draw_overlay(record, axes["all"])
        draw_zoom(record, axes["zoom"])
        draw_energy(record, axes["energy"])
        draw_friction(record, axes["friction"])
        draw_misfit(record, axes["misfit"])
        numbers = f"record nrmse {100 * record.nrmse:.2g} %, energy {100 * record.energy_difference:+.2g} %"
        headline(figure, f"{title}: {numbers}")
        caution(figure, record.warnings)
        return figure


def draw_overlay(record: WholeRecord, ax: Axes) -> Axes:
    """Measured over predicted from the first sample to the last; where the two part is shaded, the zoom framed."""
    _draw_part(record, ax, np.arange(len(record.time)))
    part = _zoomed(record)
    ax.axvspan(record.time[part[0]], record.time[part[-1]], fill=False, edgecolor=GREY, lw=0.7)
    for begin, end, _ in record.left:
        ax.axvspan(begin, end, color=VERMILION, alpha=0.12, linewidth=0.0)
    ax.legend(loc="upper right", ncols=3)
    ax.margins(y=0.2)
    return ax


def draw_zoom(record: WholeRecord, ax: Axes) -> Axes:
    """The same around the period with the largest misfit."""
    _draw_part(record, ax, _zoomed(record))
    return ax


def _zoomed(record: WholeRecord) -> "np.ndarray[tuple[int], np.dtype[np.intp]]":
    """Numbers of the samples that the zoom shows."""
    per = max(1, len(record.time) // max(1, len(record.cycle_nrmse)))
    worst = int(np.argmax(record.cycle_nrmse)) if len(record.cycle_nrmse) else 0
    begin = max(0, min((worst - ZOOM // 2) * per, len(record.time) - ZOOM * per))
    return np.arange(begin, min(begin + ZOOM * per, len(record.time)))


def _draw_part(record: WholeRecord, ax: Axes, part: "np.ndarray[tuple[int], np.dtype[np.intp]]") -> None:
    for values, color, width, label in (
        (record.base, BASE, 0.7, "base"),
        (record.measured, MEASURED, 1.8, "measured"),
        (record.predicted, PREDICTED, 0.8, "predicted"),
    ):
        some = part[thinned(values[part])]
        ax.plot(record.time[some], values[some], color=color, lw=width, alpha=0.6 if width > 1 else 1.0, label=label)
    ax.set(xlabel="time [s]", ylabel="x / Y")


def draw_energy(record: WholeRecord, ax: Axes) -> Axes:
    """Energy of each period of the drive, measured and predicted."""
    ax.plot(record.cycle_time, record.cycle_measured, "o", ms=_size(record), color=MEASURED, label="measured")
    ax.plot(record.cycle_time, record.cycle_predicted, "-", lw=1.0, color=PREDICTED, label="predicted")
    ax.set(xlabel="time [s]", ylabel="energy per period [kY²]")
    ax.legend()
    return ax


def _size(record: WholeRecord) -> float:
    """Size of a period's point: in a long record points would hide each other."""
    return 3.0 if len(record.cycle_time) <= MANY else 0.8


def draw_friction(record: WholeRecord, ax: Axes) -> Axes:
    """Friction ratio of each period as a random walk, with its standard error."""
    error = np.nan_to_num(record.cycle_friction_se)
    low, high = record.cycle_friction - error, record.cycle_friction + error
    ax.fill_between(record.cycle_time, low, high, color=PREDICTED, alpha=0.2, lw=0)
    ax.plot(record.cycle_time, record.cycle_friction, color=PREDICTED, lw=1.0)
    if len(record.cycle_friction):
        middle = float(np.median(record.cycle_friction))
        ends = [*ax.get_ylim(), middle * (1.0 - FLAT), middle * (1.0 + FLAT)]
        ax.set_ylim(min(ends), max(ends))  # what changes by less looks as flat as it is
    ax.ticklabel_format(axis="y", useOffset=False)
    ax.set(xlabel="time [s]", ylabel="friction ratio")
    return ax


def draw_misfit(record: WholeRecord, ax: Axes) -> Axes:
    """Misfit of each period over the response's rms; the usual one as a line."""
    ax.plot(record.cycle_time, 100 * record.cycle_nrmse, "o-", ms=_size(record), lw=0.8, color=PREDICTED)
    if len(record.cycle_nrmse):
        ax.axhline(100 * float(np.median(record.cycle_nrmse)), color=GREY, lw=0.8)
    ax.set(xlabel="time [s]", ylabel="nrmse of a period [%]")
    ax.set_ylim(bottom=0.0)
    return ax
