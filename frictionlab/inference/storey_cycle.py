"""One test of a frame of several masses: what its sensors show of all of them, under the law of one contact.

The first of ``[[rig.contacts]]`` is fitted as the contact of a single mass is; the others are as the scene says. The
data are the harmonics of every mass that was measured, with one covariance.
"""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from frictionlab.analysis.measurement import Measurement
from frictionlab.arrays import FloatArray
from frictionlab.errors import UsageError
from frictionlab.inference.comparison import AtContact, base_lines, harmonics_of, left_for_contact, over_cycle
from frictionlab.inference.observation import NO_MOTION, SENSORS, Values
from frictionlab.inference.observations import GAIN, CycleObservation, of_measurement
from frictionlab.inference.unknowns import SMALLEST, Unknown, damping_of
from frictionlab.scene import Scene, Solver
from frictionlab.scene.physical import contacts_of, storeys_of, structure_of
from frictionlab.simulator import Contact, SteadyState, Structure, steady_state
from frictionlab.simulator.laws import Law, law_of

COST = 400.0  # steps of integration that a steady state of several masses costs, about
FREQUENCY, DAMPING = "storey_{}_frequency", "storey_{}_damping"  # from the second storey on
MOST = 9  # masses whose sensors may have a gain of their own


@dataclass(frozen=True, kw_only=True)
class StoreyObservation(CycleObservation):
    """The mean cycle of all measured masses of a frame, under the law of its first contact."""

    scene: Scene
    single: ClassVar[bool] = False
    by_sensors: ClassVar = (*SENSORS, "mass_in_base", *(GAIN.format(i) for i in range(2, MOST + 1)))

    @property
    def place_words(self) -> str:
        """Where the contact is, as words."""
        rig, at = self.scene.rig, contacts_of(self.scene)
        against = f"mass {at[0].against}" if isinstance(at[0].against, int) else f"the {at[0].against}"
        others = f", {len(at) - 1} more contacts as the scene says" if len(at) > 1 else ""
        return f"mass {at[0].mass} of {max(len(rig.masses), 1)} against {against}{others}"

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of sensors and rig: of upper storeys and their sensors as much as of the first."""
        detuned, loose, known = self.sources.natural_frequency, self.sources.damping_ratio, super().rig_unknowns
        more: list[Unknown] = []
        for i, storey in enumerate(self.scene.rig.masses[1:], 2):
            key, zeta = f"rig.masses.{i - 1}", storey.damping_ratio or 0.0
            more += [
                Unknown(FREQUENCY.format(i), f"natural frequency of storey {i}", sd=detuned, key=key),
                damping_of(DAMPING.format(i), f"damping of storey {i}", zeta, loose, key),
            ]
        for gain in (u for u in known if u.name == "gain"):
            more += [
                Unknown(GAIN.format(i), f"gain of the sensor of mass {i}", sd=gain.sd, key=gain.key)
                for i in range(2, self.seen_masses + 1)
            ]
        return (*known, *(u for u in more if u.sd > SMALLEST))

    def structure(self, values: Values) -> Structure:
        """Return the frame at some values of the unknowns."""
        problem, at = self.problem(values), contacts_of(self.scene)[0]
        numbers = self.law.complete({p.name: problem.parameters[p.name] for p in self.law.own})
        mass, stiffness, damping = storeys_of(self.scene)
        for i in range(2, len(mass) + 1):
            stiffness[i - 1] *= (1.0 + values.get(FREQUENCY.format(i), 0.0)) ** 2
            damping[i - 1] = max(values.get(DAMPING.format(i), damping[i - 1]), 0.0)
        damping[0] = problem.frame_damping_ratio
        return structure_of(
            self.scene,
            problem.r,
            self.unit,
            first=Contact(at.mass, at.against, self.law, numbers),
            storeys=np.array([mass, stiffness, damping]),
            base=problem.base,
        )

    def state(self, values: Values, near: SteadyState | None = None) -> SteadyState | None:  # noqa: ARG002 - all is solved anew
        """Return the steady state at some values; None where there is none.

        Stops and regime are those of the motion against the wall, as `analyze` counts them: of a contact elsewhere they
        are not known.
        """
        self.work.take(COST)
        try:
            whole = steady_state(self.structure(values))
        except NO_MOTION:
            return None
        contact = whole.contacts[0] if whole.contacts else None
        seen = contact if contact and (contact.mass, contact.against) == (1, "wall") else None
        return replace(
            whole,
            problem=self.problem(values),
            stops_per_cycle=seen.stops_per_cycle if seen else None,
            stuck_fraction=seen.stuck_fraction if seen else None,
            regime=whole.regime if seen else None,
        )

    def solved(self, values: Values, solver: Solver = "auto") -> SteadyState:  # noqa: ARG002 - there is one for frames
        """Return the steady state predicted."""
        return self.state(values) or SteadyState(self.problem(values), "exact", "not found")

    def measured_contact(self, state: SteadyState, late: float) -> AtContact | None:
        """Return slip and force of the first contact by the measured motion; None where its masses were not measured.

        What the equation of motion leaves at its mass, less what the other contacts there take in the prediction.
        """
        structure, motion = state.structure, state.orbit
        if structure is None or motion is None or structure.masses > self.seen_masses:
            return None
        contact, cycle = structure.contacts[0], self.cycle
        lines = harmonics_of(np.array([cycle.mass_smooth, *(other.mass for other in cycle.others)]))
        base, order = base_lines(structure.base, lines.shape[1], late), np.arange(1, lines.shape[1] + 1)
        at = contact.mass - 1
        left = left_for_contact(
            lines, base, structure.r, structure.mass[at], structure.stiffness[at], structure.damping[at]
        )
        row = structure.row(contact)
        slip = row @ lines - (base if contact.against == "base" else 0.0)
        rows = np.array([structure.row(c)[at] for c in structure.contacts])
        others = harmonics_of(motion.all_at(cycle.tau + late)[2][:, 1:] @ rows[1:])
        points = len(cycle.tau)
        z, v, n = (over_cycle(part, points) for part in (slip, 1j * order * slip, left - others))
        return AtContact(z, v, n)

    def law_at_contact(self, state: SteadyState, tau: FloatArray) -> AtContact | None:
        """Return slip, its velocity and the force of the first contact in the prediction."""
        structure, motion = state.structure, state.orbit
        if structure is None or motion is None:
            return None
        contact, (q, v, force) = structure.contacts[0], motion.all_at(tau)
        row, follow = structure.row(contact), float(contact.against == "base")
        z = q @ row - follow * structure.base.at(tau)
        return AtContact(z, v @ row - follow * structure.base.rate_at(tau), force[:, 0])

    def left(self, predicted: FloatArray, values: Values) -> float:  # noqa: ARG002 - of one mass it takes that
        """Return the rms over all masses of what the prediction leaves, over that of the measured."""
        shown = self.predict(values)
        return math.nan if shown is None else self.nrmse(self.white(self.data - shown))


def observe_storeys(measurement: Measurement, scene: Scene, law: str | Law | None) -> StoreyObservation:
    """Return a measured test of a frame of several masses as a fit sees it.

    ``law``: of the first contact, in place of the scene's: then its parameters in the scene are not held. SceneError:
    the friction of another contact is not known; UsageError: more masses were measured than the scene has, or the law's
    phases are not linear.
    """
    rig, seen = scene.rig, 1 + len(measurement.cycle.others)
    masses = max(len(rig.masses), 1)
    if seen > masses:
        raise UsageError(
            f"{measurement.source}: expected {masses} masses, as [[rig.masses]] has them; got {seen} measured: give"
            " each its table, from the base up"
        )
    contact = contacts_of(scene)[0]
    chosen = law_of(contact.law if law is None else law)
    held = dict(contact.parameters) if law is None else {}
    if rig.damping is not None:
        held["frame_damping_ratio"] = rig.damping
    soft = [p.name for t in chosen.terms if t.kind != "rigid" for p in t.parameters if p.name not in held]
    if not chosen.is_exact or soft:
        raise UsageError(
            f"law {chosen.name}: in a frame of several masses the contact that is fitted is a sum of coulomb, place,"
            " speed and breakaway (rig.contacts, --law); one that yields has many minima there"
            + (f": give {', '.join(soft)} in [[rig.contacts]]" if chosen.is_exact else "")
        )
    known = of_measurement(measurement, scene, seen)
    known["normal_force"] = contact.normal_force_n or measurement.normal_force_n
    return StoreyObservation(law=chosen, held=held, wall="fixed", scene=scene, seen_masses=seen, **known)
