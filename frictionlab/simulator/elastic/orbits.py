"""What repeats: the outcome that needs no search, and the orbit that rest settles on."""

from math import exp, hypot, inf, log, pi

from frictionlab.simulator.elastic.events import carry_elastic
from frictionlab.simulator.elastic.holding import never_slips, start_at_rest
from frictionlab.simulator.elastic.layout import DERIVED, HASTY, PATIENT, PLAIN, PULLED, ElasticRoom, Sliders
from frictionlab.simulator.elastic.residues import away, has_slipped_out, keeps_some, unstrain
from frictionlab.simulator.elastic.shooting import (
    distance,
    elastic_multiplier,
    follow,
    shoot_elastic,
    span_of,
    spread,
)
from frictionlab.simulator.elastic.starts import NEARLY, rings_often, start_balanced, start_held, start_rigid
from frictionlab.simulator.kernel.layout import (
    CHATTERED,
    DONE,
    NOT_FOUND,
    PARTING,
    PERIODIC,
    PHASES,
    PULLING,
    RUNAWAY,
    STUCK,
    TURN,
    UNBOUNDED,
    WANDERS,
    Force,
    Leg,
    Rig,
)
from frictionlab.simulator.kernel.motion import gap
from frictionlab.simulator.kernel.shooting import symmetric_force

__all__ = [
    "any_stable",
    "apart",
    "at_once_elastic",
    "fewest",
    "from_rest",
    "growth_of_distance",
    "is_even_handed",
    "is_stable",
    "only_elastic",
    "resonates",
    "search_elastic",
    "settle",
    "start_from",
    "verdict",
]

LONGEST_ORBIT = 128  # cycles of the longest orbit looked for
NEARER = 0.5  # an orbit of more cycles is tried if the motion comes so much nearer to itself after them
SHORT_ORBIT = 8  # cycles of an orbit that Newton may finish; a longer one must have closed already
LIKELY_ORBIT = 2  # cycles of an orbit that Newton may find from afar
NEAR_STEPS = 8.0  # Newton steps to one of several
LONGEST_WAIT = 256.0  # cycles from rest until no slider that never slips in the orbit can slip any more
FAIR = 7.0  # cycles in place of Newton steps, after which another start is tried
LARGELY = 1.5  # times what its sliders can hold: so much more, and a contact is not like one that holds
ENOUGH_STEPS = 200.0  # Newton steps to the only orbit
CYCLES_WAITED = 1024  # for an orbit where several may exist
PARTED = 1.02  # growth of the distance in a cycle from which motions move apart
CYCLES_COMPARED = 200.0
UNDECIDED = 0.9  # growth from which the two are compared for longer: a stable orbit's neighbours come nearer
CYCLES_UNDECIDED = 2000.0
PARTED_SLOWLY = 1.01  # over that many cycles; what parts by a power of time, not exponentially, grows by less
PHASES_WAITED = 1e5  # the same, where a cycle has many


def start_from(state: list[float], room: ElasticRoom) -> None:
    """Start from a state that was kept."""
    for i in range(len(state)):
        room.start[i] = state[i]


