"""Integrated laws by scipy, the slow and obvious way: the equations of the laws' files, events, tight tolerances."""

from collections.abc import Callable
from math import cos, exp, log1p, pi, sin
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from frictionlab.simulator import Problem, SteadyState, Structure
from frictionlab.simulator.numeric import RTOL, Integrated

TURN = 2.0 * pi
Drive = Callable[[float], float]

LAWS: dict[str, dict[str, float]] = {
    "coulomb+stribeck": {"static_ratio": 1.2, "stribeck_speed": 0.1},
    "coulomb+logarithm": {"rate_strength": 0.05, "rate_speed": 0.01},
    "coulomb+dahl": {"stiffness_ratio": 100.0},
    "coulomb+bouc-wen": {"stiffness_ratio": 100.0, "exponent": 2.5},
    "coulomb+lugre": {"stiffness_ratio": 100.0, "bristle_damping": 0.1, "static_ratio": 1.2, "stribeck_speed": 0.1},
    "coulomb+rate-state": {
        "stiffness_ratio": 100.0,
        "direct_effect": 0.05,
        "evolution_effect": 0.03,
        "slip_distance": 0.01,
        "reference_speed": 0.1,
    },
}
"""One point of each law, that tests and benchmarks share."""


def steady(what: Problem | Structure, rtol: float = RTOL, near: SteadyState | None = None) -> SteadyState:
    """Steady state by steps, also of laws that have exact slides."""
    return Integrated(what, rtol).steady(near=near)


def force_of(problem: Problem) -> Drive:
    """F of the equation in z."""
    pairs = list(enumerate(zip(*problem.force, strict=True), 1))
    return lambda t: sum(c * cos(k * t) + s * sin(k * t) for k, (c, s) in pairs)


def height(p: dict[str, float], z: float, speed: float) -> float:
    """Friction over beta (1 + gradient z) of a law without a state."""
    speed = max(speed, 0.0)
    if "rate_strength" in p:
        return 1.0 + p["rate_strength"] * log1p(speed / p["rate_speed"])
    if "height" in p:
        return 1.0 + p["height"] * cos(p["number"] * z)
    return 1.0 + (p["static_ratio"] - 1.0) * exp(-((speed / p["stribeck_speed"]) ** p["stribeck_exponent"]))


def rates(problem: Problem, side: float, force: Drive) -> Callable[[float, Any], list[float]]:
    """Rates of z, v, inner states, and of the energy dissipated."""
    p, r, name = problem.parameters, problem.r, problem.law.terms[1].name
    lead = 2.0 * problem.frame_damping_ratio * r

    def flow(t: float, y: Any) -> list[float]:
        z, v = y[0], y[1]
        top = p["beta"] * (1.0 + p.get("gradient", 0.0) * z)
        inner: list[float] = []
        if problem.law.kind == "smooth":
            n = side * top * height(p, z, side * v)
        elif name in ("dahl", "bouc-wen"):
            n = y[2]
            share = n / top if name == "dahl" else abs(n / top) ** (p["exponent"] - 1.0) * n / top
            inner = [p["stiffness_ratio"] * (v - abs(v) * share)]
        elif name == "lugre":
            g = top * (1.0 + (p["static_ratio"] - 1.0) * exp(-((v / p["stribeck_speed"]) ** 2)))
            bend = v - p["stiffness_ratio"] * abs(v) * y[2] / g
            n, inner = p["stiffness_ratio"] * y[2] + p["bristle_damping"] * bend, [bend]
        else:
            n, (a, b) = y[2], (p["direct_effect"] * top, p["evolution_effect"] * top)
            grows, falls = (exp(min((sign * n - y[3]) / a, 50.0)) for sign in (1.0, -1.0))  # trial steps go far
            slip = p["reference_speed"] * (grows - falls)
            wear = exp(min((top - y[3]) / b, 50.0)) - abs(slip) / p["reference_speed"]
            heal = b * p["reference_speed"] / p["slip_distance"]
            inner = [p["stiffness_ratio"] * (v - slip), heal * wear]
        n += 2.0 * problem.zeta * r * v
        return [v, (force(t) - z - lead * v - n) / r**2, *inner, n * v + lead * v * v]

    return flow


def cycle(problem: Problem, start: Any, **options: Any) -> np.ndarray:
    """State after one cycle from tau = 0, and the energy dissipated (wall "base" or no frame damping), by solve_ivp."""
    return _carried(problem, force_of(problem), np.append(start, 0.0), (0.0, TURN), **options)


def along(problem: Problem, force: Drive, knots: np.ndarray, start: Any, **options: Any) -> np.ndarray:
    """States (n, size) at the knots of a force that is smooth between them, by solve_ivp from knot to knot."""
    states = [np.append(start, 0.0)]
    for span in zip(knots[:-1].tolist(), knots[1:].tolist(), strict=True):
        states.append(_carried(problem, force, states[-1], span, **options))
    return np.array(states)[:, :-1]


def _carried(
    problem: Problem, force: Drive, y: Any, span: tuple[float, float], method: str = "Radau", rtol: float = 1e-12
) -> np.ndarray:
    """State, and energy dissipated, at the end of a span of time."""
    smooth, (t, end) = problem.law.kind == "smooth", span
    solve: Any = solve_ivp

    def turn(_t: float, state: Any) -> float:
        return float(state[1])

    turned: Any = turn
    while t < end:
        side = float(np.sign(y[1]))
        moved = smooth and y[1] == 0.0
        if moved:
            t, side = _release(problem, force, float(y[0]), t, end)
            if t >= end:
                break
        flow, options = rates(problem, side, force), {"method": method, "rtol": rtol}
        if moved:  # past the corner: the event must not see its own start
            y = solve(flow, (t, t + 1e-7), y, atol=1e-16, **options).y[:, -1]
            t += 1e-7
        turned.terminal, turned.direction = True, -side
        answer = solve(flow, (t, end), y, atol=1e-14, events=turned if smooth else None, **options)
        t, y = float(answer.t[-1]), np.array(answer.y[:, -1])
        if answer.status == 1:
            y[1] = 0.0
    return np.asarray(y)


def _release(problem: Problem, force: Drive, z: float, t: float, end: float) -> tuple[float, float]:
    """When a mass at rest breaks away, and to which side."""
    top = problem.beta * (1.0 + problem.parameter("gradient") * z) * height(problem.parameters, z, 0.0)

    def excess(tau: float) -> float:
        return abs(force(tau) - z) - top

    grid = np.linspace(t, end, 20001 if end - t > 1.0 else 201)
    over = next((i for i, tau in enumerate(grid) if excess(tau) > 1e-13), None)
    if over is None:
        return end, 0.0
    go = float(brentq(excess, grid[over - 1], grid[over], xtol=1e-15)) if over else t
    return go, float(np.sign(force(go) - z))
