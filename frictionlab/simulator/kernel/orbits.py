"""What repeats: Den Hartog's closed form, shooting, and the search for the orbit that rest settles on."""

from math import atan2, cos, exp, expm1, floor, hypot, inf, pi, sin, sqrt, tan

from frictionlab.simulator.kernel.events import carry
from frictionlab.simulator.kernel.layout import (
    CHATTERED,
    DONE,
    HIGH,
    LOW,
    NOT_FOUND,
    PATH,
    PERIODIC,
    PULLING,
    STUCK,
    STUCK_TIME,
    TURN,
    Buffer,
    Contact,
    Force,
    Found,
    Leg,
    Rig,
    Room,
    State,
)
from frictionlab.simulator.kernel.motion import gap, local_force, slide_at
from frictionlab.simulator.kernel.outlook import at_once, even_handed

__all__ = [
    "attract",
    "braked",
    "continued",
    "continuous_orbit",
    "continuous_state",
    "damped_turn",
    "den_hartog",
    "find_orbit",
    "frictionless",
    "newton_target",
    "only_orbit",
    "orbit_from",
    "pulls",
    "search",
    "shoot",
    "shortest",
    "spectral_radius",
    "symmetric_force",
    "turns_back",
]

LONGEST = 32  # cycles of the longest orbit looked for
MOST_STEPS = 60  # Newton steps to the only orbit
SECTIONS = 4  # phases of the drive from which the only orbit is tried
FEW_STEPS = 8  # Newton steps to one of several
PATIENCE = 1024  # cycles waited for an orbit with static friction


def den_hartog(r: float, beta: float) -> tuple[float, float]:
    """Return the amplitude X and the phase phi of eqs (2.11)-(2.14); X is 0 where no continuous motion exists.

    tan(pi / 2r) is taken from the distance of 1/r to the nearest odd integer, so that r = 1 +- 1e-15 is no harder.
    """
    odd = 2.0 * floor(0.5 / r) + 1.0
    away = gap(r, odd) / r  # 1/r - odd, in [-1, 1)
    detuning = gap(r, 1.0) * (1.0 + r)  # 1 / V
    if away == 0.0 or detuning == 0.0:
        return 0.0, 0.0
    ratio = -beta / (tan(0.5 * pi * away) * r) * detuning  # beta U / V
    if abs(ratio) >= 1.0:
        return 0.0, 0.0
    share = sqrt((1.0 - ratio) * (1.0 + ratio))
    return share / abs(detuning), atan2(-ratio, share if detuning > 0.0 else -share)


def damped_turn(rig: Rig, beta: float) -> tuple[float, float]:
    """Return the amplitude and the phase of Den Hartog's motion with a dashpot, zeta < 1; 0 where there is none.

    The free motion that friction leaves, (c1, c2) at the turn, must change sign with the rest in half a period; g and h
    there come from the distance of 1/r to the nearest odd integer, as without the dashpot.
    """
    r, zeta, omega = rig.plain.r, rig.plain.zeta, rig.plain.omega
    odd = 2.0 * floor(0.5 / r) + 1.0
    away = pi * (gap(r, odd) - zeta * zeta / (1.0 + r * omega)) / r
    decay = zeta * pi / r
    h = -exp(-decay) * sin(away) / omega
    g1 = 2.0 * sin(0.5 * away) ** 2 - cos(away) * expm1(-decay) + zeta * h / r  # 1 + g
    h1 = g1 - 2.0 * zeta * h / r  # 1 + h'
    det = g1 * h1 + h * h / (r * r)
    detuning, lag = gap(r, 1.0) * (1.0 + r), 2.0 * zeta * r
    size = 1.0 / hypot(detuning, lag)
    speed = 2.0 * beta * h / (r * r * det)
    if abs(speed) >= size:
        return 0.0, 0.0
    forced = sqrt((size - speed) * (size + speed))
    amplitude = forced + beta - 2.0 * beta * h1 / det
    return max(0.0, amplitude), atan2(-speed, forced) + atan2(lag, detuning)


