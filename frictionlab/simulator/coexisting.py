"""All orbits of one problem: what motions from many starts settle on, and how many of them on each."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from frictionlab.errors import UsageError
from frictionlab.simulator import engine as engines
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.orbit import steady
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.state import SteadyState, from_numbers
from frictionlab.simulator.trajectory import from_record

__all__ = ["Attractor", "coexisting"]

SAME = 1e-6  # orbits whose energy and amplitude differ by less, over the largest, are one (mirror images are)
GOLDEN = (0.7548776662466927, 0.5698402909980532)  # steps of the plane's golden ratio: even, and the same every time


@dataclass(frozen=True)
class Attractor:
    """One steady state, and the share of starts that settle on it.

    Parameters
    ----------
    state : SteadyState
        "periodic", "stuck" (rest anywhere), or "not found": the motion has not repeated within the cycles waited for.
    share : float
        Share of the starts, 0 to 1: displacements and velocities spread evenly over twice the reach of the motion from
        rest (at least Y and omega Y).
    """

    state: SteadyState
    share: float


def coexisting(problem: Problem, *, starts: int = 200) -> tuple[Attractor, ...]:
    """Return the steady states that motions from many starts settle on, the most visited one first.

    Under plain dry friction there is one and no search is made; with static friction, or friction that varies along the
    path, orbits may coexist, repeat after several cycles, or not at all.

    Parameters
    ----------
    problem : Problem
        With a rigid contact law.
    starts : int
        Number of starts; a basin of share s is missed with probability (1 - s)^starts.

    Raises
    ------
    UsageError
        The law has no rigid contact, or there is no start.

    Examples
    --------
    >>> found = coexisting(Problem(0.44, 0.2, mu=3.0), starts=20)
    >>> sorted(attractor.state.period_cycles for attractor in found)
    [3]
    """
    if problem.law.kind != "rigid" or starts < 1:
        raise UsageError(
            f"all steady states: law {problem.law.name}, {starts} starts; expected a rigid contact (a sum of coulomb, "
            "place, speed and breakaway) and at least one start"
        )
    first = steady(problem)
    if problem.mu == 1.0 and not problem.parameter("gradient"):
        return (Attractor(first, 1.0),)
    groups: list[tuple[SteadyState, int]] = []
    for state in _settled(problem, first, starts):
        place = next((i for i, (known, _) in enumerate(groups) if _is_same(known, state)), None)
        if place is None:
            groups.append((state, 1))
        else:
            groups[place] = (groups[place][0], groups[place][1] + 1)
    groups.sort(key=lambda group: -group[1])
    return tuple(Attractor(replace(state, warnings=()), count / starts) for state, count in groups)


def _settled(problem: Problem, first: SteadyState, starts: int) -> Iterator[SteadyState]:
    """What the motion from each start settles on."""
    engine = engines.choose(2e3 * starts)
    rig, force = engines.set_up(engine, problem)
    reach = 2.0 * max(1.0, first.response_amplitude or 0.0)
    phases = 64 + int(64 * (problem.base.harmonics + 1.0 / problem.r))
    for number in range(starts):
        z, v = (reach * (2.0 * ((0.5 + step * number) % 1.0) - 1.0) for step in GOLDEN)
        yield _from_start(engine, problem, (rig, force), (z, v), phases)


def _from_start(
    engine: engines.Engine, problem: Problem, parts: tuple[Any, Any], start: tuple[float, float], phases: int
) -> SteadyState:
    row = engine.buffer((0.0,) * layout.ROW)
    while True:
        room = engines.make_room(engine, problem, phases)
        engine.kernel.steady_from(*parts, *start, room, row)
        count = int(room.tally[layout.PHASES])
        if row[layout.OUTCOME] != layout.OVERFULL:
            break
        phases = count
    moved = int(row[layout.OUTCOME]) in (layout.PERIODIC, layout.STUCK)
    return from_numbers(
        problem, row, from_record(problem, room.phases, count, periodic=True, mirror=False) if moved else None
    )


def _is_same(one: SteadyState, other: SteadyState) -> bool:
    """Whether two steady states are one: same period, energy and amplitude; rest is one wherever the mass rests."""
    if (one.outcome, one.period_cycles) != (other.outcome, other.period_cycles):
        return False
    if one.outcome != "periodic":
        return True
    pairs = ((one.energy_per_cycle, other.energy_per_cycle), (one.response_amplitude, other.response_amplitude))
    return all(abs((a or 0.0) - (b or 0.0)) <= SAME * max(abs(a or 0.0), abs(b or 0.0)) for a, b in pairs)
