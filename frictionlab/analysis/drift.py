"""Long tests: the energy of one cycle every ten seconds, and its linear trend with confidence (thesis 4.4.3)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
INTERVAL_S = 10.0


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


def every(time: FloatArray, value: FloatArray, interval: float = INTERVAL_S) -> tuple[FloatArray, FloatArray]:
    """One value every ``interval`` seconds: the first cycle that starts at or after each of the ticks.

    Parameters
    ----------
    time, value : (n,) arrays
        Start of each cycle [s] and its value.
    """
    ticks = np.arange(time[0], time[-1] + 1e-9, interval)
    chosen = np.unique(np.searchsorted(time, ticks - 1e-9))
    chosen = chosen[chosen < len(time)]
    return time[chosen], value[chosen]


def linear_trend(time: FloatArray, value: FloatArray) -> Trend | None:
    """Least-squares line with its confidence; neighbours that hang together widen it.

    The residual's lag-one correlation rho, where it is significant, takes the number of independent points from n to
    n (1 - rho) / (1 + rho) [Santer et al. 2000].

    Returns
    -------
    Trend or None
        None for fewer than six points.
    """
    n = len(time)
    if n < 6:
        return None
    u = time - time.mean()
    spread = float(np.dot(u, u))
    slope = float(np.dot(u, value)) / spread
    left = value - value.mean() - slope * u
    square = float(np.dot(left, left))
    rho = float(np.dot(left[1:], left[:-1])) / square if square > 0.0 else 0.0
    rho += (1.0 + 4.0 * rho) / n  # the estimate's own bias towards zero
    independent = n * (1.0 - rho) / (1.0 + rho) if rho > 1.6 / math.sqrt(n) else float(n)
    freedom = max(independent - 2.0, 1.0)
    error = math.sqrt(square / freedom / spread)
    reach = student95(freedom) * error
    return Trend(time, value, slope, error, slope - reach, slope + reach, float(value.mean()))


def student95(freedom: float) -> float:
    """Two-sided 95 % quantile of Student's t (Cornish and Fisher 1937, good to 1 % from 3 degrees of freedom)."""
    z = 1.959964
    g1 = (z**3 + z) / 4
    g2 = (5 * z**5 + 16 * z**3 + 3 * z) / 96
    g3 = (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / 384
    return z + g1 / freedom + g2 / freedom**2 + g3 / freedom**3
