"""The steady state, solved for instead of waited for; and the motion from given initial conditions."""

from dataclasses import dataclass
from math import isfinite, pi
from typing import Any, Literal, get_args

from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator import engine as engines
from frictionlab.simulator.kernel import layout as kernel
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.trajectory import Trajectory, from_record, simulate_exactly

__all__ = ["Outcome", "Solver", "SteadyState", "simulate", "steady_state"]

Solver = Literal["auto", "closed-form", "exact"]
Outcome = Literal["periodic", "stuck", "unbounded", "not settled", "not found"]
Regime = Literal["continuous", "stick-slip", "stuck"]

OUTCOMES: dict[int, Outcome] = {
    kernel.PERIODIC: "periodic",
    kernel.STUCK: "stuck",
    kernel.UNBOUNDED: "unbounded",
    kernel.NOT_FOUND: "not found",
}
CLOSED = {"auto": 0, "closed-form": 1, "exact": -1}


@dataclass(frozen=True)
class SteadyState:
    """A steady state and what is known about it; numbers that do not exist are None.

    Parameters
    ----------
    problem : Problem
        What moves.
    solver : str
        What answered: "closed-form", "exact" or "thesis".
    outcome : str
        "periodic", "stuck" (never moves), "unbounded" (no steady state), "not settled" or "not found".
    energy_per_cycle : float or None
        Energy dissipated per cycle over k Y^2: friction beta * path, plus the dashpot's (2.18, 3.7).
    response_amplitude : float or None
        (max - min) / 2 of the displacement of the mass over Y.
    stops_per_cycle : float or None
        Sticks of positive duration per cycle (mean over the cycles of the period).
    stuck_fraction : float or None
        Share of the time stuck to the wall, 0 to 1.
    regime : str or None
        "continuous", "stick-slip" or "stuck".
    symmetric : bool or None
        Whether half a cycle later the motion is its own negative.
    period_cycles : int or None
        Length of the period in cycles of the drive.
    floquet_multiplier : float or None
        What a small disturbance is multiplied by in one period: the largest; its modulus if it is complex.
    closure_error : float or None
        |energy put in (2.16) - energy dissipated| per cycle: zero but for rounding.
    residual : float or None
        By how much the state misses itself after one period (z and r z').
    warnings : tuple of str
        Sentences about what the numbers do not say.
    orbit : Trajectory or None
        The motion over one period.
    """

    problem: Problem
    solver: str
    outcome: Outcome
    energy_per_cycle: float | None = None
    response_amplitude: float | None = None
    stops_per_cycle: float | None = None
    stuck_fraction: float | None = None
    regime: Regime | None = None
    symmetric: bool | None = None
    period_cycles: int | None = None
    floquet_multiplier: float | None = None
    closure_error: float | None = None
    residual: float | None = None
    warnings: tuple[str, ...] = ()
    orbit: Trajectory | None = None


def steady_state(problem: Problem, *, solver: Solver = "auto") -> SteadyState:
    """Return the steady state of a problem.

    The periodic orbit is solved for by shooting with exact phases, half a period where the drive's symmetry allows; the
    closed form of Den Hartog (2.10-2.14) answers where it is valid.

    Parameters
    ----------
    problem : Problem
        What moves.
    solver : {"auto", "closed-form", "exact"}
        "auto" takes the closed form where it is valid and the exact orbit elsewhere.

    Returns
    -------
    SteadyState

    Raises
    ------
    SimulationError
        If events do not end, or the closed form is asked for where it does not hold.
    UsageError
        If the solver is not known.

    Examples
    --------
    >>> state = steady_state(Problem(r=0.5, beta=0.4))
    >>> f"{state.energy_per_cycle:.10f}", state.stops_per_cycle
    ('2.1260422664', 2.0)
    """
    if solver not in get_args(Solver):
        raise UsageError(f"steady state: solver; expected one of {', '.join(get_args(Solver))}; got {solver!r}")
    engine = engines.choose(10.0 + 4.0 / problem.r)
    rig, force = engines.set_up(engine, problem)
    row = engine.buffer((0.0,) * kernel.ROW)
    phases = 32 + int(8 * (problem.base.harmonics + 1.0 / problem.r))
    while True:
        room = engines.make_room(engine, problem, phases)
        engine.kernel.steady(rig, force, CLOSED[solver], room, row)
        count = int(room[1][kernel.PHASES])
        if row[kernel.OUTCOME] != kernel.OVERFULL:
            return _from_row(problem, solver, row, room, count)
        phases = count


