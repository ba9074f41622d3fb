"""The fit of a law to a whole record: the same coordinates and priors as for a cycle, another error model.

What the law leaves of a record hangs together over many samples, so a sample counts only as much as the residual's own
correlation allows: its variance is multiplied by the integrated autocorrelation time. Beside the curvature, errors are
taken from the scores of single cycles (a sandwich over cycles), and the larger counts. The noise of the base's sensor
is added to them: the simulation is driven by the measured base, so its noise shakes the mass, near resonance much.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from frictionlab.errors import AnalysisError
from frictionlab.identification.coordinates import point_of, strain_slopes, strains
from frictionlab.identification.fit import Errors, Fit
from frictionlab.identification.forward import Forward
from frictionlab.identification.observed import Observed
from frictionlab.identification.track import RecordForward

FloatArray = NDArray[np.float64]
ROUNDS = 3  # of weighing the residual by what it is
MOST_STEPS = 40
RUNS = 150  # simulated for one fit, about
SHAKES = 30  # simulated with noise on the base: errors are known to a seventh
FEW_SHAKES = 6  # to see how much of the residual is that noise
FAR = 10.0  # residual of values without a motion, over the record's rms
SMALLEST = 1e-9  # of the record's rms: no sensor is better


def fit_record(forward: RecordForward, observed: Observed, starts: Sequence[Mapping[str, float]]) -> Fit:
    """Return the best fit of a law to a record, as a fit of the cycle's kind.

    Raises
    ------
    AnalysisError
        No starting point has a motion.
    """
    forward.prepare(RUNS)
    noise = max(forward.track.noise, SMALLEST * forward.track.rms)
    points = [_inside(forward, point_of(forward.coordinates, start)) for start in starts]
    costs = [_misfit(forward, point) for point in points]
    best = points[int(np.argmin(costs))]
    if not math.isfinite(min(costs)):
        raise AnalysisError(f"record: law {forward.family.law.name} has no motion at the values tried")
    spread, shaken = math.sqrt(min(costs)), 0.0
    for turn in range(ROUNDS):
        best = _followed(forward, best, max(noise, spread))
        residual = _residual(forward, best)
        shaken = shaken_power(forward, best) if turn == 0 else shaken
        before, spread = spread, spread_of(residual, noise, shaken)
        if abs(spread / before - 1.0) < 0.05:
            break
    here = forward.track.mass - residual
    jacobian = forward.jacobian(best, here) / noise
    return Fit(
        Forward(forward.family, forward.coordinates, observed.harmonics),
        observed,
        best,
        residual / noise,
        jacobian,
        (spread / noise) ** 2,
    )


def _inside(forward: RecordForward, point: FloatArray) -> FloatArray:
    return np.maximum(point, [c.low for c in forward.coordinates])


def _misfit(forward: RecordForward, point: FloatArray) -> float:
    predicted = forward.predict(point)
    if predicted is None:
        return math.inf
    gap = forward.track.mass - predicted
    return float(np.var(gap))  # the offset is free


def _residual(forward: RecordForward, point: FloatArray) -> FloatArray:
    predicted = forward.predict(point)
    if predicted is None:
        raise AnalysisError(f"record: law {forward.family.law.name} has no motion at the best values found")
    return np.asarray(forward.track.mass - predicted)


def _followed(forward: RecordForward, start: FloatArray, spread: float) -> FloatArray:
    """Least squares from a starting point, each sample of a standard deviation, each coordinate of one."""
    mass = forward.track.mass
    far = np.full(len(mass), FAR * forward.track.rms / spread)

    def residuals(point: FloatArray) -> FloatArray:
        predicted = forward.predict(point)
        gap = far if predicted is None else (mass - predicted) / spread
        return np.concatenate([gap, strains(forward.coordinates, point)])

    def slopes(point: FloatArray) -> FloatArray:
        here, held = forward.predict(point), np.diag(strain_slopes(forward.coordinates, point))
        if here is None:
            return np.vstack([np.zeros((len(mass), len(point))), held])
        return np.vstack([-forward.jacobian(point, here) / spread, held])

    low = np.array([c.low for c in forward.coordinates])
    found = least_squares(
        residuals, np.maximum(start, low + 1e-9), slopes, bounds=(low - 1e-12, np.inf), max_nfev=MOST_STEPS, xtol=1e-8
    )
    return np.asarray(np.maximum(np.where(found.x - low < 1e-6, low, found.x), low))


def shaken_power(forward: RecordForward, point: FloatArray) -> float:
    """The most that the noise left in the base adds to the residual's mean square, in a few draws."""
    changes = forward.shaken(point, FEW_SHAKES)
    return float(np.mean(changes**2, axis=1).max()) if len(changes) else 0.0


