"""The friction oscillator, slow and obvious: the textbook's formula between events, zeros by looking everywhere.

Nothing here is shared with the package: complex exponentials, a dense scan for each zero, bisection. Not for r = 1
without damping, where the textbook divides by zero, nor for zeta = 1.
"""

import cmath
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, pi

import numpy as np

SCAN = 4000  # points looked at per slide and natural or drive period


@dataclass
class Cycle:
    """What one run over a span has met."""

    z: float
    v: float
    path: float = 0.0
    stops: int = 0
    stuck: float = 0.0
    work: float = 0.0
    turns: list[float] = field(default_factory=list)


Motion = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def textbook(r: float, beta: float, zeta: float, tau: float, z: float, v: float, side: float) -> Motion:
    """The motion t -> (z, v) of a slide: particular integral plus the two free exponentials."""
    gain = 1.0 / complex(1.0 - r * r, 2.0 * zeta * r)
    forced = gain * cmath.exp(1j * tau)
    root = cmath.sqrt(zeta * zeta - 1.0)
    l1, l2 = (-zeta + root) / r, (-zeta - root) / r
    a, b = z - forced.real + beta * side, v - (1j * forced).real
    c1 = (b - l2 * a) / (l1 - l2)
    c2 = a - c1

    def motion(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        w, e1, e2 = forced * np.exp(1j * t), c1 * np.exp(l1 * t), c2 * np.exp(l2 * t)
        return (w + e1 + e2).real - beta * side, (1j * w + l1 * e1 + l2 * e2).real

    return motion


def run(r: float, beta: float, mu: float, zeta: float, z: float, v: float, span: float = 2.0 * pi) -> Cycle:
    """Carry a state from tau = 0 over a span under a pure cosine, event by event."""
    now = Cycle(z, v)
    tau, slid = 0.0, False
    while tau < span - 1e-12:
        pull = cos(tau) - now.z
        side = float(np.sign(now.v or pull))
        if now.v == 0.0 and abs(pull) <= mu * beta:
            times = np.linspace(tau, span, SCAN)
            loose = np.flatnonzero(np.abs(np.cos(times) - now.z) > mu * beta)
            end = span
            if loose.size:
                end = _zero(lambda t: mu * beta - abs(cos(t) - now.z), times[max(0, loose[0] - 1)], times[loose[0]])
            if end - tau > 1e-9:
                now.stops += slid
                now.stuck += end - tau
            tau, slid = end, False
            if not loose.size:
                break
            side = float(np.sign(cos(tau + 1e-9) - now.z))
        motion = textbook(r, beta, zeta, tau, now.z, now.v, side)
        t, over = _slide(motion, side, span - tau, min(r, 1.0))
        _book(now, motion, t, tau)
        now.v = float(motion(np.array([t]))[1][0]) if over else 0.0
        tau, slid = tau + t, True
        if not over:
            now.turns.append(tau)
    return now


def _slide(motion: Motion, side: float, rest: float, scale: float) -> tuple[float, bool]:
    times = np.linspace(0.0, rest, int(SCAN * (1.0 + rest / (2.0 * pi * scale))))
    speed = side * motion(times)[1]
    behind = np.flatnonzero(speed[2:] <= 0.0)
    if not behind.size:
        return rest, True
    i = int(behind[0]) + 2
    return _zero(lambda t: float(side * motion(np.array([t]))[1][0]), times[i - 1], times[i]), False


def _zero(f: Callable[[float], float], low: float, high: float) -> float:
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if f(middle) > 0.0 else (low, middle)
    return high


def _book(now: Cycle, motion: Motion, t: float, tau: float) -> None:
    nodes, weights = np.polynomial.legendre.leggauss(40)
    pieces = np.linspace(0.0, t, 60)
    for a, b in pairwise(pieces):
        at = 0.5 * (a + b) + 0.5 * (b - a) * nodes
        now.work += float(np.sum(weights * np.cos(tau + at) * motion(at)[1])) * 0.5 * (b - a)
    end = float(motion(np.array([t]))[0][0])
    now.path += abs(end - now.z)
    now.z = end


def periodic(r: float, beta: float, mu: float = 1.0, zeta: float = 0.0, cycles: int = 200) -> Cycle:
    """The cycle after many cycles from rest: waited for, not solved for."""
    z, v = 0.0, 0.0
    for _ in range(cycles):
        last = run(r, beta, mu, zeta, z, v)
        z, v = last.z, last.v
    return last
