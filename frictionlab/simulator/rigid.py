"""Rigid contacts by exact phases: the motion from a start, the steady state, what starts settle on, the last cycle."""

from dataclasses import dataclass, replace
from math import hypot, inf, pi
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator import engine as engines
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.last import SETTLED
from frictionlab.simulator.motion import Motion, Timeline, cycles_of
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.state import SteadyState, from_numbers

TURN = 2.0 * pi
CLOSED = {"auto": 0, "closed-form": 1, "exact": -1}


@dataclass(frozen=True)
class Trajectory(Motion):
    """A motion of one problem, phase by phase; a phase is one slide, or one stick, within one cycle of the drive.

    Parameters
    ----------
    problem : Problem
        What moves.
    phases : ndarray of shape (n, 8)
        Of each phase: direction (+1, -1 sliding, 0 sticking), start (rad, within its cycle), duration; at its start
        displacement, velocity and acceleration relative to the wall, over Y, derivatives with respect to tau; stiffness
        of the oscillator, force of the contact but for its dashpot at its start.
    timeline : Timeline
        When the phases are.
    """

    problem: Problem
    phases: FloatArray
    timeline: Timeline
    directed: ClassVar[bool] = True
    """Whether a phase names the direction of its slide first."""

    @classmethod
    def of_record(
        cls, problem: Problem, record: Any, count: int, *, periodic: bool, mirror: bool = False, first: int = 0
    ) -> Self:
        """Build a motion from a kernel's record of so many phases, the first of them in cycle `first`.

        `mirror` appends the second, mirrored half of a period.
        """
        rows = np.array(record[: layout.PHASE * count], dtype=np.float64).reshape(count, layout.PHASE)
        if mirror:
            flip = np.array([-1.0 if cls.directed else 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, 1.0, -1.0])
            rows = np.vstack((rows, rows * flip + np.array([0.0, pi, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])))
        rows, cycle = rows + 0.0, first + cycles_of(rows[:, 1], rows[:, 2])
        for column in (rows, cycle):
            column.setflags(write=False)
        return cls(problem, rows, Timeline(cycle, rows[:, 1], rows[:, 2], periodic))

    @property
    def side(self) -> FloatArray:
        """Direction of each phase: +1, -1 (sliding), 0 (sticking)."""
        return self.phases[:, 0]

    @property
    def stops(self) -> FloatArray:
        """Begin and end of each stop, rad, shape (m, 2); sticks that continue across a cut are one stop."""
        return self.timeline.spans(self.side == 0.0)

    @property
    def turning_points(self) -> tuple[FloatArray, FloatArray]:
        """Times (rad) at which a slide starts or ends at rest relative to the wall, and the displacement x there."""
        at_rest = (self.phases[:, 4] == 0.0) & np.concatenate(([True], np.diff(self.phases[:, 3]) != 0.0))
        times = self.timeline.begins[at_rest]
        return times, self.at(times)[0]

    def force(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> FloatArray:
        """Return the force of the contact on the mass, against the motion, over k Y, at any times.

        In a slide ``n = s beta (1 + q z) + 2 zeta_c r v``; in a stop what holds the mass, ``n = F - z``.

        Parameters
        ----------
        tau, cycle : array_like
            As in `at`.

        Examples
        --------
        >>> from frictionlab.simulator import Problem, steady_state
        >>> steady_state(Problem(r=0.7, beta=0.5)).orbit.force([0.0, 3.0]).tolist()
        [0.5, -0.5]
        """
        shape, _, index, within = self.timeline.place(tau, cycle)
        _, v, pull = self._evaluate(index, within).T
        found: FloatArray = pull + 2.0 * self.problem.zeta * self.problem.r * v
        return found.reshape(shape)

    def _evaluate(self, index: NDArray[np.intp], within: FloatArray) -> FloatArray:
        """Return z, v and the contact's force but for its dashpot at times within the phases given, a row each."""
        engine = engines.choose(0.05 * len(index))
        return self._evaluated(engine, *engines.set_up(engine, self.problem), index, within)

    def _evaluated(self, engine: Any, rig: Any, force: Any, index: NDArray[np.intp], within: FloatArray) -> FloatArray:
        states = engine.zeros(3 * len(index))
        engine.kernel.evaluate(rig, force, engine.flat(self.phases[index]), engine.flat(within), states)
        return np.asarray(states, dtype=np.float64).reshape(-1, 3)


def run(problem: Problem, *, cycles: int, x0: float, v0: float, tau0: float, keep: int) -> Trajectory:
    """Carry the motion over cycles of the drive by exact phases; the last `keep` cycles are recorded."""
    engine = engines.choose(cycles * (2.0 + 1.0 / problem.r))
    rig, force = engines.set_up(engine, problem)
    if problem.wall == "base":
        x0, v0 = x0 - float(problem.base.at(tau0)), v0 - float(problem.base.rate_at(tau0))

    def carried(z: float, v: float, count: int, phases: int) -> tuple[float, float, Any]:
        room, leg = engines.make_room(engine, problem, phases), layout.Leg(tau0, TURN, float(count), 1.0)
        end_z, end_v, code = engine.kernel.carry(rig, force, leg, z, v, room)
        refuse_chatter(problem, code, tau0, end_z, end_v)
        return end_z, end_v, room

    z, v, _ = carried(x0, v0, cycles - keep, 0)
    phases = 64 + int(8 * keep * (problem.base.harmonics + 1.0 / problem.r))
    _, _, room = carried(z, v, keep, phases)
    if room.tally[layout.PHASES] > phases:
        _, _, room = carried(z, v, keep, int(room.tally[layout.PHASES]))
    return Trajectory.of_record(
        problem, room.phases, int(room.tally[layout.PHASES]), periodic=False, first=cycles - keep
    )


def refuse_chatter(problem: Problem, code: int, tau: float, z: float, v: float) -> None:
    """Raise the named error for an event sequence that did not end."""
    if code == layout.DONE:
        return
    raise SimulationError(
        f"simulation: events without end: r = {problem.r!r}, beta = {problem.beta!r}, mu = {problem.mu!r}, zeta = "
        f"{problem.zeta!r}, cycle begun at tau = {tau!r}; expected at most some hundred phases per cycle and natural "
        f"period; got more, last state z = {z!r}, v = {v!r}; do: report these numbers"
    )


def steady(problem: Problem, solver: str = "auto") -> SteadyState:
    """Return the steady state: the closed form where it is valid ("auto", "closed-form"), else the orbit shot for."""
    state, _ = _solved(problem, 1.0, CLOSED[solver], None, inf)
    return state


def steady_from(problem: Problem, z: float, v: float, looks: float) -> tuple[SteadyState, float]:
    """Return what the motion from a start relative to the wall settles on, and what is left of the looks at slides."""
    return _solved(problem, 8.0, -1, (z, v), looks)


def _solved(
    problem: Problem, cycles: float, closed: int, start: tuple[float, float] | None, looks: float
) -> tuple[SteadyState, float]:
    """Return the steady state, or what a start settles on, and the looks left; with space for about so many cycles."""
    engine = engines.choose(10.0 + 4.0 / problem.r)
    phases = 64 + int(8 * cycles * (problem.base.harmonics + 1.0 / problem.r))
    while True:
        rig, force = engines.set_up(engine, problem)
        room, row = engines.make_room(engine, problem, phases), engine.zeros(layout.ROW)
        given = room.meter[0] = min(looks, engines.hand_over_after()) if engine is engines.plain() else looks
        if start is None:
            engine.kernel.steady(rig, force, closed, room, row)
        else:
            engine.kernel.steady_from(rig, force, *start, room, row)
        code = int(row[layout.OUTCOME])
        if code == layout.COSTLY and given < looks:
            engine = engines.compiled()
        elif code == layout.OVERFULL:
            phases = int(room.tally[layout.PHASES])
        else:
            break
    if code == layout.CHATTERED and start is None:
        refuse_chatter(problem, layout.CHATTER, float(row[layout.START]), row[layout.START_Z], row[layout.START_V])
    if closed == 1 and code == layout.NOT_FOUND:
        raise SimulationError(
            f"steady state: closed form at r = {problem.r!r}, beta = {problem.beta!r}; expected continuous motion of "
            "an undamped mass under a pure cosine (2.10); got stops, damping or harmonics; do: use solver 'exact'"
        )
    moved, mirror = code in (layout.PERIODIC, layout.STUCK), bool(row[layout.SIGN] < 0.0)
    count = int(room.tally[layout.PHASES])
    orbit = Trajectory.of_record(problem, room.phases, count, periodic=True, mirror=mirror) if moved else None
    return from_numbers(problem, row, orbit), float(room.meter[0])


def last(problem: Problem, cycles: int) -> SteadyState:
    """Return the last of a number of cycles from rest as if it were steady."""
    motion = run(problem, cycles=cycles, x0=0.0, v0=0.0, tau0=0.0, keep=1)
    engine = engines.choose(0.0)
    rig, force = engines.set_up(engine, problem)
    room, row = engines.make_room(engine, problem, len(motion.phases)), engine.zeros(layout.ROW)
    tau, start = float(motion.phases[0, 1]), (float(motion.phases[0, 3]), float(motion.phases[0, 4]))
    leg = layout.Leg(tau, TURN, 1.0, 1.0)
    end_z, end_v, _ = engine.kernel.carry(rig, force, leg, *start, room)
    engine.kernel.account(rig, force, room)
    engine.kernel.fill_row(rig, force, leg, room, engine.kernel.spectral_radius(room.jacobian), row)
    put_in = room.tally[layout.WORK] - room.tally[layout.CONTACT] - room.tally[layout.VISCOUS]
    path, miss = float(room.tally[layout.PATH]), hypot(end_z - start[0], problem.r * (end_v - start[1]))
    row[layout.OUTCOME] = layout.PERIODIC if path > 0.0 else layout.STUCK
    row[layout.MISS], row[layout.CLOSED_FORM] = miss, 0.0
    row[layout.ENERGY] += put_in  # the energy put in: the area of the loop (2.18), which measurement and thesis report
    row[layout.SYMMETRIC] = engine.kernel.mirrored(rig, force, room)
    state = from_numbers(problem, row, motion)
    if miss <= SETTLED * (hypot(*start) + path):
        return state
    unknown: dict[str, Any] = {"symmetric": None, "period_cycles": None, "floquet_multiplier": None, "notes": 0}
    return replace(state, outcome="not settled", **unknown)
