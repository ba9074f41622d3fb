"""What was simulated: a steady motion, all motions of one oscillator, the response to a recorded base."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.arrays import FloatArray
from frictionlab.figures import style

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frictionlab.base_motion import RecordResponse
    from frictionlab.simulator import Attractor, SteadyState
    from frictionlab.simulator.several import StructureState

SAMPLES = 2000  # per cycle: smooth in print
MOST_MOTIONS = len(style.PALETTE)  # motions drawn, the most visited first
MOST_STOPS = 200  # shaded one by one


def motion_figure(state: "SteadyState") -> Figure:
    """Displacement over the period beside the hysteresis loop, and the contact's force; the state has an orbit."""
    with style.look():
        figure = style.new_figure(height=5.0)
        grid = figure.add_gridspec(2, 4)
        draw_motion(state, figure.add_subplot(grid[0, :3]))
        tau, x, _ = _sampled(state)
        loop = figure.add_subplot(grid[0, 3])
        loop.plot(x, state.problem.base.at(tau), color=style.PREDICTED)
        loop.set(xlabel="mass $x/Y$", ylabel="base $y/Y$")
        draw_contact_force(state, figure.add_subplot(grid[1, :2]))
        draw_contact_force(state, figure.add_subplot(grid[1, 2:]), over_speed=True)
        figure.suptitle(state.verdict, fontsize=8.0)
        style.caution(figure, state.warnings)
    return figure


def structure_figure(state: "StructureState") -> Figure:
    """Displacements of base and masses over the period, and each contact's force over its displacement."""
    structure, motion = state.structure, state.motion
    if motion is None:
        raise ValueError("this steady state has no motion to draw")
    tau = np.linspace(motion.start, motion.end, SAMPLES * (state.period_cycles or 1))
    q, _ = motion.at(tau)
    base, force = structure.base.at(tau), motion.force(tau)
    with style.look():
        figure = style.new_figure(height=5.0)
        grid = figure.add_gridspec(2, max(1, len(structure.contacts)))
        ax = figure.add_subplot(grid[0, :])
        ax.plot(tau / np.pi, base, color=style.BASE, linewidth=0.8, label="base $y/Y$")
        for mass in range(structure.masses):
            ax.plot(tau / np.pi, q[:, mass], color=style.PALETTE[mass % len(style.PALETTE)], label=f"mass {mass + 1}")
        ax.set(xlabel=r"phase of the drive $\tau/\pi$", ylabel="displacement over $Y$")
        ax.margins(y=0.18)
        ax.legend(loc="upper right", ncols=1 + structure.masses)
        for number, contact in enumerate(structure.contacts):
            against = f"mass {contact.against}" if isinstance(contact.against, int) else f"the {contact.against}"
            place = q @ structure.row(contact) - (base if contact.against == "base" else 0.0)
            below = figure.add_subplot(grid[1, number])
            below.plot(place, force[:, number], color=style.PREDICTED)
            below.set_title(f"mass {contact.mass} against {against}", fontsize=7.0)
            below.set(xlabel="relative displacement over $Y$", ylabel="contact's force over $k_1Y$")
        figure.suptitle(state.verdict, fontsize=8.0)
        style.caution(figure, state.warnings)
    return figure


def draw_motion(state: "SteadyState", ax: Axes, color: str = style.PREDICTED, periods: int = 2) -> Axes:
    """Displacement of mass and base over so many periods; stops are shaded."""
    tau, x, _ = _sampled(state, periods)
    ax.plot(tau / np.pi, state.problem.base.at(tau), color=style.BASE, linewidth=0.8, label="base $y/Y$")
    ax.plot(tau / np.pi, x, color=color, label="mass $x/Y$")
    if state.orbit is not None:
        period = state.orbit.end - state.orbit.start
        shown = range(-1, periods) if state.orbit.timeline.periodic else range(1)  # -1: a stop that was begun before
        stops = [(a + n * period, b + n * period) for n in shown for a, b in state.orbit.stops]
        style.shade(ax, [(begin / np.pi, end / np.pi) for begin, end in stops])
    ax.set(
        xlabel=r"phase of the drive $\tau/\pi$", ylabel="displacement over $Y$", xlim=(tau[0] / np.pi, tau[-1] / np.pi)
    )
    ax.margins(y=0.18)
    ax.legend(loc="upper right", ncols=2)
    return ax


def draw_contact_force(
    state: "SteadyState", ax: Axes, color: str = style.PREDICTED, *, over_speed: bool = False
) -> Axes:
    """Draw the contact's force over the mass's displacement, or its speed, over one period."""
    if state.orbit is None:
        return ax
    tau, x, v = _sampled(state)
    if state.problem.wall == "base":
        x, v = x - state.problem.base.at(tau), v - state.problem.base.rate_at(tau)
    ax.plot(v if over_speed else x, state.orbit.force(tau), color=color)
    way = r"speed relative to the wall over $\omega Y$" if over_speed else "mass relative to the wall $z/Y$"
    ax.set(xlabel=way, ylabel="contact's force over $kY$")
    return ax


