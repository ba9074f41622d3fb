"""Steady cycles of many problems at once: their numbers, and the mass's displacement over one turn of the drive.

Rigid laws are one call of the kernel; others are solved one by one.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SimulationError
from frictionlab.simulator import engine as engines
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.laws import law_of
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.solve import steady_state
from frictionlab.simulator.state import SteadyState, to_numbers
from frictionlab.simulator.sweep import MOST_PHASES, Family, are_many, warm_up

__all__ = ["steady_cycles"]

Floats = NDArray[np.float64]
SLIDES = 20.0  # of a steady state, roughly


def steady_cycles(points: Floats, family: Family, samples: int = 128) -> tuple[Floats, Floats]:
    """Return the kernel's rows of problems, and their cycles.

    Parameters
    ----------
    points : ndarray of shape (n, coordinates)
        As `Family.coordinates` names them.
    family : Family
        What the problems have in common.
    samples : int
        Of a cycle, even: equally spaced phases of the drive from 0.

    Returns
    -------
    rows : ndarray of shape (n, columns)
        As `sweep_points`; `frictionlab.simulator.sweep.named` reads them.
    cycles : ndarray of shape (n, samples)
        Absolute displacement of the mass over Y, mean over the cycles of a motion's period; NaN where there is
        no steady state.

    Examples
    --------
    >>> _, cycles = steady_cycles(np.array([[0.5, 0.4, 1.0, 0.0]]), Family())
    >>> orbit = steady_state(Problem(0.5, 0.4)).orbit
    >>> bool(np.allclose(cycles[0], orbit.at(2 * np.pi * np.arange(128) / 128)[0], atol=1e-12))
    True
    """
    if law_of(family.law).kind != "rigid":
        return _one_by_one(points, family, samples)
    engine = engines.choose(SLIDES * len(points))
    phases = 64 + int(10 * (family.base.harmonics + 1.0 / float(points[:, 0].min())))
    rows, cycles = _call(engine, points, family, samples, phases)
    while np.any(full := rows[:, layout.OUTCOME] == layout.OVERFULL):
        phases *= 4
        if phases > MOST_PHASES:
            break  # the cycles are NaN: no steady state that could be told
        rows[full], cycles[full] = _call(engine, points[full], family, samples, phases)
    if family.wall == "base":
        cycles += family.base.at(_phases(samples))
    return rows, cycles


def _call(engine: engines.Engine, points: Floats, family: Family, samples: int, phases: int) -> tuple[Floats, Floats]:
    base = family.base
    room = engines.make_room(engine, Problem(1.0, 0.0, wall=family.wall, base=base), phases)
    force = engines.make_force(engine, base.cosine, base.sine)
    rows, out = _buffer(engine, layout.ROW * len(points)), _buffer(engine, samples * len(points))
    flat = engine.flat(family.contacts(points))
    series = engine.buffer(base.cosine), engine.buffer(base.sine)
    engine.kernel.cycles(flat, *series, force, room, rows, samples, out)
    shape = len(points), -1
    return np.array(rows, dtype=np.float64).reshape(shape), np.array(out, dtype=np.float64).reshape(shape)


def _buffer(engine: engines.Engine, size: int) -> Any:
    return engine.buffer((0.0,) * size)


def _one_by_one(points: Floats, family: Family, samples: int) -> tuple[Floats, Floats]:
    if are_many(len(points), family.law):
        warm_up(family.law)
    tau, rows, cycles = _phases(samples), [], []
    for point in points.tolist():
        state = _state(family, point)
        rows.append([layout.NOT_FOUND, *[np.nan] * (layout.ROW - 1)] if state is None else to_numbers(state))
        cycles.append(_cycle_of(state, tau))
    return np.array(rows), np.array(cycles)


def _state(family: Family, point: list[float]) -> SteadyState | None:
    try:
        return steady_state(family.problem(point))
    except SimulationError:
        return None  # its row says that none was found


def _cycle_of(state: SteadyState | None, tau: Floats) -> Floats:
    """The mean cycle of a motion; NaN where there is none."""
    if state is None or (state.orbit is None and state.outcome != "stuck"):
        return np.full(len(tau), np.nan)
    if state.orbit is None:
        return np.zeros(len(tau))
    turns = 2.0 * np.pi * np.arange(state.period_cycles or 1)[:, None]
    return np.asarray(state.orbit.at(tau + turns)[0].mean(axis=0))


def _phases(samples: int) -> Floats:
    return 2.0 * np.pi * np.arange(samples) / samples
