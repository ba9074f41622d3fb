"""Autocorrelation of cycles: by how much the mean of a few is less certain than their scatter says.

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

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
SHARES = {-2.0: 0.03, -0.6: 0.03, -0.3: 0.03, -0.15: 0.03} | dict.fromkeys((0.0, 0.1, 0.2, 0.3, 0.4, 0.5), 0.88 / 6)
WANDERS = {0.0: 0.74, 0.3: 0.05, 0.6: 0.05, 0.8: 0.04, 0.9: 0.04, 0.95: 0.04, 0.98: 0.02, 0.995: 0.02}
"""phi -> prior probability; the last is friction that wanders over 200 cycles."""

BLOCK = 32  # values of a series at a time: they stay in the cache
ROUNDING = 1e-12  # of the largest value: what scatters by less does not scatter


class _Pairs:
    """All pairs of a share and a wander (c, 1): correlation of neighbours, of a series and of what phi leaves of it."""

    def __init__(self) -> None:
        share, self.phi = (side.reshape(-1, 1) for side in np.meshgrid(list(SHARES), list(WANDERS)))
        same, cross = share**2 + (1.0 - share) ** 2, share * (1.0 - share)
        size = same + 2.0 * cross * self.phi
        self.rho = (same * self.phi + cross * (1.0 + self.phi**2)) / size
        self.log_prior = np.log(np.outer(list(WANDERS.values()), list(SHARES.values()))).reshape(-1, 1)
        self.left = 1.0 + self.phi**2 - 2.0 * self.phi * self.rho  # variance of x[k] - phi x[k-1] ...
        self.alike = self.rho - self.phi  # ... and its covariance with the next one

    def of_mean(self, n: int) -> FloatArray:
        """Variance (c, 1) of the mean of n values of unit variance."""
        apart = np.arange(1, n)
        return np.asarray((n + 2.0 * ((n - apart) * self.phi ** (apart - 1) * self.rho).sum(axis=1)[:, None]) / n**2)

    def _variances(self, n: int) -> FloatArray:
        """Variance (n, c, 1) of what predictions leave of n values in a row."""
        found = np.ones((n, *self.phi.shape))
        for i in range(1, n):
            found[i] = self.left - self.alike**2 / found[i - 1]
        return found

    def squares(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Sum of squares (c, m) of series (n, m) about their likeliest mean, and log likelihood of the rest (c, 1).

        Each value is predicted from those before it; what is left, over its deviation, is white.
        """
        series = np.concatenate([values - values.mean(axis=0), np.ones((len(values), 1))], axis=1)
        before, last = np.zeros((1, series.shape[1])), np.zeros((len(self.phi), series.shape[1]))
        square, cross = np.zeros((2, len(self.phi), series.shape[1]))
        spread = self._variances(len(series))
        follows = np.concatenate([np.zeros_like(spread[:1]), self.alike / spread[:-1]])
        for at in np.array_split(np.arange(len(series)), math.ceil(len(series) / BLOCK)):
            some = series[at]
            error = some[:, None, :] - self.phi * np.concatenate([before, some[:-1]])[:, None, :]
            for row, share in zip(error, follows[at], strict=True):
                last = np.subtract(row, share * last, out=row)
            before, weighed = some[-1:], error / spread[at]
            square, cross = square + (error * weighed).sum(axis=0), cross + (error * weighed[..., -1:]).sum(axis=0)
        size = -0.5 * np.log(spread).sum(axis=0)
        whole = cross[:, -1:]
        return np.asarray((square - cross**2 / whole)[:, :-1]), np.asarray(size - 0.5 * np.log(whole))


PAIRS = _Pairs()


def student(freedom: float) -> float:
    """Variance of Student's t over the normal distribution's: a scatter from few values is itself uncertain."""
    return freedom / max(freedom - 2.0, 0.5)


def variance_of_mean(values: FloatArray) -> float:
    """Variance of the mean of a series (n,), n > 2, its autocorrelation and its length accounted for."""
    n = len(values)
    return float(values.var(ddof=1)) / n * float(variance_inflation(values[:, None])[0]) * student(n - 1.0)


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
    square, log_weight = PAIRS.squares(np.where(varied, series, np.arange(n)[:, None] % 2))
    log_weight = log_weight + PAIRS.log_prior - 0.5 * (n - 1.0) * np.log(square)
    weight = np.exp(log_weight - log_weight.max(axis=0))
    log_variance = np.log(square / (n - 1.0) * PAIRS.of_mean(n))
    told = np.exp((weight * log_variance).sum(axis=0) / weight.sum(axis=0))
    return np.where(varied, told * n / np.where(varied, scatter, 1.0), 1.0)
