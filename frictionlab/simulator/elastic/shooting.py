"""Newton steps in mass and sliders to the motion that repeats; its multiplier; and what sliders hold that never slip.

That is arbitrary, as far as the orbit goes, so a rule says it. Without a gradient it shifts the orbit and changes
nothing else: they are relaxed, as far as their limits allow. With one it changes friction too, and it is what the
motion from rest leaves in them.
"""

from math import exp, hypot, inf, log, sqrt

from frictionlab.simulator.elastic.events import carry_elastic
from frictionlab.simulator.elastic.layout import ElasticRoom, OrbitGuess, Sliders
from frictionlab.simulator.elastic.starts import held_offset
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.layout import Buffer, Force, Leg, Rig
from frictionlab.simulator.kernel.resonance import solve_linear
from frictionlab.simulator.kernel.shooting import spectral_radius

STRAINED = 1e-12  # of its strength: a slider that holds so much more than need be is relaxed
SAME = 1e-9  # of its strength: by which what a slider holds may differ, but for rounding
MOST_TURNS = 16.0  # of the map, in place of a Newton step that does not help
SLOWLY = 4.0  # maps in a row, from which sliders that do not slip for good are relaxed
SQUARINGS = 40  # of the map's derivative: its largest multiplier to 2^-40


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


def distance(rig: Rig, sliders: Sliders, room: ElasticRoom) -> float:
    """Return by how much the image misses the start: in the norm that dry friction never lets grow (README)."""
    start, image = room.start, room.image
    total = (image[0] - start[0]) ** 2 + (rig.plain.r * (image[1] - start[1])) ** 2
    for i in range(len(sliders.force)):
        if room.kinds[i] == layout.FREE:
            total += (image[2 + 2 * i] - start[2 + 2 * i]) ** 2 / max(sliders.stiffness[i], 1e-300)
    return sqrt(total)


def span_of(rig: Rig, room: ElasticRoom) -> float:
    """Return the size of a motion, against which its miss is judged."""
    return hypot(room.start[0], rig.plain.r * room.start[1]) + max(
        0.0, room.tally[layout.HIGH] - room.tally[layout.LOW]
    )


def spread(rig: Rig, room: ElasticRoom, miss: float) -> bool:
    """Tell whether a miss is nothing but rounding."""
    return miss <= 1e-12 * span_of(rig, room) + 1e-14 * rig.plain.rate


def classify(sliders: Sliders, room: ElasticRoom) -> None:
    """Say of each slider what its force is at the section, from the leg just run: SLIDING, OUTER or FREE."""
    for i in range(len(sliders.force)):
        if room.image[3 + 2 * i] != 0.0:
            room.kinds[i] = layout.SLIDING
        else:
            room.kinds[i] = layout.FREE if sliders.slips[i] > 0.0 else layout.OUTER


def keeps_kinds(sliders: Sliders, room: ElasticRoom) -> bool:
    """Tell whether the leg bore out what was assumed of the sliders at its start, so that Newton may use it."""
    for i in range(len(sliders.force)):
        side = room.start[3 + 2 * i] if room.kinds[i] == layout.SLIDING else 0.0
        if room.image[3 + 2 * i] != side or (room.kinds[i] == layout.OUTER and sliders.slips[i] > 0.0):
            return False
    return True


def back_to_start(rig: Rig, sliders: Sliders, leg: Leg, room: ElasticRoom) -> None:
    """Take the image as the new start; in a mirrored leg a slider that never slips is relaxed at z = 0."""
    keep(room.image, room.start)
    for i in range(len(sliders.force)):
        if room.kinds[i] == layout.OUTER and leg.sign < 0.0:
            relaxed, limit = sliders.stiffness[i] * room.start[0], sliders.strength[i]
            if abs(relaxed) <= limit * (1.0 + rig.contact.gradient * room.start[0]):
                room.start[2 + 2 * i] = relaxed  # else it slips before long: the motion goes on as it is


def reduced(sliders: Sliders, room: ElasticRoom, row: int) -> int:
    """Return which row of the jacobian the unknown number `row` of Newton's equations is."""
    if row < 2:
        return row
    free = 2
    for i in range(len(sliders.force)):
        if room.kinds[i] == layout.FREE:
            if free == row:
                return 2 + i
            free += 1
    return -1


def newton_step(sliders: Sliders, room: ElasticRoom) -> bool:
    """Write Newton's correction of the unknowns into the last column of the matrix; False if there is none."""
    size = int(room.tally[layout.COLUMNS])
    width = size + 1
    for i in range(size):
        row = reduced(sliders, room, i)
        for j in range(size):
            room.matrix[i * width + j] = (1.0 if i == j else 0.0) - room.jacobian[row * size + j]
        at = row if row < 2 else 2 * row - 2
        room.matrix[i * width + size] = room.image[at] - room.start[at]
    return solve_linear(room.matrix, size)


