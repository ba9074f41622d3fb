"""An elastic contact's motion by small steps of a Taylor series: slow, and nothing of the package's mathematics.

The mass carries sliders: each pulls with its own spring until its limit, then drags along. A step is a tenth of the
shortest time the problem knows; a turn is found by halving, and so is the time at which a slider comes to its limit
(the way there is known: between turns the mass moves one way, and a spring's force is its way).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from frictionlab.simulator import Problem
from tests.benchmarks.direct import ORDER, STEP, TURN, _at, _push, _turn, compiled, force_of


@dataclass(frozen=True)
class Run:
    """State at the end of each cycle, and per cycle the way, stops, energy put in, and how far each slider slipped.

    A state is z, v, the forces of the sliders, and which way each slips (0: it holds).
    """

    state: np.ndarray
    path: np.ndarray
    stops: np.ndarray
    put_in: np.ndarray
    slip: np.ndarray


def sliders_of(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and strength of each slider: pieces of Segalman's density of slip lengths, cut as the README says."""
    p = problem.parameters
    count, chi = int(p.get("sliders", 1)), p.get("chi", 0.0)
    cuts = (np.arange(count + 1) / count) ** (2.0 / (chi + 2.0))
    return p["stiffness_ratio"] * np.diff(cuts ** (chi + 1.0)), p["beta"] * np.diff(cuts ** (chi + 2.0))


def run(problem: Problem, cycles: int, state: np.ndarray | None = None) -> Run:
    """Carry a state, relative to the wall, from tau = 0 over cycles of the drive; from rest with relaxed sliders."""
    p = problem.parameters
    kappa, beta = sliders_of(problem)
    damping = p.get("contact_damping_ratio", 0.0) + problem.frame_damping_ratio
    ratios = p.get("static_ratio_up", 1.0), p.get("static_ratio_down", 1.0)
    law = np.array([problem.r, p.get("gradient", 0.0), *ratios, damping])
    begin = np.zeros(2 + 2 * len(kappa)) if state is None else state.copy()
    if state is None and problem.wall == "base":
        begin[0], begin[1] = -float(problem.base.at(0.0)), -float(problem.base.rate_at(0.0))
    wide = 3 + len(kappa)
    out = np.zeros((cycles, wide + len(begin)))
    _march(law, kappa, beta, force_of(problem), begin, out)
    return Run(out[:, wide:], out[:, 0], out[:, 1], out[:, 2], out[:, 3:wide])


@compiled
def _series(
    law: np.ndarray, force: np.ndarray, tau: float, z: float, v: float, n: float, k: float, a: np.ndarray
) -> None:
    """Taylor coefficients of z about tau, under a contact's force n that grows by k with the way."""
    r, zeta = law[0], law[4]
    a[:] = 0.0
    for i in range(force.shape[1]):
        m = i + 1.0
        c, s = np.cos(m * tau), np.sin(m * tau)
        even, odd = force[0, i] * c + force[1, i] * s, m * (force[1, i] * c - force[0, i] * s)
        scale = 1.0
        for j in range(ORDER - 1):
            if j > 0:
                scale /= j
            a[j + 2] += scale * even
            even, odd = odd, -m * m * even
    a[0], a[1] = z, v
    for j in range(ORDER - 1):
        held = a[j + 2] - (1.0 + k) * a[j] - 2.0 * zeta * r * (j + 1) * a[j + 1]
        if j == 0:
            held -= n - k * z
        a[j + 2] = held / (r * r * (j + 1) * (j + 2))


@compiled
def _work(force: np.ndarray, tau: float, span: float, a: np.ndarray) -> float:
    """What the force does over a part of a phase, by Gauss's four points."""
    nodes = np.array([-0.8611363115940526, -0.3399810435848563, 0.3399810435848563, 0.8611363115940526])
    weights = np.array([0.3478548451374538, 0.6521451548625461, 0.6521451548625461, 0.3478548451374538])
    total = 0.0
    for i in range(4):
        t = 0.5 * span * (1.0 + nodes[i])
        total += 0.5 * span * weights[i] * _push(force, tau + t) * _at(a, t, 1)
    return total


