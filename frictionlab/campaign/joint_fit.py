"""The tests of a campaign fitted together: one rig under all materials, one law and one coefficient a material.

Every test is one observation of the inference; the law of a material is the scene's, or the top of the ladder that its
tests climb together. `JointFit.posterior` has one friction coefficient a material (Amontons' law), `by_force` one
friction ratio at each normal force: one linear step from it, by which Amontons' law is tested.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import ndtr, stdtrit

from frictionlab.arrays import FloatArray
from frictionlab.campaign.friction import Cause, FrictionFit, Known, LeftOut, Verdict, in_newtons, reach_of
from frictionlab.campaign.prediction import FREQUENCY, GAIN, LAG, Model, local, prepare
from frictionlab.errors import FrictionlabError
from frictionlab.estimate import Estimate
from frictionlab.inference.fit import Fit, Place
from frictionlab.inference.fit import Model as FitModel
from frictionlab.inference.ladder import Ladder, climb
from frictionlab.inference.observations import CycleObservation
from frictionlab.inference.posterior import Posterior, infer, model_of
from frictionlab.inference.unknowns import STRAINED
from frictionlab.simulator import Problem
from frictionlab.simulator.laws import Law, law_of

OUT = frozenset({Cause.LONG, Cause.STUCK, Cause.UNSTEADY, Cause.UNSETTLED})
"""Such a test has no steady cycle that a law could be fitted to."""
OUTLIER = 4.0  # robust standard deviations from which a test stands out ...
FEWEST = 5  # ... among so many tests of its material
SLIGHT = 1e-3  # relative: a friction ratio that differs by less does not stand out
KEPT = 0.999  # of a disturbance after a cycle: from so much on a motion is one of many
STATES = 5000  # steady states that the fit of a test takes, roughly
MOST_CLIMBED = 16  # tests of a material that climb the ladder: spread over r and force, they decide its law
SOURCES = {"gain": GAIN, "lag_s": LAG, "natural_frequency": FREQUENCY}
BY_TWO_NUMBERS = (
    "{}: friction from two numbers of each test (energy and amplitude), for no law could be fitted to their cycles: {}"
)
FOUND = "Sensors and rig as the tests find them, beside what is known of them: {}."


@dataclass(frozen=True)
class JointFit:
    """What the tests of all materials say together.

    Parameters
    ----------
    posterior : Posterior
        One friction coefficient a material.
    by_force : Posterior
        One friction ratio at each normal force of a material; tests in the same order.
    ladders : mapping of str to Ladder
        Of the materials whose law was looked for.
    out : mapping of str to (float, float)
        Tests that stand out, by source: their own friction ratio and that of the others.
    """

    posterior: Posterior
    by_force: Posterior
    ladders: Mapping[str, Ladder]
    out: Mapping[str, tuple[float, float]]

    @cached_property
    def place(self) -> Mapping[str, int]:
        """Number of each test by its source."""
        return {observation.measurement.source: i for i, observation in enumerate(self.posterior.observations)}

    def tests(self, material: str, normal_force_n: float | None = None) -> list[int]:
        """Return the numbers of a material's tests, under one normal force or all."""
        return [
            i
            for i, observation in enumerate(self.posterior.observations)
            if observation.material == material and normal_force_n in (None, observation.measurement.normal_force_n)
        ]

    def law(self, material: str) -> Law | None:
        """Return the law that a material's tests were fitted with; None where they were not."""
        tests = self.tests(material)
        return self.posterior.law(tests[0]) if tests else None

    def problems(self) -> dict[str, tuple[Problem, float]]:
        """Return by source what is simulated for each test, and the phase (rad) by which its base's channel is late."""
        found = {}
        for source, i in self.place.items():
            observation, values = self.posterior.observations[i], self.posterior.values(i)
            found[source] = observation.problem(values), observation.turn * values.get("lag_s", 0.0)
        return found

    def friction(self, material: str, normal_force_n: float) -> Estimate:
        """Return the friction ratio under one normal force, at the mean base amplitude of its tests."""
        tests, found = self.tests(material, normal_force_n), self.by_force
        k = found.fit.find("beta", tests[0])
        if k is None:
            return Estimate(None)
        value, slope = found.shared(k, tests[0])
        unit = float(np.mean([found.observations[i].unit for i in tests])) / found.observations[tests[0]].unit
        whole = math.sqrt(found.covariance[k, k])
        return Estimate(value / unit, slope / unit * min(found.law_error(k), whole), slope / unit * whole)

    def coefficient(self, material: str, stiffness: float | None) -> Estimate:
        """Return a material's friction coefficient by all its tests, stiffness and normal forces as they are told."""
        tests = self.tests(material)
        k = self.posterior.fit.find("beta", tests[0]) if tests else None
        if k is None or stiffness is None:
            return Estimate(None)
        observation = self.posterior.observations[tests[0]]
        if not observation.normal_force:
            return Estimate(None)
        relative = self.posterior.relative(k)
        value = self.shared_beta(tests[0]) * stiffness * observation.unit / observation.normal_force
        whole = value * relative * math.sqrt(self.posterior.covariance[k, k])
        return Estimate(value, min(value * relative * self.posterior.law_error(k), whole), whole)

    def relative_covariance(self, material: str, forces: Sequence[float]) -> FloatArray | None:
        """Return the covariance of the logarithms of friction ratios under several normal forces; None if one lacks."""
        found, places = self.by_force, list[int]()
        for force in forces:
            tests = self.tests(material, force)
            k = found.fit.find("beta", tests[0]) if tests else None
            if k is None:
                return None
            places.append(k)
        slopes = [found.relative(k) for k in places]
        return np.asarray(found.covariance[np.ix_(places, places)] * np.outer(slopes, slopes))

    def evenness(self, tests: Sequence[int]) -> tuple[float, int]:
        """Return chi-square of the tests' own friction about their mean, by each test's own error, and its freedom."""
        values, errors = [], []
        for i in tests:
            estimate = self.own_beta(i)
            if estimate.value and estimate.se:
                values.append(math.log(estimate.value / float(self.shared_beta(i))))
                errors.append(estimate.se / estimate.value)
        weight = np.array(errors) ** -2.0
        about = np.array(values) - float(weight @ values / weight.sum()) if values else np.zeros(0)
        return float(weight @ about**2), max(len(values) - 1, 0)

    def shared_beta(self, i: int) -> float:
        """Return the friction ratio of test i by its material's coefficient."""
        return self.posterior.shared(self.posterior.fit.find("beta", i) or 0, i)[0]

    def own_beta(self, i: int) -> Estimate:
        """Return the friction ratio that test i alone asks for, all else as the joint fit has it (one linear step)."""
        posterior = self.posterior
        k = posterior.fit.find("beta", i)
        if k is None:
            return Estimate(None)
        test = posterior.tests[i]
        place = test.place(k)
        slopes, residual = posterior.fit.place.slopes[i], posterior.fit.residual(i)
        level = np.array([posterior.unknowns[j].level == "test" or j == k for j in test.index])
        information = slopes[:, level].T @ slopes[:, level] + 1e-12 * np.eye(int(level.sum()))
        at = int(np.flatnonzero(np.flatnonzero(level) == place)[0])
        covariance = np.linalg.inv(information)
        step = float((covariance @ slopes[:, level].T @ residual)[at])
        u, c = posterior.unknowns[k], float(posterior.fit.own(i)[place]) + step
        times = float(test.factors[place])
        value = u.value(max(c, u.low)) * times
        return Estimate(value, u.slope(max(c, u.low)) * times * math.sqrt(float(covariance[at, at])))

    def rig_notes(self) -> tuple[str, ...]:
        """Return where the tests find sensors and rig, and which of them are far from what is known."""
        parts, far = [], []
        for k, u in enumerate(self.posterior.unknowns):
            if u.law:
                continue
            off, error = float(self.posterior.fit.point[k]), math.sqrt(self.posterior.covariance[k, k])
            factor, unit = (u.unit[0], f" {u.unit[1]}") if u.unit[1] else (100.0, " %")
            value, spread, known = (factor * u.sd * x for x in (off, error, u.known_to))
            parts.append(f"{u.words} {value:+.2g}{unit} ± {spread:.2g}{unit}, known to {known:.2g}{unit}")
            if abs(off) > STRAINED * u.known_to:
                far.append(f"{u.words}: {value:+.2g}{unit} is {abs(off) / u.known_to:.2g} times what {u.key} declares")
        return (FOUND.format("; ".join(parts)), *far) if parts and len(self.posterior.tests) > 1 else ()