def step_towards(rig: Rig, sliders: Sliders, room: ElasticRoom) -> None:
    """Move the start by Newton's correction, from `trial`; sliders that are no unknowns follow."""
    size = int(room.tally[layout.COLUMNS])
    correction = room.matrix
    dz, dv = correction[size], correction[2 * size + 1]
    room.start[0], room.start[1] = room.trial[0] + dz, room.trial[1] + dv
    load = 1.0 + rig.contact.gradient * room.start[0]
    free = 2
    for i in range(len(sliders.force)):
        at = 2 + 2 * i
        room.start[at + 1] = room.trial[at + 1]
        if room.kinds[i] == layout.FREE:
            force = room.trial[at] + correction[free * (size + 1) + size]
            room.start[at] = max(-sliders.strength[i] * load, min(sliders.strength[i] * load, force))
            free += 1
        elif room.kinds[i] == layout.OUTER:
            room.start[at] = room.trial[at] + sliders.stiffness[i] * dz
        else:
            room.start[at] = room.trial[at + 1] * sliders.strength[i] * load


def keep(state: Buffer, copy: Buffer) -> None:
    """Write a state into another buffer."""
    for i in range(len(state)):
        copy[i] = state[i]


def follow(rig: Rig, sliders: Sliders, force: Force, leg: Leg, times: float, room: ElasticRoom) -> int:
    """Apply the leg's map so many times; return how the motion ended."""
    code = layout.DONE
    for _ in range(int(times)):
        code = carry_elastic(rig, sliders, force, leg, room, layout.PLAIN)
        if code != layout.DONE:
            break
        classify(sliders, room)
        back_to_start(rig, sliders, leg, room)
    return code


def closes(rig: Rig, room: ElasticRoom, miss: float) -> bool:
    """Tell whether a miss is so small that nothing is gained by a smaller one: neither in state nor in energy."""
    size, spent = span_of(rig, room), abs(room.tally[layout.CONTACT] + room.tally[layout.VISCOUS])
    return miss <= 2e-16 * size or (miss <= 4e-15 * size and miss * (size + rig.contact.beta) <= 1e-13 * spent)


def shoot_elastic(
    rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom, steps: float, patience: float
) -> tuple[float, int]:
    """Bring the room's start to the fixed point of the leg's map; return its miss and how the last motion ended.

    Newton with the exact derivative; where a step does not halve the miss, or sliders do other than was assumed, the
    map itself is applied: once, then twice, and so on, as often as patience allows. The last motion carried is that
    from the start.
    """
    code = carry_elastic(rig, sliders, force, leg, room, layout.DERIVED)
    return shoot_on(rig, sliders, force, leg, room, steps, patience, code)


def shoot_on(
    rig: Rig, sliders: Sliders, force: Force, leg: Leg, room: ElasticRoom, steps: float, patience: float, code: int
) -> tuple[float, int]:
    """As `shoot_elastic`, where the leg has just been carried with its derivative, and ended in `code`."""
    turns, floor = 1.0, 1e-15 * rig.plain.rate
    for _ in range(int(steps)):
        miss, size = distance(rig, sliders, room), span_of(rig, room)
        as_assumed = keeps_kinds(sliders, room)
        if code != layout.DONE or (as_assumed and closes(rig, room, miss)):
            break
        there = as_assumed and miss <= 1e-13 * size + floor
        keep(room.start, room.trial)
        keep(room.image, room.known)
        if not as_assumed:
            classify(sliders, room)
        elif newton_step(sliders, room):
            step_towards(rig, sliders, room)
            code = carry_elastic(rig, sliders, force, leg, room, layout.DERIVED)
            less = distance(rig, sliders, room)
            borne_out = code == layout.DONE and keeps_kinds(sliders, room)
            if borne_out and less < 0.5 * miss:
                continue
            if there and borne_out and less <= 1e-13 * size + floor:
                return less, code  # only rounding is left
        keep(room.trial, room.start)
        keep(room.known, room.image)
        if there or patience <= 0.0:  # there: a step leads away, no derivative to trust
            return miss, carry_elastic(rig, sliders, force, leg, room, layout.DERIVED)
        back_to_start(rig, sliders, leg, room)
        follow(rig, sliders, force, leg, turns - 1.0, room)
        code = carry_elastic(rig, sliders, force, leg, room, layout.DERIVED)
        if (
            turns >= SLOWLY
            and code == layout.DONE
            and rig.contact.gradient == 0.0
            and unstrain(rig, sliders, leg, room)
        ):
            code = carry_elastic(
                rig, sliders, force, leg, room, layout.DERIVED
            )  # what only just touches its limit takes for ever
        turns, patience = min(2.0 * turns, MOST_TURNS), patience - turns
    return distance(rig, sliders, room), code


def elastic_multiplier(sliders: Sliders, room: ElasticRoom) -> float:
    """Return the multiplier of largest modulus of the leg last carried: signed if real, else the modulus.

    By squaring the map's derivative over and over: its 2^m-th root is what remains of the norm.
    """
    size = int(room.tally[layout.COLUMNS])
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
