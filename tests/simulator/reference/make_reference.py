"""Make rigid.json: steady states of rigid contacts at hard points.

    python -m tests.simulator.reference.make_reference          # of the rows that have no numbers yet

The points stand in the files alone, a row each: a new one is a row of what it is asked for.
At 50 digits by the textbook alone, independent of the package on purpose: mpmath, the textbook solution between events
(with the secular form at r = 1 and the degenerate form at zeta = 1), zeros by dense scanning and bisection, orbits by
Newton with differences. It takes minutes, the extremes an hour. Parameters are the doubles themselves, so that the
package is compared at exactly the same point.
"""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import mpmath as mp

mp.mp.dps = 50
SCAN = 40  # points per natural (or drive) half-period


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

    @classmethod
    def of(cls, row: dict[str, Any]) -> "Rig":
        """The numbers of a row of a file."""
        names = ("static_ratio_up", "static_ratio_down", "contact_damping_ratio", "gradient", "frame_damping_ratio")
        given = (mp.mpf(row["parameters"].get(name, name.startswith("static"))) for name in names)
        up, down, contact, gradient, frame = given
        lines = tuple(mp.mpc(c, -s) for c, s in zip(*row.get("base", ([1.0], [0.0])), strict=True))
        moves = row.get("wall") == "base"
        return cls(mp.mpf(row["r"]), mp.mpf(row["beta"]), up, down, contact + frame, gradient, frame, lines, moves)

    @property
    def lines(self) -> Any:
        """F = sum Re(line exp(i k tau)), k from 1 on: the frame's dashpot sees the base move, or the wall does."""
        return [
            b * ((k * self.r) ** 2 if self.moving else mp.mpc(1, 2 * self.frame * self.r * k))
            for k, b in enumerate(self.base, 1)
        ]

    def load(self, z: Any) -> Any:
        return self.beta * (1 + self.gradient * z)

    def slide(self, tau: Any, z: Any, v: Any, side: Any) -> "Slide":
        """The motion from (z, v) to a side."""
        stiffness = 1 + side * self.beta * self.gradient
        return Slide(self.r, self.zeta, self.lines, (tau, z, v), stiffness, -self.beta * side / stiffness)


def series(lines: Any, tau: Any, order: int = 0) -> Any:
    """A Fourier series, or a derivative of it."""
    return mp.fsum(((1j * k) ** order * line * mp.exp(mp.mpc(0, k * tau))).real for k, line in enumerate(lines, 1))


class Slide:
    """The textbook motion r^2 z'' + 2 zeta r z' + stiffness (z - offset) = F: particular integral plus free motion."""

    def __init__(self, r: Any, zeta: Any, lines: Any, start: Any, stiffness: Any, offset: Any) -> None:
        self.r, self.zeta, self.tau, self.offset = r, zeta, start[0], offset
        self.resonant = r == 1 and zeta == 0 and stiffness == 1 and len(lines) == 1
        bends = [mp.mpc(stiffness - (k * r) ** 2, 2 * zeta * r * k) for k in range(1, len(lines) + 1)]
        self.gains = lines if self.resonant else [line / bend for line, bend in zip(lines, bends, strict=True)]
        z0, v0 = self.forced(mp.mpf(0))
        a, b = start[1] - z0 - offset, start[2] - v0
        self.critical = zeta * zeta == stiffness
        if self.critical:
            self.c1, self.c2 = a, b + a * zeta / r
            return
        root = mp.sqrt(mp.mpc(zeta * zeta - stiffness))
        self.l1, self.l2 = (-zeta + root) / r, (-zeta - root) / r
        self.c1 = (b - self.l2 * a) / (self.l1 - self.l2)
        self.c2 = a - self.c1

    def forced(self, t: Any) -> Any:
        now = self.tau + t
        if self.resonant:  # x'' + x = F: t F(tau - pi/2) / 2 about the start
            push = series(self.gains, now - mp.pi / 2)
            return t * push / 2, push / 2 + t * series(self.gains, now) / 2
        return series(self.gains, now), series(self.gains, now, 1)

    def at(self, t: Any) -> Any:
        """Displacement and velocity after a time."""
        z, v = self.forced(t)
        if self.critical:
            e, rate = mp.exp(-self.zeta * t / self.r), self.zeta / self.r
            return z + self.offset + e * (self.c1 + self.c2 * t), v + e * (self.c2 - (self.c1 + self.c2 * t) * rate)
        e1, e2 = self.c1 * mp.exp(self.l1 * t), self.c2 * mp.exp(self.l2 * t)
        return z + self.offset + (e1 + e2).real, v + (self.l1 * e1 + self.l2 * e2).real


