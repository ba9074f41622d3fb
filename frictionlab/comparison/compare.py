"""One measured cycle over its prediction. Which physics the simulation pays for is the scene's ``[model]``."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.accuracy import accuracy_of
from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Measurement
from frictionlab.comparison.identification import Identified, identify, nrmse_of, problem_family, read_off
from frictionlab.errors import AnalysisError, UsageError
from frictionlab.estimate import Estimate, Flat, FlatKnown
from frictionlab.recording import Recording
from frictionlab.scene import Scene, Solver
from frictionlab.schema import COMPARISONS
from frictionlab.simulator import SteadyState, observe, steady_state

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Comparison:
    """A measured steady cycle and its prediction; ``None`` is not known. Energies in k Y^2, amplitudes in Y.

    ``friction`` (the friction ratio), ``force`` (N), ``coefficient`` are estimates, with the contract's keys as flat
    names: ``friction_ratio``, ``friction_ratio_se``, ``friction_ratio_u`` ... All are told in `frictionlab.schema`.
    ``tau`` (p,) rad from the top of the base's fundamental, ``base``, ``measured``, ``predicted`` (p,) in Y stand
    behind them.
    """

    source: str
    status: str
    reason: str | None
    warnings: tuple[str, ...]
    frequency_ratio: float
    energy_per_cycle: float
    response_amplitude: float
    stops_per_cycle: float
    regime: str
    friction: Estimate
    force: Estimate
    coefficient: Estimate
    predicted_energy_per_cycle: float | None
    predicted_response_amplitude: float | None
    predicted_stops_per_cycle: float | None
    predicted_regime: str | None
    energy_difference: float | None
    response_nrmse: float | None
    model: str
    solver: str
    closure_error: float | None
    accuracy: str
    material: str | None
    normal_force_n: float | None
    tau: FloatArray
    base: FloatArray
    measured: FloatArray
    predicted: FloatArray | None
    law: str | None = None
    parameters: Mapping[str, object] | None = None
    response_floor: float | None = None
    misfit: float | None = None
    verdict: str | None = None
    laws: tuple[Mapping[str, object], ...] | None = None
    record_nrmse: float | None = None
    record_energy_difference: float | None = None

    friction_ratio = FlatKnown("friction")
    friction_ratio_se = Flat("friction", "se")
    friction_ratio_u = Flat("friction", "u")
    friction_force_n = Flat("force")
    friction_force_n_se = Flat("force", "se")
    friction_force_n_u = Flat("force", "u")
    friction_coefficient = Flat("coefficient")
    friction_coefficient_se = Flat("coefficient", "se")
    friction_coefficient_u = Flat("coefficient", "u")

    def row(self) -> dict[str, object]:
        """The contract's keys alone: a line of JSON or of a table."""
        return COMPARISONS.row(self)

    def __repr__(self) -> str:
        left = "no prediction" if self.response_nrmse is None else f"nrmse {self.response_nrmse:.2g}"
        said = f", {len(self.warnings)} warnings" if self.warnings else ""
        return f"<Comparison {self.source}: r = {self.frequency_ratio:.4g}, beta {self.friction}, {left}{said}>"


def compare(
    recording: Recording, scene: Scene, *, friction_ratio: float | None = None, solver: Solver | None = None
) -> Comparison:
    """Identify the friction of a recording, predict its steady cycle, and say how they differ.

    Parameters
    ----------
    recording : Recording
    scene : Scene
        ``[rig]`` gives the natural frequency (and stiffness, for newtons), ``[model]`` the physics.
    friction_ratio : float, optional
        Predict with this friction ratio (beta, eq. 2.8) instead of identifying it.
    solver : {"auto", "closed-form", "exact", "thesis"}, optional
        In place of the scene's.

    Raises
    ------
    AnalysisError
        No measurement can be made, or the natural frequency is not known.
    """
    measurement = measure(recording, scene)
    return predict(measurement, scene, friction_ratio=friction_ratio, solver=solver)


