"""What repeats: the closed form, the only orbit by shooting, or the one that rest settles on."""

from math import hypot, inf, pi

from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.events import carry
from frictionlab.simulator.kernel.layout import TURN, Force, Found, Home, Leg, Rig, RigidContact, Room
from frictionlab.simulator.kernel.outlook import at_once, continuous_orbit, continuous_state, forced, is_symmetric
from frictionlab.simulator.kernel.resonance import resonant_orbit
from frictionlab.simulator.kernel.settle import attract, calm
from frictionlab.simulator.kernel.shooting import pulls, shoot, spectral_radius

MOST_STEPS = 60.0  # Newton steps to the only orbit
FEW_STEPS = 8.0  # Newton steps from a guess
SECTIONS = 4  # phases of the drive from which the only orbit is tried


def only_orbit(rig: Rig, force: Force, room: Room) -> Found:
    """Return the one orbit of a problem with mu = 1: over half a cycle where the force is symmetric.

    The map has a kink where the mass comes to rest just at the section, and Newton may stall there: then the section is
    shifted.
    """
    resonates, found = resonant_orbit(rig, force, room)
    if resonates:
        return found
    span, sign = (pi, -1.0) if is_symmetric(rig, force) else (TURN, 1.0)
    leg, z, v, miss, code = orbit_from(rig, force, Leg(0.0, span, 1.0, sign), room)
    for section in range(1, SECTIONS):
        if (
            code != layout.DONE
            or miss <= 1e-12 * (hypot(z, rig.plain.r * v) + room.tally[layout.PATH]) + 1e-14 * rig.plain.rate
        ):
            break
        leg, z, v, miss, code = orbit_from(rig, force, Leg(0.7 * section, span, 1.0, sign), room)
    if (
        code == layout.DONE
        and miss > 1e-12 * (hypot(z, rig.plain.r * v) + room.tally[layout.PATH]) + 1e-14 * rig.plain.rate
    ):
        return continued(rig, force, Leg(0.0, span, 1.0, sign), room)
    return leg, z, v, miss, code


def continued(rig: Rig, force: Force, leg: Leg, room: Room) -> Found:
    """Return the orbit reached from one with more friction, step by step.

    Where stops are about to vanish (r = 1, beta just above pi/4) Newton's method converges only from the side on which
    the mass stops: more friction is on that side.
    """
    contact, more = rig.contact, 0.03 * rig.contact.beta
    stiff = RigidContact(contact.beta + more, 0.0, 1.0, 1.0, contact.damping, contact.frame)
    _, z, v, miss, code = orbit_from(Rig(stiff, rig.plain, rig.plain, rig.plain), force, leg, room)
    while more > 0.0:
        more = 0.2 * more if more > 1e-17 * contact.beta else 0.0
        stiff = RigidContact(contact.beta + more, 0.0, 1.0, 1.0, contact.damping, contact.frame)
        z, v, miss, code = shoot(Rig(stiff, rig.plain, rig.plain, rig.plain), force, leg, z, v, room, 2.0 * FEW_STEPS)
    return leg, z, v, miss, code


def orbit_from(rig: Rig, force: Force, leg: Leg, room: Room) -> Found:
    """Return the orbit of a leg, shot for from Den Hartog's orbit, or from rest where that does not exist or help."""
    if len(force.cosine) == 1 and rig.plain.zeta < 1.0 and rig.contact.beta > 0.0:
        amplitude, z, v = continuous_state(rig, force, leg.tau)
        if amplitude > 0.0:
            z, v, miss, code = shoot(rig, force, leg, z, v, room, FEW_STEPS)
            if code == layout.DONE and miss <= 2e-15 * (hypot(z, rig.plain.r * v) + room.tally[layout.PATH]):
                return leg, z, v, miss, code
    z, v = 0.0, 0.0
    for _ in range(2):
        z, v, _ = carry(rig, force, leg, z, v, room)
    if (
        room.tally[layout.STUCK_TIME] == 0.0
    ):  # a motion without stops forgets rest slowly: perhaps friction hardly counts
        iz, iv, _ = carry(rig, force, leg, z, v, room)
        miss = hypot(iz - z, rig.plain.r * (iv - v))
        fz, fv, _ = forced(rig, force, leg.tau)
        iz, iv, _ = carry(rig, force, leg, fz, fv, room)
        if hypot(iz - fz, rig.plain.r * (iv - fv)) <= miss:
            z, v = fz, fv
    z, v, miss, code = shoot(rig, force, leg, z, v, room, MOST_STEPS)
    return leg, z, v, miss, code


def is_simple(rig: Rig, force: Force) -> bool:
    """Tell whether Den Hartog's motion is a motion of this rig: a single cosine, a dashpot at most, no gradient."""
    return len(force.cosine) == 1 and rig.plain.zeta < 1.0 and rig.contact.gradient == 0.0


