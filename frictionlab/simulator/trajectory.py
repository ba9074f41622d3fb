"""A motion as a list of phases: exact between its events, evaluated anywhere, never sampled."""

from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.errors import SimulationError
from frictionlab.simulator import engine as engines
from frictionlab.simulator.kernel.layout import DONE, PHASE, PHASES, Leg
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.timeline import PhasedMotion, Timeline, cycles_of

__all__ = ["Trajectory", "from_record", "refuse_chatter", "simulate_exactly"]

TURN = 2.0 * pi
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory(PhasedMotion):
    """A motion of one problem, phase by phase; a phase is one slide, or one stick, within one cycle of the drive.

    The phase of the drive is kept apart from the count of cycles, so that the millionth cycle is as exact as the first.

    Parameters
    ----------
    problem : Problem
        What moves.
    side : ndarray of shape (n,)
        Direction of each phase: +1, -1 (sliding), 0 (sticking).
    cycle : ndarray of shape (n,)
        Cycle in which the phase begins, counted from the start of the motion.
    tau : ndarray of shape (n,)
        Start of the phase, rad, within its cycle.
    duration : ndarray of shape (n,)
        Length of the phase, rad.
    displacement, velocity, acceleration : ndarray of shape (n,)
        State at the start of the phase, relative to the wall, over Y; derivatives with respect to tau.
    periodic : bool
        Whether the motion repeats after its last phase: then it is defined at all times.
    mirrored : bool
        Whether it repeats with its sign changed (half a period of a symmetric orbit).
    """

    problem: Problem
    side: Floats
    cycle: NDArray[np.int64]
    tau: Floats
    duration: Floats
    displacement: Floats
    velocity: Floats
    acceleration: Floats
    periodic: bool = False

    @property
    def timeline(self) -> Timeline:
        """When its phases are."""
        return Timeline(self.cycle, self.tau, self.duration, self.periodic)

    @property
    def stops(self) -> Floats:
        """Begin and end of each stop, rad, shape (m, 2); sticks that continue across a cut are one stop."""
        return self.timeline.spans(self.side == 0.0)

    @property
    def turning_points(self) -> tuple[Floats, Floats]:
        """Times (rad) at which a slide starts or ends at rest relative to the wall, and the displacement x there."""
        at_rest = (self.velocity == 0.0) & np.concatenate(([True], np.diff(self.displacement) != 0.0))
        times = self.timeline.begins[at_rest]
        return times, self.at(times)[0]

    def force(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> Floats:
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
        found: Floats = pull + 2.0 * self.problem.zeta * self.problem.r * v
        return found.reshape(shape)

    def _evaluate(self, index: NDArray[np.intp], within: Floats) -> Floats:
        """Return z, v and the contact's force but for its dashpot at times within the phases given, a row each."""
        engine = engines.choose(0.05 * len(index))
        rig, force = engines.set_up(engine, self.problem)
        gradient = self.problem.parameter("gradient")
        stiffness = np.where(self.side == 0.0, np.inf, 1.0 + self.side * self.problem.beta * gradient)
        pull = self.side * self.problem.beta * (1.0 + gradient * self.displacement)
        state = (self.displacement, self.velocity, self.acceleration)
        columns = (self.side, self.tau, self.duration, *state, stiffness, pull)
        states = engine.zeros(3 * len(index))
        phases, times = engine.flat(np.stack(columns, axis=1)[index]), engine.flat(within)
        engine.kernel.evaluate(rig, force, phases, times, states)
        return np.asarray(states, dtype=np.float64).reshape(-1, 3)


def recorded(record: Any, count: int, *, mirror: bool, directed: bool) -> Floats:
    """Return a kernel's record of phases, a row each; `mirror` appends the second, mirrored half of a period.

    `directed` phases name the direction of their slide first.
    """
    rows = np.array(record[: PHASE * count], dtype=np.float64).reshape(count, PHASE)
    if mirror:
        flip = np.array([-1.0 if directed else 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, 1.0, -1.0])
        rows = np.vstack((rows, rows * flip + np.array([0.0, pi, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])))
    return rows + 0.0


def from_record(problem: Problem, record: Any, count: int, *, periodic: bool, mirror: bool) -> Trajectory:
    """Build a trajectory from the kernel's record of phases; `mirror` appends the second, mirrored half of a period."""
    rows = recorded(record, count, mirror=mirror, directed=True)
    cycle = cycles_of(rows[:, 1], rows[:, 2])
    columns = [np.ascontiguousarray(rows[:, i]) for i in range(6)]
    for column in (*columns, cycle):
        column.setflags(write=False)
    side, tau, duration, z, v, a = columns
    return Trajectory(problem, side, cycle, tau, duration, z, v, a, periodic)


def simulate_exactly(problem: Problem, *, cycles: int, x0: float, v0: float, tau0: float, keep: int) -> Trajectory:
    """Carry the motion over cycles of the drive by exact phases; the last `keep` cycles are recorded."""
    engine = engines.choose(cycles * (2.0 + 1.0 / problem.r))
    rig, force = engines.set_up(engine, problem)
    if problem.wall == "base":
        x0, v0 = x0 - float(problem.base.at(tau0)), v0 - float(problem.base.rate_at(tau0))
    room = engines.make_room(engine, problem, 0)
    leg = Leg(tau0, TURN, float(cycles - keep), 1.0)
    z, v, code = engine.kernel.carry(rig, force, leg, x0, v0, room)
    refuse_chatter(problem, code, tau0, z, v)
    phases = 64 + int(8 * keep * (problem.base.harmonics + 1.0 / problem.r))
    while True:
        room = engines.make_room(engine, problem, phases)
        leg = Leg(tau0, TURN, float(keep), 1.0)
        end_z, end_v, code = engine.kernel.carry(rig, force, leg, z, v, room)
        refuse_chatter(problem, code, tau0, end_z, end_v)
        count = int(room.tally[PHASES])
        if count <= phases:
            break
        phases = count
    run = from_record(problem, room.phases, count, periodic=False, mirror=False)
    cycle = run.cycle + (cycles - keep)
    cycle.setflags(write=False)
    return Trajectory(problem, run.side, cycle, run.tau, run.duration, run.displacement, run.velocity, run.acceleration)


def refuse_chatter(problem: Problem, code: int, tau: float, z: float, v: float) -> None:
    """Raise the named error for an event sequence that did not end."""
    if code == DONE:
        return
    raise SimulationError(
        f"simulation: events without end: r = {problem.r!r}, beta = {problem.beta!r}, mu = {problem.mu!r}, zeta = "
        f"{problem.zeta!r}, cycle begun at tau = {tau!r}; expected at most some hundred phases per cycle and natural "
        f"period; got more, last state z = {z!r}, v = {v!r}; do: report these numbers"
    )
