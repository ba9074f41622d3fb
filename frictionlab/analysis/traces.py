"""Excerpts of a measurement for its figure: a few cycles, their loops, their stops, the spectra."""

import math

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.layout import Layout
from frictionlab.analysis.measurement import Traces
from frictionlab.analysis.spectrum import Spectrum
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
    mass_lines, base_lines = _thinned(layout.mass_spectrum), _thinned(layout.base_spectrum)
    return Traces(
        time=time,
        mass=layout.mass[last, ::thin].ravel(),
        base=layout.base[last, ::thin].ravel(),
        stops=_stops_in_seconds(layout, found, last),
        loop_mass=_closed(layout.mass[loops, ::thin]),
        loop_base=_closed(layout.base[loops, ::thin]),
        mass_frequency=mass_lines.frequency,
        mass_spectrum=mass_lines.amplitude,
        base_frequency=base_lines.frequency,
        base_spectrum=base_lines.amplitude,
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


def _thinned(lines: Spectrum) -> Spectrum:
    """Highest of each few neighbouring lines, so that no peak is thinned away."""
    width = math.ceil(len(lines.frequency) / SHOWN_LINES)
    first = np.arange(0, len(lines.frequency), width)
    return Spectrum(lines.frequency[first], np.maximum.reduceat(lines.amplitude, first), lines.resolution)
