"""What is reported of a motion: works, range, stops; one row per steady state, many rows per call."""

from math import cos, hypot, nan, pi, sin

from frictionlab.simulator.kernel.events import carry, jerk_bound, safe_step
from frictionlab.simulator.kernel.layout import (
    AMPLITUDE,
    CLOSED_FORM,
    CLOSURE,
    ENERGY,
    FIRST,
    HIGH,
    LAST,
    LOW,
    MISS,
    MULTIPLIER,
    NOT_FOUND,
    OUTCOME,
    OVERFULL,
    PATH,
    PERIOD,
    PERIODIC,
    PHASE,
    PHASES,
    ROW,
    SIGN,
    SPAN,
    START,
    START_V,
    START_Z,
    STOPS,
    STOPS_MADE,
    STUCK,
    STUCK_SHARE,
    STUCK_TIME,
    SYMMETRIC,
    TURN,
    TURNS,
    UNBOUNDED,
    VISCOUS,
    WORK,
    Buffer,
    Force,
    Leg,
    Rig,
    Room,
    State,
)
from frictionlab.simulator.kernel.motion import local_force, make_rig, slide_at
from frictionlab.simulator.kernel.orbits import find_orbit, spectral_radius, symmetric_force

__all__ = ["account", "evaluate", "fill_row", "mirrored", "set_force", "slide_range", "slide_work", "steady", "sweep"]

# Gauss-Legendre nodes and weights, 16 points on [-1, 1] (positive half), from mpmath at 50 digits.
NODES = (
    0.09501250983763744,
    0.2816035507792589,
    0.45801677765722737,
    0.6178762444026438,
    0.755404408355003,
    0.8656312023878318,
    0.9445750230732326,
    0.9894009349916499,
)
WEIGHTS = (
    0.1894506104550685,
    0.1826034150449236,
    0.16915651939500254,
    0.14959598881657674,
    0.12462897125553388,
    0.09515851168249279,
    0.062253523938647894,
    0.027152459411754096,
)


def slide_work(rig: Rig, force: Force, start: State, span: float, tally: Buffer) -> None:
    """Add the work of F and of the dashpot over a slide, by Gauss-Legendre panels short enough to be exact."""
    r, zeta = rig[0], rig[3]
    p, q = force[2], force[3]
    panels = int(span / (4.0 * min(r / max(1.0, 2.0 * zeta), 1.0 / len(p)))) + 1
    half = 0.5 * span / panels
    for panel in range(panels):
        middle = (2 * panel + 1) * half
        for i in range(8):
            for way in (-1.0, 1.0):
                t = middle + way * half * NODES[i]
                _, v, _ = slide_at(t, rig, force, start)
                push = 0.0
                for m in range(len(p)):
                    push += p[m] * cos((m + 1) * t) + q[m] * sin((m + 1) * t)
                tally[WORK] += half * WEIGHTS[i] * push * v
                tally[VISCOUS] += half * WEIGHTS[i] * 2.0 * zeta * r * v * v


def slide_range(rig: Rig, force: Force, room: Room, start: State, side: float, span: float) -> None:
    """Widen the tally's range by the displacement z + f over a phase, with the wall's motion f about its start.

    The velocity v + f' is marched like in `slide_end`; every point visited counts, so its zeros are met to rounding.
    """
    tally, p, q = room[1], room[3][2], room[3][3]
    third = 0.0
    for i in range(len(p)):
        third += (i + 1.0) ** 3 * hypot(p[i], q[i])
    reach, t = min(rig[0], 1.0), 0.0
    while True:
        t = min(t, span)
        z, v, a = slide_at(t, rig, force, start) if side != 0.0 else (0.0, 0.0, 0.0)
        jerk = third + (jerk_bound(rig, v, a) if side != 0.0 else 0.0)
        for i in range(len(p)):
            k = i + 1.0
            c, s = cos(k * t), sin(k * t)
            z += p[i] * c + q[i] * s
            v += k * (q[i] * c - p[i] * s)
            a -= k * k * (p[i] * c + q[i] * s)
        tally[HIGH] = max(tally[HIGH], start[0] + z)
        tally[LOW] = min(tally[LOW], start[0] + z)
        if t >= span:
            return
        step = safe_step(abs(v), a if v >= 0.0 else -a, jerk) if v != 0.0 else 0.0
        t += max(1e-8 * reach, min(step, reach))


def account(rig: Rig, force: Force, room: Room) -> None:
    """Go through the recorded phases and add up what the event loop does not need: works, and range with the wall."""
    tally, phases, frame = room[1], room[2], room[3]
    for at in range(0, PHASE * int(tally[PHASES]), PHASE):
        side, tau, span = phases[at], phases[at + 1], phases[at + 2]
        start = (phases[at + 3], phases[at + 4], phases[at + 5])
        local_force(tau, force)
        if side != 0.0:
            slide_work(rig, force, start, span, tally)
        if len(frame[0]) > 0:
            local_force(tau, frame)
            slide_range(rig, force, room, start, side, span)


