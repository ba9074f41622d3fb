"""The verbs: the steady state solved for, and the motion from initial conditions.

A steady state is found by Newton's method on the map of a half, one or several cycles; by waiting where that gets lost.
"""

from math import inf, isfinite, pi
from typing import NamedTuple

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import UsageError
from frictionlab.simulator.meter import STATE, WAITED_CYCLES, WAITED_STEPS, Meter
from frictionlab.simulator.notes import COARSE, SLOW, Note
from frictionlab.simulator.numeric.flow import TURN, Flow, LostError, NumericMotion
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.state import SteadyState, numbers_of
from frictionlab.simulator.structure import Structure

RTOL = 1e-8
FINEST, COARSEST = 1e-12, 1e-3
LONGEST = 8  # cycles of a period
TRIES = (2, 4, 16, 64, 256)  # cycles after which Newton is tried though nothing repeats yet
HELD_AFTER = 16  # cycles after which a contact that holds is believed to hold
NEWTON = 15  # maps of one search
CLOSE = 1e-3  # a run has nearly repeated: Newton may finish it
NEAR = 0.1  # how far Newton may move from there, over the size of the motion
CONVERGED = 1e-11  # of the motion's size: rounding of the steps' ends
ALMOST = 1e-8  # and what is taken if nothing better comes
TIGHTEN, TIGHTER = 0.03, 2  # where the two energies differ by more than the tolerance: how much finer, how many times
CLOSED, SMALLEST = 1e-9, 1e-15  # and what is always good enough, over the energy and over k Y^2
REFINING = 14  # periods' steps that an orbit by finer steps takes: it may cost half of what the search may
HIDDEN = 0.1  # closure error over the energy above which that is not known at all
MOST = 200_000  # steps of a search for a steady state: some seconds; a run of many cycles may take more


class Orbit(NamedTuple):
    """A fixed point of the map of a motion over a period."""

    state: FloatArray  # (n,): z, v and inner states at tau = 0
    cycles: int  # of the period
    mirrored: bool  # whether half a cycle later the motion is its own negative
    residual: float  # by how much the state misses itself, over its size; above ALMOST it creeps on, the contact holds
    slopes: FloatArray  # (n, n): derivative of the map
    awaited: bool = True  # False if the run from rest was still far from it when waiting ended

    @property
    def multiplier(self) -> float:
        """What a small disturbance is multiplied by in one period: the largest; its modulus if it is complex."""
        if not np.all(np.isfinite(self.slopes)):
            return inf
        values = np.linalg.eigvals(self.slopes)
        top = values[np.argmax(np.abs(values))]
        return float(top.real) if abs(top.imag) < 1e-12 * abs(top) else float(abs(top))

    @property
    def is_stable(self) -> bool:
        """Whether a small disturbance does not grow."""
        return abs(self.multiplier) < 1.0 + 1e-9


