"""A sampled base motion in, the motion of the mass out: exact between samples, event by event, where the law allows."""

from dataclasses import dataclass
from math import pi
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record.base import BaseRecord
from frictionlab.simulator.structure import Structure

MOST_CYCLES = 1e7  # natural periods: half a minute of compiled work that nothing interrupts


@dataclass(frozen=True)
class RecordMotion:
    """The motion of the masses under a sampled motion of the base, from its first sample to its last.

    Lengths are over Y = `base.scale`, times are tau = omega_n t in rad, forces over k Y; of several masses omega_n and
    k are the first storey's.

    Parameters
    ----------
    problem : Problem
        What moves; of several masses, as the first contact has it.
    frame : Structure
        What moves, as masses and contacts.
    base : BaseRecord
    solver : {"exact", "numeric"}
        Closed forms, or numerical integration for the laws that have none.
    displacements, velocities : ndarray of shape (k, n)
        Absolute displacements of the masses from where the springs are relaxed, and their rates by tau, at the samples;
        relative to the base where that is given by its acceleration: how far it went is not known.
    contact_forces : ndarray of shape (k, c)
        Forces of the contacts on the masses, at the samples.
    """

    problem: Problem
    frame: Structure
    base: BaseRecord
    solver: Literal["exact", "numeric"]
    displacements: FloatArray
    velocities: FloatArray
    contact_forces: FloatArray

    @property
    def displacement(self) -> FloatArray:
        """Displacement of the first mass at the samples (k,)."""
        return self.displacements[:, 0]

    @property
    def velocity(self) -> FloatArray:
        """Velocity of the first mass at the samples (k,)."""
        return self.velocities[:, 0]

    @property
    def contact_force(self) -> FloatArray:
        """Force of the first contact on its mass at the samples (k,)."""
        return self.contact_forces[:, 0]

    @property
    def time(self) -> FloatArray:
        """Times of the samples, tau in rad."""
        return self.base.time

    def place_of(self, contact: int) -> FloatArray:
        """Displacement of a contact (from 0) at the samples (k,): of its mass from what it rubs against."""
        known = self.frame.contacts[contact]
        place = self.displacements @ self.frame.row(known)
        moves = known.against == "base" and self.base.quantity == "displacement"
        return np.asarray(place - self.base.values if moves else place)

    @property
    def peaks(self) -> dict[str, float]:
        """Largest sizes at the samples: displacement, velocity, displacement from the base, contact force."""
        known = self.base.quantity == "displacement"  # else it is from the base
        series = {
            "displacement": self.displacement,
            "velocity": self.velocity,
            "relative_displacement": self.displacement - self.base.values if known else self.displacement,
            "contact_force": self.contact_force,
        }
        return {name: float(np.abs(values).max()) for name, values in series.items()}


@dataclass(frozen=True)
class Response(RecordMotion):
    """A motion under a sampled base, accounted for; energies are over k Y^2.

    A contact with an inner state always creeps: a stop is then slow slip (`Integrated.stop_limits`), and its path is
    the way slipped.

    Parameters
    ----------
    contact_stops : list of ndarray of shape (m, 2)
        Of each contact: begin and end of each time in which it does not slip, rad.
    energy : float
        All that is dissipated: by friction, by the contacts' dashpots and by the frame's.
    contact_energies : ndarray of shape (c,)
        By each contact, its dashpot in it.
    friction_energy : float
        By dry friction alone.
    energy_input : float
        Work of the forces by which the base drives the masses, by an independent integral.
    closure_error : float
        |energy put in - energy dissipated - energy stored|.
    paths : ndarray of shape (c,)
        Way of each contact while it slips.
    """

    contact_stops: list[FloatArray]
    energy: float
    contact_energies: FloatArray
    friction_energy: float
    energy_input: float
    closure_error: float
    paths: FloatArray

    @property
    def path(self) -> float:
        """Way of the first contact while it slips."""
        return float(self.paths[0])

    @property
    def stops(self) -> int:
        """Times that the first contact, slipping, came to hold."""
        return self.stops_of(0)

    def stops_of(self, contact: int) -> int:
        """Times that a contact (from 0), slipping, came to hold."""
        return int(np.count_nonzero(self.contact_stops[contact][:, 0] > self.time[0]))

    @property
    def time_stuck(self) -> float:
        """Time in which the contact does not slip, rad."""
        return float(np.sum(np.diff(self.contact_stops[0])))

    @property
    def stuck_fraction(self) -> float:
        """Share of the time in which the contact does not slip."""
        return self.time_stuck / float(self.time[-1] - self.time[0])

    def row_of(self, contact: int) -> dict[str, object]:
        """What a contact (from 0) does: what it is, energy taken, stops, share of the time without slip, way, force."""
        known, stuck = self.frame.contacts[contact], float(np.sum(np.diff(self.contact_stops[contact])))
        return {
            "mass": known.mass,
            "against": known.against,
            "law": known.law.name,
            "energy": float(self.contact_energies[contact]),
            "stops": self.stops_of(contact),
            "stuck_fraction": stuck / float(self.time[-1] - self.time[0]),
            "path": float(self.paths[contact]),
            "peak_force": float(np.abs(self.contact_forces[:, contact]).max()),
        }


