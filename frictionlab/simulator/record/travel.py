"""The loop over the samples: whole steps where nothing can happen, event by event where something may."""

from frictionlab.simulator.record.events import (
    begin_slide,
    decide,
    give_way,
    note,
    release,
    set_phase,
    slide_end,
)
from frictionlab.simulator.record.layout import (
    CHATTER,
    DONE,
    FRESH,
    FRICTION_WORK,
    HELD,
    HIGH,
    INPUT,
    LOW,
    LOWER,
    NOTHING,
    OFFSET,
    PATH,
    SIDE,
    SINCE,
    SQUARED_FRAME_SPEED,
    SQUARED_SPEED,
    STIFFNESS,
    STOPS,
    STUCK_TIME,
    TURN,
    UPPER,
    Buffer,
    Cubic,
    RecordRig,
    RecordSliders,
    V,
    Z,
)
from frictionlab.simulator.record.piece import (
    cubic_of,
    force_of,
    free_motion,
    jerk_bound,
    moved,
    product_integral,
    shifted,
)

__all__ = ["advance", "begin", "book", "close", "contact_force", "glides", "rests", "through", "travel"]

MOST_EVENTS = 2000  # within one step


def begin(
    rig: RecordRig, sliders: RecordSliders, state: Buffer, tally: Buffer, events: Buffer, tau: float, push: float
) -> None:
    """Say how the motion starts: a rigid contact at rest decides, elastic sliders hold without a force."""
    for i in range(len(sliders.stiff)):
        sliders.anchor[i], sliders.slips[i] = state[Z], 0.0
    state[SINCE] = tau
    if len(sliders.stiff) == 0:
        if state[V] == 0.0:
            decide(rig, sliders, state, tally, events, tau, push)
        else:
            begin_slide(state, tally, events, tau, 1.0 if state[V] > 0.0 else -1.0)
    set_phase(rig, sliders, state)
    tally[HIGH], tally[LOW] = state[Z], state[Z]


def book(
    rig: RecordRig, state: Buffer, tally: Buffer, base: Cubic, span: float, way: float, a0: float, v: float, a: float
) -> None:
    """Add one part of a step to the accounts: works by their closed form, squares of speeds by end values."""
    zeta = rig.frame + rig.contact
    force = force_of(base, rig.frame, rig.wall)
    end = shifted(force, span)
    z0, v0, stiffness = state[Z], state[V], state[STIFFNESS]
    speed0 = (v0, a0, force[1] - stiffness * v0 - 2.0 * zeta * a0)
    speed1 = (v, a, end[1] - stiffness * v - 2.0 * zeta * a)
    if state[HELD] != 0.0:
        speed0, speed1 = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    force0, force1 = (force[0], force[1], 2.0 * force[2]), (end[0], end[1], 2.0 * end[2])
    tally[INPUT] += product_integral(span, force0, speed0, force1, speed1)
    tally[FRICTION_WORK] += way * (0.5 * (stiffness - 1.0) * (2.0 * z0 + way) + state[OFFSET])
    if zeta != 0.0:
        tally[SQUARED_SPEED] += product_integral(span, speed0, speed0, speed1, speed1)
    if rig.frame != 0.0 and rig.wall == 0.0:
        far = shifted(base, span)
        frame0 = (v0 - base[1], speed0[1] - 2.0 * base[2], speed0[2] - 6.0 * base[3])
        frame1 = (v - far[1], speed1[1] - 2.0 * far[2], speed1[2] - 6.0 * far[3])
        tally[SQUARED_FRAME_SPEED] += product_integral(span, frame0, frame0, frame1, frame1)
    if state[SIDE] != 0.0:
        tally[PATH] += abs(way)
    tally[HIGH], tally[LOW] = max(tally[HIGH], z0 + way), min(tally[LOW], z0 + way)


def glides(state: Buffer, zeta: float, force: Cubic, span: float, way: float, a0: float, v: float) -> bool:
    """Tell whether a slide surely goes on through a step: its speed leaves the chord by less than M h^2 / 8."""
    side, v0 = state[SIDE], state[V]
    jerk = jerk_bound(state[STIFFNESS], zeta, v0, a0, force, span)
    sag = 0.125 * jerk * span * span
    if side != 0.0 and (side * v0 <= sag or side * v <= sag):
        return False
    bulge = 0.125 * (abs(a0) + span * jerk) * span * span
    high, low = max(0.0, way) + bulge, min(0.0, way) - bulge
    return state[Z] + high < state[UPPER] and state[Z] + low > state[LOWER]


def rests(rig: RecordRig, state: Buffer, force: Cubic, span: float) -> bool:
    """Tell whether a rigid contact surely holds through a step: the force leaves its chord by at most |F''| h^2 / 8."""
    z = state[Z]
    bulge = 0.25 * (abs(force[2]) + 3.0 * abs(force[3]) * span) * span * span
    end = force[0] + span * (force[1] + span * (force[2] + span * force[3]))
    high, low = max(force[0], end) - z + bulge, min(force[0], end) - z - bulge
    most = rig.beta * (1.0 + rig.gradient * z)
    return high < rig.up * most and low > -rig.down * most


