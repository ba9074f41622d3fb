"""What never slips; and where a search starts: near that, or where drive and contact balance.

What never slips is the periodic motion with every slider held; the forces with which they hold are arbitrary in it.

A slider that yields by phi = beta / kappa under ``z = A cos(theta)`` slips, on the way down, from
``cos(theta_s) = 1 - 2 phi / A`` on. To its own harmonic it is a spring and a loss,
``C + i S = kappa / pi (theta_s - sin(2 theta_s) / 2 + i sin(theta_s)^2)`` (method of harmonic balance; T. K. Caughey,
J. Appl. Mech. 27 (1960) 640).
"""

from math import acos, atan2, cos, hypot, inf, pi, sin

from frictionlab.simulator.elastic.layout import ElasticRoom, Sliders
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.layout import TURN, Force, Leg, Oscillator, Rig
from frictionlab.simulator.kernel.motion import gap, local_force, stiffened

FEW, MANY = 4, 64  # looks at the held motion, for each harmonic: to see that it slips, to find each crest
HALVINGS = 8  # of the bracket about the size of the motion: to half a per cent
DOUBLINGS = 40
NEARLY = 1.05  # times a slider's limit: a contact that would hold with so little more hardly slips
SURELY = 1.3  # times a slider's own yield: a motion of that size makes it slip for a while


def forced_part(slide: Oscillator, force: Force, slow: Force) -> None:
    """Write the forced motion's coefficients, about the time about which the force is written."""
    for i in range(len(force.p)):
        k = i + 1.0
        stiffness = complex(gap(slide.r, k) * (1.0 + k * slide.r), 2.0 * slide.zeta * k * slide.r)
        part = complex(slide.share * force.p[i], -slide.share * force.q[i]) / stiffness
        slow.p[i], slow.q[i] = part.real, -part.imag


def slow_motion(t: float, slow: Force) -> tuple[float, float]:
    """Return the forced motion of a held contact, and its velocity, at t."""
    z, v = 0.0, 0.0
    for i in range(len(slow.p)):
        k = i + 1.0
        c, s = cos(k * t), sin(k * t)
        z += slow.p[i] * c + slow.q[i] * s
        v += k * (slow.q[i] * c - slow.p[i] * s)
    return z, v


def start_at_rest(sliders: Sliders, room: ElasticRoom) -> None:
    """Start at rest on the wall, at z = 0, every slider relaxed: so begins a search that must begin somewhere."""
    for i in range(2 + 2 * len(sliders.force)):
        room.start[i] = 0.0
    for i in range(len(sliders.force)):
        room.kinds[i] = layout.OUTER


def held_stiffness(sliders: Sliders) -> float:
    """Return the stiffness of the frame and of every slider, held."""
    total = 1.0
    for i in range(len(sliders.force)):
        total += sliders.stiffness[i]
    return total


def resonates_held(slide: Oscillator, force: Force) -> bool:
    """Tell whether a harmonic drives the held, undamped contact exactly at resonance."""
    nearest = 1.0
    for i in range(len(force.p)):
        nearest = min(nearest, abs(gap(slide.r, i + 1.0)))
    return slide.zeta == 0.0 and nearest == 0.0


def held_offset(rig: Rig, sliders: Sliders, i: int, high: float, low: float) -> float:
    """Return the residual force with which slider i holds while z goes from low to high; infinite if it cannot.

    The one closest to 0. A single slider's residual force moves the mass by as much the other way.
    """
    steep, strength = rig.contact.gradient, sliders.strength[i]
    up, down = rig.contact.static_up * strength, rig.contact.static_down * strength
    moves = steep if len(sliders.force) == 1 else 0.0
    most = (up * (1.0 + steep * high) - sliders.stiffness[i] * high) / (1.0 + up * moves)
    least = -(down * (1.0 + steep * low) + sliders.stiffness[i] * low) / (1.0 - down * moves)
    if least > most:
        return inf
    inside = min(1e-9 * strength, 0.25 * (most - least))  # a crest that only just touches the limit does not slip
    return max(least + inside, min(most - inside, 0.0))


def held_range(slow: Force, count: int) -> tuple[float, float]:
    """Return the highest and lowest z of the motion with every slider held: looked at in turn, each crest refined."""
    high, low = -inf, inf
    width = TURN / count
    z, v = slow_motion(0.0, slow)
    for i in range(count):
        high, low, tau, before = max(high, z), min(low, z), i * width, v
        z, v = slow_motion(tau + width, slow)
        if before * v < 0.0:
            part = width
            for _ in range(60):
                part *= 0.5
                tau += part if slow_motion(tau + part, slow)[1] * before > 0.0 else 0.0
            crest, _ = slow_motion(tau, slow)
            high, low = max(high, crest), min(low, crest)
    return high, low


def looked_at(slow: Force, count: int) -> tuple[float, float]:
    """Return the highest and lowest z of a number of looks at the motion with every slider held."""
    high, low = -inf, inf
    for i in range(count):
        z, _ = slow_motion(TURN * i / count, slow)
        high, low = max(high, z), min(low, z)
    return high, low


def is_held(rig: Rig, sliders: Sliders, high: float, low: float) -> bool:
    """Tell whether every slider can hold while z goes from low to high."""
    worst = 0.0
    for i in range(len(sliders.force)):
        worst = max(worst, held_offset(rig, sliders, i, high, low))
    return worst < inf


def slips_soon(rig: Rig, sliders: Sliders, slow: Force) -> bool:
    """Tell whether a few looks at the held motion show that some slider cannot hold.

    They tell where a longer way can only make it worse: where no slider's limit grows faster than its force.
    """
    ratio = max(rig.contact.static_up, rig.contact.static_down)
    for i in range(len(sliders.force)):
        if sliders.stiffness[i] <= ratio * sliders.strength[i] * abs(rig.contact.gradient):
            return False
    high, low = looked_at(slow, FEW * len(slow.p))
    return not is_held(rig, sliders, high, low)


def never_slips(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> bool:
    """Tell whether there is a periodic motion in which no slider ever slips; it is left in the room's start."""
    slide, slow = stiffened(rig.plain, held_stiffness(sliders)), room.slow
    local_force(0.0, force)
    if resonates_held(slide, force):
        return False
    forced_part(slide, force, slow)
    z, v = slow_motion(0.0, slow)
    if len(slow.p) == 1:
        high = hypot(z, v)
        low = -high
    elif slips_soon(rig, sliders, slow):
        return False
    else:
        high, low = held_range(slow, MANY * len(slow.p))
    if not is_held(rig, sliders, high, low):
        return False
    start_at_rest(sliders, room)
    room.start[0], room.start[1] = z, v
    for i in range(len(sliders.force)):
        offset = held_offset(rig, sliders, i, high, low)
        room.start[2 + 2 * i] = sliders.stiffness[i] * z + offset
        room.start[0] -= offset
    return True


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
