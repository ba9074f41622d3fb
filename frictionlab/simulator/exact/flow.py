"""The motion from event to event: contacts hold, slip, turn and give way; and the derivative of a run by its start.

No event is stepped over. Each event function g is positive until its event; its value, two derivatives and a bound M of
the third give a step that is proven free of zeros, ``g + g' h + g'' h^2 / 2 - M h^3 / 6 > 0``, and a march of such
steps converges to the zero. At each event the derivative of the state jumps by a saltation matrix.
"""

from math import inf, sqrt
from typing import Any, NamedTuple

from numba import from_dtype

from frictionlab.arrays import FloatArray
from frictionlab.simulator.compiled import address_of, caller, inner, numba
from frictionlab.simulator.exact.motion import (
    WORK,
    base_at_time,
    begin_motion,
    bound_base,
    bound_modes,
    flow_over,
    force_on,
    held_force,
    modes_at,
    modulus,
    place_of,
)
from frictionlab.simulator.exact.phase import CHATTER, DONE, PULLS, SYSTEM, TIRED, slot_of

TURN_OF, UPWARDS, DOWNWARDS = 0, 1, 2  # what ends a phase: slip of a contact, or what it holds up or down
WINDOW = 8.0  # over the fastest rate: derivatives are bounded over so long at first
SHORT = 1.5  # the same where their bounds grow: under a sampled base, and next to resonance
STILL = 1e-12  # over the size of the motion: a slower contact stands
BARELY = 1e-11  # over the masses' accelerations: a contact so little pushed stays where it is
IDLE = 8  # events in a row at one moment, and as many for each contact and slider, that no motion has
NEVER = 1e-300  # bound of the third derivative of what does not change
EVENTS = 400.0  # in a natural period and contact that no motion has


@inner
def is_rigid(system: Any, c: int) -> bool:
    """Return whether a contact has no spring of its own."""
    return system.first[c] == system.first[c + 1]


@inner
def ratio_of(system: Any, c: int, upwards: bool) -> float:
    """Return the ratio of static to kinetic friction of a contact that gives way in a direction."""
    return system.up[c] if upwards else system.down[c]


@inner
def load_at(system: Any, work: Any, c: int) -> float:
    """Return the share of a contact's friction force that it has where it is."""
    return 1.0 + system.gradient[c] * place_of(system, work.q, c, work.f[0])


@inner
def gives_way(system: Any, work: Any, c: int, i: int, side: float) -> tuple[float, float]:
    """Return the displacement at which a held slider gives way to a side, and what that changes by by its anchor."""
    limit = ratio_of(system, c, side > 0.0) * system.strength[i]
    left = system.spring[i] - side * limit * system.gradient[c]
    return (system.spring[i] * work.anchor[i] + side * limit) / left, system.spring[i] / left


@inner
def relax(system: Any, work: Any, c: int, i: int, side: float) -> None:
    """Write where the spring of a slider that slips to a side is relaxed."""
    place = place_of(system, work.q, c, work.f[0])
    work.anchor[i] = place - side * system.strength[i] / system.spring[i] * (1.0 + system.gradient[c] * place)


@inner
def set_contact(system: Any, work: Any, c: int) -> None:
    """Write stiffness and constant force of a contact as it holds or slips, and between which thresholds it does.

    The thresholds are of the force of a rigid one that holds, of the displacement of an elastic one.
    """
    side, q = float(work.side[c]), system.gradient[c]
    work.upper[c], work.lower[c] = inf, -inf
    if is_rigid(system, c):
        work.kappa[c], work.offset[c] = side * system.limit[c] * q, side * system.limit[c]
        if side == 0.0:
            limit = system.limit[c] * load_at(system, work, c)
            work.kappa[c], work.upper[c], work.lower[c] = inf, system.up[c] * limit, -system.down[c] * limit
        return
    kappa, offset = 0.0, 0.0
    for i in range(system.first[c], system.first[c + 1]):
        spring, limit = system.spring[i], system.strength[i]
        if work.slips[i]:
            kappa += side * limit * q
            offset += side * limit
            continue
        kappa += spring
        offset -= spring * work.anchor[i]
        if side >= 0.0:
            work.upper[c] = min(work.upper[c], gives_way(system, work, c, i, 1.0)[0])
        if side <= 0.0:
            work.lower[c] = max(work.lower[c], gives_way(system, work, c, i, -1.0)[0])
    work.kappa[c], work.offset[c] = kappa, offset


