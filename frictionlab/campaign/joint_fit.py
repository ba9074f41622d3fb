"""The tests of a campaign fitted together by the inference, and what that says of each group and each test.

Tests whose recordings are at hand are fitted by their mean cycles, all materials on one rig; the law of a material is
the scene's, or the top of the ladder that its tests climb together. A material without recordings is fitted by the rows
of its measurements. `JointFit.posterior` has one friction coefficient a material (Amontons' law), `by_force` one
friction ratio at each normal force: one linear step from it, by which Amontons' law is tested.
"""

import math
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import ndtr, stdtrit

from frictionlab.arrays import FloatArray
from frictionlab.campaign.prediction import RowObservation
from frictionlab.campaign.trials import short_name
from frictionlab.inference.diagnose import beside_the_law, named_cause, other_causes, strained_facts
from frictionlab.inference.fit import Fit, scattered, stepped, weighed
from frictionlab.inference.fit import Model as FitModel
from frictionlab.inference.force import ForceObservation
from frictionlab.inference.ladder import NO_DIFFERENCE, NOT_DISTINGUISHED, SPENT, Ladder, climb
from frictionlab.inference.observation import NO_MOTION
from frictionlab.inference.observations import CycleObservation
from frictionlab.inference.posterior import EXPLAINED, Posterior, explains, infer, model_of
from frictionlab.inference.unknowns import STRAINED, Unknown
from frictionlab.inference.verdict import not_tried, start_left
from frictionlab.scene import Scene
from frictionlab.simulator import Problem, SteadyState
from frictionlab.simulator.laws import Law, law_of
from frictionlab.uncertainty import Estimate

OUTLIER = 4.0  # robust standard deviations from which a test stands out ...
FEWEST = 5  # ... among so many tests of its material
KEPT = 0.999  # of a disturbance after a cycle: from so much on a motion is one of many
SLIGHT = 1e-3  # relative: a friction ratio that differs by less does not stand out
MOST_CLIMBED = 16  # tests of a material that climb the ladder: spread over r and force, they decide its law
BY_TWO_NUMBERS = (
    "{}: friction from two numbers of each test (energy and amplitude), for no law could be fitted to their cycles: {}"
)
UNLIKE = "{}: {}{} does not explain all cycles"
VARIES = "; its friction coefficient would be {:.3g} times as large {}, and its error holds the difference"
DO_FIND = ": --law auto finds the law that the tests require"
TURNS = (
    "{}: the gradient changes its sign from test to test ({:+.2g} to {:+.2g} per Y): a contact seated anew between"
    " tests has another one; its scatter is in the bands of predictions"
)
STRAY = 10.0  # times the misfit of any other test of its material: such a test is named
LATE = (
    "{}: the base's channel of this test is {:+.3g} ms behind, that of the tests together {:+.3g} ms: more than {}"
    " allows ({:.2g} ms): check this test's clock; its energies are at its own lag"
)
STRAYS = (
    "{}: its law misses {:.3g} times the noise of {}, and at most {:.2g} times that of any other test: check that"
    " test's normal force ({:g} N), material and base amplitude"
)
AT_LAG = ": measurements.csv has energies at the lag declared, all else at the lag found"
STIFFNESS = "stiffness by the frequency found"  # what adds to errors
SAME = 5e-3  # relative: a friction coefficient that differs by less is not said to
BETTER = 0.5  # of what laws leave of tests that they do not explain: so much a cause may leave at most
FOUND = "Sensors and rig as the tests find them, beside what is known of them: {}."
ONE_WAY = "{}: the contact slides one way at one speed, which shows Coulomb friction alone: no other law is fitted"
CURVE_POINTS, DEAR_POINTS = 160, 16  # of an energy over frequency ratios; of a law that is integrated step by step
Seen = CycleObservation | RowObservation | ForceObservation


