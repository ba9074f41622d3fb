"""All steady motions of one oscillator: each over its period, and as speed over displacement."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.figures.style import BASE, PAGE, PALETTE, caution, headline, look, new_figure

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frictionlab.simulator import Attractor, SteadyState

SAMPLES = 1000  # per cycle
TURN = 2.0 * np.pi
MOST = len(PALETTE)  # motions drawn, the most visited first


def coexisting_figure(found: "Sequence[Attractor]") -> Figure:
    """A row for each motion, with its share: displacement over its period beside speed over displacement."""
    drawn = [attractor for attractor in found if attractor.state.orbit is not None][:MOST]
    with look():
        figure = new_figure(PAGE, 0.6 + 1.7 * max(1, len(drawn)))
        axes = figure.subplots(max(1, len(drawn)), 2, squeeze=False, width_ratios=(3, 1), sharex="col")
        for (left, right), attractor, color in zip(axes, drawn, PALETTE, strict=False):
            _over_time(attractor.state, left, color).set_title(_words(attractor), fontsize=7.0)
            _path(attractor.state, right, color)
        for ax in axes[-1]:
            ax.xaxis.label.set_visible(True)
        if not drawn:
            figure.clear()
        problem = found[0].state.problem
        told = ", ".join(f"{name} {value:g}" for name, value in problem.parameters.items())
        headline(figure, f"all steady motions found: r {problem.r:g}, {problem.law.name}: {told}")
        left_out = [_words(attractor) for attractor in found if attractor not in drawn]
        caution(figure, tuple(dict.fromkeys((*left_out, *(said for each in drawn for said in each.state.warnings)))))
    return figure


def _words(attractor: "Attractor") -> str:
    state = attractor.state
    share = f"{100.0 * attractor.share:.3g} % of the starts"
    if state.outcome != "periodic":
        return f"{share}: {state.outcome}"
    cycles = "every cycle" if state.period_cycles == 1 else f"after {state.period_cycles} cycles"
    return f"{share}: repeats {cycles}, {state.energy_per_cycle:.4g} $kY^2$ per cycle"


def _over_time(state: "SteadyState", ax: Axes, color: str) -> Axes:
    """Displacement of mass and base over the period."""
    tau, x, _ = _sampled(state)
    ax.plot(tau / TURN, state.problem.base.at(tau), color=BASE, linewidth=0.8)
    ax.plot(tau / TURN, x, color=color)
    ax.set(xlabel="time / cycle (grey: the base)", ylabel="displacement / $Y$")
    return ax


def _path(state: "SteadyState", ax: Axes, color: str) -> Axes:
    """Speed over displacement; a dot where each cycle begins."""
    _, x, v = _sampled(state)
    ax.plot(x, v, color=color)
    ax.plot(x[:-1:SAMPLES], v[:-1:SAMPLES], ".", color="black", markersize=4.0)
    ax.set(xlabel="displacement / $Y$", ylabel=r"speed / $\omega Y$")
    return ax


def _sampled(state: "SteadyState") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time over one period, from where a cycle begins, displacement and speed."""
    tau = TURN * np.linspace(0.0, state.period_cycles or 1, SAMPLES * (state.period_cycles or 1) + 1)
    if state.orbit is None:
        raise ValueError("this steady state has no motion to draw")
    return (tau, *state.orbit.at(tau))
