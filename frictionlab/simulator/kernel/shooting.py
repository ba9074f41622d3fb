"""Newton's method on the map of a leg, and what its derivative says of an orbit (README, "Steady states")."""

from math import hypot, sqrt

from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.events import carry
from frictionlab.simulator.kernel.layout import Buffer, Force, Leg, Rig, Room


def symmetric_force(force: Force) -> bool:
    """Tell whether F(tau + pi) = -F(tau): no even harmonic."""
    even = 0.0
    for i in range(1, len(force.cosine), 2):
        even += abs(force.cosine[i]) + abs(force.sine[i])
    return even == 0.0


def spectral_radius(jacobian: Buffer) -> float:
    """Return the multiplier of largest modulus: signed if real, the modulus if it is one of a complex pair."""
    half = 0.5 * (jacobian[0] + jacobian[3])
    det = jacobian[0] * jacobian[3] - jacobian[1] * jacobian[2]
    inside = half * half - det
    if inside < 4e-16 * half * half:  # also of a pair that only rounding parts
        return sqrt(det)
    return half + sqrt(inside) if half >= 0.0 else half - sqrt(inside)


def newton_target(jacobian: Buffer, z: float, v: float, dz: float, dv: float) -> tuple[float, float]:
    """Return where Newton's method expects the fixed point, from the map's miss (dz, dv); the image if it cannot."""
    a, b, c, d = jacobian[0] - 1.0, jacobian[1], jacobian[2], jacobian[3] - 1.0
    det = a * d - b * c
    if det == 0.0:
        return z + dz, v + dv
    return z - (d * dz - b * dv) / det, v - (a * dv - c * dz) / det


def shoot(
    rig: Rig, force: Force, leg: Leg, z: float, v: float, room: Room, steps: float
) -> tuple[float, float, float, int]:
    """Return the fixed point of the leg's map near (z, v): z, v, its miss, and how the last motion ended.

    Newton with the exact derivative, shortened until the miss shrinks; where no step helps the map itself is applied
    instead, which for mu = 1 never increases the miss (README, "Steady states").
    """
    r = rig.plain.r
    floor = 1e-15 * rig.plain.rate  # rounding of F itself, which a motion much smaller than F cannot undercut
    patience = 1
    iz, iv, code = carry(rig, force, leg, z, v, room)
    miss = hypot(iz - z, r * (iv - v))
    for _ in range(int(steps)):
        size = hypot(z, r * v) + room.tally[layout.PATH]
        if code != layout.DONE or room.tally[layout.PATH] == 0.0 or miss <= 2e-16 * size:
            break
        nz, nv = newton_target(room.jacobian, z, v, iz - z, iv - v)
        share = 1.0
        while share > 0.01:
            tz, tv = z + share * (nz - z), v + share * (nv - v)
            mz, mv, code = carry(rig, force, leg, tz, tv, room)
            less = hypot(mz - tz, r * (mv - tv))
            if code == layout.DONE and less < (1.0 - 0.5 * share) * miss:
                break
            share *= 0.25
            if miss <= 1e-13 * size + floor:
                return z, v, miss, layout.DONE
        if share > 0.01:
            z, v, iz, iv, miss = tz, tv, mz, mv, less
            continue
        for _ in range(patience):
            z, v = iz, iv
            iz, iv, code = carry(rig, force, leg, z, v, room)
            if code == layout.TIRED:
                return z, v, miss, code
            miss = hypot(iz - z, r * (iv - v))
        patience = min(2 * patience, 64)
    return z, v, miss, code


def pulls(rig: Rig, room: Room) -> bool:
    """Tell whether friction has turned into a pull, 1 + q z < 0, somewhere on the way last carried."""
    q = rig.contact.gradient
    return q != 0.0 and 1.0 + min(q * room.tally[layout.HIGH], q * room.tally[layout.LOW]) < 0.0
