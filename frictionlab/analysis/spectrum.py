"""Lines in a spectrum: Hann window, zero-padding, log-parabolic refinement of the peak.

Amplitudes are scaled by 2 / sum(w), so that a line of amplitude A reads A whatever the padding.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy import fft
from numpy.typing import NDArray

from frictionlab.errors import AnalysisError

FloatArray = NDArray[np.float64]
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
    """One line: ``frequency`` and its standard error in 1/[step], ``amplitude`` in the signal's unit."""

    frequency: float
    frequency_se: float
    amplitude: float


def hann(n: int) -> Iterator[tuple[slice, FloatArray]]:
    """Hann window of n points, symmetric about the middle and nowhere zero, in parts; its sum is n / 2."""
    return ((some, 0.5 - 0.5 * part) for some, part in _cosines(2.0 * math.pi / n, math.pi / n, n))


def _windowed(signal: FloatArray) -> FloatArray:
    """The signal (n,) about its mean under a Hann window: one copy, for a long recording's are dear."""
    about = np.asarray(signal - signal.mean())
    for some, part in hann(len(signal)):
        about[some] *= part
    return about


def _cosines(step: float, first: float, n: int) -> Iterator[tuple[slice, FloatArray]]:
    """cos(first + step i) for i < n, in parts: cos(a + b) = cos a cos b - sin a sin b spares most of the cosines."""
    width = math.isqrt(n) + 1
    fine = step * np.arange(width)
    cosine, sine = np.cos(fine), np.sin(fine)
    rows = max(1, PART // width)
    for row in range(0, -(-n // width), rows):
        coarse = first + step * width * np.arange(row, row + rows)
        table = np.outer(np.cos(coarse), cosine)
        table -= np.outer(np.sin(coarse), sine)
        at = row * width
        yield slice(at, min(at + table.size, n)), table.ravel()[: n - at]


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


def strongest_tone(
    signal: FloatArray, step: float, *, padding: int = DEFAULT_PADDING, noise: float | None = None
) -> Tone:
    """Find the strongest line of a signal and refine it by a parabola through the logs of the three highest bins.

    Lines slower than two periods in the record are not looked for.

    Parameters
    ----------
    signal : (n,) array
    step : float
        Sampling interval.
    padding : int
        Length of the FFT over the length of the record.
    noise : float, optional
        Rms of the white noise in the signal, for the standard error; by default taken from the spectrum's median.

    Raises
    ------
    AnalysisError
        Fewer than 8 samples, or a signal that does not move.

    Examples
    --------
    >>> t = np.arange(2000) * 0.01
    >>> tone = strongest_tone(3.0 * np.cos(2 * np.pi * 1.7 * t), 0.01)
    >>> abs(tone.frequency - 1.7) < 2e-5
    True
    """
    return tone_of(amplitude_spectrum(signal, step, padding=padding), step, noise=noise)


def tone_of(spectrum: Spectrum, step: float, *, noise: float | None = None) -> Tone:
    """Refine the strongest line of a spectrum of samples at this interval; see :func:`strongest_tone`."""
    amplitude, resolution = spectrum.amplitude, spectrum.resolution
    n = round(1.0 / (resolution * step))
    spacing = float(spectrum.frequency[1])
    first = min(max(1, math.ceil(2.0 * resolution / spacing)), len(amplitude) - 2)
    peak = first + int(np.argmax(amplitude[first:-1]))
    if not amplitude[peak] > 0.0:
        raise AnalysisError("spectrum: expected a signal that moves; got one that stands still")
    offset, height = refined(amplitude[peak - 1 : peak + 2], resolution / spacing)
    if noise is None:
        noise = math.sqrt(float(np.median(amplitude) ** 2) / math.log(2.0) * n / 6.0)
    error = hann_frequency_error(height, noise, n, step)
    return Tone((peak + offset) * spacing, error, height)


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


def cramer_rao(amplitude: float, noise: float, n: int, step: float) -> float:
    """Least standard error any unbiased frequency estimate can have: a line in white noise over n samples.

    var f = 6 noise^2 / (pi^2 amplitude^2 n (n^2 - 1) step^2) [Rife and Boorstyn 1974].
    """
    return math.sqrt(6.0 / (n * (n * n - 1.0))) * noise / (math.pi * amplitude * step)


def hann_frequency_error(amplitude: float, noise: float, n: int, step: float) -> float:
    """Standard error of the peak of a Hann-windowed spectrum in white noise, to first order in noise.

    With u the time from the middle of the record: var f = 2 noise^2 sum(w^2 u^2) / (2 pi amplitude sum(w u^2))^2. For
    long records this is 1.50 times the Cramer-Rao bound, the price of the window's low leakage.
    """
    return cramer_rao(amplitude, noise, n, step) * _HANN_OVER_BOUND


def _hann_over_bound() -> float:
    u = (np.arange(4096) + 0.5) / 4096 - 0.5
    w = 0.5 + 0.5 * np.cos(2.0 * math.pi * u)
    return float(math.sqrt(np.sum(w * w * u * u) * np.sum(u * u)) / np.sum(w * u * u))


_HANN_OVER_BOUND = _hann_over_bound()
