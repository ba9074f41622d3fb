"""The exact flow as Python calls it: steady states and motions of one mass or many, by linear phases between events."""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, inf, nan, pi
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator import row as places
from frictionlab.simulator.compiled import announce, record_of
from frictionlab.simulator.exact import answer, orbit
from frictionlab.simulator.exact.account import NUMBERS, evaluate_all
from frictionlab.simulator.exact.motion import WORK
from frictionlab.simulator.exact.phase import (
    CHATTER,
    CONTACTS,
    DONE,
    HARMONICS,
    MASSES,
    MISSING,
    PULLS,
    SLIDERS,
    SLOTS,
    STEEP,
    SYSTEM,
    TIRED,
    make_phase,
)
from frictionlab.simulator.meter import EXACT_STATE, LOOKS, Meter
from frictionlab.simulator.motion import Motion, Timeline, cycles_of
from frictionlab.simulator.notes import SLOW, Note
from frictionlab.simulator.problem import Base, Problem
from frictionlab.simulator.state import ContactNumbers, Outcome, SteadyState, from_numbers, of_contacts
from frictionlab.simulator.structure import Contact, Structure

announce("frictionlab.simulator.exact.answer")

TURN = 2.0 * pi
TOUCH = 1e-13  # rad: a shorter stick is no stop
CREEP = 1e-10  # Y in a cycle: a contact that slips no further is at rest, at the edge of where it holds
PIECES = 512  # recorded at first
MOST_PIECES = 1 << 22
CLOSED = {"auto": answer.AUTO, "closed-form": answer.CLOSED_ONLY, "exact": answer.NEVER_CLOSED}
_OWN = threading.local()


