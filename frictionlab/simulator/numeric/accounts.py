"""What is reported of a recorded motion: energies two ways, extremes, stops; by quadrature on the steps' own nodes.

    dissipated:  integral n v + 2 zeta_f r integral (speed of the frame's dashpot)^2
    put in:      - integral z G'  (+ 2 zeta_f r integral f'^2 with a fixed wall),  G = f - 2 zeta_f r f', or F

The first comes from forces and speeds, the second from displacements only: integrated by parts, so that they agree no
better than the steps are.
"""

from frictionlab.simulator.numeric.contact import contact, series, slip_speed
from frictionlab.simulator.numeric.layout import (
    FRAME,
    HIGH,
    INPUT,
    LOG,
    LOW,
    ROW,
    ROWS,
    STAGES,
    TALLY,
    VALUES,
    WIDTH,
    WORK,
    Buffer,
    Force,
    Rig,
    Room,
    Table,
)
from frictionlab.simulator.numeric.step import at_node

__all__ = ["account", "account_row", "extreme", "forces", "seen_at", "slips"]


def seen_at(force: Force, table: Table, room: Room, t: float, h: float, theta: float) -> tuple[float, float]:
    """Displacement x and velocity of the mass within the step in VALUES."""
    f, rate = series(force[4], force[5], t + theta * h)
    return at_node(table, room, theta, 0) + f, at_node(table, room, theta, 1) + rate


def extreme(force: Force, table: Table, room: Room, task: tuple[float, float, float, float]) -> float:
    """Displacement x where its velocity changes sign, between two shares of the step in VALUES."""
    t, h, low, high = task
    falling = seen_at(force, table, room, t, h, low)[1]
    for _ in range(30):
        middle = 0.5 * (low + high)
        if (seen_at(force, table, room, t, h, middle)[1] > 0.0) == (falling > 0.0):
            low = middle
        else:
            high = middle
    return seen_at(force, table, room, t, h, 0.5 * (low + high))[0]


def account_row(rig: Rig, force: Force, table: Table, room: Room, first: int) -> None:
    """Add one recorded step to the tally."""
    log, tally, values = room[LOG], room[TALLY], room[VALUES]
    t, h, side = log[first], log[first + 1], log[first + 2]
    for i in range(len(values)):
        values[i] = log[first + 3 + i]
    last_theta, last_speed = 0.0, 0.0
    for i in range(STAGES + 1):
        theta = table[0][i]
        z, v, w = values[i * WIDTH], values[i * WIDTH + 1], values[i * WIDTH + 2]
        x, speed = z, v
        if len(force[4]) > 0:
            f, rate = series(force[4], force[5], t + theta * h)
            x, speed = z + f, v + rate
        tally[HIGH], tally[LOW] = max(tally[HIGH], x), min(tally[LOW], x)
        if i > 0 and last_speed * speed < 0.0:
            x = extreme(force, table, room, (t, h, last_theta, theta))
            tally[HIGH], tally[LOW] = max(tally[HIGH], x), min(tally[LOW], x)
        last_theta, last_speed = theta, speed
        if i > 0:
            weight = h * table[2][(STAGES - 1) * STAGES + i - 1]
            drag = v - series(force[2], force[3], t + theta * h)[1] if rig[5] > 0.0 else 0.0
            tally[WORK] += weight * v * contact(rig, side, z, v, w)[0] if side != 0.0 else 0.0
            tally[FRAME] += weight * 2.0 * rig[5] * rig[1] * drag * drag
            tally[INPUT] -= weight * z * series(force[6], force[7], t + theta * h)[1]


def account(rig: Rig, force: Force, table: Table, room: Room) -> None:
    """Fill the tally from the recorded steps."""
    tally = room[TALLY]
    tally[WORK], tally[FRAME], tally[INPUT] = 0.0, 0.0, 0.0
    tally[HIGH], tally[LOW] = -1e300, 1e300
    for i in range(int(tally[ROWS])):
        account_row(rig, force, table, room, i * ROW)


def slips(rig: Rig, room: Room, out: Buffer) -> None:
    """Write the speed of slip at each node of the recorded steps."""
    log = room[LOG]
    for i in range(int(room[TALLY][ROWS])):
        side = log[i * ROW + 2]
        for j in range(STAGES + 1):
            k = i * ROW + 3 + j * WIDTH
            out[i * (STAGES + 1) + j] = abs(slip_speed(rig, side, log[k], log[k + 1], log[k + 2], log[k + 3]))


def forces(rig: Rig, sides: Buffer, states: Buffer, out: Buffer) -> None:
    """Write the contact's force at each of many states; side 0, at rest, has none of its own."""
    for i in range(len(sides)):
        k = i * WIDTH
        out[i] = contact(rig, sides[i], states[k], states[k + 1], states[k + 2])[0]
