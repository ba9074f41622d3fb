"""All orbits of one problem: what motions from many starts settle on, and how many of them on each."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from frictionlab.errors import UsageError
from frictionlab.simulator.notes import Note
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.solve import flow_of, steady_state
from frictionlab.simulator.state import SteadyState
from frictionlab.simulator.structure import Structure

SAME = 1e-6  # orbits whose energy and amplitude differ by less, over the largest, are one (mirror images are)
STARTS, FEWER = 200, 50  # of one mass with exact slides, and where each takes a tenth of a second
LOOKS = 2e8  # at slides, from all rigid starts together: some 20 s; what is left of the starts then is "not found"
OF_REST = Note.MAY_COEXIST | Note.MAY_GO_ON


@dataclass(frozen=True)
class Attractor:
    """One steady state, and the share of starts that settle on it.

    Parameters
    ----------
    state : SteadyState
        "periodic", "stuck" (rest anywhere), or "not found": the motion has not repeated within the cycles waited for.
    share : float
        Share of the starts, 0 to 1: displacements and velocities of the masses spread evenly over twice the reach of
        the motion from rest (at least Y and omega Y).
    """

    state: SteadyState
    share: float


def coexisting(problem: Problem | Structure, *, starts: int | None = None) -> tuple[Attractor, ...]:
    """Return the steady states that motions from many starts settle on, the most visited one first.

    Where friction neither falls from rest nor with speed, nor varies along the path, there is one and no search is
    made; else orbits may coexist, repeat after several cycles, or not at all.

    Parameters
    ----------
    problem : Problem or Structure
        With any contact laws.
    starts : int, optional
        Number of starts (200 of one mass where slides are exact, else 50); a basin of share s is missed with
        probability (1 - s)^starts.

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
        starts = STARTS if isinstance(problem, Problem) and problem.is_exact else FEWER
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


def _settled(problem: Problem | Structure, first: SteadyState, starts: int) -> Iterator[SteadyState]:
    """What the motion from each start settles on: starts step by the golden ratio of their space, evenly."""
    flow, looks = flow_of(problem), LOOKS  # for all starts together
    size = 2 * flow.masses
    golden = np.abs(np.roots([1.0, *np.zeros(size - 1), -1.0, -1.0])).max()  # of x^(d + 1) = x + 1
    reach = 2.0 * np.maximum(1.0, first.response_amplitudes or (first.response_amplitude or 0.0,))
    for number in range(starts):
        shares = 2.0 * ((0.5 + number * golden ** -np.arange(1.0, size + 1.0)) % 1.0) - 1.0
        state, looks = flow.steady_from(reach * shares[: size // 2], reach * shares[size // 2 :], looks)
        yield state


def _is_same(one: SteadyState, other: SteadyState) -> bool:
    """Whether two steady states are one: same period, energy and amplitude; rest is one wherever the mass rests."""
    if (one.outcome, one.period_cycles) != (other.outcome, other.period_cycles):
        return False
    if one.outcome != "periodic":
        return True
    pairs = [(one.energy_per_cycle, other.energy_per_cycle), (one.response_amplitude, other.response_amplitude)]
    pairs += zip(one.response_amplitudes, other.response_amplitudes, strict=True)
    return all(abs((a or 0.0) - (b or 0.0)) <= SAME * max(abs(a or 0.0), abs(b or 0.0)) for a, b in pairs)
