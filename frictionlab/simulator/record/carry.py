"""A sampled base motion under any laws: by exact phases from event to event between samples, or by steps.

What is integrated over a motion is a product of two smooth functions: Hermite's rule on exact pieces, of values and two
derivatives at their ends, Gauss-Radau's on steps.
"""

from collections.abc import Callable
from math import ceil, inf, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.compiled import record_of
from frictionlab.simulator.exact.answer import travel
from frictionlab.simulator.exact.motion import WORK
from frictionlab.simulator.exact.orbit import Carrier
from frictionlab.simulator.exact.phase import DONE, MISSING, bound_by, make_phase
from frictionlab.simulator.exact.solve import TOUCH, feel_acceleration, system_of
from frictionlab.simulator.numeric import RTOL, radau
from frictionlab.simulator.numeric.flow import Flow, slow_times, stop_limits
from frictionlab.simulator.record.base import BaseRecord, derivatives_of
from frictionlab.simulator.structure import Structure

FINE = 16.0  # parts per unit of the fastest phase's time
LONGEST = 0.5  # rad: what steps carry at once at most
RECORDED = 4000  # steps that may be made within it, and
ALLOWED = 20_000  # tried
LOGGED = 12_000  # steps recorded before they are accounted for
Integral = Callable[[FloatArray, FloatArray], float]


class Carried(NamedTuple):
    """A motion along a record, relative to the base where every contact is against it: as a flow leaves it."""

    samples: FloatArray  # (k, 2 n + c): displacements, velocities, contacts' forces
    events: list[FloatArray]  # of each contact, as `Response` has them
    friction: FloatArray  # (c,): work done on contacts, their dashpots apart
    dashpots: FloatArray  # (c,): taken by them
    frame: float  # taken by the frame's dashpots
    paths: FloatArray  # (c,): ways slipped
    stored: FloatArray  # (c,): energy in the contacts' springs at the end
    put_in: float  # work of the forces that drive the masses
    gap: float  # of the energies


def drive_of(base: BaseRecord, parts: int, *, acceleration: bool) -> tuple[FloatArray, FloatArray]:
    """Return times (k + 1,) and cubics (k, 4) of what drives, a sampling interval in so many parts."""
    time, cubics = base.pieces(parts)
    if acceleration and base.quantity == "displacement":
        cubics = np.column_stack((2.0 * cubics[:, 2], 6.0 * cubics[:, 3], np.zeros((len(cubics), 2))))
    return np.array(time), cubics  # to be written on, as all arrays are for which the flows are compiled


def by_phases(frame: Structure, base: BaseRecord, q: FloatArray, v: FloatArray) -> Carried:
    """Let the exact flow carry the masses through the record from displacements and velocities (n,) on."""
    systems, works = system_of(frame), record_of(WORK)
    system, work, n = systems[0], works[0], frame.masses
    relative = frame.follows_base
    if relative:
        feel_acceleration(systems)
    contacts = int(system["contacts"])
    row = system["row"][:contacts, :n]
    kappas = [sum(system["spring"][system["first"][c] : system["first"][c + 1]]) for c in range(contacts)]
    change = [abs(contact.beta * contact.parameter("gradient")) for contact in frame.contacts]
    stiffness = frame.stiffness + row.T @ (np.array([*map(sum, zip(kappas, change, strict=True))])[:, None] * row)
    thick = np.linalg.eigvals(system["mobility"][:n, :n] @ system["damping"][:n, :n])
    fastest = max(sqrt(np.linalg.eigvals(system["mobility"][:n, :n] @ stiffness).real.max()), thick.real.max())
    parts = max(1, ceil(FINE * float(np.diff(base.time).max()) * fastest))  # integrals are exact to rounding then
    time, cubics = drive_of(base, parts, acceleration=relative)
    found, count = np.zeros((len(time), 2 * n + contacts)), 256 + len(time) + len(time) // 8
    system["harmonics"] = 0
    work["left"], work["q"][:n], work["v"][:n] = inf, q, v
    for c in range(contacts):
        place = row[c] @ q - system["follow"][c] * cubics[0, 0]
        work["anchor"][int(system["first"][c]) : int(system["first"][c + 1])] = place
    start = {name: works[name].copy() for name in ("q", "v", "anchor")}
    while True:
        pieces = np.empty((count, 2 + 2 * n + 3 * contacts))
        reached = travel(Carrier(systems, works, pieces), time, cubics, found)
        if reached >= 0 and not work["phases"]["missing"]:
            place = row @ work["q"][:n] - system["follow"][:contacts] * work["f"][0]
            raise _stranded(frame, float(time[reached]), place)
        if reached < 0 and work["count"] <= count:
            break
        if reached >= 0:
            make_phase(systems, works)
        count = max(count, int(work["count"]))
        for name, values in start.items():
            works[name] = values
    return _along_pieces(frame, systems, works, pieces[: int(work["count"])], (time, cubics), found)._replace(
        samples=found[::parts].copy()
    )


