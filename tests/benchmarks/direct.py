"""A rigid contact's motion by small steps of a Taylor series: slow, obvious, and nothing of the package's mathematics.

A step is a tenth of the shortest time the problem knows. The velocity's sign is looked at after each step and at the
velocity's least size within it, and a turn is found by halving. Long runs are what it is for: some 50 us a cycle.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Any

import numba
import numpy as np

from frictionlab.simulator import Problem

TURN = 2.0 * pi
ORDER = 12
STEP = 0.1


@dataclass(frozen=True)
class Run:
    """State at the end of each cycle, and per cycle the way, stops, and energy in and out (relative to the wall)."""

    z: np.ndarray
    v: np.ndarray
    path: np.ndarray
    stops: np.ndarray
    put_in: np.ndarray
    taken: np.ndarray


def force_of(problem: Problem) -> np.ndarray:
    """Coefficients (2, harmonics) of the force in the displacement relative to the wall, written out anew."""
    out = []
    for i, (c, s) in enumerate(zip(problem.base.cosine, problem.base.sine, strict=True)):
        k = i + 1
        if problem.wall == "base":
            out.append((c * (k * problem.r) ** 2, s * (k * problem.r) ** 2))
        else:
            lead = 2.0 * problem.frame_damping_ratio * problem.r * k
            out.append((c + lead * s, s - lead * c))
    return np.array(out).T.copy()


def run(problem: Problem, cycles: int, z: float = 0.0, v: float = 0.0) -> Run:
    """Carry a state, relative to the wall, from tau = 0 over cycles of the drive."""
    p = problem.parameters
    law = np.array(
        [
            problem.r,
            problem.beta,
            p.get("gradient", 0.0),
            p.get("static_ratio_up", 1.0),
            p.get("static_ratio_down", 1.0),
            p.get("contact_damping_ratio", 0.0) + problem.frame_damping_ratio,
        ]
    )
    out = np.zeros((cycles, 6))
    _march(law, force_of(problem), z, v, out)
    return Run(*out.T)


def compiled(function: Callable[..., Any]) -> Any:
    """The function as machine code, kept."""
    return numba.njit(cache=True, error_model="numpy")(function)


@compiled
def _push(force: np.ndarray, tau: float) -> float:
    total = 0.0
    for k in range(force.shape[1]):
        total += force[0, k] * cos((k + 1) * tau) + force[1, k] * sin((k + 1) * tau)
    return total


@compiled
def _series(law: np.ndarray, force: np.ndarray, tau: float, z: float, v: float, side: float, a: np.ndarray) -> None:
    """Taylor coefficients of z about tau."""
    r, beta, q, zeta = law[0], law[1], law[2], law[5]
    a[:] = 0.0
    for k in range(force.shape[1]):
        m = k + 1.0
        c, s = cos(m * tau), sin(m * tau)
        even, odd = force[0, k] * c + force[1, k] * s, m * (force[1, k] * c - force[0, k] * s)
        scale = 1.0
        for j in range(ORDER - 1):  # derivatives of F over j!
            if j > 0:
                scale /= j
            a[j + 2] += scale * even
            even, odd = odd, -m * m * even
    a[0], a[1] = z, v
    for j in range(ORDER - 1):
        held = a[j + 2] - (1.0 + side * beta * q) * a[j] - 2.0 * zeta * r * (j + 1) * a[j + 1]
        if j == 0:
            held -= side * beta
        a[j + 2] = held / (r * r * (j + 1) * (j + 2))


@compiled
def _at(a: np.ndarray, t: float, order: int) -> float:
    """The series' derivative of an order (0, 1, 2) at t."""
    total = 0.0
    for j in range(ORDER, order - 1, -1):
        factor = 1.0
        for i in range(order):
            factor *= j - i
        total = total * t + factor * a[j]
    return total


@compiled
def _zero(a: np.ndarray, order: int, sign: float, low: float, high: float) -> float:
    """Where sign times a derivative falls through zero."""
    for _ in range(70):
        middle = 0.5 * (low + high)
        if sign * _at(a, middle, order) > 0.0:
            low = middle
        else:
            high = middle
    return high


@compiled
def _holds(law: np.ndarray, force: np.ndarray, tau: float, z: float) -> bool:
    load, pull = law[1] * (1.0 + law[2] * z), _push(force, tau) - z
    return bool(-law[4] * load <= pull <= law[3] * load)


