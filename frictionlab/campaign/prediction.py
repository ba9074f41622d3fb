"""What the contact law says of one test, and what the test says of its friction ratio by that.

Each comes with how fast it changes with the friction ratio and the frequency ratio. Errors that each test makes anew
fall with the number of tests; a gain, a lag or a natural frequency that is wrong is wrong in all of them. So each test
has an error of its own and *shifts*: by how much one standard uncertainty of a shared source moves its estimate. The
shifts of a group are the weighted means of its tests' shifts, and do not fall.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.campaign.trials import Trial
from frictionlab.errors import SimulationError, UsageError
from frictionlab.inference.compare import base_words, model_words
from frictionlab.inference.observations import law_and_held
from frictionlab.scene import Scene, Solver
from frictionlab.simulator import COSINE, Base, Problem, steady_state
from frictionlab.simulator.engine import choose
from frictionlab.simulator.laws import Law, law_of
from frictionlab.simulator.problem import Wall
from frictionlab.uncertainty import Sources

COULOMB = law_of("coulomb")
STEP = 0.005  # relative step of the slopes: wide enough to see past the small steps where a stop appears


SLIDES = 20.0  # of one steady state, roughly


def prepare(predictions: int) -> None:
    """Load the compiled simulator if that many predictions are worth it; it changes nothing but their time."""
    choose(SLIDES * predictions)


@dataclass(frozen=True)
class Model:
    """The physics of a campaign's predictions: all but the friction ratio is known.

    ``law``; ``held``: names and values of its parameters that the scene holds; ``wall``; ``solver``.
    """

    law: Law = COULOMB
    held: tuple[tuple[str, float], ...] = ()
    wall: Wall = "fixed"
    solver: Solver = "auto"

    def problem(self, r: float, beta: float, base: Base = COSINE) -> Problem:
        """Return what is simulated at one frequency ratio and friction ratio."""
        given = {p.name: p.default for p in self.law.parameters if p.default is not None} | dict(self.held)
        given.pop("beta", None)
        frame = given.pop("frame_damping_ratio", 0.0)
        return Problem(r, beta, wall=self.wall, base=base, law=self.law, parameters=given, frame_damping_ratio=frame)

    @property
    def open_ones(self) -> list[str]:
        """Parameters of its law that have no value."""
        held = {name for name, _ in self.held}
        return [p.name for p in self.law.own if p.name not in held and p.name != "beta" and p.default is None]

    @property
    def first(self) -> "Model":
        """That by which friction is looked for at first: itself, or plain Coulomb friction where it is open or dear."""
        if self.is_cheap and not self.open_ones:
            return self
        rig = tuple((name, value) for name, value in self.held if name == "frame_damping_ratio")
        return Model(COULOMB, rig, self.wall)

    @property
    def is_cheap(self) -> bool:
        """Whether a steady state takes less than a millisecond or two."""
        return self.law.is_exact

    @property
    def words(self) -> str:
        """The model as a reader would say it."""
        solver = "" if self.solver == "auto" else f", solver {self.solver}"
        return model_words(self.law, f"{self.wall} wall", dict(self.held), base_words(1)) + solver


def model_of(scene: Scene, *, recorded: bool = False) -> Model:
    """The model that a scene switches on, by the same translation as a single comparison's.

    ``recorded``: whether recordings are at hand, whose cycles tell more than rows of measurements.

    Raises
    ------
    UsageError
        It asks for what rows of measurements cannot give: base harmonics, or the fit of more than the friction ratio.
    """
    law, held = law_and_held(scene)
    model = Model(law, tuple(sorted(held.items())), scene.model.wall, scene.model.solver)
    if "beta" in held:
        raise UsageError("model.parameters.beta: a campaign fits the friction ratio: leave it out here")
    if recorded:
        return model
    if scene.model.base_harmonics > 1:
        raise UsageError(
            f"model.base_harmonics = {scene.model.base_harmonics}: rows of measurements hold no harmonics, so without"
            " recordings a campaign predicts with a pure cosine base: leave it out, or put the recordings beside them"
        )
    if model.open_ones:
        raise UsageError(
            f"law {law.name}: rows of measurements tell the friction ratio alone: put the recordings beside them, or"
            f" hold the law's other parameters fixed in [model.parameters]: {', '.join(model.open_ones)}"
        )
    return model


@dataclass(frozen=True)
class PredictedState:
    """A predicted steady state: ``energy`` (k Y^2 per cycle), ``amplitude`` (Y), ``stops`` per cycle.

    ``memory``: what is left of a disturbance after one cycle, the modulus of the Floquet multiplier (1: it never dies).
    """

    energy: float
    amplitude: float
    stops: float
    memory: float


@lru_cache(maxsize=65536)
def predict(model: Model, r: float, beta: float, base: Base = COSINE) -> PredictedState | None:
    """The steady state at (r, beta), or None where there is none (unbounded, or not found)."""
    try:
        state = steady_state(model.problem(r, beta, base), solver=model.solver)
    except SimulationError:
        return None
    if state.energy_per_cycle is None or state.response_amplitude is None:
        return None
    multiplier = state.floquet_multiplier
    memory = abs(multiplier) ** (1.0 / max(state.period_cycles or 1, 1)) if multiplier is not None else 0.0
    return PredictedState(state.energy_per_cycle, state.response_amplitude, state.stops_per_cycle or 0.0, memory)


@dataclass(frozen=True)
class Local:
    """A prediction with its slopes: ``by_beta`` and ``by_r``, each (2,) for energy and amplitude."""

    here: PredictedState
    by_beta: FloatArray
    by_r: FloatArray


def local(model: Model, r: float, beta: float, base: Base = COSINE) -> Local | None:
    """Prediction and central differences at (r, beta); None where a neighbour has no steady state."""
    h, g = STEP * beta, STEP * r * min(1.0, max(abs(r - 1.0), 0.02))
    points = [predict(model, *p, base) for p in ((r, beta), (r, beta - h), (r, beta + h), (r - g, beta), (r + g, beta))]
    if any(p is None for p in points):
        return None
    here, low, high, slow, fast = (p for p in points if p is not None)
    return Local(here, (_pair(high) - _pair(low)) / (2 * h), (_pair(fast) - _pair(slow)) / (2 * g))


def _pair(prediction: PredictedState) -> FloatArray:
    return np.array([prediction.energy, prediction.amplitude])


@dataclass(frozen=True)
class Curve:
    """The model's prediction over frequency of one friction ratio; arrays (n,), nan where there is no steady state."""

    material: str
    normal_force_n: float
    friction_ratio: float
    r: FloatArray
    energy: FloatArray
    stops: FloatArray


