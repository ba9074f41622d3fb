"""Numeric laws against two other programs: heyoka (Taylor series, events) and CVODE (BDF), formulas written out anew.

    python -m tests.benchmarks.numeric_independent

Neither program is needed otherwise: install heyoka and scikit-sundae in a throw-away environment. The orbit that
`steady` finds at its default is handed over at tau = 0; after a cycle of the other program it must be back, with the
same energy. heyoka's tolerance is that of doubles; the formulas are those of the literature, not the laws' files.
CVODE has no events here: the corner of |v| is met by its error control alone, so laws that stick are not for it.
"""

import importlib
import time
from collections.abc import Callable
from math import cos, exp, pi, sinh
from typing import Any

import numpy as np
from scipy.optimize import brentq

from frictionlab.simulator import Problem, steady_state
from frictionlab.simulator.numeric import NumericMotion, machine, steady
from tests.simulator.numeric_oracle import LAWS as ORACLE_LAWS

TURN = 2.0 * pi
LAWS = ORACLE_LAWS | {"coulomb+bouc-wen": {"stiffness_ratio": 100.0, "exponent": 3.0}}  # |n|^2 n has no corner
POINTS = ((0.3, 0.6), (0.7, 0.5))
GOAL = 1e-6
STEP = 0.01  # rad: a longer series from far off sees nothing of a Stribeck curve (turns came out 2e-3 rad late)
PAST = 1e-5  # rad: after a corner, before its event is watched again
EXPONENTS = (10.0, 100.0, 1000.0)


def flow(hy: Any, name: str, p: dict[str, float], r: float, state: list[Any], side: Any) -> list[Any]:
    """Rates of z, v, inner states and work, in heyoka's symbols; `side` is the sign of v, of n for rate and state."""
    z, v = state[0], state[1]
    beta = p["beta"]
    inner: list[Any] = []
    if name == "stribeck":
        n = side * beta * (1.0 + (p["static_ratio"] - 1.0) * hy.exp(-v * v / p["stribeck_speed"] ** 2))
    elif name == "logarithm":
        n = side * beta * (1.0 + p["rate_strength"] * hy.log(1.0 + side * v / p["rate_speed"]))
    elif name == "dahl":
        n = state[2]
        inner = [p["stiffness_ratio"] * v * (1.0 - side * n / beta)]
    elif name == "bouc-wen":
        n = state[2]
        inner = [p["stiffness_ratio"] * (v - side * v * (n / beta) ** 3.0)]
    elif name == "lugre":
        steady_force = beta * (1.0 + (p["static_ratio"] - 1.0) * hy.exp(-v * v / p["stribeck_speed"] ** 2))
        bend = v * (1.0 - p["stiffness_ratio"] * side * state[2] / steady_force)
        n, inner = p["stiffness_ratio"] * state[2] + p["bristle_damping"] * bend, [bend]
    else:
        a, b, speed = p["direct_effect"] * beta, p["evolution_effect"] * beta, p["reference_speed"]
        n = state[2]
        slip = 2.0 * speed * hy.sinh(n / a) * hy.exp(-state[3] / a)
        heals = b * speed / p["slip_distance"]
        inner = [p["stiffness_ratio"] * (v - slip), heals * (hy.exp((beta - state[3]) / b) - side * slip / speed)]
    return [v, (hy.cos(hy.time) - z - n) / r**2, *inner, n * v]


def by_heyoka(problem: Problem, start: np.ndarray) -> np.ndarray:
    """State and work after a cycle from tau = 0, from corner to corner."""
    hy = importlib.import_module("heyoka")
    name, p, r = problem.law.terms[1].name, dict(problem.parameters), problem.r
    state = [hy.make_vars(f"x{i}") for i in range(len(start) + 1)]
    corner = state[2] if name == "rate-state" else state[1]
    system = list(zip(state, flow(hy, name, p, r, state, hy.par[0]), strict=True))
    y = [*start, 0.0]
    free = hy.taylor_adaptive(system, y, pars=[1.0])
    watched = hy.taylor_adaptive(system, y, pars=[1.0], t_events=[hy.t_event(corner)])
    at, t, side = (2 if name == "rate-state" else 1), 0.0, 1.0
    now = np.array(y)
    side = float(np.sign(now[at]))
    while t < TURN:
        if now[at] == 0.0:
            if name in ("stribeck", "logarithm"):
                t = released(p, now[0], t)
                if t >= TURN:
                    break
                side = float(np.sign(cos(t) - now[0]))
            free.time, free.state[:], free.pars[0] = t, now, side
            t = min(TURN, t + PAST)
            free.propagate_until(t)
            now = free.state.copy()
            if t >= TURN:
                break
        watched.time, watched.state[:], watched.pars[0] = t, now, side
        watched.reset_cooldowns()
        met = watched.propagate_until(TURN, max_delta_t=STEP)[0]
        t, now = float(watched.time), watched.state.copy()
        if met != hy.taylor_outcome.time_limit:
            now[at], side = 0.0, -side
    return now