def bisect(f: Any, low: Any, high: Any) -> Any:
    """Zero of f between a positive low and a non-positive high."""
    for _ in range(170):
        middle = (low + high) / 2
        low, high = (middle, high) if f(middle) > 0 else (low, middle)
    return high


def turning(speed: Any, scale: Any, limit: Any) -> Any:
    """First zero of a speed that begins positive, or None; minima between two scanned points are looked into."""
    step = min(scale, mp.mpf(1)) * mp.pi / SCAN
    marks = [step * mp.mpf(2) ** -k for k in range(60, 0, -1)]
    early, before, k = mp.mpf(0), marks[0], 1
    values = [speed(before)]
    while before < limit:
        t = min(limit, marks[k] if k < len(marks) else before + step)
        k += 1
        values.append(speed(t))
        if values[-1] <= 0:
            return bisect(speed, before, t)
        if len(values) > 2 and values[-2] < values[-3] and values[-2] < values[-1]:
            low, high = early, t
            for _ in range(200):  # golden section: does the minimum dip below zero?
                a, b = low + (high - low) * mp.mpf("0.382"), low + (high - low) * mp.mpf("0.618")
                low, high = (low, b) if speed(a) < speed(b) else (a, high)
            if speed(low) <= 0:
                return bisect(speed, early, low)
        early, before = before, t
    return None


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
        pull = series(rig.lines, tau + t) - z
        return min(rig.up * rig.load(z) - pull, rig.down * rig.load(z) + pull)

    step = mp.pi / (2 * SCAN * len(rig.base))
    before = mp.mpf(0)
    while before < limit:
        t = min(limit, before + step)
        if left(t) < 0:
            t = bisect(left, before, t)
            return t, int(mp.sign(series(rig.lines, tau + t) - z))
        before = t
    return None


class Carried(NamedTuple):
    """Where a span ends, and what it was: the path weighed by the load, viscous work, time held, stops, extremes."""

    z: Any
    v: Any
    path: Any
    viscous: Any
    held: Any
    stops: int
    high: Any
    low: Any


def carry(rig: Rig, z: Any, v: Any, span: Any) -> Carried:
    """Carry a state from tau = 0 over a span.

    The viscous work is that of both dashpots, less what the frame's gets from the base's motion alone: it sees v - f'.
    """
    tau, end = mp.mpf(0), mp.mpf(0) + span
    path, viscous, held, stops, slid = mp.mpf(0), mp.mpf(0), mp.mpf(0), 0, False
    high, low = -mp.inf, mp.inf
    while tau < end:
        pull = series(rig.lines, tau) - z
        if v == 0 and -rig.down * rig.load(z) <= pull <= rig.up * rig.load(z):
            stops += slid
            loose = release(rig, tau, z, end - tau)
            held += end - tau if loose is None else loose[0]
            if loose is None:
                break
            tau, side = tau + loose[0], loose[1]
        else:
            side = mp.sign(v) if v != 0 else mp.sign(pull)
        slide = rig.slide(tau, z, v, side)
        t = turning(lambda t, at=slide.at, side=side: side * at(t)[1], rig.r, end - tau)
        over = t is None
        t = end - tau if over else t
        edges = mp.linspace(0, t, 9 + int(t / min(rig.r, 1)))
        if rig.zeta:
            viscous += 2 * rig.zeta * rig.r * mp.quad(lambda t, at=slide.at: at(t)[1] ** 2, edges)
        if rig.frame and not rig.moving:
            crossed = mp.quad(lambda t, at=slide.at, tau=tau: -at(t)[1] * series(rig.base, tau + t, 1), edges)
            viscous += 4 * rig.frame * rig.r * crossed
        before = z
        z, v = slide.at(t)
        v = v if over else mp.mpf(0)
        path += abs(z - before) * (1 + rig.gradient * (z + before) / 2)
        high, low = max(high, z, before), min(low, z, before)
        tau, slid = (end if over else tau + t), True
    return Carried(z, v, path, viscous, held, stops, high, low)


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


