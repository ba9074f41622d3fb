"""The motion along the samples: whole steps where nothing can happen, event by event where something may.

What ends a slide and a stop inside a piece, and what follows: no event is stepped over (README, "Events").
"""

from math import inf, sqrt

from frictionlab.simulator.record.layout import (
    CHATTER,
    DONE,
    EVENT,
    EVENTS,
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
    YIELD,
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
    safe_step,
    shifted,
)

STILL = 1e-13  # rad: a shorter stick is a touch, not a stop
MOST_EVENTS = 2000  # within one step


def set_phase(rig: RecordRig, sliders: RecordSliders, state: Buffer) -> None:
    """Write the stiffness, the constant force and the thresholds of the phase that the state is in.

    A slipping slider's force is ``s beta_i (1 + q z)``, a holding one's ``k_i (z - a_i)``: both linear in z.
    """
    beta, q, up, down = rig.beta, rig.gradient, rig.up, rig.down
    stiff, limit, anchor, slips = sliders
    side = state[SIDE]
    state[STIFFNESS], state[OFFSET], state[LOWER], state[UPPER] = 1.0, 0.0, -inf, inf
    if len(stiff) == 0:
        state[STIFFNESS], state[OFFSET] = 1.0 + side * beta * q, side * beta
    for i in range(len(stiff)):
        if slips[i] != 0.0:
            state[STIFFNESS] += side * limit[i] * q
            state[OFFSET] += side * limit[i]
        else:
            state[STIFFNESS] += stiff[i]
            state[OFFSET] -= stiff[i] * anchor[i]
            gives_up = (stiff[i] * anchor[i] + up * limit[i]) / (stiff[i] - up * limit[i] * q)
            gives_down = (stiff[i] * anchor[i] - down * limit[i]) / (stiff[i] + down * limit[i] * q)
            state[UPPER], state[LOWER] = min(state[UPPER], gives_up), max(state[LOWER], gives_down)


def note(tally: Buffer, events: Buffer, tau: float, side: float, z: float) -> None:
    """Write one event into the record, if it has room."""
    at = EVENT * int(tally[EVENTS])
    tally[EVENTS] += 1.0
    if at + EVENT <= len(events):
        events[at], events[at + 1], events[at + 2] = tau, side, z


def begin_stop(state: Buffer, tau: float) -> None:
    """Remember since when the contact holds; whether that is a stop is known when it ends."""
    state[FRESH] = abs(state[SIDE])
    state[SIDE], state[SINCE] = 0.0, tau


def begin_slide(state: Buffer, tally: Buffer, events: Buffer, tau: float, side: float) -> None:
    """Let the contact slip; the stop before it, if it lasted, is counted and written down."""
    if state[SIDE] == 0.0 and tau - state[SINCE] > STILL:
        tally[STUCK_TIME] += tau - state[SINCE]
        tally[STOPS] += state[FRESH]
        note(tally, events, state[SINCE], 0.0, state[Z])
    note(tally, events, tau, side, state[Z])
    state[SIDE], state[HELD] = side, 0.0


def hold(rig: RecordRig, sliders: RecordSliders, state: Buffer, tau: float) -> None:
    """Let every slipping slider hold where it is: its spring stays as stretched as friction has it."""
    q = rig.gradient
    stiff, limit, anchor, slips = sliders
    for i in range(len(stiff)):
        if slips[i] != 0.0:
            anchor[i] = state[Z] - state[SIDE] * limit[i] * (1.0 + q * state[Z]) / stiff[i]
            slips[i] = 0.0
    begin_stop(state, tau)


def give_way(
    rig: RecordRig, sliders: RecordSliders, state: Buffer, tally: Buffer, events: Buffer, tau: float, side: float
) -> None:
    """Let those holding sliders slip whose threshold has been reached."""
    q = rig.gradient
    ratio = rig.up if side > 0.0 else rig.down
    stiff, limit, anchor, slips = sliders
    mark = state[UPPER] if side > 0.0 else state[LOWER]
    for i in range(len(stiff)):
        gives = (stiff[i] * anchor[i] + side * ratio * limit[i]) / (stiff[i] - side * ratio * limit[i] * q)
        if slips[i] == 0.0 and side * (gives - mark) <= 0.0:
            slips[i] = 1.0
    if state[SIDE] == 0.0:
        begin_slide(state, tally, events, tau, side)


def decide(
    rig: RecordRig, sliders: RecordSliders, state: Buffer, tally: Buffer, events: Buffer, tau: float, push: float
) -> None:
    """Say what follows when the mass comes to rest under a force: it sticks, or slides towards the force."""
    state[V] = 0.0
    if len(sliders.stiff) > 0:
        hold(rig, sliders, state, tau)
        return
    pull, most = push - state[Z], rig.beta * (1.0 + rig.gradient * state[Z])
    if pull > rig.up * most:
        begin_slide(state, tally, events, tau, 1.0)
    elif pull < -rig.down * most:
        begin_slide(state, tally, events, tau, -1.0)
    else:
        begin_stop(state, tau)
        state[HELD] = 1.0


def root_between(cubic: Cubic, low: float, high: float) -> float:
    """Return the root of a cubic that is at most 0 at low, above 0 at high, and monotone between: by bisection."""
    c0, c1, c2, c3 = cubic
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return low
        if c0 + middle * (c1 + middle * (c2 + middle * c3)) > 0.0:
            high = middle
        else:
            low = middle


