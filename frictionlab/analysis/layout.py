"""From samples to cycles: the drive found, the steady cycles of mass and base laid under each other."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from frictionlab.analysis import cycles, hum, signals, spectrum, steadiness
from frictionlab.analysis.hum import Foreign
from frictionlab.analysis.signals import Stretch
from frictionlab.arrays import ComplexArray, FloatArray
from frictionlab.errors import AnalysisError

FEWEST_SAMPLES = 6  # a cycle; with 5 the base's amplitude comes out 3 % low, with 3 the motion is lost
SHOWN = 10.0  # times the drive: how far a spectrum is kept
FINE_SAMPLES = 24  # a cycle; between fewer a cubic takes from the third harmonic
HARMONICS = 9  # of the base motion: base_distortion counts 2 to 9


@dataclass(frozen=True)
class Drive:
    """The base motion.

    ``frequency`` [Hz] and its standard error (None: too few cycles), ``amplitude`` of the fundamental [m] and its
    standard error, ``harmonics`` (9,) complex over the fundamental (cosine - i sine parts),
    ``wander`` of its phase [rad rms], and whether the cut follows it (``drifts``);
    ``growth``: relative change of its amplitude from the first to the last cycle, 0 where that is not clear.
    """

    frequency: float
    frequency_se: float | None
    amplitude: float
    amplitude_se: float
    harmonics: ComplexArray
    wander: float
    drifts: bool
    growth: float = 0.0


@dataclass(frozen=True)
class Sensor:
    """What a sensor adds to a channel, in the channel's unit.

    ``noise``: rms of its white noise; ``step``: smallest step of its values (0: not quantised); ``rounding``: rms of
    the rounding that no mean takes away; ``shared``: the same as white noise over a cycle.
    """

    noise: float
    step: float
    rounding: float
    shared: float

    @classmethod
    def of(cls, signal: FloatArray, rows: FloatArray, noise: float, samples: float) -> "Sensor":
        """Of a channel (n,) with this white noise, its cycles (m, p), and the samples a cycle has."""
        step = signals.sensor_step(signal)
        rounding = signals.rounding_left(noise, step)
        shared = signals.as_white(rounding, step, float(np.ptp(rows.mean(axis=0))), samples)
        return cls(noise, step, rounding, shared)

    def over(self, unit: float) -> "Sensor":
        """The same in another unit."""
        return Sensor(self.noise / unit, self.step / unit, self.rounding / unit, self.shared / unit)


@dataclass(frozen=True)
class Layout:
    """Steady cycles laid under each other.

    ``mass``, ``base`` (n, p): x/Y and y/Y about their means over all cycles, from the base's rise through zero on;
    ``time`` (n,), ``end`` (n,): when each cycle starts and ends [s];
    ``blocks``: which cycles follow each other without a gap; ``samples``: samples used of a cycle; ``of_mass``,
    ``of_base``: the sensors, over Y; ``offset``: mean of x over all cycles [m];
    ``mass_spectrum``, ``base_spectrum``: of the longest stretch, up to ten times the drive; ``foreign``: lines between
    the drive's harmonics, the high ones taken out;
    ``base_wander`` (p,): what the base's slow wander adds to its mean cycle; ``more``: name -> cycles (n, p) of further
    channels, in SI units.
    """

    drive: Drive
    mass: FloatArray
    base: FloatArray
    time: FloatArray
    end: FloatArray
    blocks: tuple[slice, ...]
    samples: float
    of_mass: Sensor
    of_base: Sensor
    offset: float
    mass_spectrum: spectrum.Spectrum
    base_spectrum: spectrum.Spectrum
    foreign: Foreign
    base_wander: FloatArray
    more: Mapping[str, FloatArray]

    @property
    def left(self) -> float:
        """Sum of the amplitudes of the mass's lines that were left in and make no beat or period, over Y.

        Harmonics that stand out of those beside them are among them.
        """
        low = 2.0 * self.drive.frequency
        some = [line.amplitude for line in self.foreign.mass if not line.removed and line.frequency > low]
        some += [line.amplitude for line in self.foreign.on_harmonics]
        return sum(some) / self.drive.amplitude if self.foreign.period == 1 else 0.0

    @property
    def hidden(self) -> float:
        """Standard uncertainty of an extreme (Y) by lines: faint or hidden ones, and what others leave."""
        rate, taken = self.samples * self.drive.frequency, [line for line in self.foreign.mass if line.removed]
        left = [3.0 / (rate * hum.window(line, self.drive.frequency)) for line in taken]  # of a Hann window's mean
        unseen = math.hypot(self.foreign.faintest, self.foreign.masked) / self.drive.amplitude / math.sqrt(3.0)
        return math.hypot(unseen, self.of_mass.noise * math.sqrt(sum(left)))

    def __len__(self) -> int:
        return len(self.mass)

    def in_periods(self) -> tuple[FloatArray, FloatArray]:
        """x/Y and y/Y of whole periods of the motion, a row each, the base without its slow wander."""
        period, points = self.foreign.period, self.mass.shape[1]
        mass, base = (rows[len(self) % period :].reshape(-1, period * points) for rows in (self.mass, self.base))
        whole = (slice(0, len(base)),)
        return mass, base - slow_wander(base.mean(axis=1), base.shape[1], whole, whole[0])

    def levelled_base(self, some: slice) -> FloatArray:
        """y/Y of some cycles without its slow wander: a drifting sensor adds no energy."""
        return self.base[some] - slow_wander(self.base.mean(axis=1), self.base.shape[1], self.blocks, some)


def lay_out(
    stretches: list[Stretch],
    *,
    padding: int = spectrum.DEFAULT_PADDING,
    least_points: int = 64,
    most_points: int | None = None,
) -> Layout:
    """Find the drive in the longest stretch and lay all full cycles of all stretches under each other.

    Parameters
    ----------
    stretches : list of Stretch
        Steady motion only: the transient is cut off.
    padding : int
        Length of the FFT that finds the drive over the length of the stretch.
    least_points, most_points : int
        Points a cycle is laid out on: one per sample, but at least and at most so many; multiples of 8.

    Raises
    ------
    AnalysisError
        No drive, or no full cycle.
    """
    longest = max(stretches, key=lambda s: len(s.base), default=None)
    if longest is None or len(longest.base) < 32:
        raise AnalysisError("analysis: expected at least 32 samples after the transient: shorten transient_s")
    base_noise = signals.white_noise(longest.base)
    base_lines = spectrum.amplitude_spectrum(longest.base, longest.step, padding=padding)
    guess = _drive_frequency(longest, base_lines)
    cuts = _cuts(stretches, longest, guess, base_noise)
    at = next(i for i, s in enumerate(stretches) if s is longest)
    cut = cuts[at]
    driven = hum.DriveLine.of(longest, cut)
    lines_of_base, shown = driven.lines_in(longest.base, base_lines), SHOWN * driven.frequency
    base_lines = spectrum.up_to(base_lines, shown)  # the rest of a long recording's is dear
    mass_lines = spectrum.amplitude_spectrum(longest.mass, longest.step, padding=1)
    found = driven.lines_in(longest.mass, mass_lines), lines_of_base
    stretches, foreign = hum.cleaned(stretches, cuts, driven, mass_lines, found)
    mass_lines = spectrum.up_to(mass_lines, shown)
    if foreign.period > 1 and cut.drifts:  # what it follows is the motion's own change from cycle to cycle
        cut = cycles.cut(stretches[0].base, cut.frequency, noise=base_noise, follow=False)
        cuts = [cut]
    longest = stretches[at]
    points = cycles.points_per_cycle(1.0 / cut.frequency, least=least_points, most=most_points)
    base = _folded_all([s.base for s in stretches], cuts, points)
    mass = _folded_all([s.mass for s in stretches], cuts, points)
    edges = np.cumsum([0, *(len(c) for c in cuts)]).tolist()
    blocks = tuple(slice(a, b) for a, b in pairwise(edges) if b > a)
    if foreign.base:
        base_noise = signals.white_noise(longest.base)
    of_mass = Sensor.of(longest.mass, mass, signals.white_noise(longest.mass), 1.0 / cut.frequency)
    of_base = Sensor.of(longest.base, base, base_noise, 1.0 / cut.frequency)
    drive, wander = _driven(base, blocks, cut, longest.step, of_base, foreign.period)
    time = np.concatenate([s.time + c.start * s.step for s, c in zip(stretches, cuts, strict=True)])
    end = np.concatenate([s.time + c.end * s.step for s, c in zip(stretches, cuts, strict=True)])
    return Layout(
        drive=drive,
        offset=float(mass.mean()),
        mass_spectrum=mass_lines,
        base_spectrum=base_lines,
        mass=_scaled(mass, drive.amplitude),
        base=_scaled(base, drive.amplitude),
        time=time,
        end=end,
        blocks=blocks,
        samples=min(1.0 / cut.frequency, float(points)),
        of_mass=of_mass.over(drive.amplitude),
        of_base=of_base.over(drive.amplitude),
        foreign=foreign,
        base_wander=(wander.mean(axis=0) - wander.mean()) / drive.amplitude,
        more={name: _folded_all([s.more[name] for s in stretches], cuts, points) for name in longest.more},
    )


def _driven(
    base: FloatArray, blocks: tuple[slice, ...], cut: cycles.Cut, step: float, sensor: Sensor, period: int
) -> tuple[Drive, FloatArray]:
    """The base motion of whole periods, and its slow wander."""
    white, points = math.hypot(sensor.noise, sensor.shared * math.sqrt(len(base))), base.shape[1]
    if 1 < period <= len(base):
        base = base[len(base) % period :]
        rows = base.reshape(-1, period * points)
        wander = slow_wander(rows.mean(axis=1), period * points, (slice(0, len(rows)),)).reshape(period, -1)
    else:
        wander = slow_wander(base.mean(axis=1), points, blocks)
    return _drive(base, wander.mean(axis=0), cut, step, white), wander


def _cuts(stretches: list[Stretch], longest: Stretch, guess: float, base_noise: float) -> list[cycles.Cut]:
    """The cycles of each stretch, all by the longest one's frequency."""
    cut = cycles.cut(longest.base, guess * longest.step, noise=base_noise)
    cuts = [cut if s is longest else cycles.cut(s.base, cut.frequency, noise=base_noise) for s in stretches]
    if not any(len(c) for c in cuts):
        raise AnalysisError(
            f"analysis: expected at least one full cycle of the drive ({guess:.4g} Hz) after the transient; got"
            f" {len(longest.base) * longest.step:.3g} s: shorten transient_s or record longer"
        )
    if cut.frequency * FEWEST_SAMPLES > 1.0:
        raise AnalysisError(
            f"analysis: expected at least {FEWEST_SAMPLES} samples a cycle of the drive; got {1.0 / cut.frequency:.3g}"
            f" ({cut.frequency / longest.step:.4g} Hz): sample faster"
        )
    return cuts