def newton(image: Callable[[Any], Any], y: Any) -> tuple[Any, Any]:
    """Fixed point of a map of the plane, by differences; and by how much it misses."""
    for _ in range(40):
        to = image(y)
        miss = to - y
        if mp.norm(miss) < mp.norm(y) * mp.mpf(10) ** (20 - mp.mp.dps):
            break
        d = mp.mpf(10) ** (-mp.mp.dps // 2)
        columns = [(image(y + mp.matrix(e)) - to) / d for e in ([d, 0], [0, d])]
        jacobian = mp.matrix([[columns[0][0] - 1, columns[1][0]], [columns[0][1], columns[1][1] - 1]])
        y -= mp.lu_solve(jacobian, miss)
    return y, miss


def reference(rig: Rig, *, half: bool, digits: int = 50) -> dict[str, Any]:
    """The steady state's numbers; half: its second half mirrors the first."""
    sign, span = (-1, mp.pi) if half else (1, 2 * mp.pi)

    def image(y: Any) -> Any:
        end = carry(rig, y[0], y[1], span)
        return mp.matrix([sign * end.z, sign * end.v])

    plain = rig.up == rig.down == 1 and rig.zeta == rig.gradient == 0
    y = den_hartog(rig.r, rig.beta) if plain else None
    if y is None:
        y = mp.matrix([0, 0])
        for _ in range(40 if half else 8):
            y = image(y)
    y, miss = newton(image, y)
    found, cycles = carry(rig, y[0], y[1], span), span / (2 * mp.pi)
    amplitude = max(found.high, -found.low) if sign < 0 else (found.high - found.low) / 2
    squares = mp.fsum((k * abs(b)) ** 2 for k, b in enumerate(rig.base, 1))
    frame = 0 if rig.moving else 2 * rig.frame * rig.r * mp.pi * squares  # what its dashpot takes of the base alone
    return {
        "energy_per_cycle": mp.nstr((rig.beta * found.path + found.viscous) / cycles + frame, digits),
        "response_amplitude": None
        if rig.moving
        else mp.nstr(amplitude, digits),  # z there is not the mass's own motion
        "stuck_fraction": mp.nstr(found.held / span, digits),
        "stops_per_cycle": round(found.stops / float(cycles)),
        "miss": mp.nstr(mp.norm(miss), 3),
    }


def fill(target: Path, solve: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
    """Solve the rows of a file that have no numbers yet."""
    rows = json.loads(target.read_text(encoding="utf-8"))
    for row in rows:
        if "response_amplitude" not in row:
            row.update(solve(row))
            assert float(row["miss"]) < 1e-15, row
            lines = ",\n".join(f" {json.dumps(each)}" for each in rows)
            target.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


def of_row(row: dict[str, Any]) -> dict[str, Any]:
    """The numbers of a point, with the digits that the textbook's solution loses beside resonance."""
    away = abs(row["r"] - 1.0)
    with mp.workdps(70 + (math.ceil(-2 * math.log10(min(1.0, away))) if away else 0)):
        rig = Rig.of(row)
        return reference(rig, half=rig.up == rig.down == 1 and rig.gradient == 0 and len(rig.base) == 1)


if __name__ == "__main__":
    fill(Path(__file__).with_name("rigid.json"), of_row)