def _stranded(frame: Structure, tau: float, place: FloatArray) -> SimulationError:
    """Why the motion came no further."""
    loads = [1.0 + contact.parameter("gradient") * z for contact, z in zip(frame.contacts, place, strict=True)]
    what = "events without end; expected some per sample; do: report these numbers"
    if min(loads, default=1.0) <= 0.0:
        what = f"1 + gradient z; expected never below 0; got {min(loads):.3g}; do: give a smaller gradient"
    laws = ", ".join(f"law {contact.law.name}, parameters {contact.parameters}" for contact in frame.contacts)
    return SimulationError(f"simulation of a record: {what} (tau = {tau!r}, z = {place.tolist()}, {laws})")


def _along_pieces(
    frame: Structure,
    systems: Any,
    works: Any,
    rows: FloatArray,
    drive: tuple[FloatArray, FloatArray],
    found: FloatArray,
) -> Carried:
    """Energies and events of pieces (m, 2 + 2 n + 3 c) as `exact.solve.Trajectory` has them.

    Writes the contacts' forces at the first sample. `drive`: times, and cubics between them.
    """
    (time, cubics), n, contacts = drive, frame.masses, len(frame.contacts)
    system, begins, length = systems[0], rows[:, 0], rows[:, 1]
    kappa, offset, side = np.split(rows[:, 2 + 2 * n :].T, (contacts, 2 * contacts))
    here = np.clip(np.searchsorted(time, begins + 0.5 * length, side="right") - 1, 0, len(time) - 2)
    f = derivatives_of(cubics[here], np.vstack((begins, begins + length)) - time[here])
    ends = np.vstack((rows[:, 2 : 2 + 2 * n], found[-1:, : 2 * n])).T
    q, v = np.stack((ends[:, :-1], ends[:, 1:]), axis=1).reshape(2, n, 2, -1)
    speed, force = np.empty((3, n, 2, len(rows))), np.empty((3, contacts, 2, len(rows)))
    speed[0] = v
    changes = np.flatnonzero(np.any(kappa[:, 1:] != kappa[:, :-1], axis=0)) + 1
    runs = np.append(0, changes)
    phases, inverse = np.unique(kappa[:, runs], axis=1, return_inverse=True)
    which = np.repeat(inverse.ravel(), np.diff(np.append(runs, len(rows))))
    for number, stiff in enumerate(phases.T):
        some = np.flatnonzero(which == number) if phases.shape[1] > 1 else slice(None)
        part = (f[..., some], q[..., some], v[..., some], offset[:, some])
        speed[1:, ..., some], force[..., some] = _in_phase(system, stiff, *part)
    follow, row = system["follow"][:contacts], system["row"][:contacts, :n]
    slip = np.einsum("ca,oaem->ocem", row, speed) - follow[:, None, None] * f[1:, None]
    s = np.einsum("ca,aem->cem", row, q) - follow[:, None, None] * f[0]
    loose = np.isfinite(kappa)
    way = np.where(loose, s[:, 1] - s[:, 0], 0.0)
    work = way * (np.where(loose, 0.5 * kappa, 0.0) * (s[:, 0] + s[:, 1]) + offset)
    found[0, 2 * n :] = force[0, :, 0, 0] + system["dashpot"][:contacts] * slip[0, :, 0, 0]

    def integral(one: FloatArray, other: FloatArray) -> float:
        """Of a product, from values and two derivatives (3, 2, m) of both at the ends of pieces, exact up to degree 5.

        Hermite's rule ``h/2 (y0 + y1) + h^2/10 (y0' - y1') + h^3/120 (y0'' + y1'')``.
        """
        value, slope = one[0] * other[0], one[1] * other[0] + one[0] * other[1]
        bend = one[2] * other[0] + 2.0 * one[1] * other[1] + one[0] * other[2]
        rule = 0.5 * value.sum(axis=0) + length * (0.1 * (slope[0] - slope[1]) + length / 120.0 * bend.sum(axis=0))
        return float(np.sum(length * rule))

    moved = tuple(np.moveaxis(part, 1, 0) for part in (speed, slip, force))
    friction, last = work.sum(axis=1), (found[0], found[-1])
    sums = _energies(frame, system, integral, (f[:3], f[1:]), moved, friction, last)
    stored = springs_of(system, works[0], s[:, 1, -1])
    events = [_events(begins, length, side[c], s[c, 0]) for c in range(contacts)]
    paths = np.sum(np.abs(way) * (side != 0.0), axis=1)
    return Carried(found, events, friction, sums[0], sums[1], paths, stored, *sums[2:])


