"""How much of a normal curve lies where no coordinate is below zero, as a logarithm, however far its peak is beyond.

The last coordinate is integrated by its error function, those before it by Gauss and Legendre's nodes, which crowd at
the bound: a curve whose peak lies beyond falls off there at once. So it is exact in one dimension, and to 1e-4 in the
logarithm in two, three and four, where libraries' probabilities of many dimensions are lost below 1e-10.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, logsumexp

FloatArray = NDArray[np.float64]
CERTAIN = 8.0  # deviations above its bound from which a coordinate has none
WIDEST = 8.0  # deviations beyond its best value, inside the bounds, that a coordinate is followed to
NODES = {1: 40, 2: 28, 3: 18}  # for each coordinate before the last, by how many these are; 12 for more
LARGEST = 1 << 20  # values held at a time


@cache
def _nodes(before: int) -> tuple[FloatArray, FloatArray]:
    """Gauss and Legendre's nodes on 0 to 1 and the logarithms of their weights."""
    at, weight = np.polynomial.legendre.leggauss(NODES.get(before, 12))
    return 0.5 * (at + 1.0), np.log(0.5 * weight)


def log_orthant(mean: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the logarithm of the probability (...) that no coordinate of a normal curve is negative.

    Parameters
    ----------
    mean : ndarray of shape (..., k)
        Its peak, anywhere.
    covariance : ndarray of shape (..., k, k)

    Examples
    --------
    >>> even = np.array([[1.0, 0.5], [0.5, 1.0]])
    >>> round(float(np.exp(log_orthant(np.zeros(2), even))), 9), bool(log_orthant(np.zeros(0), np.zeros((0, 0))) == 0.0)
    (0.333333333, True)
    """
    count = mean.shape[-1]
    if count == 0:
        return np.zeros(mean.shape[:-1])
    means, covariances = mean.reshape(-1, count), covariance.reshape(-1, count, count)
    spread = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    near = (means < CERTAIN * spread).any(axis=0)
    if not near.all():  # of those that are nowhere near their bounds nothing is lost
        some = np.flatnonzero(near)
        return log_orthant(means[:, some], covariances[:, some[:, None], some]).reshape(mean.shape[:-1])
    held = max(1, LARGEST // len(_nodes(count - 1)[0]) ** (count - 1))
    parts = [_of_rows(means[i : i + held], covariances[i : i + held]) for i in range(0, len(means), held)]
    return np.concatenate(parts).reshape(mean.shape[:-1])


def _of_rows(mean: FloatArray, covariance: FloatArray) -> FloatArray:
    """The same (n,) of peaks (n, k) and covariances (n, k, k)."""
    precision: FloatArray = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
    force = np.einsum("nij,nj->ni", precision, mean)
    best = _nearest(precision, force)
    first, weight = _grid(best, force - np.einsum("nij,nj->ni", precision, best), covariance)
    log_density = -0.5 * np.einsum("ni,nij,nj->n", mean, precision, mean) + 0.5 * np.linalg.slogdet(precision)[1]
    count, own = mean.shape[1] - 1, precision[:, -1, -1, None]
    pull = force[:, -1, None] - np.einsum("nqi,ni->nq", first, precision[:, :-1, -1])
    inside = np.einsum("nqi,ni->nq", first, force[:, :-1])
    inside -= 0.5 * np.einsum("nqi,nij,nqj->nq", first, precision[:, :-1, :-1], first)
    inside += 0.5 * pull**2 / own + log_ndtr(pull / np.sqrt(own)) - 0.5 * np.log(own)
    return np.asarray(log_density - 0.5 * count * np.log(2.0 * np.pi) + logsumexp(inside + weight, axis=1))


def _nearest(precision: FloatArray, force: FloatArray) -> FloatArray:
    """Where the curve is highest inside the bounds (n, k): one coordinate after the other, until nothing moves."""
    best = np.zeros_like(force)
    for _ in range(100 if force.shape[1] > 1 else 1):
        before = best.copy()
        for i in range(force.shape[1]):
            others = np.einsum("nj,nj->n", precision[:, i], best) - precision[:, i, i] * best[:, i]
            best[:, i] = np.maximum((force[:, i] - others) / precision[:, i, i], 0.0)
        if np.allclose(best, before, rtol=1e-6, atol=1e-12):
            break
    return best


def _grid(best: FloatArray, slope: FloatArray, covariance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nodes (n, q, k - 1) of all coordinates but the last, and the logarithms of their weights (n, q)."""
    n, before = len(best), best.shape[1] - 1
    if not before:
        return np.zeros((n, 1, 0)), np.zeros((n, 1))
    at, log_weight = _nodes(before)
    spread = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))[:, :before]
    scale = np.minimum(spread, 1.0 / np.maximum(-slope[:, :before], 1e-300))
    last = np.arcsinh((best[:, :before] + WIDEST * spread) / scale)
    u = last[:, :, None] * at
    x, weight = scale[:, :, None] * np.sinh(u), log_weight + np.log((scale * last)[:, :, None] * np.cosh(u))
    index, rows = np.indices((len(at),) * before).reshape(before, -1), np.arange(before)[:, None]
    return np.moveaxis(x[:, rows, index], 1, 2), weight[:, rows, index].sum(axis=1)
