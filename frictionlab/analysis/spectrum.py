"""Lines in a spectrum: Hann window, zero-padding, log-parabolic refinement of the peak.

Amplitudes are scaled by 2 / sum(w), so that a line of amplitude A reads A whatever the padding.

Smoothing by the spectrum: what the cycles have in common, and what each has of its own. The mean cycle is known the
better the more cycles there are; a cycle's deviation from it is kept only where its
spectrum stands above the sensor's. Both are Wiener filters (gain = signal power / total power, per harmonic), so that
a regular motion is smoothed over all its cycles and an irregular one cycle by cycle, without anything to tune.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy import fft
from numpy.typing import NDArray

from frictionlab.analysis.cycles import chunks
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError

DEFAULT_PADDING = 4
PART = 1 << 15  # points of a window made at a time: they stay in the cache
LONGEST = 1 << 23
"""Points of an FFT: one of 26 million took 1 GB, and told the drive no better. Longer signals are taken in parts."""


@dataclass(frozen=True)
class Spectrum:
    """Amplitude spectrum: ``frequency`` (m,) in 1/[step], ``amplitude`` (m,) in the signal's unit.

    ``resolution``: 1 / duration of the signal, or of the parts it was taken in, in 1/[step].
    """

    frequency: FloatArray
    amplitude: FloatArray
    resolution: float


@dataclass(frozen=True)
class Tone:
    """One line: ``frequency`` in 1/[step], ``amplitude`` in the signal's unit."""

    frequency: float
    amplitude: float


def hann(first: int, last: int, n: int) -> FloatArray:
    """Part of a Hann window of n points, symmetric about the middle and nowhere zero; its sum is n / 2."""
    return np.asarray(0.5 - 0.5 * np.cos((2.0 * math.pi / n) * (np.arange(first, last) + 0.5)))


def _windowed(signal: FloatArray) -> FloatArray:
    """The signal (n,) about its mean under a Hann window, in parts: one copy, for a long recording's are dear."""
    about = np.asarray(signal - signal.mean())
    for first in range(0, len(about), PART):
        last = min(first + PART, len(about))
        about[first:last] *= hann(first, last, len(about))
    return about


