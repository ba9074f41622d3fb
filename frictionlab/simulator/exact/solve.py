"""The exact flow as Python calls it: steady states and motions of one mass or many, by linear phases between events."""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil, inf, nan, pi
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator import row as places
from frictionlab.simulator.compiled import address_in_python, announce, record_of
from frictionlab.simulator.exact import answer, orbit, phase
from frictionlab.simulator.exact.account import ACCOUNT, LOOKER, NUMBERS, account_all, evaluate
from frictionlab.simulator.exact.flow import ADVANCER, RUNNER
from frictionlab.simulator.exact.motion import WORK
from frictionlab.simulator.exact.phase import SIDE
from frictionlab.simulator.laws import BREAKAWAY, PLACE
from frictionlab.simulator.motion import Motion
from frictionlab.simulator.notes import COARSE, SLOW, Note
from frictionlab.simulator.problem import EXACT_STATE, LOOKS, Base, Meter, Problem
from frictionlab.simulator.state import SteadyState, from_numbers, numbers_of, taken_in
from frictionlab.simulator.structure import Contact, Structure

announce("frictionlab.simulator.exact.answer")

MODES = address_in_python(phase.make_modes, phase.SYSTEM, phase.PHASES)

TURN = 2.0 * pi
TOUCH = 1e-13  # rad: a shorter stick is no stop
PIECES = 512  # recorded at first
MOST_PIECES = 1 << 22
NOTHING: FloatArray = np.empty((0, 0))
ONE: FloatArray = np.ones((1, 1))
NEGATIVE = (
    "friction turns negative within the motion: gradient; expected 1 + gradient z > 0, and beta |gradient| < 1; do: a"
    " smaller gradient, or rate_strength"
)
WHY = {
    **dict.fromkeys((phase.PULLS, phase.STEEP), NEGATIVE),
    phase.TIRED: "more steps than allowed: the contact rings, hardly anything damps it, or the law is too stiff; do:"
    " take the law that this one tends to (a rigid contact for a stiffness without end), or loosen rtol",
    phase.CHATTER: "events without end, or steps that became too short; expected at most some hundred phases in a cycle"
    " and natural period; do: report these numbers, or take a law that holds where this one nearly does",
}
"""How a run ended that did not come to its end."""
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
    _refuse_more("masses", what.masses, phase.MASSES)
    _refuse_more("contacts", len(what.contacts), phase.CONTACTS)
    contacts, bound = [], []
    for contact in what.contacts:
        row, follow, values = what.row(contact), float(contact.against == "base"), contact.parameters
        if contact.law.kind in ("rigid", "smooth"):
            bound.append((*row, follow))
        if contact.law.kind != "elastic":
            values.pop("stiffness_ratio", None)  # that of a formula is none of sliders
        contacts.append((row, follow, values))
    if bound and np.linalg.matrix_rank(bound) < len(bound):
        raise SimulationError(
            "structure: rigid contacts hold a mass twice over, and what each carries is not determined; do: give"
            " one of them the term compliance"
        )
    systems = _systems(np.array([what.r]), (what.mass, what.damping, what.stiffness), contacts, what.base)
    systems["alone"], systems["mirrored"] = not what.weakens, what.has_mirror_image
    return systems


def systems_of(values: Mapping[str, FloatArray], wall: str, base: Base) -> Any:
    """Return problems of one law, whose numbers (k,) are given by name, as the compiled flow takes them (k,)."""
    thick = 2.0 * np.reshape(values.get("frame_damping_ratio", 0.0), (-1, 1, 1))
    systems = _systems(values["r"], (ONE, thick, ONE), [(ONE[0], float(wall == "base"), values)], base)
    terms = [term for term in (PLACE, BREAKAWAY) if all(p.name in values for p in term.parameters)]
    weakens, is_even = sum(term.weakens(values) for term in terms), [term.is_even(values) for term in terms]
    systems["alone"] = np.logical_not(np.logical_and(values["beta"], weakens))
    systems["mirrored"] = np.logical_and(base.is_odd, np.all(is_even, axis=0))
    return systems


