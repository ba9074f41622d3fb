"""The motion from event to event: contacts hold, slip, turn and give way; and the derivative of a run by its start.

No event is stepped over. Each event function g is positive until its event; its value, two derivatives and a bound M of
the third give a step that is proven free of zeros, ``g + g' h + g'' h^2 / 2 - M h^3 / 6 > 0``, and a march of such
steps converges to the zero. At each event the derivative of the state jumps by a saltation matrix.
"""

from math import inf, sqrt
from typing import Any

from numba import from_dtype, types

from frictionlab.arrays import FloatArray
from frictionlab.simulator.compiled import callback, inner
from frictionlab.simulator.exact.motion import (
    WORK,
    base_at_time,
    base_bound,
    begin_motion,
    bound_modes,
    flow_over,
    force_on,
    held_force,
    modes_at,
    place_of,
    speed_of,
)
from frictionlab.simulator.exact.phase import CHATTER, DONE, PULLS, SYSTEM, TIRED, slot_of

TURN_OF, UPWARDS, DOWNWARDS = 0, 1, 2  # what ends a phase: slip of a contact, or what it holds up or down
WINDOW = 1.5  # over the fastest rate: derivatives are bounded over so long at first
STILL = 1e-12  # over the size of the motion: a slower contact stands
BARELY = 1e-11  # over the accelerations: a contact so little pushed stays where it is
IDLE = 8  # events in a row at one moment, and as many for each contact and slider, that no motion has
EVENTS = 400.0  # in a natural period and contact that no motion has


@inner
def is_rigid(system: Any, c: int) -> bool:
    """Tell whether a contact has no spring of its own."""
    return system.first[c] == system.first[c + 1]


@inner
def ratio_of(system: Any, c: int, upwards: bool) -> float:
    """Return the ratio of static to kinetic friction of a contact that gives way in a direction."""
    return system.up[c] if upwards else system.down[c]


@inner
def load_of(system: Any, c: int, place: float) -> float:
    """Return the share of a contact's friction force that it has at a displacement."""
    return 1.0 + system.gradient[c] * place


@inner
def still_below(system: Any, work: Any) -> float:
    """Return the speed below which a contact stands, by rounding."""
    size = abs(work.f[1])
    for a in range(system.masses):
        size += abs(work.v[a])
    return STILL * size


@inner
def gives_way_at(system: Any, work: Any, c: int, i: int, side: float) -> float:
    """Return the displacement at which a held slider gives way to a side."""
    limit = ratio_of(system, c, side > 0.0) * system.strength[i]
    return (system.spring[i] * work.anchor[i] + side * limit) / (system.spring[i] - side * limit * system.gradient[c])


@inner
def set_contact(system: Any, work: Any, c: int) -> None:
    """Write stiffness, constant force and thresholds of a contact as it holds or slips."""
    side, q = float(work.side[c]), system.gradient[c]
    work.upper[c], work.lower[c] = inf, -inf
    if is_rigid(system, c):
        work.kappa[c] = inf if side == 0.0 else side * system.limit[c] * q
        work.offset[c] = side * system.limit[c]
        return
    kappa, offset = 0.0, 0.0
    for i in range(system.first[c], system.first[c + 1]):
        spring, limit, anchor = system.spring[i], system.strength[i], work.anchor[i]
        if work.slips[i]:
            kappa += side * limit * q
            offset += side * limit
            continue
        kappa += spring
        offset -= spring * anchor
        work.upper[c] = min(work.upper[c], gives_way_at(system, work, c, i, 1.0))
        work.lower[c] = max(work.lower[c], gives_way_at(system, work, c, i, -1.0))
    work.kappa[c], work.offset[c] = kappa, offset


@inner
def anchor_of(system: Any, c: int, i: int, place: float, side: float) -> float:
    """Return where the spring of a slider that slips at a displacement is relaxed."""
    return place - side * system.strength[i] / system.spring[i] * load_of(system, c, place)


@inner
def accelerate(system: Any, work: Any, slot: int, out: int) -> None:
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
        work.acceleration[out, a] = acceleration


