"""A held contact rings about a slow motion: how long it surely stays within limits, found without following each ring.

Held, the way is ``w = s(t) - c + y(t)``: s the forced motion, whose rates are those of the drive; y the free vibration,
``y = R exp(-zeta t / r) cos(phi)`` with phi growing like omega t. The forced part moves little while phi goes round.
"""

from math import acos, atan2, cos, exp, hypot, pi, sin, sqrt

from frictionlab.simulator.elastic.layout import LIMIT, REACHED, TURNED, Point, Ring
from frictionlab.simulator.elastic.phases import (
    crossing,
    first_point,
    is_exact,
    motion_at,
    snap_of,
    speed_after,
    time_to,
)
from frictionlab.simulator.kernel.events import cubic_step, jerk_bound, safe_step, slide_start
from frictionlab.simulator.kernel.layout import EVALUATIONS, TURN, Buffer, Force, Oscillator, State
from frictionlab.simulator.kernel.motion import gap

__all__ = [
    "add_wall",
    "calm_past",
    "forced_part",
    "heading",
    "held_end",
    "next_zone",
    "over_the_crest",
    "ring_of",
    "rings",
    "slow_motion",
    "stays_within",
    "step_ahead",
]

PAST_TURN = 3  # what ends a step, beside TURNED and REACHED
TRIES = 2.0  # of a leap, between two turns
SLOWEST = 0.5  # the drive's highest harmonic over the ring's frequency: above it every turn is followed


def rings(slide: Oscillator, force: Force) -> bool:
    """Tell whether the free vibration is faster than the drive and lightly damped: then leaps are worth it."""
    return slide.r * len(force.p) < SLOWEST and slide.zeta < 0.9


def forced_part(slide: Oscillator, force: Force, slow: Force) -> None:
    """Write the forced motion's coefficients, about the time about which the force is written."""
    for i in range(len(force.p)):
        k = i + 1.0
        stiffness = complex(gap(slide.r, k) * (1.0 + k * slide.r), 2.0 * slide.zeta * k * slide.r)
        part = complex(slide.share * force.p[i], -slide.share * force.q[i]) / stiffness
        slow.p[i], slow.q[i] = part.real, -part.imag


def add_wall(slow: Force, wall: Force) -> None:
    """Add the wall's motion, so that the whole is the mass's own displacement."""
    for i in range(len(wall.p)):
        slow.p[i] += wall.p[i]
        slow.q[i] += wall.q[i]


def slow_motion(t: float, slow: Force) -> tuple[float, float]:
    """Return the slow motion and its velocity at t."""
    z, v = 0.0, 0.0
    for i in range(len(slow.p)):
        k = i + 1.0
        c, s = cos(k * t), sin(k * t)
        z += slow.p[i] * c + slow.q[i] * s
        v += k * (slow.q[i] * c - slow.p[i] * s)
    return z, v


def ring_of(slide: Oscillator, force: Force, slow: Force, start: State) -> Ring:
    """Return what is constant while the contact holds."""
    curve, offset = 0.0, -slide.r * (slide.r * start.a + 2.0 * slide.zeta * start.v)
    for i in range(len(force.p)):
        offset += slide.share * force.p[i]
        curve += (i + 1.0) * (i + 1.0) * hypot(slow.p[i], slow.q[i])
    return Ring(offset, curve)


def stays_within(u: float, du: float, size: float, curve: float, high: float, low: float) -> float:
    """Return for how long a vibration of a size about u, which drifts at du with |u''| <= curve, is within limits."""
    above, below = high - u - size, u - size - low
    if above <= 0.0 or below <= 0.0:
        return 0.0
    return min(safe_step(above, -du, curve), safe_step(below, du, curve))


def next_zone(phi: float, top: float, bottom: float) -> float:
    """Return the phase after phi at which cos(phi) may first exceed `top` or fall below `bottom`; phi if it may now.

    At most one turn later. A vibration that decays is smaller than it was: limits beyond 0 tell nothing.
    """
    if top <= 0.0 or bottom >= 0.0:
        return phi
    crest = acos(top) if top < 1.0 else -1.0  # half the width of the zone about a crest, about a trough
    trough = acos(-bottom) if bottom > -1.0 else -1.0
    if phi <= crest or phi >= TURN - crest or abs(phi - pi) <= trough:
        return phi
    if phi < pi and trough >= 0.0:
        return pi - trough
    if crest >= 0.0:
        return TURN - crest
    return TURN + pi - trough if trough >= 0.0 else phi + TURN


