"""Friction over time: a random walk from period to period, each value with its error.

What the residual of each period says of the friction ratio is smoothed. A motion needs some periods to follow (near
resonance many): what friction did shows so much later, and is put where it happened. Where friction changes by more
than a little, the record is simulated at several friction ratios.

A small change of beta during a period moves the record by its sensitivity dx/dbeta there; the residual tells how large
it was. The walk's step is the one that makes the values most likely; a Kalman smoother joins them (Rauch, Tung and
Striebel 1965).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.inference.record import RecordObservation, Track, spread_of
from frictionlab.simulator.record import BaseRecord, respond

Periods = NDArray[np.intp]
STEPS = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 41)])  # of the walk, over beta, that are tried
WIDE = 10.0  # over beta: what is known of the first value
SMALL = 1e-3  # relative change of beta for its derivative
LINEAR, UNTOLD = 0.5, 10.0  # times beta: the largest change that is told, and the error where none is
SHAKES = 10  # draws of the base's noise, for what it does to single periods
BAD = 3.0  # times the usual rms of what is left of a period, from which its own counts
SETTLES = 200  # periods, at most, that a motion is followed after a step of friction
GRID = (-2.0, -1.0, 0.0, 1.0, 2.0)  # friction ratios simulated where it changes, in rms of its changes
NOTABLE = 3e-3  # relative rms of the changes from which one derivative does not do


def changes(gap: FloatArray, slope: FloatArray, periods: Periods, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the change of a parameter in each period (c,), by least squares, and the weight <s, s> of each.

    Parameters
    ----------
    gap, slope : ndarray of shape (n,)
        Measured minus predicted, and the prediction's derivative by the parameter.
    periods : ndarray of shape (n,)
        Number of the period that each sample is in, from 0.
    count : int
        Periods; what comes behind them is left out.
    """
    weight = np.asarray(np.bincount(periods, slope * slope, minlength=count)[:count], dtype=np.float64)
    moved = np.asarray(np.bincount(periods, slope * gap, minlength=count)[:count], dtype=np.float64)
    return moved / np.maximum(weight, 1e-300), weight


@dataclass(frozen=True)
class Walk:
    """A random walk: its values (c,), their errors (c,), its step from one to the next.

    ``sure``: logarithm of how much more likely what was seen is than if nothing changed.
    """

    values: FloatArray
    errors: FloatArray
    step: float
    sure: float

    def earlier(self, delay: float) -> "Walk":
        """What made a walk that shows so many steps late; what has not shown yet is the last value, less sure."""
        places = np.arange(len(self.values)) + delay
        late = np.maximum(places - (len(self.values) - 1.0), 0.0)
        values, errors = (np.interp(places, np.arange(len(places)), v) for v in (self.values, self.errors))
        blurred = self.step**2 * (0.25 * delay + late)  # what changes within the delay shows as its mean
        return replace(self, values=values, errors=np.sqrt(errors**2 + blurred))


def walk(values: FloatArray, errors: FloatArray, size: float) -> Walk:
    """Return the smoothed random walk behind values (c,) seen with errors.

    Parameters
    ----------
    values, errors : ndarray of shape (c,)
    size : float
        What the walk's step is measured in (beta).

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> truth = np.linspace(0.0, 1.0, 200)
    >>> found = walk(truth + 0.1 * rng.standard_normal(200), np.full(200, 0.1), 1.0)
    >>> off = found.values - truth
    >>> bool(np.std(off) < 0.05), bool(np.mean(np.abs(off) < 2 * found.errors) > 0.9), found.sure > 10
    (True, True, True)
    """
    still = _forward(values, errors, 0.0, size)[0]
    best = max(STEPS * size, key=lambda step: _forward(values, errors, float(step), size)[0])
    likely, mean, variance = _forward(values, errors, float(best), size)
    for c in range(len(values) - 2, -1, -1):
        ahead = variance[c] + best**2
        share = variance[c] / ahead
        mean[c] += share * (mean[c + 1] - mean[c])
        variance[c] += share**2 * (variance[c + 1] - ahead)
    return Walk(mean, np.sqrt(np.maximum(variance, 0.0)), float(best), float(likely - still))


def _forward(values: FloatArray, errors: FloatArray, step: float, size: float) -> tuple[float, FloatArray, FloatArray]:
    """Kalman's filter: log-likelihood, means and variances (c,)."""
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


