"""Likelihood and priors of a fit, as a nested sampler takes them: by the definitions, no Laplace."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

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
    """The unit cube to coordinates: the normal curve, its upper half where a coordinate only grows."""
    low = np.array([ndtr(c.low) for c in fit.coordinates])
    high = np.array([ndtr(c.high) for c in fit.coordinates])

    def point(cube: FloatArray) -> FloatArray:
        return np.asarray(ndtri(low + (high - low) * cube))

    return point
