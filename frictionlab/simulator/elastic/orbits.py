"""What repeats: the outcome that needs no search, and the orbit that rest settles on."""

from math import exp, hypot, inf, log, pi, sqrt

from frictionlab.simulator.elastic.events import carry_elastic
from frictionlab.simulator.elastic.holding import never_slips, start_at_rest
from frictionlab.simulator.elastic.layout import (
    ELASTIC_PHASE,
    FREE,
    HASTY,
    OUTER,
    PATIENT,
    PULLED,
    SLIDING,
    ElasticRoom,
    Sliders,
)
from frictionlab.simulator.elastic.shooting import (
    back_to_start,
    classify,
    distance,
    elastic_multiplier,
    follow,
    shoot_elastic,
    span_of,
)
from frictionlab.simulator.kernel.events import carry
from frictionlab.simulator.kernel.layout import (
    CHATTERED,
    DONE,
    HIGH,
    LOW,
    NOT_FOUND,
    PARTING,
    PATH,
    PERIODIC,
    PHASE,
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
    Room,
    State,
)
from frictionlab.simulator.kernel.motion import gap, local_force, slide_at
from frictionlab.simulator.kernel.orbits import only_orbit
from frictionlab.simulator.kernel.shooting import symmetric_force

__all__ = [
    "any_stable",
    "apart",
    "at_once_elastic",
    "best_section",
    "fewest",
    "from_rest",
    "growth_of_distance",
    "is_even_handed",
    "is_stable",
    "resonates",
    "search_elastic",
    "settle",
    "spread",
    "start_from",
    "start_rigid",
    "verdict",
]

RIGID_SHARE = 0.2  # of what a search may cost, to find the rigid contact's orbit
YIELDING = 3.0  # times a slider's own yield: a motion that small is not like the rigid contact's
RESIDUES_WAITED = 64.0  # cycles until what sliders that never slip hold no longer changes
LONGEST_ORBIT = 128  # cycles of the longest orbit looked for
SHORT_ORBIT = 8  # cycles of an orbit that Newton may finish; a longer one must have closed already
LIKELY_ORBIT = 2  # cycles of an orbit that Newton may find from afar
ENOUGH_STEPS = 200.0  # Newton steps to the only orbit
NEAR_STEPS = 8.0  # Newton steps to one of several
CYCLES_WAITED = 1024  # for an orbit where several may exist
PARTED = 1.02  # growth of the distance in a cycle from which motions move apart
CYCLES_COMPARED = 200.0
PHASES_WAITED = 1e5  # the same, where a cycle has many


