"""The orbit that one motion settles on, where several may exist: static friction, friction along the path.

After a stop, one number says all that follows: where the mass stands. So the motion beside is one number too, by how
much it is stretched, and three things tell a motion that is about to repeat from one that comes by the same place again
by chance: its cycles have gone through the same phases as those one period before, motions beside it draw nearer in a
period, and the orbit that Newton's method finds there goes through these phases too and draws the motion nearer
(README, "Steady states").
"""

from math import exp, hypot, inf, log, pi

from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.events import carry
from frictionlab.simulator.kernel.layout import TURN, Buffer, Force, Found, Home, Leg, Past, Rig, Room
from frictionlab.simulator.kernel.outlook import continuous_orbit, continuous_state, is_symmetric, safe_distance
from frictionlab.simulator.kernel.shooting import newton_target, spectral_radius

LONGEST = 512  # cycles of the longest orbit looked for
PATIENCE = 4096  # cycles waited for a motion that contracts
ENOUGH = 1024  # cycles waited for one that does not
WINDOW = 256  # cycles over which that is judged
PARTED = 8.0  # e-fold stretching over the window by which a motion is told not to repeat
GROWN = 1e-3  # the least e-fold stretching over the window that is no rounding
STEPS = 8  # Newton steps to one of several orbits
NEAR = 0.01  # of its size: how near a motion must come to where it was before an orbit is tried
EAGER = 64  # legs after each of which a return is looked for; later after every eighth


def phases_passed(room: Room) -> float:
    """Return a number that is the same for two motions through the same phases.

    How many phases and stops there are, and whether a stop comes first: else one motion that stands at the section
    looks like another that has just left its stop there.
    """
    return room.tally[layout.PHASES] + 4096.0 * room.tally[layout.STOPS_MADE] + 0.5 * room.tally[layout.FIRST]


def stretch(jacobian: Buffer, dz: float, dv: float, r: float) -> tuple[float, float, float]:
    """Return a neighbour (dz, dv) after a leg, at distance 1 again, and the logarithm of what its distance grew by."""
    ahead, speed = jacobian[0] * dz + jacobian[1] * dv, jacobian[2] * dz + jacobian[3] * dv
    grown = hypot(ahead, r * speed)
    return (ahead / grown, speed / grown, log(grown)) if grown > 1e-30 else (1.0, 0.0, -69.0)