@inner
def relative_acceleration(system: Any, work: Any, c: int) -> float:
    """Return a contact's acceleration over the largest of the masses'."""
    found, size = -system.follow[c] * work.f[2], 1.0
    for a in range(system.masses):
        found += system.row[c, a] * work.acceleration[1, a]
        size = max(size, abs(work.acceleration[1, a]))
    return found / size


@inner
def settle(system: Any, work: Any, resting: FloatArray, breaking: int) -> int:
    """Decide which rigid contacts at rest hold: as many as can. Return the phase's slot; -1 where none is consistent.

    One that holds is within its limit; one that slips is accelerated the way it slips. `resting` marks them;
    `breaking` is one that gives way now, its side is set; -1: none.
    """
    count, total = 0, 1
    for c in range(system.contacts):
        if resting[c]:
            count += 1
            total *= 3
    _stand(system, work, resting, count)
    for slipping in range(count + 1):
        for code in range(total):
            if _assign(system, work, resting, code, breaking) != slipping:
                continue
            for c in range(system.contacts):
                set_contact(system, work, c)
            slot = slot_of(system, work.phases, work.kappa)
            if slot < 0:
                return slot
            if work.phases.modes[slot] < 0:
                continue
            accelerate(system, work, slot, 1)
            if _is_consistent(system, work, resting, breaking):
                return slot
    return -CHATTER


@inner
def _assign(system: Any, work: Any, resting: FloatArray, code: int, breaking: int) -> int:
    """Set the sides of resting contacts by the digits of a code; return how many slip, -1: not as one breaks."""
    slipping = 0
    for c in range(system.contacts):
        if not resting[c]:
            continue
        digit = code % 3
        code //= 3
        side = 0 if digit == 0 else 1 if digit == 1 else -1
        if c == breaking and side != resting[c]:
            return -1
        work.side[c] = side
        slipping += abs(side)
    return slipping


@inner
def _stand(system: Any, work: Any, resting: FloatArray, count: int) -> None:
    """Make the speeds of contacts at rest exactly zero."""
    n = system.masses
    if count == 1 and n == 1:
        for c in range(system.contacts):
            if resting[c]:
                work.v[0] = system.follow[c] * work.f[1] / system.row[c, 0]
        return
    for _ in range(3 if count > 1 else count):  # one after the other, and again: they may share a mass
        for c in range(system.contacts):
            if not resting[c]:
                continue
            miss, give = speed_of(system, work.v, c, work.f[1]), 0.0
            for a in range(n):
                work.net[a] = 0.0
                for b in range(n):
                    work.net[a] += system.mobility[a, b] * system.row[c, b]
                give += system.row[c, a] * work.net[a]
            for a in range(n):
                work.v[a] -= work.net[a] * miss / give


@inner
def _is_consistent(system: Any, work: Any, resting: FloatArray, breaking: int) -> bool:
    for c in range(system.contacts):
        if not resting[c]:
            continue
        if work.side[c] != 0:
            if c != breaking and work.side[c] * relative_acceleration(system, work, c) < -BARELY:
                return False
            continue
        limit = system.limit[c] * load_of(system, c, place_of(system, work.q, c, work.f[0]))
        room = STILL * limit
        if not -system.down[c] * limit - room <= work.force[c] <= system.up[c] * limit + room:
            return False
    return True


@inner
def begin(system: Any, work: Any, resting: FloatArray) -> int:
    """Find how contacts hold or slip in the state at hand; return the phase's slot."""
    base_at_time(system, work)
    still = still_below(system, work)
    for c in range(system.contacts):
        for g in range(3):
            work.lead[c, g] = 0
        resting[c] = 0
        speed, place = speed_of(system, work.v, c, work.f[1]), place_of(system, work.q, c, work.f[0])
        side = 1 if speed > 0.0 else -1
        if is_rigid(system, c):
            work.side[c] = 0 if abs(speed) <= still else side
            resting[c] = 1 if work.side[c] == 0 else 0
            continue
        work.side[c] = 0
        for i in range(system.first[c], system.first[c + 1]):
            limit = system.strength[i] * load_of(system, c, place)
            pull = system.spring[i] * (place - work.anchor[i])
            if pull > system.up[c] * limit or -pull > system.down[c] * limit:  # no state of a run: a trial's
                work.anchor[i] = anchor_of(system, c, i, place, 1.0 if pull > 0.0 else -1.0)
                pull = system.spring[i] * (place - work.anchor[i])
            ratio = ratio_of(system, c, side > 0)
            slips = abs(speed) > still and side * pull >= limit * (1.0 - STILL)
            work.slips[i] = 1 if slips and (ratio == 1.0 or abs(pull) <= limit * (1.0 + STILL)) else 0
            if work.slips[i]:
                work.side[c], work.slipped[i] = side, 1
    return settle_turns(system, work, resting)


