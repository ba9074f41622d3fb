"""Excerpts of a measurement for its figure: a few cycles, their loops, their stops, the spectra."""

import math

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.layout import Layout
from frictionlab.analysis.measurement import Traces
from frictionlab.analysis.stops import Stops

FloatArray = NDArray[np.float64]
SHOWN_CYCLES = 6
SHOWN_LOOPS = 30
SHOWN_POINTS = 512  # a cycle
SHOWN_LINES = 8000


def traces(layout: Layout, found: Stops, used: slice) -> Traces:
    """Cut out what a figure shows of the cycles used."""
    last = slice(max(0, used.stop - SHOWN_CYCLES), used.stop)
    thin = math.ceil(layout.mass.shape[1] / SHOWN_POINTS)
    loops = np.unique(np.linspace(used.start, used.stop - 1, SHOWN_LOOPS).round().astype(np.intp))
    points = layout.mass.shape[1]
    inside = np.arange(points)[::thin] / points
    time = (layout.time[last, None] + (layout.end[last] - layout.time[last])[:, None] * inside).ravel()
    lines = math.ceil(len(layout.mass_spectrum.frequency) / SHOWN_LINES)
    return Traces(
        time=time,
        mass=layout.mass[last, ::thin].ravel(),
        base=layout.base[last, ::thin].ravel(),
        stops=_stops_in_seconds(layout, found, last),
        loop_mass=_closed(layout.mass[loops, ::thin]),
        loop_base=_closed(layout.base[loops, ::thin]),
        frequency=layout.mass_spectrum.frequency[::lines],
        mass_spectrum=_highest(layout.mass_spectrum.amplitude, lines),
        base_spectrum=_highest(layout.base_spectrum.amplitude, lines),
    )


def _stops_in_seconds(layout: Layout, found: Stops, some: slice) -> FloatArray:
    """Begin and end of the stops in some cycles, (k, 2) s."""
    cycle = np.arange(len(layout) + 1, dtype=np.float64)
    edges = np.append(layout.time, layout.end[-1])
    pair = np.stack([found.begin, found.end], axis=1) / (2.0 * math.pi)
    inside = pair[(pair[:, 1] > some.start) & (pair[:, 0] < some.stop)]
    return np.asarray(np.interp(np.clip(inside, some.start, some.stop), cycle, edges))


def _closed(rows: FloatArray) -> FloatArray:
    return np.concatenate([rows, rows[:, :1]], axis=1)


def _highest(amplitude: FloatArray, width: int) -> FloatArray:
    """Highest of each ``width`` neighbouring lines, so that no peak is thinned away."""
    return np.asarray(np.maximum.reduceat(amplitude, np.arange(0, len(amplitude), width)))