def mirrored(rig: Rig, force: Force, z: float, v: float, room: Room) -> float:
    """Tell (1.0 or 0.0) whether an orbit of one cycle is its own mirror image after half a cycle."""
    iz, iv, _ = carry(rig, force, (0.0, pi, 1.0, -1.0), z, v, room)
    size = hypot(z, rig[0] * v) + room[1][PATH]
    return 1.0 if hypot(iz - z, rig[0] * (iv - v)) <= 1e-9 * size else 0.0


def fill_row(rig: Rig, leg: Leg, room: Room, row: Buffer) -> None:
    """Write the numbers of an orbit from the tally of one leg."""
    tally = room[1]
    cycles = leg[1] * leg[2] / TURN
    row[MULTIPLIER] = spectral_radius(room[0]) ** (1.0 if leg[3] > 0.0 else 2.0)
    row[ENERGY] = (rig[1] * tally[PATH] + tally[VISCOUS]) / cycles
    row[CLOSURE] = abs(tally[WORK] / cycles - row[ENERGY])
    high, low = tally[HIGH], tally[LOW]
    row[AMPLITUDE] = max(high, -low) if leg[3] < 0.0 else 0.5 * max(0.0, high - low)
    wrapped = 1.0 if tally[FIRST] == 0.0 and tally[LAST] != 0.0 else 0.0
    row[STOPS] = (tally[STOPS_MADE] + wrapped) / cycles
    row[STUCK_SHARE] = tally[STUCK_TIME] / (cycles * TURN)
    row[PERIOD] = leg[2]


def steady(rig: Rig, force: Force, closed: int, room: Room, row: Buffer) -> None:
    """Fill `row` with the steady state's numbers; its phases are left in the record, from a leg's start to its end."""
    outcome, leg, z, v, miss, exact = find_orbit(rig, force, closed, room)
    for i in range(ROW):
        row[i] = nan
    row[OUTCOME], row[MISS], row[CLOSED_FORM] = outcome, miss, 1.0 if exact else 0.0
    row[START], row[SPAN], row[TURNS], row[SIGN], row[START_Z], row[START_V] = leg[0], leg[1], leg[2], leg[3], z, v
    if outcome == UNBOUNDED or outcome >= NOT_FOUND:
        return
    row[SYMMETRIC] = 1.0 if leg[3] < 0.0 or (outcome == STUCK and z == 0.0) else 0.0
    if outcome == PERIODIC and leg[2] == 1.0 and leg[3] == 1.0 and symmetric_force(force):
        row[SYMMETRIC] = mirrored(rig, force, z, v, room)
    carry(rig, force, leg, z, v, room)
    if PHASE * int(room[1][PHASES]) > len(room[2]):
        row[OUTCOME] = OVERFULL
        return
    account(rig, force, room)
    fill_row(rig, leg, room, row)
    if row[CLOSURE] > 1e-3 * row[ENERGY] + 1e-10 * rig[5] * row[AMPLITUDE]:  # repeats to rounding, yet is no orbit
        row[OUTCOME] = NOT_FOUND
        for i in range(ENERGY, CLOSURE + 1):
            row[i] = nan


def set_force(r: float, cosine: Buffer, sine: Buffer, force: Force, frame: Force) -> None:
    """Write the force's coefficients: those of the base's motion f, or of -r^2 f'' if the wall moves (`frame`) too."""
    for i in range(len(cosine)):
        scale = (r * (i + 1.0)) ** 2 if len(frame[0]) > 0 else 1.0
        force[0][i], force[1][i] = scale * cosine[i], scale * sine[i]


def sweep(points: Buffer, cosine: Buffer, sine: Buffer, force: Force, closed: int, room: Room, rows: Buffer) -> None:
    """Fill one row of `rows` for each r, beta, mu, zeta in `points`; each by itself, so that chunks do not matter."""
    row = rows[:ROW].copy()
    for i in range(len(points) // 4):
        r, beta, mu, zeta = points[4 * i], points[4 * i + 1], points[4 * i + 2], points[4 * i + 3]
        set_force(r, cosine, sine, force, room[3])
        steady(make_rig(r, beta, mu, zeta, force), force, closed, room, row)
        for j in range(ROW):
            rows[ROW * i + j] = row[j]


def evaluate(rig: Rig, force: Force, phases: Buffer, within: Buffer, states: Buffer) -> None:
    """Fill `states` with z and v at times `within` the phases given one by one, each by its six numbers."""
    for i in range(len(within)):
        at = PHASE * i
        start = (phases[at + 3], phases[at + 4], phases[at + 5])
        states[2 * i], states[2 * i + 1] = start[0], 0.0
        if phases[at] != 0.0:
            local_force(phases[at + 1], force)
            way, states[2 * i + 1], _ = slide_at(within[i], rig, force, start)
            states[2 * i] += way
