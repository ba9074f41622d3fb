"""Numeric laws by scipy, the slow and obvious way: the equations of the laws' files, events, tight tolerances."""

from collections.abc import Callable
from math import cos, exp, pi, sin
from typing import Any

import numpy as np

from frictionlab.simulator import Problem

TURN = 2.0 * pi
State = Any
Drive = Callable[[float], float] | None

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


def force_of(problem: Problem) -> Callable[[float], float]:
    """F of the equation in z."""
    pairs = list(enumerate(zip(*problem.force, strict=True), 1))
    return lambda t: sum(c * cos(k * t) + s * sin(k * t) for k, (c, s) in pairs)


def height(p: dict[str, float], speed: float) -> float:
    """Friction over beta (1 + gradient z) at a speed: Stribeck or logarithm."""
    if "rate_strength" in p:
        return 1.0 + p["rate_strength"] * float(np.log1p(max(speed, 0.0) / p["rate_speed"]))
    return 1.0 + (p["static_ratio"] - 1.0) * exp(-((max(speed, 0.0) / p["stribeck_speed"]) ** p["stribeck_exponent"]))


def rates(problem: Problem, side: float, drive: Drive = None) -> Callable[[float, State], list[float]]:
    """Rates of z, v, inner states, and of the energy dissipated; under another force than the problem's if given."""
    p, force, r = problem.parameters, drive or force_of(problem), problem.r
    name = problem.law.terms[1].name
    lead = 2.0 * problem.frame_damping_ratio * r

    def flow(t: float, y: State) -> list[float]:
        z, v = y[0], y[1]
        top = p["beta"] * (1.0 + p.get("gradient", 0.0) * z)
        inner: list[float] = []
        if name in ("stribeck", "logarithm"):
            n = side * top * height(p, side * v)
        elif name == "dahl":
            n = y[2]
            inner = [p["stiffness_ratio"] * (v - abs(v) * n / top)]
        elif name == "bouc-wen":
            n = y[2]
            inner = [p["stiffness_ratio"] * (v - abs(v) * abs(n / top) ** (p["exponent"] - 1.0) * n / top)]
        elif name == "lugre":
            g = top * (1.0 + (p["static_ratio"] - 1.0) * exp(-((v / p["stribeck_speed"]) ** 2)))
            bend = v - p["stiffness_ratio"] * abs(v) * y[2] / g
            n, inner = p["stiffness_ratio"] * y[2] + p["bristle_damping"] * bend, [bend]
        else:
            n, (a, b) = y[2], (p["direct_effect"] * top, p["evolution_effect"] * top)
            grows, falls = (exp(min((sign * n - y[3]) / a, 50.0)) for sign in (1.0, -1.0))  # trial steps go far
            slip = p["reference_speed"] * (grows - falls)
            heal = b * p["reference_speed"] / p["slip_distance"]
            inner = [
                p["stiffness_ratio"] * (v - slip),
                heal * (exp(min((top - y[3]) / b, 50.0)) - abs(slip) / p["reference_speed"]),
            ]
        n += 2.0 * problem.zeta * r * v
        return [v, (force(t) - z - lead * v - n) / r**2, *inner, n * v + lead * v * v]

    return flow


def cycle(problem: Problem, start: State, **options: Any) -> np.ndarray:
    """State after one cycle from tau = 0, and the energy dissipated (wall "base" or no frame damping), by solve_ivp."""
    return _carried(problem, force_of(problem), np.append(start, 0.0), (0.0, TURN), **options)


def along(problem: Problem, force: Callable[[float], float], knots: np.ndarray, start: State) -> np.ndarray:
    """States (n, size) at the knots of a force that is smooth between them, by solve_ivp from knot to knot."""
    states = [np.append(start, 0.0)]
    for span in zip(knots[:-1].tolist(), knots[1:].tolist(), strict=True):
        states.append(_carried(problem, force, states[-1], span, rtol=1e-12))
    return np.array(states)[:, :-1]


def _carried(
    problem: Problem, force: Callable[[float], float], y: State, span: tuple[float, float], **options: Any
) -> np.ndarray:
    """State, and energy dissipated, at the end of a span of time."""
    smooth, (t, end) = problem.law.kind == "smooth", span
    hold = problem.parameters.get("static_ratio", 1.0)
    while t < end:
        side = float(np.sign(y[1]))
        if smooth and y[1] == 0.0:
            t, side = _stay(problem, force, (y[0], t, end, hold))
            if t >= end:
                break
        t, y = _slide(problem, force, (t, end, y, side), smooth=smooth, **options)
    return np.asarray(y)


def _stay(
    problem: Problem, force: Callable[[float], float], held: tuple[float, float, float, float]
) -> tuple[float, float]:
    from scipy.optimize import brentq  # noqa: PLC0415

    z, t, end, hold = held
    top = hold * problem.beta * (1.0 + problem.parameter("gradient") * z)

    def excess(tau: float) -> float:
        return abs(force(tau) - z) - top

    grid = np.linspace(t, end, 20001 if end - t > 1.0 else 201)
    over = next((i for i, tau in enumerate(grid) if excess(tau) > 1e-13), None)
    if over is None:
        return end, 0.0
    go = float(brentq(excess, grid[over - 1], grid[over], xtol=1e-15)) if over else t
    return go, float(np.sign(force(go) - z))


def _slide(
    problem: Problem,
    force: Callable[[float], float],
    at: tuple[float, float, State, float],
    *,
    smooth: bool,
    method: str = "Radau",
    rtol: float = 1e-12,
) -> tuple[float, State]:
    from scipy.integrate import solve_ivp  # noqa: PLC0415

    t, end, y, side = at
    flow = rates(problem, side, force)

    def turn(_t: float, state: State) -> float:
        return float(state[1])

    turned: Any = turn
    turned.terminal, turned.direction = True, -side
    solve: Any = solve_ivp
    begun = t
    if smooth and y[1] == 0.0:  # past the corner: the event must not see its own start
        answer = solve(flow, (t, t + 1e-7), y, method=method, rtol=rtol, atol=1e-16)
        begun, y = t + 1e-7, answer.y[:, -1]
    events = turned if smooth else None
    answer = solve(flow, (begun, end), y, method=method, rtol=rtol, atol=1e-14, events=events)
    last = np.array(answer.y[:, -1])
    if answer.status == 1:
        last[1] = 0.0
    return float(answer.t[-1]), last
