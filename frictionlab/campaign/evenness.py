"""Whether tests agree: how sure one test's friction is by its own cycles alone, and chi-square of many.

The weights of a fit are found from the cycles of its test and let these scatter too little, so each half of the cycles
is weighed by what the other half says. Neighbours share the change of friction where they are cut.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from frictionlab.analysis.energy import lag_one
from frictionlab.identification.observed import FEWEST_CYCLES, ROUNDING, Observed, shrunk

FloatArray = NDArray[np.float64]
SHARED = 0.5  # correlation of two neighbours that share a change at most


def variance_of(observed: Observed, slope: FloatArray) -> float:
    """Variance of the one unknown of a mean cycle by its noise and by the scatter of its cycles.

    Parameters
    ----------
    observed : Observed
    slope : ndarray of shape (2 K,)
        Of the cycle's harmonics over the unknown.

    Examples
    --------
    >>> draws = 0.1 * np.random.default_rng(3).standard_normal((400, 4))
    >>> seen = Observed(draws.mean(0), draws, np.eye(4) * 2.5e-5, 2.5e-9, 400, 399.0, 1.0, 0.0, np.zeros((4, 4)))
    >>> round(variance_of(seen, np.array([1.0, 0.0, 0.0, 0.0])) / 2.5e-5, 1)
    1.0
    """
    count = len(observed.each)
    if count <= FEWEST_CYCLES or not math.isfinite(observed.freedom):
        return _weighed(observed.covariance, slope)[1]
    about = observed.each - observed.each.mean(axis=0)
    least = observed.sensor * observed.used + 2.0 * ROUNDING**2 * observed.power / observed.harmonics
    moved, at_least = np.zeros(count), 0.0
    for first in (0, 1):
        rest = shrunk(observed.each[1 - first :: 2], least) / observed.used + observed.of_base
        weight, _ = _weighed(rest, slope)
        moved[first::2] = about[first::2] @ weight
        at_least += 0.5 * observed.sensor * float(weight @ weight)
    own = float(weight @ observed.of_base @ weight)
    few = (count - 1.0) / max(count - 3.0, 1.0)
    hang = 1.0 + 2.0 * min(max(lag_one(moved), 0.0), SHARED)
    scatter = float(moved @ moved) / (count - 1.0) / observed.used * few * hang
    return max(at_least, scatter) + own


def _weighed(covariance: FloatArray, slope: FloatArray) -> tuple[FloatArray, float]:
    """Weights (2 K,) of the harmonics for the unknown, and its variance by that covariance."""
    raw = np.linalg.solve(covariance, slope)
    information = max(float(slope @ raw), 1e-300)
    return np.asarray(raw / information), 1.0 / information


def agreement(scores: Sequence[float]) -> tuple[float, int, float | None]:
    """Chi-square of scores about what they share, its degrees of freedom, and how often chance would give more.

    Examples
    --------
    >>> square, freedom, p = agreement([1.0, -1.0, 0.5])
    >>> square, freedom, round(p or 0.0, 3)
    (2.25, 2, 0.325)
    """
    square, freedom = math.fsum(score**2 for score in scores), max(len(scores) - 1, 0)
    return square, freedom, float(chdtrc(freedom, square)) if freedom else None
