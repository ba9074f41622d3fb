"""What is reported of a motion with an elastic contact: works, range, stops; and its states at any time."""

from math import inf, nan, pi

from frictionlab.simulator.elastic.events import carry_elastic
from frictionlab.simulator.elastic.layout import CONTACT, DERIVED, ELASTIC_PHASE, ElasticRoom, Sliders
from frictionlab.simulator.elastic.orbits import at_once_elastic, is_even_handed, search_elastic, verdict
from frictionlab.simulator.elastic.phases import stiffened
from frictionlab.simulator.elastic.settling import no_candidate, settle
from frictionlab.simulator.elastic.shooting import elastic_multiplier, span_of
from frictionlab.simulator.kernel.accounts import (
    begin_search,
    end_search,
    frame_work,
    most_looks,
    slide_range,
    slide_work,
)
from frictionlab.simulator.kernel.layout import (
    AMPLITUDE,
    BOTTOM,
    CLOSED_FORM,
    CLOSURE,
    COSTLY,
    CROSS,
    ENERGY,
    HIGH,
    LOW,
    MISS,
    MULTIPLIER,
    NOT_FOUND,
    OUTCOME,
    OVERFULL,
    PERIOD,
    PERIODIC,
    PHASES,
    ROW,
    SIGN,
    SPAN,
    START,
    START_V,
    START_Z,
    STOPS,
    STOPS_MADE,
    STUCK,
    STUCK_SHARE,
    STUCK_TIME,
    SYMMETRIC,
    TOP,
    TURN,
    TURNS,
    UNBOUNDED,
    VISCOUS,
    WORK,
    Buffer,
    Force,
    Leg,
    Rig,
    Room,
    State,
)
from frictionlab.simulator.kernel.motion import local_force, slide_at

__all__ = [
    "account_elastic",
    "evaluate_elastic",
    "fill_elastic_row",
    "is_mirrored",
    "steady_elastic",
    "steady_elastic_from",
    "tell_elastic",
]


def account_elastic(rig: Rig, force: Force, room: ElasticRoom) -> None:
    """Go through the recorded phases and add up what the event loop does not need: works, and range with the wall."""
    tally, phases = room.tally, room.phases
    moving = len(room.wall.cosine) > 0
    plain_room = Room(room.jacobian, tally, phases, room.wall, room.meter)
    tally[TOP], tally[BOTTOM] = (-inf, inf) if moving else (tally[HIGH], tally[LOW])
    for at in range(0, ELASTIC_PHASE * int(tally[PHASES]), ELASTIC_PHASE):
        tau, span = phases[at + 1], phases[at + 2]
        start = State(phases[at + 3], phases[at + 4], phases[at + 5])
        slide = stiffened(rig.plain, phases[at + 6])
        local_force(tau, force)
        local_force(tau, room.wall)
        slide_work(Rig(rig.contact, rig.plain, slide, slide), force, start, 1.0, span, tally)
        if moving:  # else it goes one way: both ends are known
            slide_range(slide, force, plain_room, start, 1.0, span)


def fill_elastic_row(rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom, row: Buffer) -> None:
    """Write the numbers of an orbit from the tally of one leg. Energy is the contact's force over the way."""
    tally = room.tally
    cycles = leg.span * leg.turns / TURN
    row[MULTIPLIER] = elastic_multiplier(sliders, room) ** (1.0 if leg.sign > 0.0 else 2.0)
    row[ENERGY] = (tally[CONTACT] + tally[VISCOUS]) / cycles
    row[CLOSURE] = abs(tally[WORK] / cycles - row[ENERGY])
    if rig.contact.frame != 0.0 and len(room.wall.cosine) == 0:
        row[ENERGY] += frame_work(rig, force, tally[CROSS], cycles)
    high, low = tally[TOP], tally[BOTTOM]
    row[AMPLITUDE] = max(high, -low) if leg.sign < 0.0 else 0.5 * max(0.0, high - low)
    row[STOPS] = tally[STOPS_MADE] / cycles
    row[STUCK_SHARE] = tally[STUCK_TIME] / (cycles * TURN)
    row[PERIOD] = leg.turns


def is_mirrored(rig: Rig, force: Force, leg: Leg, room: ElasticRoom) -> float:
    """Tell (1.0 or 0.0) whether the orbit just recorded is its own mirror image after half a cycle."""
    if leg.sign < 0.0:
        return 1.0
    if leg.turns > 1.0 or not is_even_handed(rig, force):
        return 0.0
    phases = room.phases
    for at in range(0, ELASTIC_PHASE * int(room.tally[PHASES]), ELASTIC_PHASE):
        within = leg.tau + pi - phases[at + 1]
        if 0.0 <= within <= phases[at + 2]:
            local_force(phases[at + 1], force)
            start = State(phases[at + 3], phases[at + 4], phases[at + 5])
            way, v, _ = slide_at(within, stiffened(rig.plain, phases[at + 6]), force, start)
            miss = abs(start.z + way + room.start[0]) + rig.plain.r * abs(v + room.start[1])
            return 1.0 if miss <= 1e-9 * span_of(rig, room) else 0.0
    return 0.0


