"""One mass with one contact, slow and obvious: scipy's integrator from knot to knot of the drive and event to event.

A rigid contact stands or slides; each slider of an elastic one holds like a spring or slips, and all hold from a turn
on. Nothing is shared with the flow but the numbers of the law.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from frictionlab.simulator import Problem
from frictionlab.simulator.exact.solve import sliders_of

SCAN = 60  # places of a piece at which the reserve of a contact that stands is looked at


@dataclass
class Run:
    """Displacement and contact force at the knots, the velocity at the end, and what happened on the way."""

    z: list[float] = field(default_factory=list)
    force: list[float] = field(default_factory=list)
    v: float = 0.0
    friction_work: float = 0.0  # what springs store is in it
    path: float = 0.0  # on which it slipped
    held: float = 0.0  # time in which nothing slipped
    slips: int = 0


class OneMass:
    """A problem under a drive F(tau) of the equation in z."""

    def __init__(self, problem: Problem, drive: Callable[[float], float]) -> None:
        self.problem, self.drive, self.q = problem, drive, problem.parameter("gradient")
        springs, beta = sliders_of(problem.parameters)
        self.springs, self.beta = np.array(springs), np.array(beta or (problem.beta,))
        self.rigid, self.side = not springs, np.zeros(len(self.beta))

    def limit(self, z: float) -> Any:
        """Kinetic friction of each slider."""
        return self.beta * (1.0 + self.q * z)

    def reserve(self, t: float, z: float) -> float:
        """What a rigid contact that stands could still hold."""
        (up, down), pull, most = self.problem.static_ratios, self.drive(t) - z, float(self.limit(z)[0])
        return min(up * most - pull, down * most + pull)

    def settled(self, t: float, z: float) -> float:
        """Where a rigid contact goes from rest; 0: it stands."""
        return 0.0 if self.reserve(t, z) >= 0.0 else float(np.sign(self.drive(t) - z))

    def force(self, t: float, y: Any) -> float:
        """Of the contact on the mass, its dashpot included."""
        if self.rigid and not self.side[0]:
            return float(self.drive(t) - y[0])
        own = self.side[0] * self.limit(y[0])[0] if self.rigid else y[2:].sum()
        return float(own + 2.0 * self.problem.zeta * self.problem.r * y[1])

    def rates(self, t: float, y: Any) -> Any:
        """Of displacement, velocity and the sliders' forces."""
        pull = self.drive(t) - y[0] - 2.0 * self.problem.frame_damping_ratio * self.problem.r * y[1]
        own = [] if self.rigid else np.where(self.side == 0.0, self.springs, self.side * self.beta * self.q) * y[1]
        return np.concatenate(([y[1], (pull - self.force(t, y)) / self.problem.r**2], own))

    def events(self, way: float, holding: Sequence[int]) -> list[Any]:
        """A turn, then each slider that comes to its limit."""
        ratio = self.problem.static_ratios[0 if way > 0.0 else 1]
        found: list[Any] = [lambda _, y: way * y[1]]
        found += [lambda _, y, i=i: way * y[2 + i] - ratio * self.limit(y[0])[i] for i in holding]
        for event, direction in zip(found, [-1.0] + [1.0] * len(holding), strict=True):
            event.terminal, event.direction = True, direction
        return found

    def follow(self, knots: Sequence[float], z: float, v: float) -> Run:
        """Carry the mass from the first knot to the last; sliders begin relaxed."""
        run, y = Run(), np.concatenate(([z, v], np.zeros(len(self.springs))))
        if self.rigid:
            self.side[0] = np.sign(v) or self.settled(knots[0], z)
            run.slips = int(self.side[0] != 0.0)
        for t, end in pairwise(knots):
            run.z.append(float(y[0]))
            run.force.append(self.force(t, y))
            while end - t > 1e-13:
                t, y = (self.stand if self.rigid and not self.side[0] else self.move)(run, t, end, y)  # noqa: PLW2901
        run.z.append(float(y[0]))
        run.force.append(self.force(knots[-1], y))
        run.v = float(y[1])
        return run

    def stand(self, run: Run, t: float, end: float, y: Any) -> tuple[float, Any]:
        """A rigid contact stands until the pull has used its reserve."""
        times, z, when = np.linspace(t, end, SCAN), float(y[0]), end
        over = next((k for k in range(1, SCAN) if self.reserve(times[k], z) < 0.0), None)
        if over is not None:
            when = float(brentq(self.reserve, times[over - 1], times[over], args=(z,), xtol=1e-15))
            self.side[0] = np.sign(self.drive(when) - z)
            run.slips += 1
        run.held += when - t
        return when, y

    def move(self, run: Run, t: float, end: float, y: Any) -> tuple[float, Any]:
        """On to the next event, or to the end."""
        way = float(self.side[0]) if self.rigid else float(np.sign(y[1]) or np.sign(self.rates(t, y)[1]))
        holding = [] if self.rigid else np.flatnonzero(self.side == 0.0).tolist()
        solve: Any = solve_ivp
        how = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": 0.05}
        done = solve(self.rates, (t, end), y, events=self.events(way, holding), **how)
        at, after, slips = float(done.t[-1]), done.y[:, -1].copy(), self.side != 0.0
        way_made, slope = after[0] - y[0], 0.5 * self.q * (after[0] ** 2 - y[0] ** 2)
        run.friction_work += float(np.sum(self.side * self.beta * (way_made + slope)))
        if not self.rigid:
            run.friction_work += float(np.sum(((after[2:] ** 2 - y[2:] ** 2) / (2.0 * self.springs))[~slips]))
        run.path += abs(way_made) if slips.any() else 0.0
        run.held += 0.0 if slips.any() else at - t
        turned, *given = (met.size > 0 for met in done.t_events)
        if turned:
            after[1], self.side[:] = 0.0, 0.0
            self.side[0] = self.settled(at, float(after[0])) if self.rigid else 0.0
            run.slips += int(self.side[0] != 0.0)
        for i, gives in zip(holding, given, strict=True):
            if gives:
                self.side[i], after[2 + i] = way, way * self.limit(after[0])[i]
                run.slips += 1
        return at, after