def calm_past(
    t: float, way: float, v: float, slide: Oscillator, slow: Force, ring: Ring, limits: tuple[float, float], end: float
) -> float:
    """Return a time not before t up to which the way, now `way` at speed v, surely stays between the limits.

    First over many rings, while the vibration's whole size fits between the limits; then up to the crest or trough that
    may reach one.
    """
    high, low = limits
    z, du = slow_motion(t, slow)
    u, begun, period = z - ring.offset, t, TURN / slide.omega
    root = sqrt((1.0 - slide.zeta) * (1.0 + slide.zeta))
    y, turned = way - u, (slide.r * (v - du) + slide.zeta * (way - u)) / root
    size = hypot(y, turned)
    margin = 1e-14 * (abs(z) + abs(ring.offset) + size)
    while t < end:
        step = stays_within(u, du, size + margin, ring.curve, high, low)
        if step < period:
            break
        t += step
        size *= exp(-slide.zeta * step / slide.r)
        z, du = slow_motion(t, slow)
        u = z - ring.offset
    if t >= end or size == 0.0:
        return min(t, end)
    drift = abs(du) * period + 0.5 * ring.curve * period * period + margin
    phi = (atan2(-turned, y) + slide.omega * (t - begun)) % TURN
    after = next_zone(phi, (high - u - drift) / size, (low - u + drift) / size)
    return min(end, t + (after - phi) / slide.omega)


def over_the_crest(speed: float, gain: float, jerk: float, near: float, reach: float) -> float:
    """Return a time after which the mass has surely turned once, and not come as far as `near` before; 0: not known.

    With |v''| <= jerk the velocity is below ``speed - |gain| h / 2`` up to ``h = |gain| / jerk``: zero by
    ``2 speed / |gain|``, after a way of at most ``speed^2 / |gain|``.
    """
    if gain >= 0.0 or speed * speed >= -gain * near:
        return 0.0
    turned = min(reach, -gain / jerk)
    return turned if 2.0 * speed < -gain * turned else 0.0


def heading(now: Point) -> float:
    """Return the side to which a mass moves."""
    return 1.0 if now.v > 0.0 or (now.v == 0.0 and now.a > 0.0) else -1.0


def step_ahead(
    slide: Oscillator, start: State, now: Point, t: float, side: float, rate: float, near: float
) -> tuple[float, int]:
    """Return a step that passes nothing unseen, and what lies at its end: maybe a turn, the limit, surely past a turn.

    `now` is the motion at t; `near` what is left of the way to the limit on the side to which the mass moves.
    """
    reach, speed, gain, bend = min(slide.r, 1.0), side * now.v, side * now.a, side * now.bend
    leap = over_the_crest(speed, gain, jerk_bound(slide, now.v, now.a), near, reach)
    if leap > 0.0:
        return leap, PAST_TURN
    if now.v == 0.0 and t == 0.0:
        safe = slide_start(slide, start, side, slide.share * rate)
    else:
        safe = cubic_step(max(0.0, speed), gain, bend, snap_of(slide, now), reach)
    if safe == 0.0:
        safe = 1e-3 * reach  # force and speed and their rates are all zero: the third derivative decides
    towards = time_to(near, speed, gain, bend)
    return (towards, REACHED) if towards <= safe else (safe, TURNED)


def held_end(
    slide: Oscillator,
    forces: tuple[Force, Force],
    start: State,
    side: float,
    rate: float,
    limits: tuple[float, float],
    end: float,
    tally: Buffer,
) -> tuple[float, float, float, int, float, float]:
    """Return the time at which the way of a mass on held sliders first reaches one of two limits, or `end`.

    With it the way, v, what ended it, the side of the limit, and whether (1.0 or 0.0) the mass may have turned before.
    Between turns the march of `phase_end` proves that the velocity keeps its sign, so no limit is passed; over rings
    that cannot reach one it leaps (`calm_past`). `forces` are the drive and, to be written, the forced motion.
    """
    force, slow = forces
    leaps, ring = rings(slide, force), Ring(0.0, 0.0)
    if leaps:
        forced_part(slide, force, slow)
        ring = ring_of(slide, force, slow, start)
    t, now, tries, turned = 0.0, first_point(slide, start, rate), TRIES, 0.0
    while t < end:
        left = limits[0] if side > 0.0 else -limits[1]
        step, what = step_ahead(slide, start, now, t, side, rate, left - side * now.way)
        if what == REACHED and t + step < end and (step <= 2e-16 * t or is_exact(slide, now, step)):
            return t + step, side * left, speed_after(now, step), REACHED, side, turned
        past, t = t, min(end, t + step)
        if what == TURNED and step <= 2e-16 * past:
            side, tries, turned = -side, TRIES, 1.0  # a turn, met to rounding
            continue
        now = motion_at(t, slide, force, start)
        tally[EVALUATIONS] += 1.0
        if what == PAST_TURN and side * now.v <= 0.0:
            side, tries, turned = -side, TRIES, 1.0
            left = limits[0] if side > 0.0 else -limits[1]
        if side * now.way > left - 4e-16 * abs(left):
            t, v = crossing(slide, force, start, (side, left), (past, t), now, tally)
            return t, side * left, v, REACHED, side, turned
        if side * now.v <= 0.0:
            side, tries, turned = -side, TRIES, 1.0
        if leaps and tries > 0.0:  # as far as can be known before the next turn
            calm = calm_past(t, now.way, now.v, slide, slow, ring, limits, end)
            tries = tries - 1.0 if calm == t else 0.0
            if calm > t:
                t, turned = calm, 1.0
                now = motion_at(t, slide, force, start)
                tally[EVALUATIONS] += 1.0
                side = heading(now)
    return t, now.way, now.v, LIMIT, side, turned
