"""A whole record over its prediction from the first sample, period by period, and its friction over time.

A small change of beta during a period moves the record by its sensitivity dx/dbeta there; the residual shows how large
it was. The changes are smoothed as a random walk from period to period, whose step is the one that makes the values
most likely (Kalman's filter; Rauch, Tung and Striebel 1965). A motion needs some periods to follow (near resonance
many): what friction did shows so much later, and is put where it happened. Where friction changes by more than a
little, the record is simulated at several friction ratios.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError
from frictionlab.inference.comparison import WholeRecord
from frictionlab.inference.record import RecordObservation, spread_of
from frictionlab.simulator.record import BaseRecord, motion_under

Periods = NDArray[np.intp]
STEPS = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 41)])  # of the walk, over beta, that are tried
WIDE = 10.0  # over beta: what is known of the first value
SMALL = 1e-3  # relative change of beta for its derivative
LINEAR, UNTOLD = 0.5, 10.0  # times beta: the largest change that is believed, and the error where none is
SHAKES = 10  # draws of the base's noise, for what it does to single periods
BAD = 3.0  # times the usual rms of what is left of a period, from which its own counts
SETTLES = 200  # periods, at most, that a motion is followed after a step of friction
GRID = (-2.0, -1.0, 0.0, 1.0, 2.0)  # friction ratios simulated where it changes, in rms of its changes
NOTABLE = 3e-3  # relative rms of the changes from which one derivative does not do
LEAVES = 2.0  # times the usual misfit of a period at which the prediction has left the measurement
NOISE = 3.0  # times the sensor's noise, at least
FEW = 3  # periods, at most, that show no usual one
CALM = 3  # periods below that end such a stretch


def follow(observation: RecordObservation, values: Mapping[str, float], *, fits_start: bool) -> WholeRecord:
    """Return the record over its prediction at some values; its start is fitted where it was not.

    AnalysisError: the law has no motion under the measured base at these values.
    """
    from scipy.integrate import cumulative_trapezoid  # noqa: PLC0415 - for whole records alone

    if fits_start:
        values = {**values, **_fitted_start(observation, values)}
    predicted = observation.predict(values)
    if predicted is None:
        raise AnalysisError(f"record: law {observation.law.name} has no motion at the values found")
    friction = friction_over_time(observation, values, predicted)
    time, gap = observation.time, observation.data - predicted
    edges = np.minimum(observation.period * np.arange(observation.periods + 1), time[-1])
    area, area_predicted = (  # what the loop takes in (2.18), from the first sample to each
        cumulative_trapezoid(observation.base, mass, initial=0) for mass in (observation.data, predicted)
    )
    power = cumulative_trapezoid(gap**2, time, initial=0)
    each = np.sqrt(np.diff(np.interp(edges, time, power)) / np.diff(edges)) / observation.rms
    limit = math.inf
    if len(each) > FEW:
        limit = max(LEAVES * float(np.median(each)), NOISE * observation.noise / observation.rms)
    out, starts = np.flatnonzero(each > limit), observation.begin + edges
    apart = [p for p in np.split(out, np.flatnonzero(np.diff(out) > CALM) + 1) if len(p)]  # a short calm ends none
    return WholeRecord(
        time=observation.begin + time,
        base=observation.base,
        measured=observation.data,
        predicted=predicted,
        nrmse=math.sqrt(float(np.mean(gap**2))) / observation.rms,
        energy_difference=float(area_predicted[-1] / area[-1] - 1.0),
        cycle_time=starts[:-1],
        cycle_measured=np.diff(np.interp(edges, time, area)),
        cycle_predicted=np.diff(np.interp(edges, time, area_predicted)),
        cycle_nrmse=each,
        cycle_friction=friction.values,
        cycle_friction_se=friction.errors,
        wanders=friction.sure,
        left=tuple((float(starts[p[0]]), float(starts[p[-1] + 1]), float(each[p].max())) for p in apart),
    )


def _fitted_start(observation: RecordObservation, values: Mapping[str, float]) -> dict[str, float]:
    """Where and how fast the mass begins, by least squares, all else given."""
    from scipy.optimize import least_squares  # noqa: PLC0415 - for whole records alone

    names = tuple(observation.start)
    far = np.full(len(observation.data), 10.0 * observation.rms)

    def residual(point: FloatArray) -> FloatArray:
        predicted = observation.predict({**values, **dict(zip(names, point.tolist(), strict=True))})
        return far if predicted is None else observation.data - predicted

    begun = [values[name] for name in names]
    found = least_squares(residual, begun, method="trf", max_nfev=25, diff_step=[1e-6] * len(begun))
    return dict(zip(names, found.x.tolist(), strict=True))


@dataclass(frozen=True)
class Walk:
    """A random walk: its values (c,), their errors (c,), its step from one to the next.

    ``sure``: logarithm of how much more likely what was seen is than if nothing changed.
    """

    values: FloatArray
    errors: FloatArray
    step: float
    sure: float


def walk(values: FloatArray, errors: FloatArray, size: float) -> Walk:
    """Return the smoothed walk behind values (c,) seen with errors (c,); ``size``: what its step is over (beta)."""

    def filtered(step: float) -> tuple[float, FloatArray, FloatArray]:  # log-likelihood, means and variances (c,)
        mean, variance, likelihood = 0.0, (WIDE * size) ** 2, 0.0
        means, variances = np.zeros(len(values)), np.zeros(len(values))
        for c, (value, error) in enumerate(zip(values, errors, strict=True)):
            variance += step**2 if c else 0.0
            total = variance + error**2
            likelihood -= 0.5 * (math.log(total) + (value - mean) ** 2 / total)
            mean += variance / total * (value - mean)
            variance *= error**2 / total
            means[c], variances[c] = mean, variance
        return likelihood, means, variances

    tried = {float(step): filtered(float(step)) for step in STEPS * size}
    best = max(tried, key=lambda step: tried[step][0])
    likely, mean, variance = tried[best]
    for c in range(len(values) - 2, -1, -1):
        ahead = variance[c] + best**2
        share = variance[c] / ahead
        mean[c] += share * (mean[c + 1] - mean[c])
        variance[c] += share**2 * (variance[c + 1] - ahead)
    return Walk(mean, np.sqrt(np.maximum(variance, 0.0)), best, float(likely - tried[0.0][0]))


def changes(gap: FloatArray, slope: FloatArray, periods: Periods, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the change of a parameter in each of c periods (c,), by least squares, and the weight <s, s> of each.

    ``gap``, ``slope`` (n,): measured minus predicted, and the prediction's derivative by the parameter; ``periods``
    (n,): number of the period that each sample is in, from 0.
    """
    weight = np.asarray(np.bincount(periods, slope * slope, minlength=count)[:count], dtype=np.float64)
    moved = np.asarray(np.bincount(periods, slope * gap, minlength=count)[:count], dtype=np.float64)
    return moved / np.maximum(weight, 1e-300), weight


