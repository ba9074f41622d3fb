"""A sampled base motion under a law without exact phases: the numeric engine, piece by piece."""

from math import inf, sqrt
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.numeric import RTOL, layout, machine
from frictionlab.simulator.numeric.machine import LostError, Machine
from frictionlab.simulator.numeric.motion import NODES, Integrals, integrals, slow_times, stop_limits
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record.base import BaseRecord, wall_of
from frictionlab.simulator.record.piece import cubic_of, force_of
from frictionlab.simulator.record.response import Response

LONGEST = 0.5  # rad: what is carried at once at most
RECORDED = 4000  # steps that may be made within it, and
ALLOWED = 20_000  # tried
ROOM = 12_000  # steps recorded before they are accounted for
WORTH_LOADING, WORTH_COMPILING = 500.0, 10_000.0  # pieces: in plain Python they take about as long


def load(pieces: float) -> bool:
    """Say whether so many pieces are worth the compiled kernel, and load it if so."""
    if machine.compiled.cache_info().currsize:
        return True
    if pieces > WORTH_COMPILING or (pieces > WORTH_LOADING and machine.is_ready()):
        machine.compiled()
        return True
    return False


def integrate(problem: Problem, base: BaseRecord, start: tuple[float, float]) -> Response:
    """Return the response of a law without exact phases from a start x, v."""
    h: Any = np.diff(base.time)  # the formulas of a piece take arrays as well
    values: Any = base.values
    slopes: Any = base.speeds
    cubic: Any = cubic_of(values[:-1], values[1:], slopes[:-1], slopes[1:], h)
    wall = wall_of(problem, base)
    force = force_of(cubic, problem.frame_damping_ratio, wall)
    curve, pull = (np.stack([c + 0.0 * h for c in each], axis=1) for each in (cubic, force))
    at = (start[0] - float(values[0]), start[1] - float(slopes[0])) if wall == 1.0 else start
    rig = _machine(problem, curve, pull, at, fast=load(len(h)))
    sums, nodes, motion = _travelled(rig, base, curve, pull)
    span = float(h.sum())
    push, rate = (sqrt(2.0 * float(h @ pull[:, k] ** 2) / span) for k in (0, 1))  # amplitudes: the root of 2 of the rms
    limits = stop_limits(problem, rate, push / rate)
    return _response(problem, base, rig, (at, *motion), sums, _events(*nodes, *limits))


def _machine(problem: Problem, curve: FloatArray, pull: FloatArray, at: tuple[float, float], *, fast: bool) -> Machine:
    """The engine at its start, set up for a drive that is a cubic, its errors measured by what the drive does."""
    rig = Machine(problem, RTOL, fast=fast, steps=ALLOWED, rows=ROOM)
    rig.room = rig.room._replace(cosine=rig.buffer((0.0,) * 4), sine=rig.buffer(()))
    state = np.zeros(rig.size)
    state[:2] = at
    if rig.size == layout.WIDTH:
        state[3] = 1.0  # a rate-and-state contact has its steady age
    rig.put(state)
    rig.room.tally[layout.LENGTH] = LONGEST
    push, rate = float(np.abs(pull[:, 0]).max()), float(np.abs(curve[:, 1]).max())
    rig.room.scale[0], rig.room.scale[1] = min(push, 1.0), min(push, max(rate, 1e-3 * push))
    return rig


def _travelled(
    rig: Machine, base: BaseRecord, curve: FloatArray, pull: FloatArray
) -> tuple[Integrals, tuple[FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]]:
    """Integrals over the motion; time, slip and z at its steps' nodes; z, v and contact force at the samples."""
    lengths, starts = np.diff(base.time), base.time[:-1]
    pieces = rig.engine.flat(lengths), rig.engine.flat(pull)
    ends = rig.engine.flat(np.full(len(lengths), -1.0))
    sums, nodes, samples = Integrals(0.0, 0.0, 0.0, 0.0, 0.0), [], []
    done = 0
    while done < len(lengths):
        rig.room.tally[layout.ROWS] = 0.0
        code = rig.kernel.travel(rig.rig, rig.room, pieces, done, (LONGEST, RECORDED), ends)
        counts = np.array(ends[done:])
        part = int(np.count_nonzero(counts >= 0.0))
        if code != layout.FINE:
            raise _lost(rig.problem, float(base.time[done + part]), code)
        last = counts[:part].astype(np.intp) - 1
        begin, length, side, values = rig.recorded()
        piece = done + np.repeat(np.arange(part), np.diff(last, prepend=-1))
        t = begin[:, None] + length[:, None] * NODES
        held, slip = machine.contacts_of(rig.problem, np.repeat(side, layout.NODES), values.reshape(-1, layout.WIDTH))
        held, slip = held.reshape(t.shape), slip.reshape(t.shape)
        drive = (_cubic(pull[piece], t), _slope(pull[piece], t), _slope(curve[piece], t))
        found = integrals(length, values, (held, slip), drive, inner=not rig.is_smooth)
        sums = Integrals(*(one + other for one, other in zip(sums, found, strict=True)))
        n = np.where(side[:, None] == 0.0, drive[0] - values[:, :, 0], held)
        if not done:
            samples.append((values[:1, 0, 0], values[:1, 0, 1], n[:1, 0]))
        samples.append((values[last, -1, 0], values[last, -1, 1], n[last, -1]))
        nodes.append(((starts[piece][:, None] + t).ravel(), slip.ravel(), values[:, :, 0].ravel()))
        done += part
    x, v, n = (np.concatenate(column) for column in zip(*samples, strict=True))
    times, slips, places = (np.concatenate(column) for column in zip(*nodes, strict=True))
    return sums, (times, slips, places), (x, v, n)


