"""A test that is only planned, as a fit would see it: its mean cycle, and cycles that scatter as they are expected to.

The plan counts what a fit counts: each candidate becomes an observation of the inference, built by the same function as
a measured one, and what it would say of the unknowns is the information that the posterior of a fit states.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measurement import Cycle, Measurement
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError, SimulationError
from frictionlab.inference.fit import Fit, Model, Place, Test
from frictionlab.inference.observations import CycleObservation, harmonics_of, observe, parts
from frictionlab.inference.posterior import Posterior, model_of, posterior_of
from frictionlab.inference.unknowns import Unknown, factor
from frictionlab.planning.candidates import Candidate, Laboratory
from frictionlab.simulator import Problem, SteadyState, steady_state
from frictionlab.uncertainty import Sources

POINTS = 512  # of a virtual cycle
HARMONICS = 64
MOST_CYCLES = 60  # drawn of a test: more cycles scatter like these
STEP = 1e-3  # relative change of the friction by which the scatter from cycle to cycle is drawn
HOUR = 3600.0


@dataclass(frozen=True)
class Used:
    """Which cycles a mean is of."""

    used: NDArray[np.bool_]


@dataclass(frozen=True)
class VirtualMeasurement:
    """What a fit asks of a measurement, of a test that has not been made."""

    source: str
    material: str | None
    normal_force_n: float
    sampling_rate_hz: float
    frequency_ratio: float
    drive_frequency_hz: float
    base_amplitude_m: float
    base_amplitude_m_se: float
    mass_noise_m: float
    response_amplitude: float
    energy_per_cycle: float
    regime: str
    sources: Sources
    cycle: Cycle
    series: Used


@dataclass(frozen=True)
class VirtualTest:
    """One candidate under the laboratory's law: its steady state, and what a fit of it alone would state.

    ``held``: with sensors and rig as they are known, as standard errors are told.
    ``information`` (m, m): on the coordinates that all candidates share; None where it says nothing.
    """

    candidate: Candidate
    state: SteadyState | None
    observation: CycleObservation | None
    posterior: Posterior | None
    held: Posterior | None
    information: FloatArray | None

    @property
    def response_m(self) -> float:
        """Half the swing of the mass, m; nan where there is no steady state."""
        amplitude = None if self.state is None else self.state.response_amplitude
        return math.nan if amplitude is None else amplitude * self.candidate.base_amplitude_m


@dataclass(frozen=True)
class Reference:
    """The middle of the candidates, in whose units shared values are told: Y (m), omega (rad/s), normal force (N)."""

    amplitude: float
    turn: float
    force: float


def reference_of(lab: Laboratory, candidates: Sequence[Candidate]) -> Reference:
    """Return the geometric middle of the candidates' amplitudes, frequencies and forces."""

    def middle(values: Sequence[float]) -> float:
        return math.sqrt(min(values) * max(values))

    r = middle([c.frequency_ratio for c in candidates])
    return Reference(
        middle([c.base_amplitude_m for c in candidates]),
        2.0 * math.pi * r * lab.natural_frequency_hz,
        middle([c.normal_force_n for c in candidates]),
    )


def values_in(lab: Laboratory, reference: Reference, candidate: Candidate) -> dict[str, float]:
    """Return the law's parameters as they are expected in one test, dimensionless there."""
    turn = 2.0 * math.pi * candidate.frequency_ratio * lab.natural_frequency_hz
    length, rate = candidate.base_amplitude_m / reference.amplitude, turn / reference.turn
    values = {}
    for p in lab.law.own:
        if p.name == "beta":
            force = lab.coefficient[0] * candidate.normal_force_n
            values["beta"] = lab.held.get("beta", force / (lab.stiffness_n_per_m * candidate.base_amplitude_m))
        else:
            values[p.name] = lab.expected[p.name] * length**-p.lengths * rate**-p.rates
    return values


def problem_of(lab: Laboratory, reference: Reference, candidate: Candidate, friction: float = 1.0) -> Problem:
    """Return what is simulated for a test; ``friction``: times the friction that is expected."""
    values = values_in(lab, reference, candidate)
    beta = values.pop("beta") * friction
    frame = lab.held.get("frame_damping_ratio", 0.0)
    wall = lab.scene.model.wall
    r = candidate.frequency_ratio
    return Problem(r, beta, wall=wall, law=lab.law, parameters=values, frame_damping_ratio=frame)


