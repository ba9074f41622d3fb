"""The steady state of a rigid contact, solved for by exact phases; and the last of a number of cycles from rest."""

from dataclasses import replace
from math import hypot, pi
from typing import Any

from frictionlab.errors import SimulationError
from frictionlab.simulator import engine as engines
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.last import SETTLED
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.state import Regime, SteadyState, from_numbers
from frictionlab.simulator.thesis import ThesisRun, thesis_run
from frictionlab.simulator.trajectory import from_record, refuse_chatter, simulate_exactly

__all__ = ["last", "steady", "waited"]

CLOSED = {"auto": 0, "closed-form": 1, "exact": -1}


def steady(problem: Problem, solver: str = "auto") -> SteadyState:
    """Return the steady state: the closed form where it is valid ("auto", "closed-form"), else the orbit shot for."""
    engine = engines.choose(10.0 + 4.0 / problem.r)
    rig, force = engines.set_up(engine, problem)
    row = engine.zeros(layout.ROW)
    phases = 32 + int(8 * (problem.base.harmonics + 1.0 / problem.r))
    while True:
        room = engines.make_room(engine, problem, phases)
        if engine is engines.plain():
            room.meter[0] = engines.hand_over_after()
        engine.kernel.steady(rig, force, CLOSED[solver], room, row)
        if row[layout.OUTCOME] == layout.COSTLY and engine is engines.plain():
            engine = engines.compiled()
            rig, force = engines.set_up(engine, problem)
            row = engine.zeros(layout.ROW)
            continue
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


def last(problem: Problem, cycles: int) -> SteadyState:
    """Return the last of a number of cycles from rest as if it were steady."""
    run = simulate_exactly(problem, cycles=cycles, x0=0.0, v0=0.0, tau0=0.0, keep=1)
    engine = engines.choose(0.0)
    rig, force = engines.set_up(engine, problem)
    room = engines.make_room(engine, problem, len(run.side))
    row = engine.zeros(layout.ROW)
    start, leg = (float(run.displacement[0]), float(run.velocity[0])), layout.Leg(float(run.tau[0]), 2.0 * pi, 1.0, 1.0)
    end_z, end_v, _ = engine.kernel.carry(rig, force, leg, *start, room)
    engine.kernel.account(rig, force, room)
    engine.kernel.fill_row(rig, force, leg, room, engine.kernel.spectral_radius(room.jacobian), row)
    put_in = room.tally[layout.WORK] - room.tally[layout.CONTACT] - room.tally[layout.VISCOUS]
    path, miss = float(room.tally[layout.PATH]), hypot(end_z - start[0], problem.r * (end_v - start[1]))
    row[layout.OUTCOME] = layout.PERIODIC if path > 0.0 else layout.STUCK
    row[layout.MISS], row[layout.CLOSED_FORM] = miss, 0.0
    row[layout.ENERGY] += put_in  # the energy put in: the area of the loop (2.18), which measurement and thesis report
    row[layout.SYMMETRIC] = engine.kernel.mirrored(rig, force, room)
    state = from_numbers(problem, row, run)
    settled = miss <= SETTLED * (hypot(*start) + path)
    if settled:
        return state
    unknown: dict[str, Any] = {"symmetric": None, "period_cycles": None, "floquet_multiplier": None, "notes": 0}
    return replace(state, outcome="not settled", **unknown)


def waited(problem: Problem, cycles: int) -> SteadyState:
    """Return what the thesis's method says after a number of cycles from rest."""
    return _from_thesis(thesis_run(problem, cycles=cycles))


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
        energy_taken=run.energy_input,
        response_amplitude=amplitude,
        stops_per_cycle=float(run.stops),
        stuck_fraction=run.stuck_time / (2.0 * pi),
        regime=regime,
        period_cycles=1 if settled else None,
        closure_error=abs(run.energy_input - run.energy_dissipated),
        residual=run.drift,
    )
