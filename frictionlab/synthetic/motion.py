"""How the mass of a virtual test moves: from rest or steadily, cycle by cycle, under a plain sine or any other base."""

import math

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SceneError
from frictionlab.scene import Scene
from frictionlab.simulator import Motion, simulate, steady_state
from frictionlab.synthetic.base import FINE, base_motion, highest_hz
from frictionlab.synthetic.driven import Driven, drive
from frictionlab.synthetic.friction import cycle_friction_ratios
from frictionlab.synthetic.rig import VirtualTest

FloatArray = NDArray[np.float64]
PHASES = 64  # points per cycle of the true irregularity


def sample_times(test: VirtualTest, scene: Scene) -> FloatArray:
    """Times of the log's samples (n,), s."""
    rate = scene.synthetic.sampling_rate_hz
    return np.asarray(np.arange(round(test.duration_s * rate)) / rate)


def plain_base(test: VirtualTest, time: FloatArray) -> FloatArray:
    """Displacement (m) of a base that is a plain sine."""
    return np.asarray(test.base_amplitude_m * np.cos(2 * math.pi * test.drive_frequency_hz * time))


def motion(test: VirtualTest, time: FloatArray, scene: Scene) -> FloatArray:
    """Displacement of the mass (m) at the given times (s), before any sensor."""
    tau = 2 * math.pi * test.drive_frequency_hz * time
    x = v = 0.0
    if scene.synthetic.start == "steady":
        orbit, period = _steady_orbit(test)
        if test.is_plain_coulomb:
            return test.base_amplitude_m * orbit.at(np.mod(tau, period))[0]
        x, v = (float(state[0]) for state in orbit.at(np.zeros(1)))
    if test.is_plain_coulomb:
        cycles = max(1, math.ceil(test.duration_s * test.drive_frequency_hz))
        return test.base_amplitude_m * simulate(test.problem(), cycles=cycles).at(tau)[0]
    displacement = np.empty_like(time)
    for cycle, beta in enumerate(cycle_friction_ratios(test, scene)):
        trajectory = simulate(test.problem(float(beta)), cycles=1, x0=x, v0=v)
        inside = slice(*np.searchsorted(tau, [2 * math.pi * cycle, 2 * math.pi * (cycle + 1)]))
        displacement[inside] = trajectory.at(tau[inside] - 2 * math.pi * cycle)[0]
        x, v = (float(state[0]) for state in trajectory.at(np.array([2 * math.pi])))
    return test.base_amplitude_m * displacement


def _steady_orbit(test: VirtualTest) -> tuple[Motion, float]:
    """The steady orbit of a test and its period (rad)."""
    state = steady_state(test.problem())
    if state.orbit is None or state.period_cycles is None:
        raise SceneError(f"synthetic.tests: {test.log}: start = 'steady' needs a steady state; got {state.outcome}")
    return state.orbit, 2 * math.pi * state.period_cycles


def driven(test: VirtualTest, scene: Scene) -> tuple[Driven, int, FloatArray]:
    """The motion under a base that is no plain sine; which of its times are the log's; the base (m) at all of them.

    Raises
    ------
    SceneError
        A start from the steady state, which only a plain sine has; a recorded base that cannot be read.
    """
    if scene.synthetic.start == "steady":
        raise SceneError(
            f"synthetic.tests: {test.log}: start = 'steady' needs a plain sine; got base {test.base.name!r}"
        )
    rate = scene.synthetic.sampling_rate_hz
    top = max(highest_hz(test.base, test.drive_frequency_hz), test.natural_frequency_hz)
    every = max(1, math.ceil(FINE * top / rate))
    time = np.arange((round(test.duration_s * rate) - 1) * every + 1) / (rate * every)
    base = base_motion(
        *(test.base, time, test.drive_frequency_hz, scene), lambda purpose: test.draws(scene, purpose), name=test.log
    )
    constant = np.array([test.friction_ratio])
    betas = constant if test.is_plain_coulomb else cycle_friction_ratios(test, scene)
    run = drive(
        lambda beta: test.problem(beta).in_frame_time(),
        betas,
        2 * math.pi * test.natural_frequency_hz / test.drive_frequency_hz,
        2 * math.pi * test.natural_frequency_hz * time,
        base / test.base_amplitude_m,
    )
    return run, every, base


def phase_times(test: VirtualTest, transient: float) -> FloatArray:
    """Times (s) of 64 phases in each full cycle after the transient, cut where the base rises through zero."""
    first = math.ceil(transient * test.drive_frequency_hz + 0.25)
    last = math.floor(test.duration_s * test.drive_frequency_hz + 0.25)
    cycles = np.arange(first, max(first, last))[:, None] - 0.25
    return np.asarray((cycles + np.arange(PHASES) / PHASES) / test.drive_frequency_hz)


def motion_at(test: VirtualTest, scene: Scene, *times: FloatArray) -> list[FloatArray]:
    """The motion at several sets of times, simulated once."""
    every = np.concatenate(times)
    order = np.argsort(every, kind="stable")
    displacement = np.empty_like(every)
    displacement[order] = motion(test, every[order], scene)
    return np.split(displacement, np.cumsum([len(t) for t in times])[:-1])
