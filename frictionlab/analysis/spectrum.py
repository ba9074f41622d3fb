"""Lines in a spectrum: Hann window, zero-padding, log-parabolic refinement of the peak.

Amplitudes are scaled by 2 / sum(w), so that a line of amplitude A reads A whatever the padding.
"""

import math
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


def strongest_tone(signal: FloatArray, step: float, *, padding: int = DEFAULT_PADDING) -> Tone:
    """Find the strongest line of a signal and refine it by a parabola through the logs of the three highest bins.

    Lines slower than two periods in the record are not looked for.

    Parameters
    ----------
    signal : (n,) array
    step : float
        Sampling interval.
    padding : int
        Length of the FFT over the length of the record.

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
    return tone_of(amplitude_spectrum(signal, step, padding=padding))


def tone_of(spectrum: Spectrum) -> Tone:
    """Refine the strongest line of a spectrum; see :func:`strongest_tone`."""
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
