"""A sampled base motion under a law without exact phases: the numeric engine, piece by piece."""

from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SimulationError
from frictionlab.simulator.numeric import RTOL, layout, machine
from frictionlab.simulator.numeric.machine import LostError, Machine, machine_of
from frictionlab.simulator.numeric.motion import STOP_SHARE, ringing
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record.base import BaseRecord
from frictionlab.simulator.record.piece import cubic_of, force_of
from frictionlab.simulator.record.response import Response

__all__ = ["integrate", "load", "wall_of"]

Floats = NDArray[np.float64]
_Found = tuple[Any, Any, tuple[Floats, ...]]  # tally, events; z, v and the contact's force at the samples
CHUNK = 1 << 15  # pieces handed to the kernel at once
LONGEST = 0.5  # rad: what is carried at once at most
RECORDED = 4000  # steps that may be made within it, and
ALLOWED = 20_000.0  # tried
DWELL = 10.0  # a stop lasts at least so many times as long as slow slip takes in a turn
TOUCH = 1e-13  # rad: a shorter stick of a rigid contact is a touch, not a stop
WORTH_LOADING, WORTH_COMPILING = 500.0, 10_000.0  # pieces: in plain Python they take about as long


@dataclass(frozen=True)
class _Pieces:
    """Start and length of each piece (m,), coefficients (m, 4) of the base and of the force in it."""

    starts: Floats
    lengths: Floats
    base: Floats
    pull: Floats

    def part(self, buffer: Any, first: int) -> tuple[Any, ...]:
        """Some of them as the kernel's buffers."""
        some = slice(first, first + CHUNK)
        columns = (self.starts[some], self.lengths[some], self.base[some].ravel(), self.pull[some].ravel())
        return tuple(buffer(tuple(column.tolist())) for column in columns)


def wall_of(problem: Problem, base: BaseRecord) -> float:
    """How the wall moves, in the words of `piece.force_of`.

    Raises
    ------
    SimulationError
        An acceleration of the base says nothing of where a fixed wall is.
    """
    if base.quantity == "displacement":
        return 1.0 if problem.wall == "base" else 0.0
    if problem.wall != "base":
        raise SimulationError(
            "simulation of a record: the base's acceleration; expected a wall that moves with the base (wall = 'base');"
            " got a fixed one, which needs the base's displacement; do: integrate twice, with a high-pass"
        )
    return 2.0


def load(pieces: float) -> bool:
    """Say whether so many pieces are worth the compiled kernel, and load it if so."""
    if machine.compiled.cache_info().currsize:
        return True
    if pieces > WORTH_COMPILING or (pieces > WORTH_LOADING and machine.is_ready()):
        machine.compiled()
        return True
    return False


def integrate(problem: Problem, base: BaseRecord, slopes: Floats, start: tuple[float, float]) -> Response:
    """Return the response of a law without exact phases; `slopes` of the base at its samples, `start` x and v."""
    pieces = _pieces_of(problem, base, slopes)
    rig = _machine(problem, pieces, fast=load(len(pieces.lengths)))
    moving = wall_of(problem, base) == 1.0
    first = float(base.values[0]), float(pieces.base[0, 1])
    at = (start[0] - first[0], start[1] - first[1]) if moving else start
    state = np.zeros(rig.size)
    state[:2] = at
    if rig.size == layout.WIDTH:
        state[3] = 1.0  # a rate-and-state contact has its steady age
    rig.put(state)
    room = 256 + len(base.time) // 16
    seen, events, motion = _travelled(rig, pieces, base, room, at)
    if int(seen[layout.SEEN_EVENTS]) > room:
        rig.put(state)
        seen, events, motion = _travelled(rig, pieces, base, int(seen[layout.SEEN_EVENTS]), at)
    return _response(problem, base, rig, (seen, events, motion), at)


def _pieces_of(problem: Problem, base: BaseRecord, slopes: Floats) -> _Pieces:
    """The base and the force it makes as cubics."""
    h: Any = np.diff(base.time)  # the formulas of a piece take arrays as well
    y0: Any = base.values[:-1]
    y1: Any = base.values[1:]
    d: Any = slopes
    none = np.zeros_like(h)
    straight = (y0, (y1 - y0) / h, none, none)
    cubic: Any = cubic_of(y0, y1, d[:-1], d[1:], h) if len(slopes) else straight
    wall = wall_of(problem, base)
    pull = force_of(cubic, problem.frame_damping_ratio, wall)
    columns = [np.stack([c + none for c in each], axis=1) for each in (cubic, pull)]
    return _Pieces(base.time[:-1], h, *columns)


def _machine(problem: Problem, pieces: _Pieces, *, fast: bool) -> Machine:
    """The engine set up for a drive that is a cubic, its errors measured by what the drive does."""
    rig = machine_of(problem, RTOL, fast=fast, rows=RECORDED)
    none = (0.0,) * 4
    force = tuple(rig.buffer(part) for part in (none, (), none, (), (), (), (), ()))
    push, rate = float(np.abs(pieces.pull[:, 0]).max()), float(np.abs(pieces.base[:, 1]).max())
    scale = rig.room[layout.SCALE]
    scale[0], scale[1] = min(push, 1.0), min(push, max(rate, 1e-3 * push))
    tally = rig.room[layout.TALLY]
    tally[layout.BUDGET] = ALLOWED
    return replace(rig, force=force)


