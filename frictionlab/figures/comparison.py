"""Measured over predicted: the time response of a steady cycle and the hysteresis loop, in one figure."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.figures.style import BASE, MEASURED, PAGE, PREDICTED, caution, headline, look, new_figure
from frictionlab.inference import Comparison

TURN = 2 * math.pi


def draw_response(comparison: Comparison, ax: Axes) -> Axes:
    """Time response over one steady cycle, measured over predicted, the base behind them."""
    turns = np.append(comparison.tau / TURN, 1.0)
    ax.plot(turns, _closed(comparison.base), color=BASE, lw=0.9, ls=":", label="base")
    ax.plot(turns, _closed(comparison.measured), color=MEASURED, lw=2.2, alpha=0.55, label="measured")
    if comparison.predicted is not None:
        centred = comparison.predicted - comparison.predicted.mean()
        ax.plot(turns, _closed(centred), color=PREDICTED, lw=1.0, label="predicted")
    ax.set(xlabel="drive cycle, ωt / 2π", ylabel="displacement, x / Y", xlim=(0, 1))
    ax.legend(loc="upper center", ncols=3)
    ax.margins(y=0.18)
    return ax


def draw_loop(comparison: Comparison, ax: Axes) -> Axes:
    """Hysteresis loop, base over mass (eq. 2.18): its area is the energy per cycle."""
    base = _closed(comparison.base)
    ax.plot(_closed(comparison.measured), base, color=MEASURED, lw=2.2, alpha=0.55, label="measured")
    if comparison.predicted is not None:
        centred = comparison.predicted - comparison.predicted.mean()
        ax.plot(_closed(centred), base, color=PREDICTED, lw=1.0, label="predicted")
    ax.set(xlabel="displacement of the mass, x / Y", ylabel="displacement of the base, y / Y")
    return ax


def comparison_figure(comparison: Comparison) -> Figure:
    """Both of them, with the numbers in a line above each."""
    with look():
        figure = new_figure(PAGE, 3.1)
        response, loop = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
        draw_response(comparison, response).set_title(_response_title(comparison))
        draw_loop(comparison, loop).set_title(_loop_title(comparison))
        name = comparison.source.replace("\\", "/").rsplit("/", 1)[-1]
        headline(figure, f"{name}: {comparison.model}{_verdict(comparison)}")
        caution(figure, comparison.warnings)
        return figure


def _response_title(comparison: Comparison) -> str:
    error = comparison.friction.error
    beta = f"β = {comparison.friction_ratio:.4g}" + (f" ± {error:.1g}" if error else "")
    nrmse = comparison.response_nrmse
    fit = "no prediction" if nrmse is None else f"nrmse {100 * nrmse:.2g} %"
    return f"r = {comparison.frequency_ratio:.5g}   {beta}   {fit}"


def _verdict(comparison: Comparison) -> str:
    if comparison.verdict is None:
        return ""
    said = "explained" if comparison.verdict == "explained" else "not explained"
    return f": {said}, what is left is {comparison.misfit:.2g} times the measurement's error"


def _loop_title(comparison: Comparison) -> str:
    predicted = comparison.predicted_energy_per_cycle
    versus = "" if predicted is None else f", predicted {predicted:.4g}"
    return f"energy {comparison.energy_per_cycle:.4g}{versus} kY²"


def _closed(values: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> "np.ndarray[tuple[int], np.dtype[np.float64]]":
    """A cycle with its first point repeated at the end."""
    return np.append(values, values[:1])
