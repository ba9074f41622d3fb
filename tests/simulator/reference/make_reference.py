"""Make reference.json, laws.json and uneven.json: steady states at hard points, at 50 digits, by the textbook alone.

    python tests/simulator/reference/make_reference.py          # points that the files lack

Independent of the package on purpose: mpmath, the textbook solution between events (with the secular form at r = 1 and
the degenerate form at zeta = 1), zeros by dense scanning and bisection, orbits by Newton with differences. It takes
minutes. Parameters are the doubles themselves, so that the package is compared at exactly the same point.
"""

import json
from pathlib import Path
from typing import Any, NamedTuple

import mpmath as mp

mp.mp.dps = 50
SCAN = 40  # points per natural (or drive) half-period

POINTS = [
    # r, beta, mu, zeta: why it is hard
    (0.5, 0.4, 1.0, 0.0, "known value of the design"),
    (0.01, 0.5, 1.0, 0.0, "fifty stops per cycle"),
    (0.013, 0.02, 1.0, 0.0, "little friction at low frequency"),
    (20.0, 0.999, 1.0, 0.0, "a motion of 1e-7 under a force of 1"),
    (1.2621, 0.999, 1.0, 0.0, "force barely over friction"),
    (1.0 + 1e-12, 0.3, 1.0, 0.0, "beside resonance"),
    (1.0 - 1e-15, 0.5, 1.0, 0.0, "one step beside resonance"),
    (1.0, 0.8, 1.0, 0.0, "at resonance, friction just strong enough"),
    (0.3335, 0.01, 1.0, 0.0, "beside the superharmonic 1/3"),
    (1.0 / 3.0, 0.05, 1.0, 0.0, "at the superharmonic 1/3"),
    (0.95, 0.1, 1.0, 0.0, "100 cycles are far from steady"),
    (0.1, 0.4, 1.0, 0.0, "six stops"),
    (0.2, 0.3, 1.0, 0.0, "RK45 misses a stop here"),
    (0.4, 0.5, 1.3, 0.0, "static friction"),
    (0.05, 0.2, 2.0, 0.0, "static friction, several stops"),
    (0.4, 0.5, 1.0, 0.1, "damped"),
    (1.0, 0.3, 1.0, 1e-9, "at resonance, hardly damped"),
    (0.4, 0.5, 1.0, 1.0, "critically damped"),
    (0.4, 0.5, 1.0, 10.0, "overdamped"),
    (1000.0, 0.5, 1.0, 0.0, "three decades over resonance"),
]


LAWS = [
    # r, beta, then what the law adds: why it is hard
    (0.5, 0.4, {"gradient": 0.05}, "friction varying along the path"),
    (0.7, 0.5, {"gradient": -0.3, "contact_damping_ratio": 0.02}, "a steep place, continuous"),
    (0.2, 0.3, {"gradient": 0.1}, "place, several stops"),
    (0.45, 0.5, {"static_ratio_up": 1.3, "static_ratio_down": 1.05}, "break-away by direction"),
    (0.6, 0.3, {"frame_damping_ratio": 0.05}, "the frame's own dashpot"),
    (
        0.4,
        0.5,
        {"gradient": 0.08, "static_ratio_up": 1.1, "static_ratio_down": 1.2, "frame_damping_ratio": 0.03},
        "all together",
    ),
]


UNEVEN: list[tuple[Any, ...]] = [
    # r, beta, law's parameters, base's cosine and sine, wall: why it is hard
    (0.45, 0.5, {}, ([1.0, 0.2, 0.1], [0.0, 0.1, -0.15]), "fixed", "harmonics"),
    (0.9, 0.6, {}, ([1.0, 0.15], [0.0, -0.1]), "base", "harmonics on a moving wall"),
    (
        0.4,
        0.45,
        {"static_ratio_up": 1.2, "static_ratio_down": 1.05, "frame_damping_ratio": 0.04},
        ([1.0, 0.2, 0.0, 0.1, 0.05], [0.1, 0.1, 0.15, 0.0, 0.1]),
        "fixed",
        "five harmonics, break-away, a damped frame",
    ),
    (
        0.7,
        0.35,
        {
            "gradient": -0.1,
            "contact_damping_ratio": 0.05,
            "static_ratio_up": 1.15,
            "static_ratio_down": 1.3,
            "frame_damping_ratio": 0.02,
        },
        ([1.0, 0.2, 0.1], [0.0, 0.1, 0.1]),
        "base",
        "all terms, harmonics, a moving wall, a damped frame",
    ),
]


