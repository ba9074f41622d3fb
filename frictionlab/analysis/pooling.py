"""One number from several that scatter by more than their errors."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Average:
    """Mean of several estimates, its standard error, and their scatter beyond their own errors (None for one alone)."""

    mean: float
    se: float
    spread: float | None


def average(values: Sequence[float], errors: Sequence[float]) -> Average:
    """Mean weighted by the errors and by the scatter beyond them [Paule and Mandel 1982].

    The standard error is the larger of what the errors and what the values themselves say.

    Examples
    --------
    >>> average([1.0, 2.0, 3.0], [0.1, 0.1, 0.1]).mean
    2.0
    >>> average([3.0], [0.1])
    Average(mean=3.0, se=0.1, spread=None)
    """
    value, error = np.asarray(values, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if len(value) == 1:
        return Average(float(value[0]), float(error[0]), None)
    error = np.maximum(error, 1e-12 * float(np.abs(value).max(initial=1e-300)))
    spread = scatter_beyond(value, error)
    weight = 1.0 / (error**2 + spread**2)
    mean = weighted_mean(value, error, spread)
    seen = math.sqrt(float(np.sum(weight * (value - mean) ** 2)) / (len(value) - 1) / float(weight.sum()))
    return Average(mean, max(1.0 / math.sqrt(float(weight.sum())), seen), spread)


def weighted_mean(value: FloatArray, error: FloatArray, spread: float) -> float:
    """Mean of values (n,) with errors (n,), each weighted by 1 / (error^2 + spread^2)."""
    weight = 1.0 / (error**2 + spread**2)
    return float(np.sum(weight * value) / np.sum(weight))


def scatter_beyond(value: FloatArray, error: FloatArray) -> float:
    """Scatter beyond the errors: where chi-square meets its degrees of freedom; 0 where it is below them already.

    Examples
    --------
    >>> round(scatter_beyond(np.array([1.0, 2.0, 3.0]), np.full(3, 0.6)), 6)
    0.8
    """
    freedom = len(value) - 1

    def excess(spread: float) -> float:
        mean = weighted_mean(value, error, spread)
        return float(np.sum((value - mean) ** 2 / (error**2 + spread**2))) - freedom

    if freedom < 1 or excess(0.0) <= 0.0:
        return 0.0
    low, high = 0.0, float(np.ptp(value))
    while excess(high) > 0.0:
        high *= 2.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return high


def welch(square: float, weight: FloatArray, freedom: FloatArray) -> float:
    """How often chance makes values with errors of their own differ by more than they do [Welch 1951].

    Parameters
    ----------
    square : float
        Chi-square of at least two values about their weighted mean.
    weight, freedom : ndarray of shape (n,)
        One over the square of each value's error, and the degrees of freedom by which that is known.

    Examples
    --------
    >>> known, guessed = np.full(4, 1e6), np.full(4, 5.0)
    >>> round(welch(7.815, np.ones(4), known), 3), round(welch(7.815, np.ones(4), guessed), 3)
    (0.05, 0.13)
    """
    k = len(weight)
    spread = float(np.sum((1.0 - weight / weight.sum()) ** 2 / freedom))
    ratio = square / (k - 1) / (1.0 + 2.0 * (k - 2) / (k**2 - 1) * spread)
    return float(fdtrc(k - 1, (k**2 - 1) / (3.0 * spread), ratio))
