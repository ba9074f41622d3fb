"""Make resonance.json: motions that a harmonic of the base drives next to resonance, at 50 digits.

    python -m tests.simulator.reference.make_resonance    # of the rows that have no numbers yet

Independent of the package on purpose: mpmath with 90 digits, of which the textbook's formula of a slide loses some
thirty here; unknown are the phases of the turns in a cycle and the place of the first, and each slide must end at rest
where the next begins.
"""

from itertools import pairwise
from pathlib import Path
from typing import Any

import mpmath as mp

from tests.simulator.reference.make_reference import Slide, fill

mp.mp.dps = 90


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


def of_row(row: dict[str, Any]) -> dict[str, Any]:
    """The numbers of a point; the harmonic next to resonance is the one that r is nearest to."""
    point = (*(row[name] for name in ("r", "beta", "zeta", "cosine", "sine")), round(1 / row["r"]))
    unknown = mp.findroot(lambda *u: misses(point, u), guess(point), tol=mp.mpf(10) ** -60, maxsteps=60)
    places, _ = cycle(point, list(unknown))
    path = sum(abs(b - a) for a, b in pairwise(places))
    return {
        "path_per_cycle": mp.nstr(path, 50),
        "response_amplitude": mp.nstr((max(places) - min(places)) / 2, 50),
        "miss": mp.nstr(max(map(abs, misses(point, unknown))), 3),
    }


if __name__ == "__main__":
    fill(Path(__file__).with_name("resonance.json"), of_row)
