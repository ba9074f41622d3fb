"""Hum: lines in a spectrum that are no harmonic of the drive, from the mains, a bearing, a second tone; taken out.

A motion that repeats with the drive has its harmonics and nothing between them. What stands there alone is the
sensor's, the laboratory's or a second motion's. High lines are taken out, low ones (a beat, a free vibration) are told.
"""

import cmath
import math
from dataclasses import dataclass, replace

import numpy as np

from frictionlab.analysis import cycles
from frictionlab.analysis.signals import Stretch, sensor_step
from frictionlab.analysis.spectrum import Spectrum, amplitude_spectrum, refined
from frictionlab.arrays import FloatArray

LEAST = 5e-4  # of the base's amplitude: smaller lines change no number by more than its error
FAINTEST = 1e-4  # the same of lines where no frame follows: of these nothing else may come
CLEAR = 8.0  # times the median of the neighbourhood; the highest of 4 million bins of white noise is 4.7 times it
NEIGHBOURS = 60  # resolution cells to either side
BESIDE, CLOSE = 5.0, 1.5  # resolution cells that a harmonic of the drive covers; a high one, of which little is left
HIGH = 8.0  # times the drive: no frame follows there, so that a line is not the mass's motion
LEAKS = 4.0  # times what stronger lines leak there
ORDERS = 60  # of the drive's harmonics that may leak
MOST = 12  # lines
MOST_HARMONICS, WIDEST = 400, 64.0  # of the drive that are looked at; bins to either side of one
OUT = 3.0  # times the highest of the four beside it with odd, or even, numbers like its own
LONGEST = 6  # cycles a motion may take to repeat
FAINT, SURELY = 0.2, 0.1  # of the highest line; of a resolution cell: lines that tell the period, and how well
SAMPLED = 2000  # lines of a spectrum that tell its noise
MAINS = (50.0, 60.0)
NEAR = 3e-3  # relative: how far mains may be off
RESOLVED = 3.0  # resolution cells between a line and a harmonic, in a window that tells them apart
PART = 1 << 15  # samples a line is drawn on at a time
SHORTEST_S = 5.0  # of such windows, in which a line may swell and wander
ROUNDS = 0.1  # of a sensor's step: a line below it may be rounding


@dataclass(frozen=True)
class Line:
    """A line that is no harmonic: ``frequency`` [Hz], ``amplitude`` in the signal's unit; whether ``removed``."""

    frequency: float
    amplitude: float
    removed: bool

    @property
    def origin(self) -> str:
        """Mains hum where its frequency says so, else nothing."""
        for mains in MAINS:
            times = round(self.frequency / mains)
            if times >= 1 and abs(self.frequency / (times * mains) - 1.0) < NEAR:
                return "mains hum" if times == 1 else f"mains hum, {times} times {mains:g} Hz"
        return "no harmonic of the drive"

    @property
    def cause(self) -> str:
        """What may stand on a harmonic."""
        hum = self.origin
        return f"perhaps {hum}" if "mains" in hum else "a line from outside, or a contact that rings"


@dataclass(frozen=True)
class Foreign:
    """Lines that are no harmonics of the drive, by channel (m), and after how many cycles of the drive all repeats.

    ``faintest``: amplitude of the faintest line that would be found in the mass's channel above the frame's reach (m);
    ``on_harmonics``: harmonics of the mass that stand out of those beside them; ``masked``: amplitude of hum that a
    harmonic of the drive may hide (m).
    """

    mass: tuple[Line, ...] = ()
    base: tuple[Line, ...] = ()
    period: int = 1
    faintest: float = 0.0
    on_harmonics: tuple[Line, ...] = ()
    masked: float = 0.0


@dataclass(frozen=True)
class DriveLine:
    """The drive as the search for lines needs it.

    ``frequency`` [Hz], ``unit``: the base's amplitude [m], ``spread``: relative width of the drive's line.
    """

    frequency: float
    unit: float
    spread: float

    @classmethod
    def of(cls, stretch: Stretch, cut: cycles.Cut) -> "DriveLine":
        """Of a stretch and where its cycles lie."""
        spread = float(np.std(cut.end - cut.start)) * cut.frequency if len(cut) else 0.0
        return cls(cut.frequency / stretch.step, float(np.std(stretch.base)) * math.sqrt(2.0), spread)

    def lines_in(self, signal: FloatArray, lines: Spectrum) -> tuple[Line, ...]:
        """Lines of one channel that are no harmonics, without the faint ones that may be a quiet sensor's steps.

        Rounding of a periodic motion makes many of these.
        """
        found = foreign(lines, self)
        faint = LEAST * self.unit
        if all(line.amplitude > faint for line in found):
            return found
        least = min(faint, ROUNDS * sensor_step(signal))
        return tuple(line for line in found if line.amplitude > least)


