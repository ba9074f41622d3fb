"""The fit of a law to a whole record: the same coordinates and priors as for a cycle, another error model.

The simulation is driven by the measured base, so the noise of its sensor shakes the mass, near resonance much. Where
the law leaves no more than the noise of both sensors, a record is weighed by what makes that noise white (`colour`).
What a law leaves beyond noise hangs together over many samples: a sample then counts only as much as the residual's own
correlation allows, its variance is multiplied by the integrated autocorrelation time, and errors are taken from the
scores of single cycles too (a sandwich over cycles): the larger counts. Errors hold what the base's noise does.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from frictionlab.analysis.autocorrelation import student, variance_inflation
from frictionlab.errors import AnalysisError
from frictionlab.identification.colour import Whitener, white, whitener_of
from frictionlab.identification.coordinates import point_of, strain_slopes, strains
from frictionlab.identification.fit import Fit, suspected
from frictionlab.identification.fit_errors import Errors
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
OF_THE_START = ("start_displacement", "start_velocity", "offset")
HELD_TRIES = 2  # starts that are followed with sensors and rig held
SMALLEST = 1e-9  # of the record's rms: no sensor is better


@dataclass(frozen=True)
class RecordFit(Fit):
    """The best values of a law for one record.

    ``gap`` (n,): measured minus predicted, over Y; ``whitener``: what made residual and jacobian of it; ``noise``: rms
    of the mass's sensor.
    """

    gap: FloatArray
    whitener: Whitener
    noise: float


def fit_record(
    forward: RecordForward,
    observed: Observed,
    starts: Sequence[Mapping[str, float]],
    *,
    weighs: bool = True,
    tries: int = 1,
) -> RecordFit:
    """Return the best fit of a law to a record, as a fit of the cycle's kind.

    `weighs`: whether the noise is made white, where there is nothing but noise; a start alone does not need it.
    `tries`: so many of the best starts are followed at most, until one leaves nothing but noise.

    Raises
    ------
    AnalysisError
        No starting point has a motion.
    """
    forward.prepare(RUNS)
    noise = max(forward.track.noise, SMALLEST * forward.track.rms)
    points = [_inside(forward, point_of(forward.coordinates, start)) for start in starts]
    costs = [_misfit(forward, point) for point in points]
    if not math.isfinite(min(costs)):
        raise AnalysisError(f"record: law {forward.family.law.name} has no motion at the values tried")
    best, spread = points[0], math.inf
    for i in np.argsort(costs)[:tries]:
        if math.isfinite(costs[i]):
            there = _weighed(forward, points[i], noise, math.sqrt(costs[i]))
            best, spread = min(((best, spread), there), key=lambda found: found[1])
        if spread == noise:
            break
    whitener = white(noise)
    if spread == noise and weighs:
        whitener = whitener_of(noise, forward.shaken(best, SHAKES))
        best = _followed(forward, best, whitener)
    gap = _residual(forward, best)
    return RecordFit(
        Forward(forward.family, forward.coordinates, observed.harmonics),
        observed,
        best,
        whitener(gap),
        whitener(forward.jacobian(best, forward.track.mass - gap)),
        (spread / noise) ** 2,
        gap=gap,
        whitener=whitener,
        noise=noise,
    )


def _weighed(forward: RecordForward, point: FloatArray, noise: float, spread: float) -> tuple[FloatArray, float]:
    """Follow the fit with all samples alike, and find what one of them counts with: the noise, if that is all."""
    shaken = 0.0
    for turn in range(ROUNDS):
        point = _followed(forward, point, white(max(noise, spread)))
        gap = _residual(forward, point)
        shaken = shaken_power(forward, point) if turn == 0 else shaken
        before, spread = spread, spread_of(gap, noise, shaken)
        if abs(spread / before - 1.0) < 0.05:
            break
    return point, spread


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


def _followed(forward: RecordForward, start: FloatArray, whitener: Whitener) -> FloatArray:
    """Least squares from a starting point, of the whitened residual; each coordinate counts with its prior."""
    mass = forward.track.mass
    far = np.full(len(mass), FAR * forward.track.rms * abs(float(whitener.taps[0])))

    def residuals(point: FloatArray) -> FloatArray:
        predicted = forward.predict(point)
        gap = far if predicted is None else whitener(mass - predicted)
        return np.concatenate([gap, strains(forward.coordinates, point)])

    def slopes(point: FloatArray) -> FloatArray:
        here, held = forward.predict(point), np.diag(strain_slopes(forward.coordinates, point))
        if here is None:
            return np.vstack([np.zeros((len(mass), len(point))), held])
        return np.vstack([-whitener(forward.jacobian(point, here)), held])

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


def errors_of_record(found: RecordFit, forward: RecordForward) -> Errors:
    """Return how sure the coordinates are: by both sensors' noise, the scores of single cycles, and the priors."""
    per_period = forward.track.per_period
    names = [c.name for c in found.coordinates]
    law = np.array([c.law for c in found.coordinates])
    own = law | np.isin(names, OF_THE_START)
    shakes = forward.shaken(found.point, SHAKES)
    joint = _covariance(found, np.ones(len(own), dtype=bool), shakes, per_period)
    statistical = np.zeros(len(own))
    statistical[own] = np.sqrt(np.diag(_covariance(found, own, shakes, per_period)))
    return Errors(np.where(law, statistical, 0.0), _larger(joint, np.diag(statistical**2)))


