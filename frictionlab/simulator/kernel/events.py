"""What ends a slide and what follows: turns, sticks, releases; and the loop that strings them (README, "Events")."""

from math import asin, atan2, cos, hypot, inf, pi, sin, sqrt

from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.layout import TURN, Buffer, Force, Leg, Oscillator, Rig, RigidContact, Room, State
from frictionlab.simulator.kernel.motion import free_motion, local_force, motion_at

STILL = 1e-13  # rad: a shorter stick is a touch, not a stop
NEARLY = 1e-8  # of a slope's share of a step


def jerk_bound(slide: Oscillator, v: float, a: float) -> float:
    """Bound |v''| over the next min(r, 1): the free motion's energy can grow only by the force's work."""
    r, zeta, rate = slide.r, slide.zeta, slide.rate
    energy = sqrt(v * v + r * r * a * a) + rate * min(1.0, 1.0 / r)
    return (rate + (1.0 + 2.0 * zeta) * energy) / (r * r)


def snap_bound(slide: Oscillator, v: float, a: float) -> float:
    """Bound |v'''| over the next min(r, 1): v is an oscillator too, under F', so that it follows from F''."""
    r, zeta, rate = slide.r, slide.zeta, slide.rate
    energy = sqrt(v * v + r * r * a * a) + rate * min(1.0, 1.0 / r)
    return (slide.rate2 + energy / r + 2.0 * zeta / r * (rate + (1.0 + 2.0 * zeta) * energy)) / (r * r)


def stiff_bound(slide: Oscillator, v: float, a: float, bend: float) -> float:
    """Bound |v'''|, as `snap_bound`, where the dashpot is stronger than the spring: far from then on, too.

    a follows F' - v by ``r^2 a' + 2 zeta r a = F' - v``: it never exceeds what it is now, or the right side over 2 zeta
    r; v'' follows F'' - a alike, and what the two leave over r^2 is v'''.
    """
    r, thick, rate = slide.r, 2.0 * slide.zeta * slide.r, slide.rate
    speed = sqrt(v * v + r * r * a * a) + rate * min(1.0, 1.0 / r)
    gain = max(abs(a), (rate + speed) / thick)
    return (slide.rate2 + gain + thick * max(abs(bend), (slide.rate2 + gain) / thick)) / (r * r)


def least_step(speed: float, gain: float, jerk: float, reach: float) -> float:
    """Return h up to which speed + gain h - jerk h^2/2 stays positive, at most reach; the jerk may have either sign."""
    inside = gain * gain + 2.0 * jerk * speed
    if inside < 0.0 or (jerk <= 0.0 <= gain):
        return reach
    root = sqrt(inside)
    return min(reach, (gain + root) / jerk if gain > 0.0 else 2.0 * speed / (root - gain))


def cubic_step(speed: float, gain: float, bend: float, snap: float, reach: float) -> float:
    """Return h up to which speed + gain h + bend h^2/2 - snap h^3/6 stays positive, at most reach.

    Within H the cubic is no less than the parabola that has its third part of snap H against the bend: H is drawn in
    towards what is found with it.
    """
    step = least_step(speed, gain, snap * reach / 3.0 - bend, reach)
    if step == reach:
        return step
    within = min(reach, 1.5 * step)
    return max(step, least_step(speed, gain, snap * within / 3.0 - bend, within))


def slide_start(slide: Oscillator, start: State, side: float, rate: float) -> float:
    """Return a time up to which a slide that starts from rest keeps its direction: a cubic lower bound of the speed."""
    r, zeta = slide.r, slide.zeta
    a0 = side * start.a
    reach = min(r, 1.0)
    energy = r * abs(a0) + slide.rate * reach / r
    snap = (slide.rate2 + energy / r + 2.0 * zeta * r * jerk_bound(slide, 0.0, a0)) / (r * r)
    j0 = 0.5 * side * (rate - 2.0 * zeta * r * start.a) / (r * r)
    root = sqrt(j0 * j0 + 2.0 / 3.0 * snap * a0)
    if j0 > 0.0:
        return min(reach, 1.5 * (j0 + root) / snap)
    return min(reach, a0 / (root - j0)) if a0 > 0.0 else 0.0


