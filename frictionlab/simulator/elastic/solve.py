"""The steady state of an elastic contact, solved for; and its motion from initial conditions."""

from dataclasses import replace
from math import pi
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError
from frictionlab.simulator.elastic import engine as engines
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.kernel.layout import CONTACT, DERIVED, PLAIN, PULLED
from frictionlab.simulator.meter import LOOKS, STATE, Meter
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.rigid import Trajectory
from frictionlab.simulator.state import SteadyState, from_numbers

ROOM = 1e5  # phases for which there is room at first; a motion that has more is begun again
UNMETERED = 1e15  # looks at a phase: more than any search takes, and each still counts
SETTLED = 1e-6  # a cycle repeats if its end misses its start by less than this share of its size


class ElasticMotion(Trajectory):
    """A motion of one problem, phase by phase: in each the same sliders slip; the mass moves one way, or none slips.

    The first number of a phase is how many sliders slip, and a stop a time in which none does: the mass may move in it.
    """

    directed: ClassVar[bool] = False

    @property
    def slipping(self) -> FloatArray:
        """How many sliders slip in each phase."""
        return self.phases[:, 0]

    @property
    def turning_points(self) -> tuple[FloatArray, FloatArray]:
        """Times (rad) at which the mass is at rest relative to the wall, and the displacement x there."""
        times = self.timeline.begins[self.phases[:, 4] == 0.0]
        return times, self.at(times)[0]

    def _evaluate(self, index: NDArray[np.intp], within: FloatArray) -> FloatArray:
        """Return z, v and the sliders' force at times within the phases of an index, a row each."""
        engine = engines.choose(0.05 * len(index))
        rig, _, force = engines.set_up(engine, self.problem)
        return self._evaluated(engine, rig, force, index, within)


def steady(problem: Problem, *, meter: Meter | None = None) -> SteadyState:
    """Return the steady state of a problem whose contact is elastic: ``compliance`` or ``iwan``.

    The periodic orbit is solved for by shooting in mass and sliders with exact phases, half a period where the drive's
    symmetry allows.

    Parameters
    ----------
    problem : Problem
        What moves.
    meter : Meter, optional
        What a search of many steady states may still spend: this one's looks at its phases are taken from it.

    Returns
    -------
    SteadyState
        Its stops are the times in which no slider slips; "stuck": none ever slips.

    Raises
    ------
    SimulationError
        If events do not end, or the law has no elastic contact.

    Examples
    --------
    >>> law = {"law": "coulomb+compliance", "parameters": {"stiffness_ratio": 50.0}}
    >>> state = steady(Problem(r=0.5, beta=0.4, **law))
    >>> f"{state.energy_per_cycle:.10f}", state.stops_per_cycle
    ('2.1039181422', 2.0)
    """
    return _solved(problem, 8.0, None, meter)


def steady_from(problem: Problem, x0: float, v0: float) -> SteadyState:
    """Return what the motion from a displacement over Y and its rate, at tau = 0 and the contact relaxed, settles on.

    Raises
    ------
    SimulationError
        If events do not end.
    """
    if problem.wall == "base":
        x0, v0 = x0 - float(problem.base.at(0.0)), v0 - float(problem.base.rate_at(0.0))
    return _solved(problem, 100.0, (x0, v0))


def _solved(
    problem: Problem, cycles: float, start: tuple[float, float] | None, meter: Meter | None = None
) -> SteadyState:
    """Return the steady state, or what a start relative to the wall settles on; about so many cycles of work."""
    engine = engines.choose(cycles * engines.phases_per_cycle(problem))
    rig, sliders, force = engines.set_up(engine, problem)
    row = engine.zeros(layout.ROW)
    phases = 64 + int(min(engines.phases_per_cycle(problem), ROOM))
    while True:
        room = engines.make_elastic_room(engine, problem, phases)
        if engine is engines.plain():
            room.meter[0] = engines.hand_over_after()
        given = room.meter[0] = min(room.meter[0], UNMETERED)
        if start is None:
            engine.kernel.steady_elastic(rig, sliders, force, room, row)
        else:
            engine.kernel.start_at_rest(sliders, room)
            room.start[0], room.start[1] = start
            engine.kernel.steady_elastic_from(rig, sliders, force, room, row)
        if row[layout.OUTCOME] == layout.COSTLY and engine is engines.plain():
            engine = engines.compiled()
            rig, sliders, force = engines.set_up(engine, problem)
            row = engine.zeros(layout.ROW)
            continue
        count = int(room.tally[layout.PHASES])
        if row[layout.OUTCOME] != layout.OVERFULL:
            break
        phases = count
    if meter is not None:
        meter.take(STATE + (given - room.meter[0]) / LOOKS)
    code = int(row[layout.OUTCOME])
    if code == layout.CHATTERED:
        raise _endless(problem, float(row[layout.START]), float(row[layout.START_Z]), float(row[layout.START_V]))
    moved, mirror = code in (layout.PERIODIC, layout.STUCK), bool(row[layout.SIGN] < 0.0)
    orbit = ElasticMotion.of_record(problem, room.phases, count, periodic=True, mirror=mirror) if moved else None
    return from_numbers(problem, row, orbit)