@inner
def event_function(system: Any, work: Any, slot: int, c: int, which: int) -> tuple[float, float, float, float]:
    """Return an event function of a contact and its first three derivatives, at the time of `modes_at`."""
    phases = work.phases
    sign = float(work.side[c]) if which == TURN_OF else -1.0 if which == UPWARDS else 1.0
    if is_rigid(system, c) and which != TURN_OF:
        return _held_force(system, work, slot, c, sign)
    first = 1 if which == TURN_OF else 0
    g0, g1, g2, g3 = 0.0, 0.0, 0.0, 0.0
    for j in range(phases.modes[slot]):
        row, w = phases.place[slot, c, j], work.w
        g0 += (row * w[first, j]).real
        g1 += (row * w[first + 1, j]).real
        g2 += (row * w[first + 2, j]).real
        g3 += (row * w[first + 3, j]).real
    follows, f = phases.follows[slot, c], work.f
    g0, g1, g2 = g0 + follows * f[first], g1 + follows * f[first + 1], g2 + follows * f[first + 2]
    g3 += follows * f[first + 3]
    if which != TURN_OF:
        g0 = place_of(system, work.now_q, c, work.f[0])
        return (work.upper[c] if which == UPWARDS else -work.lower[c]) + sign * g0, sign * g1, sign * g2, sign * g3
    return sign * g0, sign * g1, sign * g2, sign * g3


@inner
def _held_force(system: Any, work: Any, slot: int, c: int, sign: float) -> tuple[float, float, float, float]:
    """As `event_function`: what a rigid contact that holds can bear more than it does."""
    phases, w, f = work.phases, work.w, work.f
    g0, g1, g2, g3 = held_force(system, work, slot, c, work.now_q, work.now_v), 0.0, 0.0, 0.0
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
    limit = ratio_of(system, c, sign < 0.0) * system.limit[c] * load_of(system, c, work.place[c])
    return limit + sign * g0, sign * g1, sign * g2, sign * g3


@inner
def third_bound(system: Any, work: Any, slot: int, c: int, which: int) -> float:
    """Bound the third derivative of an event function over the window of `bound_modes`."""
    phases, bound, total = work.phases, work.bound, 0.0
    if is_rigid(system, c) and which != TURN_OF:
        for order in range(3):
            total += abs(phases.held_f[slot, c, order]) * base_bound(system, order + 3)
        for j in range(phases.modes[slot]):
            total += abs(phases.held_w[slot, c, j]) * bound[0, j] + abs(phases.held_dw[slot, c, j]) * bound[1, j]
        return total
    row = 1 if which == TURN_OF else 0
    total = abs(phases.follows[slot, c]) * base_bound(system, 3 + row)
    for j in range(phases.modes[slot]):
        total += abs(phases.place[slot, c, j]) * bound[row, j]
    return total


@inner
def safe_step(value: float, slope: float, bend: float, bound: float, reach: float) -> float:
    """Return h up to which ``value + slope h + bend h^2 / 2 - bound h^3 / 6`` stays positive, at most reach.

    Within H the cubic is no less than the parabola that has the third part of bound H against its bend.
    """
    if value <= 0.0 and slope <= 0.0:
        return min(reach, 2.9 * bend / bound) if bend > 0.0 else 0.0
    within, step = reach, 0.0
    for _ in range(6):
        curve = bound * within / 3.0 - bend
        inside = slope * slope + 2.0 * curve * value
        least = within
        if inside >= 0.0 and not (curve <= 0.0 <= slope):
            root = sqrt(inside)
            if slope > 0.0:
                least = (slope + root) / curve if curve > 0.0 else within
            else:
                least = 2.0 * value / (root - slope) if root > slope else within
        step = max(step, min(within, least))
        if 2.0 * step >= within:
            break
        within = sqrt(within * step)
    return step


