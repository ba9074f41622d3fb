"""The formulas of a slide: exact between events, regular through resonance (README, "A slide")."""

from math import cos, exp, expm1, hypot, sin, sqrt

from frictionlab.simulator.kernel.layout import Force, Oscillator, Point, Rig, RigidContact, State

Driven = tuple[float, float, float, float, float]


def make_oscillator(r: float, zeta: float, stiffness: float, force: Force) -> Oscillator:
    """Return ``r^2 z'' + 2 zeta r z' + stiffness z = F`` after division by the stiffness, and bounds of its force."""
    rate, rate2 = 0.0, 0.0
    for i in range(len(force.cosine)):
        size = hypot(force.cosine[i], force.sine[i])
        rate += (i + 1) * size
        rate2 += (i + 1) * (i + 1) * size
    omega = sqrt(abs((1.0 - zeta) * (1.0 + zeta))) / r
    return stiffened(Oscillator(r, zeta, omega, rate, rate2, 1.0), stiffness)


def stiffened(plain: Oscillator, stiffness: float) -> Oscillator:
    """Return the oscillator of another stiffness, from that of stiffness 1."""
    if stiffness == 1.0:
        return plain
    root = sqrt(stiffness)
    r, zeta = plain.r / root, plain.zeta / root
    omega = sqrt(abs((1.0 - zeta) * (1.0 + zeta))) / r
    return Oscillator(r, zeta, omega, plain.rate / stiffness, plain.rate2 / stiffness, 1.0 / stiffness)


def make_rig(r: float, contact: RigidContact, force: Force) -> Rig:
    """Return the rig; under friction beta (1 + q z) a slide up has the stiffness 1 + beta q, one down 1 - beta q.

    A stiffness that is not positive is replaced by 1: `find_orbit` answers RUNAWAY then.
    """
    steep = contact.beta * contact.gradient
    plain = make_oscillator(r, contact.damping + contact.frame, 1.0, force)
    if abs(steep) >= 1.0:
        return Rig(contact, plain, plain, plain)
    return Rig(contact, plain, stiffened(plain, 1.0 + steep), stiffened(plain, 1.0 - steep))


def gap(r: float, k: float) -> float:
    """Return ``1 - k r`` without rounding in the product (Dekker), so that neighbours of r = 1/k stay apart."""
    big = 134217729.0 * r
    high = big - (big - r)
    low = r - high
    product = k * r
    return (1.0 - product) - ((k * high - product) + k * low)


def free_motion(t: float, slide: Oscillator) -> tuple[float, float, float]:
    """Return g, h and 1 - g: free motion from unit displacement, from unit velocity, and what the first has lost."""
    r, zeta, omega = slide.r, slide.zeta, slide.omega
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


def forced_motion(t: float, k: float, slide: Oscillator, h: float, lost: float) -> Driven:
    """Return C, S: the motion from rest under cos(k t), sin(k t); C - lost, under cos(k t) - 1; and cos, sin(k t).

    C + iS is the second divided difference of exp(s t) over ik and the two roots of the free motion, over r^2. Near
    resonance ik meets a root; there the difference quotient is sin(x)/x or expm1(x)/x (README, "Through resonance").
    """
    r, zeta, omega = slide.r, slide.zeta, slide.omega
    if zeta == 0.0:
        away = gap(r, k)
        if abs(away) > 0.25:
            scale = 1.0 / (away * (1.0 + k * r))
            s, c = sin(0.5 * k * t), cos(0.5 * k * t)
            cosine, low, high = (lost - 2.0 * s * s) * scale, 1.0 - 2.0 * s * s, 2.0 * s * c
            if t < 0.3 * min(r, 1.0 / k):  # what is left is of third and fourth order in t
                rest = cosine_defect(k * t) - (k * r) ** 2 * cosine_defect(t / r)
                return cosine, (k * r * sine_defect(t / r) - sine_defect(k * t)) * scale, rest * scale, low, high
            return cosine, (high - k * h) * scale, cosine - lost, low, high
        mean, half = 0.5 * (1.0 / r + k) * t, 0.5 * away / r * t
        beat = t / r * (sin(half) / half if half != 0.0 else 1.0)
        cosine = sin(mean) * beat / (1.0 + k * r)
        return cosine, (h / r - cos(mean) * beat) / (1.0 + k * r), cosine - lost, cos(k * t), sin(k * t)
    if zeta < 1.0:
        near, far = complex(-zeta / r, omega), complex(-zeta / r, -omega)
        decay = exp(-zeta / r * t)
        free = complex(decay * cos(omega * t), decay * sin(omega * t))
    else:
        near, far = complex(-1.0 / (r * (zeta + r * omega)), 0.0), complex(-(zeta / r + omega), 0.0)
        free = complex(exp(near.real * t), 0.0)
    first, drive = complex(0.0, k) - near, complex(cos(k * t), sin(k * t))
    if abs(first) * r > 0.25:
        quotient = (drive - free) / first
    elif first == 0.0:
        quotient = free * t
    else:
        x, y = first.real * t, first.imag * t
        quotient = free * complex(expm1(x) * cos(y) - 2.0 * sin(0.5 * y) ** 2, exp(x) * sin(y)) / first
    motion = (quotient - h) / ((complex(0.0, k) - far) * (r * r))
    return motion.real, motion.imag, motion.real - lost, drive.real, drive.imag


def local_force(tau: float, force: Force) -> tuple[float, float]:
    """Write the force's coefficients about tau, F(tau + t) = sum p cos(k t) + q sin(k t); return F and F' at tau."""
    p, q = force.p, force.q
    size, rate = 0.0, 0.0
    for i in range(len(p)):
        k = i + 1
        c, s = cos(k * tau), sin(k * tau)
        p[i] = force.cosine[i] * c + force.sine[i] * s
        q[i] = force.sine[i] * c - force.cosine[i] * s
        size += p[i]
        rate += k * q[i]
    return size, rate


def motion_at(t: float, slide: Oscillator, force: Force, start: State) -> Point:
    """Return the way made, v, a and v'' at time t of a phase from its start.

    Friction acts through the acceleration at the start only; the way is not a difference of displacements, so that it
    keeps its digits however small it is.
    """
    r, zeta = slide.r, slide.zeta
    v0, a0 = start.v, start.a
    g, h, lost = free_motion(t, slide)
    way = v0 * h + (r * r * a0 + 2.0 * zeta * r * v0) * lost
    v = v0 * g + a0 * h
    a = a0 * (g - 2.0 * zeta / r * h) - v0 * h / (r * r)
    rate = 0.0
    for i in range(len(force.p)):
        k = i + 1.0
        p, q = slide.share * force.p[i], slide.share * force.q[i]
        c, s, rest, low, high = forced_motion(t, k, slide, h, lost)
        way += p * rest + q * s
        v += k * (q * c - p * s)
        a += k * (q * (h / (r * r) - k * s) - k * p * c)
        rate += k * (q * low - p * high)
    return Point(way, v, a, (rate - v - 2.0 * zeta * r * a) / (r * r))


def push_at(t: float, slide: Oscillator, force: Force, start: State) -> tuple[float, float]:
    """Return v and F at time t of a slide from its start."""
    g, h, lost = free_motion(t, slide)
    v, push = start.v * g + start.a * h, 0.0
    for i in range(len(force.p)):
        k = i + 1.0
        c, s, _, low, high = forced_motion(t, k, slide, h, lost)
        v += k * slide.share * (force.q[i] * c - force.p[i] * s)
        push += force.p[i] * low + force.q[i] * high
    return v, push
