"""The motion of a structure, event by event, and its derivative by the start (saltation at each event)."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from frictionlab.arrays import ComplexArray, FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.several.first_event import first_event
from frictionlab.simulator.several.linear_phase import ModalMotion, Phase, Slider, Station, drive_of, sliders_in
from frictionlab.simulator.structure import Structure

Modes = tuple[int, ...]
Lead = dict[tuple[int, int], int]
"""(contact, 0) or (slider, side) -> how many of value and slope of its event's function are zero at a phase's begin."""
BARELY = 1e-11  # over the accelerations: a contact so little pushed stays where it is
STILL = 1e-12  # over the size of the motion: a slower contact stands
IDLE = 4  # events in a row at one moment, and as many for each slider, that no motion has
EVENTS = 400.0  # in a natural period and slider that no motion has


class Event(NamedTuple):
    """What may end a phase: a linear form over (q, v, anchors, f, f', f'', 1), positive until then."""

    slider: int
    side: int  # 0: its slip ends; +-1: it gives way up or down
    form: FloatArray


@dataclass(frozen=True)
class Piece:
    """A part of a motion within one phase: its modes, and how long it lasts (rad)."""

    motion: ModalMotion
    length: float
    modes: Modes


@dataclass(frozen=True)
class FlowRun:
    """A motion over a span: its end, the derivative of its end by its start (if asked), its pieces."""

    end: Station
    jacobian: FloatArray | None
    pieces: tuple[Piece, ...]


class Flow:
    """The motion of a structure from any state: phases are made when first met, and kept.

    Parameters
    ----------
    structure : Structure

    Raises
    ------
    SimulationError
        Rigid contacts hold a mass twice over.
    """

    def __init__(self, structure: Structure) -> None:
        self.structure, self.sliders = structure, sliders_in(structure)
        self.phases: dict[Modes, Phase] = {}
        self.events: dict[Modes, tuple[list[Event], tuple[ComplexArray, ComplexArray, FloatArray]]] = {}
        self.rigid = [e for e, slider in enumerate(self.sliders) if slider.is_rigid]
        rows = np.array([[*self.sliders[e].row, self.sliders[e].follow] for e in self.rigid])
        if len(rows) and np.linalg.matrix_rank(rows) < len(rows):
            raise SimulationError(
                "structure: rigid contacts hold a mass twice over, and what each carries is not determined; do: give"
                " one of them the term compliance"
            )
        self.inverse_mass = np.linalg.inv(structure.r**2 * structure.mass)

    @property
    def size(self) -> int:
        """Length of a state: displacements, velocities, anchors."""
        return 2 * self.structure.masses + len(self.sliders)

    def phase(self, modes: Modes) -> Phase:
        """Return the phase of some modes."""
        if modes not in self.phases:
            self.phases[modes] = Phase(self.structure, self.sliders, modes)
        return self.phases[modes]

    def station(self, tau: float, state: FloatArray) -> Station:
        """Return a state (q, v, anchors) as a moment."""
        n = self.structure.masses
        return Station(tau, state[:n], state[n : 2 * n], state[2 * n :])

    def at_rest(self) -> Station:
        """Return the moment tau = 0 at which all masses are at rest and no spring pulls, but for the base's."""
        f = drive_of(self.structure, 0.0)[0]
        anchors = np.array([-slider.follow * f for slider in self.sliders])
        return Station(0.0, np.zeros(self.structure.masses), np.zeros(self.structure.masses), anchors)

    def run(self, at: Station, span: float, *, tangent: bool = False) -> FlowRun:
        """Carry a moment over a span (rad).

        Raises
        ------
        SimulationError
            Events do not end, or friction would turn into a pull.
        """
        end = at.tau + span
        jacobian = np.eye(self.size) if tangent else None
        modes, at, lead = self._begin(at)
        pieces: list[Piece] = []
        idle, left = 0, EVENTS * (1 + len(self.sliders)) * (1.0 + span / self.structure.r)
        while True:
            phase = self.phase(modes)
            self.refuse_pull(at)
            motion = phase.motion_from(at)
            length, event = self._next(modes, motion, lead, end - at.tau)
            if length > 0.0:
                pieces.append(Piece(motion, length, modes))
                if jacobian is not None:
                    jacobian = motion.tangent(length) @ jacobian
                q, v = motion.after(np.array([length]))
                at = Station(at.tau + length, q[0], v[0], at.anchors)
            if event is None:
                return self._ended(modes, at, end, jacobian, pieces)
            idle, left = idle + 1 if length == 0.0 else 0, left - 1
            if idle > IDLE * (1 + len(self.sliders)) or left < 0:
                raise self._endless(at)
            before, earlier, still = at, modes, lead if length == 0.0 else {}
            modes, at, lead = self._after(modes, at, event)
            lead = {**still, **lead}
            if jacobian is not None:
                jacobian = self._saltation(event, earlier, before, modes, at) @ jacobian

    def _ended(
        self, modes: Modes, at: Station, end: float, jacobian: FloatArray | None, pieces: list[Piece]
    ) -> FlowRun:
        """The run at its end: the anchors of what slips follow their contact."""
        anchors, n = at.anchors.copy(), self.structure.masses
        for e, (slider, mode) in enumerate(zip(self.sliders, modes, strict=True)):
            if slider.is_rigid or not mode:
                continue
            anchors[e] = slider.anchor(self._place(slider, at), mode)
            if jacobian is not None:
                jacobian[2 * n + e] = (1.0 - mode * slider.limit * slider.gradient / slider.spring) * (
                    slider.row @ jacobian[:n]
                )
        return FlowRun(at._replace(tau=end, anchors=anchors), jacobian, tuple(pieces))

    def refuse_pull(self, at: Station) -> None:
        """Refuse a moment at which friction has fallen along the path to a pull.

        Raises
        ------
        SimulationError
            1 + gradient z is not positive.
        """
        for slider in self.sliders:
            place = self._place(slider, at) if slider.gradient else 0.0
            if 1.0 + slider.gradient * place <= 0.0:
                raise SimulationError(
                    f"contact {slider.contact + 1}: gradient; expected 1 + gradient z > 0 on the whole motion; got"
                    f" {slider.gradient:g} and z = {place:.3g}: friction would turn into a pull; do: take a smaller"
                    " gradient"
                )

    def _place(self, slider: Slider, at: Station) -> float:
        return float(slider.row @ at.q - slider.follow * drive_of(self.structure, at.tau)[0])

    def _speed(self, slider: Slider, at: Station) -> float:
        return float(slider.row @ at.v - slider.follow * drive_of(self.structure, at.tau)[1])

    def vector(self, at: Station) -> FloatArray:
        """Return (q, v, anchors, f, f', f'', 1) at a moment, which linear forms are over."""
        return np.concatenate((at.q, at.v, at.anchors, drive_of(self.structure, at.tau)[:3], (1.0,)))

    def _rates(self, modes: Modes, at: Station) -> FloatArray:
        """Return the derivative of `vector` within a phase."""
        acceleration = self.phase(modes).accelerations @ self.vector(at)
        drive = drive_of(self.structure, at.tau)[1:]
        return np.concatenate((at.v, acceleration, np.zeros(len(self.sliders)), drive, (0.0,)))

    def _begin(self, at: Station) -> tuple[Modes, Station, Lead]:
        """Return the modes that a state has: what stands holds if it can, what moves slips if it is at its limit."""
        modes, resting, at = [0] * len(self.sliders), [], at._replace(anchors=at.anchors.copy())
        still = self._still(at)
        for e, slider in enumerate(self.sliders):
            speed = self._speed(slider, at)
            side = 1 if speed > 0.0 else -1
            if slider.is_rigid:
                resting += [e] if abs(speed) <= still else []
                modes[e] = 0 if abs(speed) <= still else side
                continue
            place = self._place(slider, at)
            limit, pull = slider.limit * (1.0 + slider.gradient * place), slider.spring * (place - at.anchors[e])
            if pull > slider.up * limit or -pull > slider.down * limit:  # no state of a run: Newton's method tries it
                at.anchors[e] = slider.anchor(place, 1.0 if pull > 0.0 else -1.0)
                pull = slider.spring * (place - at.anchors[e])
            smooth = (slider.up if side > 0 else slider.down) == 1.0 or abs(pull) <= limit * (1.0 + STILL)
            modes[e] = side if abs(speed) > still and side * pull >= limit * (1.0 - STILL) and smooth else 0
        return self._settled(tuple(modes), at, resting, {})

    def _settled(
        self, modes: Modes, at: Station, resting: Sequence[int], lead: Lead, breaking: int | None = None
    ) -> tuple[Modes, Station, Lead]:
        """Return the modes that are consistent for rigid contacts at rest: as many as can, hold.

        One that holds is within its limit; one that slips is accelerated the way it slips.
        """
        at = self._standing(at, resting)
        choices = sorted(product((0, 1, -1), repeat=len(resting)), key=lambda sides: sum(map(abs, sides)))
        for sides in choices:
            tried = list(modes)
            for e, side in zip(resting, sides, strict=True):
                tried[e] = side
            if breaking is not None and tried[breaking] != modes[breaking]:
                continue
            held = [self.sliders[e].row for e in self.rigid if tried[e] == 0]
            if len(held) > 1 and np.linalg.matrix_rank(held) < len(held):  # wall and base at once: the base moves
                continue
            if self._is_consistent(tuple(tried), at, resting, breaking):
                slipping: Lead = {(self.sliders[e].contact, 0): 1 for e in resting if tried[e]}
                return self._halted(tuple(tried), at, {**slipping, **lead})
        raise self._endless(at)

    def _still(self, at: Station) -> float:
        """The speed below which a contact stands, by rounding."""
        return STILL * (float(np.abs(at.v).sum()) + abs(float(drive_of(self.structure, at.tau)[1])))

    def _halted(self, modes: Modes, at: Station, lead: Lead) -> tuple[Modes, Station, Lead]:
        """Hold the elastic sliders that move no more, nor begin to: a rigid contact beside them holds."""
        changed, anchors, held = list(modes), at.anchors.copy(), dict(lead)
        for e, slider in enumerate(self.sliders):
            if modes[e] and not slider.is_rigid and abs(self._speed(slider, at)) <= self._still(at):
                ahead, later = self._ahead(slider, modes, at)
                if modes[e] * (ahead if abs(ahead) > BARELY else later) > BARELY:
                    held[slider.contact, 0] = 1 if abs(ahead) > BARELY else 2
                    continue
                changed[e], anchors[e] = 0, slider.anchor(self._place(slider, at), modes[e])
                held[e, modes[e]] = 2
        return tuple(changed), at._replace(anchors=anchors), held

    def _ahead(self, slider: Slider, modes: Modes, at: Station) -> tuple[float, float]:
        """A contact's acceleration and its rate, over the largest of the masses'."""
        accelerations, x, rates = self.phase(modes).accelerations, self.vector(at), self._rates(modes, at)
        found = []
        for values, follow in ((accelerations @ x, x[-2]), (accelerations @ rates, rates[-2])):
            size = 1.0 + float(np.abs(values).max())
            found.append((float(slider.row @ values) - slider.follow * follow) / size)
        return found[0], found[1]

    def _standing(self, at: Station, resting: Sequence[int]) -> Station:
        """Return a moment with the speeds of contacts at rest exactly zero."""
        if not resting:
            return at
        rows = np.array([self.sliders[e].row for e in resting])
        miss = np.array([self._speed(self.sliders[e], at) for e in resting])
        moved = self.inverse_mass @ rows.T
        return at._replace(v=at.v - moved @ np.linalg.lstsq(rows @ moved, miss, rcond=1e-12)[0])

    def _is_consistent(self, modes: Modes, at: Station, resting: Sequence[int], breaking: int | None) -> bool:
        phase, x = self.phase(modes), self.vector(at)
        forces = phase.forms @ x
        for e in resting:
            slider = self.sliders[e]
            if modes[e]:
                if e != breaking and modes[e] * self._ahead(slider, modes, at)[0] < -BARELY:
                    return False
                continue
            force = float(forces[slider.contact])
            limit = slider.limit * (1.0 + slider.gradient * self._place(slider, at))
            if not -slider.down * limit * (1.0 + STILL) <= force <= slider.up * limit * (1.0 + STILL):
                return False
        return True

    def _forms(self, modes: Modes) -> list[Event]:
        """The events that may end a phase."""
        n, count, found = self.structure.masses, len(self.sliders), []
        slipping: set[int] = set()
        for e, (slider, mode) in enumerate(zip(self.sliders, modes, strict=True)):
            place, speed = np.zeros(2 * n + count + 4), np.zeros(2 * n + count + 4)
            place[:n], place[2 * n + count] = slider.row, -slider.follow
            speed[n : 2 * n], speed[2 * n + count + 1] = slider.row, -slider.follow
            if mode:
                found += [Event(e, 0, mode * speed)] if slider.contact not in slipping else []
                slipping.add(slider.contact)
                continue
            if slider.is_rigid:
                force = self.phase(modes).forms[slider.contact]
            else:
                force = slider.spring * place
                force[2 * n + e] -= slider.spring
            for side, ratio in ((1, slider.up), (-1, slider.down)):
                limit = ratio * slider.limit * slider.gradient * place
                limit[-1] += ratio * slider.limit
                found.append(Event(e, side, limit - side * force))
        return found

    def _next(self, modes: Modes, motion: ModalMotion, lead: Lead, span: float) -> tuple[float, Event | None]:
        """Return how long a phase lasts within a span, and what ends it."""
        if modes not in self.events:
            events = self._forms(modes)
            width = 2 * self.structure.masses + len(self.sliders) + 4
            forms = np.array([event.form for event in events]).reshape(len(events), width)
            rows, waves, others = motion.phase.in_modes(forms)
            varies = np.abs(rows).sum(axis=1) + np.abs(waves).sum(axis=1) > STILL * np.abs(forms).sum(axis=1)
            events = [event for event, alive in zip(events, varies, strict=True) if alive]
            self.events[modes] = events, (rows[varies], waves[varies], others[varies])
        events, (rows, waves, others) = self.events[modes]
        if not events:
            return span, None
        base = self.structure.base
        turned = waves * base.lines * np.exp(1j * np.arange(1, base.harmonics + 1) * motion.at.tau)
        signed = np.hstack((0.5 * turned, 0.5 * turned.conj()))
        offsets = others @ np.concatenate((motion.rest, motion.at.anchors, (1.0,)))
        fresh = np.array([lead.get(self._key(event), 0) for event in events])
        rows = np.ascontiguousarray(rows)
        length, which = first_event(motion.phase.rates, motion.drive, rows, signed, offsets, fresh, span)
        return length, events[which] if which >= 0 else None

    def _key(self, event: Event) -> tuple[int, int]:
        return (event.slider, event.side) if event.side else (self.sliders[event.slider].contact, 0)

    def _after(self, modes: Modes, at: Station, event: Event) -> tuple[Modes, Station, Lead]:
        """Return modes and moment after an event, and what has just begun."""
        slider, changed, lead = self.sliders[event.slider], list(modes), Lead()
        resting = [e for e in self.rigid if modes[e] == 0]
        if event.side == 0:
            anchors = at.anchors.copy()
            for e, other in enumerate(self.sliders):
                if other.contact == slider.contact and modes[e]:
                    changed[e] = 0
                    if not other.is_rigid:
                        anchors[e] = other.anchor(self._place(other, at), modes[e])
                        lead[e, modes[e]] = 2 if abs(self._speed(other, at)) <= self._still(at) else 1
            at = at._replace(anchors=anchors)
            resting += [event.slider] if slider.is_rigid else []
            return self._settled(tuple(changed), at, resting, lead)
        changed[event.slider] = event.side
        if not slider.is_rigid:
            return self._settled(tuple(changed), at, resting, {})
        smooth = (slider.up if event.side > 0 else slider.down) == 1.0
        return self._settled(tuple(changed), at, resting, {(slider.contact, 0): 2 if smooth else 1}, event.slider)

    def _saltation(self, event: Event, earlier: Modes, before: Station, modes: Modes, after: Station) -> FloatArray:
        """Return what an event makes of the derivative: the jump of the state's rate, at the time that shifts."""
        n, size = self.structure.masses, self.size
        reset = np.eye(size)
        for e, slider in enumerate(self.sliders):
            if earlier[e] and not modes[e] and not slider.is_rigid:
                reset[2 * n + e] = 0.0
                reset[2 * n + e, :n] = (1.0 - earlier[e] * slider.limit * slider.gradient / slider.spring) * slider.row
        old, new = self._rates(earlier, before), self._rates(modes, after)
        fall = float(event.form @ old)
        if fall == 0.0:
            return reset
        jump = new[:size] - old[:size]
        jump[2 * n :] = 0.0
        return np.asarray(reset + np.outer(jump, event.form[:size]) / fall)

    def _endless(self, at: Station) -> SimulationError:
        return SimulationError(
            f"simulation: events without end at tau = {at.tau!r} of a structure of {self.structure.masses} masses and"
            f" {len(self.structure.contacts)} contacts, r = {self.structure.r!r}; expected at most some hundred phases"
            f" per cycle and natural period; last q = {at.q.tolist()}, v = {at.v.tolist()}; do: report these numbers"
        )

    def contact_forces(self, piece: Piece, times: FloatArray) -> FloatArray:
        """Return the forces (k, c) of the contacts on their masses at times after a piece's begin."""
        q, v = piece.motion.after(times)
        tau = piece.motion.at.tau + times
        drive = np.array([drive_of(self.structure, float(each))[:3] for each in tau])
        anchors = np.tile(piece.motion.at.anchors, (len(times), 1))
        return np.asarray(np.hstack((q, v, anchors, drive, np.ones((len(times), 1)))) @ self.phase(piece.modes).forms.T)

    def holds(self, pieces: Sequence[Piece], contact: int) -> Iterator[bool]:
        """Tell of each piece whether no slider of a contact slips."""
        own = [e for e, slider in enumerate(self.sliders) if slider.contact == contact]
        return (not any(piece.modes[e] for e in own) for piece in pieces)
