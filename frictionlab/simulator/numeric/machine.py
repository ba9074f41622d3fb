"""The numeric kernel ready to run, plain or compiled, and a problem in the form that it takes."""

import functools
from math import hypot
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.engine import Engine, as_it_stands, compile_modules, machine_code_folder
from frictionlab.simulator.laws import bouc_wen, dahl, logarithm, lugre, rate_state, stribeck
from frictionlab.simulator.meter import Meter
from frictionlab.simulator.numeric import contact, layout, phases, step, tableau
from frictionlab.simulator.problem import Problem

FORMULAS = {
    stribeck: ("stribeck_factor",),
    logarithm: ("logarithm_factor",),
    dahl: ("dahl_flow",),
    bouc_wen: ("bouc_wen_flow",),
    lugre: ("lugre_curve", "lugre_flow"),
    rate_state: ("rate_state_slip", "rate_state_age"),
}
MODULES = (contact, step, phases)  # each uses only those before it
CODES = {
    "stribeck": (layout.STRIBECK, ("static_ratio", "stribeck_speed", "stribeck_exponent")),
    "logarithm": (layout.LOGARITHM, ("rate_strength", "rate_speed")),
    "dahl": (layout.DAHL, ("stiffness_ratio",)),
    "bouc-wen": (layout.BOUC_WEN, ("stiffness_ratio", "exponent")),
    "lugre": (layout.LUGRE, ("stiffness_ratio", "bristle_damping", "static_ratio", "stribeck_speed")),
    "rate-state": (
        layout.RATE_STATE,
        ("direct_effect", "evolution_effect", "slip_distance", "reference_speed", "stiffness_ratio"),
    ),
}
FIRST = 0.3  # rad of the faster of drive's harmonics and free vibration: first step tried
CAP_PLAIN, CAP = 20_000, 3_000_000  # steps before plain Python, and before the compiled kernel, give up


class Spent(Exception):  # noqa: N818 - no error: plain Python hands over to the compiled kernel
    """The steps allowed are used up."""


class LostError(SimulationError):
    """From this state the motion cannot be carried on: friction turns negative, or steps become too short."""


