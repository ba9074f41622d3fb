"""Recordings of contacts whose law is known, whose friction differs a little from cycle to cycle."""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from frictionlab.analysis.measurement import measure
from frictionlab.arrays import FloatArray
from frictionlab.inference.observation import Observation
from frictionlab.inference.observations import CycleObservation, observe
from frictionlab.inference.unknowns import of_law
from frictionlab.recording import Recording
from frictionlab.scene import Scene, scene_from_tables
from frictionlab.simulator import Problem, steady_state
from frictionlab.simulator.record import BaseRecord, respond
from tests.analysis.seen import through_laser
from tests.desk import present

NATURAL_HZ, BASE_M = 3.13, 1.8e-3


def recorded(
    problem: Problem,
    generator: np.random.Generator,
    *,
    scatter: float = 0.003,
    seconds: float = 60.0,
    rate: float = 250.0,
    lag_s: float = 0.0,
    gain: float = 1.0,
    tuned: float = 1.0,
    sensors: Callable[[FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray]] | None = None,
) -> Recording:
    """A steady motion through two lasers; friction scatters by a relative rms from cycle to cycle.

    The base begins at a phase of 0.7 rad, and friction changes as each cycle of it begins.
    The motion of each cycle is that of its own friction, to first order; the mass is seen `lag_s` early. The
    frame's true natural frequency is `tuned` times NATURAL_HZ. `sensors` makes of time, mass and base [s, m] what the
    sensors show of them, before their noise.
    """
    stronger = problem.with_parameters({"beta": problem.beta * (1 + 1e-4)})
    here, there = (present(steady_state(p).orbit) for p in (problem, stronger))
    t = np.arange(round(seconds * rate)) / rate
    drive = problem.r * tuned * NATURAL_HZ
    tau = 2 * math.pi * drive * t + 0.7
    early = tau + 2 * math.pi * drive * lag_s
    cycle = np.floor(early / (2 * math.pi)).astype(int)
    weaker = scatter * generator.standard_normal(cycle.max() + 1)[cycle]
    phase = np.mod(early, 2 * math.pi)
    x = here.at(phase)[0]
    x = x + (there.at(phase)[0] - x) / 1e-4 * weaker
    mass, base = gain * BASE_M * x, BASE_M * problem.base.at(tau)
    if sensors is not None:
        mass, base = sensors(t, mass, base)
    return Recording(t, through_laser(mass, generator), through_laser(base, generator))


def observed(
    problem: Problem,
    known: Scene,
    generator: np.random.Generator,
    source: object,
    *,
    material: str = "steel",
    newtons: float | None = None,
    **how: Any,
) -> CycleObservation:
    """What a contact, recorded as `how` says, shows as a test of a campaign; ``newtons``: where the scene has none."""
    measured = measure(recorded(problem, generator, **how), known)
    force = measured.normal_force_n if newtons is None else newtons
    return observe(replace(measured, source=str(source), material=material, normal_force_n=force), known)


def from_rest(problem: Problem) -> Callable[[FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """For `recorded`: the motion that begins at rest under the base, in place of the steady one."""

    def started(t: FloatArray, _mass: FloatArray, base: FloatArray) -> tuple[FloatArray, FloatArray]:
        drive = BaseRecord(2.0 * math.pi * NATURAL_HZ * t, base / BASE_M, rest=0.0, scale=1.0)
        return BASE_M * respond(problem.in_frame_time(), drive).displacement, base

    return started


def assert_slopes_of_sensors(
    observation: Observation, names: Collection[str], here: Mapping[str, float], step: float, within: float
) -> dict[str, float]:
    """Slopes of what sensors do are differences of whole predictions; all values are returned."""
    unknowns = (*of_law(observation.law, observation.held, observation.sources.infer), *observation.rig_unknowns)
    values = {u.name: u.value(0.0) for u in unknowns} | dict(here)
    plain = present(observation.predict(values))
    slopes = observation.slopes(unknowns, [1.0] * len(unknowns), values)
    for i, u in enumerate(unknowns):
        if u.name in names:
            there = present(observation.predict(values | {u.name: u.value(u.at(values[u.name]) + step)}))
            np.testing.assert_allclose(slopes[:, i], (there - plain) / step, atol=within)
    return values


def scene(**tables: Mapping[str, object]) -> Scene:
    """The rig of these recordings: its sensors and its frame are known unless a test says otherwise (None: unknown)."""
    known: dict[str, Mapping[str, object]] = {
        "rig": {"natural_frequency_hz": NATURAL_HZ, "damping_ratio": 0.0, "natural_frequency_hz_u": 0.003},
        "analysis": {"transient_s": 2.0, "cycles": "all"},
    }
    both = {name: {**known.get(name, {}), **tables.get(name, {})} for name in {*known, *tables}}
    return scene_from_tables({name: {k: v for k, v in table.items() if v is not None} for name, table in both.items()})