@inner
def accelerate(system: Any, work: Any, slot: int) -> None:
    """Write the masses' accelerations and the held contacts' forces at the state at hand."""
    n = system.masses
    for a in range(n):
        work.net[a] = force_on(system, work, a, work.q, work.v)
    for c in range(system.contacts):
        if work.kappa[c] == inf:
            work.force[c] = held_force(system, work, slot, c, work.q, work.v)
    for a in range(n):
        acceleration = 0.0
        for b in range(n):
            force = work.net[b]
            for c in range(system.contacts):
                if work.kappa[c] == inf:
                    force -= system.row[c, b] * work.force[c]
            acceleration += system.mobility[a, b] * force
        work.acceleration[1, a] = acceleration


@inner
def settle(system: Any, work: Any) -> int:
    """Decide which rigid contacts at rest hold: as many as can. Return the phase's slot; negative: none.

    One that holds is within its limit; one that slips is accelerated the way it slips, and begins at speed zero.
    `work.resting` marks them; `work.breaking` is one that gives way now, to the side at which it rests; -1: none.
    """
    count = _stand(system, work)
    total = 3**count
    for slipping in range(count + 1):
        for code in range(total):
            if _assign(system, work, code) != slipping:
                continue
            for c in range(system.contacts):
                set_contact(system, work, c)
            slot = slot_of(system, work.phases, work.kappa)
            if slot < 0:
                return slot
            if work.phases.modes[slot] < 0:
                continue
            accelerate(system, work, slot)
            if _is_consistent(system, work):
                for c in range(system.contacts):
                    if work.resting[c] and work.side[c] != 0:
                        smooth = c == work.breaking and ratio_of(system, c, work.side[c] > 0) == 1.0
                        work.lead[c, TURN_OF] = 2 if smooth else 1
                return slot
    return -CHATTER


@inner
def _assign(system: Any, work: Any, code: int) -> int:
    """Set the sides of resting contacts by the digits of a code; return how many slip, -1: not as one breaks."""
    slipping = 0
    for c in range(system.contacts):
        if not work.resting[c]:
            continue
        digit = code % 3
        code //= 3
        side = 0 if digit == 0 else 1 if digit == 1 else -1
        if c == work.breaking and side != work.resting[c]:
            return -1
        work.side[c] = side
        slipping += abs(side)
    return slipping


@inner
def _stand(system: Any, work: Any) -> int:
    """Make the speeds of contacts at rest exactly zero; return their number."""
    n, count = system.masses, 0
    for c in range(system.contacts):
        count += 1 if work.resting[c] else 0
    for _ in range(3 if count > 1 else count):  # one after the other, and again: they may share a mass
        for c in range(system.contacts):
            if not work.resting[c] or system.limit[c] == 0.0:  # without friction it only turns
                continue
            if n == 1:
                work.v[0] = system.follow[c] * work.f[1] / system.row[c, 0]
                continue
            miss, give = place_of(system, work.v, c, work.f[1]), 0.0
            for a in range(n):
                work.net[a] = 0.0
                for b in range(n):
                    work.net[a] += system.mobility[a, b] * system.row[c, b]
                give += system.row[c, a] * work.net[a]
            for a in range(n):
                work.v[a] -= work.net[a] * miss / give
    return count


@inner
def _is_consistent(system: Any, work: Any) -> bool:
    for c in range(system.contacts):
        if not work.resting[c]:
            continue
        if work.side[c] != 0:
            found, size = -system.follow[c] * work.f[2], 1.0
            for a in range(system.masses):
                found += system.row[c, a] * work.acceleration[1, a]
                size = max(size, abs(work.acceleration[1, a]))
            if c != work.breaking and work.side[c] * found < -BARELY * size:
                return False
            continue
        margin = 0.5 * STILL * (work.upper[c] - work.lower[c])
        if not work.lower[c] - margin <= work.force[c] <= work.upper[c] + margin:
            return False
    return True


