"""One fit for any number of parameters: least squares on the cycle, with priors, nuisances and one error model.

The misfit is whitened by the covariance of the measured mean cycle; each coordinate adds its prior as one more
residual. Errors come from three sides, and the largest counts: the sensors' noise, the scatter of single cycles carried
through the fit (so that friction which changes from cycle to cycle is seen as such), and what the law cannot explain
(MacKinnon and White's HC3, harmonic by harmonic). What the nuisances add makes the combined uncertainty.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from frictionlab.errors import AnalysisError
from frictionlab.identification.coordinates import (
    Coordinate,
    holds,
    strains,
    suspicion,
    values_of,
)
from frictionlab.identification.descent import Misfit, Place, descend
from frictionlab.identification.forward import Forward
from frictionlab.identification.observed import Observed
from frictionlab.identification.orthant import log_orthant

FloatArray = NDArray[np.float64]
ROUNDS = 3  # of weighing down what the law cannot explain
LEVEL = 0.01  # of chi-square, beyond which a misfit is no noise
MOST_STEPS = 60
HOPELESS = 4.0  # sum of squares over the best start's, or law's, from which another start is followed no farther
RIVAL = 9.0  # a second valley within so much of chi-square is a rival
STEPS_NOT_RIGID = 30  # of laws that cost more a state, and whose misfit is rough: stiff contacts ring


@dataclass(frozen=True)
class Fit:
    """The best values of a law for one measured cycle.

    Parameters
    ----------
    forward, observed
        What was fitted to what.
    point : ndarray of shape (n,)
        Coordinates of the best values (in deviations of their priors).
    residual : ndarray of shape (2 K,)
        Measured minus predicted, whitened.
    jacobian : ndarray of shape (2 K, n)
        Of the prediction, whitened.
    excess : float
        Chi-square per degree of freedom, at least 1: what the law cannot explain counts as noise.
    """

    forward: Forward
    observed: Observed
    point: FloatArray
    residual: FloatArray
    jacobian: FloatArray
    excess: float

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The unknowns, in order."""
        return self.forward.coordinates

    @property
    def values(self) -> dict[str, float]:
        """Best values by name, nuisances included."""
        return values_of(self.coordinates, self.point)

    @property
    def law_values(self) -> dict[str, float]:
        """Best values of what the law's problem takes: its parameters, and the frame's damping ratio."""
        names = {p.name for p in self.forward.family.law.parameters}
        return {name: value for name, value in self.values.items() if name in names}

    @property
    def nrmse(self) -> float:
        """Rms of measured minus predicted over the rms of the measured, in the harmonics kept."""
        return self.observed.nrmse(np.asarray(np.linalg.solve(self.observed.whitener, self.residual)))

    @property
    def chi_square(self) -> float:
        """Sum of squares of the whitened residual."""
        return float(self.residual @ self.residual)

    @property
    def cost(self) -> float:
        """What was made least: chi-square, and what the priors add."""
        return self.chi_square / self.excess + self.strain

    @property
    def strain(self) -> float:
        """What the priors add to the sum of squares."""
        return float((strains(self.coordinates, self.point) ** 2).sum())

    @property
    def hold(self) -> FloatArray:
        """How firmly each prior holds its coordinate (n,) here: 1 but where a prior has tails."""
        return holds(self.coordinates, self.point)

    @property
    def precision(self) -> FloatArray:
        """Inverse of the posterior covariance (n, n), by the curvature."""
        return np.asarray(self.jacobian.T @ self.jacobian / self.excess + np.diag(self.hold))


def fit(
    forward: Forward,
    observed: Observed,
    starts: Sequence[FloatArray],
    *,
    excess: float | None = None,
    most: int | None = None,
) -> Fit:
    """Return the best fit from some starting points.

    Parameters
    ----------
    forward, observed
        What is fitted to what.
    starts : sequence of ndarray of shape (n,)
        Starting points in coordinates; the best of them, by its sum of squares, is followed.
    excess : float, optional
        Variance of the misfit over the noise's; by default it is found, so that the law's own faults are weighed down.
    most : int, optional
        Steps after which a fit is broken off, if they are fewer than usual.

    Raises
    ------
    AnalysisError
        No starting point has a steady state.
    """
    begin = _best_start(forward, observed, starts, 1.0 if excess is None else excess)
    found = _fitted(forward, observed, begin, 1.0 if excess is None else excess, most=most)
    return _tempered(found) if excess is None else found


