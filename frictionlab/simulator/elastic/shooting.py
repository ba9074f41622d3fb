"""Newton steps in mass and sliders to the motion that repeats, and the multiplier of what it finds."""

from math import exp, hypot, log, sqrt

from frictionlab.simulator.elastic.events import carry_elastic
from frictionlab.simulator.elastic.layout import ElasticRoom, Sliders
from frictionlab.simulator.elastic.residues import unstrain
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.layout import Force, Leg, Rig
from frictionlab.simulator.kernel.resonance import solve_linear
from frictionlab.simulator.kernel.shooting import spectral_radius

MOST_TURNS = 16.0  # of the map, in place of a Newton step that does not help
SLOWLY = 4.0  # maps in a row, from which sliders that do not slip for good are relaxed
SQUARINGS = 40  # of the map's derivative: its largest multiplier to 2^-40


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
    for i in range(2 + 2 * len(sliders.force)):
        room.start[i] = room.image[i]
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


def adopt(sliders: Sliders, room: ElasticRoom) -> None:
    """Remember the start, from which Newton's correction is taken, and its image."""
    for i in range(2 + 2 * len(sliders.force)):
        room.trial[i] = room.start[i]
        room.known[i] = room.image[i]


def give_up(sliders: Sliders, room: ElasticRoom) -> None:
    """Go back to the start from which Newton's correction was taken, and its image."""
    for i in range(2 + 2 * len(sliders.force)):
        room.start[i], room.image[i] = room.trial[i], room.known[i]


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
        adopt(sliders, room)
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
        give_up(sliders, room)
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
