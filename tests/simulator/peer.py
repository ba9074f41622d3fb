"""The same oscillator on heyoka's Taylor integrator, which nobody here wrote; its events find the stops."""

from dataclasses import dataclass
from math import acos, cos, pi
from typing import Any

TURN = 2.0 * pi


@dataclass(frozen=True)
class PeerCycle:
    """The last cycle of a run from rest."""

    energy: float
    stops: int
    amplitude: float


def integrators(r: float, beta: float) -> dict[float, Any]:
    """One integrator per direction of sliding; building them compiles code, which is not what is timed."""
    import heyoka as hy  # noqa: PLC0415 - optional

    x, v, e = hy.make_vars("x", "v", "e")
    pull = hy.cos(hy.time)
    found = {}
    for side, direction in ((1.0, hy.event_direction.negative), (-1.0, hy.event_direction.positive)):
        system = [(x, v), (v, (pull - x - side * beta) / (r * r)), (e, pull * v)]
        found[side] = hy.taylor_adaptive(system, [0.0, 0.0, 0.0], t_events=[hy.t_event(v, direction=direction)])
    return found


def run(r: float, beta: float, cycles: int, sides: dict[float, Any] | None = None) -> PeerCycle:
    """Run from rest: slides by heyoka, sticks by the arc cosine of eq. (3.2)."""
    import heyoka as hy  # noqa: PLC0415 - optional

    sides = integrators(r, beta) if sides is None else sides
    t, x, v, energy = 0.0, 0.0, 0.0, 0.0
    begin, stops, high, slid = 0.0, 0, 0.0, False
    for cycle in range(cycles):
        end = (cycle + 1) * TURN
        begin, stops, high = energy, 0, 0.0
        while t < end:
            pull = cos(t) - x
            if v == 0.0 and abs(pull) <= beta * (1 + 1e-12):
                stops += slid
                slid = False
                t, side = _release(t, x, beta)
                if t >= end:
                    t = end
                    break
            else:
                side = 1.0 if (v or pull) > 0 else -1.0
            machine = sides[side]
            machine.time = t
            machine.state[:] = [x, v, energy]
            outcome = machine.propagate_until(end)[0]
            t, (x, v, energy) = machine.time, machine.state.tolist()
            if outcome != hy.taylor_outcome.time_limit:
                v = 0.0
            high, slid = max(high, abs(x)), True
    return PeerCycle(energy - begin, stops, high)


def _release(t: float, x: float, beta: float) -> tuple[float, float]:
    """When and to which side the held mass breaks loose."""
    ways = []
    for side in (1.0, -1.0):
        level = x + side * beta
        if abs(level) < 1.0:
            wait = (-side * acos(level) - t) % TURN
            ways.append((t + (wait if wait < TURN - 1e-9 else 0.0), side))
    return min(ways)