def followed(found: Fit) -> Fit:
    """Return the best fit from where another was broken off."""
    return _fitted(found.forward, found.observed, found.point, found.excess, found)


def _tempered(found: Fit) -> Fit:
    """The fit whose excess is what it leaves."""
    for _ in range(ROUNDS):
        worse = excess_of(found)
        if worse < 1.1 * found.excess:
            break
        found = _fitted(found.forward, found.observed, found.point, worse, found)
    return found


def fits_from(forward: Forward, observed: Observed, starts: Sequence[FloatArray]) -> list[Fit]:
    """Return the best fits from each start, best first; what misses by far more than the best is not followed.

    Raises
    ------
    AnalysisError
        No starting point has a steady state.
    """
    good = [start for start in starts if math.isfinite(cost(forward, observed, start, 1.0))]
    found = [fit(forward, observed, [start], excess=1.0) for start in good or starts]
    enough = HOPELESS * min(one.cost for one in found) + RIVAL
    fits = [_tempered(one) for one in found if one.cost <= enough]
    excess = min(one.excess for one in fits)
    return sorted(fits, key=lambda one: one.chi_square / excess + one.strain)


def unfitted(forward: Forward, observed: Observed) -> Fit:
    """Return what a law without unknowns says of a measured cycle; where it has no steady state the residual is all."""
    predicted = forward.predict(np.zeros(0))
    gap = observed.cosine_sine - (0.0 if predicted is None else predicted)
    return Fit(forward, observed, np.zeros(0), observed.whitener @ gap, np.zeros((len(gap), 0)), 1.0)


def released(found: Fit, forward: Forward) -> Fit:
    """Return the same fit with sensors and rig beside it, which stand where they are known to be."""
    point = np.concatenate([found.point, np.zeros(len(forward.coordinates) - len(found.point))])
    predicted = forward.predict(point)
    if predicted is None:
        raise AnalysisError(f"law {forward.family.law.name}: the best values found have no steady state")
    jacobian = found.observed.whitener @ forward.jacobian(point, predicted)
    return Fit(forward, found.observed, point, found.residual, jacobian, found.excess)


def excess_of(found: Fit) -> float:
    """Chi-square per degree of freedom, at least 1."""
    free = len(found.residual) - int((np.abs(found.jacobian).max(axis=0) > 1.0).sum())
    return max(1.0, found.chi_square / max(1, free))


def misfit_is_noise(found: Fit) -> bool:
    """Whether what a fit leaves is no more than noise would leave, at the 1 % level of chi-square."""
    return excess_of(found) <= most_of_noise(len(found.residual))


def most_of_noise(points: int) -> float:
    """Return the chi-square per degree of freedom that noise exceeds in 1 of 100 cases only.

    Examples
    --------
    >>> round(most_of_noise(18), 3)
    1.934
    """
    return 2.0 * float(gammaincinv(0.5 * points, 1.0 - LEVEL)) / points


def suspected(found: Fit) -> float:
    """Return how sure it is (0 to 1) that a fit moved sensors and rig for the sake of something else."""
    return suspicion(found.coordinates, found.point)


def _best_start(forward: Forward, observed: Observed, starts: Sequence[FloatArray], excess: float) -> FloatArray:
    costs = [cost(forward, observed, start, excess) for start in starts]
    if not np.isfinite(costs).any():
        r = forward.family.r
        raise AnalysisError(
            f"no friction ratio tried has a steady state at r = {r:g}: near resonance the motion may have no bound;"
            " check the natural frequency (rig.natural_frequency_hz, --natural-frequency)"
        )
    return starts[int(np.argmin(costs))]


def cost(forward: Forward, observed: Observed, point: FloatArray, excess: float) -> float:
    """Return the weighed sum of squares at a point, priors included; infinite where there is no steady state."""
    predicted = forward.predict(point)
    if predicted is None:
        return math.inf
    gap = observed.whitener @ (observed.cosine_sine - predicted)
    return float(gap @ gap) / excess + float((strains(forward.coordinates, point) ** 2).sum())


