"""Whether a motion is steady: when it settled, whether it grows, drifts over a long test, or jumps.

How much one cycle differs from the next: the irregularity index of eq. (4.1), and what noise alone would give.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from frictionlab.analysis import cycles, spectrum
from frictionlab.analysis.signals import Stretch, line, variance_inflation, variance_of_mean, white_noise
from frictionlab.arrays import FloatArray, IntArray, runs
from frictionlab.uncertainty import Estimate

OF_A_RAMP = 1.0 / math.sqrt(12.0)  # rms of what changes steadily about its middle, over the whole change
STRAIGHT = 0.02  # of the variance of what drifts: what a line leaves
LONG_S = 300.0  # of steady cycles: so long a test has a trend of its own
MEMORY_S = 60.0  # no frame of a laboratory remembers its start for longer
SOFT = 0.05  # of a record: a soft start or stop that takes no more is part of the transient, and needs no word
SMALL, FULL = 0.5, 0.97  # of the drive's usual size: less at an end is a start or a stop, cut up to the second
OFF_ITS_MEAN, STEP, JUMP = 0.35, 0.02, 0.05  # of the base's rms; relative steps of drive and response that count
OTHER = 0.05  # of the drive's frequency: so far off, a part is another test
AS_A_DRIFT, CLEAR = 1.15, 5.0  # times the last part's change, and errors of it, from which a decay is seen
LEFT, HUMS = 5e-4, 4.0  # of the motion: less is no decay; times the noise's power where no frame follows: more is hum
FEWEST = 8  # cycles of which it can be seen when they settle, and that are worth to cut more than half for
INTERVAL_S = 10.0  # one cycle so often gives the trend of a long test (thesis 4.4.3)


def transient(parts: Sequence[Stretch], begin: float, natural: float | None = None) -> tuple[float, float | None]:
    """Until when to cut, and when the motion of a recording's parts has settled, s from ``begin``; None: it has not.

    Mass and base repeat from cycle to cycle then, or drift: cycles of all parts are compared on a coarse grid with the
    mean of the last quarter, of a long test with their own drift; medians of five, so that single irregular cycles are
    no transient. Half is cut at most, or what leaves eight cycles; what the last third alone repeats has not settled.
    Hum on harmonics that no frame of this natural frequency [Hz] follows is left out: it may drift past one.
    """
    longest = max(parts, key=lambda part: len(part.base), default=None)
    if longest is None or len(longest.base) < 64 or not float(np.ptp(longest.base)) > 0.0:
        return 0.0, 0.0
    later = spectrum.amplitude_spectrum(longest.base[len(longest.base) // 2 :], 1.0)
    frequency, noise = spectrum.strongest_tone(later).frequency, white_noise(longest.base)
    cuts = [cycles.cut(part.base, frequency, noise=noise) for part in parts]
    starts = np.concatenate([p.time + c.start * p.step for p, c in zip(parts, cuts, strict=True)]) - begin
    n, from_s = len(starts), parts[0].time - begin
    until_s = parts[-1].time + len(parts[-1].base) * parts[-1].step - begin
    if n < FEWEST:
        start = 0.0 if n < 4 else float(starts[1])
        return start, start
    window = n // 3
    if until_s - from_s >= LONG_S:
        window = min(window, max(FEWEST // 2, int(n * MEMORY_S / (until_s - from_s))))
    highest = math.ceil(max(spectrum.HIGH, 2.0 * (natural or 0.0) * longest.step / frequency))
    found = list[tuple[int, bool]]()
    for name in ("mass", "base"):
        signals = [getattr(part, name) for part in parts]
        rows = np.concatenate([cycles.fold(s, c.start, c.end, 64) for s, c in zip(signals, cuts, strict=True)])
        rows -= rows.mean()
        lines, rough = np.fft.rfft(rows, axis=1), white_noise(getattr(longest, name))
        late = lines[-(n // 2) :, highest + 1 :]
        if late.size and np.mean(np.abs(late - late.mean(axis=0)) ** 2) > HUMS * 64.0 * rough**2:
            lines[:, highest + 1 :] = 0.0
            rows = np.fft.irfft(lines, axis=1)
        found.append(_settled(rows, window, rough))
    latest, seen = max(first for first, _ in found), all(seen for _, seen in found)
    start = float(np.append(starts, math.inf)[latest]) if latest else max(from_s, 0.0)
    most = math.inf if seen and n - latest >= FEWEST else 0.5 * float(from_s + until_s)
    return min(most, start), start if seen else None


def driven(parts: Sequence[Stretch]) -> tuple[list[Stretch], list[str]]:
    """Parts of a recording from when the drive has its size until it loses it; what is said of that.

    Its size is that of the fundamental, as the longest part that moves shows it, in a window of one cycle. An end where
    it is small is cut where it is as large as in the cycles beside it, for it may drift; a pause of two cycles parts a
    recording; a part without it, or at another frequency, is left out.
    """
    moving = [part.base[_moving(part.base)] for part in parts]
    swing = max((float(np.std(base)) for base in moving), default=0.0)
    longest = max((base for base in moving if np.std(base) >= 0.1 * swing), key=len, default=np.zeros(0))
    if len(longest) < 64 or not swing > 0.0:
        return list(parts), []
    tone = spectrum.strongest_tone(spectrum.amplitude_spectrum(longest, 1.0, padding=1))
    if cycles.FEWEST_SAMPLES * tone.frequency > 1.0:  # refused by name where its cycles are laid out
        return list(parts), []
    stride = max(1, math.floor(1.0 / tone.frequency / 24.0))  # a motion of 24 points a cycle is enough
    period = round(1.0 / tone.frequency / stride)
    sizes = [_size_of_drive(base, tone.frequency, stride, period) for base in moving]
    if not any(map(len, sizes)) or 0.5 * tone.amplitude**2 < 0.2 * float(np.var(longest)):  # of its power: no cycles
        return list(parts), []
    least = SMALL * max(float(np.quantile(size, 0.75)) for size in sizes if len(size))
    pieces, said = list[Stretch](), list[str]()
    for part in parts:
        size = _size_of_drive(part.base, tone.frequency, stride, period)
        few = SOFT * len(size)
        found = full_runs(size, least, 8 * period, pause=period, still=0.1 * least) if len(size) else [(0, 0)]
        for first, last in found:
            ends = stride * first, stride * (last - 1 + period) if last < len(size) else len(part.base)
            pieces.append(part.part(*ends))
            from_s, until_s = (part.time + end * part.step for end in ends)
            said += [f"drive: it has its size from {from_s:.4g} s: the rest is left out"] * (first > few)
            said += [f"drive: it has its size until {until_s:.4g} s: the rest is left out"] * (last < len(size) - few)
        if not found:
            said.append(f"drive: the base does not follow it from {part.time:.4g} s on: that part is left out")
    if len(pieces) == 1:
        return pieces, said
    others = {i: hz for i, piece in enumerate(pieces) if (hz := _other_frequency(piece.base, tone.frequency))}
    for i, other in others.items():
        both = f"at {other / pieces[i].step:.4g} Hz, not at {tone.frequency / pieces[i].step:.4g} Hz"
        said.append(f"drive: from {pieces[i].time:.4g} s on it is {both}: that part is left out: measure it by itself")
    return [piece for i, piece in enumerate(pieces) if i not in others], said


def steps(parts: Sequence[Stretch]) -> tuple[list[str], list[str]]:
    """When the drive or the force on the contact changes suddenly and for good, and when the mass's motion does.

    From cycle to cycle of the base, which leaves its mean upward: that needs no frequency.
    """
    causes, answers = list[str](), list[str]()
    for part in (part for part in parts if not part.one_way):
        about = part.base - part.base.mean()
        level = OFF_ITS_MEAN * float(np.std(about))
        away = np.flatnonzero(np.abs(about) > level)
        rises = away[1:][np.diff(np.sign(about[away])) > 0.0]
        if len(rises) < 12:
            continue
        at = rises - (about[rises] - level) / (about[rises] - about[rises - 1])
        time, samples, rough = part.time + at * part.step, np.diff(at), 1e3 * white_noise(part.mass)
        few = float(np.median(samples))
        # a half swing of noisy samples is too large, and scatters
        base = 2e3 * np.abs(cycles.fundamentals(part.base, at[:-1], at[1:], cycles.points_per_cycle(few)))
        mass = 500.0 * (np.maximum.reduceat(part.mass, rises) - np.minimum.reduceat(part.mass, rises))[:-1]
        force, mean = (
            np.add.reduceat(each, rises)[:-1] / np.diff(rises)
            for each in (part.channels.get("normal_force", np.zeros(len(about))), part.mass)
        )
        size, of_noise = float(np.median(mass)), 1e3 * white_noise(part.base) * math.sqrt(2.0 / few)
        exact = math.hypot(0.1 / few, of_noise / float(np.median(base)))
        for said, name, series, usual, unit, noise, least in (
            (causes, "drive_frequency_hz: the drive's frequency", 1.0 / (samples * part.step), 0.0, "Hz", exact, STEP),
            (causes, "base_amplitude_m: the base's amplitude", base, 0.0, "mm", exact, STEP),
            (causes, "normal_force_n: the normal force", force, 0.0, "N", exact, STEP),
            (answers, "response_amplitude: the amplitude of the response", mass, size, "mm", rough, JUMP),
            (answers, "response_amplitude: the mean position of the response", 1e3 * mean, size, "mm", rough, JUMP),
        ):
            over = usual or abs(float(np.median(series)))
            first = jumps(series / over, noise=noise / (usual or 1.0), least=least).tolist() if over else []
            if first:
                levels = [float(np.median(series[a:b])) for a, b in pairwise([0, *first, len(series)])]
                digits = 1 - math.floor(math.log10(float(np.abs(np.diff(levels)).min()) or 1.0))  # that show each step
                begin, *then = (f"{round(level, digits):g}" for level in levels)
                to = ", to ".join(f"{level} at {t:.4g} s" for level, t in zip(then, time[first], strict=True))
                said.append(f"{name} goes from {begin} to {to} ({unit}): cut the log there")
    return causes, answers


def _other_frequency(base: FloatArray, frequency: float) -> float | None:
    """The frequency of a base (n,), where it is clearly another than this one; both in cycles per sample."""
    if len(base) * frequency < 4.0:
        return None
    own = spectrum.strongest_tone(spectrum.amplitude_spectrum(base, 1.0, padding=1)).frequency
    return own if abs(own - frequency) > OTHER * frequency + 1.0 / len(base) else None


def _moving(signal: FloatArray) -> slice:
    """From the first to the last twentieth of a signal (n,) that moves a quarter as far as one of them."""
    edges = np.linspace(0, len(signal), 21 if len(signal) > 1280 else 2).astype(np.intp)
    some = (signal[a : b : max(1, (b - a) // 1000)] for a, b in pairwise(edges.tolist()))
    swings = [float(np.ptp(np.quantile(each, (0.05, 0.95)))) if len(each) else 0.0 for each in some]  # without spikes
    moves = np.flatnonzero(np.array(swings) >= 0.25 * max(swings))
    return slice(int(edges[moves[0]]), int(edges[moves[-1] + 1]))


def _size_of_drive(base: FloatArray, frequency: float, stride: int, period: int) -> FloatArray:
    """Size (n,) of the fundamental in windows of one cycle, one from each ``stride`` samples on."""
    place = np.arange(0, len(base), stride)
    total = np.cumsum((base[::stride] - base.mean()) * np.exp(-2j * math.pi * frequency * place))
    return np.asarray(np.abs(total[period:] - total[:-period]))


def full_runs(size: FloatArray, low: float, near: int, *, pause: float, still: float) -> list[tuple[int, int]]:
    """First and past-last of the sizes (n,) of what starts, stops and pauses: what is ``low`` is none of them.

    Between, only what is low for longer than ``pause`` and falls below ``still``; a start is over, and a stop begins,
    where a size is as large as ``near`` many beside it.
    """
    n, found = len(size), list[tuple[int, int]]()

    def full(size: FloatArray, at: int) -> int:
        while at < n - 1 and size[at] < FULL * float(np.median(size[at : at + near])):
            at += 1
        return at

    slow = np.transpose(runs(size < low)).tolist()
    rests = [(a, b) for a, b in slow if a == 0 or b == n or (b - a > pause and float(size[a:b].min()) < still)]
    edges = [0, *(edge for rest in rests for edge in rest), n]
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        first, last = full(size, a) if a else 0, n - full(size[::-1], n - b) if b < n else n
        found += [(first, last)] if first < last else []
    return found


def _settled(rows: FloatArray, window: int, noise: float) -> tuple[int, bool]:
    """The first of the cycles (n, p) from which on they repeat, n: none does; whether that has been seen.

    A transient does not outlast three windows; what goes on for more is a drift: a cycle is compared with the line
    through the second and third window after it. From the first one on the three windows, or thirds, must not show a
    decay (a drift is as strong in the last): summed over all cycles it is seen long after single cycles hide it.
    """
    n, far = len(rows), 3 * window
    tail = rows[-max(4, n // 4) :]
    final, squares = tail.mean(axis=0), list[FloatArray]()
    size = max(float(final.std()), 1e-300)
    sums = np.cumsum(np.pad(rows, ((1, 0), (0, 0))), axis=0) if n > far + 2 else None
    for some in cycles.chunks(*rows.shape):
        if sums is not None:
            cycle = np.arange(n)[some]
            at = np.minimum(cycle, n - far)
            second, third = ((sums[at + k * window] - sums[at + (k - 1) * window]) / window for k in (2, 3))
            final = second + (second - third) * ((at - cycle) / window + 1.5)[:, None]
        squares.append(np.mean((rows[some] - final) ** 2, axis=1))
    away = np.sqrt(np.concatenate(squares)) / size  # rms distance of each cycle from the final one
    limit = max(3.0 * float(np.median(away[-len(tail) :])), 6.0 * noise / size, 0.005)
    usual = np.median(np.lib.stride_tricks.sliding_window_view(np.pad(away, 2, mode="edge"), 5), axis=1)
    outside = (usual > limit).astype(np.float64)
    share = np.cumsum(outside[::-1])[::-1] / np.arange(n, 0, -1)  # of the cycles from each on
    settled = np.flatnonzero((share <= 0.02) & (outside == 0.0))  # of the cycles after it may be farther off
    first = repeats = int(settled[0]) if len(settled) else n
    while (length := min(window, (n - first) // 3)) >= 4:
        three = rows[first : first + 3 * length].reshape(3, length, -1)
        change = three[0].mean(axis=0) - three[2].mean(axis=0)
        along = three @ (change / max(float(np.linalg.norm(change)), 1e-300))
        early, late = -np.diff(along.mean(axis=1))
        error = math.sqrt(variance_of_mean(line(np.arange(length, dtype=np.float64), along[2])[1]))
        if float(change.std()) < LEFT * size or early - AS_A_DRIFT * late < CLEAR * error:
            break
        first += max(1, length // 16)
    return first, 3 * repeats <= 2 * n and (first == repeats or length >= 4)


def growth(series: FloatArray, *, least: float = 1e-3) -> float:
    """Relative change of a positive per-cycle series (n,) from its first to its last cycle along a straight line.

    0 where the line is not clear (eight standard errors, a half of the variance), the change less than ``least``, or
    the cycles fewer than 12.
    """
    n = len(series)
    if n < 12 or not float(series.mean()) > 0.0:
        return 0.0
    slope, left, spread = line(np.arange(n, dtype=np.float64), series)
    error = math.sqrt(float(np.dot(left, left)) / (n - 2) / spread)
    change = slope * (n - 1) / float(series.mean())
    clear = abs(slope) > 8.0 * error and float(np.var(left)) < 0.5 * float(np.var(series))
    return change if clear and abs(change) > least else 0.0


def drift(means: FloatArray) -> float:
    """How far the means of cycles (n,) move from the first to the last, where they follow a straight line; else 0."""
    slope, left, _ = line(np.arange(len(means), dtype=np.float64), means)
    return slope * (len(means) - 1) if float(np.var(left)) < STRAIGHT * float(np.var(means)) else 0.0


def jumps(series: FloatArray, *, noise: float, width: int = 5, least: float = JUMP) -> IntArray:
    """First cycles (m,) after sudden lasting changes in a per-cycle series (n,).

    A jump is a difference between the medians of ``width`` cycles on either side of more than ``least``, eight times
    the scatter within them, and eight times the sensor's noise.
    """
    if len(series) < 2 * width:
        return np.zeros(0, dtype=np.intp)
    windows = np.lib.stride_tricks.sliding_window_view(series, width)
    middle = np.median(windows, axis=1)
    spread = np.median(np.abs(windows - middle[:, None]), axis=1) / 0.6745
    within = np.maximum(np.maximum(spread[width:], spread[:-width]), noise)
    begin, end = runs(np.abs(middle[width:] - middle[:-width]) > np.maximum(8.0 * within, least))
    mean = windows.mean(axis=1)
    sharp = np.abs(mean[width:] - mean[:-width])  # medians say whether, means say where
    return np.array([b + int(np.argmax(sharp[b:e])) for b, e in zip(begin, end, strict=True)], dtype=np.intp) + width


@dataclass(frozen=True)
class Trend:
    """A straight line through a quantity over time.

    ``time`` (n,) s and ``value`` (n,): the points; ``slope`` per second, its standard error ``slope_se``, its 95 %
    confidence interval ``low`` to ``high``; ``level``: the line at the middle of the test.
    """

    time: FloatArray
    value: FloatArray
    slope: float
    slope_se: float
    low: float
    high: float
    level: float

    @property
    def jumps(self) -> FloatArray:
        """When the quantity jumps [s]: over that a line says nothing."""
        return self.time[jumps(self.value / self.level, noise=0.0)]


def linear_trend(time: FloatArray, value: FloatArray) -> Trend | None:
    """Least-squares line with its confidence; autocorrelated residuals widen it (None for fewer than six points).

    Its degrees of freedom are those of as many independent points, or one in two of the times that the residual changes
    its sign: one slow wander seen through many times is better known than its length says.
    """
    from scipy.special import stdtrit  # noqa: PLC0415 - a tenth of a second that only long tests need

    n = len(time)
    if n < 6:
        return None
    slope, left, spread = line(time, value)
    inflation = max(float(variance_inflation(left[:, None])[0]), 1.0)
    error = math.sqrt(float(np.dot(left, left)) / (n - 2) / spread * inflation)
    freedom = max(n / inflation - 2.0, 0.5 * np.count_nonzero(np.diff(left > 0.0)) - 1.0, 1.0)
    reach = float(stdtrit(freedom, 0.975)) * error
    return Trend(time, value, slope, error, slope - reach, slope + reach, float(value.mean()))


def trend_of(time: FloatArray, value: FloatArray) -> Trend | None:
    """The trend of a per-cycle series (n,) by its cycles' starts [s]: of the first cycle after each `INTERVAL_S`."""
    ticks = np.arange(time[0], time[-1] + 1e-9, INTERVAL_S)
    chosen = np.unique(np.searchsorted(time, ticks - 1e-9))
    chosen = chosen[chosen < len(time)]
    return linear_trend(time[chosen], value[chosen])


