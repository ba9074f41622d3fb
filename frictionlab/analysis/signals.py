"""Samples on an even clock, the noise and the step of their sensor, and the autocorrelation of cycles.

Autocorrelation says by how much the mean of a few is less certain than their scatter says.

Cycles are cut where the base rises, friction changes anywhere: with a share s of what a change does before the cut and
1 - s after it, a value of one cycle is ``(1 - s) f[k] + s f[k+1]`` (a parameter that friction moves to and fro has a
share beyond 0 and 1: neighbours are anticorrelated). Friction itself may wander, ``f[k+1] = phi f[k] + ...``. That is a
moving average of an autoregression, ARMA(1, 1): its likelihood is exact and cheap for any number of cycles
(innovations, Brockwell and Davis 1991, section 5.3), so s and phi are averaged over, each pair weighted by its
posterior probability. It is the one rule of the package: means, slopes, fits and campaigns use it, times `student`.

Rms of error over stated error of means of 10, 30, 100 values (300 series each): 1.0, 0.94, 0.97 where friction changes
in mid-cycle; a lag-one correlation gives 1.7, 0.96, 0.81. A steady drift is no noise: `steadiness.growth` finds it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from frictionlab.arrays import FloatArray, jump_in
from frictionlab.errors import AnalysisError

BY_TWO = "_by_two"
EVEN = 0.02  # of a step: stamps that stray no further from an even clock are even


class Second(NamedTuple):
    """A second sensor of one place (`channels.by_two_sensors`): penalty of its noise, of which rate of displacement."""

    penalty: float
    times: int

    @property
    def alone(self) -> bool:
        """Whether it is the only one, integrated (a penalty without end): slower noise is then larger."""
        return self.penalty == math.inf


@dataclass(frozen=True)
class Stretch:
    """Uninterrupted samples: ``time`` of the first [s], ``step`` [s], channels (n,) by their names, evenly spaced.

    ``mass`` and ``base`` [m] are always among them, ``mass`` and ``base`` + `BY_TWO` where two sensors show them, with
    what the ``seconds`` do to their noise; ``one_way``: the motion is one way, folded (`stretches`).
    """

    time: float
    step: float
    channels: Mapping[str, FloatArray]
    one_way: bool = False
    seconds: Mapping[str, Second] = field(default_factory=dict)

    @property
    def mass(self) -> FloatArray:
        """Displacement of the mass (n,) m."""
        return self.channels["mass"]

    @property
    def base(self) -> FloatArray:
        """Displacement of the base (n,) m."""
        return self.channels["base"]

    def part(self, first: int, last: int) -> "Stretch":
        """The samples from one number up to another, not included."""
        some = {name: values[first:last] for name, values in self.channels.items()}
        return replace(self, time=self.time + first * self.step, channels=some)

    def after(self, time: float) -> "Stretch":
        """The part from a time on; empty if there is none."""
        passed = min((time - self.time) / self.step, float(len(self.mass)))
        return self.part(min(max(0, math.ceil(passed - 1e-6)), len(self.mass)), len(self.mass))


def stray(time: FloatArray, step: float) -> float:
    """How far stamps (n,) stray from an even clock that starts with them, in steps."""
    off = time - time[0]
    off -= step * np.arange(len(time))
    return float(np.max(np.abs(off, out=off))) / step


def evenly(time: FloatArray, step: float, signals: Mapping[str, FloatArray]) -> tuple[Mapping[str, FloatArray], float]:
    """Signals (n,) of stamps [s] on an even clock, and how far the stamps strayed from it (0: nothing was changed).

    Stamps within 2 % of a step of an even clock count as even, and so do stamps that are merely written coarsely (few
    different steps, none missing). Anything else is interpolated by a cubic spline (a straight line takes 1 to 4 % of a
    motion of 10 samples a cycle, the spline less than 0.1 %), across missing samples by a straight line. Of stamps that
    nearly coincide the first counts. `AnalysisError`: The stamps jump so far that even steps would fill the memory.
    """
    off = stray(time, step)
    if off < EVEN or (off < 1.0 and len(np.unique(np.rint(np.diff(time) / (1e-3 * step)))) <= 4):
        return signals, 0.0
    if jump := jump_in(time, step):
        raise AnalysisError(f"{jump}: ingest the log again, which flags it, or cut it there")
    even, passed = np.arange(time[0], time[-1] + 1e-9 * step, step), time - time[0]
    strays = float(np.max(np.abs(passed - step * np.rint(passed / step)))) / step
    from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - half a second that only stray stamps need

    apart = np.flatnonzero(np.diff(time, prepend=-math.inf) > 0.2 * step)  # nearer, noise makes a spline swing
    measured = np.stack([values[apart] for values in signals.values()], axis=1)
    spline = make_interp_spline(time[apart], measured, k=min(3, len(apart) - 1))
    rows, next_one = np.ascontiguousarray(spline(even).T), np.searchsorted(time, even).clip(1, len(time) - 1)
    hole = time[next_one] - time[next_one - 1] > 2.5 * step  # farther, a motion does
    for row, values in zip(rows, signals.values(), strict=True):
        row[hole] = np.interp(even[hole], time, values)
    return dict(zip(signals, rows, strict=True)), max(strays, EVEN)


# The sensor ----------------------------------------------------------------------------------------------------------

_ORDER = 6
_GAIN = math.comb(2 * _ORDER, _ORDER)  # variance of the 6th difference of unit white noise
INTEGRATED = {1: 2.6215, 2: 6.5258}
"""Rms of a rate's white noise, times step^rate, over what sixth differences of the integral show: the mean over angles
w of ``(2 sin(w / 2))^12 / w^(2 rate)``, under 924."""
_BLOCK = 64
# of a block's mean power: chi-squared with the block's effective degrees of freedom [Wilson and Hilferty 1931]
_SQUARES = [(1.0 - k / _BLOCK) * (math.comb(2 * _ORDER, _ORDER + k) / _GAIN) ** 2 for k in range(1, _ORDER + 1)]
_MEDIAN_OVER_MEAN = (1.0 - 2.0 / (9.0 * _BLOCK / (1.0 + 2.0 * math.fsum(_SQUARES)))) ** 3


def white_noise(signal: FloatArray) -> float:
    """Rms of the white noise in a smooth signal (n,), n >= 16, quantisation included, from its sixth differences.

    A sinusoid of period P samples leaves (2 pi / P)^6 of its amplitude in them: nothing at 60 samples a period. The
    median over blocks keeps shocks and kinks out.
    """
    power = np.diff(signal, _ORDER) ** 2
    blocks = len(power) // _BLOCK
    if blocks < 8:
        return math.sqrt(float(power.mean()) / _GAIN)
    means = power[: blocks * _BLOCK].reshape(blocks, _BLOCK).mean(axis=1)
    return math.sqrt(float(np.median(means)) / _MEDIAN_OVER_MEAN / _GAIN)


def sensor_step(signal: FloatArray) -> float:
    """Smallest step of a sensor's values, rounding in the text merged; 0 when they are not quantised."""
    some = signal  # else blocks from all of it: a record may begin at rest
    if len(signal) > 20_000:
        some = np.concatenate([signal[k : k + 1000] for k in np.linspace(0, len(signal) - 1000, 20).astype(np.intp)])
    levels = np.unique(some)
    if len(levels) < 2 or len(levels) > 0.9 * len(some):
        return 0.0
    gaps = np.diff(levels)
    real = gaps[gaps > 0.1 * np.median(gaps)]
    return float(np.round(np.percentile(real, 10), 12))