def friction_over_time(observation: RecordObservation, values: Mapping[str, float], predicted: FloatArray) -> Walk:
    """Return the friction ratio of each period of a record as a random walk about the fitted one.

    Where it changes by more than a little, the record is simulated at some friction ratios, and each period takes the
    derivative at the nearest. What a record does not tell (the mass stands) keeps the fitted value, with a wide error.
    """
    track, beta = observation.track, observation.problem(values).beta
    count = track.periods
    slope = (_at(observation, values, beta * (1.0 + SMALL), predicted) - predicted) / (SMALL * max(beta, 1e-300))
    if count < 2 or not slope.any():
        return Walk(np.full(count, beta), np.full(count, np.nan), 0.0, 0.0)
    periods = (track.time / track.period).astype(np.intp)
    shakes = observation.shaken(values, SHAKES)
    change, weight = changes(track.mass - predicted, slope, periods, count)
    left = track.mass - predicted - change[np.minimum(periods, count - 1)] * slope
    error = _errors(track, left, shakes, slope, weight, periods)
    found = _walked(change, error, beta)
    size = float(np.std(found.values))
    if size > NOTABLE * beta:
        change, weight = _nearest(observation, values, predicted, found.values, size, periods)
        found = _walked(change, error, beta)
    found = found.earlier(_delay(observation, values, slope))
    return replace(found, values=beta + found.values)


def _at(observation: RecordObservation, values: Mapping[str, float], beta: float, otherwise: FloatArray) -> FloatArray:
    """The record at another friction ratio; what stands otherwise where that has no motion."""
    made = observation.predict({**values, "beta": beta})
    return otherwise if made is None else made


def _walked(change: FloatArray, error: FloatArray, beta: float) -> Walk:
    far = np.abs(change) > LINEAR * beta
    return walk(np.where(far, 0.0, change), np.where(far, UNTOLD * beta, error), beta)


def _errors(
    track: Track, left: FloatArray, shakes: FloatArray, slope: FloatArray, weight: FloatArray, periods: Periods
) -> FloatArray:
    """Error of each period's change (c,): by both sensors' noise, and by what is left where that is more."""
    count = len(weight)
    shaken = np.array([changes(shake, slope, periods, count)[0] for shake in shakes])
    by_base = np.sqrt(np.mean(shaken**2, axis=0)) if len(shakes) else np.zeros(count)
    power = float(np.mean(shakes**2, axis=1).max()) if len(shakes) else 0.0
    own = np.sqrt(np.bincount(periods, left**2)[:count] / np.bincount(periods)[:count])
    spread = np.where(own > BAD * float(np.median(own)), own, spread_of(left, track.noise, power))
    return np.asarray(np.hypot(spread / np.sqrt(np.maximum(weight, 1e-6 * float(weight.max()))), by_base))


def _nearest(
    observation: RecordObservation,
    values: Mapping[str, float],
    predicted: FloatArray,
    first: FloatArray,
    size: float,
    periods: Periods,
) -> tuple[FloatArray, FloatArray]:
    """Change of each period and its weight, by the derivative at the friction ratio nearest to a first guess."""
    beta, mass = observation.problem(values).beta, observation.track.mass
    offsets = size * np.array(GRID)
    records = [_at(observation, values, beta + off, predicted) for off in offsets]
    told = []
    for k, off in enumerate(offsets):
        low, high = max(k - 1, 0), min(k + 1, len(offsets) - 1)
        slope = (records[high] - records[low]) / (offsets[high] - offsets[low])
        change, weight = changes(mass - records[k], slope, periods, len(first))
        told.append((off + change, weight))
    nearest = np.argmin(np.abs(first[None, :] - offsets[:, None]), axis=0)
    every = np.arange(len(first))
    found = np.array(told)
    return found[nearest, 0, every], found[nearest, 1, every]


def _delay(observation: RecordObservation, values: Mapping[str, float], slope: FloatArray) -> float:
    """Periods by which the motion is late behind friction: how it answers to a step of beta in the record's middle.

    With the share g of the settled answer that each period after the step shows, ``sum (1 - g)``.
    """
    track, here = observation.track, observation.motion(values)
    law = observation.problem(values).in_frame_time()
    if here is None or law.law.kind != "rigid":
        return 0.0  # an inner state cannot be begun anew
    k = len(track.time) // 2
    base = BaseRecord(here.time[k:], here.base.values[k:], rest=0.0, scale=1.0)
    stepped = law.with_parameters({"beta": law.beta * (1.0 + SMALL)})
    there = respond(stepped, base, x0=float(here.displacement[k]), v0=float(here.velocity[k]))
    step = (there.displacement - here.displacement[k:]) / (SMALL * law.beta)
    since = ((track.time[k:] - track.time[k]) / track.period).astype(np.intp)
    shown, weight = changes(step, slope[k:], since, int(since[-1]) + 1)
    shown = shown[weight > 0.1 * float(np.median(weight))][:SETTLES]
    settled = np.flatnonzero(np.abs(shown - 1.0) < 0.05)
    return float(np.clip(np.sum(1.0 - shown[: settled[0] if len(settled) else len(shown)]), 0.0, SETTLES))