def errors_held(found: RecordFit, forward: RecordForward, starts: Sequence[Mapping[str, float]]) -> Errors:
    """Return the errors of a record's fit; where it needs sensors or rig far from what is known of them, more.

    What was declared of them, or the law, is wrong then: how far the law's values stand from those found with sensors
    and rig as they are known, from the best of some starts, is added in quadrature.
    """
    errors = errors_of_record(found, forward)
    sure = suspected(found)
    if not sure:
        return errors
    plain = replace(forward, coordinates=tuple(c for c in forward.coordinates if c.law or c.name in OF_THE_START))
    try:
        alone = fit_record(plain, found.observed, (found.values, *starts), weighs=False, tries=HELD_TRIES)
    except AnalysisError:
        return errors  # no motion with sensors and rig as known: that they were moved is warned of
    known, told = alone.values, zip(found.coordinates, found.point.tolist(), strict=True)
    apart = sure * np.array([point - c.at(known[c.name]) if c.law else 0.0 for c, point in told])
    return Errors(errors.statistical, errors.combined + np.outer(apart, apart), np.abs(apart))


def _covariance(found: RecordFit, used: NDArray[np.bool_], shakes: FloatArray, per_period: int) -> FloatArray:
    """Covariance of some coordinates, the others held: noise carried through the fit, and what the priors add."""
    posterior: FloatArray = np.asarray(np.linalg.inv(found.precision[np.ix_(used, used)]), dtype=np.float64)
    gain = found.whitener.transposed(found.jacobian[:, used] @ posterior) / found.excess  # (n, m): values over the gap
    covariance = found.excess * found.noise**2 * gain.T @ gain + posterior * found.hold[used] @ posterior
    if found.excess > 1.0:
        covariance = _larger(covariance, _by_cycles(found, gain, per_period))
    if len(shakes):
        moved = shakes @ gain
        covariance = covariance + moved.T @ moved / len(moved)
    return np.asarray(covariance)


def _by_cycles(found: RecordFit, gain: FloatArray, per_period: int) -> FloatArray:
    """Covariance by the scatter of what single cycles do to the values; neighbours that hang together count as fewer.

    Friction that wanders slowly leaves many cycles in a row on one side.
    """
    n, count = gain.shape
    blocks = n // per_period
    if blocks < 4:
        return np.zeros((count, count))
    whole = blocks * per_period
    each = (gain[:whole] * found.gap[:whole, None]).reshape(blocks, per_period, count).sum(axis=1)
    few = blocks / max(blocks - 3.0, 1.0)
    hang = np.sqrt(np.maximum(variance_inflation(each) * student(blocks - 1.0), 1.0))
    return np.asarray(each.T @ each * few * np.outer(hang, hang))


def _larger(one: FloatArray, other: FloatArray) -> FloatArray:
    """The first covariance, its variances raised to those of the other where these are larger."""
    up = np.sqrt(np.maximum(np.diag(other) / np.diag(one), 1.0))
    return np.asarray(one * np.outer(up, up))