@inner
def watches(system: Any, work: Any, c: int, which: int) -> bool:
    """Tell whether a contact can end a phase in one of the three ways."""
    side = work.side[c]
    if which == TURN_OF:
        return side != 0
    if is_rigid(system, c):
        return side == 0
    toward = 1 if which == UPWARDS else -1
    return side in (0, toward) and abs(work.upper[c] if toward > 0 else work.lower[c]) < inf


@inner
def first_event(system: Any, work: Any, slot: int, span: float) -> tuple[float, int, int]:
    """Return when the phase ends within a span, by which contact and how; (span, -1, 0) where nothing happens."""
    t, end, begun, window = 0.0, 0.0, False, WINDOW / work.fastest
    modes_at(system, work, slot, 0.0)
    while t < span:
        if t >= end:
            end = min(span, t + window)
            window *= 1.0 if system.harmonics == 0 else 2.0  # what decays is bounded by less later
            bound_modes(system, work, slot, t, end - t)
            bound_events(system, work, slot)
        least, contact, how = nearest_event(system, work, slot, end - t, begun)
        if contact < 0:
            return span, -1, 0
        if least < end - t and least <= 2e-15 * (1.0 + t):
            return t, contact, how
        begun, t = True, end if least >= end - t else t + least
        if t < span or end < span:
            modes_at(system, work, slot, t)
    return span, -1, 0


@inner
def bound_events(system: Any, work: Any, slot: int) -> None:
    """Bound the third derivative of each event function over the window of `bound_modes`."""
    for c in range(system.contacts):
        for which in range(3):
            if watches(system, work, c, which):
                work.bounds[c, which] = third_bound(system, work, slot, c, which) + 1e-300


@inner
def nearest_event(system: Any, work: Any, slot: int, reach: float, begun: bool) -> tuple[float, int, int]:
    """Return the least step that is proven free of events, and the contact and the event that it is of; none: -1."""
    least, contact, how = inf, -1, 0
    for c in range(system.contacts):
        for which in range(3):
            if not watches(system, work, c, which):
                continue
            g, slope, bend, twist = event_function(system, work, slot, c, which)
            lead = 0 if begun else work.lead[c, which]
            step = step_before(g, slope, bend, twist, lead, work.bounds[c, which], work.fastest, reach)
            if step < least:
                least, contact, how = step, c, which
    return least, contact, how


@inner
def step_before(
    g: float, slope: float, bend: float, twist: float, lead: int, bound: float, fastest: float, reach: float
) -> float:
    """Return a step in which an event function stays positive; none: it is zero now.

    The first `lead` of value and slope are zero, for it has just begun.
    """
    if lead == 0:
        return safe_step(g, slope, bend, bound, reach) if g > 0.0 else 0.0
    if lead == 1:
        return safe_step(0.0, slope, bend, bound, reach)
    if abs(bend) * fastest < 1e-9 * bound:
        return min(reach, max(0.0, 2.0 * twist / (bound * fastest)))
    return safe_step(0.0, 0.0, bend, bound, reach)


@inner
def pulls(system: Any, work: Any) -> bool:
    """Tell whether friction has fallen along the path to a pull at the state at hand."""
    for c in range(system.contacts):
        if system.gradient[c] != 0.0 and load_of(system, c, place_of(system, work.q, c, work.f[0])) <= 0.0:
            return True
    return False