def _drive_frequency(stretch: Stretch, lines: spectrum.Spectrum) -> float:
    """Frequency of the base's strongest line [Hz]; refuses a base that nothing drives."""
    base = stretch.base
    variance = float(np.var(base))
    if not variance > 0.0:
        raise AnalysisError("analysis: no drive: the base stands still; expected a base motion: check the base column")
    tone = spectrum.strongest_tone(lines)
    if 0.5 * tone.amplitude**2 < 0.2 * variance:
        raise AnalysisError(
            f"analysis: no drive: the strongest line of the base motion ({tone.frequency:.4g} Hz) holds only"
            f" {50 * tone.amplitude**2 / variance:.2g} % of its power; expected a periodic base: check the base column"
        )
    return tone.frequency


def _folded_all(signals: list[FloatArray], cuts: list[cycles.Cut], points: int) -> FloatArray:
    """Cycles of all stretches; few samples of a cycle are interpolated without limit of band first."""
    finer = math.ceil(FINE_SAMPLES * max(c.frequency for c in cuts))
    if finer > 1:
        signals = [cycles.finer(s, finer) for s in signals]
    rows = [cycles.fold(s, c.start * finer, c.end * finer, points) for s, c in zip(signals, cuts, strict=True)]
    return rows[0] if len(rows) == 1 else np.concatenate(rows)


