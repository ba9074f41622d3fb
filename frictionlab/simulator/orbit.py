"""The steady state, solved for instead of waited for; the motion from initial conditions, and its last cycle."""

from dataclasses import replace
from math import hypot, isfinite, pi
from typing import Any, get_args

from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator import engine as engines
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.state import Regime, Solver, SteadyState, from_numbers
from frictionlab.simulator.thesis import ThesisRun, thesis_run
from frictionlab.simulator.trajectory import Trajectory, from_record, refuse_chatter, simulate_exactly

__all__ = ["last_cycle", "simulate", "steady_state"]

CLOSED = {"auto": 0, "closed-form": 1, "exact": -1}
LARGEST = 1e100  # initial condition: its square must be a double
SETTLED = 1e-6  # a cycle repeats if its end misses its start by less than this share of its size


def steady_state(problem: Problem, *, solver: Solver = "auto") -> SteadyState:
    """Return the steady state of a problem.

    The periodic orbit is solved for by shooting with exact phases, half a period where the drive's symmetry allows; the
    closed form of Den Hartog (2.10-2.14) answers where it is valid.

    Parameters
    ----------
    problem : Problem
        What moves.
    solver : {"auto", "closed-form", "exact", "thesis"}
        "auto" takes the closed form where it is valid and the exact orbit elsewhere; "thesis" waits for 100 cycles from
        rest with RK45 at its default tolerances (`last_cycle`, `thesis_run`).

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
    if solver == "thesis":
        return last_cycle(problem, cycles=100, solver="thesis")
    if solver == "numeric":
        raise UsageError("steady state: solver; 'numeric' is not there yet for this law")
    engine = engines.choose(10.0 + 4.0 / problem.r)
    rig, force = engines.set_up(engine, problem)
    row = engine.buffer((0.0,) * layout.ROW)
    phases = 32 + int(8 * (problem.base.harmonics + 1.0 / problem.r))
    while True:
        room = engines.make_room(engine, problem, phases)
        engine.kernel.steady(rig, force, CLOSED[solver], room, row)
        count = int(room.tally[layout.PHASES])
        if row[layout.OUTCOME] != layout.OVERFULL:
            return _from_row(problem, solver, row, room, count)
        phases = count


def _from_row(problem: Problem, solver: str, row: Any, room: Any, count: int) -> SteadyState:
    """Turn the kernel's row of numbers into a steady state with its orbit, or into an error."""
    code = int(row[layout.OUTCOME])
    if code == layout.CHATTERED:
        refuse_chatter(problem, layout.CHATTER, float(row[layout.START]), row[layout.START_Z], row[layout.START_V])
    if solver == "closed-form" and code == layout.NOT_FOUND:
        raise SimulationError(
            f"steady state: closed form at r = {problem.r!r}, beta = {problem.beta!r}; expected continuous motion of "
            "an undamped mass under a pure cosine (2.10); got stops, damping or harmonics; do: use solver 'exact'"
        )
    moved = code in (layout.PERIODIC, layout.STUCK)
    mirror = bool(row[layout.SIGN] < 0.0)
    return from_numbers(
        problem, row, from_record(problem, room.phases, count, periodic=True, mirror=mirror) if moved else None
    )


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
    if not (abs(x0) <= LARGEST and abs(v0) <= LARGEST and isfinite(tau0)):
        raise SimulationError(
            f"simulate: initial conditions; expected finite numbers of size up to {LARGEST:g}; "
            f"got x0 = {x0}, v0 = {v0}, tau0 = {tau0}"
        )
    return simulate_exactly(
        problem, cycles=cycles, x0=x0, v0=v0, tau0=tau0 % (2.0 * pi), keep=cycles if keep is None else keep
    )


def last_cycle(problem: Problem, *, cycles: int, solver: Solver = "exact") -> SteadyState:
    """Return the last of a number of cycles from rest as if it were steady, and say if it is not: "not settled".

    Parameters
    ----------
    problem : Problem
        What moves.
    cycles : int
        Cycles of the drive; >= 1.
    solver : {"exact", "auto", "thesis"}
        Exact phases, or the thesis's RK45 at its default tolerances.

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
    if solver == "thesis":
        return _from_thesis(thesis_run(problem, cycles=cycles))
    run = simulate(problem, cycles=cycles, solver=solver, keep=1)
    engine = engines.choose(0.0)
    rig, force = engines.set_up(engine, problem)
    room = engines.make_room(engine, problem, len(run.side))
    row = engine.buffer((0.0,) * layout.ROW)
    start, leg = (float(run.displacement[0]), float(run.velocity[0])), layout.Leg(float(run.tau[0]), 2.0 * pi, 1.0, 1.0)
    end_z, end_v, _ = engine.kernel.carry(rig, force, leg, *start, room)
    engine.kernel.account(rig, force, room)
    engine.kernel.fill_row(rig, force, leg, room, row)
    put_in = room.tally[layout.WORK] - problem.beta * room.tally[layout.LOADED] - room.tally[layout.VISCOUS]
    path, miss = float(room.tally[layout.PATH]), hypot(end_z - start[0], problem.r * (end_v - start[1]))
    row[layout.OUTCOME] = layout.PERIODIC if path > 0.0 else layout.STUCK
    row[layout.MISS], row[layout.CLOSED_FORM] = miss, 0.0
    row[layout.ENERGY] += put_in  # the energy put in: the area of the loop (2.18), which measurement and thesis report
    row[layout.SYMMETRIC] = engine.kernel.mirrored(rig, force, *start, engines.make_room(engine, problem, 0))
    state = from_numbers(problem, row, run)
    settled = miss <= SETTLED * (hypot(*start) + path)
    if settled:
        return state
    unknown: dict[str, Any] = {"symmetric": None, "period_cycles": None, "floquet_multiplier": None, "warnings": ()}
    return replace(state, outcome="not settled", **unknown)


def _from_thesis(run: ThesisRun) -> SteadyState:
    """Return the numbers of the thesis's last cycle; its energy is the one put in (2.16)."""
    z = run.displacement
    amplitude = 0.5 * float(z.max() - z.min())
    moved = bool(amplitude > 0.0)
    settled = run.drift <= SETTLED * (1.0 + amplitude)
    regime: Regime = ("stick-slip" if run.stops else "continuous") if moved else "stuck"
    return SteadyState(
        problem=run.problem,
        solver="thesis",
        outcome=("periodic" if settled else "not settled") if moved else "stuck",
        energy_per_cycle=run.energy_input,
        response_amplitude=amplitude,
        stops_per_cycle=float(run.stops),
        stuck_fraction=run.stuck_time / (2.0 * pi),
        regime=regime,
        period_cycles=1 if settled else None,
        closure_error=abs(run.energy_input - run.energy_dissipated),
        residual=run.drift,
    )
