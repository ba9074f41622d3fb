"""The slow twin of every flow: scipy's integrator from event to event, with forces as the laws say them.

It shares nothing with the flows but the numbers of a structure. A contact is rigid, a row of elastic sliders, or a law
with inner states. A held contact's force comes from the constraint, solved anew at each call; which contacts hold after
an event is tried out one by one.
"""

from collections.abc import Sequence
from itertools import pairwise, product
from math import cos, exp, inf, log1p, pi, sin
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from frictionlab.simulator import Base, Motion, Problem, SteadyState, Structure
from frictionlab.simulator.exact.solve import sliders_of
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.numeric.integrated import RTOL, Integrated
from frictionlab.simulator.problem import COSINE, Wall
from frictionlab.simulator.structure import Contact, frame_of

Floats = np.ndarray
TURN = 2.0 * pi
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
"""One point of each integrated law."""


def steady(what: Problem | Structure, rtol: float = RTOL, near: SteadyState | None = None) -> SteadyState:
    """Steady state by steps, also of laws that have exact slides."""
    return Integrated(what, rtol).steady(near=near)


def start_of(orbit: Motion, tau: float = 0.0) -> Floats:
    """Displacement, velocity and inner states of an orbit at a time."""
    state = orbit.flow.carried(orbit.section, 0.0, tau)[0]
    return np.concatenate(([float(value) for value in orbit.at(tau)], state[2:]))


def rubs(law: str, mass: int = 1, against: int | str = "wall", /, **values: float) -> Contact:
    """A contact of a frame by its law's name and numbers."""
    chosen = law_of(law)
    return Contact(mass, against, chosen, chosen.complete(values))


TERM_OF = {
    "gradient": "place", "contact_damping_ratio": "speed", "static_ratio_up": "breakaway",
    "static_ratio_down": "breakaway", "stiffness_ratio": "compliance", "sliders": "iwan",
}  # fmt: skip


def problem_of(r: float, beta: float, wall: Wall = "fixed", base: Base = COSINE, /, **numbers: float) -> Problem:
    """A contact with the exact terms that its numbers belong to; static friction that is not given is kinetic."""
    terms = {TERM_OF[name] for name in numbers if name in TERM_OF}
    terms -= {"compliance"} if "iwan" in terms else set()
    given = ({"static_ratio_up": 1.0, "static_ratio_down": 1.0} if "breakaway" in terms else {}) | numbers
    return Problem(r, beta, wall=wall, base=base, law="+".join(["coulomb", *sorted(terms)]), parameters=given)


def height(p: dict[str, float], s: float, speed: float) -> float:
    """Friction over beta (1 + gradient s) of a law without a state, at a place and a speed >= 0."""
    if "rate_strength" in p:
        return 1.0 + p["rate_strength"] * log1p(speed / p["rate_speed"])
    if "height" in p:
        return 1.0 + p["height"] * cos(p["number"] * s)
    if "static_ratio" not in p:
        return 1.0
    return 1.0 + (p["static_ratio"] - 1.0) * exp(-((speed / p["stribeck_speed"]) ** p["stribeck_exponent"]))


def inner(p: dict[str, float], s: float, v: float, w: list[float]) -> tuple[float, list[float]]:
    """Force of a contact with inner states, and their rates; the age of rate-and-state friction is over its force."""
    top, stiffness = p["beta"] * (1.0 + p.get("gradient", 0.0) * s), p["stiffness_ratio"]
    if "bristle_damping" in p:
        g = top * (1.0 + (p["static_ratio"] - 1.0) * exp(-((v / p["stribeck_speed"]) ** 2)))
        bend = v - stiffness * abs(v) * w[0] / g
        return stiffness * w[0] + p["bristle_damping"] * bend, [bend]
    share = w[0] / top
    if "slip_distance" not in p:  # Dahl's is Bouc and Wen's of exponent 1
        return w[0], [stiffness * (v - abs(v) * abs(share) ** (p.get("exponent", 1.0) - 1.0) * share)]
    a, b, slow = p["direct_effect"], p["evolution_effect"], p["reference_speed"]
    grows, falls = (exp(min((way - w[1]) / a, 50.0)) for way in (share, -share))  # trial steps go far
    slip = slow * (grows - falls)
    wear = exp(min((1.0 - w[1]) / b, 50.0)) - abs(slip) / slow
    return w[0], [stiffness * (v - slip), b * slow / p["slip_distance"] * wear]