@inner
def still_speed(system: Any, work: Any) -> float:
    """Return the speed below which a contact stands."""
    total = abs(work.f[1])
    for a in range(system.masses):
        total += abs(work.v[a])
    return STILL * total


@inner
def begin(system: Any, work: Any) -> None:
    """Find which contacts slip in the state at hand, and which are at rest."""
    base_at_time(system, work)
    bound_base(system, work)
    still = still_speed(system, work)
    for c in range(system.contacts):
        for which in range(3):
            work.lead[c, which] = 0
        speed = place_of(system, work.v, c, work.f[1])
        side = 1 if speed > 0.0 else -1
        work.side[c] = side if is_rigid(system, c) and abs(speed) > still else 0
        work.resting[c] = 1 if is_rigid(system, c) and work.side[c] == 0 else 0
        place, load = place_of(system, work.q, c, work.f[0]), load_at(system, work, c)
        for i in range(system.first[c], system.first[c + 1]):
            limit, pull = system.strength[i] * load, system.spring[i] * (place - work.anchor[i])
            if pull > system.up[c] * limit or -pull > system.down[c] * limit:  # no state of a run: a trial's
                relax(system, work, c, i, 1.0 if pull > 0.0 else -1.0)
                pull = system.spring[i] * (place - work.anchor[i])
            ratio = ratio_of(system, c, side > 0)
            slips = abs(speed) > still and side * pull >= limit * (1.0 - STILL)
            work.slips[i] = 1 if slips and (ratio == 1.0 or abs(pull) <= limit * (1.0 + STILL)) else 0
            if work.slips[i]:
                work.side[c], work.slipped[i] = side, 1
    work.breaking = -1


@inner
def watches(work: Any, c: int, which: int) -> bool:
    """Return whether a contact can end a phase in one of the three ways."""
    return work.side[c] != 0 if which == TURN_OF else work.upper[c] < inf if which == UPWARDS else work.lower[c] > -inf


@inner
def sign_of(work: Any, c: int, which: int) -> float:
    """Return the sign by which what `watched` returns enters an event function."""
    return float(work.side[c]) if which == TURN_OF else -1.0 if which == UPWARDS else 1.0


@inner
def watched(system: Any, work: Any, slot: int, c: int, which: int) -> tuple[float, float, float, float]:
    """Return what an event is seen by, at the time of `modes_at`, and its first three derivatives.

    The speed of a contact that slips, the force of a rigid one that holds, the displacement of an elastic one.
    """
    phases, w, f = work.phases, work.w, work.f
    g0, g1, g2, g3 = 0.0, 0.0, 0.0, 0.0
    if is_rigid(system, c) and which != TURN_OF:
        g0 = held_force(system, work, slot, c, work.now_q, work.now_v)
        for order in range(3):
            by_f = phases.held_f[slot, c, order]
            g1 += by_f * f[order + 1]
            g2 += by_f * f[order + 2]
            g3 += by_f * f[order + 3] if order + 3 < len(f) else 0.0
        for j in range(phases.modes[slot]):
            row, drow = phases.held_w[slot, c, j], phases.held_dw[slot, c, j]
            g1 += (row * w[1, j] + drow * w[2, j]).real
            g2 += (row * w[2, j] + drow * w[3, j]).real
            g3 += (row * w[3, j] + drow * w[4, j]).real
        return g0, g1, g2, g3
    first, follows = 1 if which == TURN_OF else 0, phases.follows[slot, c]
    g0, g1, g2, g3 = follows * f[first], follows * f[first + 1], follows * f[first + 2], follows * f[first + 3]
    for j in range(phases.modes[slot]):
        row = phases.place[slot, c, j]
        g0 += (row * w[first, j]).real
        g1 += (row * w[first + 1, j]).real
        g2 += (row * w[first + 2, j]).real
        g3 += (row * w[first + 3, j]).real
    return (g0 if which == TURN_OF else place_of(system, work.now_q, c, f[0])), g1, g2, g3