@dataclass(frozen=True)
class JointFit:
    """What tests say together.

    ``posterior``: one friction coefficient a material; ``by_force``: one friction ratio at each normal force of a
    material, tests in the same order; ``ladders``: of the materials whose law was looked for; ``out``: tests that stand
    out, by source: their own friction ratio and that of the others; ``causes``: facts of the rig that answer what tests
    leave, each with the fit of tests with it.
    """

    posterior: Posterior
    by_force: Posterior
    ladders: Mapping[str, Ladder] = field(default_factory=dict)
    out: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    causes: tuple[tuple[Unknown, Fit], ...] = ()

    @cached_property
    def place(self) -> Mapping[str, int]:
        """Number of each test by its source."""
        return {observation.source: i for i, observation in enumerate(self.posterior.observations)}

    @cached_property
    def materials(self) -> tuple[str, ...]:
        """The materials fitted, in alphabetical order."""
        return tuple(sorted({str(observation.material) for observation in self.posterior.observations}))

    @property
    def of_rows(self) -> bool:
        """Whether it rests on rows of measurements, and not on mean cycles of motions or forces."""
        return isinstance(self.posterior.observations[0], RowObservation)

    def lag_s(self, i: int | None = None) -> float:
        """By how much the base's channel of test i (None: of any other) is behind, beyond what is declared.

        0 where no fit looked for it: rows keep the energies of the lag declared, for two numbers hardly show one.
        """
        k = None if self.of_rows else self.posterior.fit.find("lag_s")
        if k is None:
            return 0.0
        return self.posterior.shared(k, 0)[0] if i is None else self.posterior.values(i)["lag_s"]

    def tests(self, material: str, normal_force_n: float | None = None) -> list[int]:
        """Return the numbers of a material's tests, under one normal force or all."""
        return [
            i
            for i, observation in enumerate(self.by_force.observations)
            if observation.material == material and normal_force_n in (None, observation.normal_force)
        ]

    def some(self, material: str) -> list[int]:
        """Return the numbers of at most `MOST_CLIMBED` tests of a material, spread over force and frequency ratio."""
        spread_out = _spread_out([self.posterior.observations[i] for i in self.tests(material)])
        return [self.place[observation.source] for observation in spread_out]

    def law(self, material: str) -> Law | None:
        """Return the law that a material's tests were fitted with; None where they were not."""
        tests = self.tests(material)
        return self.posterior.law(tests[0]) if tests else None

    def unit(self, group: tuple[str, float]) -> float:
        """Return the mean base amplitude of a group's tests, m."""
        return float(np.mean([self.posterior.observations[i].unit for i in self.tests(*group)]))

    def problems(self) -> dict[str, tuple[Problem, float]]:
        """Return by source what is simulated for each test, and the phase (rad) by which its base's channel is late."""
        found = {}
        for source, i in self.place.items():
            observation, values = self.posterior.observations[i], self.posterior.values(i)
            found[source] = observation.problem(values), observation.turn * values.get("lag_s", 0.0)
        return found

    def states(
        self, group: tuple[str, float], observation: CycleObservation | RowObservation, times: Iterable[float] = (1.0,)
    ) -> list[SteadyState | None]:
        """Return the steady states of a test, in the fit or not, with the values that all tests of a group share.

        With so many times its friction; None where there is none. Sensors and rig are as they are declared.
        """
        i = self.tests(*group)[0]
        first = self.posterior.observations[i]
        seen, law = observation.under(first.law, first.held), {p.name for p in first.law.parameters}
        known = {name: value for name, value in values_in(seen, self.posterior, i).items() if name in law}
        k = self.by_force.fit.find("beta", i) or 0
        beta = self.by_force.shared(k, i)[0] * first.unit / seen.unit
        found = [seen.state(known | {"beta": beta * each}) for each in times]
        return [None if s is None or s.energy_per_cycle is None or s.response_amplitude is None else s for s in found]

    def curve(
        self, group: tuple[str, float], row: RowObservation, low: float, high: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return the energy (n,) of a group's friction over frequency ratios (n,), nan where there is no steady state.

        They are close at the low end, where the stops change fast. ``row``: one of its tests.
        """
        half = (CURVE_POINTS if self.posterior.law(self.tests(*group)[0]).is_exact else DEAR_POINTS) // 2
        r = np.unique(np.concatenate([np.geomspace(low, high, half), np.linspace(low, high, half)]))
        unit = self.unit(group)
        tests = [replace(row, r=value, turn=row.turn * value / row.r, unit=unit) for value in r.tolist()]
        states = [self.states(group, test)[0] for test in tests]
        return r, np.array([math.nan if state is None else state.energy_per_cycle or 0.0 for state in states])

    def friction(self, material: str, normal_force_n: float) -> Estimate:
        """Return the friction ratio under one normal force, at the mean base amplitude of its tests."""
        i = self.tests(material, normal_force_n)[0]
        given = isinstance(self.posterior.observations[i], ForceObservation)  # over the normal force: the coefficient
        times = 1.0 if given else self.by_force.observations[i].unit / self.unit((material, normal_force_n))
        return self.by_force.estimate("beta", i).scaled(times)

    def coefficient(self, material: str, stiffness: float | None) -> Estimate:
        """Return a material's friction coefficient by all its tests, stiffness and normal forces as they are known."""
        i = self.tests(material)[0]
        observation, ratio = self.posterior.observations[i], self.posterior.estimate("beta", i)
        if isinstance(observation, ForceObservation):
            return ratio
        return ratio.scaled(stiffness).scaled(observation.unit).over(observation.normal_force)

    def rig_notes(self, scene: Scene) -> tuple[str, ...]:
        """Return where the tests find sensors and rig, and which of them are far from what is known.

        Measured energies are those of the declared lag, so one that is found elsewhere is to be declared; not where the
        laws do not explain their tests, for then the rig makes up for what a law lacks.
        """
        posterior, parts, tests = self.posterior, [], range(len(self.posterior.tests))
        for k, u in enumerate(posterior.unknowns):
            if not u.law:
                factor, unit = (u.unit[0], f" {u.unit[1]}") if u.unit[1] else (100.0, " %")
                at = float(posterior.fit.point[k]), math.sqrt(posterior.covariance[k, k]), u.known_to
                value, spread, known = (factor * u.sd * x for x in at)
                parts.append(f"{u.words} {value:+.2g}{unit} ± {spread:.2g}{unit}, known to {known:.2g}{unit}")
        if not parts or len(tests) < 2:
            return ()
        said = [FOUND.format("; ".join(parts)), *(named_cause(*one, posterior, scene) for one in self.causes)]
        if 2 * sum(explains(posterior.fit, [i]) for i in tests) >= len(tests):
            far = strained_facts(posterior, scene)
            said += [f"{one}; then measure again{AT_LAG if 'the lag ' in one else ''}" for one in far]
        return tuple(said)

    def misfit(self, i: int) -> float:
        """Return what the joint fit leaves of test i, over what noise leaves."""
        return self.posterior.fit.nrmse([i]) / float(self.posterior.observations[i].floor)

    def test_notes(self) -> Iterator[str]:
        """Yield tests that are unlike the others of their material.

        One that its law misses far more than all others: a fact of it may be wrong. One whose lag differs from that of
        all by more than is known of it. And whose friction rises along the path in some tests and falls in others,
        beyond twice its error.
        """
        lag = next((u for u in self.posterior.unknowns if u.name == "lag_s"), None)
        if lag is not None:
            common, known = self.lag_s(), lag.sd * lag.known_to
            for source, i in self.place.items():
                if abs((late := self.lag_s(i)) - common) > STRAINED * known:
                    yield LATE.format(source, 1e3 * late, 1e3 * common, f"{lag.key}_u", 1e3 * known)
        for material in self.materials:
            *others, worst = sorted(self.tests(material), key=self.misfit)
            most = max((self.misfit(i) for i in others), default=math.inf)
            if not self.of_rows and len(others) > 1 and self.misfit(worst) > STRAY * max(most, EXPLAINED):
                seen = self.posterior.observations[worst]
                yield STRAYS.format(material, self.misfit(worst), seen.source, most, seen.normal_force or 0.0)
            own = [e for i in self.tests(material) if (e := self.posterior.parameters(i).get("gradient")) is not None]
            if len({e.value > 0.0 for e in own if abs(e.value) > 2.0 * (e.u or math.inf)}) > 1:
                values = [e.value for e in own]
                yield TURNS.format(material, min(values), max(values))


def standing_out(posterior: Posterior) -> dict[str, tuple[float, float]]:
    """Return tests whose friction is far from that of the others of their material: their own and the others'.

    Each one's own friction ratio is one linear step from the shared one, all else as the fit has it.
    """
    found: dict[str, list[tuple[str, float, float, float]]] = {}
    for i, (test, observation) in enumerate(zip(posterior.tests, posterior.observations, strict=True)):
        k, gap, error, shared = posterior.fit.find("beta", i), math.nan, math.nan, math.nan
        if k is not None:
            some = np.array([posterior.unknowns[j].level == "test" or j == k for j in test.index])
            slopes = posterior.fit.slopes[i][:, some]
            at = int(np.flatnonzero(test.index[some] == k)[0])
            covariance = np.linalg.inv(slopes.T @ slopes + 1e-12 * np.eye(slopes.shape[1]))
            step = float((covariance @ slopes.T @ posterior.fit.residuals[i])[at])
            u = posterior.unknowns[k]
            c, shared = max(float(posterior.fit.own(i)[test.place(k)]) + step, u.low), posterior.shared(k, i)[0]
            gap = math.log(u.value(c) * test.factor(k) / shared)
            error = u.slope(c) / u.value(c) * math.sqrt(float(covariance[at, at]))
        found.setdefault(str(observation.material), []).append((observation.source, gap, error, shared))
    out: dict[str, tuple[float, float]] = {}
    for tests in found.values():
        gaps, errors = np.array([test[1:3] for test in tests]).T
        if len(tests) < FEWEST or not np.isfinite(gaps).all():
            continue
        width = 1.4826 * float(np.median(np.abs(gaps - np.median(gaps))))
        limit = float(stdtrit(len(tests) - 1, ndtr(OUTLIER)))  # of few tests the width is known badly
        far = np.abs(gaps - np.median(gaps)) > limit * np.sqrt(errors**2 + max(width, SLIGHT) ** 2)
        out |= {
            source: (beta * math.exp(gap), beta)
            for (source, gap, _, beta), is_far in zip(tests, far, strict=True)
            if is_far
        }
    return out


def fit_together(
    tests: Mapping[str, Sequence[Seen]],
    *,
    find_law: bool,
    accuracy: str,
    doubtful: Container[str] = (),
    forces: Mapping[str, float] = {},
    by_mass: bool = False,
    watch: Callable[[Sequence[Any]], Iterable[Any]] = iter,
) -> tuple[JointFit | None, list[str]]:
    """Fit the tests of all materials together, by their mean cycles or by their rows.

    ``tests``: observations by material, under the scene's law; ``find_law``: the tests of each material climb from
    plain Coulomb friction to theirs; ``accuracy``: of that ladder; ``doubtful``: sources of tests in which Coulomb's
    law has many steady states, which count where the law found has one; ``forces``: normal
    force that each test was set to, where it was measured; ``by_mass``: the frame's stiffness is that of
    its mass and natural frequency; ``watch``: wraps the materials. Returns the joint fit (None where there is nothing
    to fit), and sentences of the materials that could not be fitted.
    """
    chosen: list[Seen] = []
    ladders: dict[str, Ladder] = {}
    notes: list[str] = []
    for material, own in watch(tuple(tests.items())):
        sure = _spread_out([o for o in own if o.source not in doubtful])
        try:
            law = own[0].law
            if any(isinstance(o, ForceObservation) and o.one_way for o in own):
                law = law_of("coulomb")
                notes += [ONE_WAY.format(material)] * (find_law or law.name != own[0].law.name)
            elif find_law:
                ladders[material] = climb([o.under(law_of("coulomb")) for o in sure], accuracy=accuracy)
                law = ladders[material].chosen.law
                notes += [f"{material}: {said}" for said in not_tried(ladders[material]) if SPENT in said]
            if law.is_exact or not find_law:  # a material that cannot be fitted alone would end the fit of all
                found = infer([o.under(law) for o in own if any(o is one for one in sure[:3])])
            else:
                found = ladders[material].posterior
        except NO_MOTION as error:
            notes.append(BY_TWO_NUMBERS.format(material, error))
            continue
        under = [o.under(law) for o in own]
        chosen += [o for o in under if o.source not in doubtful or _forgets(o, found)]
    if not chosen:
        return None, notes
    of_rows, out = isinstance(chosen[0], RowObservation), dict[str, tuple[float, float]]()
    try:
        is_all = not ladders and len(tests) == 1 and len(found.tests) == len(chosen)  # who was fitted alone
        posterior = bare = found if is_all else infer(chosen, at=_as_climbed(chosen, ladders))
        if of_rows:  # two numbers show an outlier by their noise alone
            bare = replace(posterior, fit=weighed(posterior.fit, np.zeros(len(chosen)), follows=False))
        if out := standing_out(bare):  # made again without those that stand out
            kept = [o for o in chosen if o.source not in out]
            posterior = infer(kept, at=_as_climbed(kept, ladders))
        causes = list[tuple[Unknown, Fit]]()
        if isinstance(chosen[0], CycleObservation):
            posterior, causes, hidden = _against_another_rig(posterior, by_mass=by_mass)
            notes += hidden
        if not of_rows:
            posterior, said = _against_richer_laws(posterior, do="" if find_law else DO_FIND)
            posterior, others = _undistinguished(posterior, ladders)
            notes += [*said, *others]
        return JointFit(posterior, at_each_force(posterior, forces), ladders, out, tuple(causes)), notes
    except NO_MOTION as error:
        return None, [*notes, BY_TWO_NUMBERS.format("all materials", error)]


def values_in(observation: Seen, found: Posterior, i: int = 0) -> dict[str, float]:
    """Return what all tests of a material share, by name, as values in a test of it; ``i``: one in the fit."""
    first, shared = found.observations[i], ((k, found.unknowns[k]) for k in found.tests[i].index.tolist())
    return {u.name: found.shared(k, i)[0] * observation.factor(u, first) for k, u in shared}


def _forgets(observation: Seen, found: Posterior) -> bool:
    """Whether the motion of a test, by what others of its material have found, forgets how it began."""
    state = observation.state(values_in(observation, found))
    return state is not None and state.memory < KEPT


def _climbed(model: FitModel, ladders: Mapping[str, Ladder]) -> Iterator[tuple[int, float, float]]:
    """Yield the unknowns that ladders have found: place in a model, value, and distance to laws not distinguished."""
    for found in (ladder.posterior for ladder in ladders.values()):
        places = {observation.source: i for i, observation in enumerate(found.observations)}
        apart = found.shifts.get(NOT_DISTINGUISHED, np.zeros(len(found.unknowns)))
        for test in (test for test in model.tests if test.observation.source in places):
            i = places[test.observation.source]
            for k, times in zip(test.index.tolist(), test.factors.tolist(), strict=True):
                if (there := found.fit.find(model.unknowns[k].name, i)) is not None:
                    value, slope = found.shared(there, i)
                    yield k, value / times, float(apart[there]) * slope / times


def _as_climbed(tests: Sequence[Seen], ladders: Mapping[str, Ladder]) -> FloatArray | None:
    """The point of ladders, of one test or an integrated law: other starts are dear, or have no motion."""
    if not ladders or (len(tests) > 1 and all(observation.law.is_exact for observation in tests)):
        return None
    model = model_of(tests)
    point = np.zeros(len(model.unknowns))
    for k, value, _ in _climbed(model, ladders):
        point[k] = model.unknowns[k].at(value)
    return point


def _undistinguished(posterior: Posterior, ladders: Mapping[str, Ladder]) -> tuple[Posterior, list[str]]:
    """The posterior whose errors hold what laws say that the tests do not distinguish, and what is said of these."""
    shift = np.zeros(len(posterior.unknowns))
    for k, _, apart in _climbed(posterior.fit.model, ladders):
        u = posterior.unknowns[k]
        shift[k] = apart / u.slope(float(posterior.fit.point[k])) if u.law else 0.0
    said = [f"{m}: {one}" for m, ladder in ladders.items() for one in ladder.posterior.warnings if NO_DIFFERENCE in one]
    return posterior.with_shift(NOT_DISTINGUISHED, shift) if shift.any() else posterior, said


def _against_another_rig(
    posterior: Posterior, *, by_mass: bool
) -> tuple[Posterior, list[tuple[Unknown, Fit]], list[str]]:
    """The posterior whose errors hold what another rig moves, the causes that answer, what is said of a hidden play.

    Where the stiffness follows from a mass (``by_mass``) it is the scene's times the square of the natural frequency's
    factor, and forces carry it once more: only of a frequency that is far from what is declared.
    """
    joint = JointFit(posterior, posterior)
    some = [i for material in joint.materials for i in joint.some(material)]
    explained = explains(posterior.fit, some)
    found, causes, _, said = other_causes(posterior, some, explained=explained)
    better = explained or any(fit.nrmse() <= BETTER * posterior.fit.nrmse(some) for _, fit in causes)
    posterior, causes = (found, causes) if better else (posterior, [])
    asked = [fit.values()[cause.name] for cause, fit in causes if cause.name == "natural_frequency"]
    detuned = next(iter(asked), posterior.values().get("natural_frequency", 0.0))
    declared = max((o.sources.natural_frequency for o in posterior.observations), default=0.0)
    if by_mass and abs(detuned) > STRAINED * declared:
        stiffer = abs((1.0 + detuned) ** 2 - 1.0)
        moved = [stiffer / posterior.relative(k) if u.name == "beta" else 0.0 for k, u in enumerate(posterior.unknowns)]
        posterior = posterior.with_shift(STIFFNESS, np.array(moved))
    return posterior, causes, said


def _against_richer_laws(posterior: Posterior, do: str) -> tuple[Posterior, list[str]]:
    """The posterior whose errors hold what another law would say, of each material whose law leaves a misfit."""
    said, joint = [], JointFit(posterior, posterior)
    for material in joint.materials:
        tests = joint.tests(material)
        if explains(posterior.fit, tests):
            continue
        posterior, times, why = beside_the_law(posterior, joint.some(material))
        varies = VARIES.format(times, why) if abs(times - 1.0) > SAME else ""
        missed, first = [i for i in tests if joint.misfit(i) > EXPLAINED], list[str]()
        for i in missed:  # what to do about one whose motion settled only after what is fitted begins
            observation = posterior.observations[i]
            moves = observation.starting and not isinstance(observation, ForceObservation)
            state = observation.state(posterior.values(i)) if moves else None
            start = "" if state is None else start_left(observation, state, posterior.fit.nrmse([i]))
            first += [f"{short_name(observation.source)}: {start}; else "] if start else []
        unlike = UNLIKE.format(material, "".join(first), posterior.law(tests[0]).name)
        said.append(unlike + varies + ("" if first and len(first) == len(missed) else do))
    return posterior, said


def _spread_out(observations: Sequence[Seen]) -> list[Seen]:
    """At most `MOST_CLIMBED` tests, spread evenly over normal force and frequency ratio."""
    ordered = sorted(observations, key=lambda o: (o.normal_force or 0.0, o.r))
    places = np.linspace(0, len(ordered) - 1, min(len(ordered), MOST_CLIMBED)).round()
    return [ordered[int(place)] for place in places]


def at_each_force(posterior: Posterior, forces: Mapping[str, float] = {}) -> Posterior:
    """Return the posterior with one friction ratio at each normal force: one linear step from the given one.

    ``forces``: that tests were set to, by source, where it was measured.

    What changes with the force is no scatter from test to test: that of friction is found anew where one force has
    several tests.
    """
    set_to = [replace(o, normal_force=forces.get(o.source, o.normal_force)) for o in posterior.observations]
    wide = model_of(set_to, amontons=False)
    old = np.zeros(len(wide.unknowns), dtype=np.intp)  # where each unknown of the wide model stands in the given one
    point = np.zeros(len(old))
    for before, after in zip(posterior.tests, wide.tests, strict=True):
        old[after.index] = before.index
        for k, m, times in zip(before.index, after.index, before.factors / after.factors, strict=True):
            point[m] = wide.unknowns[m].at(posterior.unknowns[k].value(float(posterior.fit.point[k])) * float(times))
    model = replace(wide, scatter=posterior.fit.model.scatter[old])
    found = stepped(replace(posterior.fit, model=model, point=np.clip(point, *model.bounds)))
    counted = posterior.scatter[old]
    if len(posterior.unknowns) < len(old) and len(wide.tests) > sum(u.name == "beta" for u in wide.unknowns):
        for _ in range(2):  # weighed as its scatter says: at the old one tests that agree would be held by their prior
            found = stepped(scattered(found))
        counted = found.scatter_to_count
    shifts = {name: shift[old] for name, shift in posterior.shifts.items()}
    return Posterior(found, posterior.information, counted, shifts, posterior.warnings)