class Rig(NamedTuple):
    """The numbers of a problem; zeta is the sum of both dashpots, base the complex amplitudes of its harmonics."""

    r: Any
    beta: Any
    up: Any
    down: Any
    zeta: Any
    gradient: Any
    frame: Any
    base: Any = (mp.mpc(1),)
    moving: Any = False

    @property
    def lines(self) -> Any:
        """F = sum Re(line exp(i k tau)), k from 1 on: the frame's dashpot sees the base move, or the wall does."""
        return [
            b * ((k * self.r) ** 2 if self.moving else mp.mpc(1, 2 * self.frame * self.r * k))
            for k, b in enumerate(self.base, 1)
        ]

    def force(self, tau: Any) -> Any:
        return series(self.lines, tau)

    def load(self, z: Any) -> Any:
        return self.beta * (1 + self.gradient * z)


def coulomb(r: Any, beta: Any, zeta: Any, mu: Any = 1) -> Rig:
    """Friction that knows only its direction, and one dashpot."""
    return Rig(r, beta, mp.mpf(mu), mp.mpf(mu), zeta, mp.mpf(0), mp.mpf(0))


def series(lines: Any, tau: Any, order: int = 0) -> Any:
    """A Fourier series, or a derivative of it."""
    return mp.fsum(((1j * k) ** order * line * mp.expj(k * tau)).real for k, line in enumerate(lines, 1))


class Slide:
    """The textbook motion of one slide: particular integral plus free motion."""

    def __init__(self, rig: Rig, tau: Any, z: Any, v: Any, side: Any) -> None:
        r, zeta, stiffness = rig.r, rig.zeta, 1 + side * rig.beta * rig.gradient
        self.r, self.zeta, self.tau, self.offset = r, zeta, tau, -rig.beta * side / stiffness
        self.resonant = r == 1 and zeta == 0
        bends = [mp.mpc(stiffness - (k * r) ** 2, 2 * zeta * r * k) for k in range(1, len(rig.base) + 1)]
        self.gains = None if self.resonant else [line / bend for line, bend in zip(rig.lines, bends, strict=True)]
        z0, v0 = self.forced(mp.mpf(0))
        a, b = z - z0 - self.offset, v - v0
        self.critical = zeta == 1
        if self.critical:
            self.c1, self.c2 = a, b + a / r
            return
        root = mp.sqrt(mp.mpc(zeta * zeta - stiffness))
        self.l1, self.l2 = (-zeta + root) / r, (-zeta - root) / r
        self.c1 = (b - self.l2 * a) / (self.l1 - self.l2)
        self.c2 = a - self.c1

    def forced(self, t: Any) -> Any:
        if self.resonant:  # x'' + x = cos(tau): t sin(tau) / 2 about the start
            now = self.tau + t
            return t * mp.sin(now) / 2, mp.sin(now) / 2 + t * mp.cos(now) / 2
        return series(self.gains, self.tau + t), series(self.gains, self.tau + t, 1)

    def at(self, t: Any) -> Any:
        z, v = self.forced(t)
        if self.critical:
            e = mp.exp(-t / self.r)
            return z + self.offset + e * (self.c1 + self.c2 * t), v + e * (self.c2 - (self.c1 + self.c2 * t) / self.r)
        e1, e2 = self.c1 * mp.exp(self.l1 * t), self.c2 * mp.exp(self.l2 * t)
        return z + self.offset + (e1 + e2).real, v + (self.l1 * e1 + self.l2 * e2).real


def bisect(f: Any, low: Any, high: Any) -> Any:
    """Zero of f between a positive low and a non-positive high."""
    for _ in range(170):
        middle = (low + high) / 2
        low, high = (middle, high) if f(middle) > 0 else (low, middle)
    return high


def slide_end(slide: Any, side: Any, limit: Any) -> Any:
    """First zero of the velocity; minima between two scanned points are looked into."""
    step = min(slide.r, mp.mpf(1)) * mp.pi / SCAN
    marks = [step * mp.mpf(2) ** -k for k in range(60, 0, -1)]
    t = step
    while t < limit:
        marks.append(t)
        t += step
    marks = [m for m in marks if m < limit] + [limit]

    def speed(t: Any) -> Any:
        return side * slide.at(t)[1]

    values = [speed(m) for m in marks]
    for i in range(1, len(marks)):
        if values[i] <= 0:
            return bisect(speed, marks[i - 1], marks[i]) if i else marks[0]
        if 0 < i < len(marks) - 1 and values[i] < values[i - 1] and values[i] < values[i + 1]:
            low, high = marks[i - 1], marks[i + 1]
            for _ in range(200):  # golden section: does the minimum dip below zero?
                a, b = low + (high - low) * mp.mpf("0.382"), low + (high - low) * mp.mpf("0.618")
                low, high = (low, b) if speed(a) < speed(b) else (a, high)
            if speed(low) <= 0:
                return bisect(speed, marks[i - 1], low)
    return None


