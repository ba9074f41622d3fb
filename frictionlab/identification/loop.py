"""The friction ratio read off the loop: where a fit begins.

``E = beta * path`` for any Coulomb steady state (friction work is the friction force times the distance slid), which is
``beta = E / (4 X)`` for cycles with two turning points, eq. (2.23). A contact of stiffness kappa yields by
2 beta / kappa at each turn before it slips, so a closed stroke there and back of length D takes in
``2 beta (D - 2 beta / kappa)`` (Masing); the strokes of a motion of many turns are those of the rainflow count.
"""

import math

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measurement import Measurement
from frictionlab.errors import AnalysisError
from frictionlab.simulator.problem import Wall

FloatArray = NDArray[np.float64]
LARGEST = 4.0  # friction ratio at which a contact that hardly slips is still looked for
TRIED = 256  # friction ratios on either side of the one that takes in most


def loop_friction_ratio(measurement: Measurement, wall: Wall = "fixed") -> float:
    """Friction ratio as energy over the path slid.

    With a wall that moves with the base the path is that of mass over base, and the force that drives it r^2 times.

    Raises
    ------
    AnalysisError
        The mass stands still, or takes in no energy.
    """
    slid = slid_of(measurement, wall)
    path = float(np.abs(np.diff(slid, append=slid[:1])).sum())
    return energy_of(measurement, wall) / path


def slid_of(measurement: Measurement, wall: Wall) -> FloatArray:
    """Motion (p,) of the mass over its wall in the mean cycle, in Y, without the noise."""
    cycle = measurement.cycle
    if wall == "fixed":
        return cycle.mass_smooth
    order = np.arange(1, len(cycle.base_cosine) + 1)
    phase = np.outer(cycle.tau, order)
    return np.asarray(cycle.mass_smooth - np.cos(phase) @ cycle.base_cosine - np.sin(phase) @ cycle.base_sine)


def energy_of(measurement: Measurement, wall: Wall) -> float:
    """Energy (k Y^2) that the motion over the wall takes in: where the wall moves, the force is r^2 times as large.

    Raises
    ------
    AnalysisError
        The mass stands still, or takes in no energy.
    """
    if measurement.regime == "stuck":
        raise AnalysisError(
            "no friction ratio: the mass stands still, which tells only that friction is at least the spring's force:"
            " measure with less normal force or more base amplitude"
        )
    if not measurement.energy_per_cycle > 0.0:
        raise AnalysisError(
            f"no friction ratio: the loop's energy is {measurement.energy_per_cycle:.3g} k Y^2; expected more than 0:"
            " are the columns of mass and base the right way round, and does no sensor count the other way (then turn"
            " the sign of its column)?"
        )
    force = 1.0 if wall == "fixed" else (measurement.frequency_ratio or math.nan) ** 2
    return force * measurement.energy_per_cycle


def elastic_friction_ratios(strokes: FloatArray, energy: float, stiffness: float) -> tuple[float, ...]:
    """Return the friction ratios with which an elastic contact takes in an energy over given strokes, smallest first.

    There are none where the contact is too soft for the energy, else two: one slips most of the way, one hardly. Of the
    second only what is below `LARGEST` is told.

    Parameters
    ----------
    strokes : ndarray of shape (k,)
        Closed strokes of a cycle (:func:`strokes_of`), in Y.
    energy : float
        k Y^2.
    stiffness : float
        Of the contact over k.

    Examples
    --------
    >>> strokes = np.array([2.0])
    >>> rigid, soft = (elastic_friction_ratios(strokes, 1.6, kappa) for kappa in (1e9, 4.0))
    >>> [round(beta, 6) for beta in rigid], [round(beta, 4) for beta in soft]
    ([0.4], [0.4508, 3.5492])
    >>> elastic_friction_ratios(strokes, 1.6, 1.0)
    ()
    """
    most = 0.25 * stiffness * float(strokes.max())  # takes in the most energy of the longest stroke
    least = 0.5 * energy / float(strokes.sum())
    if least >= most:
        return ()
    rising = np.linspace(least, min(most, energy / float(strokes.max())), TRIED)
    falling = np.linspace(rising[-1], min(2.0 * most, LARGEST), TRIED) if rising[-1] < LARGEST else rising[:0]
    found = [_crossing(beta, _taken_in(strokes, beta, stiffness) - energy) for beta in (rising, falling)]
    return tuple(beta for beta in found if beta is not None)


def _taken_in(strokes: FloatArray, beta: FloatArray, stiffness: float) -> FloatArray:
    slipped = np.maximum(strokes[:, None] - 2.0 * beta / stiffness, 0.0)
    return np.asarray(2.0 * beta * slipped.sum(axis=0))


def _crossing(at: FloatArray, values: FloatArray) -> float | None:
    """Where values change their sign first, between two places on a straight line; None where they do not."""
    places = np.flatnonzero(values[:-1] * values[1:] <= 0.0)
    if not len(places):
        return None
    i = int(places[0])
    rise = float(values[i + 1] - values[i])
    return float(at[i] if rise == 0.0 else at[i] - values[i] * (at[i + 1] - at[i]) / rise)


def strokes_of(slid: FloatArray) -> FloatArray:
    """Return the closed strokes of a periodic motion, there and back, longest last (rainflow, ASTM E1049).

    Examples
    --------
    >>> strokes_of(np.array([0.0, 3.0, 1.0, 2.0, -2.0, -1.0]))
    array([1., 5.])
    """
    first = int(np.argmax(slid))
    around = np.concatenate([slid[first:], slid[: first + 1]])
    around = around[np.diff(around, append=np.inf) != 0.0]  # a point of each level stretch is enough
    turns = np.flatnonzero(np.diff(np.sign(np.diff(around)))) + 1
    points = [around[0], *around[turns], around[-1]]
    strokes: list[float] = []
    open_: list[float] = []
    for point in points:
        open_.append(float(point))
        while len(open_) >= 4 and _is_closed(open_[-4:]):
            strokes.append(abs(open_[-3] - open_[-2]))
            del open_[-3:-1]
    return np.sort([*strokes, float(np.ptp(slid))])


def _is_closed(points: list[float]) -> bool:
    """Whether the middle of three ways is no longer than either beside it."""
    before, middle, after = np.abs(np.diff(points))
    return bool(middle <= before and middle <= after)