def released(p: dict[str, float], z: float, t: float) -> float:
    """When a mass that came to rest at t breaks loose: |cos(tau) - z| above static friction."""
    hold = p["beta"] * p.get("static_ratio", 1.0)
    grid = np.linspace(t, TURN, 100_001)
    over = np.flatnonzero(np.abs(np.cos(grid) - z) > hold + 1e-13)
    if not over.size:
        return TURN
    first = int(over[0])
    return t if first == 0 else float(brentq(lambda tau: abs(cos(tau) - z) - hold, grid[first - 1], grid[first]))


def by_cvode(problem: Problem, start: np.ndarray) -> np.ndarray:
    """State and work after a cycle by BDF, without events."""
    cvode = importlib.import_module("sksundae.cvode")
    name, p, r, beta = problem.law.terms[1].name, problem.parameters, problem.r, problem.beta
    kappa = p["stiffness_ratio"]

    def rhs(t: float, y: np.ndarray, rate: np.ndarray) -> None:
        v, n = y[1], y[2]
        if name == "lugre":
            g = beta * (1.0 + (p["static_ratio"] - 1.0) * exp(-((v / p["stribeck_speed"]) ** 2)))
            rate[2] = v - kappa * abs(v) * y[2] / g
            n = kappa * y[2] + p["bristle_damping"] * rate[2]
        elif name == "rate-state":
            a, b, speed = p["direct_effect"] * beta, p["evolution_effect"] * beta, p["reference_speed"]
            slip = 2.0 * speed * sinh(max(-600.0, min(600.0, n / a))) * exp(-y[3] / a)
            rate[2] = kappa * (v - slip)
            rate[3] = b * speed / p["slip_distance"] * (exp((beta - y[3]) / b) - abs(slip) / speed)
        else:
            rate[2] = kappa * (v - abs(v) * abs(n / beta) ** (p.get("exponent", 1.0) - 1.0) * n / beta)
        rate[0], rate[1], rate[-1] = v, (cos(t) - y[0] - n) / r**2, n * v

    solver = cvode.CVODE(rhs, method="BDF", rtol=1e-11, atol=1e-13, max_num_steps=2_000_000)
    done = solver.solve(np.array([0.0, TURN]), np.append(start, 0.0))
    return np.array(done.y[-1])


def line(law: str, r: float, beta: float, other: str, carry: Callable[[Problem, np.ndarray], np.ndarray]) -> str:
    """One line of the table: what another program makes of our orbit."""
    problem = Problem(r, beta, law=law, parameters=LAWS[law])
    found = steady(problem)
    assert isinstance(found.orbit, NumericMotion)
    assert found.energy_per_cycle is not None
    size = (3 if problem.law.kind == "inner" else 2) + (law == "coulomb+rate-state")
    start = found.orbit.state(0.0)[:size] * np.array([1.0, 1.0, 1.0, beta])[:size]
    begun = time.process_time()
    end = carry(problem, start)
    spent = time.process_time() - begun
    away, off = float(np.max(np.abs(end[:-1] - start))), abs(float(end[-1]) / found.energy_per_cycle - 1.0)
    verdict = "" if max(away, off) < GOAL else "   above the goal"
    return f"{law:20s} r {r:.1f}  {other:8s} {away:9.0e} {off:9.0e} {spent:8.2f}{verdict}"


def main() -> None:
    """Print the table."""
    machine.compiled()
    print(f"goal {GOAL:.0e}                        back at start   energy   seconds of its cycle")
    for law in LAWS:
        for r, beta in POINTS:
            print(line(law, r, beta, "heyoka", by_heyoka), flush=True)
            if "stiffness_ratio" in LAWS[law]:
                print(line(law, r, beta, "CVODE", by_cvode), flush=True)
    print("\nBouc-Wen against Jenkins, stiffness ratio 100: relative difference of the energy")
    for r, beta in POINTS:
        rigid = steady_state(Problem(r, beta, law="coulomb+compliance", parameters={"stiffness_ratio": 100.0}))
        assert rigid.energy_per_cycle is not None
        for exponent in EXPONENTS:
            more = {"stiffness_ratio": 100.0, "exponent": exponent}
            soft = steady(Problem(r, beta, law="coulomb+bouc-wen", parameters=more))
            assert soft.energy_per_cycle is not None
            off = soft.energy_per_cycle / rigid.energy_per_cycle - 1.0
            print(f"r {r:.1f}, exponent {exponent:6g}: {off:+.1e}")


if __name__ == "__main__":
    main()
