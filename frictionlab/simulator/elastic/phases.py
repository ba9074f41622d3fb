"""One phase: an oscillator of some stiffness until it turns or a slider gives way; nothing is stepped over."""

from math import inf, sqrt

from frictionlab.simulator.elastic.layout import LIMIT, REACHED, TURNED
from frictionlab.simulator.kernel.events import jerk_bound, safe_step, slide_start
from frictionlab.simulator.kernel.layout import EVALUATIONS, Buffer, Force, Oscillator, State
from frictionlab.simulator.kernel.motion import slide_at

__all__ = ["crossing", "phase_end", "stiffened", "time_to", "turn"]


def stiffened(plain: Oscillator, stiffness: float) -> Oscillator:
    """Return the oscillator of another stiffness, from that of stiffness 1."""
    if stiffness == 1.0:
        return plain
    root = sqrt(stiffness)
    r, zeta = plain.r / root, plain.zeta / root
    omega = sqrt(abs((1.0 - zeta) * (1.0 + zeta))) / r
    return Oscillator(r, zeta, omega, plain.rate / stiffness, plain.rate2 / stiffness, 1.0 / stiffness)


def time_to(left: float, speed: float, gain: float) -> float:
    """Return when a way is made at a steady acceleration: the first h with speed h + gain h^2/2 = left, or never."""
    inside = speed * speed + 2.0 * gain * left
    if inside < 0.0 or speed + sqrt(inside) == 0.0:
        return inf
    return 2.0 * left / (speed + sqrt(inside))


def phase_end(
    slide: Oscillator, force: Force, start: State, side: float, rate: float, left: float, limit: float, tally: Buffer
) -> tuple[float, float, float, float, int]:
    """Return the time of the first of three: the way `left` is made, the velocity is 0, `limit`; way, v, a; which.

    The march of `kernel.events.slide_end` proves that the velocity keeps its sign over each step. So the way only
    grows, and its crossing of `left` cannot be missed: it lies in the step after which the way is longer.
    """
    reach, low, t = min(slide.r, 1.0), 0.0, 0.0
    way, v, a = 0.0, start.v, start.a
    if v != 0.0:
        safe = min(reach, safe_step(side * v, side * a, jerk_bound(slide, v, a)))
    else:
        safe = slide_start(slide, start, side, slide.share * rate)
        if safe == 0.0:
            safe = 1e-3 * reach  # force and speed and their rates are all zero: the third derivative decides
    near = left
    while True:
        towards = time_to(near, side * v, side * a)
        step = min(safe, towards)
        if step <= 2e-16 * t:
            break
        low, t = t, min(limit, t + step)
        way, v, a = slide_at(t, slide, force, start)
        tally[EVALUATIONS] += 1.0
        near = left - side * way
        if near < 0.0 or abs(near) <= 4e-16 * left:
            t, v, a = crossing(slide, force, start, side, left, low, t)
            return t, side * left, v, a, REACHED
        if side * v <= 0.0:
            safe, towards = 0.0, inf
            break
        if t >= limit:
            return t, way, v, a, LIMIT
        safe = min(reach, safe_step(side * v, side * a, jerk_bound(slide, v, a)))
    if towards < safe:
        return t, side * left, v, a, REACHED
    t, way, a = turn(slide, force, start, side, t, limit)
    return t, way, 0.0, a, TURNED


def turn(
    slide: Oscillator, force: Force, start: State, side: float, t: float, limit: float
) -> tuple[float, float, float]:
    """Return time, way and a of the turn that the march has come down to: a last step of Newton's."""
    way, v, a = slide_at(t, slide, force, start)
    if side * a < 0.0 and abs(v) < 1e-6 * abs(a) * t:
        t = min(limit, t - v / a)
        way, v, a = slide_at(t, slide, force, start)
    return t, way, a


def crossing(
    slide: Oscillator, force: Force, start: State, side: float, left: float, low: float, high: float
) -> tuple[float, float, float]:
    """Return when the way `left` is made, v and a there; the way grows from low, where it is shorter, to high."""
    t, v, a = high, 0.0, 0.0
    for _ in range(80):
        way, v, a = slide_at(t, slide, force, start)
        over = side * way - left
        if abs(over) <= 4e-16 * left:
            break
        if over > 0.0:
            high = t
        else:
            low = t
        new = t - over / (side * v) if side * v > 0.0 else 0.5 * (low + high)
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - t) <= 2e-16 * t:
            break
        t = new
    return t, v, a