@inner
def after_event(system: Any, work: Any, slot: int, c: int, how: int, resting: FloatArray) -> int:
    """Change how contacts hold and slip after an event; return the next phase's slot."""
    for other in range(system.contacts):
        resting[other] = 1 if is_rigid(system, other) and work.side[other] == 0 else 0
        for which in range(3):
            work.lead[other, which] = 0
    if how == TURN_OF:
        return after_turn(system, work, c, resting)
    side = 1 if how == UPWARDS else -1
    if is_rigid(system, c):
        _, slope, bend, _ = event_function(system, work, slot, c, how)
        if slope >= 0.0 and bend > 0.0:  # it touches its limit and turns back
            work.lead[c, how] = 2 if slope == 0.0 else 1
            return slot
        resting[c] = side
        slot = settle(system, work, resting, c)
        work.lead[c, TURN_OF] = 2 if ratio_of(system, c, side > 0) == 1.0 else 1
        return slot
    threshold = work.upper[c] if side > 0 else work.lower[c]
    work.side[c] = side
    for i in range(system.first[c], system.first[c + 1]):
        late = side * (gives_way_at(system, work, c, i, float(side)) - threshold)
        if not work.slips[i] and late <= 1e-14 * abs(threshold):
            work.slips[i], work.slipped[i] = 1, 1
    return settle(system, work, resting, -1)


@inner
def settle_turns(system: Any, work: Any, resting: FloatArray) -> int:
    """Settle contacts that have come to rest; those that slip on begin at speed zero. Return the next phase's slot."""
    slot = settle(system, work, resting, -1)
    for c in range(system.contacts):
        if resting[c] and work.side[c] != 0:
            work.lead[c, TURN_OF] = 1
    return slot


@inner
def after_turn(system: Any, work: Any, c: int, resting: FloatArray) -> int:
    """Let what slips of a contact hold, if it can: its speed has come to zero; return the next phase's slot."""
    side = work.side[c]
    work.side[c] = 0
    if is_rigid(system, c):
        resting[c] = 1
    else:
        for i in range(system.first[c], system.first[c + 1]):
            if work.slips[i]:
                work.slips[i] = 0
                work.anchor[i] = anchor_of(system, c, i, place_of(system, work.q, c, work.f[0]), float(side))
        work.lead[c, UPWARDS if side > 0 else DOWNWARDS] = 2
    return settle_turns(system, work, resting)


@inner
def record(system: Any, work: Any, pieces: FloatArray, length: float) -> None:
    """Write a piece that has come to its end, if there is space, and count it."""
    at, n, contacts = work.count, system.masses, system.contacts
    work.count += 1
    if at >= len(pieces):
        return
    pieces[at, 0], pieces[at, 1] = work.tau, length
    for a in range(n):
        pieces[at, 2 + a], pieces[at, 2 + n + a] = work.q[a], work.v[a]
    for c in range(contacts):
        pieces[at, 2 + 2 * n + c] = work.kappa[c]
        pieces[at, 2 + 2 * n + contacts + c] = work.offset[c]
        pieces[at, 2 + 2 * n + 2 * contacts + c] = float(work.side[c])


@inner
def start_account(system: Any, work: Any, tangent: bool) -> None:
    """Begin to count and measure what a run does."""
    size = 2 * system.masses + system.sliders
    work.count, work.signature, work.path = 0, 0, 0.0
    for i in range(system.sliders):
        work.slipped[i] = work.slips[i] = 0
    for a in range(system.masses):
        work.high[a] = work.low[a] = work.q[a]
    if tangent:
        for a in range(size):
            for b in range(size):
                work.jacobian[a, b] = 1.0 if a == b else 0.0


@inner
def account_way(system: Any, work: Any) -> None:
    """Add the way slipped in a phase that has ended; widen the range of the masses."""
    for c in range(system.contacts):
        if work.side[c] != 0:
            work.path += abs(place_of(system, work.q, c, work.f[0]) - work.place[c])
    for a in range(system.masses):
        work.high[a], work.low[a] = max(work.high[a], work.q[a]), min(work.low[a], work.q[a])


