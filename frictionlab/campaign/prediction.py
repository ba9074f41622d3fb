"""What the contact law says of a test, and a row of measurements as an observation of the inference.

Where no recording is at hand, the two numbers of a row, energy and amplitude, are what a fit sees of a test. Gain, lag
and natural frequency are unknowns of the rig, as sure as the row's combined uncertainties (else the scene) say.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from frictionlab.arrays import ComplexArray, FloatArray
from frictionlab.campaign.trials import Trial
from frictionlab.errors import UsageError
from frictionlab.inference.comparison import loop_energy
from frictionlab.inference.observation import Observation, Values, noise_of
from frictionlab.inference.observations import law_and_held
from frictionlab.inference.unknowns import SMALLEST, Unknown, of_law, of_rig
from frictionlab.inference.verdict import model_words
from frictionlab.scene import Scene
from frictionlab.simulator import COSINE, SteadyState
from frictionlab.simulator.laws import Law, law_of
from frictionlab.simulator.problem import Wall
from frictionlab.uncertainty import Sources

COULOMB = law_of("coulomb")
STEP = 0.005  # relative step of differences: wide enough to see past the small steps where a stop appears
MODEL_FLOOR = 0.002  # relative: no model is better than this
RATIO_FLOOR = 0.0005  # relative: of a frequency ratio where nobody says how well the natural frequency is known
FLAT = 30.0  # times: how much wider than its usual range the prior of a friction ratio is


@dataclass(frozen=True)
class Model:
    """The physics of a campaign: a law, ``held`` values of its parameters, by name, and the wall."""

    law: Law = COULOMB
    held: Mapping[str, float] = field(default_factory=dict)
    wall: Wall = "fixed"

    @property
    def open_ones(self) -> list[str]:
        """Parameters of its law that have no value."""
        return [p.name for p in self.law.own if p.name not in self.held and p.name != "beta" and p.default is None]

    @property
    def first(self) -> "Model":
        """That by which rows are fitted: itself, or plain Coulomb friction where it is open or dear."""
        if self.law.is_exact and not self.open_ones:
            return self
        rig = {name: value for name, value in self.held.items() if name == "frame_damping_ratio"}
        return Model(COULOMB, rig, self.wall)

    @property
    def words(self) -> str:
        """The model as a reader would say it."""
        return model_words(self.law, f"{self.wall} wall", self.held, "cosine base")


def model_of(scene: Scene, *, recorded: bool = False) -> Model:
    """The model that a scene switches on, by the same translation as a single comparison's.

    ``recorded``: whether recordings are at hand, whose cycles say more than rows of measurements.

    Raises
    ------
    UsageError
        It asks for what a campaign cannot give: a friction ratio that is held, another solver; or rows of measurements
        cannot: base harmonics, the fit of more than the friction ratio.
    """
    law, held = law_and_held(scene)
    model, solver = Model(law, held, scene.model.wall), scene.model.solver
    if "beta" in held:
        raise UsageError("model.parameters.beta: a campaign fits the friction ratio: leave it out here")
    if solver not in ("auto", "exact"):
        raise UsageError(f"model.solver = {solver}: a campaign takes the exact one: leave it out")
    if recorded:
        return model
    if scene.model.base_harmonics > 1:
        raise UsageError(
            f"model.base_harmonics = {scene.model.base_harmonics}: rows of measurements hold no harmonics, so without"
            " recordings a campaign predicts with a pure cosine base: leave it out, or put the recordings beside them"
        )
    if model.open_ones:
        raise UsageError(
            f"law {law.name}: rows of measurements give the friction ratio alone: put the recordings beside them, or"
            f" hold the law's other parameters fixed in [model.parameters]: {', '.join(model.open_ones)}"
        )
    return model


def loop_ratio(trial: Trial, wall: Wall) -> float:
    """Return E / (4 X), eq. (2.23): friction over k Y of any Coulomb motion with two turns a cycle; nan if unknown."""
    energy, amplitude = trial.mean
    if wall == "base":  # the path is that of mass over base, and the force that drives it r^2 times
        return trial.r**2 * energy / (4.0 * math.hypot(_in_phase(energy, amplitude, trial.r) - 1.0, energy / math.pi))
    return energy / (4.0 * amplitude)


def fundamental(energy: float, amplitude: float, r: float) -> ComplexArray:
    """Return the fundamental (1,) of a motion over a cosine base, by its energy (k Y^2) and amplitude (Y)."""
    return np.array([complex(_in_phase(energy, amplitude, r), -energy / math.pi)])


def _in_phase(energy: float, amplitude: float, r: float) -> float:
    """Part of the motion in phase with the base, Y: it turns its sign at resonance; the other one is E / pi."""
    return math.copysign(math.sqrt(max(amplitude**2 - (energy / math.pi) ** 2, 0.0)), 1.0 - r)


@dataclass(frozen=True, kw_only=True)
class RowObservation(Observation):
    """Energy and amplitude of one test, over what was measured of them (2,), under a law.

    Y is the mean of its group where the row does not say it.

    ``measured``: the two numbers; ``rig``: what is not known of sensors and rig.
    """

    measured: tuple[float, float]
    rig: tuple[Unknown, ...]
    steps: ClassVar = (2e-4, -2e-4)  # of the flat prior's deviation: half a per cent of the friction ratio
    by_sensors: ClassVar = ("gain", "lag_s", "crosstalk")

    @property
    def law_unknowns(self) -> tuple[Unknown, ...]:
        """The friction ratio, the one that rows determine: no prior holds it but one that the scene declares."""
        usual = of_law(self.law, self.held, self.sources.infer)
        wide = {u.name: FLAT for u in usual if u.name not in self.sources.infer.priors}
        return tuple(replace(u, sd=u.sd * (by := wide.get(u.name, 1.0)), scatter=u.scatter / by) for u in usual)

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of sensors and rig."""
        return self.rig

    def motion(self, values: Values, near: object = None) -> SteadyState | None:  # noqa: ARG002 - exact laws need none
        """Return the steady state at some values; None where there is none."""
        state = self.state(values)
        return None if state is None or state.energy_per_cycle is None else state

    def seen(self, motion: SteadyState, values: Values) -> FloatArray:
        """Return energy and amplitude as the sensors show them, over the measured ones (2,).

        A lag turns the cycle, and so moves what is in phase with the base into the loop's area.
        """
        energy, amplitude = motion.energy_per_cycle or 0.0, motion.response_amplitude or 0.0
        gain, late = 1.0 + values.get("gain", 0.0), values.get("lag_s", 0.0) * self.turn if "lag_s" in values else 0.0
        turned = loop_energy(fundamental(energy, amplitude, self.r), COSINE.lines, late)
        shown = gain * np.array([turned, (1.0 + values.get("crosstalk", 0.0)) * amplitude])
        return np.asarray(shown / self.measured)