def frictionless(rig: Rig, force: Force, tau: float) -> tuple[float, float]:
    """Return z and v at tau of the periodic motion without friction; 0, 0 if a harmonic is exactly at resonance."""
    r, zeta = rig.plain.r, rig.plain.zeta
    z, v = 0.0, 0.0
    for i in range(len(force.cosine)):
        k = i + 1.0
        stiffness = complex(gap(r, k) * (1.0 + k * r), 2.0 * zeta * k * r)
        if stiffness == 0.0:
            return 0.0, 0.0
        motion = complex(force.cosine[i], -force.sine[i]) * complex(cos(k * tau), sin(k * tau)) / stiffness
        z += motion.real
        v -= k * motion.imag
    return z, v


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
    if inside < 0.0:
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
    rig: Rig, force: Force, leg: Leg, z: float, v: float, room: Room, steps: int
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
    for _ in range(steps):
        size = hypot(z, r * v) + room.tally[PATH]
        if code != DONE or room.tally[PATH] == 0.0 or miss <= 2e-16 * size:
            break
        nz, nv = newton_target(room.jacobian, z, v, iz - z, iv - v)
        share = 1.0
        while share > 0.01:
            tz, tv = z + share * (nz - z), v + share * (nv - v)
            mz, mv, code = carry(rig, force, leg, tz, tv, room)
            less = hypot(mz - tz, r * (mv - tv))
            if code == DONE and less < (1.0 - 0.5 * share) * miss:
                break
            share *= 0.25
            if miss <= 1e-13 * size + floor:
                return z, v, miss, DONE
        if share > 0.01:
            z, v, iz, iv, miss = tz, tv, mz, mv, less
            continue
        for _ in range(patience):
            z, v = iz, iv
            iz, iv, code = carry(rig, force, leg, z, v, room)
            miss = hypot(iz - z, r * (iv - v))
        patience = min(2 * patience, 64)
    return z, v, miss, code


def continuous_state(rig: Rig, force: Force, tau: float) -> tuple[float, float, float]:
    """Return X and the state z, v at tau of Den Hartog's motion, carried there from its turn; X = 0: there is none."""
    r, beta = rig.plain.r, rig.contact.beta
    size = hypot(force.cosine[0], force.sine[0])
    amplitude, phase = den_hartog(r, beta / size) if rig.plain.zeta == 0.0 else damped_turn(rig, beta / size)
    amplitude *= size
    if amplitude == 0.0:
        return 0.0, 0.0, 0.0
    turn = (phase + atan2(force.sine[0], force.cosine[0])) % TURN
    since = (tau - turn) % TURN
    sign = -1.0 if since >= pi else 1.0
    push, _ = local_force(turn, force)
    start = State(amplitude, 0.0, (push - amplitude + beta) / (r * r))
    way, v, _ = slide_at(since - pi if since >= pi else since, rig.plain, force, start)
    return amplitude, sign * (amplitude + way), sign * v


def continuous_orbit(rig: Rig, force: Force, room: Room) -> tuple[Leg, float, float, bool]:
    """Return Den Hartog's orbit as leg, z, v, and whether the event loop confirms it.

    The closed form assumes that the mass never stops; the loop, started on its upper turn, must come back mirrored
    after half a period on one straight way of length 2X. The orbit is handed over from the middle of that way.
    """
    size = hypot(force.cosine[0], force.sine[0])
    _, phase = den_hartog(rig.plain.r, rig.contact.beta / size)
    turn = (phase + atan2(force.sine[0], force.cosine[0])) % TURN
    r, leg = rig.plain.r, Leg((turn + 0.5 * pi) % TURN, pi, 1.0, -1.0)
    amplitude, middle, speed = continuous_state(rig, force, leg.tau)
    if amplitude * r * r <= rig.contact.beta * (1.0 - 1e-9) or amplitude == 0.0:  # friction would hold it at its turn
        return leg, 0.0, 0.0, False
    valid = turns_back(rig, force, Leg(turn, pi, 1.0, -1.0), amplitude, room)
    if valid and not even_handed(rig):  # its lower turn may stop where its upper one does not
        valid = turns_back(rig, force, Leg((turn + pi) % TURN, pi, 1.0, -1.0), -amplitude, room)
    return leg, middle, speed, valid


def turns_back(rig: Rig, force: Force, leg: Leg, z: float, room: Room) -> bool:
    """Tell whether a mass that turns at z comes back mirrored after a leg, on one straight way and without a stop."""
    iz, iv, code = carry(rig, force, leg, z, 0.0, room)
    miss = hypot(iz - z, rig.plain.r * iv) + abs(room.tally[PATH] - 2.0 * abs(z))
    return code == DONE and room.tally[STUCK_TIME] == 0.0 and miss <= 1e-9 * abs(z)


def braked(rig: Rig, force: Force) -> bool:
    """Tell whether friction takes more out of any large motion than its resonant harmonic puts in: pi/4 of it."""
    largest = 0.0
    for i in range(len(force.cosine)):
        largest = max(largest, hypot(force.cosine[i], force.sine[i]))
    return rig.contact.beta >= 0.25 * pi * largest