def crossing(cubic: Cubic, span: float) -> float:
    """Return the first time within a span from which a cubic is above 0; -1 if there is none.

    Between the zeros of its derivative it is monotone, so that nothing is overlooked.
    """
    c0, c1, c2, c3 = cubic
    if c0 > 0.0:
        return 0.0
    first, second = -1.0, -1.0
    inside = c2 * c2 - 3.0 * c1 * c3
    if inside >= 0.0:
        sum_ = -(c2 + sqrt(inside)) if c2 >= 0.0 else sqrt(inside) - c2
        first = sum_ / (3.0 * c3) if c3 != 0.0 else -1.0
        second = c1 / sum_ if sum_ != 0.0 else -1.0
    if second < first:
        first, second = second, first
    low = 0.0
    for k in range(3):
        high = first if k == 0 else (second if k == 1 else span)
        if not 0.0 < high <= span:
            continue
        if c0 + high * (c1 + high * (c2 + high * c3)) > 0.0:
            return root_between(cubic, low, high)
        low = high
    return -1.0


def release(rig: RecordRig, force: Cubic, z: float, span: float) -> tuple[float, float, float]:
    """Return when within a span a rigid contact breaks loose, to which side, the acceleration then; or span, 0, 0."""
    most = rig.beta * (1.0 + rig.gradient * z)
    c0, c1, c2, c3 = force
    up = crossing((c0 - z - rig.up * most, c1, c2, c3), span)
    down = crossing((z - c0 - rig.down * most, -c1, -c2, -c3), span)
    if up < 0.0 and down < 0.0:
        return span, 0.0, 0.0
    if down < 0.0 or 0.0 <= up <= down:
        over = max(0.0, c0 - z - rig.up * most) if up == 0.0 else 0.0
        return up, 1.0, over + (rig.up - 1.0) * most
    over = max(0.0, z - c0 - rig.down * most) if down == 0.0 else 0.0
    return down, -1.0, -over - (rig.down - 1.0) * most


def first_step(side: float, a: float, jerk: float, snap: float, span: float) -> float:
    """Return a time up to which a slide that starts from rest keeps its direction: a cubic lower bound of its speed.

    ``a t + j t^2 / 2 - N t^3 / 6 > 0``, with N = `snap` a bound of the speed's third derivative.
    """
    gain, half = max(0.0, side * a), 0.5 * side * jerk
    root = sqrt(half * half + 2.0 / 3.0 * snap * gain)
    step = 1.5 * (half + root) / snap if half > 0.0 else (gain / (root - half) if gain > 0.0 else 0.0)
    return max(min(step, span), 1e-6 * span)


def threshold_step(gap: float, v: float, a: float, jerk: float, most: float) -> float:
    """Return a time in which a gap to a threshold ahead does not close, 0 if it has; v, a towards it.

    `jerk` and `most` bound |v''| and |a|. A mass that moves away from it leaves it open for as long as it does so.
    """
    if gap <= 0.0 and (v > 0.0 or (v == 0.0 and a >= 0.0)):
        return 0.0
    step = safe_step(max(0.0, gap), -v, most)
    if v < 0.0:
        return max(step, safe_step(-v, -a, jerk))
    return max(step, -1.5 * a / jerk) if v == 0.0 and a < 0.0 else step


def yield_step(state: Buffer, way: float, v: float, a: float, jerk: float, most: float) -> float:
    """Return a time in which no holding slider gives way, 0 if one does now."""
    step = inf
    if state[SIDE] >= 0.0 and state[UPPER] < inf:
        step = threshold_step((state[UPPER] - state[Z]) - way, v, a, jerk, most)
    if state[SIDE] <= 0.0 and state[LOWER] > -inf:
        step = min(step, threshold_step(way - (state[LOWER] - state[Z]), -v, -a, jerk, most))
    return step


def slide_end(
    state: Buffer, zeta: float, force: Cubic, a: float, span: float
) -> tuple[int, float, float, float, float]:
    """Return what ends a slide (or an elastic stop) within a span, TURN, YIELD or NOTHING, and when; way, v, a then.

    Marched by steps proven free of events; a step that vanishes has met one.
    """
    stiffness, side, start_v, start_a = state[STIFFNESS], state[SIDE], state[V], a
    jerk = jerk_bound(stiffness, zeta, start_v, a, force, span)
    most = abs(a) + span * jerk + 1e-300
    t, way, v = 0.0, 0.0, start_v
    if v == 0.0 and side != 0.0:
        snap = 2.0 * abs(force[2]) + 6.0 * abs(force[3]) * span + stiffness * most + 2.0 * zeta * jerk + 1e-300
        t = first_step(side, a, force[1] - 2.0 * zeta * a, snap, span)
    while True:
        if t > 0.0:
            way, v, a = moved(free_motion(t, stiffness, zeta), stiffness, zeta, start_v, start_a, force)
        if side != 0.0 and side * v <= 0.0:
            return TURN, t, way, 0.0, a
        slips = safe_step(side * v, side * a, jerk) if side != 0.0 else inf
        holds = yield_step(state, way, v, a, jerk, most)
        step = min(slips, holds)
        if step <= 1e-14 * span:
            return (YIELD, t, way, v, a) if holds < slips else (TURN, t, way, 0.0, a)
        if t >= span:
            return NOTHING, t, way, v, a
        t = min(t + step, span)


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
