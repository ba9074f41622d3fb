"""What repeats: the outcome that needs no search, and the orbit that rest settles on."""

from math import inf, pi

from frictionlab.simulator.elastic.events import carry_elastic
from frictionlab.simulator.elastic.holding import never_slips, start_at_rest
from frictionlab.simulator.elastic.layout import ElasticRoom, Sliders
from frictionlab.simulator.elastic.residues import keeps_some, unstrain
from frictionlab.simulator.elastic.settling import NEAR_STEPS, candidate_of, is_stable, no_candidate, settle
from frictionlab.simulator.elastic.shooting import back_to_start, shoot_elastic, span_of, spread
from frictionlab.simulator.elastic.starts import NEARLY, start_balanced, start_held
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.layout import TURN, Force, Leg, Rig
from frictionlab.simulator.kernel.outlook import grows, is_symmetric

FAIR = 7.0  # cycles in place of Newton steps, after which another start is tried
LARGELY = 1.5  # times what its sliders can hold: so much more, and a contact is not like one that holds
ENOUGH_STEPS = 200.0  # Newton steps to the only orbit
FEW_STEPS = 12.0  # Newton steps to an orbit that rest may settle on


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
    else:
        ahead = start_balanced(rig, sliders, force, leg, room)
        miss, code = shoot_elastic(rig, sliders, force, ahead, room, FEW_STEPS, layout.HASTY)
    likely = 1.0 if is_stable(rig, sliders, room, miss, code) else 0.0
    return from_rest(rig, sliders, force, ahead, likely, room)


def from_rest(
    rig: Rig, sliders: Sliders, force: Force, leg: Leg, likely: float, room: ElasticRoom
) -> tuple[Leg, float, int]:
    """Return leg, miss and code of the orbit that the motion from rest settles on.

    It probably is the one in the room if `likely` (1.0, else 0.0): a stable one of the leg.
    """
    orbit, cycle = no_candidate(), Leg(leg.tau, TURN, 1.0, 1.0)
    code = layout.DONE
    if likely > 0.0 and leg.sign < 0.0:  # of half a cycle: carried on
        code = carry_elastic(rig, sliders, force, cycle, room, layout.DERIVED)
    if likely > 0.0 and code == layout.DONE:
        orbit = candidate_of(sliders, room)
    start_at_rest(sliders, room)
    if orbit.contraction <= 0.0:
        return settle(rig, sliders, force, 0.0, orbit, room)
    code = carry_elastic(rig, sliders, force, Leg(0.0, leg.tau, 1.0, 1.0), room, layout.PLAIN)
    if code != layout.DONE:
        return cycle, inf, code
    back_to_start(rig, sliders, cycle, room)
    return settle(rig, sliders, force, leg.tau, orbit, room)


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
