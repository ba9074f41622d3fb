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

from tests.simulator.reference.make_reference import Rig, fill

mp.mp.dps = 90


def cycle(rig: Rig, unknown: Any) -> tuple[list[Any], list[Any]]:
    """Places and velocities at the turns of a cycle, the first place twice: as it is assumed and as it comes out."""
    *turns, first = unknown
    places, speeds = [first], []
    for j, (begin, end) in enumerate(pairwise((*turns, turns[0] + 2 * mp.pi))):
        place, speed = rig.slide(begin, places[-1], mp.mpf(0), (-1) ** (j + 1)).at(end - begin)
        places.append(place)
        speeds.append(speed)
    return places, speeds


def misses(rig: Rig, unknown: Any) -> list[Any]:
    """Velocity at each turn, and by how much a cycle misses its first place."""
    places, speeds = cycle(rig, unknown)
    return [*speeds, places[-1] - places[0]]


def guess(rig: Rig) -> list[Any]:
    """Den Hartog's motion under the n-th harmonic alone; with a dashpot, where friction's square wave is a sine."""
    n = round(1 / rig.r)  # the harmonic that r is nearest to
    size, away = abs(rig.base[n - 1]), mp.mpc(1 - (rig.r * n) ** 2, 2 * rig.zeta * rig.r * n)
    # size exp(i phi) = away X + i 4 beta / pi: the force leads the motion X cos by phi
    push = 4 * rig.beta / mp.pi
    x = mp.findroot(lambda x: abs(away * x + 1j * push) - size, mp.sqrt(size**2 - push**2) / abs(away))
    begin = mp.arg(away * x + 1j * push) - mp.arg(rig.base[n - 1])
    return [*((begin + j * mp.pi) / n for j in range(2 * n)), x]


def of_row(row: dict[str, Any]) -> dict[str, Any]:
    """The numbers of a point; with a dashpot the energy is not its path's alone, and is left out."""
    rig = Rig.of(row)
    unknown = mp.findroot(lambda *u: misses(rig, u), guess(rig), tol=mp.mpf(10) ** -60, maxsteps=60)
    places, _ = cycle(rig, list(unknown))
    path = sum(abs(b - a) for a, b in pairwise(places))
    return {
        "energy_per_cycle": None if rig.zeta else mp.nstr(rig.beta * path, 50),
        "response_amplitude": mp.nstr((max(places) - min(places)) / 2, 50),
        "stops_per_cycle": 0,
        "miss": mp.nstr(max(map(abs, misses(rig, unknown))), 3),
    }


if __name__ == "__main__":
    fill(Path(__file__).with_name("resonance.json"), of_row)