def irregularity_index(rows: FloatArray, blocks: tuple[slice, ...] = (slice(None),)) -> float | None:
    """Irregularity index, eq. (4.1): mean over cycles of sum |x_{j+1,i} - x_{j,i}| / sum |x_{j,i}|.

    ``rows`` (N_cyc, N_p): one cycle a row, about the mean of the whole signal; ``blocks``: rows that follow each other
    without a gap. None for fewer than two cycles, or a signal that does not move.
    """
    size = _row_sums(rows)
    pairs = np.concatenate([np.arange(len(rows))[block][:-1] for block in blocks])
    if not len(pairs) or not size[pairs].all():
        return None
    change = [np.abs(rows[pairs[some] + 1] - rows[pairs[some]]).sum(axis=1) for some in cycles.chunks(*rows.shape)]
    return float((np.concatenate(change) / size[pairs]).mean())


def _row_sums(rows: FloatArray) -> FloatArray:
    return np.concatenate([np.abs(rows[some]).sum(axis=1) for some in cycles.chunks(*rows.shape)])


def irregularity_floor(rows: FloatArray, noise: float) -> float | None:
    """Index that white noise of this rms at each point of a row would give a motion that repeats exactly.

    The difference of two noisy points is Gaussian with sqrt(2) the rms; its mean modulus is 2 noise / sqrt(pi).
    ``rows`` (N_cyc, N_p): one cycle a row, about the mean of the whole signal.
    """
    size = float(np.mean(_row_sums(rows))) / rows.shape[1]
    return 2.0 * noise / math.sqrt(math.pi) / size if size > 0.0 else None


