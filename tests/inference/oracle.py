"""Likelihood and priors of a fit by the definitions, no Laplace: for a nested sampler, and for importance sampling."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp, ndtr
from scipy.stats import multivariate_t, norm
from scipy.stats import t as student

from frictionlab.inference.fit import Fit
from frictionlab.inference.unknowns import Unknown

FloatArray = NDArray[np.float64]
DRAWN = 6  # degrees of freedom of the curve that points are drawn from: wider than any posterior about its peak
WIDER = 1.2  # its covariance over Laplace's


def likelihood(fit: Fit) -> Callable[[FloatArray], float]:
    """Logarithm of the likelihood of a point: normal misfit with the covariance of the measured mean cycle."""
    observation = fit.model.tests[0].observation
    constant = observation.log_scale - 0.5 * len(observation.data) * math.log(2.0 * math.pi)

    def value(point: FloatArray) -> float:
        residual = fit.model.residual(0, point)
        return -1e300 if residual is None else constant - 0.5 * float(residual @ residual)

    return value


def log_prior(c: Unknown, at: float) -> float:
    """Logarithm of a coordinate's prior density: normal, or Student's; twice that where only half of it is left."""
    if not c.low <= at <= c.high:
        return -math.inf
    if math.isfinite(c.tail):
        density = float(student.logpdf(at / _scale(c), 2.0 * c.tail - 1.0)) - math.log(_scale(c))
        return density + (math.log(2.0) if c.folded else 0.0)
    return float(norm.logpdf(at)) - math.log(float(ndtr(c.high) - ndtr(c.low)))


def _scale(c: Unknown) -> float:
    """A prior with tails is Student's t of 2 a - 1 degrees of freedom, wider by this."""
    return math.sqrt(2.0 * c.tail / (2.0 * c.tail - 1.0))


@dataclass(frozen=True)
class Weighed:
    """What points drawn about the best values say: evidence, and how many even points they are worth.

    ``points`` (m, n) with their ``weights`` (m,), which sum to 1.
    """

    log_evidence: float
    worth: float
    points: FloatArray
    weights: FloatArray


def weighed(fit: Fit, draws: int, generator: np.random.Generator) -> Weighed:
    """Integrate likelihood times prior about the best values by importance sampling from a curve with tails."""
    curve = multivariate_t(fit.point, WIDER * np.linalg.inv(fit.precision), df=DRAWN, seed=generator)
    points, value = curve.rvs(draws), likelihood(fit)
    logs = np.full(draws, -math.inf)
    for i, point in enumerate(points):
        prior = sum(log_prior(c, float(p)) for c, p in zip(fit.model.unknowns, point, strict=True))
        if math.isfinite(prior):
            logs[i] = value(point) + prior - curve.logpdf(point)
    whole = float(logsumexp(logs))
    weights = np.exp(logs - whole)
    return Weighed(whole - math.log(draws), 1.0 / float(weights @ weights), points, weights)