class Machine:
    """A problem in the kernel's form: its functions, numbers and buffers.

    Parameters
    ----------
    problem : Problem
    rtol : float
        Tolerance of a step, over the size of each component.
    fast : bool
        Whether to take the compiled kernel.
    steps : int, optional
        How many may be tried; by default what plain Python or the compiled kernel does in some seconds.
    rows : int
        Space for so many recorded steps.
    meter : Meter, optional
        Where steps are booked.

    Raises
    ------
    SimulationError
        The law is none that this solver knows.
    """

    def __init__(
        self,
        problem: Problem,
        rtol: float,
        *,
        fast: bool,
        steps: int | None = None,
        rows: int = 0,
        meter: Meter | None = None,
    ) -> None:
        self.problem, self.rtol, self.fast, self.meter = problem, rtol, fast, meter
        self.steps = steps if steps is not None else CAP if fast else CAP_PLAIN
        self.engine = compiled() if fast else plain()
        self.kernel, self.buffer, self.rig = self.engine.kernel, self.engine.buffer, _rig(problem)
        sizes = [hypot(c, s) for c, s in zip(*problem.force, strict=True)]
        bounds = tuple(float(sum(k**n * c for k, c in enumerate(sizes, 1))) for n in (1, 2))
        table = tableau.NODES, tableau.WEIGHTS, tableau.STAGES, tableau.BERNSTEIN
        empty = ((0.0,) * size for size in (*layout.SIZES, rows * layout.ROW))
        self.room = layout.Room(*(self.buffer(values) for values in (*problem.force, bounds, *table, *empty)))
        self.room.scale[:] = self.buffer(_scale(problem))
        self.room.tally[layout.TOLERANCE], self.room.tally[layout.BUDGET] = rtol, self.steps

    def again(self, *, rtol: float | None = None, rows: int = 0) -> "Machine":
        """Return another one for the same problem, by finer steps or with space to record them."""
        tolerance = self.rtol if rtol is None else rtol
        return Machine(self.problem, tolerance, fast=self.fast, steps=self.steps, rows=rows, meter=self.meter)

    @property
    def size(self) -> int:
        """Components of the state: z, v and the contact's own."""
        return self.rig.size

    @property
    def state(self) -> FloatArray:
        """The state now."""
        return np.array(self.room.state[: self.size])

    def put(self, state: FloatArray) -> None:
        """Set the state; its slopes over itself are then 1, and steps begin as if nothing had gone before."""
        self.room.tally[layout.LENGTH] = FIRST * min(self.problem.r, 1.0) / self.problem.base.harmonics
        padded = (*state.tolist(), *((0.0,) * (layout.WIDTH - self.size)))
        self.room.state[:] = self.buffer(padded)
        self.room.slopes[:] = self.buffer(tuple(np.eye(layout.WIDTH).ravel().tolist()))

    def carry(self, tau: float, span: float, *, slopes: bool = False) -> None:
        """Carry the state, and its slopes, from a phase of the drive over at most a cycle.

        Raises
        ------
        Spent
            The steps allowed are used up.
        LostError
            The motion cannot be carried on.
        OverspentError
            Nothing is left on the meter.
        """
        before = self.room.tally[layout.STEPS]
        code = self.kernel.carry(self.rig, self.room, tau, span, slopes)
        if self.meter is not None:
            self.meter.take(float(self.room.tally[layout.STEPS] - before))
        if code == layout.TOO_MANY:
            raise Spent
        if code != layout.FINE:
            raise LostError(_lost(self.problem, code))

    def recorded(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return start (n,), length (n,), side (n,) and values (n, 8, 4) of the steps recorded."""
        count = int(self.room.tally[layout.ROWS])
        log = np.array(self.room.log[: count * layout.ROW]).reshape(count, layout.ROW)
        values = np.ascontiguousarray(log[:, 3:]).reshape(count, layout.NODES, layout.WIDTH)
        return log[:, 0].copy(), log[:, 1].copy(), log[:, 2].copy(), values

    def rest_state(self, tau: float = 0.0) -> FloatArray:
        """The mass at rest with a relaxed spring, the contact unloaded; a rate-and-state contact has its steady age."""
        state = np.zeros(self.size)
        if self.problem.wall == "base":
            state[0], state[1] = -float(self.problem.base.at(tau)), -float(self.problem.base.rate_at(tau))
        if self.size == layout.WIDTH:
            state[3] = 1.0
        return state

    @property
    def is_smooth(self) -> bool:
        """Whether the contact has no state of its own: it holds truly in a stop."""
        return self.rig.code < layout.DAHL


def _lost(problem: Problem, code: int) -> str:
    """Why a motion cannot be carried on."""
    if code == layout.NEGATIVE:
        return (
            f"simulation: law {problem.law.name}, parameters {problem.parameters}: friction turns negative within "
            "the motion; expected at least 0; do: a smaller gradient or rate_strength"
        )
    return slips_in_jumps(problem) or (
        f"simulation: law {problem.law.name}: steps became too short at r = {problem.r!r}, parameters "
        f"{problem.parameters}; expected a law that can be integrated; got one too stiff; do: report these "
        "numbers, or take a law that holds where this one nearly does"
    )


def slips_in_jumps(problem: Problem) -> str:
    """Why a rate-and-state contact too soft for its fall of friction cannot be integrated; empty for others."""
    if not problem.law.has("rate-state"):
        return ""
    p = problem.parameters
    critical = rate_state.critical_stiffness(
        p["direct_effect"], p["evolution_effect"], problem.beta, p["slip_distance"]
    )
    if p["stiffness_ratio"] >= critical:
        return ""
    return (
        f"simulation: law {problem.law.name} at r = {problem.r!r}, parameters {p}: the contact slips in jumps; "
        f"expected stiffness_ratio above (evolution_effect - direct_effect) beta / slip_distance = {critical:.4g}; got "
        f"{p['stiffness_ratio']:.4g}: slip speeds up without bound in a finite time, for this contact has no mass of "
        "its own; do: a larger stiffness_ratio or slip_distance, a smaller evolution_effect, or jumps by static "
        "friction (coulomb+breakaway)"
    )


@functools.cache
def plain() -> Engine:
    """The kernel as plain Python."""
    return as_it_stands(MODULES)


@functools.cache
def compiled() -> Engine:
    """The kernel compiled by numba."""
    return compile_modules(layout, MODULES, formulas=FORMULAS)


def is_ready() -> bool:
    """Whether the compiled kernel is loaded, or its machine code at hand (then it loads in a second)."""
    folder = machine_code_folder(layout, (*FORMULAS, *MODULES))
    return bool(compiled.cache_info().currsize) or any(folder.glob("**/*.nbi"))


def _rig(problem: Problem) -> layout.Rig:
    """The numbers of a problem in the kernel's order."""
    code, names = _code(problem)
    own = [problem.parameter(name) for name in names]
    up, down = problem.static_ratios
    if code == layout.STRIBECK:
        up = down = own[0]
    size = 2 if code < layout.DAHL else 4 if code == layout.RATE_STATE else 3
    ending = 2 if code == layout.RATE_STATE else 1
    damping = 2.0 * problem.zeta * problem.r, 2.0 * problem.frame_damping_ratio * problem.r
    law: Any = (*own, *((0.0,) * (5 - len(own))))
    gradient = problem.parameter("gradient")
    return layout.Rig(code, problem.r, problem.beta, gradient, *damping, law, up, down, size, ending, _narrow(problem))


def _narrow(problem: Problem) -> float:
    """Speed within which the friction curve falls or rises; 0 if it is flat."""
    p = problem.parameters
    if problem.beta == 0.0 or (p.get("static_ratio", 1.0) == 1.0 and p.get("rate_strength", 0.0) == 0.0):
        return 0.0
    return p.get("stribeck_speed", p.get("rate_speed", 0.0))


def _code(problem: Problem) -> tuple[int, tuple[str, ...]]:
    """The law's code and its parameters; without friction every law is none."""
    if problem.beta == 0.0:
        return layout.COULOMB, ()
    codes = [CODES[term.name] for term in problem.law.terms if term.name in CODES]
    if problem.law.kind == "elastic" or len(codes) > 1:
        raise SimulationError(
            f"simulation: law {problem.law.name}: expected one of {', '.join(CODES)}, each with place, speed and frame "
            "damping; got another; do: leave the solver to choose"
        )
    return codes[0] if codes else (layout.COULOMB, ())


def _scale(problem: Problem) -> tuple[float, ...]:
    """What counts as small of z, v and the inner states: errors are relative to this and the state's own size."""
    reach = problem.force_size * min(1.0, 1.0 / problem.r**2)
    inner = problem.beta
    if problem.law.has("lugre"):
        inner /= problem.parameter("stiffness_ratio")
    return reach, reach / min(1.0, problem.r), inner or 1.0, 1.0


def contacts_of(problem: Problem, sides: FloatArray, states: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Force of the contact on the mass and its slip at states (m, 4) of phases of given sides, by the kernel's formula.

    At rest, side 0, neither is known from the state: both are 0 here.
    """
    engine = compiled() if compiled.cache_info().currsize else plain()
    force, slip = engine.zeros(len(sides)), engine.zeros(len(sides))
    engine.kernel.contacts(_rig(problem), engine.flat(sides), engine.flat(states), force, slip)
    return np.array(force), np.array(slip)
