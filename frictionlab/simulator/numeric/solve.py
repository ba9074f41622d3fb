"""The two verbs: the steady state solved for, and the motion from initial conditions."""

from collections.abc import Callable
from math import isfinite, pi
from typing import TypeVar

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError, UsageError
from frictionlab.simulator.meter import STATE, Meter
from frictionlab.simulator.motion import Timeline
from frictionlab.simulator.notes import COARSE, SLOW, Note
from frictionlab.simulator.numeric import layout, machine, shooting
from frictionlab.simulator.numeric.machine import Machine, Spent
from frictionlab.simulator.numeric.motion import NumericMotion
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.state import Regime, SteadyState

TURN = 2.0 * pi
RTOL = 1e-8
FINEST, COARSEST = 1e-12, 1e-3
TIGHTEN, TIGHTER = 0.03, 2  # where the two energies differ by more than the tolerance: how much finer, how many times
CLOSED, SMALLEST = 1e-9, 1e-15  # and what is always good enough, over the energy and over k Y^2
REFINING = 14  # periods' steps that an orbit by finer steps takes: it may cost half of what the search may
HIDDEN = 0.1  # and one above which the energy is not known at all
MOST = 200_000  # steps of a search for a steady state: some seconds; a run of many cycles may take more
HINT = 2_000  # steps that plain Python may try where the compiled kernel is a second away
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

    def solved(rig: Machine) -> SteadyState:
        state = None if start is None else start[: rig.size]
        return _answer(rig, shooting.find_orbit(rig, state, lambda begin: _holds(rig, begin)))

    return _with_machine(problem, rtol, solved, MOST, meter)


def steady_from(problem: Problem, x0: float, v0: float) -> SteadyState:
    """Return what the motion from a displacement over Y and its rate, at tau = 0 and the contact unloaded, settles on.

    Raises
    ------
    SimulationError
        The law cannot be integrated with these parameters, or friction turns negative on the way.
    """

    def settled(rig: Machine) -> SteadyState:
        begin = rig.rest_state()
        begin[:2] += (x0, v0)
        return _answer(rig, shooting.settle(rig, begin, lambda state: _holds(rig, state)))

    return _with_machine(problem, RTOL, settled, MOST)


def _check(rtol: float) -> None:
    if not FINEST <= rtol <= COARSEST:
        raise UsageError(f"numeric solver: rtol; expected between 1e-12 and 1e-3; got {rtol!r}")


def _with_machine(
    problem: Problem,
    rtol: float,
    work: Callable[[Machine], Result],
    most: int = machine.CAP,
    meter: Meter | None = None,
) -> Result:
    """Do the work in plain Python while it is short, else with the compiled kernel: the same bits."""
    if meter is not None:
        meter.take(STATE)
        machine.compiled()  # steps that plain Python tries in vain would count twice
    if not machine.compiled.cache_info().currsize:
        try:
            return work(Machine(problem, rtol, fast=False, steps=HINT if machine.is_ready() else None))
        except Spent:
            machine.compiled()
    try:
        return work(Machine(problem, rtol, fast=True, steps=most, meter=meter))
    except Spent:
        raise SimulationError(
            machine.slips_in_jumps(problem)
            or f"simulation: law {problem.law.name} at r = {problem.r!r}, parameters {problem.parameters}; expected "
            f"fewer than {most} steps; got more: the contact rings, or hardly anything damps it; do: take the law "
            "that this one tends to (a rigid contact for a stiffness without end), or loosen rtol"
        ) from None


def _holds(rig: Machine, state: FloatArray) -> bool:
    """Whether the contact holds over the cycle from a state."""
    return _resting_share(_recorded(rig, state, 0.0, 1, periodic=False)) == 1.0


