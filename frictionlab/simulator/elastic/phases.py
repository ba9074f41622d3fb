"""One phase: an oscillator of some stiffness until it turns or a slider gives way; nothing is stepped over."""

from math import inf, sqrt

from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.events import cubic_step, slide_start, snap_bound, stiff_bound
from frictionlab.simulator.kernel.layout import Buffer, Force, Oscillator, Point, State
from frictionlab.simulator.kernel.motion import motion_at

EXACT = 4e-16  # share of the speed that a Taylor step may err by: less than a look at the phase rounds


def first_point(slide: Oscillator, start: State, rate: float) -> Point:
    """Return the start of a phase, with v'' from F'."""
    bend = (slide.share * rate - start.v - 2.0 * slide.zeta * slide.r * start.a) / (slide.r * slide.r)
    return Point(0.0, start.v, start.a, bend)


def snap_of(slide: Oscillator, now: Point) -> float:
    """Bound |v'''| over the next min(r, 1)."""
    snap = snap_bound(slide, now.v, now.a)
    return min(snap, stiff_bound(slide, now.v, now.a, now.bend)) if slide.zeta > 1.0 else snap


def time_to(near: float, speed: float, gain: float, bend: float) -> float:
    """Return about when a way is made at the present rates; never: inf.

    The first h with speed h + gain h^2/2 = near, then two Newton steps for what bend h^3/6 adds.
    """
    inside = speed * speed + 2.0 * gain * near
    if inside < 0.0 or speed + sqrt(inside) == 0.0:
        return inf
    first = 2.0 * near / (speed + sqrt(inside))
    h = first
    for _ in range(2):
        slope = speed + h * (gain + 0.5 * bend * h)
        if slope <= 0.0:
            return first
        h -= (h * (speed + h * (0.5 * gain + bend * h / 6.0)) - near) / slope
    return h if h * first > 0.0 else first


def turn_after(speed: float, gain: float, bend: float) -> float:
    """Return about when the velocity is 0 at the present rates: the first h with speed + gain h + bend h^2/2 = 0."""
    inside = gain * gain - 2.0 * bend * speed
    return 2.0 * speed / (sqrt(inside) - gain) if gain < 0.0 < inside else inf


def is_exact(slide: Oscillator, now: Point, h: float) -> bool:
    """Tell whether way and velocity after a short time follow from the present rates to rounding."""
    return snap_of(slide, now) * abs(h * h * h) <= EXACT * abs(now.v)


def speed_after(now: Point, h: float) -> float:
    """Return the velocity a little later."""
    return now.v + h * (now.a + 0.5 * now.bend * h)


def last_step(now: tuple[float, float, float], snap: float, t: float, safe: float, towards: float) -> tuple[float, int]:
    """Return the step to the limit or to a turn, and which, where the present rates tell it to rounding; else LIMIT.

    `now` holds speed, gain and bend; the speed is positive for the time `safe`, the limit reached after `towards`.
    """
    speed, gain, bend = now
    if towards <= safe:
        return towards, layout.REACHED if snap * towards * towards * towards <= EXACT * speed else layout.LIMIT
    rest = turn_after(speed, gain, bend)
    if rest < inf and snap * rest * rest * rest <= -EXACT * gain * t:
        return rest, layout.TURNED
    return 0.0, layout.TURNED if safe <= 2e-16 * t else layout.LIMIT


def phase_end(
    slide: Oscillator, force: Force, start: State, side: float, rate: float, left: float, limit: float, tally: Buffer
) -> tuple[float, float, float, int]:
    """Return the time of the first of three: the way `left` is made, the velocity is 0, `limit`; way, v; which.

    From (v, a, v'') and a bound of |v'''| the velocity surely keeps its sign for a step. So the way only grows, and its
    crossing of `left` cannot be missed. It is looked for where those rates put it, if that lies within the step; and
    the last step, to a crossing or a turn, needs no look where the rates alone tell it to rounding.
    """
    reach, t, now = min(slide.r, 1.0), 0.0, first_point(slide, start, rate)
    while True:
        rates, snap = (side * now.v, side * now.a, side * now.bend), snap_of(slide, now)
        if t == 0.0 and now.v == 0.0:
            safe = slide_start(slide, start, side, slide.share * rate)
            if safe == 0.0:
                safe = 1e-3 * reach  # force and speed and their rates are all zero: the third derivative decides
        else:
            safe = cubic_step(rates[0], rates[1], rates[2], snap, reach)
        towards = time_to(left - side * now.way, rates[0], rates[1], rates[2])
        step, what = last_step(rates, snap, t, safe, towards)
        if what == layout.REACHED and t + step < limit:
            return t + step, side * left, speed_after(now, step), layout.REACHED
        if what == layout.TURNED and t + step < limit:
            return t + step, now.way + step * (now.v + step * (0.5 * now.a + step * now.bend / 6.0)), 0.0, layout.TURNED
        low, t = t, min(limit, t + min(safe, towards))
        now = motion_at(t, slide, force, start)
        tally[layout.EVALUATIONS] += 1.0
        near = left - side * now.way
        if near < 0.0 or abs(near) <= 4e-16 * left:
            t, v = crossing(slide, force, start, (side, left), (low, t), now, tally)
            return t, side * left, v, layout.REACHED
        if side * now.v <= 0.0 or t >= limit:
            return t, now.way, max(0.0, side * now.v) * side, layout.TURNED if side * now.v <= 0.0 else layout.LIMIT


def crossing(
    slide: Oscillator,
    force: Force,
    start: State,
    goal: tuple[float, float],
    within: tuple[float, float],
    now: Point,
    tally: Buffer,
) -> tuple[float, float]:
    """Return when a way is made, and v there; the way grows over a time at whose end, `now`, it is longer.

    `goal` is the side and the way to it.
    """
    side, left = goal
    low, high = within
    t = high
    for _ in range(80):
        over = side * now.way - left
        if abs(over) <= 4e-16 * left:
            break
        if over > 0.0:
            high = t
        else:
            low = t
        speed, gain, bend = side * now.v, side * now.a, side * now.bend
        step = -over / speed if speed > 0.0 else low - high
        if speed > 0.0:
            for _ in range(2):
                slope = speed + step * (gain + 0.5 * bend * step)
                step -= (
                    (step * (speed + step * (0.5 * gain + bend * step / 6.0)) + over) / slope if slope > 0.0 else 0.0
                )
            if low < t + step < high and is_exact(slide, now, step):
                return t + step, speed_after(now, step)
        new = t + step
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - t) <= 2e-16 * t:
            break
        t = new
        now = motion_at(t, slide, force, start)
        tally[layout.EVALUATIONS] += 1.0
    return t, now.v