def _from_row(problem: Problem, solver: str, row: Any, room: Any, count: int) -> SteadyState:
    """Turn the kernel's row of numbers into a steady state with its orbit and verdict."""
    code = int(row[kernel.OUTCOME])
    if code == kernel.CHATTERED:
        raise SimulationError(f"steady state: events without end at {problem}; do: report these numbers")
    if solver == "closed-form" and code == kernel.NOT_FOUND:
        raise SimulationError(
            f"steady state: closed form at r = {problem.r!r}, beta = {problem.beta!r}; expected continuous motion of "
            "an undamped mass under a pure cosine (2.10); got stops, damping or harmonics; do: use solver 'exact'"
        )
    outcome = OUTCOMES[code]
    if outcome in ("unbounded", "not found"):
        return SteadyState(problem, "exact", outcome)
    mirror = row[kernel.SIGN] < 0.0
    return SteadyState(
        problem=problem,
        solver="closed-form" if row[kernel.CLOSED_FORM] else "exact",
        outcome=outcome,
        energy_per_cycle=float(row[kernel.ENERGY]),
        response_amplitude=float(row[kernel.AMPLITUDE]),
        stops_per_cycle=float(row[kernel.STOPS]),
        stuck_fraction=float(row[kernel.STUCK_SHARE]),
        regime=_regime(outcome, row),
        symmetric=bool(row[kernel.SYMMETRIC]),
        period_cycles=int(row[kernel.PERIOD]),
        floquet_multiplier=float(row[kernel.MULTIPLIER]),
        closure_error=float(row[kernel.CLOSURE]),
        residual=float(row[kernel.MISS]),
        orbit=from_record(problem, room[2], count, periodic=True, mirror=mirror),
    )


def _regime(outcome: Outcome, row: Any) -> Regime:
    """Return the regime of a row."""
    if outcome == "stuck":
        return "stuck"
    return "stick-slip" if row[kernel.STOPS] > 0.0 else "continuous"


def simulate(
    problem: Problem,
    *,
    cycles: int,
    x0: float = 0.0,
    v0: float = 0.0,
    tau0: float = 0.0,
    solver: Solver = "exact",
    keep: int | None = None,
) -> Trajectory:
    """Return the motion from initial conditions over a number of cycles, as exact phases.

    Parameters
    ----------
    problem : Problem
        What moves.
    cycles : int
        Cycles of the drive; >= 1.
    x0, v0 : float
        Displacement over Y and its derivative with respect to tau, at tau0.
    tau0 : float
        Phase of the drive at the start, rad.
    solver : {"exact", "auto"}
        Both carry exact phases.
    keep : int, optional
        Record only the last so many cycles (all, unless given): memory for a million cycles.

    Returns
    -------
    Trajectory

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
    if solver not in ("exact", "auto"):
        raise UsageError(f"simulate: solver; expected 'exact' or 'auto'; got {solver!r}")
    if cycles < 1 or not (keep is None or 1 <= keep <= cycles):
        raise UsageError(f"simulate: cycles, keep; expected 1 <= keep <= cycles; got cycles = {cycles}, keep = {keep}")
    if not all(isfinite(number) for number in (x0, v0, tau0)):
        raise SimulationError(f"simulate: initial conditions; expected finite numbers; got {x0}, {v0}, {tau0}")
    return simulate_exactly(
        problem, cycles=cycles, x0=x0, v0=v0, tau0=tau0 % (2.0 * pi), keep=cycles if keep is None else keep
    )