@compiled
def _way(force: np.ndarray, tau: float, z: float, n: np.ndarray) -> float:
    """Which way the mass goes from a turn."""
    return 1.0 if _push(force, tau) - z - n.sum() >= 0.0 else -1.0


@compiled
def _next(kappa: np.ndarray, limit: np.ndarray, q: float, z: float, way: float, n: np.ndarray, side: np.ndarray) -> Any:
    """How far the mass may go until a slider comes to its limit, and which one."""
    nearest, which = np.inf, -1
    for i in range(len(kappa)):
        left = (limit[i] * (1.0 + q * z) - way * n[i]) / (kappa[i] - way * limit[i] * q)
        if side[i] == 0.0 and left < nearest:
            nearest, which = max(left, 0.0), i
    return nearest, which


@compiled
def _reached(a: np.ndarray, span: float, way: float, far: float) -> float:
    """When, within a span, the mass has gone so far."""
    low, high = 0.0, span
    for _ in range(70):
        middle = 0.5 * (low + high)
        if way * (_at(a, middle, 0) - a[0]) < far:
            low = middle
        else:
            high = middle
    return high


@compiled
def _phase(
    law: np.ndarray,
    force: np.ndarray,
    tau: float,
    way: float,
    slopes: np.ndarray,
    here: np.ndarray,
    far: float,
    row: Any,
) -> Any:
    """One step: how long it lasts, whether it ends in a turn, and whether in a slider that gives way.

    `here` holds z, v and the sliders' forces and is carried on; `slopes` how each force changes with the way.
    """
    a, n, pulls, count = np.zeros(ORDER + 1), here[2 : 2 + len(slopes)], slopes.sum(), len(slopes)
    h = STEP * min(law[0] / np.sqrt(max(1.0 + pulls, 1.0)), 1.0 / force.shape[1]) / max(1.0, 2.0 * law[4])
    span = min(h, TURN - tau)
    _series(law, force, tau, here[0], here[1], n.sum(), pulls, a)
    end = _turn(a, span, way)
    turned = end <= span
    end = min(end, span)
    gave = way * (_at(a, end, 0) - here[0]) > far
    if gave:
        end, turned = _reached(a, end, way, far), False
    moved = _at(a, end, 0) - here[0]
    row[0] += abs(moved)
    row[2] += _work(force, tau, end, a)
    row[3 : 3 + count] += abs(moved) * np.abs(here[2 + count :])
    n += slopes * moved
    here[0], here[1] = _at(a, end, 0), 0.0 if turned else _at(a, end, 1)
    return end, turned, gave


@compiled
def _march(
    law: np.ndarray, kappa: np.ndarray, beta: np.ndarray, force: np.ndarray, here: np.ndarray, out: np.ndarray
) -> None:
    """Carry a state over as many cycles as `out` has rows."""
    q, count = law[1], len(kappa)
    n, side = here[2 : 2 + count], here[2 + count :]
    way, slid = np.sign(here[1]), bool(np.any(side != 0.0))
    for cycle in range(out.shape[0]):
        tau, row = 0.0, out[cycle]
        while tau < TURN:
            way = _way(force, tau, here[0], n) if way == 0.0 else way
            far, which = _next(kappa, (law[2] if way > 0.0 else law[3]) * beta, q, here[0], way, n, side)
            turned, gave = False, far == 0.0
            if not gave:
                slopes = np.where(side == 0.0, kappa, way * beta * q)
                took, turned, gave = _phase(law, force, tau, way, slopes, here, far, row)
                tau = TURN if not (turned or gave) and TURN - tau - took < 1e-15 else tau + took
            if turned:
                row[1] += 1.0 if slid else 0.0
                slid, way = False, 0.0
                side[:] = 0.0
            if gave:
                side[which], slid = way, True
                n[which] = way * beta[which] * (1.0 + q * here[0])
        row[3 + count :] = here
