"""By how much the mean of a few cycles is less sure than their scatter says, because neighbours hang together.

Two things make neighbours alike, and one makes them unlike. Cycles are cut where the base rises, friction changes
anywhere: with a share s of what a change does before the cut and 1 - s after it, a value of one cycle is
``(1 - s) f[k] + s f[k+1]``. A parameter that friction moves to and fro has a share beyond 0 and 1: its neighbours
are unlike, and its mean is surer than its scatter says. And friction itself may wander, ``f[k+1] = phi f[k] + ...``.
That is a moving average of an autoregression, ARMA(1, 1): its likelihood is exact and cheap for any number of cycles
(innovations, Brockwell and Davis 1991, section 5.3), so s and phi are averaged over, each pair by how likely it makes
the series. Few cycles say little of it, and what was thought before them counts.

Errors of fits and campaigns ask this likelihood. A mean energy and the weights of a fit ask the lag-one correlation
instead (`raised_by_lag_one`), where it is significant: it is cruder (rms of error over stated error of means of 10, 30,
100 values 1.7, 0.96, 0.81 where friction changes in mid-cycle; 1.0, 0.94, 0.97 by the likelihood, 300 series each), but
a steady drift, which is no noise at all, makes it largest: of a gain that drifts by 2 % in a test the mean energy was
2.0 standard errors off by it, and 5.2 by the likelihood. In recordings whose friction scatters alone the energies of
both are alike (900 draws: 66 and 93 % within 1 and 1.96). As weights, the likelihood would raise log evidence (605.4 to
612.2 of a gradient with two dashpots), against which the ladder's limits were not found.
"""

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
SHARES = {-2.0: 0.03, -0.6: 0.03, -0.3: 0.03, -0.15: 0.03} | dict.fromkeys((0.0, 0.1, 0.2, 0.3, 0.4, 0.5), 0.88 / 6)
WANDERS = {0.0: 0.74, 0.3: 0.05, 0.6: 0.05, 0.8: 0.04, 0.9: 0.04, 0.95: 0.04, 0.98: 0.02, 0.995: 0.02}
"""phi -> how likely before anything is measured; the last is friction that wanders over 200 cycles."""

SIGNIFICANT = 1.64  # deviations: a correlation that chance has in 1 of 20
BLOCK = 32  # values of a series at a time, so that they stay in the processor's cache
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
    """Variance of Student's t over that of a normal curve: what a scatter lacks that so few values tell."""
    return freedom / max(freedom - 2.0, 0.5)


def lag_one(values: FloatArray) -> float:
    """Correlation of neighbours about the mean; 0 for a series that does not vary."""
    about = values - values.mean()
    square = float(np.dot(about, about))
    return float(np.dot(about[1:], about[:-1])) / square if square > 0.0 else 0.0


def raised_by_lag_one(values: FloatArray, *, most: float, fewest: int = 3) -> float:
    """By how much the variance of a mean is larger by the lag-one correlation rho: (1 + rho) / (1 - rho).

    What is not significant counts as nothing; `most`: no correlation is larger; `fewest` values tell one.

    Examples
    --------
    >>> raised_by_lag_one(np.tile([1.0, -1.0], 50), most=0.95)
    1.0
    >>> raised_by_lag_one(np.repeat([1.0, -1.0], 50), most=0.95) > 30
    True
    """
    n, rho = len(values), lag_one(values)
    if n < fewest or rho <= SIGNIFICANT / math.sqrt(n):
        return 1.0
    rho = min(rho + (1.0 + 4.0 * rho) / n, most)  # the estimate's own bias towards zero
    return (1.0 + rho) / (1.0 - rho)


def raised_by(series: FloatArray) -> FloatArray:
    """Return by how much the variance of each mean is larger than scatter over length says.

    Geometric mean of what all pairs say, each by its likelihood: its root is that of a stated error which covers. That
    the scatter is known from few values alone is not in it: multiply by `student`.

    Parameters
    ----------
    series : ndarray of shape (n, m)
        m series of n values, n at least 2.

    Examples
    --------
    >>> draws = np.random.default_rng(1).standard_normal((201, 1))
    >>> np.round([float(raised_by(some)[0]) for some in (draws, draws[1:] + draws[:-1], draws[1:] - draws[:-1])], 1)
    array([0.8, 2.2, 0.1])
    >>> few = np.array([1.0, 0.9, -0.2, -0.8, -0.7, -0.1, 0.2, -0.3])
    >>> round(float(raised_by(few[:, None])[0]) * student(7.0), 1)
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
