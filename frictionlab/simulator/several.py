"""The steady state and the motion of a structure: several masses, any number of contacts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator import row as places
from frictionlab.simulator.exact.answer import NEVER_CLOSED
from frictionlab.simulator.exact.solve import TURN, Pieces, Solved, followed, rest_of, solved, system_of
from frictionlab.simulator.motion import Energies
from frictionlab.simulator.problem import Problem, Wall
from frictionlab.simulator.state import OUTCOMES, Regime, SteadyState
from frictionlab.simulator.structure import Structure

CREEP = 1e-10  # Y in a cycle: a contact that slips no further is at rest, at the edge of where it holds
NOT_FOUND = (
    "from rest no orbit was approached within the work allowed; with more damping_ratio there is less to wait for"
)


@dataclass(frozen=True)
class ContactNumbers:
    """What a contact does in a cycle: energy over k_1 Y^2, stops, share of the time without slip."""

    mass: int
    against: int | str
    law: str
    energy_per_cycle: float
    stops_per_cycle: float
    stuck_fraction: float


@dataclass(frozen=True)
class StructureMotion:
    """A motion of a structure, piece by piece: exact between its events, evaluated anywhere.

    Parameters
    ----------
    pieces : Pieces
    """

    pieces: Pieces

    @property
    def masses(self) -> int:
        """Number of masses."""
        return int(self.pieces.systems[0]["masses"])

    @property
    def start(self) -> float:
        """Begin of the motion, rad."""
        return self.pieces.timeline.start

    @property
    def end(self) -> float:
        """End of the motion (or of its first period), rad."""
        return self.pieces.timeline.end

    def at(self, tau: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return displacements and velocities (k, n) of the masses at times tau (k,), over Y.

        Raises
        ------
        SimulationError
            A time lies outside the motion.

        Examples
        --------
        >>> state = steady(Structure.of_storeys(0.5, [1.0, 1.0], [1.0, 1.0], [0.02, 0.02]))
        >>> state.motion.at([0.0, 1.0])[0].shape
        (2, 2)
        """
        _, found = self.pieces.at(np.atleast_1d(tau))
        return found[:, : self.masses], found[:, self.masses : 2 * self.masses]

    def force(self, tau: ArrayLike) -> FloatArray:
        """Return the forces (k, c) of the contacts on their masses, against the motion, over k_1 Y, at times (k,)."""
        return self.pieces.at(np.atleast_1d(tau))[1][:, 2 * self.masses :]

    def stops_of(self, contact: int) -> FloatArray:
        """Begin and end of each stop (m, 2), rad, of a contact (from 0); stops that go on across a cut are one."""
        return self.pieces.stops(contact)


