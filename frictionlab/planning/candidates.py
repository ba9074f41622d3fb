"""The tests that a laboratory could run, and what a fit of each would state.

A candidate becomes an observation of the inference, built by the function that builds a measured one: its expected mean
cycle, and cycles that scatter as they are expected to. What it would say of the unknowns is the information that the
posterior of a fit states: the plan counts what a fit counts.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from frictionlab.analysis.response import Cycle
from frictionlab.errors import AnalysisError, ParameterError, SceneError, SimulationError
from frictionlab.inference.comparison import harmonics_of
from frictionlab.inference.diagnose import OTHER_CAUSE
from frictionlab.inference.fit import placed
from frictionlab.inference.material_law import COEFFICIENT, MaterialLaw, physical_name
from frictionlab.inference.observation import simulated
from frictionlab.inference.observations import CycleObservation, law_and_held, mean_cycle, of_cycle, parts
from frictionlab.inference.posterior import Posterior, model_of, posterior_of
from frictionlab.inference.starts import point_at
from frictionlab.scene import Scene
from frictionlab.simulator import Problem, SteadyState, steady_state
from frictionlab.simulator.laws import Law, law_of
from frictionlab.uncertainty import Estimate, sources_of

ASSUMED_COEFFICIENT = (0.4, 0.2)  # dry contacts lie about here; said where it is assumed
POINTS = 512  # of a virtual cycle
HARMONICS = 64
CHANGE = 0.75  # of a cycle from the base's top on: cycles are cut there, friction changes at the top
MOST_CYCLES = 60  # drawn of a test: more cycles scatter like these
STEP = 1e-3  # relative change of the friction by which the scatter from cycle to cycle is drawn
EXAMPLES = {"frequency_ratios": [0.3, 0.5, 1.2], "normal_forces_n": [2.5, 5.0], "base_amplitudes_m": [0.0018]}


class Candidate(NamedTuple):
    """One possible test: ``normal_force_n`` N; ``base_amplitude_m`` m; ``duration_s`` s, its transient included."""

    frequency_ratio: float
    normal_force_n: float
    base_amplitude_m: float
    duration_s: float


@dataclass(frozen=True)
class Laboratory:
    """What all candidates share: the rig, the law, and what is known before.

    ``candidates``: all tests that could be run; ``middle``: their geometric middle; ``expected``: the law's parameters
    other than beta, dimensionless there; ``coefficient``: the friction coefficient and its standard
    error; ``known``: what was measured before, by name.
    """

    scene: Scene
    law: Law
    held: Mapping[str, float]
    natural_frequency_hz: float
    stiffness_n_per_m: float
    coefficient: tuple[float, float]
    known: Mapping[str, Estimate]
    expected: Mapping[str, float]
    candidates: tuple[Candidate, ...]
    middle: Candidate
    notes: tuple[str, ...]

    @property
    def free(self) -> tuple[str, ...]:
        """The law's parameters that are to be found, beta first."""
        return tuple(p.name for p in self.law.own if p.name not in self.held and not p.whole)

    @property
    def noise_m(self) -> float:
        """Rms of the noise of one sample, and of the sensor's steps."""
        return math.sqrt(self.scene.plan.noise_m**2 + self.scene.plan.step_m**2 / 12.0)

    def under(self, law: str) -> "Laboratory":
        """The same laboratory with another law in mind; nothing of it is held but the frame's damping."""
        other = law_of(law)
        held = {name: value for name, value in self.held.items() if name == "frame_damping_ratio"}
        return replace(self, law=other, held=held, expected=_expected(self.scene, other, held))

    def values(self, candidate: Candidate) -> dict[str, float]:
        """Return the law's parameters as they are expected in one test, dimensionless there."""
        length = candidate.base_amplitude_m / self.middle.base_amplitude_m
        rate = candidate.frequency_ratio / self.middle.frequency_ratio
        force = self.coefficient[0] * candidate.normal_force_n
        beta = self.held.get("beta", force / (self.stiffness_n_per_m * candidate.base_amplitude_m))
        others = [p for p in self.law.own if p.name != "beta"]
        return {"beta": beta, **{p.name: self.expected[p.name] * length**-p.lengths * rate**-p.rates for p in others}}

    def problem(self, candidate: Candidate, friction: float = 1.0) -> Problem:
        """Return what is simulated for a test; ``friction``: times the friction that is expected."""
        values, wall = self.values(candidate), self.scene.model.wall
        stronger = values | {"beta": values["beta"] * friction}
        return simulated(self.law, self.held, wall, stronger, candidate.frequency_ratio)


