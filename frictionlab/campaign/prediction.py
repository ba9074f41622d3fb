"""What Coulomb's law says of one test, and how fast that changes with the friction ratio and the frequency ratio."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SimulationError
from frictionlab.scene import Scene
from frictionlab.simulator import Problem, observe, steady_state
from frictionlab.simulator.engine import choose

FloatArray = NDArray[np.float64]
WALLS = {"fixed": "fixed wall", "base": "wall moving with the base"}
STEP = 0.005  # relative step of the slopes: wide enough to see past the small steps where a stop appears


SLIDES = 20.0  # of one steady state, roughly


def prepare(predictions: int) -> None:
    """Load the compiled simulator if that many predictions are worth it; it changes nothing but their time."""
    choose(SLIDES * predictions)


@dataclass(frozen=True)
class Law:
    """The friction model of a campaign: ``mu`` static over kinetic, ``zeta`` viscous damping ratio, ``wall``."""

    mu: float = 1.0
    zeta: float = 0.0
    wall: Literal["fixed", "base"] = "fixed"

    @property
    def words(self) -> str:
        """The law as a reader would say it."""
        parts = ["Coulomb friction", WALLS[self.wall]]
        if self.mu > 1:
            parts.append(f"static over kinetic friction {self.mu:g}")
        parts.append(f"viscous damping ratio {self.zeta:g}" if self.zeta else "no other damping")
        return ", ".join(parts)


def law_of(scene: Scene) -> Law:
    """The law that a scene's ``[model]`` switches on."""
    zeta = (scene.rig.damping_ratio or 0.0) if scene.model.damping else 0.0
    return Law(scene.model.static_ratio, zeta, scene.model.wall)


@dataclass(frozen=True)
class Prediction:
    """A predicted steady state: ``energy`` (k Y^2 per cycle), ``amplitude`` (Y), ``stops`` per cycle.

    ``memory``: what is left of a disturbance after one cycle, the modulus of the Floquet multiplier (1: it never dies).
    """

    energy: float
    amplitude: float
    stops: float
    memory: float


@lru_cache(maxsize=65536)
def predict(law: Law, r: float, beta: float) -> Prediction | None:
    """The steady state at (r, beta), or None where there is none (unbounded, or not found)."""
    try:
        state = steady_state(Problem(r, beta, mu=law.mu, zeta=law.zeta, wall=law.wall))
    except SimulationError:
        return None
    seen = observe(state)
    if seen.energy_per_cycle is None or seen.response_amplitude is None:
        return None
    multiplier = state.floquet_multiplier
    memory = abs(multiplier) ** (1.0 / max(state.period_cycles or 1, 1)) if multiplier is not None else 0.0
    return Prediction(seen.energy_per_cycle, seen.response_amplitude, seen.stops_per_cycle or 0.0, memory)


@dataclass(frozen=True)
class Local:
    """A prediction with its slopes: ``by_beta`` and ``by_r``, each (2,) for energy and amplitude."""

    here: Prediction
    by_beta: FloatArray
    by_r: FloatArray


def local(law: Law, r: float, beta: float) -> Local | None:
    """Prediction and central differences at (r, beta); None where a neighbour has no steady state."""
    h, g = STEP * beta, STEP * r * min(1.0, max(abs(r - 1.0), 0.02))
    points = [predict(law, *p) for p in ((r, beta), (r, beta - h), (r, beta + h), (r - g, beta), (r + g, beta))]
    if any(p is None for p in points):
        return None
    here, low, high, slow, fast = (p for p in points if p is not None)
    return Local(here, (_pair(high) - _pair(low)) / (2 * h), (_pair(fast) - _pair(slow)) / (2 * g))


def _pair(prediction: Prediction) -> FloatArray:
    return np.array([prediction.energy, prediction.amplitude])


@dataclass(frozen=True)
class Curve:
    """Coulomb's prediction over frequency of one friction ratio; arrays (n,), nan where there is no steady state."""

    material: str
    normal_force_n: float
    friction_ratio: float
    r: FloatArray
    energy: FloatArray
    stops: FloatArray


def curve(law: Law, material: str, normal_force_n: float, beta: float, r: FloatArray) -> Curve:
    """Predict one friction ratio over frequency ratios."""
    states = [predict(law, float(value), beta) for value in r]
    energy = np.array([math.nan if s is None else s.energy for s in states])
    stops = np.array([math.nan if s is None else s.stops for s in states])
    return Curve(material, normal_force_n, beta, r, energy, stops)
