"""What a motion does, from its recorded pieces: values at any time, energies, ranges, stops.

A contact's friction works ``kappa / 2 (s_1^2 - s_0^2) + o (s_1 - s_0)`` in a piece, exactly. What dashpots take, what
the base puts in and the area of the loop are integrated by Gauss and Legendre, in panels short enough to be exact.
"""

from math import pi
from typing import Any

import numpy as np
from numba import from_dtype, types
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.simulator.compiled import address_of, caller, entry, inner
from frictionlab.simulator.exact.flow import move_cubic
from frictionlab.simulator.exact.motion import (
    WORK,
    base_at_time,
    begin_motion,
    contact_force,
    modes_at,
    place_of,
)
from frictionlab.simulator.exact.phase import CONTACTS, MASSES, SYSTEM, slot_of

TURN = 2.0 * pi
COUNTS, PANELS = (4, 8, 12, 16), (0.12, 1.9, 5.2, 9.5)  # nodes that integrate so long a time times the fastest rate
NODES, WEIGHTS = np.zeros((2, len(COUNTS), COUNTS[-1]))
for _i, _count in enumerate(COUNTS):
    NODES[_i, :_count], WEIGHTS[_i, :_count] = np.polynomial.legendre.leggauss(_count)
LOOKS = 1.0  # over the fastest rate: between two looks a speed changes its sign at most once
FORGOTTEN = 40.0  # e-fold decays after which nothing is left of a mode
STILL = 1e-13  # rad: a shorter stick is a touch, not a stop

NUMBERS = np.dtype(
    [
        ("gap", "f8"),  # energies over k_1 Y^2, in all: work of the drive on the masses less what is taken from them
        ("input", "f8"),  # that work
        ("loop", "f8"),  # integral of f dx_1 (2.18)
        ("frame", "f8"),
        ("contact", "f8", (CONTACTS,)),
        ("dashpot", "f8", (CONTACTS,)),  # of it, by the contacts' dashpots
        ("path", "f8", (CONTACTS,)),  # way slipped
        ("stuck", "f8", (CONTACTS,)),  # rad
        ("stops", "i8", (CONTACTS,)),
        ("high", "f8", (MASSES,)),
        ("low", "f8", (MASSES,)),
    ]
)
"""What a motion does from its first piece to its last."""


@inner
def enter(system: Any, work: Any, pieces: FloatArray, k: int) -> int:
    """Make a recorded piece the phase at hand; return its slot."""
    n, contacts = system.masses, system.contacts
    work.tau = pieces[k, 0]
    for a in range(n):
        work.q[a], work.v[a] = pieces[k, 2 + a], pieces[k, 2 + n + a]
    for c in range(contacts):
        work.kappa[c], work.offset[c] = pieces[k, 2 + 2 * n + c], pieces[k, 2 + 2 * n + contacts + c]
        work.side[c] = int(pieces[k, 2 + 2 * n + 2 * contacts + c])
    slot = slot_of(system, work.phases, work.kappa)
    base_at_time(system, work)
    if slot >= 0:
        begin_motion(system, work, slot)
    return slot


@entry
def evaluate(
    systems: Any, works: Any, pieces: FloatArray, index: NDArray[np.int64], within: FloatArray, found: FloatArray
) -> int:
    """Write displacements, velocities and contact forces (k, 2 n + c) at times within the pieces of an index.

    Returns how many times there are, or the one whose phase is to be made first. Records stand in arrays of length 1.
    """
    system, work, last, slot = systems[0], works[0], -1, 0
    n = system.masses
    for k in range(len(index)):
        if index[k] != last:
            last = index[k]
            slot = enter(system, work, pieces, last)
            if slot < 0:
                return k
        modes_at(system, work, slot, within[k])
        for c in range(system.contacts):
            found[k, 2 * n + c] = contact_force(system, work, slot, c)
        for a in range(n):
            found[k, a], found[k, n + a] = work.now_q[a], work.now_v[a]
    return len(index)


@inner
def rate_at(system: Any, work: Any, slot: int, t: float) -> float:
    """Return the fastest rate of what has not died out at a time after the begin."""
    fastest = max(float(system.harmonics), 1e-3)
    for j in range(work.phases.modes[slot]):
        rate = work.phases.rate[slot, j]
        if -rate.real * t < FORGOTTEN:
            fastest = max(fastest, abs(rate))
    return fastest