def _systems(
    r: FloatArray,
    frame: tuple[FloatArray, FloatArray, FloatArray],
    contacts: Sequence[tuple[FloatArray, float, Mapping[str, Any]]],
    base: Base,
) -> Any:
    """Return frames (k,): r (k,), mass, damping and stiffness; of each contact row, whether it follows, and numbers.

    Where contacts are against the base and none against the wall, coordinates are relative to the base, which drives by
    its acceleration.
    """
    _refuse_more("harmonics of the base", base.harmonics, phase.HARMONICS)
    systems, (mass, damping, stiffness), n = record_of(phase.SYSTEM, len(r)), frame, len(frame[0])
    systems["run"], systems["advance"], systems["look"], systems["account"] = RUNNER, ADVANCER, LOOKER, ACCOUNT
    systems["make"], systems["make_modes"] = phase.MAKER, MODES
    systems["harmonics"], systems["moves"], systems["lines"][:, : base.harmonics] = base.harmonics, 1.0, base.lines
    systems["masses"], systems["contacts"], systems["r"], each = n, len(contacts), r, np.reshape(r, (-1, 1, 1))
    inverse = 1.0 / mass if n == 1 else np.linalg.inv(mass)
    systems["inertia"][:, :n, :n], systems["mobility"][:, :n, :n] = each * each * mass, inverse / (each * each)
    systems["stiffness"][:, :n, :n] = stiffness
    systems["frame"][:, :n, :n] = systems["damping"][:, :n, :n] = each * damping
    systems["push"][:, :n, 0], systems["push"][:, :n, 1] = stiffness.sum(axis=-1), (each * damping).sum(axis=-1)
    for c, (row, follow, values) in enumerate(contacts):
        systems["row"][:, c, :n], systems["follow"][:, c] = row, follow
        systems["limit"][:, c] = systems["brake"][:, c] = values["beta"]
        systems["up"][:, c], systems["down"][:, c] = (values.get(f"static_ratio_{way}", 1.0) for way in ("up", "down"))
        if "gradient" in values:
            systems["gradient"][:, c] = values["gradient"]
        if "contact_damping_ratio" in values:
            dashpot = systems["dashpot"][:, c] = 2.0 * r * values["contact_damping_ratio"]
            systems["damping"][:, :n, :n] += np.reshape(dashpot, (-1, 1, 1)) * np.outer(row, row)
            systems["push"][:, :n, 1] += np.outer(dashpot * follow, row)
        systems["first"][:, c + 1] = systems["first"][:, c]
        for k in range(len(r) if "stiffness_ratio" in values else 0):
            _set_sliders(systems[k], c, {name: float(np.ravel(numbers)[k]) for name, numbers in values.items()})
    if any(follow for _, follow, _ in contacts) and all(follow or row.sum() == 0.0 for row, follow, _ in contacts):
        systems["push"][:, :n, 0], systems["push"][:, :n, 1] = -systems["inertia"][:, :n, :n].sum(axis=-1), 0.0
        systems["follow"], systems["moves"] = 0.0, 0.0
        systems["lines"][:, : base.harmonics] *= -(np.arange(1.0, base.harmonics + 1.0) ** 2)
    return systems


def _set_sliders(system: Any, contact: int, numbers: Mapping[str, float]) -> None:
    """Write the sliders of a contact, after those of the contacts before it."""
    springs, strengths = sliders_of(numbers)
    first = int(system["first"][contact])
    last = first + len(springs)
    _refuse_more("sliders", last, phase.SLIDERS)
    system["spring"][first:last], system["strength"][first:last] = springs, strengths
    system["first"][contact + 1] = system["sliders"] = last


def _refuse_more(name: str, count: int, most: int) -> None:
    if count > most:
        raise SimulationError(f"structure: {name}; expected at most {most}; got {count}; do: leave some out")


