"""What was simulated: a steady motion, cycles from rest, the response to a recorded base; what a law predicts."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from frictionlab.arrays import FloatArray
from frictionlab.errors import UsageError
from frictionlab.figures.style import MOST_POINTS, PREDICTED, TURN, drawing, over_time, panels, shades, thinned
from frictionlab.schema import AMPLITUDE, ENERGY
from frictionlab.simulator import simulate as run_from_rest
from frictionlab.simulator.structure import frame_of
from frictionlab.tables.texts import kinds_of

if TYPE_CHECKING:
    from frictionlab.base_motion import RecordResponse
    from frictionlab.inference.predictive import Prediction
    from frictionlab.simulator import Motion, SteadyState

SAMPLES = 2000  # per cycle: smooth in print
MOST_CYCLES = 200  # from rest, the last ones
MOST_STOPS = 200  # shaded one by one
CURVES = {f"{AMPLITUDE}_m": "amplitude [mm]", f"{ENERGY}_j": "energy per cycle [mJ]"}
BAND: dict[str, Any] = {"color": PREDICTED, "alpha": 0.25, "linewidth": 0.0}  # of 95 of 100 tests
FEW = 20  # points of a curve that are marked
PHASE, OVER = "phase of the drive τ/π", "displacement over Y"


def motion_figure(state: "SteadyState") -> Figure:
    """Displacements over two periods, or over all cycles from rest; the hysteresis loop, and each contact's force.

    That of a single contact is drawn over its speed too.
    """
    contacts = len(frame_of(state.structure or state.problem).contacts)
    posed = "" if state.structure is not None else f"{repr(state.problem)[1:-1].removeprefix('Problem ')}. "
    with drawing(5.0, posed + state.verdict, state.warnings) as figure:
        grid = figure.add_gridspec(2, 4 * max(1, contacts))
        draw_motion(state, figure.add_subplot(grid[0, : -max(1, contacts)]))
        tau, q, _, _ = _sampled(state)
        loop = figure.add_subplot(grid[0, -max(1, contacts) :], xlabel="mass x/Y", ylabel="base y/Y")
        loop.plot(q[:, 0], state.problem.base.at(tau), color=PREDICTED)
        panels = [(0, False), (0, True)] if contacts == 1 else [(number, False) for number in range(contacts)]
        width = 4 * contacts // max(1, len(panels))
        for place, (number, over_speed) in enumerate(panels):
            ax = figure.add_subplot(grid[1, width * place : width * (place + 1)])
            draw_contact_force(state, ax, number, over_speed=over_speed)
    return figure


def draw_motion(state: "SteadyState", ax: Axes) -> Axes:
    """Displacements of masses and base over two periods, or over all cycles from rest; stops of one mass are shaded."""
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
    masses = motion.all_at(tau)[0].T
    names = ["mass x/Y"] if len(masses) == 1 else [f"mass {number} x/Y" for number in range(1, len(masses) + 1)]
    lines = {"base y/Y": state.problem.base.at(tau), **dict(zip(names, masses, strict=True))}
    shaded = stops if len(masses) == 1 and len(stops) <= MOST_STOPS else ()
    colors = (PREDICTED,) if len(masses) == 1 else shades(len(masses))
    return over_time(ax, tau / np.pi, lines, colors, stops=shaded, xlabel=PHASE, ylabel=OVER)


def draw_contact_force(state: "SteadyState", ax: Axes, number: int = 0, *, over_speed: bool = False) -> Axes:
    """Draw the force of a contact (from 0) over its displacement, or its speed, over one period."""
    (tau, q, v, force), frame = _sampled(state), frame_of(state.structure or state.problem)
    contact = frame.contacts[number]
    way = (v if over_speed else q) @ frame.row(contact)
    if state.structure is not None:
        ax.set_title(f"mass {contact.mass} against {'mass ' * isinstance(contact.against, int)}{contact.against}")
    if contact.against == "base":
        way = way - (frame.base.rate_at(tau) if over_speed else frame.base.at(tau))
    ax.plot(way, force[:, number], color=PREDICTED)
    ax.set_xlabel("contact's speed over ωY" if over_speed else "contact's displacement over Y")
    ax.set_ylabel("contact's force over kY")
    return ax


def _orbit(state: "SteadyState") -> "Motion":
    if state.orbit is None:
        raise UsageError(f"plot: there is no motion to draw (outcome {state.outcome}, solver {state.solver})")
    return state.orbit


def _samples(state: "SteadyState") -> int:
    return SAMPLES * (state.period_cycles or 1) + 1


def _sampled(state: "SteadyState") -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Phase, displacements and speeds of the masses and forces of the contacts over a period, or the last cycle."""
    motion = _orbit(state)
    tau = np.linspace(motion.start, motion.end, _samples(state))
    return (tau, *motion.all_at(tau))


def response_figure(answer: "RecordResponse") -> Figure:
    """Displacements over time, stops shaded; below, the contact's force over time and way (area: dissipated)."""
    part, response = answer.recording, answer.response
    force, time = response.contact_force, part.time
    way = response.place_of(0)
    last = slice(max(0, len(way) - MOST_POINTS), None)
    stops = response.contact_stops[0] / (2.0 * np.pi * answer.natural_frequency_hz) + time[0]
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


def prediction_figure(prediction: "Prediction") -> Figure:
    """One test: its displacement over time, and the loop; several: amplitude and energy over the frequency ratio."""
    tests, first = prediction.tests, prediction.tests[0]
    at = f"{first.normal_force_n:.4g} N, base {1e3 * first.base_amplitude_m:.4g} mm"
    title = f"{first.material}, {first.law}: {at}; shaded: 95 of 100 such tests"
    warned = [(str(k), text) for k, test in enumerate(tests) for text in test.warnings]
    said = [sentence for sentence, _ in kinds_of(warned)]
    with drawing(title=title, cautions=said) as figure:
        if len(tests) == 1:
            left, right = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
            base, mass = 1e3 * first.base, 1e3 * first.displacement
            band = (1e3 * first.displacement_low, 1e3 * first.displacement_high)
            left.fill_between(first.time, *band, **BAND)
            over_time(left, first.time, {"base": base, "mass": mass}, (PREDICTED,), ylabel="displacement [mm]")
            right.plot(mass, base, color=PREDICTED)  # its area is the energy (2.18)
            right.fill_betweenx(base, *band, **BAND)
            right.set(xlabel="mass [mm]", ylabel="base [mm]")
        else:
            for ax, (name, label) in zip(panels(figure, 2), CURVES.items(), strict=True):
                rows = np.array([(test.frequency_ratio, *test.numbers[name]) for test in tests], dtype=np.float64)
                r, value, low, high = rows[np.argsort(rows[:, 0])].T
                ax.plot(r, 1e3 * value, color=PREDICTED, marker="." if len(r) <= FEW else None)
                ax.fill_between(r, 1e3 * low, 1e3 * high, **BAND)
                ax.set(xlabel="frequency ratio r", ylabel=label)
                ax.set_ylim(bottom=0.0)
    return figure