def curve(model: Model, material: str, normal_force_n: float, beta: float, r: FloatArray) -> Curve:
    """Predict one friction ratio over frequency ratios."""
    states = [predict(model, float(value), beta) for value in r]
    energy = np.array([math.nan if s is None else s.energy for s in states])
    stops = np.array([math.nan if s is None else s.stops for s in states])
    return Curve(material, normal_force_n, beta, r, energy, stops)


MODEL_FLOOR = 0.002  # relative: no model is better than this
RATIO_FLOOR = 0.0005  # relative: of a frequency ratio where nobody tells how well the natural frequency is known
GAIN = "gain and linearity of the sensors"
LAG = "lag between the channels"
CROSSTALK = "crosstalk"
FREQUENCY = "natural frequency"
SIGNED = (GAIN, FREQUENCY)  # the others turn their sign from test to test, nobody knows how: their worst is taken
RIG = (GAIN, LAG, CROSSTALK, FREQUENCY)


@dataclass(frozen=True)
class Own:
    """What one test says: ``step`` from the present friction ratio to its own.

    ``error``: its own standard error, with misfit; ``whole``: with the shared sources, as it weighs; ``misfit``: by
    which factor energy and amplitude contradict each other beyond their errors, at least 1; ``shifts``: of the step by
    one standard uncertainty of each shared source.
    """

    step: float
    error: float
    whole: float
    misfit: float
    shifts: Mapping[str, float]

    def scaled(self, factor: float) -> "Own":
        """The same for a friction ratio in another unit."""
        shifts = {source: shift * factor for source, shift in self.shifts.items()}
        return Own(self.step * factor, self.error * factor, self.whole * factor, self.misfit, shifts)


