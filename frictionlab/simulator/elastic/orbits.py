"""What repeats: the motion that never slips, shooting in mass and sliders, the orbit that rest settles on."""

from math import atan2, cos, exp, hypot, inf, log, pi, sin, sqrt

from frictionlab.simulator.elastic.events import carry_elastic
from frictionlab.simulator.elastic.layout import (
    COLUMNS,
    ELASTIC_PHASE,
    FREE,
    OUTER,
    PULLED,
    SLIDING,
    ElasticRoom,
    Sliders,
)
from frictionlab.simulator.elastic.phases import stiffened
from frictionlab.simulator.kernel.layout import (
    CHATTERED,
    DONE,
    HIGH,
    LOW,
    NOT_FOUND,
    PERIODIC,
    PHASES,
    PULLING,
    RUNAWAY,
    STUCK,
    TURN,
    UNBOUNDED,
    Force,
    Leg,
    Oscillator,
    Rig,
)
from frictionlab.simulator.kernel.motion import gap
from frictionlab.simulator.kernel.orbits import (
    continuous_state,
    damped_turn,
    den_hartog,
    spectral_radius,
    symmetric_force,
)

__all__ = [
    "adopt",
    "apart",
    "at_once_elastic",
    "back_to_start",
    "best_section",
    "classify",
    "distance",
    "elastic_multiplier",
    "follow",
    "from_rest",
    "give_up",
    "held_motion",
    "held_offset",
    "held_range",
    "is_even_handed",
    "keeps_kinds",
    "never_slips",
    "newton_step",
    "product",
    "reduced",
    "resonates",
    "search_elastic",
    "settle",
    "shoot_elastic",
    "sign_of_growth",
    "solve",
    "span_of",
    "spread",
    "start_at_rest",
    "start_from",
    "start_sliding",
    "step_towards",
    "verdict",
]

LONGEST_ORBIT = 8  # cycles of the longest orbit looked for
ENOUGH_STEPS = 200.0  # Newton steps to the only orbit
NEAR_STEPS = 8.0  # Newton steps to one of several
CYCLES_WAITED = 1024  # for an orbit where several may exist
PHASES_WAITED = 1e5  # the same, where a cycle has many
SQUARINGS = 40  # of the map's derivative: its largest multiplier to 2^-40


def distance(rig: Rig, sliders: Sliders, room: ElasticRoom) -> float:
    """Return by how much the image misses the start: in the norm that dry friction never lets grow (README)."""
    start, image = room.start, room.image
    total = (image[0] - start[0]) ** 2 + (rig.plain.r * (image[1] - start[1])) ** 2
    for i in range(len(sliders.force)):
        if room.kinds[i] == FREE:
            total += (image[2 + 2 * i] - start[2 + 2 * i]) ** 2 / max(sliders.stiffness[i], 1e-300)
    return sqrt(total)


def span_of(rig: Rig, room: ElasticRoom) -> float:
    """Return the size of a motion, against which its miss is judged."""
    return hypot(room.start[0], rig.plain.r * room.start[1]) + max(0.0, room.tally[HIGH] - room.tally[LOW])


def classify(sliders: Sliders, room: ElasticRoom) -> None:
    """Say of each slider what its force is at the section, from the leg just run: SLIDING, OUTER or FREE."""
    for i in range(len(sliders.force)):
        if room.image[3 + 2 * i] != 0.0:
            room.kinds[i] = SLIDING
        else:
            room.kinds[i] = FREE if sliders.slips[i] > 0.0 else OUTER


def keeps_kinds(sliders: Sliders, room: ElasticRoom) -> bool:
    """Tell whether the leg bore out what was assumed of the sliders at its start, so that Newton may use it."""
    for i in range(len(sliders.force)):
        side = room.start[3 + 2 * i] if room.kinds[i] == SLIDING else 0.0
        if room.image[3 + 2 * i] != side or (room.kinds[i] == OUTER and sliders.slips[i] > 0.0):
            return False
    return True