def work(slide: Any, span: Any) -> Any:
    """Integral of the squared velocity over a slide."""
    return mp.quad(lambda t: slide.at(t)[1] ** 2, mp.linspace(0, span, 9))


def release(rig: Rig, tau: Any, z: Any, limit: Any) -> Any:
    """First time at which F - z reaches the static limit, to the right side."""
    if len(rig.base) > 1:
        return scanned_release(rig, tau, z, limit)
    best, drive = None, rig.lines[0]
    for way, ratio in ((1, rig.up), (-1, rig.down)):
        level = (z + way * ratio * rig.load(z)) / abs(drive)
        if abs(level) >= 1:
            continue
        when = (-way * mp.acos(level) - mp.arg(drive) - tau) % (2 * mp.pi)
        best = (when, way) if best is None or when < best[0] else best
    return best if best is not None and best[0] < limit else None


def scanned_release(rig: Rig, tau: Any, z: Any, limit: Any) -> Any:
    """The same under several harmonics: by dense scanning; a crest that just reaches the limit would be missed."""

    def left(t: Any) -> Any:
        pull = rig.force(tau + t) - z
        return min(rig.up * rig.load(z) - pull, rig.down * rig.load(z) + pull)

    step = mp.pi / (2 * SCAN * len(rig.base))
    before = mp.mpf(0)
    while before < limit:
        t = min(limit, before + step)
        if left(t) < 0:
            t = bisect(left, before, t)
            return t, int(mp.sign(rig.force(tau + t) - z))
        before = t
    return None


def carry(rig: Rig, z: Any, v: Any, span: Any) -> Any:
    """Carry a state from tau = 0 over a span; return z, v, path weighed by the load, viscous work, stops, extremes.

    The viscous work is that of both dashpots, less what the frame's gets from the base's motion alone.
    """
    tau = mp.mpf(0)
    end, path, stops, viscous = tau + span, mp.mpf(0), 0, mp.mpf(0)
    high, low, slid = -mp.inf, mp.inf, False
    while tau < end:
        pull = rig.force(tau) - z
        if v == 0 and -rig.down * rig.load(z) <= pull <= rig.up * rig.load(z):
            stops += slid
            loose = release(rig, tau, z, end - tau)
            if loose is None:
                break
            tau, side = tau + loose[0], loose[1]
        else:
            side = mp.sign(v) if v != 0 else mp.sign(pull)
        slide = Slide(rig, tau, z, v, side)
        t = slide_end(slide, side, end - tau)
        over = t is None
        t = end - tau if over else t
        if rig.zeta:
            viscous += 2 * rig.zeta * rig.r * work(slide, t)
        if rig.frame and not rig.moving:
            viscous += 4 * rig.frame * rig.r * cross(rig, slide, tau, t)
        before = z
        z, v = slide.at(t)
        v = v if over else mp.mpf(0)
        path += abs(z - before) * (1 + rig.gradient * (z + before) / 2)
        high, low = max(high, z, before), min(low, z, before)
        tau, slid = (end if over else tau + t), True
    return z, v, path, viscous, stops, high, low


def cross(rig: Rig, slide: Any, tau: Any, span: Any) -> Any:
    """Integral of -v f' over a slide: what the frame's dashpot, which sees v - f', takes more."""
    return mp.quad(lambda t: -slide.at(t)[1] * series(rig.base, tau + t, 1), mp.linspace(0, span, 9))


def den_hartog(r: Any, beta: Any) -> Any:
    """State at tau = 0 by eqs (2.10)-(2.14), a first guess where the amplitude is far from rest; None without one."""
    if r == 1:
        return None
    v, u = 1 / (1 - r * r), mp.sin(mp.pi / r) / (r * (1 + mp.cos(mp.pi / r)))
    if abs(beta * u) >= abs(v):
        return None
    x = mp.sqrt(v * v - (beta * u) ** 2)
    phase = mp.atan2(-beta * u / v, x / v)
    half = mp.floor(-phase / mp.pi)
    t, sign = -phase - half * mp.pi, (-1) ** int(half)
    c, s = mp.cos(t / r), mp.sin(t / r)
    z = x * mp.cos(t) + beta * u * mp.sin(t) + beta * (1 - c - u * r * s)
    w = -x * mp.sin(t) + beta * u * mp.cos(t) + beta * (s / r - u * c)
    return mp.matrix([sign * z, sign * w])


