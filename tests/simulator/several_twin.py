"""The slow twin of several masses: scipy's integrator from event to event, with forces as the laws say them.

It shares nothing with the flow but the structure. A held contact's force comes from the constraint, solved anew at each
call; which contacts hold after an event is tried out one by one.
"""

from itertools import product
from math import cos, floor, inf, pi, sin
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from frictionlab.simulator.exact.solve import sliders_of
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.structure import Contact, Structure

Floats = np.ndarray
RTOL = 1e-12


def rubs(law: str, mass: int = 1, against: int | str = "wall", /, **values: float) -> Contact:
    """A contact of a frame by its law's name and numbers."""
    chosen = law_of(law)
    return Contact(mass, against, chosen, chosen.complete(values))


class Twin:
    """A structure whose contacts are each rigid, or one elastic slider."""

    def __init__(self, structure: Structure) -> None:
        self.s, self.n = structure, structure.masses
        self.inverse = np.linalg.inv(structure.r**2 * structure.mass)
        self.springs = [sliders_of(c.parameters)[0][0] if c.law.kind == "elastic" else inf for c in structure.contacts]
        self.modes = [0] * len(structure.contacts)
        self.anchors = np.zeros(len(structure.contacts))
        self.stops, self.stuck = 0, 0.0  # of the first contact
        self.method: Any = "DOP853"
        self.passed: list[Floats] = []  # states at whole radians

    @classmethod
    def of_one(cls, problem: Problem) -> "Twin":
        """A single mass with one contact."""
        against = "base" if problem.wall == "base" else "wall"
        contact = Contact(1, against, problem.law, problem.numbers)
        zeta = problem.frame_damping_ratio
        return cls(Structure.of_storeys(problem.r, [1.0], [1.0], [zeta], [contact], problem.base))

    def base(self, tau: float) -> tuple[float, float, float]:
        """f, f', f''."""
        f = rate = bend = 0.0
        for k, (c, s) in enumerate(zip(self.s.base.cosine, self.s.base.sine, strict=True), 1):
            along, across = c * cos(k * tau) + s * sin(k * tau), s * cos(k * tau) - c * sin(k * tau)
            f, rate, bend = f + along, rate + k * across, bend - k * k * along
        return f, rate, bend

    def place(self, c: Contact, tau: float, z: Floats) -> tuple[float, float]:
        """Displacement and speed of a contact."""
        row, moves = self.s.row(c), float(c.against == "base")
        f, rate, _ = self.base(tau)
        return float(row @ z[: self.n]) - moves * f, float(row @ z[self.n : 2 * self.n]) - moves * rate

    def limit(self, c: Contact, s: float) -> float:
        """Kinetic friction force."""
        return c.beta * (1.0 + c.parameter("gradient") * s)

    def solved(self, tau: float, z: Floats) -> tuple[Floats, Floats]:
        """Accelerations and contact forces."""
        q, v = z[: self.n], z[self.n : 2 * self.n]
        f, rate, bend = self.base(tau)
        push = self.s.stiffness @ (f - q) + self.s.r * self.s.damping @ (rate - v)
        forces, held = np.zeros(len(self.modes)), []
        for i, c in enumerate(self.s.contacts):
            s, speed = self.place(c, tau, z)
            if self.modes[i] == 0 and self.springs[i] == inf:
                held.append(i)
                continue
            forces[i] = self.modes[i] * self.limit(c, s) if self.modes[i] else self.springs[i] * (s - self.anchors[i])
            forces[i] += 2.0 * self.s.r * c.parameter("contact_damping_ratio") * speed
            push = push - self.s.row(c) * forces[i]
        inverse = self.inverse
        if held:
            rows = np.array([self.s.row(self.s.contacts[i]) for i in held])
            asked = np.array([bend * (self.s.contacts[i].against == "base") for i in held])
            forces[held] = np.linalg.lstsq(rows @ inverse @ rows.T, rows @ inverse @ push - asked, rcond=None)[0]
            push = push - rows.T @ forces[held]
        return inverse @ push, forces

    def slope(self, tau: float, z: Floats) -> Floats:
        """Right-hand side, with the work of the base on the loop f dx_1 and of the contacts."""
        acceleration, forces = self.solved(tau, z)
        speeds = [self.place(c, tau, z)[1] for c in self.s.contacts]
        return np.concatenate((z[self.n : 2 * self.n], acceleration, [self.base(tau)[0] * z[self.n], forces @ speeds]))

    def events(self) -> list[Any]:
        """What may end a phase, each positive until then."""
        found = []
        for i, c in enumerate(self.s.contacts):
            if self.modes[i]:
                found.append((i, 0, lambda t, z, c=c, m=self.modes[i]: m * self.place(c, t, z)[1]))
                continue
            for side, ratio in zip((1, -1), c.static_ratios, strict=True):

                def reserve(t: float, z: Floats, i: int = i, side: int = side, k: float = ratio) -> float:
                    contact = self.s.contacts[i]
                    s, _ = self.place(contact, t, z)
                    yields = self.springs[i] < inf
                    pull = self.springs[i] * (s - self.anchors[i]) if yields else self.solved(t, z)[1][i]
                    return float(k * self.limit(contact, s) - side * pull)

                found.append((i, side, reserve))
        return found

    def settle(self, tau: float, z: Floats, resting: list[int]) -> None:
        """Hold as many rigid contacts at rest as can."""
        for sides in sorted(product((0, 1, -1), repeat=len(resting)), key=lambda each: sum(map(abs, each))):
            chosen = dict(zip(resting, sides, strict=True))
            held = [self.s.row(self.s.contacts[i]) for i, side in chosen.items() if side == 0]
            if len(held) > 1 and np.linalg.matrix_rank(held) < len(held):
                continue
            before = list(self.modes)
            for i, side in chosen.items():
                self.modes[i] = side
            acceleration, forces = self.solved(tau, z)
            fine = True
            for i, side in chosen.items():
                c = self.s.contacts[i]
                limit, ahead = self.limit(c, self.place(c, tau, z)[0]), float(self.s.row(c) @ acceleration)
                ahead -= self.base(tau)[2] * (c.against == "base")
                up, down = c.static_ratios
                fine &= (-down * limit <= forces[i] <= up * limit) if side == 0 else side * ahead > -1e-9
            if fine:
                return
            self.modes = before
        raise AssertionError("the twin finds no consistent set of held contacts")

    def run(self, z: Floats, span: float) -> Floats:
        """Carry (q, v) over a span from tau = 0; return (q, v, loop, contacts' work)."""
        z, tau = np.concatenate((z, [0.0, 0.0])), 0.0
        resting = []
        for i, c in enumerate(self.s.contacts):
            s, speed = self.place(c, tau, z)
            if self.springs[i] == inf:
                self.modes[i] = 0 if abs(speed) < 1e-12 else int(np.sign(speed))
                resting += [i] if self.modes[i] == 0 else []
                continue
            pull, limit = self.springs[i] * (s - self.anchors[i]), self.limit(c, s)
            slips = abs(abs(pull) / limit - 1.0) < 1e-9 and pull * speed > 0.0  # more: held by static friction
            self.modes[i] = int(np.sign(speed)) if slips else 0
        self.settle(tau, z, resting)
        while tau < span:
            ahead = min(span, floor(tau) + 1.0)
            step: Any = solve_ivp(
                self.slope, (tau, ahead), z, self.method, rtol=RTOL, atol=1e-14, max_step=0.05, dense_output=True
            )
            end, which = self.first(step, self.events(), tau, ahead)
            self.stuck += end - tau if self.modes[0] == 0 else 0.0
            z, tau = step.sol(end), end
            if which is None:
                self.passed.append(z)
                continue
            i, side, _ = which
            slid = self.modes[0] != 0
            resting = [j for j, spring in enumerate(self.springs) if spring == inf and self.modes[j] == 0]
            if side:
                self.modes[i] = side
                if self.springs[i] == inf:
                    self.settle(tau, z, [j for j in resting if j != i])
            else:
                s, _ = self.place(self.s.contacts[i], tau, z)
                if self.springs[i] < inf:
                    self.anchors[i] = s - self.modes[i] * self.limit(self.s.contacts[i], s) / self.springs[i]
                self.modes[i] = 0
                self.settle(tau, z, [*resting, i] if self.springs[i] == inf else resting)
            self.stops += slid and self.modes[0] == 0
        return z

    def first(self, step: Any, events: list[Any], tau: float, span: float) -> tuple[float, Any]:
        """The first change of sign of an event function: looked for at 120 places a radian, then by brentq."""
        times = np.linspace(tau, span, 2 + int(120 * (span - tau)))[1:]
        best, which, states = span, None, step.sol(times).T
        for event in events:
            values = np.array([event[2](t, z) for t, z in zip(times, states, strict=True)])
            below = np.flatnonzero(values < 0.0)
            if len(below):
                k = below[0]
                low = times[k - 1] if k else tau + 1e-9  # at the begin of a phase an event's function may be zero
                same = event[2](low, step.sol(low)) <= 0.0
                t = low if same else brentq(lambda t, e=event: e[2](t, step.sol(t)), low, times[k], xtol=1e-15)
                if t < best:
                    best, which = t, event
        return best, which


def cycle_from_rest(structure: Structure) -> Floats:
    """State (q, v) after a cycle from rest, then loop and contacts' work of it."""
    twin = Twin(structure)
    f = float(structure.base.at(0.0))
    twin.anchors = np.array([-f * (c.against == "base") for c in structure.contacts])
    return twin.run(np.zeros(2 * structure.masses), 2 * pi)