def _cubic(c: FloatArray, t: FloatArray) -> FloatArray:
    """The values of cubics (n, 4) at times (n, 8) from their starts."""
    c0, c1, c2, c3 = c.T[:, :, None]
    return np.asarray(c0 + t * (c1 + t * (c2 + t * c3)))


def _slope(c: FloatArray, t: FloatArray) -> FloatArray:
    """The rates of cubics (n, 4) at times (n, 8) from their starts."""
    _, c1, c2, c3 = c.T[:, :, None]
    return np.asarray(c1 + t * (2.0 * c2 + 3.0 * t * c3))


def _events(
    times: FloatArray, slip: FloatArray, z: FloatArray, slow: float, shortest: float, gap: float
) -> tuple[FloatArray, FloatArray]:
    """What begins, when and where (m, 3), as a `Response` lists it, and the stops (k, 2).

    A slow time that does not last is a turn, and told only if slip goes on the other way.
    """
    spans = slow_times(times, slip, slow, gap)
    lasts = spans[:, 1] - spans[:, 0] > shortest
    places = z[np.minimum(np.searchsorted(times, spans[:, 0]), len(z) - 1)]
    passed = np.searchsorted(spans[:, 1], times, side="right")
    fast = np.flatnonzero((np.abs(slip) >= slow) & (np.searchsorted(spans[:, 0], times) <= passed))
    way, passed = np.sign(slip[fast]), passed[fast]
    before = np.concatenate(([0], passed[:-1]))
    after = passed > before  # the first look at slip after a slow time
    stopped = np.concatenate(([0], np.cumsum(lasts)))
    begins = (np.diff(way, prepend=0.0) != 0.0) | (stopped[passed] > stopped[before])
    at, span = fast[begins], passed[begins] - 1
    since_slow = after[begins]
    when = np.where(since_slow, spans[span, 1] if len(spans) else 0.0, times[at])
    where = np.where(since_slow, places[span] if len(spans) else 0.0, z[at])
    slides = np.column_stack((when, way[begins], where))
    stops = np.column_stack((spans[lasts, 0], np.zeros(int(lasts.sum())), places[lasts]))
    events = np.vstack((slides, stops))
    return events[np.argsort(events[:, 0], kind="stable")], spans[lasts]


def _lost(problem: Problem, tau: float, code: int) -> SimulationError:
    """Why the motion cannot be carried on."""
    what = f"simulation of a record: law {problem.law.name}, parameters {problem.parameters}, at tau = {tau:.6g}: "
    if code == layout.NEGATIVE:
        return LostError(f"{what}friction turns negative; expected at least 0; do: a smaller gradient or rate_strength")
    return LostError(
        f"{what}expected fewer than {RECORDED} steps in {LONGEST} rad; got more: the contact rings, or the law is too"
        " stiff; do: take the law that this one tends to (a rigid contact for a stiffness without end)"
    )


def _response(
    problem: Problem,
    base: BaseRecord,
    rig: Machine,
    motion: tuple[tuple[float, float], FloatArray, FloatArray, FloatArray],
    sums: Integrals,
    seen: tuple[FloatArray, FloatArray],
) -> Response:
    """The numbers of a motion relative to the wall (its start; z, v and contact force at the samples)."""
    at, z, v, n = motion
    events, stops = seen
    inner = float(rig.state[2]) if rig.size > 2 else 0.0
    spring = inner * problem.parameter("stiffness_ratio") if problem.law.has("lugre") else inner
    stored = 0.5 * spring**2 / problem.parameter("stiffness_ratio", inf)
    frame, dashpot = 2.0 * problem.frame_damping_ratio, 2.0 * problem.zeta * sums.squared
    friction = sums.work - dashpot - stored
    moving = wall_of(problem, base) == 1.0
    slides = events[events[:, 1] != 0.0, 0]
    return Response(
        problem=problem,
        base=base,
        displacement=z + base.values if moving else z,
        velocity=v + base.speeds if moving else v,
        contact_force=n,
        events=events,
        energy=friction + dashpot + frame * (sums.squared if problem.wall == "base" else sums.dragged),
        friction_energy=friction,
        energy_input=sums.put_in,
        closure_error=sums.closure_error(frame, 0.5 * float(z[-1] ** 2 + v[-1] ** 2 - at[0] ** 2 - at[1] ** 2)),
        path=sums.path,
        stops=int(np.count_nonzero(stops[:, 0] > slides.min(initial=inf))),
        time_stuck=float(np.sum(stops[:, 1] - stops[:, 0])),
        solver="numeric",
    )
