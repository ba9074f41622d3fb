"""How sure the values of a fit are: noise, scatter of the cycles, misfit, and what is not known of sensors and rig."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.autocorrelation import student, variance_inflation
from frictionlab.identification.coordinates import doubts, pulled
from frictionlab.identification.fit import Fit, excess_of, misfit_is_noise, suspected

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Errors:
    """Uncertainty of a fit's coordinates, in deviations of the priors.

    ``statistical`` (n,): what noise, scatter and misfit do to the values found; ``combined`` (n, n): with what is not
    known of sensors and rig. ``apart`` (n,): how far values found with sensors and rig held as they are known stand
    from those of the fit that moves them; it is in the combined.
    """

    statistical: FloatArray
    combined: FloatArray
    apart: FloatArray | float = 0.0


def errors_of(found: Fit) -> Errors:
    """Return how sure the coordinates are.

    With the gain K of the fit (coordinates over data) and the Jacobian J, an error e of the data and an error c of what
    was known before leave ``K e + (1 - K J) c``: the first is the statistical error, the second what the priors add.
    ``1 - K J`` is the posterior covariance P, so that the nuisance k adds ``P[i, k]`` to the coordinate i, and more
    where its prior has tails (`pulled`).
    """
    law = np.array([c.law for c in found.coordinates], dtype=bool)
    joint: FloatArray = np.asarray(np.linalg.inv(found.precision))
    noise = noise_of(found)
    own = (joint[:, law] ** 2).sum(axis=1)
    left = pulled(joint, doubts(found.coordinates, found.point))
    return Errors(np.where(law, np.sqrt(np.diag(noise) + own), 0.0), noise + left @ left.T)


def noise_of(found: Fit) -> FloatArray:
    """Covariance (n, n) of the values found by noise, scatter of the cycles and misfit: what the data alone do.

    A misfit that is no more than noise is the noise's, which is counted: told again by the residuals, of which a fit of
    ten unknowns to 18 numbers leaves few, it made the errors twice too large above resonance.
    """
    gain = np.linalg.inv(found.precision) @ found.jacobian.T / found.excess
    noise = found.excess * gain @ gain.T
    shown = _by_noise(found, gain)
    if not misfit_is_noise(found):
        shown = np.maximum(shown, _by_misfit(found, gain))
    elif found.observed.left_out:  # the scatter of cycles is not weighed by it yet
        shown = shown * excess_of(found)
    return np.asarray(noise * np.outer(*[np.sqrt(shown / np.maximum(np.diag(noise), 1e-300))] * 2))


def errors_as_known(held: Fit, alone: Fit, moved: Fit) -> Errors:
    """Return how sure values are that were found with sensors and rig held as they are known.

    Given the data, the truth is spread about the values of the fit that moves sensors and rig, by that fit's errors.
    Seen from the held values, the distance between the two is added in quadrature.

    Parameters
    ----------
    held : Fit
        The values that are given, sensors and rig beside them (`released`).
    alone : Fit
        The same without sensors and rig: how noise scatters it is the statistical error.
    moved : Fit
        The fit that moves sensors and rig.
    """
    of_moved, own = errors_of(moved), errors_of(alone).statistical
    apart = held.point - moved.point
    statistical = np.concatenate([own, np.zeros(len(apart) - len(own))])
    combined = of_moved.combined + np.outer(apart, apart)
    np.fill_diagonal(combined, np.maximum(np.diag(combined), statistical**2))
    return Errors(statistical, combined, np.abs(apart))


def errors_strained(found: Fit, alone: Fit) -> Errors:
    """Return how sure values are that need sensors or rig far from what is known of them.

    What was declared of them, or the law, is wrong then, and the data do not say which: how far the values stand from
    those found with sensors and rig as they are known (`alone`, without them) is added in quadrature, by as much as
    that is sure (`Coordinate.suspicion`).
    """
    errors = errors_of(found)
    apart = np.zeros(len(found.point))
    apart[: len(alone.point)] = suspected(found) * (found.point[: len(alone.point)] - alone.point)
    return Errors(errors.statistical, errors.combined + np.outer(apart, apart), np.abs(apart))


def _by_noise(found: Fit, gain: FloatArray) -> FloatArray:
    """Variance (n,) by the sensors' noise, or by the scatter of single cycles where that is larger.

    Each part of the cycles is carried through the fit that the others would ask for: the weights of a fit are found
    from all of them, and let these cycles scatter too little.
    """
    observed = found.observed
    if not observed.left_out:
        return np.asarray(found.excess * (gain**2).sum(axis=1))
    white = gain @ observed.whitener
    sensor = observed.sensor * (white**2).sum(axis=1)
    weight = 1.0 / math.sqrt(found.excess)
    slopes: FloatArray = np.asarray(weight * np.linalg.solve(observed.whitener, found.jacobian), dtype=np.float64)
    gains = (_gain(slopes, covariance, found.hold) for _, covariance in observed.left_out)
    moved = weight * np.concatenate([part @ g.T for (part, _), g in zip(observed.left_out, gains, strict=True)])
    freedom = len(moved) - 1.0
    scatter = (moved**2).sum(axis=0) / freedom / observed.used * variance_inflation(moved) * student(freedom)
    return np.asarray(np.maximum(sensor, scatter) + np.einsum("ij,jk,ik->i", white, observed.of_base, white))


def _gain(slopes: FloatArray, covariance: FloatArray, hold: FloatArray) -> FloatArray:
    """What a fit makes of data: coordinates (n, 2 K) over harmonics, priors counted."""
    weighed = np.linalg.solve(covariance, slopes)
    return np.asarray(np.linalg.solve(slopes.T @ weighed + np.diag(hold), weighed.T))


def _by_misfit(found: Fit, gain: FloatArray) -> FloatArray:
    """Variance (n,) by what the law cannot explain, harmonic by harmonic (HC3)."""
    hat = found.jacobian @ gain
    leverage = np.clip(np.diag(hat), 0.0, 0.9)
    return np.asarray(((gain * (found.residual / (1.0 - leverage))) ** 2).sum(axis=1))