def back_to_start(rig: Rig, sliders: Sliders, leg: Leg, room: ElasticRoom) -> None:
    """Take the image as the new start; in a mirrored leg a slider that never slips is relaxed at z = 0."""
    for i in range(2 + 2 * len(sliders.force)):
        room.start[i] = room.image[i]
    for i in range(len(sliders.force)):
        if room.kinds[i] == OUTER and leg.sign < 0.0:
            limit = sliders.strength[i] * (1.0 + rig.contact.gradient * room.start[0])
            room.start[2 + 2 * i] = max(-limit, min(limit, sliders.stiffness[i] * room.start[0]))


def reduced(sliders: Sliders, room: ElasticRoom, row: int) -> int:
    """Return which row of the jacobian the unknown number `row` of Newton's equations is."""
    if row < 2:
        return row
    free = 2
    for i in range(len(sliders.force)):
        if room.kinds[i] == FREE:
            if free == row:
                return 2 + i
            free += 1
    return -1


def solve(matrix: list[float], size: int) -> bool:
    """Solve size linear equations in place, right side in the last column; False where they have no one solution."""
    width = size + 1
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i * width + k]) > abs(matrix[best * width + k]):
                best = i
        if matrix[best * width + k] == 0.0:
            return False
        for j in range(width):
            matrix[k * width + j], matrix[best * width + j] = matrix[best * width + j], matrix[k * width + j]
        for i in range(size):
            if i != k:
                share = matrix[i * width + k] / matrix[k * width + k]
                for j in range(k, width):
                    matrix[i * width + j] -= share * matrix[k * width + j]
    for k in range(size):
        matrix[k * width + size] /= matrix[k * width + k]
    return True


def newton_step(sliders: Sliders, room: ElasticRoom) -> bool:
    """Write Newton's correction of the unknowns into the last column of the matrix; False if there is none."""
    size = int(room.tally[COLUMNS])
    width = size + 1
    for i in range(size):
        row = reduced(sliders, room, i)
        for j in range(size):
            room.matrix[i * width + j] = (1.0 if i == j else 0.0) - room.jacobian[row * size + j]
        at = row if row < 2 else 2 * row - 2
        room.matrix[i * width + size] = room.image[at] - room.start[at]
    return solve(room.matrix, size)


def step_towards(rig: Rig, sliders: Sliders, room: ElasticRoom, share: float) -> None:
    """Move the start by a share of Newton's correction, from `trial`; sliders that are no unknowns follow."""
    size = int(room.tally[COLUMNS])
    correction = room.matrix
    dz, dv = share * correction[size], share * correction[2 * size + 1]
    room.start[0], room.start[1] = room.trial[0] + dz, room.trial[1] + dv
    load = 1.0 + rig.contact.gradient * room.start[0]
    free = 2
    for i in range(len(sliders.force)):
        at = 2 + 2 * i
        room.start[at + 1] = room.trial[at + 1]
        if room.kinds[i] == FREE:
            force = room.trial[at] + share * correction[free * (size + 1) + size]
            room.start[at] = max(-sliders.strength[i] * load, min(sliders.strength[i] * load, force))
            free += 1
        elif room.kinds[i] == OUTER:
            room.start[at] = room.trial[at] + sliders.stiffness[i] * dz
        else:
            room.start[at] = room.trial[at + 1] * sliders.strength[i] * load


def give_up(sliders: Sliders, room: ElasticRoom) -> None:
    """Go back to the start from which Newton's correction was taken."""
    for i in range(2 + 2 * len(sliders.force)):
        room.start[i] = room.trial[i]


def adopt(sliders: Sliders, room: ElasticRoom) -> None:
    """Remember the start, from which Newton's correction is taken."""
    for i in range(2 + 2 * len(sliders.force)):
        room.trial[i] = room.start[i]


