"""Likelihood and priors of a fit, as a nested sampler takes them: by the definitions, no Laplace."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri
from scipy.stats import t as student

from frictionlab.identification.fit import Fit

FloatArray = NDArray[np.float64]


def likelihood(fit: Fit) -> Callable[[FloatArray], float]:
    """Logarithm of the likelihood of a point: normal misfit with the covariance of the measured mean cycle."""
    observed = fit.observed
    constant = float(np.log(np.diag(observed.whitener)).sum()) - observed.harmonics * math.log(2.0 * math.pi)

    def value(point: FloatArray) -> float:
        predicted = fit.forward.predict(point)
        if predicted is None:
            return -1e300
        gap = observed.whitener @ (observed.cosine_sine - predicted)
        return constant - 0.5 * float(gap @ gap)

    return value


def prior_transform(fit: Fit) -> Callable[[FloatArray], FloatArray]:
    """The unit cube to coordinates: normal, the upper half of it where a coordinate only grows, or with tails."""
    low = np.array([ndtr(c.low) for c in fit.coordinates])
    high = np.array([ndtr(c.high) for c in fit.coordinates])
    tails = [(i, c.tail) for i, c in enumerate(fit.coordinates) if math.isfinite(c.tail)]

    def point(cube: FloatArray) -> FloatArray:
        found = np.asarray(ndtri(low + (high - low) * cube))
        for i, a in tails:  # Student's t of 2 a - 1 degrees of freedom, wider by a constant
            found[i] = math.sqrt(2.0 * a / (2.0 * a - 1.0)) * float(student.ppf(cube[i], 2.0 * a - 1.0))
        return found

    return point
