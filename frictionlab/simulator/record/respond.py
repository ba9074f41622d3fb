"""A sampled base motion in, the motion of the mass out: exact between samples, event by event, where the law allows."""

from math import ceil, inf, pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record.base import BaseRecord, wall_of
from frictionlab.simulator.record.response import Response

FINE = 16.0  # parts per unit of the fastest phase's time
TOUCH = 1e-13  # rad: a shorter stick is no stop
MOST_CYCLES = 1e7  # natural periods: half a minute of compiled work that nothing interrupts


def respond(problem: Problem, base: BaseRecord, *, x0: float = 0.0, v0: float = 0.0) -> Response:
    """Simulate the mass under a sampled motion of the base.

    Between samples the base is a polynomial and the mass, between events, a linear oscillator: its motion is a closed
    form, and what interpolation makes of the samples is the only approximation (README, "How good"). Laws without exact
    phases are integrated by the numeric engine, piece by piece.

    Parameters
    ----------
    problem : Problem
        With r = 1: time is counted in omega_n t. Its own periodic base is not used. `beta` is over k times the
        record's scale Y.
    base : BaseRecord
    x0, v0 : float
        Displacement (over Y, from where the spring is relaxed) and velocity dx/dtau of the mass at the first sample.

    Raises
    ------
    SimulationError
        r is not 1, the record lasts too long, an acceleration is to drive against a fixed wall, friction would have to
        be negative or to outgrow the spring, events do not end, or the law is too stiff to be integrated.

    Examples
    --------
    >>> import numpy as np
    >>> tau = np.linspace(0.0, 40.0, 2001)
    >>> response = respond(Problem(1.0, beta=0.4), BaseRecord(tau, 1.0 - np.cos(0.5 * tau)))
    >>> response.stops, round(response.energy, 3)
    (6, 2.442)
    """
    if problem.r != 1.0:
        raise SimulationError(
            f"simulation of a record: r; expected 1 (time is counted in omega_n t); got {problem.r!r}"
        )
    cycles = float(base.time[-1] - base.time[0]) / (2.0 * pi)
    if not cycles <= MOST_CYCLES:
        raise SimulationError(
            f"simulation of a record: it lasts {cycles:.3g} natural periods; expected at most {MOST_CYCLES:g}: are its "
            "stamps in seconds?"
        )
    if not problem.law.is_exact:
        from frictionlab.simulator.record.integrate import integrate  # noqa: PLC0415 - for such laws alone

        return integrate(problem, base, (x0, v0))
    change = problem.beta * abs(problem.parameter("gradient"))
    if change >= 1.0:
        raise SimulationError(
            f"simulation of a record: beta * |gradient|; expected less than 1; got {change:g}: friction changes along "
            "the path faster than the spring's force, and the mass would run away"
        )
    return _response(problem, base, _travelled(problem, base, x0, v0))


class _Travelled(NamedTuple):
    """What the exact flow has left: the base's pieces, the motion at the samples, the pieces between events."""

    time: FloatArray  # (k,): begins of the base's pieces, and the end
    cubics: FloatArray  # (k - 1, 4), in the time from each begin on
    samples: FloatArray  # (n, 3): displacement, velocity, force of the contact
    rows: FloatArray  # (m, 7): as `exact.solve.Pieces` has them
    stored: float  # in the sliders' springs at the end, over k Y^2