def settled(rig: Rig, force: Force, z: float, v: float, room: Room) -> tuple[Found, bool]:
    """Return the orbit that the motion from a state at tau = 0 settles on, and whether it is Den Hartog's."""
    leg, home = Leg(0.0, TURN, 1.0, 1.0), Home(0.0, 0.0, 0.0)
    if is_simple(rig, force) and rig.contact.beta > 0.0:
        leg, home = calm(rig, force, room)
    found = attract(rig, force, z, v, home, room)
    far = found[4] == layout.FAR
    if home.near == 0.0 and far:
        return upcoming(rig, force, found, room), False
    if home.near == 0.0 or not (far or (found[1] == home.z and found[2] == home.v)):
        return found, False
    _, oz, ov = continuous_state(rig, force, leg.tau)
    iz, iv, code = carry(rig, force, leg, oz, ov, room)
    miss = hypot(iz - oz, rig.plain.r * (iv - ov))
    return (leg, oz, ov, miss, layout.FAR if far and code == layout.DONE else code), rig.plain.zeta == 0.0


def upcoming(rig: Rig, force: Force, found: Found, room: Room) -> Found:
    """Return the orbit without stops next to resonance, for a motion that no longer stops but is still far from it."""
    resonates, orbit = resonant_orbit(rig, force, room)
    if resonates:
        leg, z, v, miss, _ = orbit
        return leg, z, v, miss, layout.FAR
    leg, z, v, miss, _ = found
    carry(rig, force, leg, z, v, room)
    return leg, z, v, miss, layout.DONE


def search(rig: Rig, force: Force, room: Room) -> tuple[Found, bool]:
    """Return the orbit of a rig that moves, and whether it is Den Hartog's.

    Without static friction there is one, and Newton's method cannot get lost; where friction varies along the path it
    may be unstable, and the motion from rest is waited for then, as with static friction.
    """
    if max(rig.contact.static_up, rig.contact.static_down) == 1.0 or rig.contact.beta == 0.0:
        leg, z, v, miss, code = only_orbit(rig, force, room)
        if rig.contact.gradient == 0.0:
            return (leg, z, v, miss, code), False
        size = hypot(z, rig.plain.r * v) + room.tally[layout.PATH]
        if code == layout.DONE and miss <= 1e-12 * size + 1e-14 * rig.plain.rate:
            carry(rig, force, leg, z, v, room)
            if abs(spectral_radius(room.jacobian)) <= 1.0 + 1e-9:
                return (leg, z, v, miss, code), False
    return settled(rig, force, 0.0, 0.0, room)


def verdict(rig: Rig, found: Found, room: Room) -> int:
    """Return the outcome of a search; `room` holds the tally of its last motion."""
    _, z, v, miss, code = found
    size = hypot(z, rig.plain.r * v) + room.tally[layout.PATH]
    if code == layout.CHATTER:
        return layout.CHATTERED
    if pulls(rig, room):
        return layout.PULLING
    if code == layout.WANDERS:
        return layout.PARTING
    if room.tally[layout.PATH] == 0.0:
        return layout.STUCK
    if miss > 1e-9 * size + 1e-14 * rig.plain.rate:
        return layout.NOT_FOUND
    return layout.UPCOMING if code == layout.FAR else layout.PERIODIC


def find_orbit(rig: Rig, force: Force, closed: int, room: Room) -> tuple[int, Leg, float, float, float, bool]:
    """Return outcome, leg, z, v, miss, and whether the closed form was it. `closed`: -1 never, 0 if valid, 1 only."""
    leg = Leg(0.0, TURN, 1.0, 1.0)
    outcome, place = at_once(rig, force, room)
    if outcome != layout.PERIODIC:
        return outcome, leg, place, 0.0, 0.0, False
    only = max(rig.contact.static_up, rig.contact.static_down) == 1.0 or rig.contact.beta == 0.0 or closed == 1
    if closed >= 0 and only and is_simple(rig, force) and rig.plain.zeta == 0.0:
        leg, z, v, valid = continuous_orbit(rig, force, room)
        if valid:
            iz, iv, _ = carry(rig, force, leg, z, v, room)
            return layout.PERIODIC, leg, z, v, hypot(iz - z, rig.plain.r * (iv - v)), True
    if closed == 1:
        return layout.NOT_FOUND, leg, 0.0, 0.0, inf, False
    found, exact = search(rig, force, room)
    leg, z, v, miss, _ = found
    outcome = verdict(rig, found, room)
    return (
        outcome,
        leg,
        z,
        0.0 if outcome == layout.STUCK else v,
        0.0 if outcome == layout.STUCK else miss,
        exact and closed >= 0,
    )
