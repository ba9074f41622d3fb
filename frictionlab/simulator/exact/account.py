"""What a motion does, from its recorded pieces: values at any time, energies, ranges, stops.

What contacts and frame take, what the base puts in and the area of the loop are integrated by Gauss and Legendre, in
panels short enough to be exact. It serves both flows: each says by its `look` what the motion is at a time in a piece.
"""

from math import pi
from typing import Any

import numpy as np
from numba import from_dtype, types
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.simulator.compiled import address_of, caller, entry, inner
from frictionlab.simulator.exact.flow import RECORDS, Carrier, is_integrated
from frictionlab.simulator.exact.motion import base_at_time, begin_motion, contact_force, modes_at, place_of
from frictionlab.simulator.exact.phase import CONTACTS, MASSES, SIDE, dot, slot_of

TURN = 2.0 * pi
COUNTS, PANELS = (4, 8, 12, 16), (0.12, 1.9, 5.2, 9.5)  # nodes that integrate so long a time times the fastest rate
NODES, WEIGHTS = np.zeros((2, len(COUNTS), COUNTS[-1]))
for _i, _count in enumerate(COUNTS):
    NODES[_i, :_count], WEIGHTS[_i, :_count] = np.polynomial.legendre.leggauss(_count)
ROUGH = 8.0  # over the length of a step that is integrated: the rate of what its polynomial may do
LOOKS = 1.0  # over the fastest rate: between two looks a speed changes its sign at most once
FORGOTTEN = 40.0  # e-fold decays after which nothing is left of a mode
STILL = 1e-13  # rad: a shorter stick is a touch, not a stop

