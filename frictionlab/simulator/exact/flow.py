"""The motion from event to event: contacts hold, slip, turn and give way; and the derivative of a run by its start.

No event is stepped over. Each event function g is positive until its event; its value, two derivatives and a bound M of
the third give a step that is proven free of zeros, ``g + g' h + g'' h^2 / 2 - M h^3 / 6 > 0``, and a march of such
steps converges to the zero. At each event the derivative of the state jumps by a saltation matrix.
"""

from math import inf, sqrt
from typing import Any, NamedTuple

from numba import from_dtype

from frictionlab.arrays import FloatArray
from frictionlab.simulator.compiled import address_of, caller, inlined, inner, numba
from frictionlab.simulator.exact.motion import (
    STAGES,
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
from frictionlab.simulator.exact.phase import CHATTER, DONE, PULLS, SIDE, SYSTEM, TIRED, dot, drive_size, slot_of

TURN_OF, UPWARDS, DOWNWARDS = 0, 1, 2  # what ends a phase: slip of a contact, or what it holds up or down
WINDOW = 8.0  # over the fastest rate: derivatives are bounded over so long at first
SHORT = 1.5  # the same where their bounds grow: under a sampled base, and next to resonance
STILL = 1e-12  # over the size of the motion: a slower contact stands
ROUNDED = 1e-16  # over the size of the drive: what is left of a speed that is none
BARELY = 1e-11  # over the masses' accelerations: a contact so little pushed stays where it is
IDLE = 25  # events in a row at one moment, and as many for each contact and slider, that no motion has
BRIEF = 1e-12  # rad: a phase by steps that is no longer takes no time
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
    for c in range(system.contacts):
        if work.kappa[c] == inf:
            for a in range(n):
                work.net[a] -= system.row[c, a] * work.force[c]
    for a in range(n):
        work.acceleration[1, a] = dot(system.mobility[a], work.net, n)


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
            miss = place_of(system, work.v, c, work.f[1])
            for a in range(n):
                work.net[a] = dot(system.mobility[a], system.row[c], n)
            give = dot(system.row[c], work.net, n)
            for a in range(n):
                work.v[a] -= work.net[a] * miss / give
    return count


@inner
def _is_consistent(system: Any, work: Any) -> bool:
    for c in range(system.contacts):
        if not work.resting[c]:
            continue
        if work.side[c] != 0:
            found, size = place_of(system, work.acceleration[1], c, work.f[2]), 1.0
            for a in range(system.masses):
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
    """Return the speed below which a contact stands: steps leave rounding of a mass at rest, where the base turns."""
    total = abs(work.f[1])
    for a in range(system.masses):
        total += abs(work.v[a])
    return STILL * total + (ROUNDED * drive_size(system) if is_integrated(system) else 0.0)


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
    """Return the sign by which what an event is seen by enters its function."""
    return float(work.side[c]) if which == TURN_OF else -1.0 if which == UPWARDS else 1.0


@inner
def watch(system: Any, work: Any, slot: int, c: int, which: int) -> None:
    """Write what an event is `seen` by, at the time of `modes_at`, and its first three derivatives.

    The speed of a contact that slips, the force of a rigid one that holds, the displacement of an elastic one.
    """
    phases, w, f, seen = work.phases, work.w, work.f, work.seen
    first, held = 1 if which == TURN_OF else 0, work.kappa[c] == inf
    for k in range(len(seen)):
        seen[k] = phases.seen_f[slot, c, 0] * f[first + k]
        for j in range(phases.modes[slot]):
            seen[k] += (phases.seen_w[slot, c, j] * w[first + k, j]).real
        if held and k > 0:
            seen[k] += phases.seen_f[slot, c, 1] * f[k + 1]
            seen[k] += phases.seen_f[slot, c, 2] * f[k + 2] if k + 2 < len(f) else 0.0
            for j in range(phases.modes[slot]):
                seen[k] += (phases.seen_dw[slot, c, j] * w[k + 1, j]).real
    if held:
        seen[0] = held_force(system, work, slot, c, work.now_q, work.now_v)
    elif which != TURN_OF:
        seen[0] = place_of(system, work.now_q, c, f[0])


@inner
def third_bound(work: Any, slot: int, c: int, which: int) -> float:
    """Bound the third derivative of what an event is seen by, over the window of `bound_modes`."""
    phases, bound, first = work.phases, work.bound, 1 if which == TURN_OF else 0
    total = NEVER + abs(phases.seen_f[slot, c, 0]) * work.crest[first]
    for j in range(phases.modes[slot]):
        total += modulus(phases.seen_w[slot, c, j]) * bound[first, j]
    if work.kappa[c] == inf:
        total += abs(phases.seen_f[slot, c, 1]) * work.crest[1] + abs(phases.seen_f[slot, c, 2]) * work.crest[2]
        for j in range(phases.modes[slot]):
            total += modulus(phases.seen_dw[slot, c, j]) * bound[1, j]
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


@inlined
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
                        work.bounds[c, which] = third_bound(work, slot, c, which)
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


@inlined
def nearest_event(system: Any, work: Any, slot: int, t: float, reach: float) -> tuple[float, int, int]:
    """Return the least step that is proven free of events, and the contact and the event that it is of; none: -1."""
    least, contact, how = inf, -1, 0
    for c in range(system.contacts):
        for which in range(3):
            if not watches(work, c, which):
                continue
            if which != DOWNWARDS or work.upper[c] == inf:
                watch(system, work, slot, c, which)
            sign, value, slope, bend = sign_of(work, c, which), work.seen[0], work.seen[1], work.seen[2]
            if which != TURN_OF:
                value -= work.upper[c] if which == UPWARDS else work.lower[c]
            lead, bound = 0 if t > 0.0 else work.lead[c, which], work.bounds[c, which]
            if bound <= NEVER and slope == bend == 0.0 and which != TURN_OF:  # what it lies between is held: it waits
                continue
            if lead == 2 and abs(bend) * work.fastest < 1e-9 * bound:  # all but the third derivative are zero
                step = min(reach, max(0.0, 2.0 * sign * work.seen[3] / (bound * work.fastest)))
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
def contact_at(system: Any, c: int, side: float, z: float, v: float, w: float, age: float) -> Any:
    """Return what a contact that has a formula does (`laws.law.Contact`), its dashpot apart."""
    law = system.law
    return call_formula(law.formula[c], (law.own[c], side, law.beta[c] * (1.0 + law.gradient[c] * z), z, v, w, age))


@inner
def state_of(system: Any, work: Any, c: int, which: int) -> float:
    """Return a state of the contact's own at hand; 0: it has none such."""
    if system.law.states[c] <= which:
        return 0.0
    return float(work.anchor[system.first[system.contacts] - 2 * system.masses + system.law.at[c] + which])


@inner
def freeze(system: Any, work: Any) -> bool:
    """Make friction by a formula what it is at this moment; False where friction is negative at any contact.

    Of a contact at rest that is what it begins to slip with.
    """
    law = system.law
    for c in range(system.contacts):
        if law.formula[c] == 0:
            if system.gradient[c] != 0.0 and load_at(system, work, c) <= 0.0:
                return False
            continue
        z, v = place_of(system, work.q, c, work.f[0]), place_of(system, work.v, c, work.f[1])
        rests, side = law.states[c] == 0 and work.side[c] == 0, 1.0 if work.side[c] >= 0 else -1.0
        w, age = state_of(system, work, c, 0), state_of(system, work, c, 1)
        system.limit[c] = side * contact_at(system, c, side, z, 0.0 if rests else v, w, age)[0]
        if (law.states[c] == 0 and system.limit[c] < 0.0) or law.beta[c] * (1.0 + law.gradient[c] * z) < 0.0:
            return False
    return True


@inner
def turn_corners(system: Any, work: Any) -> None:
    """Give contacts with states of their own the side on which they are, or to which they are accelerated."""
    for c in range(system.contacts):
        if system.law.states[c] > 0:
            ending = state_of(system, work, c, 0) if system.law.states[c] > 1 else 0.0
            ending = place_of(system, work.v, c, work.f[1]) if ending == 0.0 else ending
            ending = place_of(system, work.acceleration[1], c, work.f[2]) if ending == 0.0 else ending
            work.resting[c], work.side[c] = 0, 1 if ending >= 0.0 else -1


@inlined
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
        if side * work.seen[1] <= 0.0 and side * work.seen[2] < 0.0:  # it touches its limit and turns back
            work.lead[c, how] = 2 if work.seen[1] == 0.0 else 1
            return False
        work.resting[c], work.breaking = side, c
    else:  # what meets its threshold gives way
        if abs(place_of(system, work.v, c, work.f[1])) <= still_speed(system, work):  # a rigid contact held it there
            work.how = TURN_OF
            watch(system, work, slot, c, work.how)
            slope, bend = work.seen[1], work.seen[2]
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
    work.count, work.signature, work.path, work.steps.next = 0, 0, 0.0, system.law.first
    for i in range(system.sliders):
        work.slips[i], work.slipped[i] = 0, 1 if i >= system.first[system.contacts] else 0
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
def begin_piece(system: Any, work: Any, pieces: FloatArray, length: float) -> int:
    """Count a piece that begins at the state at hand, and record what all flows do; return its number, -1: no space."""
    at = work.count
    work.count += 1
    if at >= len(pieces):
        return -1
    pieces[at, 0], pieces[at, 1] = work.tau, length
    for k in range(4):
        pieces[at, 2 + k] = system.cubic[k]
    for c in range(system.contacts):
        pieces[at, SIDE + c] = float(work.side[c])
    return int(at)


@inlined
def advance(system: Any, work: Any, pieces: FloatArray, slot: int, length: float, tangent: bool) -> None:
    """Carry the state at hand, and the derivative, over a piece of a phase; record and count it."""
    n, contacts = system.masses, system.contacts
    at, begun = begin_piece(system, work, pieces, length), SIDE + contacts
    if at >= 0:
        for a in range(n):
            pieces[at, begun + a], pieces[at, begun + n + a] = work.q[a], work.v[a]
        for c in range(contacts):
            pieces[at, begun + 2 * n + c], pieces[at, begun + 2 * n + contacts + c] = work.kappa[c], work.offset[c]
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
        by_place = system.limit[c] * system.gradient[c]
        if system.law.formula[c] != 0:
            d = contact_at(system, c, -sign, place_of(system, work.q, c, work.f[0]), 0.0, 0.0, 0.0)
            by_place = -sign * (d[1] * system.law.beta[c] * system.law.gradient[c] + d[2])
        for a in range(n):
            form[a] = ratio_of(system, c, how == UPWARDS) * by_place * system.row[c, a]
        for b in range(n):
            add_force_row(system, work, slot, b, sign * work.phases.grip[slot, c, b])
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
def add_force_row(system: Any, work: Any, slot: int, a: int, share: float) -> None:
    """Add to `form` a share of the derivative by the state of the force on a mass, but for that of held contacts."""
    n, form, held = system.masses, work.form, system.first[system.contacts]
    for k in range(work.steps.components):
        if is_integrated(system):
            form[k if k < 2 * n else held + k] += share * work.steps.bare[a, k, STAGES]
        else:
            form[k] -= share * (work.phases.stiffness[slot, a, k] if k < n else system.damping[a, k - n])
    for c in range(system.contacts):
        for i in range(system.first[c], system.first[c + 1]):
            if not work.slips[i]:
                form[2 * n + i] += share * system.row[c, a] * system.spring[i]


@inner
def is_integrated(system: Any) -> bool:
    """Return whether the flow is integrated by steps."""
    return bool(system.law.tolerance > 0.0)


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
        work.jacobian[2 * n + i, b] = share * dot(system.row[c], work.jacobian[:, b], n)


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
            jacobian[a, b] = dot(work.flow[a], column, 2 * n + contacts)


def through_phase(system: Any, work: Any, pieces: FloatArray, slot: int, tangent: bool) -> int:
    """Carry the state, and the derivative, to the end of the phase in a slot; return how that went.

    It is the end of the run, or an event: its contact, how it happens, its rate and by what it is seen are in `work`.
    """
    begin_motion(system, work, slot)
    length, work.contact, work.how = first_event(system, work, slot, work.until - work.tau)
    if length > 0.0:
        advance(system, work, pieces, slot, length, tangent)
    if work.contact >= 0:
        base_at_time(system, work)
        watch(system, work, slot, work.contact, work.how)
        work.fall = sign_of(work, work.contact, work.how) * work.seen[1]
    return TIRED if work.contact >= 0 and work.left < 0.0 else DONE


@inlined
def pass_event(system: Any, work: Any, slot: int, tangent: bool) -> int:
    """Let contacts do what they do at the event at hand, and the derivative jump; return as `settle`."""
    c, how, states = work.contact, work.how, system.law.states[work.contact]
    if states > 0:  # its law has a corner there, the motion has none
        work.side[c] = -work.side[c]
        if states == 2:
            work.anchor[system.first[system.contacts] - 2 * system.masses + system.law.at[c]] = 0.0
        elif system.masses == 1 and system.follow[c] == 0.0:
            work.v[0] = 0.0
        return slot
    work.signature = (work.signature * 31 + 3 * c + how + 1) % 1000000007
    if tangent:
        event_row(system, work, slot, c, how)
        for other in range(system.contacts):
            set_contact(system, work, other)
        come_earlier(system, work, slot, work.fall)
    side = float(work.side[c])
    if after_event(system, work, slot, c, how):
        slot = settle(system, work)
    if tangent and slot >= 0:
        jump(system, work, c, side)
    return slot


def run(system: Any, work: Any, pieces: FloatArray, span: float, tangent: bool, fresh: bool) -> int:
    """Carry the state over a span (rad), phase by phase; return how that ended. Anchors of what slips follow it.

    The state is in `work`: `tau`, `q`, `v`, `anchor`; afterwards it is the end's. With `tangent` the derivative of
    the end by the start is in `jacobian`. One that is not `fresh` goes on where the last run ended. It is called by its
    address: that keeps its code out of its callers.
    """
    work.until, work.idle, work.quick = work.tau + span, 0, 0
    work.steps.components = 2 * system.masses + system.sliders - system.first[system.contacts]
    if fresh:
        start_account(system, work, 2 * system.masses + system.sliders if tangent else 0)
    begin(system, work)
    turn_corners(system, work)
    slot, count = settle(system, work) if freeze(system, work) else -PULLS, 1 + system.contacts + system.sliders
    turn_corners(system, work)
    left, brief = EVENTS * count * (1.0 + span / system.r), BRIEF if is_integrated(system) else 0.0
    while slot >= 0 and freeze(system, work):
        begun = work.tau
        code = call_advance(system.advance, (system, work, pieces, slot, tangent))
        if code != DONE:
            return int(code)
        if work.contact < 0:
            work.tau = work.until
            base_at_time(system, work)
            follow_slip(system, work, tangent)
            return DONE
        work.idle, left = work.idle + 1 if work.tau - begun <= brief else 0, left - 1.0
        if work.idle > IDLE * count or left < 0.0:
            return CHATTER if freeze(system, work) else PULLS
        slot = pass_event(system, work, slot, tangent)
    return -slot if slot < 0 and freeze(system, work) else PULLS


types = numba.types
RECORDS = (from_dtype(SYSTEM), from_dtype(WORK), types.Array(types.float64, 2, "C"))
FORMULA = types.UniTuple(types.float64, 16)(types.float64[::1], *(types.float64,) * 6)
ADVANCE = types.int64(*RECORDS, types.int64, types.boolean)
RUN = types.int64(*RECORDS, types.float64, types.boolean, types.boolean)
"""What a law's formula, a flow and its run are for compiled functions: one search serves all that have an address."""
call_formula, call_advance, call_run = caller(FORMULA), caller(ADVANCE), caller(RUN)
RUNNER, ADVANCER = address_of(run, RUN), address_of(through_phase, ADVANCE)


class Carrier(NamedTuple):
    """What carries a motion: what is carried, where it writes."""

    system: Any  # a record of SYSTEM
    work: Any  # of WORK
    pieces: FloatArray  # what is recorded
