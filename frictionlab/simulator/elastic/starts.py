"""Where a search starts: near what never slips, or where drive and contact balance.

A slider that yields by phi = beta / kappa under ``z = A cos(theta)`` slips, on the way down, from
``cos(theta_s) = 1 - 2 phi / A`` on. To its own harmonic it is a spring and a loss,
``C + i S = kappa / pi (theta_s - sin(2 theta_s) / 2 + i sin(theta_s)^2)`` (method of harmonic balance; T. K. Caughey,
J. Appl. Mech. 27 (1960) 640).
"""

from math import acos, atan2, cos, hypot, inf, pi, sin

from frictionlab.simulator.elastic.holding import (
    FEW,
    MANY,
    forced_part,
    held_offset,
    held_range,
    held_stiffness,
    looked_at,
    slow_motion,
)
from frictionlab.simulator.elastic.layout import ElasticRoom, Sliders
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.layout import TURN, Force, Leg, Rig
from frictionlab.simulator.kernel.motion import local_force, stiffened

HALVINGS = 8  # of the bracket about the size of the motion: to half a per cent
DOUBLINGS = 40
NEARLY = 1.05  # times a slider's limit: a contact that would hold with so little more hardly slips
SURELY = 1.3  # times a slider's own yield: a motion of that size makes it slip for a while


def slip_angle(yields: float, size: float) -> float:
    """Return the phase of a vibration, counted from its crest, from which a slider slips on the way down."""
    return acos(max(-1.0, 1.0 - 2.0 * yields / size))


def secant(sliders: Sliders, size: float) -> complex:
    """Return stiffness and loss of all sliders to a vibration of a size."""
    total = complex(0.0, 0.0)
    for i in range(len(sliders.force)):
        kappa, beta = sliders.stiffness[i], sliders.strength[i]
        if kappa * size <= beta:
            total += kappa
        else:
            slips = slip_angle(beta / kappa, size)
            loss = sin(slips)
            total += kappa / pi * complex(slips - loss * cos(slips), loss * loss)
    return total


def stiffness_to(rig: Rig, contact: complex, k: float) -> complex:
    """Return what the mass opposes to its harmonic k, the contact replaced by stiffness and loss."""
    r, zeta = rig.plain.r, rig.plain.zeta
    return contact + complex((1.0 - k * r) * (1.0 + k * r), 2.0 * zeta * k * r)


def balanced_size(rig: Rig, sliders: Sliders, drive: float) -> float:
    """Return the size of the motion under a single cosine of a size, where it is the same for drive and contact."""
    high = drive
    for _ in range(DOUBLINGS):
        if high * abs(stiffness_to(rig, secant(sliders, high), 1.0)) > drive:
            break
        high *= 2.0
    low = 0.5 * high
    for _ in range(DOUBLINGS):
        if low * abs(stiffness_to(rig, secant(sliders, low), 1.0)) <= drive:
            break
        low, high = 0.5 * low, low
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if middle * abs(stiffness_to(rig, secant(sliders, middle), 1.0)) > drive:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def start_balanced(rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom) -> Leg:
    """Start on the balanced motion, on the way down, where most sliders slip; return the leg from there."""
    size = balanced_size(rig, sliders, hypot(force.cosine[0], force.sine[0]))
    contact = secant(sliders, size)
    first = complex(force.cosine[0], -force.sine[0]) / stiffness_to(rig, contact, 1.0)
    slips = 0.0
    for i in range(len(sliders.force)):
        yields = sliders.strength[i] / sliders.stiffness[i]
        if size > SURELY * yields:
            slips = max(slips, slip_angle(yields, size))
    phase = 0.5 * (slips + pi)
    tau = (phase - atan2(first.imag, first.real)) % TURN
    z, v = 0.0, 0.0
    for i in range(len(force.cosine)):
        k = i + 1.0
        motion = complex(force.cosine[i], -force.sine[i]) / stiffness_to(rig, contact, k)
        motion *= complex(cos(k * tau), sin(k * tau))
        z += motion.real
        v -= k * motion.imag
    room.start[0], room.start[1] = z, v
    load = 1.0 + rig.contact.gradient * z
    for i in range(len(sliders.force)):
        kappa, beta = sliders.stiffness[i], sliders.strength[i]
        at, room.kinds[i] = 2 + 2 * i, layout.OUTER
        room.start[at], room.start[at + 1] = kappa * z, 0.0
        if kappa * size > beta and slip_angle(beta / kappa, size) < phase:
            room.start[at], room.start[at + 1], room.kinds[i] = -beta * load, -1.0, layout.SLIDING
        elif kappa * size > beta:
            room.start[at], room.kinds[i] = beta - kappa * size * (1.0 - cos(phase)), layout.FREE
    return Leg(tau, leg.span, leg.turns, leg.sign)


def strain(sliders: Sliders, high: float, low: float) -> float:
    """Return the largest of the forces that hold sliders while z goes from low to high, over its limit."""
    most = 0.0
    for i in range(len(sliders.force)):
        most = max(most, 0.5 * sliders.stiffness[i] * (high - low) / sliders.strength[i])
    return most


def start_held(rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom, most: float) -> tuple[Leg, bool]:
    """Start on the motion with every slider held, half way between crest and trough; False where that is far off.

    That is where it asks for more than `most` times what a slider can hold; which then is as far from either limit.
    """
    slow = room.slow
    local_force(0.0, force)
    forced_part(stiffened(rig.plain, held_stiffness(sliders)), force, slow)
    count = FEW * len(slow.p)
    high, low = looked_at(slow, count)
    if strain(sliders, high, low) > most:
        return leg, False
    high, low = held_range(slow, MANY * len(slow.p))
    if strain(sliders, high, low) > most:
        return leg, False
    middle, tau, nearest = 0.5 * (high + low), 0.0, inf
    for i in range(count):
        z, v = slow_motion(TURN * i / count, slow)
        if abs(z - middle) < nearest:
            nearest, tau, room.start[0], room.start[1] = abs(z - middle), TURN * i / count, z, v
    z = room.start[0]
    for i in range(len(sliders.force)):
        kappa, beta, at = sliders.stiffness[i], sliders.strength[i], 2 + 2 * i
        offset = held_offset(rig, sliders, i, high, low)
        room.kinds[i] = layout.OUTER if offset < inf else layout.FREE
        offset = offset if offset < inf else -kappa * middle
        room.start[at], room.start[at + 1] = max(-beta, min(beta, kappa * z + offset)), 0.0
        room.start[0] -= offset
    return Leg(tau, leg.span, leg.turns, leg.sign), True
