"""What was recorded: a measurement, free decays, and a whole record over its prediction."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from frictionlab.analysis.free_vibration import FreeVibration
from frictionlab.analysis.measurement import Measurement
from frictionlab.arrays import FloatArray
from frictionlab.figures import style
from frictionlab.inference.comparison import WholeRecord
from frictionlab.recording import Recording
from frictionlab.schema import with_error

CYCLES, LOOPS, THIN = 6, 30, 512  # of the last cycles, of loops and of points in one that are drawn, at most
ZOOM = 3  # periods of the drive that the zoom shows
FLAT = 0.01  # relative: friction is drawn over at least so much up and down
MANY = 200  # periods, beyond which points are drawn small
LAST_S = 5.0  # of a recording, shown by themselves
TAPS = 3  # whose numbers stand above their figure


def recording_figure(recording: Recording, name: str = "") -> Figure:
    """Mass and base over the whole record, and over its last seconds, in mm about their means."""
    measured = recording.measured()
    with style.drawing(4.0, name or ", ".join(file.name for file in recording.source.files)) as figure:
        for ax, seconds in zip(figure.subplots(2, 1), (recording.duration_s, LAST_S), strict=True):
            part = recording.time >= recording.time[-1] - seconds
            known = {place: measured.get(f"{place}_displacement") for place in ("base", "mass")}
            lines = {place: 1e3 * (v[part] - np.nanmean(v)) for place, v in known.items() if v is not None}
            style.over_time(ax, recording.time[part], lines, ylabel="displacement [mm]")
    return figure


def measurement_figure(measurement: Measurement, name: str = "") -> Figure:
    """Response, spectrum, loops and a measured force, with the numbers above each; ``name`` stands above them.

    A motion that is given has no loop over a base; where it goes one way the force alone is drawn.
    """
    m, layout, force = measurement, measurement.layout, measurement.cycle.force
    if m.slides_one_way and force is not None:
        return _one_way_figure(m, force, name)
    ratio = "r unknown" if m.frequency_ratio is None else f"r = {m.frequency_ratio:.6g}"
    index = "unknown" if m.irregularity_index is None else f"{m.irregularity_index:.2g}"
    with style.drawing(5.2 if force is None else 7.4, name or m.source, m.warnings) as figure:
        grid = figure.add_gridspec(2 if force is None else 3, 2, width_ratios=(1.35, 1.0))
        title = f"{m.regime}, {m.stops_per_cycle:.3g} stops a cycle   amplitude {m.amplitude} Y   irregularity {index}"
        used, thin = np.flatnonzero(m.series.used), slice(None, None, math.ceil(layout.mass.shape[1] / THIN))
        last, time = used[-CYCLES:], layout.moments(used[-CYCLES:])
        stops = layout.seconds(m.found.T / style.TURN)
        stops = stops[(stops[:, 1] > time[0]) & (stops[:, 0] < time[-1])]
        lines = {"base": layout.base[last].ravel(), "mass": layout.mass[last].ravel()}
        ax = figure.add_subplot(grid[0, :], title=title)
        style.over_time(ax, time, lines, stops=stops, ylabel="displacement, x / Y, y / Y")
        title = f"{ratio}   Y = {1e3 * m.base_amplitude_m:.4g} mm   distortion {100 * m.base_distortion:.2g} %"
        is_given = m.energy.value is None
        _draw_spectrum(m, figure.add_subplot(grid[1, :] if is_given else grid[1, 0], title=title))
        if not is_given:
            ax = figure.add_subplot(grid[1, 1], title=f"energy {m.energy} kY² ({m.energy_rule})")
            some = np.unique(np.linspace(used[0], used[-1], LOOPS).round().astype(np.intp)).tolist()
            loops = [style.closed(np.stack([layout.mass[j, thin], layout.base[j, thin]], axis=1)) for j in some]
            fade = max(0.15, 1.0 / len(loops))
            ax.add_collection(LineCollection(loops, colors=style.MEASURED, linewidths=0.8, alpha=fade))
            ax.autoscale_view()
            ax.set(xlabel="displacement of the mass, x / Y", ylabel="displacement of the base, y / Y")
        if force is not None:
            unit, turn = 1e3 * m.base_amplitude_m, 2.0 * np.pi * m.drive_frequency_hz
            ways = (("speed of the mass [mm/s]", turn * m.cycle.mass_velocity), ("mass [mm]", m.cycle.mass_smooth))
            for column, (label, way) in enumerate(ways):
                ax = figure.add_subplot(grid[2, column], xlabel=label, ylabel="measured force [N]")
                ax.plot(unit * style.closed(way), style.closed(force), color=style.MEASURED)
                ax.locator_params(axis="x", nbins=5)
            figure.axes[-2].set_title(f"friction force {m.measured_force} N")
    return figure


def _one_way_figure(m: Measurement, force: FloatArray, name: str) -> Figure:
    """The mean cycle of the force (p,): a torque, where no radius makes a force of it."""
    quantity = "torque [N m]" if m.cycle.cell is None else "force [N]"
    with style.drawing(2.9, name or m.source, m.warnings) as figure:
        ax = figure.subplots()
        ax.plot(m.cycle.tau / style.TURN, style.unfolded(force, m.cycle.mass_velocity), color=style.MEASURED)
        ax.set(xlabel=style.ONE_WAY, ylabel=f"measured {quantity}, mean cycle")
        if m.measured_force.known:
            ax.set_title(f"friction force {m.measured_force} N   coefficient {m.measured_coefficient}")
    return figure


def _draw_spectrum(measurement: Measurement, ax: Axes) -> None:
    """Amplitude spectra of mass and base, the drive frequency marked."""
    drive, spectra = measurement.drive_frequency_hz, measurement.layout.spectra
    for label, color in (("base", style.GREY), ("mass", style.MEASURED)):
        lines, some = spectra[label], style.thinned(spectra[label].amplitude)
        ax.semilogy(lines.frequency[some], 1e3 * lines.amplitude[some], color=color, lw=0.8, label=label)
    height = [1e3 * measurement.base_amplitude_m]
    ax.plot([drive], height, "o", ms=5, mfc="none", color=style.VERMILION, label=f"drive, {drive:.6g} Hz")
    top = max(float(lines.amplitude.max()) for lines in spectra.values())
    ax.set(xlabel="frequency [Hz]", ylabel="amplitude [mm]", xlim=(0, spectra["base"].frequency[-1]))
    ax.set_ylim(1e-5, 3e3 * top)
    style.plain_numbers(ax.yaxis)
    ax.legend(loc="upper right")


def free_vibration_figure(taps: Sequence[FreeVibration], name: str = "") -> Figure:
    """Each tap with the motion fitted to it, and what is left; its numbers and ``name`` stand above."""

    def known(value: float, se: float | None, upper: float | None, times: float = 1.0) -> str:
        return f"below {times * (upper or 0.0):.2g}" if se is None else with_error(value, se, times)

    is_length = taps[0].unit == "m"
    size, small, times = (1e3, "µm", 1e3) if is_length else (np.degrees(1.0), "deg", 1.0)
    motion = "displacement of the mass [mm]" if is_length else "angle [deg]"
    titles = [
        f"{tap.start_s:.4g} s:   f_n = {with_error(tap.natural_frequency_hz, tap.natural_frequency_hz_se)} Hz   "
        f"zeta = {known(tap.damping_ratio, tap.damping_ratio_se, tap.damping_ratio_upper)}   "
        f"F/k = {known(tap.friction_m, tap.friction_m_se, tap.friction_m_upper, times * size)} {small}"
        for tap in taps[:TAPS]
    ]
    more = [f"... {len(taps)} taps"] if len(taps) > TAPS else []
    with style.drawing(4.6, name) as figure:
        above, below = figure.subplots(2, 1, height_ratios=(2.0, 1.0))
        for number, tap in enumerate(taps):
            time, measured, fitted = tap.time, size * tap.measured, size * tap.fitted
            above.plot(time, measured, color=style.MEASURED, label=None if number else "measured")
            above.plot(time, fitted, color=style.PREDICTED, lw=0.8, ls="--", label=None if number else "fitted")
            below.plot(time, times * (measured - fitted), color=style.MEASURED, lw=0.5)
        above.set(title="\n".join(titles + more), xlabel="time [s]", ylabel=motion)
        above.legend(loc="upper right", ncols=2)
        below.set(xlabel="time [s]", ylabel=f"measured - fitted [{small}]")
    return figure


def record_figure(record: WholeRecord, title: str = "whole record") -> Figure:
    """The record, a zoom of its worst periods (framed), energy, friction and misfit over time; shaded: they part."""
    per = max(1, len(record.time) // max(1, len(record.cycle_nrmse)))
    worst = int(np.argmax(record.cycle_nrmse)) if len(record.cycle_nrmse) else 0
    begin = max(0, min((worst - ZOOM // 2) * per, len(record.time) - ZOOM * per))
    zoom = slice(begin, begin + ZOOM * per)
    size = 3.0 if len(record.cycle_time) <= MANY else 0.8  # in a long record points would hide each other
    numbers = f"record nrmse {100 * record.nrmse:.2g} %, energy {100 * record.energy_difference:+.2g} %"
    with style.drawing(5.6, f"{title}: {numbers}", record.warnings) as figure:
        axes = figure.subplot_mosaic([["all"] * 3, ["zoom"] * 3, ["energy", "friction", "misfit"]])
        for name, part in (("all", slice(None)), ("zoom", zoom)):
            lines = {"base": record.base, "measured": record.measured, "predicted": record.predicted}
            shown = {label: values[part] for label, values in lines.items()}
            style.over_time(axes[name], record.time[part], shown, ylabel="x / Y")
        axes["all"].axvspan(*record.time[zoom][[0, -1]], fill=False, edgecolor=style.GREY, lw=0.7)
        for start, end, _ in record.left:
            axes["all"].axvspan(start, end, color=style.VERMILION, alpha=0.12, linewidth=0.0)
        ax, time = axes["energy"], record.cycle_time
        ax.plot(time, record.cycle_measured, "o", ms=size, color=style.MEASURED, label="measured")
        ax.plot(time, record.cycle_predicted, "-", lw=1.0, color=style.PREDICTED, label="predicted")
        ax.set(xlabel="time [s]", ylabel="energy per period [kY²]")
        ax.margins(y=0.25)
        ax.legend(loc="upper center", ncols=2)
        ax, error = axes["friction"], np.nan_to_num(record.cycle_friction_se)
        band = (record.cycle_friction - error, record.cycle_friction + error)
        ax.fill_between(time, *band, color=style.PREDICTED, alpha=0.2, lw=0)
        ax.plot(time, record.cycle_friction, color=style.PREDICTED, lw=1.0)
        if len(record.cycle_friction):
            middle = float(np.median(record.cycle_friction))
            ends = [*ax.get_ylim(), middle * (1.0 - FLAT), middle * (1.0 + FLAT)]
            ax.set_ylim(min(ends), max(ends))  # what changes by less looks as flat as it is
        ax.ticklabel_format(axis="y", useOffset=False)
        ax.set(xlabel="time [s]", ylabel="friction ratio")
        ax = axes["misfit"]
        ax.plot(time, 100 * record.cycle_nrmse, "o-", ms=size, lw=0.8, color=style.PREDICTED)
        if len(record.cycle_nrmse):
            ax.axhline(100 * float(np.median(record.cycle_nrmse)), color=style.GREY, lw=0.8)
        ax.set(xlabel="time [s]", ylabel="nrmse of a period [%]")
        ax.set_ylim(bottom=0.0)
    return figure