def own_estimate(trial: Trial, here: Local, sources: Sources | None) -> Own | None:
    """Generalized least squares of energy and amplitude; None where neither tells the friction ratio."""
    measured = np.array(trial.mean)
    noise = np.diag(np.hypot(trial.mean_se, MODEL_FLOOR * measured) ** 2)
    shared = _moved(trial, here, sources)
    floor = 0.0 if shared[FREQUENCY].any() else RATIO_FLOOR * trial.r
    noise += np.outer(here.by_r, here.by_r) * math.hypot(trial.frequency_ratio_se or 0.0, floor) ** 2
    weight = np.linalg.inv(noise + sum(np.outer(v, v) for v in shared.values()))
    information = float(here.by_beta @ weight @ here.by_beta)
    if not information > 0.0:
        return None
    gain = here.by_beta @ weight / information
    gap = measured - np.array([here.here.energy, here.here.amplitude])
    step = float(gain @ gap)
    left = gap - here.by_beta * step
    misfit = math.sqrt(max(1.0, float(left @ weight @ left)))
    error = misfit * math.sqrt(float(gain @ noise @ gain))
    shifts = {source: float(gain @ v) for source, v in shared.items()}
    return Own(step, error, math.hypot(error, *shifts.values()), misfit, shifts)


def _moved(trial: Trial, here: Local, sources: Sources | None) -> dict[str, FloatArray]:
    """What one standard uncertainty of each shared source does to energy and amplitude (2,).

    What moves both alike is a gain; what is left of the energy's uncertainty a lag, of the amplitude's a crosstalk.
    """
    energy, amplitude = trial.mean
    of_energy, of_amplitude = _relative(trial, sources)
    both = min(of_energy, of_amplitude)
    return {
        GAIN: both * np.array([energy, amplitude]),
        LAG: np.array([energy * math.sqrt(of_energy**2 - both**2), 0.0]),
        CROSSTALK: np.array([0.0, amplitude * math.sqrt(of_amplitude**2 - both**2)]),
        FREQUENCY: -here.by_r * _ratio_uncertainty(trial, sources),
    }


def _relative(trial: Trial, sources: Sources | None) -> tuple[float, float]:
    """Relative uncertainty of energy and amplitude: as measured, else from the scene with the worst that a lag does."""
    of_energy, of_amplitude = trial.systematic
    gain = 0.0 if sources is None else math.hypot(sources.gain, sources.linearity)
    late = 0.0
    if sources is not None and math.isfinite(trial.drive_frequency_hz):
        energy, amplitude = trial.mean
        late = math.pi * amplitude / energy * 2.0 * math.pi * trial.drive_frequency_hz * sources.lag
    return (
        math.hypot(gain, late) if of_energy is None else of_energy,
        gain if of_amplitude is None else of_amplitude,
    )


def _ratio_uncertainty(trial: Trial, sources: Sources | None) -> float:
    ratio = trial.ratio
    if ratio.u is not None:
        return math.sqrt(max(ratio.u**2 - (ratio.se or 0.0) ** 2, 0.0))
    return 0.0 if sources is None else sources.natural_frequency * trial.r


def pooled_shifts(shifts: Iterable[Mapping[str, float]], weight: FloatArray) -> dict[str, float]:
    """Shifts of a weighted mean: with their signs where these are known, else as if all tests moved the same way."""
    each, share = list(shifts), weight / weight.sum()
    found = {}
    for source in RIG:
        moved = np.array([s.get(source, 0.0) for s in each])
        found[source] = float(share @ (moved if source in SIGNED else np.abs(moved)))
    return found