def run(
    problem: Problem, *, cycles: int, x0: float = 0.0, v0: float = 0.0, tau0: float = 0.0, keep: int | None = None
) -> ElasticMotion:
    """Return the motion from initial conditions over a number of cycles; the contact is relaxed at the start.

    Parameters are those of `frictionlab.simulator.simulate`.

    Raises
    ------
    SimulationError
        If events do not end, or the gradient is so steep that the mass runs away or friction becomes a pull.

    Examples
    --------
    >>> law = {"law": "coulomb+compliance", "parameters": {"stiffness_ratio": 50.0}}
    >>> run(Problem(r=0.5, beta=0.4, **law), cycles=3).stops.shape
    (7, 2)
    """
    keep = cycles if keep is None else keep
    engine = engines.choose(cycles * engines.phases_per_cycle(problem))
    rig, sliders, force = engines.set_up(engine, problem)
    if abs(problem.beta * problem.parameter("gradient")) >= 1.0:
        raise _steep(problem)
    if problem.wall == "base":
        x0, v0 = x0 - float(problem.base.at(tau0)), v0 - float(problem.base.rate_at(tau0))
    room = engines.make_elastic_room(engine, problem, 0)
    engine.kernel.start_at_rest(sliders, room)
    room.start[0], room.start[1] = x0, v0
    if cycles > keep:
        _carry(engine, problem, (rig, sliders, force), room, tau0, cycles - keep)
        room.start[:] = room.image[:]
    begun = list(room.start)
    phases = 64 + int(min(2 * keep * engines.phases_per_cycle(problem), 10 * ROOM))
    while True:
        room = engines.make_elastic_room(engine, problem, phases)
        room.start[:] = engine.buffer(tuple(begun))
        _carry(engine, problem, (rig, sliders, force), room, tau0, keep)
        count = int(room.tally[layout.PHASES])
        if count <= phases:
            return ElasticMotion.of_record(problem, room.phases, count, periodic=False, first=cycles - keep)
        phases = count


def last(problem: Problem, cycles: int) -> SteadyState:
    """Return the last of a number of cycles from rest as if it were steady, and say if it is not: "not settled".

    Its energy is the one put in: the area of the loop (2.18), which measurement and thesis report.

    Raises
    ------
    SimulationError
        As `run`.

    Examples
    --------
    >>> law = {"law": "coulomb+compliance", "parameters": {"stiffness_ratio": 50.0}}
    >>> last(Problem(r=0.95, beta=0.1, **law), cycles=100).outcome
    'not settled'
    """
    motion = run(problem, cycles=cycles, keep=1)
    engine = engines.choose(cycles * engines.phases_per_cycle(problem))
    rig, sliders, force = engines.set_up(engine, problem)
    leg = layout.Leg(0.0, 2.0 * pi, 1.0, 1.0)
    room = engines.make_elastic_room(engine, problem, len(motion.phases))
    engine.kernel.start_at_rest(sliders, room)
    _set_at_rest(problem, room, 0.0)
    engine.kernel.follow(rig, sliders, force, leg, cycles - 1.0, room)
    engine.kernel.carry_elastic(rig, sliders, force, leg, room, DERIVED)
    row = engine.zeros(layout.ROW)
    engine.kernel.report(rig, sliders, force, leg, room, row)
    row[layout.ENERGY] += room.tally[layout.WORK] - room.tally[CONTACT] - room.tally[layout.VISCOUS]
    slips = bool((motion.slipping > 0.0).any())
    row[layout.OUTCOME] = layout.PERIODIC if slips else layout.STUCK
    row[layout.MISS] = float(engine.kernel.distance(rig, sliders, room))
    state = from_numbers(problem, row, motion)
    if row[layout.MISS] <= SETTLED * engine.kernel.span_of(rig, room):
        return state
    unknown: dict[str, Any] = {"symmetric": None, "period_cycles": None, "floquet_multiplier": None, "notes": 0}
    return replace(state, outcome="not settled", **unknown)


def _set_at_rest(problem: Problem, room: Any, tau: float) -> None:
    """Put the mass at rest at x = 0, as seen from the wall."""
    if problem.wall == "base":
        room.start[0], room.start[1] = -float(problem.base.at(tau)), -float(problem.base.rate_at(tau))


def _carry(engine: Any, problem: Problem, parts: tuple[Any, ...], room: Any, tau0: float, cycles: int) -> None:
    """Carry the room's start over cycles; raise the named error where that fails."""
    code = engine.kernel.carry_elastic(*parts, layout.Leg(tau0, 2.0 * pi, float(cycles), 1.0), room, PLAIN)
    if code == PULLED:
        raise _steep(problem)
    if code != layout.DONE:
        raise _endless(problem, tau0, float(room.image[0]), float(room.image[1]))


def _steep(problem: Problem) -> SimulationError:
    return SimulationError(
        f"simulation: gradient; expected so small that beta |gradient| < 1 and 1 + gradient z > 0 on the whole motion; "
        f"got {problem.parameter('gradient')!r} with beta = {problem.beta!r}; do: take a smaller gradient"
    )


def _endless(problem: Problem, tau: float, z: float, v: float) -> SimulationError:
    return SimulationError(
        f"simulation: events without end: r = {problem.r!r}, law {problem.law.name}, {problem.parameters}, cycle begun "
        f"at tau = {tau!r}; expected at most some hundred phases per cycle and natural period of the held contact; got "
        f"more, last state z = {z!r}, v = {v!r}; do: report these numbers"
    )
