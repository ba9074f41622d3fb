"""Make resonance.json: motions that a harmonic of the base drives next to resonance, at 50 digits.

    python tests/simulator/reference/make_resonance.py

Independent of the package on purpose: mpmath with 90 digits, of which the textbook's formula of a slide loses some
thirty here; unknown are the phases of the turns in a cycle and the place of the first, and each slide must end at rest
where the next begins.
"""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import mpmath as mp

mp.mp.dps = 90

POINTS = [
    # r, beta, zeta, cosine, sine, n: the harmonic next to resonance
    (1.0 + 1e-6, 0.3, 0.0, (1.0, 0.0, 0.1), (0.0, 0.0, 0.0), 1),
    (1.0 - 1e-9, 0.3, 0.0, (1.0, 0.2, 0.1), (0.0, 0.1, 0.05), 1),
    (1.0 + 1e-13, 0.6, 0.0, (1.0, 0.0, 0.1), (0.0, 0.0, 0.02), 1),
    (1.0 - 1e-10, 0.3, 1e-10, (1.0, 0.0, 0.1), (0.0, 0.0, 0.0), 1),
    (0.5 * (1.0 + 1e-8), 0.1, 0.0, (1.0, 0.3), (0.0, 0.0), 2),
    ((1.0 + 1e-3) / 3.0, 0.1, 0.0, (1.0, 0.1, 0.3), (0.0, 0.05, 0.0), 3),
    ((1.0 - 1e-12) / 3.0, 0.1, 0.0, (1.0, 0.1, 0.3), (0.0, 0.05, 0.0), 3),
]


class Rig:
    """The numbers of a point, and the textbook motion of one slide."""

    def __init__(self, r: float, beta: float, zeta: float, cosine: Any, sine: Any) -> None:
        self.r, self.beta, self.zeta = mp.mpf(r), mp.mpf(beta), mp.mpf(zeta)
        self.harmonics = [
            (k, mp.mpc(c, -s) / mp.mpc(1 - (k * self.r) ** 2, 2 * self.zeta * k * self.r))
            for k, (c, s) in enumerate(zip(cosine, sine, strict=True), 1)
        ]
        self.root = mp.mpc(-self.zeta, mp.sqrt(1 - self.zeta**2)) / self.r

    def forced(self, tau: Any) -> Any:
        z = sum(gain * mp.exp(mp.mpc(0, k * tau)) for k, gain in self.harmonics)
        v = sum(1j * k * gain * mp.exp(mp.mpc(0, k * tau)) for k, gain in self.harmonics)
        return z.real, v.real

    def slide(self, begin: Any, z: Any, side: int, end: Any) -> Any:
        """Displacement and velocity at `end` of a slide from rest."""
        z0, v0 = self.forced(begin)
        a, b = z - z0 + side * self.beta, -v0
        free = mp.mpc(a, (self.root.real * a - b) / self.root.imag)
        turned = free * mp.exp(self.root * (end - begin))
        z1, v1 = self.forced(end)
        return z1 - side * self.beta + turned.real, v1 + (self.root * turned).real


def misses(rig: Rig, unknown: Any) -> list[Any]:
    """Velocity at each turn, and by how much a cycle misses its first place."""
    *turns, first = unknown
    place, out = first, []
    for j, begin in enumerate(turns):
        end = turns[j + 1] if j + 1 < len(turns) else turns[0] + 2 * mp.pi
        place, speed = rig.slide(begin, place, -1 if j % 2 == 0 else 1, end)
        out.append(speed)
    return [*out, place - first]


def guess(point: Any) -> list[Any]:
    """Den Hartog's motion under the n-th harmonic alone; with a dashpot, where friction's square wave is a sine."""
    r, beta, zeta, cosine, sine, n = point
    size = mp.hypot(cosine[n - 1], sine[n - 1])
    away = mp.mpc(1 - (mp.mpf(r) * n) ** 2, 2 * mp.mpf(zeta) * r * n)
    # size exp(i phi) = away X + i 4 beta / pi: the force leads the motion X cos by phi
    push = 4 * mp.mpf(beta) / mp.pi
    x = mp.findroot(lambda x: abs(away * x + 1j * push) - size, mp.sqrt(size**2 - push**2) / abs(away))
    lead = mp.arg(away * x + 1j * push)
    psi = mp.atan2(sine[n - 1], cosine[n - 1])
    return [*((lead + psi + j * mp.pi) / n for j in range(2 * n)), x]


def row(point: Any) -> dict[str, Any]:
    """One point's numbers."""
    rig = Rig(*point[:5])
    unknown = mp.findroot(lambda *u: misses(rig, u), guess(point), tol=mp.mpf(10) ** -60, maxsteps=60)
    *turns, first = list(unknown)
    place, places = first, [first]
    for j, begin in enumerate(turns):
        end = turns[j + 1] if j + 1 < len(turns) else turns[0] + 2 * mp.pi
        place, _ = rig.slide(begin, place, -1 if j % 2 == 0 else 1, end)
        places.append(place)
    path = sum(abs(b - a) for a, b in pairwise(places))
    return {
        "r": point[0],
        "beta": point[1],
        "zeta": point[2],
        "cosine": point[3],
        "sine": point[4],
        "path_per_cycle": mp.nstr(path, 50),
        "response_amplitude": mp.nstr((max(places) - min(places)) / 2, 50),
    }


if __name__ == "__main__":
    rows = [row(point) for point in POINTS]
    text = json.dumps(rows, indent=1) + "\n"
    (Path(__file__).parent / "resonance.json").write_text(text, encoding="utf-8")
