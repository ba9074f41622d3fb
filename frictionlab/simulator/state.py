"""A steady state: its numbers, its verdict as a sentence, and what the numbers alone would not say."""

from dataclasses import dataclass
from math import isfinite, nan
from typing import Any, Literal

from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.settle import LONGEST, PATIENCE
from frictionlab.simulator.motion import Motion
from frictionlab.simulator.problem import Problem

__all__ = ["KEYS", "Outcome", "Regime", "Solver", "SteadyState", "from_numbers", "outcome_of", "regime_of", "still_far"]

Solver = Literal["auto", "closed-form", "exact", "numeric", "thesis"]
Outcome = Literal["periodic", "stuck", "unbounded", "not settled", "not found"]
Regime = Literal["continuous", "stick-slip", "stuck"]

OUTCOMES: dict[int, Outcome] = {
    layout.PERIODIC: "periodic",
    layout.STUCK: "stuck",
    layout.UNBOUNDED: "unbounded",
    layout.NOT_FOUND: "not found",
    layout.CHATTERED: "not found",
    layout.RUNAWAY: "not found",
    layout.PULLING: "not found",
    layout.PARTING: "not found",
    layout.COSTLY: "not found",
}
SOLVERS = ("exact", "closed-form", "numeric")  # what the number CLOSED_FORM of a row says
DECLINED = {
    layout.RUNAWAY: "gradient: beta |gradient| >= 1: friction changes along the path faster than the spring's force "
    "and the mass runs away; this is not computed: take a smaller gradient.",
    layout.PULLING: "gradient: on this motion the mass goes where the friction force beta (1 + gradient z) is below 0, "
    "which no contact does; no numbers are given: take a smaller gradient.",
}
LOOSE = 1e-10  # relative closure error above which it is said
ROUNDING = 1e-14  # of the force times the amplitude: what rounding leaves of the work put in
PARAMETERS = ("r", "beta", "mu", "zeta", "wall")
NUMBERS = (
    "energy_per_cycle",
    "response_amplitude",
    "stops_per_cycle",
    "stuck_fraction",
    "regime",
    "symmetric",
    "period_cycles",
    "floquet_multiplier",
    "closure_error",
)
PLACES = {  # number of a state: its place in a kernel's row
    "energy_per_cycle": layout.ENERGY,
    "response_amplitude": layout.AMPLITUDE,
    "stops_per_cycle": layout.STOPS,
    "stuck_fraction": layout.STUCK_SHARE,
    "symmetric": layout.SYMMETRIC,
    "period_cycles": layout.PERIOD,
    "floquet_multiplier": layout.MULTIPLIER,
    "closure_error": layout.CLOSURE,
}
KEYS = (*PARAMETERS, "solver", "outcome", *NUMBERS)


@dataclass(frozen=True)
class SteadyState:
    """A steady state and what is known about it; numbers that do not exist are None.

    Parameters
    ----------
    problem : Problem
        What moves.
    solver : str
        What answered: "closed-form", "exact", "numeric" or "thesis".
    outcome : str
        "periodic", "stuck" (the contact never slips), "unbounded" (no steady state), "not settled" or "not found".
    energy_per_cycle : float or None
        Energy per cycle over k Y^2: friction beta * path, plus the dashpot's (2.18, 3.7); of a motion that has not
        settled, the energy put in (2.18).
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
    orbit : Motion or None
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
    orbit: Motion | None = None

    def __repr__(self) -> str:
        return f"<SteadyState r = {self.problem.r:g}, {self.problem.law.name}: {self.verdict}>"

    @property
    def verdict(self) -> str:
        """What was found, as a sentence."""
        if self.outcome == "unbounded":
            return "There is no steady state: the drive is exactly at resonance and friction too weak to bound it."
        if self.outcome == "not found":
            return "No orbit is told: " + (self.warnings[0] if self.warnings else "none was found from rest.")
        if self.outcome == "stuck" and self.problem.law.kind == "inner":
            lost = f"{self.energy_per_cycle:.10g} k Y^2 per cycle ({self.solver})"
            return f"The contact holds all the time: it yields, and creeps more slowly than a stop may: {lost}."
        if self.outcome == "stuck" and self.problem.law.kind == "elastic":
            return "The contact never slips: it only yields elastically, and holds at the largest force on it."
        if self.outcome == "stuck" and hold_of(self.problem) < self.problem.force_size:
            return (
                "The mass comes to rest displaced, where static friction holds it against the force in both directions."
            )
        if self.outcome == "stuck":
            return "The mass never moves: static friction holds it against the largest force."
        kept = (
            "has not repeated yet" if self.outcome == "not settled" else f"repeats every {_cycles(self.period_cycles)}"
        )
        stops = f" with {self.stops_per_cycle:g} stops per cycle" if self.stops_per_cycle else ""
        return f"The motion {kept}: {self.regime}{stops}, {self.energy_per_cycle:.10g} k Y^2 per cycle ({self.solver})."

    def row(self) -> dict[str, object]:
        """Return the contract's keys of a steady state with their values; what does not exist is None."""
        values: dict[str, object] = {key: getattr(self.problem, key) for key in PARAMETERS}
        return values | {key: getattr(self, key) for key in ("solver", "outcome", *NUMBERS)}