def usable(
    fits: Sequence[FrictionFit], observations: Mapping[str, CycleObservation]
) -> dict[str, list[CycleObservation]]:
    """Return the observations of each material that a law can be fitted to.

    Where Coulomb's law has many steady states the cycle depends on which of them it is more than on the law; it counts
    only in a group that has no other tests.
    """
    found: dict[str, list[CycleObservation]] = {}
    for fit in fits:
        steady = [v for v in fit.verdicts if v.excluded is None or v.excluded.cause not in OUT]
        here = [v for v in steady if v.trial.source in observations]
        alone = [v for v in here if v.predicted is None or v.predicted.memory < KEPT]
        if here:
            found.setdefault(fit.material, []).extend(observations[v.trial.source] for v in alone or here)
    return found


def fit_together(
    fits: Sequence[FrictionFit],
    observations: Mapping[str, CycleObservation],
    laws: Mapping[str, Law | None],
    accuracy: str,
) -> tuple[JointFit | None, list[str]]:
    """Fit the tests of all materials together.

    Parameters
    ----------
    fits : sequence of FrictionFit
        From two numbers of each test: which tests have no steady cycle.
    observations : mapping of str to CycleObservation
        By source, under the scene's law.
    laws : mapping of str to Law or None
        Law by material, where it is not the scene's; None is found by climbing from plain Coulomb friction.
    accuracy : str
        Of the ladder.

    Returns
    -------
    The joint fit (None where there is nothing to fit), and sentences of the materials that could not be fitted.
    """
    prepare(STATES * len(observations))
    chosen: list[CycleObservation] = []
    ladders: dict[str, Ladder] = {}
    notes: list[str] = []
    for material, own in usable(fits, observations).items():
        try:
            law = laws.get(material, own[0].law)
            if law is None:
                ladders[material] = climb(_spread_out(own), accuracy=accuracy)
                law = ladders[material].chosen.law
            under = [observation.under(law) for observation in own]
            infer(_spread_out(under)[:3])  # a material that cannot be fitted alone would end the fit of all
        except (FrictionlabError, ArithmeticError, np.linalg.LinAlgError) as error:
            notes.append(BY_TWO_NUMBERS.format(material, error))
            continue
        chosen += under
    if not chosen:
        return None, notes
    try:
        joint = _joint(chosen, ladders)
    except (FrictionlabError, ArithmeticError, np.linalg.LinAlgError) as error:
        return None, [*notes, BY_TWO_NUMBERS.format("all materials", error)]
    return joint, notes


