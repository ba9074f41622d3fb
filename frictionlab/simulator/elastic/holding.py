"""What never slips: the periodic motion with every slider held, and the forces with which they hold."""

from math import cos, hypot, inf, sin

from frictionlab.simulator.elastic.layout import OUTER, ElasticRoom, Sliders
from frictionlab.simulator.elastic.phases import stiffened
from frictionlab.simulator.kernel.layout import (
    TURN,
    Force,
    Oscillator,
    Rig,
)
from frictionlab.simulator.kernel.motion import gap

__all__ = ["held_motion", "held_offset", "held_range", "never_slips", "start_at_rest"]


def start_at_rest(sliders: Sliders, room: ElasticRoom) -> None:
    """Start with everything relaxed."""
    for i in range(2 + 2 * len(sliders.force)):
        room.start[i] = 0.0
    for i in range(len(sliders.force)):
        room.kinds[i] = OUTER


def held_motion(slide: Oscillator, force: Force, tau: float) -> tuple[float, float]:
    """Return z and v at tau of the periodic motion with every slider held, relaxed at z = 0."""
    z, v = 0.0, 0.0
    for i in range(len(force.cosine)):
        k = i + 1.0
        stiffness = complex(gap(slide.r, k) * (1.0 + k * slide.r), 2.0 * slide.zeta * k * slide.r)
        if stiffness == 0.0:
            return inf, 0.0
        share = complex(slide.share * force.cosine[i], -slide.share * force.sine[i])
        motion = share * complex(cos(k * tau), sin(k * tau)) / stiffness
        z += motion.real
        v -= k * motion.imag
    return z, v


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


def held_range(slide: Oscillator, force: Force) -> tuple[float, float]:
    """Return the highest and lowest z of the motion with every slider held: from its series, each crest refined."""
    harmonics = len(force.cosine)
    if harmonics == 1:
        z, v = held_motion(slide, force, 0.0)
        return hypot(z, v), -hypot(z, v)
    high, low, count = -inf, inf, 64 * harmonics
    for i in range(count):
        tau, width = TURN * i / count, TURN / count
        z, v = held_motion(slide, force, tau)
        after = held_motion(slide, force, tau + width)[1]
        if v * after < 0.0:
            for _ in range(60):
                width *= 0.5
                tau += width if held_motion(slide, force, tau + width)[1] * v > 0.0 else 0.0
            z = held_motion(slide, force, tau)[0]
        high, low = max(high, z), min(low, z)
    return high, low


def never_slips(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> bool:
    """Tell whether there is a periodic motion in which no slider ever slips; it is left in the room's start."""
    total = 1.0
    for i in range(len(sliders.force)):
        total += sliders.stiffness[i]
    slide = stiffened(rig.plain, total)
    z, v = held_motion(slide, force, 0.0)
    if z == inf:
        return False
    high, low = held_range(slide, force)
    start_at_rest(sliders, room)
    room.start[0], room.start[1] = z, v
    for i in range(len(sliders.force)):
        offset = held_offset(rig, sliders, i, high, low)
        if offset == inf:
            return False
        room.start[2 + 2 * i] = sliders.stiffness[i] * z + offset
        room.start[0] -= offset
    return True
