"""Measurement + simulator -> identified friction, prediction, difference.

The friction ratio that a measurement holds is first read off its loop: ``E = beta * path`` for any Coulomb steady
state (friction work is the friction force times the distance slid), which is ``beta = E / (4 X)`` for cycles with two
turning points, eq. (2.23). A least-squares fit of the simulated to the measured cycle then refines it. Which physics
the simulation pays for is the scene's ``[model]``.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from frictionlab.analysis.measure import measure
from frictionlab.analysis.measurement import Cycle, Measurement
from frictionlab.errors import AnalysisError, SimulationError, UsageError
from frictionlab.recording import Recording
from frictionlab.scene import Scene, Solver
from frictionlab.simulator import Base, Problem, SteadyState, steady_state

FloatArray = NDArray[np.float64]
ProblemOf = Callable[[float], Problem]
SEARCH = np.geomspace(0.6, 1.6, 21)  # friction ratios tried about the loop's, before the best is refined
BEHIND = ("material", "normal_force_n", "tau", "base", "measured", "predicted")  # fields that are no key of a row


@dataclass(frozen=True)
class Comparison:
    """A measured steady cycle and its prediction; the contract's keys, ``None`` is not known.

    Energies in k Y^2, amplitudes in Y; ``energy_difference`` = predicted / measured - 1; ``response_nrmse``: rms of
    measured minus predicted cycle over the rms of the measured cycle about its mean. ``tau`` (p,) rad from the top of
    the base's fundamental, ``base``, ``measured``, ``predicted`` (p,) in Y stand behind them.
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
    friction_ratio: float
    friction_ratio_se: float | None
    friction_force_n: float | None
    friction_coefficient: float | None
    predicted_energy_per_cycle: float | None
    predicted_response_amplitude: float | None
    predicted_stops_per_cycle: float | None
    predicted_regime: str | None
    energy_difference: float | None
    response_nrmse: float | None
    model: str
    solver: str
    closure_error: float | None
    material: str | None
    normal_force_n: float | None
    tau: FloatArray
    base: FloatArray
    measured: FloatArray
    predicted: FloatArray | None

    def row(self) -> dict[str, object]:
        """The contract's keys alone: a line of JSON or of a table."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in BEHIND}


@dataclass(frozen=True)
class Identified:
    """A friction ratio, its standard error (``None``: was given, or not to be had) and how well it fits (nrmse)."""

    friction_ratio: float
    friction_ratio_se: float | None
    nrmse: float


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
    problem_of = _modelled(measurement, scene)
    found = identify(measurement, problem_of) if friction_ratio is None else Identified(friction_ratio, None, math.nan)
    state = steady_state(problem_of(found.friction_ratio), solver=solver or scene.model.solver)
    return _compared(measurement, scene, found, state)


def _modelled(measurement: Measurement, scene: Scene) -> ProblemOf:
    """The dimensionless problem as a function of the friction ratio, with the physics that the scene names."""
    model, cycle = scene.model, measurement.cycle
    zeta = (scene.rig.damping_ratio or 0.0) if model.damping else 0.0
    harmonics = min(model.base_harmonics, len(cycle.base_cosine))
    base = Base(tuple(cycle.base_cosine[:harmonics].tolist()), tuple(cycle.base_sine[:harmonics].tolist()))
    ratio = measurement.frequency_ratio or math.nan

    def problem_of(friction_ratio: float) -> Problem:
        problem = Problem(ratio, friction_ratio, mu=model.static_ratio, zeta=zeta, wall=model.wall)
        return replace(problem, base=base) if harmonics > 1 else problem

    return problem_of


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


def identify(measurement: Measurement, problem_of: ProblemOf) -> Identified:
    """The friction ratio whose simulated cycle fits the measured one best, in the least-squares sense.

    Raises
    ------
    AnalysisError
        No friction ratio near the one read off the loop has a steady state.
    """
    cycle = measurement.cycle
    guess = loop_friction_ratio(measurement)

    def misfit(friction_ratio: float) -> float:
        predicted = simulated_cycle(problem_of, friction_ratio, cycle.tau)
        return math.inf if predicted is None else _nrmse(cycle, predicted)

    tried = guess * SEARCH
    misfits = np.array([misfit(float(beta)) for beta in tried])
    if not np.isfinite(misfits).any():
        raise AnalysisError(
            f"no friction ratio between {tried[0]:g} and {tried[-1]:g} has a steady state at"
            f" r = {measurement.frequency_ratio:g}: near resonance the motion may have no bound; check the natural"
            " frequency"
        )
    best = int(np.argmin(misfits))
    bounds = (float(tried[max(0, best - 1)]), float(tried[min(len(tried) - 1, best + 1)]))
    refined = minimize_scalar(misfit, bounds=bounds, method="bounded", options={"xatol": 1e-7 * guess})
    beta = float(refined.x)
    return Identified(beta, _fit_error(cycle, problem_of, beta), float(refined.fun))


def loop_friction_ratio(measurement: Measurement) -> float:
    """Friction ratio as energy over path slid: ``E / (4 X)`` for two turning points a cycle, eq. (2.23)."""
    smooth = measurement.cycle.mass_smooth
    path = float(np.abs(np.diff(smooth, append=smooth[:1])).sum())
    return measurement.energy_per_cycle / path


def simulated_cycle(problem_of: ProblemOf, friction_ratio: float, tau: FloatArray) -> FloatArray | None:
    """The simulated steady cycle x/Y at phases tau, shape of tau; ``None`` where there is no moving steady state."""
    try:
        state = steady_state(problem_of(friction_ratio))
    except SimulationError:
        return None  # no motion to compare with: this friction ratio is no candidate
    return None if state.orbit is None else state.orbit.at(tau)[0]


def _nrmse(cycle: Cycle, predicted: FloatArray) -> float:
    """Rms of measured minus predicted, both about their means, over the rms of the measured."""
    difference = cycle.mass - (predicted - predicted.mean())
    return float(np.sqrt(np.mean(difference**2) / np.mean(cycle.mass**2)))


def _fit_error(cycle: Cycle, problem_of: ProblemOf, beta: float) -> float | None:
    """Standard error of the fit: residual over sensitivity, with the points a residual's correlation leaves free."""
    step = 1e-4 * beta
    near = [simulated_cycle(problem_of, beta + sign * step, cycle.tau) for sign in (-1, 0, 1)]
    if near[0] is None or near[1] is None or near[2] is None:
        return None
    slope = (near[2] - near[0]) / (2 * step)
    slope = slope - slope.mean()
    residual = cycle.mass - (near[1] - near[1].mean())
    correlation = float(np.dot(residual, np.roll(residual, 1)) / np.dot(residual, residual))
    inflation = (1 + correlation) / max(1 - correlation, 1e-6)
    return float(np.sqrt(np.mean(residual**2) * inflation / np.dot(slope, slope)))


