"""A sampled base motion in, the motion of the mass out: exact between samples, event by event, where the law allows."""

import functools
from dataclasses import dataclass
from math import pi, sqrt
from types import ModuleType
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator import engine as engines
from frictionlab.simulator.elastic.sliders import sliders_of
from frictionlab.simulator.engine import Engine
from frictionlab.simulator.laws import Law
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record import layout, piece, travel
from frictionlab.simulator.record.base import BaseRecord, wall_of
from frictionlab.simulator.record.response import Response

MODULES: tuple[ModuleType, ...] = (piece, travel)
FOLLOWED = ("coulomb", "place", "speed", "breakaway", "compliance", "iwan")  # terms with exact phases here
FINE = 16.0  # steps per unit of the fastest phase's time
MOST_CYCLES = 1e7  # natural periods: half a minute of compiled work that nothing interrupts
WORTH_LOADING = 5e4  # steps; in plain Python they take about as long (1 s) as loading the compiled kernel
WORTH_COMPILING = 5e5  # the same for compiling it, once per machine and version


def respond(problem: Problem, base: BaseRecord, *, x0: float = 0.0, v0: float = 0.0) -> Response:
    """Simulate the mass under a sampled motion of the base.

    Between samples the base is a polynomial and the mass, between events, a linear oscillator: its motion is a closed
    form, and what interpolation makes of the samples is the only approximation (README, "How good"). Laws without exact
    phases are integrated by the numeric engine, piece by piece.

    Parameters
    ----------
    problem : Problem
        With r = 1: time is counted in omega_n t. Its own periodic base is not used. `beta` is over k times the
        record's scale Y.
    base : BaseRecord
    x0, v0 : float
        Displacement (over Y, from where the spring is relaxed) and velocity dx/dtau of the mass at the first sample.

    Raises
    ------
    SimulationError
        r is not 1, the record lasts too long, an acceleration is to drive against a fixed wall, friction would have to
        be negative or to outgrow the spring, events do not end, or the law is too stiff to be integrated.

    Examples
    --------
    >>> import numpy as np
    >>> tau = np.linspace(0.0, 40.0, 2001)
    >>> response = respond(Problem(1.0, beta=0.4), BaseRecord(tau, 1.0 - np.cos(0.5 * tau)))
    >>> response.stops, round(response.energy, 3)
    (6, 2.442)
    """
    if problem.r != 1.0:
        raise SimulationError(
            f"simulation of a record: r; expected 1 (time is counted in omega_n t); got {problem.r!r}"
        )
    cycles = float(base.time[-1] - base.time[0]) / (2.0 * pi)
    if not cycles <= MOST_CYCLES:
        raise SimulationError(
            f"simulation of a record: it lasts {cycles:.3g} natural periods; expected at most {MOST_CYCLES:g}: are its "
            "stamps in seconds?"
        )
    if not _is_exact(problem.law):
        from frictionlab.simulator.record.integrate import integrate  # noqa: PLC0415 - numba, for such laws alone

        return integrate(problem, base, (x0, v0))
    wall, fine = wall_of(problem, base), _steps_per_rad(problem)
    engine = choose(_steps(base, fine))
    start = (x0 - float(base.values[0]), v0 - float(base.speeds[0])) if wall == 1.0 else (x0, v0)
    run = _run(engine, problem, base, fine, start, 256 + len(base.time) // 64)
    if run.count > len(run.events) // layout.EVENT:
        run = _run(engine, problem, base, fine, start, run.count)
    _refuse_negative_friction(problem, run)
    return _response(problem, base, run)


def prepare(problem: Problem, base: BaseRecord, runs: int) -> None:
    """Load the compiled kernel if so many responses are worth it; it changes nothing but their time."""
    if _is_exact(problem.law):
        choose(runs * _steps(base, _steps_per_rad(problem)))


def _steps_per_rad(problem: Problem) -> float:
    """How many steps a rad is parted into at least: by the fastest phase."""
    damping = problem.frame_damping_ratio + problem.zeta
    return FINE * max(1.0, sqrt(_stiffest(problem)), 2.0 * damping)


def _steps(base: BaseRecord, fine: float) -> float:
    return float(base.time[-1] - base.time[0]) * fine + len(base.time)


def choose(steps: float) -> Engine:
    """Return the engine for about so many steps: plain Python where loading the compiled kernel would take longer."""
    folder = engines.machine_code_folder(layout, MODULES)
    if compiled.cache_info().currsize or steps > WORTH_COMPILING:
        return compiled()
    return compiled() if steps > WORTH_LOADING and any(folder.glob("**/*.nbi")) else plain()


@functools.cache
def plain() -> Engine:
    """Return the record kernel as plain Python."""
    return engines.as_it_stands(MODULES)


@functools.cache
def compiled() -> Engine:
    """Return the record kernel compiled by numba."""
    return engines.compile_modules(layout, MODULES)


@dataclass(frozen=True)
class _Run:
    """What the kernel has left in its buffers; `start`: z and v at the first sample."""

    start: tuple[float, float]
    sliders: layout.RecordSliders
    state: Any
    tally: Any
    motion: tuple[Any, Any, Any]
    events: Any

    @property
    def count(self) -> int:
        return int(self.tally[layout.EVENTS])


def _run(
    engine: Engine, problem: Problem, base: BaseRecord, fine: float, start: tuple[float, float], events: int
) -> _Run:
    """Let the kernel travel through the record from a start z, v, with space for a number of events."""
    n, none = len(base.time), [0.0] * len(_springs(problem)[0])
    sliders = layout.RecordSliders(*(_column(engine, np.array(c)) for c in (*_springs(problem), none, none)))
    sizes = (layout.STATE, layout.TALLY, layout.FREE, layout.EVENT * events, n, n, n)
    state, tally, free, record, *motion = (_column(engine, np.zeros(size)) for size in sizes)
    samples = tuple(_column(engine, column) for column in (base.time, base.values, base.speeds))
    state[layout.Z], state[layout.V] = start
    contact = problem.beta, problem.parameter("gradient"), *problem.static_ratios
    rig = layout.RecordRig(problem.frame_damping_ratio, problem.zeta, *contact, wall_of(problem, base))
    steps = base.step, fine
    reached = engine.kernel.travel(rig, sliders, state, tally, record, samples, steps, tuple(motion), free)
    if reached < n - 1:
        raise SimulationError(
            f"simulation: events without end at tau = {base.time[reached]!r}: law {problem.law.name}, parameters "
            f"{problem.parameters}; expected some per sample; got more, last z = {state[layout.Z]!r}, v = "
            f"{state[layout.V]!r}; do: report these numbers"
        )
    return _Run(start, sliders, state, tally, (motion[0], motion[1], motion[2]), record)


def _column(engine: Engine, values: FloatArray) -> Any:
    """An array as the engine's kind of buffer; not copied where arrays are that."""
    return values.tolist() if engine.buffer is list else values


def _springs(problem: Problem) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Stiffness and slip force of each elastic slider; none: rigid."""
    return sliders_of(problem) if problem.law.kind == "elastic" else ((), ())


def _is_exact(law: Law) -> bool:
    """Whether all phases of a law are exact under a sampled base."""
    return all(term.name in FOLLOWED for term in law.terms)


def _stiffest(problem: Problem) -> float:
    """The largest stiffness of a phase over k.

    Raises
    ------
    SimulationError
        The smallest one is not positive: the friction outgrows the spring.
    """
    change = problem.beta * abs(problem.parameter("gradient"))
    if change >= 1.0:
        raise SimulationError(
            f"simulation of a record: beta * |gradient|; expected less than 1; got {change:g}: friction changes along "
            "the path faster than the spring's force, and the mass would run away"
        )
    return 1.0 + change + sum(_springs(problem)[0])


def _refuse_negative_friction(problem: Problem, run: _Run) -> None:
    gradient = problem.parameter("gradient")
    low, high = run.tally[layout.LOW], run.tally[layout.HIGH]
    least = 1.0 + min(gradient * low, gradient * high)
    if least < 0.0:
        raise SimulationError(
            f"simulation of a record: 1 + gradient z; expected never below 0; got {least:.3g} with gradient = "
            f"{gradient:g} and z from {low:.3g} to {high:.3g}; do: give a smaller gradient"
        )


def _stored(problem: Problem, run: _Run) -> float:
    """Energy in the sliders' springs at the end, over k Y^2."""
    total, z, side = 0.0, float(run.state[layout.Z]), float(run.state[layout.SIDE])
    for stiff, limit, anchor, slips in zip(*run.sliders, strict=True):
        force = side * limit * (1.0 + problem.parameter("gradient") * z) if slips else stiff * (z - anchor)
        total += 0.5 * force * force / stiff
    return total


def _response(problem: Problem, base: BaseRecord, run: _Run) -> Response:
    tally, state = run.tally, run.state
    x, v, n = (np.asarray(column, dtype=np.float64) for column in run.motion)
    work, squared = float(tally[layout.FRICTION_WORK]), float(tally[layout.SQUARED_SPEED])
    friction, zeta_c, zeta_f = work - _stored(problem, run), problem.zeta, problem.frame_damping_ratio
    frame = squared if problem.wall == "base" else float(tally[layout.SQUARED_FRAME_SPEED])
    gained = 0.5 * float(state[layout.Z] ** 2 + state[layout.V] ** 2 - run.start[0] ** 2 - run.start[1] ** 2)
    put_in = float(tally[layout.INPUT])
    if wall_of(problem, base) == 1.0:
        x, v = x + base.values, v + base.speeds
    return Response(
        problem=problem,
        base=base,
        displacement=x,
        velocity=v,
        contact_force=n,
        events=np.array(run.events[: layout.EVENT * run.count], dtype=np.float64).reshape(-1, layout.EVENT),
        energy=friction + 2.0 * zeta_c * squared + 2.0 * zeta_f * frame,
        friction_energy=friction,
        energy_input=put_in,
        closure_error=abs(put_in - work - 2.0 * (zeta_f + zeta_c) * squared - gained),
        path=float(tally[layout.PATH]),
        stops=int(tally[layout.STOPS]),
        time_stuck=float(tally[layout.STUCK_TIME]),
    )
