"""A steady state: its numbers, its verdict as a sentence, and what the numbers alone would not say."""

from dataclasses import dataclass
from math import isfinite, nan, pi
from typing import Any, Literal, NamedTuple

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.schema import AMPLITUDE, ENERGY, STOPS, Result, attribute_of, value_of
from frictionlab.simulator import row as places
from frictionlab.simulator.motion import Motion
from frictionlab.simulator.notes import notes_of, sentences
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.structure import Structure, frame_of

Solver = Literal["auto", "closed-form", "exact", "numeric", "thesis"]
Outcome = Literal["periodic", "stuck", "unbounded", "not settled", "not found"]
Regime = Literal["continuous", "stick-slip", "stuck"]

OUTCOMES: dict[int, Outcome] = {
    places.PERIODIC: "periodic",
    places.STUCK: "stuck",
    places.UNBOUNDED: "unbounded",
    places.NOT_FOUND: "not found",
    **dict.fromkeys((places.CHATTERED, places.RUNAWAY, places.PULLING, places.COSTLY), "not found"),
}
SOLVERS = ("exact", "closed-form", "numeric")  # what the number SOLVER of a row says
PARAMETERS = ("r", "beta", "mu", "zeta", "wall")
NUMBERS = {  # of a state: their places in a row, if they have one
    ENERGY: places.ENERGY,
    AMPLITUDE: places.AMPLITUDE,
    STOPS: places.STOPS,
    "stuck_fraction": places.STUCK_SHARE,
    "regime": None,
    "symmetric": places.SYMMETRIC,
    "period_cycles": places.PERIOD,
    "floquet_multiplier": places.MULTIPLIER,
    "closure_error": places.CLOSURE,
    "residual": places.MISS,
    f"contact_{ENERGY}": places.CONTACT_ENERGY,
    f"frame_{ENERGY}": places.FRAME_ENERGY,
    "warnings": None,
}
PLACES = {key: place for key, place in NUMBERS.items() if place is not None}
ATTRIBUTES = {attribute_of(key): place for key, place in PLACES.items()}
KEYS = (*PARAMETERS, "solver", "outcome", *NUMBERS)
CREEP = 1e-10  # Y in a cycle: a contact that slips no further is at rest, at the edge of where it holds
SETTLED = 1e-6  # a cycle repeats if its end misses its start by less than this share of its size


class ContactNumbers(NamedTuple):
    """What a contact does in a cycle: energy over k_1 Y^2, stops, share of the time without slip."""

    mass: int
    against: int | str
    law: str
    energy_per_cycle: float | None
    stops_per_cycle: float | None
    stuck_fraction: float | None