def from_rest(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return leg, miss and code of the orbit that the motion from rest comes to, with what it leaves in its sliders.

    It is followed until what they hold is settled; Newton does the rest.
    """
    leg, cycles, waited, miss = Leg(0.0, TURN, 1.0, 1.0), 2.0, 2.0, inf
    now = [0.0] * (2 + 2 * len(sliders.force))
    start_at_rest(sliders, room)
    code = follow(rig, sliders, force, leg, cycles, room)
    while code == DONE:
        for i in range(len(now)):
            now[i] = room.start[i]
        miss, code = shoot_elastic(rig, sliders, force, leg, room, NEAR_STEPS, HASTY)
        settled = code == DONE and spread(rig, room, miss) and has_slipped_out(rig, sliders, leg, now, room)
        if settled or waited >= LONGEST_WAIT:
            break
        start_from(now, room)
        code = follow(rig, sliders, force, leg, cycles, room)
        waited += cycles
        cycles = waited
    return leg, miss, code


def only_elastic(rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return leg, miss and code of the only orbit, from as near a start as can be had cheaply."""
    ahead, near = leg, False
    if len(force.cosine) > 1:
        ahead, near = start_held(rig, sliders, force, leg, room, NEARLY)
    there = near
    if not there and rings_often(rig, sliders):
        ahead, there = start_rigid(rig, sliders, force, leg, room)
    if not there:
        ahead = start_balanced(rig, sliders, force, leg, room)
    miss, code = shoot_elastic(rig, sliders, force, ahead, room, ENOUGH_STEPS, FAIR)
    if code == DONE and not spread(rig, room, miss):
        if len(force.cosine) > 1 and not near:
            other, near = start_held(rig, sliders, force, leg, room, LARGELY)
            ahead = other if near else ahead
        miss, code = shoot_elastic(rig, sliders, force, ahead, room, ENOUGH_STEPS, PATIENT)
    return ahead, miss, code


def search_elastic(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return leg, miss and code of the orbit that a search comes down to.

    Without break-away and gradient there is only one. Where friction varies along the path it may be unstable: then,
    and with break-away, the orbit that the motion from rest settles on is looked for. With a gradient it matters what
    is held by sliders that never slip: it is what the motion from rest leaves in them.
    """
    leg = Leg(0.0, pi, 1.0, -1.0) if is_even_handed(rig, force) else Leg(0.0, TURN, 1.0, 1.0)
    if max(rig.contact.static_up, rig.contact.static_down) == 1.0:
        ahead, miss, code = only_elastic(rig, sliders, force, leg, room)
        if rig.contact.gradient == 0.0:
            if code == DONE and spread(rig, room, miss) and unstrain(rig, sliders, ahead, room):
                miss, code = shoot_elastic(rig, sliders, force, ahead, room, NEAR_STEPS, PATIENT)
            return ahead, miss, code
        if code == DONE and keeps_some(sliders, ahead):
            ahead, miss, code = from_rest(rig, sliders, force, room)
        if is_stable(rig, sliders, room, miss, code):
            return ahead, miss, code
    start_at_rest(sliders, room)
    return settle(rig, sliders, force, room)


def settle(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return the orbit of up to LONGEST_ORBIT cycles that the motion from the room's start settles on, if it is stable.

    The motion is waited for until it nearly repeats, and Newton finishes it; only an orbit close by is taken. Where it
    takes too long, a stable orbit that Newton comes to from there is.
    """
    leg, wait, size, passed = Leg(0.0, TURN, 1.0, 1.0), 4, 2 + 2 * len(sliders.force), 0.0
    past, now = [0.0] * (2 * LONGEST_ORBIT + 2), [0.0] * size
    for cycle in range(1, CYCLES_WAITED + 1):
        code = follow(rig, sliders, force, leg, 1.0, room)
        if code != DONE:
            return leg, inf, code
        at, extent = 2 * (cycle % (LONGEST_ORBIT + 1)), span_of(rig, room)
        past[at], past[at + 1] = room.start[0], room.start[1]
        passed += room.tally[PHASES]
        if cycle < wait and passed < PHASES_WAITED:
            continue
        wait *= 2
        for i in range(size):
            now[i] = room.start[i]
        nearest = inf
        for k in range(1, min(LONGEST_ORBIT, cycle) + 1):
            old = 2 * ((cycle - k) % (LONGEST_ORBIT + 1))
            near = (0.01 if cycle >= 16 else 0.001) if k <= SHORT_ORBIT else 1e-6
            gone = apart(rig, now, past[old], past[old + 1])
            if gone > near * extent or gone > NEARER * nearest:
                continue
            nearest = gone
            start_from(now, room)
            trial = Leg(0.0, TURN, float(k), 1.0)
            miss, code = shoot_elastic(rig, sliders, force, trial, room, NEAR_STEPS, HASTY)
            close = apart(rig, now, room.start[0], room.start[1]) < 0.1 * extent
            if close and is_stable(rig, sliders, room, miss, code):
                return fewest(rig, sliders, force, trial, miss, room)
        start_from(now, room)
        if passed >= PHASES_WAITED:
            break
    growth, parts = growth_of_distance(rig, sliders, force, now, room)
    if parts:
        return leg, growth, WANDERS
    return any_stable(rig, sliders, force, now, room)


def growth_of_distance(
    rig: Rig, sliders: Sliders, force: Force, now: list[float], room: ElasticRoom
) -> tuple[float, bool]:
    """Return by what factor two motions close by move apart in a cycle, in the geometric mean, and whether they do.

    Both are carried; after each cycle the second is drawn close again, along the line between them. Where they hardly
    move apart over CYCLES_COMPARED, it is for CYCLES_UNDECIDED.
    """
    compared, least = CYCLES_COMPARED, PARTED
    leg, size, grown, cycles = Leg(0.0, TURN, 1.0, 1.0), len(now), 0.0, 0.0
    first, second = [0.0] * size, [0.0] * size
    for i in range(size):
        first[i], second[i] = now[i], now[i]
    tiny = 1e-8 * (abs(now[0]) + rig.plain.rate)
    second[0] += tiny
    while cycles < compared:
        if cycles == CYCLES_COMPARED - 1.0 and UNDECIDED < exp(grown / cycles) <= PARTED:
            compared, least = CYCLES_UNDECIDED, PARTED_SLOWLY
        start_from(second, room)
        code = carry_elastic(rig, sliders, force, leg, room, PLAIN)
        for i in range(size):
            second[i] = room.image[i]
        start_from(first, room)
        if carry_elastic(rig, sliders, force, leg, room, PLAIN) != DONE or code != DONE:
            break
        for i in range(size):
            first[i] = room.image[i]
        start_from(first, room)
        gone = away(rig, sliders, second, room)
        if gone == 0.0:
            return 0.0, False
        share = tiny / gone
        grown -= log(share)
        cycles += 1.0
        for i in range(size):
            second[i] = first[i] + share * (second[i] - first[i])
        for i in range(len(sliders.force)):
            second[3 + 2 * i] = first[3 + 2 * i]
    growth = exp(grown / max(cycles, 1.0))
    return growth, growth > least


def fewest(
    rig: Rig, sliders: Sliders, force: Force, leg: Leg, miss: float, room: ElasticRoom
) -> tuple[Leg, float, int]:
    """Return the leg of fewest cycles after which the orbit at the room's start already repeats; carried last."""
    for turns in range(1, int(leg.turns)):
        if int(leg.turns) % turns == 0:
            part = Leg(leg.tau, leg.span, float(turns), leg.sign)
            code = carry_elastic(rig, sliders, force, part, room, DERIVED)
            less = distance(rig, sliders, room)
            if code == DONE and less <= 1e-9 * span_of(rig, room):
                return part, less, DONE
    if leg.turns > 1.0:
        carry_elastic(rig, sliders, force, leg, room, DERIVED)
    return leg, miss, DONE


def is_stable(rig: Rig, sliders: Sliders, room: ElasticRoom, miss: float, code: int) -> bool:
    """Tell whether a search has come to an orbit, and a stable one."""
    return code == DONE and spread(rig, room, miss) and abs(elastic_multiplier(sliders, room)) <= 1.0 + 1e-9


def any_stable(rig: Rig, sliders: Sliders, force: Force, now: list[float], room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return a stable orbit of few cycles to which Newton comes from a state, however far it lies."""
    leg = Leg(0.0, TURN, 1.0, 1.0)
    for turns in range(1, LIKELY_ORBIT + 1):
        start_from(now, room)
        follow(rig, sliders, force, leg, 1.0, room)  # what slips at the section is read from a cycle
        trial = Leg(0.0, TURN, float(turns), 1.0)
        miss, code = shoot_elastic(rig, sliders, force, trial, room, 4.0 * NEAR_STEPS, PATIENT)
        if is_stable(rig, sliders, room, miss, code):
            return trial, miss, code
    return leg, inf, DONE


def apart(rig: Rig, state: list[float], z: float, v: float) -> float:
    """Return how far a state of the mass is from z, v."""
    return hypot(state[0] - z, rig.plain.r * (state[1] - v))


def resonates(rig: Rig, force: Force) -> bool:
    """Tell whether a harmonic drives the slipping, undamped mass exactly at resonance harder than friction brakes."""
    for i in range(len(force.cosine)):
        drive = 0.25 * pi * hypot(force.cosine[i], force.sine[i])
        if rig.plain.zeta == 0.0 and gap(rig.plain.r, i + 1.0) == 0.0 and rig.contact.beta < drive:
            return rig.contact.gradient == 0.0
    return False


def is_even_handed(rig: Rig, force: Force) -> bool:
    """Tell whether the mirror image of a motion, half a cycle later, is a motion too."""
    alike = rig.contact.static_up == rig.contact.static_down and rig.contact.gradient == 0.0
    return alike and symmetric_force(force)


def at_once_elastic(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> int:
    """Return the outcome that needs no search: RUNAWAY, UNBOUNDED or STUCK; PERIODIC: an orbit is to be found."""
    if abs(rig.contact.beta * rig.contact.gradient) >= 1.0:
        return RUNAWAY
    if resonates(rig, force):
        return UNBOUNDED
    return STUCK if never_slips(rig, sliders, force, room) else PERIODIC


def verdict(rig: Rig, room: ElasticRoom, miss: float, code: int) -> int:
    """Return the outcome of a search."""
    if code == PULLED:
        return PULLING
    if code == WANDERS:
        return PARTING
    if code != DONE:
        return CHATTERED
    return PERIODIC if miss <= 1e-9 * span_of(rig, room) + 1e-14 * rig.plain.rate else NOT_FOUND