def cleaned(
    stretches: list[Stretch],
    cuts: list[cycles.Cut],
    drive: DriveLine,
    of_mass: Spectrum,
    found: tuple[tuple[Line, ...], tuple[Line, ...]],
) -> tuple[list[Stretch], Foreign]:
    """Take high lines that are no harmonics out of all stretches; say what is in each channel of the longest.

    Parameters
    ----------
    stretches, cuts : lists of the same length
        Samples, and where their cycles lie.
    of_mass : Spectrum
        Of the mass in the longest stretch.
    found : tuple
        Lines of mass and base.
    """
    mass, base = found
    period = period_of((*mass, *base), drive.frequency, of_mass.resolution) if len(stretches) == 1 else 1
    if period > 1:  # high lines of that period are the motion's
        mass, base = (beside_period(some, drive.frequency / period, of_mass.resolution) for some in found)
    stretches = [
        replace(s, mass=without(s.mass, s.step, mass, c), base=without(s.base, s.step, base, c))
        for s, c in zip(stretches, cuts, strict=True)
    ]
    least = faintest(of_mass, drive)
    if period > 1:
        return stretches, Foreign(mass, base, period, least)
    out, masked = on_harmonics(of_mass, drive, mass)
    return stretches, Foreign(mass, base, period, least, out, masked)


def without(signal: FloatArray, step: float, found: tuple[Line, ...], cut: cycles.Cut) -> FloatArray:
    """Return a channel (n,) without the lines that are to go.

    At first in windows long enough to tell them from the drive's harmonics; then, with those taken off, in short ones
    that follow a line which swells and wanders.
    """
    gone = [line for line in found if line.removed]
    for line in gone:
        signal = signal - line_in(signal, step, line, window(line, cut.frequency / step))
    if gone and len(cut):
        own = signal - cycles.common(signal, cut, cycles.points_per_cycle(1.0 / cut.frequency))
        signal = signal - sum(line_in(own, step, line, SHORTEST_S) for line in gone)
    return signal


def foreign(lines: Spectrum, driven: DriveLine) -> tuple[Line, ...]:
    """Find the lines between the drive's harmonics in the spectrum of a stretch: highest first, at most `MOST`."""
    amplitude, frequency, resolution = lines.amplitude, lines.frequency, lines.resolution
    drive, unit, spread = driven.frequency, driven.unit, driven.spread
    high = np.flatnonzero(amplitude > FAINTEST * unit)
    high = high[(high > 0) & (high < len(amplitude) - 1)]
    high = high[(amplitude[high] >= amplitude[high - 1]) & (amplitude[high] > amplitude[high + 1])]
    order = np.maximum(np.rint(frequency[high] / drive), 0.0)
    follows = frequency[high] <= HIGH * drive
    covered = np.where(follows, BESIDE, CLOSE) * resolution + 3.0 * spread * frequency[high]
    apart = np.abs(frequency[high] - order * drive) > covered
    tops = high[apart & (frequency[high] > 0.3 * drive) & ~(follows & (amplitude[high] < LEAST * unit))]
    if not len(tops):
        return ()
    cell = resolution / float(frequency[1])
    orders = np.arange(1, ORDERS)
    wide = 0.5 * cell + 3.0 * spread * orders * drive / float(frequency[1])
    reach = np.where(orders <= HIGH, 2.0 * cell + 0.5, wide)  # a line beside a high harmonic is none of it
    strong = _heights(amplitude, orders * (drive / frequency[1]), reach)
    beside = np.abs(frequency[tops][:, None] - orders * drive) / resolution
    leaks = (np.where(beside < BESIDE, 1.0, _leak(beside)) * strong).sum(axis=1)
    clear = amplitude[tops] > LEAKS * leaks
    tops, leaks = tops[clear], leaks[clear]
    found: list[Line] = []
    for i in np.argsort(-amplitude[tops])[: 8 * MOST].tolist():
        top = int(tops[i])
        near = np.array([abs(frequency[top] - line.frequency) / resolution for line in found])
        leak = leaks[i] + float(np.dot(_leak(near), [line.amplitude for line in found]))
        if amplitude[top] > max(LEAKS * leak, CLEAR * _around(amplitude, top, cell)):
            offset, height = refined(amplitude[top - 1 : top + 2], cell)
            at = float((top + offset) * frequency[1])
            found.append(Line(at, height, removed=at > HIGH * drive))
    return tuple(found[:MOST])


