"""Make elastic.json: steady states of elastic contacts at hard points, at 50 digits.

    python -m tests.simulator.reference.make_elastic_reference    # rows that have no numbers yet

Independent of the package on purpose: the textbook's slide and turns of `make_reference`; limits by bisection (the way
only grows between turns); orbits by Newton with differences.
"""

from itertools import pairwise
from pathlib import Path
from typing import Any

import mpmath as mp

from tests.simulator.reference.make_reference import Rig, Slide, bisect, den_hartog, fill, series, turning


class Contact:
    """The numbers of a point, at 50 digits."""

    def __init__(self, row: dict[str, Any]) -> None:
        rig, given = Rig.of(row), {"sliders": 1, "chi": 0.0} | row["parameters"]
        self.r, self.q, self.up, self.down, self.moving = rig.r, rig.gradient, rig.up, rig.down, rig.moving
        self.zeta_c, self.zeta_f, self.base, self.lines = rig.zeta - rig.frame, rig.frame, rig.base, rig.lines
        n, chi, kappa = int(given["sliders"]), mp.mpf(given["chi"]), mp.mpf(given["stiffness_ratio"])
        cuts = [(mp.mpf(i) / n) ** (2 / (chi + 2)) for i in range(n + 1)]
        self.kappa = [kappa * (b ** (chi + 1) - a ** (chi + 1)) for a, b in pairwise(cuts)]
        self.beta = [rig.beta * (b ** (chi + 2) - a ** (chi + 2)) for a, b in pairwise(cuts)]

    def frame_sees(self, v: Any, tau: Any) -> Any:
        """The velocity between mass and base: z is relative to a wall that stands, or to one that is the base."""
        return v if self.moving else v - series(self.base, tau, 1)


def stiffness(c: Contact, side: list[int]) -> Any:
    """What the contact adds: springs that hold, friction that varies along the path where it slips."""
    return sum(k if s == 0 else s * b * c.q for k, b, s in zip(c.kappa, c.beta, side, strict=True))


def carry(c: Contact, state: Any, span: Any, tau: Any) -> Any:
    """Carry (z, v, forces, sides) over a span; return the state there, and energies, held time, stops, extremes."""
    z, v, n, side = state[0], state[1], list(state[2]), list(state[3])
    end, work, viscous, frame = tau + span, mp.mpf(0), mp.mpf(0), mp.mpf(0)
    high, low, held, stops, still = -mp.inf, mp.inf, mp.mpf(0), 0, mp.mpf(0)
    while tau < end:
        thick = 2 * (c.zeta_c + c.zeta_f) * c.r
        a = series(c.lines, tau) - z - sum(n) - thick * v
        way = int(mp.sign(v) if v != 0 else mp.sign(a))
        ratio = c.up if way > 0 else c.down
        left = {
            i: (ratio * c.beta[i] * (1 + c.q * z) - way * n[i]) / (c.kappa[i] - way * ratio * c.beta[i] * c.q)
            for i in range(len(n))
            if side[i] == 0
        }
        stiff = stiffness(c, side)
        whole, scale = 1 + stiff, c.r / mp.sqrt(1 + stiff)
        at = Slide(c.r, c.zeta_c + c.zeta_f, c.lines, (tau, z, v), whole, (stiff * z - sum(n)) / whole).at
        t = turning(lambda t, at=at, way=way: way * at(t)[1], scale, end - tau)
        turned, t = t is not None, end - tau if t is None else t
        made = way * (at(t)[0] - z)
        first = min(left, key=lambda i: left[i]) if left else -1
        gives = first >= 0 and left[first] <= made
        if gives:
            turned = False
            t = bisect(lambda s, at=at, way=way, z=z, f=left[first]: f - way * (at(s)[0] - z), mp.mpf(0), t)
        after, speed = at(t)
        if t > 0:
            edges = mp.linspace(0, t, 2 + int(t / scale))
            if c.zeta_c or c.zeta_f:
                viscous += 2 * c.zeta_c * c.r * mp.quad(lambda s, at=at: at(s)[1] ** 2, edges)
                frame += (
                    2 * c.zeta_f * c.r * mp.quad(lambda s, at=at, tau=tau: c.frame_sees(at(s)[1], tau + s) ** 2, edges)
                )
        work += (sum(n) + stiff * (after - z) / 2) * (after - z)
        if not any(side):
            held += t
            still += t
        for i in range(len(n)):
            n[i] = n[i] + c.kappa[i] * (after - z) if side[i] == 0 else side[i] * c.beta[i] * (1 + c.q * after)
        high, low = max(high, z, after), min(low, z, after)
        tau, z, v = tau + t, after, mp.mpf(0) if turned else speed
        if gives:
            stops += still > mp.mpf(10) ** -13
            still = mp.mpf(0)
            side[first], n[first] = way, way * c.beta[first] * (1 + c.q * z)
        elif turned:
            side = [0] * len(n)
        elif t == end - (tau - t):
            break
    return (z, v, n, side), work, viscous + frame, held, stops, high, low


