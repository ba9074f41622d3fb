"""The exact flow as Python calls it: steady states and motions of one mass or many, by linear phases between events."""

import threading
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil, inf, nan, pi
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.arrays import ComplexArray, FloatArray
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
from frictionlab.simulator.state import SteadyState, from_numbers, numbers_of
from frictionlab.simulator.structure import Contact, Structure, frame_of

announce("frictionlab.simulator.exact.answer")

MODES = address_in_python(phase.make_modes, phase.SYSTEM, phase.PHASES)

TURN = 2.0 * pi
TOUCH = 1e-13  # rad: a shorter stick is no stop
SECTIONS = 4  # phases of the drive from which the only orbit is tried
RESTING = 64  # cycles in which a mass that can rest comes to rest, or nearly so
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
    if isinstance(what, Problem) and what.is_exact:
        values = what.parameters | {"r": what.r}
        return systems_of({name: np.array([value]) for name, value in values.items()}, what.wall, what.base)
    what = frame_of(what)
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
    systems["mirror"] = -1
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
            springs, strengths = sliders_of({name: float(np.ravel(each)[k]) for name, each in values.items()})
            own, begin = systems[k], int(systems[k]["first"][c])  # after those of the contacts before it
            end = begin + len(springs)
            _refuse_more("sliders", end, phase.SLIDERS)
            own["spring"][begin:end], own["strength"][begin:end] = springs, strengths
            own["first"][c + 1] = own["sliders"] = end
    if any(follow for _, follow, _ in contacts) and all(follow or row.sum() == 0.0 for row, follow, _ in contacts):
        systems["push"][:, :n, 0], systems["push"][:, :n, 1] = -systems["inertia"][:, :n, :n].sum(axis=-1), 0.0
        systems["follow"], systems["moves"] = 0.0, 0.0
        systems["lines"][:, : base.harmonics] *= -(np.arange(1.0, base.harmonics + 1.0) ** 2)
    return systems


