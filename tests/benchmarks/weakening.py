"""Friction that falls with speed: what is told of random Stribeck and logarithm contacts, held to a long run from rest.

    python -m tests.benchmarks.weakening [POINTS] [SEED]

The run is of another method and shares nothing: Runge and Kutta's fourth order by small steps, cut by halving where the
mass turns or breaks loose. Right: after some hundred cycles it is on the orbit that was told, which repeats after no
fewer cycles; or it rests where the answer is "stuck".
"""

import sys
from collections import Counter, defaultdict
from math import cos, exp, log, pi

import numba
import numpy as np

from frictionlab.errors import SimulationError
from frictionlab.simulator import Problem, SteadyState, steady_state
from frictionlab.simulator.sweep import warm_up
from tests.benchmarks.direct import compiled

TURN = 2.0 * pi
STEPS = 4000  # a cycle
WAIT = 400  # cycles
NEAR = 1e-4  # of the orbit's size: Runge and Kutta's error, and what is left of the start
SLOW = 0.975  # multiplier of a cycle above which more than NEAR is left
LAWS = ("coulomb+stribeck", "coulomb+logarithm")


@compiled
def _friction(law: np.ndarray, speed: float) -> float:
    """Kinetic friction over k Y."""
    if law[2] == 0.0:
        return float(law[1] * (1.0 + (law[3] - 1.0) * exp(-((speed / law[4]) ** 2))))
    return float(law[1] * (1.0 + law[3] * log(1.0 + speed / law[4])))


@compiled
def _pull(law: np.ndarray, tau: float, z: float, v: float, side: float) -> float:
    """The acceleration of a slide to a side."""
    return float((cos(tau) - z - side * _friction(law, max(0.0, side * v))) / (law[0] * law[0]))


@compiled
def _step(law: np.ndarray, tau: float, h: float, z: float, v: float, side: float) -> tuple[float, float]:
    """One step of Runge and Kutta."""
    a1 = _pull(law, tau, z, v, side)
    v2 = v + 0.5 * h * a1
    a2 = _pull(law, tau + 0.5 * h, z + 0.5 * h * v, v2, side)
    v3 = v + 0.5 * h * a2
    a3 = _pull(law, tau + 0.5 * h, z + 0.5 * h * v2, v3, side)
    v4 = v + h * a3
    a4 = _pull(law, tau + h, z + h * v3, v4, side)
    return z + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


@compiled
def _part(law: np.ndarray, tau: float, h: float, z: float, v: float, side: float) -> float:
    """How much of a step passes before a slide turns (side given) or a mass at rest breaks loose (side 0)."""
    low, high = 0.0, h
    for _ in range(60):
        middle = 0.5 * (low + high)
        if side == 0.0:
            goes_on = abs(cos(tau + middle) - z) <= _friction(law, 0.0)
        else:
            goes_on = side * _step(law, tau, middle, z, v, side)[1] > 0.0
        low, high = (middle, high) if goes_on else (low, middle)
    return high


@numba.njit(cache=True)
def follow(law: np.ndarray, z: float, v: float, out: np.ndarray) -> None:
    """Carry a state from tau = 0; `out` (cycles, 2) takes the state at the end of each cycle."""
    side = np.sign(v)
    for cycle in range(out.shape[0]):
        for i in range(STEPS):
            tau, left = TURN * i / STEPS, TURN / STEPS
            for _ in range(50):
                if side == 0.0:
                    if abs(cos(tau) - z) <= _friction(law, 0.0):
                        part = left
                        if abs(cos(tau + left) - z) > _friction(law, 0.0):
                            part = _part(law, tau, left, z, 0.0, 0.0)
                        tau, left = tau + part, left - part
                        if left <= 0.0:
                            break
                    side = np.sign(cos(tau) - z)
                nz, nv = _step(law, tau, left, z, v, side)
                if side * nv >= 0.0:
                    z, v = nz, nv
                    break
                part = _part(law, tau, left, z, v, side)
                z, v = _step(law, tau, part, z, v, side)[0], 0.0
                tau, left, side = tau + part, left - part, 0.0
                if left < 1e-13:
                    break
        out[cycle, 0], out[cycle, 1] = z, v


def random_problem(rng: np.random.Generator, law: str) -> Problem:
    """One problem: r 0.15 to 1.5, friction ratio 0.1 to 0.7, a fall of friction of 5 to 100 %."""
    r, beta = float(np.exp(rng.uniform(np.log(0.15), np.log(1.5)))), float(rng.uniform(0.1, 0.7))
    speed = float(10.0 ** rng.uniform(-1.5, 0.0))
    fall = {"static_ratio": float(rng.uniform(1.05, 2.0)), "stribeck_speed": speed}
    if law == "coulomb+logarithm":
        fall = {"rate_strength": float(rng.uniform(-0.12, -0.01)), "rate_speed": speed}
    return Problem(r, beta, law=law, parameters=fall)


def judge(problem: Problem, state: SteadyState) -> str:
    """Say what the run from rest says of an answer."""
    p = problem.parameters
    kind, keys = (0.0, ("static_ratio", "stribeck_speed"))
    if problem.law.has("logarithm"):
        kind, keys = 1.0, ("rate_strength", "rate_speed")
    law = np.array([problem.r, problem.beta, kind, *(p[key] for key in keys)])
    late = np.zeros((WAIT, 2))
    follow(law, 0.0, 0.0, late)
    size = float(np.abs(late).max()) + 1e-3
    if state.outcome == "stuck":
        return "stuck" if abs(late[-1, 0] - late[-2, 0]) < NEAR * size else "WRONG: moves"
    if state.outcome != "periodic" or state.orbit is None:
        return f"named: {state.outcome}"
    period = state.period_cycles or 1
    if abs(state.floquet_multiplier or 0.0) ** (1.0 / period) > SLOW:
        return "forgets its start too slowly to tell"
    z, v = state.orbit.at(TURN * np.arange(period))
    away = np.hypot(z - late[-1, 0], problem.r * (v - late[-1, 1])) / size
    again = np.hypot(z[1:] - z[0], problem.r * (v[1:] - v[0])) / size
    if away.min() > NEAR:
        return f"WRONG: rest is elsewhere by {away.min():.0e}"
    return "WRONG: shorter period" if np.any(again < 1e-6) else f"right, period {period}"


def main(count: int, seed: int) -> None:
    """Draw, solve, judge, print."""
    rng, counts = np.random.default_rng(seed), defaultdict[str, Counter[str]](Counter)
    for law in LAWS:
        warm_up(law)
        for _ in range(count):
            problem = random_problem(rng, law)
            try:
                said = judge(problem, steady_state(problem))
            except SimulationError as error:
                said = "refused: friction turns negative" if "negative" in str(error) else f"refused: {error}"
            counts[law][said] += 1
            if said.startswith(("WRONG", "named")):
                sys.stderr.write(f"{said}: {problem.parameters}, r = {problem.r!r}\n")
        told = ", ".join(f"{key}: {value}" for key, value in sorted(counts[law].items()))
        sys.stdout.write(f"{law:20s} {count} points: {told}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100, int(sys.argv[2]) if len(sys.argv) > 2 else 77)