def virtual_test(lab: Laboratory, reference: Reference, candidate: Candidate) -> VirtualTest:
    """Return what a test would show, and what a fit of it alone would state at the values that are expected."""
    state = _state(problem_of(lab, reference, candidate))
    nothing = VirtualTest(candidate, state, None, None, None, None)
    if state is None or state.orbit is None or state.outcome != "periodic" or _may_stand(lab, reference, candidate):
        return nothing
    cycles = cycles_of(lab, candidate)
    varied = _state(problem_of(lab, reference, candidate, 1.0 + STEP))
    if cycles < 1 or varied is None or varied.orbit is None:
        return nothing
    observation = _observation(lab, candidate, state, varied, cycles)
    values = values_in(lab, reference, candidate)
    try:
        held, whole = (_expected(model_of([observation], rig=rig), values) for rig in (False, True))
    except (AnalysisError, np.linalg.LinAlgError):
        return nothing
    law = np.array([u.law for u in whole.unknowns])
    se = np.zeros(len(law))
    se[law] = np.sqrt(np.diag(held.covariance))
    posterior = replace(whole, held_se=se)
    return VirtualTest(candidate, state, observation, posterior, held, _shared(lab, reference, candidate, posterior))


def cycles_of(lab: Laboratory, candidate: Candidate) -> int:
    """Return the full cycles after the transient."""
    settled = candidate.duration_s - lab.scene.analysis.planned_transient_s
    return int(max(settled, 0.0) * candidate.frequency_ratio * lab.natural_frequency_hz)


def _state(problem: Problem) -> SteadyState | None:
    try:
        return steady_state(problem)
    except SimulationError:
        return None


def _may_stand(lab: Laboratory, reference: Reference, candidate: Candidate) -> bool:
    """Whether the mass would stand if friction were one standard error higher: then a test may say nothing."""
    value, error = lab.coefficient
    problem = problem_of(lab, reference, candidate, 1.0 + error / value)
    return problem.mu * problem.beta >= problem.force_size


def _lines(state: SteadyState) -> NDArray[np.complex128]:
    """Harmonics (K,) of a steady motion, the mean over its period."""
    periods = state.period_cycles or 1
    tau = 2.0 * np.pi * np.arange(POINTS * periods) / POINTS
    motion = np.zeros(POINTS * periods) if state.orbit is None else state.orbit.at(tau)[0]
    return harmonics_of(motion.reshape(periods, POINTS).mean(axis=0), HARMONICS)