@dataclass(frozen=True)
class Sensor:
    """What a sensor adds to a channel, in the channel's unit.

    ``noise``: rms of its white noise; ``step``: smallest step of its values (0: not quantised); ``rounding``: rms of
    the rounding that no mean takes away; ``shared``: the same as white noise over a cycle; ``second``: where another
    sensor helps it.
    """

    noise: float
    step: float
    rounding: float = 0.0
    shared: float = 0.0
    second: Second | None = None

    @property
    def is_stepped(self) -> bool:
        """Whether noise of less than a fifth of a step leaves the steps to be seen."""
        return self.rounding > 0.1 * self.step

    def left(self, samples: float, order: FloatArray) -> FloatArray:
        """Share of the noise's power that is left at harmonics (n,) of a cycle of so many samples."""
        if self.second is None:
            return np.ones(len(order))
        angle = math.pi * order / samples
        if self.second.alone:  # an offset is gone
            return np.asarray((2.0 * np.where(order > 0.0, angle, math.pi / samples)) ** (-2 * self.second.times))
        bend = (2.0 * np.sin(np.minimum(angle, 0.5 * math.pi))) ** (2 * self.second.times)
        return np.asarray(1.0 / (1.0 + self.second.penalty * bend))

    def by_second(self, samples: float) -> float:
        """Share of the second sensor in what is shown at the drive."""
        return 1.0 if self.second and self.second.alone else 1.0 - float(self.left(samples, np.ones(1))[0])

    def slow(self, samples: float) -> float:
        """Rms of white noise that is as large as what is left at the drive."""
        return self.noise * math.sqrt(float(self.left(samples, np.ones(1))[0]))

    @classmethod
    def of(cls, signal: FloatArray, stroke: float, samples: float, second: Second | None = None) -> "Sensor":
        """Of a channel (n,), the stroke of its mean cycle, and the samples a cycle has.

        Noise of rms s before rounding leaves ``step exp(-2 pi^2 s^2 / step^2) / (sqrt(2) pi)`` of it in a mean of many
        values of one place [Widrow and Kollar 2008, ch. 5]. Rounding follows the place: where a cycle passes fewer
        levels than it has samples, it is spread over fewer points and disturbs the low harmonics more.
        """
        noise, step = white_noise(signal), sensor_step(signal)
        if second and second.alone:
            return cls(noise * INTEGRATED[second.times], 0.0, second=second)
        if not step > 0.0:
            return cls(noise, step, second=second)
        variance = max((noise / step) ** 2 - 1.0 / 12.0, 0.0)  # before rounding, in steps
        rounding = step / (math.sqrt(2.0) * math.pi) * math.exp(-2.0 * math.pi**2 * variance)
        shared = rounding * math.sqrt(samples / min(samples, max(stroke / step, 1.0)))
        return cls(noise, step, rounding, shared, second)

    def over(self, unit: float) -> "Sensor":
        """The same in another unit."""
        return Sensor(self.noise / unit, self.step / unit, self.rounding / unit, self.shared / unit, self.second)

    def beside(self, other: "Sensor") -> "Sensor":
        """What a difference of two channels has of both, at most."""
        noise, shared = math.hypot(self.noise, other.noise), math.hypot(self.shared, other.shared)
        return replace(self, noise=noise, shared=shared, second=None)