def orbit(c: Contact, half: bool) -> Any:
    """Newton with differences on the map of half a period (mirrored) or of a whole one, from a section in a slip."""
    sign, span = (-1, mp.pi) if half else (1, 2 * mp.pi)
    count = len(c.kappa)
    state: Any = (mp.mpf(0), mp.mpf(0), [mp.mpf(0)] * count, [0] * count)
    begun = mp.mpf(0)

    def image(state: Any) -> Any:
        (z, v, n, side), *_ = carry(c, state, span, begun)
        return sign * z, sign * v, [sign * f for f in n], [sign * s for s in side]

    rigid = den_hartog(c.r, sum(c.beta)) if c.kappa[0] > 1e6 else None
    if rigid is not None:  # rest would ring for ever
        side = [int(mp.sign(rigid[1]))] * count
        state = rigid[0], rigid[1], [s * b for s, b in zip(side, c.beta, strict=True)], side
    for _ in range(0 if rigid is not None else 8 if half else 4):
        state = image(state)
    for _ in range(40):  # on to a time at which every slider slips, if there is one; there only z and v are unknown
        if all(state[3]):
            break
        state, *_ = carry(c, state, mp.mpf("0.1"), begun)
        begun += mp.mpf("0.1")

    def tied(y: Any, like: Any) -> Any:
        n = [s * b * (1 + c.q * y[0]) if s else f for s, b, f in zip(like[3], c.beta, like[2], strict=True)]
        return y[0], y[1], n, list(like[3])

    for _ in range(40):
        to = image(state)
        miss = mp.matrix([to[0] - state[0], to[1] - state[1]])
        rest = max(abs(a - b) for a, b in zip(to[2], tied(to, to)[2], strict=True))
        if to[3] == state[3] and all(to[3]) and rest == 0 and mp.norm(miss) < mp.mpf(10) ** -30:
            break
        d = mp.mpf(10) ** -22
        columns = []
        for e in (mp.matrix([d, 0]), mp.matrix([0, d])):
            moved = image(tied(mp.matrix([state[0], state[1]]) + e, state))
            columns.append(((moved[0] - to[0]) / d, (moved[1] - to[1]) / d))
        jacobian = mp.matrix([[columns[0][0] - 1, columns[1][0]], [columns[0][1], columns[1][1] - 1]])
        y = mp.matrix([state[0], state[1]]) - mp.lu_solve(jacobian, miss)
        state = tied(y, to if to[3] == state[3] else state)
    return state, miss, span, sign, begun


def reference(point: dict[str, Any]) -> dict[str, Any]:
    c = Contact(point)
    half = c.up == c.down and c.q == 0 and len(c.base) == 1
    state, miss, span, sign, begun = orbit(c, half)
    _, work, viscous, held, stops, high, low = carry(c, state, span, begun)
    cycles = span / (2 * mp.pi)
    amplitude = max(high, -low) if sign < 0 else (high - low) / 2
    return {
        "energy_per_cycle": mp.nstr((work + viscous) / cycles, 30),
        "response_amplitude": None if c.moving else mp.nstr(amplitude, 30),
        "stuck_fraction": mp.nstr(held / span, 30),
        "stops_per_cycle": round(stops / float(cycles)),
        "miss": mp.nstr(mp.norm(miss), 3),
    }


if __name__ == "__main__":
    fill(Path(__file__).with_name("elastic.json"), reference)
