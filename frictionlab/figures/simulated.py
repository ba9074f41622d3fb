"""What was simulated: a steady motion, all motions of one oscillator, the response to a recorded base."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.arrays import FloatArray
from frictionlab.figures.style import MOST_POINTS, PALETTE, PREDICTED, drawing, over_time, shades, thinned

if TYPE_CHECKING:
    from collections.abc import Sequence

    from frictionlab.base_motion import RecordResponse
    from frictionlab.simulator import Attractor, SteadyState
    from frictionlab.simulator.several import StructureState

SAMPLES = 2000  # per cycle: smooth in print
MOST_MOTIONS = len(PALETTE)  # motions drawn, the most visited first
MOST_STOPS = 200  # shaded one by one
PHASE, OVER = "phase of the drive τ/π", "displacement over Y"


def motion_figure(state: "SteadyState") -> Figure:
    """Displacement over the period beside the hysteresis loop, and the contact's force; the state has an orbit."""
    with drawing(5.0, state.verdict, state.warnings) as figure:
        grid = figure.add_gridspec(2, 4)
        draw_motion(state, figure.add_subplot(grid[0, :3]))
        tau, x, _ = _sampled(state)
        loop = figure.add_subplot(grid[0, 3], xlabel="mass x/Y", ylabel="base y/Y")
        loop.plot(x, state.problem.base.at(tau), color=PREDICTED)
        draw_contact_force(state, figure.add_subplot(grid[1, :2]))
        draw_contact_force(state, figure.add_subplot(grid[1, 2:]), over_speed=True)
    return figure


def structure_figure(state: "StructureState") -> Figure:
    """Displacements of base and masses over the period, and each contact's force over its displacement."""
    structure, motion = state.structure, state.motion
    if motion is None:
        raise ValueError("this steady state has no motion to draw")
    tau = np.linspace(motion.start, motion.end, SAMPLES * (state.period_cycles or 1))
    base, (q, _), force = structure.base.at(tau), motion.at(tau), motion.force(tau)
    with drawing(5.0, state.verdict, state.warnings) as figure:
        grid = figure.add_gridspec(2, max(1, len(structure.contacts)))
        lines = {"base y/Y": base, **{f"mass {n + 1} x/Y": q[:, n] for n in range(structure.masses)}}
        above = figure.add_subplot(grid[0, :])
        over_time(above, tau / np.pi, lines, shades(structure.masses), xlabel=PHASE, ylabel=OVER)
        for number, contact in enumerate(structure.contacts):
            against = f"mass {contact.against}" if isinstance(contact.against, int) else f"the {contact.against}"
            place = q @ structure.row(contact) - (base if contact.against == "base" else 0.0)
            below = figure.add_subplot(grid[1, number], title=f"mass {contact.mass} against {against}")
            below.plot(place, force[:, number], color=PREDICTED)
            below.set(xlabel="relative displacement over Y", ylabel="contact's force over k₁Y")
    return figure


def draw_motion(state: "SteadyState", ax: Axes, color: str = PREDICTED, periods: int = 2) -> Axes:
    """Displacement of mass and base over so many periods; stops are shaded."""
    tau, x, _ = _sampled(state, periods)
    stops: list[tuple[float, float]] = []
    if state.orbit is not None:
        period = state.orbit.end - state.orbit.start
        shown = range(-1, periods) if state.orbit.timeline.periodic else range(1)  # -1: a stop that was begun before
        stops = [((a + n * period) / np.pi, (b + n * period) / np.pi) for n in shown for a, b in state.orbit.stops]
    lines = {"base y/Y": state.problem.base.at(tau), "mass x/Y": x}
    return over_time(ax, tau / np.pi, lines, (color,), stops=stops, xlabel=PHASE, ylabel=OVER)


def draw_contact_force(state: "SteadyState", ax: Axes, color: str = PREDICTED, *, over_speed: bool = False) -> Axes:
    """Draw the contact's force over the mass's displacement, or its speed, over one period."""
    if state.orbit is None:
        return ax
    tau, x, v = _sampled(state)
    if state.problem.wall == "base":
        x, v = x - state.problem.base.at(tau), v - state.problem.base.rate_at(tau)
    ax.plot(v if over_speed else x, state.orbit.force(tau), color=color)
    way = "speed relative to the wall over ωY" if over_speed else "mass relative to the wall z/Y"
    ax.set(xlabel=way, ylabel="contact's force over kY")
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
    problem = found[0].state.problem
    values = ", ".join(f"{name} {value:g}" for name, value in problem.parameters.items())
    title = f"all steady motions found: r {problem.r:g}, {problem.law.name}: {values}"
    said = [_words(attractor) for attractor in found if attractor not in drawn]
    said += [sentence for attractor in drawn for sentence in attractor.state.warnings]
    with drawing(0.6 + 1.7 * max(1, len(drawn)), title, tuple(dict.fromkeys(said))) as figure:
        rows = figure.subplots(len(drawn), 2, squeeze=False, width_ratios=(3, 1)) if drawn else ()
        for (left, right), attractor, color in zip(rows, drawn, PALETTE, strict=False):
            draw_motion(attractor.state, left, color, periods=1).set_title(_words(attractor))
            _, x, v = _sampled(attractor.state)
            right.plot(x, v, color=color)
            right.plot(x[:-1:SAMPLES], v[:-1:SAMPLES], ".", color="black", markersize=4.0)
            right.set(xlabel="displacement / Y", ylabel="speed / ωY")
    return figure


def _words(attractor: "Attractor") -> str:
    state = attractor.state
    share = f"{100.0 * attractor.share:.3g} % of the starts"
    if state.outcome != "periodic":
        return f"{share}: {state.outcome}"
    cycles = "every cycle" if state.period_cycles == 1 else f"after {state.period_cycles} cycles"
    return f"{share}: repeats {cycles}, {state.energy_per_cycle:.4g} kY² per cycle"


def response_figure(answer: "RecordResponse") -> Figure:
    """Displacements over time with the stops shaded; below, the force of the contact over time and over the way.

    The area of the loop is what friction dissipates.
    """
    part, response = answer.recording, answer.response
    force, time = response.contact_force, part.time
    way = response.relative_displacement if response.problem.wall == "base" else response.displacement
    last = slice(max(0, len(way) - MOST_POINTS), None)
    stops = response.intervals_stuck / (2.0 * np.pi * answer.natural_frequency_hz) + time[0]
    with drawing(4.2, cautions=answer.warnings) as figure:
        axes = figure.subplot_mosaic([["motion", "motion"], ["force", "loop"]], width_ratios=(1.8, 1.0))
        base, mass = part.base_displacement - part.base_displacement[0], part.mass_displacement
        lines, shaded = {"base": 1e3 * base, "mass, simulated": 1e3 * mass}, stops if len(stops) <= MOST_STOPS else ()
        over_time(axes["motion"], time, lines, (PREDICTED,), stops=shaded, ylabel="displacement [mm]")
        some = thinned(force)
        axes["force"].plot(time[some], force[some], color=PREDICTED, linewidth=0.8)
        axes["force"].set(xlabel="time [s]", ylabel="contact force over kY")
        axes["loop"].plot(way[last], force[last], color=PREDICTED, linewidth=0.6)
        axes["loop"].set(xlabel="mass over Y", ylabel="contact force over kY")
    return figure