@inner
def run(system: Any, work: Any, pieces: FloatArray, span: float, tangent: bool, fresh: bool) -> int:
    """Carry the state over a span (rad); return how that ended. The anchors of what slips follow their contact.

    The state is in `work`: `tau`, `q`, `v`, `anchor`; afterwards it is the end's. With `tangent` the derivative of
    the end by the start is in `work.jacobian`. One that is not `fresh` goes on where the last run ended.
    """
    contacts, sliders = system.contacts, system.sliders
    resting = work.resting
    work.until = work.tau + span
    if fresh:
        start_account(system, work, tangent)
    slot = begin(system, work, resting)
    idle, left = 0, EVENTS * (1 + contacts + sliders) * (1.0 + span / system.r)
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
        if idle > IDLE * (1 + contacts + sliders) or left < 0.0:
            return PULLS if pulls(system, work) else CHATTER
        work.signature = (work.signature * 31 + 3 * c + how + 1) % 1000000007
        base_at_time(system, work)
        if length == 0.0:
            modes_at(system, work, slot, 0.0)
        slot = cross(system, work, slot, c, how) if tangent else after_event(system, work, slot, c, how, resting)
    return PULLS if pulls(system, work) else -slot


@inner
def advance(system: Any, work: Any, pieces: FloatArray, slot: int, length: float, tangent: bool) -> None:
    """Carry the state at hand, and the derivative, over a piece of a phase; record it."""
    record(system, work, pieces, length)
    if tangent:
        flow_over(system, work, slot, length)
        carry_jacobian(system, work)
    modes_at(system, work, slot, length)
    for a in range(system.masses):
        work.q[a], work.v[a] = work.now_q[a], work.now_v[a]
    account_way(system, work)
    work.tau += length
    if system.harmonics == 0:
        shift_cubic(system.cubic, length)


@inner
def cross(system: Any, work: Any, slot: int, c: int, how: int) -> int:
    """Pass an event with the derivative, which jumps by the saltation matrix; return the next phase's slot."""
    n, size = system.masses, 2 * system.masses + system.sliders
    side = float(work.side[c])
    for i in range(system.sliders):
        work.slipping[i] = work.slips[i]
    event_shift(system, work, slot, c, how)
    accelerate(system, work, slot, 0)
    slot = after_event(system, work, slot, c, how, work.resting)
    for i in range(system.first[c], system.first[c + 1]):
        if work.slipping[i] and not work.slips[i]:
            anchor_row(system, work, c, i, side, 2 * n + i)
    for b in range(size):
        for a in range(n):
            work.jacobian[n + a, b] += (work.acceleration[1, a] - work.acceleration[0, a]) * work.shift[b]
    return slot


@inner
def shift_cubic(cubic: FloatArray, t: float) -> None:
    """Rewrite a polynomial about a later time."""
    c0, c1, c2, c3 = cubic[0], cubic[1], cubic[2], cubic[3]
    cubic[0] = c0 + t * (c1 + t * (c2 + t * c3))
    cubic[1] = c1 + t * (2.0 * c2 + 3.0 * t * c3)
    cubic[2] = c2 + 3.0 * t * c3


@inner
def follow_slip(system: Any, work: Any, tangent: bool) -> None:
    """Write the anchors of sliders that slip at the end of a run, and their rows of the derivative."""
    n = system.masses
    for c in range(system.contacts):
        for i in range(system.first[c], system.first[c + 1]):
            if work.slips[i]:
                work.anchor[i] = anchor_of(system, c, i, place_of(system, work.q, c, work.f[0]), float(work.side[c]))
                if tangent:
                    anchor_row(system, work, c, i, float(work.side[c]), 2 * n + i)


@inner
def anchor_row(system: Any, work: Any, c: int, i: int, side: float, row: int) -> None:
    """Write the derivative of the anchor of a slider that slips, which follows its contact."""
    share = 1.0 - side * system.strength[i] * system.gradient[c] / system.spring[i]
    for b in range(2 * system.masses + system.sliders):
        total = 0.0
        for a in range(system.masses):
            total += system.row[c, a] * work.jacobian[a, b]
        work.jacobian[row, b] = share * total


