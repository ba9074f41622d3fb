"""Whether tests agree: how sure one test's friction is by its own cycles alone, and chi-square of many.

The weights of a fit are found from the cycles of its test and let these scatter too little, so each half of the cycles
is weighed by what the other half says. How neighbours hang together, and how well so few cycles tell their scatter, is
reckoned as in a single comparison (`frictionlab.analysis.autocorrelation`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.autocorrelation import student, variance_inflation
from frictionlab.analysis.pooling import welch
from frictionlab.identification.observed import HALVES, Observed

FloatArray = NDArray[np.float64]
WELL_KNOWN = 1e6  # degrees of freedom of a variance that no cycles are needed for


@dataclass(frozen=True)
class Own:
    """How sure one test is of one unknown: a variance, and by how many degrees of freedom that is known."""

    variance: float
    freedom: float

    @property
    def cautious(self) -> float:
        """The variance with Student's factor."""
        return self.variance * student(self.freedom)


def own_of(observed: Observed, slopes: FloatArray, k: int = 0) -> Own:
    """How sure one of the unknowns of a mean cycle is by its noise and by the scatter of its cycles.

    Parameters
    ----------
    observed : Observed
    slopes : ndarray of shape (2 K, n)
        Of the cycle's harmonics over the unknowns.
    k : int
        Which of them.

    Examples
    --------
    >>> draws = 0.1 * np.random.default_rng(3).standard_normal((400, 4))
    >>> seen = Observed(draws.mean(0), draws, np.eye(4) * 2.5e-5, 2.5e-9, 400, 399.0, 1.0, 0.0, np.zeros((4, 4)))
    >>> round(own_of(seen, np.eye(4)[:, :1]).variance / 2.5e-5, 1)
    1.0
    """
    halves = observed.by_others(HALVES)
    if not halves:
        return Own(_weighed(observed.covariance, slopes, k)[1], WELL_KNOWN)
    weights = [_weighed(covariance, slopes, k)[0] for _, covariance in halves]
    moved = np.concatenate([part @ weight for (part, _), weight in zip(halves, weights, strict=True)])
    freedom = len(moved) - 1.0
    scatter = float(moved @ moved) / freedom / observed.used * float(variance_inflation(moved[:, None])[0])
    least = observed.sensor * math.fsum(float(weight @ weight) for weight in weights) / len(weights)
    base = math.fsum(float(weight @ observed.of_base @ weight) for weight in weights) / len(weights)
    total = max(least, scatter) + base
    return Own(total, min(freedom * (total / scatter) ** 2, WELL_KNOWN) if scatter > 0.0 else WELL_KNOWN)


def _weighed(covariance: FloatArray, slopes: FloatArray, k: int) -> tuple[FloatArray, float]:
    """Weights (2 K,) of the harmonics for the k-th unknown, and its variance by that covariance."""
    raw = np.linalg.solve(covariance, slopes)
    told = np.linalg.inv(slopes.T @ raw)
    return np.asarray(raw @ told[:, k]), float(told[k, k])


def agreement(
    values: Sequence[float], owns: Sequence[Own], shared: FloatArray | None = None
) -> tuple[float, int, float | None]:
    """Chi-square of values about what they share, its degrees of freedom, and how often chance would give more.

    Parameters
    ----------
    values, owns : sequence
        What each test says of one unknown, and how sure it is of that by itself.
    shared : ndarray of shape (n, k), optional
        Their errors by sources that all tests share.

    Examples
    --------
    >>> known, guessed = [Own(1.0, WELL_KNOWN)] * 3, [Own(1.0, 4.0)] * 3
    >>> square, freedom, p = agreement([1.0, -1.0, 3.0], known)
    >>> square, freedom, round(p or 0.0, 3), round(agreement([1.0, -1.0, 3.0], guessed)[2] or 0.0, 3)
    (8.0, 2, 0.018, 0.073)
    >>> agreement([1.0, -1.0, 3.0], known, np.array([[1.0], [-1.0], [3.0]]))[0] < 1.0
    True
    """
    if len(values) < 2:
        return 0.0, 0, None
    value, variance = np.array(values), np.array([own.variance for own in owns])
    inverse = np.linalg.inv(np.diag(variance) + (0.0 if shared is None else shared @ shared.T))
    about = value - float(inverse.sum(axis=0) @ value / inverse.sum())
    square = float(about @ inverse @ about)
    return square, len(values) - 1, welch(square, 1.0 / variance, np.array([own.freedom for own in owns]))