def laboratory(scene: Scene, law: str | None = None, measured: MaterialLaw | None = None) -> Laboratory:
    """Return what a scene says of its laboratory, and what the law of its material, ``measured``, knows before.

    The law planned for is the one named, else the scene's, else the measured one. Errors as of `frictionlab.plan`.
    """
    frequency, stiffness, plan = scene.rig.natural_frequency, scene.rig.stiffness, scene.plan
    forces = tuple(plan.normal_forces_n) or tuple(f for f in [scene.experiment.normal_force_n] if f is not None)
    lists = {"frequency_ratios": plan.frequency_ratios, "normal_forces_n": forces}
    lists["base_amplitudes_m"] = plan.base_amplitudes_m
    none = [name for name, values in lists.items() if not values]
    lacking = [
        f"plan.{name}: expected at least one value; got none: list what the rig can set, such as {name} ="
        f" {EXAMPLES[name]}, under [plan] of the scene"
        for name in none
    ]
    if frequency is None or stiffness is None:
        two = "two of natural_frequency_hz, mass_kg and stiffness_n_per_m; a tribometer, which has none, is not planned"
        lacking.insert(0, f"rig: a plan needs natural frequency and stiffness: give {two}")
    if frequency is None or stiffness is None or lacking:
        raise SceneError("\n".join(lacking))
    possible = _candidates(scene, forces)
    middle = Candidate(*(math.sqrt(min(column) * max(column)) for column in zip(*possible, strict=True)))
    notes = list[str]()
    if law is None and "law" not in scene.model.model_fields_set and measured is not None:
        law = measured.law
        notes.append(f"law: {law}, as the law of {measured.material} has it: --law plans another")
    chosen, held = law_and_held(scene, law)
    known, expected = {} if measured is None else known_of(measured, middle), _expected(scene, chosen, held)
    value, error = plan.friction_coefficient or ASSUMED_COEFFICIENT
    if COEFFICIENT in known:
        value, error = known[COEFFICIENT].value or value, known[COEFFICIENT].u or error
    elif plan.friction_coefficient is None:
        notes.append(f"plan.friction_coefficient: not given: {value:g} ± {error:g} is assumed")
    expected |= {name: known[name].value or 0.0 for name in expected if name in known and name not in held}
    return Laboratory(
        scene, chosen, held, frequency, stiffness, (value, error), known, expected, possible, middle, tuple(notes)
    )


def _candidates(scene: Scene, forces: Sequence[float]) -> tuple[Candidate, ...]:
    """All tests of a plan's ranges that are outside the band to avoid."""
    plan, transient = scene.plan, scene.analysis.planned_transient_s
    if plan.duration_s <= transient:
        raise SceneError(
            f"plan.duration_s: {plan.duration_s:g} s are over before the transient (analysis.transient_s ="
            f" {transient:g} s): lengthen the test, or shorten the transient"
        )
    low, high = plan.avoid_frequency_ratios or (math.inf, -math.inf)
    ratios = [r for r in plan.frequency_ratios if not low <= r <= high]
    if not ratios:
        raise SceneError(
            f"plan.avoid_frequency_ratios: {low:g} to {high:g} forbids all of frequency_ratios; give others or a"
            " narrower band"
        )
    points = product(ratios, forces, plan.base_amplitudes_m, [plan.duration_s])
    return tuple(Candidate(*point) for point in points)


