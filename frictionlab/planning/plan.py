"""A plan: one test after the other, the one that shows most beside those before it.

Two laws are distinguished by the evidence to expect if the one holds and the other is fitted to it, both ways.
What a test would show under one law is fitted with the other by the inference itself, sensors and rig beside it, so
that what a lag or a detuned frame explains does not count. The cycle fitted is free of noise: noise adds as much to
both laws. Of a plan its tests, what to expect of each, and the order that saves changes are given as a sheet,
which ``[experiment] sheet`` reads after the tests.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import FrictionlabError, SceneError, UsageError
from frictionlab.inference.diagnose import diagnose
from frictionlab.inference.fit import followed, weighed
from frictionlab.inference.ladder import REQUIRED
from frictionlab.inference.posterior import Posterior, infer
from frictionlab.inference.verdict import friction_of
from frictionlab.planning.candidates import Candidate, Laboratory, VirtualTest, together, virtual_test
from frictionlab.scene import Scene
from frictionlab.schema import PLANS, Result
from frictionlab.simulator.laws import law_of
from frictionlab.uncertainty import NOT_KNOWN, Estimate, Flat

MOST = 10  # tests, where nobody says how many
SWEEPS = 2  # through the tests chosen, each compared with all others again
AGAIN = 1e-9  # of what a test shows: a tie goes to one not chosen yet
NEAR = 12  # candidates of a choice between two laws to which both are fitted, at least
MOST_STEPS = 12  # of a fit: the evidence need not be known better
Gain = Callable[[Sequence[int]], FloatArray]
Watch = Callable[[Sequence[Candidate]], Iterable[Candidate]]
Evidence = FloatArray
"""Logarithm of the Bayes factor to expect (2, n), if the one law holds and if the other does; NaN: not judged."""


@dataclass(frozen=True)
class PlannedTest:
    """One test of a plan, or a candidate that was not chosen (``rank`` None); its columns: `frictionlab.schema`.

    ``expected``: what a fit calls ``se``, where sensors and rig are as they are known; ``cumulative``: with friction
    that differs from test to test. ``coefficient``: the friction coefficient with its combined uncertainty as a
    comparison of this test alone would state it. ``values``: those of the law's parameters that are to be found.
    """

    rank: int | None
    frequency_ratio: float
    normal_force_n: float
    base_amplitude_m: float
    duration_s: float
    regime: str | None
    response_m: float | None
    expected: Mapping[str, float | None]
    expected_u: Mapping[str, float | None]
    cumulative: Mapping[str, float | None] | None
    cumulative_u: Mapping[str, float | None] | None
    drive_frequency_hz: float
    values: Mapping[str, float]
    coefficient: Estimate = NOT_KNOWN
    friction_coefficient_u_after: float | None = None
    log_bayes: float | None = None
    log_bayes_against: float | None = None
    log_bayes_after: float | None = None

    friction_coefficient = Flat("coefficient")
    friction_coefficient_u = Flat("coefficient", "u")

    def row(self) -> dict[str, object]:
        """The contract's keys: a line of JSON or of a table."""
        return PLANS.row(self)


@dataclass(frozen=True)
class Plan(Result):
    """A plan: ``tests``, best first; ``others``: candidates that were not chosen; ``notes``: what was assumed.

    ``against``: the law from which ``law`` is to be distinguished, if that was asked.
    """

    law: str
    against: str | None
    tests: tuple[PlannedTest, ...]
    others: tuple[PlannedTest, ...]
    notes: tuple[str, ...]

    def rows(self) -> list[dict[str, object]]:
        """One row for each test chosen, best first."""
        return [test.row() for test in self.tests]

    def __repr__(self) -> str:
        apart = "" if self.against is None else f" against {self.against}"
        first = [f"r = {t.frequency_ratio:g} at {t.normal_force_n:g} N" for t in self.tests[:3]]
        more = ", ..." if len(self.tests) > len(first) else ""
        return f"<Plan {self.law}{apart}: {len(self.tests)} tests, {', '.join(first)}{more}>"