def slide_end(
    slide: Oscillator, force: Force, start: State, side: float, rate: float, limit: float, tally: Buffer
) -> tuple[float, float, float, float]:
    """Return the time of the slide's first zero of velocity, or `limit` if there is none before; way, v, a there.

    From (v, a, v'') the velocity keeps its sign for a step h while v + a h + v'' h^2/2 - M h^3/6 > 0, with M a bound of
    |v'''|: the march cannot pass a zero and converges to it cubically. Once the cubic's last term is NEARLY nothing
    beside the slope, Newton's step from there meets the zero to rounding; a step as long as the bound holds ends at no
    zero. `rate` is F' at the start.
    """
    reach = min(slide.r, 1.0)
    t = 0.0 if start.v != 0.0 else slide_start(slide, start, side, slide.share * rate)
    v, a = start.v, start.a
    bend = (slide.share * rate - v - 2.0 * slide.zeta * slide.r * a) / (slide.r * slide.r)
    while t < limit:
        if t > 0.0:
            _, v, a, bend = motion_at(t, slide, force, start)
            tally[layout.EVALUATIONS] += 1.0
        if side * v <= 0.0:
            break
        snap = snap_bound(slide, v, a)
        if slide.zeta > 1.0:
            snap = min(snap, stiff_bound(slide, v, a, bend))
        step = cubic_step(side * v, side * a, side * bend, snap, reach)
        t += step
        if step <= 2e-16 * t or (step < reach and snap * step * step <= NEARLY * abs(a)):
            break
    t = min(t, limit)
    way, v, a, bend = motion_at(t, slide, force, start)
    if t == limit:
        return t, way, v, a
    if side * a < 0.0 and abs(v) < 1e-6 * abs(a) * t:
        last = -v / a
        if t + last >= limit or abs(last) > 1e-10 * t:
            t = min(limit, t + last)
            way, v, a, bend = motion_at(t, slide, force, start)
        else:
            t, way, a = t + last, way + 0.5 * v * last, a + bend * last
    return t, way, 0.0, a


def release_cosine(up: float, down: float, force: Force, z: float) -> tuple[float, float]:
    """Return when and to which side a mass held at z breaks loose under a single cosine; never: (2 turns, 0).

    The angle from the force's crest to the release comes from what the crest has over the hold, so that it keeps its
    digits where that is next to nothing.
    """
    size, phase = hypot(force.cosine[0], force.sine[0]), atan2(-force.q[0], force.p[0])
    when, side = 2.0 * TURN, 0.0
    for way in (1.0, -1.0):
        over = (size - (up if way > 0.0 else down)) - way * z
        if over <= 0.0 or over >= 2.0 * size:
            continue
        angle = 2.0 * asin(sqrt(0.5 * over / size))
        t = ((-angle if way > 0.0 else pi - angle) - phase) % TURN
        if t > TURN - 1e-7 and way * force.q[0] > 0.0:
            t = 0.0  # rounding put the crossing just behind the present
        if t < when:
            when, side = t, way
    return when, side


def release(rig: Rig, force: Force, z: float, limit: float) -> tuple[float, float]:
    """Return when and to which side a mass held at z breaks loose; none before limit: (limit, 0).

    It is held while ``-static_down load <= F - z <= static_up load`` with ``load = beta (1 + q z)``.
    """
    contact, bound2 = rig.contact, rig.plain.rate2
    load = contact.beta * (1.0 + contact.gradient * z)
    up, down = contact.static_up * load, contact.static_down * load
    p, q = force.p, force.q
    if len(p) == 1:
        when, side = release_cosine(up, down, force, z)
        return (when, side) if when < limit else (limit, 0.0)
    t = 0.0
    while t < limit:
        pull, rate = -z, 0.0
        for i in range(len(p)):
            c, s = cos((i + 1) * t), sin((i + 1) * t)
            pull += p[i] * c + q[i] * s
            rate += (i + 1) * (q[i] * c - p[i] * s)
        side = 1.0 if up - pull <= down + pull else -1.0
        if min(up - pull, down + pull) <= 0.0:
            if side * rate > 0.0:
                return t, side
            t += 1e-9  # touches the limit and turns back
            continue
        step = min(least_step(up - pull, -rate, bound2, limit), least_step(down + pull, rate, bound2, limit))
        t += step
        if step <= 2e-16 * t and side * rate > 0.0:
            return t, side
    return limit, 0.0


