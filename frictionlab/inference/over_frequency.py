"""A law fitted to a table over frequency: amplitude and phase of the mass at several drives, as one observation."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.signals import student
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError, FrictionlabError, UsageError
from frictionlab.estimate import Estimate
from frictionlab.inference.compare import AUTO, caveats, friction_of, model_words
from frictionlab.inference.comparison import Comparison, OverFrequency
from frictionlab.inference.diagnose import strained_facts
from frictionlab.inference.fit import Fit, Model, Test, fit_from, start_place
from frictionlab.inference.observation import Observation, Reached, Values
from frictionlab.inference.observations import harmonics_of, law_and_held, prepare, steady
from frictionlab.inference.posterior import EXPLAINED, Posterior, of_one_test, posterior_of
from frictionlab.inference.unknowns import Unknown, factor, of_law, of_rig
from frictionlab.recording import FrequencyTable
from frictionlab.scene import Scene
from frictionlab.simulator import Problem, SteadyState
from frictionlab.simulator.laws import Law
from frictionlab.simulator.meter import Meter
from frictionlab.simulator.problem import Wall
from frictionlab.uncertainty import Sources, sources_of

SEEN = ("natural_frequency", "gain", "lag_s", "frame_damping_ratio")  # what a table over frequency tells of the rig
UNIT = "base_amplitude"
TRIED = np.geomspace(0.02, 2.0, 14)  # friction ratios to begin from
POINTS = 128  # of a simulated cycle
STEP = 1e-4  # of a prior's standard deviation: finite differences
LEAST = 1e-6  # of an amplitude, or rad: the error of a number whose error is not stated, before the scatter is known
RUNS = 40.0  # predictions of one fit, about
CURVE = 200  # points of the predicted curve
ALONE = 1e12  # Hz: a table has no sampling interval, so no lag that nobody declared


@dataclass(frozen=True)
class TableObservation(Observation):
    """A table under a law: unknowns -> amplitudes (Y), then phases (rad) that would be measured.

    ``r``, ``r_u``, ``amplitude``, ``amplitude_u``, ``phase``, ``phase_u`` (n,), NaN where there is none; ``lengths``
    (n,): Y of each row over that of the reference; ``unit``: Y of the reference, m (NaN where it is not known), to a
    factor that is fitted where it `is_free`; ``turn``: natural frequency, rad/s (NaN). Shares of a number's size,
    squared: ``scatter`` in place of an error that is not stated, ``missed`` what the law misses beside the error.
    """

    r: FloatArray
    r_u: FloatArray
    amplitude: FloatArray
    amplitude_u: FloatArray
    phase: FloatArray
    phase_u: FloatArray
    lengths: FloatArray
    unit: float
    turn: float
    law: Law
    held: Values
    wall: Wall
    sources: Sources
    is_free: bool = False
    material: str | None = None
    scatter: float = 0.0
    missed: float = 0.0
    steps: ClassVar = (STEP, -STEP)
    steepness: FloatArray | None = None
    """Change (N,) of what is fitted with the logarithm of r, where the errors of r count."""

    @cached_property
    def there(self) -> NDArray[np.intp]:
        """Which of all amplitudes, then phases (2 n,), were measured."""
        return np.flatnonzero(np.isfinite(np.concatenate((self.amplitude, self.phase))))

    @property
    def data(self) -> FloatArray:
        """What is fitted (N,)."""
        return np.concatenate((self.amplitude, self.phase))[self.there]

    @cached_property
    def sizes(self) -> FloatArray:
        """What errors are relative to (N,): the amplitude itself, one radian."""
        return np.concatenate((np.abs(self.amplitude), np.ones(len(self.r))))[self.there]

    @cached_property
    def noise(self) -> FloatArray:
        """Standard uncertainties (N,), that of r included."""
        stated = np.concatenate((self.amplitude_u, self.phase_u))[self.there]
        noise = np.where(np.isfinite(stated), stated, math.sqrt(self.scatter) * self.sizes)
        if self.steepness is not None:
            relative = np.nan_to_num(np.tile(self.r_u / self.r, 2)[self.there])
            noise = np.hypot(noise, self.steepness * relative)
        return np.maximum(noise, LEAST * self.sizes)

    @property
    def is_stated(self) -> bool:
        """Whether the table states the error of every number."""
        return bool(np.isfinite(np.concatenate((self.amplitude_u, self.phase_u))[self.there]).all())

    @cached_property
    def sd(self) -> FloatArray:
        """Standard deviations (N,) that numbers count with."""
        return np.hypot(self.noise, math.sqrt(self.missed) * self.sizes)

    @property
    def variances(self) -> FloatArray:
        """Of the noise (N,)."""
        return self.noise**2

    @property
    def powers(self) -> FloatArray:
        """Squares (N,) of what errors are relative to."""
        return self.sizes**2

    @property
    def reference(self) -> int:
        """The row whose dimensionless parameters are reported: that of the middle frequency."""
        return int(np.argsort(self.r)[len(self.r) // 2])

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of sensors and rig."""
        swing = float(np.nanmedian(self.amplitude)) if np.isfinite(self.amplitude).any() else 1.0
        unit = self.unit if math.isfinite(self.unit) else 1e-3
        made = of_rig(self.sources, self.held, amplitude=swing, unit=unit, distorted=False)
        seen = [u for u in made if u.name in SEEN and (u.name != "lag_s" or math.isfinite(self.turn))]
        free = Unknown(UNIT, "amplitude of the base", scale="log", known_to=4.0, key="experiment.base_amplitude_m")
        return (*seen, *(free,) * self.is_free)

    @property
    def floor(self) -> float:
        """The rms that the stated errors alone would leave."""
        return float(np.sqrt(np.mean((self.noise / self.sizes) ** 2)))

    def covariance(self, at: Reached) -> FloatArray:
        """Return the covariance (m, m) in the coordinates: few rows tell their scatter badly."""
        freedom = max(1.0, len(at.residual) - float(at.slopes.shape[1]))
        return np.asarray(at.gain @ at.gain.T * (student(freedom) if self.missed or not self.is_stated else 1.0))

    def problem(self, values: Values, row: int | None = None) -> Problem:
        """Return what is simulated in a row (the reference's): the law is the same in N, m and s in all rows."""
        i = self.reference if row is None else row
        return self.at_ratio(values, float(self.r[i]), float(self.lengths[i]))

    def at_ratio(self, values: Values, r: float, length: float = 1.0) -> Problem:
        """Return what is simulated at a frequency ratio, Y in that of the reference."""
        rate, times = r / float(self.r[self.reference]), dict[str, float]()
        for p in self.law.own:
            if not p.whole:
                own = Unknown(p.name, p.words, law=True)
                times[p.name] = factor(own, self.law, length=length, rate=rate, force=1.0)
        return self.simulated(values, r, times=times)

    def shown(self, values: Values, state: SteadyState | None, r: float) -> tuple[float, float]:
        """Return amplitude (Y) and phase (rad) of a state as the sensors would show them; NaN where there are none."""
        if state is None or state.orbit is None or state.response_amplitude is None:
            stuck = state is not None and state.outcome == "stuck"
            return 0.0 if stuck else math.nan, math.nan
        periods = state.period_cycles or 1
        tau = 2.0 * np.pi * np.arange(POINTS * periods) / POINTS
        first = harmonics_of(state.orbit.at(tau)[0].reshape(periods, POINTS).mean(axis=0), 1)[0]
        late = values.get("lag_s", 0.0) * r * self.turn if "lag_s" in values else 0.0
        gain = (1.0 + values.get("gain", 0.0)) * values.get(UNIT, 1.0)
        return gain * state.response_amplitude, -float(np.angle(first)) - late

    def states(self, values: Values) -> Iterator[SteadyState | None]:
        """Yield the steady state of each row; None where there is none."""
        for row in range(len(self.r)):
            try:
                problem = self.problem(values, row)
            except FrictionlabError:
                yield None  # values outside a law's domain are no candidate
                continue
            yield steady(problem, Meter(math.inf))

    def motion(self, values: Values, near: object = None) -> FloatArray | None:  # noqa: ARG002 - rows are cheap
        """Return what would be measured (N,), phases within half a turn of the measured; None without a motion."""
        rows = [self.shown(values, s, r) for s, r in zip(self.states(values), self.r.tolist(), strict=True)]
        made = np.array(rows).T.ravel()[self.there]
        if not np.isfinite(made).all():
            return None
        phases = self.there >= len(self.r)
        off = made[phases] - self.data[phases]
        made[phases] -= 2.0 * np.pi * np.round(off / (2.0 * np.pi))
        return np.asarray(made)

    def seen(self, motion: FloatArray, values: Values) -> FloatArray:  # noqa: ARG002 - `motion` is what sensors show
        """Return what sensors show of the rows, which is how `motion` has them."""
        return motion

    def with_steepness(self, values: Values) -> Self:
        """Return the table whose errors hold those of its r, at some values."""
        if not np.isfinite(self.r_u).any():
            return self
        off = 1e-4
        at, moved = self.predict(values), replace(self, r=self.r * (1.0 + off)).predict(values)
        return self if at is None or moved is None else replace(self, steepness=(moved - at) / off)


