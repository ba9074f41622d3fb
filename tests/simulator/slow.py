"""Rigid contact laws, slow and obvious: small steps of one formula, no events, no closed form, nothing of the package.

The law stands here once, as text books write it; a step is Runge and Kutta's, cut by bisection where the mass turns.
"""

from dataclasses import dataclass
from math import cos, pi, sin


@dataclass(frozen=True)
class Law:
    """``n = s beta (1 + q z) + 2 zeta_c r v``, held while -down <= n <= up; the frame's dashpot towards the base."""

    r: float
    beta: float
    q: float = 0.0
    up: float = 1.0
    down: float = 1.0
    contact: float = 0.0
    frame: float = 0.0
    moving: bool = False
    second: float = 0.0  # cosine of the base's second harmonic

    def base(self, tau: float) -> tuple[float, float, float]:
        """f, f', f''."""
        b = self.second
        return cos(tau) + b * cos(2 * tau), -sin(tau) - 2 * b * sin(2 * tau), -cos(tau) - 4 * b * cos(2 * tau)

    def push(self, tau: float) -> float:
        """The force in the displacement relative to the wall."""
        f, df, ddf = self.base(tau)
        return -(self.r**2) * ddf if self.moving else f + 2 * self.frame * self.r * df

    def slope(self, tau: float, y: list[float], s: float) -> list[float]:
        """z', v', and the rates at which the base puts energy in and contact and frame take it out."""
        z, v = y[0], y[1]
        f, df, ddf = self.base(tau)
        friction = s * self.beta * (1 + self.q * z) + 2 * self.contact * self.r * v
        a = (self.push(tau) - z - 2 * self.frame * self.r * v - friction) / self.r**2
        if self.moving:
            return [v, a, -(self.r**2) * ddf * v, friction * v + 2 * self.frame * self.r * v * v]
        legs = 2 * self.frame * self.r * (df - v)
        return [v, a, (f - z + legs) * df, friction * v + legs * (df - v)]

    def holds(self, tau: float, z: float) -> bool:
        """Whether static friction holds the mass at z."""
        load = self.beta * (1 + self.q * z)
        return -self.down * load <= self.push(tau) - z <= self.up * load

    def wait(self, tau: float, h: float, y: list[float]) -> list[float]:
        """Energies over a short time in which the mass rests."""
        if self.moving:
            return y
        f, df, _ = self.base(tau + 0.5 * h)
        legs = 2 * self.frame * self.r * df
        return [y[0], 0.0, y[2] + h * (f - y[0] + legs) * df, y[3] + h * legs * df]


def release(law: Law, tau: float, h: float, z: float) -> float:
    """When, between tau and tau + h, the mass at rest at z breaks loose."""
    low, high = 0.0, h
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if law.holds(tau + middle, z) else (low, middle)
    return high


def step(law: Law, tau: float, h: float, y: list[float], s: float) -> list[float]:
    """One step of Runge and Kutta's fourth order."""
    a = law.slope(tau, y, s)
    b = law.slope(tau + h / 2, [u + h / 2 * d for u, d in zip(y, a, strict=True)], s)
    c = law.slope(tau + h / 2, [u + h / 2 * d for u, d in zip(y, b, strict=True)], s)
    d = law.slope(tau + h, [u + h * e for u, e in zip(y, c, strict=True)], s)
    return [u + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4) for u, k1, k2, k3, k4 in zip(y, a, b, c, d, strict=True)]


def cycle(law: Law, z: float, v: float, steps: int = 2000) -> tuple[float, float, float, float, list[float]]:
    """Carry a state over one cycle; return z, v, energy in and out, and the displacement x at each step."""
    y, h, seen = [z, v, 0.0, 0.0], 2 * pi / steps, []
    for i in range(steps):
        tau, left = i * h, h
        seen.append(y[0] + (law.base(tau)[0] if law.moving else 0.0))
        while left > 0.0:
            if y[1] == 0.0 and law.holds(tau, y[0]):
                part = left if law.holds(tau + left, y[0]) else release(law, tau, left, y[0])
                y = law.wait(tau, part, y)
                tau, left = tau + part, left - part
                continue
            pull = law.push(tau) - y[0]
            s = 1.0 if y[1] > 0.0 or (y[1] == 0.0 and pull > 0.0) else -1.0
            part, after = left, step(law, tau, left, y, s)
            if s * after[1] < 0.0:
                low, high = 0.0, left
                for _ in range(60):
                    part = 0.5 * (low + high)
                    low, high = (part, high) if s * step(law, tau, part, y, s)[1] > 0.0 else (low, part)
                after = step(law, tau, part, y, s)
                after[1] = 0.0
            y, tau, left = after, tau + part, left - part
            left = 0.0 if left < 1e-14 else left
    return y[0], y[1], y[2], y[3], seen
