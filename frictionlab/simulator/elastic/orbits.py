"""What repeats: the outcome that needs no search, the orbit that rest settles on, and what is reported of it."""

from math import pi

from frictionlab.simulator.elastic.events import carry_elastic
from frictionlab.simulator.elastic.layout import ElasticRoom, Sliders
from frictionlab.simulator.elastic.settling import NEAR_STEPS, is_stable, settle
from frictionlab.simulator.elastic.shooting import (
    elastic_multiplier,
    keeps_some,
    shoot_elastic,
    span_of,
    spread,
    unstrain,
)
from frictionlab.simulator.elastic.starts import NEARLY, never_slips, start_at_rest, start_balanced, start_held
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.accounts import (
    account,
    begin_row,
    begin_search,
    end_search,
    fill_row,
    fits,
    mirrored,
    most_looks,
    strike_if_open,
)
from frictionlab.simulator.kernel.layout import TURN, Buffer, Force, Leg, Rig, Room
from frictionlab.simulator.kernel.outlook import grows, is_symmetric

FAIR = 7.0  # cycles in place of Newton steps, after which another start is tried
LARGELY = 1.5  # times what its sliders can hold: so much more, and a contact is not like one that holds
ENOUGH_STEPS = 200.0  # Newton steps to the only orbit


