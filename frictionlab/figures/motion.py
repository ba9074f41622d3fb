"""One steady motion: displacement over a cycle with its stops, the loop whose area is the energy, the contact's law."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.figures.style import BASE, GREY, PREDICTED, caution, look, new_figure

if TYPE_CHECKING:
    from frictionlab.simulator import SteadyState

SAMPLES = 2000  # per cycle: smooth in print


def motion_figure(state: "SteadyState") -> Figure:
    """Displacement over the period beside the hysteresis loop, and the contact's force; the state has an orbit."""
    with look():
        figure = new_figure(height=5.0)
        grid = figure.add_gridspec(2, 4)
        draw_motion(state, figure.add_subplot(grid[0, :3]))
        draw_loop(state, figure.add_subplot(grid[0, 3]))
        force_over_displacement(state, figure.add_subplot(grid[1, :2]))
        force_over_speed(state, figure.add_subplot(grid[1, 2:]))
        figure.suptitle(state.verdict, fontsize=8.0)
        caution(figure, state.warnings)
    return figure


def draw_motion(state: "SteadyState", ax: Axes) -> Axes:
    """Displacement of mass and base over two periods; stops are shaded."""
    tau = _times(state, 2)
    ax.plot(tau / np.pi, state.problem.base.at(tau), color=BASE, linewidth=0.8, label="base $y/Y$")
    ax.plot(tau / np.pi, _displacement(state, tau), color=PREDICTED, label="mass $x/Y$")
    for begin, end in state.orbit.stops if state.orbit is not None else ():
        for shift in (0.0, state.orbit.end - state.orbit.start) if state.orbit is not None else ():
            ax.axvspan((begin + shift) / np.pi, (end + shift) / np.pi, color=GREY, alpha=0.25, linewidth=0.0)
    ax.set_xlim(tau[0] / np.pi, tau[-1] / np.pi)
    ax.set_xlabel(r"phase of the drive $\tau/\pi$")
    ax.set_ylabel("displacement over $Y$")
    ax.margins(y=0.18)
    ax.legend(loc="upper right", ncols=2)
    return ax


def draw_loop(state: "SteadyState", ax: Axes) -> Axes:
    """Base motion against displacement of the mass: the area is the energy per cycle (2.18)."""
    tau = _times(state, 1)
    ax.plot(_displacement(state, tau), state.problem.base.at(tau), color=PREDICTED)
    ax.set_xlabel("mass $x/Y$")
    ax.set_ylabel("base $y/Y$")
    return ax


def force_over_displacement(state: "SteadyState", ax: Axes, color: str = PREDICTED) -> Axes:
    """Draw the contact's force over the mass's displacement, over one period."""
    x, _, n = _sampled(state)
    ax.plot(x, n, color=color)
    ax.set(xlabel="mass relative to the wall $z/Y$", ylabel="contact's force over $kY$")
    return ax


def force_over_speed(state: "SteadyState", ax: Axes, color: str = PREDICTED) -> Axes:
    """Draw the contact's force over the mass's speed, over one period."""
    _, v, n = _sampled(state)
    ax.plot(v, n, color=color)
    ax.set(xlabel=r"speed relative to the wall over $\omega Y$", ylabel="contact's force over $kY$")
    return ax


def _times(state: "SteadyState", periods: int) -> np.ndarray:
    """Times over a number of periods; one only where the motion does not repeat."""
    if state.orbit is None:
        raise ValueError("this steady state has no motion to draw")
    begin, end = state.orbit.start, state.orbit.end
    count = periods if state.orbit.periodic else 1
    return np.linspace(begin, begin + count * (end - begin), count * SAMPLES)[: -1 if count == 1 else None]


def _displacement(state: "SteadyState", tau: np.ndarray) -> np.ndarray:
    """Displacement of the mass at times tau."""
    if state.orbit is None:
        raise ValueError("this steady state has no motion to draw")
    return state.orbit.at(tau)[0]


def _sampled(state: "SteadyState") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacement and speed relative to the wall, and the contact's force, over one period."""
    if state.orbit is None:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    phase = np.linspace(state.orbit.start, state.orbit.end, 3000)
    x, v = state.orbit.at(phase)
    if state.problem.wall == "base":
        x, v = x - state.problem.base.at(phase), v - state.problem.base.rate_at(phase)
    return x, v, state.orbit.force(phase)
