"""How the mass answers, cycle by cycle: noise taken off, energy, amplitude, position, stops and regime.

Smoothing by the spectrum: what the cycles have in common, and what each has of its own. The mean cycle is known the
better the more cycles there are; a cycle's deviation from it is kept only where its spectrum stands above the
sensor's. Both are Wiener filters (gain = signal power / total power, per harmonic), so that a regular motion is
smoothed over all its cycles and an irregular one cycle by cycle, without anything to tune.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy import fft

from frictionlab.analysis import energy, stops
from frictionlab.analysis.cycles import chunks
from frictionlab.analysis.layout import Layout, slow_wander
from frictionlab.analysis.signals import white_noise
from frictionlab.analysis.stops import Move, Thresholds
from frictionlab.arrays import ComplexArray, FloatArray

FEW = 5  # cycles whose mean shows a slip within a stop
LEVELLED = 0.5  # of the range, which stops of one place each never take away
FINE = 512  # points a cycle, at least, on which stops and extremes are looked for
_KEPT_FROM = 1.5  # amplitude over the noise's, about, from which a harmonic stands out
_MOST_RAISED = 4.0
_ENOUGH = 32  # harmonics whose median is a floor
_BLOCK = 1 << 18  # points smoothed, or of loops measured, at a time: long recordings fit in memory


@dataclass(frozen=True)
class Smoother:
    """How cycles are smoothed, decided from all of them.

    ``mean`` (points/2 + 1,) complex: Fourier coefficients of the smoothed mean cycle; ``own_gain`` (points/2 + 1,):
    what is kept of a cycle's deviation, by harmonic; ``x_noise``, ``v_noise``: rms of the error left in one point of
    x and v (v: with the harmonics given up); ``x_tail``: what the harmonics that drown in noise may add to an extreme;
    ``resolution``: the shortest time that can be resolved, in radians of tau.
    """

    mean: ComplexArray
    own_gain: FloatArray
    x_noise: float
    v_noise: float
    x_tail: float
    resolution: float

    def cycle(self, points: int) -> tuple[FloatArray, FloatArray]:
        """The smoothed mean cycle on so many points, and its derivative by the phase."""
        lines = self.mean * points
        return fft.irfft(lines, points), fft.irfft(1j * np.arange(len(lines)) * lines, points)


def smoother(rows: FloatArray, *, noise: float, samples: float, shared: float = 0.0) -> Smoother:
    """Decide how to smooth cycles (n, points), points even, one a row.

    ``noise``: rms of the white noise of one of the ``samples`` that the sensor took of a cycle (a row may have more
    points); ``shared``: the same of noise that cycles share, for rounding without noise follows the place.
    """
    n, points = rows.shape
    mean_cycle = rows.mean(axis=0)
    lines = fft.rfft(mean_cycle) / points
    floor = noise * noise / samples  # power that noise alone gives one coefficient of one cycle
    mean_floor = floor / n + shared * shared / samples
    mean_gain = np.ones(len(lines))
    for parity in (1, 2):  # apart: a motion whose halves mirror each other has odd harmonics only
        mean_gain[parity::2] = _gain(np.abs(lines[parity::2]) ** 2, mean_floor, 1)
    own_gain = np.zeros(len(lines))
    if n > 1:
        power = np.zeros(len(lines))
        for some in chunks(n, points, _BLOCK):
            own = fft.rfft(rows[some] - mean_cycle, axis=1)
            power += np.sum(own.real**2 + own.imag**2, axis=0)
        power = power / (n - 1) / points**2
        top = power[int(0.375 * samples) : int(0.5 * samples)]
        if len(top) >= _ENOUGH:  # rounding without noise is not quite white
            floor = min(max(floor, float(np.median(top))), _MOST_RAISED * floor)
        floor += shared * shared / samples
        own_gain[1:] = _gain(power[1:], floor, n - 1)
    k = np.arange(len(lines))
    left = 2.0 * (mean_floor * mean_gain**2 + floor * own_gain**2)
    left[0] *= 0.5
    highest = max(1, int(np.flatnonzero((mean_gain > 0.0) | (own_gain > 0.0))[-1]))
    drowned = _KEPT_FROM * math.sqrt(mean_floor)  # amplitude of the first harmonic given up; the others fall as k^-3
    v_noise = math.hypot(math.sqrt(float((left * k * k).sum())), drowned * math.sqrt(highest**3 / 3.0))
    return Smoother(
        mean=lines * mean_gain,
        own_gain=own_gain,
        x_noise=math.sqrt(float(left.sum())),
        v_noise=v_noise,
        x_tail=0.5 * highest * drowned,  # all of them in phase at an extreme
        resolution=math.pi / highest,
    )


def _gain(power: FloatArray, floor: float, samples: int) -> FloatArray:
    """Wiener gain by line, of power averaged over its neighbourhood; 0 above the last line that stands out of noise."""
    k = np.arange(len(power))
    reach = np.maximum(2, k // 6)
    low, high = np.maximum(k - reach, 0), np.minimum(k + reach, len(power) - 1)
    total = np.concatenate([[0.0], np.cumsum(power)])
    count = high - low + 1
    local = (total[high + 1] - total[low]) / count
    clear = local > floor * (1.0 + 4.0 / np.sqrt(count * samples))
    gain = np.where(clear, 1.0 - floor / np.maximum(local, 1e-300), 0.0)
    gain[(int(np.flatnonzero(clear)[-1]) if clear.any() else 0) + 1 :] = 0.0
    return gain


def smoothed(rows: FloatArray, how: Smoother, points: int) -> tuple[FloatArray, FloatArray]:
    """Smooth cycles (n, p): x and its derivative by tau (n, points); deviations from the mean cycle as one signal."""
    mean_cycle, both = rows.mean(axis=0), np.empty((2, len(rows), points))
    both[:] = np.stack(how.cycle(points))[:, None]
    for some in chunks(len(rows), points, _BLOCK) if how.own_gain.any() else ():
        n, flat = some.stop - some.start, (rows[some] - mean_cycle).ravel()
        lines = fft.rfft(np.concatenate([flat, flat[::-1]])) / len(flat)
        harmonic = np.arange(len(lines)) / (2.0 * n)
        lines *= np.interp(harmonic, np.arange(1, len(how.own_gain)), how.own_gain[1:]) * (n * points)
        for signal, factor in zip(both, (1.0, 1j * harmonic), strict=True):
            signal[some] += fft.irfft(factor * lines, 2 * n * points)[: n * points].reshape(n, points)
    return both[0], both[1]


@dataclass(frozen=True)
class Response:
    """How the mass answers: what is known of each cycle (n,), and of all.

    ``energy`` (k Y^2), ``amplitude`` (Y), ``position`` (Y), ``stops``, ``stuck`` (fraction): of each cycle; ``found``:
    each stop; ``energy_noise``, ``amplitude_noise``: standard error of one cycle's value from sensor noise alone;
    ``energy_shared``: standard error that all cycles have in common; ``stops_per_cycle``, ``stuck_fraction``,
    ``regime``: over all cycles; ``asymmetry``: rms of the even part of the mean cycle over its rms; ``how``: the
    smoother of all cycles; ``shortest_stop``: shortest stop that differs from a slow passage, in cycles (1: none
    can); ``doubtful``: pauses of a cycle that are too short to be sure, and their mean length in cycles;
    ``smallest_slip``: way (Y) of the smallest slip within a stop of a tenth of a cycle that is seen; ``unclear``: a
    move within a stop that may part it or not.
    """

    energy: FloatArray
    amplitude: FloatArray
    position: FloatArray
    stops: FloatArray
    stuck: FloatArray
    found: FloatArray
    energy_noise: float
    energy_shared: float
    amplitude_noise: float
    stops_per_cycle: float
    stuck_fraction: float
    regime: str
    asymmetry: float
    shortest_stop: float
    doubtful: tuple[float, float]
    smallest_slip: float
    unclear: Move | None
    how: Smoother

    @property
    def size(self) -> float:
        """Usual amplitude of a cycle, Y."""
        return float(np.median(self.amplitude))

    @property
    def is_stuck(self) -> bool:
        """Whether the mass does not move by more than its sensor's noise."""
        return self.regime == "stuck"