@inner
def third_bound(system: Any, work: Any, slot: int, c: int, which: int) -> float:
    """Bound the third derivative of what an event is seen by, over the window of `bound_modes`."""
    phases, bound, total = work.phases, work.bound, NEVER
    if is_rigid(system, c) and which != TURN_OF:
        for order in range(3):
            total += abs(phases.held_f[slot, c, order]) * work.crest[order]
        for j in range(phases.modes[slot]):
            total += modulus(phases.held_w[slot, c, j]) * bound[0, j]
            total += modulus(phases.held_dw[slot, c, j]) * bound[1, j]
        return total
    first = 1 if which == TURN_OF else 0
    total += abs(phases.follows[slot, c]) * work.crest[first]
    for j in range(phases.modes[slot]):
        total += modulus(phases.place[slot, c, j]) * bound[first, j]
    return total


@inner
def parabola_zero(value: float, slope: float, curve: float) -> float:
    """Return when ``value + slope h - curve h^2 / 2`` falls to zero first."""
    inside = slope * slope + 2.0 * curve * value
    if inside < 0.0 or curve <= 0.0 <= slope:
        return inf
    root = sqrt(inside)
    if slope > 0.0:
        return (slope + root) / curve
    return 2.0 * value / (root - slope) if root > slope else inf


@inner
def safe_step(value: float, slope: float, bend: float, bound: float, reach: float) -> float:
    """Return h up to which ``value + slope h + bend h^2 / 2 - bound h^3 / 6`` stays positive, at most reach.

    Within H the cubic is no less than the parabola that has the third part of bound H against its bend, and it is zero
    before the parabola without that.
    """
    if value <= 0.0 and slope <= 0.0:
        return min(reach, 2.9 * bend / bound) if bend > 0.0 else 0.0
    within, step = min(reach, parabola_zero(value, slope, -bend)), 0.0
    for _ in range(6):
        step = max(step, min(within, parabola_zero(value, slope, bound * within / 3.0 - bend)))
        if 2.0 * step >= within:
            break
        within = sqrt(within * step)
    return step


@inner
def first_event(system: Any, work: Any, slot: int, span: float) -> tuple[float, int, int]:
    """Return when the phase ends within a span, by which contact and how; (span, -1, 0) where nothing happens."""
    t, end, grows = 0.0, 0.0, system.harmonics == 0 or work.phases.close[slot]
    window = (SHORT if grows else WINDOW) / work.fastest
    modes_at(system, work, slot, 0.0)
    while t < span:
        if t >= end:
            end = min(span, t + window)
            window *= 1.0 if system.harmonics == 0 else 2.0  # what decays is bounded by less later
            bound_modes(system, work, slot, t, end - t)
            for c in range(system.contacts):
                for which in range(3):
                    if watches(work, c, which):
                        work.bounds[c, which] = third_bound(system, work, slot, c, which)
        least, contact, how = nearest_event(system, work, slot, t, end - t)
        if contact < 0:
            return span, -1, 0
        if least < end - t and least <= 2e-15 * (1.0 + t):
            return t, contact, how
        met, t = work.sure and least < end - t, end if least >= end - t else t + least
        if t < span or end < span:
            modes_at(system, work, slot, t)
        if met:
            return t, contact, how
    return span, -1, 0


@inner
def nearest_event(system: Any, work: Any, slot: int, t: float, reach: float) -> tuple[float, int, int]:
    """Return the least step that is proven free of events, and the contact and the event that it is of; none: -1."""
    least, contact, how = inf, -1, 0
    g, slope, bend, twist = 0.0, 0.0, 0.0, 0.0
    for c in range(system.contacts):
        for which in range(3):
            if not watches(work, c, which):
                continue
            if which != DOWNWARDS or work.upper[c] == inf:
                g, slope, bend, twist = watched(system, work, slot, c, which)
            sign, value = sign_of(work, c, which), g
            if which != TURN_OF:
                value -= work.upper[c] if which == UPWARDS else work.lower[c]
            lead, bound = 0 if t > 0.0 else work.lead[c, which], work.bounds[c, which]
            if bound <= NEVER and slope == bend == 0.0 and which != TURN_OF:  # what it lies between is held: it waits
                continue
            if lead == 2 and abs(bend) * work.fastest < 1e-9 * bound:  # all but the third derivative are zero
                step = min(reach, max(0.0, 2.0 * sign * twist / (bound * work.fastest)))
            elif lead == 0 and sign * value <= 0.0:
                step = 0.0
            else:  # it has just begun: the first `lead` of value and slope are zero
                value, slide = 0.0 if lead > 0 else sign * value, 0.0 if lead > 1 else sign * slope
                step = safe_step(value, slide, sign * bend, bound, reach)
            if step < least:
                least, contact, how = step, c, which
                ahead = abs(slope + bend * step)  # a step whose cubic error is none in time ends at the event
                work.sure = 1 if lead == 0 and bound * step * step * step <= 1e-17 * ahead else 0
    return least, contact, how


