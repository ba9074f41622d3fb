"""What never slips: the periodic motion with every slider held, and the forces with which they hold."""

from math import cos, hypot, inf, sin

from frictionlab.simulator.elastic.layout import ElasticRoom, Sliders
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.layout import TURN, Force, Oscillator, Rig
from frictionlab.simulator.kernel.motion import gap, local_force, stiffened

FEW, MANY = 4, 64  # looks at the held motion, for each harmonic: to see that it slips, to find each crest


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
