"""Friction over time: a random walk from period to period, each value with its error.

A small change of beta during a period moves the record by its sensitivity dx/dbeta there; the residual tells how large
it was. The walk's step is the one that makes the values most likely; a Kalman smoother joins them (Rauch, Tung and
Striebel 1965).
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Periods = NDArray[np.intp]
STEPS = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 41)])  # of the walk, over beta, that are tried
WIDE = 10.0  # over beta: what is known of the first value


def changes(gap: FloatArray, slope: FloatArray, periods: Periods, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the change of a parameter in each period (c,), by least squares, and the weight <s, s> of each.

    Parameters
    ----------
    gap, slope : ndarray of shape (n,)
        Measured minus predicted, and the prediction's derivative by the parameter.
    periods : ndarray of shape (n,)
        Number of the period that each sample is in, from 0.
    count : int
        Periods; what comes behind them is left out.
    """
    weight = np.asarray(np.bincount(periods, slope * slope, minlength=count)[:count], dtype=np.float64)
    moved = np.asarray(np.bincount(periods, slope * gap, minlength=count)[:count], dtype=np.float64)
    return moved / np.maximum(weight, 1e-300), weight


@dataclass(frozen=True)
class Walk:
    """A random walk: its values (c,), their errors (c,), its step from one to the next.

    ``sure``: logarithm of how much more likely what was seen is than if nothing changed.
    """

    values: FloatArray
    errors: FloatArray
    step: float
    sure: float

    def earlier(self, delay: float) -> "Walk":
        """What made a walk that shows so many steps late; what has not shown yet is the last value, less sure."""
        places = np.arange(len(self.values)) + delay
        late = np.maximum(places - (len(self.values) - 1.0), 0.0)
        values, errors = (np.interp(places, np.arange(len(places)), v) for v in (self.values, self.errors))
        blurred = self.step**2 * (0.25 * delay + late)  # what changes within the delay shows as its mean
        return replace(self, values=values, errors=np.sqrt(errors**2 + blurred))


def walk(values: FloatArray, errors: FloatArray, size: float) -> Walk:
    """Return the smoothed random walk behind values (c,) seen with errors.

    Parameters
    ----------
    values, errors : ndarray of shape (c,)
    size : float
        What the walk's step is measured in (beta).

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> truth = np.linspace(0.0, 1.0, 200)
    >>> found = walk(truth + 0.1 * rng.standard_normal(200), np.full(200, 0.1), 1.0)
    >>> off = found.values - truth
    >>> bool(np.std(off) < 0.05), bool(np.mean(np.abs(off) < 2 * found.errors) > 0.9), found.sure > 10
    (True, True, True)
    """
    still = _forward(values, errors, 0.0, size)[0]
    best = max(STEPS * size, key=lambda step: _forward(values, errors, float(step), size)[0])
    likely, mean, variance = _forward(values, errors, float(best), size)
    for c in range(len(values) - 2, -1, -1):
        ahead = variance[c] + best**2
        share = variance[c] / ahead
        mean[c] += share * (mean[c + 1] - mean[c])
        variance[c] += share**2 * (variance[c + 1] - ahead)
    return Walk(mean, np.sqrt(np.maximum(variance, 0.0)), float(best), float(likely - still))


def _forward(values: FloatArray, errors: FloatArray, step: float, size: float) -> tuple[float, FloatArray, FloatArray]:
    """Kalman's filter: log-likelihood, means and variances (c,)."""
    mean, variance, likelihood = 0.0, (WIDE * size) ** 2, 0.0
    means, variances = np.zeros(len(values)), np.zeros(len(values))
    for c, (value, error) in enumerate(zip(values, errors, strict=True)):
        variance += step**2 if c else 0.0
        total = variance + error**2
        likelihood -= 0.5 * (math.log(total) + (value - mean) ** 2 / total)
        mean += variance / total * (value - mean)
        variance *= error**2 / total
        means[c], variances[c] = mean, variance
    return likelihood, means, variances
