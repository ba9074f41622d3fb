"""The steady state of a structure: the run from rest, Newton's method on its section, and what is accepted.

An orbit is told only if it is stable and the run from rest itself draws nearer to it.
"""

from math import pi

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.simulator.motion import Timeline
from frictionlab.simulator.several.answer import (
    ContactNumbers,
    StructureMotion,
    StructureState,
    contact_numbers,
    energies,
    ranges,
)
from frictionlab.simulator.several.flow import Flow, Piece
from frictionlab.simulator.structure import Structure

TURN = 2.0 * pi
PATIENCE = (2, 4, 10, 20, 40, 80, 160, 320)  # cycles further from rest, after each of which an orbit is tried
PERIODS = (1, 2, 3, 4, 8)  # cycles of the orbits looked for
NEWTON = 20
CLOSE = 1e-11  # over the motion's size: an orbit repeats
GROWS = 1.8  # while the cycles double: the motion grows without bound
NOT_FOUND = (
    "from rest no orbit of 1, 2, 3, 4 or 8 cycles was approached within 636 cycles; with more damping_ratio there is"
    " less to wait for"
)


class _Section:
    """The map of a number of half or whole cycles; the end of a half is mirrored."""

    def __init__(self, flow: Flow, halves: int) -> None:
        self.flow, self.halves = flow, halves
        self.sign = -1.0 if halves % 2 else 1.0
        n, count = flow.structure.masses, len(flow.sliders)
        self.weights = np.concatenate((np.ones(n), np.full(n, flow.structure.r), np.ones(count)))

    def image(
        self, state: FloatArray, *, tangent: bool = False
    ) -> tuple[FloatArray, FloatArray | None, tuple[Piece, ...]]:
        """Return a state's image, the map's derivative, and the pieces of the way."""
        run = self.flow.run(self.flow.station(0.0, state), self.halves * pi, tangent=tangent)
        end = np.concatenate((run.end.q, run.end.v, run.end.anchors))
        return self.sign * end, None if run.jacobian is None else self.sign * run.jacobian, run.pieces

    def size(self, vector: FloatArray) -> float:
        """Length of a state, velocities times r."""
        return float(np.linalg.norm(self.weights * vector))

    def orbit_near(self, state: FloatArray) -> tuple[FloatArray, FloatArray, float] | None:
        """Return a fixed point near a state with the map's derivative and its miss, by Newton's method; none: None.

        What the map leaves as it is (a contact that never slips) stays.
        """
        image, jacobian, _ = self.image(state, tangent=True)
        miss = self.size(image - state)
        for _ in range(NEWTON):
            if jacobian is None or miss <= 1e-15 * self.size(state):
                break
            step = np.linalg.lstsq(np.eye(len(state)) - jacobian, image - state, rcond=1e-12)[0]
            for share in (1.0, 0.5, 0.25, 0.1):
                tried = state + share * step
                ahead, slope, _ = self.image(tried, tangent=True)
                less = self.size(ahead - tried)
                if less < miss:
                    state, image, jacobian, miss = tried, ahead, slope, less
                    break
            else:
                break
        whole = max(self.size(state), 1.0)
        return (state, jacobian, miss) if jacobian is not None and miss <= CLOSE * whole else None