def best_section(room: ElasticRoom, leg: Leg) -> float:
    """Return the phase of the drive at which most sliders slip: there the fewest of their forces are unknown."""
    phases, most, longest, section = room.phases, 0.0, 0.0, leg.tau
    recorded = min(int(room.tally[PHASES]), len(phases) // ELASTIC_PHASE)
    for i in range(recorded):
        at = ELASTIC_PHASE * i
        if phases[at] > most or (phases[at] == most > 0.0 and phases[at + 2] > longest):
            most, longest, section = phases[at], phases[at + 2], phases[at + 1] + 0.5 * phases[at + 2]
    return section


def from_rest(rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom) -> tuple[Leg, int]:
    """Run from rest for two cycles; leave the state at the best section in the room's start, return the leg from it.

    Sliders that never slip in the orbit keep what the way to it leaves in them: where that is not relaxed at z = 0, as
    in a mirrored leg, and there are several, the motion is followed until it repeats.
    """
    start_at_rest(sliders, room)
    code = follow(rig, sliders, force, leg, 4.0 if leg.sign < 0.0 else 2.0, room)
    waited = 0.0 if leg.sign < 0.0 or len(sliders.force) == 1 else RESIDUES_WAITED
    while code == DONE and waited > 0.0:
        code = carry_elastic(rig, sliders, force, leg, room)
        near = distance(rig, sliders, room) <= 1e-9 * span_of(rig, room)
        classify(sliders, room)
        back_to_start(rig, sliders, leg, room)
        waited = 0.0 if near else waited - 1.0
    section = best_section(room, leg)
    ahead = Leg(section, leg.span, leg.turns, leg.sign)
    if code == DONE:
        code = follow(rig, sliders, force, Leg(leg.tau, section - leg.tau, 1.0, 1.0), 1.0, room)
    for i in range(len(sliders.force)):  # so short a leg does not tell which sliders never slip
        room.kinds[i] = FREE if room.kinds[i] == OUTER else room.kinds[i]
    if code == DONE and leg.sign > 0.0 and len(sliders.force) > 1:
        code = follow(rig, sliders, force, ahead, 1.0, room)
    return ahead, code


def start_rigid(rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom) -> tuple[Leg, bool]:
    """Start on the orbit of the rigid contact, in the middle of its longest slide; False where it is of no help."""
    plain, phases, beta = (
        Room(room.jacobian, room.tally, room.phases, room.wall, room.meter),
        room.phases,
        rig.contact.beta,
    )
    if beta == 0.0:
        return leg, False
    left = room.meter[0]  # of which a part may be spent here
    room.meter[0] = RIGID_SHARE * left
    own, z, v, _, code = only_orbit(rig, force, plain)
    room.meter[0] += left - RIGID_SHARE * left if left < inf else 0.0
    if code != DONE or room.tally[PATH] == 0.0:
        return leg, False
    carry(rig, force, own, z, v, plain)
    longest, at = 0.0, 0
    for i in range(0, PHASE * min(int(room.tally[PHASES]), len(phases) // PHASE), PHASE):
        if phases[i] != 0.0 and phases[i + 2] > longest:
            longest, at = phases[i + 2], i
    side, tau = phases[at], phases[at + 1]
    local_force(tau, force)
    start, slide = State(phases[at + 3], phases[at + 4], phases[at + 5]), rig.rising if side > 0.0 else rig.falling
    way, speed, _ = slide_at(0.5 * longest, slide, force, start)
    moved = 0.5 * (room.tally[HIGH] - room.tally[LOW]) if own.sign > 0.0 else max(room.tally[HIGH], -room.tally[LOW])
    z = start.z + way
    room.start[0], room.start[1] = z, speed
    load = 1.0 + rig.contact.gradient * z
    for i in range(len(sliders.force)):
        room.start[2 + 2 * i], room.start[3 + 2 * i] = side * sliders.strength[i] * load, side
        room.kinds[i] = SLIDING
        if moved * sliders.stiffness[i] < YIELDING * sliders.strength[i]:
            return leg, False
    return Leg(tau + 0.5 * longest, leg.span, leg.turns, leg.sign), longest > 0.0 and load > 0.0


def spread(rig: Rig, room: ElasticRoom, miss: float) -> bool:
    """Tell whether a miss is nothing but rounding."""
    return miss <= 1e-12 * span_of(rig, room) + 1e-14 * rig.plain.rate


def search_elastic(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return leg, miss and code of the orbit that a search from the rigid contact's, else from rest, comes down to.

    Without break-away and gradient there is only one. Where friction varies along the path it may be unstable: then,
    and with break-away, the orbit that the motion from rest settles on is looked for.
    """
    leg = Leg(0.0, pi, 1.0, -1.0) if is_even_handed(rig, force) else Leg(0.0, TURN, 1.0, 1.0)
    if max(rig.contact.static_up, rig.contact.static_down) > 1.0:
        start_at_rest(sliders, room)
        return settle(rig, sliders, force, room)
    ahead, there, miss, code = leg, False, inf, DONE
    if leg.sign < 0.0 or len(sliders.force) == 1:  # else sliders that never slip keep what the way from rest leaves
        ahead, there = start_rigid(rig, sliders, force, leg, room)
    if there:
        miss, code = shoot_elastic(rig, sliders, force, ahead, room, NEAR_STEPS, HASTY)
    if code != DONE or not spread(rig, room, miss):
        ahead, code = from_rest(rig, sliders, force, leg, room)
        if code == DONE:
            miss, code = shoot_elastic(rig, sliders, force, ahead, room, ENOUGH_STEPS, PATIENT)
    if rig.contact.gradient == 0.0 or (
        code == DONE and spread(rig, room, miss) and abs(elastic_multiplier(sliders, room)) <= 1.0 + 1e-9
    ):
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
        for k in range(1, min(LONGEST_ORBIT, cycle) + 1):
            old = 2 * ((cycle - k) % (LONGEST_ORBIT + 1))
            near = (0.01 if cycle >= 16 else 0.001) if k <= SHORT_ORBIT else 1e-6
            if apart(rig, now, past[old], past[old + 1]) > near * extent:
                continue
            start_from(now, room)
            trial = Leg(0.0, TURN, float(k), 1.0)
            miss, code = shoot_elastic(rig, sliders, force, trial, room, NEAR_STEPS, PATIENT)
            close = apart(rig, now, room.start[0], room.start[1]) < 0.1 * extent
            if close and is_stable(rig, sliders, room, miss, code):
                return fewest(rig, sliders, force, trial, miss, room)
        start_from(now, room)
        if passed >= PHASES_WAITED:
            break
    growth = growth_of_distance(rig, sliders, force, now, room)
    if growth > PARTED:
        return leg, growth, WANDERS
    return any_stable(rig, sliders, force, now, room)


def growth_of_distance(rig: Rig, sliders: Sliders, force: Force, now: list[float], room: ElasticRoom) -> float:
    """Return by what factor two motions close by move apart in a cycle, in the geometric mean over CYCLES_COMPARED.

    Both are carried; after each cycle the second is drawn close again, along the line between them.
    """
    leg, size, grown, cycles = Leg(0.0, TURN, 1.0, 1.0), len(now), 0.0, 0.0
    first, second = [0.0] * size, [0.0] * size
    for i in range(size):
        first[i], second[i] = now[i], now[i]
    tiny = 1e-8 * (abs(now[0]) + rig.plain.rate)
    second[0] += tiny
    while cycles < CYCLES_COMPARED:
        start_from(second, room)
        code = carry_elastic(rig, sliders, force, leg, room)
        for i in range(size):
            second[i] = room.image[i]
        start_from(first, room)
        if carry_elastic(rig, sliders, force, leg, room) != DONE or code != DONE:
            break
        for i in range(size):
            first[i] = room.image[i]
        gone = (second[0] - first[0]) ** 2 + (rig.plain.r * (second[1] - first[1])) ** 2
        for i in range(len(sliders.force)):
            gone += (second[2 + 2 * i] - first[2 + 2 * i]) ** 2 / max(sliders.stiffness[i], 1e-300)
        if gone == 0.0:
            return 0.0
        share = tiny / sqrt(gone)
        grown -= log(share)
        cycles += 1.0
        for i in range(size):
            second[i] = first[i] + share * (second[i] - first[i])
        for i in range(len(sliders.force)):
            second[3 + 2 * i] = first[3 + 2 * i]
    return exp(grown / max(cycles, 1.0))


def fewest(
    rig: Rig, sliders: Sliders, force: Force, leg: Leg, miss: float, room: ElasticRoom
) -> tuple[Leg, float, int]:
    """Return the leg of fewest cycles after which the orbit at the room's start already repeats; carried last."""
    for turns in range(1, int(leg.turns)):
        if int(leg.turns) % turns == 0:
            part = Leg(leg.tau, leg.span, float(turns), leg.sign)
            code = carry_elastic(rig, sliders, force, part, room)
            less = distance(rig, sliders, room)
            if code == DONE and less <= 1e-9 * span_of(rig, room):
                return part, less, DONE
    if leg.turns > 1.0:
        carry_elastic(rig, sliders, force, leg, room)
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


def start_from(state: list[float], room: ElasticRoom) -> None:
    """Start from a state that was kept."""
    for i in range(len(state)):
        room.start[i] = state[i]


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