@inner
def integrate(system: Any, work: Any, slot: int, length: float, numbers: Any) -> None:
    """Add what flows in the phase at hand, by Gauss and Legendre's rule in panels, exact to rounding."""
    t = 0.0
    while t < length:
        reach, rule = rate_at(system, work, slot, t) * (length - t), 0
        while rule < len(PANELS) - 1 and reach >= PANELS[rule]:
            rule += 1
        half = 0.5 * (length - t) / (int(reach / PANELS[-1]) + 1)
        middle = t + half
        t = length if reach < PANELS[-1] else t + 2.0 * half
        for k in range(COUNTS[rule]):
            modes_at(system, work, slot, middle + half * NODES[rule, k])
            for c in range(system.contacts):
                if system.follow[c] != 0.0:
                    speed = place_of(system, work.now_v, c, work.f[1])
                    work.force[c] = contact_force(system, work, slot, c) - system.dashpot[c] * speed
            add_flows(system, work, half * WEIGHTS[rule, k], numbers)


@inner
def add_flows(system: Any, work: Any, weight: float, numbers: Any) -> None:
    """Add what flows at a moment, times a weight, but for friction.

    Of the moment `now_q`, `now_v` and `f` are written, and `force` of contacts that follow the base, without dashpots.
    """
    n, f, rate = system.masses, work.f[0], work.f[1]
    for c in range(system.contacts):
        if system.dashpot[c] != 0.0:
            speed = place_of(system, work.now_v, c, rate)
            lost = weight * system.dashpot[c] * speed * speed
            numbers.dashpot[c] += lost
            numbers.contact[c] += lost
        if system.follow[c] != 0.0:  # what rubs against the base works on the mass beyond its own slip
            numbers.gap -= weight * work.force[c] * rate
    for a in range(n):
        drive, drag, thick = system.push[a, 0] * f + system.push[a, 1] * rate, 0.0, 0.0
        for b in range(n):
            if system.damping[a, b] != 0.0:
                drag += system.damping[a, b] * work.now_v[b]
                thick += of_frame(system, a, b) * (work.now_v[b] - system.moves * rate)
        numbers.gap += weight * (drive - drag) * work.now_v[a]
        numbers.input += weight * drive * work.now_v[a]
        numbers.frame += weight * thick * (work.now_v[a] - system.moves * rate)
    numbers.loop += weight * f * work.now_v[0]


@inner
def of_frame(system: Any, a: int, b: int) -> float:
    """Return an entry of the frame's own damping."""
    own = system.damping[a, b]
    for c in range(system.contacts):
        own -= system.dashpot[c] * system.row[c, a] * system.row[c, b]
    return own


@inner
def widen(system: Any, work: Any, slot: int, length: float, numbers: Any) -> None:
    """Widen the ranges by a piece: its begin and end, and wherever a mass turns in it."""
    only_at_events = system.masses == 1 and system.contacts == 1 and system.sliders == 0 and system.follow[0] == 0.0
    for a in range(system.masses):
        t, before = 0.0, place_and_speed(system, work, slot, 0.0, a, numbers)
        while t < length:
            step = min(LOOKS / rate_at(system, work, slot, t), 0.5 * length, length - t)
            t = length if only_at_events or t + step >= length * (1.0 - 1e-12) else t + step
            speed = place_and_speed(system, work, slot, t, a, numbers)
            if speed * before < 0.0 and not only_at_events:
                turn(system, work, slot, t - step, t, before, a, numbers)
            before = speed


@inner
def turn(system: Any, work: Any, slot: int, low: float, high: float, before: float, a: int, numbers: Any) -> None:
    """Widen the range of a mass to where it turns between two times; `before`: its speed at the first."""
    t, sign, width = high, 1.0 if before > 0.0 else -1.0, high - low
    for _ in range(60):
        now = place_and_speed(system, work, slot, t, a, numbers)
        low, high = (t, high) if sign * now > 0.0 else (low, t)
        bend = work.form[0]
        ahead = t - now / bend if bend != 0.0 else 0.5 * (low + high)
        ahead = ahead if low < ahead < high else 0.5 * (low + high)
        if abs(ahead - t) <= 1e-9 * width:
            break
        t = ahead


