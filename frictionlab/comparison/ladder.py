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
STANDING = 0.03  # speed in a stop, over the greatest speed of the cycle


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
    """How the mass moves while it should stand; x/Y over y/Y and x/Y per radian, with standard errors.

    ``compliance``: how far the mass follows the base elastically (0: a rigid contact); ``creep``: how it slides on,
    positive in the direction it came; ``stops``: stops looked at.
    """

    compliance: float
    compliance_se: float
    creep: float
    creep_se: float
    stops: int


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


def stop_motion(cycle: Cycle) -> StopMotion | None:
    """How the mass moves in its stops: x over base position and time, by least squares; ``None`` without a stop.

    In a stop the base turns about, so that following it and sliding on in one direction are told apart.
    """
    speed = np.abs(cycle.mass_velocity)
    first = int(np.argmax(speed))  # start where the mass is fastest: no stop is cut
    order = np.roll(np.arange(len(speed)), -first)
    begin, end = runs(speed[order] < STANDING * speed.max())
    parts = [order[b:e] for b, e in zip(begin, end, strict=True) if e - b >= 12]
    if not parts:
        return None
    step = 2 * math.pi / len(speed)
    rows, values = [], []
    for part in parts:
        came = math.copysign(1.0, cycle.mass_velocity[part[0] - 1])
        inside = part[len(part) // 8 : len(part) - len(part) // 4]  # arrival and departure are slow but no stop
        late = came * step * np.arange(len(inside))
        design = np.stack([cycle.base[inside], late], axis=1)
        rows.append(design - design.mean(axis=0))
        values.append(cycle.mass[inside] - cycle.mass[inside].mean())
    design, value = np.concatenate(rows), np.concatenate(values)
    (compliance, creep), *_ = np.linalg.lstsq(design, value, rcond=None)
    left = value - design @ np.array([compliance, creep])
    variance = float(np.dot(left, left)) / max(1, len(value) - 2 - len(parts))
    errors = np.sqrt(np.diag(np.linalg.inv(design.T @ design)) * variance)
    return StopMotion(float(compliance), float(errors[0]), float(creep), float(errors[1]), len(parts))