def plan_tests(
    lab: Laboratory,
    *,
    against: str | None = None,
    tests: int | None = None,
    everything: bool = False,
    watch: Watch = iter,
) -> Plan:
    """Return the tests that show most about a law's parameters, or most between two laws, best first.

    Each next test is the one that, with all before it, takes most from what is not known: from the product of the
    parameters' uncertainties (D-optimality), or in expected evidence between two laws. A test may be chosen again where
    nothing else shows more. Options and errors as of `frictionlab.plan`.
    """
    if tests is not None and tests < 1:
        raise UsageError(f"tests: expected at least 1; got {tests}")
    if not lab.free:
        raise UsageError(f"law {lab.law.name}: the scene holds all of its parameters: there is nothing to find out")
    virtual = [virtual_test(lab, candidate) for candidate in watch(lab.candidates)]
    allowed = allowed_by(lab, virtual)
    evidence: Evidence | None = None
    if against is None:
        order = pick(_least_error(lab, virtual), allowed, tests or MOST)
        for i in np.flatnonzero(allowed) if everything else np.unique(order):
            own = virtual[i].posterior
            if own is not None:  # errors hold, as a comparison's do, what another spring or frequency would move
                virtual[i] = replace(virtual[i], posterior=diagnose(own, lab.scene, explained=True).posterior)
    else:
        most = len(virtual) if everything else max(NEAR, 2 * (tests or MOST))
        evidence = _between(lab, virtual, against, allowed, most, watch)
        known, shown = np.isfinite(evidence[0]), np.nan_to_num(evidence)

        def both_ways(before: Sequence[int]) -> FloatArray:  # growth in proportion, both ways alike
            so_far = shown[:, list(before)].sum(axis=1, keepdims=True)
            grown = np.log1p(np.maximum(so_far + shown, 0.0)) - np.log1p(np.maximum(so_far, 0.0))
            return np.where(known, grown.sum(axis=0), -math.inf)

        order = pick(both_ways, allowed & known, tests or MOST)

    def row(i: int, before: Sequence[int] = ()) -> PlannedTest:
        return _row(lab, virtual, i, before, evidence)

    chosen = tuple(row(i, order[: rank + 1]) for rank, i in enumerate(order))
    decided = [rank for rank, test in enumerate(chosen, 1) if (test.log_bayes_after or 0.0) >= REQUIRED]
    chosen = chosen[: decided[0]] if decided and tests is None else chosen
    rest = [int(i) for i in np.flatnonzero(allowed) if i not in set(order[: len(chosen)])]
    return Plan(lab.law.name, against, chosen, tuple(map(row, rest)), _doubts(lab, chosen, against))


def _least_error(lab: Laboratory, tests: Sequence[VirtualTest]) -> Gain:
    """What each candidate adds to tests chosen: the fall of the logarithm of the parameters' joint uncertainty."""
    telling = [i for i, test in enumerate(tests) if test.posterior is not None]
    whole = together(lab, [tests[i] for i in telling])
    m = len(whole.unknowns)
    holds = np.eye(m) + known_before(lab, whole, tests[telling[0]].candidate)
    counted = np.array([u.law for u in whole.unknowns])
    information = np.zeros((len(tests), m, m))
    for i, own in zip(telling, whole.information, strict=True):
        s = together(lab, [tests[i]]).fit.model.scatter
        information[i] = own - (own * s) @ np.linalg.solve(np.eye(m) + (s[:, None] * own) * s, s[:, None] * own)
    silent = np.array([test.posterior is None for test in tests])

    def spread(precision: FloatArray) -> FloatArray:
        left = np.linalg.inv(precision)[..., counted, :][..., counted]
        return np.asarray(0.5 * np.linalg.slogdet(left)[1])

    def gain(order: Sequence[int]) -> FloatArray:
        total = holds + information[np.asarray(order, dtype=np.intp)].sum(axis=0)
        return np.where(silent, -math.inf, spread(total) - spread(total + information))

    return gain