NUMBERS = np.dtype(
    [
        ("gap", "f8"),  # energies over k_1 Y^2, in all: work of the drive on the masses less what is taken from them
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


def look(system: Any, work: Any, pieces: FloatArray, k: int, t: float) -> int:
    """Write the motion at a time after the begin of a recorded exact piece; return its phase.

    Written are displacements and velocities, the base's motion, and the contacts' forces and speeds of slip.
    """
    n, contacts, begun = system.masses, system.contacts, SIDE + system.contacts
    if work.entered != k:  # it becomes the phase at hand
        begin_look(system, work, pieces, k)
        for a in range(n):
            work.q[a], work.v[a] = pieces[k, begun + a], pieces[k, begun + n + a]
        for c in range(contacts):
            work.side[c] = int(pieces[k, SIDE + c])
            work.kappa[c], work.offset[c] = pieces[k, begun + 2 * n + c], pieces[k, begun + 2 * n + contacts + c]
        work.slot = slot_of(system, work.phases, work.kappa)
        begin_motion(system, work, work.slot)
    modes_at(system, work, work.slot, t)
    for c in range(contacts):
        work.force[c] = contact_force(system, work, work.slot, c)
        work.slip[c] = place_of(system, work.now_v, c, work.f[1]) if work.side[c] != 0 else 0.0
    return int(work.slot)


@inner
def begin_look(system: Any, work: Any, pieces: FloatArray, k: int) -> None:
    """Make the begin of a recorded piece the time at hand, and the base's motion what it was."""
    work.tau, work.entered = pieces[k, 0], k
    for i in range(4):
        system.cubic[i] = pieces[k, 2 + i]
    base_at_time(system, work)


LOOK = types.int64(*RECORDS, types.int64, types.float64)
LOOKER, call_look = address_of(look, LOOK), caller(LOOK)


@inner
def base_moved(system: Any, work: Any, order: int) -> float:
    """Return by what displacements (order 0) or velocities (1) at a look differ from absolute ones.

    That is in coordinates relative to the base, which its acceleration drives: of one that is sampled it is not known.
    """
    total = 0.0
    for m in range(system.harmonics if system.moves == 0.0 else 0):
        wave, k = work.line[m] + work.grown[m], m + 1.0
        total += wave.imag / k if order == 1 else -wave.real / (k * k)
    return total


@entry
def evaluate(
    systems: Any, works: Any, pieces: FloatArray, index: NDArray[np.int64], within: FloatArray, found: FloatArray
) -> None:
    """Write displacements, velocities and contact forces (k, 2 n + c) at times within the pieces of an index.

    Records stand in arrays of length 1.
    """
    system, work = systems[0], works[0]
    n, work.entered = system.masses, -1
    for k in range(len(index)):
        call_look(system.look, (system, work, pieces, index[k], within[k]))
        for c in range(system.contacts):
            found[k, 2 * n + c] = work.force[c]
        place, rate = base_moved(system, work, 0), base_moved(system, work, 1)
        for a in range(n):
            found[k, a], found[k, n + a] = work.now_q[a] + place, work.now_v[a] + rate


@inner
def rate_at(system: Any, work: Any, t: float, length: float) -> float:
    """Return the fastest rate of what has not died out at a time after the begin of a piece."""
    if is_integrated(system):
        return ROUGH / length
    fastest = max(float(system.harmonics), 1e-3)
    for j in range(work.phases.modes[work.slot]):
        rate = work.phases.rate[work.slot, j]
        if -rate.real * t < FORGOTTEN:
            fastest = max(fastest, abs(rate))
    return fastest


@inner
def integrate(flow: Carrier, k: int, numbers: Any) -> None:
    """Add what flows in a piece, by Gauss and Legendre's rule in panels, exact to rounding."""
    system, work, length, t = flow.system, flow.work, flow.pieces[k, 1], 0.0
    call_look(system.look, (system, work, flow.pieces, k, 0.0))
    while t < length:
        reach, rule = rate_at(system, work, t, length) * (length - t), 0
        while rule < len(PANELS) - 1 and reach >= PANELS[rule]:
            rule += 1
        half = 0.5 * (length - t) / (int(reach / PANELS[-1]) + 1)
        middle = t + half
        t = length if reach < PANELS[-1] else t + 2.0 * half
        for i in range(COUNTS[rule]):
            call_look(system.look, (system, work, flow.pieces, k, middle + half * NODES[rule, i]))
            add_flows(system, work, half * WEIGHTS[rule, i], numbers)


@inner
def add_flows(system: Any, work: Any, weight: float, numbers: Any) -> None:
    """Add what flows at a look, times a weight."""
    n, f, rate = system.masses, work.f[0], work.f[1]
    for c in range(system.contacts):
        speed = place_of(system, work.now_v, c, rate)
        dry = work.force[c] - system.dashpot[c] * speed
        numbers.contact[c] += weight * work.force[c] * speed
        numbers.dashpot[c] += weight * system.dashpot[c] * speed * speed
        numbers.path[c] += weight * abs(work.slip[c])
        numbers.gap -= weight * dry * (speed + system.follow[c] * rate)
    for a in range(n):
        work.net[a] = work.now_v[a] - system.moves * rate
    for a in range(n):
        drive = dot(system.push[a], work.f, 2)
        numbers.gap += weight * (drive - dot(system.damping[a], work.now_v, n)) * work.now_v[a]
        numbers.frame += weight * dot(system.frame[a], work.net, n) * work.net[a]
    numbers.loop += weight * (f if system.moves else base_moved(system, work, 0)) * work.now_v[0]


@inner
def widen(flow: Carrier, k: int, numbers: Any) -> None:
    """Widen the ranges by a piece: its begin and end, and wherever a mass turns in it."""
    system, work, length = flow.system, flow.work, flow.pieces[k, 1]
    only_at_events = system.masses == system.contacts == 1 and system.sliders == 0 and system.follow[0] < system.moves
    for a in range(system.masses):
        t, before = 0.0, speed_at(flow, k, 0.0, a, numbers)
        while t < length:
            step = min(LOOKS / rate_at(system, work, t, length), 0.5 * length, length - t)
            begun, t = t, length if only_at_events or t + step >= length * (1.0 - 1e-12) else t + step
            speed = speed_at(flow, k, t, a, numbers)
            if speed * before < 0.0 and not only_at_events:
                turn(flow, k, begun, t, before, speed, a, numbers)
            before = speed


@inner
def turn(flow: Carrier, k: int, begun: float, ended: float, before: float, after: float, a: int, numbers: Any) -> None:
    """Widen the range of a mass to where it turns between two times, whose speeds are given: Illinois' method."""
    one, other, width = begun, ended, ended - begun
    for _ in range(60):
        t = other - after * (other - one) / (after - before)
        now = speed_at(flow, k, t, a, numbers)
        near = abs(t - other) <= 1e-9 * width
        one, before = (other, after) if now * after < 0.0 else (one, 0.5 * before)
        other, after = t, now
        if near or now == 0.0:
            break


@inner
def speed_at(flow: Carrier, k: int, t: float, a: int, numbers: Any) -> float:
    """Widen the range of a mass by where it is at a time within a piece; return its speed."""
    system, work = flow.system, flow.work
    call_look(system.look, (system, work, flow.pieces, k, t))
    place = work.now_q[a] + base_moved(system, work, 0)
    numbers.high[a], numbers.low[a] = max(numbers.high[a], place), min(numbers.low[a], place)
    return float(work.now_v[a] + base_moved(system, work, 1))


@inner
def count_stops(pieces: FloatArray, count: int, c: int, numbers: Any) -> None:
    """Count the stops of a contact: times in which it holds, those in a row as one, touches not at all.

    One that goes on across the end of a period, at its begin, is one.
    """
    length, slipped, at_begin = 0.0, False, False
    for k in range(count):
        if pieces[k, SIDE + c] == 0.0:
            length += pieces[k, 1]
            numbers.stuck[c] += pieces[k, 1]
            continue
        if length > STILL:
            numbers.stops[c] += 1
            at_begin = at_begin or not slipped
        length, slipped = 0.0, True
    if length > STILL and slipped:
        numbers.stops[c] += 0 if at_begin else 1


def account(system: Any, work: Any, pieces: FloatArray, count: int, numbers: Any) -> int:
    """Write what a motion does in so many recorded pieces, as NUMBERS; return their number. Called by its address.

    Under a sampled base ranges and stops are left out.
    """
    flow, work.entered = Carrier(system, work, pieces), -1
    numbers.gap = numbers.loop = numbers.frame = 0.0
    for a in range(system.masses):
        numbers.high[a], numbers.low[a] = -np.inf, np.inf
    for c in range(system.contacts):
        numbers.contact[c] = numbers.dashpot[c] = numbers.path[c] = numbers.stuck[c] = 0.0
        numbers.stops[c] = 0
    for k in range(count):
        integrate(flow, k, numbers)
        if system.harmonics > 0:
            widen(flow, k, numbers)
    for c in range(system.contacts if system.harmonics > 0 else 0):
        count_stops(pieces, count, c, numbers)
    return count


SIGNATURE = types.int64(*RECORDS, types.int64, from_dtype(NUMBERS))
ACCOUNT, call_account = address_of(account, SIGNATURE), caller(SIGNATURE)


@entry
def account_all(systems: Any, works: Any, pieces: FloatArray, sums: Any) -> None:
    """Account for all recorded pieces of records that stand in arrays of length 1."""
    call_account(systems[0].account, (systems[0], works[0], pieces, len(pieces), sums[0]))
