"""Any motion of the base: a sampled record in, the motion of the masses out.

    BaseRecord --respond(problem, record)--> Response

Exact between samples, event by event, where the law allows.
"""

from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.motion import Motion
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.solve import flow_of
from frictionlab.simulator.structure import Structure, frame_of

Quantity = Literal["displacement", "acceleration"]

MOST_CYCLES = 1e7  # natural periods: half a minute of compiled work that nothing interrupts


@dataclass(frozen=True)
class BaseRecord:
    """A motion of the base, sampled; between its samples a cubic spline (not-a-knot).

    Parameters
    ----------
    time : array_like of shape (n,)
        tau = omega_n t, rad, strictly increasing; steps need not be equal.
    displacement : array_like of shape (n,)
        Displacement of the base in any one unit. With smooth motions the spline errs with the fourth power of the
        sampling interval.
    rest : float, optional
        Displacement at which the spring of a mass at x = 0 is relaxed; left out, that of the first sample.
    scale : float, optional
        The displacement Y that everything is measured in; left out, the largest distance from `rest`.
    quantity : {"displacement", "acceleration"}
        What the samples are. An acceleration is d2y/dtau2, in a unit of length: it drives a wall that moves with the
        base as it is, without any integration; its `rest` is 0, and Y its largest size.

    Raises
    ------
    SimulationError
        Fewer than two samples, lengths that differ, values that are not finite, times that do not increase, or a base
        that never moves.

    Examples
    --------
    >>> base = BaseRecord([0.0, 1.0, 2.0, 3.0], [5.0, 6.0, 4.0, 5.0])
    >>> base.scale, base.values.tolist()
    (1.0, [0.0, 1.0, -1.0, 0.0])
    """

    time: FloatArray
    displacement: FloatArray
    rest: float = float("nan")
    scale: float = float("nan")
    quantity: Quantity = "displacement"

    def __init__(
        self,
        time: ArrayLike,
        displacement: ArrayLike,
        *,
        rest: float | None = None,
        scale: float | None = None,
        quantity: Quantity = "displacement",
    ) -> None:
        times, values = (np.ascontiguousarray(column, np.float64).view() for column in (time, displacement))
        times.setflags(write=False)
        values.setflags(write=False)
        _check(times, values)
        if rest is None:
            rest = 0.0 if quantity == "acceleration" else float(values[0])
        zero = float(rest)
        size = float(max(values.max() - zero, zero - values.min())) if scale is None else float(scale)
        if not (size > 0.0 and np.isfinite(size) and np.isfinite(zero)):
            raise SimulationError(
                f"base motion: its size; expected a finite number > 0; got {size!r} about {zero!r}: a base at rest "
                "drives nothing"
            )
        vars(self).update(time=times, displacement=values, rest=zero, scale=size, quantity=quantity)

    @cached_property
    def values(self) -> FloatArray:
        """Displacement from `rest` over `scale`, shape (n,)."""
        values = (self.displacement - self.rest) / self.scale
        values.setflags(write=False)
        return values

    @cached_property
    def motion(self) -> FloatArray:
        """Displacement and its rate at the samples (2, n); none where the acceleration alone is known."""
        known = self.quantity == "displacement"
        return np.asarray((self.values, self._spline(self.time, 1)) if known else np.zeros((2, len(self.time))))

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline  # noqa: PLC0415 - 0.2 s that other work need not wait for

        return CubicSpline(self.time, self.values)

    def cubics(self, *, acceleration: bool = False) -> FloatArray:
        """Return the cubics (n - 1, 4) of what drives, each from a sample on; of its `acceleration` if asked."""
        cubics: FloatArray = self._spline.c[::-1].T.copy()
        if acceleration and self.quantity == "displacement":
            cubics = np.column_stack((2.0 * cubics[:, 2], 6.0 * cubics[:, 3], np.zeros((len(cubics), 2))))
        return cubics


def _check(times: FloatArray, values: FloatArray) -> None:
    if times.ndim != 1 or times.shape != values.shape or len(times) < 2:
        raise SimulationError(
            f"base motion: expected times and displacements of one length, at least 2; got shapes {times.shape} and "
            f"{values.shape}"
        )
    for name, column in (("time", times), ("displacement", values)):
        if not np.isfinite(column.sum()):
            wrong = int(np.argmax(~np.isfinite(column)))
            raise SimulationError(
                f"base motion: {name}; expected finite numbers; got {column[wrong]} at sample {wrong}"
            )
    steps = np.diff(times)
    if not steps.min() > 0.0:
        wrong = int(np.argmax(~(steps > 0.0)))
        raise SimulationError(
            f"base motion: time; expected to increase; got {float(times[wrong])!r} then "
            f"{float(times[wrong + 1])!r} at sample {wrong + 1}"
        )