def follow(rig: Rig, sliders: Sliders, force: Force, leg: Leg, times: float, room: ElasticRoom) -> int:
    """Apply the leg's map so many times; return how the motion ended."""
    code = DONE
    for _ in range(int(times)):
        code = carry_elastic(rig, sliders, force, leg, room)
        if code != DONE:
            break
        classify(sliders, room)
        back_to_start(rig, sliders, leg, room)
    return code


def shoot_elastic(
    rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom, steps: float
) -> tuple[float, int]:
    """Bring the room's start to the fixed point of the leg's map; return its miss and how the last motion ended.

    Newton with the exact derivative, shortened until the miss shrinks; where that does not help, or sliders do other
    than was assumed, the map itself is applied. The last motion carried is that from the start.
    """
    patience, floor = 1.0, 1e-15 * rig.plain.rate
    code = carry_elastic(rig, sliders, force, leg, room)
    for _ in range(int(steps)):
        miss, size = distance(rig, sliders, room), span_of(rig, room)
        as_assumed = keeps_kinds(sliders, room)
        if code != DONE or (as_assumed and miss <= 2e-16 * size):
            break
        adopt(sliders, room)
        share = 1.0 if as_assumed and newton_step(sliders, room) else 0.0
        while share > 0.01:
            step_towards(rig, sliders, room, share)
            code = carry_elastic(rig, sliders, force, leg, room)
            less = distance(rig, sliders, room)
            if code == DONE and keeps_kinds(sliders, room) and less < (1.0 - 0.5 * share) * miss:
                break
            share *= 0.25
        if share > 0.01:
            continue
        give_up(sliders, room)
        if not as_assumed or miss > 1e-13 * size + floor:
            follow(rig, sliders, force, leg, patience, room)
            patience = min(2.0 * patience, 64.0)
        code = carry_elastic(rig, sliders, force, leg, room)
        if as_assumed and miss <= 1e-13 * size + floor:
            break
    return distance(rig, sliders, room), code


def start_at_rest(sliders: Sliders, room: ElasticRoom) -> None:
    """Start with everything relaxed."""
    for i in range(2 + 2 * len(sliders.force)):
        room.start[i] = 0.0
    for i in range(len(sliders.force)):
        room.kinds[i] = OUTER


