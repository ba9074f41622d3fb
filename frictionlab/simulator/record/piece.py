"""The formulas of a piece: cubic force, linear oscillator, exact to rounding for any damping and stiffness.

    z'' + 2 zeta z' + S z = p(t),    p(t) = p0 + p1 t + p2 t^2 + p3 t^3

The motion is written from where it starts: with u_k the response from rest to t^k / k! and h the free motion from unit
velocity, ``way = v0 h + (a0 + 2 zeta v0) u_0 + p1 u_1 + 2 p2 u_2 + 6 p3 u_3``. All five are one power series in t,
whose terms fall by (rate t)^n / n!: steps are short (README, "Pieces"), so nine terms are all there is in doubles.
"""

from math import sqrt

from frictionlab.simulator.record.layout import Cubic, Free, Jet

TERMS = 9


def free_motion(t: float, stiffness: float, zeta: float) -> Free:
    """Return h and the responses from rest to 1, t, t^2/2, t^3/6 at time t of an oscillator."""
    before, now = 0.0, 1.0
    w0 = t
    w1 = w0 * t / 2.0
    w2 = w1 * t / 3.0
    w3 = w2 * t / 4.0
    w4 = w3 * t / 5.0
    h, u0, u1, u2, u3 = 0.0, 0.0, 0.0, 0.0, 0.0
    for n in range(TERMS):
        h += now * w0
        u0 += now * w1
        u1 += now * w2
        u2 += now * w3
        u3 += now * w4
        before, now = now, -2.0 * zeta * now - stiffness * before
        w0, w1, w2, w3, w4 = w1, w2, w3, w4, w4 * t / (n + 6.0)
    return h, u0, u1, u2, u3


def moved(free: Free, stiffness: float, zeta: float, v: float, a: float, force: Cubic) -> tuple[float, float, float]:
    """Return the way made, velocity and acceleration after the time that `free` belongs to; v, a at its start."""
    h, u0, u1, u2, u3 = free
    _, p1, p2, p3 = force
    push = a + 2.0 * zeta * v
    slope = 1.0 - 2.0 * zeta * h - stiffness * u0  # h'
    way = v * h + push * u0 + p1 * u1 + 2.0 * p2 * u2 + 6.0 * p3 * u3
    speed = v * slope + push * h + p1 * u0 + 2.0 * p2 * u1 + 6.0 * p3 * u2
    return way, speed, a * slope - stiffness * v * h + p1 * h + 2.0 * p2 * u0 + 6.0 * p3 * u1


def cubic_of(y0: float, y1: float, d0: float, d1: float, h: float) -> Cubic:
    """Return the cubic with values y0, y1 and slopes d0, d1 at the ends of a piece of length h."""
    slope = (y1 - y0) / h
    bend = (d0 + d1 - 2.0 * slope) / h
    return y0, d0, (slope - d0) / h - bend, bend / h


def force_of(base: Cubic, zeta: float, wall: float) -> Cubic:
    """Return the force F: f + 2 zeta_f f' for a wall that stands (0), -f'' for one that moves with the base (1).

    Where the base is given by its acceleration (2), that is f'' itself.
    """
    f0, f1, f2, f3 = base
    if wall == 2.0:
        return -f0, -f1, -f2, -f3
    if wall != 0.0:
        return -2.0 * f2, -6.0 * f3, 0.0, 0.0
    return f0 + 2.0 * zeta * f1, f1 + 4.0 * zeta * f2, f2 + 6.0 * zeta * f3, f3


def shifted(cubic: Cubic, t: float) -> Cubic:
    """Return the cubic about a later time."""
    c0, c1, c2, c3 = cubic
    return c0 + t * (c1 + t * (c2 + t * c3)), c1 + t * (2.0 * c2 + 3.0 * t * c3), c2 + 3.0 * t * c3, c3


def jerk_bound(stiffness: float, zeta: float, v: float, a: float, force: Cubic, span: float) -> float:
    """Bound |v''| = |p' - S v - 2 zeta a| over a span, from v and a at its start.

    With M the bound itself, |v| <= |v0| + |a0| t + M t^2/2 and |a| <= |a0| + M t: solved for M. The span is so short
    that the divisor is near 1.
    """
    _, p1, p2, p3 = force
    rate = abs(p1) + span * (2.0 * abs(p2) + span * 3.0 * abs(p3))
    known = rate + stiffness * (abs(v) + span * abs(a)) + 2.0 * zeta * abs(a)
    return known / (1.0 - span * (0.5 * stiffness * span + 2.0 * zeta)) + 1e-300


def safe_step(value: float, gain: float, bend: float) -> float:
    """Return t up to which value + gain t - bend t^2/2 stays positive; value >= 0, bend > 0."""
    root = sqrt(gain * gain + 2.0 * bend * value)
    if gain > 0.0:
        return (gain + root) / bend
    return 2.0 * value / (root - gain) if value > 0.0 else 0.0


def product_integral(span: float, u0: Jet, w0: Jet, u1: Jet, w1: Jet) -> float:
    """Return the integral of u w over a span, from values and two derivatives at its start and end.

    Hermite's rule ``h/2 (y0 + y1) + h^2/10 (y0' - y1') + h^3/120 (y0'' + y1'')``: exact up to degree 5.
    """
    at = u0[0] * w0[0] + u1[0] * w1[0]
    slope = u0[1] * w0[0] + u0[0] * w0[1] - u1[1] * w1[0] - u1[0] * w1[1]
    bend0 = u0[2] * w0[0] + 2.0 * u0[1] * w0[1] + u0[0] * w0[2]
    bend1 = u1[2] * w1[0] + 2.0 * u1[1] * w1[1] + u1[0] * w1[2]
    return span * (0.5 * at + span * (0.1 * slope + span / 120.0 * (bend0 + bend1)))