def _answer(rig: Machine, found: shooting.Orbit | None) -> SteadyState:
    """The numbers of an orbit, by finer steps where its two energies differ by more than the tolerance."""
    problem = rig.problem
    if found is None:
        gives = Note.NOT_PASSIVE if _gives_energy(problem) else Note(0)
        return SteadyState(problem, "numeric", "not found", notes=Note.UNSETTLED | gives)
    for _ in range(TIGHTER + 1):
        motion = _recorded(rig, found.state, 0.0, found.cycles, periodic=True)
        told = _told(problem, found, motion)
        off, size = told.closure_error or 0.0, told.energy_taken or 0.0
        closed = off <= max(rig.rtol, CLOSED) * size or off < SMALLEST
        dear = REFINING * len(motion.side) > MOST
        in_vain = off * TIGHTEN**TIGHTER > HIDDEN * size
        if closed or dear or in_vain or not found.is_exact or rig.rtol * TIGHTEN < FINEST:
            break
        rig = rig.again(rtol=rig.rtol * TIGHTEN)
        better = shooting.newton(rig, found.state, found.cycles, mirrored=found.mirrored)
        if better is None:
            break
        found = better
    if problem.beta > 0.0 and told.outcome == "periodic" and off > HIDDEN * size:
        return SteadyState(problem, "numeric", "not found", notes=Note.FRICTION_HIDDEN)
    return told


def _recorded(
    rig: Machine, state: FloatArray, tau: float, cycles: int, *, periodic: bool, first: int = 0
) -> NumericMotion:
    """The motion over some cycles from a state; `first` is the count of cycles that it begins with."""
    rows = 256 * cycles
    while True:
        rig = rig.again(rows=rows)
        rig.put(state)
        cuts = [0]
        for _ in range(cycles):
            rig.carry(tau, TURN)
            cuts.append(int(rig.room.tally[layout.ROWS]))
        if cuts[-1] <= rows:
            break
        rows = cuts[-1]
    begin, length, side, values = rig.recorded()
    cycle = first + np.repeat(np.arange(cycles), np.diff(cuts))
    for column in (begin, length, side, values, cycle):
        column.setflags(write=False)
    return NumericMotion(rig.problem, Timeline(cycle, begin, length, periodic), side, values)


def _told(problem: Problem, found: shooting.Orbit, motion: NumericMotion) -> SteadyState:
    """The numbers of an orbit."""
    cycles, stops, resting, sums = found.cycles, motion.stops, _resting_share(motion), motion.integrals
    stuck = resting == 1.0
    frame, (low, high) = 2.0 * problem.frame_damping_ratio * problem.r, motion.range
    taken = (sums.work + frame * (sums.dragged if problem.wall == "fixed" else sums.squared)) / cycles
    off = sums.closure_error(frame) / cycles
    regime: Regime = "stuck" if stuck else "stick-slip" if len(stops) else "continuous"
    return SteadyState(
        problem=problem,
        solver="numeric",
        outcome="stuck" if stuck else "periodic",
        energy_taken=taken,
        response_amplitude=0.5 * (high - low),
        stops_per_cycle=0.0 if stuck else len(stops) / cycles,
        stuck_fraction=resting,
        regime=regime,
        symmetric=_is_symmetric(found, motion),
        period_cycles=cycles,
        floquet_multiplier=found.multiplier,
        closure_error=off,
        residual=found.residual,
        notes=_notes(problem, found, off / taken if taken else 0.0, stuck=stuck),
        orbit=motion,
    )


def _resting_share(motion: NumericMotion) -> float:
    """Share of the time in which the contact holds; 1 if it always does."""
    stops = motion.stops
    share = float(np.sum(stops[:, 1] - stops[:, 0])) / (motion.end - motion.start)
    return 1.0 if share > 1.0 - 1e-12 else share


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
    """Return the motion from initial conditions over a number of cycles; the contact is unloaded at the start.

    Parameters
    ----------
    problem, cycles, x0, v0, tau0, keep
        As in `frictionlab.simulator.simulate`.
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

    def followed(rig: Machine) -> NumericMotion:
        begun = tau0 % TURN
        state = rig.rest_state(begun)
        state[:2] += (x0, v0)
        for _ in range(cycles - kept):
            state = shooting.propagate(rig, state, TURN, tau0=begun)[0]
        return _recorded(rig, state, begun, kept, periodic=False, first=cycles - kept)

    return _with_machine(problem, rtol, followed)
