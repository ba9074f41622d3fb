"""How the mass of a virtual test moves: from rest or steadily, cycle by cycle; and what further sensors show of it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from frictionlab.arrays import FloatArray
from frictionlab.errors import SceneError
from frictionlab.scene import Scene
from frictionlab.simulator import simulate, steady_state
from frictionlab.simulator.record import BaseRecord, Response, respond
from frictionlab.synthetic.virtual_rig import SyntheticTest

FINE = 200  # points per period of the fastest part: a spline through them errs by 3e-9 of it
HOUR_S = 3600.0


def cycle_friction_ratios(test: SyntheticTest, scene: Scene) -> FloatArray:
    """Friction ratio of each cycle: drift, jump and scatter as the test's material has them; (cycles,)."""
    group = test.group
    start = np.arange(test.cycles) / test.drive_frequency_hz
    factor = 1 + group.friction_drift_per_hour * start / HOUR_S
    if group.jump_s is not None:
        factor = np.where(start >= group.jump_s, group.jump_factor, 1.0) * factor
    if group.friction_scatter:
        factor = factor * (1 + group.friction_scatter * test.draws(scene, "friction").standard_normal(len(start)))
    return test.friction_ratio * np.maximum(factor, 0.0)


def motion(test: SyntheticTest, time: FloatArray, scene: Scene) -> FloatArray:
    """Displacement of the mass (m) at the given times (s), before any sensor; (n, masses) of a frame of several."""
    tau, x, v = 2 * math.pi * test.drive_frequency_hz * time, 0.0, 0.0
    what, run = test.frame or test.problem(), None
    if scene.synthetic.start == "steady":
        settled = steady_state(what)
        run, period = settled.orbit, settled.period_cycles
        if run is None or period is None:
            raise SceneError(
                f"synthetic.tests: {test.log}: start = 'steady' needs a steady state; got {settled.outcome}"
            )
        tau = np.mod(tau, 2 * math.pi * period) if test.is_plain_coulomb else tau
        x, v = (float(part[0, 0]) for part in run.all_at(np.zeros(1))[:2])
    elif test.is_plain_coulomb:
        run = simulate(what, cycles=test.cycles)
    if run is not None and test.is_plain_coulomb:
        moved = run.all_at(tau)[0]
        return np.asarray(test.base_amplitude_m * (moved if test.frame is not None else moved[:, 0]))
    displacement = np.empty_like(time)
    for cycle, beta in enumerate(cycle_friction_ratios(test, scene)):
        trajectory = simulate(test.problem(float(beta)), cycles=1, x0=x, v0=v)
        inside = slice(*np.searchsorted(tau, [2 * math.pi * cycle, 2 * math.pi * (cycle + 1)]))
        displacement[inside] = trajectory.at(tau[inside] - 2 * math.pi * cycle)[0]
        x, v = (float(part[0]) for part in trajectory.at(np.array([2 * math.pi])))
    return test.base_amplitude_m * displacement


@dataclass(frozen=True)
class Driven:
    """A motion, over Y, at even times; its parts are those of one friction ratio each.

    ``time`` (n,) tau = omega_n t; ``base`` and ``displacement`` (n,) over Y, ``velocity`` (n,) of the mass over
    omega_n Y, ``force`` (n,) of the contact over k Y; ``every``: one of so many times is the log's.
    """

    test: SyntheticTest
    time: FloatArray
    base: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    force: FloatArray
    parts: Sequence[Response]
    every: int

    def totals(self) -> dict[str, object]:
        """What is true of the whole motion."""
        amplitude, energy = self.test.base_amplitude_m, sum(part.energy for part in self.parts)
        base = np.concatenate([part.base.values for part in self.parts])
        return {
            "base_largest_m": amplitude * float(np.abs(base).max()),
            "total_energy_j": energy * self.test.stiffness_n_per_m * amplitude**2,
            "total_friction_energy": sum(part.friction_energy for part in self.parts),
            "total_stops": sum(part.stops for part in self.parts),
        }

    def channels(self, names: Sequence[str]) -> dict[str, FloatArray]:
        """Further channels of the log, in SI, before any sensor.

        The mass's acceleration is that of its equation of motion, (2.9) in the frame's time:
        ``x'' = y - x + 2 zeta (y' - x') - n``.
        """
        test, amplitude = self.test, self.test.base_amplitude_m
        omega, spline = 2 * math.pi * test.natural_frequency_hz, CubicSpline(self.time, self.base)
        rate = spline(self.time, 1)
        pull = self.base - self.displacement + 2.0 * test.damping_ratio * (rate - self.velocity)
        known = {
            "contact_force": test.stiffness_n_per_m * amplitude * self.force,
            "normal_force": np.full(len(self.time), test.normal_force_n),
            "mass_velocity": amplitude * omega * self.velocity,
            "base_velocity": amplitude * omega * rate,
            "mass_acceleration": amplitude * omega**2 * (pull - self.force),
            "base_acceleration": amplitude * omega**2 * spline(self.time, 2),
        }
        return {name: known[name][:: self.every] for name in names}


def driven(test: SyntheticTest, scene: Scene) -> Driven:
    """Return the motion from rest with what further channels show; where the base is 0 the spring is relaxed.

    Friction has one value for a cycle of the drive, then the next. A start from the steady state is refused.
    """
    if scene.synthetic.start == "steady":
        got = ", ".join(scene.synthetic.channels)
        raise SceneError(f"synthetic.tests: {test.log}: start = 'steady' has displacements alone; got channels {got}")
    rate = scene.synthetic.sampling_rate_hz
    every = max(1, math.ceil(FINE * max(test.drive_frequency_hz, test.natural_frequency_hz) / rate))
    time = np.arange((round(test.duration_s * rate) - 1) * every + 1) / (rate * every)
    tau = 2 * math.pi * test.natural_frequency_hz * time
    base = np.cos(test.frequency_ratio * tau)
    betas = [test.friction_ratio] if test.is_plain_coulomb else cycle_friction_ratios(test, scene).tolist()
    length = 2 * math.pi * test.natural_frequency_hz / test.drive_frequency_hz
    ends = np.searchsorted(tau, length * np.arange(1, len(betas))).tolist()
    x, v, first = 0.0, 0.0, 0
    moved, parts = np.zeros((3, len(tau))), []
    for beta, end in zip(betas, [*ends, len(tau) - 1], strict=True):
        if end - first < 1:
            continue
        some = slice(first, end + 1)
        record = BaseRecord(tau[some], base[some], rest=0.0, scale=1.0)
        parts.append(respond(test.problem(beta).in_frame_time(), record, x0=x, v0=v))
        moved[:, some] = parts[-1].displacement, parts[-1].velocity, parts[-1].contact_force
        x, v, first = float(parts[-1].displacement[-1]), float(parts[-1].velocity[-1]), end
    return Driven(test, tau, base, moved[0], moved[1], moved[2], tuple(parts), every)
