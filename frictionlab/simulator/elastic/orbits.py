"""What repeats: the outcome that needs no search, and the orbit that rest settles on."""

from math import atan2, hypot, inf, pi

from frictionlab.simulator.elastic.holding import never_slips, start_at_rest
from frictionlab.simulator.elastic.layout import (
    ELASTIC_PHASE,
    FREE,
    OUTER,
    PULLED,
    SLIDING,
    ElasticRoom,
    Sliders,
)
from frictionlab.simulator.elastic.shooting import (
    elastic_multiplier,
    follow,
    shoot_elastic,
    span_of,
)
from frictionlab.simulator.kernel.continuous import continuous_state, damped_turn, den_hartog
from frictionlab.simulator.kernel.layout import (
    CHATTERED,
    DONE,
    NOT_FOUND,
    PERIODIC,
    PHASES,
    PULLING,
    RUNAWAY,
    STUCK,
    TURN,
    UNBOUNDED,
    Force,
    Leg,
    Rig,
)
from frictionlab.simulator.kernel.motion import gap
from frictionlab.simulator.kernel.shooting import symmetric_force

__all__ = [
    "apart",
    "at_once_elastic",
    "best_section",
    "from_rest",
    "is_even_handed",
    "resonates",
    "search_elastic",
    "settle",
    "spread",
    "start_from",
    "start_sliding",
    "verdict",
]

LONGEST_ORBIT = 8  # cycles of the longest orbit looked for
ENOUGH_STEPS = 200.0  # Newton steps to the only orbit
NEAR_STEPS = 8.0  # Newton steps to one of several
CYCLES_WAITED = 1024  # for an orbit where several may exist
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
    """Run from rest for two cycles; leave the state at the best section in the room's start, return the leg from it."""
    start_at_rest(sliders, room)
    code = follow(rig, sliders, force, leg, 4.0 if leg.sign < 0.0 else 2.0, room)
    section = best_section(room, leg)
    if code == DONE:
        code = follow(rig, sliders, force, Leg(leg.tau, section - leg.tau, 1.0, 1.0), 1.0, room)
    for i in range(len(sliders.force)):  # so short a leg does not tell which sliders never slip
        room.kinds[i] = FREE if room.kinds[i] == OUTER else room.kinds[i]
    return Leg(section, leg.span, leg.turns, leg.sign), code


def start_sliding(rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom) -> tuple[Leg, bool]:
    """Start on Den Hartog's orbit of the rigid contact, halfway between its turns; False where there is none."""
    if len(force.cosine) > 1 or rig.plain.zeta >= 1.0 or rig.contact.beta == 0.0:
        return leg, False
    size = hypot(force.cosine[0], force.sine[0])
    beta = rig.contact.beta / size
    _, phase = den_hartog(rig.plain.r, beta) if rig.plain.zeta == 0.0 else damped_turn(rig, beta)
    tau = (phase + atan2(force.sine[0], force.cosine[0]) + 0.5 * pi) % TURN
    amplitude, z, v = continuous_state(rig, force, tau)
    room.start[0], room.start[1] = z, v
    load, side = 1.0 + rig.contact.gradient * z, 1.0 if v > 0.0 else -1.0
    for i in range(len(sliders.force)):
        room.start[2 + 2 * i], room.start[3 + 2 * i] = side * sliders.strength[i] * load, side
        room.kinds[i] = SLIDING
        if amplitude * sliders.stiffness[i] < 3.0 * sliders.strength[i]:
            return leg, False
    return Leg(tau, leg.span, leg.turns, leg.sign), load > 0.0


def spread(rig: Rig, room: ElasticRoom, miss: float) -> bool:
    """Tell whether a miss is nothing but rounding."""
    return miss <= 1e-12 * span_of(rig, room) + 1e-14 * rig.plain.rate


def search_elastic(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return leg, miss and code of the orbit that a search from Den Hartog's, else from rest, comes down to.

    Without break-away and gradient there is only one. Where friction varies along the path it may be unstable: then,
    and with break-away, the orbit that the motion from rest settles on is looked for.
    """
    leg = Leg(0.0, pi, 1.0, -1.0) if is_even_handed(rig, force) else Leg(0.0, TURN, 1.0, 1.0)
    if max(rig.contact.static_up, rig.contact.static_down) > 1.0:
        return settle(rig, sliders, force, room)
    ahead, there = start_sliding(rig, sliders, force, leg, room)
    miss, code = inf, DONE
    if there:
        miss, code = shoot_elastic(rig, sliders, force, ahead, room, NEAR_STEPS)
    if code != DONE or not spread(rig, room, miss):
        ahead, code = from_rest(rig, sliders, force, leg, room)
        if code == DONE:
            miss, code = shoot_elastic(rig, sliders, force, ahead, room, ENOUGH_STEPS)
    if rig.contact.gradient == 0.0 or (
        code == DONE and spread(rig, room, miss) and abs(elastic_multiplier(sliders, room)) <= 1.0 + 1e-9
    ):
        return ahead, miss, code
    return settle(rig, sliders, force, room)


def settle(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return the orbit of up to LONGEST_ORBIT cycles that the motion from rest settles on, if it is stable.

    The motion is waited for until it nearly repeats, and Newton finishes it; only an orbit close by is taken.
    """
    leg, waited, wait, size = Leg(0.0, TURN, 1.0, 1.0), 0.0, 16.0, 2 + 2 * len(sliders.force)
    past, now = [0.0] * (2 * LONGEST_ORBIT), [0.0] * size
    start_at_rest(sliders, room)
    while wait <= CYCLES_WAITED:
        code = follow(rig, sliders, force, leg, wait - waited - LONGEST_ORBIT, room)
        for k in range(LONGEST_ORBIT):
            past[2 * k], past[2 * k + 1] = room.start[0], room.start[1]
            if code == DONE:
                code = follow(rig, sliders, force, leg, 1.0, room)
        if code != DONE:
            return leg, inf, code
        extent = span_of(rig, room)
        for i in range(size):
            now[i] = room.start[i]
        for k in range(LONGEST_ORBIT - 1, -1, -1):
            if apart(rig, now, past[2 * k], past[2 * k + 1]) > 0.01 * extent:
                continue
            start_from(now, room)
            trial = Leg(0.0, TURN, float(LONGEST_ORBIT - k), 1.0)
            miss, code = shoot_elastic(rig, sliders, force, trial, room, NEAR_STEPS)
            near = apart(rig, now, room.start[0], room.start[1]) < 0.1 * extent and spread(rig, room, miss)
            if code == DONE and near and abs(elastic_multiplier(sliders, room)) <= 1.0 + 1e-9:
                return trial, miss, DONE
        start_from(now, room)
        waited, wait = wait, 2.0 * wait
        if wait * room.tally[PHASES] > PHASES_WAITED:
            break
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
    if code != DONE:
        return CHATTERED
    return PERIODIC if miss <= 1e-9 * span_of(rig, room) + 1e-14 * rig.plain.rate else NOT_FOUND