def through(
    rig: RecordRig,
    sliders: RecordSliders,
    state: Buffer,
    tally: Buffer,
    events: Buffer,
    tau: float,
    base: Cubic,
    span: float,
) -> int:
    """Carry the state through a step in which something may happen; return DONE or CHATTER."""
    zeta, t = rig.frame + rig.contact, 0.0
    given, a0 = False, 0.0
    for _ in range(MOST_EVENTS):
        here, rest = shifted(base, t), span - t
        if not rest > 0.0:
            return DONE
        force = force_of(here, rig.frame, rig.wall)
        if state[HELD] != 0.0:
            when, side, a0 = release(rig, force, state[Z], rest)
            book(rig, state, tally, here, when, 0.0, 0.0, 0.0, 0.0)
            t = t + when if side != 0.0 else span
            if side != 0.0:
                begin_slide(state, tally, events, tau + t, side)
                set_phase(rig, sliders, state)
            given = True
            continue
        if not given:
            a0 = force[0] - state[OFFSET] - state[STIFFNESS] * state[Z] - 2.0 * zeta * state[V]
        given = False
        what, when, way, v, a = slide_end(state, zeta, force, a0, rest)
        book(rig, state, tally, here, when, way, a0, v, a)
        state[Z] += way
        state[V] = v
        t = t + when if when < rest else span
        if what == NOTHING:
            return DONE
        if what == TURN:
            push = shifted(force, when)
            decide(rig, sliders, state, tally, events, tau + t, push[0])
        else:
            side = 1.0 if v > 0.0 or (v == 0.0 and a > 0.0) else -1.0
            give_way(rig, sliders, state, tally, events, tau + t, side)
        set_phase(rig, sliders, state)
    return CHATTER


def contact_force(rig: RecordRig, state: Buffer, push: float) -> float:
    """Return the force of the contact on the mass now, under a force F."""
    if state[HELD] != 0.0:
        return push - state[Z]
    return (state[STIFFNESS] - 1.0) * state[Z] + state[OFFSET] + 2.0 * rig.contact * state[V]


def close(state: Buffer, tally: Buffer, events: Buffer, tau: float) -> None:
    """Write down the stop that the motion ends in."""
    if state[SIDE] == 0.0 and tau > state[SINCE]:
        tally[STUCK_TIME] += tau - state[SINCE]
        tally[STOPS] += state[FRESH]
        note(tally, events, state[SINCE], 0.0, state[Z])


def advance(
    rig: RecordRig,
    sliders: RecordSliders,
    state: Buffer,
    tally: Buffer,
    events: Buffer,
    tau: float,
    base: Cubic,
    span: float,
    free: Buffer,
) -> int:
    """Carry the state through one step: at once where nothing can happen in it; return DONE or CHATTER."""
    zeta = rig.frame + rig.contact
    force = force_of(base, rig.frame, rig.wall)
    if state[HELD] != 0.0:
        if rests(rig, state, force, span):
            book(rig, state, tally, base, span, 0.0, 0.0, 0.0, 0.0)
            return DONE
        return through(rig, sliders, state, tally, events, tau, base, span)
    stiffness = state[STIFFNESS]
    if stiffness != free[5] or span != free[6]:
        free[0], free[1], free[2], free[3], free[4] = free_motion(span, stiffness, zeta)
        free[5], free[6] = stiffness, span
    a0 = force[0] - state[OFFSET] - stiffness * state[Z] - 2.0 * zeta * state[V]
    known = (free[0], free[1], free[2], free[3], free[4])
    way, v, a = moved(known, stiffness, zeta, state[V], a0, force)
    if not glides(state, zeta, force, span, way, a0, v):
        return through(rig, sliders, state, tally, events, tau, base, span)
    book(rig, state, tally, base, span, way, a0, v, a)
    state[Z] += way
    state[V] = v
    return DONE


def travel(
    rig: RecordRig,
    sliders: RecordSliders,
    state: Buffer,
    tally: Buffer,
    events: Buffer,
    samples: tuple[Buffer, Buffer, Buffer],
    steps: tuple[float, float],
    motion: tuple[Buffer, Buffer, Buffer],
    free: Buffer,
) -> int:
    """Carry the state through all samples; fill the motion (z, v, contact force) and return the last sample reached.

    `samples`: times, values and slopes of the base. `steps`: the length of every piece, or
    0 where they differ; and how many steps a unit of time is parted into at least.
    """
    times, values, slopes = samples
    for i in range(len(times) - 1):
        length = steps[0] if steps[0] > 0.0 else times[i + 1] - times[i]
        piece = cubic_of(values[i], values[i + 1], slopes[i], slopes[i + 1], length)
        if i == 0:
            push = force_of(piece, rig.frame, rig.wall)[0]
            begin(rig, sliders, state, tally, events, times[0], push)
            motion[0][0], motion[1][0], motion[2][0] = state[Z], state[V], contact_force(rig, state, push)
        count = int(length * steps[1]) + 1
        span = length / count
        for k in range(count):
            base = shifted(piece, k * span) if k > 0 else piece
            code = advance(rig, sliders, state, tally, events, times[i] + k * span, base, span, free)
            if code != DONE:
                return i
        push = force_of(shifted(piece, length), rig.frame, rig.wall)[0]
        motion[0][i + 1], motion[1][i + 1] = state[Z], state[V]
        motion[2][i + 1] = contact_force(rig, state, push)
    close(state, tally, events, times[len(times) - 1])
    return len(times) - 1