def _sampled(state: "SteadyState", periods: int = 1) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Phase, displacement and speed of the mass over a number of periods; one only where the motion does not repeat."""
    if state.orbit is None:
        raise ValueError("this steady state has no motion to draw")
    begin, end = state.orbit.start, state.orbit.end
    count = periods if state.orbit.timeline.periodic else 1
    tau = np.linspace(begin, begin + count * (end - begin), count * SAMPLES * (state.period_cycles or 1) + 1)
    tau = np.minimum(tau, end) if count == 1 else tau  # a motion that does not repeat is known up to its end
    return (tau, *state.orbit.at(tau)[:2])


def coexisting_figure(found: "Sequence[Attractor]") -> Figure:
    """A row for each motion, with its share: displacement over its period beside speed over displacement.

    A dot stands where each cycle begins.
    """
    drawn = [attractor for attractor in found if attractor.state.orbit is not None][:MOST_MOTIONS]
    with style.look():
        figure = style.new_figure(style.PAGE, 0.6 + 1.7 * max(1, len(drawn)))
        axes = figure.subplots(max(1, len(drawn)), 2, squeeze=False, width_ratios=(3, 1), sharex="col")
        for (left, right), attractor, color in zip(axes, drawn, style.PALETTE, strict=False):
            draw_motion(attractor.state, left, color, periods=1).set_title(_words(attractor), fontsize=7.0)
            _, x, v = _sampled(attractor.state)
            right.plot(x, v, color=color)
            right.plot(x[:-1:SAMPLES], v[:-1:SAMPLES], ".", color="black", markersize=4.0)
            right.set(xlabel="displacement / $Y$", ylabel=r"speed / $\omega Y$")
        for ax in axes[-1]:
            ax.xaxis.label.set_visible(True)
        if not drawn:
            figure.clear()
        problem = found[0].state.problem
        told = ", ".join(f"{name} {value:g}" for name, value in problem.parameters.items())
        style.headline(figure, f"all steady motions found: r {problem.r:g}, {problem.law.name}: {told}")
        left_out = [_words(attractor) for attractor in found if attractor not in drawn]
        style.caution(
            figure, tuple(dict.fromkeys((*left_out, *(said for each in drawn for said in each.state.warnings))))
        )
    return figure


def _words(attractor: "Attractor") -> str:
    state = attractor.state
    share = f"{100.0 * attractor.share:.3g} % of the starts"
    if state.outcome != "periodic":
        return f"{share}: {state.outcome}"
    cycles = "every cycle" if state.period_cycles == 1 else f"after {state.period_cycles} cycles"
    return f"{share}: repeats {cycles}, {state.energy_per_cycle:.4g} $kY^2$ per cycle"


def response_figure(answer: "RecordResponse") -> Figure:
    """Displacements over time with the stops shaded; below, the force of the contact over time and over the way.

    The area of the loop is what friction dissipates.
    """
    part, response = answer.recording, answer.response
    way = response.relative_displacement if response.problem.wall == "base" else response.displacement
    last = slice(max(0, len(way) - style.MOST_POINTS), None)
    with style.look():
        figure = style.new_figure(height=4.2)
        axes = figure.subplot_mosaic([["motion", "motion"], ["force", "loop"]], width_ratios=(1.8, 1.0))
        for values, color, label in (
            (part.base_displacement - part.base_displacement[0], style.BASE, "base"),
            (part.mass_displacement, style.PREDICTED, "mass, simulated"),
        ):
            some = style.thinned(values)
            axes["motion"].plot(part.time[some], 1e3 * values[some], color=color, label=label)
        stops = response.intervals_stuck / (2.0 * np.pi * answer.natural_frequency_hz) + part.time[0]
        style.shade(axes["motion"], stops if len(stops) <= MOST_STOPS else ())
        axes["motion"].set(xlabel="time [s]", ylabel="displacement [mm]")
        axes["motion"].margins(y=0.18)
        axes["motion"].legend(loc="upper right", ncols=2)
        some = style.thinned(response.contact_force)
        axes["force"].plot(part.time[some], response.contact_force[some], color=style.PREDICTED, linewidth=0.8)
        axes["force"].set(xlabel="time [s]", ylabel="contact force over $kY$")
        axes["loop"].plot(way[last], response.contact_force[last], color=style.PREDICTED, linewidth=0.6)
        axes["loop"].set(xlabel="mass over $Y$", ylabel="contact force over $kY$")
        style.caution(figure, answer.warnings)
    return figure