def record(room: Room, side: float, tau: float, span: float, start: State, spring: tuple[float, float]) -> None:
    """Book one phase, and remember the first and the last kind of phase."""
    tally = room.tally
    if tally[layout.PHASES] == 0.0:
        tally[layout.FIRST] = abs(side)
    tally[layout.LAST] = abs(side)
    write_phase(room.phases, tally, side, (tau, span), start, spring)


def write_phase(
    phases: Buffer, tally: Buffer, kind: float, time: tuple[float, float], start: State, spring: tuple[float, float]
) -> None:
    """Count one phase, and write it into the record, if that has room.

    `time` is when it began and how long it took, `spring` its stiffness and the contact's force at its start.
    """
    at = layout.PHASE * int(tally[layout.PHASES])
    tally[layout.PHASES] += 1.0
    if at + layout.PHASE <= len(phases):
        phases[at], phases[at + 1], phases[at + 2] = kind, time[0], time[1]
        phases[at + 3], phases[at + 4], phases[at + 5] = start.z, start.v, start.a
        phases[at + 6], phases[at + 7] = spring


def propagate(slide: Oscillator, span: float, jacobian: Buffer) -> None:
    """Multiply the jacobian from the left by the free motion over a slide."""
    r, zeta = slide.r, slide.zeta
    g, h, _ = free_motion(span, slide)
    for i in range(2):
        dz, dv = jacobian[i], jacobian[2 + i]
        jacobian[i] = g * dz + h * dv
        jacobian[2 + i] = (g - 2.0 * zeta / r * h) * dv - h / (r * r) * dz


def stick(
    rig: Rig, force: Force, tau: float, end: float, z: float, fresh: float, room: Room
) -> tuple[float, float, float]:
    """Hold the mass until it breaks loose; return when, to which side and with which acceleration, or (end, 0, 0).

    `fresh` is 1 if the mass has just come to rest: then the stick is a new stop.
    """
    contact, jacobian, tally = rig.contact, room.jacobian, room.tally
    span, side = release(rig, force, z, end - tau)
    jacobian[2], jacobian[3] = 0.0, 0.0
    if span > STILL:
        record(room, 0.0, tau, span, State(z, 0.0, 0.0), (inf, 0.0))
        tally[layout.STUCK_TIME] += span
        tally[layout.STOPS_MADE] += fresh
    if side == 0.0:
        return end, side, 0.0
    _, rate = local_force(tau + span, force)
    static = contact.static_up if side > 0.0 else contact.static_down
    a = (static - 1.0) * (contact.beta * (1.0 + contact.gradient * z)) * side / (rig.plain.r * rig.plain.r)
    if static > 1.0 and rate * side > 0.0:  # a mass held a little farther breaks loose earlier or later
        late = a / rate * (1.0 + side * static * contact.beta * contact.gradient)
        jacobian[2], jacobian[3] = -late * jacobian[0], -late * jacobian[1]
    return tau + span, side, a


def along(contact: RigidContact, side: float) -> float:
    """Return what friction along the path adds to the stiffness of a slide to a side (`make_rig`)."""
    steep = contact.beta * contact.gradient
    return side * steep if abs(steep) < 1.0 else 0.0


