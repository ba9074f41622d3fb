"""What needs no search: what grows for ever, never begins or comes to rest; and motions without a stop in closed form.

Those are Den Hartog's, with and without a dashpot, and the one without friction.
"""

from math import atan2, cos, exp, expm1, floor, hypot, inf, pi, sin, sqrt, tan

from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.events import carry
from frictionlab.simulator.kernel.layout import TURN, Force, Leg, Rig, Room, State
from frictionlab.simulator.kernel.motion import gap, local_force, motion_at
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


def forced(rig: Rig, force: Force, tau: float) -> tuple[float, float, float]:
    """Return z, v and a at tau of the periodic motion without friction; 0 if a harmonic is exactly at resonance."""
    r, zeta = rig.plain.r, rig.plain.zeta
    z, v, a = 0.0, 0.0, 0.0
    for i in range(len(force.cosine)):
        k = i + 1.0
        stiffness = complex(gap(r, k) * (1.0 + k * r), 2.0 * zeta * k * r)
        if stiffness == 0.0:
            return 0.0, 0.0, 0.0
        motion = complex(force.cosine[i], -force.sine[i]) * complex(cos(k * tau), sin(k * tau)) / stiffness
        z, v, a = z + motion.real, v - k * motion.imag, a - k * k * motion.real
    return z, v, a


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
    way, v, _, _ = motion_at(since - pi if since >= pi else since, rig.plain, force, start)
    return amplitude, sign * (amplitude + way), sign * v


def continuous_orbit(rig: Rig, force: Force, room: Room) -> tuple[Leg, float, float, bool]:
    """Return Den Hartog's orbit as leg, z, v, and whether the event loop confirms it.

    The closed form assumes that the mass never stops; the loop, started on its upper turn, must come back mirrored
    after half a period on one straight way of length 2X. The orbit is handed over from the middle of that way.
    """
    size = hypot(force.cosine[0], force.sine[0])
    beta = rig.contact.beta / size
    _, phase = den_hartog(rig.plain.r, beta) if rig.plain.zeta == 0.0 else damped_turn(rig, beta)
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
    miss = hypot(iz - z, rig.plain.r * iv) + abs(room.tally[layout.PATH] - 2.0 * abs(z))
    return code == layout.DONE and room.tally[layout.STUCK_TIME] == 0.0 and miss <= 1e-9 * abs(z)


def safe_distance(rig: Rig, force: Force) -> float:
    """Return how near to Den Hartog's motion no other motion stops any more, so that it only comes nearer.

    Two motions under dry friction never part in hypot(dz, r dv), but by a release from a stop against more than kinetic
    friction. A motion can stop only where its pull |F - z| is within static friction; this one must be as near to that
    and to v = 0 as the two are to each other. Half of the least such distance over half a period, for its samples.
    """
    r, hold = rig.plain.r, rig.contact.beta * max(rig.contact.static_up, rig.contact.static_down)
    least, count = inf, 16 + int(8.0 / r)
    for i in range(count):
        tau = pi * i / count
        _, z, v = continuous_state(rig, force, tau)
        push, _ = local_force(tau, force)
        least = min(least, hypot(max(0.0, abs(push - z) - hold), r * v))
    return 0.5 * least
