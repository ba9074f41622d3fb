"""Motions whose truth is known, seen through the optoNCDT's noise and step."""

import math
from typing import Any

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.recording import Recording
from frictionlab.scene import Analysis, Rig, Scene
from frictionlab.simulator import Motion, Problem, SteadyState, steady_state
from tests.desk import present

NATURAL_HZ, BASE_M, NOISE_M, STEP_M = 3.13, 1.8e-3, 0.8e-6, 1.02 * 0.05 / 65520


def through_laser(signal: FloatArray, generator: np.random.Generator, noise: float = NOISE_M) -> FloatArray:
    return np.asarray(np.round((signal + noise * generator.standard_normal(len(signal))) / STEP_M) * STEP_M)


def steady(r: float, beta: float) -> tuple[SteadyState, Motion, float, float]:
    """Steady state, its orbit, its energy per cycle and response amplitude; fails the test when there is none."""
    state = steady_state(Problem(r, beta))
    return state, present(state.orbit), present(state.energy_per_cycle), present(state.response_amplitude)


def recording_of(
    r: float,
    beta: float,
    *,
    seed: int,
    noise: float = NOISE_M,
    seconds: float = 90.0,
    rate: float = 500.0,
    phase: float = 0.7,
) -> Recording:
    """A steady orbit through two lasers."""
    state, orbit, _, _ = steady(r, beta)
    generator = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate)) / rate
    tau = 2 * math.pi * r * NATURAL_HZ * t + phase
    mass = BASE_M * orbit.at(np.mod(tau, 2 * math.pi * (state.period_cycles or 1)))[0]
    base = BASE_M * np.cos(tau)
    return Recording(t, through_laser(mass, generator, noise), through_laser(base, generator, noise))


def scene(cycles: str = "all", transient: float = 20.0, **rig: Any) -> Scene:
    return Scene(
        rig=Rig(**{"natural_frequency_hz": NATURAL_HZ, **rig}), analysis=Analysis(transient_s=transient, cycles=cycles)
    )