def _spread_out(observations: Sequence[CycleObservation]) -> list[CycleObservation]:
    """At most `MOST_CLIMBED` tests, spread evenly over normal force and frequency ratio."""
    ordered = sorted(observations, key=lambda o: (o.normal_force or 0.0, o.r))
    if len(ordered) <= MOST_CLIMBED:
        return ordered
    return [ordered[int(i)] for i in np.linspace(0, len(ordered) - 1, MOST_CLIMBED).round()]


def _joint(observations: Sequence[CycleObservation], ladders: Mapping[str, Ladder]) -> JointFit:
    near = None
    single = len({o.material for o in observations}) == 1 and len(observations) == 1
    if single and ladders:
        near = next(iter(ladders.values())).posterior.values()
    posterior = infer(observations, near=near)
    joint = JointFit(posterior, at_each_force(posterior), ladders, {})
    out = _standing_out(joint)
    if out:
        rest = [o for o in observations if o.measurement.source not in out]
        posterior = infer(rest, near=posterior.values())
        joint = JointFit(posterior, at_each_force(posterior), ladders, out)
    return joint


def _standing_out(joint: JointFit) -> dict[str, tuple[float, float]]:
    """Tests whose friction is far from that of the others of their material, by source: their own and the others'."""
    out: dict[str, tuple[float, float]] = {}
    for material in {test.observation.material for test in joint.posterior.tests}:
        tests = joint.tests(str(material))
        own = [joint.own_beta(i) for i in tests]
        if len(tests) < FEWEST or any(e.value is None for e in own):
            continue
        gap = np.array([math.log((e.value or 1.0) / joint.shared_beta(i)) for i, e in zip(tests, own, strict=True)])
        error = np.array([(e.se or 0.0) / (e.value or 1.0) for e in own])
        width = 1.4826 * float(np.median(np.abs(gap - np.median(gap))))
        limit = float(stdtrit(len(tests) - 1, ndtr(OUTLIER)))  # of few tests the width is known badly
        far = np.abs(gap - np.median(gap)) > limit * np.sqrt(error**2 + max(width, SLIGHT) ** 2)
        for i, e, is_far in zip(tests, own, far, strict=True):
            if is_far:
                source = joint.posterior.observations[i].measurement.source
                out[source] = (float(e.value or math.nan), joint.shared_beta(i))
    return out


