"""Den Hartog's closed form for continuous motion (2.10-2.14, 2.23), its boundary, and the viscous oscillator (3.4-3.7).

Valid for an undamped mass, a fixed wall and a pure cosine, below `friction_limit`. Textbook forms divide 0 by 0 at
r = 1 and at r = 1/(2k+1); here both are written in the exact distance of 1/r to the nearest odd integer.
"""

from math import ceil, cos, inf, pi, sin, sqrt

import mpmath
from scipy.optimize import minimize_scalar

from frictionlab.simulator import Problem
from frictionlab.simulator.exact.answer import den_hartog, gap
from tests.desk import present


def off(value: float | None, truth: str) -> float:
    """Relative error, formed with 50 digits."""
    with mpmath.workdps(50):
        exact = mpmath.mpf(truth)
        return float(abs(present(value) - exact) / abs(exact)) if exact else abs(present(value))


def of_modes(problem: Problem) -> float:
    """What rounding takes beside resonance: digits go as the distance does (design, "One engine")."""
    damping = problem.zeta + problem.frame_damping_ratio
    distance = min(abs(complex(1.0 - k * problem.r, damping)) for k in range(1, problem.base.harmonics + 1))
    return 0.0 if distance == 0.0 or problem.law.kind == "elastic" else 3e-15 / distance


def continuous_amplitude(r: float, beta: float) -> float:
    """Return the amplitude X = sqrt(V^2 - beta^2 U^2) of continuous motion over Y, eqs (2.11)-(2.13)."""
    amplitude, _ = den_hartog(r, beta)
    return amplitude if amplitude > 0.0 else inf


def continuous_energy(r: float, beta: float) -> float:
    """Return the energy dissipated per cycle of continuous motion over k Y^2: 4 beta X, eq. (2.23)."""
    return 4.0 * beta * continuous_amplitude(r, beta)


def friction_limit(r: float) -> float:
    """Return beta_lim(r), the friction ratio up to which the motion is continuous: no stop in a cycle (mu = 1).

    The velocity of (2.22) must keep its sign for half a period: ``X >= beta S`` with, counted back from the turn,

    ``S = max over 0 < phi < pi of [A (cos(phi/r) - cos phi) - B sin(phi/r)] / (r B sin phi)``

    where ``A, B = sin, cos(pi/2r)``; with X from (2.11) that is ``beta_lim = |V| / sqrt(U^2 + S^2)``, written as
    ``r |V B| / sqrt(A^2 + (r B S)^2)``. At r = 1/(2n) it is 1/(4 n^2 - 1), the bound of eq. (3.3).
    """
    odd = 2.0 * (0.5 / r // 1.0) + 1.0
    away = gap(r, odd) / r  # 1/r - odd
    turn = -1.0 if odd % 4.0 == 3.0 else 1.0
    a, b = turn * cos(0.5 * pi * away), -turn * sin(0.5 * pi * away)
    if odd == 1.0:  # V B, whose zero and pole cancel at r = 1
        half = 0.5 * pi * away
        vb = 0.5 * pi / (r * (1.0 + r)) * (sin(half) / half if half != 0.0 else 1.0)
    else:
        vb = abs(b) / abs(gap(r, 1.0) * (1.0 + r))
    return r * vb / sqrt(a * a + _steepest(r, a, b) ** 2)


def _steepest(r: float, a: float, b: float) -> float:
    """Return the maximum of |a (cos(phi/r) - cos phi) - b sin(phi/r)| / sin phi over (0, pi/2]."""

    def ratio(phi: float) -> float:
        beat = -2.0 * sin(0.5 * (1.0 / r + 1.0) * phi) * sin(0.5 * gap(r, 1.0) / r * phi)
        return abs(a * beat - b * sin(phi / r)) / sin(phi)

    count = 16 + 16 * ceil(1.0 / r)
    step = 0.5 * pi / count
    values = [abs(b) / r] + [ratio(step * i) for i in range(1, count + 1)]
    best = values[0]
    for i in range(count + 1):  # the ratio is even about both ends
        if values[i] >= values[abs(i - 1)] and values[i] >= values[min(i + 1, 2 * count - i - 1)]:
            low, high = max(step * (i - 1), 1e-6 * step), min(step * (i + 1), 0.5 * pi)
            peak = minimize_scalar(
                lambda phi: -ratio(phi), bounds=(low, high), method="bounded", options={"xatol": 1e-9}
            )
            best = max(best, -float(peak.fun), ratio(high))
    return best


def viscous_energy(r: float, zeta: float) -> float:
    """Return the energy per cycle of the viscous oscillator over k Y^2: 2 zeta r times the integral of x'^2, (3.7)."""
    return 2.0 * pi * zeta * r / ((1.0 - r * r) ** 2 + (2.0 * zeta * r) ** 2)