def _scaled(rows: FloatArray, unit: float) -> FloatArray:
    """Rows about their mean over a unit, in place: a second copy of a long recording would be dear."""
    rows -= rows.mean()
    rows /= unit
    return rows


def _drive(base: FloatArray, wander: FloatArray, cut: cycles.Cut, step: float, base_noise: float) -> Drive:
    """Amplitude and harmonics of the base motion from its mean cycle (m), its mean slow wander (points,) taken off."""
    n, points = base.shape
    order = np.arange(1, HARMONICS + 1)
    turn = 2.0 * np.pi * np.arange(points) / points - 0.5 * np.pi  # rows start at the rise through zero
    mean = base.mean(axis=0) - wander
    lines = np.array([np.sum(mean * np.exp(-1j * k * turn)) for k in order]) * (2.0 / points)
    each = np.abs(cycles.first_harmonic(base, turn)) * (2.0 / points)
    amplitude = float(abs(lines[0]))
    white = base_noise * math.sqrt(2.0 * cut.frequency / n)
    scatter = float(each.std(ddof=1)) / math.sqrt(n) if n > 2 else 0.0
    known = math.isfinite(cut.frequency_se)
    growth = steadiness.growth(each)
    return Drive(
        frequency=cut.frequency / step,
        frequency_se=cut.frequency_se / step if known else None,
        amplitude=amplitude,
        amplitude_se=math.hypot(max(white, scatter), growth * amplitude / math.sqrt(12.0)),
        harmonics=lines * np.exp(-1j * order * np.angle(lines[0])) / amplitude,
        wander=cut.wander,
        drifts=cut.drifts,
        growth=growth,
    )


