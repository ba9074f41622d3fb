"""Lines in a spectrum: the drive's own, and those that are no harmonic of it.

Spectra have a Hann window and zero-padding; a peak is refined by a parabola through the logs of its three bins.
Amplitudes are scaled by 2 / sum(w), so that a line of amplitude A reads A whatever the padding.

A motion that repeats with the drive has its harmonics and nothing between them. What stands there alone is the
sensor's, the laboratory's (hum of the mains, a bearing) or a second motion's. High lines are hum to be taken out, low
ones (a beat, a free vibration) are reported.
"""

import cmath
import math
from dataclasses import dataclass, replace

import numpy as np
from numpy import fft
from numpy.typing import NDArray
from scipy.fft import next_fast_len

from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError

DEFAULT_PADDING = 4
LONGEST = 1 << 23
"""Points up to which an FFT is padded: one of 26 million took 1 GB, and showed the drive no better."""


@dataclass(frozen=True)
class Spectrum:
    """Amplitude spectrum: ``frequency`` (m,) in 1/[step], ``amplitude`` (m,) in the signal's unit.

    ``resolution``: 1 / duration of the signal, in 1/[step].
    """

    frequency: FloatArray
    amplitude: FloatArray
    resolution: float

    @property
    def cell(self) -> float:
        """Bins to a resolution cell."""
        return self.resolution / float(self.frequency[1])


@dataclass(frozen=True)
class Line:
    """One line: ``frequency`` in 1/[step], ``amplitude`` in the signal's unit; whether it is ``removed`` as hum."""

    frequency: float
    amplitude: float
    removed: bool = False


def hann(n: int) -> FloatArray:
    """Hann window of n points, symmetric about the middle and nowhere zero; its sum is n / 2."""
    return np.asarray(0.5 - 0.5 * np.cos(2.0 * math.pi / n * np.arange(0.5, n)))