def only_orbit(rig: Rig, force: Force, room: Room) -> Found:
    """Return the one orbit of a problem with mu = 1: over half a cycle where the force is symmetric.

    The map has a kink where the mass comes to rest just at the section, and Newton may stall there: then the section is
    shifted.
    """
    span, sign = (pi, -1.0) if symmetric_force(force) and even_handed(rig) else (TURN, 1.0)
    leg, z, v, miss, code = orbit_from(rig, force, Leg(0.0, span, 1.0, sign), room)
    for section in range(1, SECTIONS):
        if code != DONE or miss <= 1e-12 * (hypot(z, rig.plain.r * v) + room.tally[PATH]) + 1e-14 * rig.plain.rate:
            break
        leg, z, v, miss, code = orbit_from(rig, force, Leg(0.7 * section, span, 1.0, sign), room)
    if code == DONE and miss > 1e-12 * (hypot(z, rig.plain.r * v) + room.tally[PATH]) + 1e-14 * rig.plain.rate:
        return continued(rig, force, Leg(0.0, span, 1.0, sign), room)
    return leg, z, v, miss, code


def continued(rig: Rig, force: Force, leg: Leg, room: Room) -> Found:
    """Return the orbit reached from one with more friction, step by step.

    Where stops are about to vanish (r = 1, beta just above pi/4) Newton's method converges only from the side on which
    the mass stops: more friction is on that side.
    """
    contact, more = rig.contact, 0.03 * rig.contact.beta
    stiff = Contact(contact.beta + more, 0.0, 1.0, 1.0, contact.damping, contact.frame)
    _, z, v, miss, code = orbit_from(Rig(stiff, rig.plain, rig.plain, rig.plain), force, leg, room)
    while more > 0.0:
        more = 0.2 * more if more > 1e-17 * contact.beta else 0.0
        stiff = Contact(contact.beta + more, 0.0, 1.0, 1.0, contact.damping, contact.frame)
        z, v, miss, code = shoot(Rig(stiff, rig.plain, rig.plain, rig.plain), force, leg, z, v, room, 2 * FEW_STEPS)
    return leg, z, v, miss, code


def orbit_from(rig: Rig, force: Force, leg: Leg, room: Room) -> Found:
    """Return the orbit of a leg, shot for from Den Hartog's orbit, or from rest where that does not exist or help."""
    if len(force.cosine) == 1 and rig.plain.zeta < 1.0 and rig.contact.beta > 0.0:
        amplitude, z, v = continuous_state(rig, force, leg.tau)
        if amplitude > 0.0:
            z, v, miss, code = shoot(rig, force, leg, z, v, room, FEW_STEPS)
            if code == DONE and miss <= 2e-15 * (hypot(z, rig.plain.r * v) + room.tally[PATH]):
                return leg, z, v, miss, code
    z, v = 0.0, 0.0
    for _ in range(2):
        z, v, _ = carry(rig, force, leg, z, v, room)
    if room.tally[STUCK_TIME] == 0.0:  # a motion without stops forgets rest slowly: perhaps friction hardly counts
        iz, iv, _ = carry(rig, force, leg, z, v, room)
        miss = hypot(iz - z, rig.plain.r * (iv - v))
        fz, fv = frictionless(rig, force, leg.tau)
        iz, iv, _ = carry(rig, force, leg, fz, fv, room)
        if hypot(iz - fz, rig.plain.r * (iv - fv)) <= miss:
            z, v = fz, fv
    z, v, miss, code = shoot(rig, force, leg, z, v, room, MOST_STEPS)
    return leg, z, v, miss, code


def shortest(rig: Rig, force: Force, leg: Leg, z: float, v: float, room: Room) -> Leg:
    """Return the leg of fewest cycles after which an orbit of several cycles already repeats."""
    for turns in range(1, int(leg.turns)):
        if int(leg.turns) % turns == 0:
            part = Leg(leg.tau, leg.span, float(turns), leg.sign)
            iz, iv, _ = carry(rig, force, part, z, v, room)
            size = hypot(z, rig.plain.r * v) + room.tally[PATH]
            if hypot(iz - z, rig.plain.r * (iv - v)) <= 1e-9 * size:
                return part
    return leg


