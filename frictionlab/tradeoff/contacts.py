"""The numeric engine's tolerance under each law without exact slides, and RK45 as the thesis set it.

RK45 starts on the orbit that the engine has found, so that its error is that of one cycle and not of waiting. One
cycle is run, and its time counts a hundred times: the thesis waits for a hundred cycles. The references are those of
another method: scipy's DOP853 at rtol 1e-13, its own orbit closed by Newton's method.
"""

from collections.abc import Callable
from functools import partial
from math import pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.simulator import Problem
from frictionlab.simulator.numeric import RTOL, NumericMotion, machine, steady
from frictionlab.tradeoff.setting import Setting, Trial, run_trials
from frictionlab.tradeoff.simulation import off

__all__ = ["CONTACTS", "cycle_by_rk45", "tolerance_of"]

TURN = 2.0 * pi
WAITED = 100  # cycles, by the thesis
TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10)
THESIS = {"method": "RK45", "rtol": 1e-3, "atol": 1e-6}  # solve_ivp's defaults, and so the thesis's
REFERENCE = "scipy's DOP853 at rtol 1e-13 on its own orbit, good to some 1e-12 (tests/tradeoff: to 2e-11)"
CURVE = {"static_ratio": 1.2, "stribeck_speed": 0.1}
SOFT = {"stiffness_ratio": 100.0}
AGE = {"direct_effect": 0.05, "evolution_effect": 0.03, "slip_distance": 0.01, "reference_speed": 0.1}
CONTACTS: dict[str, tuple[Problem, float]] = {  # and its energy per cycle, by DOP853
    name: (Problem(0.3, 0.6, law=f"coulomb+{name}", parameters=parameters), truth)
    for name, parameters, truth in (
        ("stribeck", CURVE, 1.993360043181),
        ("logarithm", {"rate_strength": 0.05, "rate_speed": 0.01}, 1.837739564223),
        ("dahl", SOFT, 1.827898042556),
        ("bouc-wen", SOFT | {"exponent": 2.5}, 1.832849267005),
        ("lugre", SOFT | CURVE | {"bristle_damping": 0.1}, 1.888145795724),
        ("rate-state", SOFT | AGE, 1.892207367962),
    )
}
Floats = NDArray[np.float64]


def tolerance_of(name: str) -> tuple[Setting, ...]:
    """The tolerances of the numeric engine, compiled, under a law (r = 0.3, beta = 0.6), and RK45."""
    problem, truth = CONTACTS[name]
    machine.compiled()  # what loading costs is no matter of the tolerance
    motion = steady(problem).orbit
    trials = [
        Trial(f"rtol {rtol:.0e}", partial(steady, problem, rtol=rtol), off(truth), default=rtol == RTOL)
        for rtol in TOLERANCES
    ]
    if isinstance(motion, NumericMotion):
        run = partial(cycle_by_rk45, problem, motion.state(0.0))
        trials.append(Trial(f"RK45, {WAITED} cycles", run, off(truth), parts=WAITED))
    return run_trials(f"tolerance, {name}", "energy_per_cycle", REFERENCE, trials)


def cycle_by_rk45(problem: Problem, start: Floats) -> float:
    """Energy dissipated over a cycle from a state (z, v, what the contact has of its own) at tau = 0.

    Where the contact has no state of its own a slide ends where the velocity is zero, and a stop by brentq (Fig. 3.1).
    """
    from scipy.integrate import solve_ivp  # noqa: PLC0415 - 0.6 s that the engine does not need

    rig = machine.machine_of(problem, RTOL, fast=False)
    integrate: Any = solve_ivp
    t, state = 0.0, np.append(start[: rig.size], 0.0)
    while t < TURN:
        side = float(np.sign(state[1]))
        if rig.is_smooth and side == 0.0:
            t, side = _release(problem, rig, float(state[0]), t)
            if t >= TURN:
                break
        events = _at_rest(side) if rig.is_smooth else None
        with np.errstate(over="ignore"):  # a trial step that goes far is thrown away
            run = integrate(_flow(rig, side), (t, TURN), state, events=events, **THESIS)
        t, state = float(run.t[-1]), run.y[:, -1].copy()
        if run.status == 1:
            state[1] = 0.0
    return float(state[-1])


def _flow(rig: machine.Machine, side: float) -> Callable[[float, Floats], list[float]]:
    """Rates of the state and of the energy dissipated, by the engine's own right-hand side."""
    rate, slopes = [0.0] * 4, [0.0] * 16

    def flow(t: float, y: Floats) -> list[float]:
        values = [*y[:-1].tolist(), *((0.0,) * (4 - rig.size))]
        leans = values[2] if rig.size == len(values) else values[1]
        way = side if rig.is_smooth else float(np.sign(leans))
        pull = rig.kernel.series(rig.force[0], rig.force[1], t)[0]
        rig.kernel.rates(rig.rig, way, pull, (values, 0), (rate, slopes, 0))
        return [*rate[: rig.size], rig.kernel.contact(rig.rig, way, *values[:3])[0] * values[1]]

    return flow


def _at_rest(side: float) -> Callable[[float, Floats], float]:
    """The event that ends a slide."""

    def velocity(_t: float, y: Floats) -> float:
        return float(y[1])

    rest: Any = velocity
    rest.terminal, rest.direction = True, -side
    event: Callable[[float, Floats], float] = rest
    return event


def _release(problem: Problem, rig: machine.Machine, z: float, t: float) -> tuple[float, float]:
    """When a mass at rest breaks loose, and to which side; none in this cycle: (TURN, 0)."""
    from scipy.optimize import brentq  # noqa: PLC0415 - heavy, needed by this method alone

    hold = problem.beta * problem.parameter("static_ratio", 1.0)

    def pull(tau: float) -> float:
        return float(rig.kernel.series(rig.force[0], rig.force[1], tau)[0]) - z

    grid = np.linspace(t, TURN, 400).tolist()
    over = next((i for i, tau in enumerate(grid) if abs(pull(tau)) > hold), None)
    if over is None:
        return TURN, 0.0
    go = float(brentq(lambda tau: abs(pull(tau)) - hold, grid[over - 1], grid[over])) if over else t
    return go, float(np.sign(pull(grid[over])))