def orbit(rig: Rig, half: Any) -> Any:
    """Newton with differences on the map of half a period (mirrored) or of a whole one."""
    sign, span = (-1, mp.pi) if half else (1, 2 * mp.pi)

    def image(y: Any) -> Any:
        z, v, *_ = carry(rig, y[0], y[1], span)
        return mp.matrix([sign * z, sign * v])

    plain = rig.up == rig.down == 1 and rig.zeta == rig.gradient == 0
    y = den_hartog(rig.r, rig.beta) if plain else None
    if y is None:
        y = mp.matrix([0, 0])
        for _ in range(40 if half else 8):
            y = image(y)
    for _ in range(40):
        miss = image(y) - y
        if mp.norm(miss) < mp.mpf(10) ** -30:
            break
        d = mp.mpf(10) ** -22
        columns = [(image(y + mp.matrix([d, 0])) - image(y)) / d, (image(y + mp.matrix([0, d])) - image(y)) / d]
        jacobian = mp.matrix([[columns[0][0] - 1, columns[1][0]], [columns[0][1], columns[1][1] - 1]])
        y -= mp.lu_solve(jacobian, miss)
    return y, miss, sign, span


def reference(r: Any, beta: Any, mu: Any, zeta: Any, why: Any) -> Any:
    rig = coulomb(mp.mpf(r), mp.mpf(beta), mp.mpf(zeta), mu)
    half = mu == 1.0 or (r, beta, mu) == (0.4, 0.5, 1.3)
    return {"r": r, "beta": beta, "mu": mu, "zeta": zeta, "why": why} | numbers(rig, half)


def law_reference(r: Any, beta: Any, more: Any, why: Any) -> Any:
    names = ("static_ratio_up", "static_ratio_down", "contact_damping_ratio", "gradient", "frame_damping_ratio")
    up, down, contact, gradient, frame = (mp.mpf(more.get(name, name.startswith("static"))) for name in names)
    rig = Rig(mp.mpf(r), mp.mpf(beta), up, down, contact + frame, gradient, frame)
    return {"r": r, "beta": beta, "parameters": more, "why": why} | numbers(rig, half=up == down and gradient == 0)


def uneven_reference(r: Any, beta: Any, more: Any, base: Any, wall: Any, why: Any) -> Any:
    """Under harmonics, on either wall; on a moving one the amplitude is left out: z is not the mass's own motion."""
    names = ("static_ratio_up", "static_ratio_down", "contact_damping_ratio", "gradient", "frame_damping_ratio")
    up, down, contact, gradient, frame = (mp.mpf(more.get(name, name.startswith("static"))) for name in names)
    lines = tuple(mp.mpc(c, -s) for c, s in zip(*base, strict=True))
    rig = Rig(mp.mpf(r), mp.mpf(beta), up, down, contact + frame, gradient, frame, lines, wall == "base")
    told = numbers(rig, half=False)
    return {"r": r, "beta": beta, "parameters": more, "base": base, "wall": wall, "why": why} | {
        key: None if key == "response_amplitude" and rig.moving else value for key, value in told.items()
    }


def numbers(rig: Rig, half: Any) -> Any:
    y, miss, sign, span = orbit(rig, half)
    _, _, path, viscous, stops, high, low = carry(rig, y[0], y[1], span)
    cycles = span / (2 * mp.pi)
    amplitude = max(high, -low) if sign < 0 else (high - low) / 2
    squares = mp.fsum((k * abs(b)) ** 2 for k, b in enumerate(rig.base, 1))
    frame = 0 if rig.moving else 2 * rig.frame * rig.r * mp.pi * squares  # what its dashpot takes of the base alone
    return {
        "energy_per_cycle": mp.nstr((rig.beta * path + viscous) / cycles + frame, 30),
        "response_amplitude": mp.nstr(amplitude, 30),
        "stops_per_cycle": round(stops / float(cycles)),
        "miss": mp.nstr(mp.norm(miss), 3),
    }


def kept(name: str) -> Any:
    target = Path(__file__).with_name(name)
    return target, json.loads(target.read_text()) if target.exists() else []


def keep(target: Path, rows: Any) -> None:
    assert float(rows[-1]["miss"]) < 1e-15, rows[-1]
    target.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    target, rows = kept("reference.json")
    for point in POINTS:
        if not any(point[:4] == (row["r"], row["beta"], row["mu"], row["zeta"]) for row in rows):
            rows.append(reference(*point))
            keep(target, rows)
    target, rows = kept("laws.json")
    for r, beta, more, why in LAWS:
        if not any((r, beta, more) == (row["r"], row["beta"], row["parameters"]) for row in rows):
            rows.append(law_reference(r, beta, more, why))
            keep(target, rows)
    target, rows = kept("uneven.json")
    for uneven in UNEVEN:
        if not any(uneven[-1] == row["why"] for row in rows):
            rows.append(uneven_reference(*uneven))
            keep(target, rows)