def predict(
    measurement: Measurement, scene: Scene, *, friction_ratio: float | None = None, solver: Solver | None = None
) -> Comparison:
    """As :func:`compare`, from a measurement that is already made."""
    if friction_ratio is not None and not (friction_ratio >= 0 and math.isfinite(friction_ratio)):
        raise UsageError(f"friction ratio: expected a number of at least 0; got {friction_ratio:g}")
    if measurement.frequency_ratio is None:
        raise AnalysisError(
            "no frequency ratio: the natural frequency is not known: give rig.natural_frequency_hz in the scene, or"
            " mass_kg and stiffness_n_per_m; `frictionlab free-vibration` measures it"
        )
    problem_of = problem_family(measurement, scene)
    if friction_ratio is None:
        found = (identify if scene.model.identification == "fit" else read_off)(measurement, problem_of)
    else:
        found = Identified(friction_ratio, None, math.nan)
    state = steady_state(problem_of(found.friction_ratio), solver=solver or scene.model.solver)
    return _compared(measurement, scene, found, state)


def model_words(scene: Scene) -> str:
    """The physics that a scene switches on, as words."""
    model = scene.model
    words = ["Coulomb friction", f"{model.wall} wall"]
    if model.static_ratio > 1:
        words.append(f"static ratio {model.static_ratio:g}")
    if model.damping:
        words.append(f"frame damping {scene.rig.damping_ratio:g}")
    words.append(f"{model.base_harmonics} base harmonics" if model.base_harmonics > 1 else "cosine base")
    return ", ".join(words)


def _force(measurement: Measurement, friction: Estimate, stiffness: float | None) -> Estimate:
    """Friction force (N): of friction ratio and base amplitude; the stiffness is taken as exact."""
    base = measurement.base_amplitude
    force = friction.scaled(stiffness).scaled(base.value)
    if force.value is None or friction.relative_se is None or base.relative_se is None:
        return Estimate(force.value)
    return Estimate(force.value, abs(force.value) * math.hypot(friction.relative_se, base.relative_se))


def _compared(measurement: Measurement, scene: Scene, found: Identified, state: SteadyState) -> Comparison:
    cycle, stiffness = measurement.cycle, scene.rig.stiffness
    predicted = None if state.orbit is None else state.orbit.at(cycle.tau)[0]
    seen = observe(state)
    energy = seen.energy_per_cycle
    friction = Estimate(found.friction_ratio, found.friction_ratio_se)
    force, normal = _force(measurement, friction, stiffness), measurement.normal_force_n
    warnings = [*measurement.warnings, *found.warnings, *state.warnings]
    if predicted is None:
        warnings.append(f"no prediction: {state.outcome}")
    return Comparison(
        source=measurement.source,
        status=measurement.status,
        reason=measurement.reason,
        warnings=tuple(warnings),
        frequency_ratio=measurement.frequency_ratio or math.nan,
        energy_per_cycle=measurement.energy_per_cycle,
        response_amplitude=measurement.response_amplitude,
        stops_per_cycle=measurement.stops_per_cycle,
        regime=measurement.regime,
        friction=friction,
        force=force,
        coefficient=force.over(normal),
        predicted_energy_per_cycle=energy,
        predicted_response_amplitude=seen.response_amplitude,
        predicted_stops_per_cycle=seen.stops_per_cycle,
        predicted_regime=seen.regime,
        energy_difference=None if energy is None else energy / measurement.energy_per_cycle - 1,
        response_nrmse=None if predicted is None else nrmse_of(cycle, predicted),
        model=model_words(scene),
        solver=state.solver,
        closure_error=state.closure_error,
        accuracy=accuracy_of(scene),
        material=measurement.material,
        normal_force_n=normal,
        tau=cycle.tau,
        base=cycle.base,
        measured=cycle.mass,
        predicted=predicted,
    )
