"""What was recorded: a measurement, free decays, and a whole record over its prediction."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from frictionlab.analysis.free_vibration import FreeVibration
from frictionlab.analysis.measurement import Measurement
from frictionlab.figures.style import (
    BASE,
    GREY,
    MEASURED,
    ORANGE,
    PAGE,
    PREDICTED,
    VERMILION,
    caution,
    headline,
    look,
    new_figure,
    plain_decades,
    thinned,
)
from frictionlab.inference import WholeRecord
from frictionlab.recording import Recording

ZOOM = 3  # periods of the drive that the zoom shows
FLAT = 0.01  # relative: friction is drawn over at least so much up and down
MANY = 200  # periods, beyond which points are drawn small
LAST_S = 5.0  # of a recording, shown by themselves


def draw_response(measurement: Measurement, ax: Axes) -> Axes:
    """The last cycles used: mass over base, stops shaded."""
    traces = measurement.traces
    for number, (begin, end) in enumerate(traces.stops):
        ax.axvspan(begin, end, color=ORANGE, alpha=0.3, lw=0, label="stop" if number == 0 else None)
    ax.plot(traces.time, traces.base, color=BASE, lw=0.9, ls=":", label="base")
    ax.plot(traces.time, traces.mass, color=MEASURED, label="mass")
    ax.set(xlabel="time [s]", ylabel="displacement, x / Y, y / Y", xlim=(traces.time[0], traces.time[-1]))
    ax.margins(y=0.2)
    ax.legend(loc="upper center", ncols=3)
    return ax


def draw_loops(measurement: Measurement, ax: Axes) -> Axes:
    """Hysteresis loops of the cycles used, base over mass: their area is the energy per cycle, eq. (2.18)."""
    traces = measurement.traces
    fade = max(0.15, 1.0 / len(traces.loop_mass))
    loops = [np.column_stack(pair) for pair in zip(traces.loop_mass, traces.loop_base, strict=True)]
    ax.add_collection(LineCollection(loops, colors=MEASURED, linewidths=0.8, alpha=fade))
    ax.autoscale_view()
    ax.set(xlabel="displacement of the mass, x / Y", ylabel="displacement of the base, y / Y")
    return ax


def draw_spectrum(measurement: Measurement, ax: Axes) -> Axes:
    """Amplitude spectra of mass and base, the drive frequency marked."""
    traces = measurement.traces
    ax.semilogy(traces.base_frequency, 1e3 * traces.base_spectrum, color=GREY, lw=0.8, label="base")
    ax.semilogy(traces.mass_frequency, 1e3 * traces.mass_spectrum, color=MEASURED, lw=0.8, label="mass")
    drive, height = measurement.drive_frequency_hz, 1e3 * measurement.base_amplitude_m
    ax.plot([drive], [height], ls="none", marker="o", ms=5, mfc="none", color=VERMILION, label=f"drive, {drive:.6g} Hz")
    top = max(float(traces.base_spectrum.max()), float(traces.mass_spectrum.max()))
    ax.set(
        xlabel="frequency [Hz]",
        ylabel="amplitude [mm]",
        xlim=(0, traces.base_frequency[-1]),
        ylim=(1e-2 * 1e-3, 3e3 * top),
    )
    plain_decades(ax)
    ax.legend(loc="upper right")
    return ax


def draw_measured_force(measurement: Measurement, ax: Axes, *, over_speed: bool) -> Axes:
    """The force that a load cell measured over the mean cycle, over displacement or speed of the mass."""
    cycle, unit = measurement.cycle, 1e3 * measurement.base_amplitude_m
    if cycle.force is None:
        return ax
    speed = 2.0 * np.pi * measurement.drive_frequency_hz * cycle.mass_velocity
    way = unit * (speed if over_speed else cycle.mass_smooth)
    ax.plot(np.append(way, way[:1]), np.append(cycle.force, cycle.force[:1]), color=MEASURED)
    ax.set(xlabel="speed of the mass [mm/s]" if over_speed else "displacement of the mass [mm]")
    ax.set(ylabel="measured force [N]")
    return ax


def measurement_figure(measurement: Measurement, name: str = "") -> Figure:
    """Response, spectrum, loops and a measured force, with the numbers above each; ``name`` stands above them."""
    with look():
        force = measurement.cycle.force is not None
        figure = new_figure(PAGE, 7.4 if force else 5.2)
        grid = figure.add_gridspec(3 if force else 2, 2, width_ratios=(1.35, 1.0))
        draw_response(measurement, figure.add_subplot(grid[0, :])).set_title(_response_title(measurement))
        draw_spectrum(measurement, figure.add_subplot(grid[1, 0])).set_title(_spectrum_title(measurement))
        draw_loops(measurement, figure.add_subplot(grid[1, 1])).set_title(
            f"energy {measurement.energy} kY² ({measurement.energy_rule})"
        )
        if force:
            over_speed = draw_measured_force(measurement, figure.add_subplot(grid[2, 0]), over_speed=True)
            over_speed.set_title(f"friction force {measurement.measured_force} N")
            draw_measured_force(measurement, figure.add_subplot(grid[2, 1]), over_speed=False)
        headline(figure, name or measurement.source)
        caution(figure, measurement.warnings)
        return figure


def recording_figure(recording: Recording, name: str = "") -> Figure:
    """Mass and base over the whole record, and over its last seconds, in mm about their means."""
    with look():
        figure = new_figure(PAGE, 4.0)
        for ax, seconds in zip(figure.subplots(2, 1), (recording.time[-1] - recording.time[0], LAST_S), strict=True):
            part = recording.time >= recording.time[-1] - seconds
            for label, color in (("base", BASE), ("mass", MEASURED)):
                values = recording.measured().get(f"{label}_displacement")
                if values is not None:
                    shown = 1e3 * (values[part] - np.nanmean(values))
                    some = thinned(shown)
                    ax.plot(recording.time[part][some], shown[some], color=color, lw=0.8, label=label)
            ax.set(xlabel="time [s]", ylabel="displacement [mm]")
        ax.legend(loc="upper right", ncols=2)
        headline(figure, name or ", ".join(file.name for file in recording.source.files))
        return figure


def _response_title(m: Measurement) -> str:
    return (
        f"{m.regime}, {m.stops_per_cycle:.3g} stops a cycle   amplitude {m.amplitude} Y"
        f"   irregularity {_known(m.irregularity_index)}"
    )


def _spectrum_title(m: Measurement) -> str:
    ratio = "r unknown" if m.frequency_ratio is None else f"r = {m.frequency_ratio:.6g}"
    return f"{ratio}   Y = {1e3 * m.base_amplitude_m:.4g} mm   distortion {100 * m.base_distortion:.2g} %"


def _known(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.2g}"


def draw_decays(taps: Sequence[FreeVibration], ax: Axes) -> Axes:
    """Each tap's displacement and the motion fitted to it."""
    for number, tap in enumerate(taps):
        label = ("measured", "fitted") if number == 0 else (None, None)
        ax.plot(tap.swing.time, 1e3 * tap.swing.measured, color=MEASURED, label=label[0])
        ax.plot(tap.swing.time, 1e3 * tap.swing.fitted, color=PREDICTED, lw=0.8, ls="--", label=label[1])
    ax.set(xlabel="time [s]", ylabel="displacement of the mass [mm]")
    ax.legend(loc="upper right", ncols=2)
    return ax


