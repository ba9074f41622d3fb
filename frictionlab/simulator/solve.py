"""The three questions to the simulator, and which solver answers: steady state, motion from a start, its last cycle."""

from math import isfinite, pi
from typing import Any, get_args

from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator.motion import Motion
from frictionlab.simulator.problem import Meter, Problem
from frictionlab.simulator.state import Solver, SteadyState, last_of
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
    return last_of(flow_of(problem, solver).run(cycles=cycles, keep=1))