def attract(rig: Rig, force: Force, z: float, v: float, room: Room) -> Found:
    """Return the orbit that the motion from a state at tau = 0 settles on, of up to LONGEST cycles.

    Needed for mu > 1 only, where orbits may coexist, be unstable or last several cycles: the motion is waited for until
    it nearly repeats, Newton finishes it, and only a stable orbit close by is accepted.
    """
    past = [(0.0, 0.0)] * (LONGEST + 1)
    wait = 4
    leg = Leg(0.0, TURN, 1.0, 1.0)
    for cycle in range(1, PATIENCE + 1):
        z, v, code = carry(rig, force, leg, z, v, room)
        if code != DONE or room.tally[PATH] == 0.0:
            return leg, z, v, 0.0, code
        past[cycle % (LONGEST + 1)] = (z, v)
        if cycle != wait:
            continue
        wait *= 2
        size = hypot(z, rig.plain.r * v) + room.tally[PATH]
        for k in range(1, min(LONGEST, cycle) + 1):
            old = past[(cycle - k) % (LONGEST + 1)]
            close = 0.01 if cycle >= 16 and k <= 8 else 0.001  # early, and of long periods, chance comes as close
            if hypot(z - old[0], rig.plain.r * (v - old[1])) > close * size:
                continue
            trial = Leg(0.0, TURN, float(k), 1.0)
            oz, ov, miss, code = shoot(rig, force, trial, z, v, room, FEW_STEPS)
            near = hypot(z - oz, rig.plain.r * (v - ov)) < 0.1 * size
            if code == DONE and near and miss <= 1e-12 * size + 1e-14 * rig.plain.rate:
                trial = shortest(rig, force, trial, oz, ov, room)
                if trial.turns < k:
                    oz, ov, miss, code = shoot(rig, force, trial, oz, ov, room, FEW_STEPS)
                carry(rig, force, trial, oz, ov, room)
                if abs(spectral_radius(room.jacobian)) <= 1.0 + 1e-9:
                    return trial, oz, ov, miss, code
    return leg, z, v, inf, DONE


def pulls(rig: Rig, room: Room) -> bool:
    """Tell whether friction has turned into a pull, 1 + q z < 0, somewhere on the way last carried."""
    q = rig.contact.gradient
    return q != 0.0 and 1.0 + min(q * room.tally[HIGH], q * room.tally[LOW]) < 0.0


def search(rig: Rig, force: Force, room: Room) -> Found:
    """Return the orbit of a rig that moves and has no closed form.

    Without static friction there is one, and Newton's method cannot get lost; where friction varies along the path it
    may be unstable, and the motion from rest is waited for then, as with static friction.
    """
    if max(rig.contact.static_up, rig.contact.static_down) == 1.0:
        leg, z, v, miss, code = only_orbit(rig, force, room)
        if rig.contact.gradient == 0.0:
            return leg, z, v, miss, code
        size = hypot(z, rig.plain.r * v) + room.tally[PATH]
        if code == DONE and miss <= 1e-12 * size + 1e-14 * rig.plain.rate:
            carry(rig, force, leg, z, v, room)
            if abs(spectral_radius(room.jacobian)) <= 1.0 + 1e-9:
                return leg, z, v, miss, code
    return attract(rig, force, 0.0, 0.0, room)


def find_orbit(rig: Rig, force: Force, closed: int, room: Room) -> tuple[int, Leg, float, float, float, bool]:
    """Return outcome, leg, z, v, miss, and whether the closed form was it. `closed`: -1 never, 0 if valid, 1 only."""
    leg = Leg(0.0, TURN, 1.0, 1.0)
    outcome, place = at_once(rig, force, room)
    if outcome != PERIODIC:
        return outcome, leg, place, 0.0, 0.0, False
    if closed >= 0 and len(force.cosine) == 1 and rig.plain.zeta == 0.0 and rig.contact.gradient == 0.0:
        leg, z, v, valid = continuous_orbit(rig, force, room)
        if valid:
            iz, iv, _ = carry(rig, force, leg, z, v, room)
            return PERIODIC, leg, z, v, hypot(iz - z, rig.plain.r * (iv - v)), True
    if closed == 1:
        return NOT_FOUND, leg, 0.0, 0.0, inf, False
    leg, z, v, miss, code = search(rig, force, room)
    size = hypot(z, rig.plain.r * v) + room.tally[PATH]
    if code != DONE:
        return CHATTERED, leg, z, v, miss, False
    if pulls(rig, room):
        return PULLING, leg, z, v, miss, False
    if room.tally[PATH] == 0.0:
        return STUCK, leg, z, 0.0, 0.0, False
    return (PERIODIC if miss <= 1e-9 * size + 1e-14 * rig.plain.rate else NOT_FOUND), leg, z, v, miss, False
