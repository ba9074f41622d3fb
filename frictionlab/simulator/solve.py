"""The four questions to the simulator, and which solver answers: a steady state, all of them, a motion, its last cycle.

Of all steady states it is what motions from many starts settle on, and how many of them on each.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import hypot, isfinite, pi
from typing import Any, get_args

import numpy as np

from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator.motion import Motion
from frictionlab.simulator.notes import Note
from frictionlab.simulator.problem import Meter, Problem
from frictionlab.simulator.state import SETTLED, Outcome, Solver, SteadyState, numbers_of
from frictionlab.simulator.structure import Structure
from frictionlab.simulator.thesis import thesis_run

ANSWERS: dict[str, tuple[str, ...]] = {  # kind of a law: the solvers that know it
    "rigid": get_args(Solver),
    "elastic": ("auto", "exact"),
    "smooth": ("auto", "numeric"),
    "inner": ("auto", "numeric"),
}
LARGEST = 1e100  # initial condition: its square must be a double
MOST_CYCLES = 10_000_000  # half a minute of compiled work that nothing interrupts
SAME = 1e-6  # orbits whose energy and amplitude differ by less, over the largest, are one (mirror images are)
STARTS, FEWER = 200, 50  # of one mass with exact slides, and where each takes a tenth of a second
TOGETHER = 2e8  # looks at slides of all rigid starts: some 20 s; what is left of the starts then is "not found"
OF_REST = Note.MAY_COEXIST | Note.MAY_GO_ON


def steady_state(
    problem: Problem | Structure,
    *,
    solver: Solver = "auto",
    near: SteadyState | None = None,
    meter: Meter | None = None,
) -> SteadyState:
    """Return the steady state of a problem, or of a structure of several masses.

    The periodic orbit is solved for by shooting with exact phases, half a period where the drive's symmetry allows; the
    closed form of Den Hartog (2.10-2.14) answers where it is valid. Laws without exact phases are integrated.

    Parameters
    ----------
    problem : Problem or Structure
        What moves.
    solver : {"auto", "closed-form", "exact", "numeric", "thesis"}
        "auto" takes the closed form where it is valid, else exact phases where the law has them, else integrates;
        "thesis" waits for 100 cycles from rest with RK45 at its default tolerances (`last_cycle`, `thesis_run`).
    near : SteadyState, optional
        Of a law without exact slides: that of a problem close by, at whose orbit the search starts. Where motions
        coexist, the answer is then the neighbour's branch, not the one that rest settles on.
    meter : Meter, optional
        What a search of many steady states may still spend: this one's work is taken from it.

    Returns
    -------
    SteadyState

    Raises
    ------
    SimulationError
        If events do not end, friction turns into a pull on the way, the law cannot be integrated, rigid contacts hold a
        mass twice over, or the closed form is asked for where it does not hold.
    UsageError
        If the solver is not known, or does not know the law.
    OverspentError
        Nothing is left on the meter.

    Examples
    --------
    >>> state = steady_state(Problem(r=0.5, beta=0.4))
    >>> f"{state.energy_per_cycle:.10f}", state.stops_per_cycle
    ('2.1260422664', 2.0)
    """
    _check_solver(problem, solver)
    if isinstance(problem, Problem) and solver == "thesis":
        return last_cycle(problem, cycles=100, solver="thesis")
    state: SteadyState = flow_of(problem, solver).steady(solver, near=near, meter=meter)
    return state


def _check_solver(problem: Problem | Structure, solver: str) -> None:
    """Refuse a solver that does not exist, or does not know the law."""
    able: tuple[str, ...] = ("auto",)
    what = "several masses, of which the laws say what solves them"
    if isinstance(problem, Problem):
        able, what = ANSWERS[problem.law.kind], f"law {problem.law.name}"
    if solver not in able:
        raise UsageError(f"steady state: solver {solver!r} does not know {what}; expected one of {', '.join(able)}")


def flow_of(problem: Problem | Structure, solver: str = "auto") -> Any:
    """Return the flow that carries a motion, the exact or the integrated one, loaded when it is asked for."""
    if problem.is_exact and solver != "numeric":
        from frictionlab.simulator.exact.solve import Flow  # noqa: PLC0415 - half a second to load

        return Flow(problem)
    from frictionlab.simulator.numeric.integrated import Integrated  # noqa: PLC0415 - as above

    return Integrated(problem)


def simulate(
    problem: Problem | Structure,
    *,
    cycles: int,
    x0: float = 0.0,
    v0: float = 0.0,
    tau0: float = 0.0,
    solver: Solver = "auto",
    keep: int | None = None,
) -> Motion:
    """Return the motion from initial conditions over a number of cycles, as exact phases.

    Parameters
    ----------
    problem : Problem or Structure
        What moves.
    cycles : int
        Cycles of the drive; >= 1.
    x0, v0 : float
        Displacement over Y of the first mass and its derivative with respect to tau, at tau0; others are at rest.
    tau0 : float
        Phase of the drive at the start, rad.
    solver : {"auto", "exact", "numeric"}
        "auto" takes exact phases where the law has them.
    keep : int, optional
        Record only the last so many cycles (all, unless given): memory for a million cycles.

    Returns
    -------
    Motion
        As exact phases where the law has them.

    Raises
    ------
    SimulationError
        If events do not end.
    UsageError
        If the arguments contradict each other.

    Examples
    --------
    >>> simulate(Problem(r=0.5, beta=0.4), cycles=3).stops.shape
    (4, 2)
    """
    if solver not in ("auto", "exact", "numeric"):
        raise UsageError(f"simulate: solver; expected 'auto', 'exact' or 'numeric'; got {solver!r}")
    _check_solver(problem, solver)
    if cycles < 1 or not (keep is None or 1 <= keep <= cycles):
        raise UsageError(f"simulate: cycles, keep; expected 1 <= keep <= cycles; got cycles = {cycles}, keep = {keep}")
    if not (abs(x0) <= LARGEST and abs(v0) <= LARGEST and isfinite(tau0)):
        raise SimulationError(
            f"simulate: initial conditions; expected finite numbers of size up to {LARGEST:g}; "
            f"got x0 = {x0}, v0 = {v0}, tau0 = {tau0}"
        )
    begin = {"x0": x0, "v0": v0, "tau0": tau0 % (2.0 * pi)}
    motion: Motion = flow_of(problem, solver).run(cycles=cycles, keep=keep or cycles, **begin)
    return motion


def last_cycle(problem: Problem, *, cycles: int, solver: Solver = "auto") -> SteadyState:
    """Return the last of a number of cycles from rest as if it were steady, and say if it is not: "not settled".

    Parameters
    ----------
    problem : Problem
        What moves.
    cycles : int
        Cycles of the drive; 1 to `MOST_CYCLES`.
    solver : {"auto", "exact", "numeric", "thesis"}
        Exact phases, steps where the law has none, or the thesis's RK45 at its default tolerances.

    Raises
    ------
    SimulationError
        If events do not end.
    UsageError
        If the solver cannot carry a motion from rest.

    Examples
    --------
    >>> last_cycle(Problem(r=0.95, beta=0.1), cycles=100).outcome
    'not settled'
    """
    _check_solver(problem, solver)
    if not 1 <= cycles <= MOST_CYCLES:
        raise UsageError(f"last cycle: cycles; expected 1 to {MOST_CYCLES}; got {cycles}")
    if solver == "thesis":
        return thesis_run(problem, cycles=cycles)
    motion = flow_of(problem, solver).run(cycles=cycles, keep=1)
    numbers = numbers_of(motion)
    x, v = (values.tolist() for values in motion.at([motion.start, motion.end]))
    drift = hypot(x[1] - x[0], problem.r * (v[1] - v[0]))
    settled = drift <= SETTLED * (hypot(x[0], v[0]) + 2.0 * numbers["response_amplitude"])
    outcome: Outcome = "stuck" if numbers["regime"] == "stuck" else "periodic" if settled else "not settled"
    period = 1 if settled else None
    return SteadyState(problem, motion.solver, outcome, period_cycles=period, residual=drift, **numbers)


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
    flow, looks = flow_of(problem), TOGETHER
    size = 2 * flow.masses
    golden = np.abs(np.roots([1.0, *np.zeros(size - 1), -1.0, -1.0])).max()  # of x^(d + 1) = x + 1
    reach = 2.0 * np.maximum(1.0, first.response_amplitudes or (first.response_amplitude or 0.0,))
    for number in range(starts):
        shares = 2.0 * ((0.5 + number * golden ** -np.arange(1.0, size + 1.0)) % 1.0) - 1.0
        start = flow.rest(reach * shares[: size // 2], reach * shares[size // 2 :])
        found = flow.solved(start, waits=True, left=looks)
        looks -= found.spent
        yield flow.state_of(found)


def _is_same(one: SteadyState, other: SteadyState) -> bool:
    """Whether two steady states are one: same period, energy and amplitude; rest is one wherever the mass rests."""
    if (one.outcome, one.period_cycles) != (other.outcome, other.period_cycles):
        return False
    if one.outcome != "periodic":
        return True
    pairs = [(one.energy_per_cycle, other.energy_per_cycle), (one.response_amplitude, other.response_amplitude)]
    pairs += zip(one.response_amplitudes, other.response_amplitudes, strict=True)
    return all(abs((a or 0.0) - (b or 0.0)) <= SAME * max(abs(a or 0.0), abs(b or 0.0)) for a, b in pairs)
