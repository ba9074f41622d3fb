"""The whole record against its prediction: fitted to it or to the steady cycle, followed from the first sample."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import AnalysisError
from frictionlab.identification.coordinates import Coordinate
from frictionlab.identification.family import Family, measured_base
from frictionlab.identification.friction_over_time import friction_over_time
from frictionlab.identification.identify import Identified, coordinates_of, with_errors
from frictionlab.identification.observed import Observed
from frictionlab.identification.record_fit import errors_held, fit_record
from frictionlab.identification.record_ladder import RecordLadder, Unknowns
from frictionlab.identification.track import (
    RecordForward,
    Track,
    of_a_record,
    start_coordinates,
    start_values,
)
from frictionlab.identification.wander import Walk
from frictionlab.identification.whole_record import WholeRecord
from frictionlab.uncertainty import Sources

FloatArray = NDArray[np.float64]
LEAVES = 2.0  # times the usual misfit of a period at which the prediction has left the measurement
NOISE = 3.0  # times the sensor's noise, at least
FEW = 3  # periods, at most, that tell no usual one
CALM = 3  # periods below that end such a stretch
SEARCH = (0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0)  # friction ratios tried, over the cycle's


@dataclass(frozen=True)
class Question:
    """What is asked of a record.

    ``unknowns``: the coordinates of a family of problems; ``starts``: values to begin from, of which the best so many
    (``tries``) are followed; ``observed``: the cycle that stands beside the record.
    """

    track: Track
    family: Family
    unknowns: Unknowns
    starts: tuple[Mapping[str, float], ...]
    observed: Observed
    tries: int = 1


def question_of(track: Track, measurement: Measurement, found: Identified, sources: Sources) -> Question:
    """Ask a record what its cycle was asked, beginning from what that said.

    The unknowns and their priors are those of a cycle, with the start of the motion and the sensor's zero beside them.
    """
    middle = {name: value for name, value in found.fit.values.items() if not name.startswith("second_")}
    starts = [middle | start_values(track)]
    if "beta" in found.family.free:
        starts += [starts[0] | {"beta": factor * middle["beta"]} for factor in SEARCH if factor != 1.0]

    def unknowns(family: Family) -> tuple[Coordinate, ...]:
        return of_a_record(coordinates_of(family, measurement, sources))

    return Question(track, found.family, unknowns, tuple(starts), found.fit.observed)


def identify_whole(question: Question) -> Identified:
    """Return the values of a law that fit the whole record best.

    Raises
    ------
    AnalysisError
        No values tried have a motion.
    """
    track, family = question.track, question.family
    forward = RecordForward(family, (*question.unknowns(family), *start_coordinates(track)), track)
    best = fit_record(forward, question.observed, question.starts, tries=question.tries)
    return with_errors(family, best, errors=errors_held(best, forward, question.starts))


def climb_whole(question: Question) -> tuple[Identified, RecordLadder]:
    """Return the law that the record requires, from the one that is asked about upward, and the ladder climbed.

    Raises
    ------
    AnalysisError
        That law has no motion under the measured base.
    """
    ladder = RecordLadder(question.track, question.unknowns, question.observed, question.tries)
    return ladder.climb(question.family, question.starts), ladder


def under_measured_base(measurement: Measurement, found: Identified) -> Identified:
    """Return the same values, their steady cycle to be predicted under all measured harmonics of the base."""
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
    return _over(track, predicted, friction_over_time(forward, point, predicted))


def _over(track: Track, predicted: FloatArray, friction: Walk) -> WholeRecord:
    """Measured over predicted, as a whole and period by period."""
    gap = track.mass - predicted
    area, area_predicted = loop_areas(track.base, track.mass), loop_areas(track.base, predicted)
    edges = np.minimum(track.period * np.arange(track.periods + 1), track.time[-1])
    power = np.concatenate([[0.0], np.cumsum(0.5 * (gap[1:] ** 2 + gap[:-1] ** 2) * np.diff(track.time))])
    each = np.sqrt(np.diff(np.interp(edges, track.time, power)) / np.diff(edges)) / track.rms
    limit = max(LEAVES * float(np.median(each)), NOISE * track.noise / track.rms) if len(each) > FEW else math.inf
    apart = stretches_apart(each, limit, edges)
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
        cycle_friction=friction.values,
        cycle_friction_se=friction.errors,
        wanders=friction.sure,
        left=tuple((track.start + begin, track.start + end, worst) for begin, end, worst in apart),
    )


def loop_areas(base: FloatArray, mass: FloatArray) -> FloatArray:
    """Integral of y dx from the first sample to each (n,): what the loop takes in (2.18), by trapezia."""
    steps = 0.5 * (base[1:] + base[:-1]) * np.diff(mass)
    return np.concatenate([[0.0], np.cumsum(steps)])


def stretches_apart(each: FloatArray, limit: float, edges: FloatArray) -> Iterator[tuple[float, float, float]]:
    """Stretches of periods whose misfit is above a limit: from, to, the largest; a short calm ends none.

    Parameters
    ----------
    each : ndarray of shape (c,)
        Misfit of each period.
    limit : float
    edges : ndarray of shape (c + 1,)
        Where the periods begin and end.

    Examples
    --------
    >>> misfit = np.array([1.0, 5.0, 1.0, 6.0, 1.0, 1.0, 1.0, 1.0, 4.0])
    >>> [(float(begin), float(end)) for begin, end, _ in stretches_apart(misfit, 2.0, np.arange(10.0))]
    [(1.0, 4.0), (8.0, 9.0)]
    """
    out = np.flatnonzero(each > limit)
    for places in np.split(out, np.flatnonzero(np.diff(out) > CALM) + 1):
        if len(places):
            yield float(edges[places[0]]), float(edges[places[-1] + 1]), float(each[places].max())
