"""What ends a slide and a stop inside a piece, and what follows; none is stepped over (README, "Events")."""

from math import inf, sqrt

from frictionlab.simulator.record.layout import (
    EVENT,
    EVENTS,
    FRESH,
    HELD,
    LOWER,
    NOTHING,
    OFFSET,
    SIDE,
    SINCE,
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
from frictionlab.simulator.record.piece import free_motion, jerk_bound, moved, safe_step

__all__ = [
    "begin_slide",
    "begin_stop",
    "crossing",
    "decide",
    "first_step",
    "give_way",
    "hold",
    "note",
    "release",
    "root_between",
    "set_phase",
    "slide_end",
    "threshold_step",
    "yield_step",
]

STILL = 1e-13  # rad: a shorter stick is a touch, not a stop


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