def at_each_force(posterior: Posterior) -> Posterior:
    """Return the posterior with one friction ratio at each normal force: one linear step from the given one."""
    wide = model_of(posterior.observations, amontons=False)
    scatter, point = np.zeros(len(wide.unknowns)), np.zeros(len(wide.unknowns))
    scatter_u, shifts = np.zeros(len(wide.unknowns)), {name: np.zeros(len(wide.unknowns)) for name in posterior.shifts}
    for old, new in zip(posterior.tests, wide.tests, strict=True):
        for j, (k, m) in enumerate(zip(old.index, new.index, strict=True)):
            u, times = posterior.unknowns[k], float(old.factors[j] / new.factors[j])
            point[m] = wide.unknowns[m].at(u.value(float(posterior.fit.point[k])) * times)
            scatter[m], scatter_u[m] = posterior.fit.model.scatter[k], posterior.scatter_u[k]
            for name, shift in posterior.shifts.items():
                shifts[name][m] = shift[k]
    model = replace(wide, scatter=scatter)
    place = posterior.fit.place
    here = Place(np.clip(point, *model.bounds), place.local, place.residual, place.slopes, model.strains(point))
    fit = Fit(model, _stepped(model, here))
    return Posterior(fit, posterior.information, scatter_u, shifts, posterior.warnings)


def _stepped(model: FitModel, here: Place) -> Place:
    """The place one linear step on, where the step of every friction ratio is small; else the place itself."""
    fit = Fit(model, here)
    bent = np.array([u.strain_slope(float(c)) for u, c in zip(model.unknowns, here.point, strict=True)])
    step = np.linalg.solve(fit.precision, fit.reduced.pull - bent * here.strain)
    point = np.clip(here.point + step, *model.bounds)
    moved = point - here.point
    residual = tuple(
        r - slopes @ moved[test.index] for r, slopes, test in zip(here.residual, here.slopes, model.tests, strict=True)
    )
    return Place(point, here.local, residual, here.slopes, model.strains(point))


