"""Motions whose truth is known, seen through the optoNCDT's noise and step."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.logs.clock import time_base
from frictionlab.logs.sensor import bridge, examine
from frictionlab.recording import Recording
from frictionlab.scene import Analysis, Rig, Scene
from frictionlab.simulator import Base, Problem, SteadyState, steady_state
from frictionlab.simulator import Motion as Orbit
from tests.desk import present

NATURAL_HZ, BASE_M, NOISE_M, STEP_M = 3.13, 1.8e-3, 0.8e-6, 1.02 * 0.05 / 65520
PHASE_S = 0.0731
Signal = Callable[[FloatArray], FloatArray]


def through_laser(
    signal: FloatArray, generator: np.random.Generator, noise: float = NOISE_M, step: float = STEP_M
) -> FloatArray:
    return np.asarray(np.round((signal + noise * generator.standard_normal(len(signal))) / step) * step)


def steady(r: float, beta: float) -> tuple[SteadyState, Orbit, float, float]:
    """Steady state, its orbit, its energy per cycle and response amplitude; fails the test when there is none."""
    state = steady_state(Problem(r, beta))
    return state, present(state.orbit), present(state.energy_per_cycle), present(state.response_amplitude)


@dataclass(frozen=True)
class Motion:
    """An exact motion: ``mass`` and ``base`` over Y as functions of time [s], and what is true of it.

    ``energy`` (k Y^2) and ``amplitude`` (Y): means over the true period; ``stops`` per cycle and ``stuck``, their share
    of it; ``hz``: of the drive.
    """

    mass: Signal
    base: Signal
    energy: float
    amplitude: float
    stops: float
    stuck: float
    hz: float


def motion(r: float, beta: float, *, base: tuple[float, ...] = (1.0,), fundamental: int = 1, **how: Any) -> Motion:
    """The steady state of a base ``sum_k base[k-1] cos(k tau)``; the drive is its harmonic ``fundamental``."""
    state = steady_state(Problem(r / fundamental, beta, base=Base(cosine=base), **how))
    orbit, hz = present(state.orbit), r * NATURAL_HZ
    turn = 2.0 * math.pi * hz / fundamental
    period = 2.0 * math.pi * (state.period_cycles or 1)
    tau = np.linspace(0.0, 2.0 * math.pi, 4096 * fundamental, endpoint=False) - 0.5 * math.pi / fundamental
    cycles = orbit.at(np.mod(tau, period))[0].reshape(fundamental, -1)
    return Motion(
        mass=lambda t: orbit.at(np.mod(turn * t, period))[0],
        base=lambda t: np.asarray(Base(cosine=base).at(turn * t)),
        energy=present(state.energy_per_cycle) / fundamental,
        amplitude=float(np.mean(np.ptp(cycles, axis=1) / 2.0)),
        stops=present(state.stops_per_cycle) / fundamental,
        stuck=present(state.stuck_fraction),
        hz=hz,
    )


def seen(
    of: Motion,
    *,
    seed: int = 1,
    seconds: float = 90.0,
    rate: float = 500.0,
    size: float = BASE_M,
    noise: float = NOISE_M,
    step: float = STEP_M,
    phase: float = PHASE_S,
    sensors: Callable[[FloatArray, FloatArray, FloatArray], tuple[FloatArray, FloatArray]] | None = None,
) -> Recording:
    """A motion through two lasers; ``size``: amplitude of the base [m].

    ``sensors`` makes of time, mass and base [s, m] what the sensors show of them, before their noise.
    """
    t = np.arange(round(seconds * rate)) / rate
    mass, base = size * of.mass(t + phase), size * of.base(t + phase)
    if sensors is not None:
        mass, base = sensors(t, mass, base)
    generator = np.random.default_rng(seed)
    x, y = (through_laser(signal + 0.3 * step, generator, noise, step) for signal in (mass, base))
    return Recording(t, x, y)


def clipped(values: FloatArray, share: float) -> FloatArray:
    """What a sensor shows, at its levels, whose range ends at this share of the motion's amplitude on both sides."""
    middle, end = 0.5 * (values.max() + values.min()), share * 0.5 * np.ptp(values)
    return np.asarray(np.round(np.clip(values, middle - end, middle + end) / STEP_M) * STEP_M)


def as_read(recording: Recording) -> Recording:
    """A recording with the flags and the clock that reading its log would give it."""
    clock = time_base(np.array(recording.time), bridge_s=0.02)
    columns = {"mass": recording.mass_displacement, "base": recording.base_displacement}
    mass, base = (examine(np.array(values), role) for role, values in columns.items())
    for channel in (mass, base):
        bridge(clock.time, channel, clock.bridge)
    said = (*clock.warnings, *mass.warnings, *base.warnings)
    quality, source = clock.quality | mass.quality | base.quality, replace(recording.source, warnings=said)
    return Recording(clock.time, mass.values, base.values, quality, source)


def scene(cycles: str = "all", transient: float = 20.0, **rig: Any) -> Scene:
    return Scene(
        rig=Rig(**{"natural_frequency_hz": NATURAL_HZ, **rig}), analysis=Analysis(transient_s=transient, cycles=cycles)
    )
