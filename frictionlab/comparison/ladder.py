"""Model only what a scene requires, measured: what each step of physics buys in fit and costs in time.

The rungs: Coulomb friction; the frame's own damping; the measured base motion, its odd harmonics alone and all of them;
a static friction above the kinetic one, fitted together with it. What the best of them leaves is then read: a
difference between the two directions, compliance of the contact, creep in the stops.
"""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from frictionlab.analysis.measurement import Cycle, Measurement
from frictionlab.analysis.stops import runs
from frictionlab.comparison.identification import ProblemOf, identify, nrmse_of, simulated_cycle
from frictionlab.scene import Scene
from frictionlab.simulator import COSINE, Base, Problem

FloatArray = NDArray[np.float64]
Model = Callable[[float, float], Problem]  # friction ratio, static ratio -> problem
MOST_STATIC_RATIO = 3.0
STANDING = 0.03  # speed at which a stop has begun, over the greatest speed of the cycle
MOST_TURNING = 0.02  # of a cycle: a shorter pause is a turning point


@dataclass(frozen=True)
class Rung:
    """One model: its words, what was fitted (with joint standard errors), nrmse, and the seconds it took.

    ``direction_share``: share of the residual's power that differs between the two directions of motion (its even
    harmonics); a model symmetric in both cannot take it away.
    """

    model: str
    friction_ratio: float
    friction_ratio_se: float | None
    static_ratio: float
    static_ratio_se: float | None
    nrmse: float
    direction_share: float
    seconds: float


@dataclass(frozen=True)
class StopMotion:
    """What the mass does in one stop: from ``begin`` to ``end`` (rad of tau) it ``moved`` by so much, in Y.

    Positive in the direction it came: it slides on, or backs away from the pull that will soon set it free; negative
    in the direction of that pull: the contact gives way. ``early``: how much of it in the first half of the stop;
    ``moved_se``: from the sensor's noise alone. A rigid contact has 0.
    """

    begin: float
    end: float
    moved: float
    moved_se: float
    early: float


def climb(measurement: Measurement, scene: Scene) -> tuple[Rung, ...]:
    """Fit each model in turn, cheapest first; a rung that the scene's numbers do not allow is left out.

    Parameters
    ----------
    measurement : Measurement
        With a frequency ratio.
    scene : Scene
        ``[rig] damping_ratio`` switches the second rung on, ``[model] wall`` is kept.
    """
    zeta = scene.rig.damping_ratio or 0.0
    damped = [(", frame damping", zeta, COSINE)] if zeta else []
    rungs = [
        ("Coulomb friction", 0.0, COSINE),
        *damped,
        (", odd base harmonics", zeta, _base(measurement.cycle, odd=True)),
        (", all base harmonics", zeta, _base(measurement.cycle, odd=False)),
    ]
    fitted = [_one(measurement, words, _model(measurement, scene, z, base)) for words, z, base in rungs]
    best = min(range(len(rungs)), key=lambda i: fitted[i].nrmse)
    words, z, base = rungs[best]
    return (*fitted, _with_static_ratio(measurement, words, fitted[best], _model(measurement, scene, z, base)))


def _base(cycle: Cycle, *, odd: bool) -> Base:
    keep = np.ones(len(cycle.base_cosine))
    keep[1::2] = 0.0 if odd else 1.0
    return Base(tuple((keep * cycle.base_cosine).tolist()), tuple((keep * cycle.base_sine).tolist()))


def _model(measurement: Measurement, scene: Scene, zeta: float, base: Base) -> Model:
    ratio = measurement.frequency_ratio or math.nan

    def problem(friction_ratio: float, static_ratio: float) -> Problem:
        return Problem(ratio, friction_ratio, mu=static_ratio, zeta=zeta, wall=scene.model.wall, base=base)

    return problem


def _at(model: Model, static_ratio: float) -> ProblemOf:
    return lambda beta: model(beta, static_ratio)


def _one(measurement: Measurement, words: str, model: Model) -> Rung:
    begin = time.perf_counter()
    found = identify(measurement, _at(model, 1.0))
    seconds = time.perf_counter() - begin
    share = _direction_share(measurement.cycle, _at(model, 1.0), found.friction_ratio)
    return Rung(words, found.friction_ratio, found.friction_ratio_se, 1.0, None, found.nrmse, share, seconds)