def observe_row(trial: Trial, model: Model, sources: Sources, beta: float, unit: float) -> RowObservation:
    """Return a row of measurements as a fit sees it; ``beta``: about what its friction ratio is.

    Sensors and rig are as the row's combined uncertainties say, else the scene: what moves both numbers alike is a
    gain; what is left of the energy's uncertainty a lag, of the amplitude's a crosstalk; damping is the scene's. What
    an error of r does to the numbers counts as their noise, so that near resonance the ratio of the two decides.
    """
    of_energy, of_amplitude, of_ratio = trial.systematic
    gain = math.hypot(sources.gain, sources.linearity)
    way = 2.0 * math.pi**2 * trial.drive_frequency_hz * trial.mean[1] / trial.mean[0]  # of a lag of 1 s, at most
    of_energy = math.hypot(gain, way * sources.lag) if of_energy is None else of_energy
    of_amplitude = gain if of_amplitude is None else of_amplitude
    both, detuned = min(of_energy, of_amplitude), sources.natural_frequency if of_ratio is None else of_ratio
    known = (
        ("gain", "gain of a sensor", both, "sensors.gain_error"),
        ("lag_s", "lag between the channels", math.sqrt(of_energy**2 - both**2) / way, "sensors.lag_s"),
        ("crosstalk", "crosstalk", math.sqrt(of_amplitude**2 - both**2), "sensors.crosstalk"),
        ("natural_frequency", "natural frequency", detuned, "rig.natural_frequency_hz"),
    )
    unknown = [Unknown(n, said, sd=sd, key=key) for n, said, sd, key in known]
    every = of_rig(sources, model.held, amplitude=float(trial.mean[1]), unit=unit, distorted=False)
    unknown += [u for u in every if u.name == "frame_damping_ratio"]  # what it takes is in the energy of the loop
    rig = tuple(u for u in unknown if u.sd > SMALLEST and math.isfinite(u.sd))
    noise = np.diag(np.hypot(np.divide(trial.mean_se, trial.mean), MODEL_FLOOR) ** 2)
    row = RowObservation(
        source=trial.source,
        measured=trial.mean,
        guess=beta,
        rig=rig,
        law=model.law,
        held=model.held,
        wall=model.wall,
        material=trial.material,
        normal_force=trial.normal_force_n,
        r=trial.r,
        unit=unit,
        turn=2.0 * math.pi * trial.drive_frequency_hz,
        sources=sources,
        swing=float(trial.mean[1]),
        data=np.ones(2),
        powers=1.0,
        floor=math.sqrt(float(np.mean(np.diag(noise)))),
        **noise_of(noise),
    )
    floor = 0.0 if any(u.name == "natural_frequency" for u in rig) else RATIO_FLOOR
    step = STEP * min(1.0, max(abs(trial.r - 1.0), 0.02))
    ends = [row.predict({"beta": beta, "natural_frequency": side * step}) for side in (-1.0, 1.0)]
    if ends[0] is not None and ends[1] is not None:
        steep = (ends[1] - ends[0]) / (2.0 * step)
        noise = noise + np.outer(steep, steep) * math.hypot((trial.frequency_ratio_se or 0.0) / trial.r, floor) ** 2
    return replace(row, **noise_of(noise))
