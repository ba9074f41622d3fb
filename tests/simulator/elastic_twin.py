"""Elastic contacts, slow and obvious: a tight Runge-Kutta integration, an event for every turn and every limit."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

from frictionlab.simulator import Problem
from frictionlab.simulator.exact.solve import sliders_of


@dataclass
class Run:
    """Where a run ended, what went in, how long no slider slipped, and when something happened."""

    z: float
    v: float
    force: float
    work: float
    held: float
    events: list[float] = field(default_factory=list)


@dataclass
class Event:
    """A turn (slider -1), or a slider that comes to its limit."""

    problem: Problem
    way: float
    slider: int
    strength: float
    direction: float
    terminal: bool = True

    def __call__(self, _: float, y: np.ndarray) -> float:
        if self.slider < 0:
            return self.way * float(y[1])
        ratio = self.problem.static_ratios[0 if self.way > 0 else 1]
        limit = ratio * self.strength * (1 + self.problem.parameter("gradient") * y[0])
        return float(self.way * y[2 + self.slider] - limit)


def run(
    problem: Problem, end: float, z: float = 0.0, v: float = 0.0, forces: Sequence[float] = (), *, slips: bool = False
) -> Run:
    """Carry a state from tau = 0 to the end; relaxed sliders, or with forces, and all slip the way the mass goes."""
    kappa, beta = (np.array(values) for values in sliders_of(problem.parameters))
    cosine, sine = (np.array(values) for values in problem.force)
    order = np.arange(1, len(cosine) + 1)
    q, thick = problem.parameter("gradient"), 2 * (problem.zeta + problem.frame_damping_ratio) * problem.r
    tau, side, held, times = 0.0, np.full(len(kappa), np.sign(v) if slips else 0.0), 0.0, []
    y = np.concatenate(([z, v], forces if len(forces) else np.zeros(len(kappa)), [0.0]))

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        f = float(np.cos(order * t) @ cosine + np.sin(order * t) @ sine)
        a = (f - y[0] - y[2:-1].sum() - thick * y[1]) / problem.r**2
        return np.concatenate(([y[1], a], np.where(side == 0, kappa, side * beta * q) * y[1], [f * y[1]]))

    while tau < end - 1e-13:
        way = float(np.sign(y[1]) or np.sign(rates(tau, y)[1]))
        events = [Event(problem, way, -1, 0.0, -1.0)]
        events += [Event(problem, way, int(i), float(beta[i]), 1.0) for i in np.flatnonzero(side == 0)]
        done = solve_ivp(rates, (tau, end), y, method="DOP853", events=events, rtol=1e-12, atol=1e-13, max_step=0.05)
        held += (done.t[-1] - tau) if not side.any() else 0.0
        tau, y = float(done.t[-1]), done.y[:, -1].copy()
        times.append(tau)
        for event, met in zip(events, done.t_events or [], strict=True):
            if met.size and event.slider < 0:
                side[:], y[1] = 0.0, 0.0
            elif met.size:
                side[event.slider] = way
                y[2 + event.slider] = way * beta[event.slider] * (1 + q * y[0])
    return Run(float(y[0]), float(y[1]), float(y[2:-1].sum()), float(y[-1]), held, times)