@dataclass(frozen=True)
class SteadyState(Result):
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
        Area of the loop of base over mass displacement per cycle, over k Y^2: the integral of f dx, eq. (2.18).
    contact_energy_per_cycle, frame_energy_per_cycle : float or None
        What contacts take per cycle, and what the frame's dashpots do, over k Y^2.
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
    notes : int
        What the numbers do not say: `notes.Note` as bits; `warnings` are their sentences.
    orbit : Motion or None
        The motion over one period, of all masses.
    structure : Structure or None
        What moves, where that is several masses or contacts: `problem` and the numbers above are those of the first
        mass and contact then.
    response_amplitudes : tuple of float
        Of a structure: (max - min) / 2 of each mass's displacement over Y.
    contacts : tuple of ContactNumbers
        Of a structure: what each contact does.
    """

    problem: Problem
    solver: str
    outcome: Outcome
    energy_per_cycle: float | None = None
    contact_energy_per_cycle: float | None = None
    frame_energy_per_cycle: float | None = None
    response_amplitude: float | None = None
    stops_per_cycle: float | None = None
    stuck_fraction: float | None = None
    regime: Regime | None = None
    symmetric: bool | None = None
    period_cycles: int | None = None
    floquet_multiplier: float | None = None
    closure_error: float | None = None
    residual: float | None = None
    notes: int = 0
    orbit: Motion | None = None
    structure: Structure | None = None
    response_amplitudes: tuple[float, ...] = ()
    contacts: tuple[ContactNumbers, ...] = ()

    @property
    def energy_taken(self) -> float | None:
        """What the contact and both dashpots take per cycle, over k Y^2."""
        contact, frame = self.contact_energy_per_cycle, self.frame_energy_per_cycle
        return None if contact is None or frame is None else contact + frame

    @property
    def memory(self) -> float:
        """Share of a disturbance that is left after one cycle, by the Floquet multiplier; 1: it never dies out."""
        return float(abs(self.floquet_multiplier or 0.0) ** (1.0 / max(self.period_cycles or 1, 1)))

    def __repr__(self) -> str:
        return f"<SteadyState r = {self.problem.r:g}, {self.problem.law.name}: {self.verdict}>"

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences about what the numbers do not say."""
        return sentences(self)

    @property
    def verdict(self) -> str:
        """What was found, as a sentence."""
        if self.outcome == "unbounded":
            return "There is no steady state: the drive is exactly at resonance and friction too weak to bound it."
        if self.outcome == "not found":
            return "No orbit is given: " + (self.warnings[0] if self.warnings else "none was found from rest.")
        if self.outcome == "stuck" and self.problem.law.kind == "inner":
            lost = f"{self.energy_per_cycle:.10g} k Y^2 per cycle ({self.solver})"
            return f"The contact holds all the time: it yields, and creeps more slowly than a stop may: {lost}."
        if self.outcome == "stuck" and self.problem.law.kind == "elastic":
            return "The contact never slips: it only yields elastically, and holds at the largest force on it."
        problem = self.problem
        held = problem.beta * max(min(problem.static_ratios), problem.parameter("static_ratio", 1.0))
        if self.outcome == "stuck" and held < problem.force_size:
            return (
                "The mass comes to rest displaced, where static friction holds it against the force in both directions."
            )
        if self.outcome == "stuck":
            return "The mass never moves: static friction holds it against the largest force."
        period = "cycle" if self.period_cycles == 1 else f"{self.period_cycles} cycles"
        kept = "has not repeated yet" if self.outcome == "not settled" else f"repeats every {period}"
        said = "1 stop" if self.stops_per_cycle == 1.0 else f"{self.stops_per_cycle:g} stops"
        stops = f" with {said} per cycle" if self.stops_per_cycle else ""
        what = f"{self.regime}{stops}, {self.energy_per_cycle:.10g} k Y^2 per cycle ({self.solver})"
        has_twin = self.symmetric is False and (self.structure or problem).has_mirror_image
        return f"The motion {kept}: {what}{'; so does its mirror image, counted with it' if has_twin else ''}."

    def row(self) -> dict[str, object]:
        """Return the contract's keys of a steady state with their values; what does not exist is None."""
        problem, contacts = self.problem, self.contacts
        amplitudes: list[float | None] = list(self.response_amplitudes)
        if self.structure is None:
            named = (1, "base" if problem.wall == "base" else "wall", problem.law.name)
            numbers = (self.contact_energy_per_cycle, self.stops_per_cycle, self.stuck_fraction)
            contacts, amplitudes = (ContactNumbers(*named, *numbers),), [self.response_amplitude]
        row: dict[str, object] = {key: getattr(problem, key) for key in PARAMETERS}
        row |= {key: value_of(self, key) for key in ("solver", "outcome", *NUMBERS)}
        return row | {
            "law": problem.law.name if contacts else None,
            "parameters": problem.parameters if contacts else {},
            "response_amplitudes": amplitudes,
            "contacts": [contact._asdict() for contact in contacts],
        }