def iwan_sliders(stiffness: float, beta: float, count: int, chi: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return stiffness and strength of sliders whose slip lengths phi have the density R phi^chi up to phi_max.

    Total stiffness and strength are those of the whole distribution, ``kappa = R phi_max^(chi + 1) / (chi + 1)`` and
    ``beta = R phi_max^(chi + 2) / (chi + 2)`` (D. J. Segalman's four-parameter model without its jump, -1 < chi <= 0).
    It is cut at ``phi_max (i / N)^(2 / (chi + 2))``; each piece becomes one slider with the piece's own stiffness and
    strength. So the force of a first loading is met exactly at each cut, and its largest error between two is about the
    same in all pieces: ``beta / (2 (chi + 2) N^2)``.

    Examples
    --------
    >>> stiffness, strength = iwan_sliders(100.0, 0.4, 4, 0.0)
    >>> stiffness, [round(share, 6) for share in strength]
    ((25.0, 25.0, 25.0, 25.0), [0.025, 0.075, 0.125, 0.175])
    """
    cuts = [(i / count) ** (2.0 / (chi + 2.0)) for i in range(count + 1)]
    springs = [cut ** (chi + 1.0) for cut in cuts]
    limits = [cut ** (chi + 2.0) for cut in cuts]
    return (
        tuple(stiffness * (springs[i + 1] - springs[i]) for i in range(count)),
        tuple(beta * (limits[i + 1] - limits[i]) for i in range(count)),
    )


def sliders_of(numbers: Mapping[str, float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return stiffness and friction force of a contact's elastic sliders, by its parameters; none: it is rigid."""
    stiffness, beta = numbers.get("stiffness_ratio"), numbers["beta"]
    if stiffness is None:
        return (), ()
    if "sliders" in numbers:
        return iwan_sliders(stiffness, beta, round(numbers["sliders"]), numbers["chi"])
    return (stiffness,), (beta,)


def system_of(what: Problem | Structure) -> Any:
    """Return a problem, or a structure, as the compiled flow takes it: a record in an array of length 1.

    Refuses more masses, contacts, sliders or harmonics than there is space for, and what rigid contacts hold twice
    over.
    """
    if isinstance(what, Problem):
        values = what.parameters | {"r": what.r}
        return systems_of({name: np.array([value]) for name, value in values.items()}, what.wall, what.base)
    r, n, contacts = what.r, what.masses, what.contacts
    rows = np.array([what.row(contact) for contact in contacts]).reshape(-1, n)
    follow = np.array([float(contact.against == "base") for contact in contacts])
    dashpot = np.array([2.0 * r * contact.parameter("contact_damping_ratio") for contact in contacts])
    _refuse_more("masses", n, MASSES)
    _refuse_more("contacts", len(contacts), CONTACTS)
    systems = record_of(SYSTEM)
    system = systems[0]
    system["masses"], system["contacts"], system["r"] = n, len(contacts), r
    for number, contact in enumerate(contacts):
        _set_sliders(system, number, contact.parameters if contact.law.kind == "elastic" else {"beta": contact.beta})
        system["limit"][number], system["gradient"][number] = contact.beta, contact.parameter("gradient")
        system["up"][number], system["down"][number] = contact.static_ratios
    rigid = [i for i, contact in enumerate(contacts) if contact.law.kind in ("rigid", "smooth")]
    bound = np.column_stack((rows, follow))[rigid]
    if len(bound) and np.linalg.matrix_rank(bound) < len(bound):
        raise SimulationError(
            "structure: rigid contacts hold a mass twice over, and what each carries is not determined; do: give"
            " one of them the term compliance"
        )
    _set_base(systems, what.base)
    system["row"][: len(rows), :n], system["follow"][: len(rows)], system["dashpot"][: len(rows)] = (
        rows,
        follow,
        dashpot,
    )
    system["inertia"][:n, :n] = r * r * what.mass
    system["mobility"][:n, :n] = np.linalg.inv(r * r * what.mass)
    system["damping"][:n, :n] = r * what.damping + rows.T @ (dashpot[:, None] * rows)
    system["stiffness"][:n, :n] = what.stiffness
    system["push"][:n, 0] = what.stiffness.sum(axis=1)
    system["push"][:n, 1] = r * what.damping.sum(axis=1) + rows.T @ (dashpot * follow)
    return systems


def systems_of(values: Mapping[str, FloatArray], wall: str, base: Base) -> Any:
    """Return problems of one law, whose numbers (k,) are given by name, as the compiled flow takes them (k,)."""
    r, moves = values["r"], float(wall == "base")
    contact, frame = values.get("contact_damping_ratio", 0.0), values.get("frame_damping_ratio", 0.0)
    systems = record_of(SYSTEM, len(r))
    systems["masses"], systems["contacts"], systems["r"] = 1, 1, r
    systems["row"][:, 0, 0], systems["follow"][:, 0] = 1.0, moves
    systems["dashpot"][:, 0], systems["damping"][:, 0, 0] = 2.0 * contact * r, 2.0 * (contact + frame) * r
    systems["inertia"][:, 0, 0], systems["mobility"][:, 0, 0] = r * r, 1.0 / (r * r)
    systems["stiffness"][:, 0, 0], systems["push"][:, 0, 0] = 1.0, 1.0
    systems["push"][:, 0, 1] = 2.0 * (frame + contact * moves) * r
    systems["limit"][:, 0], systems["gradient"][:, 0] = values["beta"], values.get("gradient", 0.0)
    systems["up"][:, 0], systems["down"][:, 0] = (values.get(f"static_ratio_{way}", 1.0) for way in ("up", "down"))
    _set_base(systems, base)
    if "stiffness_ratio" in values:
        for k in range(len(r)):
            _set_sliders(systems[k], 0, {name: float(numbers[k]) for name, numbers in values.items()})
    return systems


def feel_acceleration(systems: Any) -> None:
    """Change a system's coordinates to those relative to the base, which then drives by its acceleration."""
    n = int(systems[0]["masses"])
    systems["push"][0, :n, 0], systems["push"][0, :n, 1] = -systems["inertia"][0, :n, :n].sum(axis=1), 0.0
    systems["follow"][:] = 0.0


def _set_base(systems: Any, base: Base) -> None:
    _refuse_more("harmonics of the base", base.harmonics, HARMONICS)
    systems["harmonics"] = base.harmonics
    systems["lines"][:, : base.harmonics] = base.lines


def _set_sliders(system: Any, contact: int, numbers: Mapping[str, float]) -> None:
    """Write the sliders of a contact, after those of the contacts before it."""
    springs, strengths = sliders_of(numbers)
    first = int(system["first"][contact])
    last = first + len(springs)
    _refuse_more("sliders", last, SLIDERS)
    system["spring"][first:last], system["strength"][first:last] = springs, strengths
    system["first"][contact + 1] = system["sliders"] = last


def _refuse_more(name: str, count: int, most: int) -> None:
    if count > most:
        raise SimulationError(f"structure: {name}; expected at most {most}; got {count}; do: leave some out")


@dataclass(frozen=True)
class Trajectory(Motion):
    """A motion of one mass or many, piece by piece: exact between its events.

    `systems`: a record of `SYSTEM` in an array. `recorded` (m, 2 + 2 n + 3 c): of each piece start (rad, within its
    cycle) and duration; at its start displacements and velocities; of each contact tangent stiffness, constant force,
    and direction of slip (0: it holds). `mirror`: the mirrored half of a cycle follows. `first`: the cycle it begins
    with.
    """

    problem: Problem
    systems: Any
    recorded: FloatArray
    periodic: bool
    mirror: bool = False
    first: int = 0
    solver: ClassVar[str] = "exact"

    @cached_property
    def rows(self) -> FloatArray:
        """All pieces, as `recorded` has them."""
        rows = self.recorded + 0.0
        if self.mirror:
            n, c = self.masses, int(self.systems[0]["contacts"])
            flip = np.concatenate(([1.0, 1.0], np.full(2 * n, -1.0), np.ones(c), np.full(2 * c, -1.0)))
            rows = np.vstack((rows, rows * flip + np.eye(1, len(flip)) * pi))
        rows.setflags(write=False)
        return rows

    @cached_property
    def timeline(self) -> Timeline:  # type: ignore[override] # a field there
        """When its pieces are."""
        begin, length = self.rows[:, 0], self.rows[:, 1]
        cycle = self.first + cycles_of(begin, length)
        cycle.setflags(write=False)
        return Timeline(cycle, begin, length, self.periodic)

    @property
    def masses(self) -> int:
        """Number of masses."""
        return int(self.systems[0]["masses"])

    def stops_of(self, contact: int) -> FloatArray:
        """Begin and end of each stop (m, 2), rad, of a contact (from 0); stops that go on across a cut are one."""
        spans = self.timeline.spans(
            self.rows[:, 2 + 2 * self.masses + 2 * int(self.systems[0]["contacts"]) + contact] == 0.0
        )
        return spans[spans[:, 1] - spans[:, 0] > TOUCH]

    def evaluate(self, tau: FloatArray, index: NDArray[np.intp], within: FloatArray) -> tuple[FloatArray, ...]:  # noqa: ARG002
        """Return x, v of the first mass and the force of the first contact (k,) at times within pieces of an index."""
        n, found = self.masses, self._all(index, within)
        return found[:, 0], found[:, n], found[:, 2 * n] if found.shape[1] > 2 * n else np.zeros(len(found))

    def all_at(self, tau: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return displacements, velocities (k, n) and forces (k, c) of all masses and contacts: see `Motion.all_at`."""
        n, (_, _, index, within) = self.masses, self.timeline.place(np.atleast_1d(tau), None)
        found = self._all(index, within)
        return found[:, :n], found[:, n : 2 * n], found[:, 2 * n :]

    def _all(self, index: NDArray[np.intp], within: FloatArray) -> FloatArray:
        """Displacements, velocities and contacts' forces (k, 2 n + c) at times within the pieces of an index."""
        found = np.empty((len(index), 2 * self.masses + int(self.systems[0]["contacts"])))
        works, numbers = workspace(), np.asarray(index, np.int64)
        evaluate_all(self.systems, works, self.rows, numbers, within, found)
        while works[0]["phases"]["missing"]:
            make_phase(self.systems, works)
            evaluate_all(self.systems, works, self.rows, numbers, within, found)
        return found


class Solved(NamedTuple):
    """What a search has found: its row, the numbers of contacts and masses, the pieces and the map of the orbit."""

    row: FloatArray
    numbers: Any
    pieces: FloatArray
    leg: Any
    spent: float  # evaluations


def solved(systems: Any, closed: int = answer.AUTO, start: FloatArray | None = None, left: float = inf) -> Solved:
    """Return the steady state of a system that rest settles on, or the motion from a start (q, v, anchors).

    `left`: evaluations that the search may take, if those are fewer than its own share.
    """
    works, legs, numbers = workspace(), record_of(orbit.LEG), record_of(NUMBERS)
    n, c, size = (int(systems[0][name]) for name in ("masses", "contacts", "sliders"))
    rows, count, made = np.empty((1, places.ROW)), PIECES, 0
    search = answer.solve if start is None else answer.wait_for
    while True:
        pieces = np.empty((count, 2 + 2 * n + 3 * c))
        ys = np.full((1, 2 * n + size), nan) if start is None else start[np.newaxis].copy()
        search(orbit.Carrier(systems, works, pieces), legs, ys, closed, numbers, rows, left)
        code = rows[0, places.OUTCOME]
        if code == places.LACKING:
            made = _made(systems, works, made)
        elif code == places.AWAITED:
            search = answer.wait_for
        elif code != places.OVERFULL:
            kept = pieces[: int(works[0]["count"])]
            return Solved(rows[0], numbers[0], kept, legs[0], float(works[0]["spent"]))
        else:
            count = int(works[0]["count"])
            if count > MOST_PIECES:
                raise SimulationError(f"steady state: expected at most {MOST_PIECES} phases in an orbit; got {count}")


def workspace() -> Any:
    """Return where the runs of this thread write, with no phase in it: mapping its memory would take longer than a run.

    A run leaves nothing in it that the next one reads.
    """
    works = getattr(_OWN, "works", None)
    if works is None:
        works = _OWN.works = record_of(WORK)
    phases = works[0]["phases"]
    phases["count"] = phases["next"] = phases["missing"] = 0
    return works


def rows_of(systems: Any) -> FloatArray:
    """Return the rows (k, ROW) of the steady states of systems of one mass: the same bits as one by one."""
    rows, sizes = np.empty((len(systems), places.ROW)), 2 + int(systems["sliders"].max(initial=0))
    flow = orbit.Carrier(systems, workspace(), np.empty((PIECES, 7)))
    legs, numbers = record_of(orbit.LEG), record_of(NUMBERS)
    answer.solve(flow, legs, np.full((len(rows), sizes), nan), answer.AUTO, numbers, rows, inf)
    awaited = np.flatnonzero(rows[:, places.OUTCOME] == places.AWAITED)
    if awaited.size:
        found, starts = np.empty((len(awaited), places.ROW)), np.full((len(awaited), sizes), nan)
        answer.wait_for(flow._replace(systems=systems[awaited]), legs, starts, answer.AUTO, numbers, found, inf)
        rows[awaited] = found
    for k in np.flatnonzero(rows[:, places.OUTCOME] == places.OVERFULL):
        rows[k] = solved(systems[k : k + 1]).row
    return rows


def _made(systems: Any, works: Any, before: int) -> int:
    """Make the phase that a run has missed, unless phases are made without end; return how many were made."""
    if before >= 4 * SLOTS:
        raise SimulationError(
            f"structure: phases of {int(systems[0]['masses'])} masses; expected at most {SLOTS} in a motion; got more; "
            "do: give its contacts fewer sliders"
        )
    make_phase(systems, works)
    return before + 1


def _refuse(what: Problem | Structure, code: int, state: str = "not kept") -> None:
    """Raise the named error of a run that did not come to its end."""
    contacts: Sequence[Problem | Contact] = (what,) if isinstance(what, Problem) else what.contacts
    uneven = [n for n, contact in enumerate(contacts, 1) if contact.parameter("gradient")]
    if code in (PULLS, STEEP) and uneven:
        raise SimulationError(
            f"simulation: contact {uneven[0]}: gradient; expected 1 + gradient z > 0 on the whole motion, and beta"
            f" |gradient| < 1; got {contacts[uneven[0] - 1].parameter('gradient'):g}: friction would turn into a pull;"
            " do: take a smaller gradient"
        )
    if code != DONE:
        why = "more work than allowed" if code == TIRED else "events without end"
        numbers = ", ".join(f"beta = {contact.beta!r}" for contact in contacts)
        raise SimulationError(
            f"simulation: {why}: r = {what.r!r}, {numbers}; expected at most some hundred phases in a cycle and natural"
            f" period; got more, state at the start {state}; do: report these numbers"
        )


def steady(what: Problem | Structure, solver: str = "auto", *, meter: Meter | None = None) -> SteadyState:
    """Return the steady state that rest settles on: the closed form where it is valid, else the exact orbit.

    Parameters
    ----------
    what : Problem or Structure
    solver : {"auto", "closed-form", "exact"}
    meter : Meter, optional
        What a search of many steady states may still spend: this one's work is taken from it.

    Raises
    ------
    SimulationError
        Events do not end, or the closed form is asked for where it does not hold; of several masses also: a gradient is
        too steep, or rigid contacts hold a mass twice over.
    """
    systems, many = system_of(what), isinstance(what, Structure)
    found = solved(systems, answer.NEVER_CLOSED if many else CLOSED[solver])
    code = int(found.row[places.OUTCOME])
    if meter is not None:
        meter.take(EXACT_STATE + found.spent / LOOKS)
    if code == places.CHATTERED:
        _refuse(what, CHATTER)
    if many and code in (places.PULLING, places.RUNAWAY):
        _refuse(what, PULLS)
    if solver == "closed-form" and code == places.NOT_FOUND:
        raise SimulationError(
            f"steady state: closed form at r = {what.r!r}; expected continuous motion of an undamped mass under a pure"
            " cosine (2.10); got stops, damping or harmonics; do: use solver 'exact'"
        )
    return _state(what, systems, found)


def steady_from(problem: Problem, x0: float, v0: float, looks: float = inf) -> tuple[SteadyState, float]:
    """Return what the motion from a start at tau = 0 settles on, and what is left of the evaluations allowed."""
    systems = system_of(problem)
    found = solved(systems, answer.NEVER_CLOSED, rest_of(systems, x0, v0), looks)
    return _state(problem, systems, found), looks - found.spent


def _state(what: Problem | Structure, systems: Any, found: Solved) -> SteadyState:
    """The state of what a search has found; of several masses with the numbers of each mass and contact."""
    problem, row, orbit_of = what if isinstance(what, Problem) else what.first_contact, found.row, None
    if row[places.OUTCOME] in (places.PERIODIC, places.STUCK):
        mirror = bool(found.leg["sign"] < 0.0)
        orbit_of = Trajectory(problem, systems, found.pieces, periodic=True, mirror=mirror)
    state = from_numbers(problem, row, orbit_of)
    if isinstance(what, Problem):
        return state
    if orbit_of is None:  # what has no contacts is linear: without an orbit it is at resonance and undamped
        linear: Outcome = "unbounded" if state.outcome == "not found" and not what.contacts else state.outcome
        return replace(state, outcome=linear, structure=what)
    cycles, contacts = float(found.leg["span"] * found.leg["turns"]) / TURN, []
    for number, contact in enumerate(what.contacts):
        energy, stuck = (float(found.numbers[name][number]) / cycles for name in ("contact", "stuck"))
        holds = state.outcome == "stuck" or stuck >= TURN * (1.0 - 1e-12) or energy <= CREEP * contact.beta
        stops = 0.0 if holds else float(found.numbers["stops"][number]) / cycles
        named = (contact.mass, contact.against, contact.law.name)
        contacts.append(ContactNumbers(*named, energy, stops, 1.0 if holds else stuck / TURN))
    high, low = (np.asarray(found.numbers[name])[: what.masses] for name in ("high", "low"))
    sizes = 0.5 * (high - low) if cycles >= 1.0 else np.maximum(high, -low)
    seen = of_contacts(contacts)
    lasting = Note.FORGETS_SLOWLY * int(1.0 - abs(state.floquet_multiplier or 0.0) < SLOW)
    return replace(
        state,
        outcome="stuck" if seen["regime"] == "stuck" else "periodic",
        notes=int(lasting | Note.MAY_COEXIST * int(what.weakens)),
        structure=what,
        response_amplitudes=tuple(sizes.tolist()),
        **seen,
    )


def run(
    what: Problem | Structure, *, cycles: int, keep: int, x0: float = 0.0, v0: float = 0.0, tau0: float = 0.0
) -> Trajectory:
    """Carry the motion over cycles of the drive by exact phases; the last `keep` cycles are recorded."""
    systems, works, legs = system_of(what), workspace(), record_of(orbit.LEG)
    n, c, harmonics = (int(systems[0][name]) for name in ("masses", "contacts", "harmonics"))
    works[0]["left"], legs[0]["tau"], legs[0]["span"], legs[0]["sign"] = inf, tau0, TURN, 1.0

    def carried(start: FloatArray, turns: int, pieces: FloatArray) -> FloatArray:
        """The state after so many cycles, with phases made as they are met."""
        legs[0]["turns"], end, code, made = turns, start.copy(), MISSING, 0
        while code == MISSING:
            code = int(answer.carry_on(orbit.Carrier(systems, works, pieces), legs, start, end, False))
            if code == MISSING:
                made = _made(systems, works, made)
        _refuse(what, code, str(end.tolist()))
        return end

    y = rest_of(systems, x0, v0, tau0)
    if cycles > keep:
        y = carried(y, cycles - keep, np.empty((0, 0)))
    count = 64 + ceil(8 * keep * (max(1, harmonics) + 1.0 / what.r))
    while True:
        pieces = np.empty((min(count, MOST_PIECES), 2 + 2 * n + 3 * c))
        carried(y, keep, pieces)
        count = int(works[0]["count"])
        if count <= len(pieces):
            problem = what if isinstance(what, Problem) else what.first_contact
            return Trajectory(problem, systems, pieces[:count].copy(), periodic=False, first=cycles - keep)
        if count > MOST_PIECES:
            raise SimulationError(
                f"simulate: expected at most {MOST_PIECES} phases; got {count}; do: keep fewer cycles"
            )


def rest_of(systems: Any, x0: float = 0.0, v0: float = 0.0, tau: float = 0.0) -> FloatArray:
    """Return a start: the first mass at a displacement and velocity, the others at rest; every slider relaxed."""
    system = systems[0]
    n, h = int(system["masses"]), int(system["harmonics"])
    y = np.zeros(2 * n + int(system["sliders"]))
    y[0], y[n] = x0, v0
    f = float(np.sum(system["lines"][:h] * np.exp(1j * tau * np.arange(1, h + 1))).real)
    for c in range(int(system["contacts"])):
        place = float(system["row"][c, :n] @ y[:n] - system["follow"][c] * f)
        y[2 * n + int(system["first"][c]) : 2 * n + int(system["first"][c + 1])] = place
    return y