def _travelled(problem: Problem, base: BaseRecord, x0: float, v0: float) -> _Travelled:
    """Let the exact flow carry the mass through the record."""
    from frictionlab.simulator.compiled import record_of  # noqa: PLC0415 - loads the compiler: half a second
    from frictionlab.simulator.exact.flow import RUNNER  # noqa: PLC0415 - as above
    from frictionlab.simulator.exact.motion import WORK  # noqa: PLC0415 - as above
    from frictionlab.simulator.exact.orbit import Carrier  # noqa: PLC0415 - as above
    from frictionlab.simulator.exact.solve import system_of_one  # noqa: PLC0415 - as above
    from frictionlab.simulator.exact.travel import travel  # noqa: PLC0415 - as above

    wall, h = wall_of(problem, base), np.diff(base.time)
    slope, values, rates = np.diff(base.values) / h, base.values, base.speeds
    bend = (rates[:-1] + rates[1:] - 2.0 * slope) / h
    cubics = np.column_stack((values[:-1], rates[:-1], (slope - rates[:-1]) / h - bend, bend / h))
    parts = _parts(problem, h)
    time, cubics = _parted(base.time, h, cubics, parts)
    systems, works, samples = system_of_one(problem), record_of(WORK), np.zeros((len(time), 3))
    system, work = systems[0], works[0]
    system["harmonics"] = 0
    if wall == 2.0:  # an acceleration drives the motion relative to the base, which is all that is known
        system["push"][0], system["follow"][0] = (-1.0, 0.0), 0.0
    work["left"], work["q"][0], work["v"][0] = inf, x0, v0
    work["anchor"][:] = x0 - float(system["follow"][0]) * float(values[0])
    start, count = works.copy(), 256 + len(time) + len(time) // 8
    while True:
        pieces = np.empty((count, 7))
        reached = travel(Carrier(RUNNER, systems, works, pieces), time, cubics, samples)
        if reached >= 0:
            place = float(work["q"][0] - system["follow"][0] * work["f"][0])
            load = 1.0 + problem.parameter("gradient") * place
            what = (
                "events without end; expected some per sample; do: report these numbers"
                if load > 0.0
                else f"1 + gradient z; expected never below 0; got {load:.3g}; do: give a smaller gradient"
            )
            raise SimulationError(
                f"simulation of a record: {what} (tau = {float(time[reached])!r}, z = {place:.6g}, law "
                f"{problem.law.name}, parameters {problem.parameters})"
            )
        if works[0]["count"] <= count:
            break
        count, works[:] = int(works[0]["count"]), start
    forces = _slider_forces(problem, systems[0], works[0], float(values[-1]))
    springs = system["spring"][: len(forces)]
    samples = samples[::parts]
    return _Travelled(time, cubics, samples, pieces[: int(works[0]["count"])], float(np.sum(0.5 * forces**2 / springs)))


def _parts(problem: Problem, h: FloatArray) -> int:
    """In how many parts a sampling interval is carried, so that integrals over a part are exact to rounding."""
    from frictionlab.simulator.exact.solve import sliders_of  # noqa: PLC0415 - as above

    stiffness = 1.0 + problem.beta * abs(problem.parameter("gradient")) + sum(sliders_of(problem)[0])
    return max(
        1, ceil(FINE * float(h.max()) * max(sqrt(stiffness), 2.0 * (problem.frame_damping_ratio + problem.zeta)))
    )


def _parted(time: FloatArray, h: FloatArray, cubics: FloatArray, parts: int) -> tuple[FloatArray, FloatArray]:
    """The base's pieces in parts of equal length, each in its own time."""
    if parts == 1:
        return time, cubics
    share = np.arange(parts) / parts
    t = np.outer(h, share)
    c0, c1, c2, c3 = (np.repeat(column, parts).reshape(-1, parts) for column in cubics.T)
    parted = (c0 + t * (c1 + t * (c2 + t * c3)), c1 + t * (2.0 * c2 + 3.0 * t * c3), c2 + 3.0 * t * c3, c3)
    begins = (time[:-1, None] + t).ravel()
    return np.append(begins, time[-1]), np.column_stack([column.ravel() for column in parted])


def _slider_forces(problem: Problem, system: Any, work: Any, f: float) -> FloatArray:
    """Forces of the elastic sliders at the end, over k Y."""
    count = int(system["sliders"])
    place = float(work["q"][0]) - float(system["follow"][0]) * f
    held = system["spring"][:count] * (place - work["anchor"][:count])
    limit = system["strength"][:count] * (1.0 + problem.parameter("gradient") * place)
    return np.asarray(np.where(work["slips"][:count] != 0, float(work["side"][0]) * limit, held))


class _Ends(NamedTuple):
    """Begins and ends (2, m) of the pieces between events: the relative motion, the base, and the force F."""

    z: FloatArray
    v: FloatArray
    a: FloatArray
    jerk: FloatArray
    base: FloatArray  # (4, 2, m): f and its derivatives
    force: FloatArray  # (3, 2, m): F and its derivatives


