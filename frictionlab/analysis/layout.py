"""From samples to cycles: the drive found, hum taken out, the steady cycles of mass and base laid under each other."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from frictionlab.analysis import cycles, spectrum, steadiness
from frictionlab.analysis.channels import FORCES
from frictionlab.analysis.cycles import Cut
from frictionlab.analysis.signals import BY_TWO, Sensor, Stretch, white_noise
from frictionlab.analysis.spectrum import SHORTEST_S, DriveLine, Line, Spectrum, line_in
from frictionlab.arrays import ComplexArray, FloatArray, IntArray
from frictionlab.errors import AnalysisError

SHOWN = 10.0  # times the drive: how far a spectrum is kept
VELOCITY = "mass_velocity"
JUMPS = " without overshoot"  # of a force: as it is drawn and fitted; its loop takes the harmonics of all samples
HARMONICS = 9  # of the base motion: base_distortion counts 2 to 9
FOLDED = 0.003  # of the drive's frequency: how near a line lies to a harmonic that the sampling folds down
FARTHEST = 20.0  # times the order of one that is seen: how far others that are folded down are looked for
PARTS, KEEPS = 16, 20.0  # of a record; times the noise's power: the phase of so strong a line is the same in all parts


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

    @property
    def distortion(self) -> float:
        """Rms of the harmonics from the second on over the fundamental."""
        return float(np.linalg.norm(self.harmonics[1:]))


@dataclass(frozen=True)
class Foreign:
    """Lines that are no harmonics of the drive, by channel (m); of a measured velocity over the drive's (rad/s).

    ``faintest``: amplitude of the faintest line that would be found in the mass's channel above the frame's reach (m);
    ``on_harmonics``: harmonics of the mass that stand out of those beside them; ``masked``: amplitude of hum that a
    harmonic of the drive may hide (m).
    """

    lines: Mapping[str, tuple[Line, ...]]
    faintest: float
    on_harmonics: tuple[Line, ...]
    masked: float


@dataclass(frozen=True)
class Layout:
    """Steady cycles laid under each other.

    ``mass``, ``base`` (n, p): x/Y and y/Y about their means over all cycles, from the base's rise through zero on;
    ``time`` (n,), ``end`` (n,): when each cycle starts and ends [s];
    ``blocks``: which cycles follow each other without a gap; ``samples``: samples used of a cycle; ``of_mass``,
    ``of_base``: the sensors, over Y (of a measured velocity ``of_velocity``, over omega Y); ``offset``: mean of x over
    all cycles [m];
    ``spectra``: of the longest stretch, by channel, up to ten times the drive; ``foreign``: lines between the drive's
    harmonics, the high ones taken out;
    ``base_wander`` (p,): what the base's slow wander adds to its mean cycle; ``more``: name -> cycles (n, p) of further
    channels, in SI units; a force is there with `JUMPS` too.
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
    spectra: Mapping[str, Spectrum]
    foreign: Foreign
    base_wander: FloatArray
    more: Mapping[str, FloatArray]
    of_velocity: Sensor | None = None

    @property
    def left(self) -> float:
        """Sum of the amplitudes, over Y, of the mass's lines that were left in and make no beat.

        Harmonics that stand out of those beside them are among them.
        """
        low = 2.0 * self.drive.frequency
        some = [line.amplitude for line in self.foreign.lines["mass"] if not line.removed and line.frequency > low]
        return sum(some + [line.amplitude for line in self.foreign.on_harmonics]) / self.drive.amplitude

    @property
    def hidden(self) -> float:
        """Standard uncertainty of an extreme (Y) by lines: faint or hidden ones, and what others leave."""
        rate, taken = self.samples * self.drive.frequency, [line for line in self.foreign.lines["mass"] if line.removed]
        left = [3.0 / (rate * _window(line, self.drive.frequency)) for line in taken]  # of a Hann window's mean
        unseen = math.hypot(self.foreign.faintest, self.foreign.masked) / self.drive.amplitude / math.sqrt(3.0)
        return math.hypot(unseen, self.of_mass.noise * math.sqrt(sum(left)))

    @property
    def duration(self) -> float:
        """From the first cycle's start to the last one's end [s]."""
        return float(self.end[-1] - self.time[0])

    @cached_property
    def second_motion(self) -> tuple[Line | None, float]:
        """A line of mass or base that keeps its phase, and which harmonic of the drive it is, folded down (0: none)."""
        lines = self.foreign.lines
        every = ((line, rows) for rows, of in ((self.mass, "mass"), (self.base, "base")) for line in lines[of])
        low = next((line for line, rows in every if not line.removed and self._keeps_time(rows, line)), None)
        if low is None:
            return None, 0.0
        order = np.arange(max(2.0, self.samples // 2), 2.0 * self.samples + HARMONICS)  # an acceleration may jump
        near = order[np.abs(self._seen_at(order) - low.frequency / self.drive.frequency) < FOLDED]
        return low, float(near[0]) if len(near) else 0.0

    def folded_into(self, count: int) -> FloatArray:
        """Amplitude (count,), Y, by which harmonics of a mass's acceleration that are folded down may stand in others.

        Those of a jump fall as 1 over their order; the second motion is one, and shows how large they are.
        """
        second, (line, first), k = self.of_mass.second, self.second_motion, np.arange(1.0, count + 1.0)
        if line is None or not first or second is None or not (second.alone and second.times == 2):
            return np.zeros(count)
        order = np.arange(first, FARTHEST * first)
        there = np.abs(self._seen_at(order) - k[:, None]) < 1.0 / len(self)
        share = np.where(there.any(axis=1), first / order[there.argmax(axis=1)], 0.0)
        size, slower = line.amplitude / self.drive.amplitude, line.frequency / self.drive.frequency / k
        return np.asarray(size * slower**2 * share)

    def _seen_at(self, order: FloatArray) -> FloatArray:
        """Where harmonics (n,) show in the samples, over the drive's frequency."""
        return np.asarray(np.abs(order - self.samples * np.rint(order / self.samples)))

    def _keeps_time(self, rows: FloatArray, line: Line) -> bool:
        """Whether a line in cycles (n, p) keeps its phase, as a second motion does, not friction that wanders."""
        turned = np.exp(-2j * math.pi * line.frequency * self.moments(np.arange(len(rows)))).reshape(rows.shape)
        each = np.mean((rows - rows.mean(axis=0)) * turned, axis=1)
        parts = np.array([some.mean() for some in np.array_split(each, min(len(each), PARTS))])
        return bool(abs(parts.mean()) ** 2 * (1.0 + (len(parts) - 1.0) / KEEPS) > np.mean(np.abs(parts) ** 2))

    def seconds(self, turns: FloatArray) -> FloatArray:
        """When so many cycles have passed [s]; what is between two blocks has no time."""
        return np.asarray(np.interp(turns, np.arange(len(self) + 1.0), np.append(self.time, self.end[-1])))

    def moments(self, which: IntArray) -> FloatArray:
        """Times (k p,) of the points of some cycles (k,), one after the other [s]."""
        phase = np.arange(self.mass.shape[1]) / self.mass.shape[1]
        return np.asarray(self.time[which, None] + (self.end - self.time)[which, None] * phase).ravel()

    def __len__(self) -> int:
        return len(self.mass)


def lay_out(
    stretches: list[Stretch],
    *,
    padding: int = spectrum.DEFAULT_PADDING,
    least_points: int = 64,
    most_points: int | None = None,
) -> Layout:
    """Find the drive in the longest stretch of steady motion and lay all cycles of all stretches under each other.

    ``padding``: length of the FFT that finds the drive over that of the stretch; the rest: `cycles.points_per_cycle`.
    `AnalysisError`: No drive; no full cycle of it, or fewer than six samples of one.
    """
    at = max(range(len(stretches)), key=lambda i: len(stretches[i].base))
    alone = stretches[at]
    by_one = [name for name in alone.channels if not name.endswith(BY_TWO)]
    stretches = [replace(s, channels={n: s.channels.get(n + BY_TWO, s.channels[n]) for n in by_one}) for s in stretches]
    stretches, cuts, foreign, spectra = _cleaned(stretches, at, padding)
    longest, cut = stretches[at], cuts[at]
    points = cycles.points_per_cycle(1.0 / cut.frequency, least=least_points, most=most_points)
    more = {name: _folded([s.channels[name] for s in stretches], cuts, points) for name in longest.channels}
    of_force = [name for name in FORCES if name in longest.channels]
    more |= {n + JUMPS: _folded([s.channels[n] for s in stretches], cuts, points, jumps=True) for n in of_force}
    mass, base = more.pop("mass"), more.pop("base")
    edges = np.cumsum([0, *(len(c) for c in cuts)]).tolist()
    blocks = tuple(slice(a, b) for a, b in pairwise(edges) if b > a)

    def sensor(name: str, rows: FloatArray) -> Sensor:
        by_two, shown = alone.seconds.get(name), alone if name in alone.seconds else longest
        return Sensor.of(shown.channels[name], float(np.ptp(rows.mean(axis=0))), 1.0 / cut.frequency, by_two)

    of_mass, of_base = sensor("mass", mass), sensor("base", base)
    of_velocity = sensor(VELOCITY, more[VELOCITY]) if VELOCITY in more else None
    drive, wander = _drive(base, blocks, cut, longest.step, of_base)
    unit, offset = drive.amplitude, float(mass.mean())
    mass -= offset  # in place: a second copy of a long recording would be dear
    mass /= unit
    base -= base.mean()
    base /= unit
    return Layout(
        drive=drive,
        mass=mass,
        base=base,
        time=np.concatenate([s.time + c.start * s.step for s, c in zip(stretches, cuts, strict=True)]),
        end=np.concatenate([s.time + c.end * s.step for s, c in zip(stretches, cuts, strict=True)]),
        blocks=blocks,
        samples=min(1.0 / cut.frequency, float(points)),
        of_mass=of_mass.over(unit),
        of_base=of_base.over(unit),
        offset=offset,
        spectra=spectra,
        foreign=foreign,
        base_wander=(wander - wander.mean()) / unit,
        more=more,
        of_velocity=of_velocity and of_velocity.over(2.0 * math.pi * drive.frequency * unit),
    )


def _cleaned(
    stretches: list[Stretch], at: int, padding: int
) -> tuple[list[Stretch], list[Cut], Foreign, dict[str, Spectrum]]:
    """The stretches without high lines that are no harmonics, their cycles, all lines, spectra by channel."""
    longest = stretches[at]
    lines = spectrum.amplitude_spectrum(longest.base, longest.step, padding=padding)
    cuts = _cuts(stretches, at, lines)
    cut = cuts[at]
    spread = float(np.std(cut.end - cut.start)) * cut.frequency if len(cut) else 0.0
    drive = DriveLine(cut.frequency / longest.step, float(np.std(longest.base)) * math.sqrt(2.0), spread)
    found, spectra = dict[str, tuple[Line, ...]](), dict[str, Spectrum]()
    for name in ("base", "mass", *({VELOCITY} & longest.channels.keys())):
        signal = longest.channels[name] / (2.0 * math.pi * drive.frequency if name == VELOCITY else 1.0)
        if name != "base":
            lines = spectrum.amplitude_spectrum(signal, longest.step, padding=1)
        found[name], faint = spectrum.foreign_lines(lines, drive), spectrum.LEAST * drive.unit
        if found[name]:  # of a quiet sensor's steps they may be rounding
            sensor = Sensor.of(signal, float(np.ptp(signal)), 1.0 / cut.frequency)
            least = 0.1 * sensor.step if sensor.is_stepped else min(faint, 0.1 * sensor.step)
            found[name] = tuple(line for line in found[name] if line.amplitude > least)
        if name == "mass":
            faintest, others = spectrum.faintest(lines, drive), spectrum.on_harmonics(lines, drive, found[name])
        kept = slice(int(np.searchsorted(lines.frequency, SHOWN * drive.frequency, side="right")))
        # copied, so that the rest, which is dear of a long recording, can be forgotten
        spectra[name] = Spectrum(lines.frequency[kept].copy(), lines.amplitude[kept].copy(), lines.resolution)

    both = list(zip(stretches, cuts, strict=True))
    clean = ({name: _without(s.channels[name], s.step, gone, c) for name, gone in found.items()} for s, c in both)
    stretches = [replace(s, channels={**s.channels, **each}) for s, each in zip(stretches, clean, strict=True)]
    return stretches, cuts, Foreign(found, faintest, *others), spectra


def _cuts(stretches: list[Stretch], at: int, lines: Spectrum) -> list[Cut]:
    """The cycles of each stretch, all by the longest one's frequency; refuses a base that nothing drives."""
    longest = stretches[at]
    variance = float(np.var(longest.base))
    still = "analysis: no drive: the base stands still{}; expected a base motion: check its column, or is it a tap?"
    if not variance > 0.0:
        raise AnalysisError(still.format(""))
    tone, noise = spectrum.strongest_tone(lines), white_noise(longest.base)
    if 0.5 * tone.amplitude**2 < 0.2 * variance:
        if noise**2 > 0.5 * variance:
            raise AnalysisError(still.format(f" but for the sensor's noise of {1e6 * noise:.2g} um"))
        share = f"{50 * tone.amplitude**2 / variance:.2g} % of its power in {len(longest.base) * longest.step:.3g} s"
        raise AnalysisError(
            f"analysis: no drive: the strongest line of the base motion ({tone.frequency:.4g} Hz) holds {share};"
            " expected two cycles of a periodic base at least: shorten transient_s, check the base column, or fit a"
            " sweep whole (compare-numeric --fit whole)"
        )
    cut = cycles.cut(longest.base, tone.frequency * longest.step, noise=noise)
    cuts = [cut if s is longest else cycles.cut(s.base, cut.frequency, noise=noise) for s in stretches]
    if not any(len(c) for c in cuts):
        raise AnalysisError(
            f"analysis: expected at least one full cycle of the drive ({tone.frequency:.4g} Hz) after the transient;"
            f" got {len(longest.base) * longest.step:.3g} s: shorten transient_s or record longer"
        )
    if cut.frequency * cycles.FEWEST_SAMPLES > 1.0:
        got = f"got {1.0 / cut.frequency:.3g} ({cut.frequency / longest.step:.4g} Hz): sample faster"
        raise AnalysisError(f"analysis: expected at least {cycles.FEWEST_SAMPLES} samples a cycle of the drive; {got}")
    return cuts


def _without(signal: FloatArray, step: float, found: tuple[Line, ...], cut: Cut) -> FloatArray:
    """A channel (n,) without the lines to go, first in windows that part them from harmonics, then in short ones."""
    gone = [line for line in found if line.removed]
    for line in gone:
        signal = signal - line_in(signal, step, line, _window(line, cut.frequency / step))
    if gone and len(cut):
        own = signal - cycles.common(signal, cut)
        signal = signal - sum(line_in(own, step, line, SHORTEST_S) for line in gone)
    return signal


def _window(line: Line, drive: float) -> float:
    """Length of a window [s] that parts a line from the drive's harmonic next to it."""
    beside = abs(line.frequency - round(line.frequency / drive) * drive)
    return max(SHORTEST_S, 3.0 / max(beside, 1e-300))  # resolution cells


def _folded(signals: list[FloatArray], cuts: list[Cut], points: int, *, jumps: bool = False) -> FloatArray:
    """Cycles of all stretches; few samples of a cycle are interpolated without limit of band first, unless it jumps."""
    times = 1 if jumps else min(cycles.FINEST, math.ceil(cycles.SHARP * max(c.frequency for c in cuts)))
    if times > 1:
        signals = [cycles.finer(s, times) for s in signals]
    each = zip(signals, cuts, strict=True)
    rows = [cycles.fold(s, c.start * times, c.end * times, points, jumps=jumps) for s, c in each]
    return rows[0] if len(rows) == 1 else np.concatenate(rows)


def _drive(
    base: FloatArray, blocks: tuple[slice, ...], cut: Cut, step: float, sensor: Sensor
) -> tuple[Drive, FloatArray]:
    """The base motion from its mean cycle, and the slow wander (p,) that was taken off that."""
    white = math.hypot(sensor.slow(1.0 / cut.frequency), sensor.shared * math.sqrt(len(base)))
    points = base.shape[1]
    wander = slow_wander(base.mean(axis=1), points, blocks)[0]
    order = np.arange(1, HARMONICS + 1)
    angle = 2.0 * np.pi * np.arange(points) / points - 0.5 * np.pi  # rows start at the rise through zero
    mean = base.mean(axis=0) - wander
    lines = np.array([np.sum(mean * np.exp(-1j * k * angle)) for k in order]) * (2.0 / points)
    each = np.abs(cycles.first_harmonic(base, angle)) * (2.0 / points)
    n, amplitude, growth = len(base), float(abs(lines[0])), steadiness.growth(each)
    scatter = float(each.std(ddof=1)) / math.sqrt(n) if n > 2 else 0.0
    error = max(white * math.sqrt(2.0 * cut.frequency / n), scatter)
    drive = Drive(
        frequency=cut.frequency / step,
        frequency_se=cut.frequency_se / step if math.isfinite(cut.frequency_se) else None,
        amplitude=amplitude,
        amplitude_se=math.hypot(error, growth * amplitude * steadiness.OF_A_RAMP),
        harmonics=lines * np.exp(-1j * order * np.angle(lines[0])) / amplitude,
        wander=cut.wander,
        drifts=cut.drifts,
        growth=growth,
    )
    return drive, wander


def slow_wander(means: FloatArray, points: int, blocks: tuple[slice, ...], some: slice | None = None) -> FloatArray:
    """Slow wander of cycles ``some`` (n, points), or of their mean: straight from each one's middle to the next."""
    inside = (np.arange(points) + 0.5) / points - 0.5
    before, after = np.zeros(len(means)), np.zeros(len(means))
    for block in blocks:
        rise = np.diff(means[block])
        if len(rise):
            before[block], after[block] = np.concatenate([rise[:1], rise]), np.concatenate([rise, rise[-1:]])
    if some is None:
        return np.asarray(means.mean() + np.where(inside < 0, before.mean(), after.mean()) * inside)[None]
    return np.asarray(means[some, None] + np.where(inside < 0, before[some, None], after[some, None]) * inside)