def hold_of(problem: Problem) -> float:
    """Return the largest force over k Y that holds a mass at rest in both directions, where z = 0."""
    return problem.beta * max(min(problem.static_ratios), problem.parameter("static_ratio", 1.0))


def _cycles(count: int | None) -> str:
    """Return a number of cycles in words."""
    return "cycle" if count == 1 else f"{count} cycles"


def outcome_of(row: Any) -> Outcome:
    """Return the outcome of a kernel's row."""
    return OUTCOMES[int(row[layout.OUTCOME])]


def regime_of(row: Any) -> Regime | None:
    """Return the regime of a kernel's row."""
    outcome = outcome_of(row)
    if outcome not in ("periodic", "stuck"):
        return None
    if outcome == "stuck":
        return "stuck"
    return "stick-slip" if row[layout.STOPS] > 0.0 else "continuous"


def from_numbers(problem: Problem, row: Any, orbit: Motion | None) -> SteadyState:
    """Turn a kernel's row into a steady state."""
    outcome = outcome_of(row)
    if outcome not in ("periodic", "stuck"):
        return SteadyState(problem, "exact", outcome, warnings=why_none(problem, row))
    multiplier = float(row[layout.MULTIPLIER])
    said = warnings_of(problem, outcome, multiplier, awaited=row[layout.UNAWAITED] != 1.0)
    rounding = ROUNDING * problem.force_size * float(row[layout.AMPLITUDE])
    off = max(0.0, float(row[layout.CLOSURE]) - rounding) / float(row[layout.ENERGY]) if row[layout.ENERGY] else 0.0
    if off > LOOSE:
        said += (
            f"So close to resonance or rest, numbers are good to about {off:.0e} only: energies in and out differ so.",
        )
    return SteadyState(
        problem=problem,
        solver=SOLVERS[int(row[layout.CLOSED_FORM])],
        outcome=outcome,
        energy_per_cycle=float(row[layout.ENERGY]),
        response_amplitude=float(row[layout.AMPLITUDE]),
        stops_per_cycle=float(row[layout.STOPS]),
        stuck_fraction=float(row[layout.STUCK_SHARE]),
        regime=regime_of(row),
        symmetric=bool(row[layout.SYMMETRIC]),
        period_cycles=int(row[layout.PERIOD]),
        floquet_multiplier=multiplier,
        closure_error=float(row[layout.CLOSURE]),
        residual=float(row[layout.MISS]),
        warnings=said,
        orbit=orbit,
    )