def fit_of(fit: FrictionFit, joint: JointFit, model: Model, known: Known) -> FrictionFit:
    """Return the friction of a group by the joint fit, in the place of that by two numbers."""
    tests = joint.tests(fit.material, fit.normal_force_n)
    if not tests:
        return fit
    ratio = joint.friction(fit.material, fit.normal_force_n)
    if ratio.value is None:
        return fit
    law = joint.posterior.law(tests[0])
    verdicts = tuple(_verdict(v, joint, model, ratio.value) for v in fit.verdicts)
    used = [v.trial for v in verdicts if v.excluded is None]
    freedom = max(len(joint.tests(fit.material)) - 1, 0)
    force, coefficient = in_newtons(ratio, used, known, fit.normal_force_n)
    reach = reach_of(ratio, freedom)
    square, own_freedom = joint.evenness(tests)
    relative = joint.by_force.relative(joint.by_force.fit.find("beta", tests[0]) or 0)
    found = joint.posterior.shares("beta", tests[0])
    scatter = float(joint.posterior.fit.model.scatter[joint.posterior.fit.find("beta", tests[0]) or 0]) * relative
    return replace(
        fit,
        verdicts=verdicts,
        ratio=ratio,
        force=force,
        coefficient=coefficient,
        low=ratio.value - reach,
        high=ratio.value + reach,
        freedom=freedom,
        scatter=scatter if freedom else None,
        note=_note(fit, law, verdicts, has_force=force.known, freedom=freedom),
        shares={SOURCES[name]: share / ratio.value for name, share in found.items() if name in SOURCES},
        law=law.name,
        tests_chi_square=square if own_freedom else None,
        tests_freedom=own_freedom,
        tests_p=_p(square, own_freedom),
    )


def _p(square: float, freedom: int) -> float | None:
    from scipy.stats import chi2  # noqa: PLC0415 - half a second, for campaigns alone

    return float(chi2.sf(square, freedom)) if freedom else None


def _verdict(verdict: Verdict, joint: JointFit, model: Model, beta: float) -> Verdict:
    """What the joint fit says of one test."""
    trial, i = verdict.trial, joint.place.get(verdict.trial.source)
    excluded = _excluded(verdict, joint)
    if i is None or trial.regime == "stuck" or trial.is_long:
        return replace(verdict, excluded=excluded)
    observation = joint.posterior.observations[i]
    residual = joint.posterior.fit.residual(i)
    here = local(model, trial.r, beta * observation.unit / trial.base_amplitude_m, observation.base)
    parameters = joint.posterior.parameters(i)["beta"]
    return replace(
        verdict,
        excluded=excluded,
        alone=Estimate(parameters.value, parameters.se, parameters.u),
        predicted=None if here is None else here.here,
        elasticity=float(here.by_beta[0]) * beta / here.here.energy if here is not None and here.here.energy else 0.0,
        misfit=math.sqrt(observation.chi_square(residual) / len(residual)),
        nrmse=observation.nrmse(residual),
        floor=observation.cycles.floor,
    )


def _excluded(verdict: Verdict, joint: JointFit) -> LeftOut | None:
    source = verdict.trial.source
    if source in joint.place:
        return None
    if source in joint.out:
        return Cause.UNEXPLAINED.because(*joint.out[source])
    if verdict.excluded is None and verdict.predicted is not None and verdict.predicted.memory >= KEPT:
        return Cause.NOT_UNIQUE.because()
    return verdict.excluded or Cause.NO_CYCLE.because()


def _note(fit: FrictionFit, law: Law, verdicts: Sequence[Verdict], *, has_force: bool, freedom: int) -> str:
    used, tests = sum(v.excluded is None for v in verdicts), sum(not v.trial.is_long for v in verdicts)
    parts = [] if freedom else ["one test only: its scatter from test to test is not known"]
    parts += [f"{tests - used} of {tests} tests left out"] if used < tests else []
    parts += [] if has_force else [part for part in fit.note.split("; ") if part.startswith("no force")]
    missed = [v for v in verdicts if v.excluded is None and v.nrmse is not None and v.floor is not None]
    off = sum((v.nrmse or 0.0) > 2.0 * (v.floor or 0.0) for v in missed)
    parts += [f"{law.name} does not explain {off} of {len(missed)} cycles to their noise"] if off else []
    return "; ".join(parts)


def model_under(joint: JointFit, material: str, scene_model: Model) -> Model:
    """Return what a material's tests are predicted with: its law, with the values that the joint fit has found."""
    tests = joint.tests(material)
    if not tests:
        return scene_model
    first = joint.posterior.observations[tests[0]]
    values = joint.posterior.values(tests[0])
    names = {p.name for p in first.law.parameters if p.name != "beta"}
    held = dict(first.held) | {name: value for name, value in values.items() if name in names}
    return Model(law_of(first.law.name), tuple(sorted(held.items())), scene_model.wall, scene_model.solver)