@inner
def carry_jacobian(system: Any, work: Any) -> None:
    """Multiply the derivative from the left by that of a phase."""
    n, contacts, jacobian = system.masses, system.contacts, work.jacobian
    column = work.form
    for b in range(2 * n + system.sliders):
        for a in range(2 * n):
            column[a] = jacobian[a, b]
        for c in range(contacts):
            column[2 * n + c] = offset_change(system, work, c, b)
        for a in range(2 * n):
            total = 0.0
            for k in range(2 * n + contacts):
                total += work.flow[a, k] * column[k]
            jacobian[a, b] = total


@inner
def offset_change(system: Any, work: Any, c: int, b: int) -> float:
    """Return what a contact's constant force changes by in a column of the derivative."""
    total = 0.0
    for i in range(system.first[c], system.first[c + 1]):
        if not work.slips[i]:
            total -= system.spring[i] * work.jacobian[2 * system.masses + i, b]
    return total


@inner
def event_shift(system: Any, work: Any, slot: int, c: int, how: int) -> None:
    """Write by how much an event comes earlier, for each column of the derivative; at the time of `modes_at`."""
    n, shift, form = system.masses, work.shift, work.form
    _, fall, _, _ = event_function(system, work, slot, c, how)
    held = is_rigid(system, c) and how != TURN_OF
    for b in range(2 * n + system.sliders):
        shift[b] = 0.0
    if fall == 0.0:
        return
    event_form(system, work, slot, c, how)
    for b in range(2 * n + system.sliders):
        for a in range(2 * n):
            shift[b] += form[a] * work.jacobian[a, b]
        if held:
            sign = -1.0 if how == UPWARDS else 1.0
            for other in range(system.contacts):
                change = offset_change(system, work, other, b) if work.kappa[other] != inf else 0.0
                for a in range(n):
                    shift[b] -= sign * work.phases.grip[slot, c, a] * system.row[other, a] * change
        elif how != TURN_OF:
            shift[b] += threshold_change(system, work, c, how, b)
        shift[b] /= fall


@inner
def event_form(system: Any, work: Any, slot: int, c: int, how: int) -> None:
    """Write the derivative of an event function by displacements and velocities."""
    n, form = system.masses, work.form
    for a in range(2 * n):
        form[a] = 0.0
    sign = float(work.side[c]) if how == TURN_OF else -1.0 if how == UPWARDS else 1.0
    held = is_rigid(system, c) and how != TURN_OF
    ratio = ratio_of(system, c, how == UPWARDS)
    for a in range(n):
        by_load = ratio * system.limit[c] * system.gradient[c] if held else sign
        form[n + a if how == TURN_OF else a] = by_load * system.row[c, a]
    if not held:
        return
    for b in range(n):
        grip = sign * work.phases.grip[slot, c, b]
        for a in range(n):
            form[a] -= grip * work.phases.stiffness[slot, b, a]
            form[n + a] -= grip * system.damping[b, a]


@inner
def threshold_change(system: Any, work: Any, c: int, how: int, b: int) -> float:
    """Return what the reserve of the slider that gives way changes by, by its anchor, in a column of the derivative."""
    side = 1.0 if how == UPWARDS else -1.0
    threshold = work.upper[c] if how == UPWARDS else work.lower[c]
    for i in range(system.first[c], system.first[c + 1]):
        if not work.slips[i] and gives_way_at(system, work, c, i, side) == threshold:
            limit = ratio_of(system, c, side > 0.0) * system.strength[i]
            share = system.spring[i] / (system.spring[i] - side * limit * system.gradient[c])
            return side * share * work.jacobian[2 * system.masses + i, b]
    return 0.0


def runner(systems: Any, works: Any, pieces: FloatArray, span: float, tangent: bool, fresh: bool) -> int:
    """`run`, of records that stand in arrays of length 1, called by its address: that keeps its code out of callers."""
    return run(systems[0], works[0], pieces, span, tangent, fresh)


def _runner() -> Any:
    real, system, work = (
        types.Array(kind, dims, "C")
        for kind, dims in ((types.float64, 2), (from_dtype(SYSTEM), 1), (from_dtype(WORK), 1))
    )
    return callback(runner, types.int64(system, work, real, types.float64, types.boolean, types.boolean))


RUNNER = _runner()