def spread_of(residual: FloatArray, noise: float, shaken: float = 0.0) -> float:
    """Standard deviation that one sample counts with: the noise's, or the residual's times what hangs together.

    `shaken`: mean square that the base's noise may add; its share of the errors is counted by itself.
    """
    about = residual - residual.mean()
    variance = float(np.mean(about**2))
    n = len(residual)
    if variance <= noise**2 * (1.0 + 3.0 * math.sqrt(2.0 / n)) + shaken:
        return noise
    return math.sqrt(max(variance * together(about), noise**2))


def together(about: FloatArray) -> float:
    """Integrated autocorrelation time in samples: 1 + 2 sum rho, up to where rho first vanishes [Geyer 1992].

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal(4000)
    >>> bool(together(white) < 1.2), bool(together(np.repeat(white, 10)) > 8.0)
    (True, True)
    """
    n = len(about)
    size = 1 << (2 * n - 1).bit_length()
    power = np.abs(np.fft.rfft(about, size)) ** 2
    rho = np.fft.irfft(power, size)[: n // 2]
    rho = rho / rho[0]
    below = np.flatnonzero(rho <= 0.0)
    end = int(below[0]) if len(below) else len(rho)
    return max(1.0, 1.0 + 2.0 * float(rho[1:end].sum()))


def errors_of_record(found: Fit, forward: RecordForward) -> Errors:
    """Return how sure the coordinates are: by the curvature, the scores of single cycles, and the base's noise."""
    per_period = forward.track.per_period
    shaken = forward.shaken(found.point, SHAKES) / max(forward.track.noise, SMALLEST * forward.track.rms)
    names = [c.name for c in found.coordinates]
    law = np.array([c.law for c in found.coordinates])
    own = law | np.isin(names, ("start_displacement", "start_velocity", "offset"))
    joint: FloatArray = np.asarray(np.linalg.inv(found.precision), dtype=np.float64)
    held: FloatArray = np.asarray(np.linalg.inv(found.precision[np.ix_(own, own)]), dtype=np.float64)
    if found.excess > 1.0:
        joint = _larger(joint, _by_cycles(found, joint, np.ones(len(own), dtype=bool), per_period))
        held = _larger(held, _by_cycles(found, held, own, per_period))
    joint = joint + _by_base(found, np.ones(len(own), dtype=bool), shaken)
    held = held + _by_base(found, own, shaken)
    statistical = np.zeros(len(own))
    statistical[own] = np.sqrt(np.diag(held))
    return Errors(np.where(law, statistical, 0.0), _larger(joint, np.diag(statistical**2)))


def _by_cycles(found: Fit, covariance: FloatArray, used: NDArray[np.bool_], per_period: int) -> FloatArray:
    """Covariance by the scatter of the cycles' own scores: H^-1 (sum g g') H^-1, each g of one cycle."""
    n = len(found.residual)
    blocks = n // per_period
    if blocks < 4:
        return np.zeros_like(covariance)
    whole = blocks * per_period
    scores = found.jacobian[:whole, used] * (found.residual[:whole, None] / found.excess)
    each = scores.reshape(blocks, per_period, -1).sum(axis=1)
    few = blocks / (blocks - 1.0) * (blocks - 1.0) / max(blocks - 3.0, 1.0)
    return np.asarray(covariance @ (each.T @ each * few) @ covariance)


def _by_base(found: Fit, used: NDArray[np.bool_], shaken: FloatArray) -> FloatArray:
    """Covariance by what the base's noise does to the record: mean square of the shifts it makes in the fit."""
    count = int(used.sum())
    if not len(shaken):
        return np.zeros((count, count))
    covariance = np.linalg.inv(found.precision[np.ix_(used, used)])
    shifts = shaken @ found.jacobian[:, used] @ covariance / found.excess
    return np.asarray(shifts.T @ shifts / len(shaken))


def _larger(one: FloatArray, other: FloatArray) -> FloatArray:
    """The first covariance, its variances raised to those of the other where these are larger."""
    up = np.sqrt(np.maximum(np.diag(other) / np.diag(one), 1.0))
    return np.asarray(one * np.outer(up, up))