def slow_wander(means: FloatArray, points: int, blocks: tuple[slice, ...], some: slice | None = None) -> FloatArray:
    """Slow wander of cycles: straight lines from the middle of each one's mean (n,) to the next, within a block.

    Returns
    -------
    (n, points) array
        Of the cycles ``some``; without it one row, the mean wander of all.
    """
    inside = (np.arange(points) + 0.5) / points - 0.5
    before, after = np.zeros(len(means)), np.zeros(len(means))
    for block in blocks:
        rise = np.diff(means[block])
        if len(rise):
            before[block] = np.concatenate([rise[:1], rise])
            after[block] = np.concatenate([rise, rise[-1:]])
    if some is None:
        return np.asarray(means.mean() + np.where(inside < 0, before.mean(), after.mean()) * inside)[None]
    return np.asarray(means[some, None] + np.where(inside < 0, before[some, None], after[some, None]) * inside)


def approach(stretch: Stretch, layout: Layout) -> tuple[FloatArray, FloatArray]:
    """Cycles of the mass before the steady ones, at the steady period: start times (m,) [s] and x/Y (m, p)."""
    period = 1.0 / layout.drive.frequency
    count = max(0, math.floor((layout.time[0] - stretch.time) / period - 2.0 / layout.samples))
    time = layout.time[0] - period * np.arange(count, 0, -1)
    start = (time - stretch.time) / stretch.step
    rows = cycles.fold(stretch.mass, start, start + period / stretch.step, layout.mass.shape[1])
    return time, (rows - layout.offset) / layout.drive.amplitude
