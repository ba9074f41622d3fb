"""A motion along a sampled record: piece by piece, the base a cubic in each; what is reported of it, as it goes.

Each piece is carried by `phases.carry`, whose drive is then a polynomial in the time from the piece's start. Its steps
are accounted for at once and forgotten, so that a record may be as long as memory holds its samples.
"""

from frictionlab.simulator.numeric.contact import contact, series, slip_speed
from frictionlab.simulator.numeric.layout import (
    DAHL,
    EVENT,
    FINE,
    IS_OPEN,
    IS_SLOW,
    LAST_SLIP,
    LAST_TIME,
    LOG,
    NEXT_WAY,
    PLACE,
    ROW,
    ROWS,
    SEEN_EVENTS,
    SEEN_FRAME,
    SEEN_INPUT,
    SEEN_PATH,
    SEEN_SQUARED,
    SEEN_STOPS,
    SEEN_STUCK,
    SEEN_WORK,
    SINCE,
    STAGES,
    STATE,
    STEPS,
    TALLY,
    TOO_MANY,
    UNTIL,
    WAY,
    WIDTH,
    Buffer,
    Force,
    Rig,
    Room,
    Table,
)
from frictionlab.simulator.numeric.phases import carry

__all__ = ["account_step", "close", "finish", "force_now", "look", "note", "set_piece", "travel"]


def note(seen: Buffer, events: Buffer, t: float, what: float, z: float) -> None:
    """Write one event down, if there is room; count it in any case."""
    at = EVENT * int(seen[SEEN_EVENTS])
    seen[SEEN_EVENTS] += 1.0
    if at + EVENT <= len(events):
        events[at], events[at + 1], events[at + 2] = t, what, z


def finish(seen: Buffer, events: Buffer, shortest: float) -> None:
    """Judge a slow time that has ended: a stop if it lasted, else a turn if the direction is another."""
    seen[IS_OPEN] = 0.0
    lasted, way = seen[UNTIL] - seen[SINCE], seen[NEXT_WAY]
    if lasted > shortest:
        seen[SEEN_STUCK] += lasted
        seen[SEEN_STOPS] += abs(seen[WAY])
        note(seen, events, seen[SINCE], 0.0, seen[PLACE])
    if way != 0.0 and (lasted > shortest or way != seen[WAY]):
        note(seen, events, seen[UNTIL], way, seen[PLACE])
        seen[WAY] = way


def look(seen: Buffer, events: Buffer, limits: tuple[float, float, float], t: float, slip: float, z: float) -> None:
    """Watch for stops: what a node's slip adds to what the nodes before it showed.

    `limits`: the speed below which slip is slow, the shortest stop, the longest slip that is part of a stop.
    """
    slow, shortest, gap = limits
    is_slow, last, gone = abs(slip) < slow, abs(seen[LAST_SLIP]), seen[LAST_TIME]
    change = abs(slip) - last
    crossed = gone + (t - gone) * min(1.0, max(0.0, (slow - last) / change)) if change != 0.0 else t
    if is_slow and seen[IS_SLOW] == 0.0:
        if seen[IS_OPEN] == 0.0 or crossed - seen[UNTIL] >= gap:
            if seen[IS_OPEN] != 0.0:
                finish(seen, events, shortest)
            seen[SINCE], seen[PLACE] = crossed, z
        seen[IS_SLOW], seen[IS_OPEN] = 1.0, 0.0
    elif not is_slow:
        way = 1.0 if slip > 0.0 else -1.0
        if seen[IS_SLOW] != 0.0:
            seen[IS_SLOW], seen[IS_OPEN], seen[UNTIL], seen[NEXT_WAY] = 0.0, 1.0, crossed, way
        if seen[IS_OPEN] != 0.0 and t - seen[UNTIL] >= gap:
            finish(seen, events, shortest)
        if seen[IS_OPEN] == 0.0 and way != seen[WAY]:
            note(seen, events, t, way, z)
            seen[WAY] = way
    seen[LAST_TIME], seen[LAST_SLIP] = t, slip