@inner
def pulls(system: Any, work: Any) -> bool:
    """Return whether friction has fallen along the path to a pull at the state at hand."""
    for c in range(system.contacts):
        if system.gradient[c] != 0.0 and load_at(system, work, c) <= 0.0:
            return True
    return False


@inner
def after_event(system: Any, work: Any, slot: int, c: int, how: int) -> bool:
    """Let a contact hold or give way at its event; return whether it does: then contacts are to be settled."""
    for other in range(system.contacts):
        work.resting[other] = 1 if is_rigid(system, other) and work.side[other] == 0 else 0
    for which in range(3):
        work.lead[c, which] = 0
    side, work.breaking = 1 if how == UPWARDS else -1, -1
    first, last = system.first[c], system.first[c + 1]
    if how == TURN_OF:
        side = work.side[c]
        work.side[c], work.resting[c] = 0, 1 if is_rigid(system, c) else 0
        for i in range(first, last):
            if work.slips[i]:
                work.slips[i] = 0
                relax(system, work, c, i, float(side))
            work.lead[c, UPWARDS if side > 0 else DOWNWARDS] = 2
    elif is_rigid(system, c):
        _, slope, bend, _ = watched(system, work, slot, c, how)
        if side * slope <= 0.0 and side * bend < 0.0:  # it touches its limit and turns back
            work.lead[c, how] = 2 if slope == 0.0 else 1
            return False
        work.resting[c], work.breaking = side, c
    else:  # what meets its threshold gives way
        if abs(place_of(system, work.v, c, work.f[1])) <= still_speed(system, work):  # a rigid contact held it there
            _, slope, bend, _ = watched(system, work, slot, c, TURN_OF)
            if side * slope < 0.0 and (abs(slope) > BARELY * work.fastest or side * bend < 0.0):  # it moves back
                work.lead[c, how] = 2
                return False
            work.lead[c, TURN_OF] = 1
        threshold, work.side[c] = work.upper[c] if side > 0 else work.lower[c], side
        for i in range(first, last):
            late = side * (gives_way(system, work, c, i, float(side))[0] - threshold)
            if not work.slips[i] and late <= 1e-14 * abs(threshold):
                work.slips[i], work.slipped[i] = 1, 1
    return True


@inner
def start_account(system: Any, work: Any, size: int) -> None:
    """Begin to count and measure what a run does, and its derivative of a size."""
    work.count, work.signature, work.path = 0, 0, 0.0
    for i in range(system.sliders):
        work.slipped[i] = work.slips[i] = 0
    for a in range(system.masses):
        work.high[a] = work.low[a] = work.q[a]
    for a in range(size):
        for b in range(size):
            work.jacobian[a, b] = 1.0 if a == b else 0.0


@inner
def move_cubic(base: FloatArray, by: float) -> None:
    """Write the polynomial of a sampled base about a later time."""
    base[0] += by * (base[1] + by * (base[2] + by * base[3]))
    base[1] += by * (2.0 * base[2] + 3.0 * by * base[3])
    base[2] += 3.0 * by * base[3]


