"""Cycles of the drive: cut by the phase of the base motion's fundamental, never by peaks of the mass.

A cycle starts where the fundamental of the base rises through zero. A loop that does not close exactly (sensor drift,
an irregular mass) then closes where the base is at zero, and the closing chord adds no area.

Smoothing by the spectrum: what the cycles have in common, and what each has of its own. The mean cycle is known the
better the more cycles there are; a cycle's deviation from it is kept only where its spectrum stands above the
sensor's. Both are Wiener filters (share kept = signal power / total power, per harmonic), so that a regular motion is
smoothed over all its cycles and an irregular one cycle by cycle, without anything to tune.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from frictionlab.analysis.signals import Sensor, line, variance_inflation
from frictionlab.arrays import ComplexArray, FloatArray, IntArray
from frictionlab.errors import AnalysisError

FEWEST_SAMPLES = 6  # a cycle; with 5 the base's amplitude comes out 3 % low, with 3 the motion is lost
MOST_SINGLE = 400  # cycles that show the scatter
SHARP = 96  # samples a cycle: between fewer a cubic takes from the harmonics by which laws differ
FINEST = 4  # times as many points as samples that a signal is laid on, at most
SLOWEST = 0.2  # of the drive, at least: what is slower is gone of a motion that was integrated
_CHUNK = 1 << 16  # samples folded at a time: stays in the cache
INTERPOLATED = 733.0 / 945.0
"""Mean variance that `interpolate` leaves of unit white noise, over all positions between samples."""


@dataclass(frozen=True)
class Cut:
    """Where the cycles of one uninterrupted stretch lie, in fractional sample numbers.

    ``start`` (n,), ``end`` (n,): the base's fundamental rises through zero; ``frequency``: mean drive frequency in
    cycles per sample; ``frequency_se``: its standard error, from the scatter of the phase over the cycles;
    ``wander``: rms of the phase about a constant frequency, rad; ``drifts``: whether the cut follows the wander.
    """

    start: FloatArray
    end: FloatArray
    frequency: float
    frequency_se: float
    wander: float
    drifts: bool

    def __len__(self) -> int:
        return len(self.start)


def interpolate(signal: FloatArray, position: FloatArray, *, jumps: bool = False) -> FloatArray:
    """Values of a signal between its samples: cubic through the four nearest (Lagrange), shape of ``position``.

    One that ``jumps``, as friction does where it turns, stays between the two samples beside it: no cubic does.
    """
    index = np.clip(position.astype(np.intp), 1, len(signal) - 3)
    u = position - index
    v, w, z = u + 1.0, u - 1.0, u - 2.0
    near, far = u * w, v * z
    value = signal[index] * (far * w)
    value -= signal[index + 1] * (far * u)
    value *= 0.5
    value += signal[index + 2] * (near * v / 6.0)
    value -= signal[index - 1] * (near * z / 6.0)
    if jumps:
        beside = np.sort(np.stack([signal[index], signal[index + 1]]), axis=0)
        return np.clip(value, *beside)
    return value


def finer(signal: FloatArray, times: int) -> FloatArray:
    """A signal (n,) on a grid so many times finer, ((n - 1) times + 1,), by its spectrum: exact up to half its rate."""
    n = len(signal)
    about = signal - np.linspace(signal[0], signal[-1], n)
    lines = np.fft.rfft(np.concatenate([about, -about[-2:0:-1]]))
    smooth = np.fft.irfft(lines * times, (2 * n - 2) * times)[: (n - 1) * times + 1]
    return np.asarray(smooth + np.linspace(signal[0], signal[-1], len(smooth)))


def chunks(count: int, points: int, size: int = 1 << 13) -> Iterator[slice]:
    """A few rows of so many points at a time: by default as many as stay in the nearest cache."""
    some = max(1, size // points)
    return (slice(first, min(first + some, count)) for first in range(0, max(count, 1), some))


def fold(signal: FloatArray, start: FloatArray, end: FloatArray, points: int, *, jumps: bool = False) -> FloatArray:
    """Lay cycles under each other: row j holds ``points`` values, evenly from ``start[j]`` to before ``end[j]``.

    ``start`` and ``end`` (n,): fractional sample numbers within the signal (m,); ``jumps``: as of `interpolate`.
    Returns (n, points).
    """
    rows, phase = np.empty((len(start), points)), np.arange(points) / points
    for some in chunks(len(start), points, _CHUNK):
        rows[some] = interpolate(signal, start[some, None] + (end[some] - start[some])[:, None] * phase, jumps=jumps)
    return rows


def some_cycles(count: int) -> IntArray:
    """Numbers of the single cycles that are kept to show the scatter: all, or evenly chosen ones of many."""
    return np.linspace(0, count - 1, min(count, MOST_SINGLE)).astype(np.intp)


def common(signal: FloatArray, found: Cut) -> FloatArray:
    """What all cycles of a signal (m,) have in common, at its own samples; the first and last cycle go on outside."""
    points = points_per_cycle(1.0 / found.frequency)
    cycle = fold(signal, found.start, found.end, points).mean(axis=0)
    edges, number = np.append(found.start, found.end[-1]), np.arange(len(found) + 1.0)
    around = np.concatenate([cycle[-2:], cycle, cycle[:3]])
    every = np.empty(len(signal))
    for some in chunks(len(signal), 1, _CHUNK):
        at = np.arange(some.start, some.stop, dtype=np.float64)
        beyond = np.minimum(at - edges[0], 0.0) + np.maximum(at - edges[-1], 0.0)
        turns = np.interp(at, edges, number) + found.frequency * beyond
        every[some] = interpolate(around, (turns % 1.0) * points + 2.0)
    return every


def points_per_cycle(samples_per_cycle: float, *, least: int = 64, most: int | None = None) -> int:
    """Points a cycle is laid out on: a multiple of 8, one for each sample, but at least and at most so many."""
    points = max(least, 8 * math.ceil(samples_per_cycle / 8.0))
    return points if most is None else min(points, most)


def first_harmonic(rows: FloatArray, angle: FloatArray) -> ComplexArray:
    """Sum of each row times exp(-i angle), (n,). einsum, not BLAS: threads that fight for a busy core cost more."""
    cosine, sine = np.einsum("ij,j->i", rows, np.cos(angle)), np.einsum("ij,j->i", rows, np.sin(angle))
    return np.asarray(cosine - 1j * sine)


def cut(base: FloatArray, frequency: float, *, noise: float) -> Cut:
    """Cut a stretch into cycles by the phase of the base motion's fundamental.

    The phase of each cycle is the angle of its first Fourier coefficient; harmonics and offset do not enter. A
    straight line through the phases gives the mean frequency. Where the drive wanders by more than the sensor's noise
    explains, the cut follows it from cycle to cycle; else the line is the cut.

    ``base`` (m,): of one stretch, evenly sampled; ``frequency``: first guess in cycles per sample, good to a quarter of
    a period over neighbouring cycles; ``noise``: rms of the sensor's white noise, for the standard error.

    Raises
    ------
    AnalysisError
        The first guess is no frequency that samples show.
    """
    if not 0.0 < frequency < 0.5:
        raise AnalysisError(f"cycles: expected 0 to 0.5 drive cycles per sample; got {frequency:g}")
    track = _phase_track(base, frequency)
    for _ in range(1 if track.count > 2 else 8):  # a period that is off lets offset and harmonics leak
        frequency += track.slope
        track = _phase_track(base, frequency)
    found = _boundaries(track, frequency + track.slope, noise, len(base))
    if not found.drifts or len(found) < 3:
        return found
    # the phase again, in cycles of the length that each one has: no offset or harmonic leaks into it
    lines = fundamentals(base, found.start, found.end, points_per_cycle(float((found.end - found.start).mean())))
    phase = np.angle(1j * lines) / (2.0 * math.pi)  # 0 where a cycle starts as the fundamental rises through zero
    centre, turns = 0.5 * (found.start + found.end), np.arange(len(found)) + 0.25 + phase
    size = 2.0 * float(np.mean(np.abs(lines)))
    track = _Track(len(found), centre, turns, 0.0, line(centre, turns)[1], size)
    return _boundaries(track, found.frequency, noise, len(base))


@dataclass(frozen=True)
class _Track:
    """Phase of the base against a constant frequency: at ``centre`` (n,) samples, ``turns`` (n,) cycles passed.

    ``count``: cycles that do not share samples.
    """

    count: int
    centre: FloatArray
    turns: FloatArray
    slope: float
    residual: FloatArray
    amplitude: float


def _phase_track(base: FloatArray, frequency: float) -> _Track:
    period = 1.0 / frequency
    fits = (len(base) - 4.0) / period
    count = math.floor(fits)
    if count < 1:
        return _Track(0, np.zeros(0), np.zeros(0), 0.0, np.zeros(0), 0.0)
    few = count < 3
    begins = np.arange(0.0, count - 1 + max(fits - count, 1e-9), 0.125) if few else np.arange(float(count))
    start = 1.0 + period * begins
    lines = fundamentals(base, start, start + period, points_per_cycle(period))
    phase = np.unwrap(np.angle(lines)) / (2.0 * math.pi) - (begins if few else 0.0)
    centre = start + 0.5 * period
    slope, residual, _ = line(centre, phase)
    amplitude = 2.0 * abs(complex(np.mean(lines * np.exp(-2j * math.pi * (phase + begins)))))
    return _Track(count, centre, begins + 0.5 + phase, slope, residual, amplitude)


def fundamentals(signal: FloatArray, start: FloatArray, end: FloatArray, points: int) -> ComplexArray:
    """First Fourier coefficient of each cycle (n,), what the sensor's zero drifts by within a cycle taken off."""
    angle = 2.0 * math.pi * np.arange(points) / points
    lines, means = np.empty(len(start), dtype=np.complex128), np.empty(len(start))
    for some in chunks(len(start), points, 4 * _CHUNK):  # so that long recordings fit in memory
        rows = fold(signal, start[some], end[some], points)
        lines[some], means[some] = first_harmonic(rows, angle) / points, rows.mean(axis=1)
    n = len(start)
    if n < 3 or start[1] < end[0] - 1e-6 * (end[0] - start[0]):  # cycles that overlap show no drift
        return lines
    # mean of up to 12 cycles after less that of as many before: motions that repeat every 2, 3, 4 or 6 have no drift
    width = min(12, (n - 1) // 2)
    total = np.concatenate([[0.0], np.cumsum(means)])
    inner = np.arange(width, n - width)
    rise = (total[inner + width + 1] - total[inner + 1]) - (total[inner] - total[inner - width])
    ramp = 1.0 / (points * (np.exp(-2j * math.pi / points) - 1.0))  # its coefficient, for a rise of 1 in a cycle
    return np.asarray(lines - np.pad(rise / (width * (width + 1)), width, mode="edge") * ramp)


def _boundaries(track: _Track, frequency: float, noise: float, length: int) -> Cut:
    """The cycles of a phase; the error of their frequency is the sensor's, or that of the phase's scatter if larger."""
    n, count = len(track.centre), track.count
    if n == 0 or track.amplitude == 0.0:
        return Cut(np.zeros(0), np.zeros(0), frequency, math.nan, math.nan, drifts=False)
    expected = math.sqrt(2.0 * frequency) * noise / track.amplitude / (2.0 * math.pi)
    square = float(np.dot(track.residual, track.residual))
    rms = math.sqrt(square / max(1, count - 2))
    drifts = count > 4 and rms > max(3.0 * expected, 1e-6)
    centre, passed = track.centre, track.turns
    if not drifts:
        passed = passed.mean() + frequency * (centre - centre.mean())
    # the fundamental, cos(2 pi turns), rises through zero at whole turns less a quarter, to both ends of the stretch
    ends, local = np.array([0.0, float(length - 1)]), np.full(2, frequency)
    if n > 1:
        local = (passed[[1, -1]] - passed[[0, -2]]) / (centre[[1, -1]] - centre[[0, -2]])
    outer = passed[[0, -1]] + local * (ends - centre[[0, -1]])
    at, passed = (np.concatenate([o[:1], inner, o[1:]]) for o, inner in ((ends, centre), (outer, passed)))
    whole = np.arange(math.ceil(passed[0] + 0.25 - 1e-9), math.floor(passed[-1] + 0.25 + 1e-9) + 1)
    edges = np.interp(whole - 0.25, passed, at)
    edges = edges[(edges >= 0.0) & (edges <= length - 1)]
    error = math.nan
    if count > 2:
        scatter = square / (n - 2)
        white = expected**2
        if scatter > white * (1.0 + 2.0 * math.sqrt(2.0 / (n - 2))):  # a drive that wanders is autocorrelated
            white = max(scatter * max(float(variance_inflation(track.residual[:, None])[0]), 1.0), white)
        error = math.sqrt(white / line(track.centre, track.residual)[2])
    return Cut(edges[:-1], edges[1:], frequency, error, 2.0 * math.pi * rms, drifts)


# Smoothing ------------------------------------------------------------------------------------------------------------

BLOCK = 1 << 18  # points smoothed, or of loops measured, at a time: long recordings fit in memory


@dataclass(frozen=True)
class Smoother:
    """How cycles are smoothed, decided from all of them.

    ``mean`` (points/2 + 1,) complex: Fourier coefficients of the smoothed mean cycle; ``own_share`` (points/2 + 1,):
    what is kept of a cycle's deviation, by harmonic; ``x_noise``, ``v_noise``: rms of the error left in one point of
    x and v (v: with the harmonics given up); ``x_tail``: what the harmonics that drown in noise may add to an extreme;
    ``resolution``: the shortest time that can be resolved, in radians of tau.
    """

    mean: ComplexArray
    own_share: FloatArray
    x_noise: float
    v_noise: float
    x_tail: float
    resolution: float

    def cycle(self, points: int) -> tuple[FloatArray, FloatArray]:
        """The smoothed mean cycle on so many points, and its derivative by the phase."""
        lines = self.mean * points
        return np.fft.irfft(lines, points), np.fft.irfft(1j * np.arange(len(lines)) * lines, points)


def smoother(rows: FloatArray, sensor: Sensor, samples: float) -> Smoother:
    """Decide how to smooth cycles (n, points), points even, of which the sensor took so many ``samples`` each."""
    n, points = rows.shape
    mean_cycle = rows.mean(axis=0)
    lines = np.fft.rfft(mean_cycle) / points
    k = np.arange(float(len(lines)))
    floor = sensor.noise**2 / samples  # power that noise alone gives one coefficient of one cycle
    shared = sensor.shared**2 / samples  # by all cycles: rounding without noise follows the place
    mean_floor = floor * sensor.left(samples, k) / n + shared
    mean_share = np.ones(len(lines))
    for parity in (1, 2):  # apart: a motion whose halves mirror each other has odd harmonics only
        mean_share[parity::2] = _wiener(np.abs(lines[parity::2]) ** 2, mean_floor[parity::2], 1)
    own_share, own_floor = np.zeros(len(lines)), np.full(len(lines), floor)
    if n > 1:
        power = np.zeros(len(lines))
        for some in chunks(n, points, BLOCK):
            own = np.fft.rfft(rows[some] - mean_cycle, axis=1)
            power += np.sum(own.real**2 + own.imag**2, axis=0)
        power = power / (n - 1) / points**2
        top = power[int(0.375 * samples) : int(0.5 * samples)]
        if sensor.second and sensor.second.alone:  # what is slower than the drive leaks into single cycles
            slow = np.geomspace(SLOWEST, 1.0, 64)
            leak = np.sinc(slow - k[:, None]) ** 2 + np.sinc(slow + k[:, None]) ** 2
            own_floor *= sensor.left(samples, k) + np.trapezoid(leak * sensor.left(samples, slow), slow, axis=1)
        elif sensor.second:  # what two sensors leave wanders below the drive, and leaks
            own_floor *= 4.0
        elif len(top) >= 32:  # rounding without noise is not quite white
            own_floor[:] = min(max(floor, float(np.median(top))), 4.0 * floor)
        own_floor += shared
        own_share[1:] = _wiener(power[1:], own_floor[1:], n - 1)
    left = 2.0 * (mean_floor * mean_share**2 + own_floor * own_share**2)
    left[0] *= 0.5
    highest = max(1, int(np.flatnonzero((mean_share > 0.0) | (own_share > 0.0))[-1]))
    drowned = 1.5 * math.sqrt(mean_floor[highest])  # amplitude of the first harmonic given up; the others fall as k^-3
    v_noise = math.hypot(math.sqrt(float((left * k * k).sum())), drowned * math.sqrt(highest**3 / 3.0))
    return Smoother(
        mean=lines * mean_share,
        own_share=own_share,
        x_noise=math.sqrt(float(left.sum())),
        v_noise=v_noise,
        x_tail=0.5 * highest * drowned,  # all of them in phase at an extreme
        resolution=math.pi / highest,
    )


def _wiener(power: FloatArray, floor: FloatArray, samples: int) -> FloatArray:
    """Share that a Wiener filter keeps by line, of power averaged nearby; 0 above the last line out of noise."""
    k, unit = np.arange(len(power)), floor / max(float(floor.max()), 1e-300)
    power, floor = (each / np.where(unit > 0.0, unit, 1.0) for each in (power, floor))  # a floor that is even
    reach = np.maximum(2, k // 6)
    low, high = np.maximum(k - reach, 0), np.minimum(k + reach, len(power) - 1)
    total = np.concatenate([[0.0], np.cumsum(power)])
    count = high - low + 1
    local = (total[high + 1] - total[low]) / count
    clear = local > floor * (1.0 + 4.0 / np.sqrt(count * samples))
    share = np.where(clear, 1.0 - floor / np.maximum(local, 1e-300), 0.0)
    share[(int(np.flatnonzero(clear)[-1]) if clear.any() else 0) + 1 :] = 0.0
    return share


def smoothed(rows: FloatArray, how: Smoother, points: int) -> tuple[FloatArray, FloatArray]:
    """Smooth cycles (n, p): x and its derivative by tau (n, points); deviations from the mean cycle as one signal."""
    mean_cycle, both = rows.mean(axis=0), np.empty((2, len(rows), points))
    both[:] = np.stack(how.cycle(points))[:, None]
    for some in chunks(len(rows), points, BLOCK) if how.own_share.any() else ():
        n, flat = some.stop - some.start, (rows[some] - mean_cycle).ravel()
        lines = np.fft.rfft(np.concatenate([flat, flat[::-1]])) / len(flat)
        harmonic = np.arange(len(lines)) / (2.0 * n)
        lines *= np.interp(harmonic, np.arange(1, len(how.own_share)), how.own_share[1:]) * (n * points)
        for signal, factor in zip(both, (1.0, 1j * harmonic), strict=True):
            signal[some] += np.fft.irfft(factor * lines, 2 * n * points)[: n * points].reshape(n, points)
    return both[0], both[1]