@compiled
def _push_rate(force: np.ndarray, tau: float) -> float:
    total = 0.0
    for k in range(force.shape[1]):
        m = k + 1.0
        total += m * (force[1, k] * cos(m * tau) - force[0, k] * sin(m * tau))
    return total


@compiled
def _crest(force: np.ndarray, tau: float, span: float) -> float:
    """Where, within a span, the force is largest or least; 0 if at an end."""
    low, high, before = 0.0, span, _push_rate(force, tau)
    if before * _push_rate(force, tau + span) >= 0.0:
        return 0.0
    for _ in range(70):
        middle = 0.5 * (low + high)
        if before * _push_rate(force, tau + middle) > 0.0:
            low = middle
        else:
            high = middle
    return high


@compiled
def _wait(law: np.ndarray, force: np.ndarray, tau: float, span: float, z: float) -> float:
    """How long the mass stays at z: the whole span, or until it breaks loose."""
    crest = _crest(force, tau, span)
    over_crest = not _holds(law, force, tau + crest, z)
    if not over_crest and _holds(law, force, tau + span, z):
        return span
    low, high = 0.0, crest if over_crest else span
    for _ in range(70):
        middle = 0.5 * (low + high)
        if _holds(law, force, tau + middle, z):
            low = middle
        else:
            high = middle
    return high


@compiled
def _turn(a: np.ndarray, span: float, side: float) -> float:
    """When, within a span, a slide to a side ends; beyond the span if it does not."""
    if side * _at(a, span, 1) < 0.0:
        begin = 1e-9 * span if a[1] == 0.0 else 0.0  # not the zero it starts from
        while begin > 0.0 and side * _at(a, begin, 1) <= 0.0:
            begin = 2.0 * begin if 2.0 * begin < span else 0.0
        return float(_zero(a, 1, side, begin, span))
    if side * _at(a, 0.0, 2) < 0.0 < side * _at(a, span, 2):
        least = _zero(a, 2, -side, 0.0, span)
        if side * _at(a, least, 1) < -1e-15:
            return float(_zero(a, 1, side, 0.0, least))
    return 2.0 * span


@compiled
def _book(law: np.ndarray, force: np.ndarray, tau: float, span: float, side: float, a: np.ndarray, row: Any) -> None:
    """Add way and energies of a part of a slide, by Gauss's four points."""
    nodes = np.array([-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526])
    weights = np.array([0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538])
    for i in range(4):
        t, weight = 0.5 * span * (1.0 + nodes[i]), 0.5 * span * weights[i]
        speed = _at(a, t, 1)
        friction = side * law[1] * (1.0 + law[2] * _at(a, t, 0)) + 2.0 * law[5] * law[0] * speed
        row[4] += weight * _push(force, tau + t) * speed
        row[5] += weight * friction * speed
    row[2] += abs(_at(a, span, 0) - a[0])


@compiled
def _march(law: np.ndarray, force: np.ndarray, z: float, v: float, out: np.ndarray) -> None:
    """Carry a state over as many cycles as `out` has rows."""
    a, h = np.zeros(ORDER + 1), STEP * min(law[0], 1.0 / force.shape[1]) / max(1.0, 2.0 * law[5])
    side, slid = np.sign(v), False
    for cycle in range(out.shape[0]):
        tau, row = 0.0, out[cycle]
        while tau < TURN:
            last = tau + h >= TURN
            span = TURN - tau if last else h
            if side == 0.0:
                stays = _wait(law, force, tau, span, z) if _holds(law, force, tau, z) else 0.0
                row[3] += 1.0 if slid and stays > 1e-12 else 0.0
                slid = slid and stays <= 1e-12
                tau = TURN if last and stays == span else tau + stays
                if stays < span:
                    side, v, slid = np.sign(_push(force, tau) - z), 0.0, False
                continue
            _series(law, force, tau, z, v, side, a)
            end = _turn(a, span, side)
            turned = end <= span
            end = min(end, span)
            _book(law, force, tau, end, side, a, row)
            z, v, slid = _at(a, end, 0), 0.0 if turned else _at(a, end, 1), True
            tau = TURN if last and not turned else tau + end
            side = 0.0 if turned else side
        row[0], row[1] = z, v