def _fitted(
    forward: Forward,
    observed: Observed,
    start: FloatArray,
    excess: float,
    near: Fit | None = None,
    most: int | None = None,
) -> Fit:
    """The best fit from a start; `near`: another fit whose best point it is."""
    whitener, weight = observed.whitener, 1.0 / math.sqrt(excess)
    predict = _remembered(forward)

    def residual(point: FloatArray) -> FloatArray | None:
        predicted = predict(point)
        return None if predicted is None else weight * (whitener @ (observed.cosine_sine - predicted))

    def slopes(point: FloatArray) -> FloatArray:
        predicted = predict(point)
        if predicted is None:
            raise AnalysisError(f"law {forward.family.law.name}: the best values found have no steady state")
        return np.asarray(weight * (whitener @ forward.jacobian(point, predicted)))

    misfit = Misfit(forward.coordinates, residual, slopes)
    begin = _begin(misfit, start) if near is None else _begin_at(near, weight)
    usual = MOST_STEPS if forward.family.law.kind == "rigid" else STEPS_NOT_RIGID
    found = descend(misfit, begin, most=usual if most is None else most)
    return Fit(forward, observed, found.point, found.residual / weight, found.slopes / weight, excess)


def _begin(misfit: Misfit, start: FloatArray) -> Place:
    low, high = (np.array(side) for side in zip(*((c.low, c.high) for c in misfit.coordinates), strict=True))
    point = np.clip(start, low, high)
    residual = misfit.residual(point)
    if residual is None:
        raise AnalysisError("the values that a fit was to begin at have no steady state")
    return Place(point, residual, misfit.slopes(point), strains(misfit.coordinates, point))


def _begin_at(near: Fit, weight: float) -> Place:
    return Place(near.point, weight * near.residual, weight * near.jacobian, strains(near.coordinates, near.point))


def _remembered(forward: Forward) -> Callable[[FloatArray], FloatArray | None]:
    """What a point predicts, remembered for the last two points: slopes are asked for where residuals have been."""
    known: list[tuple[FloatArray, FloatArray | None]] = []

    def predict(point: FloatArray) -> FloatArray | None:
        for there, predicted in known:
            if np.array_equal(there, point):
                return predicted
        known[:] = [*known[-1:], (point.copy(), forward.predict(point))]
        return known[-1][1]

    return predict


def log_evidence(found: Fit) -> float:
    """Logarithm of the evidence, Laplace's approximation about a fit whose excess is 1."""
    precision = found.precision
    _, determinant = np.linalg.slogdet(precision)
    noise = 2.0 * float(np.log(np.diag(found.observed.whitener)).sum())
    total = -0.5 * found.chi_square + 0.5 * noise - 0.5 * found.strain - 0.5 * float(determinant)
    total += sum(c.log_peak for c in found.coordinates) - 0.5 * len(found.residual) * math.log(2.0 * math.pi)
    slope = found.jacobian.T @ found.residual / found.excess - found.point  # of minus the cost, without tails
    return total + half_lines(found.coordinates, found.point, precision, slope)


def half_lines(coordinates: Sequence[Coordinate], point: FloatArray, precision: FloatArray, slope: FloatArray) -> float:
    """Return what coordinates that may only grow from a bound add to a log evidence.

    Those at their bounds have the normal curve's peak beyond: with the slope g there it is at ``point + P g``, and
    higher by ``g P g / 2``. Of the curve about it the part inside all bounds counts, and each half of a prior twice.

    Parameters
    ----------
    coordinates : sequence of Coordinate
    point, slope : ndarray of shape (n,)
        Best values, and the slope of minus the cost there.
    precision : ndarray of shape (n, n)
    """
    folded = np.array([c.folded for c in coordinates], dtype=bool)
    if not folded.any():
        return 0.0
    covariance: FloatArray = np.asarray(np.linalg.inv(precision), dtype=np.float64)
    low = np.array([c.low if c.folded else 0.0 for c in coordinates])
    pushed = np.where(folded & (point - low < 1e-6), np.minimum(slope, 0.0), 0.0)
    beyond = covariance @ pushed
    inside = half_priors(coordinates, point + beyond, covariance)
    return 0.5 * float(pushed @ beyond) + float(inside)


def half_priors(coordinates: Sequence[Coordinate], peak: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return what bounds add to log evidences (...) of normal curves: the part inside of all, each half prior twice.

    Parameters
    ----------
    coordinates : sequence of Coordinate
    peak : ndarray of shape (..., n)
        Where the curve is highest, bounds not counted.
    covariance : ndarray of shape (..., n, n)
    """
    folded = [i for i, c in enumerate(coordinates) if c.folded]
    low = np.array([coordinates[i].low for i in folded])
    some = covariance[..., folded, :][..., folded]
    return log_orthant(peak[..., folded] - low, some) + len(folded) * math.log(2.0)