def friction_over_time(observation: RecordObservation, values: Mapping[str, float], predicted: FloatArray) -> Walk:
    """Return the friction ratio of each period of a record as a random walk about the fitted one.

    Where it changes by more than a little, the record is simulated at some friction ratios, and each period takes the
    derivative at the nearest. What a record does not show (the mass stands) keeps the fitted value, with a wide error.
    The error of a period's change is by both sensors' noise, and by what is left where that is more.
    """
    beta, count, gap = observation.problem(values).beta, observation.periods, observation.data - predicted

    def at(friction: float) -> FloatArray:
        made = observation.predict({**values, "beta": friction})
        return predicted if made is None else made

    def walked(change: FloatArray) -> Walk:
        far = np.abs(change) > LINEAR * beta
        return walk(np.where(far, 0.0, change), np.where(far, UNTOLD * beta, error), beta)

    slope = (at(beta * (1.0 + SMALL)) - predicted) / (SMALL * max(beta, 1e-300))
    if count < 2 or not slope.any():
        return Walk(np.full(count, beta), np.full(count, np.nan), 0.0, 0.0)
    periods = (observation.time / observation.period).astype(np.intp)
    change, weight = changes(gap, slope, periods, count)
    left = gap - change[np.minimum(periods, count - 1)] * slope
    shakes, by_base, power = observation.shaken(values, SHAKES), np.zeros(count), 0.0
    if len(shakes):
        moved = np.array([changes(shake, slope, periods, count)[0] for shake in shakes])
        by_base, power = np.sqrt(np.mean(moved**2, axis=0)), float(np.mean(shakes**2, axis=1).max())
    own = np.sqrt(np.bincount(periods, left**2)[:count] / np.bincount(periods)[:count])
    spread = np.where(own > BAD * float(np.median(own)), own, spread_of(left, observation.noise, power))
    error = np.hypot(spread / np.sqrt(np.maximum(weight, 1e-6 * float(weight.max()))), by_base)
    found = walked(change)
    size = float(np.std(found.values))
    if size > NOTABLE * beta:  # the derivative at the friction ratio nearest to the first guess
        offsets = size * np.array(GRID)
        records = [at(beta + off) for off in offsets]
        near = []
        for k, off in enumerate(offsets):
            low, high = max(k - 1, 0), min(k + 1, len(offsets) - 1)
            steep = (records[high] - records[low]) / (offsets[high] - offsets[low])
            near.append(off + changes(observation.data - records[k], steep, periods, count)[0])
        nearest = np.argmin(np.abs(found.values[None, :] - offsets[:, None]), axis=0)
        found = walked(np.array(near)[nearest, np.arange(count)])
    delay, each = _delay(observation, values, slope), np.arange(count)
    late = np.maximum(each + delay - (count - 1.0), 0.0)  # what has not shown yet is the last value, less sure
    earlier, errors = (np.interp(each + delay, each, part) for part in (found.values, found.errors))
    blurred = found.step**2 * (0.25 * delay + late)  # what changes within the delay shows as its mean
    return replace(found, values=beta + earlier, errors=np.sqrt(errors**2 + blurred))


def _delay(observation: RecordObservation, values: Mapping[str, float], slope: FloatArray) -> float:
    """Periods by which the motion is late behind friction: how it answers to a step of beta in the record's middle.

    With the share g of the settled answer that each period after the step shows, ``sum (1 - g)``.
    """
    here, time = observation.motion(values), observation.time
    law = observation.problem(values).in_frame_time()
    if here is None or law.law.kind != "rigid":
        return 0.0  # an inner state cannot be begun anew
    k = len(time) // 2
    base = BaseRecord(here.time[k:], here.base.values[k:], rest=0.0, scale=1.0)
    stepped = law.with_parameters({"beta": law.beta * (1.0 + SMALL)})
    there = motion_under(stepped, base, x0=float(here.displacement[k]), v0=float(here.velocity[k]))
    step = (there.displacement - here.displacement[k:]) / (SMALL * law.beta)
    since = ((time[k:] - time[k]) / observation.period).astype(np.intp)
    shown, weight = changes(step, slope[k:], since, int(since[-1]) + 1)
    shown = shown[weight > 0.1 * float(np.median(weight))][:SETTLES]
    settled = np.flatnonzero(np.abs(shown - 1.0) < 0.05)
    return float(np.clip(np.sum(1.0 - shown[: settled[0] if len(settled) else len(shown)]), 0.0, SETTLES))