# Autocorrelation -----------------------------------------------------------------------------------------------------

SHARES = {-2.0: 0.03, -0.6: 0.03, -0.3: 0.03, -0.15: 0.03} | dict.fromkeys((0.0, 0.1, 0.2, 0.3, 0.4, 0.5), 0.88 / 6)
WANDERS = {0.0: 0.74, 0.3: 0.05, 0.6: 0.05, 0.8: 0.04, 0.9: 0.04, 0.95: 0.04, 0.98: 0.02, 0.995: 0.02}
"""phi -> prior probability; the last is friction that wanders over 200 cycles."""
ROUNDING = 1e-12  # of the largest value: what scatters by less does not scatter

# all pairs of a share and a wander (c, 1): correlation rho of neighbours, of a series and of what phi leaves of it
_SHARE, _PHI = (side.reshape(-1, 1) for side in np.meshgrid(list(SHARES), list(WANDERS)))
_LOG_PRIOR = np.log(np.outer(list(WANDERS.values()), list(SHARES.values()))).reshape(-1, 1)
_SAME, _CROSS = _SHARE**2 + (1.0 - _SHARE) ** 2, _SHARE * (1.0 - _SHARE)
_RHO = (_SAME * _PHI + _CROSS * (1.0 + _PHI**2)) / (_SAME + 2.0 * _CROSS * _PHI)
_LEFT = 1.0 + _PHI**2 - 2.0 * _PHI * _RHO  # variance of x[k] - phi x[k-1] ...
_ALIKE = _RHO - _PHI  # ... and its covariance with the next one


