"""A motion, phase by phase: a slide (or the motion between two corners of an inner law), its end, a stop and its end.

Within a phase the right-hand side is smooth. A phase ends where its component (v; n in rate-and-state friction) comes
back to zero: that the polynomial of a step does not cross zero is proven by its Bernstein coefficients, all of one
sign; if they are not, the interval is halved until they are or a crossing is closed in. Then the step is made again so
that it ends at the crossing, by Newton's method on its length: the end is as good as a step's end, not as its
polynomial.
"""

from frictionlab.simulator.numeric.contact import acceleration, drive, factor, rates
from frictionlab.simulator.numeric.layout import (
    BUDGET,
    DAHL,
    FINE,
    LAST,
    LENGTH,
    NEGATIVE,
    NODES,
    ROW,
    ROWS,
    STALLED,
    STEPS,
    TOLERANCE,
    TOO_MANY,
    WIDTH,
    Buffer,
    Rig,
    Room,
)
from frictionlab.simulator.numeric.step import carry_slopes, coarseness, error_of, predict, step

SHORTEST = 1e-13  # share of a step: two crossings closer than this are one
SHORT = 1e-12  # rad: a phase so short is a second look at the same corner
TINY = 1e-14  # of the component that ends a phase: zero
LOOSE = 1e-12  # and what is taken for it after all looks
LOOKS = 10  # for the end of a phase
SHORTEST_TRY = 1e-10  # rad: a step so short crosses zero where its polynomial does
REST = 0.5  # longest recorded piece of a stop, rad over the number of harmonics
SAFETY, SHRINK, GROW = 0.85, 0.2, 4.0  # of a step's length


def record(room: Room, t: float, h: float, side: float) -> None:
    """Append the step in `values` to the log, as far as there is space; count it in any case."""
    log, tally = room.log, room.tally
    first = int(tally[ROWS]) * ROW
    tally[ROWS] += 1.0
    if first + ROW > len(log):
        return
    log[first], log[first + 1], log[first + 2] = t, h, side
    for i in range(NODES * WIDTH):
        log[first + 3 + i] = room.values[i]


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
    """A lower bound of the polynomial with the coefficients in `curve`, between two shares of the step."""
    part = room.part
    for i in range(NODES):
        part[i] = room.curve[i]
    cut_before(part, room.scratch, begin + width)
    cut_after(part, begin / (begin + width))
    lowest = part[0]
    for i in range(1, NODES):
        lowest = min(lowest, part[i])
    return lowest


def first_crossing(room: Room, side: float, component: int) -> float:
    """Share of the trial step at which its component first falls below zero; 2 if it is proven not to."""
    values, curve, matrix = room.trial, room.curve, room.bernstein
    tiny = -TINY * room.scale[component]
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


def guess(room: Room, size: int, h: float) -> None:
    """Write a first guess of the stages: the last step's polynomial drawn on, or straight on."""
    trial, state, last = room.trial, room.state, room.tally[LAST]
    if 0.0 < h < 3.0 * last:
        predict(room, size, 1.0, h / last)
        return
    for i in range(NODES):
        for k in range(WIDTH):
            trial[i * WIDTH + k] = state[k]
        trial[i * WIDTH] += h * room.nodes[i] * state[1]


def land(rig: Rig, room: Room, side: float, t: float, h: float, theta: float) -> float:
    """Make the trial step again so that it ends where its component falls through zero; -1 if it does not.

    The polynomial of a long step may cross zero where the motion does not (just after a release it moves like t^2):
    then the step must be shorter. The length is Newton's, kept between what is too short and what is too long.
    """
    size, component, values, trial = rig.size, rig.ending, room.values, room.trial
    for i in range(NODES * WIDTH):
        values[i] = trial[i]
    length, short, long = theta * h, 0.0, h
    for _ in range(LOOKS):
        predict(room, size, 0.0, length / h)
        if not step(rig, room, side, t, length):
            return -1.0
        left = side * trial[7 * WIDTH + component]
        rise = side * room.rate[6 * WIDTH + component]
        if abs(left) <= TINY * room.scale[component] and (rise < 0.0 or h < SHORTEST_TRY):
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
    return length if abs(left) <= LOOSE * room.scale[component] or h < SHORTEST_TRY else -1.0