def known_before(lab: Laboratory, joint: Posterior, candidate: Candidate) -> FloatArray:
    """Return what is known of the law's parameters before the first test, as information on a joint fit's coordinates.

    ``candidate``: in whose units these are.
    """
    known, values = np.zeros(len(joint.unknowns)), lab.values(candidate)
    for k, u in enumerate(joint.unknowns):
        if not u.law:
            continue
        slope = u.slope(u.at(values[u.name])) if values[u.name] or u.scale == "linear" else 0.0
        if u.name == "beta":
            value, error = lab.coefficient
            known[k] = (slope / (values["beta"] * error / value)) ** 2
        elif u.name in lab.known:
            known[k] = (slope / (lab.known[u.name].u or math.inf)) ** 2
    return np.diag(known)


def allowed_by(lab: Laboratory, tests: Sequence[VirtualTest]) -> NDArray[np.bool_]:
    """Return which candidates (n,) the rig allows; refused where none is, or none shows anything."""
    response, most = np.array([test.response_m for test in tests]), lab.scene.plan.largest_response_m
    allowed = ~(response > (most or math.inf))
    if not allowed.any():
        raise SceneError(
            f"plan.largest_response_m: {most:g} m forbids all candidates; the least response expected is"
            f" {np.nanmin(response):.3g} m"
        )
    if not any(test.posterior is not None for test, ok in zip(tests, allowed, strict=True) if ok):
        raise UsageError(
            f"law {lab.law.name}: no candidate shows anything: the mass stands still or has no steady state in all"
            " of them, or would if friction were one standard error higher; change normal_forces_n,"
            " base_amplitudes_m or frequency_ratios of [plan], or narrow friction_coefficient"
            + "".join(f"\n{note}" for note in lab.notes)
        )
    return np.asarray(allowed)


def pick(gain: Gain, allowed: NDArray[np.bool_], most: int) -> list[int]:
    """Return indices of the tests chosen, at most so many, best first.

    Each is the one that shows most. What the first show beside nothing is no measure of what they show beside the rest:
    so each is put to the test again beside all others, and the set is ranked once more.
    """

    def often(order: Sequence[int]) -> NDArray[np.intp]:
        return np.bincount(np.asarray(order, dtype=np.intp), minlength=len(allowed))

    def best(order: Sequence[int], free: NDArray[np.bool_]) -> int:
        return int(np.argmax(np.where(free, gain(order) * (1.0 - AGAIN * often(order)), -math.inf)))

    order: list[int] = []
    for _ in range(1 + SWEEPS):
        before = sorted(order)
        for k in range(len(order)):
            order[k] = best([*order[:k], *order[k + 1 :]], allowed)
        while len(order) < most:
            order.append(best(order, allowed))
        if sorted(order) == before:
            break
    ranked: list[int] = []
    while len(ranked) < len(order):
        ranked.append(best(ranked, often(order) > often(ranked)))
    return ranked


def _doubts(lab: Laboratory, tests: Sequence[PlannedTest], against: str | None) -> tuple[str, ...]:
    """What is assumed, and what the plan will not do."""
    plan, notes = lab.scene.plan, lab.notes
    if len(tests) > 1 and not plan.repeatability:
        notes = (*notes, "plan.repeatability: not given: friction is taken to be the same in every test")
    if against is not None and "breakaway" in f"{lab.law.name}+{against}":
        notes = (*notes, "against: motions jump with break-away: the evidence may come out some ten times lower")
    after = tests[-1].log_bayes_after
    if against is not None and after is not None and after < REQUIRED:
        laws = f"{lab.law.name} and {against}"
        said = f"{REQUIRED:g} decides, {after:.2g} is expected; allow more tests, or larger values in plan.expected"
        notes = (*notes, f"against: these tests are not expected to decide between {laws}: {said}")
    return notes