@inner
def advance(system: Any, work: Any, pieces: FloatArray, slot: int, length: float, tangent: bool) -> None:
    """Carry the state at hand, and the derivative, over a piece of a phase; record and count it."""
    at, n, contacts = work.count, system.masses, system.contacts
    work.count += 1
    if at < len(pieces):
        pieces[at, 0], pieces[at, 1] = work.tau, length
        for a in range(n):
            pieces[at, 2 + a], pieces[at, 2 + n + a] = work.q[a], work.v[a]
        for c in range(contacts):
            pieces[at, 2 + 2 * n + c], pieces[at, 2 + 2 * n + contacts + c] = work.kappa[c], work.offset[c]
            pieces[at, 2 + 2 * n + 2 * contacts + c] = float(work.side[c])
    modes_at(system, work, slot, length)
    if tangent:
        flow_over(system, work, slot)
        carry_jacobian(system, work)
    for a in range(n):
        work.q[a], work.v[a] = work.now_q[a], work.now_v[a]
        work.high[a], work.low[a] = max(work.high[a], work.q[a]), min(work.low[a], work.q[a])
    for c in range(contacts):
        if work.side[c] != 0:
            work.path += abs(place_of(system, work.q, c, work.f[0]) - work.place[c])
    work.tau += length
    move_cubic(system.cubic, length)
    for c in range(contacts):
        for which in range(3):
            work.lead[c, which] = 0


@inner
def come_earlier(system: Any, work: Any, slot: int, fall: float) -> None:
    """Write by how much an event comes earlier, for each column of the derivative, and what is before it.

    Its row is in `form`; `fall`: the rate of its function.
    """
    size, shift = 2 * system.masses + system.sliders, work.shift
    for i in range(system.sliders):
        work.slipping[i] = work.slips[i]
    for b in range(size):
        shift[b] = 0.0
    if fall != 0.0:
        for k in range(size):
            if work.form[k] != 0.0:
                for b in range(size):
                    shift[b] += work.form[k] * work.jacobian[k, b] / fall
    accelerate(system, work, slot)
    for a in range(system.masses):
        work.acceleration[0, a] = work.acceleration[1, a]


@inner
def jump(system: Any, work: Any, c: int, side: float) -> None:
    """Let the derivative jump at an event, by the saltation matrix; `side`: where the contact slipped before."""
    n = system.masses
    for i in range(system.first[c], system.first[c + 1]):
        if work.slipping[i] and not work.slips[i]:
            anchor_row(system, work, c, i, side)
    for a in range(n):
        change = work.acceleration[1, a] - work.acceleration[0, a]
        for b in range(2 * n + system.sliders):
            work.jacobian[n + a, b] += change * work.shift[b]


@inner
def event_row(system: Any, work: Any, slot: int, c: int, how: int) -> None:
    """Write the derivative of an event function by the state: displacements, velocities, anchors."""
    n, form, sign = system.masses, work.form, sign_of(work, c, how)
    for k in range(2 * n + system.sliders):
        form[k] = 0.0
    if is_rigid(system, c) and how != TURN_OF:  # of what it can bear more than it does
        by_load = ratio_of(system, c, how == UPWARDS) * system.limit[c] * system.gradient[c]
        for a in range(n):
            form[a] = by_load * system.row[c, a]
        for b in range(n):
            grip = sign * work.phases.grip[slot, c, b]
            for a in range(n):
                form[a] -= grip * work.phases.stiffness[slot, b, a]
                form[n + a] -= grip * system.damping[b, a]
            for other in range(system.contacts):
                for i in range(system.first[other], system.first[other + 1]):
                    if not work.slips[i]:
                        form[2 * n + i] += grip * system.row[other, b] * system.spring[i]
        return
    for a in range(n):
        form[n + a if how == TURN_OF else a] = sign * system.row[c, a]
    threshold = work.upper[c] if how == UPWARDS else work.lower[c]
    for i in range(system.first[c], system.first[c + 1]):
        place, by_anchor = gives_way(system, work, c, i, -sign)
        if how != TURN_OF and not work.slips[i] and place == threshold:
            form[2 * n + i] = -sign * by_anchor
            break


