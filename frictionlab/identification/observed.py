"""What was observed: the mean cycle as harmonics, and how sure it is, by the scatter of the cycles themselves.

The noise of a fit is not the sensor's: friction differs a little from cycle to cycle, and then all harmonics move
together. So the covariance comes from the cycles, shrunk towards a smooth diagonal (there are fewer cycles than
harmonics) [Schäfer and Strimmer 2005], and is never below the sensor's white noise.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from frictionlab.analysis.measurement import Measurement

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

FEWEST_CYCLES = 3  # below so many the cycles say nothing of their own scatter
MOST_HARMONICS = 128
EXPLAINED = 2.0  # misfit up to which a law explains a cycle: the cycles' own scatter is known to a factor of 2 at most
FEW = 3.0  # over the number of cycles: the share of the mean variance below which no variance is known
HALVES = 2
PARTS = 8  # that the cycles are left out in, one after the other, to see how far each is from what the others say
POINTS = 4.0  # of a cycle for each harmonic: with fewer, interpolation takes part of it away
MOST, PROVEN = 0.95, 12  # correlation of neighbouring cycles, and how many tell one
ROUNDING = 1e-6  # of the response: interpolation between samples is no better


@dataclass(frozen=True)
class Observed:
    """A measured mean cycle, about its mean, and its covariance.

    Parameters
    ----------
    cosine_sine : ndarray of shape (2 K,)
        Cosine parts of harmonics 1 to K of x/Y, then the sine parts.
    each : ndarray of shape (n, 2 K)
        The same of single steady cycles.
    covariance : ndarray of shape (2 K, 2 K)
        Of the mean cycle.
    sensor : float
        Variance of one part of the mean cycle from the sensor's white noise alone.
    used : int
        Cycles that the mean is of.
    freedom : float
        Cycles that the scatter is known from, less one; infinite where it is the sensor's alone.
    power : float
        Mean square of the measured mean cycle.
    beyond : float
        Mean square of the sensor's noise in the harmonics that are not kept.
    of_base : ndarray of shape (2 K, 2 K)
        The part of the covariance that all cycles share: the base's noise.
    raised : float
        By how much neighbours that hang together raise the covariance of the mean.
    kept : ndarray of shape (K,), or 1
        How much of each harmonic the mass's filter leaves of a motion.
    """

    cosine_sine: FloatArray
    each: FloatArray
    covariance: FloatArray
    sensor: float
    used: int
    freedom: float
    power: float
    beyond: float
    of_base: FloatArray
    raised: float = 1.0
    kept: FloatArray | float = 1.0

    @property
    def harmonics(self) -> int:
        """Number of harmonics kept."""
        return len(self.cosine_sine) // 2

    @cached_property
    def whitener(self) -> FloatArray:
        """Matrix (2 K, 2 K) that makes the noise of the mean cycle independent with unit variance."""
        return np.asarray(np.linalg.inv(np.linalg.cholesky(self.covariance)))

    @cached_property
    def left_out(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Parts of the cycles about their mean (m, 2 K), each with the covariance of the mean by all others.

        A weight that is found from some cycles lets those scatter too little: this is how the others see them. Nothing
        where the cycles are too few to tell their own scatter.
        """
        return self.by_others(PARTS)

    @cached_property
    def weighed(self) -> FloatArray:
        """Single cycles about their mean (n, 2 K), each half over the covariance of the mean by the other half.

        Nothing (0, 2 K) where they are too few to tell their own scatter.
        """
        parts = [np.linalg.solve(covariance, part.T).T for part, covariance in self.by_others(HALVES)]
        return np.concatenate(parts) if parts else np.zeros((0, 2 * self.harmonics))

    def by_others(self, parts: int) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """As `left_out`, in so many parts."""
        n, about = len(self.each), self.each - self.each.mean(axis=0)
        if n < FEWEST_CYCLES + 1 or not math.isfinite(self.freedom):
            return ()
        rows = np.array_split(np.arange(n), min(n, parts))
        least = self.sensor * self.used + 2.0 * ROUNDING**2 * self.power / self.harmonics
        others = (np.delete(self.each, part, axis=0) for part in rows)
        return tuple(
            (about[part], shrunk(rest, least) * (self.raised / self.used) + self.of_base)
            for part, rest in zip(rows, others, strict=True)
        )

    @property
    def floor(self) -> float:
        """Standard error of the mean cycle over its rms: what no model can undercut."""
        return math.sqrt((0.5 * float(np.trace(self.covariance)) + self.beyond) / self.power)

    def nrmse(self, gap: FloatArray) -> float:
        """Rms of a misfit (2 K,) over the rms of the measured mean cycle."""
        return math.sqrt(0.5 * float(gap @ gap) / self.power)


def parts(coefficients: ComplexArray) -> FloatArray:
    """Cosine and sine parts (..., 2 K) of complex harmonics (..., K)."""
    return np.concatenate([coefficients.real, -coefficients.imag], axis=-1)


def harmonics_of(cycle: FloatArray, count: int) -> ComplexArray:
    """Complex amplitudes of harmonics 1 to count of a cycle on equally spaced phases from 0, over the last axis."""
    return np.asarray(np.fft.rfft(cycle, axis=-1)[..., 1 : count + 1] * (2.0 / cycle.shape[-1]))


