"""A sampled base motion under any laws, by either flow: what is carried between samples, and accounted for."""

from collections.abc import Iterator
from math import ceil, inf
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.simulator.compiled import record_of
from frictionlab.simulator.exact.account import NUMBERS, account_along
from frictionlab.simulator.exact.answer import travel
from frictionlab.simulator.exact.phase import DONE, MISSING, make_phase
from frictionlab.simulator.exact.solve import TOUCH, Flow, feel_acceleration
from frictionlab.simulator.numeric import Integrated, radau
from frictionlab.simulator.numeric.flow import slow_times, stop_limits
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record.base import BaseRecord, derivatives_of
from frictionlab.simulator.structure import Structure

LONGEST = 0.5  # rad: what steps carry at once at most
ALLOWED = 20_000  # steps that may be tried within it
CHUNK = 20_000  # times between samples that are carried, and accounted for, at once


def drive_of(base: BaseRecord, parts: int, *, acceleration: bool) -> tuple[FloatArray, FloatArray]:
    """Return times (k + 1,) and cubics (k, 4) of what drives, a sampling interval in so many parts."""
    time, cubics = base.pieces(parts)
    if acceleration and base.quantity == "displacement":
        cubics = np.column_stack((2.0 * cubics[:, 2], 6.0 * cubics[:, 3], np.zeros((len(cubics), 2))))
    return np.array(time), cubics  # to be written on, as all arrays are for which the flows are compiled


def carry(
    what: Problem | Structure, base: BaseRecord, q: FloatArray, v: FloatArray, *, exact: bool, accounted: bool
) -> dict[str, Any]:
    """Return a motion along a record by the names of `RecordMotion`, from displacements and velocities (n,) on.

    It is relative to the base where every contact is against it, for so a flow has it. Accounted for: by the names of
    `Response` too.
    """
    frame = what if isinstance(what, Structure) else Structure.of(what)
    flow: Flow = Flow(what) if exact else Integrated(what)
    parts = 1 if exact else ceil(float(np.diff(base.time).max()) / LONGEST)
    time, cubics = drive_of(base, parts, acceleration=frame.follows_base)
    if exact and frame.follows_base:
        feel_acceleration(flow.systems)
    system, n, rms = flow.systems[0], flow.masses, [0.0, 0.0]
    if isinstance(flow, Integrated):
        push = np.array([system["push"][:n] @ cubics[:, k : k + 2].T for k in (0, 1)])  # on the masses, and its slope
        rms = [float(np.sqrt(2.0 * np.max(x**2 @ np.diff(time)) / (time[-1] - time[0]))) for x in push]
        size, rate, law = float(np.abs(push[0]).max()), float(np.abs(base.motion[1]).max()), flow.law
        law["scale"][:n], law["scale"][n : 2 * n] = min(size, 1.0), min(size, max(rate, 1e-3 * size))
        law["force"], law["first"] = size, LONGEST
    system["harmonics"], found = 0, np.zeros((len(time), 2 * n + flow.contacts))
    passed = _passed(flow, time, cubics, flow.rest_at(q, v, float(cubics[0, 0])), found, kept=accounted)
    account = _account(flow, frame, base, found, passed, rms) if accounted else {}
    list(passed)  # if nothing is accounted for, it is carried here
    q, v, force = np.split(found[::parts], (n, 2 * n), axis=1)
    return {"displacements": q, "velocities": v, "contact_forces": force} | account