def only_elastic(rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return leg, miss and code of the only orbit, from as near a start as can be had cheaply."""
    ahead, near = leg, False
    if len(force.cosine) > 1:
        ahead, near = start_held(rig, sliders, force, leg, room, NEARLY)
    if not near:
        ahead = start_balanced(rig, sliders, force, leg, room)
    miss, code = shoot_elastic(rig, sliders, force, ahead, room, ENOUGH_STEPS, FAIR)
    if code == layout.DONE and not spread(rig, room, miss):
        if len(force.cosine) > 1 and not near:
            other, near = start_held(rig, sliders, force, leg, room, LARGELY)
            ahead = other if near else ahead
        miss, code = shoot_elastic(rig, sliders, force, ahead, room, ENOUGH_STEPS, layout.PATIENT)
    return ahead, miss, code


def search_elastic(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return leg, miss and code of the orbit that a search comes down to.

    Without break-away and gradient there is only one. Where friction varies along the path it may be unstable: then,
    and with break-away, the orbit that the motion from rest settles on is looked for. With a gradient it matters what
    is held by sliders that never slip: it is what the motion from rest leaves in them.
    """
    leg = Leg(0.0, pi, 1.0, -1.0) if is_symmetric(rig, force) else Leg(0.0, TURN, 1.0, 1.0)
    if max(rig.contact.static_up, rig.contact.static_down) == 1.0:
        ahead, miss, code = only_elastic(rig, sliders, force, leg, room)
        if rig.contact.gradient == 0.0:
            if code == layout.DONE and spread(rig, room, miss) and unstrain(rig, sliders, ahead, room):
                miss, code = shoot_elastic(rig, sliders, force, ahead, room, NEAR_STEPS, layout.PATIENT)
            return ahead, miss, code
        if is_stable(rig, sliders, room, miss, code) and not keeps_some(sliders, ahead):
            return ahead, miss, code
    start_at_rest(sliders, room)
    return settle(rig, sliders, force, room)


def at_once_elastic(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> int:
    """Return the outcome that needs no search: RUNAWAY, UNBOUNDED or STUCK; PERIODIC: an orbit is to be found."""
    if abs(rig.contact.beta * rig.contact.gradient) >= 1.0:
        return layout.RUNAWAY
    if grows(rig, force):
        return layout.UNBOUNDED
    return layout.STUCK if never_slips(rig, sliders, force, room) else layout.PERIODIC


def verdict(rig: Rig, room: ElasticRoom, miss: float, code: int) -> int:
    """Return the outcome of a search."""
    if code == layout.PULLED:
        return layout.PULLING
    if code == layout.WANDERS:
        return layout.PARTING
    if code != layout.DONE:
        return layout.CHATTERED
    return layout.PERIODIC if miss <= 1e-9 * span_of(rig, room) + 1e-14 * rig.plain.rate else layout.NOT_FOUND


def plain_room(room: ElasticRoom) -> Room:
    """Return what of the buffers every contact has."""
    return Room(room.jacobian, room.tally, room.phases, room.wall, room.meter)


def report(rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom, row: Buffer) -> None:
    """Write the numbers of the motion just recorded over a leg."""
    record = plain_room(room)
    account(rig, force, record)
    fill_row(rig, force, leg, record, elastic_multiplier(sliders, room), row)
    whole = leg.turns == 1.0 and is_symmetric(rig, force)
    row[layout.SYMMETRIC] = 1.0 if leg.sign < 0.0 else mirrored(rig, force, record) if whole else 0.0


def tell_elastic(
    rig: Rig, sliders: Sliders, force: Force, found: tuple[int, Leg, float], room: ElasticRoom, row: Buffer
) -> None:
    """Fill `row` with what is known of an orbit that was found, from outcome, leg and miss."""
    outcome, leg, miss = found
    if not begin_row(outcome, leg, room.start[0], room.start[1], miss, row):
        return
    if outcome == layout.STUCK:  # a search ends with the motion from the start that it found
        carry_elastic(rig, sliders, force, leg, room, layout.DERIVED)
    if not fits(plain_room(room), row):
        return
    report(rig, sliders, force, leg, room, row)
    if outcome == layout.STUCK:
        row[layout.STOPS], row[layout.STUCK_SHARE] = 0.0, 1.0
        row[layout.ENERGY] -= room.tally[layout.CONTACT]  # springs keep nothing: what is left of it is rounding
    else:
        strike_if_open(rig, row)


def steady_elastic(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom, row: Buffer) -> None:
    """Fill `row` with the steady state's numbers; its phases are left in the record, from a leg's start to its end."""
    outcome, leg, miss = at_once_elastic(rig, sliders, force, room), Leg(0.0, TURN, 1.0, 1.0), 0.0
    most = most_looks(rig, force)
    given = begin_search(most, room.meter)
    may_slip = outcome == layout.STUCK and max(rig.contact.static_up, rig.contact.static_down) > 1.0
    if (
        outcome == layout.PERIODIC or may_slip
    ):  # with break-away rest may settle on a motion beside the one that never slips
        leg, miss, code = search_elastic(rig, sliders, force, room)
        outcome = verdict(rig, room, miss, code)
    costly, left = end_search(most, given, room.meter)
    slipping = 0.0
    for i in range(len(sliders.force)):
        slipping += sliders.slips[i]
    if may_slip and (costly or outcome != layout.PERIODIC or slipping == 0.0):
        outcome, leg, miss, costly = at_once_elastic(rig, sliders, force, room), Leg(0.0, TURN, 1.0, 1.0), 0.0, False
    tell_elastic(rig, sliders, force, (layout.COSTLY if costly else outcome, leg, miss), room, row)
    room.meter[0] = left


def steady_elastic_from(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom, row: Buffer) -> None:
    """As `steady_elastic`, of the orbit that the motion from the room's start settles on."""
    most = most_looks(rig, force)
    given = begin_search(most, room.meter)
    leg, miss, code = settle(rig, sliders, force, room)
    outcome = verdict(rig, room, miss, code)
    costly, left = end_search(most, given, room.meter)
    tell_elastic(rig, sliders, force, (layout.COSTLY if costly else outcome, leg, miss), room, row)
    room.meter[0] = left
    slipping = 0.0
    for i in range(min(int(room.tally[layout.PHASES]), len(room.phases) // layout.PHASE)):
        slipping += room.phases[layout.PHASE * i]
    if row[layout.OUTCOME] == layout.PERIODIC and slipping == 0.0:
        tell_elastic(rig, sliders, force, (layout.STUCK, leg, miss), room, row)