def accept(room: Room, size: int, t: float, h: float, side: float) -> None:
    """Take the trial step: its end is the state, its polynomial is kept."""
    for i in range(NODES * WIDTH):
        room.values[i] = room.trial[i]
    for k in range(size):
        room.state[k] = room.trial[7 * WIDTH + k]
    if len(room.log) > 0:
        record(room, t, h, side)


def advance(rig: Rig, room: Room, side: float, t: float, end: float, slopes: bool, watch: bool) -> float:  # noqa: FBT001
    """Take one step from t, up to `end` at most; the time reached, negative (-1 - t) if the phase ends there."""
    size, tally = rig.size, room.tally
    while tally[STEPS] < tally[BUDGET]:
        h = min(tally[LENGTH], end - t)
        guess(room, size, h)
        if not step(rig, room, side, t, h):
            tally[LENGTH], tally[LAST] = 0.25 * h, 0.0
            continue
        error = max(error_of(room, size) / tally[TOLERANCE], coarseness(rig, room))
        change = SAFETY * max(error, 1e-12) ** (-1.0 / 7.0)
        if error > 1.0:
            tally[LENGTH] = h * max(SHRINK, change)
            continue
        theta = first_crossing(room, side, rig.ending) if watch else 2.0
        grown = h * min(GROW, max(SHRINK, change))
        tally[LENGTH] = grown if h >= tally[LENGTH] else max(grown, tally[LENGTH])
        landed = h
        if theta <= 1.0:
            landed = land(rig, room, side, t, h, theta)
            if landed < 0.0 or error_of(room, size) > tally[TOLERANCE] or coarseness(rig, room) > 1.0:
                tally[LENGTH], tally[LAST] = 0.25 * h if landed < 0.0 else 0.5 * landed, 0.0
                continue
        if slopes:
            carry_slopes(room, landed, size)
        accept(room, size, t, landed, side)
        tally[LAST] = landed
        reached = end if theta > 1.0 and h == end - t else t + landed
        return -1.0 - reached if theta <= 1.0 else reached
    return end + 1.0


def release(rig: Rig, room: Room, z: float, t: float, end: float) -> tuple[float, float]:
    """When and to which side a mass at rest at z breaks away: the first time after t, and before `end`."""
    friction, bound = rig.beta * (1.0 + rig.gradient * z), room.bounds[1]
    tiny = 1e-15 * (room.bounds[0] + abs(z) + friction)
    while t < end:
        pull, rate = drive(room, t)
        wait = end - t
        for side, hold in ((1.0, rig.static_up), (-1.0, rig.static_down)):
            left = hold * friction - side * (pull - z)
            fall = side * rate
            if left < -tiny or (left <= tiny and fall > 0.0):
                return t, side
            root = (fall * fall + 2.0 * bound * max(left, 0.0)) ** 0.5
            safe = 2.0 * max(left, 0.0) / (root + fall) if fall > 0.0 else (root - fall) / bound
            wait = min(wait, max(safe, 1e-15 * (1.0 + t)))
        t += wait
    return end, 0.0


def rest(rig: Rig, room: Room, t: float, end: float, before: float) -> tuple[float, float]:
    """What a mass at rest does at t: stay until it is released or the end comes; when it goes, and to which side.

    `before` is the acceleration with which it came to rest (0: it began there); it says how slopes are carried on.
    """
    state, slopes, z = room.state, room.slopes, room.state[0]
    go, side = release(rig, room, z, t, end)
    if go > t:
        for i in range(NODES * WIDTH):
            room.values[i] = state[i % WIDTH]
        count = int((go - t) * max(1, len(room.cosine)) / REST) + 1 if len(room.log) > 0 else 0
        for i in range(count):
            record(room, t + (go - t) * i / count, (go - t) / count, 0.0)
    pull, rate = drive(room, go)
    after = acceleration(rig, side, pull, z) if side != 0.0 else 0.0
    hold = rig.static_up if side > 0.0 else rig.static_down
    for j in range(2):
        if go > t or side == 0.0:
            slopes[WIDTH + j] = 0.0
            if side != 0.0 and rate != 0.0:
                slopes[WIDTH + j] = -after * (1.0 + side * hold * rig.beta * rig.gradient) / rate * slopes[j]
        elif before != 0.0:
            slopes[WIDTH + j] *= after / before
    return go, side