def _passed(
    flow: Flow, time: FloatArray, cubics: FloatArray, state: FloatArray, found: FloatArray, *, kept: bool
) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Carry a state along, and write what is at the samples; yield of each chunk its pieces (m, ...), if they are kept.

    Beside them: when the sampling interval of each began, and under what cubic.
    """
    works, done, made, steps = flow.workspace(), 0, 0, isinstance(flow, Integrated)
    left = float(ALLOWED) if steps else inf
    count = 256 + 2 * min(len(cubics), CHUNK) if kept or steps else 0
    while done < len(cubics):
        flow.put(works, state)
        part, whole = slice(done, done + CHUNK), slice(done, done + CHUNK + 1)
        pieces, marks = np.empty((count, flow.width)), np.zeros(len(time[whole]), np.int64)
        reached, code = travel(flow.systems, works, pieces, time[whole], cubics[part], found[whole], marks, left)
        if code == MISSING:
            made = flow.made(works, made)
        elif code != DONE:
            flow.refuse(code, f" of a record at tau = {time[done + reached]:.6g}")
        elif count < marks[-1] and count > 0:
            count = int(marks[-1])
        else:
            state = flow.at_hand(works)
            if isinstance(flow, Integrated):
                found[whole] = flow.at_ends(pieces, marks)
            if kept:
                piece = done + np.repeat(np.arange(len(marks) - 1), np.diff(marks))
                yield pieces[: marks[-1]], time[piece], cubics[piece]
            done += len(marks) - 1


def _account(
    flow: Flow, frame: Structure, base: BaseRecord, found: FloatArray, passed: Iterator[Any], rms: list[float]
) -> dict[str, Any]:
    """Return what a motion does in all; `rms`: of the largest force that drives, and of its slope, times sqrt(2)."""
    system, n, contacts, works = flow.systems[0], flow.masses, flow.contacts, flow.workspace()
    parts, stored, totals = [], np.zeros(contacts), record_of(NUMBERS)
    for pieces, since, cubics in passed:
        stored = _stored(flow, frame, base, found[-1])  # before what is at hand is written over; the last one counts
        parts.append([_seen_of(flow, c, pieces, since, cubics) for c in range(contacts)])
        sums = record_of(NUMBERS)
        while account_along(flow.systems, works, pieces, since, cubics, sums) < len(pieces):
            make_phase(flow.systems, works)
        for name in ("input", "gap", "frame", "contact", "dashpot", "path"):
            totals[name] += sums[name]
    events, total = [], totals[0]
    for c, seen in enumerate(zip(*parts, strict=True)):
        nodes = np.concatenate(seen, axis=-1)
        if not _creeps(flow, c):
            events.append(_events(*nodes))
            continue
        slow, shortest, ringing = stop_limits(frame.contacts[c], 1.0, rms[1], rms[0] / rms[1])
        events.append(_events_of_slip(nodes, slow_times(nodes[0], nodes[1], slow, ringing), slow, shortest))
    gap, taken = float(total["gap"]), total["contact"][:contacts] - stored
    for sample, sign in ((found[-1], 0.5), (found[0], -0.5)):  # energy of motion and in the frame's springs
        q, v = sample[:n], sample[n : 2 * n]
        gap -= sign * float(q @ system["stiffness"][:n, :n] @ q + v @ system["inertia"][:n, :n] @ v)
    return {
        "contact_events": events,
        "paths": total["path"][:contacts],
        "energy": float(taken.sum() + total["frame"]),
        "contact_energies": taken,
        "energy_input": float(total["input"]),
        "friction_energy": float((taken - total["dashpot"][:contacts]).sum()),
        "closure_error": abs(gap),
    }


def _creeps(flow: Flow, contact: int) -> bool:
    return bool(flow.systems[0]["law"]["states"][contact] > 0)


def _seen_of(flow: Flow, c: int, pieces: FloatArray, since: FloatArray, cubics: FloatArray) -> FloatArray:
    """Return begin, length, side, place (4, m) of a contact in pieces; of one that creeps time, slip, place (3, k)."""
    n, system = flow.masses, flow.systems[0]
    row, follow = system["row"][c, :n], system["follow"][c]
    if isinstance(flow, Integrated):
        q, _, _, slip = flow.nodes(pieces)
        times = pieces[:, :1] + pieces[:, 1:2] * radau.NODES
        f = derivatives_of(cubics, (times - since[:, None]).T)[0].T
        place = row @ q - follow * f
        if _creeps(flow, c):
            return np.stack((times, slip[:, c], place)).reshape(3, -1)
        place = place[:, 0]
    else:
        place = pieces[:, 2 + flow.contacts :][:, :n] @ row - follow * derivatives_of(cubics, pieces[:, 0] - since)[0]
    return np.stack((pieces[:, 0], pieces[:, 1], pieces[:, 2 + c], place))


def _stored(flow: Flow, frame: Structure, base: BaseRecord, sample: FloatArray) -> FloatArray:
    """Return the energy (c,) in the springs of contacts at the state at hand, by what is at the last sample."""
    system, work, n, contacts = flow.systems[0], flow.workspace()[0], flow.masses, flow.contacts
    place = system["row"][:contacts, :n] @ sample[:n] - system["follow"][:contacts] * base.values[-1]
    stored = springs_of(system, work, place)
    if isinstance(flow, Integrated):
        for c, contact in enumerate(frame.contacts):
            if flow.law["states"][c] > 0:  # its force at rest is the spring's
                own = tuple(flow.law["own"][c].tolist())
                w = float(flow.at_hand(flow.works)[flow.sliders + flow.law["at"][c]])
                force = float(flow.formulas[c](own, 1.0, contact.beta, 0.0, 0.0, w, 1.0)[0])
                stored[c] = 0.5 * force**2 / contact.parameter("stiffness_ratio")
    return stored


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