@dataclass(frozen=True, kw_only=True)
class StructureState(SteadyState):
    """The steady state of a structure. What `SteadyState` says of one contact or mass is of the first.

    Parameters
    ----------
    structure : Structure
    motion : StructureMotion or None
        Over one period.
    response_amplitudes : tuple of float
        (max - min) / 2 of each mass's displacement over Y.
    contacts : tuple of ContactNumbers
    said : tuple of str
        What the numbers do not say.
    """

    structure: Structure
    motion: StructureMotion | None = None
    response_amplitudes: tuple[float, ...] = ()
    contacts: tuple[ContactNumbers, ...] = ()
    said: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<StructureState r = {self.structure.r:g}, {self.structure.masses} masses: {self.verdict}>"

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences about what the numbers do not say."""
        return self.said

    @property
    def verdict(self) -> str:
        """What was found, as a sentence."""
        if self.motion is None:
            said = {"unbounded": "There is no steady state: the motion grows at resonance, and friction is too weak."}
            return said.get(self.outcome, "No orbit is told: none was found from rest.")
        cycles = "cycle" if self.period_cycles == 1 else f"{self.period_cycles} cycles"
        return (
            f"The motion repeats every {cycles}: {self.regime}, {self.energy_per_cycle:.10g} k Y^2 per cycle (exact)."
        )

    def row(self) -> dict[str, object]:
        """Return the contract's keys of a steady state; what is of one contact is the first one's, or None."""
        law = self.problem.law
        return super().row() | {
            "law": law.name if self.contacts else None,
            "parameters": self.problem.parameters if self.contacts else {},
            "response_amplitudes": list(self.response_amplitudes),
            "contacts": [dict(vars(contact)) for contact in self.contacts],
        }


def _problem_of(structure: Structure) -> Problem:
    """The first contact as that of one mass; where there is none, without friction."""
    if not structure.contacts:
        return Problem(structure.r, 0.0, base=structure.base)
    first = structure.contacts[0]
    wall: Wall = "base" if first.against == "base" else "fixed"
    r, base = structure.r, structure.base
    return Problem(r, first.beta, wall=wall, base=base, law=first.law, parameters=first.parameters)


def steady(structure: Structure) -> StructureState:
    """Return the steady state of a structure that the motion from rest settles on.

    Raises
    ------
    SimulationError
        Events do not end, a gradient is too steep, or rigid contacts hold a mass twice over.

    Examples
    --------
    >>> from frictionlab.simulator.laws import law_of
    >>> from frictionlab.simulator.structure import Contact
    >>> law = law_of("coulomb")
    >>> rubs = Contact(1, "wall", law, law.complete({"beta": 0.4}))
    >>> one = Structure.of_storeys(0.5, [1.0], [1.0], [0.0], [rubs])  # eq. (2.9)
    >>> f"{steady(one).energy_per_cycle:.10f}"
    '2.1260422664'
    """
    found = solved(system_of(structure), NEVER_CLOSED)
    code = int(found.row[places.OUTCOME])
    if code in (places.CHATTERED, places.PULLING, places.RUNAWAY):
        uneven = [n for n, contact in enumerate(structure.contacts, 1) if contact.parameter("gradient")]
        if code == places.CHATTERED or not uneven:
            raise SimulationError(f"structure of {structure.masses} masses, r = {structure.r!r}: events without end")
        raise SimulationError(
            f"contact {uneven[0]}: gradient; expected 1 + gradient z > 0 on the whole motion; got"
            f" {structure.contacts[uneven[0] - 1].parameter('gradient'):g}: friction would turn into a pull; do: take a"
            " smaller gradient"
        )
    if found.pieces is None:
        outcome = OUTCOMES[code]
        said = (NOT_FOUND,) if outcome == "not found" else ()
        return StructureState(_problem_of(structure), "exact", outcome, structure=structure, said=said)
    return _state(structure, found, found.pieces())


def _state(structure: Structure, found: Solved, pieces: Pieces) -> StructureState:
    """The numbers of an orbit; one over half a cycle is mirrored in the other half."""
    numbers, row, n = found.numbers, found.row, structure.masses
    high, low = (np.asarray(numbers[name])[:n] for name in ("high", "low"))
    sizes = 0.5 * (high - low) if found.cycles >= 1.0 else np.maximum(high, -low)
    contacts = []
    for number, contact in enumerate(structure.contacts):
        energy = float(numbers["contact"][number]) / found.cycles
        stuck = float(numbers["stuck"][number]) / (found.cycles * TURN)
        holds = row[places.OUTCOME] == places.STUCK or stuck >= 1.0 - 1e-12 or energy <= CREEP * contact.beta
        stops = 0.0 if holds else float(numbers["stops"][number]) / found.cycles
        named = (contact.mass, contact.against, contact.law.name)
        contacts.append(ContactNumbers(*named, energy, stops, 1.0 if holds else stuck))
    first, multiplier = contacts[0] if contacts else None, float(row[places.MULTIPLIER])
    lasting = "a motion beside this one does not draw nearer: a mode has neither damping nor friction"
    others = "this is the motion that rest settles on; other starts may settle on others"
    said = {lasting: abs(multiplier) > 1.0 - 1e-6, others: not structure.has_one_motion}
    stuck_all = bool(contacts) and all(contact.stuck_fraction >= 1.0 for contact in contacts)
    moves: Regime = "stick-slip" if any(contact.stuck_fraction for contact in contacts) else "continuous"
    return StructureState(
        problem=_problem_of(structure),
        solver="exact",
        outcome="stuck" if stuck_all else "periodic",
        energies=Energies(*(float(row[i]) for i in (places.ENERGY, places.CONTACT_ENERGY, places.FRAME_ENERGY))),
        response_amplitude=float(sizes[0]),
        stops_per_cycle=first.stops_per_cycle if first else None,
        stuck_fraction=first.stuck_fraction if first else None,
        regime="stuck" if stuck_all else moves,
        period_cycles=max(1, round(found.cycles)),
        floquet_multiplier=multiplier,
        closure_error=float(row[places.CLOSURE]),
        residual=float(row[places.MISS]),
        structure=structure,
        motion=StructureMotion(pieces),
        response_amplitudes=tuple(sizes.tolist()),
        contacts=tuple(contacts),
        said=tuple(sentence for sentence, is_so in said.items() if is_so),
    )


def follow(structure: Structure, cycles: int) -> StructureMotion:
    """Return the motion from rest over so many cycles of the drive.

    Raises
    ------
    SimulationError
        As :func:`steady`.
    """
    systems = system_of(structure)
    return StructureMotion(followed(systems, rest_of(systems), cycles, cycles))
