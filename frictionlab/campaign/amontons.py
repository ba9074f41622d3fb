"""Amontons' law across the campaign: whether the friction coefficient is the same under every normal force."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from frictionlab.campaign.friction import FrictionFit
from frictionlab.campaign.joint_fit import JointFit
from frictionlab.campaign.prediction import RIG
from frictionlab.estimate import Estimate, welch

SIGNIFICANT = 0.05


@dataclass(frozen=True)
class AmontonsTest:
    """One material's coefficients over normal force.

    ``coefficient`` and its error: the mean over forces; ``chi_square`` about it with ``freedom`` degrees; ``p``: how
    often a constant coefficient would look at least this uneven; ``exponent``: of coefficient ~ force^exponent, with
    its standard error; ``verdict``: all of it in words. ``None`` is not known.
    """

    material: str
    forces: int
    coefficient: float | None
    coefficient_se: float | None
    chi_square: float | None
    freedom: int
    p: float | None
    exponent: float | None
    exponent_se: float | None
    verdict: str

    @property
    def holds(self) -> bool | None:
        """Whether the coefficient may be constant; None where nothing can be said."""
        return None if self.p is None else self.p >= SIGNIFICANT


def amontons(
    material: str, fits: Sequence[FrictionFit], joint: JointFit | None = None, stiffness: float | None = None
) -> AmontonsTest:
    """Test whether a material's friction coefficient is constant over normal force.

    The weighted sum of squares about the weighted mean is chi-square distributed if each error is well known; each
    comes from a few tests only, so p is taken from Welch's F [Welch 1951], which is chi-square over its degrees of
    freedom in the limit of many tests. Where the tests were fitted together, the errors of the coefficients and what
    they have in common are those of the joint fit, and its tests less its groups tell their scatter.
    """
    known = [f for f in fits if f.friction_coefficient is not None and f.friction_coefficient_se]
    if not known:
        why = "no coefficient is known"
        return AmontonsTest(material, 0, None, None, None, 0, None, None, None, f"{material}: {why}.")
    value = np.array([f.friction_coefficient for f in known], dtype=float)
    error = _apart(known, value)
    together = None if joint is None else _together(known, joint, value)
    force = np.array([f.normal_force_n for f in known])
    weight = error**-2.0
    mean = float(np.sum(weight * value) / weight.sum())
    square = float(np.sum(weight * (value - mean) ** 2))
    freedom = len(known) - 1
    stretch = max(1.0, math.sqrt(square / freedom)) if freedom else 1.0
    mean_error = math.hypot(stretch / math.sqrt(float(weight.sum())), _common_uncertainty(known))
    p = welch(square, weight, np.array([max(f.freedom, 1) for f in known])) if freedom else None
    if together is not None and freedom:
        square = _square(value, together)
        p = float(stats.f.sf(square / freedom, freedom, max(known[0].freedom, 1)))
    shared = None if joint is None else joint.coefficient(material, stiffness)
    if shared is not None and shared.value is not None:
        mean, mean_error = shared.value, math.hypot(shared.u or 0.0, shared.value * _by_rig(known))
    exponent, exponent_error = _exponent(force, value, error) if freedom else (None, None)
    words = _words(material, mean, mean_error, square, freedom, p, exponent, exponent_error)
    return AmontonsTest(
        material, len(known), mean, mean_error, square if freedom else None, freedom, p, exponent, exponent_error, words
    )


def _by_rig(fits: Sequence[FrictionFit]) -> float:
    """Relative uncertainty that stiffness, base sensor and normal force add to that of the friction ratio."""
    beyond = [_relative(f.coefficient) ** 2 - _relative(f.ratio) ** 2 for f in fits]
    return math.sqrt(max(0.0, *beyond))


def _relative(number: Estimate) -> float:
    return (number.u or 0.0) / (number.value or 1.0)


def _together(fits: Sequence[FrictionFit], joint: JointFit, value: np.ndarray) -> np.ndarray | None:
    """Covariance of the coefficients by the joint fit, and each normal force's own error; None if one is not of it."""
    relative = joint.relative_covariance(fits[0].material, [f.normal_force_n for f in fits])
    if relative is None:
        return None
    return np.asarray((relative + np.diag([f.normal_force_u**2 for f in fits])) * np.outer(value, value))


def _square(value: np.ndarray, covariance: np.ndarray) -> float:
    """Chi-square of values about their best mean."""
    weight = np.linalg.inv(covariance)
    mean = float(weight.sum(axis=0) @ value / weight.sum())
    return float((value - mean) @ weight @ (value - mean))


def _apart(fits: Sequence[FrictionFit], value: np.ndarray) -> np.ndarray:
    """Errors that make coefficients differ from force to force.

    Their own, the normal force's (each is set for itself), and what shared sources do to one force more than to others.
    """
    shifts = np.array([[f.shares.get(source, 0.0) for source in RIG] for f in fits])
    uneven = np.square(shifts - shifts.mean(axis=0)).sum(axis=1)
    own = np.array([f.friction_coefficient_se for f in fits], dtype=float)
    normal = np.array([f.normal_force_u for f in fits])
    return np.asarray(np.sqrt(own**2 + value**2 * (normal**2 + uneven)))


def _common_uncertainty(fits: Sequence[FrictionFit]) -> float:
    """What sensors and rig do to all coefficients alike; the normal forces' errors are in each already."""
    beyond = [
        (f.coefficient.u or 0.0) ** 2
        - (f.friction_coefficient_se or 0.0) ** 2
        - (f.normal_force_u * (f.friction_coefficient or 0.0)) ** 2
        for f in fits
    ]
    return math.sqrt(max(0.0, math.fsum(beyond) / len(beyond)))


def _exponent(force: np.ndarray, value: np.ndarray, error: np.ndarray) -> tuple[float, float]:
    """Slope of ln(coefficient) over ln(force), weighted; its error includes the scatter about the line."""
    weight = (value / error) ** 2
    x, y = np.log(force), np.log(value)
    about = x - np.sum(weight * x) / weight.sum()
    spread = float(np.sum(weight * about**2))
    slope = float(np.sum(weight * about * y)) / spread
    left = y - np.sum(weight * y) / weight.sum() - slope * about
    stretch = math.sqrt(float(np.sum(weight * left**2)) / (len(x) - 2)) if len(x) > 2 else 1.0
    return slope, max(1.0, stretch) / math.sqrt(spread)


def _words(
    material: str,
    mean: float,
    error: float,
    square: float,
    freedom: int,
    p: float | None,
    exponent: float | None,
    exponent_error: float | None,
) -> str:
    about = f"mean coefficient {Estimate(mean, error)}"
    if p is None or exponent is None or exponent_error is None:
        return f"{material}: measured under one normal force only, so Amontons' law is not tested; {about}."
    proof = f"chi-square {square:.3g} on {freedom} degrees of freedom, p = {_p(p)}"
    if p >= SIGNIFICANT:
        return (
            f"{material}: the friction coefficient may be the same under all {freedom + 1} normal forces, as Amontons'"
            f" law says ({proof}); {about}."
        )
    way = "falls" if exponent < 0 else "rises"
    clear = abs(exponent) > 2 * exponent_error
    trend = (
        f"it {way} with normal force, by {abs(2**exponent - 1):.1%} at each doubling"
        if clear
        else "it varies without a clear trend over normal force"
    )
    return f"{material}: the friction coefficient is not constant over normal force ({proof}): {trend}; {about}."


def _p(p: float) -> str:
    return f"{p:.2g}" if p >= 1e-4 else "less than 0.0001"