def response(layout: Layout, *, wall_moves: bool = False) -> Response:
    """Measure the mass's answer from steady cycles; a wall that goes with the base: stops are relative to the base."""
    of_mass, of_base, n = layout.of_mass, layout.of_base, len(layout)
    points, rounding = max(FINE, layout.mass.shape[1]), 1e-14 * (1.0 + abs(layout.offset) / layout.drive.amplitude)
    how = smoother(layout.mass, noise=of_mass.noise, samples=layout.samples, shared=of_mass.shared)
    slid, sliding, noise, shared = layout.mass, how, of_mass.noise, of_mass.shared
    if wall_moves:
        slid = layout.mass - layout.base
        noise, shared = math.hypot(noise, of_base.noise), math.hypot(shared, of_base.shared)
        sliding = smoother(slid, noise=noise, samples=layout.samples, shared=shared)
    x, v = smoothed(slid, sliding, points)
    thresholds = Thresholds.of(sliding.v_noise, sliding.resolution)
    if "mass_velocity" in layout.more and not wall_moves:
        rows = layout.more["mass_velocity"] / (2.0 * math.pi * layout.drive.frequency * layout.drive.amplitude)
        of_speed = smoother(rows, noise=white_noise(rows.ravel()), samples=layout.samples)
        v = smoothed(rows, of_speed, points)[0]
        thresholds = Thresholds.of(math.hypot(of_speed.x_noise, of_speed.x_tail), of_speed.resolution)
    found, doubts = stops.stops_of(stops.pauses(v, thresholds.still), thresholds, points)
    whole, slide = half_range(x), half_range(levelled(x, found, sliding.resolution))
    rough, unclear = math.hypot(noise / math.sqrt(n), shared), None
    if n >= FEW:
        found, unclear = stops.parted(found, slid.mean(axis=0), noise=rough, dwell=thresholds.dwell, cycles=n)
    is_blurred = float(np.median(slide)) < LEVELLED * float(np.median(whole))
    if is_blurred:  # a threshold above the mass's own speed makes one stop of all
        found, slide, unclear = np.zeros((2, 0)), whole, None
    is_stuck = float(np.median(slide)) < 4.0 * noise + rounding
    count, stuck = (np.zeros(n), np.ones(n)) if is_stuck else stops.per_cycle(found, n)
    if wall_moves:  # the mass itself stands nowhere
        slide = whole = half_range(smoothed(layout.mass, how, points)[0])
    power, areas = np.abs(how.mean[1:]) ** 2, _loop_areas(layout)
    energy_noises = _energy_noises(layout, how, found, float(np.mean(areas)) * layout.drive.growth / math.sqrt(12.0))
    return Response(
        energy=areas,
        amplitude=slide,
        position=layout.mass.mean(axis=1),
        stops=count,
        stuck=stuck,
        found=found,
        energy_noise=energy_noises[0],
        energy_shared=energy_noises[1],
        amplitude_noise=_amplitude_noise(layout, how if wall_moves else sliding, slide, whole),
        stops_per_cycle=float(count.mean()),
        stuck_fraction=float(stuck.mean()),
        regime="stuck" if is_stuck else "stick-slip" if count.mean() >= 0.5 else "continuous",
        asymmetry=math.sqrt(float(power[1::2].sum() / max(power.sum(), 1e-300))),
        how=how,
        shortest_stop=1.0 if is_blurred else 2.0 * thresholds.dwell / stops.TURN,
        doubtful=(len(doubts) / n, float(np.mean(doubts)) / stops.TURN if len(doubts) else 0.0),
        smallest_slip=stops.smallest_slip(rough, layout.samples),
        unclear=None if is_stuck else unclear,
    )


