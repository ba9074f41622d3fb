"""The two verbs: the steady state solved for, and the motion from initial conditions."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import isfinite, pi
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator.meter import STATE, Meter
from frictionlab.simulator.notes import COARSE, SLOW, Note
from frictionlab.simulator.numeric import layout, machine, shooting
from frictionlab.simulator.numeric.machine import Machine, machine_of
from frictionlab.simulator.numeric.motion import NumericMotion
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.state import Regime, SteadyState

__all__ = ["RTOL", "run", "steady", "steady_from"]

TURN = 2.0 * pi
RTOL = 1e-8
FINEST, COARSEST = 1e-12, 1e-3
TIGHTEN, TIGHTER = 0.03, 2  # where the two energies differ by more than the tolerance: how much finer, how many times
CLOSED, SMALLEST = 1e-9, 1e-15  # and what is always good enough, over the energy and over k Y^2
REFINING = 14  # periods' steps that an orbit by finer steps takes: it may cost half of what the search may
HIDDEN = 0.1  # and one above which the energy is not known at all
MOST = 200_000  # steps of a search for a steady state: some seconds; a run of many cycles may take more
HINT = 2_000  # steps that plain Python may try where the compiled kernel is a second away
Floats = NDArray[np.float64]
Result = TypeVar("Result")


def steady(
    problem: Problem, *, rtol: float = RTOL, near: SteadyState | None = None, meter: Meter | None = None
) -> SteadyState:
    """Return the steady state of a law without exact slides.

    Parameters
    ----------
    problem : Problem
        What moves; any law of kind "smooth" or "inner" (and plain friction with place and dashpots).
    rtol : float
        Tolerance of the polynomial of each step, over the size of each component; 1e-12 to 1e-3. Where the two
        energies differ by more, steps are made finer, twice at most.
    near : SteadyState, optional
        A steady state of this solver of a problem close by: its orbit is where the search starts. Where motions
        coexist, the answer is then the neighbour's branch, not the one that rest settles on.
    meter : Meter, optional
        What a search of many steady states may still spend: this one's steps are taken from it.

    Raises
    ------
    SimulationError
        The law cannot be integrated with these parameters, or friction turns negative on the way.
    UsageError
        `rtol` is out of its range.
    OverspentError
        Nothing is left on the meter.

    Examples
    --------
    >>> from frictionlab.simulator import Problem
    >>> law = {"static_ratio": 1.2, "stribeck_speed": 0.1}
    >>> state = steady(Problem(r=0.5, beta=0.4, law="coulomb+stribeck", parameters=law))
    >>> round(state.energy_per_cycle, 6), state.stops_per_cycle
    (2.172182, 2.0)
    """
    _check(rtol)
    if _is_unbounded(problem):
        return SteadyState(problem, "numeric", "unbounded")
    start = near.orbit.state(0.0) if near is not None and isinstance(near.orbit, NumericMotion) else None
    return _with_means(problem, rtol, lambda means: _steady(problem, means, start), MOST, meter)


def steady_from(problem: Problem, x0: float, v0: float) -> SteadyState:
    """Return what the motion from a displacement over Y and its rate, at tau = 0 and the contact unloaded, settles on.

    Raises
    ------
    SimulationError
        The law cannot be integrated with these parameters, or friction turns negative on the way.
    """

    def settled(means: _Means) -> SteadyState:
        rig = means.machine(problem)
        begin = rig.rest_state()
        begin[:2] += (x0, v0)
        return _answer(problem, means, shooting.settle(rig, begin, _holds(problem, means)))

    return _with_means(problem, RTOL, settled, MOST)


def _check(rtol: float) -> None:
    if not FINEST <= rtol <= COARSEST:
        raise UsageError(f"numeric solver: rtol; expected between 1e-12 and 1e-3; got {rtol!r}")


@dataclass(frozen=True)
class _Means:
    """How the work is done: plain or compiled, the tolerance, the steps allowed."""

    fast: bool
    rtol: float
    steps: int
    meter: Meter | None = None

    def machine(self, problem: Problem, rows: int = 0) -> Machine:
        """The problem set up so."""
        rig = machine_of(problem, self.rtol, fast=self.fast, rows=rows)
        rig.room[layout.TALLY][layout.BUDGET] = self.steps
        return replace(rig, meter=self.meter)


def _with_means(
    problem: Problem,
    rtol: float,
    work: Callable[[_Means], Result],
    most: int = machine.CAP,
    meter: Meter | None = None,
) -> Result:
    """Do the work in plain Python while it is short, else with the compiled kernel: the same bits."""
    if meter is not None:
        meter.take(STATE)
        machine.compiled()  # steps that plain Python tries in vain would count twice
    if not machine.compiled.cache_info().currsize:
        try:
            return work(_Means(fast=False, rtol=rtol, steps=HINT if machine.is_ready() else machine.CAP_PLAIN))
        except shooting.Spent:
            machine.compiled()
    try:
        return work(_Means(fast=True, rtol=rtol, steps=most, meter=meter))
    except shooting.Spent:
        raise SimulationError(
            machine.slips_in_jumps(problem)
            or f"simulation: law {problem.law.name} at r = {problem.r!r}, parameters {problem.parameters}; expected "
            f"fewer than {most} steps; got more: the contact rings, or hardly anything damps it; do: take the law "
            "that this one tends to (a rigid contact for a stiffness without end), or loosen rtol"
        ) from None


def _steady(problem: Problem, means: _Means, start: Floats | None) -> SteadyState:
    rig = means.machine(problem)
    found = shooting.find_orbit(rig, None if start is None else start[: rig.size], _holds(problem, means))
    return _answer(problem, means, found)


def _holds(problem: Problem, means: _Means) -> Callable[[Floats], bool]:
    """What tells of a state whether the contact holds over the cycle from there."""

    def is_held(state: Floats) -> bool:
        motion, _ = _recorded(problem, means, (state, 0.0, 1), periodic=False)
        return _resting_share(motion) == 1.0

    return is_held


def _answer(problem: Problem, means: _Means, found: shooting.Orbit | None) -> SteadyState:
    """The numbers of an orbit, by finer steps where its two energies differ by more than the tolerance."""
    if found is None:
        gives = Note.NOT_PASSIVE if _gives_energy(problem) else Note(0)
        return SteadyState(problem, "numeric", "not found", notes=Note.UNSETTLED | gives)
    for _ in range(TIGHTER + 1):
        told = _told(problem, found, *_recorded(problem, means, (found.state, 0.0, found.cycles), periodic=True))
        off, size = told.closure_error or 0.0, told.energy_taken or 0.0
        closed = off <= max(means.rtol, CLOSED) * size or off < SMALLEST
        dear = REFINING * len(told.orbit.begin) > MOST if isinstance(told.orbit, NumericMotion) else True
        in_vain = off * TIGHTEN**TIGHTER > HIDDEN * size
        if closed or dear or in_vain or not found.is_exact or means.rtol * TIGHTEN < FINEST:
            break
        means = replace(means, rtol=means.rtol * TIGHTEN)
        better = shooting.newton(means.machine(problem), found.state, found.cycles, mirrored=found.mirrored)
        if better is None:
            break
        found = better
    if problem.beta > 0.0 and told.outcome == "periodic" and off > HIDDEN * size:
        return SteadyState(problem, "numeric", "not found", notes=Note.FRICTION_HIDDEN)
    return told


def _recorded(
    problem: Problem, means: _Means, task: tuple[Floats, float, int], *, periodic: bool
) -> tuple[NumericMotion, Any]:
    """Run some cycles from a state with a record, and account for them; the motion and the tally."""
    state, tau, cycles = task
    rows = 256 * cycles
    while True:
        rig = means.machine(problem, rows)
        tally = rig.room[layout.TALLY]
        rig.put(state)
        cuts = [0]
        for _ in range(cycles):
            rig.carry(tau, TURN)
            cuts.append(int(tally[layout.ROWS]))
        if cuts[-1] <= rows:
            rig.kernel.account(rig.rig, rig.force, rig.table, rig.room)
            return _motion(rig, cuts, periodic=periodic), tally
        rows = cuts[-1]


def _motion(rig: Machine, cuts: list[int], *, periodic: bool) -> NumericMotion:
    """The recorded steps as a motion; `cuts` says how many were recorded at the end of each cycle."""
    count = cuts[-1]
    log = np.array(rig.room[layout.LOG][: count * layout.ROW]).reshape(count, layout.ROW)
    slip = rig.buffer((0.0,) * (count * layout.NODES))
    if not rig.is_smooth:
        rig.kernel.slips(rig.rig, rig.room, slip)
    turns = np.repeat(np.arange(len(cuts) - 1), np.diff(cuts))
    values = log[:, 3:].reshape(count, layout.NODES, layout.WIDTH)
    slips = np.array(slip).reshape(count, layout.NODES)
    columns = [np.ascontiguousarray(c) for c in (log[:, 0] + TURN * turns, log[:, 1], log[:, 2], values, slips)]
    for column in columns:
        column.setflags(write=False)
    begin, length, side, values, slips = columns
    return NumericMotion(rig.problem, begin, length, side, values, slips, periodic)


def _told(problem: Problem, found: shooting.Orbit, motion: NumericMotion, tally: Any) -> SteadyState:
    """The numbers of an orbit."""
    cycles, stops, resting = found.cycles, motion.stops, _resting_share(motion)
    stuck = resting == 1.0
    dissipated = float(tally[layout.WORK] + tally[layout.FRAME]) / cycles
    put_in = float(tally[layout.INPUT]) / cycles + _carried(problem)
    regime: Regime = "stuck" if stuck else "stick-slip" if len(stops) else "continuous"
    return SteadyState(
        problem=problem,
        solver="numeric",
        outcome="stuck" if stuck else "periodic",
        energy_taken=dissipated,
        response_amplitude=0.5 * float(tally[layout.HIGH] - tally[layout.LOW]),
        stops_per_cycle=0.0 if stuck else len(stops) / cycles,
        stuck_fraction=resting,
        regime=regime,
        symmetric=_is_symmetric(found, motion),
        period_cycles=cycles,
        floquet_multiplier=found.multiplier,
        closure_error=abs(put_in - dissipated),
        residual=found.residual,
        notes=_notes(problem, found, abs(put_in - dissipated) / dissipated if dissipated else 0.0, stuck=stuck),
        orbit=motion,
    )


def _resting_share(motion: NumericMotion) -> float:
    """Share of the time in which the contact holds; 1 if it always does."""
    stops = motion.stops
    share = float(np.sum(stops[:, 1] - stops[:, 0])) / (motion.end - motion.start)
    return 1.0 if share > 1.0 - 1e-12 else share


def _carried(problem: Problem) -> float:
    """What a fixed wall's frame dashpot takes from the base by itself: 2 zeta_f r integral f'^2 of a cycle."""
    if problem.wall == "base":
        return 0.0
    pairs = enumerate(zip(problem.base.cosine, problem.base.sine, strict=True), 1)
    return 2.0 * problem.frame_damping_ratio * problem.r * pi * sum(k * k * (c * c + s * s) for k, (c, s) in pairs)


def _is_symmetric(found: shooting.Orbit, motion: NumericMotion) -> bool:
    """Whether half a cycle later the motion is its own negative."""
    if found.mirrored:
        return True
    taus = np.linspace(0.0, pi, 17)
    one, other = motion.state(taus)[:, :2], motion.state(taus + pi)[:, :2]
    return bool(np.max(np.abs(one + other)) < 1e-6 * np.max(np.abs(one)))


def _notes(problem: Problem, found: shooting.Orbit, off: float, *, stuck: bool) -> int:
    """What the numbers do not say; `off` is the closure error over the energy."""
    said = {
        Note.NOT_PASSIVE: _gives_energy(problem),
        Note.CREEPS: not found.is_exact,
        Note.FORGETS_SLOWLY: not stuck and 1.0 - abs(found.multiplier) < SLOW,
        Note.REST_STILL_FAR: not found.awaited,
        Note.MAY_COEXIST: not stuck and found.awaited and shooting.is_weakening(problem),
        Note.FEWER_DIGITS: not stuck and off > COARSE,
    }
    return sum(int(note) for note, is_so in said.items() if is_so)


def _gives_energy(problem: Problem) -> bool:
    """Whether LuGre friction may give energy back."""
    p = problem.parameters
    if not problem.law.has("lugre"):
        return False
    return 2.0 * problem.zeta * problem.r < p["bristle_damping"] * (p["static_ratio"] - 1.0)


def _is_unbounded(problem: Problem) -> bool:
    """Whether the drive is at resonance, nothing but friction damps, and friction is too weak to bound the motion."""
    if problem.zeta or problem.frame_damping_ratio or problem.parameter("rate_strength") > 0.0:
        return False
    pairs = enumerate(zip(*problem.force, strict=True), 1)
    return any(
        abs(k * problem.r - 1.0) < 1e-12 and problem.beta < 0.25 * pi * float(np.hypot(c, s)) for k, (c, s) in pairs
    )


def run(
    problem: Problem,
    *,
    cycles: int,
    x0: float = 0.0,
    v0: float = 0.0,
    tau0: float = 0.0,
    keep: int | None = None,
    rtol: float = RTOL,
) -> NumericMotion:
    """Return the motion from initial conditions over a number of cycles.

    Parameters
    ----------
    problem : Problem
        What moves.
    cycles : int
        Cycles of the drive; >= 1.
    x0, v0 : float
        Displacement over Y and its derivative at tau0; the contact is unloaded there.
    tau0 : float
        Phase of the drive at the start, rad.
    keep : int, optional
        Record only the last so many cycles (all, unless given).
    rtol : float
        Tolerance of the polynomial of each step, over the size of each component.

    Raises
    ------
    SimulationError
        The law cannot be integrated with these parameters.
    UsageError
        The arguments contradict each other.

    Examples
    --------
    >>> from frictionlab.simulator import Problem
    >>> run(Problem(r=0.5, beta=0.4), cycles=3).stops.shape
    (4, 2)
    """
    _check(rtol)
    kept = cycles if keep is None else keep
    if not 1 <= kept <= cycles:
        raise UsageError(f"run: cycles, keep; expected 1 <= keep <= cycles; got cycles = {cycles}, keep = {keep}")
    if not all(isfinite(value) for value in (x0, v0, tau0)):
        raise SimulationError(
            f"run: initial conditions; expected finite numbers; got x0 = {x0}, v0 = {v0}, tau0 = {tau0}"
        )
    start = np.array([x0, v0]), tau0 % TURN
    return _with_means(problem, rtol, lambda means: _run(problem, means, start, (cycles, kept)))


def _run(problem: Problem, means: _Means, start: tuple[Floats, float], count: tuple[int, int]) -> NumericMotion:
    (offset, tau0), (cycles, kept) = start, count
    rig = means.machine(problem)
    state = rig.rest_state(tau0)
    state[:2] += offset
    for _ in range(cycles - kept):
        state = shooting.propagate(rig, state, TURN, tau0=tau0)[0]
    motion, _ = _recorded(problem, means, (state, tau0, kept), periodic=False)
    return motion.later(TURN * (cycles - kept))