def whole(legs: int, each: int) -> Leg:
    """Return the map of so many legs; of two to a cycle, one is half of it mirrored, and three take three cycles."""
    if each == 1:
        return Leg(0.0, TURN, float(legs), 1.0)
    if legs == 1:
        return Leg(0.0, pi, 1.0, -1.0)
    return Leg(0.0, TURN, float(legs if legs % 2 == 1 else legs // 2), 1.0)


def alike(ring: list[Past], at: int, legs: int) -> bool:
    """Tell whether the latest legs have each gone through the same phases as one period before."""
    i = 0
    while i < legs and ring[(at - i) % len(ring)].passed == ring[(at - i - legs) % len(ring)].passed:
        i += 1
    return i == legs


def returning(ring: list[Past], at: int, legs: int, r: float, near: float) -> float:
    """Return how near a motion has come to where it was so many legs ago, if it seems to settle there; else inf."""
    now, old = ring[at % len(ring)], ring[(at - legs) % len(ring)]
    if now.passed != old.passed or now.grown > old.grown or abs(now.z - old.z) > near:
        return inf
    away = hypot(now.z - old.z, r * (now.v - old.v))
    return away if away <= near and alike(ring, at, legs) else inf


def nearest(ring: list[Past], at: int, tried: Buffer, each: int, r: float, size: float) -> tuple[int, float]:
    """Return the number of legs after which a motion has come nearest to where it was, and how near; none: 0, inf.

    Of two about as near the shorter; `tried` is how near, over the size of the motion, each number is tried from.
    """
    best, least = 0, inf
    for legs in range(1, min(len(tried) - 1, at // 2) + 1):
        if each == 2 and at % 2 == 1 and legs > 1:  # the mirror image of the motion, not the motion
            continue
        away = returning(ring, at, legs, r, min(0.1 * least, tried[legs] * size))
        if away < inf:
            best, least = legs, away
    return best, least


def finish(rig: Rig, force: Force, leg: Leg, z: float, v: float, room: Room) -> tuple[float, float, float, bool]:
    """Return the orbit beside a state: z, v, its miss, and whether the motion from the state settles on it.

    Newton's method in full steps, each of which must halve the miss. The motion settles there if the orbit is stable,
    both go through the same phases over a period, and the map is nearly linear between them: what it brings the motion
    nearer by is more than twice what it departs from its derivative.
    """
    r = rig.plain.r
    iz, iv, code = carry(rig, force, leg, z, v, room)
    later_z, later_v, passed, radius = iz, iv, phases_passed(room), abs(spectral_radius(room.jacobian))
    oz, ov, miss, size = z, v, hypot(iz - z, r * (iv - v)), hypot(z, r * v) + room.tally[layout.PATH]
    floor = 1e-12 * size + 1e-14 * rig.plain.rate
    for _ in range(STEPS):
        if code != layout.DONE or room.tally[layout.PATH] == 0.0 or miss <= 2e-16 * size:
            break
        nz, nv = newton_target(room.jacobian, oz, ov, iz - oz, iv - ov)
        jz, jv, code = carry(rig, force, leg, nz, nv, room)
        less, radius = hypot(jz - nz, r * (jv - nv)), abs(spectral_radius(room.jacobian))
        if less > 0.5 * miss and miss > floor:
            return oz, ov, miss, False
        if less >= miss:
            break
        oz, ov, iz, iv, miss = nz, nv, jz, jv, less
    dz, dv, jacobian = z - oz, v - ov, room.jacobian
    bent_z = later_z - oz - jacobian[0] * dz - jacobian[1] * dv
    bent_v = later_v - ov - jacobian[2] * dz - jacobian[3] * dv
    straight = hypot(bent_z, r * bent_v) <= 0.5 * max(0.0, 1.0 - radius) * hypot(dz, r * dv) + floor
    same = code == layout.DONE and miss <= floor and phases_passed(room) == passed
    return oz, ov, miss, same and straight and radius <= 1.0 + 1e-9


def shortest(rig: Rig, force: Force, leg: Leg, z: float, v: float, miss: float, room: Room) -> Found:
    """Return an orbit with the leg of fewest cycles after which it already repeats."""
    for turns in range(1, int(leg.turns)):
        if int(leg.turns) % turns == 0:
            part = Leg(leg.tau, leg.span, float(turns), leg.sign)
            iz, iv, code = carry(rig, force, part, z, v, room)
            size = hypot(z, rig.plain.r * v) + room.tally[layout.PATH]
            if code == layout.DONE and hypot(iz - z, rig.plain.r * (iv - v)) <= 1e-9 * size:
                z, v, miss, _ = finish(rig, force, part, z, v, room)
                return part, z, v, miss, layout.DONE
    return leg, z, v, miss, layout.DONE


def calm(rig: Rig, force: Force, room: Room) -> tuple[Leg, Home]:
    """Return the orbit without a stop, if there is one in closed form, and how near to it no motion stops any more."""
    leg, _, _, valid = continuous_orbit(rig, force, room)
    if not valid:
        return leg, Home(0.0, 0.0, 0.0)
    _, z, v = continuous_state(rig, force, 0.0)
    return leg, Home(z, v, safe_distance(rig, force))


def parting(ring: list[Past], at: int, each: int) -> float:
    """Return by how much a neighbour's distance grows in a cycle, if that tells that a motion does not repeat; else 0.

    It does when the growth over the last cycles is large, or when there has been growth and enough has been waited for.
    """
    if at % (WINDOW * each) != 0 or at < 2 * WINDOW * each:
        return 0.0
    apart = ring[at % len(ring)].grown - ring[(at - WINDOW * each) % len(ring)].grown
    return exp(apart / WINDOW) if apart > PARTED or (at >= ENOUGH * each and apart > GROWN) else 0.0


def attract(rig: Rig, force: Force, z: float, v: float, home: Home, room: Room) -> Found:
    """Return the orbit that the motion from a state at tau = 0 settles on, of up to LONGEST cycles.

    The motion is followed until it is safe within `home`, or nearly repeats and Newton finishes it. Trials may cost
    half of the cycles followed, and each period is tried again only when the motion has come ten times nearer. The code
    is WANDERS, and the miss the growth of a neighbour's distance in a cycle, if motions beside it part; FAR if it has
    not stopped any more for long, but has not settled either.
    """
    r, each = rig.plain.r, 2 if is_symmetric(rig, force) else 1
    leg, most = whole(1, each), LONGEST * each
    ring, tried = [Past(z, v, 0.0, -1.0)] * (2 * most + 1), [NEAR] * (most + 1)
    dz, dv, grown, spent, held, free = 1.0, 0.0, 0.0, 0.0, 0, 0
    for at in range(1, PATIENCE * each + 1):
        z, v, code = carry(rig, force, leg, z, v, room)
        held = held + 1 if room.tally[layout.PATH] == 0.0 else 0
        free = free + 1 if room.tally[layout.STUCK_TIME] == 0.0 else 0
        if code == layout.TIRED:
            now, old = ring[(at - 1) % len(ring)], ring[(at - 2) % len(ring)]
            return leg, now.z, now.v, hypot(now.z - old.z, r * (now.v - old.v)), code
        if code != layout.DONE or held == each:
            return Leg(0.0, TURN, 1.0, 1.0), -z if each == 2 and at % 2 == 1 else z, v, 0.0, code
        if hypot(z - home.z, r * (v - home.v)) < home.near:
            return leg, home.z, home.v, 0.0, layout.DONE
        dz, dv, more = stretch(room.jacobian, dz, dv, r)
        grown += more
        ring[at % len(ring)] = Past(z, v, grown, phases_passed(room))
        size = hypot(z, r * v) + each * room.tally[layout.PATH]
        legs, away = nearest(ring, at, tried, each, r, size) if at <= EAGER or at % 8 == 0 else (0, inf)
        trial = whole(legs, each)
        if legs > 0 and (away <= 1e-9 * size or spent + trial.turns <= 16.0 + 0.5 * at / each):
            oz, ov, miss, settles = finish(rig, force, trial, z, v, room)
            if settles:
                return shortest(rig, force, trial, oz, ov, miss, room)
            spent, tried[legs] = spent + 2.0 * trial.turns, 0.1 * away / size
        growth = parting(ring, at, each)
        if growth > 0.0:
            return leg, z, v, growth, layout.WANDERS
    return leg, z, v, inf, layout.FAR if free >= WINDOW * each else layout.DONE