def mean_over(values: FloatArray, used: slice, *, noise: float = 0.0, shared: float = 0.0) -> Estimate:
    """Mean of a per-cycle series (n,) over the cycles used, with its standard error; a steady drift is no scatter.

    ``noise``: standard error of one value from sensor noise alone, below which none is stated (0: not known, and then
    fewer than three cycles have no error); ``shared``: what all cycles have in common.
    """
    part, n, drift = values[used], len(values), growth(values)
    mean = float(part.mean())
    # a few cycles take the scatter of all, about the line of a drift; what leaves much of the variance is a step
    level = values - drift * float(values.mean()) * np.linspace(-0.5, 0.5, n)
    some = part if len(part) >= 8 else level if level.var() < 0.1 * values.var() else values
    if len(some) <= 2 and not noise:
        return Estimate(mean)
    drift *= (len(part) - 1) / max(n - 1, 1)  # within the cycles used
    square = noise * noise / len(part)
    if len(some) > 2 and float(some.var(ddof=1)) > noise * noise * (1.0 + 2.0 * math.sqrt(2.0 / (len(some) - 1))):
        alone = float(some.var(ddof=1)) / len(part)
        square = max(alone if len(part) == 1 else variance_of_mean(some) * len(some) / len(part), square)
    return Estimate(mean, math.hypot(math.sqrt(square), shared, OF_A_RAMP * drift * mean))