def from_numbers(problem: Problem, row: FloatArray, **known: Any) -> SteadyState:
    """Turn a row of numbers into a steady state; what is `known` goes before what the row says."""
    numbers: list[float] = row.tolist()  # Python's own are faster one by one
    if "notes" not in known:
        values = problem.parameters | {"r": problem.r}
        rigid = problem.law.kind == "rigid"
        known["notes"] = int(notes_of(values, problem.wall, problem.base, numbers, rigid=rigid))
    said: dict[str, Any] = {key: number for key, at in ATTRIBUTES.items() if isfinite(number := numbers[at])}
    said["outcome"], said["solver"] = OUTCOMES[int(numbers[places.OUTCOME])], "exact"
    if said["outcome"] in ("periodic", "stuck"):
        said["solver"] = SOLVERS[int(numbers[places.SOLVER])]
        said["regime"] = "stick-slip" if numbers[places.STOPS] > 0.0 else "continuous"
        said["regime"] = "stuck" if said["outcome"] == "stuck" else said["regime"]
        said["symmetric"], said["period_cycles"] = bool(said["symmetric"]), int(said["period_cycles"])
    return SteadyState(problem, **said | known)


def to_numbers(state: SteadyState) -> list[float]:
    """Return a steady state as a row of numbers, as far as a map needs it: the other way round than `from_numbers`."""
    row = [nan] * places.ROW
    code = {outcome: number for number, outcome in reversed(OUTCOMES.items())}
    row[places.OUTCOME] = float(code[state.outcome])
    row[places.SOLVER] = float(SOLVERS.index(state.solver))
    for name, position in ATTRIBUTES.items():
        value = getattr(state, name)
        row[position] = nan if value is None else float(value)
    row[places.NOTES] = float(state.notes)
    return row


def numbers_of(motion: Motion) -> dict[str, Any]:
    """Return what a motion of whole cycles says of a steady state, by the names of `SteadyState`.

    `response_amplitudes` and `contacts` are of all masses and contacts, the others of the first ones.
    """
    frame, sums, contacts = frame_of(motion.flow.what), motion.sums, []
    cycles = round((motion.end - motion.start) / (2.0 * pi))
    taken = sums["contact"][: len(frame.contacts)] / cycles
    loop, contact, lost = float(sums["loop"]) / cycles, float(taken.sum()), float(sums["frame"]) / cycles
    follows = any(known.against == "base" for known in frame.contacts)
    if motion.periodic and frame.masses == 1 and not follows and not frame.damping.any():
        loop = contact  # it encloses what is taken
    for number, known in enumerate(frame.contacts):
        stops = motion.stops_of(number)
        goes_on = not motion.periodic and bool(np.any(stops[:1, 0] <= motion.start + 1e-12))
        begun = len(stops) - goes_on
        stuck = float(np.sum(stops[:, 1] - stops[:, 0])) / (motion.end - motion.start)
        holds = stuck > 1.0 - 1e-12 or taken[number] <= CREEP * known.beta
        named = (known.mass, known.against, known.law.name, float(taken[number]))
        contacts.append(ContactNumbers(*named, *((0.0, 1.0) if holds else (begun / cycles, stuck))))
    amplitudes = tuple((0.5 * (sums["high"] - sums["low"])[: frame.masses]).tolist())
    sticks = any(each.stops_per_cycle or each.stuck_fraction == 1.0 for each in contacts)
    is_stuck = bool(contacts) and all(each.stuck_fraction == 1.0 for each in contacts)
    return {
        "energy_per_cycle": loop,
        "contact_energy_per_cycle": contact,
        "frame_energy_per_cycle": lost,
        "closure_error": abs(float(sums["gap"])) / cycles,
        "response_amplitude": amplitudes[0],
        "response_amplitudes": amplitudes,
        "orbit": motion,
        "contacts": tuple(contacts),
        "stops_per_cycle": contacts[0].stops_per_cycle if contacts else None,
        "stuck_fraction": contacts[0].stuck_fraction if contacts else None,
        "regime": "stuck" if is_stuck else "stick-slip" if sticks else "continuous",
    }