def _row(
    lab: Laboratory, tests: Sequence[VirtualTest], i: int, order: Sequence[int], evidence: Evidence | None
) -> PlannedTest:
    """One candidate as a row of a plan; ``order``: the tests up to it, if it is chosen."""
    test, candidate, response = tests[i], lab.candidates[i], tests[i].response_m
    values, estimates = lab.values(candidate), {} if test.posterior is None else test.posterior.parameters(0)
    se, u = ({name: getattr(estimates.get(name), key, None) for name in lab.free} for key in ("se", "u"))
    chosen = [tests[k] for k in order if tests[k].posterior is not None]
    after_se, after_u = (_after(lab, chosen, candidate, rig=rig) if order else None for rig in (False, True))
    if after_se is not None and after_u is not None:
        after_se = {name: None if e is None else min(e, after_u[name] or e) for name, e in after_se.items()}
    coefficient, coefficient_after = NOT_KNOWN, None
    if test.posterior is not None and test.observation is not None and "beta" in u:  # as a comparison states it
        seen = test.observation
        y_se = lab.noise_m * math.sqrt(seen.turn / (math.pi * seen.rate * seen.used))
        friction = friction_of(test.posterior, lab.scene, Estimate(seen.unit, y_se))
        ratio, known = friction["friction"], friction["coefficient"]
        if known.u is not None:  # gains, stiffness and normal force add to what is not known of the ratio
            coefficient, after = Estimate(known.value, None, known.u), (after_u or {}).get("beta")
            beyond = (known.u / known.value) ** 2 - (ratio.u / ratio.value) ** 2
            coefficient_after = after and known.value * math.sqrt(max(beyond, 0.0) + (after / values["beta"]) ** 2)
    both = (math.nan, math.nan) if evidence is None else evidence[:, i].tolist()
    one, two = (None if math.isnan(way) else way for way in both)
    after = None if evidence is None or not order else float(np.nan_to_num(evidence[:, order]).sum(axis=1).min())
    return PlannedTest(
        rank=len(order) or None,
        **candidate._asdict(),
        regime=None if test.state is None else test.state.regime,
        response_m=response if math.isfinite(response) else None,
        expected=se,
        expected_u=u,
        cumulative=after_se,
        cumulative_u=after_u,
        drive_frequency_hz=candidate.frequency_ratio * lab.natural_frequency_hz,
        values={name: values[name] for name in lab.free},
        coefficient=coefficient,
        friction_coefficient_u_after=coefficient_after,
        log_bayes=one,
        log_bayes_against=two,
        log_bayes_after=after,
    )


def _after(
    lab: Laboratory, chosen: Sequence[VirtualTest], candidate: Candidate, *, rig: bool
) -> dict[str, float | None]:
    """Uncertainties of the shared parameters after some tests, in a candidate's units.

    ``rig``: whether sensors and rig are unknown too, or as they are known.
    """
    found: dict[str, float | None] = dict.fromkeys(lab.free)
    if not chosen:
        return found
    first, here, joint = lab.values(chosen[0].candidate), lab.values(candidate), together(lab, chosen, rig=rig)
    precision = np.linalg.inv(joint.covariance) + known_before(lab, joint, chosen[0].candidate)
    each = zip(joint.unknowns, joint.fit.point, np.sqrt(np.diag(np.linalg.inv(precision))), strict=True)
    for u, c, error in each:
        if u.law:
            times = abs(here[u.name] / first[u.name]) if first[u.name] else 1.0
            found[u.name] = times * abs(u.slope(float(c))) * float(error)
    return found


def evidence_over(lab: Laboratory, test: VirtualTest, other: str) -> float:
    """Return the logarithm of the Bayes factor to expect for the laboratory's law over another, of one test.

    NaN where the test says nothing, the two laws are one, or the other has no steady state near. Each at its peak:
    values with sensors and rig as they are known, which a posterior may give, have another evidence.
    """
    law = law_of(other)
    if test.observation is None or test.posterior is None or law.name == lab.law.name:
        return math.nan
    values = lab.values(test.candidate)
    near = {p.name: values[p.name] for p in law.own if p.name in values}
    try:
        rival = infer([test.observation.under(law, {})], near=near, most=MOST_STEPS)
    except (FrictionlabError, ArithmeticError, np.linalg.LinAlgError):
        return math.nan
    missed = np.maximum(rival.fit.shares_missed(), test.observation.missed)  # the rig's part is under both laws
    other_fit = followed(weighed(rival.fit, missed, follows=False))
    return test.posterior.fit.log_evidence - other_fit.log_evidence