def _observation(
    lab: Laboratory, candidate: Candidate, state: SteadyState, varied: SteadyState, cycles: int
) -> CycleObservation:
    """The test as `observe` makes it of a measurement: cycles drawn with the noise and scatter that `[plan]` says."""
    plan, drive = lab.scene.plan, candidate.frequency_ratio * lab.natural_frequency_hz
    samples = plan.sampling_rate_hz / drive
    noise = math.sqrt(plan.noise_m**2 + plan.step_m**2 / 12.0)
    mean, by_friction = _lines(state), (_lines(varied) - _lines(state)) / STEP
    generator = np.random.default_rng([len(lab.law.name), round(1e4 * candidate.frequency_ratio), cycles])
    count = min(cycles, MOST_CYCLES)
    white = math.sqrt(2.0 / samples) * noise / candidate.base_amplitude_m
    drawn = generator.standard_normal((count, 1))
    friction = plan.cycle_scatter * (drawn - drawn.mean()) / (drawn.std(ddof=1) if count > 1 else 1.0)
    each = mean + friction * by_friction
    each = each + white * (generator.standard_normal(each.shape) + 1j * generator.standard_normal(each.shape))
    tau = 2.0 * np.pi * np.arange(POINTS) / POINTS
    shown = (np.exp(1j * np.outer(tau, np.arange(1, HARMONICS + 1))) @ mean).real
    first = np.eye(1, 9)[0]
    cycle = Cycle(tau, shown, np.cos(tau), shown, np.zeros(POINTS), first, 0.0 * first, each, np.ones(POINTS // 2))
    used = np.ones(cycles, dtype=bool)
    base_se = noise * math.sqrt(2.0 / (samples * cycles))
    virtual = VirtualMeasurement(
        f"N{candidate.normal_force_n:g}_r{candidate.frequency_ratio:g}",
        lab.scene.experiment.material,
        candidate.normal_force_n,
        plan.sampling_rate_hz,
        candidate.frequency_ratio,
        drive,
        candidate.base_amplitude_m,
        base_se,
        noise,
        state.response_amplitude or 0.0,
        state.energy_per_cycle or 0.0,
        state.regime or "continuous",
        lab.sources,
        cycle,
        Used(used),
    )
    found = observe(cast("Measurement", virtual), lab.scene, lab.law)
    missed = plan.model_error**2 * float(np.mean(parts(mean) ** 2)) / found.powers
    return replace(found, held=dict(lab.held), missed=missed)


def _expected(model: Model, values: Mapping[str, float]) -> Posterior:
    """The posterior of one test's fit that ends where it is expected to: nothing is left of the cycle."""
    point = np.clip(np.array([u.at(values[u.name]) if u.law else 0.0 for u in model.unknowns]), *model.bounds)
    local = np.zeros(len(model.tests[0].index))
    own = model.own(0, point, local)
    residual = np.zeros(len(model.tests[0].observation.data))
    place = Place(point, (local,), (residual,), (model.slopes(0, own),), model.strains(point))
    return posterior_of(Fit(model, place))


def _shared(lab: Laboratory, reference: Reference, candidate: Candidate, posterior: Posterior) -> FloatArray:
    """What a test says of the coordinates that all candidates share: its own, scaled by powers of Y, omega and N."""
    times = factors(lab, reference, candidate, posterior.unknowns)
    return np.asarray(posterior.information[0] * np.outer(times, times))


def factors(lab: Laboratory, reference: Reference, candidate: Candidate, unknowns: Sequence[Unknown]) -> FloatArray:
    """Return the change of a test's own coordinates with the shared ones (m,)."""
    turn = 2.0 * math.pi * candidate.frequency_ratio * lab.natural_frequency_hz
    scales = {
        "length": candidate.base_amplitude_m / reference.amplitude,
        "rate": turn / reference.turn,
        "force": candidate.normal_force_n / reference.force,
    }
    times = [1.0 if u.scale == "log" else factor(u, lab.law, **scales) for u in unknowns]
    return np.array(times)


def between_tests(lab: Laboratory, unknowns: Sequence[Unknown], beta: float, duration_s: float) -> FloatArray:
    """Return the scatter (m,) of the coordinates from test to test: friction that differs, and drifts on the way."""
    plan = lab.scene.plan
    relative = math.hypot(plan.repeatability, 0.5 * plan.drift_per_hour * duration_s / HOUR)
    return np.array([relative * beta / u.slope(u.at(beta)) if u.name == "beta" else 0.0 for u in unknowns])


def together(tests: Sequence[VirtualTest], scatter: Mapping[str, float], *, rig: bool = True) -> Posterior:
    """Return what some tests would state together; ``scatter``: relative, of unknowns from test to test.

    ``rig``: whether sensors and rig are unknown too, or as they are known.
    """
    observations = [t.observation for t in tests if t.observation is not None]
    model = model_of(observations, rig=rig)
    known = [p for t in tests if (p := t.posterior if rig else t.held) is not None]
    first = known[0]
    values = first.values(0)
    point = np.array([u.at(values[u.name]) if u.law else 0.0 for u in model.unknowns])
    widths = np.array(
        [
            scatter.get(u.name, 0.0) * values.get(u.name, 0.0) / u.slope(float(c)) if u.law else 0.0
            for u, c in zip(model.unknowns, point, strict=True)
        ]
    )
    places = [p.fit.place for p in known]
    tests_of: Sequence[Test] = model.tests
    slopes = tuple(
        place.slopes[0] * _own_by_shared(model, test, p) for place, test, p in zip(places, tests_of, known, strict=True)
    )
    information = tuple(
        p.information[0] * np.outer(_own_by_shared(model, test, p), _own_by_shared(model, test, p))
        for test, p in zip(tests_of, known, strict=True)
    )
    residual = tuple(np.zeros(len(place.residual[0])) for place in places)
    local = tuple(np.zeros(len(test.index)) for test in tests_of)
    scattered = replace(model, scatter=widths)
    place = Place(point, local, residual, slopes, model.strains(point))
    return Posterior(Fit(scattered, place), information, np.zeros(len(model.unknowns)))


def _own_by_shared(model: Model, test: Test, single: Posterior) -> FloatArray:
    """Change of a single test's coordinates with those of a model of several, in the single test's order."""
    shared = [model.unknowns[k] for k in test.index]
    return np.array(
        [
            1.0 if u.scale == "log" else float(times) * u.sd / own.sd
            for u, own, times in zip(shared, single.unknowns, test.factors, strict=True)
        ]
    )
