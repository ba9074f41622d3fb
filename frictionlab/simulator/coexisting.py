"""All orbits of one problem: what motions from many starts settle on, and how many of them on each."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from frictionlab.errors import UsageError
from frictionlab.simulator.notes import Note
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.solve import flow_of, steady_state
from frictionlab.simulator.state import SteadyState
from frictionlab.simulator.sweep import warm_up

SAME = 1e-6  # orbits whose energy and amplitude differ by less, over the largest, are one (mirror images are)
STARTS, NUMERIC_STARTS = 200, 50  # where slides are exact, and where each takes a tenth of a second
WORTH_COMPILING = 20  # starts
LOOKS = 2e8  # at slides, from all rigid starts together: some 20 s; what is left of the starts then is "not found"
OF_REST = Note.REST_STILL_FAR | Note.MAY_COEXIST | Note.MAY_GO_ON
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


def coexisting(problem: Problem, *, starts: int | None = None) -> tuple[Attractor, ...]:
    """Return the steady states that motions from many starts settle on, the most visited one first.

    Where friction neither falls from rest nor with speed, nor varies along the path, there is one and no search is
    made; else orbits may coexist, repeat after several cycles, or not at all.

    Parameters
    ----------
    problem : Problem
        With any contact law.
    starts : int, optional
        Number of starts (200 where slides are exact, else 50); a basin of share s is missed with probability
        (1 - s)^starts.

    Raises
    ------
    SimulationError
        A law without exact slides cannot be integrated from one of the starts.
    UsageError
        There is no start.

    Examples
    --------
    >>> found = coexisting(Problem(0.44, 0.2, mu=3.0), starts=20)
    >>> sorted(attractor.state.period_cycles for attractor in found)
    [3]
    """
    if starts is None:
        starts = STARTS if problem.law.is_exact else NUMERIC_STARTS
    if starts < 1:
        raise UsageError(f"all steady states: starts; expected at least 1; got {starts}")
    first = steady_state(problem)
    if not problem.weakens or first.outcome == "unbounded":
        return (Attractor(first, 1.0),)
    groups: list[tuple[SteadyState, int]] = []
    for state in _settled(problem, first, starts):
        place = next((i for i, (known, _) in enumerate(groups) if _is_same(known, state)), None)
        if place is None:
            groups.append((state, 1))
        else:
            groups[place] = (groups[place][0], groups[place][1] + 1)
    groups.sort(key=lambda group: -group[1])
    alone = [replace(state, notes=state.notes & ~OF_REST) if state.orbit is not None else state for state, _ in groups]
    return tuple(Attractor(state, count / starts) for state, (_, count) in zip(alone, groups, strict=True))


def _settled(problem: Problem, first: SteadyState, starts: int) -> Iterator[SteadyState]:
    """What the motion from each start settles on."""
    reach = 2.0 * max(1.0, first.response_amplitude or 0.0)
    places = [tuple(reach * (2.0 * ((0.5 + step * number) % 1.0) - 1.0) for step in GOLDEN) for number in range(starts)]
    if not problem.law.is_exact and starts >= WORTH_COMPILING:
        warm_up(problem.law.name)
    flow, looks = flow_of(problem), LOOKS  # for all starts together
    for x, v in places:
        state, looks = flow.steady_from(x, v, looks)
        yield state


def _is_same(one: SteadyState, other: SteadyState) -> bool:
    """Whether two steady states are one: same period, energy and amplitude; rest is one wherever the mass rests."""
    if (one.outcome, one.period_cycles) != (other.outcome, other.period_cycles):
        return False
    if one.outcome != "periodic":
        return True
    pairs = ((one.energy_per_cycle, other.energy_per_cycle), (one.response_amplitude, other.response_amplitude))
    return all(abs((a or 0.0) - (b or 0.0)) <= SAME * max(abs(a or 0.0), abs(b or 0.0)) for a, b in pairs)
