"""The friction ratio that a measured cycle holds, and how sure that is.

It is first read off the loop: ``E = beta * path`` for any Coulomb steady state (friction work is the friction force
times the distance slid), which is ``beta = E / (4 X)`` for cycles with two turning points, eq. (2.23). A least-squares
fit of the simulated to the measured cycle then refines it.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from frictionlab.analysis.measurement import Cycle, Measurement
from frictionlab.errors import AnalysisError, SimulationError
from frictionlab.scene import Scene
from frictionlab.simulator import Base, Problem, steady_state

FloatArray = NDArray[np.float64]
ProblemOf = Callable[[float], Problem]
SEARCH = np.geomspace(0.6, 1.6, 21)  # friction ratios tried about the loop's, before the best is refined
RIVAL = 1.3  # a second friction ratio that fits this much worse, or less, is a rival
VAGUE = 0.1  # relative standard error from which the number is called vague
DETUNED = 1e-3  # relative error of the natural frequency whose effect is told ...
DETUNED_EFFECT = 0.01  # ... if it moves the friction ratio by more than this


@dataclass(frozen=True)
class Identified:
    """A friction ratio, its standard error (``None``: given, or not to be had), how well it fits (nrmse), caveats."""

    friction_ratio: float
    friction_ratio_se: float | None
    nrmse: float
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Sensitivity:
    """How the simulated cycle answers at the friction ratio found: its derivative (p,) by beta, about its mean.

    ``residual`` (p,): measured minus simulated; ``detuning``: change of beta for a relative change of the natural
    frequency, ``None`` where the neighbours have no steady state.
    """

    slope: FloatArray
    residual: FloatArray
    detuning: float | None

    def moved_by(self, change: FloatArray) -> float:
        """Change of the fitted friction ratio when the measured cycle changes by this much (p,)."""
        return float(np.dot(self.slope, change) / np.dot(self.slope, self.slope))


def problem_family(measurement: Measurement, scene: Scene) -> ProblemOf:
    """The dimensionless problem as a function of the friction ratio, with the physics that the scene names."""
    model, cycle = scene.model, measurement.cycle
    zeta = (scene.rig.damping_ratio or 0.0) if model.damping else 0.0
    harmonics = min(model.base_harmonics, len(cycle.base_cosine))
    base = Base(tuple(cycle.base_cosine[:harmonics].tolist()), tuple(cycle.base_sine[:harmonics].tolist()))
    ratio = measurement.frequency_ratio or math.nan

    def problem_of(friction_ratio: float) -> Problem:
        problem = Problem(ratio, friction_ratio, mu=model.static_ratio, zeta=zeta, wall=model.wall)
        return problem.with_base(base) if harmonics > 1 else problem

    return problem_of


def identify(measurement: Measurement, problem_of: ProblemOf) -> Identified:
    """The friction ratio whose simulated cycle fits the measured one best, in the least-squares sense.

    Raises
    ------
    AnalysisError
        The mass stands still, or no friction ratio near the one read off the loop has a steady state.
    """
    cycle = measurement.cycle
    tried = loop_friction_ratio(measurement, problem_of) * SEARCH
    misfits = np.array([misfit(cycle, problem_of, float(beta)) for beta in tried])
    if not np.isfinite(misfits).any():
        raise AnalysisError(
            f"no friction ratio between {tried[0]:g} and {tried[-1]:g} has a steady state at"
            f" r = {measurement.frequency_ratio:g}: near resonance the motion may have no bound; check the natural"
            " frequency"
        )
    minima = [_refined(cycle, problem_of, tried, place) for place in _valleys(misfits)]
    beta, nrmse = min(minima, key=lambda found: found[1])
    rivals = [b for b, fit in minima if fit < RIVAL * nrmse and abs(b / beta - 1) > 0.01]
    return _with_caveats(measurement, problem_of, Identified(beta, None, nrmse), rivals)


def read_off(measurement: Measurement, problem_of: ProblemOf) -> Identified:
    """The friction ratio read off the loop alone, with the errors of its energy and its amplitude; nothing is fitted.

    Raises
    ------
    AnalysisError
        As :func:`loop_friction_ratio`.
    """
    beta = loop_friction_ratio(measurement, problem_of)
    relative = math.hypot(
        measurement.energy_per_cycle_se / measurement.energy_per_cycle,
        measurement.response_amplitude_se / measurement.response_amplitude,
    )
    return Identified(beta, beta * relative, misfit(measurement.cycle, problem_of, beta))


def misfit(cycle: Cycle, problem_of: ProblemOf, friction_ratio: float) -> float:
    """Nrmse of the simulated cycle with this friction ratio; infinite where it has no moving steady state."""
    predicted = simulated_cycle(problem_of, friction_ratio, cycle.tau)
    return math.inf if predicted is None else nrmse_of(cycle, predicted)


def _valleys(misfits: FloatArray) -> list[int]:
    """Indices of the local minima."""
    padded = np.concatenate([[math.inf], misfits, [math.inf]])
    lower = (padded[1:-1] <= padded[:-2]) & (padded[1:-1] < padded[2:])
    return [int(i) for i in np.flatnonzero(lower & np.isfinite(misfits))]


def _refined(cycle: Cycle, problem_of: ProblemOf, tried: FloatArray, place: int) -> tuple[float, float]:
    """Friction ratio and nrmse at the bottom of a valley."""
    bounds = (float(tried[max(0, place - 1)]), float(tried[min(len(tried) - 1, place + 1)]))
    found = minimize_scalar(
        lambda beta: misfit(cycle, problem_of, float(beta)),
        bounds=bounds,
        method="bounded",
        options={"xatol": 1e-7 * float(tried[place])},
    )
    return float(found.x), float(found.fun)


def loop_friction_ratio(measurement: Measurement, problem_of: ProblemOf | None = None) -> float:
    """Friction ratio as energy over the path slid: ``E / (4 X)`` for two turning points a cycle, eq. (2.23).

    With a wall that moves with the base the path is that of mass over base, and the force that drives it r^2 times.

    Raises
    ------
    AnalysisError
        The mass stands still, or takes in no energy.
    """
    if measurement.regime == "stuck":
        raise AnalysisError(
            "no friction ratio: the mass stands still, which tells only that friction is at least the spring's force:"
            " measure with less normal force or more base amplitude"
        )
    if not measurement.energy_per_cycle > 0.0:
        raise AnalysisError(
            f"no friction ratio: the loop's energy is {measurement.energy_per_cycle:.3g} k Y^2; expected more than 0:"
            " are the columns of mass and base the right way round?"
        )
    cycle, slid, force = measurement.cycle, measurement.cycle.mass_smooth, 1.0
    if problem_of is not None and problem_of(0.5).wall == "base":
        base = sum(
            c * np.cos(k * cycle.tau) + s * np.sin(k * cycle.tau)
            for k, (c, s) in enumerate(zip(cycle.base_cosine, cycle.base_sine, strict=True), 1)
        )
        slid, force = slid - base, (measurement.frequency_ratio or math.nan) ** 2
    path = float(np.abs(np.diff(slid, append=slid[:1])).sum())
    return force * measurement.energy_per_cycle / path


def simulated_cycle(problem_of: ProblemOf, friction_ratio: float, tau: FloatArray) -> FloatArray | None:
    """The simulated steady cycle x/Y at phases tau, shape of tau; ``None`` where there is no moving steady state."""
    try:
        state = steady_state(problem_of(friction_ratio))
    except SimulationError:
        return None  # no motion to compare with: this friction ratio is no candidate
    return None if state.orbit is None else state.orbit.at(tau)[0]


def nrmse_of(cycle: Cycle, predicted: FloatArray) -> float:
    """Rms of measured minus predicted, both about their means, over the rms of the measured."""
    difference = cycle.mass - (predicted - predicted.mean())
    return float(np.sqrt(np.mean(difference**2) / np.mean(cycle.mass**2)))


def sensitivity(measurement: Measurement, problem_of: ProblemOf, beta: float) -> Sensitivity | None:
    """Derivatives of the simulated cycle at a friction ratio; ``None`` where its neighbours have no steady state."""
    tau = measurement.cycle.tau
    step = 1e-4 * beta
    below, here, above = (simulated_cycle(problem_of, beta + sign * step, tau) for sign in (-1, 0, 1))
    if below is None or here is None or above is None:
        return None
    slope = _centred(above - below) / (2 * step)
    if not np.any(slope):
        return None
    found = Sensitivity(slope, measurement.cycle.mass - _centred(here), None)
    slower, faster = (simulated_cycle(_detuned(problem_of, sign * 1e-4), beta, tau) for sign in (-1, 1))
    if slower is None or faster is None:
        return found
    return replace(found, detuning=-found.moved_by(_centred(faster - slower) / 2e-4))


def _centred(cycle: FloatArray) -> FloatArray:
    return np.asarray(cycle - cycle.mean())


def _detuned(problem_of: ProblemOf, relative: float) -> ProblemOf:
    """The same family with the natural frequency changed by a small share."""

    def detuned(beta: float) -> Problem:
        problem = problem_of(beta)
        return problem.with_r(problem.r / (1 + relative))

    return detuned


def fit_error(measurement: Measurement, found: Sensitivity) -> float:
    """Standard error of the fitted friction ratio: noise of both sensors, irregular cycles, and what the model misses.

    To first order the fit is linear in the measured cycle, so each source adds its variance: white noise of the mass
    sensor over all samples used; amplitude and phase of the base, which scale and shift the cycle; the share by which
    cycles differ more than noise explains; and a residual beyond the noise, with as many independent points as its
    correlation leaves.
    """
    cycle = measurement.cycle
    used = max(1, int(measurement.series.used.sum()))
    samples = used * measurement.sampling_rate_hz / measurement.drive_frequency_hz
    noise = measurement.mass_noise_m / measurement.base_amplitude_m
    square = float(np.mean(found.slope**2))
    base = measurement.base_amplitude_m_se / measurement.base_amplitude_m
    variance = noise**2 / samples / square
    variance += base**2 * (found.moved_by(cycle.mass_smooth) ** 2 + found.moved_by(cycle.mass_velocity) ** 2)
    index, floor = measurement.irregularity_index, measurement.irregularity_floor
    if index is not None and floor is not None and index > 1.1 * floor:
        variance *= (index / floor) ** 2
    return math.sqrt(variance + _missed(found, noise**2 / used))


def _missed(found: Sensitivity, noise_power: float) -> float:
    """Variance from what the model misses: nothing where the residual is no larger than noise."""
    power = float(np.mean(found.residual**2))
    if power < 2.0 * noise_power:
        return 0.0
    lagged = float(np.dot(found.residual, np.roll(found.residual, 1)) / np.dot(found.residual, found.residual))
    independent = max(2.0, len(found.residual) * (1 - lagged) / (1 + lagged))
    return power / float(np.mean(found.slope**2)) / independent


def _with_caveats(
    measurement: Measurement, problem_of: ProblemOf, found: Identified, rivals: list[float]
) -> Identified:
    """Add the standard error, and say where the number must not be trusted."""
    beta, said = found.friction_ratio, []
    answer = sensitivity(measurement, problem_of, beta)
    error = None if answer is None else fit_error(measurement, answer)
    if error is None:
        said.append("friction_ratio: no standard error: friction a little smaller or larger has no steady state here")
    if rivals:
        told = " and ".join(f"{rival:.4g}" for rival in rivals)
        said.append(f"friction_ratio: not unique: {told} fits nearly as well as {beta:.4g}; its error spans them")
        error = max([error or 0.0, *(abs(rival - beta) for rival in rivals)])
    if error is not None and error > VAGUE * beta:
        said.append(
            f"friction_ratio: known only to {100 * error / beta:.2g} %: at r = {measurement.frequency_ratio:.4g} the"
            " response hardly tells the friction; measure at another frequency"
        )
    effect = 0.0 if answer is None or answer.detuning is None else abs(DETUNED * answer.detuning / beta)
    if effect > DETUNED_EFFECT:
        said.append(
            f"friction_ratio: near resonance it hangs on the natural frequency: 0.1 % there moves it by"
            f" {100 * effect:.2g} %; the standard error does not hold this"
        )
    return replace(found, friction_ratio_se=error, warnings=tuple(said))