def observe_cycle(measurement: Measurement, *, every: bool = False) -> Observed:
    """Return the measured mean cycle with the covariance that its steady cycles show.

    ``every``: the mean of all steady cycles, not of those that the energy rule takes.
    """
    cycle = measurement.cycle
    each = cycle.each
    points = min(measurement.sampling_rate_hz / measurement.drive_frequency_hz, len(measurement.cycle.tau))
    count = min(each.shape[1], harmonics_told(measurement.frequency_ratio or 1.0, points))
    single = parts(each[:, :count])
    mean = single.mean(axis=0) if every else parts(harmonics_of(cycle.mass, count))
    used = len(single) if every else max(1, int(measurement.series.used.sum()))
    power = float(np.mean(cycle.mass**2))
    samples = measurement.sampling_rate_hz / measurement.drive_frequency_hz
    sensor = 2.0 * (measurement.mass_noise_m / measurement.base_amplitude_m) ** 2 / samples
    least = sensor + 2.0 * ROUNDING**2 * power / count
    beyond = sensor / used * max(0.0, 0.5 * samples - count)
    if len(single) < FEWEST_CYCLES:
        covariance, raised, freedom = np.eye(2 * count) * least / used, 1.0, math.inf
    else:
        covariance, raised = of_mean(single, least, used)
        freedom = float(len(single) - 1)
    of_base = by_base(mean, measurement.base_amplitude_m_se / measurement.base_amplitude_m)
    return Observed(
        mean,
        single,
        covariance + of_base,
        sensor / used,
        used,
        freedom,
        power,
        beyond,
        of_base,
        raised,
        cycle.kept[:count],
    )


def harmonics_told(ratio: float, points: float) -> int:
    """Harmonics worth keeping of a cycle of so many points at a frequency ratio.

    A stop's corner is sharp, and a slow drive wakes high harmonics at the frame's own.

    Examples
    --------
    >>> harmonics_told(0.5, 160.0), harmonics_told(0.2, 400.0), harmonics_told(2.0, 40.0)
    (32, 50, 10)
    """
    wanted = min(MOST_HARMONICS, max(32, math.ceil(10.0 / ratio)))
    return max(2, min(wanted, int(points / POINTS)))


def of_mean(single: FloatArray, least: float, used: int) -> tuple[FloatArray, float]:
    """Covariance of the mean of so many cycles by what some of them show, and by how much neighbours raise it."""
    raised = _togetherness(single)
    return shrunk(single, least) * (raised / used), raised


def shrunk(single: FloatArray, least: float) -> FloatArray:
    """Covariance of one cycle: the sample's, its correlations shrunk, its variances smoothed over neighbours.

    Parameters
    ----------
    single : ndarray of shape (n, d)
        n cycles; d may be larger than n.
    least : float
        No variance is below this one.

    Examples
    --------
    >>> draws = np.random.default_rng(1).standard_normal((40, 3)) * [1.0, 2.0, 3.0]
    >>> bool(np.all(np.linalg.eigvalsh(shrunk(draws, 1e-6)) > 0))
    True
    """
    n, _ = single.shape
    about = single - single.mean(axis=0)
    variance = np.maximum((about**2).sum(axis=0) / (n - 1), 1e-300)
    unit = about / np.sqrt(variance)
    correlation = unit.T @ unit / (n - 1)
    np.fill_diagonal(correlation, 1.0)
    off = ~np.eye(len(correlation), dtype=bool)
    spread = _variance_of_correlation(unit, correlation)[off].sum()
    share = float(np.clip(spread / max((correlation[off] ** 2).sum(), 1e-300), 0.0, 1.0))
    deviation = np.sqrt(np.maximum(variance, 0.0))
    least += FEW / n * float(variance.mean())
    together = (1.0 - share) * correlation + share * np.eye(len(correlation))
    return np.asarray(together * np.outer(deviation, deviation) + np.eye(len(correlation)) * least)


def _variance_of_correlation(unit: FloatArray, correlation: FloatArray) -> FloatArray:
    """Variance of each entry of a sample correlation matrix [Schäfer and Strimmer 2005]."""
    n = len(unit)
    second = (unit**2).T @ (unit**2)
    mean = correlation * (n - 1) / n
    return np.asarray(n / (n - 1.0) ** 3 * (second - n * mean**2))


def raised_by_lag_one(values: FloatArray, *, most: float, fewest: int) -> float:
    """Variance inflation (1 + rho) / (1 - rho) by a significant lag-one correlation; the ladder's limits rest on it."""
    n, about = len(values), values - values.mean()
    square = float(np.dot(about, about))
    rho = float(np.dot(about[1:], about[:-1])) / square if square > 0.0 else 0.0
    if n < fewest or rho <= 1.64 / math.sqrt(n):
        return 1.0
    rho = min(rho + (1.0 + 4.0 * rho) / n, most)  # the estimate's own bias towards zero
    return (1.0 + rho) / (1.0 - rho)


def _togetherness(single: FloatArray) -> float:
    """By how much neighbours that hang together raise the variance of a mean, by the cycles' main direction."""
    about = single - single.mean(axis=0)
    few = len(about) <= about.shape[1]  # the same, and cheaper where cycles are many
    main = _main(about @ about.T) if few else about @ _main(about.T @ about)
    return raised_by_lag_one(main, most=MOST, fewest=PROVEN)


def _main(product: FloatArray) -> FloatArray:
    """Eigenvector (d,) of the largest eigenvalue of a symmetric matrix (d, d)."""
    last = len(product) - 1
    return np.asarray(eigh(product, subset_by_index=[last, last])[1][:, 0])


def by_base(mean: FloatArray, relative: float) -> FloatArray:
    """Covariance (2 K, 2 K) that the noise of the base sensor adds: all is over its amplitude, from its phase on.

    `relative` is the standard error of the base's amplitude over it, which is also that of its phase in rad.
    """
    order = np.arange(1, len(mean) // 2 + 1)
    cosine, sine = np.split(mean, 2)
    later = np.concatenate([order * sine, -order * cosine])
    return np.asarray(relative**2 * (np.outer(mean, mean) + np.outer(later, later)))
