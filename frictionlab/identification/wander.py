"""Friction over time: a random walk from period to period, each value with its error.

A small change of beta during a period moves the record by its sensitivity dx/dbeta there; the residual tells how large
it was. Slow drift is taken as quasi-static: the motion has settled before friction has changed much. The walk's
step is the one that makes the values most likely; a Kalman smoother joins them (Rauch, Tung and Striebel 1965).
"""

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
STEPS = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 41)])  # of the walk, over beta, that are tried
WIDE = 10.0  # over beta: what is known of the first value


def changes(gap: FloatArray, slope: FloatArray, periods: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
    """Return the change of a parameter in each period, by least squares, and the weight <s, s> of each.

    Parameters
    ----------
    gap, slope : ndarray of shape (n,)
        Measured minus predicted, and the prediction's derivative by the parameter.
    periods : ndarray of shape (n,)
        Number of the period that each sample is in, from 0.
    """
    weight = np.asarray(np.bincount(periods, slope * slope), dtype=np.float64)
    moved = np.asarray(np.bincount(periods, slope * gap), dtype=np.float64)
    return moved / np.maximum(weight, 1e-300), weight


def walk(values: FloatArray, errors: FloatArray, size: float) -> tuple[FloatArray, FloatArray, float]:
    """Return the smoothed values (c,) of a random walk seen with errors, their own errors, and how sure it is.

    How sure: the logarithm of how much more likely the values are than if nothing changed.

    Parameters
    ----------
    values, errors : ndarray of shape (c,)
    size : float
        What the walk's step is measured in (beta).

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> truth = np.linspace(0.0, 1.0, 200)
    >>> mean, error, sure = walk(truth + 0.1 * rng.standard_normal(200), np.full(200, 0.1), 1.0)
    >>> bool(np.std(mean - truth) < 0.05), bool(np.mean(np.abs(mean - truth) < 2 * error) > 0.9), sure > 10
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
    return mean, np.sqrt(np.maximum(variance, 0.0)), float(likely - still)


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