def steady(
    what: Problem | Structure, *, rtol: float = RTOL, near: SteadyState | None = None, meter: Meter | None = None
) -> SteadyState:
    """Return the steady state of what has a law without exact slides.

    Parameters
    ----------
    what : Problem or Structure
        What moves, with any laws.
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
    if not FINEST <= rtol <= COARSEST:
        raise UsageError(f"numeric solver: rtol; expected between 1e-12 and 1e-3; got {rtol!r}")
    flow = Flow(what, rtol, steps=MOST, meter=meter)
    if _is_unbounded(flow):
        return SteadyState(flow.problem, "numeric", "unbounded")
    if meter is not None:
        meter.take(STATE)
    begin: FloatArray | None = None
    if near is not None and isinstance(near.orbit, NumericMotion):
        begin = near.orbit.state(0.0)
    elif not what.weakens:
        begin = flow.carry(flow.rest_state(), TURN)
    if begin is not None:
        found = newton(flow, begin, 1, mirrored=what.has_mirror_image)
        if found is not None and found.is_stable:
            return _answer(flow, found)
    return _answer(flow, settle(flow, flow.rest_state()))


def steady_from(problem: Problem, x0: float, v0: float, looks: float = inf) -> tuple[SteadyState, float]:
    """Return what the motion from displacement and rate at tau = 0, the contact unloaded, settles on; and `looks`."""
    flow = Flow(problem, RTOL, steps=MOST)
    begin = flow.rest_state()
    begin[:2] += (x0, v0)
    return _answer(flow, settle(flow, begin)), looks


def run(
    what: Problem | Structure,
    *,
    cycles: int,
    x0: float = 0.0,
    v0: float = 0.0,
    tau0: float = 0.0,
    keep: int | None = None,
) -> NumericMotion:
    """Return the motion from initial conditions, contacts unloaded, as `frictionlab.simulator.simulate` has it."""
    flow, kept, begun = Flow(what, RTOL), cycles if keep is None else keep, tau0 % TURN
    state = flow.rest_state(begun)
    state[0] += x0
    state[flow.masses] += v0
    for _ in range(cycles - kept):
        state = flow.carry(state, TURN, tau0=begun)
    return flow.record(state, begun, kept, periodic=False, first=cycles - kept)


def _is_unbounded(flow: Flow) -> bool:
    """Whether the drive is at resonance, nothing but friction damps, and friction is too weak to bound the motion."""
    frame, law, system = flow.structure, flow.rubbing[0], flow.systems[0]
    if frame.masses > 1 or system["damping"][0, 0] or np.any(law["states"] < 0):
        return False
    waves = [abs(line) for k, line in enumerate(frame.base.lines.tolist(), 1) if abs(k * frame.r - 1.0) < 1e-12]
    strength = 0.0  # friction that grows with speed without end bounds every motion
    for c, contact in enumerate(frame.contacts if waves else ()):
        own = tuple(law["own"][c].tolist())
        fast = flow.formulas[c](own, 1.0, contact.beta, 0.0, 1e300, 0.0, 1.0)[0] if law["states"][c] == 0 else 0.0
        strength += max(contact.beta, fast)
    return any(strength < 0.25 * pi * wave for wave in waves)


def settle(flow: Flow, begin: FloatArray) -> Orbit | None:
    """Follow the run from a state until Newton can finish it: when it nearly repeats, and at times in any case.

    Where friction weakens, Newton may only finish what has nearly repeated after 1 to 8 cycles. A contact that only
    creeps may creep on for ever: if it holds over the whole cycle, that is the answer.
    """
    past, close = [begin], CLOSE
    for waited in range(1, WAITED_CYCLES + 1):
        if flow.clock.tried > WAITED_STEPS:
            return None
        past = [*past[-LONGEST:], flow.carry(past[-1], TURN)]
        misses = [_distance(flow, past[-1], other) for other in past[-2::-1]]
        cycles = next((n for n, miss in enumerate(misses, 1) if miss < close), 0)
        close = min(close, 0.1 * misses[cycles - 1]) if cycles else close
        if cycles or waited in TRIES:
            found = _finish(flow, past[-1], cycles or 1)
            if found is not None:
                return found
        if waited >= HELD_AFTER and waited in TRIES and misses[0] < CLOSE:
            motion, contacts = flow.record(past[-1], 0.0, 1, periodic=False), range(len(flow.structure.contacts))
            if any(np.sum(np.diff(motion.stops_of(c))) <= (1.0 - 1e-12) * TURN for c in contacts):
                continue
            slopes = flow.carry_with_tangent(past[-1], TURN)[1]
            return Orbit(past[-1], 1, mirrored=False, residual=misses[0], slopes=slopes)
    found = newton(flow, past[-1], 1, mirrored=False)
    return found._replace(awaited=False) if found is not None and found.is_stable else None


def _finish(flow: Flow, state: FloatArray, cycles: int) -> Orbit | None:
    """The stable orbit close to a state, of as few cycles as it has; None if there is none."""
    alike = cycles == 1 and flow.what.has_mirror_image
    for count, mirrored in [(1, True)] * alike + [(n, False) for n in range(1, cycles + 1) if cycles % n == 0]:
        found = newton(flow, state, count, mirrored=mirrored)
        if found is not None and found.is_stable and _distance(flow, found.state, state) < NEAR:
            return found
    return None


def _distance(flow: Flow, one: FloatArray, other: FloatArray) -> float:
    return float(np.max(np.abs(one - other) / (flow.scale + np.abs(one))))


def newton(flow: Flow, state: FloatArray, cycles: int, *, mirrored: bool) -> Orbit | None:
    """Newton's method on the map of a period, or of half a period mirrored; None if it does not converge."""
    sign, span = (flow.signs, pi) if mirrored else (np.ones(len(state)), TURN * cycles)
    best: tuple[float, FloatArray, FloatArray] | None = None
    for _ in range(NEWTON):
        try:
            reached, slopes = flow.carry_with_tangent(state, span)
        except LostError:
            return None
        reached, slopes = sign * reached, sign[:, None] * slopes
        miss = _distance(flow, state, reached)
        if not isfinite(miss):
            return None
        if best is not None and miss >= best[0] and best[0] < ALMOST:
            break
        if best is None or miss < best[0]:
            best = miss, state, slopes
        if miss < CONVERGED:
            break
        state = _next(flow, state, reached, slopes, miss)
    if best is None or best[0] > ALMOST:
        return None
    return Orbit(best[1], cycles, mirrored, best[0], best[2] @ best[2] if mirrored else best[2])