def _amplitude_noise(layout: Layout, how: Smoother, levelled: FloatArray, whole: FloatArray) -> float:
    """Standard error of one cycle's amplitude, by the amplitudes (n,) with stops levelled and not."""
    amplitude = float(np.mean(levelled))
    return math.hypot(
        how.x_noise / math.sqrt(2.0),
        how.x_tail,
        layout.of_mass.rounding / math.sqrt(2.0),
        layout.left,
        max(0.0, float(np.mean(whole)) - amplitude - how.x_tail),  # a stop that begins as a slow passage
        amplitude * layout.drive.amplitude_se / layout.drive.amplitude,  # of the unit
    )


def _energy_noises(layout: Layout, how: Smoother, found: FloatArray, growth: float) -> tuple[float, float]:
    """Standard errors of energy (k Y^2): of one cycle by white noise, and of all in common; `growth`: of the drive."""
    mass, base, base_cycle = layout.of_mass, layout.of_base, layout.base.mean(axis=0)
    white, shared = (
        energy.loop_area_noise(how.cycle(len(base_cycle))[0], base_cycle, *noises, layout.samples)
        for noises in ((mass.noise, base.noise), (mass.shared, base.shared))
    )
    way = np.diff(np.sin(found), axis=0)  # of the base (Y) during each stop: there one error stays
    stays = mass.rounding * math.sqrt(float(np.sum(way * way)) / len(layout))
    return white, math.hypot(shared, stays, growth)