def without_high_lines(signal: FloatArray, step: float) -> FloatArray:
    """Return a free decay (n,) without the lines above `HIGH` times its own frequency: hum that its sensor picked up.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.002)
    >>> decay = np.exp(-0.2 * t) * np.cos(20.0 * t)
    >>> clean = without_high_lines(decay + 0.01 * np.cos(2 * np.pi * 50.0 * t), 0.002)
    >>> bool(np.abs(clean - decay).max() < 2e-4)
    True
    """
    if len(signal) < 64 or not float(np.ptp(signal)) > 0.0:
        return signal
    lines = amplitude_spectrum(signal, step, padding=1)
    amplitude, cell = lines.amplitude, lines.resolution / float(lines.frequency[1])
    own = int(np.argmax(amplitude[2:])) + 2
    tops = np.arange(max(1, math.ceil(HIGH * own)), len(amplitude) - 1)
    tops = tops[(amplitude[tops] >= amplitude[tops - 1]) & (amplitude[tops] > amplitude[tops + 1])]
    for top in tops[np.argsort(-amplitude[tops])][:MOST].tolist():
        if amplitude[top] > CLEAR * _around(amplitude, top, cell):
            offset, height = refined(amplitude[top - 1 : top + 2], cell)
            line = Line(float((top + offset) * lines.frequency[1]), height, removed=True)
            signal = signal - line_in(signal, step, line, SHORTEST_S)
    return signal


