"""Friction of each period of a record: what the residual says of it, smoothed as a random walk (`wander`).

A motion needs some periods to follow (near resonance many): what friction did shows so much later, and is told where it
happened. Where friction changes by more than a little, its derivative does too: the record is simulated at several
friction ratios then.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.identification.record_fit import spread_of
from frictionlab.identification.track import RecordForward, Track
from frictionlab.identification.wander import Periods, Walk, changes, walk
from frictionlab.simulator.record import BaseRecord, respond

FloatArray = NDArray[np.float64]
SMALL = 1e-3  # relative change of beta for its derivative
LINEAR, UNTOLD = 0.5, 10.0  # times beta: the largest change that is told, and the error where none is
SHAKES = 10  # draws of the base's noise, for what it does to single periods
BAD = 3.0  # times the usual rms of what is left of a period, from which its own counts
SETTLES = 200  # periods, at most, that a motion is followed after a step of friction
GRID = (-2.0, -1.0, 0.0, 1.0, 2.0)  # friction ratios simulated where it changes, in rms of its changes
NOTABLE = 3e-3  # relative rms of the changes from which one derivative does not do


def friction_over_time(forward: RecordForward, point: FloatArray, predicted: FloatArray) -> Walk:
    """Return the friction ratio of each period of a record as a random walk about the fitted one.

    Where it changes by more than a little, the record is simulated at some friction ratios, and each period takes the
    derivative at the nearest. What a record does not tell (the mass stands) keeps the fitted value, with a wide error.
    """
    track, beta = forward.track, forward.problem(forward.values(point)).beta
    count = track.periods
    slope = (_at(forward, point, beta * (1.0 + SMALL), predicted) - predicted) / (SMALL * max(beta, 1e-300))
    if count < 2 or not slope.any():
        return Walk(np.full(count, beta), np.full(count, np.nan), 0.0, 0.0)
    periods = (track.time / track.period).astype(np.intp)
    shakes = forward.shaken(point, SHAKES)
    change, weight = changes(track.mass - predicted, slope, periods, count)
    left = track.mass - predicted - change[np.minimum(periods, count - 1)] * slope
    error = _errors(track, left, shakes, slope, weight, periods)
    found = _walked(change, error, beta)
    size = float(np.std(found.values))
    if size > NOTABLE * beta:
        change, weight = _nearest(forward, point, predicted, found.values, size, periods)
        found = _walked(change, error, beta)
    found = found.earlier(_delay(forward, point, slope))
    return replace(found, values=beta + found.values)


def _at(forward: RecordForward, point: FloatArray, beta: float, otherwise: FloatArray) -> FloatArray:
    """The record at another friction ratio; what stands otherwise where that has no motion."""
    held = {"beta": beta}
    names = [c.name for c in forward.coordinates]
    there = point.copy()
    if "beta" in names:
        i = names.index("beta")
        there[i] = forward.coordinates[i].at(beta)
    made = replace(forward, fixed={**forward.fixed, **held}).predict(there)
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
    forward: RecordForward, point: FloatArray, predicted: FloatArray, first: FloatArray, size: float, periods: Periods
) -> tuple[FloatArray, FloatArray]:
    """Change of each period and its weight, by the derivative at the friction ratio nearest to a first guess."""
    beta, mass = forward.problem(forward.values(point)).beta, forward.track.mass
    offsets = size * np.array(GRID)
    records = [_at(forward, point, beta + off, predicted) for off in offsets]
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


def _delay(forward: RecordForward, point: FloatArray, slope: FloatArray) -> float:
    """Periods by which the motion is late behind friction: how it answers to a step of beta in the record's middle.

    With the share g of the settled answer that each period after the step shows, ``sum (1 - g)``.
    """
    track, values = forward.track, forward.values(point)
    here, law = forward.response(values), forward.problem(values)
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