def _loop_areas(layout: Layout) -> FloatArray:
    """Energy of each cycle (n,), k Y^2; without the slow wander: a sensor that drifts adds no energy."""
    n, points = layout.mass.shape
    means = layout.base.mean(axis=1)
    return np.concatenate(
        [
            energy.loop_area(layout.mass[some], layout.base[some] - slow_wander(means, points, layout.blocks, some))
            for some in chunks(n, points, _BLOCK)
        ]
    )


def levelled(x: FloatArray, found: FloatArray, margin: float) -> FloatArray:
    """Replace each stop, and the smoothing's overshoot within ``margin`` (rad) of a long one, by its mean."""
    scale, flat = x.shape[1] / stops.TURN, x.ravel().copy()
    wrapped = np.maximum(found - stops.TURN * len(x), 0.0)  # of a stop that goes on at the record's beginning
    for begin, end in zip(*(np.concatenate([found, wrapped], axis=1) * scale).tolist(), strict=True):
        first, last = math.ceil(begin), min(math.floor(end), x.size)
        if last - first >= 2:
            reach = math.ceil(margin * scale) if last - first > 2.0 * margin * scale else 0
            flat[max(first - reach, 0) : last + reach] = x.ravel()[first:last].mean()
    return flat.reshape(x.shape)


def half_range(x: FloatArray) -> FloatArray:
    """(max - min) / 2 of each row; an extreme that is not flat is refined by a parabola through three points."""
    return 0.5 * (_summit(x) + _summit(-x))


def _summit(x: FloatArray) -> FloatArray:
    n, points = x.shape
    row, top = np.arange(n), np.argmax(x, axis=1)
    left, middle, right, beyond = (x[row, (top + step) % points] for step in (-1, 0, 1, 2))
    curvature = left - 2.0 * middle + right
    is_peak = (curvature < 0.0) & ~((right == middle) & (beyond == middle))
    safe = np.where(is_peak, curvature, -1.0)
    return np.asarray(np.where(is_peak, middle - 0.125 * (left - right) ** 2 / safe, middle))
