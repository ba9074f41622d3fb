"""A sampled base motion under a law without exact phases: the integrated flow, piece by piece."""

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.simulator.numeric import RTOL, radau
from frictionlab.simulator.numeric.flow import Flow, contact_along, slow_times, stop_limits
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record.base import BaseRecord, derivatives_of, force_of
from frictionlab.simulator.record.respond import Carried

LONGEST = 0.5  # rad: what is carried at once at most
RECORDED = 4000  # steps that may be made within it, and
ALLOWED = 20_000  # tried
LOGGED = 12_000  # steps recorded before they are accounted for


def integrate(problem: Problem, base: BaseRecord, x0: float, v0: float) -> Carried:
    """Carry the mass through the record from a displacement and a velocity on, the contact unloaded."""
    cubics = base.pieces()[1]
    pull, lengths, shift = force_of(problem, base, cubics), np.diff(base.time), np.zeros((2, len(base.time)))
    if problem.wall == "base" and base.quantity == "displacement":
        shift[:] = base.values, base.speeds
    flow = _flow(problem, cubics, pull, (x0 - float(shift[0, 0]), v0 - float(shift[1, 0])))
    begun, done, sums, nodes, samples = flow.work.state[:2].copy(), 0, np.zeros(5), [], []
    while done < len(lengths):
        flow.work.clock.rows = 0
        code, reached, ends = radau.travel(
            flow.law, flow.rig, flow.drive, flow.work, lengths, pull, done, LONGEST, RECORDED
        )
        if code != radau.FINE:
            what = f"a record at tau = {base.time[reached]:.6g}"
            raise flow.failure(code, what, f"{RECORDED} steps in {LONGEST} rad")
        last = ends[done:reached].astype(np.intp) - 1
        piece = done + np.repeat(np.arange(reached - done), np.diff(last, prepend=-1))
        found, passed, seen = _accounted(flow, cubics[piece], pull[piece])
        sums += found
        nodes.append(passed)
        passed[0] += np.repeat(base.time[piece], radau.COUNT)
        samples += [seen[:, last, -1]] if done else [seen[:, :1, 0], seen[:, last, -1]]
        done = reached
    moved = np.concatenate(samples, axis=1)
    work, squared, dragged, put_in, path = sums.tolist()
    rms = [float(np.sqrt(2.0 * (lengths @ pull[:, k] ** 2) / lengths.sum())) for k in (0, 1)]  # times the root of 2
    return Carried(
        samples=moved + np.pad(shift, ((0, 1), (0, 0))),
        events=_events(np.concatenate(nodes, axis=1), *stop_limits(problem, rms[1], rms[0] / rms[1])),
        work=work - 2.0 * problem.zeta * squared,
        squared=squared,
        dragged=dragged if problem.wall == "fixed" else squared,
        put_in=put_in,
        path=path,
        stored=_stored(flow),
        gained=0.5 * float(np.sum(moved[:2, -1] ** 2) - np.sum(begun**2)),
    )


def _flow(problem: Problem, cubics: FloatArray, pull: FloatArray, start: tuple[float, float]) -> Flow:
    """The integrated flow at its start, its drive a cubic, its errors measured by what the drive does."""
    flow = Flow(problem, RTOL, steps=ALLOWED)
    flow.drive = radau.Forcing(np.zeros(4), np.zeros(0), np.zeros(2))
    flow.work = flow.work._replace(log=np.empty((LOGGED, flow.work.log.shape[1])))
    flow.work.state[:2], flow.work.state[3] = start, 1.0  # a contact that has an age has its steady one
    flow.work.clock.next = LONGEST
    push, rate = float(np.abs(pull[:, 0]).max()), float(np.abs(cubics[:, 1]).max())
    flow.rig.scale[:2] = min(push, 1.0), min(push, max(rate, 1e-3 * push))
    return flow


def _accounted(flow: Flow, cubics: FloatArray, pull: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of the steps recorded: integrals of n v, v^2, (v - f')^2, F v and |slip|; time, slip, z; z, v, n at the nodes.

    What goes in comes from displacements only, what is taken from forces and speeds: they agree no better than the
    steps are. Without an inner state slip is but the direction of the mass's speed.
    """
    begin, length, side, values = flow.recorded()
    times = begin + np.outer(radau.NODES, length)
    (force, rise), speed = derivatives_of(pull, times)[:2].swapaxes(1, 2), derivatives_of(cubics, times)[1].T
    (n, slip), z, v = contact_along(flow.law, flow.rig, side, values), values[:, 0], values[:, 1]
    slipped = np.abs(slip if flow.rig.size > 2 else slip * v)
    weights = length[:, None] * radau.MATRIX[-1]
    sums = np.array([np.sum(weights * rate[:, 1:]) for rate in (n * v, v * v, (v - speed) ** 2, -z * rise, slipped)])
    sums[3] += np.sum(force[:, -1] * z[:, -1] - force[:, 0] * z[:, 0])
    held = np.where(side[:, None] == 0.0, force - z, n)
    return sums, np.stack((times.T, slip, z)).reshape(3, -1), np.stack((z, v, held))


def _events(nodes: FloatArray, slow: float, shortest: float, gap: float) -> FloatArray:
    """What begins, when and where (m, 3), as a `Response` lists it, from time, slip and z (3, n).

    A slow time that does not last is a turn, and listed only if slip goes on the other way.
    """
    times, slip, z = nodes
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
    return events[np.argsort(events[:, 0], kind="stable")]


def _stored(flow: Flow) -> float:
    """Energy in the contact's spring at the end, over k Y^2: its force at rest is the spring's."""
    if flow.rig.size == 2:
        return 0.0
    state = flow.work.state.copy()
    state[1] = 0.0
    spring = float(contact_along(flow.law, flow.rig, np.ones(1), state[None])[0, 0])
    return 0.5 * spring**2 / flow.problem.parameter("stiffness_ratio")
