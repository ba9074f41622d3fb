"""The numeric kernel ready to run, plain or compiled, and a problem in the form that it takes."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from math import hypot
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SimulationError
from frictionlab.simulator.engine import Engine, as_it_stands, compile_modules, machine_code_folder
from frictionlab.simulator.laws import bouc_wen, dahl, logarithm, lugre, rate_state, stribeck
from frictionlab.simulator.meter import Meter
from frictionlab.simulator.numeric import accounts, contact, layout, phases, step, tableau, travel
from frictionlab.simulator.problem import Problem

__all__ = [
    "LostError",
    "Machine",
    "Spent",
    "compiled",
    "forces_of",
    "is_ready",
    "machine_of",
    "plain",
    "slips_in_jumps",
]

FORMULAS = {
    stribeck: ("stribeck_factor",),
    logarithm: ("logarithm_factor",),
    dahl: ("dahl_flow",),
    bouc_wen: ("bouc_wen_flow",),
    lugre: ("lugre_curve", "lugre_flow"),
    rate_state: ("rate_state_slip", "rate_state_age"),
}
MODULES = (contact, step, phases, accounts, travel)  # each uses only those before it
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
Floats = NDArray[np.float64]
FIRST = 0.3  # rad of the faster of drive's harmonics and free vibration: first step tried
CAP_PLAIN, CAP = 20_000, 3_000_000  # steps before plain Python, and before the compiled kernel, give up


class Spent(Exception):  # noqa: N818 - no error: plain Python hands over to the compiled kernel
    """The steps allowed are used up."""


class LostError(SimulationError):
    """From this state the motion cannot be carried on: friction turns negative, or steps become too short."""


@dataclass(frozen=True)
class Machine:
    """A problem in the kernel's form: its functions, numbers and buffers; ``meter``: where its steps are booked."""

    kernel: Any
    buffer: Callable[[tuple[float, ...]], Any]
    problem: Problem
    rig: layout.Rig
    force: Any
    table: Any
    room: Any
    meter: Meter | None = None

    @property
    def size(self) -> int:
        """Components of the state: z, v and the contact's own."""
        return int(self.rig[13])

    def put(self, state: Floats) -> None:
        """Set the state; its slopes over itself are then 1, and steps begin as if nothing had gone before."""
        self.room[layout.TALLY][layout.LENGTH] = FIRST * min(self.problem.r, 1.0) / self.problem.base.harmonics
        padded = (*state.tolist(), *((0.0,) * (layout.WIDTH - self.size)))
        self.room[layout.STATE][:] = self.buffer(padded)
        self.room[layout.SLOPES][:] = self.buffer(tuple(np.eye(layout.WIDTH).ravel().tolist()))

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
        before = self.room[layout.TALLY][layout.STEPS]
        code = self.kernel.carry(self.rig, self.force, self.table, self.room, (tau, span, slopes))
        if self.meter is not None:
            self.meter.take(float(self.room[layout.TALLY][layout.STEPS] - before))
        if code == layout.TOO_MANY:
            raise Spent
        if code != layout.FINE:
            raise LostError(_lost(self.problem, code))

    def rest_state(self, tau: float = 0.0) -> Floats:
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
        return self.rig[0] < layout.DAHL


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


def machine_of(problem: Problem, rtol: float, *, fast: bool, rows: int = 0) -> Machine:
    """Set up a problem for the plain or the compiled kernel.

    Parameters
    ----------
    problem : Problem
    rtol : float
        Tolerance of a step, over the size of each component.
    fast : bool
        Whether to take the compiled kernel.
    rows : int
        Space for so many recorded steps.

    Raises
    ------
    SimulationError
        The law is none that this solver knows.
    """
    engine = compiled() if fast else plain()
    buffer = engine.buffer
    sizes = (*layout.SIZES[:-1], rows * layout.ROW)
    room = tuple(buffer((0.0,) * size) for size in sizes)
    room[layout.SCALE][:] = buffer(_scale(problem))
    tally = room[layout.TALLY]
    tally[layout.TOLERANCE] = rtol
    tally[layout.BUDGET] = CAP if fast else CAP_PLAIN
    table = tuple(buffer(part) for part in (tableau.NODES, tableau.WEIGHTS, tableau.STAGES, tableau.BERNSTEIN))
    force = tuple(buffer(part) for part in _force(problem))
    return Machine(engine.kernel, buffer, problem, _rig(problem), force, table, room)


def _rig(problem: Problem) -> layout.Rig:
    """The numbers of a problem in the kernel's order."""
    code, names = _code(problem)
    own = [problem.parameter(name) for name in names]
    up, down = problem.static_ratios
    if code == layout.STRIBECK:
        up = down = own[0]
    size = 2 if code < layout.DAHL else 4 if code == layout.RATE_STATE else 3
    sizes = [hypot(c, s) for c, s in zip(*problem.force, strict=True)]
    first, second = (sum(k**n * c for k, c in enumerate(sizes, 1)) for n in (1, 2))
    return (
        *(float(code), problem.r, problem.beta, problem.parameter("gradient"), problem.zeta),
        *(problem.frame_damping_ratio, *own, *((0.0,) * (5 - len(own)))),
        *(up, down, float(size), 2.0 if code == layout.RATE_STATE else 1.0, first, second, _narrow(problem)),
    )


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


def _force(problem: Problem) -> tuple[tuple[float, ...], ...]:
    """F; f for the frame's dashpot; f for the displacement of the mass; G of the power put in."""
    f, fixed = (problem.base.cosine, problem.base.sine), problem.wall == "fixed"
    lead = [2.0 * problem.frame_damping_ratio * problem.r * k for k in range(1, problem.base.harmonics + 1)]
    put_in = (
        tuple(c - each * s for c, s, each in zip(*f, lead, strict=True)),
        tuple(s + each * c for c, s, each in zip(*f, lead, strict=True)),
    )
    none: tuple[tuple[float, ...], ...] = ((), ())
    return (
        *problem.force,
        *(f if fixed and problem.frame_damping_ratio else none),
        *(none if fixed else f),
        *(put_in if fixed else problem.force),
    )


def forces_of(problem: Problem, sides: Floats, states: Floats) -> Floats:
    """Force of the contact on the mass at states (m, 4) of phases of given sides, by the plain kernel's own formula."""
    rig, out = _rig(problem), [0.0] * len(sides)
    plain().kernel.forces(rig, sides.tolist(), states.ravel().tolist(), out)
    return np.array(out)
