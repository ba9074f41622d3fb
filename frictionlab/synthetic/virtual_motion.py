"""How the mass of a virtual test moves: from rest or steadily, cycle by cycle; and what further sensors show of it."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SceneError
from frictionlab.scene import Scene
from frictionlab.simulator import Motion, simulate, steady_state
from frictionlab.synthetic.virtual_rig import SyntheticTest

HOUR_S = 3600.0
TURN = 2.0 * math.pi


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


@dataclass(frozen=True)
class Moved:
    """The true motion of a test at times (n,), before any sensor.

    ``tau`` (n,) rad; ``mass`` (n, masses) over Y, ``velocity`` (n, masses) its derivative by tau, ``force``
    (n, contacts) of the contacts over k Y.
    """

    test: SyntheticTest
    tau: FloatArray
    mass: FloatArray
    velocity: FloatArray
    force: FloatArray

    @property
    def base(self) -> FloatArray:
        """Displacement of the base (n,) over Y; where it is 0 the spring is relaxed."""
        return np.cos(self.tau)

    def channels(self, names: Sequence[str]) -> dict[str, FloatArray]:
        """Further channels of the log (n,), in SI units, of a frame with one mass and one contact.

        The mass's acceleration is that of its equation of motion (2.9), ``r^2 x'' = y - x + 2 zeta r (y' - x') - n``.
        """
        test, amplitude, rate = self.test, self.test.base_amplitude_m, -np.sin(self.tau)
        turn, natural = TURN * test.drive_frequency_hz, TURN * test.natural_frequency_hz
        x, v, n = self.mass[:, 0], self.velocity[:, 0], self.force[:, 0]
        pull = self.base - x + 2.0 * test.damping_ratio * test.frequency_ratio * (rate - v) - n
        known = {
            "contact_force": test.stiffness_n_per_m * amplitude * n,
            "normal_force": np.full(len(n), test.normal_force_n),
            "mass_velocity": amplitude * turn * v,
            "base_velocity": amplitude * turn * rate,
            "mass_acceleration": amplitude * natural**2 * pull,
            "base_acceleration": -amplitude * turn**2 * self.base,
        }
        return {name: known[name] for name in names}


def motion(test: SyntheticTest, time: FloatArray, scene: Scene) -> Moved:
    """How base and mass move at the given times (n,) [s], ascending from 0."""
    tau = TURN * test.drive_frequency_hz * time
    moved = [run.all_at(some) for run, some in _runs(test, tau, scene)]
    mass, velocity, force = (np.concatenate(parts) for parts in zip(*moved, strict=True))
    return Moved(test, tau, mass, velocity, force)


def _runs(test: SyntheticTest, tau: FloatArray, scene: Scene) -> Iterator[tuple[Motion, FloatArray]]:
    """The motions of one friction ratio each, a cycle or all of them, and the times (rad) that each is asked for."""
    what, orbit, x, v = test.frame or test.problem(), None, 0.0, 0.0
    if scene.synthetic.start == "steady":
        settled = steady_state(what)
        orbit = settled.orbit
        if orbit is None:
            raise SceneError(
                f"synthetic.tests: {test.log}: start = 'steady' needs a steady state; got {settled.outcome}"
            )
        x, v = (float(part[0, 0]) for part in orbit.all_at(np.zeros(1))[:2])
    if test.is_plain_coulomb:
        yield orbit or simulate(what, cycles=test.cycles), tau
        return
    edges = np.searchsorted(tau, TURN * np.arange(test.cycles + 1)).tolist()
    for cycle, beta in enumerate(cycle_friction_ratios(test, scene).tolist()):
        run = simulate(test.problem(beta), cycles=1, x0=x, v0=v)
        yield run, tau[slice(*edges[cycle : cycle + 2])] - TURN * cycle
        x, v = (float(part[0]) for part in run.at(np.array([TURN])))
