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
from scipy.optimize import least_squares
from scipy.special import gammaincinv

from frictionlab.errors import AnalysisError
from frictionlab.identification.coordinates import Coordinate, doubts, holds, strain_slopes, strains, values_of
from frictionlab.identification.forward import Forward
from frictionlab.identification.neighbours import raised_by
from frictionlab.identification.observed import Observed
from frictionlab.identification.orthant import log_orthant

FloatArray = NDArray[np.float64]
FAR = 1e3  # residual of values that have no steady state, over the measured cycle
ROUNDS = 3  # of weighing down what the law cannot explain
LEVEL = 0.01  # of chi-square, beyond which a misfit is no noise
MOST_STEPS = 60
PRESSED = 3.0  # deviations from what is known of sensors and rig at which a nuisance is told
STEPS_NOT_RIGID = 15  # of laws that cost more a state, and whose misfit is rough: stiff contacts ring


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


def fit(forward: Forward, observed: Observed, starts: Sequence[FloatArray], *, excess: float | None = None) -> Fit:
    """Return the best fit from some starting points.

    Parameters
    ----------
    forward, observed
        What is fitted to what.
    starts : sequence of ndarray of shape (n,)
        Starting points in coordinates; the best of them, by its sum of squares, is followed.
    excess : float, optional
        Variance of the misfit over the noise's; by default it is found, so that the law's own faults are weighed down.

    Raises
    ------
    AnalysisError
        No starting point has a steady state.
    """
    if excess is not None:
        return _fitted(forward, observed, _best_start(forward, observed, starts, excess), excess)
    found = _fitted(forward, observed, _best_start(forward, observed, starts, 1.0), 1.0)
    for _ in range(ROUNDS):
        worse = excess_of(found)
        if worse < 1.1 * found.excess:
            break
        found = _fitted(forward, observed, found.point, worse)
    return found


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


def strained(found: Fit) -> list[tuple[Coordinate, float]]:
    """Return what is known of sensors and rig that a fit had to push far, each with the distance in its deviations."""
    told = zip(found.coordinates, found.point.tolist(), strict=True)
    return [(c, far) for c, far in told if not c.law and abs(far) > PRESSED]


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


def _fitted(forward: Forward, observed: Observed, start: FloatArray, excess: float) -> Fit:
    whitener, weight = observed.whitener, 1.0 / math.sqrt(excess)
    far = FAR * (whitener @ observed.cosine_sine)
    predict = _remembered(forward)

    def residuals(point: FloatArray) -> FloatArray:
        predicted = predict(point)
        gap = far if predicted is None else whitener @ (observed.cosine_sine - predicted)
        return np.concatenate([weight * gap, strains(forward.coordinates, point)])

    def slopes(point: FloatArray) -> FloatArray:
        here, held = predict(point), np.diag(strain_slopes(forward.coordinates, point))
        if here is None:
            return np.vstack([np.zeros((len(far), len(point))), held])
        return np.vstack([-weight * (whitener @ forward.jacobian(point, here)), held])

    low, high = (np.array(side) for side in zip(*((c.low, c.high) for c in forward.coordinates), strict=True))
    most = MOST_STEPS if forward.family.law.kind == "rigid" else STEPS_NOT_RIGID
    found = least_squares(
        residuals,
        np.clip(start, low + 1e-9, high - 1e-9),
        slopes,
        bounds=(low - 1e-12, high),
        max_nfev=most,
        xtol=1e-10,
    )
    point = np.maximum(np.where(found.x - low < 1e-6, low, found.x), low)
    predicted = predict(point)
    if predicted is None:
        point = found.x
        predicted = predict(point)
    if predicted is None:
        raise AnalysisError(f"law {forward.family.law.name}: the best values found have no steady state")
    jacobian = whitener @ forward.jacobian(point, predicted)
    return Fit(forward, observed, point, whitener @ (observed.cosine_sine - predicted), jacobian, excess)


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
    ``1 - K J`` is the posterior covariance P, so that the nuisance k adds ``P[i, k]`` to the coordinate i. A prior with
    tails holds as a normal one with its weight at the best values; the truth may be farther off (`Coordinate.doubt`).
    """
    law = np.array([c.law for c in found.coordinates], dtype=bool)
    joint = np.linalg.inv(found.precision)
    noise = noise_of(found)
    own = (joint[:, law] ** 2).sum(axis=1)
    pulled = joint * doubts(found.coordinates, found.point)
    return Errors(np.where(law, np.sqrt(np.diag(noise) + own), 0.0), noise + pulled @ pulled.T)


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
    those found with sensors and rig as they are known (`alone`, without them) is added in quadrature.
    """
    errors = errors_of(found)
    apart = np.zeros(len(found.point))
    apart[: len(alone.point)] = found.point[: len(alone.point)] - alone.point
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
    scatter = (moved**2).sum(axis=0) / (len(moved) - 1.0) / observed.used * raised_by(moved)
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