class Solved(NamedTuple):
    """What a search has found: its row, start and pieces of the orbit, its map."""

    row: FloatArray
    y: FloatArray
    pieces: FloatArray
    leg: Any
    spent: float  # evaluations, or steps

    @property
    def cycles(self) -> int:
        """Cycles of the map, whole ones of a half that is mirrored."""
        return int(np.ceil(self.leg["span"] * self.leg["turns"] / TURN))


def workspace() -> Any:
    """Return where the runs of this thread write, with no phase in it: mapping its memory would take longer than a run.

    A run leaves nothing in it that the next one reads.
    """
    works = getattr(_OWN, "works", None)
    if works is None:
        works = _OWN.works = record_of(WORK)
    phases = works[0]["phases"]
    phases["count"] = phases["next"] = 0
    return works


class Flow:
    """What carries the motion of a problem or structure, by exact phases; what stands above a flow asks it alone.

    A state is displacements and velocities (n,) of the masses, and where the springs of elastic sliders are relaxed;
    of a flow that is integrated the laws' own states stand behind these.
    """

    solver: ClassVar[str] = "exact"
    most, longest = inf, inf  # evaluations of a search, and of a run

    def __init__(self, what: Problem | Structure) -> None:
        self.what, self.systems = what, system_of(what)
        self.problem = what if isinstance(what, Problem) else what.first_contact
        self.masses, self.contacts = (int(self.systems[0][name]) for name in ("masses", "contacts"))
        self.sliders = int(self.systems[0]["sliders"])
        self.width = SIDE + 2 * self.masses + 3 * self.contacts

    @property
    def size(self) -> int:
        """Number of entries of a state."""
        return 2 * self.masses + int(self.systems[0]["sliders"])

    def workspace(self) -> Any:
        """Return where runs write."""
        return workspace()

    def pieces_in(self, cycles: int) -> int:
        """Return how many pieces so many cycles are likely to have."""
        return 64 + ceil(8 * cycles * (max(1, int(self.systems[0]["harmonics"])) + 1.0 / self.what.r))

    def motion(self, pieces: FloatArray, *, periodic: bool, mirror: bool = False, first: int = 0) -> Motion:
        """Return recorded phases as a motion."""
        return Motion(self.problem, self, pieces, periodic, mirror, first)

    def mirrored(self, pieces: FloatArray) -> FloatArray:
        """Return pieces of half a cycle and their mirror image, which follows.

        A piece (6 + 2 n + 3 c): start and length; cubic of a sampled base; of each contact direction of slip (0: it
        holds); at its start displacements and velocities; of each contact tangent stiffness and constant force.
        """
        n, c = self.masses, self.contacts
        flip = np.concatenate(([1.0, 1.0], np.full(4 + c + 2 * n, -1.0), np.ones(c), np.full(c, -1.0)))
        return np.vstack((pieces, pieces * flip + np.eye(1, len(flip)) * pi))

    def sums(self, pieces: FloatArray) -> Any:
        """Return what pieces do in all, a record of NUMBERS."""
        works, sums, pieces = self.workspace(), record_of(NUMBERS), pieces.copy()
        account_all(self.systems, works, pieces, sums)
        return sums[0]

    def held_in(self, begins: FloatArray, pieces: FloatArray, contact: int) -> FloatArray:
        """Return begin and end (m, 2), rad, of times in which a contact holds, in pieces that begin at times."""
        held = np.concatenate(([False], pieces[:, SIDE + contact] == 0.0, [False]))
        edges = np.diff(held.astype(np.int8))
        return np.column_stack((begins[edges[:-1] > 0], (begins + pieces[:, 1])[edges[1:] < 0]))

    def stop_limits(self, contact: int) -> tuple[float, float]:  # noqa: ARG002 - of all contacts, but for those that creep
        """Return the longest slip of a contact that is part of a stop, and the shortest stop, rad."""
        return TOUCH, TOUCH

    def stops(self, held: FloatArray, contact: int, period: tuple[float, float] | None = None) -> FloatArray:
        """Return the stops (m, 2) of a contact from the times in which it holds, rad.

        Times in a row are one, touches none. Of a period (begin, end) a stop across its end is listed once, its end
        beyond it.
        """
        longest_slip, shortest = self.stop_limits(contact)
        late = longest_slip + 4.0 * np.spacing(held[1:, 0])  # as the times themselves are rounded
        fresh = np.append(True, held[1:, 0] - held[:-1, 1] > late)[: len(held)]
        spans = np.column_stack((held[fresh, 0], held[np.roll(fresh, -1), 1]))
        if period and len(spans) > 1 and spans[0, 0] - period[0] < 1e-12 and period[1] - spans[-1, 1] < 1e-12:
            spans[-1, 1] = spans[0, 1] + period[1] - period[0]
            spans = spans[1:]
        return spans[spans[:, 1] - spans[:, 0] > shortest]

    def evaluate(self, rows: FloatArray, index: NDArray[np.intp], within: FloatArray) -> tuple[FloatArray, ...]:
        """Return displacements, velocities (k, n) and contacts' forces (k, c) at times within pieces of an index."""
        works, found = self.workspace(), np.empty((len(index), 2 * self.masses + self.contacts))
        evaluate(self.systems, works, rows, index, within, found)
        return tuple(np.split(found, (self.masses, 2 * self.masses), axis=1))

    def rest(self, x0: ArrayLike = 0.0, v0: ArrayLike = 0.0, tau: float = 0.0) -> FloatArray:
        """Return a start: the first mass, or the first ones, at a displacement and velocity, the others at rest."""
        f, rate = float(self.what.base.at(tau)), float(self.what.base.rate_at(tau))
        relative = not self.systems[0]["moves"]
        q, v = (np.full(self.masses, -x if relative else 0.0) for x in (f, rate))
        q[: np.size(x0)] += x0
        v[: np.size(v0)] += v0
        return self.rest_at(q, v, f)

    def rest_at(self, q: FloatArray, v: FloatArray, f: float) -> FloatArray:
        """Return displacements and velocities (n,) as a state with every contact unloaded; f: of the base then."""
        system, y = self.systems[0], np.concatenate((q, v, np.zeros(self.size - 2 * self.masses)))
        first = 2 * self.masses + system["first"]
        for c in range(self.contacts):
            y[first[c] : first[c + 1]] = system["row"][c, : self.masses] @ q - system["follow"][c] * f
        return y

    def put(self, works: Any, y: FloatArray) -> None:
        """Make a state the one at hand."""
        n, work = self.masses, works[0]
        work["q"][:n], work["v"][:n], work["anchor"][: len(y) - 2 * n] = np.split(y, (n, 2 * n))

    def at_hand(self, works: Any) -> FloatArray:
        """Return the state at hand."""
        n, work = self.masses, works[0]
        return np.concatenate((work["q"][:n], work["v"][:n], work["anchor"][: self.size - 2 * n]))

    def stored(self, sample: FloatArray, f: float) -> FloatArray:
        """Return the energy (c,) in the contacts' springs at the state at hand, by displacements (n,) and the base."""
        system, work, stored = self.systems[0], self.workspace()[0], np.zeros(self.contacts)
        for c in range(self.contacts):
            place = system["row"][c, : self.masses] @ sample[: self.masses] - system["follow"][c] * f
            some = slice(int(system["first"][c]), int(system["first"][c + 1]))
            limit = work["side"][c] * system["strength"][some] * (1.0 + system["gradient"][c] * place)
            held = np.where(work["slips"][some] != 0, limit, system["spring"][some] * (place - work["anchor"][some]))
            stored[c] = np.sum(0.5 * held**2 / system["spring"][some])
        return stored

    def carried(
        self,
        start: FloatArray,
        tau: float,
        span: float,
        turns: int = 1,
        pieces: FloatArray = NOTHING,
        *,
        derived: bool = False,
    ) -> tuple[FloatArray, FloatArray, int]:
        """Return what a state becomes over turns of a span from tau on, its derivative if asked for, and its pieces.

        Pieces are recorded as far as there is space for them.
        """
        works, legs, end = self.workspace(), record_of(orbit.LEG), np.empty(self.size)
        legs[0], works[0]["left"] = (tau, span, turns, 1.0), self.longest
        self.refuse(answer.carry_on(self.systems, works, pieces, legs, start.copy(), end, derived))
        return end, works[0]["jacobian"][: self.size, : self.size].copy(), int(works[0]["count"])

    def recorded(self, start: FloatArray, tau: float, cycles: int, *, first: int = 0, periodic: bool = False) -> Motion:
        """Return the motion from a state over some cycles, the first of which has the number `first`."""
        count = self.pieces_in(cycles)
        while True:
            pieces = np.empty((min(count, MOST_PIECES), self.width))
            count = self.carried(start, tau, TURN, cycles, pieces)[2]
            if count <= len(pieces):
                return self.motion(pieces[:count].copy(), periodic=periodic, first=first)
            if count > MOST_PIECES:
                raise SimulationError(
                    f"simulate: expected at most {MOST_PIECES} phases; got {count}; do: keep fewer cycles"
                )

    def solved(self, start: FloatArray | None = None, *, waits: bool = False, left: float = inf) -> Solved:
        """Return the steady state that rest settles on, or the motion from a start.

        `waits`: the motion is followed at once. `left`: evaluations that the search may take, if those are fewer than
        its own share.
        """
        ys = np.full((1, self.size), nan) if start is None else start[np.newaxis].copy()
        count = PIECES if self.most == inf else 0  # an integrated orbit is recorded when it is found
        works, kept = self.workspace(), np.empty((count, self.width))
        rows, leg, pieces = _searched(works, self.systems, ys, kept, waits=waits, left=min(left, self.most))
        return Solved(rows[0], ys[0], pieces[: int(works[0]["count"])], leg, float(works[0]["spent"]))

    def refuse(self, code: int, motion: str = "") -> None:
        """Raise the named error of a run that did not come to its end; `motion`: of what."""
        what = self.what
        contacts: Sequence[Problem | Contact] = (what,) if isinstance(what, Problem) else what.contacts
        if code != phase.DONE:
            laws = ", ".join(f"law {contact.law.name}, parameters {contact.parameters}" for contact in contacts)
            breaks = [term.breaks(contact.parameters) for contact in contacts for term in contact.law.terms]
            why = next(filter(None, breaks if code != phase.PULLS else ()), WHY[code])
            raise SimulationError(f"simulation{motion or f' at r = {what.r!r}'}: {laws}: {why}")

    def run(self, *, cycles: int, keep: int, x0: float = 0.0, v0: float = 0.0, tau0: float = 0.0) -> Motion:
        """Carry the motion over cycles of the drive; the last `keep` cycles are recorded."""
        y = self.rest(x0, v0, tau0)
        if cycles > keep:
            y = self.carried(y, tau0, TURN, cycles - keep)[0]
        return self.recorded(y, tau0, keep, first=cycles - keep)

    def steady(
        self,
        solver: str = "auto",
        *,
        meter: Meter | None = None,
        near: SteadyState | None = None,  # noqa: ARG002 - searches by exact phases need none
    ) -> SteadyState:
        """Return the steady state that rest settles on: see `frictionlab.simulator.steady_state`."""
        what, many, found = self.what, isinstance(self.what, Structure), self.solved()
        code = int(found.row[places.OUTCOME])
        if meter is not None:
            meter.take(EXACT_STATE + found.spent / LOOKS)
        if code == places.CHATTERED:
            self.refuse(phase.CHATTER)
        if many and code in (places.PULLING, places.RUNAWAY):
            self.refuse(phase.PULLS)
        is_closed = found.row[places.SOLVER] == places.CLOSED_FORM or code in (places.STUCK, places.UNBOUNDED)
        if solver == "exact":
            found.row[places.SOLVER] = places.EXACT
        if solver == "closed-form" and not is_closed:
            raise SimulationError(
                f"steady state: closed form at r = {what.r!r}; expected continuous motion of an undamped mass under a"
                " pure cosine (2.10); got stops, damping or harmonics; do: use solver 'exact'"
            )
        return self.state_of(found)

    def steady_from(self, x0: ArrayLike, v0: ArrayLike, looks: float = inf) -> tuple[SteadyState, float]:
        """Return what the motion from a start at tau = 0 settles on, and what is left of the work allowed."""
        found = self.solved(self.rest(x0, v0), waits=True, left=looks)
        return self.state_of(found), looks - found.spent

    def state_of(self, found: Solved) -> SteadyState:
        """Return what a search has found; of several masses with the numbers of each mass and contact."""
        what, row, orbit_of = self.what, found.row, None
        if row[places.OUTCOME] in (places.PERIODIC, places.STUCK):
            orbit_of = self.motion(found.pieces, periodic=True, mirror=bool(found.leg["sign"] < 0.0))
        if isinstance(what, Problem):
            return from_numbers(what, row, orbit=orbit_of)
        if orbit_of is None:  # what has no contacts is linear: without an orbit it is at resonance and undamped
            state = from_numbers(self.problem, row, structure=what)
            is_linear = state.outcome == "not found" and not what.contacts
            return replace(state, outcome="unbounded") if is_linear else state
        return self.described(found, numbers_of(orbit_of, what))

    def described(self, found: Solved, numbers: dict[str, Any], notes: int = 0) -> SteadyState:
        """Return a state that was found by the numbers of its motion, with more notes."""
        row, stuck, weakens = found.row, numbers["regime"] == "stuck", self.what.weakens
        off, size = numbers["closure_error"], taken_in(numbers)
        said = {
            Note.FORGETS_SLOWLY: not stuck and 1.0 - abs(row[places.MULTIPLIER]) < SLOW,
            Note.MAY_COEXIST: not stuck and weakens,
            Note.FEWER_DIGITS: self.most < inf and not stuck and size != 0.0 and off / size > COARSE,
        }
        numbers |= {
            "solver": self.solver,
            "outcome": "stuck" if stuck else "periodic",
            "period_cycles": found.cycles,
            "notes": notes | sum(int(note) for note, is_so in said.items() if is_so),
            "structure": self.what if isinstance(self.what, Structure) else None,
        }
        return from_numbers(self.problem, row, **numbers)


