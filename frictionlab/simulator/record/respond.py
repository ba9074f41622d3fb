"""A sampled base motion in, the motion of the mass out: exact between samples, event by event, where the law allows."""

from dataclasses import dataclass
from math import ceil, inf, pi, sqrt
from typing import Any, Literal, NamedTuple

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record.base import BaseRecord, derivatives_of, force_of

FINE = 16.0  # parts per unit of the fastest phase's time
TOUCH = 1e-13  # rad: a shorter stick is no stop
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
        a stop is then slow slip (`frictionlab.simulator.numeric.motion.stop_limits`), and `path` is the way slipped.
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
    change = problem.beta * abs(problem.parameter("gradient"))
    if change >= 1.0:
        raise SimulationError(
            f"simulation of a record: beta * |gradient|; expected less than 1; got {change:g}: friction changes along "
            "the path faster than the spring's force, and the mass would run away"
        )
    return _carried(problem, base, x0, v0).response(problem, base, "exact")


def _carried(problem: Problem, base: BaseRecord, x0: float, v0: float) -> Carried:
    """Let the exact flow carry the mass through the record."""
    from frictionlab.simulator.compiled import record_of  # noqa: PLC0415 - loads the compiler: half a second
    from frictionlab.simulator.exact.flow import RUNNER  # noqa: PLC0415 - as above
    from frictionlab.simulator.exact.motion import WORK  # noqa: PLC0415 - as above
    from frictionlab.simulator.exact.orbit import Carrier  # noqa: PLC0415 - as above
    from frictionlab.simulator.exact.solve import system_of_one  # noqa: PLC0415 - as above
    from frictionlab.simulator.exact.travel import travel  # noqa: PLC0415 - as above

    systems, works = system_of_one(problem), record_of(WORK)
    system, work = systems[0], works[0]
    stiffness = 1.0 + problem.beta * abs(problem.parameter("gradient")) + float(np.sum(system["spring"]))
    fastest = max(sqrt(stiffness), 2.0 * (problem.frame_damping_ratio + problem.zeta))
    parts = max(1, ceil(FINE * float(np.diff(base.time).max()) * fastest))  # integrals are exact to rounding then
    time, cubics = base.pieces(parts)
    force, samples = force_of(problem, base, cubics), np.zeros((len(time), 3))
    system["harmonics"] = 0
    if base.quantity == "acceleration":  # it drives the motion relative to the base, which is all that is known
        system["push"][0], system["follow"][0] = (-1.0, 0.0), 0.0
    work["left"], work["q"][0], work["v"][0] = inf, x0, v0
    work["anchor"][:] = x0 - float(system["follow"][0] * base.values[0])
    start, count = works.copy(), 256 + len(time) + len(time) // 8
    while True:
        pieces = np.empty((count, 7))
        reached = travel(Carrier(RUNNER, systems, works, pieces), time, cubics, samples)
        if reached >= 0:
            raise _stranded(problem, float(time[reached]), float(work["q"][0] - system["follow"][0] * work["f"][0]))
        if work["count"] <= count:
            break
        count, works[:] = int(work["count"]), start
    held = _slider_forces(problem, system, work, float(samples[-1, 0] - system["follow"][0] * base.values[-1]))
    stored = float(np.sum(0.5 * held**2 / system["spring"][: len(held)]))
    rows, moves = pieces[: int(work["count"])], float(system["follow"][0])
    return _accounted(problem, rows, (time, cubics, force), samples, moves)._replace(
        samples=samples[::parts].T.copy(), stored=stored
    )


def _stranded(problem: Problem, tau: float, z: float) -> SimulationError:
    """Why the motion came no further."""
    load = 1.0 + problem.parameter("gradient") * z
    what = "events without end; expected some per sample; do: report these numbers"
    if load <= 0.0:
        what = f"1 + gradient z; expected never below 0; got {load:.3g}; do: give a smaller gradient"
    return SimulationError(
        f"simulation of a record: {what} (tau = {tau!r}, z = {z:.6g}, law {problem.law.name}, parameters "
        f"{problem.parameters})"
    )