def _compared(measurement: Measurement, scene: Scene, found: Identified, state: SteadyState) -> Comparison:
    cycle, stiffness = measurement.cycle, scene.rig.stiffness
    predicted = None if state.orbit is None else state.orbit.at(cycle.tau)[0]
    energy = state.energy_per_cycle
    force = None if stiffness is None else found.friction_ratio * stiffness * measurement.base_amplitude_m
    normal = measurement.normal_force_n
    warnings = [*measurement.warnings, *state.warnings]
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
        friction_ratio=found.friction_ratio,
        friction_ratio_se=found.friction_ratio_se,
        friction_force_n=force,
        friction_coefficient=None if force is None or normal is None else force / normal,
        predicted_energy_per_cycle=energy,
        predicted_response_amplitude=state.response_amplitude,
        predicted_stops_per_cycle=state.stops_per_cycle,
        predicted_regime=state.regime,
        energy_difference=None if energy is None else energy / measurement.energy_per_cycle - 1,
        response_nrmse=None if predicted is None else _nrmse(cycle, predicted),
        model=model_words(scene),
        solver=state.solver,
        closure_error=state.closure_error,
        material=measurement.material,
        normal_force_n=normal,
        tau=cycle.tau,
        base=cycle.base,
        measured=cycle.mass,
        predicted=predicted,
    )
