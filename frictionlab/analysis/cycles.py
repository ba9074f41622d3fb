"""Cycles of the drive: cut by the phase of the base motion's fundamental, never by peaks of the mass.

A cycle starts where the fundamental of the base rises through zero. A loop that does not close exactly (sensor drift,
an irregular mass) then closes where the base is at zero, and the closing chord adds no area.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.signals import line, variance_inflation
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError

FEW_PASSES = 8  # of the phase where there are fewer than three cycles, and the first guess is poor
OVERLAP = 0.125  # of a cycle: steps of the phase's window where there are fewer than three cycles
_CHUNK = 1 << 16  # samples folded at a time: stays in the cache
_ROWS = 1 << 13  # points of rows at a time: what is made of them stays in the nearest cache


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


def interpolate(signal: FloatArray, position: FloatArray) -> FloatArray:
    """Values of a signal between its samples: cubic through the four nearest (Lagrange), shape of ``position``."""
    last = len(signal) - 3
    index = np.clip(position.astype(np.intp), 1, last)
    u = position - index
    v, w, z = u + 1.0, u - 1.0, u - 2.0
    near = u * w
    far = v * z
    value = signal[index] * (far * w)
    value -= signal[index + 1] * (far * u)
    value *= 0.5
    value += signal[index + 2] * (near * v / 6.0)
    value -= signal[index - 1] * (near * z / 6.0)
    return value


def finer(signal: FloatArray, times: int) -> FloatArray:
    """A signal (n,) on a grid so many times finer, ((n - 1) times + 1,), by its spectrum: exact up to half its rate.

    Examples
    --------
    >>> t = np.arange(200) * 0.3
    >>> fine = finer(np.sin(t), 4)
    >>> bool(np.abs(fine - np.sin(np.arange(797) * 0.075))[40:-40].max() < 2e-3)
    True
    """
    n = len(signal)
    about = signal - np.linspace(signal[0], signal[-1], n)
    lines = np.fft.rfft(np.concatenate([about, -about[-2:0:-1]]))
    smooth = np.fft.irfft(lines * times, (2 * n - 2) * times)[: (n - 1) * times + 1]
    return np.asarray(smooth + np.linspace(signal[0], signal[-1], len(smooth)))


def interpolated_noise_share() -> float:
    """Mean variance that :func:`interpolate` leaves of unit white noise, over all positions between samples."""
    u = (np.arange(1000) + 0.5) / 1000
    outer, inner = u * (u - 1) * (u - 2) / 6, (u + 1) * (u - 1) * (u - 2) / 2
    return float(2.0 * np.mean(outer * outer + inner * inner))  # the other two weights mirror these


def fold(signal: FloatArray, start: FloatArray, end: FloatArray, points: int) -> FloatArray:
    """Lay cycles under each other: row j holds ``points`` values from ``start[j]`` to before ``end[j]``.

    Parameters
    ----------
    signal : (m,) array
    start, end : (n,) arrays
        Fractional sample numbers within the signal.
    points : int
        Points per cycle, equally spaced in time within the cycle.

    Returns
    -------
    (n, points) array
    """
    rows = np.empty((len(start), points))
    phase = np.arange(points) / points
    per_chunk = max(1, _CHUNK // points)
    for first in range(0, len(start), per_chunk):
        some = slice(first, first + per_chunk)
        position = start[some, None] + (end[some] - start[some])[:, None] * phase
        rows[some] = interpolate(signal, position)
    return rows


def chunks(rows: FloatArray, points: int = _ROWS) -> Iterator[slice]:
    """A few rows at a time, of so many points together: by default as many as stay in the cache."""
    size = max(1, points // rows.shape[1])
    return (slice(first, min(first + size, len(rows))) for first in range(0, max(len(rows), 1), size))


def common(signal: FloatArray, found: Cut, points: int) -> FloatArray:
    """What all cycles of a signal (m,) have in common, at its own samples; the first and last cycle go on outside."""
    cycle = fold(signal, found.start, found.end, points).mean(axis=0)
    edges, number = np.append(found.start, found.end[-1]), np.arange(len(found) + 1.0)
    around = np.concatenate([cycle[-2:], cycle, cycle[:3]])
    every = np.empty(len(signal))
    for first in range(0, len(signal), _CHUNK):
        at = np.arange(first, min(first + _CHUNK, len(signal)), dtype=np.float64)
        beyond = np.minimum(at - edges[0], 0.0) + np.maximum(at - edges[-1], 0.0)
        turns = np.interp(at, edges, number) + found.frequency * beyond
        every[first : first + len(at)] = interpolate(around, (turns % 1.0) * points + 2.0)
    return every


def points_per_cycle(samples_per_cycle: float, *, least: int = 64, most: int | None = None) -> int:
    """Points a cycle is laid out on: a multiple of 8, one for each sample, but at least and at most so many."""
    points = max(least, 8 * math.ceil(samples_per_cycle / 8.0))
    return points if most is None else min(points, most)


def cut(base: FloatArray, frequency: float, *, noise: float, begin: float = 0.0, follow: bool = True) -> Cut:
    """Cut a stretch into cycles by the phase of the base motion's fundamental.

    The phase of each cycle is the angle of its first Fourier coefficient; harmonics and offset do not enter. A
    straight line through the phases gives the mean frequency. Where the drive wanders by more than the sensor's noise
    explains, the cut follows it from cycle to cycle; else the line is the cut.

    Parameters
    ----------
    base : (m,) array
        Base displacement of one stretch, evenly sampled.
    frequency : float
        First guess of the drive frequency in cycles per sample, good to a quarter of a period over the stretch's
        neighbouring cycles.
    noise : float
        Rms of the sensor's white noise, for the standard error.
    begin : float
        Sample number before which no cycle starts (the end of the transient).
    follow : bool
        Whether the cut follows a drive that wanders.

    Raises
    ------
    AnalysisError
        The guess is not a frequency between one period in the stretch and half the sampling rate.
    """
    if not 0.0 < frequency < 0.5:
        raise AnalysisError(f"cycles: expected 0 to 0.5 drive cycles per sample; got {frequency:g}")
    track = _phase_track(base, frequency, begin)
    for _ in range(1 if track.count > 2 else FEW_PASSES):  # a period that is off lets offset and harmonics leak
        frequency += track.slope
        track = _phase_track(base, frequency, begin)
    found = _boundaries(track, frequency + track.slope, noise, len(base), begin, follow=follow)
    if not found.drifts or len(found) < 3:
        return found
    return _boundaries(_along(base, found), found.frequency, noise, len(base), begin, follow=follow)


def _along(base: FloatArray, found: Cut) -> "_Track":
    """The phase again, in cycles of the length that each one has: no offset or harmonic leaks into it."""
    period = found.end - found.start
    lines = _fundamentals(base, found.start, found.end, points_per_cycle(float(period.mean())))
    late = np.angle(1j * lines) / (2.0 * math.pi)  # 0 where a cycle starts as the fundamental rises through zero
    centre = 0.5 * (found.start + found.end)
    turns = np.arange(len(found)) + 0.25 + late
    residual = line(centre, turns)[1]
    return _Track(len(found), centre, turns, 0.0, residual, 2.0 * float(np.mean(np.abs(lines))))


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


def _phase_track(base: FloatArray, frequency: float, begin: float) -> _Track:
    period = 1.0 / frequency
    first = begin + 1.0
    count = math.floor((len(base) - 3 - first) / period)
    if count < 1:
        return _Track(0, np.zeros(0), np.zeros(0), 0.0, np.zeros(0), 0.0)
    spare = (len(base) - 3 - first) / period - count
    begins = np.arange(count, dtype=np.float64) if count > 2 else np.arange(0.0, count - 1 + max(spare, 1e-9), OVERLAP)
    start = first + period * begins
    lines = _fundamentals(base, start, start + period, points_per_cycle(period))
    phase = np.unwrap(np.angle(lines)) / (2.0 * math.pi) - (begins if count < 3 else 0.0)
    centre = start + 0.5 * period
    slope, residual, _ = line(centre, phase)
    amplitude = 2.0 * abs(complex(np.mean(lines * np.exp(-2j * math.pi * (phase + begins)))))
    return _Track(count, centre, begins + 0.5 + phase, slope, residual, amplitude)


def _fundamentals(signal: FloatArray, start: FloatArray, end: FloatArray, points: int) -> NDArray[np.complex128]:
    """First Fourier coefficient of each cycle (n,): amplitude is twice its modulus.

    What the sensor's zero drifts by within a cycle, as the means of its neighbours tell, is taken off: a ramp has a
    fundamental of its own, and a drift of 1 mm in 90 s moved the phase by 6e-4 rad.
    """
    turn = 2.0 * math.pi * np.arange(points) / points
    lines, means = np.empty(len(start), dtype=np.complex128), np.empty(len(start))
    for some, rows in folded(signal, start, end, points):
        lines[some] = first_harmonic(rows, turn) / points
        means[some] = rows.mean(axis=1)
    if len(start) < 3 or start[1] < end[0] - 1e-6 * (end[0] - start[0]):  # cycles that overlap tell no drift
        return lines
    ramp = 1.0 / (points * (np.exp(-2j * math.pi / points) - 1.0))  # its coefficient, for a rise of 1 in a cycle
    return np.asarray(lines - _drift(means) * ramp)


def _drift(means: FloatArray) -> FloatArray:
    """Slow change from cycle to cycle (n,), n > 2: mean of up to 12 cycles after less that of as many before.

    Motions that repeat every 2, 3, 4 or 6 cycles have none; the ends go on as their neighbours.
    """
    n = len(means)
    width = min(12, (n - 1) // 2)
    total = np.concatenate([[0.0], np.cumsum(means)])
    inner = np.arange(width, n - width)
    after = total[inner + width + 1] - total[inner + 1]
    before = total[inner] - total[inner - width]
    return np.pad((after - before) / (width * (width + 1)), width, mode="edge")


def first_harmonic(rows: FloatArray, turn: FloatArray) -> NDArray[np.complex128]:
    """Sum of each row times exp(-i turn), (n,). einsum, not BLAS: threads that fight for a busy core cost more."""
    cosine, sine = np.einsum("ij,j->i", rows, np.cos(turn)), np.einsum("ij,j->i", rows, np.sin(turn))
    return np.asarray(cosine - 1j * sine)


def folded(
    signal: FloatArray, start: FloatArray, end: FloatArray, points: int, *, size: int = 4 * _CHUNK
) -> Iterator[tuple[slice, FloatArray]]:
    """Fold a few cycles at a time: yields (which cycles, their rows), so that long recordings fit in memory."""
    per_chunk = max(1, size // points)
    for first in range(0, len(start), per_chunk):
        some = slice(first, min(first + per_chunk, len(start)))
        yield some, fold(signal, start[some], end[some], points)


def _boundaries(track: _Track, frequency: float, noise: float, length: int, begin: float, *, follow: bool) -> Cut:
    count = track.count
    if len(track.centre) == 0 or track.amplitude == 0.0:
        return Cut(np.zeros(0), np.zeros(0), frequency, math.nan, math.nan, drifts=False)
    expected = math.sqrt(2.0 * frequency) * noise / track.amplitude / (2.0 * math.pi)
    rms = math.sqrt(float(np.dot(track.residual, track.residual)) / max(1, count - 2))
    drifts = follow and count > 4 and rms > max(3.0 * expected, 1e-6)
    even = track.turns.mean() + frequency * (track.centre - track.centre.mean())
    turns = track.turns if drifts else even
    edges = _crossings(track.centre, turns, frequency, length, begin)
    error = _slope_error(track.centre, track.residual, expected) if count > 2 else math.nan
    return Cut(edges[:-1], edges[1:], frequency, error, 2.0 * math.pi * rms, drifts)


def _crossings(centre: FloatArray, turns: FloatArray, frequency: float, length: int, begin: float) -> FloatArray:
    """Sample numbers where the fundamental, cos(2 pi turns), rises through zero: turns = whole - 1/4."""
    ends = np.array([begin, float(length - 1)])
    local = np.full(2, frequency)
    if len(centre) > 1:
        local = (turns[[1, -1]] - turns[[0, -2]]) / (centre[[1, -1]] - centre[[0, -2]])
    outer = turns[[0, -1]] + local * (ends - centre[[0, -1]])
    at = np.concatenate([ends[:1], centre, ends[1:]])
    passed = np.concatenate([outer[:1], turns, outer[1:]])
    whole = np.arange(math.ceil(passed[0] + 0.25 - 1e-9), math.floor(passed[-1] + 0.25 + 1e-9) + 1)
    edges = np.interp(whole - 0.25, passed, at)
    return np.asarray(edges[(edges >= begin) & (edges <= length - 1)])


def _slope_error(at: FloatArray, residual: FloatArray, expected: float) -> float:
    """Standard error of the slope: the sensor's noise, or the scatter about the line where that is clearly larger.

    A drive that wanders from cycle to cycle has autocorrelated residuals, which count by `variance_inflation`.
    """
    n, spread = len(at), line(at, residual)[2]
    white = float(np.dot(residual, residual)) / (n - 2)
    if white > expected**2 * (1.0 + 2.0 * math.sqrt(2.0 / (n - 2))):
        white = max(white * max(float(variance_inflation(residual[:, None])[0]), 1.0), expected**2)
    else:
        white = expected**2
    return math.sqrt(white / spread)