def why_none(problem: Problem, row: Any) -> tuple[str, ...]:
    """Return why there are no numbers, a sentence each."""
    code = int(row[layout.OUTCOME])
    if code in DECLINED:
        return (DECLINED[code],)
    if code == layout.PARTING:
        said = (
            "the motion does not repeat: motions beside it move apart, in the mean by a factor of "
            f"{float(row[layout.MISS]):.3g} in each cycle (chaos). --cycles N tells the last of N cycles, and --all "
            "whether other starts settle."
        )
        return (said,)
    if code == layout.COSTLY:
        return (_costly(float(row[layout.MISS])),)
    alone = problem.mu == 1.0 and not problem.parameter("gradient") and problem.law.kind == "rigid"
    if code == layout.NOT_FOUND and not alone:
        if problem.law.kind != "rigid":
            return ("the motion from rest was not seen to settle on an orbit; --cycles N tells the last of N cycles.",)
        return (f"within {PATIENCE} cycles the motion has not settled on an orbit of up to {LONGEST} cycles.",)
    return ()


def _costly(miss: float) -> str:
    """Say of a search that was given up why, and how far it came."""
    near = f" When it was, the motion missed itself by {miss:.1g} Y." if isfinite(miss) and miss > 0.0 else ""
    return (
        "the search was given up after a second of work: this motion makes thousands of slides in a cycle, or is "
        f"braked so little that it takes too long to settle.{near} --cycles N tells the last of N cycles; with more "
        "friction or damping, or a larger r, there is less to do."
    )


def to_numbers(state: SteadyState) -> list[float]:
    """Return a steady state as a kernel's row, as far as a map needs it: the other way round than `from_numbers`."""
    row = [nan] * layout.ROW
    code = {outcome: number for number, outcome in reversed(OUTCOMES.items())}
    row[layout.OUTCOME] = float(code[state.outcome])
    row[layout.CLOSED_FORM] = float(SOLVERS.index(state.solver))
    for key, position in PLACES.items():
        value = getattr(state, key)
        row[position] = nan if value is None else float(value)
    return row


def still_far(cycles: int) -> str:
    """Say of an orbit that the run from rest has not shown to go there."""
    return (
        f"This motion is stable, but the run from rest was still far from it after {cycles} cycles: rest may settle on "
        "another."
    )


def warnings_of(
    problem: Problem, outcome: Outcome, multiplier: float | None, *, awaited: bool = True
) -> tuple[str, ...]:
    """Return what the numbers do not say, a sentence each; awaited: the run from rest was seen to go there."""
    said = []
    if outcome == "periodic" and problem.beta == 0.0 and problem.zeta == problem.frame_damping_ratio == 0.0:
        said.append("Nothing damps this oscillator: free vibration never dies out, and this is the motion without any.")
    elif outcome == "periodic" and in_continuum(problem):
        n = round(0.5 / problem.r)
        said.append(
            f"At r = 1/{2 * n} with beta <= 1/(4 n^2 - 1) a continuum of asymmetric motions (3.3) has the same energy "
            "and amplitude; this is the symmetric one. A run from rest creeps towards its edge like N^(-1/2)."
        )
    elif outcome == "periodic" and multiplier is not None and 1.0 - abs(multiplier) < 1e-3:
        lasts = f"{1.0 / (1.0 - abs(multiplier)):.1g}" if abs(multiplier) < 1.0 else "endlessly many"
        said.append(f"The motion forgets its start slowly: a disturbance lasts {lasts} periods.")
    if outcome == "periodic" and not awaited:
        said.append(still_far(PATIENCE))
    elif problem.mu > 1.0 and outcome == "periodic":
        said.append("With static friction (mu > 1) other motions may coexist; this is the one that rest settles on.")
    if outcome == "stuck" and problem.mu > 1.0 and problem.beta < problem.force_size:
        said.append("A motion once begun might go on: kinetic friction alone does not hold the mass.")
    return tuple(said)


def in_continuum(problem: Problem) -> bool:
    """Tell whether the problem lies on the continuum of asymmetric motions, eq. (3.3)."""
    n = round(0.5 / problem.r)
    plain = problem.base.harmonics == 1 and problem.zeta == problem.frame_damping_ratio == 0.0 and problem.mu == 1.0
    if n < 1 or not plain or problem.parameter("gradient") or abs(problem.r * 2 * n - 1.0) > 1e-12:
        return False
    return problem.beta <= problem.force_size / (4 * n * n - 1)