def _limits(problem: Problem, pieces: _Pieces) -> tuple[float, float, float]:
    """Slip slower than this is a stop, the shortest one, and the longest slip that is part of one (rad).

    As in a steady cycle (`numeric.motion.stop_speed`), where the drive's amplitudes are the root of 2 times its rms:
    its force, and that force's rate, whose ratio is the drive's own time.
    """
    if problem.law.kind != "inner" or problem.beta == 0.0:
        return 0.5, TOUCH, 0.0
    share = max(STOP_SHARE, 1.0 / (1.0 + problem.parameter("stiffness_ratio", inf)))
    span = float(pieces.lengths.sum())
    push, rate = (sqrt(2.0 * float(pieces.lengths @ pieces.pull[:, k] ** 2) / span) for k in (0, 1))
    return share * rate, DWELL * share * push / rate, ringing(problem)


def _travelled(rig: Machine, pieces: _Pieces, base: BaseRecord, room: int, at: tuple[float, float]) -> _Found:
    """What is seen of the motion, its events, and z, v and the contact's force at the samples."""
    seen, events = rig.buffer((0.0,) * layout.SEEN), rig.buffer((0.0,) * (layout.EVENT * room))
    seen[layout.LAST_TIME] = float(base.time[0])
    rig.room[layout.TALLY][layout.LENGTH] = LONGEST
    limits, kernel = _limits(rig.problem, pieces), rig.kernel
    for k in range(4):
        rig.force[0][k] = pieces.pull[0, k]
    motion = [np.empty(len(base.time)) for _ in range(3)]
    motion[0][0], motion[1][0] = at
    motion[2][0] = kernel.force_now(rig.rig, rig.force, rig.room, 0.0)
    for first in range(0, len(pieces.lengths), CHUNK):
        part = pieces.part(rig.buffer, first)
        out = tuple(rig.buffer((0.0,) * len(part[1])) for _ in range(3))
        done, code = kernel.travel(rig.rig, rig.force, rig.table, rig.room, part, out, limits, seen, events, LONGEST)
        if code != layout.FINE:
            raise _lost(rig.problem, float(base.time[first + done]), code)
        for column, found in zip(motion, out, strict=True):
            column[first + 1 : first + 1 + done] = found
    kernel.close(seen, events, limits[1], float(base.time[-1]))
    return seen, events, tuple(motion)


def _lost(problem: Problem, tau: float, code: int) -> SimulationError:
    """Why the motion cannot be carried on."""
    what = f"simulation of a record: law {problem.law.name}, parameters {problem.parameters}, at tau = {tau:.6g}: "
    if code == layout.NEGATIVE:
        return LostError(f"{what}friction turns negative; expected at least 0; do: a smaller gradient or rate_strength")
    return LostError(
        f"{what}expected fewer than {RECORDED} steps in {LONGEST} rad; got more: the contact rings, or the law is too"
        " stiff; do: take the law that this one tends to (a rigid contact for a stiffness without end)"
    )


def _response(
    problem: Problem,
    base: BaseRecord,
    rig: Machine,
    found: tuple[Any, Any, tuple[Floats, ...]],
    at: tuple[float, float],
) -> Response:
    seen, events, (x, v, n) = found
    squared, spring = float(seen[layout.SEEN_SQUARED]), _spring_force(problem, rig)
    stored = 0.5 * spring**2 / problem.parameter("stiffness_ratio", inf)
    moving, frame, contact = wall_of(problem, base) == 1.0, problem.frame_damping_ratio, problem.zeta
    friction = float(seen[layout.SEEN_WORK]) - 2.0 * contact * squared - stored
    dragged = squared if problem.wall == "base" else float(seen[layout.SEEN_FRAME])
    gained = 0.5 * float(x[-1] ** 2 + v[-1] ** 2 - at[0] ** 2 - at[1] ** 2)
    put_in = float(seen[layout.SEEN_INPUT])
    count = int(seen[layout.SEEN_EVENTS])
    return Response(
        problem=problem,
        base=base,
        displacement=x + base.values if moving else x,
        velocity=v + base.speeds if moving else v,
        contact_force=n,
        events=np.array(events[: layout.EVENT * count], dtype=np.float64).reshape(-1, layout.EVENT),
        energy=friction + 2.0 * contact * squared + 2.0 * frame * dragged,
        friction_energy=friction,
        energy_input=put_in,
        closure_error=abs(put_in - float(seen[layout.SEEN_WORK]) - 2.0 * frame * squared - gained),
        path=float(seen[layout.SEEN_PATH]),
        stops=int(seen[layout.SEEN_STOPS]),
        time_stuck=float(seen[layout.SEEN_STUCK]),
        solver="numeric",
    )


def _spring_force(problem: Problem, rig: Machine) -> float:
    """Force in the contact's springs at the end: its inner state, as a force."""
    inner = float(rig.room[layout.STATE][2]) if rig.size > 2 else 0.0
    return inner * problem.parameter("stiffness_ratio") if problem.law.has("lugre") else inner