def rows_of(systems: Any) -> FloatArray:
    """Return the rows (k, ROW) of the steady states of systems of one mass: the same bits as one by one."""
    ys = np.full((len(systems), 2 + int(systems["sliders"].max(initial=0))), nan)
    return _searched(workspace(), systems, ys, np.empty((PIECES, SIDE + 5)))[0]


def _searched(
    works: Any,
    systems: Any,
    ys: FloatArray,
    pieces: FloatArray,
    *,
    waits: bool = False,
    left: float = inf,
) -> tuple[FloatArray, Any, FloatArray]:
    """Return the rows (k, ROW) of steady states, leg and pieces of the last; starts are read from ys and put there."""
    legs, numbers, rows = record_of(orbit.LEG), record_of(NUMBERS), np.empty((len(systems), places.ROW))
    some, begun, search = cast("Any", np.s_[:]), ys.copy(), answer.follow if waits else answer.solve
    while True:
        found, starts = rows[some], begun[some].copy()
        search(systems[some], works, pieces, legs, starts, numbers, found, float(left))
        rows[some], ys[some] = found, starts
        outcomes = rows[:, places.OUTCOME].tolist()
        if places.AWAITED in outcomes:
            some, search = np.flatnonzero(rows[:, places.OUTCOME] == places.AWAITED), answer.follow
            continue
        if places.OVERFULL not in outcomes:
            return rows, legs[0], pieces
        some = np.flatnonzero(rows[:, places.OUTCOME] == places.OVERFULL)
        search = answer.follow if waits else answer.solve
        pieces = np.empty((max(4 * len(pieces), int(works[0]["count"])), pieces.shape[1]))
        if len(pieces) > MOST_PIECES:
            raise SimulationError(f"steady state: expected at most {MOST_PIECES} phases in an orbit; got more")
