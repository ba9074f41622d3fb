"""One measurement in one figure: time response with its stops, hysteresis loops, spectrum with the drive marked."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from frictionlab.analysis.measurement import Measurement
from frictionlab.figures.style import (
    BASE,
    GREY,
    MEASURED,
    ORANGE,
    PAGE,
    VERMILION,
    caution,
    headline,
    look,
    new_figure,
    plain_decades,
)


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


def draw_force(measurement: Measurement, ax: Axes, *, over_speed: bool) -> Axes:
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
            over_speed = draw_force(measurement, figure.add_subplot(grid[2, 0]), over_speed=True)
            over_speed.set_title(f"friction force {measurement.measured_force} N")
            draw_force(measurement, figure.add_subplot(grid[2, 1]), over_speed=False)
        headline(figure, name or measurement.source)
        caution(figure, measurement.warnings)
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
