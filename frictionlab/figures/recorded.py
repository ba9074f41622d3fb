"""What was recorded: a measurement, free decays, and a whole record over its prediction."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from frictionlab.analysis.free_vibration import FreeVibration
from frictionlab.analysis.measurement import Measurement
from frictionlab.figures import style
from frictionlab.inference import WholeRecord
from frictionlab.recording import Recording

ZOOM = 3  # periods of the drive that the zoom shows
FLAT = 0.01  # relative: friction is drawn over at least so much up and down
MANY = 200  # periods, beyond which points are drawn small
LAST_S = 5.0  # of a recording, shown by themselves


def draw_response(measurement: Measurement, ax: Axes) -> Axes:
    """The last cycles used: mass over base, stops shaded."""
    traces = measurement.traces
    style.shade(ax, traces.stops, style.ORANGE, "stop")
    ax.plot(traces.time, traces.base, color=style.BASE, lw=0.9, ls=":", label="base")
    ax.plot(traces.time, traces.mass, color=style.MEASURED, label="mass")
    ax.set(xlabel="time [s]", ylabel="displacement, x / Y, y / Y", xlim=(traces.time[0], traces.time[-1]))
    ax.margins(y=0.2)
    ax.legend(loc="upper center", ncols=3)
    return ax


def draw_spectrum(measurement: Measurement, ax: Axes) -> Axes:
    """Amplitude spectra of mass and base, the drive frequency marked."""
    traces = measurement.traces
    ax.semilogy(traces.base_frequency, 1e3 * traces.base_spectrum, color=style.GREY, lw=0.8, label="base")
    ax.semilogy(traces.mass_frequency, 1e3 * traces.mass_spectrum, color=style.MEASURED, lw=0.8, label="mass")
    drive, height = measurement.drive_frequency_hz, 1e3 * measurement.base_amplitude_m
    ax.plot(
        [drive],
        [height],
        ls="none",
        marker="o",
        ms=5,
        mfc="none",
        color=style.VERMILION,
        label=f"drive, {drive:.6g} Hz",
    )
    top = max(float(traces.base_spectrum.max()), float(traces.mass_spectrum.max()))
    ax.set(
        xlabel="frequency [Hz]",
        ylabel="amplitude [mm]",
        xlim=(0, traces.base_frequency[-1]),
        ylim=(1e-2 * 1e-3, 3e3 * top),
    )
    style.plain_decades(ax)
    ax.legend(loc="upper right")
    return ax


def measurement_figure(measurement: Measurement, name: str = "") -> Figure:
    """Response, spectrum, loops and a measured force, with the numbers above each; ``name`` stands above them."""
    m, traces, force = measurement, measurement.traces, measurement.cycle.force
    ratio = "r unknown" if m.frequency_ratio is None else f"r = {m.frequency_ratio:.6g}"
    index = "unknown" if m.irregularity_index is None else f"{m.irregularity_index:.2g}"
    with style.look():
        figure = style.new_figure(style.PAGE, 5.2 if force is None else 7.4)
        grid = figure.add_gridspec(2 if force is None else 3, 2, width_ratios=(1.35, 1.0))
        draw_response(m, figure.add_subplot(grid[0, :])).set_title(
            f"{m.regime}, {m.stops_per_cycle:.3g} stops a cycle   amplitude {m.amplitude} Y   irregularity {index}"
        )
        draw_spectrum(m, figure.add_subplot(grid[1, 0])).set_title(
            f"{ratio}   Y = {1e3 * m.base_amplitude_m:.4g} mm   distortion {100 * m.base_distortion:.2g} %"
        )
        ax = figure.add_subplot(grid[1, 1], title=f"energy {m.energy} kY² ({m.energy_rule})")
        loops = [np.column_stack(pair) for pair in zip(traces.loop_mass, traces.loop_base, strict=True)]
        fade = max(0.15, 1.0 / len(loops))
        ax.add_collection(LineCollection(loops, colors=style.MEASURED, linewidths=0.8, alpha=fade))
        ax.autoscale_view()
        ax.set(xlabel="displacement of the mass, x / Y", ylabel="displacement of the base, y / Y")
        if force is not None:
            unit = 1e3 * m.base_amplitude_m
            speed = 2.0 * np.pi * m.drive_frequency_hz * unit * m.cycle.mass_velocity
            title = f"friction force {m.measured_force} N"
            left = figure.add_subplot(grid[2, 0], title=title, xlabel="speed of the mass [mm/s]")
            left.plot(style.closed(speed), style.closed(force), color=style.MEASURED)
            right = figure.add_subplot(grid[2, 1], xlabel="displacement of the mass [mm]")
            right.plot(style.closed(unit * m.cycle.mass_smooth), style.closed(force), color=style.MEASURED)
            for panel in (left, right):
                panel.set_ylabel("measured force [N]")
        style.headline(figure, name or m.source)
        style.caution(figure, m.warnings)
        return figure


def recording_figure(recording: Recording, name: str = "") -> Figure:
    """Mass and base over the whole record, and over its last seconds, in mm about their means."""
    with style.look():
        figure = style.new_figure(style.PAGE, 4.0)
        for ax, seconds in zip(figure.subplots(2, 1), (recording.time[-1] - recording.time[0], LAST_S), strict=True):
            part = recording.time >= recording.time[-1] - seconds
            for label, color in (("base", style.BASE), ("mass", style.MEASURED)):
                values = recording.measured().get(f"{label}_displacement")
                if values is not None:
                    shown = 1e3 * (values[part] - np.nanmean(values))
                    some = style.thinned(shown)
                    ax.plot(recording.time[part][some], shown[some], color=color, lw=0.8, label=label)
            ax.set(xlabel="time [s]", ylabel="displacement [mm]")
        ax.legend(loc="upper right", ncols=2)
        style.headline(figure, name or ", ".join(file.name for file in recording.source.files))
        return figure


def free_vibration_figure(taps: Sequence[FreeVibration], name: str = "") -> Figure:
    """Each tap with the motion fitted to it, and what is left; its numbers and ``name`` stand above."""
    with style.look():
        figure = style.new_figure(style.PAGE, 4.6)
        above, below = figure.subplots(2, 1, height_ratios=(2.0, 1.0))
        for number, tap in enumerate(taps):
            time, measured, fitted = tap.swing.time, 1e3 * tap.swing.measured, 1e3 * tap.swing.fitted
            above.plot(time, measured, color=style.MEASURED, label=None if number else "measured")
            above.plot(time, fitted, color=style.PREDICTED, lw=0.8, ls="--", label=None if number else "fitted")
            below.plot(time, 1e3 * (measured - fitted), color=style.MEASURED, lw=0.5)
        more = f"\n... {len(taps)} taps" if len(taps) > 3 else ""
        above.set_title("\n".join(_tap_title(tap) for tap in taps[:3]) + more)
        above.set(xlabel="time [s]", ylabel="displacement of the mass [mm]")
        above.legend(loc="upper right", ncols=2)
        below.set(xlabel="time [s]", ylabel="measured - fitted [µm]")
        style.headline(figure, name)
        return figure


def _tap_title(tap: FreeVibration) -> str:
    def told(value: float, se: float | None, upper: float | None, times: float = 1.0) -> str:
        known = None if upper is None else times * upper
        return f"below {known:.2g}" if se is None else f"{times * value:.4g} ± {times * se:.1g}"

    return (
        f"{tap.start_s:.4g} s:   f_n = {tap.natural_frequency_hz:.6g} ± {tap.natural_frequency_hz_se:.1g} Hz   "
        f"zeta = {told(tap.damping_ratio, tap.damping_ratio_se, tap.damping_ratio_upper)}   "
        f"F/k = {told(tap.friction_m, tap.friction_m_se, tap.friction_m_upper, 1e6)} µm"
    )


def record_figure(record: WholeRecord, title: str = "whole record") -> Figure:
    """The record, a zoom of its worst periods, energy per cycle measured against predicted, misfit over time.

    Where measured and predicted part is shaded, the zoom framed.
    """
    per = max(1, len(record.time) // max(1, len(record.cycle_nrmse)))
    worst = int(np.argmax(record.cycle_nrmse)) if len(record.cycle_nrmse) else 0
    begin = max(0, min((worst - ZOOM // 2) * per, len(record.time) - ZOOM * per))
    zoom = np.arange(begin, min(begin + ZOOM * per, len(record.time)))
    size = 3.0 if len(record.cycle_time) <= MANY else 0.8  # in a long record points would hide each other
    with style.look():
        figure = style.new_figure(style.PAGE, 5.6)
        axes = figure.subplot_mosaic([["all"] * 3, ["zoom"] * 3, ["energy", "friction", "misfit"]])
        _draw_part(record, axes["all"], np.arange(len(record.time)))
        axes["all"].axvspan(record.time[zoom[0]], record.time[zoom[-1]], fill=False, edgecolor=style.GREY, lw=0.7)
        for start, end, _ in record.left:
            axes["all"].axvspan(start, end, color=style.VERMILION, alpha=0.12, linewidth=0.0)
        axes["all"].legend(loc="upper right", ncols=3)
        axes["all"].margins(y=0.2)
        _draw_part(record, axes["zoom"], zoom)
        ax = axes["energy"]
        ax.plot(record.cycle_time, record.cycle_measured, "o", ms=size, color=style.MEASURED, label="measured")
        ax.plot(record.cycle_time, record.cycle_predicted, "-", lw=1.0, color=style.PREDICTED, label="predicted")
        ax.set(xlabel="time [s]", ylabel="energy per period [kY²]")
        ax.legend()
        draw_friction(record, axes["friction"])
        ax = axes["misfit"]
        ax.plot(record.cycle_time, 100 * record.cycle_nrmse, "o-", ms=size, lw=0.8, color=style.PREDICTED)
        if len(record.cycle_nrmse):
            ax.axhline(100 * float(np.median(record.cycle_nrmse)), color=style.GREY, lw=0.8)
        ax.set(xlabel="time [s]", ylabel="nrmse of a period [%]")
        ax.set_ylim(bottom=0.0)
        numbers = f"record nrmse {100 * record.nrmse:.2g} %, energy {100 * record.energy_difference:+.2g} %"
        style.headline(figure, f"{title}: {numbers}")
        style.caution(figure, record.warnings)
        return figure


def _draw_part(record: WholeRecord, ax: Axes, part: NDArray[np.intp]) -> None:
    """Measured over predicted, for these samples."""
    for values, color, width, label in (
        (record.base, style.BASE, 0.7, "base"),
        (record.measured, style.MEASURED, 1.8, "measured"),
        (record.predicted, style.PREDICTED, 0.8, "predicted"),
    ):
        some = part[style.thinned(values[part])]
        ax.plot(record.time[some], values[some], color=color, lw=width, alpha=0.6 if width > 1 else 1.0, label=label)
    ax.set(xlabel="time [s]", ylabel="x / Y")


def draw_friction(record: WholeRecord, ax: Axes) -> Axes:
    """Friction ratio of each period as a random walk, with its standard error."""
    error = np.nan_to_num(record.cycle_friction_se)
    low, high = record.cycle_friction - error, record.cycle_friction + error
    ax.fill_between(record.cycle_time, low, high, color=style.PREDICTED, alpha=0.2, lw=0)
    ax.plot(record.cycle_time, record.cycle_friction, color=style.PREDICTED, lw=1.0)
    if len(record.cycle_friction):
        middle = float(np.median(record.cycle_friction))
        ends = [*ax.get_ylim(), middle * (1.0 - FLAT), middle * (1.0 + FLAT)]
        ax.set_ylim(min(ends), max(ends))  # what changes by less looks as flat as it is
    ax.ticklabel_format(axis="y", useOffset=False)
    ax.set(xlabel="time [s]", ylabel="friction ratio")
    return ax