def fast_length(least: int) -> int:
    """Return the smallest product of twos, threes and fives that is no less: lengths the FFT likes.

    SciPy has such a function too; loading it takes a fifth of the time of ``frictionlab analyze``.

    Examples
    --------
    >>> [fast_length(n) for n in (1, 7, 11, 97, 59_999)]
    [1, 8, 12, 100, 60000]
    """
    best = 1 << (least - 1).bit_length()
    five = 1
    while five < best:
        three = five
        while three < best:
            best = min(best, three << (-(-least // three) - 1).bit_length())
            three *= 3
        five *= 5
    return best


def amplitude_spectrum(signal: FloatArray, step: float, *, padding: int = DEFAULT_PADDING) -> Spectrum:
    """Amplitude spectrum of a signal: mean removed, Hann window, zero-padded FFT.

    Parameters
    ----------
    signal : (n,) array
    step : float
        Sampling interval; frequencies come in its inverse.
    padding : int
        Length of the FFT over the length of the record (rounded up to a length the FFT likes); less where that is
        longer than `LONGEST`: the lines of such a record are close together as they are. A record that is longer
        itself is taken in equal parts; its amplitudes are the root of their mean square.

    Raises
    ------
    AnalysisError
        Fewer than 8 samples.

    Examples
    --------
    >>> t = np.arange(2000) * 0.01
    >>> spectrum = amplitude_spectrum(3.0 * np.cos(2 * np.pi * 1.7 * t), 0.01)
    >>> round(float(spectrum.amplitude.max()), 3)
    3.0
    """
    n = len(signal)
    if n < 8:
        raise AnalysisError(f"spectrum: expected at least 8 samples; got {n}: give a longer recording")
    parts = -(-n // LONGEST)
    size = n // parts
    length = fast_length(max(min(padding, LONGEST // size), 1) * size)
    amplitude = np.abs(fft.rfft(_windowed(signal[:size]), length))
    if parts > 1:
        amplitude *= amplitude
        for first in range(size, size * parts, size):
            more = np.abs(fft.rfft(_windowed(signal[first : first + size]), length))
            amplitude += np.multiply(more, more, out=more)
        np.sqrt(amplitude, out=amplitude)
    amplitude *= 4.0 / size / math.sqrt(parts)  # 2 / sum(w)
    return Spectrum(np.arange(len(amplitude)) / (length * step), amplitude, 1.0 / (size * step))


def up_to(spectrum: Spectrum, frequency: float) -> Spectrum:
    """The part of a spectrum up to a frequency, copied so that the rest can be forgotten."""
    last = int(np.searchsorted(spectrum.frequency, frequency, side="right"))
    return Spectrum(spectrum.frequency[:last].copy(), spectrum.amplitude[:last].copy(), spectrum.resolution)


def strongest_tone(spectrum: Spectrum) -> Tone:
    """Find the strongest line and refine it by a parabola through the logs of the three highest bins.

    Lines slower than two periods in the record are not looked for.

    Raises
    ------
    AnalysisError
        A signal that does not move.

    Examples
    --------
    >>> t = np.arange(2000) * 0.01
    >>> tone = strongest_tone(amplitude_spectrum(3.0 * np.cos(2 * np.pi * 1.7 * t), 0.01))
    >>> abs(tone.frequency - 1.7) < 2e-5
    True
    """
    amplitude, spacing = spectrum.amplitude, float(spectrum.frequency[1])
    first = min(max(1, math.ceil(2.0 * spectrum.resolution / spacing)), len(amplitude) - 2)
    peak = first + int(np.argmax(amplitude[first:-1]))
    if not amplitude[peak] > 0.0:
        raise AnalysisError("spectrum: expected a signal that moves; got one that stands still")
    offset, height = refined(amplitude[peak - 1 : peak + 2], spectrum.resolution / spacing)
    return Tone((peak + offset) * spacing, height)


def refined(three: FloatArray, padding: float) -> tuple[float, float]:
    """Offset in bins from the middle one, and height, of a line whose three highest bins are given.

    A parabola through the logs of a Hann line is a little off (2e-4 of a resolution cell at padding 4); how much is
    known from the window's own transform, and taken out.
    """
    seen, height = _log_parabola(three)
    offset, scale = seen, 1.0
    for _ in range(4):
        told, scale = _log_parabola(_hann_line((np.arange(-1.0, 2.0) - offset) / padding))
        offset -= told - seen
    return offset, height / scale


def _hann_line(cells: FloatArray) -> FloatArray:
    """Shape of a unit line under a Hann window, over the distance in resolution cells (1 / duration)."""
    return np.asarray(np.abs(np.sinc(cells) / (1.0 - np.where(np.abs(cells) == 1.0, 0.5, cells) ** 2)))


def _log_parabola(three: FloatArray) -> tuple[float, float]:
    """Vertex of the parabola through the logs of three bins: offset in bins from the middle one, and height."""
    left, middle, right = np.log(np.maximum(three, 1e-300))
    curvature = left - 2.0 * middle + right
    if curvature >= 0.0:
        return 0.0, float(three[1])
    offset = 0.5 * (left - right) / curvature
    return float(offset), float(np.exp(middle - 0.25 * (left - right) * offset))


_KEPT_FROM = 1.5  # amplitude over the noise's, about, from which a harmonic stands out
_MOST_RAISED = 4.0
_ENOUGH = 32  # harmonics whose median is a floor
_BLOCK = 1 << 18  # points smoothed at a time


@dataclass(frozen=True)
class Smoothed:
    """Some consecutive cycles without their noise: ``x`` and ``v`` (n, points), v the derivative by tau."""

    cycles: slice
    x: FloatArray
    v: FloatArray


@dataclass(frozen=True)
class Smoother:
    """How cycles are smoothed, decided from all of them.

    ``mean`` (points/2 + 1,) complex: Fourier coefficients of the smoothed mean cycle; ``own_gain`` (points/2 + 1,):
    what is kept of a cycle's deviation, by harmonic; ``x_noise``, ``v_noise``: rms of the error left in one point of
    x and v (v: with the harmonics given up); ``x_tail``: what the harmonics that drown in noise may add to an extreme;
    ``resolution``: the shortest time that can be told apart, in radians of tau; ``period``: cycles that ``mean`` is of.
    """

    mean: NDArray[np.complex128]
    own_gain: FloatArray
    x_noise: float
    v_noise: float
    x_tail: float
    resolution: float
    period: int = 1


def smoother(rows: FloatArray, *, noise: float, samples: float, shared: float = 0.0, period: int = 1) -> Smoother:
    """Decide how to smooth cycles.

    Parameters
    ----------
    rows : (n, points) array
        One cycle a row, ``points`` even.
    noise : float
        Rms of the white noise of one sample.
    samples : float
        Samples the sensor took in a cycle (a row may have more points than that).
    shared : float
        Rms of the white noise of one sample that cycles share: rounding without noise follows the place.
    period : int
        Cycles after which the motion repeats: what they have in common is looked for in whole periods.
    """
    if period > 1:
        how = smoother(_in_periods(rows, period), noise=noise, samples=samples * period, shared=shared)
        return replace(how, v_noise=how.v_noise / period, resolution=how.resolution * period, period=period)
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
        power = _deviation_power(rows, mean_cycle)
        floor = _raised(floor, power, samples) + shared * shared / samples
        own_gain[1:] = _gain(power[1:], floor, n - 1)
    k = np.arange(len(lines))
    left = 2.0 * (mean_floor * mean_gain**2 + floor * own_gain**2)
    left[0] *= 0.5
    kept = np.flatnonzero((mean_gain > 0.0) | (own_gain > 0.0))
    top = max(1, int(kept[-1]))
    drowned = _KEPT_FROM * math.sqrt(mean_floor)  # amplitude of the first harmonic given up; the others fall as k^-3
    return Smoother(
        mean=lines * mean_gain,
        own_gain=own_gain,
        x_noise=math.sqrt(float(left.sum())),
        v_noise=math.hypot(math.sqrt(float((left * k * k).sum())), drowned * math.sqrt(top**3 / 3.0)),
        x_tail=0.5 * top * drowned,  # all of them in phase at an extreme
        resolution=math.pi / top,
    )


def _in_periods(rows: FloatArray, period: int) -> FloatArray:
    """Whole periods as rows; the first cycles, which make none, are left out."""
    return rows[len(rows) % period :].reshape(-1, period * rows.shape[1])


def _deviation_power(rows: FloatArray, mean_cycle: FloatArray) -> FloatArray:
    """Mean power of the cycles' deviations from their mean, by harmonic, as each cycle has it."""
    n, points = rows.shape
    power = np.zeros(points // 2 + 1)
    for some in chunks(rows, _BLOCK):
        lines = fft.rfft(rows[some] - mean_cycle, axis=1)
        power += np.sum(lines.real**2 + lines.imag**2, axis=0)
    return np.asarray(power / (n - 1) / points**2)


def _raised(floor: float, power: FloatArray, samples: float) -> float:
    """The floor that the highest harmonics show, where that is higher: rounding without noise is not quite white."""
    top = power[int(0.375 * samples) : int(0.5 * samples)]
    return min(max(floor, float(np.median(top))), _MOST_RAISED * floor) if len(top) >= _ENOUGH else floor


def _gain(power: FloatArray, floor: float, samples: int) -> FloatArray:
    """Wiener gain by line: power is averaged over its neighbourhood and must exceed what noise alone may reach.

    Nothing is kept above the last harmonic that stands out.
    """
    k = np.arange(len(power))
    reach = np.maximum(2, k // 6)
    low, high = np.maximum(k - reach, 0), np.minimum(k + reach, len(power) - 1)
    total = np.concatenate([[0.0], np.cumsum(power)])
    count = high - low + 1
    local = (total[high + 1] - total[low]) / count
    clear = local > floor * (1.0 + 4.0 / np.sqrt(count * samples))
    gain = np.where(clear, 1.0 - floor / np.maximum(local, 1e-300), 0.0)
    last = int(np.flatnonzero(clear)[-1]) if clear.any() else 0
    gain[last + 1 :] = 0.0
    return gain


def smoothed(rows: FloatArray, how: Smoother, points: int) -> Iterator[Smoothed]:
    """Smooth cycles block by block.

    Parameters
    ----------
    rows : (n, p) array
        One cycle a row; consecutive rows follow each other without a gap.
    how : Smoother
        From the same rows.
    points : int
        Points a cycle of the result, an even number no smaller than p.
    """
    if how.period > 1:
        yield from _smoothed_in_periods(rows, how, points)
        return
    n = len(rows)
    k = np.arange(len(how.mean))
    mean_x = fft.irfft(how.mean * points, points)
    mean_v = fft.irfft(1j * k * how.mean * points, points)
    mean_cycle = rows.mean(axis=0)
    per_block = max(1, _BLOCK // points)
    for first in range(0, n, per_block):
        some = slice(first, min(first + per_block, n))
        count = some.stop - some.start
        if not how.own_gain.any():
            yield Smoothed(some, np.broadcast_to(mean_x, (count, points)), np.broadcast_to(mean_v, (count, points)))
            continue
        x, v = _deviations(rows[some] - mean_cycle, how.own_gain, points)
        x += mean_x
        v += mean_v
        yield Smoothed(some, x, v)


def _smoothed_in_periods(rows: FloatArray, how: Smoother, points: int) -> Iterator[Smoothed]:
    """Whole periods smoothed as rows and cut into cycles again; the first cycles are as those a period later."""
    spare, period = len(rows) % how.period, how.period
    for part in smoothed(_in_periods(rows, period), replace(how, period=1), period * points):
        x, v = part.x.reshape(-1, points), part.v.reshape(-1, points) / period
        first = spare + part.cycles.start * period
        if part.cycles.start == 0 and spare:
            yield Smoothed(slice(0, spare), x[period - spare : period], v[period - spare : period])
        yield Smoothed(slice(first, first + len(x)), x, v)


def _deviations(own: FloatArray, gain: FloatArray, points: int) -> tuple[FloatArray, FloatArray]:
    """Smooth consecutive cycles' deviations as one signal (a cycle need not close), reflected at both ends."""
    n = len(own)
    flat = own.ravel()
    lines = fft.rfft(np.concatenate([flat, flat[::-1]])) / len(flat)
    harmonic = np.arange(len(lines)) / (2.0 * n)
    kept = lines * np.interp(harmonic, np.arange(1, len(gain)), gain[1:])
    size = 2 * n * points
    x = fft.irfft(kept * (0.5 * size), size)[: n * points]
    v = fft.irfft(1j * harmonic * kept * (0.5 * size), size)[: n * points]
    return x.reshape(n, points), v.reshape(n, points)
