"""What sliders hold that never slip in an orbit: arbitrary, as far as the orbit goes, so a rule says it.

Without a gradient it shifts the orbit and changes nothing else: they are relaxed, as far as their limits allow. With
one it changes friction too, and it is what the motion from rest leaves in them.
"""

from math import inf, sqrt

from frictionlab.simulator.elastic.holding import held_offset
from frictionlab.simulator.elastic.layout import ElasticRoom, OrbitGuess, Sliders
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.layout import Buffer, Leg, Rig

STRAINED = 1e-12  # of its strength: a slider that holds so much more than need be is relaxed
SAME = 1e-9  # of its strength: by which what a slider holds may differ, but for rounding


def is_idle(sliders: Sliders, i: int, leg: Leg) -> bool:
    """Tell whether a slider does not slip in the orbit just carried.

    What slips one way must slip back: if not, it only just touches its limit.
    """
    forth, back = sliders.slips[i] - sliders.falls[i], sliders.falls[i]
    return forth + back == 0.0 if leg.sign < 0.0 else forth == 0.0 or back == 0.0


def unstrain(rig: Rig, sliders: Sliders, leg: Leg, room: ElasticRoom) -> bool:
    """Relax the sliders that never slip in the orbit just carried, which are no unknowns; False if nothing changed.

    What they hold is arbitrary: each gets the residual force next to 0 with which it holds (`held_offset`). It shifts
    the orbit, and without a gradient changes nothing else.
    """
    free, residue, spring, z = False, 0.0, 1.0, room.start[0]
    for i in range(len(sliders.force)):
        if is_idle(sliders, i, leg):
            residue += room.start[2 + 2 * i] - sliders.stiffness[i] * z
            spring += sliders.stiffness[i]
            free = free or room.kinds[i] == layout.FREE
            room.kinds[i] = layout.OUTER
    if rig.contact.gradient != 0.0:
        return free
    z += residue / spring  # where the mass were with all of them relaxed
    high, low, shift, strained = (
        room.tally[layout.HIGH] + residue / spring,
        room.tally[layout.LOW] + residue / spring,
        0.0,
        0.0,
    )
    for i in range(len(sliders.force)):
        if room.kinds[i] == layout.OUTER:
            offset, at = held_offset(rig, sliders, i, high, low) if leg.sign > 0.0 else 0.0, 2 + 2 * i
            offset = offset if offset < inf else room.start[at] - sliders.stiffness[i] * z
            held, shift = sliders.stiffness[i] * z + offset, shift + offset
            strained = max(strained, abs(held - room.start[at]) / sliders.strength[i])
            room.trial[at] = held
    if strained <= STRAINED:
        return free
    room.start[0] = z - shift
    for i in range(len(sliders.force)):
        if room.kinds[i] == layout.OUTER:
            room.start[2 + 2 * i] = room.trial[2 + 2 * i]
    return True


def keeps_some(sliders: Sliders, leg: Leg) -> bool:
    """Tell whether some of several sliders do not slip in the orbit just carried."""
    kept = 0.0
    for i in range(len(sliders.force)):
        kept += 1.0 if is_idle(sliders, i, leg) else 0.0
    return kept > 0.0 and len(sliders.force) > 1


def away(rig: Rig, sliders: Sliders, state: list[float], other: Buffer) -> float:
    """Return the distance of two states, in the norm that friction never lets grow."""
    total = (state[0] - other[0]) ** 2 + (rig.plain.r * (state[1] - other[1])) ** 2
    for i in range(len(sliders.force)):
        total += (state[2 + 2 * i] - other[2 + 2 * i]) ** 2 / max(sliders.stiffness[i], 1e-300)
    return sqrt(total)


def has_slipped_out(rig: Rig, sliders: Sliders, orbit: OrbitGuess, beside: Buffer, state: Buffer) -> bool:
    """Tell whether a motion in a state holds for good what it holds now; the orbit that holds the same is `beside` it.

    It never comes farther from the orbit than it is now. So a slider that holds on the orbit with so much to spare
    holds from now on.
    """
    contact, far, shift = rig.contact, away(rig, sliders, state, beside), beside[0] - orbit.state[0]
    high, low = orbit.high + shift + far, orbit.low + shift - far
    for i in range(len(sliders.force)):
        forth, back = orbit.passed[2 * i] - orbit.passed[2 * i + 1], orbit.passed[2 * i + 1]
        if forth > 0.0 and back > 0.0:
            continue
        kappa, beta, held = (
            sliders.stiffness[i],
            sliders.strength[i],
            beside[2 + 2 * i] - sliders.stiffness[i] * beside[0],
        )
        if abs(state[2 + 2 * i] - kappa * state[0] - held) > SAME * beta:
            return False
        if held + kappa * high > contact.static_up * beta * (1.0 + contact.gradient * high):
            return False
        if held + kappa * low < -contact.static_down * beta * (1.0 + contact.gradient * low):
            return False
    return True