def _slider_forces(problem: Problem, system: Any, work: Any, z: float) -> FloatArray:
    """Forces of the elastic sliders at a displacement relative to the wall, over k Y."""
    count = int(system["sliders"])
    held = system["spring"][:count] * (z - work["anchor"][:count])
    limit = system["strength"][:count] * (1.0 + problem.parameter("gradient") * z)
    return np.asarray(np.where(work["slips"][:count] != 0, float(work["side"][0]) * limit, held))


def _accounted(
    problem: Problem,
    rows: FloatArray,
    drive: tuple[FloatArray, FloatArray, FloatArray],
    samples: FloatArray,
    moves: float,
) -> Carried:
    """Energies and events of pieces (m, 7) as `exact.solve.Pieces` has them, by what is at their ends (2, m).

    Writes the contact's force at the first sample. `drive`: times, base and force; `moves`: 1 where the wall follows.
    """
    time, cubics, force = drive
    begins, length, kappa, offset, side = rows[:, 0], rows[:, 1], rows[:, 4], rows[:, 5], rows[:, 6]
    here = np.clip(np.searchsorted(time, begins + 0.5 * length, side="right") - 1, 0, len(time) - 2)
    t = np.vstack((begins, begins + length)) - time[here]
    f, pull = derivatives_of(cubics[here], t), derivatives_of(force[here], t)
    z = np.vstack((rows[:, 2], np.append(rows[1:, 2], samples[-1, 0]))) - moves * f[0]
    v = np.vstack((rows[:, 3], np.append(rows[1:, 3], samples[-1, 1]))) - moves * f[1]
    held, thick = np.isinf(kappa), 2.0 * (problem.frame_damping_ratio + problem.zeta)
    way, kappa = np.where(held, 0.0, z[1] - z[0]), np.where(held, 0.0, kappa)
    a = pull[0] - thick * v - (1.0 + kappa) * z - offset
    speed = np.where(held, 0.0, (v, a, pull[1] - thick * a - (1.0 + kappa) * v))
    slip = speed - f[1:] if problem.wall == "fixed" else speed
    first = pull[0, 0, 0] - z[0, 0] if held[0] else kappa[0] * z[0, 0] + offset[0]
    samples[0, 2] = first + 2.0 * problem.zeta * speed[0, 0, 0]
    energy = 0.5 * (z**2 + speed[0] ** 2)
    return Carried(
        samples=samples,
        events=_events(begins, length, side, z[0]),
        work=float(np.sum(way * (0.5 * kappa * (z[0] + z[1]) + offset))),
        squared=_integral(length, speed, speed),
        dragged=_integral(length, slip, slip),
        put_in=_integral(length, pull, speed),
        path=float(np.sum(np.abs(way[side != 0.0]))),
        stored=0.0,
        gained=float(energy[1, -1] - energy[0, 0]),
    )


def _integral(length: FloatArray, one: FloatArray, other: FloatArray) -> float:
    """Integral of a product, from values and two derivatives (3, 2, m) of both at the ends of pieces (m,), in all.

    Hermite's rule ``h/2 (y0 + y1) + h^2/10 (y0' - y1') + h^3/120 (y0'' + y1'')``: exact up to degree 5.
    """
    value, slope = one[0] * other[0], one[1] * other[0] + one[0] * other[1]
    bend = one[2] * other[0] + 2.0 * one[1] * other[1] + one[0] * other[2]
    rule = 0.5 * value.sum(axis=0) + length * (0.1 * (slope[0] - slope[1]) + length / 120.0 * bend.sum(axis=0))
    return float(np.sum(length * rule))


def _events(begins: FloatArray, length: FloatArray, side: FloatArray, z: FloatArray) -> FloatArray:
    """What begins, when and where (m, 3): slips, and stops that are more than touches."""
    fresh = np.flatnonzero(np.concatenate(([True], side[1:] != side[:-1])))
    lasts = np.add.reduceat(length, fresh)
    kept = fresh[(side[fresh] != 0.0) | (lasts > TOUCH)]
    kept = kept[np.concatenate(([True], side[kept][1:] != side[kept][:-1]))]
    return np.column_stack((begins[kept], side[kept], z[kept]))
