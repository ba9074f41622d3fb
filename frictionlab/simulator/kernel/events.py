"""What ends a slide and what follows: turns, sticks, releases; and the loop that strings them (README, "Events")."""

from math import asin, atan2, cos, hypot, inf, pi, sin, sqrt

from frictionlab.simulator.kernel.layout import (
    CHATTER,
    DONE,
    EVALUATIONS,
    FIRST,
    HIGH,
    LAST,
    LOW,
    PATH,
    PHASE,
    PHASES,
    STOPS_MADE,
    STUCK_TIME,
    TALLY,
    TURN,
    Buffer,
    Force,
    Leg,
    Rig,
    Room,
    State,
)
from frictionlab.simulator.kernel.motion import free_motion, local_force, slide_at

__all__ = [
    "advance",
    "carry",
    "jerk_bound",
    "propagate",
    "record",
    "release",
    "release_cosine",
    "safe_step",
    "slide_end",
    "slide_start",
    "stick",
]

STILL = 1e-13  # rad: a shorter stick is a touch, not a stop


def jerk_bound(rig: Rig, v: float, a: float) -> float:
    """Bound |v''| over the next min(r, 1): the free motion's energy can grow only by the force's work."""
    r, _, _, zeta, _, rate, _ = rig
    energy = sqrt(v * v + r * r * a * a) + rate * min(1.0, 1.0 / r)
    return (rate + (1.0 + 2.0 * zeta) * energy) / (r * r)


def safe_step(speed: float, gain: float, jerk: float) -> float:
    """Return h up to which speed + gain h - jerk h^2/2 stays positive."""
    root = sqrt(gain * gain + 2.0 * jerk * speed)
    return (gain + root) / jerk if gain > 0.0 else 2.0 * speed / (root - gain)


def slide_start(rig: Rig, start: State, side: float, rate: float) -> float:
    """Return a time up to which a slide that starts from rest keeps its direction: a cubic lower bound of the speed."""
    r, _, _, zeta, _, bound, bound2 = rig
    a0 = side * start[2]
    reach = min(r, 1.0)
    energy = r * abs(a0) + bound * reach / r
    snap = (bound2 + energy / r + 2.0 * zeta * r * jerk_bound(rig, 0.0, a0)) / (r * r)
    j0 = 0.5 * side * (rate - 2.0 * zeta * r * start[2]) / (r * r)
    root = sqrt(j0 * j0 + 2.0 / 3.0 * snap * a0)
    if j0 > 0.0:
        return min(reach, 1.5 * (j0 + root) / snap)
    return min(reach, a0 / (root - j0)) if a0 > 0.0 else 0.0


def slide_end(
    rig: Rig, force: Force, start: State, side: float, rate: float, limit: float, tally: Buffer
) -> tuple[float, float, float, float]:
    """Return the time of the slide's first zero of velocity, or `limit` if there is none before; way, v, a there.

    From (v, a) the velocity keeps its sign for a step h while v + a h - M h^2/2 > 0, with M a bound of |v''|: the march
    cannot pass a zero and converges to it quadratically.
    """
    reach = min(rig[0], 1.0)
    t = 0.0 if start[1] != 0.0 else slide_start(rig, start, side, rate)
    v, a = start[1], start[2]
    while t < limit:
        if t > 0.0:
            _, v, a = slide_at(t, rig, force, start)
            tally[EVALUATIONS] += 1.0
        if side * v <= 0.0:
            break
        step = min(reach, safe_step(side * v, side * a, jerk_bound(rig, v, a)))
        t += step
        if step <= 2e-16 * t:
            break
    t = min(t, limit)
    way, v, a = slide_at(t, rig, force, start)
    if t == limit:
        return t, way, v, a
    if side * a < 0.0 and abs(v) < 1e-6 * abs(a) * t:
        t = min(limit, t - v / a)
        way, v, a = slide_at(t, rig, force, start)
    return t, way, 0.0, a


def release_cosine(hold: float, force: Force, z: float) -> tuple[float, float]:
    """Return when and to which side a mass held at z breaks loose under a single cosine; never: (2 turns, 0).

    The angle from the force's crest to the release comes from what the crest has over the hold, so that it keeps its
    digits where that is next to nothing.
    """
    size, phase = hypot(force[0][0], force[1][0]), atan2(-force[3][0], force[2][0])
    when, side = 2.0 * TURN, 0.0
    for way in (1.0, -1.0):
        over = (size - hold) - way * z
        if over <= 0.0 or over >= 2.0 * size:
            continue
        angle = 2.0 * asin(sqrt(0.5 * over / size))
        t = ((-angle if way > 0.0 else pi - angle) - phase) % TURN
        if t > TURN - 1e-7 and way * force[3][0] > 0.0:
            t = 0.0  # rounding put the crossing just behind the present
        if t < when:
            when, side = t, way
    return when, side


def release(rig: Rig, force: Force, z: float, limit: float) -> tuple[float, float]:
    """Return when and to which side a mass held at z breaks loose, |F - z| = mu beta; none before limit: (limit, 0)."""
    hold, bound2 = rig[1] * rig[2], rig[6]
    p, q = force[2], force[3]
    if len(p) == 1:
        when, side = release_cosine(hold, force, z)
        return (when, side) if when < limit else (limit, 0.0)
    t = 0.0
    while t < limit:
        pull, rate = -z, 0.0
        for i in range(len(p)):
            c, s = cos((i + 1) * t), sin((i + 1) * t)
            pull += p[i] * c + q[i] * s
            rate += (i + 1) * (q[i] * c - p[i] * s)
        side = 1.0 if pull > 0.0 or (pull == 0.0 and rate > 0.0) else -1.0
        left, closing = hold - abs(pull), side * rate
        if left <= 0.0:
            if closing > 0.0:
                return t, side
            t += 1e-9  # touches the limit and turns back
            continue
        step = min(safe_step(left, -closing, bound2), safe_step(hold + abs(pull), -abs(closing), bound2))
        t += step
        if step <= 2e-16 * t and closing > 0.0:
            return t, side
    return limit, 0.0