def _in_phase(
    system: Any, kappa: FloatArray, f: FloatArray, q: FloatArray, v: FloatArray, offset: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Accelerations and their rates (2, n, 2, m); forces of contacts and two derivatives (3, c, 2, m).

    `f` (4, 2, m): what drives and its derivatives; `q`, `v` (n, 2, m): at both ends of pieces of one phase.
    """
    n, contacts = len(q), len(kappa)
    row, follow, push = system["row"][:contacts, :n], system["follow"][:contacts], system["push"][:n]
    mobile, damping, held = system["mobility"][:n, :n], system["damping"][:n, :n], np.isinf(kappa)
    stiffness, by_f, grip, bind = bound_by(system, kappa)
    moved, mobile = mobile @ row.T @ bind, mobile - mobile @ row.T @ grip
    springs = np.where(held, 0.0, kappa)

    def applied(matrix: FloatArray, x: FloatArray) -> FloatArray:
        return np.asarray(np.tensordot(matrix, x, 1))

    def driven(order: int) -> FloatArray:
        return np.asarray(np.multiply.outer(by_f, f[order]) + np.multiply.outer(push[:, 1], f[order + 1]))

    constant = applied(row.T, np.where(held[:, None], 0.0, offset))[:, None]
    net = driven(0) - applied(damping, v) - applied(stiffness, q) - constant
    a = applied(mobile, net) + np.multiply.outer(moved, f[2])
    rise = driven(1) - applied(damping, a) - applied(stiffness, v)
    jerk = applied(mobile, rise) + np.multiply.outer(moved, f[3])
    bend = driven(2) - applied(damping, jerk) - applied(stiffness, a)
    force = np.empty((3, contacts, *q.shape[1:]))
    for order, (x, forces) in enumerate(((q, net), (v, rise), (a, bend))):
        place = applied(row, x) - np.multiply.outer(follow, f[order])
        bound = applied(grip, forces) - (np.multiply.outer(bind, f[order + 2]) if order < 2 else 0.0)
        force[order] = np.where(held[:, None, None], bound, springs[:, None, None] * place)
    force[0] += np.where(held[:, None], 0.0, offset)[:, None]
    return np.stack((a, jerk)), force


def _energies(
    frame: Structure,
    system: Any,
    integral: Integral,
    base: tuple[FloatArray, FloatArray],
    moved: tuple[FloatArray, ...],
    friction: FloatArray,
    ends: tuple[FloatArray, FloatArray],
) -> tuple[FloatArray, float, float, float]:
    """What dashpots of contacts (c,) and of the frame take, what is put in, and by how much it is not accounted for.

    `base`: what drives, and its rate; `moved`: speeds of the masses (n, ...), of contacts and their forces (c, ...), in
    the form that `integral` takes; `ends` (2 n + c,): samples at begin and end.
    """
    n, (f, rate), (speed, slip, force) = frame.masses, base, moved
    dashpot, row = (system[name][: len(slip)] for name in ("dashpot", "row"))
    damping, pairs, put_in = system["damping"][:n, :n], [(a, b) for a in range(n) for b in range(n)], 0.0
    taken = np.array([d * integral(u, u) if d else 0.0 for d, u in zip(dashpot, slip, strict=True)])
    own = damping - row[:, :n].T @ (dashpot[:, None] * row[:, :n])
    legs = speed if frame.follows_base else [v - rate for v in speed]
    lost = sum(own[a, b] * integral(legs[a], legs[b]) for a, b in pairs if own[a, b])
    for a in range(n):
        by_f, by_rate = (float(system["push"][a, k]) for k in (0, 1))
        put_in += by_f * integral(f, speed[a]) + (by_rate * integral(rate, speed[a]) if by_rate else 0.0)
    thick = sum(damping[a, b] * integral(speed[a], speed[b]) for a, b in pairs if damping[a, b])
    pulled = sum(integral(n_c, rate) for n_c, moves in zip(force, system["follow"], strict=False) if moves)
    mass, stiffness = system["inertia"][:n, :n], system["stiffness"][:n, :n]
    stored = [0.5 * (end[:n] @ stiffness @ end[:n] + end[n : 2 * n] @ mass @ end[n : 2 * n]) for end in ends]
    gap = put_in - thick - float(friction.sum()) - pulled - (stored[1] - stored[0])
    return taken, float(lost), put_in, gap


def springs_of(system: Any, work: Any, place: FloatArray) -> FloatArray:
    """Return the energy (c,) in the springs of elastic sliders, their contacts displaced by so much."""
    stored = np.zeros(len(place))
    for c, s in enumerate(place):
        some = slice(int(system["first"][c]), int(system["first"][c + 1]))
        limit = work["side"][c] * system["strength"][some] * (1.0 + system["gradient"][c] * s)
        held = np.where(work["slips"][some] != 0, limit, system["spring"][some] * (s - work["anchor"][some]))
        stored[c] = np.sum(0.5 * held**2 / system["spring"][some])
    return stored


def _events(begins: FloatArray, length: FloatArray, side: FloatArray, z: FloatArray) -> FloatArray:
    """What begins, when and where (m, 3): slips, and stops that are more than touches."""
    fresh = np.flatnonzero(np.concatenate(([True], side[1:] != side[:-1])))
    lasts = np.add.reduceat(length, fresh)
    kept = fresh[(side[fresh] != 0.0) | (lasts > TOUCH)]
    kept = kept[np.concatenate(([True], side[kept][1:] != side[kept][:-1]))]
    return np.column_stack((begins[kept], side[kept], z[kept]))


def by_steps(frame: Structure, base: BaseRecord, q: FloatArray, v: FloatArray) -> Carried:
    """Let the integrated flow carry the masses through the record from displacements and velocities (n,) on."""
    flow, n = Flow(frame, RTOL, steps=ALLOWED), frame.masses
    system, law = flow.systems[0], flow.rubbing[0]
    parts = ceil(float(np.diff(base.time).max()) / LONGEST)
    time, cubics = drive_of(base, parts, acceleration=frame.follows_base)
    push = np.array([system["push"][:n] @ cubics[:, k : k + 2].T for k in (0, 1)])  # forces on the masses, their slopes
    size, rate = float(np.abs(push[0]).max()), float(np.abs(base.motion[1]).max())
    law["scale"][:n], law["scale"][n : 2 * n] = min(size, 1.0), min(size, max(rate, 1e-3 * size))
    system["harmonics"], law["force"], flow.log = 0, size, np.empty((LOGGED, flow.log.shape[1]))
    flow.set_state(flow.rest_at(q, v, float(cubics[0, 0])))
    flow.clock.next, done, along = LONGEST, 0, []
    while done < len(cubics):
        flow.clock.rows, begun = 0, flow.state()
        code, reached, ends = radau.carry(flow.carrier, time, cubics, done, RECORDED, False)  # noqa: FBT003 - compiled
        if code == MISSING:
            make_phase(flow.systems, flow.works)
            flow.set_state(begun)
            continue
        if code != DONE:
            what = f"a record at tau = {time[reached]:.6g}"
            raise flow.failure(code, what, f"{RECORDED} steps in {LONGEST} rad")
        last = ends[done:reached].astype(np.intp) - 1
        piece = done + np.repeat(np.arange(reached - done), np.diff(last, prepend=-1))
        along.append(_along_steps(flow, time[piece], cubics[piece], last))
        done = reached
    summed = [np.sum(part, axis=0) for part in zip(*(sums for sums, *_ in along), strict=True)]
    friction, taken, lost, paths, put_in, gap = summed
    found = np.concatenate((along[0][1][:, None], *(samples for _, _, samples, _ in along)), axis=1)
    nodes = np.concatenate([passed for *_, passed in along], axis=2)
    rms = [float(np.sqrt(2.0 * np.max(x**2 @ np.diff(time)) / (time[-1] - time[0]))) for x in push]
    events = []
    for c, contact in enumerate(frame.contacts):
        slow, shortest, ringing = stop_limits(contact, 1.0, rms[1], rms[0] / rms[1])
        events.append(_events_of_slip(nodes[:, c], slow_times(nodes[0, c], nodes[1, c], slow, ringing), slow, shortest))
    stored = springs_of(system, flow.works[0], nodes[2, :, -1])
    for c, contact in enumerate(frame.contacts):
        if law["states"][c] > 0:  # its force at rest is the spring's
            own, w = tuple(law["own"][c].tolist()), float(flow.state()[flow.sliders + law["at"][c]])
            stored[c] = 0.5 * flow.formulas[c](own, 1.0, contact.beta, 0.0, 0.0, w, 1.0)[0] ** 2
            stored[c] /= contact.parameter("stiffness_ratio")
    return Carried(found.T[::parts], events, friction, taken, float(lost), paths, stored, float(put_in), float(gap))


def _along_steps(flow: Flow, since: FloatArray, cubics: FloatArray, last: NDArray[np.intp]) -> tuple[Any, ...]:
    """Account for the steps recorded last.

    Returned: what is summed; state and forces at the begin (2 n + c,) and at samples (2 n + c, k); time, slip and place
    of contacts (3, c, 8 m). `since`, `cubics` (m, ...): begin of the piece in which each step is, what drives in it;
    `last`: the steps that end a piece.
    """
    frame, system, n, contacts = flow.structure, flow.systems[0], flow.masses, len(flow.structure.contacts)
    begin, length, rows, values = flow.recorded()
    f = derivatives_of(cubics, begin + np.outer(radau.NODES, length)).swapaxes(1, 2)
    seen = flow.observe(f[:3], rows, values)
    whole = np.concatenate((values[:, : 2 * n], seen[0]), axis=1)
    weights = length[:, None] * radau.MATRIX[-1]

    def integral(one: FloatArray, other: FloatArray) -> float:
        return float(np.sum(weights * (one * other)[:, 1:]))

    row, follow = system["row"][:contacts, :n], system["follow"][:contacts, None, None]
    place, speed = (np.moveaxis(values[:, k : k + n], 1, 0) for k in (0, n))
    place, slip = np.tensordot(row, place, 1) - follow * f[0], np.tensordot(row, speed, 1) - follow * f[1]
    force = np.moveaxis(seen[0], 1, 0) - system["dashpot"][:contacts, None, None] * slip
    friction = np.array([integral(*pair) for pair in zip(force, slip, strict=True)])
    ends = whole[0, :, 0], whole[-1, :, -1]
    sums = _energies(frame, system, integral, (f[0], f[1]), (speed, slip, force), friction, ends)
    slips = np.moveaxis(seen[1], 1, 0)
    creeps = flow.rubbing[0]["states"][:contacts, None, None] > 0
    paths = [integral(np.abs(way), np.ones_like(way)) for way in np.where(creeps, slips, slips * slip)]
    times = np.broadcast_to((since + begin)[:, None] + np.outer(length, radau.NODES), slips.shape)
    nodes = np.stack((times, slips, place)).reshape(3, contacts, -1)
    return (friction, sums[0], sums[1], np.array(paths), *sums[2:]), ends[0], whole[last, :, -1].T, nodes


def _events_of_slip(nodes: FloatArray, spans: FloatArray, slow: float, shortest: float) -> FloatArray:
    """What begins, when and where (m, 3), as a `Response` lists it, from time, slip and place (3, k) and slow times.

    A slow time that does not last is a turn, and listed only if slip goes on the other way.
    """
    times, slip, z = nodes
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
