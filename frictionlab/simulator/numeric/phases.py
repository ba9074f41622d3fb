"""A motion, phase by phase: a slide (or the motion between two corners of an inner law), its end, a stop and its end.

Within a phase the right-hand side is smooth. A phase ends where its component (v; n in rate-and-state friction) comes
back to zero: that the polynomial of a step does not cross zero is proven by its Bernstein coefficients, all of one
sign; if they are not, the interval is halved until they are or a crossing is closed in. Then the step is made again so
that it ends at the crossing, by Newton's method on its length: the end is as good as a step's end, not as its
polynomial.
"""

from frictionlab.simulator.numeric.contact import acceleration, factor, rates, series
from frictionlab.simulator.numeric.layout import (
    BUDGET,
    CURVE,
    DAHL,
    FINE,
    JACOBIAN,
    LAST,
    LENGTH,
    LOG,
    NEGATIVE,
    NODES,
    PART,
    RATE,
    ROW,
    ROWS,
    SCALE,
    SCRATCH,
    SLOPES,
    STALLED,
    STATE,
    STEPS,
    TALLY,
    TOLERANCE,
    TOO_MANY,
    TRIAL,
    VALUES,
    WIDTH,
    Buffer,
    Force,
    Rig,
    Room,
    Table,
)
from frictionlab.simulator.numeric.step import carry_slopes, coarseness, error_of, predict, step

__all__ = [
    "accept",
    "advance",
    "carry",
    "choose_side",
    "cut_after",
    "cut_before",
    "first_crossing",
    "guess",
    "land",
    "least_between",
    "record",
    "release",
    "rest",
]

SHORTEST = 1e-13  # share of a step: two crossings closer than this are one
SHORT = 1e-12  # rad: a phase so short is a second look at the same corner
TINY = 1e-14  # of the component that ends a phase: zero
LOOSE = 1e-12  # and what is taken for it after all looks
LOOKS = 10  # for the end of a phase
SHORTEST_TRY = 1e-10  # rad: a step so short crosses zero where its polynomial does
REST = 0.5  # longest recorded piece of a stop, rad over the number of harmonics
SAFETY, SHRINK, GROW = 0.85, 0.2, 4.0  # of a step's length


def record(room: Room, t: float, h: float, side: float) -> None:
    """Append the step in VALUES to the log, as far as there is space; count it in any case."""
    log, tally = room[LOG], room[TALLY]
    first = int(tally[ROWS]) * ROW
    tally[ROWS] += 1.0
    if first + ROW > len(log):
        return
    log[first], log[first + 1], log[first + 2] = t, h, side
    for i in range(NODES * WIDTH):
        log[first + 3 + i] = room[VALUES][i]


def cut_before(curve: Buffer, scratch: Buffer, theta: float) -> None:
    """De Casteljau: the Bernstein coefficients of the part before theta, in place."""
    for i in range(NODES):
        scratch[i] = curve[i]
    for level in range(1, NODES):
        for i in range(NODES - level):
            scratch[i] += theta * (scratch[i + 1] - scratch[i])
        curve[level] = scratch[0]


def cut_after(curve: Buffer, theta: float) -> None:
    """De Casteljau: the Bernstein coefficients of the part after theta, in place."""
    for level in range(1, NODES):
        for i in range(NODES - level):
            curve[i] += theta * (curve[i + 1] - curve[i])


def least_between(room: Room, begin: float, width: float) -> float:
    """A lower bound of the polynomial with the coefficients in CURVE, between two shares of the step."""
    part = room[PART]
    for i in range(NODES):
        part[i] = room[CURVE][i]
    cut_before(part, room[SCRATCH], begin + width)
    cut_after(part, begin / (begin + width))
    lowest = part[0]
    for i in range(1, NODES):
        lowest = min(lowest, part[i])
    return lowest


def first_crossing(table: Table, room: Room, side: float, component: int) -> float:
    """Share of the trial step at which its component first falls below zero; 2 if it is proven not to."""
    values, curve, matrix = room[TRIAL], room[CURVE], table[3]
    tiny = -TINY * room[SCALE][component]
    for i in range(NODES):
        total = 0.0
        for j in range(NODES):
            total += matrix[i * NODES + j] * values[j * WIDTH + component]
        curve[i] = side * total
    curve[0], curve[7] = side * values[component], side * values[7 * WIDTH + component]
    begin, width = 0.0, 1.0
    while begin + width > SHORTEST:
        if least_between(room, begin, width) >= tiny:
            begin += width
            if begin >= 1.0:
                return 2.0
            width = min(2.0 * width, 1.0 - begin)
        elif width < SHORTEST:
            return begin + width
        else:
            width *= 0.5
    return begin + width