def _expected(scene: Scene, law: Law, held: Mapping[str, float]) -> dict[str, float]:
    """The law's parameters other than beta as they are expected: held ones, the scene's, else a first value of each."""
    said, found = {**scene.model.parameters, **scene.plan.expected, **held}, {}
    if "beta" in scene.plan.expected:
        raise SceneError("plan.expected.beta: it follows from friction_coefficient and each test's normal force")
    for p in law.own:
        low, high = p.usual
        try:
            first = p.default if p.name not in scene.plan.expected else p.checked(scene.plan.expected[p.name])
        except ParameterError as error:
            raise SceneError(f"plan.expected.{p.name}: {error}") from error
        middle = math.sqrt(low * high) if p.scale == "log" else 0.5 * (low + high)
        first = (p.expected or middle) if first is None else first
        found[p.name] = said.get(p.name, first)
    del found["beta"]
    return found


def known_of(law: MaterialLaw, middle: Candidate) -> dict[str, Estimate]:
    """Return what the law of a material knows of its parameters, dimensionless in a test; the coefficient by its name.

    Nothing where Amontons' law fails, and so no one coefficient is known before.
    """
    if COEFFICIENT not in law.values:
        return {}
    errors = dict(zip(law.values, np.sqrt(np.diag(law.covariance)).tolist(), strict=True))
    found = {COEFFICIENT: Estimate(law.values[COEFFICIENT], None, errors[COEFFICIENT])}
    problem = law.problem(middle.normal_force_n, middle.base_amplitude_m, middle.frequency_ratio)
    for p in law_of(law.law).own:
        value, physical = problem.parameters[p.name], law.values[physical_name(p)]
        u = abs(errors[physical_name(p)] * value / physical) if physical else 0.0
        found |= {p.name: Estimate(value, None, u)} if u else {}
    return found


@dataclass(frozen=True)
class VirtualTest:
    """One candidate under the laboratory's law: its steady state, and what a fit of it alone would state.

    ``observation``, ``posterior``: None where it says nothing; ``held``: the posterior with sensors and rig as they are
    known.
    """

    candidate: Candidate
    state: SteadyState | None
    observation: CycleObservation | None = None
    posterior: Posterior | None = None
    held: Posterior | None = None

    @property
    def response_m(self) -> float:
        """Half the swing of the mass, m; nan where there is no steady state."""
        amplitude = None if self.state is None else self.state.response_amplitude
        return math.nan if amplitude is None else amplitude * self.candidate.base_amplitude_m


def virtual_test(lab: Laboratory, candidate: Candidate) -> VirtualTest:
    """Return what a test would show, and what a fit of it alone would state at the values that are expected.

    A test whose mass would stand still if friction were one standard error higher says nothing.
    """
    settled = candidate.duration_s - lab.scene.analysis.planned_transient_s
    cycles = int(max(settled, 0.0) * candidate.frequency_ratio * lab.natural_frequency_hz)
    value, error = lab.coefficient
    more = lab.problem(candidate, 1.0 + error / value)
    state = varied = None
    with suppress(SimulationError):
        state = steady_state(lab.problem(candidate))
        varied = steady_state(lab.problem(candidate, 1.0 + STEP))
    found = VirtualTest(candidate, state)
    stands = more.mu * more.beta >= more.force_size
    if state is None or state.orbit is None or state.outcome != "periodic" or stands:
        return found
    if cycles < 1 or varied is None or varied.orbit is None:
        return found
    observation = _observation(lab, candidate, state, varied, cycles)
    plain, model = model_of([observation], rig=False), model_of([observation])
    point, law = point_at(model, lab.values(candidate)), np.array([u.law for u in model.unknowns])
    try:  # of a fit that ends where it is expected to: nothing is left of the cycle
        slopes = model.slopes(0, point)
        left = [np.zeros(len(slopes))]
        held = posterior_of(placed(plain, point[law], left, [slopes[:, law]]))
        whole = posterior_of(placed(model, point, left, [slopes]))
    except (AnalysisError, np.linalg.LinAlgError):
        return found
    se = np.zeros(len(law))
    se[law] = np.sqrt(np.diag(held.covariance))
    return replace(found, observation=observation, posterior=replace(whole, held_se=se), held=held)