def _with_static_ratio(measurement: Measurement, words: str, below: Rung, model: Model) -> Rung:
    """Fit friction ratio and static ratio together, from the rung below."""
    begin, cycle = time.perf_counter(), measurement.cycle

    def cost(point: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> float:
        beta, static = float(point[0]), float(point[1])
        if not (beta > 0.0 and 1.0 <= static <= MOST_STATIC_RATIO):
            return math.inf
        predicted = simulated_cycle(_at(model, static), beta, cycle.tau)
        return math.inf if predicted is None else nrmse_of(cycle, predicted)

    beta = below.friction_ratio
    corners = np.array([[beta, 1.0], [1.02 * beta, 1.0], [beta, 1.05]])
    found = minimize(
        cost,
        corners[0],
        method="Nelder-Mead",
        options={"initial_simplex": corners, "xatol": 1e-5, "fatol": 1e-7},
    )
    best = (float(found.x[0]), float(found.x[1]))
    errors = _joint_errors(cycle, model, *best)
    seconds = time.perf_counter() - begin
    share = _direction_share(cycle, _at(model, best[1]), best[0])
    return Rung(
        f"{words}, static ratio fitted", best[0], errors[0], best[1], errors[1], float(found.fun), share, seconds
    )


def _joint_errors(cycle: Cycle, model: Model, beta: float, static: float) -> tuple[float | None, float | None]:
    """Joint standard errors of friction and static ratio: residual over sensitivity, by its independent points."""
    h = 1e-4
    around = [(beta * (1 + h), static), (beta * (1 - h), static), (beta, static + h), (beta, static), (beta, static)]
    cycles = [simulated_cycle(_at(model, s), b, cycle.tau) for b, s in around]
    seen = [c - c.mean() for c in cycles if c is not None]
    if len(seen) < len(cycles):
        return None, None
    slopes = np.stack([(seen[0] - seen[1]) / (2 * h * beta), (seen[2] - seen[3]) / h], axis=1)
    square = slopes.T @ slopes
    if np.linalg.cond(square) > 1e12:
        return None, None
    residual = cycle.mass - seen[4]
    lagged = float(np.dot(residual, np.roll(residual, 1)) / np.dot(residual, residual))
    inflation = (1 + lagged) / max(1 - lagged, 2.0 / len(residual))
    errors = np.sqrt(np.diag(np.linalg.inv(square)) * np.mean(residual**2) * inflation)
    return float(errors[0]), float(errors[1])


def _direction_share(cycle: Cycle, problem_of: ProblemOf, beta: float) -> float:
    """Share of the residual's power in its even harmonics."""
    predicted = simulated_cycle(problem_of, beta, cycle.tau)
    if predicted is None:
        return math.nan
    residual = cycle.mass - (predicted - predicted.mean())
    power = np.abs(np.fft.rfft(residual)[1:]) ** 2
    return float(power[1::2].sum() / power.sum())


@dataclass(frozen=True)
class SlidingForce:
    """Force of the contact while the mass slides, over k Y (a Coulomb contact has beta everywhere).

    ``rising``, ``falling``: mean of its size in either direction; ``slow``, ``fast``: below and above half of the
    greatest speed; ``spread``: its standard deviation.
    """

    rising: float
    falling: float
    slow: float
    fast: float
    spread: float


def contact_force(measurement: Measurement, zeta: float) -> FloatArray:
    """Force of the contact over the measured cycle, (p,) over k Y: what the equation of motion leaves for it.

    ``n = y - x - 2 zeta r x' - r^2 x''`` of the mean cycle; harmonics above 25 fade out, where noise times k^2 rules.
    """
    cycle, r = measurement.cycle, measurement.frequency_ratio or math.nan
    lines = np.fft.rfft(cycle.mass_smooth)
    k = np.arange(len(lines))
    lines = lines * np.exp(-((k / 25.0) ** 2))
    response = lines * (1.0 + 2j * zeta * r * k - (r * k) ** 2)
    return np.asarray(cycle.base - np.fft.irfft(response, len(cycle.tau)))


def sliding_force(measurement: Measurement, zeta: float) -> SlidingForce:
    """Read the contact's force while the mass slides (faster than an eighth of its greatest speed)."""
    v = measurement.cycle.mass_velocity
    speed, force = np.abs(v), np.sign(v) * contact_force(measurement, zeta)
    top = float(speed.max())
    slides = speed > top / 8.0
    return SlidingForce(
        rising=float(force[slides & (v > 0)].mean()),
        falling=float(force[slides & (v < 0)].mean()),
        slow=float(force[slides & (speed < top / 2)].mean()),
        fast=float(force[speed >= top / 2].mean()),
        spread=float(force[slides].std()),
    )


def stop_motions(measurement: Measurement) -> tuple[StopMotion, ...]:
    """How the mass moves while it should stand, for each stop between two slides of opposite direction."""
    cycle = measurement.cycle
    v = cycle.mass_velocity
    top, points = float(np.abs(v).max()), len(v)
    first = int(np.argmax(np.abs(v)))  # start where the mass is fastest: no stop is cut
    order = np.roll(np.arange(points), -first)
    v, x = v[order], cycle.mass_smooth[order]
    slide = np.where(np.abs(v) > top / 8.0, np.sign(v), 0.0)
    begin, end = runs(slide == 0.0)
    used = max(1, int(measurement.series.used.sum()))
    error = math.sqrt(2.0 / used) * measurement.mass_noise_m / measurement.base_amplitude_m
    found = []
    for b, e in zip(begin, end, strict=True):
        came, goes = slide[b - 1], slide[e % points]
        still = b + np.flatnonzero(came * v[b:e] < STANDING * top)  # arrived ...
        last = e - 1 - int(np.argmax((goes * v[b:e] <= 0.0)[::-1]))  # ... and not yet on its way back
        if came == goes or not len(still) or (last - still[0]) < MOST_TURNING * points:
            continue
        middle = (int(still[0]) + last) // 2
        tau = 2 * math.pi * (first + np.array([int(still[0]), last])) / points
        moved, early = (float(came * (x[k] - x[still[0]])) for k in (last, middle))
        found.append(StopMotion(float(tau[0] % (2 * math.pi)), float(tau[1] % (2 * math.pi)), moved, error, early))
    return tuple(found)