def pair_variances(n: int) -> FloatArray:
    """Variance (c, 1) of the mean of n values of unit variance, for each pair of share and wander."""
    apart = np.arange(1, n)
    return np.asarray((n + 2.0 * ((n - apart) * _PHI ** (apart - 1) * _RHO).sum(axis=1)[:, None]) / n**2)


def pair_squares(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sum of squares (c, m) of series (n, m) about their likeliest mean, and log likelihood of the rest (c, 1).

    Each value is predicted from those before it; what is left, over its deviation, is white. One for each pair.
    """
    series = np.concatenate([values - values.mean(axis=0), np.ones((len(values), 1))], axis=1)
    variance, error = np.ones_like(_PHI), np.repeat(series[:1], len(_PHI), axis=0)
    square, cross, log_size = error**2, error * error[:, -1:], np.zeros_like(_PHI)
    for before, now in pairwise(series):
        share = _ALIKE / variance
        variance = _LEFT - _ALIKE * share
        error = now - _PHI * before - share * error
        weighed = error / variance
        square += error * weighed
        cross += weighed * error[:, -1:]
        log_size -= 0.5 * np.log(variance)
    whole = cross[:, -1:]
    return np.asarray((square - cross**2 / whole)[:, :-1]), np.asarray(log_size - 0.5 * np.log(whole))


def variance_inflation(series: FloatArray) -> FloatArray:
    """Return the variance of each mean over (variance of the values / their number): 1 for independent values.

    Geometric mean over all pairs of share and wander, weighted by their posterior. That the scatter itself is known
    from few values is not in it: multiply by `student`.

    Parameters
    ----------
    series : ndarray of shape (n, m)
        m series of n values, n at least 2.

    Examples
    --------
    >>> draws = np.random.default_rng(1).standard_normal((201, 1))
    >>> sums, steps = draws[1:] + draws[:-1], draws[1:] - draws[:-1]
    >>> np.round([float(variance_inflation(some)[0]) for some in (draws, sums, steps)], 1)
    array([0.8, 2.2, 0.1])
    >>> few = np.array([1.0, 0.9, -0.2, -0.8, -0.7, -0.1, 0.2, -0.3])
    >>> round(float(variance_inflation(few[:, None])[0]) * student(7.0), 1)
    7.4
    """
    n = len(series)
    scatter = series.var(axis=0, ddof=1)
    varied = scatter > (ROUNDING * np.abs(series).max(axis=0)) ** 2
    square, log_weight = pair_squares(np.where(varied, series, np.arange(n)[:, None] % 2))
    log_weight = log_weight + _LOG_PRIOR - 0.5 * (n - 1.0) * np.log(square)
    weight = np.exp(log_weight - log_weight.max(axis=0))
    log_variance = np.log(square / (n - 1.0) * pair_variances(n))
    found = np.exp((weight * log_variance).sum(axis=0) / weight.sum(axis=0))
    return np.where(varied, found * n / np.where(varied, scatter, 1.0), 1.0)


def student(freedom: float) -> float:
    """Variance of Student's t over the normal distribution's: a scatter from few values is itself uncertain."""
    return freedom / max(freedom - 2.0, 0.5)


def variance_of_mean(values: FloatArray) -> float:
    """Variance of the mean of a series (n,), n > 2, its autocorrelation and its length accounted for."""
    n = len(values)
    return float(values.var(ddof=1)) / n * float(variance_inflation(values[:, None])[0]) * student(n - 1.0)


def line(at: FloatArray, value: FloatArray) -> tuple[float, FloatArray, float]:
    """Least-squares line through values (n,): its slope, what it leaves (n,), and the sum of squares of ``at``."""
    u = at - at.mean()
    spread = float(np.dot(u, u))
    slope = float(np.dot(u, value)) / spread if spread > 0.0 else 0.0
    return slope, value - value.mean() - slope * u, spread