def faintest(lines: Spectrum, drive: DriveLine) -> float:
    """Amplitude of the faintest line that would be found where no frame follows, by `foreign`'s own rules."""
    high = lines.amplitude[np.searchsorted(lines.frequency, HIGH * drive.frequency) :]
    noise = float(np.median(high[:: max(1, len(high) // SAMPLED)])) if len(high) else 0.0
    return max(FAINTEST * drive.unit, CLEAR * noise)


def on_harmonics(lines: Spectrum, driven: DriveLine, found: tuple[Line, ...]) -> tuple[tuple[Line, ...], float]:
    """Harmonics of the drive that stand out of those beside them, and what hum of the mains another may hide.

    A line so near a harmonic cannot be told from it. Where no frame follows, the harmonics of a motion fall evenly,
    those with odd and those with even numbers each by itself: hum stands out, or a contact that rings. Hum that does
    not is at most as much as stands on its harmonic and on those beside it. ``found``: lines between the harmonics.
    """
    drive, unit, spread = driven.frequency, driven.unit, driven.spread
    cell, most = float(lines.frequency[1]), min(MOST_HARMONICS, int(lines.frequency[-1] / drive))
    if most < HIGH:
        return (), 0.0
    order = np.arange(1.0, most + 1.0)
    reach = np.minimum(CLOSE * lines.resolution / cell + 3.0 * spread * order * drive / cell, WIDEST)
    height = _heights(lines.amplitude, order * (drive / cell), np.minimum(reach, 0.45 * drive / cell))
    beside = np.stack([np.roll(height, by) for by in (-4, -2, 2, 4)]).max(axis=0)
    out = (order > HIGH + 1.0) & (order <= most - 4) & (height > LEAST * unit) & (height > OUT * beside)
    to_lines = np.abs(np.array([line.frequency for line in found])[:, None] - order * drive)
    clear = ~np.any(to_lines < BESIDE * lines.resolution, axis=0)
    out &= clear
    told = zip(order[out].tolist(), height[out].tolist(), strict=True)
    near = [(k, mains) for mains in MAINS if HIGH < (k := round(mains / drive)) <= most and clear[k - 1]]
    hides = [k for k, mains in near if abs(mains - k * drive) < reach[k - 1] * cell + NEAR * mains]
    masked = max((float(height[k - 3 : k + 2].max()) for k in hides), default=0.0)
    return tuple(Line(k * drive, h, removed=False) for k, h in told), masked


def period_of(found: tuple[Line, ...], drive: float, resolution: float) -> int:
    """Cycles of the drive after which a motion with these lines repeats; 1 where they belong to no such period.

    Examples
    --------
    >>> period_of((Line(0.5, 1e-4, removed=False), Line(1.5, 2e-5, removed=False)), 1.0, 0.02)
    2
    """
    low = [line for line in found if not line.removed]
    least = FAINT * max((line.amplitude for line in low), default=0.0)
    clear = [line.frequency for line in low if line.amplitude > least]
    for period in range(2, LONGEST + 1):
        part = drive / period
        if clear and all(abs(f - round(f / part) * part) < SURELY * resolution for f in clear):
            return period
    return 1


def beside_period(found: tuple[Line, ...], part: float, resolution: float) -> tuple[Line, ...]:
    """Without the high lines that are multiples of this frequency [Hz], of which the motion is made."""
    return tuple(
        line
        for line in found
        if not line.removed or abs(line.frequency - round(line.frequency / part) * part) > resolution
    )


def _heights(amplitude: FloatArray, at: FloatArray, reach: FloatArray) -> FloatArray:
    """Highest amplitude (m,) within two resolution cells of each of these places (m,) [bins]; 0 beyond the last."""
    first, last = np.ceil(at - reach), np.floor(at + reach)
    index = (first[:, None] + np.arange(np.max(last - first) + 1.0)).astype(np.intp)
    inside = (index >= 0) & (index <= last[:, None]) & (index < len(amplitude))
    return np.asarray(np.where(inside, amplitude[np.where(inside, index, 0)], 0.0).max(axis=1))


def _leak(cells: FloatArray) -> FloatArray:
    """What a line of amplitude 1 shows of itself at these distances under a Hann window, at most."""
    far = np.maximum(cells, 2.5)
    return np.where(cells < 2.5, 1.0, 1.0 / (math.pi * far * (far * far - 1.0)))


def _around(amplitude: FloatArray, top: int, cell: float) -> float:
    """Median of a line's neighbourhood without the line itself; ``cell``: bins to a resolution cell."""
    far, near = round(NEIGHBOURS * cell), round(6 * cell)
    some = np.concatenate([amplitude[max(0, top - far) : max(0, top - near)], amplitude[top + near + 1 : top + far]])
    return float(np.median(some)) if len(some) else 0.0


def window(line: Line, drive: float) -> float:
    """Length of a window [s] that tells a line from the drive's harmonic next to it."""
    beside = abs(line.frequency - round(line.frequency / drive) * drive)
    return max(SHORTEST_S, RESOLVED / max(beside, 1e-300))


def line_in(signal: FloatArray, step: float, line: Line, length: float) -> FloatArray:
    """A line as it stands in a signal (n,), its amplitude and phase followed in Hann windows of this length [s].

    In each window the line's complex amplitude is the weighted mean of the signal turned back by its frequency;
    between the windows' middles it runs straight.
    """
    n, turn = len(signal), 2.0 * math.pi * line.frequency * step
    size = max(8, min(n, round(min(length, n * step) / step)))
    starts = np.unique(np.linspace(0, n - size, max(1, math.ceil(4.0 * (n - size) / size) + 1)).round().astype(np.intp))
    weight = np.hanning(size + 2)[1:-1] * np.exp(-1j * turn * np.arange(size))
    weight /= np.hanning(size + 2).sum()
    bias, mean = weight.sum(), signal.mean()
    level = np.array([np.dot(weight, signal[a : a + size]) - mean * bias for a in starts]) * np.exp(-1j * turn * starts)
    middle, found = starts + 0.5 * (size - 1), np.empty(n)
    table = np.exp(1j * turn * np.arange(min(n, PART)))
    for first in range(0, n, PART):
        every = np.arange(first, min(first + PART, n))
        envelope = np.interp(every, middle, level.real) + 1j * np.interp(every, middle, level.imag)
        envelope *= table[: len(every)]
        found[every[0] : every[-1] + 1] = 2.0 * (envelope * cmath.exp(1j * turn * first)).real
    return found