@dataclass(frozen=True)
class Response:
    """The motion of the masses under a sampled motion of the base, from its first sample to its last.

    Lengths are over Y = `base.scale`, times are tau = omega_n t in rad, forces over k Y, energies over k Y^2; of
    several masses omega_n and k are the first storey's. Energies, ways and stops are summed when one is asked for: that
    takes about as long as the motion.

    A contact with an inner state always creeps: a stop is then slow slip (`Integrated.stop_limits`), and its path is
    the way slipped.

    Parameters
    ----------
    frame : Structure
        What moves, as masses and contacts.
    base : BaseRecord
    motion : Motion
        Its phases, or steps.
    displacements, velocities : ndarray of shape (k, n)
        Absolute displacements of the masses from where the springs are relaxed, and their rates by tau, at the samples;
        relative to the base where that is given by its acceleration: how far it went is not known.
    contact_forces : ndarray of shape (k, c)
        Forces of the contacts on the masses, at the samples.
    stored : ndarray of shape (c,)
        Energy in the contacts' springs at the end.
    kept : float
        Energy of motion and in the frame's springs at the end less that at the begin.
    """

    frame: Structure
    base: BaseRecord
    motion: Motion
    displacements: FloatArray
    velocities: FloatArray
    contact_forces: FloatArray
    stored: FloatArray
    kept: float

    @property
    def problem(self) -> Problem:
        """What moves; of several masses, as the first contact has it."""
        return self.motion.problem

    @property
    def solver(self) -> str:
        """What carried it: "exact" are closed forms, "numeric" is integration, for the laws that have none."""
        return self.motion.solver

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

    @cached_property
    def contact_stops(self) -> list[FloatArray]:
        """Of each contact begin and end (m, 2) of each time in which it does not slip, rad."""
        return [self.motion.stops_of(contact) for contact in range(len(self.frame.contacts))]

    @property
    def contact_energies(self) -> FloatArray:
        """What each contact has dissipated (c,), its dashpot in it."""
        return np.asarray(self.motion.sums["contact"][: len(self.stored)] - self.stored)

    @property
    def friction_energy(self) -> float:
        """What dry friction alone has dissipated."""
        return float((self.contact_energies - self.motion.sums["dashpot"][: len(self.stored)]).sum())

    @property
    def energy(self) -> float:
        """All that is dissipated: by friction, by the contacts' dashpots and by the frame's."""
        return float(self.contact_energies.sum() + self.motion.sums["frame"])

    @property
    def closure_error(self) -> float:
        """|energy put in by the base, by an independent integral - energy dissipated - energy stored|."""
        return abs(float(self.motion.sums["gap"]) - self.kept)

    @property
    def paths(self) -> FloatArray:
        """Way of each contact (c,) while it slips."""
        return np.asarray(self.motion.sums["path"][: len(self.stored)])

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

    def stuck_of(self, contact: int) -> float:
        """Time in which a contact (from 0) does not slip, rad."""
        return float(np.sum(np.diff(self.contact_stops[contact])))

    @property
    def stuck_fraction(self) -> float:
        """Share of the time in which the first contact does not slip."""
        return self.stuck_of(0) / float(self.time[-1] - self.time[0])

    def row_of(self, contact: int) -> dict[str, object]:
        """What a contact (from 0) does: what it is, energy taken, stops, share of the time without slip, way, force."""
        known = self.frame.contacts[contact]
        return {
            "mass": known.mass,
            "against": known.against,
            "law": known.law.name,
            "energy": float(self.contact_energies[contact]),
            "stops": self.stops_of(contact),
            "stuck_fraction": self.stuck_of(contact) / float(self.time[-1] - self.time[0]),
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
    if what.r != 1.0:
        raise SimulationError(f"simulation of a record: r; expected 1 (time is counted in omega_n t); got {what.r!r}")
    cycles = float(base.time[-1] - base.time[0]) / (2.0 * pi)
    if not cycles <= MOST_CYCLES:
        raise SimulationError(
            f"simulation of a record: it lasts {cycles:.3g} natural periods; expected at most {MOST_CYCLES:g}: are its "
            "stamps in seconds?"
        )
    frame = frame_of(what)
    if base.quantity == "acceleration" and not frame.follows_base:  # it says nothing of where a wall is
        raise SimulationError(
            "simulation of a record: the base's acceleration; expected a wall that moves with the base (wall ="
            " 'base'); got a fixed one, which needs the base's displacement; do: integrate twice, with a high-pass"
        )
    shift = base.motion if frame.follows_base else np.zeros((2, len(base.time)))  # then the flow's motion is relative
    q, v = (np.broadcast_to(np.asarray(start, np.float64), frame.masses) for start in (x0, v0))
    cubics = base.cubics(acceleration=frame.follows_base)
    motion, found = flow_of(what, solver).along(base.time, cubics, q - shift[0, 0], v - shift[1, 0])
    q, v, forces = np.split(found, (frame.masses, 2 * frame.masses), axis=1)
    inertia, stiffness = (motion.flow.systems[0][name][: q.shape[1], : q.shape[1]] for name in ("inertia", "stiffness"))
    kept = [0.5 * float(q[at] @ stiffness @ q[at] + v[at] @ inertia @ v[at]) for at in (0, -1)]
    moved = q + shift[0][:, None], v + shift[1][:, None]
    stored = motion.flow.stored(found[-1], base.values[-1])
    return Response(frame, base, motion, *moved, forces, stored, kept[1] - kept[0])