@inner
def follow_slip(system: Any, work: Any, tangent: bool) -> None:
    """Write the anchors of sliders that slip at the end of a run, and their rows of the derivative."""
    for c in range(system.contacts):
        for i in range(system.first[c], system.first[c + 1]):
            if work.slips[i]:
                relax(system, work, c, i, float(work.side[c]))
                if tangent:
                    anchor_row(system, work, c, i, float(work.side[c]))


@inner
def anchor_row(system: Any, work: Any, c: int, i: int, side: float) -> None:
    """Write the derivative of the anchor of a slider that slips, which follows its contact."""
    n, share = system.masses, 1.0 - side * system.strength[i] * system.gradient[c] / system.spring[i]
    for b in range(2 * n + system.sliders):
        total = 0.0
        for a in range(n):
            total += system.row[c, a] * work.jacobian[a, b]
        work.jacobian[2 * n + i, b] = share * total


@inner
def carry_jacobian(system: Any, work: Any) -> None:
    """Multiply the derivative from the left by that of a phase."""
    n, contacts, jacobian = system.masses, system.contacts, work.jacobian
    column = work.form
    for b in range(2 * n + system.sliders):
        for a in range(2 * n):
            column[a] = jacobian[a, b]
        for c in range(contacts):  # its constant force
            column[2 * n + c] = 0.0
            for i in range(system.first[c], system.first[c + 1]):
                if not work.slips[i]:
                    column[2 * n + c] -= system.spring[i] * jacobian[2 * n + i, b]
        for a in range(2 * n):
            total = 0.0
            for k in range(2 * n + contacts):
                total += work.flow[a, k] * column[k]
            jacobian[a, b] = total


def run(system: Any, work: Any, pieces: FloatArray, span: float, tangent: bool, fresh: bool) -> int:
    """Carry the state over a span (rad); return how that ended. The anchors of what slips follow their contact.

    The state is in `work`: `tau`, `q`, `v`, `anchor`; afterwards it is the end's. With `tangent` the derivative of
    the end by the start is in `jacobian`. One that is not `fresh` goes on where the last run ended. It is called by its
    address: that keeps its code out of its callers.
    """
    work.until = work.tau + span
    if fresh:
        start_account(system, work, 2 * system.masses + system.sliders if tangent else 0)
    begin(system, work)
    slot, count = settle(system, work), 1 + system.contacts + system.sliders
    idle, left = 0, EVENTS * count * (1.0 + span / system.r)
    while slot >= 0:
        if pulls(system, work):
            return PULLS
        begin_motion(system, work, slot)
        length, c, how = first_event(system, work, slot, work.until - work.tau)
        if length > 0.0:
            advance(system, work, pieces, slot, length, tangent)
        if c < 0:
            work.tau = work.until
            base_at_time(system, work)
            follow_slip(system, work, tangent)
            return DONE
        idle, left = 0 if length > 0.0 else idle + 1, left - 1.0
        if work.left < 0.0:
            return TIRED
        if idle > IDLE * count or left < 0.0:
            return PULLS if pulls(system, work) else CHATTER
        work.signature = (work.signature * 31 + 3 * c + how + 1) % 1000000007
        base_at_time(system, work)
        if tangent:
            event_row(system, work, slot, c, how)
            come_earlier(system, work, slot, sign_of(work, c, how) * watched(system, work, slot, c, how)[1])
        side = float(work.side[c])
        if after_event(system, work, slot, c, how):
            slot = settle(system, work)
        if tangent:
            jump(system, work, c, side)
    return PULLS if pulls(system, work) else -slot


types = numba.types
FORMULA = types.UniTuple(types.float64, 16)(types.float64[::1], *(types.float64,) * 6)
RUN = types.int64(
    *(from_dtype(SYSTEM), from_dtype(WORK), types.Array(types.float64, 2, "C")),
    *(types.float64, types.boolean, types.boolean),
)
"""What a law's formula and what a flow's run are for compiled functions: one search serves all that have an address."""
RUNNER, call_run, call_formula = address_of(run, RUN), caller(RUN), caller(FORMULA)


class Carrier(NamedTuple):
    """What carries a motion: what is carried, where it writes."""

    system: Any  # a record of SYSTEM
    work: Any  # of WORK
    pieces: FloatArray  # what is recorded
