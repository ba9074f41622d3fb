"""What was simulated: a steady motion, cycles from rest, the response to a recorded base."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.arrays import FloatArray
from frictionlab.errors import UsageError
from frictionlab.figures.style import MOST_POINTS, PREDICTED, TURN, drawing, over_time, shades, thinned
from frictionlab.simulator import simulate as run_from_rest

if TYPE_CHECKING:
    from frictionlab.base_motion import RecordResponse
    from frictionlab.simulator import Motion, SteadyState, Structure

SAMPLES = 2000  # per cycle: smooth in print
MOST_CYCLES = 200  # from rest, the last ones
MOST_STOPS = 200  # shaded one by one
PHASE, OVER = "phase of the drive τ/π", "displacement over Y"


def motion_figure(state: "SteadyState") -> Figure:
    """Displacement over two periods, or over all cycles from rest; the hysteresis loop, and the contact's force.

    Of several masses or contacts: all displacements, and each contact's force over its displacement.
    """
    if state.structure is not None:
        return _structure_figure(state, state.structure)
    with drawing(5.0, state.verdict, state.warnings) as figure:
        grid = figure.add_gridspec(2, 4)
        draw_motion(state, figure.add_subplot(grid[0, :3]))
        tau, x, _ = _sampled(state)
        loop = figure.add_subplot(grid[0, 3], xlabel="mass x/Y", ylabel="base y/Y")
        loop.plot(x, state.problem.base.at(tau), color=PREDICTED)
        draw_contact_force(state, figure.add_subplot(grid[1, :2]))
        draw_contact_force(state, figure.add_subplot(grid[1, 2:]), over_speed=True)
    return figure


def _structure_figure(state: "SteadyState", structure: "Structure") -> Figure:
    """Displacements of base and masses over the period, and each contact's force over its displacement."""
    motion = state.orbit
    if motion is None:
        raise UsageError(f"plot: there is no motion to draw (outcome {state.outcome})")
    tau = np.linspace(motion.start, motion.end, SAMPLES * (state.period_cycles or 1))
    base, (q, _, force) = structure.base.at(tau), motion.all_at(tau)
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


def draw_motion(state: "SteadyState", ax: Axes) -> Axes:
    """Displacement of mass and base over two periods, or over all cycles from rest; stops are shaded."""
    motion = _orbit(state)
    period, tau = motion.end - motion.start, np.linspace(motion.start, motion.end, _samples(state))
    begins = [-period, 0.0, period]  # a stop may have begun in the period before
    if motion.periodic:
        tau = np.concatenate([tau, tau[1:] + period])
    else:
        cycles = min(round(motion.end / TURN), MOST_CYCLES)
        motion = run_from_rest(state.problem, cycles=round(motion.end / TURN), keep=cycles)
        tau, begins = np.linspace(motion.start, motion.end, cycles * (_samples(state) - 1) + 1), [0.0]
    stops = [((a + begin) / np.pi, (b + begin) / np.pi) for begin in begins for a, b in motion.stops]
    lines = {"base y/Y": state.problem.base.at(tau), "mass x/Y": motion.at(tau)[0]}
    shaded = stops if len(stops) <= MOST_STOPS else ()
    return over_time(ax, tau / np.pi, lines, (PREDICTED,), stops=shaded, xlabel=PHASE, ylabel=OVER)


def draw_contact_force(state: "SteadyState", ax: Axes, color: str = PREDICTED, *, over_speed: bool = False) -> Axes:
    """Draw the contact's force over the mass's displacement, or its speed, over one period."""
    tau, x, v = _sampled(state)
    if state.problem.wall == "base":
        x, v = x - state.problem.base.at(tau), v - state.problem.base.rate_at(tau)
    ax.plot(v if over_speed else x, _orbit(state).force(tau), color=color)
    way = "speed relative to the wall over ωY" if over_speed else "mass relative to the wall z/Y"
    ax.set(xlabel=way, ylabel="contact's force over kY")
    return ax


def _orbit(state: "SteadyState") -> "Motion":
    if state.orbit is None:
        raise UsageError(f"plot: there is no motion to draw (outcome {state.outcome}, solver {state.solver})")
    return state.orbit


def _samples(state: "SteadyState") -> int:
    return SAMPLES * (state.period_cycles or 1) + 1


def _sampled(state: "SteadyState") -> tuple[FloatArray, FloatArray, FloatArray]:
    """Phase, displacement and speed of the mass over a period, or the last cycle."""
    motion = _orbit(state)
    tau = np.linspace(motion.start, motion.end, _samples(state))
    return (tau, *motion.at(tau))


def response_figure(answer: "RecordResponse") -> Figure:
    """Displacements over time, stops shaded; below, the contact's force over time and way (area: dissipated)."""
    part, response = answer.recording, answer.response
    force, time = response.contact_force, part.time
    way = response.place_of(0)
    last = slice(max(0, len(way) - MOST_POINTS), None)
    stops = response.stuck_in(0) / (2.0 * np.pi * answer.natural_frequency_hz) + time[0]
    with drawing(4.2, cautions=answer.warnings) as figure:
        axes = figure.subplot_mosaic([["motion", "motion"], ["force", "loop"]], width_ratios=(1.8, 1.0))
        base, masses = part.base_displacement - part.base_displacement[0], response.displacements.T
        lines, shaded = {"base": 1e3 * base}, stops if len(stops) <= MOST_STOPS else ()
        for number, mass in enumerate(masses, 1):
            name = "mass" if len(masses) == 1 else f"mass {number}"
            lines[f"{name}, simulated"] = 1e3 * response.base.scale * mass
        over_time(axes["motion"], time, lines, shades(len(masses)), stops=shaded, ylabel="displacement [mm]")
        some = thinned(force)
        axes["force"].plot(time[some], force[some], color=PREDICTED, linewidth=0.8)
        axes["force"].set(xlabel="time [s]", ylabel="contact force over kY")
        axes["loop"].plot(way[last], force[last], color=PREDICTED, linewidth=0.6)
        axes["loop"].set(xlabel="contact's displacement over Y", ylabel="contact force over kY")
    return figure