def best_section(room: ElasticRoom, leg: Leg) -> float:
    """Return the phase of the drive at which most sliders slip: there the fewest of their forces are unknown."""
    phases, most, longest, section = room.phases, 0.0, 0.0, leg.tau
    recorded = min(int(room.tally[PHASES]), len(phases) // ELASTIC_PHASE)
    for i in range(recorded):
        at = ELASTIC_PHASE * i
        if phases[at] > most or (phases[at] == most > 0.0 and phases[at + 2] > longest):
            most, longest, section = phases[at], phases[at + 2], phases[at + 1] + 0.5 * phases[at + 2]
    return section


def from_rest(rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom) -> tuple[Leg, int]:
    """Run from rest for two cycles; leave the state at the best section in the room's start, return the leg from it."""
    start_at_rest(sliders, room)
    code = follow(rig, sliders, force, leg, 4.0 if leg.sign < 0.0 else 2.0, room)
    section = best_section(room, leg)
    if code == DONE:
        code = follow(rig, sliders, force, Leg(leg.tau, section - leg.tau, 1.0, 1.0), 1.0, room)
    for i in range(len(sliders.force)):  # so short a leg does not tell which sliders never slip
        room.kinds[i] = FREE if room.kinds[i] == OUTER else room.kinds[i]
    return Leg(section, leg.span, leg.turns, leg.sign), code


def start_sliding(rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom) -> tuple[Leg, bool]:
    """Start on Den Hartog's orbit of the rigid contact, halfway between its turns; False where there is none."""
    if len(force.cosine) > 1 or rig.plain.zeta >= 1.0 or rig.contact.beta == 0.0:
        return leg, False
    size = hypot(force.cosine[0], force.sine[0])
    beta = rig.contact.beta / size
    _, phase = den_hartog(rig.plain.r, beta) if rig.plain.zeta == 0.0 else damped_turn(rig, beta)
    tau = (phase + atan2(force.sine[0], force.cosine[0]) + 0.5 * pi) % TURN
    amplitude, z, v = continuous_state(rig, force, tau)
    room.start[0], room.start[1] = z, v
    load, side = 1.0 + rig.contact.gradient * z, 1.0 if v > 0.0 else -1.0
    for i in range(len(sliders.force)):
        room.start[2 + 2 * i], room.start[3 + 2 * i] = side * sliders.strength[i] * load, side
        room.kinds[i] = SLIDING
        if amplitude * sliders.stiffness[i] < 3.0 * sliders.strength[i]:
            return leg, False
    return Leg(tau, leg.span, leg.turns, leg.sign), load > 0.0


def spread(rig: Rig, room: ElasticRoom, miss: float) -> bool:
    """Tell whether a miss is nothing but rounding."""
    return miss <= 1e-12 * span_of(rig, room) + 1e-14 * rig.plain.rate


def search_elastic(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return leg, miss and code of the orbit that a search from Den Hartog's, else from rest, comes down to.

    Without break-away and gradient there is only one. Where friction varies along the path it may be unstable: then,
    and with break-away, the orbit that the motion from rest settles on is looked for.
    """
    leg = Leg(0.0, pi, 1.0, -1.0) if is_even_handed(rig, force) else Leg(0.0, TURN, 1.0, 1.0)
    if max(rig.contact.static_up, rig.contact.static_down) > 1.0:
        return settle(rig, sliders, force, room)
    ahead, there = start_sliding(rig, sliders, force, leg, room)
    miss, code = inf, DONE
    if there:
        miss, code = shoot_elastic(rig, sliders, force, ahead, room, NEAR_STEPS)
    if code != DONE or not spread(rig, room, miss):
        ahead, code = from_rest(rig, sliders, force, leg, room)
        if code == DONE:
            miss, code = shoot_elastic(rig, sliders, force, ahead, room, ENOUGH_STEPS)
    if rig.contact.gradient == 0.0 or (
        code == DONE and spread(rig, room, miss) and abs(elastic_multiplier(sliders, room)) <= 1.0 + 1e-9
    ):
        return ahead, miss, code
    return settle(rig, sliders, force, room)


def settle(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> tuple[Leg, float, int]:
    """Return the orbit of up to LONGEST_ORBIT cycles that the motion from rest settles on, if it is stable.

    The motion is waited for until it nearly repeats, and Newton finishes it; only an orbit close by is taken.
    """
    leg, waited, wait, size = Leg(0.0, TURN, 1.0, 1.0), 0.0, 16.0, 2 + 2 * len(sliders.force)
    past, now = [0.0] * (2 * LONGEST_ORBIT), [0.0] * size
    start_at_rest(sliders, room)
    while wait <= CYCLES_WAITED:
        code = follow(rig, sliders, force, leg, wait - waited - LONGEST_ORBIT, room)
        for k in range(LONGEST_ORBIT):
            past[2 * k], past[2 * k + 1] = room.start[0], room.start[1]
            if code == DONE:
                code = follow(rig, sliders, force, leg, 1.0, room)
        if code != DONE:
            return leg, inf, code
        extent = span_of(rig, room)
        for i in range(size):
            now[i] = room.start[i]
        for k in range(LONGEST_ORBIT - 1, -1, -1):
            if apart(rig, now, past[2 * k], past[2 * k + 1]) > 0.01 * extent:
                continue
            start_from(now, room)
            trial = Leg(0.0, TURN, float(LONGEST_ORBIT - k), 1.0)
            miss, code = shoot_elastic(rig, sliders, force, trial, room, NEAR_STEPS)
            near = apart(rig, now, room.start[0], room.start[1]) < 0.1 * extent and spread(rig, room, miss)
            if code == DONE and near and abs(elastic_multiplier(sliders, room)) <= 1.0 + 1e-9:
                return trial, miss, DONE
        start_from(now, room)
        waited, wait = wait, 2.0 * wait
        if wait * room.tally[PHASES] > PHASES_WAITED:
            break
    return leg, inf, DONE


def start_from(state: list[float], room: ElasticRoom) -> None:
    """Start from a state that was kept."""
    for i in range(len(state)):
        room.start[i] = state[i]


def apart(rig: Rig, state: list[float], z: float, v: float) -> float:
    """Return how far a state of the mass is from z, v."""
    return hypot(state[0] - z, rig.plain.r * (state[1] - v))


def elastic_multiplier(sliders: Sliders, room: ElasticRoom) -> float:
    """Return the multiplier of largest modulus of the leg last carried: signed if real, else the modulus.

    By squaring the map's derivative over and over: its 2^m-th root is what remains of the norm.
    """
    size = int(room.tally[COLUMNS])
    if size == 2:
        return spectral_radius(room.jacobian)
    first, power = [0.0] * (size * size), [0.0] * (size * size)
    for i in range(size):
        row = reduced(sliders, room, i)
        for j in range(size):
            first[i * size + j] = room.jacobian[row * size + j]
            power[i * size + j] = first[i * size + j]
    grown, weight = 0.0, 1.0
    for _ in range(SQUARINGS):
        norm = 0.0
        for i in range(size * size):
            norm = max(norm, abs(power[i]))
        if norm == 0.0:
            return 0.0
        grown += weight * log(norm)
        weight *= 0.5
        for i in range(size * size):
            power[i] /= norm
        power = product(power, power, size)
    return exp(grown) * sign_of_growth(first, power, size)


def product(left: list[float], right: list[float], size: int) -> list[float]:
    """Return the product of two square matrices, row by row."""
    out = [0.0] * (size * size)
    for i in range(size):
        for j in range(size):
            for k in range(size):
                out[i * size + j] += left[i * size + k] * right[k * size + j]
    return out


def sign_of_growth(first: list[float], power: list[float], size: int) -> float:
    """Return the sign by which a matrix turns its own high power round; 1 where it turns it some other way."""
    turned = product(first, power, size)
    same, length, other = 0.0, 0.0, 0.0
    for i in range(size * size):
        same += turned[i] * power[i]
        other += turned[i] * turned[i]
        length += power[i] * power[i]
    return -1.0 if same < 0.0 and same * same > 0.999999 * length * other else 1.0


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


def resonates(rig: Rig, force: Force) -> bool:
    """Tell whether a harmonic drives the slipping, undamped mass exactly at resonance harder than friction brakes."""
    for i in range(len(force.cosine)):
        drive = 0.25 * pi * hypot(force.cosine[i], force.sine[i])
        if rig.plain.zeta == 0.0 and gap(rig.plain.r, i + 1.0) == 0.0 and rig.contact.beta < drive:
            return rig.contact.gradient == 0.0
    return False


def is_even_handed(rig: Rig, force: Force) -> bool:
    """Tell whether the mirror image of a motion, half a cycle later, is a motion too."""
    alike = rig.contact.static_up == rig.contact.static_down and rig.contact.gradient == 0.0
    return alike and symmetric_force(force)


def at_once_elastic(rig: Rig, sliders: Sliders, force: Force, room: ElasticRoom) -> int:
    """Return the outcome that needs no search: RUNAWAY, UNBOUNDED or STUCK; PERIODIC: an orbit is to be found."""
    if abs(rig.contact.beta * rig.contact.gradient) >= 1.0:
        return RUNAWAY
    if resonates(rig, force):
        return UNBOUNDED
    return STUCK if never_slips(rig, sliders, force, room) else PERIODIC


def verdict(rig: Rig, room: ElasticRoom, miss: float, code: int) -> int:
    """Return the outcome of a search."""
    if code == PULLED:
        return PULLING
    if code != DONE:
        return CHATTERED
    return PERIODIC if miss <= 1e-9 * span_of(rig, room) + 1e-14 * rig.plain.rate else NOT_FOUND