@inner
def place_and_speed(system: Any, work: Any, slot: int, t: float, a: int, numbers: Any) -> float:
    """Widen the range of a mass by where it is at a time; return its speed, and leave its acceleration in `form`."""
    modes_at(system, work, slot, t)
    bend, place = work.phases.along[slot, a] * work.f[2], work.now_q[a]
    for j in range(work.phases.modes[slot]):
        bend += (work.phases.outward[slot, a, j] * work.w[2, j]).real
    numbers.high[a], numbers.low[a] = max(numbers.high[a], place), min(numbers.low[a], place)
    work.form[0] = bend
    return work.now_v[a]


@inner
def count_stops(pieces: FloatArray, count: int, column: int, c: int, numbers: Any) -> None:
    """Count the stops of a contact: times in which it holds, those in a row as one, touches not at all.

    One that goes on across the end of a period, at its begin, is one.
    """
    length, slipped, at_begin = 0.0, False, False
    for k in range(count):
        if pieces[k, column] == 0.0:
            length += pieces[k, 1]
            continue
        if length > STILL:
            numbers.stops[c] += 1
            at_begin = at_begin or not slipped
        length, slipped = 0.0, True
    if length > STILL and slipped:
        numbers.stops[c] += 0 if at_begin else 1


@inner
def clear(system: Any, numbers: Any) -> None:
    """Begin new sums."""
    numbers.gap = numbers.input = numbers.loop = numbers.frame = 0.0
    for a in range(system.masses):
        numbers.high[a], numbers.low[a] = -np.inf, np.inf
    for c in range(system.contacts):
        numbers.contact[c] = numbers.dashpot[c] = numbers.path[c] = numbers.stuck[c] = 0.0
        numbers.stops[c] = 0


def account(system: Any, work: Any, pieces: FloatArray, begin: int, count: int, numbers: Any) -> int:
    """Write what a motion does in recorded pieces from one to before another, as NUMBERS; return the latter's number.

    From the first piece on sums are new, else they go on. Under a sampled base, whose cubic is about the begin of the
    piece, ranges and stops are left out. Called by its address.
    """
    first = 2 + 2 * system.masses + 2 * system.contacts
    if begin == 0:
        clear(system, numbers)
    for k in range(begin, count):
        length, slot = pieces[k, 1], enter(system, work, pieces, k)
        if slot < 0:
            return k
        integrate(system, work, slot, length, numbers)
        if system.harmonics > 0:
            widen(system, work, slot, length, numbers)
        modes_at(system, work, slot, length)
        for c in range(system.contacts):
            if work.kappa[c] != np.inf:
                place = place_of(system, work.now_q, c, work.f[0])
                way = place - work.place[c]
                friction = way * (0.5 * work.kappa[c] * (place + work.place[c]) + work.offset[c])
                numbers.contact[c] += friction
                numbers.gap -= friction
                numbers.path[c] += abs(way * pieces[k, first + c])
            if pieces[k, first + c] == 0.0:
                numbers.stuck[c] += length
    for c in range(system.contacts if system.harmonics > 0 else 0):
        count_stops(pieces, count, first + c, c, numbers)
    return count


SIGNATURE = types.int64(
    *(from_dtype(SYSTEM), from_dtype(WORK), types.Array(types.float64, 2, "C")),
    *(types.int64, types.int64, from_dtype(NUMBERS)),
)
ACCOUNT, call_account = address_of(account, SIGNATURE), caller(SIGNATURE)


@entry
def account_all(systems: Any, works: Any, pieces: FloatArray, sums: Any) -> int:
    """Account for all recorded pieces of records that stand in arrays of length 1; return how many."""
    return call_account(systems[0].account, (systems[0], works[0], pieces, 0, len(pieces), sums[0]))


@entry
def account_along(
    systems: Any, works: Any, pieces: FloatArray, since: FloatArray, cubics: FloatArray, sums: Any
) -> int:
    """As `account_all`, under a sampled base: of each piece when its sampling interval began (m,), its cubic (m, 4)."""
    system = systems[0]
    for k in range(len(pieces)):
        for i in range(4):
            system.cubic[i] = cubics[k, i]
        move_cubic(system.cubic, pieces[k, 0] - since[k])
        if call_account(system.account, (system, works[0], pieces, k, k + 1, sums[0])) <= k:
            return k
    return len(pieces)
