"""What needs no search: a motion that grows for ever, one that never begins, one that comes to rest."""

from math import hypot, inf, pi, sqrt

from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.events import carry
from frictionlab.simulator.kernel.layout import TURN, Force, Leg, Rig, Room
from frictionlab.simulator.kernel.motion import gap, local_force
from frictionlab.simulator.kernel.shooting import symmetric_force

RESTING = 64  # cycles in which a mass that can rest comes to rest, or nearly so


def grows(rig: Rig, force: Force) -> bool:
    """Tell whether a harmonic drives the undamped mass exactly at resonance harder than friction can brake it."""
    zeta = rig.plain.zeta
    if rig.contact.gradient != 0.0:  # the period of a free motion depends on its size
        return False
    for i in range(len(force.cosine)):
        drive = 0.25 * pi * hypot(force.cosine[i], force.sine[i])
        if zeta == 0.0 and gap(rig.plain.r, i + 1.0) == 0.0 and rig.contact.beta < drive:
            return True
    return False


def holds(rig: Rig, force: Force, room: Room) -> bool:
    """Tell whether static friction holds the mass at rest against the largest force."""
    if len(force.cosine) == 1:
        hold = rig.contact.beta * min(rig.contact.static_up, rig.contact.static_down)
        return hold >= hypot(force.cosine[0], force.sine[0])
    carry(rig, force, Leg(0.0, TURN, 1.0, 1.0), 0.0, 0.0, room)
    return room.tally[layout.PATH] == 0.0


def even_handed(rig: Rig) -> bool:
    """Tell whether the contact does the same in both directions, wherever the mass is."""
    return rig.contact.gradient == 0.0 and rig.contact.static_up == rig.contact.static_down


def is_symmetric(rig: Rig, force: Force) -> bool:
    """Tell whether the mirror image of a motion, half a cycle later, is a motion too."""
    return symmetric_force(force) and even_handed(rig)


def root_mean_square(force: Force) -> float:
    """Return the root mean square of F, which half its range is not below."""
    square = 0.0
    for i in range(len(force.cosine)):
        square += 0.5 * (force.cosine[i] * force.cosine[i] + force.sine[i] * force.sine[i])
    return sqrt(square)


def crests(force: Force) -> tuple[float, float]:
    """Return the largest and the least value of F."""
    if len(force.cosine) == 1:
        size = hypot(force.cosine[0], force.sine[0])
        return size, -size
    high, low, count = -inf, inf, 32 * len(force.cosine)
    for i in range(count):
        begin, end = TURN * i / count, TURN * (i + 1) / count
        value, rate = local_force(begin, force)
        high, low = max(high, value), min(low, value)
        _, after = local_force(end, force)
        if (rate > 0.0) == (after > 0.0):
            continue
        for _ in range(55):
            middle = 0.5 * (begin + end)
            value, slope = local_force(middle, force)
            begin, end = (middle, end) if (slope > 0.0) == (rate > 0.0) else (begin, middle)
        high, low = max(high, value), min(low, value)
    return high, low


def resting_places(rig: Rig, force: Force) -> tuple[float, float]:
    """Return the least and the largest z at which static friction holds the mass for ever; least > largest: none."""
    up, down = rig.contact.static_up * rig.contact.beta, rig.contact.static_down * rig.contact.beta
    up_share, down_share = 1.0 + up * rig.contact.gradient, 1.0 - down * rig.contact.gradient
    if min(up_share, down_share) <= 0.0 or (up_share == 1.0 and up + down < 2.0 * root_mean_square(force)):
        return 1.0, -1.0
    high, low = crests(force)
    return (high - up) / up_share, (low + down) / down_share


def comes_to_rest(rig: Rig, force: Force, room: Room) -> tuple[bool, float]:
    """Tell whether the motion from rest ends at rest, and where.

    Under plain dry friction it does wherever a place holds the mass: the distance to a motion at rest never grows. It
    may need endlessly many ever smaller slides, and ends at the edge of the places then; elsewhere such slides tell.
    """
    least, largest = resting_places(rig, force)
    if least > largest:
        return False, 0.0
    z, v, before, leg = 0.0, 0.0, 0.0, Leg(0.0, TURN, 1.0, 1.0)
    for cycle in range(RESTING):
        z, v, _ = carry(rig, force, leg, z, v, room)
        if room.tally[layout.PATH] == 0.0:
            return True, z
        before = room.tally[layout.PATH] if cycle == RESTING // 2 else before
    path, inside = room.tally[layout.PATH], 4e-16 * (rig.plain.rate + abs(least) + abs(largest))
    place = min(max(z, least + inside), largest - inside) if largest - least > 2.0 * inside else 0.5 * (least + largest)
    simple = even_handed(rig) and rig.contact.static_up == 1.0
    return simple or (path < 0.5 * before and abs(z - place) < 4.0 * RESTING * path), place


def at_once(rig: Rig, force: Force, room: Room) -> tuple[int, float]:
    """Return the outcome that needs no search and where the mass is then; PERIODIC: an orbit is to be found."""
    if abs(rig.contact.beta * rig.contact.gradient) >= 1.0:
        return layout.RUNAWAY, 0.0
    if grows(rig, force):
        return layout.UNBOUNDED, 0.0
    if holds(rig, force, room):
        return layout.STUCK, 0.0
    rests, place = comes_to_rest(rig, force, room)
    return (layout.STUCK, place) if rests else (layout.PERIODIC, 0.0)