def amplitude_spectrum(signal: FloatArray, step: float, *, padding: int = DEFAULT_PADDING) -> Spectrum:
    """Amplitude spectrum of a signal (n,), 8 samples at least: mean removed, Hann window, zero-padded FFT.

    ``padding``: length of the FFT over that of the record (rounded up to one that the FFT likes); less where that is
    longer than `LONGEST`: the lines of such a record are close together as they are.

    Raises
    ------
    AnalysisError
        Fewer than eight samples.
    """
    n = len(signal)
    if n < 8:
        raise AnalysisError(f"spectrum: expected at least 8 samples; got {n}: give a longer recording")
    length = int(next_fast_len(max(min(padding, LONGEST // n), 1) * n, real=True))
    windowed = hann(n)
    windowed *= signal - signal.mean()
    amplitude = np.abs(fft.rfft(windowed, length))
    amplitude *= 4.0 / n  # 2 / sum(w)
    return Spectrum(np.arange(len(amplitude)) / (length * step), amplitude, 1.0 / (n * step))


def strongest_tone(spectrum: Spectrum) -> Line:
    """Find the strongest line and refine it; lines slower than two periods in the record are not looked for.

    Raises
    ------
    AnalysisError
        The signal stands still.
    """
    amplitude = spectrum.amplitude
    first = min(max(1, math.ceil(2.0 * spectrum.cell)), len(amplitude) - 2)
    peak = first + int(np.argmax(amplitude[first:-1]))
    if not amplitude[peak] > 0.0:
        raise AnalysisError("spectrum: expected a signal that moves; got one that stands still")
    return _refined(spectrum, peak)


def _refined(spectrum: Spectrum, peak: int) -> Line:
    """The line of a highest bin; what a parabola through the logs of a Hann line is off by is taken out."""
    seen, height = _log_parabola(spectrum.amplitude[peak - 1 : peak + 2])
    offset, scale = seen, 1.0
    for _ in range(4):
        cells = (np.arange(-1.0, 2.0) - offset) / spectrum.cell
        shape = np.abs(np.sinc(cells) / (1.0 - np.where(np.abs(cells) == 1.0, 0.5, cells) ** 2))
        found, scale = _log_parabola(shape)
        offset = min(max(offset - (found - seen), -1.0), 1.0)  # a skirt has no vertex near its highest bin
    return Line(float((peak + offset) * spectrum.frequency[1]), height / scale)


def _log_parabola(three: FloatArray) -> tuple[float, float]:
    """Vertex of the parabola through the logs of three bins: offset in bins from the middle one, and height."""
    left, middle, right = np.log(np.maximum(three, 1e-300))
    curvature = left - 2.0 * middle + right
    if curvature >= 0.0:
        return 0.0, float(three[1])
    offset = 0.5 * (left - right) / curvature
    return float(offset), float(np.exp(middle - 0.25 * (left - right) * offset))


# Lines that are no harmonics of the drive ----------------------------------------------------------------------------

LEAST = 5e-4  # of the base's amplitude: smaller lines change no number by more than its error
FAINTEST = 1e-4  # the same of lines where no frame follows: of these nothing else may come
CLEAR_LINE = 8.0  # times the median of the neighbourhood; the highest of 4 million bins of white noise is 4.7 times it
BESIDE, CLOSE = 5.0, 1.5  # resolution cells that a harmonic of the drive covers; a high one, of which little is left
HIGH = 8.0  # times the drive: no frame follows there, so that a line is not the mass's motion
LOW, EVENLY = 2.5, 0.8  # times a decay's own frequency; of the stronger half of the record: lower lines that are hum
LEAKS = 4.0  # times what stronger lines leak there
MOST = 12  # lines
MAINS = (50.0, 60.0)
NEAR = 3e-3  # relative: how far mains may be off
PART = 1 << 15  # samples a line is drawn on at a time
SHORTEST_S = 5.0  # of the windows in which a line may swell and wander


@dataclass(frozen=True)
class DriveLine:
    """The drive as the search for other lines needs it.

    ``frequency`` [Hz], ``unit``: the base's amplitude [m], ``spread``: relative width of the drive's line.
    """

    frequency: float
    unit: float
    spread: float


def mains_of(line: Line) -> str:
    """Mains hum where a line's frequency says so, else nothing."""
    for mains in MAINS:
        times = round(line.frequency / mains)
        if times >= 1 and abs(line.frequency / (times * mains) - 1.0) < NEAR:
            return "mains hum" if times == 1 else f"mains hum, {times} times {mains:g} Hz"
    return ""


def foreign_lines(lines: Spectrum, drive: DriveLine) -> tuple[Line, ...]:
    """Find the lines between the drive's harmonics in the spectrum of a stretch: highest first, at most `MOST`."""
    amplitude, frequency, spread = lines.amplitude, lines.frequency, drive.spread
    tops = _tops(amplitude, 1, FAINTEST * drive.unit)
    order = np.maximum(np.rint(frequency[tops] / drive.frequency), 0.0)
    follows = frequency[tops] <= HIGH * drive.frequency
    covered = np.where(follows, BESIDE, CLOSE) * lines.resolution + 3.0 * spread * frequency[tops]
    apart = np.abs(frequency[tops] - order * drive.frequency) > covered
    faint = follows & (amplitude[tops] < LEAST * drive.unit)
    tops = tops[apart & (frequency[tops] > 0.3 * drive.frequency) & ~faint]
    if not len(tops):
        return ()
    orders = np.arange(1.0, 60.0)  # harmonics that may leak
    place = orders * (drive.frequency / float(frequency[1]))
    wide = 0.5 * lines.cell + 3.0 * spread * place  # a line beside a high harmonic is none of it
    strong = _heights(amplitude, place, np.where(orders <= HIGH, 2.0 * lines.cell + 0.5, wide))
    beside = np.abs(frequency[tops][:, None] - orders * drive.frequency) / lines.resolution
    leaks = (np.where(beside < BESIDE, 1.0, _leak(beside)) * strong).sum(axis=1)
    clear = amplitude[tops] > LEAKS * leaks
    tops, leaks = tops[clear], leaks[clear]
    found: list[Line] = []
    for i in np.argsort(-amplitude[tops])[: 8 * MOST].tolist():
        top = int(tops[i])
        near = np.array([abs(frequency[top] - line.frequency) / lines.resolution for line in found])
        leak = leaks[i] + float(np.dot(_leak(near), [line.amplitude for line in found]))
        if amplitude[top] > max(LEAKS * leak, CLEAR_LINE * _around(lines, top)):
            line = _refined(lines, top)
            found.append(replace(line, removed=line.frequency > HIGH * drive.frequency))
    return tuple(found[:MOST])


def without_hum(signal: FloatArray, step: float) -> FloatArray:
    """Return a free decay (n,) without the hum that its sensor shows.

    That is the lines above `HIGH` times the decay's own frequency, and those above `LOW` times it that are as strong in
    one half of the record as in the other: hum that few samples a cycle fold down there. What swings freely fades.
    """
    if len(signal) < 64 or not float(np.ptp(signal)) > 0.0:
        return signal
    about = np.abs(signal - np.median(signal))
    moves = np.flatnonzero(about > 0.1 * about.max())  # where it rests long, hum is more than the motion
    part = signal[moves[0] : moves[-1] + 1] if moves[-1] - moves[0] >= 64 else signal
    own, lines = strongest_tone(amplitude_spectrum(part, step)).frequency, amplitude_spectrum(signal, step, padding=1)
    halves = [amplitude_spectrum(half, step) for half in np.array_split(signal, 2)]
    tops = _tops(lines.amplitude, max(1, math.ceil(LOW * own / float(lines.frequency[1]))), 0.0)
    for top in tops[np.argsort(-lines.amplitude[tops])][: 4 * MOST].tolist():
        if lines.amplitude[top] > CLEAR_LINE * _around(lines, top):
            line = _refined(lines, top)
            each = [h.amplitude[round(line.frequency / float(h.frequency[1]))] for h in halves]
            if line.frequency > HIGH * own or min(each) > EVENLY * max(each):
                signal = signal - line_in(signal, step, line, SHORTEST_S)
    return signal


def faintest(lines: Spectrum, drive: DriveLine) -> float:
    """Amplitude of the faintest line that would be found where no frame follows, by `foreign_lines`' own rules."""
    high = lines.amplitude[np.searchsorted(lines.frequency, HIGH * drive.frequency) :]
    noise = float(np.median(high[:: max(1, len(high) // 2000)])) if len(high) else 0.0
    return max(FAINTEST * drive.unit, CLEAR_LINE * noise)


def on_harmonics(lines: Spectrum, drive: DriveLine, found: tuple[Line, ...]) -> tuple[tuple[Line, ...], float]:
    """Harmonics of the drive that stand out of those beside them, and what hum of the mains another may hide.

    Where no frame follows, harmonics of a motion fall evenly, odd and even ones each by themselves: hum stands out, or
    a contact that rings; other hum is at most what stands on its harmonic and beside it. ``found``: lines between them.
    """
    hz, bins = drive.frequency, drive.frequency / float(lines.frequency[1])
    most = min(400, int(lines.frequency[-1] / hz))
    if most < HIGH:
        return (), 0.0
    order = np.arange(1.0, most + 1.0)
    reach = np.minimum(CLOSE * lines.cell + 3.0 * drive.spread * order * bins, 64.0)
    height = _heights(lines.amplitude, order * bins, np.minimum(reach, 0.45 * bins))
    beside = np.stack([np.roll(height, by) for by in (-4, -2, 2, 4)]).max(axis=0)
    out = (order > HIGH + 1.0) & (order <= most - 4) & (height > LEAST * drive.unit) & (height > 3.0 * beside)
    to_lines = np.abs(np.array([line.frequency for line in found])[:, None] - order * hz)
    clear = ~np.any(to_lines < BESIDE * lines.resolution, axis=0)
    near = [(k, mains) for mains in MAINS if HIGH < (k := round(mains / hz)) <= most and clear[k - 1]]
    hides = [k for k, mains in near if abs(mains - k * hz) < reach[k - 1] * float(lines.frequency[1]) + NEAR * mains]
    masked = max((float(height[k - 3 : k + 2].max()) for k in hides), default=0.0)
    return tuple(Line(float(order[k] * hz), float(height[k])) for k in np.flatnonzero(out & clear)), masked


def line_in(signal: FloatArray, step: float, line: Line, length: float) -> FloatArray:
    """A line as it stands in a signal (n,), its complex amplitude followed in Hann windows of this length [s]."""
    n, angle = len(signal), 2.0 * math.pi * line.frequency * step
    size = max(8, min(n, round(min(length, n * step) / step)))
    starts = np.unique(np.linspace(0, n - size, max(1, math.ceil(4.0 * (n - size) / size) + 1)).round().astype(np.intp))
    weight = hann(size) * np.exp(-1j * angle * np.arange(size)) * (2.0 / size)
    bias, mean = weight.sum(), signal.mean()
    level = np.array([np.dot(weight, signal[a : a + size]) - mean * bias for a in starts]) * np.exp(
        -1j * angle * starts
    )
    middle, found = starts + 0.5 * (size - 1), np.empty(n)
    table = np.exp(1j * angle * np.arange(min(n, PART)))
    for first in range(0, n, PART):
        every = np.arange(first, min(first + PART, n))
        envelope = np.interp(every, middle, level.real) + 1j * np.interp(every, middle, level.imag)
        envelope *= table[: len(every)]
        found[every[0] : every[-1] + 1] = 2.0 * (envelope * cmath.exp(1j * angle * first)).real
    return found


def _tops(amplitude: FloatArray, first: int, least: float) -> NDArray[np.intp]:
    """Bins from a first one on that are higher than their neighbours and than the least."""
    inner = amplitude[first:-1]
    is_top = (inner > least) & (inner >= amplitude[first - 1 : -2]) & (inner > amplitude[first + 1 :])
    return first + np.flatnonzero(is_top)


def _heights(amplitude: FloatArray, at: FloatArray, reach: NDArray[np.floating]) -> FloatArray:
    """Highest amplitude (m,) within a reach (m,) of each of these places (m,) [bins]; 0 beyond the last."""
    first, last = np.ceil(at - reach), np.floor(at + reach)
    index = (first[:, None] + np.arange(np.max(last - first) + 1.0)).astype(np.intp)
    inside = (index >= 0) & (index <= last[:, None]) & (index < len(amplitude))
    return np.asarray(np.where(inside, amplitude[np.where(inside, index, 0)], 0.0).max(axis=1))


def _leak(cells: FloatArray) -> FloatArray:
    """What a line of amplitude 1 shows of itself at these distances under a Hann window, at most."""
    far = np.maximum(cells, 2.5)
    return np.where(cells < 2.5, 1.0, 1.0 / (math.pi * far * (far * far - 1.0)))


def _around(lines: Spectrum, top: int) -> float:
    """Median of a line's neighbourhood without the line itself; a low one's is narrow: integrated noise is steep."""
    far, near = round(min(60 * lines.cell, max(top / 2, 14 * lines.cell))), round(6 * lines.cell)
    before, after = slice(max(0, top - far), max(0, top - near)), slice(top + near + 1, top + far)
    some = np.concatenate([lines.amplitude[before], lines.amplitude[after]])
    return float(np.median(some)) if len(some) else 0.0