def _between(
    lab: Laboratory, tests: Sequence[VirtualTest], against: str, allowed: NDArray[np.bool_], most: int, watch: Watch
) -> Evidence:
    """The evidence between two laws, each fitted to what the other shows: of so many candidates allowed.

    They are those whose cycles differ most; NaN of the others.
    """
    other = lab.under(against)
    if other.law.name == lab.law.name:
        raise UsageError(f"against: law {against} is the one that is planned for: name another one")
    others = [virtual_test(other, candidate) for candidate in watch(lab.candidates)]
    apart = np.array([_apart(one, two) for one, two in zip(tests, others, strict=True)])
    if not np.isfinite(apart[allowed]).any():
        raise UsageError(
            f"against: no candidate that largest_response_m allows moves steadily under both {lab.law.name} and"
            f" {other.law.name}: change normal_forces_n, base_amplitudes_m or frequency_ratios of [plan]"
        )
    apart = np.where(allowed, apart, -math.inf)
    found, every = np.full((2, len(tests)), np.nan), most == len(tests)
    for i in np.argsort(-apart)[:most].tolist():
        if not allowed[i] or not (every or np.isfinite(apart[i])):
            continue
        ways = evidence_over(lab, tests[i], other.law.name), evidence_over(other, others[i], lab.law.name)
        found[:, i] = np.nan_to_num(ways)
    return found


def _apart(one: VirtualTest, two: VirtualTest) -> float:
    """Distance of the cycles of two laws in the noise's own units, what the second's unknowns explain taken out."""
    if one.observation is None or two.observation is None or two.posterior is None:
        return -math.inf
    gap = one.observation.white(one.observation.data - two.observation.data[: len(one.observation.data)])
    slopes = two.posterior.fit.slopes[0]
    if len(slopes) != len(gap):
        return 0.5 * float(gap @ gap)
    step = np.linalg.solve(slopes.T @ slopes + np.eye(slopes.shape[1]), slopes.T @ gap)
    left = gap - slopes @ step
    return 0.5 * float(left @ left + step @ step)


def running_order(plan: Plan) -> tuple[PlannedTest, ...]:
    """The tests so that each normal force is set once, and each motion of the base once for it."""
    order = ("normal_force_n", "base_amplitude_m", "frequency_ratio", "duration_s")
    return tuple(sorted(plan.tests, key=attrgetter(*order)))


def sheet_rows(plan: Plan, scene: Scene) -> list[dict[str, object]]:
    """Return the rows of a sheet: the log's name and the facts of each test, in the order to run them.

    A material that the scene does not name is an empty cell, to be filled in.
    """
    material = scene.experiment.material
    rows: list[dict[str, object]] = []
    for number, test in enumerate(running_order(plan), 1):
        name = f"N{test.normal_force_n:g}_r{test.frequency_ratio:g}_Y{1e3 * test.base_amplitude_m:g}mm"
        rows.append(
            {
                "log": f"{number:02d}_{material or 'test'}_{name}.csv",
                "material": material,
                "normal_force_n": test.normal_force_n,
                "nominal_frequency_ratio": test.frequency_ratio,
                "duration_s": test.duration_s,
                "note": _note(test),
            }
        )
    return rows


def _note(test: PlannedTest) -> str:
    """What to set, and what to expect of the motion."""
    expected = "no steady motion is expected"
    if test.response_m is not None:
        words = {"continuous": "it slides without stops", "stuck": "the mass stands still"}
        moves = words.get(test.regime or "", "it sticks and slips")
        expected = f"the mass should swing {1e3 * test.response_m:.2g} mm to each side; {moves}"
    drive = f"Drive at {test.drive_frequency_hz:.4g} Hz with {1e3 * test.base_amplitude_m:g} mm"
    return f"{drive}, record {test.duration_s:g} s; {expected}"
