"""The exact flow as Python calls it: steady states and motions of one mass or many, by linear phases between events."""

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from math import ceil, inf, nan, pi
from typing import Any

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
    make_phase,
)
from frictionlab.simulator.meter import EXACT_STATE, LOOKS, Meter
from frictionlab.simulator.motion import Motion, Timeline, cycles_of
from frictionlab.simulator.problem import Base, Problem
from frictionlab.simulator.state import SteadyState, from_numbers
from frictionlab.simulator.structure import Contact, Structure

announce("frictionlab.simulator.exact.answer")

TURN = 2.0 * pi
TOUCH = 1e-13  # rad: a shorter stick is no stop
PIECES = 512  # recorded at first
MOST_PIECES = 1 << 22
_OWN = threading.local()
CLOSED = {"auto": answer.AUTO, "closed-form": answer.CLOSED_ONLY, "exact": answer.NEVER_CLOSED}


def iwan_sliders(stiffness: float, beta: float, count: int, chi: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return stiffness and strength of sliders whose slip lengths phi have the density R phi^chi up to phi_max.

    Total stiffness and strength are those of the whole distribution,
    ``kappa = R phi_max^(chi + 1) / (chi + 1)`` and ``beta = R phi_max^(chi + 2) / (chi + 2)``, hence
    ``phi_max = beta (chi + 2) / (kappa (chi + 1))`` (D. J. Segalman's four-parameter model without its jump).
    The distribution is cut at ``phi_max (i / N)^(2 / (chi + 2))``; each piece becomes one slider with the piece's own
    stiffness and strength. So the force of a first loading is met exactly at each cut, and its largest error between
    two cuts, about R phi^chi width^2 / 8, is about the same in all pieces: ``beta / (2 (chi + 2) N^2)``.

    Parameters
    ----------
    stiffness, beta : float
        All sliders together, over k and over k Y.
    count : int
    chi : float
        Exponent, -1 < chi <= 0.

    Returns
    -------
    stiffness, strength : tuple of float

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


def sliders_of(contact: Problem | Contact) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return stiffness and friction force of a contact's elastic sliders; none: it is rigid."""
    return _sliders(dict(zip((p.name for p in contact.law.parameters), contact.numbers, strict=True)))


def _sliders(numbers: Mapping[str, float]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    stiffness, beta = numbers.get("stiffness_ratio"), numbers["beta"]
    if stiffness is None:
        return (), ()
    if "sliders" in numbers:
        return iwan_sliders(stiffness, beta, round(numbers["sliders"]), numbers["chi"])
    return (stiffness,), (beta,)


def system_of(structure: Structure) -> Any:
    """Return a structure as the compiled flow takes it: a record in an array of length 1.

    Raises
    ------
    SimulationError
        It has more masses, contacts, sliders or harmonics than there is space for, or rigid contacts hold a mass twice
        over.
    """
    r, n, contacts = structure.r, structure.masses, structure.contacts
    rows = np.array([structure.row(contact) for contact in contacts]).reshape(-1, n)
    follow = np.array([float(contact.against == "base") for contact in contacts])
    systems = record_of(SYSTEM)
    system = systems[0]
    _set_contacts(system, contacts)
    _refuse_more("harmonics of the base", structure.base.harmonics, HARMONICS)
    system["harmonics"] = structure.base.harmonics
    system["lines"][: structure.base.harmonics] = structure.base.lines
    dashpot = np.array([2.0 * r * contact.parameter("contact_damping_ratio") for contact in contacts])
    rigid = [i for i, contact in enumerate(contacts) if not sliders_of(contact)[0]]
    bound = np.column_stack((rows, follow))[rigid]
    if len(bound) and np.linalg.matrix_rank(bound) < len(bound):
        raise SimulationError(
            "structure: rigid contacts hold a mass twice over, and what each carries is not determined; do: give"
            " one of them the term compliance"
        )
    _refuse_more("masses", n, MASSES)
    system["masses"], system["r"] = n, r
    system["row"][: len(rows), :n], system["follow"][: len(rows)] = rows, follow
    system["dashpot"][: len(rows)] = dashpot
    system["inertia"][:n, :n] = r * r * structure.mass
    system["mobility"][:n, :n] = np.linalg.inv(r * r * structure.mass)
    system["damping"][:n, :n] = r * structure.damping + rows.T @ (dashpot[:, None] * rows)
    system["stiffness"][:n, :n] = structure.stiffness
    system["push"][:n, 0] = structure.stiffness.sum(axis=1)
    system["push"][:n, 1] = r * structure.damping.sum(axis=1) + rows.T @ (dashpot * follow)
    return systems


def _set_contacts(system: Any, contacts: tuple[Contact, ...]) -> None:
    """Write the numbers of contacts and their sliders into a record."""
    _refuse_more("contacts", len(contacts), CONTACTS)
    system["contacts"] = len(contacts)
    for number, contact in enumerate(contacts):
        _set_sliders(system, number, *sliders_of(contact))
        system["limit"][number], system["gradient"][number] = contact.beta, contact.parameter("gradient")
        system["up"][number], system["down"][number] = contact.static_ratios


def _refuse_more(name: str, count: int, most: int) -> None:
    if count > most:
        raise SimulationError(f"structure: {name}; expected at most {most}; got {count}; do: leave some out")


def system_of_one(problem: Problem) -> Any:
    """Return a problem as the compiled flow takes it: one mass, one contact."""
    values = problem.parameters | {"r": problem.r}
    return systems_of({name: np.array([value]) for name, value in values.items()}, problem.wall, problem.base)


def systems_of(values: Mapping[str, FloatArray], wall: str, base: Base) -> Any:
    """Return problems of one law, whose numbers (k,) are given by name, as the compiled flow takes them (k,)."""
    r, beta = values["r"], values["beta"]
    systems, moves = record_of(SYSTEM, len(r)), wall == "base"
    contact = values.get("contact_damping_ratio", 0.0)
    frame = values.get("frame_damping_ratio", 0.0)
    systems["masses"], systems["contacts"], systems["r"] = 1, 1, r
    systems["row"][:, 0, 0], systems["follow"][:, 0] = 1.0, float(moves)
    systems["dashpot"][:, 0] = 2.0 * contact * r
    systems["inertia"][:, 0, 0], systems["mobility"][:, 0, 0] = r * r, 1.0 / (r * r)
    systems["damping"][:, 0, 0] = 2.0 * (contact + frame) * r
    systems["stiffness"][:, 0, 0], systems["push"][:, 0, 0] = 1.0, 1.0
    systems["push"][:, 0, 1] = 2.0 * (frame + (contact if moves else 0.0)) * r
    systems["limit"][:, 0] = beta
    for field, name, otherwise in (
        ("gradient", "gradient", 0.0),
        ("up", "static_ratio_up", 1.0),
        ("down", "static_ratio_down", 1.0),
    ):
        systems[field][:, 0] = values.get(name, otherwise)
    _refuse_more("harmonics of the base", base.harmonics, HARMONICS)
    systems["harmonics"] = base.harmonics
    systems["lines"][:, : base.harmonics] = base.lines
    if "stiffness_ratio" in values:
        for k in range(len(r)):
            springs, strengths = _sliders({name: float(numbers[k]) for name, numbers in values.items()})
            _set_sliders(systems[k], 0, springs, strengths)
    return systems


def _set_sliders(system: Any, contact: int, springs: Sequence[float], strengths: Sequence[float]) -> None:
    """Write the sliders of a contact, after those of the contacts before it."""
    first = int(system["first"][contact])
    last = first + len(springs)
    _refuse_more("sliders", last, SLIDERS)
    system["spring"][first:last], system["strength"][first:last] = springs, strengths
    system["first"][contact + 1] = system["sliders"] = last


@dataclass(frozen=True)
class Pieces:
    """A motion as recorded: what moves, and its pieces from event to event.

    Parameters
    ----------
    systems : ndarray
        Of length 1, of `SYSTEM`.
    rows : ndarray of shape (m, 2 + 2 n + 3 c)
        Of each piece: start (rad, within its cycle) and duration; at its start displacements and velocities; of each
        contact tangent stiffness, constant force, and direction of slip (0: it holds).
    timeline : Timeline
        When they are.
    """

    systems: Any
    rows: FloatArray
    timeline: Timeline

    @classmethod
    def of_record(
        cls, systems: Any, rows: FloatArray, *, periodic: bool, mirror: bool = False, first: int = 0
    ) -> "Pieces":
        """Build it from recorded rows, the first of them in cycle `first`; `mirror` appends the mirrored half."""
        if mirror:
            n, c = int(systems[0]["masses"]), int(systems[0]["contacts"])
            flip = np.concatenate(([1.0, 1.0], np.full(2 * n, -1.0), np.ones(c), np.full(2 * c, -1.0)))
            later = rows * flip
            later[:, 0] += pi
            rows = np.vstack((rows, later))
        rows, cycle = rows + 0.0, first + cycles_of(rows[:, 0], rows[:, 1])
        rows.setflags(write=False)
        cycle.setflags(write=False)
        return cls(systems, rows, Timeline(cycle, rows[:, 0], rows[:, 1], periodic))

    def at(self, tau: ArrayLike, cycle: ArrayLike | None = None) -> tuple[tuple[int, ...], FloatArray]:
        """Return the shape of times, and displacements, velocities and contacts' forces (k, 2 n + c) at them."""
        shape, _, index, within = self.timeline.place(tau, cycle)
        return shape, self.within(index, within)

    def within(self, index: NDArray[np.intp], within: FloatArray) -> FloatArray:
        """Return the same at times within the pieces of an index."""
        n, c = int(self.systems[0]["masses"]), int(self.systems[0]["contacts"])
        found = np.empty((len(index), 2 * n + c))
        works, numbers = workspace(), np.asarray(index, np.int64)
        evaluate_all(self.systems, works, self.rows, numbers, within, found)
        while works[0]["phases"]["missing"]:
            make_phase(self.systems, works)
            evaluate_all(self.systems, works, self.rows, numbers, within, found)
        return found

    def stops(self, contact: int) -> FloatArray:
        """Begin and end of each stop (m, 2), rad, of a contact (from 0); stops that go on across a cut are one."""
        n, c = int(self.systems[0]["masses"]), int(self.systems[0]["contacts"])
        spans = self.timeline.spans(self.rows[:, 2 + 2 * n + 2 * c + contact] == 0.0)
        return spans[spans[:, 1] - spans[:, 0] > TOUCH]


@dataclass(frozen=True)
class Trajectory(Motion):
    """A motion of one problem, piece by piece: exact between its events.

    Parameters
    ----------
    problem : Problem
        What moves.
    record : callable
        Returns its pieces.
    """

    problem: Problem
    record: Callable[[], Pieces]

    @cached_property
    def pieces(self) -> Pieces:
        """Its pieces, made when they are asked for."""
        return self.record()

    @property
    def timeline(self) -> Timeline:  # type: ignore[override] # a field there
        """When its pieces are."""
        return self.pieces.timeline

    @property
    def stops(self) -> FloatArray:
        """Begin and end of each stop, rad, shape (m, 2): times in which nothing of the contact slips."""
        return self.pieces.stops(0)

    def at(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> tuple[FloatArray, FloatArray]:
        """Return displacement x and velocity x' of the mass at any times: see `Motion.at`."""
        shape, found = self.pieces.at(tau, cycle)
        return found[:, 0].reshape(shape), found[:, 1].reshape(shape)

    def _evaluate(self, index: NDArray[np.intp], within: FloatArray) -> FloatArray:
        return self.pieces.within(index, within)

    def force(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> FloatArray:
        """Return the force of the contact on the mass, against the motion, over k Y, at any times: see `Motion.force`.

        Examples
        --------
        >>> from frictionlab.simulator import Problem, steady_state
        >>> steady_state(Problem(r=0.7, beta=0.5)).orbit.force([0.0, 3.0]).tolist()
        [0.5, -0.5]
        """
        shape, found = self.pieces.at(tau, cycle)
        return found[:, 2].reshape(shape)


@dataclass(frozen=True)
class Solved:
    """What a search has found: its row, the numbers of contacts and masses, the pieces of the orbit (or none)."""

    row: FloatArray
    numbers: Any
    pieces: Callable[[], Pieces] | None
    cycles: float
    spent: float  # evaluations


def solved(systems: Any, closed: int = answer.AUTO, start: FloatArray | None = None, left: float = inf) -> Solved:
    """Return the steady state of a system that rest settles on, or the motion from a start (q, v, anchors).

    `left`: evaluations that the search may take, if those are fewer than its own share.
    """
    works, legs, numbers = workspace(), record_of(orbit.LEG), record_of(NUMBERS)
    n, c, size = (int(systems[0][name]) for name in ("masses", "contacts", "sliders"))
    rows, count, made, spent = np.empty((1, places.ROW)), PIECES, 0, 0.0
    search = answer.solve if start is None else answer.wait_for
    while True:
        pieces = np.empty((count, 2 + 2 * n + 3 * c))
        ys = np.full((1, 2 * n + size), nan) if start is None else start[np.newaxis].copy()
        search(orbit.Carrier(systems, works, pieces), legs, ys, closed, numbers, rows, left)
        code, spent = rows[0, places.OUTCOME], float(works[0]["spent"])
        if code == places.LACKING:
            made = _made(systems, works, made)
        elif code == places.AWAITED:
            search = answer.wait_for
        elif code != places.OVERFULL:
            break
        else:
            count = int(works[0]["count"])
            if count > MOST_PIECES:
                raise SimulationError(f"steady state: expected at most {MOST_PIECES} phases in an orbit; got {count}")
    leg, found = legs[0], code in (places.PERIODIC, places.STUCK)
    kept, mirror = pieces[: int(works[0]["count"])], bool(leg["sign"] < 0.0)
    record = partial(Pieces.of_record, systems, kept, periodic=True, mirror=mirror) if found else None
    return Solved(rows[0], numbers[0], record, float(leg["span"] * leg["turns"]) / TURN, spent)


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
        flow = flow._replace(systems=systems[awaited])
        answer.wait_for(flow, legs, starts, answer.AUTO, numbers, found, inf)
        rows[awaited] = found
    for k in np.flatnonzero(rows[:, places.OUTCOME] == places.OVERFULL):
        rows[k] = solved(systems[k : k + 1]).row
    return rows


def followed(systems: Any, start: FloatArray, cycles: int, keep: int, tau: float = 0.0) -> Pieces:
    """Return the last `keep` of a number of cycles from a start (q, v, anchors) at a phase of the drive.

    Raises
    ------
    SimulationError
        Events do not end, or the gradient is so steep that friction would turn into a pull.
    """
    system, works, legs = systems[0], workspace(), record_of(orbit.LEG)
    n, c = int(system["masses"]), int(system["contacts"])
    works[0]["left"] = inf
    legs[0]["tau"], legs[0]["span"], legs[0]["sign"] = tau, TURN, 1.0
    y, image = start.copy(), start.copy()
    if cycles > keep:
        legs[0]["turns"] = cycles - keep
        _carried(systems, works, np.empty((0, 0)), legs, y, image)
        y = image.copy()
    legs[0]["turns"] = keep
    count = 64 + ceil(8 * keep * (max(1, int(system["harmonics"])) + 1.0 / float(system["r"])))
    while True:
        pieces = np.empty((min(count, MOST_PIECES), 2 + 2 * n + 3 * c))
        _carried(systems, works, pieces, legs, y, image)
        count = int(works[0]["count"])
        if count <= len(pieces):
            return Pieces.of_record(systems, pieces[:count], periodic=False, first=cycles - keep)
        if count > MOST_PIECES:
            raise SimulationError(
                f"simulate: expected at most {MOST_PIECES} phases; got {count}; do: keep fewer cycles"
            )


def _carried(systems: Any, works: Any, pieces: FloatArray, legs: Any, y: FloatArray, image: FloatArray) -> None:
    """Carry a state over a leg, with phases made as they are met."""
    code, made = MISSING, 0
    while code == MISSING:
        code = int(answer.carry_on(orbit.Carrier(systems, works, pieces), legs, y, image, False))
        if code == MISSING:
            made = _made(systems, works, made)
    _refuse(systems, code, image)


def _made(systems: Any, works: Any, before: int) -> int:
    """Make the phase that a run has missed; return how many were made.

    Raises
    ------
    SimulationError
        The motion passes more phases than are kept, so that they are made without end.
    """
    if before >= 4 * SLOTS:
        raise SimulationError(
            f"structure: phases of {int(systems[0]['masses'])} masses; expected at most {SLOTS} in a motion; got more; "
            "do: give its contacts fewer sliders"
        )
    make_phase(systems, works)
    return before + 1


def _refuse(systems: Any, code: int, state: FloatArray) -> None:
    """Raise the named error of a run that did not come to its end."""
    system = systems[0]
    if code in (PULLS, STEEP):
        raise SimulationError(
            "simulation: gradient; expected so small that beta |gradient| < 1 and 1 + gradient z > 0 on the whole"
            f" motion; got {system['gradient'][: int(system['contacts'])].tolist()}; do: take a smaller gradient"
        )
    if code != DONE:
        what = "events without end" if code == CHATTER else "more work than allowed"
        raise SimulationError(
            f"simulation: {what}: r = {float(system['r'])!r}, beta = {float(system['limit'][0])!r}, "
            f"{int(system['masses'])} masses, {int(system['contacts'])} contacts; expected at most some hundred phases"
            f" in a cycle and natural period; got more, state at the start {state.tolist()}; do: report these numbers"
        )


def steady(problem: Problem, solver: str = "auto", *, meter: Meter | None = None) -> SteadyState:
    """Return the steady state of a problem: the closed form where it is valid ("auto", "closed-form"), else its orbit.

    Parameters
    ----------
    problem : Problem
    solver : {"auto", "closed-form", "exact"}
    meter : Meter, optional
        What a search of many steady states may still spend: this one's work is taken from it.

    Raises
    ------
    SimulationError
        Events do not end, or the closed form is asked for where it does not hold.
    """
    found = solved(system_of_one(problem), CLOSED[solver])
    code = int(found.row[places.OUTCOME])
    if meter is not None:
        meter.take(EXACT_STATE + found.spent / LOOKS)
    if code == places.CHATTERED:
        _refuse(system_of_one(problem), CHATTER, np.empty(0))
    if solver == "closed-form" and code == places.NOT_FOUND:
        raise SimulationError(
            f"steady state: closed form at r = {problem.r!r}, beta = {problem.beta!r}; expected continuous motion of "
            "an undamped mass under a pure cosine (2.10); got stops, damping or harmonics; do: use solver 'exact'"
        )
    return _state(problem, found)


def steady_from(problem: Problem, x0: float, v0: float, looks: float = inf) -> tuple[SteadyState, float]:
    """Return what the motion from a start at tau = 0 settles on, and what is left of the evaluations allowed."""
    systems = system_of_one(problem)
    found = solved(systems, answer.NEVER_CLOSED, rest_of(systems, x0, v0), looks)
    return _state(problem, found), looks - found.spent


def _state(problem: Problem, found: Solved) -> SteadyState:
    orbit_of = None if found.pieces is None else Trajectory(problem, found.pieces)
    return from_numbers(problem, found.row, orbit_of)


def run(problem: Problem, *, cycles: int, x0: float, v0: float, tau0: float, keep: int) -> Trajectory:
    """Carry the motion over cycles of the drive by exact phases; the last `keep` cycles are recorded."""
    systems = system_of_one(problem)
    pieces = followed(systems, rest_of(systems, x0, v0, tau0), cycles, keep, tau0)
    return Trajectory(problem, lambda: pieces)


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
