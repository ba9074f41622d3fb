"""By how much the score of a test, the slope of its likelihood over its unknowns, may be off by its own noise.

The cycles of a test show it: each cycle alone would pull the fit somewhere, weighed as the other cycles ask for. What
that does to an unknown that many tests share is a series of numbers, one a cycle; its scatter, and how neighbours in it
hang together, tell the error, as in a single comparison (`frictionlab.identification.fit_errors`). The covariance that
weighs the cycles is no such measure: shrunk because cycles are few, it is too large where friction's scatter has no
part, and knows neighbours by one direction only.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.autocorrelation import variance_inflation
from frictionlab.identification.fit import Fit

FloatArray = NDArray[np.float64]


class Noise(Protocol):
    """What a test's own noise does to its score (n,)."""

    def carried(self, into: FloatArray) -> FloatArray:
        """Covariance (S, S) of what it does to unknowns that the score moves by ``into`` (n, S)."""
        ...


@dataclass(frozen=True)
class Stated:
    """Noise of which the covariance (n, n) of the score is known."""

    covariance: FloatArray

    def carried(self, into: FloatArray) -> FloatArray:
        """Covariance (S, S) of what it does to unknowns that the score moves by ``into`` (n, S)."""
        return np.asarray(into.T @ self.covariance @ into)


@dataclass(frozen=True)
class Shown:
    """Noise that the cycles show.

    ``each`` (m, n): score by each cycle about their mean, as the other cycles weigh it; ``used``: cycles that the mean
    is of; ``least``, ``base`` (n, n): what the sensor's white noise does alone, and what the base sensor's adds;
    ``excess``: variance of what the law cannot explain over the noise's.
    """

    each: FloatArray
    used: int
    least: FloatArray
    base: FloatArray
    excess: float

    def carried(self, into: FloatArray) -> FloatArray:
        """Covariance (S, S) of what it does to unknowns that the score moves by ``into`` (n, S)."""
        moved = self.each @ into
        least = np.diag(into.T @ self.least @ into)
        scatter = moved.T @ moved / (len(moved) - 1.0) / self.used
        stated = np.maximum(np.diag(scatter), 1e-300)
        up = np.sqrt(np.maximum(variance_inflation(moved) * stated, least) / stated)
        return np.asarray(self.excess * (scatter * np.outer(up, up) + into.T @ self.base @ into))


def noise_by_cycles(found: Fit) -> Noise:
    """What the noise of a test does to its score: by its cycles, or by what weighs them where these are too few."""
    observed, weight = found.observed, found.jacobian / found.excess
    if not len(observed.weighed):
        return Stated(np.asarray(found.jacobian.T @ weight))
    each = observed.weighed @ np.linalg.solve(observed.whitener, weight)
    pull = observed.whitener.T @ weight
    return Shown(each, observed.used, observed.sensor * pull.T @ pull, pull.T @ observed.of_base @ pull, found.excess)
