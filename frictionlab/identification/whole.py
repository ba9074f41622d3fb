"""The whole record against its prediction: fitted to it or to the steady cycle, followed from the first sample."""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import AnalysisError
from frictionlab.identification.family import measured_base
from frictionlab.identification.identify import Identified, coordinates_of, with_errors
from frictionlab.identification.record_fit import errors_of_record, fit_record, spread_of
from frictionlab.identification.record_ladder import RecordLadder, RecordRung
from frictionlab.identification.track import (
    RecordForward,
    Track,
    of_a_record,
    start_coordinates,
    start_values,
)
from frictionlab.identification.wander import changes, walk
from frictionlab.identification.whole_record import WholeRecord
from frictionlab.uncertainty import Sources

FloatArray = NDArray[np.float64]
LEAVES = 2.0  # times the usual misfit of a period at which the prediction has left the measurement
NOISE = 3.0  # times the sensor's noise, at least
SMALL = 1e-3  # relative change of beta for its derivative
SEARCH = (0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0)  # friction ratios tried, over the cycle's


def identify_whole(track: Track, measurement: Measurement, found: Identified, sources: Sources) -> Identified:
    """Return the values of a law that fit the whole record best, from those that fit its cycle.

    The unknowns and their priors are those of a cycle, with the start of the motion and the sensor's zero beside them.
    Its base is the measured one; so the cycle that follows from these values has all measured harmonics of it.

    Raises
    ------
    AnalysisError
        No values tried have a motion.
    """
    family = found.family
    known = of_a_record(coordinates_of(family, measurement, sources))
    forward = RecordForward(family, (*known, *start_coordinates(track)), track)
    middle = {name: value for name, value in found.fit.values.items() if not name.startswith("second_")}
    starts = [middle | start_values(track)]
    if "beta" in family.free:
        starts += [starts[0] | {"beta": factor * middle["beta"]} for factor in SEARCH if factor != 1.0]
    best = fit_record(forward, found.fit.observed, starts)
    return _under_measured_base(measurement, with_errors(family, best, errors=errors_of_record(best, forward)))


def climb_whole(
    track: Track, measurement: Measurement, found: Identified, sources: Sources
) -> tuple[Identified, tuple[RecordRung, ...]]:
    """Return the law that the record requires, from the one that its cycle requires upward, and the rungs climbed.

    Raises
    ------
    AnalysisError
        The cycle's law has no motion under the measured base.
    """
    ladder = RecordLadder(track, measurement, sources, found)
    top = _under_measured_base(measurement, ladder.climb())
    return top, tuple(ladder.rungs)


def _under_measured_base(measurement: Measurement, found: Identified) -> Identified:
    """The same values, their steady cycle to be predicted under all measured harmonics of the base."""
    family = replace(found.family, base=measured_base(measurement, len(measurement.cycle.base_cosine)))
    forward = replace(found.fit.forward, family=family)
    return replace(found, family=family, fit=replace(found.fit, forward=forward))


def follow(track: Track, found: Identified) -> WholeRecord:
    """Return the record over its prediction with the values found; its start is fitted where it was not.

    Raises
    ------
    AnalysisError
        The law has no motion under the measured base with the values found.
    """
    values = {name: value for name, value in found.fit.values.items() if not name.startswith("second_")}
    unknown = tuple(c for c in start_coordinates(track) if c.name not in values)
    forward = RecordForward(found.family, unknown, track, fixed=values)
    point = np.zeros(0)
    if unknown:
        point = fit_record(forward, found.fit.observed, [start_values(track)], weighs=False).point
    predicted = forward.predict(point)
    if predicted is None:
        raise AnalysisError(f"record: law {found.family.law.name} has no motion at the values found")
    return _over(track, predicted, *_slope(forward, point, predicted))


def _slope(forward: RecordForward, point: FloatArray, predicted: FloatArray) -> tuple[float, FloatArray]:
    """Friction ratio, and the derivative of the record by it (n,); zero where there is no neighbour."""
    beta = forward.problem(forward.values(point)).beta
    there = replace(forward, fixed={**forward.fixed, "beta": beta * (1.0 + SMALL)}).predict(point)
    if there is None or beta == 0.0:
        return beta, np.zeros(len(predicted))
    return beta, (there - predicted) / (SMALL * beta)


def _over(track: Track, predicted: FloatArray, beta: float, slope: FloatArray) -> WholeRecord:
    """Measured over predicted, as a whole and period by period."""
    gap = track.mass - predicted
    area, area_predicted = loop_areas(track.base, track.mass), loop_areas(track.base, predicted)
    count = int(float(track.time[-1]) / track.period + 1e-6)
    edges = np.minimum(track.period * np.arange(count + 1), track.time[-1])
    power = np.concatenate([[0.0], np.cumsum(0.5 * (gap[1:] ** 2 + gap[:-1] ** 2) * np.diff(track.time))])
    each = np.sqrt(np.diff(np.interp(edges, track.time, power)) / np.diff(edges)) / track.rms
    friction, error = _friction(track, gap, beta, slope, count)
    return WholeRecord(
        time=track.start + track.time,
        base=track.base,
        measured=track.mass,
        predicted=predicted,
        nrmse=math.sqrt(float(np.mean(gap**2))) / track.rms,
        energy_difference=float(area_predicted[-1] / area[-1] - 1.0),
        cycle_time=track.start + edges[:-1],
        cycle_measured=np.diff(np.interp(edges, track.time, area)),
        cycle_predicted=np.diff(np.interp(edges, track.time, area_predicted)),
        cycle_nrmse=each,
        cycle_friction=friction,
        cycle_friction_se=error,
        left=tuple(_left(each, track, edges)),
    )


def _friction(
    track: Track, gap: FloatArray, beta: float, slope: FloatArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """Friction ratio of each period, and its error; the fitted one where the record does not tell it."""
    inside = track.time < count * track.period
    periods = (track.time[inside] / track.period).astype(np.intp)
    if count < 2 or not slope.any():
        return np.full(count, beta), np.full(count, np.nan)
    change, weight = changes(gap[inside], slope[inside], periods)
    left = gap[inside] - change[periods] * slope[inside]
    error = spread_of(left, track.noise) / np.sqrt(np.maximum(weight, 1e-6 * float(weight.max())))
    walked, se = walk(change, error, beta)
    return beta + walked, se


def loop_areas(base: FloatArray, mass: FloatArray) -> FloatArray:
    """Integral of y dx from the first sample to each (n,): what the loop takes in (2.18), by trapezia."""
    steps = 0.5 * (base[1:] + base[:-1]) * np.diff(mass)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _left(each: FloatArray, track: Track, edges: FloatArray) -> Iterator[tuple[float, float, float]]:
    """Stretches of periods whose misfit is far above the usual one's and the noise's."""
    if len(each) < 4:
        return
    limit = max(LEAVES * float(np.median(each)), NOISE * track.noise / track.rms)
    for out, group in groupby(enumerate(each > limit), key=lambda item: bool(item[1])):
        places = [i for i, _ in group]
        if out:
            begin, end = float(edges[places[0]]), float(edges[places[-1] + 1])
            yield track.start + begin, track.start + end, float(each[places].max())
