"""A sampled base motion in, the motion of the mass out: exact between samples, event by event, where the law allows."""

from dataclasses import dataclass
from math import pi
from typing import Literal, NamedTuple

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record.base import BaseRecord

MOST_CYCLES = 1e7  # natural periods: half a minute of compiled work that nothing interrupts


@dataclass(frozen=True)
class Response:
    """The motion of the mass under a sampled motion of the base, from its first sample to its last.

    Lengths are over Y = `base.scale`, times are tau = omega_n t in rad, forces over k Y, energies over k Y^2.

    Parameters
    ----------
    problem : Problem
    base : BaseRecord
    displacement, velocity : ndarray of shape (n,)
        Absolute displacement x of the mass from where the spring is relaxed, and dx/dtau, at the samples; relative to
        the base where that is given by its acceleration: how far it went is not known.
    contact_force : ndarray of shape (n,)
        Force of the contact on the mass, n, at the samples.
    events : ndarray of shape (m, 3)
        What begins, when, where: tau; 1 (slip up), -1 (slip down) or 0 (a stop); displacement relative to the wall.
    energy : float
        All that is dissipated: by friction, by the contact's dashpot and by the frame's.
    friction_energy : float
        By dry friction alone.
    energy_input : float
        Work of the force that drives the motion relative to the wall, by an independent integral.
    closure_error : float
        |energy put in - energy dissipated - energy stored|.
    path : float
        Way of the mass along the wall while the contact slips.
    solver : {"exact", "numeric"}
        Closed forms, or numerical integration for the laws that have none. A contact with an inner state always creeps:
        a stop is then slow slip (`frictionlab.simulator.numeric.flow.stop_limits`), and `path` is the way slipped.
    """

    problem: Problem
    base: BaseRecord
    displacement: FloatArray
    velocity: FloatArray
    contact_force: FloatArray
    events: FloatArray
    energy: float
    friction_energy: float
    energy_input: float
    closure_error: float
    path: float
    solver: Literal["exact", "numeric"]

    @property
    def time(self) -> FloatArray:
        """Times of the samples, tau in rad."""
        return self.base.time

    @property
    def intervals_stuck(self) -> FloatArray:
        """Begin and end of each time in which the contact does not slip, rad, shape (k, 2)."""
        ends = np.append(self.events[1:, 0], self.time[-1])
        return np.asarray(np.column_stack((self.events[:, 0], ends))[self.events[:, 1] == 0.0])

    @property
    def stops(self) -> int:
        """Times that the slipping contact came to hold."""
        return int(np.count_nonzero((self.events[1:, 1] == 0.0) & (self.events[:-1, 1] != 0.0)))

    @property
    def time_stuck(self) -> float:
        """Time in which the contact does not slip, rad."""
        return float(np.sum(np.diff(self.intervals_stuck)))

    @property
    def stuck_fraction(self) -> float:
        """Share of the time in which the contact does not slip."""
        return self.time_stuck / float(self.time[-1] - self.time[0])

    @property
    def relative_displacement(self) -> FloatArray:
        """Displacement of the mass from the base (n,)."""
        if self.base.quantity == "acceleration":
            return self.displacement
        return np.asarray(self.displacement - self.base.values)

    @property
    def peaks(self) -> dict[str, float]:
        """Largest sizes at the samples: displacement, velocity, displacement from the base, contact force."""
        names = ("displacement", "velocity", "relative_displacement", "contact_force")
        return {name: float(np.abs(getattr(self, name)).max()) for name in names}


class Carried(NamedTuple):
    """A motion along a record, as a flow leaves it. Integrals are over the motion relative to the wall."""

    samples: FloatArray  # (3, n): absolute displacement, velocity, force of the contact
    events: FloatArray  # as `Response` has them
    work: float  # of n v, the contact's dashpot apart
    squared: float  # of v^2
    dragged: float  # of the square of the frame's dashpot's speed
    put_in: float  # of F v
    path: float
    stored: float  # energy in the contact's springs at the end
    gained: float  # by mass and spring

    def response(self, problem: Problem, base: BaseRecord, solver: Literal["exact", "numeric"]) -> Response:
        """Return the response: what goes in is either dissipated or stored."""
        dashpot, frame = 2.0 * problem.zeta * self.squared, 2.0 * problem.frame_damping_ratio
        friction = self.work - self.stored
        closure_error = abs(self.put_in - self.work - dashpot - frame * self.squared - self.gained)
        energies = (friction + dashpot + frame * self.dragged, friction, self.put_in, closure_error)
        x, v, n = self.samples
        return Response(problem, base, x, v, n, self.events, *energies, self.path, solver)


def respond(problem: Problem, base: BaseRecord, *, x0: float = 0.0, v0: float = 0.0) -> Response:
    """Simulate the mass under a sampled motion of the base.

    Between samples the base is a polynomial and the mass, between events, a linear oscillator: its motion is a closed
    form, and what interpolation makes of the samples is the only approximation (README, "How good"). Laws without exact
    phases are integrated by the numeric engine, piece by piece.

    Parameters
    ----------
    problem : Problem
        With r = 1: time is counted in omega_n t. Its own periodic base is not used. `beta` is over k times the
        record's scale Y.
    base : BaseRecord
    x0, v0 : float
        Displacement (over Y, from where the spring is relaxed) and velocity dx/dtau of the mass at the first sample.

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
    if problem.r != 1.0:
        raise SimulationError(
            f"simulation of a record: r; expected 1 (time is counted in omega_n t); got {problem.r!r}"
        )
    cycles = float(base.time[-1] - base.time[0]) / (2.0 * pi)
    if not cycles <= MOST_CYCLES:
        raise SimulationError(
            f"simulation of a record: it lasts {cycles:.3g} natural periods; expected at most {MOST_CYCLES:g}: are its "
            "stamps in seconds?"
        )
    if not problem.law.is_exact:
        from frictionlab.simulator.record.integrate import integrate  # noqa: PLC0415 - for such laws alone

        return integrate(problem, base, x0, v0).response(problem, base, "numeric")
    from frictionlab.simulator.record.phases import carried  # noqa: PLC0415 - loads the compiler: half a second

    change = problem.beta * abs(problem.parameter("gradient"))
    if change >= 1.0:
        raise SimulationError(
            f"simulation of a record: beta * |gradient|; expected less than 1; got {change:g}: friction changes along "
            "the path faster than the spring's force, and the mass would run away"
        )
    return carried(problem, base, x0, v0).response(problem, base, "exact")