def choose_side(rig: Rig, room: Room, t: float) -> float:
    """Sign of the component that ends a phase, or of its rate where it is zero: laws with an inner state."""
    state, component = room.state, rig.ending
    if state[component] != 0.0:
        return 1.0 if state[component] > 0.0 else -1.0
    rates(rig, room, 1.0, drive(room, t)[0], state, 0, 0)
    rate = room.rate[component] if room.rate[component] != 0.0 else room.rate[1]
    return 1.0 if rate >= 0.0 else -1.0


def carry(rig: Rig, room: Room, t: float, span: float, slopes: bool) -> int:  # noqa: FBT001 - numba
    """Carry the state, and its slopes, from t over a span of time; how it ended."""
    state, tally, end = room.state, room.tally, t + span
    component, side, before, quick = rig.ending, 0.0, 0.0, 0
    tally[LAST] = 0.0
    while t < end:
        if side == 0.0 and rig.code < DAHL and state[1] == 0.0:
            t, side = rest(rig, room, t, end, before)
            continue
        if side == 0.0:
            side = choose_side(rig, room, t)
        begun, reached = t, advance(rig, room, side, t, end, slopes, quick < 3)
        if reached > end:
            return TOO_MANY
        if tally[LENGTH] < SHORTEST * SHORTEST:
            return STALLED
        height = factor(rig, side * state[1])[0] if rig.code < DAHL else 1.0
        if (1.0 + rig.gradient * state[0]) * height < 0.0:
            return NEGATIVE
        t = reached if reached >= 0.0 else -1.0 - reached
        if reached < 0.0:
            pull = drive(room, t)[0]
            before = acceleration(rig, side, pull, state[0]) if rig.code < DAHL else 0.0
            state[component], side, tally[LAST] = 0.0, 0.0, 0.0
            quick = quick + 1 if t - begun < SHORT and rig.code >= DAHL else 0
        elif quick >= 3:
            quick, side = 0, 0.0
    return FINE


def travel(
    rig: Rig, room: Room, pieces: tuple[Buffer, Buffer], first: int, share: tuple[float, int], ends: Buffer
) -> int:
    """Carry the state along a sampled drive, piece by piece from one of them on, while the log has space; how it ended.

    `ends` takes how many steps are recorded when each piece is over: where it stays below 0, a piece is still to do.

    Parameters
    ----------
    pieces : (list, list)
        Length of each, and the force in it: four coefficients over the time from its start.
    first : int
    share : (float, int)
        What is carried at once at most, rad, and the steps that may be recorded in it.
    """
    lengths, pull = pieces
    longest, most = share
    tally, space = room.tally, len(room.log) // ROW
    for i in range(first, len(lengths)):
        if tally[ROWS] + most > space:
            return FINE
        h, at = lengths[i], 4 * i
        for k in range(4):
            room.cosine[k] = pull[at + k]
        room.bounds[1] = 2.0 * abs(pull[at + 2]) + 6.0 * abs(pull[at + 3]) * h + 1e-300
        room.bounds[0] = abs(pull[at + 1]) + h * room.bounds[1]
        count = int(h / longest) + 1
        for part in range(count):
            tally[STEPS], begun = 0.0, tally[ROWS]
            code = carry(rig, room, h * part / count, h / count, False)  # noqa: FBT003 - numba
            if code != FINE:
                return code
            if tally[ROWS] > min(begun + most, space):
                return TOO_MANY
        ends[i] = tally[ROWS]
    return FINE
