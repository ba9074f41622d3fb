"""The integrated flow of a problem: it carries a state and its slopes, and records the motion."""

import functools
from math import hypot, pi
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.compiled import callback, numba
from frictionlab.simulator.laws import TERMS
from frictionlab.simulator.laws.law import ContactForce
from frictionlab.simulator.meter import Meter
from frictionlab.simulator.motion import Timeline
from frictionlab.simulator.numeric import radau
from frictionlab.simulator.numeric.motion import NumericMotion
from frictionlab.simulator.numeric.radau import COUNT, STAGES, WIDTH, Forcing, Oscillator, Work
from frictionlab.simulator.problem import Problem

TURN = 2.0 * pi
FIRST = 0.3  # rad of the faster of drive's harmonics and free vibration: first step tried
CAP = 3_000_000  # steps before a run is given up
STEPS = 256  # of a cycle that are recorded at first


class LostError(SimulationError):
    """From this state the motion cannot be carried on: friction turns negative, or steps become too short."""


class Flow:
    """The integrated flow of a problem.

    Parameters
    ----------
    problem : Problem
    rtol : float
        Tolerance of a step, over the size of each component.
    steps : int
        How many may be tried.
    meter : Meter, optional
        Where steps are booked.

    Raises
    ------
    SimulationError
        The law has exact phases of its own.
    """

    def __init__(self, problem: Problem, rtol: float, *, steps: int = CAP, meter: Meter | None = None) -> None:
        self.problem, self.rtol, self.meter = problem, rtol, meter
        self.law, self.rig = _rig(problem, rtol)
        sizes = [hypot(c, s) for c, s in zip(*problem.force, strict=True)]
        bounds = [sum(k**n * c for k, c in enumerate(sizes, 1)) for n in (1, 2)]
        self.drive = Forcing(*(np.array(column, dtype=float) for column in (*problem.force, bounds)))
        self.work = _work(self.rig.size)
        self.work.clock.most = steps

    @property
    def scale(self) -> FloatArray:
        """What counts as small of each component (n,): errors are relative to this and the state's own size."""
        return self.rig.scale[: self.rig.size]

    def rest_state(self, tau: float = 0.0) -> FloatArray:
        """The mass at rest with a relaxed spring, the contact unloaded; one that has an age has its steady one."""
        state = np.zeros(self.rig.size)
        if self.problem.wall == "base":
            state[:2] = -float(self.problem.base.at(tau)), -float(self.problem.base.rate_at(tau))
        state[3:] = 1.0
        return state

    def carry(self, state: FloatArray, span: float, *, tau0: float = 0.0) -> FloatArray:
        """Return the state that another one becomes over a span of time from tau0 on.

        Raises
        ------
        LostError
            The motion cannot be carried on.
        SimulationError
            The steps allowed are used up.
        OverspentError
            Nothing is left on the meter.
        """
        return self._carried(state, span, tau0, tangent=False)

    def carry_with_tangent(self, state: FloatArray, span: float) -> tuple[FloatArray, FloatArray]:
        """Return the state that another one becomes from tau = 0 on, and the slopes (n, n) of it over that one."""
        reached, size = self._carried(state, span, 0.0, tangent=True), self.rig.size
        return reached, self.work.tangent[:size, :size].copy()

    def record(self, state: FloatArray, tau0: float, cycles: int, *, periodic: bool, first: int = 0) -> NumericMotion:
        """Return the motion over some cycles from a state; `first` is the count of cycles that it begins with."""
        rows, size = STEPS * cycles, 3 + WIDTH * COUNT
        while True:
            self.work = self.work._replace(log=np.empty((rows, size)))
            self.work.clock.rows, cuts = 0, [0]
            self._begin(state)
            for _ in range(cycles):
                self._advance(tau0, TURN, tangent=False)
                cuts.append(int(self.work.clock.rows))
            if cuts[-1] <= rows:
                break
            rows = cuts[-1]
        begin, length, side, values = self.recorded()
        self.work = self.work._replace(log=np.empty((0, size)))
        cycle = first + np.repeat(np.arange(cycles), np.diff(cuts))
        cycle.setflags(write=False)
        return NumericMotion(self.problem, Timeline(cycle, begin, length, periodic), side, values, (self.law, self.rig))

    def recorded(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return start (n,), length (n,), side (n,) and values (n, 4, 8) of the steps recorded last."""
        log = self.work.log[: self.work.clock.rows].copy()
        log.setflags(write=False)
        return log[:, 0], log[:, 1], log[:, 2], log[:, 3:].reshape(-1, WIDTH, COUNT)

    def failure(self, code: int, what: str, most: str) -> SimulationError:
        """Return the error of a run of what was simulated that ended so; `most`: the steps that it might take."""
        problem = self.problem
        said = {
            radau.NEGATIVE: "friction turns negative within the motion; expected at least 0; do: a smaller gradient or"
            " rate_strength",
            radau.TOO_MANY: f"expected fewer than {most}; got more: the contact rings, hardly anything damps it, or"
            " the law is too stiff; do: take the law that this one tends to (a rigid contact for a stiffness without"
            " end), or loosen rtol",
            radau.STALLED: "steps became too short; expected a law that can be integrated; got one too stiff; do:"
            " report these numbers, or take a law that holds where this one nearly does",
        }
        breaks = next(filter(None, (term.breaks(problem.parameters) for term in problem.law.terms)), "")
        why = breaks if breaks and code != radau.NEGATIVE else said[code]
        kind = SimulationError if code == radau.TOO_MANY else LostError
        return kind(f"simulation of {what}: law {problem.law.name}, parameters {problem.parameters}: {why}")

    def _carried(self, state: FloatArray, span: float, tau0: float, *, tangent: bool) -> FloatArray:
        """Carry a state cycle by cycle."""
        self._begin(state)
        for begun in np.arange(0.0, span - 1e-9, TURN):
            self._advance(tau0, float(min(TURN, span - begun)), tangent=tangent)
        return self.work.state[: self.rig.size].copy()

    def _begin(self, state: FloatArray) -> None:
        """Set the state; its slopes over itself are then 1, and steps begin as if nothing had gone before."""
        self.work.clock.next = FIRST * min(self.problem.r, 1.0) / self.problem.base.harmonics
        self.work.state[:] = 0.0
        self.work.state[: self.rig.size] = state
        self.work.tangent[:] = np.eye(WIDTH)

    def _advance(self, tau: float, span: float, *, tangent: bool) -> None:
        """Carry the state, and its slopes, from a phase of the drive over at most a cycle."""
        before = self.work.clock.tried
        code = radau.carry(self.law, self.rig, self.drive, self.work, tau, span, int(tangent))
        if self.meter is not None:
            self.meter.take(float(self.work.clock.tried - before))
        if code != radau.FINE:
            raise self.failure(code, f"a motion at r = {self.problem.r!r}", f"{self.work.clock.most} steps")


def _work(size: int) -> Work:
    """Workspace for states of a size."""
    reduced = STAGES * (size - 1)
    shapes: tuple[tuple[int, ...], ...] = (
        *((WIDTH, COUNT), (WIDTH, COUNT), (STAGES,), (WIDTH, STAGES), (WIDTH - 1, WIDTH, STAGES)),
        *((reduced, reduced), (WIDTH, STAGES), (2, reduced), (2, COUNT), (0, 3 + WIDTH * COUNT)),
    )
    clock = np.zeros(1, radau.CLOCK).view(np.recarray)[0]
    return Work(np.zeros(WIDTH), np.eye(WIDTH), clock, *(np.zeros(shape) for shape in shapes))


@functools.cache
def _compiled(contact: ContactForce) -> Any:
    """A law's formula, compiled."""
    number = numba.float64
    return callback(contact, numba.types.UniTuple(number, 16)(number[::1], *(number,) * 6))


def _rig(problem: Problem, rtol: float) -> tuple[Any, Oscillator]:
    """A law's formula, compiled, and the numbers of a problem; without friction every law is none."""
    r, p, terms = problem.r, problem.parameters, problem.law.terms
    term = next((term for term in terms if term.kind in ("smooth", "inner") and problem.beta > 0.0), TERMS["coulomb"])
    if problem.law.kind == "elastic" or term.contact is None:
        raise SimulationError(
            f"simulation: law {problem.law.name}: the integrated flow does not know it; do: leave the solver to choose"
        )
    own = np.array([p[parameter.name] for parameter in term.parameters])
    bend = term.contact(own, 1.0, problem.beta, 0.0, 0.0, 0.0, 1.0)[4] if term.states else 1.0
    reach = problem.force_size * min(1.0, 1.0 / r**2)
    scale = np.array([reach, reach / min(1.0, r), problem.beta / bend or 1.0, 1.0])
    dashpots = 2.0 * problem.zeta * r, 2.0 * problem.frame_damping_ratio * r
    numbers = (r, problem.beta, problem.parameter("gradient"), *dashpots, *problem.static_ratios, term.narrow(p))
    return _compiled(term.contact), Oscillator(own, *numbers, 2 + term.states, rtol, scale)


def warm_up() -> None:
    """Load the compiled flow, or compile it."""
    Flow(Problem(0.5, 0.4), 1e-6).carry(np.zeros(2), 0.1)