def _next(flow: Flow, state: FloatArray, reached: FloatArray, slopes: FloatArray, miss: float) -> FloatArray:
    """Newton's next state, not absurdly far away; the state reached where there is none."""
    try:
        change = np.linalg.solve(np.eye(len(state)) - slopes, reached - state)
    except np.linalg.LinAlgError:
        return reached
    if not np.all(np.isfinite(change)):
        return reached
    new = state + change * min(1.0, (10.0 + 1e3 * miss) / (_distance(flow, state, state + change) + 1e-300))
    if len(state) == 2 and abs(new[1]) < 1e-13 * flow.scale[1]:
        new[1] = 0.0
    return np.asarray(new)


def _answer(flow: Flow, found: Orbit | None) -> SteadyState:
    """The numbers of an orbit, by finer steps where its two energies differ by more than the tolerance."""
    problem, what, frame = flow.problem, flow.what, flow.structure
    passive = _passivity(frame)
    if found is None:
        return SteadyState(problem, "numeric", "not found", notes=Note.UNSETTLED | passive)
    for _ in range(TIGHTER + 1):
        motion = flow.record(found.state, 0.0, found.cycles, periodic=True)
        numbers = numbers_of(motion, frame)
        off, size = numbers["closure_error"], numbers["energies"].contact + numbers["energies"].frame
        closed = off <= max(flow.rtol, CLOSED) * size or off < SMALLEST
        dear = REFINING * len(motion.rows) > MOST
        in_vain = off * TIGHTEN**TIGHTER > HIDDEN * size
        if closed or dear or in_vain or found.residual > ALMOST or flow.rtol * TIGHTEN < FINEST:
            break
        flow = Flow(what, flow.rtol * TIGHTEN, steps=MOST, meter=flow.meter)
        better = newton(flow, found.state, found.cycles, mirrored=found.mirrored)
        if better is None:
            break
        found = better
    stuck = numbers["regime"] == "stuck"
    if frame.rubs and not stuck and off > HIDDEN * size:
        return SteadyState(problem, "numeric", "not found", notes=Note.FRICTION_HIDDEN)
    said = {
        Note.CREEPS: found.residual > ALMOST,
        Note.FORGETS_SLOWLY: not stuck and 1.0 - abs(found.multiplier) < SLOW,
        Note.REST_STILL_FAR: not found.awaited,
        Note.MAY_COEXIST: not stuck and found.awaited and what.weakens,
        Note.FEWER_DIGITS: not stuck and size != 0.0 and off / size > COARSE,
    }
    return SteadyState(
        problem=problem,
        solver="numeric",
        outcome="stuck" if stuck else "periodic",
        symmetric=found.mirrored or _is_symmetric(motion),
        period_cycles=found.cycles,
        floquet_multiplier=found.multiplier,
        residual=found.residual,
        notes=passive | sum(int(note) for note, is_so in said.items() if is_so),
        structure=what if isinstance(what, Structure) else None,
        **numbers,
    )


def _is_symmetric(motion: NumericMotion) -> bool:
    """Whether half a cycle later the motion is its own negative."""
    taus, size = np.linspace(0.0, pi, 17), 2 * motion.flow.masses
    one, other = motion.state(taus)[:, :size], motion.state(taus + pi)[:, :size]
    return bool(np.max(np.abs(one + other)) < 1e-6 * np.max(np.abs(one)))


def _passivity(frame: Structure) -> int:
    """The note that a contact may give energy back, if it may."""
    pairs = ((contact.parameters | {"r": frame.r}, term) for contact in frame.contacts for term in contact.law.terms)
    return int(Note.NOT_PASSIVE) if any(term.gives(values) for values, term in pairs) else 0