def tell_elastic(
    rig: Rig, sliders: Sliders, force: Force, found: tuple[int, Leg, float], room: ElasticRoom, row: Buffer
) -> None:
    """Fill `row` with what is known of an orbit that was found, from outcome, leg and miss."""
    outcome, leg, miss = found
    for i in range(ROW):
        row[i] = nan
    row[OUTCOME], row[MISS], row[CLOSED_FORM] = outcome, miss, 0.0
    row[START], row[SPAN], row[TURNS], row[SIGN] = leg.tau, leg.span, leg.turns, leg.sign
    row[START_Z], row[START_V] = room.start[0], room.start[1]
    if outcome == UNBOUNDED or outcome >= NOT_FOUND:
        return
    if outcome == STUCK:  # a search ends with the motion from the start that it found
        carry_elastic(rig, sliders, force, leg, room, DERIVED)
    if ELASTIC_PHASE * int(room.tally[PHASES]) > len(room.phases):
        row[OUTCOME] = OVERFULL
        return
    account_elastic(rig, force, room)
    fill_elastic_row(rig, sliders, force, leg, room, row)
    row[SYMMETRIC] = is_mirrored(rig, force, leg, room)
    if outcome == STUCK:
        row[STOPS], row[STUCK_SHARE] = 0.0, 1.0
        row[ENERGY] -= room.tally[CONTACT]  # springs keep nothing: what is left of it is rounding
    elif row[CLOSURE] > 1e-3 * row[ENERGY] + 1e-10 * rig.plain.rate * row[AMPLITUDE]:  # repeats, yet is no orbit
        row[OUTCOME] = NOT_FOUND
        for i in range(ENERGY, CLOSURE + 1):
            row[i] = nan


def steady_elastic(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom, row: Buffer) -> None:
    """Fill `row` with the steady state's numbers; its phases are left in the record, from a leg's start to its end."""
    outcome, leg, miss = at_once_elastic(rig, sliders, force, room), Leg(0.0, TURN, 1.0, 1.0), 0.0
    most = most_looks(rig, force)
    given = begin_search(most, room.meter)
    may_slip = outcome == STUCK and max(rig.contact.static_up, rig.contact.static_down) > 1.0
    if outcome == PERIODIC or may_slip:  # with break-away rest may settle on a motion beside the one that never slips
        leg, miss, code = search_elastic(rig, sliders, force, room)
        outcome = verdict(rig, room, miss, code)
    costly, left = end_search(most, given, room.meter)
    slipping = 0.0
    for i in range(len(sliders.force)):
        slipping += sliders.slips[i]
    if may_slip and (costly or outcome != PERIODIC or slipping == 0.0):
        outcome, leg, miss, costly = at_once_elastic(rig, sliders, force, room), Leg(0.0, TURN, 1.0, 1.0), 0.0, False
    tell_elastic(rig, sliders, force, (COSTLY if costly else outcome, leg, miss), room, row)
    room.meter[0] = left


def steady_elastic_from(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom, row: Buffer) -> None:
    """As `steady_elastic`, of the orbit that the motion from the room's start settles on."""
    most = most_looks(rig, force)
    given = begin_search(most, room.meter)
    leg, miss, code = settle(rig, sliders, force, 0.0, no_candidate(), room)
    outcome = verdict(rig, room, miss, code)
    costly, left = end_search(most, given, room.meter)
    tell_elastic(rig, sliders, force, (COSTLY if costly else outcome, leg, miss), room, row)
    room.meter[0] = left
    slipping = 0.0
    for i in range(min(int(room.tally[PHASES]), len(room.phases) // ELASTIC_PHASE)):
        slipping += room.phases[ELASTIC_PHASE * i]
    if row[OUTCOME] == PERIODIC and slipping == 0.0:
        tell_elastic(rig, sliders, force, (STUCK, leg, miss), room, row)


def evaluate_elastic(rig: Rig, force: Force, phases: Buffer, within: Buffer, states: Buffer) -> None:
    """Fill `states` with z, v and the sliders' force at times `within` the phases given one by one."""
    for i in range(len(within)):
        at = ELASTIC_PHASE * i
        start, stiffness = State(phases[at + 3], phases[at + 4], phases[at + 5]), phases[at + 6]
        local_force(phases[at + 1], force)
        way, v, _ = slide_at(within[i], stiffened(rig.plain, stiffness), force, start)
        states[3 * i], states[3 * i + 1] = start.z + way, v
        states[3 * i + 2] = phases[at + 7] + (stiffness - 1.0) * way