def guess(room: Room, table: Table, size: int, h: float) -> None:
    """Write a first guess of the stages: the last step's polynomial drawn on, or straight on."""
    trial, state, last = room[TRIAL], room[STATE], room[TALLY][LAST]
    if 0.0 < h < 3.0 * last:
        predict(table, room, size, 1.0, h / last)
        return
    for i in range(NODES):
        for k in range(WIDTH):
            trial[i * WIDTH + k] = state[k]
        trial[i * WIDTH] += h * table[0][i] * state[1]


def land(rig: Rig, force: Force, table: Table, room: Room, task: tuple[float, float, float, float, int]) -> float:
    """Make the trial step again so that it ends where its component falls through zero; -1 if it does not.

    The polynomial of a long step may cross zero where the motion does not (just after a release it moves like t^2):
    then the step must be shorter. The length is Newton's, kept between what is too short and what is too long.
    """
    side, t, h, theta, size = task
    component, values, trial = int(rig[14]), room[VALUES], room[TRIAL]
    for i in range(NODES * WIDTH):
        values[i] = trial[i]
    length, short, long = theta * h, 0.0, h
    for _ in range(LOOKS):
        predict(table, room, size, 0.0, length / h)
        if not step(rig, force, table, room, (side, t, length, size)):
            return -1.0
        left = side * trial[7 * WIDTH + component]
        rise = side * room[RATE][6 * WIDTH + component]
        if abs(left) <= TINY * room[SCALE][component] and (rise < 0.0 or h < SHORTEST_TRY):
            return length
        if left < 0.0:
            long = length
        elif rise >= 0.0 and h > SHORTEST_TRY:
            return -1.0
        else:
            short = length
        length = length - left / rise if rise < 0.0 else short
        if not short < length < long:
            length = 0.5 * (short + long)
    return length if abs(left) <= LOOSE * room[SCALE][component] or h < SHORTEST_TRY else -1.0


def accept(room: Room, size: int, t: float, h: float, side: float) -> None:
    """Take the trial step: its end is the state, its polynomial is kept."""
    for i in range(NODES * WIDTH):
        room[VALUES][i] = room[TRIAL][i]
    for k in range(size):
        room[STATE][k] = room[TRIAL][7 * WIDTH + k]
    if len(room[LOG]) > 0:
        record(room, t, h, side)


def advance(rig: Rig, force: Force, table: Table, room: Room, task: tuple[float, float, float, bool, bool]) -> float:
    """Take one step from t, up to `end` at most; the time reached, negative (-1 - t) if the phase ends there."""
    side, t, end, slopes, watch = task
    size, tally = int(rig[13]), room[TALLY]
    while tally[STEPS] < tally[BUDGET]:
        h = min(tally[LENGTH], end - t)
        guess(room, table, size, h)
        if not step(rig, force, table, room, (side, t, h, size)):
            tally[LENGTH], tally[LAST] = 0.25 * h, 0.0
            continue
        error = max(error_of(table, room, size) / tally[TOLERANCE], coarseness(rig, room))
        change = SAFETY * max(error, 1e-12) ** (-1.0 / 7.0)
        if error > 1.0:
            tally[LENGTH] = h * max(SHRINK, change)
            continue
        theta = first_crossing(table, room, side, int(rig[14])) if watch else 2.0
        grown = h * min(GROW, max(SHRINK, change))
        tally[LENGTH] = grown if h >= tally[LENGTH] else max(grown, tally[LENGTH])
        landed = h
        if theta <= 1.0:
            landed = land(rig, force, table, room, (side, t, h, theta, size))
            if landed < 0.0 or error_of(table, room, size) > tally[TOLERANCE] or coarseness(rig, room) > 1.0:
                tally[LENGTH], tally[LAST] = 0.25 * h if landed < 0.0 else 0.5 * landed, 0.0
                continue
        if slopes:
            carry_slopes(table, room, landed, size)
        accept(room, size, t, landed, side)
        tally[LAST] = landed
        reached = end if theta > 1.0 and h == end - t else t + landed
        return -1.0 - reached if theta <= 1.0 else reached
    return end + 1.0