def record(room: Room, side: float, tau: float, span: float, start: State) -> None:
    """Write one phase into the record, if it has room, and remember the first and the last kind of phase."""
    tally, phases = room[1], room[2]
    at = PHASE * int(tally[PHASES])
    if at == 0:
        tally[FIRST] = abs(side)
    tally[LAST] = abs(side)
    tally[PHASES] += 1.0
    if at + PHASE <= len(phases):
        phases[at], phases[at + 1], phases[at + 2] = side, tau, span
        phases[at + 3], phases[at + 4], phases[at + 5] = start


def propagate(rig: Rig, span: float, jacobian: Buffer) -> None:
    """Multiply the jacobian from the left by the free motion over a slide."""
    r, zeta = rig[0], rig[3]
    g, h, _ = free_motion(span, rig)
    for i in range(2):
        dz, dv = jacobian[i], jacobian[2 + i]
        jacobian[i] = g * dz + h * dv
        jacobian[2 + i] = (g - 2.0 * zeta / r * h) * dv - h / (r * r) * dz


def stick(rig: Rig, force: Force, tau: float, end: float, z: float, fresh: float, room: Room) -> tuple[float, float]:
    """Hold the mass until it breaks loose; return when and to which side, or (end, 0).

    `fresh` is 1 if the mass has just come to rest: then the stick is a new stop.
    """
    beta, mu = rig[1], rig[2]
    jacobian, tally = room[0], room[1]
    span, side = release(rig, force, z, end - tau)
    jacobian[2], jacobian[3] = 0.0, 0.0
    if span > STILL:
        record(room, 0.0, tau, span, (z, 0.0, 0.0))
        tally[STUCK_TIME] += span
        tally[STOPS_MADE] += fresh
    if side == 0.0:
        return end, side
    _, rate = local_force(tau + span, force)
    if mu > 1.0 and rate * side > 0.0:  # a mass held a little farther breaks loose earlier or later
        late = (mu - 1.0) * beta * side / (rig[0] * rig[0] * rate)
        jacobian[2], jacobian[3] = -late * jacobian[0], -late * jacobian[1]
    return tau + span, side


def advance(rig: Rig, force: Force, tau: float, end: float, z: float, v: float, room: Room) -> tuple[float, float, int]:
    """Carry the motion from tau to end, event by event; return z, v there and how it ended (DONE or CHATTER).

    The decision at v = 0 comes before any search: |F - z| <= mu beta sticks, else the mass slides towards F. The
    jacobian is multiplied from the left by the derivative of the end state with respect to the start state.
    """
    r, beta, mu, zeta, _, _, _ = rig
    jacobian, tally = room[0], room[1]
    budget = 1000.0 + 200.0 * (end - tau) * (len(force[0]) + 1.0 / r)
    fresh, before = 0.0, 0.0
    while tau < end:
        budget -= 1.0
        if budget < 0.0:
            return z, v, CHATTER
        push, rate = local_force(tau, force)
        side = 1.0 if v > 0.0 or (v == 0.0 and push > z) else -1.0
        a = (push - z - beta * side - 2.0 * zeta * r * v) / (r * r)
        if v == 0.0 and abs(push - z) <= mu * beta:
            tau, side = stick(rig, force, tau, end, z, fresh, room)
            if side == 0.0:
                return z, 0.0, DONE
            _, rate = local_force(tau, force)
            a = (mu - 1.0) * beta * side / (r * r)
        elif before != 0.0:  # friction turned round: the acceleration jumps
            jump = min(1.0, max(0.0, a / before))
            jacobian[2], jacobian[3] = jacobian[2] * jump, jacobian[3] * jump
        start, rest = (z, v, a), end - tau
        span, way, v, before = slide_end(rig, force, start, side, rate, rest, tally)
        z += way
        fresh = 1.0
        record(room, side, tau, span, start)
        propagate(rig, span, jacobian)
        tally[PATH] += abs(way)
        tally[HIGH] = max(tally[HIGH], start[0], z)
        tally[LOW] = min(tally[LOW], start[0], z)
        tau = tau + span if span < rest else end
    return z, v, DONE


def carry(rig: Rig, force: Force, leg: Leg, z: float, v: float, room: Room) -> tuple[float, float, int]:
    """Carry a state over a leg; return its image and how it ended. Jacobian and tally in `room` are begun afresh.

    The image is multiplied by the leg's sign: -1 for half a period, whose image in a symmetric orbit is the start
    mirrored.
    """
    tau, span, turns, sign = leg
    jacobian, tally = room[0], room[1]
    jacobian[0], jacobian[1], jacobian[2], jacobian[3] = 1.0, 0.0, 0.0, 1.0
    for i in range(TALLY):
        tally[i] = 0.0
    tally[HIGH], tally[LOW] = -inf, inf
    code = DONE
    for _ in range(int(turns)):
        z, v, code = advance(rig, force, tau, tau + span, z, v, room)
        if code != DONE:
            break
    for i in range(4):
        jacobian[i] *= sign
    return sign * z, sign * v, code