def observe_table(table: FrequencyTable, scene: Scene, law: str | None, facts: Mapping[str, Any]) -> TableObservation:
    """Return a table as a fit sees it.

    Raises
    ------
    AnalysisError
        Its frequencies are in Hz and the natural frequency is not known.
    """
    natural = scene.rig.natural_frequency
    if natural is None and not table.is_ratio:
        raise AnalysisError(
            "frequency [Hz]: the natural frequency is not known: give rig.natural_frequency_hz in the scene, or a"
            " column r"
        )
    times = 1.0 if table.is_ratio or natural is None else 1.0 / natural
    known = table.base_amplitude
    if not np.isfinite(known).all():
        known = np.full(len(table), float(facts.get("base_amplitude_m", math.nan)))
    r = table.drive * times
    middle = int(np.argsort(r)[len(r) // 2])
    is_free = table.in_metres and not math.isfinite(known[middle])
    if is_free:  # what it would be without friction, to begin with
        known = np.full(len(r), float(np.nanmedian(table.amplitude * np.abs(1.0 - r**2))))
    unit, over = float(known[middle]), known if table.in_metres else 1.0
    chosen, held = law_and_held(scene, law)
    normal, lag = facts.get("normal_force_n"), scene.sensors.lag_s
    if lag and natural is None:
        raise AnalysisError("sensors.lag_s: what it does to a phase needs rig.natural_frequency_hz: give it")
    return TableObservation(
        r=r,
        r_u=table.drive_u * times,
        amplitude=table.amplitude / over,
        amplitude_u=table.amplitude_u / over,
        phase=table.phase + (2.0 * math.pi * lag * natural * r if lag and natural else 0.0),
        phase_u=table.phase_u,
        lengths=known / unit if math.isfinite(unit) else np.ones(len(r)),
        unit=unit,
        turn=math.nan if natural is None else 2.0 * math.pi * natural,
        law=chosen,
        held=held,
        wall=scene.model.wall,
        sources=sources_of(scene, ALONE, normal_force_n=None if normal is None else float(normal)),
        is_free=is_free,
        material=facts.get("material"),
    )


def compare_table(
    table: FrequencyTable,
    scene: Scene,
    facts: Mapping[str, Any],
    *,
    law: str | None = None,
    friction_ratio: float | None = None,
) -> Comparison:
    """Identify the contact of a table over frequency, predict its rows, and say how they differ.

    Amplitudes are half the swing, phases those of the fundamental, as the exact steady state has them (Den Hartog's
    closed form where the motion is continuous). What a number's ``_u`` is not stated for is taken from the scatter
    about the law, and no verdict is given then.

    Parameters
    ----------
    table : FrequencyTable
    scene : Scene
        ``[rig]``: the natural frequency, and the stiffness for newtons; ``[model]``: the law.
    facts : mapping
        Of the test: ``material``, ``normal_force_n``, ``base_amplitude_m``.
    law : str, optional
        In place of the scene's.
    friction_ratio : float, optional
        Predict with this one instead of identifying it.

    Raises
    ------
    AnalysisError
        Fewer rows than unknowns, or no value tried has a steady state in every row.
    UsageError
        ``law="auto"``: the ladder needs the cycles of a recording.
    """
    if law == AUTO:
        raise UsageError(
            "--law auto: a table over frequency holds no cycles to leave out; do: name laws one by one (--law"
            " coulomb+place) and compare response_nrmse and misfit"
        )
    observation = observe_table(table, scene, law, facts)
    if friction_ratio is not None:
        observation = replace(observation, held={**observation.held, "beta": friction_ratio})
    found = _fitted(observation)
    values, observation = found.values(), _table_of(found)
    states = list(observation.states(values))
    reference = states[observation.reference]
    nrmse = observation.nrmse(found.fit.residual())
    misfit = nrmse / observation.floor if observation.is_stated else None
    verdict = None if misfit is None else "misfit" if misfit > EXPLAINED else "strained"
    if verdict == "strained" and not found.strained:
        verdict = "explained"
    said = [*scene.rig.doubts, *table.said, *strained_facts(found, scene), *found.warnings]
    said += caveats(found, found.parameters())
    if misfit is None:
        said.append(
            "verdict: none, for the table states no error of some numbers (columns amplitude_u, phase_u): errors are"
            " those of the scatter about the law"
        )
    elif misfit > EXPLAINED:
        said.append(
            f"verdict: {observation.law.name} does not explain this table: what it misses is {misfit:.2g} times the"
            " stated errors; try another --law"
        )
    normal = facts.get("normal_force_n")
    friction = friction_of(
        found, scene, observation.sources, amplitude=_base_amplitude(found, observation), normal_force=normal
    )
    return Comparison(
        source=table.source,
        status="ok",
        reason=None,
        warnings=tuple(said),
        law=observation.law.name,
        parameters={name: asdict(e) for name, e in found.parameters().items()},
        model=model_words(observation.law, f"{observation.wall} wall", observation.held, "cosine base"),
        solver="exact" if reference is None else reference.solver,
        closure_error=max((abs(s.closure_error) for s in states if s is not None and s.closure_error), default=None),
        nuisances=found.nuisances(),
        levels=found.levels(),
        accuracy=scene.accuracy,
        material=observation.material,
        normal_force_n=normal,
        response_nrmse=nrmse,
        response_floor=observation.floor if observation.is_stated else None,
        misfit=misfit,
        verdict=verdict,  # type: ignore[arg-type] # one of the three
        over_frequency=_drawn(observation, values, table, tuple(said)),
        **friction,
    )


def _fitted(observation: TableObservation) -> Posterior:
    """The posterior of a table: errors of r, and the scatter where no error is stated, counted."""
    rig, law = observation.rig_unknowns, list(of_law(observation.law, observation.held))
    rows, wanted = len(observation.there), [*law, *(u for u in rig if u.name == UNIT)]
    if rows <= len(wanted):
        raise AnalysisError(
            f"a table over frequency: expected more numbers than the {len(wanted)} unknowns; got {rows}"
        )
    prepare(observation.law, float(observation.r.min()), RUNS * len(observation.r) * (1 + len(law) + len(rig)))
    if not wanted:
        model = _model(observation, [])
        return posterior_of(Fit(model, start_place(model, np.zeros(0))))
    every = [*law, *rig]
    places = [every.index(u) for u in wanted]
    starts = [np.array([u.at(beta) if u.name == "beta" else max(u.low, 0.0) for u in wanted]) for beta in TRIED]
    held = fit_from(_model(observation, wanted), starts)
    seen = _table_of(held)
    observation = replace(seen, scatter=seen.missed, missed=0.0).with_steepness(held.values())
    held = fit_from(_model(observation, wanted), [held.point])
    start = np.array([max(u.low, 0.0) for u in every])
    start[places] = held.point
    return of_one_test(held, [fit_from(_model(observation, every), [start])], places)


def _model(observation: TableObservation, unknowns: Sequence[Unknown]) -> Model:
    test = Test(observation, np.arange(len(unknowns)), np.ones(len(unknowns)))
    return Model((test,), tuple(unknowns), np.zeros(len(unknowns)))


def _table_of(found: Posterior | Fit) -> TableObservation:
    observation = (found.model if isinstance(found, Fit) else found.fit.model).tests[0].observation
    if not isinstance(observation, TableObservation):
        raise TypeError(f"expected the observation of a table; got {type(observation).__name__}")
    return observation


def _base_amplitude(found: Posterior, observation: TableObservation) -> Estimate:
    """Y of the reference, m: given, fitted, or not known.

    One that is fitted goes with the friction ratio; its error is so large that their product's holds any correlation.
    """
    if not observation.is_free:
        return Estimate(observation.unit, 0.0) if math.isfinite(observation.unit) else Estimate()
    fitted, beta = found.nuisances()[UNIT], found.parameters()["beta"]
    share, own = fitted["u"] / fitted["value"], (beta.u or 0.0) / beta.value if beta.value else 0.0
    value = observation.unit * fitted["value"]
    return Estimate(value, value * share, value * math.sqrt(share**2 + 2.0 * share * own))


def _drawn(
    observation: TableObservation, values: Values, table: FrequencyTable, warnings: tuple[str, ...]
) -> OverFrequency:
    """The rows measured over the curve predicted, Y that of the reference."""
    low, high = float(observation.r.min()), float(observation.r.max())
    ratios = np.linspace(0.95 * low, 1.05 * high, CURVE)
    curve = []
    for r in ratios.tolist():
        state = steady(observation.at_ratio(values, r), Meter(math.inf))
        curve.append(observation.shown(values, state, r))
    amplitude, phase = np.array(curve).T
    columns = (observation.r, observation.amplitude, observation.amplitude_u, observation.phase, observation.phase_u)
    return OverFrequency(table.source, observation.law.name, *columns, ratios, amplitude, phase, warnings)
