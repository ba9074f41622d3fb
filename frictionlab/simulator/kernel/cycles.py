"""Many steady states in one call: a map; and steady cycles on equally spaced phases, what a plan and a fit compare."""

from math import ceil, nan

from frictionlab.simulator.kernel.accounts import set_force, steady
from frictionlab.simulator.kernel.layout import (
    OUTCOME,
    PERIODIC,
    PHASE,
    PHASES,
    POINT,
    ROW,
    SIGN,
    START,
    START_Z,
    STUCK,
    TURN,
    TURNS,
    Buffer,
    Contact,
    Force,
    Rig,
    Room,
    State,
)
from frictionlab.simulator.kernel.motion import local_force, make_rig, slide_at

__all__ = ["cycles", "sample", "sweep"]


def sweep(points: Buffer, cosine: Buffer, sine: Buffer, force: Force, closed: int, room: Room, rows: Buffer) -> None:
    """Fill one row of `rows` for each point: r and the numbers of its contact; each by itself, whatever the chunks."""
    row = rows[:ROW].copy()
    for i in range(len(points) // POINT):
        at = POINT * i
        r, beta, gradient, up, down = points[at], points[at + 1], points[at + 2], points[at + 3], points[at + 4]
        contact = Contact(beta, gradient, up, down, points[at + 5], points[at + 6])
        set_force(r, contact.frame, cosine, sine, force, room.wall)
        steady(make_rig(r, contact, force), force, closed, room, row)
        for j in range(ROW):
            rows[ROW * i + j] = row[j]


def sample(rig: Rig, force: Force, row: Buffer, room: Room, at: int, count: int, out: Buffer) -> None:
    """Write z of a recorded orbit at `count` (even) phases of the drive from 0 into `out` from `at` on.

    A cycle is the mean over the orbit's cycles; of an orbit that repeats mirrored, half a cycle is recorded.
    """
    phases, mirrored, turns = room.phases, row[SIGN] < 0.0, row[TURNS]
    for j in range(count):
        out[at + j] = 0.0
    step, share = TURN / count, 1.0 / turns
    index = ceil(row[START] / step - 1e-12)
    last = index + int(turns) * (count // 2 if mirrored else count)
    end = row[START]
    for k in range(0, PHASE * int(room.tally[PHASES]), PHASE):
        begin, end = end, end + phases[k + 2]
        final = k + PHASE == PHASE * int(room.tally[PHASES])
        start = State(phases[k + 3], phases[k + 4], phases[k + 5])
        local_force(phases[k + 1], force)
        slide = rig.rising if phases[k] > 0.0 else rig.falling
        while index < last and (final or index * step < end):
            z = start.z
            if phases[k] != 0.0:
                way, _, _ = slide_at(min(max(index * step - begin, 0.0), phases[k + 2]), slide, force, start)
                z += way
            out[at + index % count] += share * z
            if mirrored:
                out[at + (index + count // 2) % count] -= share * z
            index += 1


def cycles(
    points: Buffer, cosine: Buffer, sine: Buffer, force: Force, room: Room, rows: Buffer, count: int, out: Buffer
) -> None:
    """As `sweep`, with z of each steady cycle at `count` phases in `out`; NaN where there is no steady state."""
    row = rows[:ROW].copy()
    for i in range(len(points) // POINT):
        at = POINT * i
        r, beta, gradient, up, down = points[at], points[at + 1], points[at + 2], points[at + 3], points[at + 4]
        contact = Contact(beta, gradient, up, down, points[at + 5], points[at + 6])
        set_force(r, contact.frame, cosine, sine, force, room.wall)
        rig = make_rig(r, contact, force)
        steady(rig, force, 0, room, row)
        for j in range(ROW):
            rows[ROW * i + j] = row[j]
        if row[OUTCOME] == PERIODIC:
            sample(rig, force, row, room, count * i, count, out)
        else:
            rest = row[START_Z] if row[OUTCOME] == STUCK else nan
            for j in range(count):
                out[count * i + j] = rest
