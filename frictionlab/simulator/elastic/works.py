"""Works and range of a held contact that rings, over all its rings at once."""

from math import cos, exp, expm1, sin

from frictionlab.simulator.elastic.layout import Ring
from frictionlab.simulator.elastic.ringing import add_wall, calm_past, forced_part, ring_of, rings, slow_motion
from frictionlab.simulator.kernel.events import jerk_bound, safe_step
from frictionlab.simulator.kernel.layout import (
    BOTTOM,
    CROSS,
    TOP,
    TURN,
    VISCOUS,
    WORK,
    Buffer,
    Force,
    Oscillator,
    Rig,
    State,
)
from frictionlab.simulator.kernel.motion import slide_at

__all__ = [
    "farthest",
    "growth",
    "is_long_ring",
    "product_integral",
    "range_between",
    "ring_range",
    "ring_work",
    "speed_integral",
]

SAMPLES = 24  # of the slow motion, for each of its harmonics
LONG = 4.0  # rad of the ring: up to there one panel of nodes does


def is_long_ring(slide: Oscillator, force: Force, slipping: float, span: float) -> bool:
    """Tell whether a recorded phase is one of a held contact that rings for a while."""
    return slipping == 0.0 and span > LONG * slide.r and rings(slide, force)


def growth(s: complex, span: float) -> complex:
    """Return the integral of exp(s t) over a span, (exp(s T) - 1) / s."""
    if s == 0.0:
        return complex(span, 0.0)
    x, y = s.real * span, s.imag * span
    half = sin(0.5 * y)
    return complex(expm1(x) * cos(y) - 2.0 * half * half, exp(x) * sin(y)) / s


def product_integral(a: complex, p: complex, b: complex, q: complex, span: float) -> float:
    """Return the integral of Re(a exp(p t)) Re(b exp(q t)) over a span."""
    together = a * b * growth(p + q, span)
    apart = a * b.conjugate() * growth(p + q.conjugate(), span)
    return 0.5 * (together.real + apart.real)


def speed_integral(a: complex, p: complex, slow: Force, ring: complex, s: complex, span: float) -> float:
    """Return the integral of Re(a exp(p t)) v, with v the slow motion's velocity and Re(ring exp(s t))."""
    total = product_integral(a, p, ring, s, span)
    for i in range(len(slow.p)):
        k = i + 1.0
        total += product_integral(a, p, k * complex(slow.q[i], slow.p[i]), complex(0.0, k), span)
    return total


def ring_work(
    rig: Rig, slide: Oscillator, forces: tuple[Force, Force], start: State, span: float, tally: Buffer
) -> None:
    """Add the work of F and of both dashpots over a held phase: integrals of products of exponentials.

    From forces and velocities alone, as `slide_work` by nodes: what the sliders took is not looked at.
    """
    force, slow = forces
    forced_part(slide, force, slow)
    offset, drift = slow_motion(0.0, slow)
    y, dy = ring_of(slide, force, slow, start).offset - offset, start.v - drift
    decay = slide.zeta / slide.r
    s = complex(-decay, slide.omega)
    ring = s * complex(y, -(dy + decay * y) / slide.omega)
    viscous = speed_integral(ring, s, slow, ring, s, span)
    for i in range(len(force.p)):
        k = i + 1.0
        turning, speed = complex(0.0, k), k * complex(slow.q[i], slow.p[i])
        tally[WORK] += speed_integral(complex(force.p[i], -force.q[i]), turning, slow, ring, s, span)
        viscous += speed_integral(speed, turning, slow, ring, s, span)
        if rig.contact.frame != 0.0:  # f' of the base: see `kernel.accounts.base_speed`
            lead = 2.0 * rig.contact.frame * rig.plain.r * k
            p, q = force.p[i] - lead * force.q[i], force.q[i] + lead * force.p[i]
            base = k / (1.0 + lead * lead) * complex(q, p)
            tally[CROSS] += speed_integral(base, turning, slow, ring, s, span)
    tally[VISCOUS] += 2.0 * rig.plain.zeta * rig.plain.r * viscous


def farthest(slow: Force, span: float, sign: float) -> float:
    """Return about when the slow motion is farthest to a side."""
    count, best, when = SAMPLES * len(slow.p), -1e300, 0.0
    for i in range(count + 1):
        t = span * i / count
        z, _ = slow_motion(t, slow)
        if sign * z > best:
            best, when = sign * z, t
    return when


def range_between(
    slide: Oscillator,
    forces: tuple[Force, Force, Force],
    start: State,
    ring: Ring,
    begin: float,
    end: float,
    tally: Buffer,
) -> None:
    """Widen the tally's range by the displacement from begin to end; leap over rings that stay within it.

    Marched as in `slide_end`: every point visited counts, so the zeros of the velocity are met to rounding. `forces`
    are the drive, the slow motion and the wall's.
    """
    force, slow, wall = forces
    third, reach, t = 0.0, min(slide.r, 1.0), begin
    for i in range(len(wall.p)):
        third += (i + 1.0) ** 3 * (abs(wall.p[i]) + abs(wall.q[i]))
    while True:
        z, v, a = slide_at(t, slide, force, start)
        jerk = third + jerk_bound(slide, v, a)
        for i in range(len(wall.p)):
            k = i + 1.0
            c, s = cos(k * t), sin(k * t)
            z += wall.p[i] * c + wall.q[i] * s
            v += k * (wall.q[i] * c - wall.p[i] * s)
            a -= k * k * (wall.p[i] * c + wall.q[i] * s)
        tally[TOP], tally[BOTTOM] = max(tally[TOP], start.z + z), min(tally[BOTTOM], start.z + z)
        if t >= end:
            return
        step = safe_step(abs(v), a if v >= 0.0 else -a, jerk) if v != 0.0 else 0.0
        limits = (tally[TOP] - start.z, tally[BOTTOM] - start.z)
        calm = calm_past(t, z, v, slide, slow, ring, limits, end)
        t = min(end, max(calm, t + max(1e-8 * reach, min(step, reach))))


def ring_range(slide: Oscillator, forces: tuple[Force, Force, Force], start: State, span: float, tally: Buffer) -> None:
    """Widen the tally's range by a held phase; `forces` are the drive, the slow motion, to be written, the wall's.

    Where not all of it stays within what has been seen, first about the slow motion's extremes: then most rings do.
    """
    force, slow, wall = forces
    forced_part(slide, force, slow)
    offset = ring_of(slide, force, slow, start).offset
    add_wall(slow, wall)
    ring = Ring(offset, ring_of(slide, force, slow, start).curve)
    period, seen = TURN / slide.omega, (tally[TOP] - start.z, tally[BOTTOM] - start.z)
    if len(wall.p) == 0 and calm_past(0.0, 0.0, start.v, slide, slow, ring, seen, span) >= span:
        return
    for side in (1.0, -1.0):
        middle = farthest(slow, span, side)
        range_between(slide, forces, start, ring, max(0.0, middle - period), min(span, middle + period), tally)
    range_between(slide, forces, start, ring, 0.0, span, tally)
