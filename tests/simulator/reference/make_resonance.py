"""Make resonance.json: motions that a harmonic of the base drives next to resonance, at 50 digits.

    python -m tests.simulator.reference.make_resonance

Independent of the package on purpose: mpmath with 90 digits, of which the textbook's formula of a slide loses some
thirty here; unknown are the phases of the turns in a cycle and the place of the first, and each slide must end at rest
where the next begins.
"""

import json
from itertools import pairwise
from pathlib import Path
from typing import Any

import mpmath as mp

from tests.simulator.reference.make_reference import Slide

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


def slide(point: Any, begin: Any, z: Any, side: int, end: Any) -> Any:
    """Displacement and velocity at `end` of a slide from rest."""
    r, beta, zeta, cosine, sine = (mp.mpf(v) if isinstance(v, float) else v for v in point[:5])
    lines = [mp.mpc(c, -s) for c, s in zip(cosine, sine, strict=True)]
    return Slide(r, zeta, lines, (begin, z, mp.mpf(0)), mp.mpf(1), -side * beta).at(end - begin)


def cycle(point: Any, unknown: Any) -> tuple[list[Any], list[Any]]:
    """Places and velocities at the turns of a cycle, the first place twice: as it is assumed and as it comes out."""
    *turns, first = unknown
    places, speeds = [first], []
    for j, begin in enumerate(turns):
        end = turns[j + 1] if j + 1 < len(turns) else turns[0] + 2 * mp.pi
        place, speed = slide(point, begin, places[-1], -1 if j % 2 == 0 else 1, end)
        places.append(place)
        speeds.append(speed)
    return places, speeds


def misses(point: Any, unknown: Any) -> list[Any]:
    """Velocity at each turn, and by how much a cycle misses its first place."""
    places, speeds = cycle(point, unknown)
    return [*speeds, places[-1] - places[0]]


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
    unknown = mp.findroot(lambda *u: misses(point, u), guess(point), tol=mp.mpf(10) ** -60, maxsteps=60)
    places, _ = cycle(point, list(unknown))
    path = sum(abs(b - a) for a, b in pairwise(places))
    return dict(zip(("r", "beta", "zeta", "cosine", "sine"), point[:5], strict=True)) | {
        "path_per_cycle": mp.nstr(path, 50),
        "response_amplitude": mp.nstr((max(places) - min(places)) / 2, 50),
    }


if __name__ == "__main__":
    rows = [row(point) for point in POINTS]
    text = json.dumps(rows, indent=1) + "\n"
    (Path(__file__).parent / "resonance.json").write_text(text, encoding="utf-8")