def draw_residuals(taps: Sequence[FreeVibration], ax: Axes) -> Axes:
    """What the fit leaves of each tap."""
    for tap in taps:
        ax.plot(tap.swing.time, 1e6 * (tap.swing.measured - tap.swing.fitted), color=MEASURED, lw=0.5)
    ax.set(xlabel="time [s]", ylabel="measured - fitted [µm]")
    return ax


def free_vibration_figure(taps: Sequence[FreeVibration], name: str = "") -> Figure:
    """Both, with the numbers of each tap above; ``name`` stands above them."""
    with look():
        figure = new_figure(PAGE, 4.6)
        grid = figure.add_gridspec(2, 1, height_ratios=(2.0, 1.0))
        shown = "\n".join(_tap_title(tap) for tap in taps[:3]) + (f"\n... {len(taps)} taps" if len(taps) > 3 else "")
        draw_decays(taps, figure.add_subplot(grid[0])).set_title(shown)
        draw_residuals(taps, figure.add_subplot(grid[1]))
        headline(figure, name)
        return figure


def _tap_title(tap: FreeVibration) -> str:
    return (
        f"{tap.start_s:.4g} s:   f_n = {tap.natural_frequency_hz:.6g} ± {tap.natural_frequency_hz_se:.1g} Hz   "
        f"zeta = {_or_below(tap.damping_ratio, tap.damping_ratio_se, tap.damping_ratio_upper)}   "
        f"F/k = {_or_below(1e6 * tap.friction_m, _scaled(tap.friction_m_se), _scaled(tap.friction_m_upper))} µm"
    )


def _scaled(value: float | None) -> float | None:
    return None if value is None else 1e6 * value


def _or_below(value: float, se: float | None, upper: float | None) -> str:
    return f"below {upper:.2g}" if se is None else f"{value:.4g} ± {se:.1g}"


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