def advance(rig: Rig, force: Force, tau: float, end: float, z: float, v: float, room: Room) -> tuple[float, float, int]:
    """Carry the motion from tau to end, event by event; return z, v there and how it ended (DONE, CHATTER, TIRED).

    The decision at v = 0 comes before any search: a pull F - z within static friction sticks, else the mass slides
    towards F. The jacobian is multiplied from the left by the derivative of the end state with respect to the start
    state.
    """
    contact, plain = rig.contact, rig.plain
    jacobian, tally = room.jacobian, room.tally
    budget = 1000.0 + 200.0 * (end - tau) * (len(force.cosine) + 1.0 / plain.r)
    fresh, before = 0.0, 0.0
    while tau < end:
        budget -= 1.0
        if budget < 0.0:
            return z, v, layout.CHATTER
        if room.meter[0] < 0.0:
            return z, v, layout.TIRED
        push, rate = local_force(tau, force)
        pull, load = push - z, contact.beta * (1.0 + contact.gradient * z)
        side = 1.0 if v > 0.0 or (v == 0.0 and pull > 0.0) else -1.0
        a = (pull - load * side - 2.0 * plain.zeta * plain.r * v) / (plain.r * plain.r)
        if v == 0.0 and -contact.static_down * load <= pull <= contact.static_up * load:
            tau, side, a = stick(rig, force, tau, end, z, fresh, room)
            if side == 0.0:
                return z, 0.0, layout.DONE
            _, rate = local_force(tau, force)
        elif before != 0.0:  # friction turned round: the acceleration jumps
            jump = min(1.0, max(0.0, a / before))
            jacobian[2], jacobian[3] = jacobian[2] * jump, jacobian[3] * jump
        start, rest, slide = State(z, v, a), end - tau, rig.rising if side > 0.0 else rig.falling
        looks = tally[layout.EVALUATIONS]
        span, way, v, before = slide_end(slide, force, start, side, rate, rest, tally)
        room.meter[0] -= len(force.p) * (tally[layout.EVALUATIONS] - looks + 1.0)
        z += way
        fresh = 1.0
        added, pull = along(contact, side), side * contact.beta * (1.0 + contact.gradient * start.z)
        record(room, side, tau, span, start, (1.0 + added, pull))
        propagate(slide, span, jacobian)
        tally[layout.PATH] += abs(way)
        tally[layout.CONTACT] += (pull + 0.5 * added * way) * way
        tally[layout.HIGH] = max(tally[layout.HIGH], start.z, z)
        tally[layout.LOW] = min(tally[layout.LOW], start.z, z)
        tau = tau + span if span < rest else end
    return z, v, layout.DONE


def carry(rig: Rig, force: Force, leg: Leg, z: float, v: float, room: Room) -> tuple[float, float, int]:
    """Carry a state over a leg; return its image and how it ended. Jacobian and tally in `room` are begun afresh.

    The image is multiplied by the leg's sign: -1 for half a period, whose image in a symmetric orbit is the start
    mirrored.
    """
    jacobian, tally = room.jacobian, room.tally
    jacobian[0], jacobian[1], jacobian[2], jacobian[3] = 1.0, 0.0, 0.0, 1.0
    for i in range(layout.TALLY):
        tally[i] = 0.0
    tally[layout.HIGH], tally[layout.LOW] = -inf, inf
    tally[layout.CARRIED], tally[layout.CARRIED + 1], tally[layout.CARRIED + 2] = leg.tau, leg.span, leg.turns
    tally[layout.CARRIED + 3], tally[layout.CARRIED + 4], tally[layout.CARRIED + 5] = leg.sign, z, v
    code = layout.DONE
    for _ in range(int(leg.turns)):
        z, v, code = advance(rig, force, leg.tau, leg.tau + leg.span, z, v, room)
        if code != layout.DONE:
            break
    for i in range(4):
        jacobian[i] *= leg.sign
    return leg.sign * z, leg.sign * v, code


def again(rig: Rig, force: Force, leg: Leg, z: float, v: float, room: Room) -> None:
    """Leave the record, jacobian and tally of a state's motion over a leg in `room`, unless they are there already."""
    tally = room.tally
    same = (
        tally[layout.CARRIED] == leg.tau
        and tally[layout.CARRIED + 1] == leg.span
        and tally[layout.CARRIED + 2] == leg.turns
    )
    if not (
        same
        and tally[layout.CARRIED + 3] == leg.sign
        and tally[layout.CARRIED + 4] == z
        and tally[layout.CARRIED + 5] == v
    ):
        carry(rig, force, leg, z, v, room)
