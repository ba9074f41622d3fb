"""The mean cycle of a measurement, the numbers of its single cycles, and what a figure shows of them."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis import channels, response
from frictionlab.analysis.channels import SensorChannel
from frictionlab.analysis.energy import LoadCell
from frictionlab.analysis.layout import Layout, slow_wander
from frictionlab.analysis.response import Response
from frictionlab.arrays import ComplexArray, FloatArray

MOST_SINGLE, MOST_HARMONICS = 400, 128  # of the single cycles that show the scatter
SHOWN_CYCLES, SHOWN_LOOPS = 6, 30
SHOWN_POINTS, SHOWN_LINES = 512, 8000  # a cycle, a spectrum


@dataclass(frozen=True)
class OtherMass:
    """A further mass in the same cycles: its mean cycle ``mass`` (p,) and single cycles ``each`` (n, K), as `Cycle`."""

    mass: FloatArray
    each: NDArray[np.complex128]


@dataclass(frozen=True)
class Cycle:
    """The mean of the cycles used, on points equally spaced in phase from tau = 0 (the base's fundamental at its top).

    ``tau`` (p,) rad; ``mass`` (p,) x/Y about its mean, ``base`` (p,) y/Y about its mean: as measured;
    ``mass_smooth``, ``mass_velocity`` (p,): without the noise, and its derivative by tau;
    ``base_cosine``, ``base_sine`` (9,): Fourier series of y/Y, harmonics 1 to 9 (the first is 1 and 0);
    ``kept`` (p // 2,): how much of the mass's harmonics 1 to p // 2 its filter leaves once it is taken back;
    ``each`` (n, K): complex amplitudes of harmonics 1 to K of x/Y in single steady cycles, up to 400 of them evenly
    chosen: how far one cycle may be from another;
    ``force`` (p,) N (a torque: N m): at the contact, about its mean, known inertia taken off; None: not measured;
    ``cell``: the same of single cycles;
    ``others``: the masses from the second on, of a frame of several.
    """

    tau: FloatArray
    mass: FloatArray
    base: FloatArray
    mass_smooth: FloatArray
    mass_velocity: FloatArray
    base_cosine: FloatArray
    base_sine: FloatArray
    each: NDArray[np.complex128]
    kept: FloatArray
    force: FloatArray | None = None
    cell: LoadCell | None = None
    others: tuple[OtherMass, ...] = ()


@dataclass(frozen=True)
class CycleSeries:
    """One value per full steady cycle, arrays (n,): ``time`` of its start [s]; ``used``: by the energy rule.

    ``energy`` (k Y^2), ``amplitude`` (Y), ``position``: mean of x/Y in the cycle about the whole mean,
    ``stops``: stops that begin in the cycle, ``stuck``: fraction of the cycle standing.
    """

    time: FloatArray
    used: NDArray[np.bool_]
    energy: FloatArray
    amplitude: FloatArray
    position: FloatArray
    stops: FloatArray
    stuck: FloatArray


@dataclass(frozen=True)
class Traces:
    """What a figure of the measurement shows; thinned, never computed on.

    ``time`` (t,) s, ``mass``, ``base`` (t,) in Y: the last cycles used; ``stops`` (k, 2) s: from when to when the mass
    stands in them; ``loop_mass``, ``loop_base`` (c, p): up to 30 of the cycles used, each closed; ``mass_frequency``,
    ``base_frequency`` Hz, ``mass_spectrum``, ``base_spectrum`` m: amplitude spectra up to ten times the drive.
    """

    time: FloatArray
    mass: FloatArray
    base: FloatArray
    stops: FloatArray
    loop_mass: FloatArray
    loop_base: FloatArray
    mass_frequency: FloatArray
    mass_spectrum: FloatArray
    base_frequency: FloatArray
    base_spectrum: FloatArray


def mean_cycle(layout: Layout, answer: Response, used: slice, of_mass: SensorChannel) -> Cycle:
    """Mean of the cycles used, turned so that it starts at tau = 0, the slow wander of both channels taken off."""
    points, how = layout.mass.shape[1], answer.how
    if used.stop - used.start < len(layout):
        sensor = layout.of_mass
        how = response.smoother(layout.mass[used], noise=sensor.noise, samples=layout.samples, shared=sensor.shared)

    def turned(cycle: FloatArray) -> FloatArray:
        return np.asarray(np.roll(cycle, -(points // 4)))

    def mean_of(rows: FloatArray, wander: FloatArray | float) -> FloatArray:
        mean = turned(rows[used].mean(axis=0) - wander)
        return np.asarray(mean - mean.mean())

    def single(rows: FloatArray) -> ComplexArray:
        """Harmonics (n, K) of single cycles, at most `MOST_SINGLE`, counted from the top of the base's motion."""
        if len(rows) > MOST_SINGLE:
            rows = rows[np.linspace(0, len(rows) - 1, MOST_SINGLE).astype(np.intp)]
        each = np.fft.rfft(rows, axis=1)[:, 1 : MOST_HARMONICS + 1] * (2.0 / points)
        return np.asarray(each * 1j ** np.arange(1, each.shape[1] + 1))

    def wander_of(means: FloatArray) -> FloatArray:
        return np.asarray(slow_wander(means, points, layout.blocks)[0])

    smooth, velocity = map(turned, how.cycle(points))
    others = [layout.more[name] / layout.drive.amplitude for name in channels.other_masses(layout.more)]
    return Cycle(
        tau=2.0 * math.pi * np.arange(points) / points,
        mass=mean_of(layout.mass, wander_of(answer.position)),
        base=mean_of(layout.base, layout.base_wander),
        mass_smooth=smooth - smooth.mean(),
        mass_velocity=velocity,
        base_cosine=layout.drive.harmonics.real.copy(),
        base_sine=-layout.drive.harmonics.imag,
        each=single(layout.mass),
        others=tuple(OtherMass(mean_of(rows, wander_of(rows.mean(axis=1))), single(rows)) for rows in others),
        kept=channels.kept(layout.drive.frequency * np.arange(1, points // 2 + 1), of_mass),
    )


def traces(layout: Layout, found: FloatArray, used: slice) -> Traces:
    """Cut out what a figure shows of the cycles used; ``found`` (2, m): stops, radians of tau."""
    points, last = layout.mass.shape[1], slice(max(0, used.stop - SHOWN_CYCLES), used.stop)
    thin = math.ceil(points / SHOWN_POINTS)
    loops = np.unique(np.linspace(used.start, used.stop - 1, SHOWN_LOOPS).round().astype(np.intp))
    inside = np.arange(points)[::thin] / points
    time = layout.time[last, None] + (layout.end[last] - layout.time[last])[:, None] * inside
    shown = found.T / (2.0 * math.pi)
    shown = np.clip(shown[(shown[:, 1] > last.start) & (shown[:, 0] < last.stop)], last.start, last.stop)
    cycles = (layout.mass[loops], layout.base[loops])
    closed = [np.concatenate([rows[:, ::thin], rows[:, :1]], axis=1) for rows in cycles]
    spectra = []
    for lines in (layout.mass_spectrum, layout.base_spectrum):  # the highest of a few neighbours: no peak is lost
        first = np.arange(0, len(lines.frequency), math.ceil(len(lines.frequency) / SHOWN_LINES))
        spectra += [lines.frequency[first], np.maximum.reduceat(lines.amplitude, first)]
    return Traces(
        time.ravel(),
        layout.mass[last, ::thin].ravel(),
        layout.base[last, ::thin].ravel(),
        np.asarray(np.interp(shown, np.arange(len(layout) + 1.0), np.append(layout.time, layout.end[-1]))),
        *closed,
        *spectra,
    )
