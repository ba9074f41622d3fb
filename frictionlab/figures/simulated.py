"""What was simulated: a steady motion, all motions of one oscillator, the response to a recorded base."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.figures.style import (
    BASE,
    GREY,
    MOST_POINTS,
    PAGE,
    PALETTE,
    PREDICTED,
    TURN,
    caution,
    headline,
    look,
    new_figure,
    thinned,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frictionlab.base_motion import RecordResponse
    from frictionlab.simulator import Attractor, SteadyState
    from frictionlab.simulator.several import StructureState

SAMPLES = 2000  # per cycle: smooth in print
PER_CYCLE = 1000  # per cycle
MOST_MOTIONS = len(PALETTE)  # motions drawn, the most visited first
MOST_STOPS = 200  # shaded one by one


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


def structure_figure(state: "StructureState") -> Figure:
    """Displacements of base and masses over the period, and each contact's force over its displacement."""
    structure, motion = state.structure, state.motion
    if motion is None:
        raise ValueError("this steady state has no motion to draw")
    tau = np.linspace(motion.start, motion.end, SAMPLES * (state.period_cycles or 1))
    q, _ = motion.at(tau)
    base, force = structure.base.at(tau), motion.force(tau)
    with look():
        figure = new_figure(height=5.0)
        grid = figure.add_gridspec(2, max(1, len(structure.contacts)))
        ax = figure.add_subplot(grid[0, :])
        ax.plot(tau / np.pi, base, color=BASE, linewidth=0.8, label="base $y/Y$")
        for mass in range(structure.masses):
            ax.plot(tau / np.pi, q[:, mass], color=PALETTE[mass % len(PALETTE)], label=f"mass {mass + 1}")
        ax.set(xlabel=r"phase of the drive $\tau/\pi$", ylabel="displacement over $Y$")
        ax.margins(y=0.18)
        ax.legend(loc="upper right", ncols=1 + structure.masses)
        for number, contact in enumerate(structure.contacts):
            against = f"mass {contact.against}" if isinstance(contact.against, int) else f"the {contact.against}"
            place = q @ structure.row(contact) - (base if contact.against == "base" else 0.0)
            below = figure.add_subplot(grid[1, number])
            below.plot(place, force[:, number], color=PREDICTED)
            below.set_title(f"mass {contact.mass} against {against}", fontsize=7.0)
            below.set(xlabel="relative displacement over $Y$", ylabel="contact's force over $k_1Y$")
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
    x, _, n = _in_contact(state)
    ax.plot(x, n, color=color)
    ax.set(xlabel="mass relative to the wall $z/Y$", ylabel="contact's force over $kY$")
    return ax


def force_over_speed(state: "SteadyState", ax: Axes, color: str = PREDICTED) -> Axes:
    """Draw the contact's force over the mass's speed, over one period."""
    _, v, n = _in_contact(state)
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


def _in_contact(state: "SteadyState") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Displacement and speed relative to the wall, and the contact's force, over one period."""
    if state.orbit is None:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    phase = np.linspace(state.orbit.start, state.orbit.end, 3000)
    x, v = state.orbit.at(phase)
    if state.problem.wall == "base":
        x, v = x - state.problem.base.at(phase), v - state.problem.base.rate_at(phase)
    return x, v, state.orbit.force(phase)


def coexisting_figure(found: "Sequence[Attractor]") -> Figure:
    """A row for each motion, with its share: displacement over its period beside speed over displacement."""
    drawn = [attractor for attractor in found if attractor.state.orbit is not None][:MOST_MOTIONS]
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
    ax.plot(x[:-1:PER_CYCLE], v[:-1:PER_CYCLE], ".", color="black", markersize=4.0)
    ax.set(xlabel="displacement / $Y$", ylabel=r"speed / $\omega Y$")
    return ax


def _sampled(state: "SteadyState") -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time over one period, from where a cycle begins, displacement and speed."""
    tau = TURN * np.linspace(0.0, state.period_cycles or 1, PER_CYCLE * (state.period_cycles or 1) + 1)
    if state.orbit is None:
        raise ValueError("this steady state has no motion to draw")
    return (tau, *state.orbit.at(tau))


def response_figure(answer: "RecordResponse") -> Figure:
    """Displacements over time with the stops shaded; below, the force of the contact over time and over the way."""
    with look():
        figure = new_figure(height=4.2)
        axes = figure.subplot_mosaic([["motion", "motion"], ["force", "loop"]], width_ratios=(1.8, 1.0))
        draw_displacements(answer, axes["motion"])
        draw_force(answer, axes["force"])
        draw_friction_loop(answer, axes["loop"])
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


def draw_friction_loop(answer: "RecordResponse", ax: Axes) -> Axes:
    """Force of the contact over the way along the wall: its area is what friction dissipates."""
    response = answer.response
    way = response.relative_displacement if response.problem.wall == "base" else response.displacement
    last = slice(max(0, len(way) - MOST_POINTS), None)
    ax.plot(way[last], response.contact_force[last], color=PREDICTED, linewidth=0.6)
    ax.set_xlabel("mass over $Y$")
    ax.set_ylabel("contact force over $kY$")
    return ax
