"""A sampled base motion under a law with exact phases: the exact flow, event by event between the samples."""

from math import ceil, inf, sqrt

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.compiled import record_of
from frictionlab.simulator.exact.answer import travel
from frictionlab.simulator.exact.motion import WORK
from frictionlab.simulator.exact.orbit import Carrier
from frictionlab.simulator.exact.solve import TOUCH, system_of
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record.base import BaseRecord, derivatives_of, force_of
from frictionlab.simulator.record.respond import Carried

FINE = 16.0  # parts per unit of the fastest phase's time


def carried(problem: Problem, base: BaseRecord, x0: float, v0: float) -> Carried:
    """Let the exact flow carry the mass through the record."""
    systems, works = system_of(problem), record_of(WORK)
    system, work = systems[0], works[0]
    stiffness = 1.0 + problem.beta * abs(problem.parameter("gradient")) + float(np.sum(system["spring"]))
    fastest = max(sqrt(stiffness), 2.0 * (problem.frame_damping_ratio + problem.zeta))
    parts = max(1, ceil(FINE * float(np.diff(base.time).max()) * fastest))  # integrals are exact to rounding then
    time, cubics = base.pieces(parts)
    force, samples = force_of(problem, base, cubics), np.zeros((len(time), 3))
    system["harmonics"] = 0
    if base.quantity == "acceleration":  # it drives the motion relative to the base, which is all that is known
        system["push"][0], system["follow"][0] = (-1.0, 0.0), 0.0
    work["left"], work["q"][0], work["v"][0] = inf, x0, v0
    work["anchor"][:] = x0 - float(system["follow"][0] * base.values[0])
    start, count = works.copy(), 256 + len(time) + len(time) // 8
    while True:
        pieces = np.empty((count, 7))
        reached = travel(Carrier(systems, works, pieces), time, cubics, samples)
        if reached >= 0:
            raise _stranded(problem, float(time[reached]), float(work["q"][0] - system["follow"][0] * work["f"][0]))
        if work["count"] <= count:
            break
        count, works[:] = int(work["count"]), start
    rows, moves, last = pieces[: int(work["count"])], float(system["follow"][0]), slice(int(system["sliders"]))
    z = float(samples[-1, 0]) - moves * float(base.values[-1])
    limit = work["side"][0] * system["strength"][last] * (1.0 + problem.parameter("gradient") * z)
    held = np.where(work["slips"][last] != 0, limit, system["spring"][last] * (z - work["anchor"][last]))
    stored = float(np.sum(0.5 * held**2 / system["spring"][last]))
    return _accounted(problem, rows, (time, cubics, force), samples, moves)._replace(
        samples=samples[::parts].T.copy(), stored=stored
    )


def _stranded(problem: Problem, tau: float, z: float) -> SimulationError:
    """Why the motion came no further."""
    load = 1.0 + problem.parameter("gradient") * z
    what = "events without end; expected some per sample; do: report these numbers"
    if load <= 0.0:
        what = f"1 + gradient z; expected never below 0; got {load:.3g}; do: give a smaller gradient"
    return SimulationError(
        f"simulation of a record: {what} (tau = {tau!r}, z = {z:.6g}, law {problem.law.name}, parameters "
        f"{problem.parameters})"
    )


def _accounted(
    problem: Problem,
    rows: FloatArray,
    drive: tuple[FloatArray, FloatArray, FloatArray],
    samples: FloatArray,
    moves: float,
) -> Carried:
    """Energies and events of pieces (m, 7) as `exact.solve.Trajectory` has them, by what is at their ends (2, m).

    Writes the contact's force at the first sample. `drive`: times, base and force; `moves`: 1 where the wall follows.
    """
    time, cubics, force = drive
    begins, length, kappa, offset, side = rows[:, 0], rows[:, 1], rows[:, 4], rows[:, 5], rows[:, 6]
    here = np.clip(np.searchsorted(time, begins + 0.5 * length, side="right") - 1, 0, len(time) - 2)
    t = np.vstack((begins, begins + length)) - time[here]
    f, pull = derivatives_of(cubics[here], t), derivatives_of(force[here], t)
    z = np.vstack((rows[:, 2], np.append(rows[1:, 2], samples[-1, 0]))) - moves * f[0]
    v = np.vstack((rows[:, 3], np.append(rows[1:, 3], samples[-1, 1]))) - moves * f[1]
    held, thick = np.isinf(kappa), 2.0 * (problem.frame_damping_ratio + problem.zeta)
    way, kappa = np.where(held, 0.0, z[1] - z[0]), np.where(held, 0.0, kappa)
    a = pull[0] - thick * v - (1.0 + kappa) * z - offset
    speed = np.where(held, 0.0, (v, a, pull[1] - thick * a - (1.0 + kappa) * v))
    slip = speed - f[1:] if problem.wall == "fixed" else speed
    first = pull[0, 0, 0] - z[0, 0] if held[0] else kappa[0] * z[0, 0] + offset[0]
    samples[0, 2] = first + 2.0 * problem.zeta * speed[0, 0, 0]
    energy = 0.5 * (z**2 + speed[0] ** 2)
    return Carried(
        samples=samples,
        events=_events(begins, length, side, z[0]),
        work=float(np.sum(way * (0.5 * kappa * (z[0] + z[1]) + offset))),
        squared=_integral(length, speed, speed),
        dragged=_integral(length, slip, slip),
        put_in=_integral(length, pull, speed),
        path=float(np.sum(np.abs(way[side != 0.0]))),
        stored=0.0,
        gained=float(energy[1, -1] - energy[0, 0]),
    )


def _integral(length: FloatArray, one: FloatArray, other: FloatArray) -> float:
    """Integral of a product, from values and two derivatives (3, 2, m) of both at the ends of pieces (m,), in all.

    Hermite's rule ``h/2 (y0 + y1) + h^2/10 (y0' - y1') + h^3/120 (y0'' + y1'')``: exact up to degree 5.
    """
    value, slope = one[0] * other[0], one[1] * other[0] + one[0] * other[1]
    bend = one[2] * other[0] + 2.0 * one[1] * other[1] + one[0] * other[2]
    rule = 0.5 * value.sum(axis=0) + length * (0.1 * (slope[0] - slope[1]) + length / 120.0 * bend.sum(axis=0))
    return float(np.sum(length * rule))


def _events(begins: FloatArray, length: FloatArray, side: FloatArray, z: FloatArray) -> FloatArray:
    """What begins, when and where (m, 3): slips, and stops that are more than touches."""
    fresh = np.flatnonzero(np.concatenate(([True], side[1:] != side[:-1])))
    lasts = np.add.reduceat(length, fresh)
    kept = fresh[(side[fresh] != 0.0) | (lasts > TOUCH)]
    kept = kept[np.concatenate(([True], side[kept][1:] != side[kept][:-1]))]
    return np.column_stack((begins[kept], side[kept], z[kept]))
