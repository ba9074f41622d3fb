"""The formulas of a slide: exact between events, regular through resonance (README, "A slide")."""

from math import cos, exp, expm1, hypot, sin, sqrt

from frictionlab.simulator.kernel.layout import Force, Rig, State

__all__ = [
    "cosine_defect",
    "forced_motion",
    "free_motion",
    "gap",
    "local_force",
    "make_rig",
    "sine_defect",
    "slide_at",
]


def make_rig(r: float, beta: float, mu: float, zeta: float, force: Force) -> Rig:
    """Return the rig: the problem's numbers and the bounds the searches rest on."""
    rate, rate2 = 0.0, 0.0
    for i in range(len(force[0])):
        size = hypot(force[0][i], force[1][i])
        rate += (i + 1) * size
        rate2 += (i + 1) * (i + 1) * size
    omega = sqrt(abs((1.0 - zeta) * (1.0 + zeta))) / r
    return r, beta, mu, zeta, omega, rate, rate2


def gap(r: float, k: float) -> float:
    """Return ``1 - k r`` without rounding in the product (Dekker), so that neighbours of r = 1/k stay apart."""
    big = 134217729.0 * r
    high = big - (big - r)
    low = r - high
    product = k * r
    return (1.0 - product) - ((k * high - product) + k * low)


def free_motion(t: float, rig: Rig) -> State:
    """Return g, h and 1 - g: free motion from unit displacement, from unit velocity, and what the first has lost."""
    r, _, _, zeta, omega, _, _ = rig
    if zeta == 0.0:
        s, c = sin(t / r), cos(t / r)
        return c, r * s, (s * s / (1.0 + c) if c > 0.0 else 1.0 - c)
    if zeta < 1.0:
        decay = exp(-zeta * t / r)
        s, c = sin(omega * t), cos(omega * t)
        h = decay * s / omega
        lost = decay * (s * s / (1.0 + c) if c > 0.0 else 1.0 - c) - expm1(-zeta * t / r) - zeta / r * h
        return decay * c + zeta / r * h, h, lost
    slow = -1.0 / (r * (zeta + r * omega))
    decay = exp(slow * t)
    h = decay * (-expm1(-2.0 * omega * t) / (2.0 * omega) if omega > 0.0 else t)
    return decay - slow * h, h, slow * h - expm1(slow * t)


def sine_defect(x: float) -> float:
    """Return x - sin(x) for small x."""
    y = x * x
    rest = 1.0 - y / 72.0 * (1.0 - y / 110.0 * (1.0 - y / 156.0))
    return x * y / 6.0 * (1.0 - y / 20.0 * (1.0 - y / 42.0 * rest))


def cosine_defect(x: float) -> float:
    """Return x^2 / 2 - (1 - cos(x)) for small x."""
    y = x * x
    rest = 1.0 - y / 90.0 * (1.0 - y / 132.0 * (1.0 - y / 182.0))
    return y * y / 24.0 * (1.0 - y / 30.0 * (1.0 - y / 56.0 * rest))


def forced_motion(t: float, k: float, rig: Rig, h: float, lost: float) -> State:
    """Return C and S: the motion from rest under cos(k t) and under sin(k t); and C - lost, under cos(k t) - 1.

    C + iS is the second divided difference of exp(s t) over ik and the two roots of the free motion, over r^2. Near
    resonance ik meets a root; there the difference quotient is sin(x)/x or expm1(x)/x (README, "Through resonance").
    """
    r, _, _, zeta, omega, _, _ = rig
    if zeta == 0.0:
        away = gap(r, k)
        if abs(away) > 0.25:
            scale = 1.0 / (away * (1.0 + k * r))
            s, c = sin(0.5 * k * t), cos(0.5 * k * t)
            cosine = (lost - 2.0 * s * s) * scale
            if t < 0.3 * min(r, 1.0 / k):  # what is left is of third and fourth order in t
                rest = cosine_defect(k * t) - (k * r) ** 2 * cosine_defect(t / r)
                return cosine, (k * r * sine_defect(t / r) - sine_defect(k * t)) * scale, rest * scale
            return cosine, (2.0 * s * c - k * h) * scale, cosine - lost
        mean, half = 0.5 * (1.0 / r + k) * t, 0.5 * away / r * t
        beat = t / r * (sin(half) / half if half != 0.0 else 1.0)
        cosine = sin(mean) * beat / (1.0 + k * r)
        return cosine, (h / r - cos(mean) * beat) / (1.0 + k * r), cosine - lost
    if zeta < 1.0:
        near, far = complex(-zeta / r, omega), complex(-zeta / r, -omega)
        decay = exp(-zeta / r * t)
        free = complex(decay * cos(omega * t), decay * sin(omega * t))
    else:
        near, far = complex(-1.0 / (r * (zeta + r * omega)), 0.0), complex(-(zeta / r + omega), 0.0)
        free = complex(exp(near.real * t), 0.0)
    first = complex(0.0, k) - near
    if abs(first) * r > 0.25:
        quotient = (complex(cos(k * t), sin(k * t)) - free) / first
    elif first == 0.0:
        quotient = free * t
    else:
        x, y = first.real * t, first.imag * t
        quotient = free * complex(expm1(x) * cos(y) - 2.0 * sin(0.5 * y) ** 2, exp(x) * sin(y)) / first
    motion = (quotient - h) / ((complex(0.0, k) - far) * (r * r))
    return motion.real, motion.imag, motion.real - lost


def local_force(tau: float, force: Force) -> tuple[float, float]:
    """Write the force's coefficients about tau, F(tau + t) = sum p cos(k t) + q sin(k t); return F and F' at tau."""
    cosine, sine, p, q = force
    size, rate = 0.0, 0.0
    for i in range(len(cosine)):
        k = i + 1
        c, s = cos(k * tau), sin(k * tau)
        p[i] = cosine[i] * c + sine[i] * s
        q[i] = sine[i] * c - cosine[i] * s
        size += p[i]
        rate += k * q[i]
    return size, rate


def slide_at(t: float, rig: Rig, force: Force, start: State) -> State:
    """Return the way made, v and a at time t of a slide that started as `start` (z, v, a).

    Friction acts through the acceleration at the start only; the way is not a difference of displacements, so that it
    keeps its digits however small it is.
    """
    r, _, _, zeta, _, _, _ = rig
    p, q = force[2], force[3]
    _, v0, a0 = start
    g, h, lost = free_motion(t, rig)
    way = v0 * h + (r * r * a0 + 2.0 * zeta * r * v0) * lost
    v = v0 * g + a0 * h
    a = a0 * (g - 2.0 * zeta / r * h) - v0 * h / (r * r)
    for i in range(len(p)):
        k = i + 1.0
        c, s, rest = forced_motion(t, k, rig, h, lost)
        way += p[i] * rest + q[i] * s
        v += k * (q[i] * c - p[i] * s)
        a += k * (q[i] * (h / (r * r) - k * s) - k * p[i] * c)
    return way, v, a
