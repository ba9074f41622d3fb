"""The response to a sampled base motion, slow and obvious.

Nothing here is shared with the package: scipy's spline, the matrix exponential of the oscillator together with its
cubic force, a dense scan for each event, bisection. One elastic slider at most.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

SCAN = 60  # points looked at per piece


@dataclass
class Contact:
    """The numbers of a law, by their names in the equation; `kappa` 0: rigid."""

    beta: float
    q: float = 0.0
    up: float = 1.0
    down: float = 1.0
    zeta_c: float = 0.0
    zeta_f: float = 0.0
    kappa: float = 0.0
    wall_moves: bool = False


@dataclass
class Run:
    """What one run has met; `z` and `n` at the samples."""

    z: list[float] = field(default_factory=list)
    n: list[float] = field(default_factory=list)
    friction_work: float = 0.0
    path: float = 0.0
    stuck: float = 0.0
    slips: int = 0


def force_pieces(law: Contact, tau: np.ndarray, f: np.ndarray) -> np.ndarray:
    """F and its three derivatives at the start of each piece, (n - 1, 4)."""
    spline = CubicSpline(tau, f)
    d = [np.array([spline(t, k) if k < 3 else spline.c[0, i] * 6.0 for i, t in enumerate(tau[:-1])]) for k in range(4)]
    if law.wall_moves:
        return np.column_stack([-d[2], -d[3], 0.0 * d[0], 0.0 * d[0]])
    zeta = 2.0 * law.zeta_f
    return np.column_stack([d[0] + zeta * d[1], d[1] + zeta * d[2], d[2] + zeta * d[3], d[3]])


def matrix(stiffness: float, zeta: float, offset: float) -> np.ndarray:
    """The system of (z, v, F, F', F'', F''', 1)."""
    a = np.zeros((7, 7))
    a[0, 1] = a[2, 3] = a[3, 4] = a[4, 5] = 1.0
    a[1] = [-stiffness, -2.0 * zeta, 1.0, 0.0, 0.0, 0.0, -offset]
    return a


def respond(law: Contact, tau: np.ndarray, f: np.ndarray, z: float, v: float) -> Run:
    """Carry the mass through the record, piece by piece, event by event."""
    run = Run()
    phase = "held"
    anchor = z
    if law.kappa == 0.0 and v != 0.0:
        phase = "up" if v > 0 else "down"
    if law.kappa == 0.0 and v == 0.0:
        phase = rest(law, force_pieces(law, tau, f)[0][0] - z, z)
    run.slips = int(phase != "held")
    for i, push in enumerate(force_pieces(law, tau, f)):
        if i == 0:
            run.z.append(z)
            run.n.append(contact(law, phase, z, v, anchor, push[0]))
        t, span = 0.0, tau[i + 1] - tau[i]
        here = np.array([z, v, *push, 1.0])
        while span - t > 1e-14:
            a, ends = motion_of(law, phase, anchor)
            when = first(a, here, span - t, ends)
            after = expm(a * (span - t if when is None else when)) @ here
            account(run, law, phase, anchor, here, after, span - t if when is None else when)
            here, t = after, (span if when is None else t + when)
            if when is None:
                break
            z, v = here[0], here[1]
            if phase == "held":
                phase = leaves(law, here)
                run.slips += 1
            else:
                here[1] = 0.0
                anchor = z - (1 if phase == "up" else -1) * law.beta * (1 + law.q * z) / (law.kappa or 1.0)
                phase = "held" if law.kappa else rest(law, here[2] - z, z)
                run.slips += phase != "held"
        z, v = here[0], here[1]
        run.z.append(z)
        run.n.append(contact(law, phase, z, v, anchor, here[2]))
    return run


def rest(law: Contact, pull: float, z: float) -> str:
    most = law.beta * (1 + law.q * z)
    return "up" if pull > law.up * most else ("down" if pull < -law.down * most else "held")


def leaves(law: Contact, here: np.ndarray) -> str:
    if law.kappa:
        return "up" if here[1] > 0 else "down"
    return "up" if here[2] - here[0] > 0 else "down"


Ends = Callable[[np.ndarray], float]


def motion_of(law: Contact, phase: str, anchor: float) -> tuple[np.ndarray, Ends]:
    """The system of a phase, and a function of the state that is positive until it ends."""
    zeta = law.zeta_c + law.zeta_f
    if phase != "held":
        side = 1.0 if phase == "up" else -1.0
        return matrix(1 + side * law.beta * law.q, zeta, side * law.beta), lambda s: side * s[1]
    if law.kappa:

        def left(s: np.ndarray) -> float:
            n, most = law.kappa * (s[0] - anchor), law.beta * (1 + law.q * s[0])
            return float(min(law.up * most - n, law.down * most + n))

        return matrix(1 + law.kappa, zeta, -law.kappa * anchor), left
    a = np.zeros((7, 7))
    a[2, 3] = a[3, 4] = a[4, 5] = 1.0

    def slack(s: np.ndarray) -> float:
        pull, most = s[2] - s[0], law.beta * (1 + law.q * s[0])
        return float(min(law.up * most - pull, law.down * most + pull))

    return a, slack


def first(a: np.ndarray, start: np.ndarray, span: float, left: Ends) -> float | None:
    """When `left` first becomes negative after having been positive (or grown): scan, then bisection."""
    step = span / SCAN
    once, state = expm(a * step), start
    low = 0.0
    for k in range(1, SCAN + 1):
        state = once @ state
        if left(state) < 0.0:
            high = k * step
            for _ in range(80):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if left(expm(a * middle) @ start) < 0.0 else (middle, high)
            return high
        low = k * step
    return None


def contact(law: Contact, phase: str, z: float, v: float, anchor: float, push: float) -> float:
    if phase == "held":
        return law.kappa * (z - anchor) + 2 * law.zeta_c * v if law.kappa else push - z
    return (1 if phase == "up" else -1) * law.beta * (1 + law.q * z) + 2 * law.zeta_c * v


def account(
    run: Run, law: Contact, phase: str, anchor: float, before: np.ndarray, after: np.ndarray, span: float
) -> None:
    z0, z1 = before[0], after[0]
    if phase == "held":
        run.stuck += span
        run.friction_work += 0.5 * law.kappa * ((z1 - anchor) ** 2 - (z0 - anchor) ** 2)
        return
    side = 1.0 if phase == "up" else -1.0
    run.path += abs(z1 - z0)
    run.friction_work += side * law.beta * (z1 - z0 + 0.5 * law.q * (z1**2 - z0**2))