def release(rig: Rig, force: Force, z: float, t: float, end: float) -> tuple[float, float]:
    """When and to which side a mass at rest at z breaks away: the first time after t, and before `end`."""
    friction, bound = rig[2] * (1.0 + rig[3] * z), rig[16]
    tiny = 1e-15 * (rig[15] + abs(z) + friction)
    while t < end:
        pull, rate = series(force[0], force[1], t)
        wait = end - t
        for side, hold in ((1.0, rig[11]), (-1.0, rig[12])):
            left = hold * friction - side * (pull - z)
            fall = side * rate
            if left < -tiny or (left <= tiny and fall > 0.0):
                return t, side
            root = (fall * fall + 2.0 * bound * max(left, 0.0)) ** 0.5
            safe = 2.0 * max(left, 0.0) / (root + fall) if fall > 0.0 else (root - fall) / bound
            wait = min(wait, max(safe, 1e-15 * (1.0 + t)))
        t += wait
    return end, 0.0


def rest(rig: Rig, force: Force, room: Room, task: tuple[float, float, float]) -> tuple[float, float]:
    """What a mass at rest does at t: stay until it is released or the end comes; when it goes, and to which side.

    `before` is the acceleration with which it came to rest (0: it began there); it says how slopes are carried on.
    """
    t, end, before = task
    state, slopes, z = room[STATE], room[SLOPES], room[STATE][0]
    go, side = release(rig, force, z, t, end)
    if go > t:
        for i in range(NODES * WIDTH):
            room[VALUES][i] = state[i % WIDTH]
        count = int((go - t) * max(1, len(force[0])) / REST) + 1 if len(room[LOG]) > 0 else 0
        for i in range(count):
            record(room, t + (go - t) * i / count, (go - t) / count, 0.0)
    pull, rate = series(force[0], force[1], go)
    after = acceleration(rig, side, pull, z, 0.0, 0.0) if side != 0.0 else 0.0
    hold = rig[11] if side > 0.0 else rig[12]
    for j in range(2):
        if go > t or side == 0.0:
            slopes[WIDTH + j] = 0.0
            if side != 0.0 and rate != 0.0:
                slopes[WIDTH + j] = -after * (1.0 + side * hold * rig[2] * rig[3]) / rate * slopes[j]
        elif before != 0.0:
            slopes[WIDTH + j] *= after / before
    return go, side


def choose_side(rig: Rig, force: Force, room: Room, t: float) -> float:
    """Sign of the component that ends a phase, or of its rate where it is zero: laws with an inner state."""
    state, component = room[STATE], int(rig[14])
    if state[component] != 0.0:
        return 1.0 if state[component] > 0.0 else -1.0
    rates(rig, 1.0, series(force[0], force[1], t)[0], (state, 0), (room[RATE], room[JACOBIAN], 0))
    rate = room[RATE][component] if room[RATE][component] != 0.0 else room[RATE][1]
    return 1.0 if rate >= 0.0 else -1.0


def carry(rig: Rig, force: Force, table: Table, room: Room, task: tuple[float, float, bool]) -> int:
    """Carry the state, and its slopes, from t over a span of time; how it ended."""
    t, span, slopes = task
    state, tally, end = room[STATE], room[TALLY], t + span
    component, side, before, quick = int(rig[14]), 0.0, 0.0, 0
    tally[LAST] = 0.0
    while t < end:
        if side == 0.0 and rig[0] < DAHL and state[1] == 0.0:
            t, side = rest(rig, force, room, (t, end, before))
            continue
        if side == 0.0:
            side = choose_side(rig, force, room, t)
        begun, reached = t, advance(rig, force, table, room, (side, t, end, slopes, quick < 3))
        if reached > end:
            return TOO_MANY
        if tally[LENGTH] < SHORTEST * SHORTEST:
            return STALLED
        height = factor(rig, side * state[1])[0] if rig[0] < DAHL else 1.0
        if (1.0 + rig[3] * state[0]) * height < 0.0:
            return NEGATIVE
        t = reached if reached >= 0.0 else -1.0 - reached
        if reached < 0.0:
            pull = series(force[0], force[1], t)[0]
            before = acceleration(rig, side, pull, state[0], 0.0, 0.0) if rig[0] < DAHL else 0.0
            state[component], side, tally[LAST] = 0.0, 0.0, 0.0
            quick = quick + 1 if t - begun < SHORT and rig[0] >= DAHL else 0
        elif quick >= 3:
            quick, side = 0, 0.0
    return FINE