def _refuse_more(name: str, count: int, most: int) -> None:
    if count > most:
        raise SimulationError(f"structure: {name}; expected at most {most}; got {count}; do: leave some out")


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
        self.each = 8 * (max(1, int(self.systems[0]["harmonics"])) + 1.0 / what.r)  # pieces likely in a cycle

    @property
    def size(self) -> int:
        """Number of entries of a state."""
        return 2 * self.masses + int(self.systems[0]["sliders"])

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
        sums = record_of(NUMBERS)
        account_all(self.systems, workspace(), pieces if pieces.flags.writeable else pieces.copy(), sums)
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
        works, found = workspace(), np.empty((len(index), 2 * self.masses + self.contacts))
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

    def stored(self, sample: FloatArray, f: float) -> FloatArray:
        """Return the energy (c,) in the contacts' springs at the state at hand, by displacements (n,) and the base."""
        system, work, stored = self.systems[0], workspace()[0], np.zeros(self.contacts)
        for c in range(self.contacts):
            place = system["row"][c, : self.masses] @ sample[: self.masses] - system["follow"][c] * f
            some = slice(int(system["first"][c]), int(system["first"][c + 1]))
            limit = work["side"][c] * system["strength"][some] * (1.0 + system["gradient"][c] * place)
            held = np.where(work["slips"][some] != 0, limit, system["spring"][some] * (place - work["anchor"][some]))
            stored[c] = np.sum(0.5 * held**2 / system["spring"][some])
        return stored

    def along(
        self, time: FloatArray, cubics: FloatArray, q: FloatArray, v: FloatArray, left: float = inf
    ) -> tuple[Motion, FloatArray]:
        """Return the motion along sampled times (k,) from displacements and velocities (n,) on, and what it is at them.

        `cubics` (k - 1, 4): what drives the masses, in the time from each sample on. At the samples (k, 2 n + c) are
        displacements, velocities and contacts' forces. `left`: evaluations, or steps, between samples.
        """
        works, n, count = workspace(), self.masses, 256 + 2 * len(time)
        start, found = self.rest_at(q, v, float(cubics[0, 0])), np.empty((len(time), 2 * n + self.contacts))
        self.systems[0]["harmonics"] = 0
        while True:
            pieces, work = np.empty((count, self.width)), works[0]
            work["q"][:n], work["v"][:n], work["anchor"][: self.size - 2 * n] = np.split(start, (n, 2 * n))
            reached, code = answer.travel(self.systems, works, pieces, time, cubics, found, left)
            self.refuse(code, f" of a record at tau = {time[reached]:.6g}")
            count = int(work["count"])
            if count <= len(pieces):
                return Motion(self.problem, self, pieces[:count], periodic=False), found

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
        works, legs, end = workspace(), record_of(orbit.LEG), np.empty(self.size)
        legs[0], works[0]["left"] = (tau, span, turns, 1.0, 0), self.longest
        self.refuse(answer.carry_on(self.systems, works, pieces, legs, start.copy(), end, derived))
        return end, works[0]["jacobian"][: self.size, : self.size].copy(), int(works[0]["count"])

    def recorded(self, start: FloatArray, tau: float, cycles: int, *, first: int = 0, periodic: bool = False) -> Motion:
        """Return the motion from a state over some cycles, the first of which has the number `first`."""
        count = 64 + ceil(self.each * cycles)
        while True:
            pieces = np.empty((min(count, MOST_PIECES), self.width))
            count = self.carried(start, tau, TURN, cycles, pieces)[2]
            if count <= len(pieces):
                return Motion(self.problem, self, pieces[:count].copy(), periodic, first=first)
            if count > MOST_PIECES:
                raise SimulationError(
                    f"simulate: expected at most {MOST_PIECES} phases; got {count}; do: keep fewer cycles"
                )

    def solved(self, start: FloatArray | None = None, *, waits: bool = False, left: float = inf) -> "Search":
        """Return the steady state that rest settles on, or the motion from a start.

        `waits`: the motion is followed at once. `left`: evaluations that the search may take, if those are fewer than
        its own share.
        """
        if start is None:
            still, f = np.zeros(self.masses), self.systems[0]["lines"].real
            start = np.zeros(self.size) if self.masses == 1 else self.rest_at(still, still, float(f.sum()))
        count = PIECES if self.most == inf else 0  # an integrated orbit is recorded when it is found
        search = Search(self.systems, start[np.newaxis].copy(), np.empty((count, self.width)), min(left, self.most))
        search.run(waits=waits)
        search.pieces = search.pieces[: int(search.works[0]["count"])]
        return search

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
        code = int(found.rows[0, places.OUTCOME])
        if meter is not None:
            meter.take(EXACT_STATE + found.spent / LOOKS)
        if code == places.CHATTERED:
            self.refuse(phase.CHATTER)
        if many and code in (places.PULLING, places.RUNAWAY):
            self.refuse(phase.PULLS)
        is_closed = found.rows[0, places.SOLVER] == places.CLOSED_FORM or code in (places.STUCK, places.UNBOUNDED)
        if solver == "exact":
            found.rows[0, places.SOLVER] = places.EXACT
        if solver == "closed-form" and not is_closed:
            raise SimulationError(
                f"steady state: closed form at r = {what.r!r}; expected continuous motion of an undamped mass under a"
                " pure cosine (2.10); got stops, damping or harmonics; do: use solver 'exact'"
            )
        return self.state_of(found)

    def state_of(self, found: "Search") -> SteadyState:
        """Return what a search has found; of several masses with the numbers of each mass and contact."""
        what, row, orbit_of = self.what, found.rows[0], None
        if row[places.OUTCOME] in (places.PERIODIC, places.STUCK):
            orbit_of = Motion(self.problem, self, found.pieces, periodic=True, mirror=bool(found.legs[0]["sign"] < 0.0))
        if isinstance(what, Problem):
            return from_numbers(what, row, orbit=orbit_of)
        if orbit_of is None:  # what has no contacts is linear: without an orbit it is at resonance and undamped
            state = from_numbers(self.problem, row, structure=what)
            is_linear = state.outcome == "not found" and not what.contacts
            return replace(state, outcome="unbounded") if is_linear else state
        return self.described(found, orbit_of)

    def described(self, found: "Search", motion: Motion, notes: int = 0) -> SteadyState:
        """Return a state that was found by the numbers of its motion, with more notes."""
        row, numbers, weakens = found.rows[0], numbers_of(motion), self.what.weakens
        stuck, taken, off = numbers["regime"] == "stuck", motion.taken, abs(float(motion.sums["gap"]))
        said = {
            Note.FORGETS_SLOWLY: not stuck and 1.0 - abs(row[places.MULTIPLIER]) < SLOW,
            Note.MAY_COEXIST: not stuck and weakens,
            Note.FEWER_DIGITS: self.most < inf and not stuck and taken != 0.0 and off / taken > COARSE,
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
    ys = np.zeros((len(systems), 2 + int(systems["sliders"].max(initial=0))))
    return Search(systems, ys, np.empty((PIECES, SIDE + 5))).run()


class Search:
    """A search for the steady states of systems (k,), from starts (k, size).

    Compiled is what most of them need, Newton's method from the start; what that leaves open is seen to here. Then `ys`
    are starts of the orbits, `legs` and `pieces` are those of the last one. `left`: what each may spend, if that is
    less than its share.
    """

    def __init__(self, systems: Any, starts: FloatArray, pieces: FloatArray, left: float = inf) -> None:
        self.systems, self.starts, self.pieces, self.left = systems, starts, pieces, float(left)
        self.works, self.legs, self.sums, self.spent = workspace(), record_of(orbit.LEG), record_of(NUMBERS), 0.0
        self.rows = np.full((len(systems), places.ROW), nan)

    @property
    def cycles(self) -> int:
        """Cycles of the last one's map, whole ones of a half that is mirrored."""
        return ceil(self.legs[0]["span"] * self.legs[0]["turns"] / TURN)

    def run(self, *, waits: bool = False) -> FloatArray:
        """Return the rows (k, ROW); `waits`: motions are followed at once."""
        search, outcomes = answer.follow if waits else answer.solve, self.rows[:, places.OUTCOME]
        self.ys = self.starts.copy()
        search(self.systems, self.works, self.pieces, self.legs, self.ys, self.sums, self.rows, self.left)
        self.spent = float(self.works[0]["spent"])
        while outcomes.max() >= places.OVERFULL:
            resting = self._which(places.RESTING)
            for k in resting:
                outcomes[k] = places.STUCK if self._comes_to_rest(k) else places.RESTING
            self._ask(resting, answer.solve)
            for k in self._which(places.UNREACHED):
                outcomes[k] = self._reach(k)
                if outcomes[k] == places.PERIODIC:
                    self._ask(np.array([k]), answer.solve)
            self._ask(self._which(places.AWAITED), answer.follow)
            more, space = self._which(places.OVERFULL), max(4 * len(self.pieces), int(self.works[0]["count"]))
            if len(more) and space > MOST_PIECES:
                raise SimulationError(f"steady state: expected at most {MOST_PIECES} phases in an orbit; got more")
            self.pieces = np.empty((space, self.pieces.shape[1])) if len(more) else self.pieces
            self._ask(more, search)
        return self.rows

    def _which(self, outcome: int) -> NDArray[np.intp]:
        return np.flatnonzero(self.rows[:, places.OUTCOME] == outcome)

    def _ask(self, some: NDArray[np.intp], search: Any) -> None:
        """Fill the rows of some systems."""
        if len(some):
            found, ys = self.rows[some], self.starts[some]
            search(self.systems[some], self.works, self.pieces, self.legs, ys, self.sums, found, self.left)
            self.rows[some], self.ys[some] = found, ys
            self.spent += float(self.works[0]["spent"])

    def _begin(self, k: int) -> tuple[Any, Any, FloatArray]:
        """Return a system, the workspace without the phases of others, and the start."""
        self.works[0]["phases"]["count"] = self.works[0]["phases"]["next"] = 0
        return self.systems[k], self.works[0], self.starts[k].copy()

    def _carry(self, k: int, y: FloatArray) -> int:
        """Replace a state of a system by what it becomes over the leg; return how that ended."""
        return answer.carry_on(self.systems[k : k + 1], self.works, self.pieces, self.legs, y.copy(), y, False)

    def _comes_to_rest(self, k: int) -> bool:
        """Return whether the motion of one mass with a rigid contact ends at rest; its place is then the start.

        Under plain dry friction it does wherever a place holds the mass: the distance to a motion at rest never grows.
        It may need endlessly many ever smaller slides, and ends at the edge of the places then; elsewhere such slides
        show it.
        """
        system, work, y = self._begin(k)
        least, largest = places_of_rest(system)
        if least > largest or (least <= y[0] <= largest and y[1] == 0.0):
            return least <= largest
        before, self.legs[0], work["left"] = 0.0, (0.0, TURN, 1, 1.0, 0), inf
        for cycle in range(RESTING):
            if self._carry(k, y) != phase.DONE:
                return False
            if work["path"] == 0.0:
                self.starts[k] = y
                return True
            before = float(work["path"]) if cycle == RESTING // 2 else before
        waves = np.abs(system["lines"]) @ np.arange(1.0, len(system["lines"]) + 1.0)
        inside, aim = 4e-16 * (float(waves) + abs(least) + abs(largest)), 0.5 * (least + largest)
        if largest - least > 2.0 * inside:
            aim = min(max(y[0], least + inside), largest - inside)
        slows = work["path"] < 0.5 * before and abs(y[0] - aim) < 4.0 * RESTING * work["path"]
        if system["alone"] or slows:
            self.starts[k] = aim, 0.0
        return bool(system["alone"] or slows)

    def _forced(self, k: int, *, held: bool) -> FloatArray:
        """Return the forced motion at tau = 0 as a state: contacts without friction, or elastic ones held."""
        system, y = self.systems[k], np.zeros(self.starts.shape[1])
        n, c, h = (int(system[name]) for name in ("masses", "contacts", "harmonics"))
        row, follow, first = system["row"][:c, :n], system["follow"][:c], system["first"]
        springs = np.array([held * system["spring"][first[i] : first[i + 1]].sum() for i in range(c)])
        inertia, damping, stiffness = (system[name][:n, :n] for name in ("inertia", "damping", "stiffness"))
        turn = 1j * np.arange(1.0, h + 1.0)[:, None, None]
        matrix = turn**2 * inertia + turn * damping + stiffness + row.T @ (springs[:, None] * row)
        push = system["push"][:n, 0] + turn[:, 0] * system["push"][:n, 1] + row.T @ (springs * follow)
        waves = (np.linalg.pinv(matrix) @ (push * system["lines"][:h, None])[..., None])[..., 0]
        y[:n], y[n : 2 * n] = waves.real.sum(axis=0), (turn[:, 0] * waves).real.sum(axis=0)
        for i in range(0 if held else c):
            y[2 * n + first[i] : 2 * n + first[i + 1]] = row[i] @ y[:n] - follow[i] * system["lines"][:h].real.sum()
        return y

    def _reach(self, k: int) -> int:
        """Find the orbit of a system that Newton's method did not come to from rest; return an outcome, as `solve`.

        Without friction it is the forced motion. The map has a kink where a contact comes to rest just at the section,
        and Newton's method may stall there: then the section is shifted. Where stops are about to vanish it converges
        only from the side on which the mass stops: more friction is on that side. Start and leg of the orbit are kept.
        """
        system, work, rest = self._begin(k)
        leg, exact, rubs = self.legs[0], system["law"]["tolerance"] == 0.0, system["limit"].any()
        share = float(system["harmonics"] * (answer.LOOKS + answer.CYCLES * 10.0 / system["r"]))
        work["left"] = before = min(self.left, share) - float(work["spent"])
        self.legs[0] = (0.0, pi, 1, -1.0, orbit.SOME) if system["mirrored"] else (0.0, TURN, 1, 1.0, orbit.SOME)
        kinds = [False, True] if system["sliders"] else [False]
        starts = [(0.0, self._forced(k, held=held)) for held in kinds if exact]
        for tau, y in [*starts, *((0.7 * i, rest) for i in range(1, SECTIONS))]:
            leg["tau"], self.starts[k] = tau, y
            if tau:
                self._carry(k, self.starts[k])
                self._carry(k, self.starts[k])
            miss, floor, code, stable = self._shoot(k)
            if code == phase.TIRED or (code == phase.DONE and miss <= (floor if rubs else 1e3 * floor)):
                break
        else:
            leg["tau"], self.starts[k] = 0.0, rest
            if exact and system["masses"] == 1 and not system["sliders"]:
                self.starts[k], limit = 0.0, float(system["limit"][0])
                for more in 0.03 * 0.2 ** np.arange(23.0):
                    system["limit"][0] = limit * (1.0 + more)
                    self._shoot(k)
                system["limit"][0] = limit
            leg["stalls"] = orbit.MANY
            miss, floor, code, stable = self._shoot(k)
        self.spent += before - float(work["left"])
        self.rows[k, places.MISS] = miss
        if code == phase.TIRED or (code != phase.DONE and system["alone"]):
            return orbit.VERDICT[code]
        if system["alone"]:
            return places.PERIODIC if miss <= 1e3 * floor else places.NOT_FOUND
        if code == phase.DONE and miss <= floor and stable:
            return places.PERIODIC
        self.starts[k] = rest
        return places.AWAITED

    def _shoot(self, k: int) -> tuple[float, float, int, bool]:
        return answer.shoot_on(self.systems[k : k + 1], self.works, self.pieces, self.legs, self.starts[k])


def places_of_rest(system: Any) -> tuple[float, float]:
    """Return the least and the largest place at which friction holds one mass; none does where the least is larger.

    By the extremes of the force that holds it at s = 0.
    """
    k = np.arange(1, int(system["harmonics"]) + 1)
    push, stiffness, q = system["push"][0], system["stiffness"][0, 0], system["gradient"][0]
    waves, up, down = (push[0] + 1j * k * push[1]) * system["lines"][: len(k)], system["up"][0], system["down"][0]
    high, low = (abs(waves[0]), -abs(waves[0])) if len(k) == 1 else (crest_of(waves), -crest_of(-waves))
    up, down = up * system["limit"][0], down * system["limit"][0]
    return (high - up) / (stiffness + up * q), (low + down) / (stiffness - down * q)


def crest_of(waves: ComplexArray) -> float:
    """Return the largest value of Re sum waves_k e^(i k tau), k from 1 on.

    Newton's method from all samples beside which it may be: half a step away the curve is higher by no more than its
    largest curvature lets it.
    """
    k, count = np.arange(1.0, len(waves) + 1.0), 16 * len(waves)
    half, bends = pi / count, float(k**2 @ np.abs(waves))
    curve = np.fft.irfft(0.5 * count * np.append(0.0, waves), count)
    tau = 2.0 * half * np.flatnonzero(curve >= curve.max() - 0.5 * bends * half**2)
    for _ in range(12):
        turned = np.exp(1j * np.outer(tau, k)) * waves
        tau = tau - np.clip((turned.imag @ k) / np.maximum(turned.real @ k**2, 1e-9 * bends), -half, half)
    return float(max(curve.max(), turned.real.sum(axis=1).max()))