def steady(structure: Structure, *, near: StructureState | None = None) -> StructureState:
    """Return the steady state of a structure that the motion from rest settles on.

    Parameters
    ----------
    structure : Structure
    near : StructureState, optional
        Of a structure that is nearly the same: where it leads to a stable orbit of as many cycles, that is the answer.

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
    flow = Flow(structure)
    beside = _beside(flow, near)
    if beside is not None:
        return beside
    at = flow.at_rest()
    state = np.concatenate((at.q, at.v, at.anchors))
    lengths = [1] if structure.has_mirror_image else []
    lengths += [2] if structure.has_one_motion else [2 * period for period in PERIODS]
    before, grown = 1.0, 0.0
    whole = _Section(flow, 2)
    for cycles in PATIENCE:
        for _ in range(cycles):
            state, _, _ = whole.image(state)
        size = whole.size(state)
        grown, before = size / before, size
        for halves in lengths:
            section = _Section(flow, halves)
            found = section.orbit_near(state)
            if found is not None and _is_approached(section, state, *found[:2]):
                return _answer(section, *found)
    if grown > GROWS:
        return StructureState(structure, "unbounded")
    return StructureState(structure, "not found", warnings=(NOT_FOUND,))


def _beside(flow: Flow, near: StructureState | None) -> StructureState | None:
    """The stable orbit that Newton's method finds from another structure's; None where there is none."""
    if near is None or near.motion is None or len(near.motion.flow.sliders) != len(flow.sliders):
        return None
    at, halves = near.motion.pieces[0].motion.at, 2 * (near.period_cycles or 1)
    section = _Section(flow, 1 if flow.structure.has_mirror_image and halves == 2 else halves)
    found = section.orbit_near(np.concatenate((at.q, at.v, at.anchors)))
    if found is None or np.abs(np.linalg.eigvals(found[1])).max() > 1.0 + 1e-9:
        return None
    return _answer(section, *found)


def _is_approached(section: _Section, state: FloatArray, orbit: FloatArray, jacobian: FloatArray) -> bool:
    """Whether an orbit is stable and the run draws nearer, to half the distance, as fast as its multiplier says."""
    moduli = np.abs(np.linalg.eigvals(jacobian))
    if moduli.max() > 1.0 + 1e-9:
        return False
    away = section.size(state - orbit)
    if away <= 1e-9 * max(1.0, section.size(orbit)) or section.flow.structure.has_one_motion:
        return True
    slowest = float(moduli[moduli < 1.0 - 1e-6].max(initial=0.5))
    for _ in range(min(100, 8 + int(np.log(0.4) / np.log(slowest)))):
        state, _, _ = section.image(state)
        if section.size(state - orbit) <= 0.5 * away:
            return True
    return False


def _answer(section: _Section, state: FloatArray, jacobian: FloatArray, miss: float) -> StructureState:
    """The numbers of an orbit; one over half a cycle is followed over the whole."""
    flow, structure = section.flow, section.flow.structure
    halves = 2 if section.halves == 1 else section.halves
    cycles = halves // 2
    _, _, pieces = _Section(flow, halves).image(state)
    motion = _motion(flow, [pieces], periodic=True)
    spent, wide = energies(flow, pieces), ranges(flow, pieces)
    for piece in pieces:
        q, v = piece.motion.after(np.linspace(0.0, piece.length, 16))
        for time, *moment in zip(np.linspace(0.0, piece.length, 16), q, v, strict=True):
            flow.refuse_pull(piece.motion.at._replace(tau=piece.motion.at.tau + float(time), q=moment[0], v=moment[1]))
    taken = np.asarray(spent["contacts"]) / cycles
    contacts: tuple[ContactNumbers, ...] = tuple(
        contact_numbers(motion, number, contact, float(taken[number]))
        for number, contact in enumerate(structure.contacts)
    )
    frame, put_in = float(spent["frame"]) / cycles, float(spent["input"]) / cycles
    stuck = bool(contacts) and all(contact.stuck_fraction >= 1.0 for contact in contacts)
    multiplier = _largest(jacobian, flow, pieces)
    return StructureState(
        structure=structure,
        outcome="stuck" if stuck else "periodic",
        motion=motion,
        energy_per_cycle=float(spent["loop"]) / cycles,
        contact_energy_per_cycle=float(taken.sum()),
        frame_energy_per_cycle=frame,
        response_amplitudes=tuple(float(0.5 * (high - low)) for low, high in wide),
        contacts=contacts,
        period_cycles=cycles,
        floquet_multiplier=multiplier**2 if section.halves == 1 else multiplier,
        closure_error=abs(put_in - frame - float(taken.sum())),
        residual=miss,
        warnings=_warnings(structure, multiplier),
    )


def _largest(jacobian: FloatArray, flow: Flow, pieces: tuple[Piece, ...]) -> float:
    """The multiplier of largest modulus; the ones of what never slips are left out."""
    values = np.linalg.eigvals(jacobian)
    frozen = sum(slider.is_rigid for slider in flow.sliders)  # their anchors are not used
    frozen += sum(all(piece.modes[e] == 0 for piece in pieces) for e in range(len(flow.sliders)))
    nearest = np.argsort(np.abs(np.abs(values) - 1.0))[:frozen]
    kept = np.delete(values, [k for k in nearest if abs(abs(values[k]) - 1.0) < 1e-9])
    if not len(kept):
        return 0.0
    largest = kept[np.argmax(np.abs(kept))]
    return float(largest.real if abs(largest.imag) <= 1e-7 * abs(largest) else abs(largest))


def _warnings(structure: Structure, multiplier: float) -> tuple[str, ...]:
    lasting = "a motion beside this one does not draw nearer: a mode has neither damping nor friction"
    others = "this is the motion that rest settles on; other starts may settle on others"
    found = {lasting: abs(multiplier) > 1.0 - 1e-6, others: not structure.has_one_motion}
    return tuple(said for said, is_so in found.items() if is_so)


def _motion(flow: Flow, cycles: list[tuple[Piece, ...]], *, periodic: bool) -> StructureMotion:
    """Pieces of one cycle after the other as a motion; each cycle counts from its own begin."""
    count = np.repeat(np.arange(len(cycles)), [len(pieces) for pieces in cycles])
    pieces = tuple(piece for cycle in cycles for piece in cycle)
    tau, length = (np.array(column) for column in zip(*((p.motion.at.tau, p.length) for p in pieces), strict=True))
    return StructureMotion(flow, pieces, Timeline(count, tau, length, periodic))


def follow(structure: Structure, cycles: int) -> StructureMotion:
    """Return the motion from rest over so many cycles of the drive.

    Raises
    ------
    SimulationError
        As :func:`steady`.
    """
    flow = Flow(structure)
    at, pieces = flow.at_rest(), []
    for _ in range(cycles):
        run = flow.run(at._replace(tau=0.0), TURN)
        pieces.append(run.pieces)
        at = run.end
    return _motion(flow, pieces, periodic=False)