def _ends(problem: Problem, found: _Travelled, wall: float) -> _Ends:
    rows, last = found.rows, found.samples[-1]
    here = np.clip(np.searchsorted(found.time, rows[:, 0] + 0.5 * rows[:, 1], side="right") - 1, 0, len(found.time) - 2)
    t = np.vstack((rows[:, 0], rows[:, 0] + rows[:, 1])) - found.time[here]
    c0, c1, c2, c3 = found.cubics[here].T
    f = np.array(
        [
            c0 + t * (c1 + t * (c2 + t * c3)),
            c1 + t * (2.0 * c2 + 3.0 * t * c3),
            2.0 * c2 + 6.0 * t * c3,
            np.broadcast_to(6.0 * c3, t.shape),
        ]
    )
    none, lead = np.zeros_like(f[0]), 2.0 * problem.frame_damping_ratio
    force = {
        0.0: np.array([f[0] + lead * f[1], f[1] + lead * f[2], f[2] + lead * f[3]]),
        1.0: np.array([-f[2], -f[3], none]),
        2.0: -f[:3],
    }[wall]
    moves = 1.0 if wall == 1.0 else 0.0
    z = np.vstack((rows[:, 2], np.append(rows[1:, 2], last[0]))) - moves * f[0]
    v = np.vstack((rows[:, 3], np.append(rows[1:, 3], last[1]))) - moves * f[1]
    kappa, offset, thick = rows[:, 4], rows[:, 5], lead + 2.0 * problem.zeta
    held = np.isinf(kappa)
    v = np.where(held, 0.0, v)
    stiffness = 1.0 + np.where(held, 0.0, kappa)
    a = np.where(held, 0.0, force[0] - thick * v - stiffness * z - offset)
    return _Ends(z, v, a, np.where(held, 0.0, force[1] - thick * a - stiffness * v), f, force)


def _integral(length: FloatArray, one: tuple[FloatArray, ...], other: tuple[FloatArray, ...]) -> float:
    """Integral of a product, from values and two derivatives (2, m) of both at the ends of pieces (m,), in all.

    Hermite's rule ``h/2 (y0 + y1) + h^2/10 (y0' - y1') + h^3/120 (y0'' + y1'')``: exact up to degree 5.
    """
    value, slope = one[0] * other[0], one[1] * other[0] + one[0] * other[1]
    bend = one[2] * other[0] + 2.0 * one[1] * other[1] + one[0] * other[2]
    rule = 0.5 * value.sum(axis=0) + length * (0.1 * (slope[0] - slope[1]) + length / 120.0 * bend.sum(axis=0))
    return float(np.sum(length * rule))


def _response(problem: Problem, base: BaseRecord, found: _Travelled) -> Response:
    wall = wall_of(problem, base)
    ends, rows = _ends(problem, found, wall), found.rows
    length, side, moved = rows[:, 1], rows[:, 6], np.isfinite(rows[:, 4])
    way = np.where(moved, ends.z[1] - ends.z[0], 0.0)
    kappa, offset = np.where(moved, rows[:, 4], 0.0), rows[:, 5]
    work = float(np.sum(way * (0.5 * kappa * (ends.z[0] + ends.z[1]) + offset)))
    speed = (ends.v, ends.a, ends.jerk)
    squared = _integral(length, speed, speed)
    frame = squared
    if wall == 0.0:
        slip = (ends.v - ends.base[1], ends.a - ends.base[2], ends.jerk - ends.base[3])
        frame = _integral(length, slip, slip)
    put_in = _integral(length, (ends.force[0], ends.force[1], ends.force[2]), speed)
    zeta_c, zeta_f = problem.zeta, problem.frame_damping_ratio
    stored = [0.5 * float(z**2 + v**2) for z, v in ((ends.z[0, 0], ends.v[0, 0]), (ends.z[1, -1], ends.v[1, -1]))]
    events = _events(rows[:, 0], length, side, ends.z[0])
    friction = work - found.stored
    force = found.samples[:, 2].copy()
    force[0] = kappa[0] * ends.z[0, 0] + offset[0] if moved[0] else ends.force[0][0, 0] - ends.z[0, 0]
    force[0] += 2.0 * problem.zeta * ends.v[0, 0]
    return Response(
        problem=problem,
        base=base,
        displacement=found.samples[:, 0],
        velocity=found.samples[:, 1],
        contact_force=force,
        events=events,
        energy=friction + 2.0 * zeta_c * squared + 2.0 * zeta_f * frame,
        friction_energy=friction,
        energy_input=put_in,
        closure_error=abs(put_in - work - 2.0 * (zeta_f + zeta_c) * squared - (stored[1] - stored[0])),
        path=float(np.sum(np.abs(way[side != 0.0]))),
        stops=int(np.count_nonzero((events[1:, 1] == 0.0) & (events[:-1, 1] != 0.0))),
        time_stuck=float(np.sum(length[side == 0.0])),
    )


def _events(begins: FloatArray, length: FloatArray, side: FloatArray, z: FloatArray) -> FloatArray:
    """What begins, when and where (m, 3): slips, and stops that are more than touches."""
    fresh = np.flatnonzero(np.concatenate(([True], side[1:] != side[:-1])))
    lasts = np.add.reduceat(length, fresh)
    kept = fresh[(side[fresh] != 0.0) | (lasts > TOUCH)]
    kept = kept[np.concatenate(([True], side[kept][1:] != side[kept][:-1]))]
    return np.column_stack((begins[kept], side[kept], z[kept]))