def _observation(
    lab: Laboratory, candidate: Candidate, state: SteadyState, varied: SteadyState, cycles: int
) -> CycleObservation:
    """The test as a fit sees a measured one: cycles drawn with the noise and scatter that `[plan]` says."""
    plan, turn = lab.scene.plan, 2.0 * math.pi * candidate.frequency_ratio * lab.natural_frequency_hz
    samples, noise = 2.0 * math.pi * plan.sampling_rate_hz / turn, lab.noise_m / candidate.base_amplitude_m
    mean, more = (harmonics_of(mean_cycle(one, POINTS), HARMONICS) for one in (state, varied))
    by_friction = (more - mean) / STEP
    generator = np.random.default_rng([len(lab.law.name), round(1e4 * candidate.frequency_ratio), cycles])
    count, white = min(cycles, MOST_CYCLES), math.sqrt(2.0 / samples) * noise
    tau = 2.0 * np.pi * np.arange(POINTS) / POINTS
    waves = np.exp(1j * np.outer(tau, np.arange(1, HARMONICS + 1)))
    drawn = generator.standard_normal(count + 1)
    drawn = plan.cycle_scatter * (drawn - drawn.mean()) / drawn.std(ddof=1)
    friction = np.where(tau < 2.0 * np.pi * CHANGE, drawn[:-1, None], drawn[1:, None])
    each = mean + harmonics_of(friction * (waves @ by_friction).real, HARMONICS)
    each = each + white * (generator.standard_normal(each.shape) + 1j * generator.standard_normal(each.shape))
    shown, first = (waves @ mean).real, np.eye(1, 9)[0]
    known = of_cycle(
        Cycle(tau, shown, np.cos(tau), shown, np.zeros(POINTS), first, 0.0 * first, each, np.ones(POINTS // 2)),
        *(Estimate(state.energy_per_cycle), Estimate(state.response_amplitude), state.regime or "continuous"),
        r=candidate.frequency_ratio,
        samples=samples,
        used=cycles,
        noise=noise,
        unit_u=noise * math.sqrt(2.0 / (samples * cycles)),
    )
    return CycleObservation(
        source=f"N{candidate.normal_force_n:g}_r{candidate.frequency_ratio:g}",
        law=lab.law,
        held=lab.held,
        wall=lab.scene.model.wall,
        material=lab.scene.experiment.material,
        normal_force=candidate.normal_force_n,
        unit=candidate.base_amplitude_m,
        turn=turn,
        sources=sources_of(lab.scene, plan.sampling_rate_hz),
        rate=plan.sampling_rate_hz,
        missed=plan.model_error**2 * float(np.mean(parts(mean) ** 2)) / known["powers"],
        **known,
    )


def together(lab: Laboratory, tests: Sequence[VirtualTest], *, rig: bool = True) -> Posterior:
    """Return what tests that say something would state together, in the units of the first.

    Friction differs from test to test by what ``[plan]`` says; ``rig``: whether sensors and rig are unknown too, or as
    they are known.
    """
    known = [p for t in tests if (p := t.posterior if rig else t.held) is not None]
    model = model_of([t.observation for t in tests if t.observation is not None], rig=rig)
    values, repeatability = lab.values(tests[0].candidate), lab.scene.plan.repeatability
    point = point_at(model, values)
    scatter = np.array([
        repeatability * values["beta"] / u.slope(float(c)) if u.name == "beta" else 0.0
        for u, c in zip(model.unknowns, point, strict=True)
    ])  # fmt: skip
    slopes, information, shifts = [], [], []
    for test, own in zip(model.tests, known, strict=True):
        shared = [model.unknowns[k] for k in test.index]
        each = zip(shared, own.unknowns, test.factors.tolist(), strict=True)
        times = np.array([1.0 if u.scale == "log" else factor * u.sd / alone.sd for u, alone, factor in each])
        slopes.append(own.fit.slopes[0] * times)
        information.append(own.information[0] * np.outer(times, times))
        shift = np.zeros(len(point))
        shift[test.index] = np.sqrt(sum(s**2 for s in own.shifts.values()) + np.zeros(len(times))) / times
        shifts.append(shift)
    fit = placed(replace(model, scatter=scatter), point, [np.zeros(len(own)) for own in slopes], slopes)
    found = Posterior(fit, tuple(information), scatter)
    return found.with_shift(OTHER_CAUSE, np.min(shifts, axis=0))  # one rig: the test that shows most of it bounds it
