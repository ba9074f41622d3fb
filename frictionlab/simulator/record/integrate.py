"""A sampled base motion under a law without exact phases: the integrated flow, piece by piece."""

from math import inf, sqrt

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.numeric import RTOL, radau
from frictionlab.simulator.numeric.flow import Flow
from frictionlab.simulator.numeric.motion import Integrals, contact_along, integrals, slow_times, stop_limits
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record.base import BaseRecord, wall_of
from frictionlab.simulator.record.response import Response

LONGEST = 0.5  # rad: what is carried at once at most
RECORDED = 4000  # steps that may be made within it, and
ALLOWED = 20_000  # tried
LOGGED = 12_000  # steps recorded before they are accounted for


def integrate(problem: Problem, base: BaseRecord, start: tuple[float, float]) -> Response:
    """Return the response of a law without exact phases from a start x, v."""
    wall, values, rates, h = wall_of(problem, base), base.values, base.speeds, np.diff(base.time)
    slope = np.diff(values) / h
    bend = (rates[:-1] + rates[1:] - 2.0 * slope) / h
    curve = np.column_stack((values[:-1], rates[:-1], (slope - rates[:-1]) / h - bend, bend / h))
    pull = _force(curve, 2.0 * problem.frame_damping_ratio, wall)
    z, v = (start[0] - float(values[0]), start[1] - float(rates[0])) if wall == 1.0 else start
    flow = _flow(problem, curve, pull, (z, v))
    sums, (times, slips, places), samples = _travelled(flow, base, curve, pull)
    push, rate = (sqrt(2.0 * float(h @ pull[:, k] ** 2) / float(h.sum())) for k in (0, 1))  # root of 2 of the rms
    events, stops = _events(times, slips, places, *stop_limits(problem, rate, push / rate))
    frame, dashpot, x = 2.0 * problem.frame_damping_ratio, 2.0 * problem.zeta * sums.squared, samples
    friction, slides = sums.work - dashpot - _stored(flow), events[events[:, 1] != 0.0, 0]
    return Response(
        problem=problem,
        base=base,
        displacement=x[0] + values if wall == 1.0 else x[0],
        velocity=x[1] + rates if wall == 1.0 else x[1],
        contact_force=x[2],
        events=events,
        energy=friction + dashpot + frame * (sums.squared if problem.wall == "base" else sums.dragged),
        friction_energy=friction,
        energy_input=sums.put_in,
        closure_error=sums.closure_error(frame, 0.5 * float(x[0, -1] ** 2 + x[1, -1] ** 2 - z**2 - v**2)),
        path=sums.path,
        stops=int(np.count_nonzero(stops[:, 0] > slides.min(initial=inf))),
        time_stuck=float(np.sum(np.diff(stops))),
        solver="numeric",
    )


def _force(curve: FloatArray, lead: float, wall: float) -> FloatArray:
    """The force F of each piece of the base's motion (n, 4), in the words of `wall_of`."""
    rate = curve[:, 1:] * (1.0, 2.0, 3.0)
    if wall == 0.0:
        force = curve.copy()
        force[:, :3] += lead * rate
        return force
    if wall == 2.0:
        return -curve
    return np.pad(-rate[:, 1:] * (1.0, 2.0), ((0, 0), (0, 2)))


def _flow(problem: Problem, curve: FloatArray, pull: FloatArray, start: tuple[float, float]) -> Flow:
    """The integrated flow at its start, its drive a cubic, its errors measured by what the drive does."""
    flow = Flow(problem, RTOL, steps=ALLOWED)
    flow.drive = radau.Forcing(np.zeros(4), np.zeros(0), np.zeros(2))
    flow.work = flow.work._replace(log=np.empty((LOGGED, flow.work.log.shape[1])))
    state = flow.work.state
    state[:2], state[3] = start, 1.0  # a contact that has an age has its steady one
    flow.work.clock.next = LONGEST
    push, rate = float(np.abs(pull[:, 0]).max()), float(np.abs(curve[:, 1]).max())
    flow.rig.scale[:2] = min(push, 1.0), min(push, max(rate, 1e-3 * push))
    return flow


def _travelled(
    flow: Flow, base: BaseRecord, curve: FloatArray, pull: FloatArray
) -> tuple[Integrals, FloatArray, FloatArray]:
    """Integrals over the motion; time, slip and z (3, m) at its steps' nodes; z, v and contact force at the samples."""
    lengths, rig, done = np.diff(base.time), flow.rig, 0
    sums, nodes, samples = Integrals(0.0, 0.0, 0.0, 0.0, 0.0), [], []
    while done < len(lengths):
        flow.work.clock.rows = 0
        code, reached, ends = radau.travel(flow.law, rig, flow.drive, flow.work, lengths, pull, done, LONGEST, RECORDED)
        if code != radau.FINE:
            raise _lost(flow.problem, float(base.time[reached]), code)
        last = ends[done:reached].astype(np.intp) - 1
        begin, length, side, values = flow.recorded()
        piece = done + np.repeat(np.arange(reached - done), np.diff(last, prepend=-1))
        t = begin[:, None] + length[:, None] * radau.NODES
        contact, c = contact_along(flow.law, rig, side, values), pull[piece].T[:, :, None]
        drive = _value(c, t), _value(_rate(c), t), _value(_rate(curve[piece].T[:, :, None]), t)
        found = integrals(rig, length, values, contact, drive)
        sums = Integrals(*(one + other for one, other in zip(sums, found, strict=True)))
        force = np.where(side[:, None] == 0.0, drive[0] - values[:, 0], contact[0])
        seen = np.stack((values[:, 0], values[:, 1], force))
        samples += [seen[:, last, -1]] if done else [seen[:, :1, 0], seen[:, last, -1]]
        nodes.append(np.stack((base.time[piece][:, None] + t, contact[1], values[:, 0])).reshape(3, -1))
        done = reached
    return sums, np.concatenate(nodes, axis=1), np.concatenate(samples, axis=1)


def _value(c: FloatArray, t: FloatArray) -> FloatArray:
    """The values of polynomials (order + 1, n, 1) at times (n, 8) from their starts."""
    total = 0.0 * t
    for coefficient in c[::-1]:
        total = total * t + coefficient
    return total


def _rate(c: FloatArray) -> FloatArray:
    """The rates of polynomials."""
    return np.asarray(c[1:] * np.arange(1.0, len(c))[:, None, None])


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


def _stored(flow: Flow) -> float:
    """Energy in the contact's spring at the end, over k Y^2: its force at rest is the spring's."""
    if flow.rig.size == 2:
        return 0.0
    state = flow.work.state.copy()
    state[1] = 0.0
    spring = float(contact_along(flow.law, flow.rig, np.ones(1), state[None])[0, 0])
    return 0.5 * spring**2 / flow.problem.parameter("stiffness_ratio")


def _lost(problem: Problem, tau: float, code: int) -> SimulationError:
    """Why the motion cannot be carried on."""
    what = f"simulation of a record: law {problem.law.name}, parameters {problem.parameters}, at tau = {tau:.6g}: "
    if code == radau.NEGATIVE:
        return SimulationError(
            f"{what}friction turns negative; expected at least 0; do: a smaller gradient or rate_strength"
        )
    return SimulationError(
        f"{what}expected fewer than {RECORDED} steps in {LONGEST} rad; got more: the contact rings, or the law is too"
        " stiff; do: take the law that this one tends to (a rigid contact for a stiffness without end)"
    )