class Twin:
    """A structure, or a problem as one, under its own base or a sampled one.

    After a run: `states` (displacements, velocities, inner states) and `forces` of the contacts at the knots; what the
    base put in on the loop, what friction (with what its springs store) and what the contacts' dashpots took; of the
    first contact, stops, time in which nothing slips, way on which it does.
    """

    def __init__(self, what: Structure | Problem, sampled: CubicSpline | None = None, method: Any = None) -> None:
        self.s = frame_of(what)
        self.sampled, self.n = sampled, self.s.masses
        self.inverse = np.linalg.inv(self.s.r**2 * self.s.mass)
        self.rows = np.array([self.s.row(c) for c in self.s.contacts]).reshape(-1, self.n)
        self.moves = np.array([float(c.against == "base") for c in self.s.contacts])
        self.numbers, self.ratios = [c.parameters for c in self.s.contacts], [c.static_ratios for c in self.s.contacts]
        self.has_state = [c.law.kind == "inner" for c in self.s.contacts]
        self.elements: list[tuple[int, float, float]] = []  # contact, friction force, stiffness: inf of a rigid one
        for i, p in enumerate(self.numbers):
            if not self.has_state[i]:
                springs, limits = sliders_of(p)
                self.elements += [(i, *pair) for pair in zip(limits or (p["beta"],), springs or (inf,), strict=True)]
        self.method = method or ("DOP853" if self.elements else "LSODA")
        self.modes, self.anchors = [0] * len(self.elements), np.zeros(len(self.elements))
        self.stops, self.stuck, self.path = 0, 0.0, 0.0

    @property
    def rest(self) -> Floats:
        """The state at rest."""
        inside = (p for p, has in zip(self.numbers, self.has_state, strict=True) if has)
        return np.concatenate((np.zeros(2 * self.n), *([0.0, 1.0] if "slip_distance" in p else [0.0] for p in inside)))

    def base(self, tau: float) -> tuple[float, float, float]:
        """f, f', f''."""
        if self.sampled is not None:
            return float(self.sampled(tau)), float(self.sampled(tau, 1)), float(self.sampled(tau, 2))
        f = rate = bend = 0.0
        for k, (c, s) in enumerate(zip(self.s.base.cosine, self.s.base.sine, strict=True), 1):
            along, across = c * cos(k * tau) + s * sin(k * tau), s * cos(k * tau) - c * sin(k * tau)
            f, rate, bend = f + along, rate + k * across, bend - k * k * along
        return f, rate, bend

    def places(self, tau: float, z: Floats) -> tuple[Floats, Floats]:
        """Displacements and speeds of the contacts."""
        f, rate, _ = self.base(tau)
        return self.rows @ z[: self.n] - self.moves * f, self.rows @ z[self.n : 2 * self.n] - self.moves * rate

    def kinetic(self, e: int, s: float, speed: float = 0.0) -> float:
        """Friction force of an element that slips with a speed >= 0."""
        i, beta, _ = self.elements[e]
        return beta * (1.0 + self.numbers[i].get("gradient", 0.0) * s) * height(self.numbers[i], s, max(speed, 0.0))

    def static(self, e: int, s: float, side: int) -> float:
        """Force up to which an element holds to a side."""
        return self.ratios[self.elements[e][0]][0 if side > 0 else 1] * self.kinetic(e, s)

    def solved(self, tau: float, z: Floats) -> tuple[Floats, Floats, list[float]]:
        """Accelerations, forces of friction and dashpot of each contact (c, 2), rates of inner states."""
        q, v, states = z[: self.n], z[self.n : 2 * self.n], z[2 * self.n :].tolist()
        f, rate, bend = self.base(tau)
        places, speeds = self.places(tau, z)
        forces, rates, held = np.zeros((len(places), 2)), list[float](), list[int]()
        for i, p in enumerate(self.numbers):
            forces[i, 1] = 2.0 * self.s.r * p.get("contact_damping_ratio", 0.0) * speeds[i]
            if self.has_state[i]:
                forces[i, 0], more = inner(p, float(places[i]), float(speeds[i]), states[len(rates) :])
                rates += more
        for e, (i, _, spring) in enumerate(self.elements):
            if self.modes[e]:
                forces[i, 0] += self.modes[e] * self.kinetic(e, places[i], self.modes[e] * speeds[i])
            elif spring < inf:
                forces[i, 0] += spring * (places[i] - self.anchors[e])
            else:
                held.append(i)
        push = self.s.stiffness @ (f - q) + self.s.r * self.s.damping @ (rate - v) - self.rows.T @ forces.sum(axis=1)
        if held:
            rows, asked = self.rows[held], bend * self.moves[held]
            crossed = rows @ self.inverse
            forces[held, 0] = np.linalg.lstsq(crossed @ rows.T, crossed @ push - asked, rcond=None)[0]
            push = push - rows.T @ forces[held, 0]
        return self.inverse @ push, forces, rates

    def slope(self, tau: float, z: Floats) -> Floats:
        """Right-hand side, with the work of the base on the loop f dx_1, of friction and of the contacts' dashpots."""
        acceleration, forces, rates = self.solved(tau, z)
        works = self.places(tau, z)[1] @ forces
        loop = self.base(tau)[0] * z[self.n]
        return np.concatenate((z[self.n : 2 * self.n], acceleration, rates, [loop], works))

    def events(self) -> list[Any]:
        """What may end a phase, each positive until then: the element, the side it gives way to (0: it turns)."""
        found: list[Any] = []
        for e, (i, _, spring) in enumerate(self.elements):
            if self.modes[e]:
                found.append((e, 0, lambda t, z, i=i, m=self.modes[e]: m * self.places(t, z)[1][i]))
                continue
            for side in (1, -1):

                def reserve(t: float, z: Floats, e: int = e, i: int = i, k: float = spring, side: int = side) -> float:
                    s = self.places(t, z)[0][i]
                    pull = k * (s - self.anchors[e]) if k < inf else self.solved(t, z)[1][i, 0]
                    return float(self.static(e, s, side) - side * pull)

                found.append((e, side, reserve))
        return found

    def settle(self, tau: float, z: Floats, resting: list[int]) -> None:
        """Hold as many rigid contacts at rest as can."""
        for sides in sorted(product((0, 1, -1), repeat=len(resting)), key=lambda each: sum(map(abs, each))):
            chosen = dict(zip(resting, sides, strict=True))
            held = [self.rows[self.elements[e][0]] for e, side in chosen.items() if side == 0]
            if len(held) > 1 and np.linalg.matrix_rank(held) < len(held):
                continue
            before = list(self.modes)
            for e, side in chosen.items():
                self.modes[e] = side
            acceleration, forces, _ = self.solved(tau, z)
            ahead = self.rows @ acceleration - self.base(tau)[2] * self.moves
            fine, (places, _) = True, self.places(tau, z)
            for e, side in chosen.items():
                i = self.elements[e][0]
                up, down = (self.static(e, places[i], way) for way in (1, -1))
                fine &= bool(-down <= forces[i, 0] <= up if side == 0 else side * ahead[i] > -1e-9)
            if fine:
                return
            self.modes = before
        raise AssertionError("the twin finds no consistent set of held contacts")

    def begin(self, tau: float, z: Floats, anchors: Floats | None) -> None:
        """What slips and what holds at first; springs are relaxed, or where their anchors say."""
        (places, speeds), resting = self.places(tau, z), []
        self.anchors = np.array([places[i] for i, *_ in self.elements]) if anchors is None else anchors.copy()
        for e, (i, _, spring) in enumerate(self.elements):
            side = int(np.sign(speeds[i]))
            if spring == inf:
                self.modes[e] = 0 if abs(speeds[i]) < 1e-12 else side
                resting += [] if self.modes[e] else [e]
                continue
            pull = spring * (places[i] - self.anchors[e])
            slips = abs(abs(pull) / self.kinetic(e, places[i]) - 1.0) < 1e-9  # more: held by static friction
            self.modes[e] = side if slips and pull * side > 0.0 else 0
        self.settle(tau, z, resting)

    def run(self, knots: Sequence[float], start: Floats | None = None, anchors: Floats | None = None) -> Floats:
        """Carry displacements and velocities, at rest where none are given; return them at the end."""
        begun = self.rest if start is None else np.concatenate((start, self.rest[len(start) :]))
        z, tau, self.states, self.forces = np.append(begun, np.zeros(3)), float(knots[0]), [begun], list[Floats]()
        self.begin(tau, z, anchors)
        still = 0
        for _, knot in pairwise(knots):
            self.forces.append(self.solved(tau, z)[1].sum(axis=1))
            while tau < knot:
                before, (tau, z) = tau, self.step(tau, float(knot), z)
                still = still + 1 if tau - before < 1e-9 else 0
                if still > 2 * len(self.elements) + 9:
                    raise AssertionError(f"the twin makes no way at {tau}")
            self.states.append(z[:-3])
        self.forces.append(self.solved(tau, z)[1].sum(axis=1))
        self.loop, self.friction, self.viscous = (float(work) for work in z[-3:])
        return z[: len(begun)]

    def step(self, tau: float, knot: float, z: Floats) -> tuple[float, Floats]:
        """On to the next event, or to the knot if none comes before."""
        ahead, bounds = (min(knot, tau + 0.3), {"max_step": 0.05}) if self.elements else (knot, {})
        solve: Any = solve_ivp
        moved = solve(self.slope, (tau, ahead), z, self.method, rtol=1e-12, atol=1e-14, dense_output=True, **bounds)
        end, event = self.first(moved, self.events(), tau, ahead)
        after = moved.sol(end) if event else moved.y[:, -1]
        of_first = [e for e, element in enumerate(self.elements) if element[0] == 0]
        slid = any(self.modes[e] for e in of_first)
        self.stuck += 0.0 if slid else end - tau
        if slid:
            self.path += abs(float(self.places(end, after)[0][0] - self.places(tau, z)[0][0]))
        if event:
            self.happens(end, after, *event[:2])
            self.stops += slid and not any(self.modes[e] for e in of_first)
        return end, after

    def happens(self, tau: float, z: Floats, e: int, side: int) -> None:
        """An element gives way to a side, or turns (0): then all sliders of its contact do."""
        i, _, spring = self.elements[e]
        resting = [j for j, (_, _, k) in enumerate(self.elements) if k == inf and self.modes[j] == 0 and j != e]
        s = self.places(tau, z)[0][i]
        for j, (contact, _, stiffness) in enumerate(self.elements):
            if not side and spring < inf and contact == i and self.modes[j]:
                self.anchors[j], self.modes[j] = s - self.modes[j] * self.kinetic(j, s) / stiffness, 0
        self.modes[e] = side
        if spring == inf or not side:
            self.settle(tau, z, resting if side or spring < inf else [*resting, e])

    def first(self, moved: Any, events: list[Any], tau: float, ahead: float) -> tuple[float, Any]:
        """The first change of sign of an event function: looked for at 120 places a radian, then by brentq."""
        times = np.linspace(tau, ahead, 2 + int(120 * (ahead - tau)))[1:]
        best, which, states = ahead, None, moved.sol(times).T if events else []
        for event in events:
            values = np.array([event[2](t, z) for t, z in zip(times, states, strict=True)])
            below = np.flatnonzero(values < 0.0)
            if len(below):
                k = below[0]
                low = times[k - 1] if k else tau + 1e-12  # at the begin of a phase an event's function may be zero
                same = event[2](low, moved.sol(low)) <= 0.0
                t = low if same else brentq(lambda t, g=event[2]: g(t, moved.sol(t)), low, times[k], xtol=1e-15)
                if t < best:
                    best, which = t, event
        return best, which
