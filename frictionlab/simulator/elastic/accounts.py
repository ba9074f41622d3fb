"""What is reported of a motion with an elastic contact: works, range, stops; and its states at any time."""

from frictionlab.simulator.elastic.events import carry_elastic
from frictionlab.simulator.elastic.layout import ElasticRoom, Sliders
from frictionlab.simulator.elastic.orbits import at_once_elastic, search_elastic, verdict
from frictionlab.simulator.elastic.settling import no_candidate, settle
from frictionlab.simulator.elastic.shooting import elastic_multiplier
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
from frictionlab.simulator.kernel.outlook import is_symmetric


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
    leg, miss, code = settle(rig, sliders, force, 0.0, no_candidate(), room)
    outcome = verdict(rig, room, miss, code)
    costly, left = end_search(most, given, room.meter)
    tell_elastic(rig, sliders, force, (layout.COSTLY if costly else outcome, leg, miss), room, row)
    room.meter[0] = left
    slipping = 0.0
    for i in range(min(int(room.tally[layout.PHASES]), len(room.phases) // layout.PHASE)):
        slipping += room.phases[layout.PHASE * i]
    if row[layout.OUTCOME] == layout.PERIODIC and slipping == 0.0:
        tell_elastic(rig, sliders, force, (layout.STUCK, leg, miss), room, row)