def respond(
    what: Problem | Structure,
    base: BaseRecord,
    *,
    x0: ArrayLike = 0.0,
    v0: ArrayLike = 0.0,
    solver: Literal["auto", "numeric"] = "auto",
) -> Response:
    """Simulate one mass or many under a sampled motion of the base.

    Between samples the base is a polynomial and the motion, between events, that of a linear system: a closed form, and
    what interpolation makes of the samples is the only approximation (README, "How good"). With a law without exact
    phases it is integrated, piece by piece.

    Parameters
    ----------
    what : Problem or Structure
        With r = 1: time is counted in omega_n t. Its own periodic base is not used. Friction is over k times the
        record's scale Y.
    base : BaseRecord
    x0, v0 : array_like of shape (n,)
        Displacements (over Y, from where the springs are relaxed) and velocities of the masses at the first sample.
    solver : {"auto", "numeric"}
        "auto" takes exact phases where the laws have them.

    Raises
    ------
    SimulationError
        r is not 1, the record lasts too long, an acceleration is to drive against a fixed wall, friction would have to
        be negative or to outgrow the spring, events do not end, or the law is too stiff to be integrated.

    Examples
    --------
    >>> import numpy as np
    >>> tau = np.linspace(0.0, 40.0, 2001)
    >>> response = respond(Problem(1.0, beta=0.4), BaseRecord(tau, 1.0 - np.cos(0.5 * tau)))
    >>> response.stops, round(response.energy, 3)
    (6, 2.442)
    """
    return Response(**_carried(what, base, x0, v0, solver, accounted=True))


def motion_under(
    what: Problem | Structure, base: BaseRecord, *, x0: ArrayLike = 0.0, v0: ArrayLike = 0.0
) -> RecordMotion:
    """As `respond`, without energies, stops and ways: what a fit asks for, in about half the time."""
    return RecordMotion(**_carried(what, base, x0, v0, "auto", accounted=False))


def _carried(
    what: Problem | Structure, base: BaseRecord, x0: ArrayLike, v0: ArrayLike, solver: str, *, accounted: bool
) -> dict[str, Any]:
    """Return the fields of a `RecordMotion`, or of a `Response`."""
    if what.r != 1.0:
        raise SimulationError(f"simulation of a record: r; expected 1 (time is counted in omega_n t); got {what.r!r}")
    cycles = float(base.time[-1] - base.time[0]) / (2.0 * pi)
    if not cycles <= MOST_CYCLES:
        raise SimulationError(
            f"simulation of a record: it lasts {cycles:.3g} natural periods; expected at most {MOST_CYCLES:g}: are its "
            "stamps in seconds?"
        )
    frame = what if isinstance(what, Structure) else Structure.of(what)
    if base.quantity == "acceleration" and not frame.follows_base:  # it says nothing of where a wall is
        raise SimulationError(
            "simulation of a record: the base's acceleration; expected a wall that moves with the base (wall ="
            " 'base'); got a fixed one, which needs the base's displacement; do: integrate twice, with a high-pass"
        )
    from frictionlab.simulator.record import carry  # noqa: PLC0415 - loads the compiler: half a second

    shift = base.motion if frame.follows_base else np.zeros((2, len(base.time)))
    q, v = (np.broadcast_to(np.asarray(start, np.float64), frame.masses) for start in (x0, v0))
    is_exact = what.is_exact and solver == "auto"
    start = q - shift[0, 0], v - shift[1, 0]
    carried = carry.carry(what, base, *start, exact=is_exact, accounted=accounted)
    for name, moved in zip(("displacements", "velocities"), shift, strict=True):
        carried[name] += moved[:, None]
    problem = what if isinstance(what, Problem) else what.first_contact
    return {"problem": problem, "frame": frame, "base": base, "solver": "exact" if is_exact else "numeric"} | carried