def account_step(
    rig: Rig,
    force: Force,
    table: Table,
    room: Room,
    task: tuple[int, float],
    limits: tuple[float, float, float],
    seen: Buffer,
    events: Buffer,
) -> None:
    """Add one recorded step to what is seen; `task`: where it stands in the log, and when its piece began."""
    first, begin = task
    log = room[LOG]
    t, h, side = log[first], log[first + 1], log[first + 2]
    for j in range(STAGES + 1):
        at = t + table[0][j] * h
        k = first + 3 + j * WIDTH
        z, v, w, p = log[k], log[k + 1], log[k + 2], log[k + 3]
        pull, rate = series(force[0], force[1], at)
        slip = 0.0 if side == 0.0 else slip_speed(rig, side, z, v, w, p)
        if rig[0] < DAHL and side != 0.0:
            slip = side
        look(seen, events, limits, begin + at, slip, z)
        if j == 0:
            seen[SEEN_INPUT] -= pull * z
            continue
        if j == STAGES:
            seen[SEEN_INPUT] += pull * z
        weight = h * table[2][(STAGES - 1) * STAGES + j - 1]
        drag = v - series(force[2], force[3], at)[1]
        seen[SEEN_INPUT] -= weight * z * rate
        seen[SEEN_SQUARED] += weight * v * v
        seen[SEEN_FRAME] += weight * drag * drag
        if side != 0.0:
            seen[SEEN_WORK] += weight * v * contact(rig, side, z, v, w)[0]
            seen[SEEN_PATH] += weight * abs(v if rig[0] < DAHL else slip)


def force_now(rig: Rig, force: Force, room: Room, t: float) -> float:
    """Force of the contact on the mass at t of a piece: what holds it where it rests."""
    state = room[STATE]
    if rig[0] < DAHL and state[1] == 0.0:
        return series(force[0], force[1], t)[0] - state[0]
    return contact(rig, 1.0 if state[1] >= 0.0 else -1.0, state[0], state[1], state[2])[0]


def set_piece(rig: Rig, force: Force, pieces: tuple[Buffer, Buffer, Buffer, Buffer], i: int) -> Rig:
    """Let the force be that of piece i, and return the rig with its bounds of |F'| and |F''|."""
    _, lengths, base, pull = pieces
    h, first = lengths[i], 4 * i
    for k in range(4):
        force[0][k], force[2][k] = pull[first + k], base[first + k]
    second = 2.0 * abs(pull[first + 2]) + 6.0 * abs(pull[first + 3]) * h + 1e-300
    return (*rig[:15], abs(pull[first + 1]) + h * second, second, *rig[17:])


def travel(
    rig: Rig,
    force: Force,
    table: Table,
    room: Room,
    pieces: tuple[Buffer, Buffer, Buffer, Buffer],
    motion: tuple[Buffer, Buffer, Buffer],
    limits: tuple[float, float, float],
    seen: Buffer,
    events: Buffer,
    longest: float,
) -> tuple[int, int]:
    """Carry the state through pieces; fill the motion at their ends (z, v, contact force); how many, and how it ended.

    `pieces`: start and length of each, coefficients (four each) of the base and of the force F in the time from the
    start. `longest`: what is carried at once at most, rad.
    """
    starts, lengths = pieces[0], pieces[1]
    tally, most = room[TALLY], len(room[LOG]) // ROW
    for i in range(len(lengths)):
        here, h = set_piece(rig, force, pieces, i), lengths[i]
        count = int(h / longest) + 1
        for part in range(count):
            tally[ROWS], tally[STEPS] = 0.0, 0.0
            code = carry(here, force, table, room, (h * part / count, h / count, False))
            if code != FINE:
                return i, code
            if tally[ROWS] > most:
                return i, TOO_MANY
            for row in range(int(tally[ROWS])):
                account_step(here, force, table, room, (row * ROW, starts[i]), limits, seen, events)
        motion[0][i], motion[1][i] = room[STATE][0], room[STATE][1]
        motion[2][i] = force_now(here, force, room, h)
    return len(lengths), FINE


def close(seen: Buffer, events: Buffer, shortest: float, t: float) -> None:
    """Write down the stop that the motion ends in, or the one that was not yet judged."""
    if seen[IS_SLOW] != 0.0:
        seen[UNTIL], seen[NEXT_WAY] = t, 0.0
        finish(seen, events, shortest)
    elif seen[IS_OPEN] != 0.0:
        finish(seen, events, shortest)
