"""Against a peer nobody here wrote: heyoka's Taylor integrator with its own event detection."""

from math import acos, cos, pi
from typing import Any

import pytest

from frictionlab.simulator import Problem, steady_state

hy: Any = pytest.importorskip("heyoka", reason="heyoka is not installed: pip install 'frictionlab[peers]'")
TURN = 2.0 * pi


def integrators(r: float, beta: float) -> dict[float, Any]:
    """One integrator per direction of sliding, of x, v and the energy put in; its event is the end of the slide."""
    x, v, e = hy.make_vars("x", "v", "e")
    pull, found = hy.cos(hy.time), {}
    for side, direction in ((1.0, hy.event_direction.negative), (-1.0, hy.event_direction.positive)):
        system = [(x, v), (v, (pull - x - side * beta) / (r * r)), (e, pull * v)]
        found[side] = hy.taylor_adaptive(system, [0.0, 0.0, 0.0], t_events=[hy.t_event(v, direction=direction)])
    return found


def last_cycle(r: float, beta: float, cycles: int) -> tuple[float, float, int]:
    """Energy, amplitude and stops of the last cycle from rest: slides by heyoka, sticks by the arc cosine of (3.2)."""
    sides, t, x, v, energy, slid = integrators(r, beta), 0.0, 0.0, 0.0, 0.0, False
    for cycle in range(cycles):
        end = (cycle + 1) * TURN
        begin, stops, high = energy, 0, 0.0
        while t < end:
            pull = cos(t) - x
            side = 1.0 if (v or pull) > 0 else -1.0
            if v == 0.0 and abs(pull) <= beta * (1 + 1e-12):
                stops, slid = stops + slid, False
                t, side = release(t, x, beta)
                if t >= end:
                    t = end
                    break
            machine = sides[side]
            machine.time, machine.state[:] = t, [x, v, energy]
            outcome = machine.propagate_until(end)[0]
            t, (x, v, energy) = machine.time, machine.state.tolist()
            if outcome != hy.taylor_outcome.time_limit:
                v = 0.0
            high, slid = max(high, abs(x)), True
    return energy - begin, high, stops


def release(t: float, x: float, beta: float) -> tuple[float, float]:
    """When and to which side the held mass breaks loose."""
    ways = []
    for side in (1.0, -1.0):
        level = x + side * beta
        if abs(level) < 1.0:
            wait = (-side * acos(level) - t) % TURN
            ways.append((t + (wait if wait < TURN - 1e-9 else 0.0), side))
    return min(ways)


@pytest.mark.parametrize(
    ("r", "beta"), [(0.5, 0.4), (0.7, 0.5), (0.3, 0.6), (0.2, 0.3), (1.4, 0.8), (0.8, 0.9)], ids=str
)
def test_agrees_with_a_taylor_integrator(r: float, beta: float) -> None:
    energy, amplitude, stops = last_cycle(r, beta, cycles=60)
    ours = steady_state(Problem(r, beta))
    assert ours.energy_per_cycle == pytest.approx(energy, rel=1e-11)
    assert ours.response_amplitude == pytest.approx(amplitude, rel=1e-11)
    assert ours.stops_per_cycle == stops
