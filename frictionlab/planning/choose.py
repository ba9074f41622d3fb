"""Which tests to run: one after the other, the one that tells most for its laboratory time beside those before it."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray
from frictionlab.errors import SceneError, UsageError
from frictionlab.inference.ladder import REQUIRED
from frictionlab.inference.unknowns import Unknown
from frictionlab.planning.against import Between, evidence_over
from frictionlab.planning.candidates import Candidate, Laboratory, candidates, check_free, laboratory, told_together
from frictionlab.planning.plan import Plan, PlannedTest
from frictionlab.planning.virtual_test import (
    Reference,
    VirtualTest,
    between_tests,
    reference_of,
    together,
    values_in,
    virtual_test,
)
from frictionlab.scene import Scene

BoolArray = NDArray[np.bool_]
MOST = 10  # tests, where nobody says how many
SWEEPS = 2  # through the tests chosen, each compared with all others again
SLOW = 1.0  # s that a law without exact slides takes for one candidate, roughly
AGAIN = 1e-9  # of what a test tells: a tie goes to one not chosen yet
HOUR = 3600.0
Gain = Callable[[Sequence[int]], FloatArray]


def plan_tests(
    scene: Scene,
    *,
    law: str | None = None,
    against: str | None = None,
    tests: int | None = None,
    hours: float | None = None,
    aim: Sequence[str] = (),
    measured: Sequence[Mapping[str, object]] = (),
    everything: bool = False,
) -> Plan:
    """Return the tests that tell most about a law's parameters, or most between two laws, best first.

    Each next test is the one that, with all before it, takes most from what is not known for the laboratory time it
    adds: from the product of the parameters' uncertainties (D-optimality), or in expected evidence between two laws.
    A test may be chosen again where nothing else tells more.

    Parameters
    ----------
    scene : Scene
        ``[plan]``: candidates, sensors, laboratory time, what is known before; ``[rig]``; ``[model]``: the law.
    law : str, optional
        In place of the scene's.
    against : str, optional
        Another law: tests are chosen to tell the two apart.
    tests : int
        How many at most; by default ten, between two laws no more than are expected to decide.
    hours : float, optional
        Laboratory time there is.
    aim : sequence of str
        Parameters of the law whose errors count; by default all.
    measured : sequence of mappings, optional
        Comparisons at hand (rows of `compare-numeric`): what they told is known before the first test.
    everything : bool
        Whether candidates that are not chosen are judged as closely as those that are (seconds): by the weights that a
        fit will find, and between two laws by a fit of their own.

    Raises
    ------
    SceneError
        A range is empty, or the bounds forbid all candidates.
    UsageError
        The law cannot be, no candidate tells anything about it, or no test fits the time.
    """
    if tests is not None and tests < 1:
        raise UsageError(f"tests: expected at least 1; got {tests}")
    lab = laboratory(scene, law, measured)
    check_free(lab, aim)
    possible = candidates(lab)
    reference = reference_of(lab, possible)
    virtual = [virtual_test(lab, reference, candidate) for candidate in possible]
    allowed = _allowed(lab, virtual)
    limits = Limits(laboratory_time(scene, possible), allowed, tests or MOST, math.inf, scene.plan.most_repeats)
    limits = limits if hours is None else limits.within(hours * HOUR)
    unknowns = next(v.posterior.unknowns for v in virtual if v.posterior is not None)
    if against is None:
        order = pick(_least_error(lab, reference, virtual, unknowns, aim, measured), limits)
        some = np.flatnonzero(allowed) if everything else np.unique(order)
        between, over = None, {int(i): evidence_over(lab, reference, virtual[i], "coulomb") for i in some}
    else:
        between = Between.of(lab, reference, virtual, against, limits)
        order, over = pick(between.gain, between.limits), {}
        between = between.judged(np.flatnonzero(between.limits.allowed) if everything else np.unique(order))
    rows = _Rows(lab, reference, virtual, limits.time, between, over, measured)
    chosen = tuple(rows.test(i, order[: rank + 1]) for rank, i in enumerate(order))
    decided = [rank for rank, test in enumerate(chosen, 1) if (test.log_bayes_after or 0.0) >= REQUIRED]
    chosen = chosen[: decided[0]] if decided and tests is None else chosen
    rest = [int(i) for i in np.flatnonzero(allowed) if i not in set(order[: len(chosen)])]
    law_name = lab.law.name
    return Plan(law_name, against, chosen, tuple(rows.test(i) for i in rest), _notes(lab, chosen, against))


def waiting(scene: Scene, law: str | None = None, against: str | None = None) -> str | None:
    """How long a plan under laws without exact slides will take, in words; None where it takes seconds.

    Raises
    ------
    SceneError, UsageError
        As `plan_tests`.
    """
    lab = laboratory(scene, law)
    laws = [lab.law] if against is None else [lab.law, lab.under(against).law]
    slow, count = [one.name for one in laws if not one.is_exact], len(candidates(lab))
    minutes = 9.0 * SLOW * len(slow) * count / 60.0
    if minutes < 0.5:
        return None
    lists = "shorter lists in [plan] take less"
    return f"plan: {count} candidates under {' and '.join(slow)} take some {minutes:.0f} minutes: {lists}"


def _allowed(lab: Laboratory, tests: Sequence[VirtualTest]) -> BoolArray:
    """Which candidates the rig allows and say something."""
    largest = lab.scene.plan.largest_response_m
    response = np.array([test.response_m for test in tests])
    inside = np.ones(len(tests), dtype=bool) if largest is None else ~(response > largest)
    if not inside.any():
        raise SceneError(
            f"plan.largest_response_m: {largest:g} m forbids all candidates; the least response expected is"
            f" {np.nanmin(response):.3g} m"
        )
    tells = np.array([test.information is not None for test in tests])
    if not (inside & tells).any():
        raise UsageError(
            f"law {lab.law.name}: no candidate tells anything: the mass stands still or has no steady state in all of"
            " them, or would if friction were one standard error higher; change normal_forces_n, base_amplitudes_m or"
            " frequency_ratios of [plan], or narrow friction_coefficient"
        )
    return np.asarray(inside)


def _least_error(
    lab: Laboratory,
    reference: Reference,
    tests: Sequence[VirtualTest],
    unknowns: Sequence[Unknown],
    aim: Sequence[str],
    measured: Sequence[Mapping[str, object]],
) -> Gain:
    """What each candidate adds to tests chosen: the fall of the logarithm of the parameters' joint uncertainty."""
    m = len(unknowns)
    middle = _middle_values(lab, reference)
    holds = np.diag([1.0] * m) + known_before(lab, unknowns, middle, measured)
    counted = np.array([u.law and (not aim or u.name in aim) for u in unknowns])
    information = np.zeros((len(tests), m, m))
    for i, test in enumerate(tests):
        if test.information is not None:
            s = between_tests(lab, unknowns, middle["beta"], test.candidate.duration_s)
            own = test.information
            inner = np.eye(m) + (s[:, None] * own) * s
            information[i] = own - (own * s) @ np.linalg.solve(inner, s[:, None] * own)
    silent = np.array([test.information is None for test in tests])

    def spread(precision: FloatArray) -> FloatArray:
        left = np.linalg.inv(precision)[..., counted, :][..., counted]
        return np.asarray(0.5 * np.linalg.slogdet(left)[1])

    def gain(order: Sequence[int]) -> FloatArray:
        total = holds + information[np.asarray(order, dtype=np.intp)].sum(axis=0)
        return np.where(silent, -math.inf, spread(total) - spread(total + information))

    return gain


def _middle_values(lab: Laboratory, reference: Reference) -> dict[str, float]:
    r = reference.turn / (2.0 * math.pi * lab.natural_frequency_hz)
    return values_in(lab, reference, Candidate(r, reference.force, reference.amplitude, 0.0))


def known_before(
    lab: Laboratory,
    unknowns: Sequence[Unknown],
    values: Mapping[str, float],
    measured: Sequence[Mapping[str, object]],
) -> FloatArray:
    """Return what is known of the law's parameters before the first test, as information on their coordinates."""
    known = np.zeros((len(unknowns), len(unknowns)))
    found = told_together(measured, lab.scene.plan.repeatability)
    coefficient = found.get("friction_coefficient")
    for k, u in enumerate(unknowns):
        if not u.law:
            continue
        slope = u.slope(u.at(values[u.name])) if values[u.name] or u.scale == "linear" else 0.0
        if u.name == "beta":
            value, error = lab.coefficient if coefficient is None else (coefficient.value, coefficient.u)
            known[k, k] = (slope / (values["beta"] * error / value)) ** 2
        elif u.name in found:
            known[k, k] = (slope / found[u.name].u) ** 2
    return known


@dataclass(frozen=True)
class LaboratoryTime:
    """What tests cost, s: ``running`` (n,) each time; ``change_force``, ``change_drive`` once for each of their groups.

    ``force``, ``drive`` (n,): number of the group that shares a normal force, or that and the motion of the base.
    """

    running: FloatArray
    force: NDArray[np.intp]
    drive: NDArray[np.intp]
    change_force: float
    change_drive: float

    def more(self, order: Sequence[int]) -> FloatArray:
        """Time (n,) that each candidate would add to tests already chosen."""
        chosen = np.asarray(order, dtype=np.intp)
        new_force = ~np.isin(self.force, self.force[chosen])
        new_drive = ~np.isin(self.drive, self.drive[chosen])
        return np.asarray(self.running + self.change_force * new_force + self.change_drive * new_drive)

    def total(self, order: Sequence[int]) -> float:
        """Time of some tests together."""
        chosen = np.asarray(order, dtype=np.intp)
        changes = self.change_force * len(set(self.force[chosen])) + self.change_drive * len(set(self.drive[chosen]))
        return float(self.running[chosen].sum()) + changes


def laboratory_time(scene: Scene, tests: Sequence[Candidate]) -> LaboratoryTime:
    """Return what tests cost by ``[plan]``: each weight is put on once, each motion of the base set once for it."""
    plan = scene.plan
    drives = [(t.normal_force_n, t.base_amplitude_m, t.frequency_ratio) for t in tests]
    forces = {force: i for i, force in enumerate(dict.fromkeys(t.normal_force_n for t in tests))}
    numbers = {drive: i for i, drive in enumerate(dict.fromkeys(drives))}
    return LaboratoryTime(
        np.array([t.duration_s + plan.setup_s for t in tests]),
        np.array([forces[t.normal_force_n] for t in tests]),
        np.array([numbers[drive] for drive in drives]),
        plan.change_force_s,
        plan.change_drive_s,
    )


@dataclass(frozen=True)
class Limits:
    """What a choice keeps to: laboratory time, bounds of the rig, ``tests`` and ``budget`` (s) at most."""

    time: LaboratoryTime
    allowed: NDArray[np.bool_]
    tests: int
    budget: float
    most_repeats: int | None

    def within(self, budget: float) -> "Limits":
        """Return the same with so much laboratory time, s."""
        return replace(self, budget=budget)

    def free(self, order: Sequence[int]) -> NDArray[np.bool_]:
        """Which candidates may follow tests chosen."""
        fits = self.time.total(order) + self.time.more(order) <= self.budget
        return np.asarray(self.allowed & fits & (self.often(order) < (self.most_repeats or math.inf)))

    def often(self, order: Sequence[int]) -> NDArray[np.intp]:
        """How often each candidate is chosen."""
        return np.bincount(np.asarray(order, dtype=np.intp), minlength=len(self.allowed))


def pick(gain: Gain, limits: Limits) -> list[int]:
    """Indices of the tests chosen, best first.

    Each is the one that tells most for the time it adds. What the first tell beside nothing is no measure of what they
    tell beside the rest: so each is put to the test again beside all others, and the set is ranked once more.
    """
    order = _filled([], gain, limits)
    if not order:
        least = float(limits.time.more([])[limits.allowed].min()) / HOUR
        raise UsageError(f"hours: {limits.budget / HOUR:g} are less than any test takes: expected at least {least:.3g}")
    for _ in range(SWEEPS):
        before = list(order)
        for k in range(len(order)):
            rest = [*order[:k], *order[k + 1 :]]
            order[k] = _next(rest, gain, limits, limits.free(rest))
        order = _filled(order, gain, limits)
        if sorted(order) == sorted(before):
            break
    return _ranked(order, gain, limits)


def _filled(order: list[int], gain: Gain, limits: Limits) -> list[int]:
    """Tests chosen, and more as long as number and time allow."""
    order = list(order)
    while len(order) < limits.tests and (free := limits.free(order)).any():
        order.append(_next(order, gain, limits, free))
    return order


def _next(order: list[int], gain: Gain, limits: Limits, free: NDArray[np.bool_]) -> int:
    """The candidate that tells most beside tests chosen, for the time it adds."""
    more, told = limits.time.more(order), gain(order) * (1.0 - AGAIN * limits.often(order))
    rate = np.where(told > 0.0, told / more, told * more)
    return int(np.argmax(np.where(free, rate, -math.inf)))


def _ranked(chosen: list[int], gain: Gain, limits: Limits) -> list[int]:
    """The tests chosen, best first."""
    order: list[int] = []
    while len(order) < len(chosen):
        left = limits.often(chosen) > limits.often(order)
        order.append(_next(order, gain, limits, left))
    return order


def _notes(lab: Laboratory, tests: Sequence[PlannedTest], against: str | None) -> tuple[str, ...]:
    """What is assumed, and what the plan will not do."""
    plan, notes = lab.scene.plan, lab.notes
    if len(tests) > 1 and not plan.repeatability and not plan.drift_per_hour:
        notes = (*notes, "plan.repeatability: not given: friction is taken to be the same in every test")
    if against is not None and "breakaway" in f"{lab.law.name}+{against}":
        notes = (*notes, "against: motions jump with break-away: the evidence may come out some ten times lower")
    after = tests[-1].log_bayes_after
    if against is not None and after is not None and after < REQUIRED:
        laws = f"{lab.law.name} from {against}"
        said = f"{REQUIRED:g} decides, {after:.2g} is expected; allow more tests, or larger values in plan.expected"
        notes = (*notes, f"against: these tests are not expected to tell {laws}: {said}")
    return notes


@dataclass(frozen=True)
class _Rows:
    """Candidates as rows of a plan."""

    lab: Laboratory
    reference: Reference
    tests: Sequence[VirtualTest]
    time: LaboratoryTime
    between: Between | None
    over: Mapping[int, float | None]
    measured: Sequence[Mapping[str, object]]

    def test(self, i: int, order: Sequence[int] | None = None) -> PlannedTest:
        """One candidate as a row; `order`: the tests up to it, if it is chosen."""
        test, candidate = self.tests[i], self.tests[i].candidate
        values = values_in(self.lab, self.reference, candidate)
        names = self.lab.free
        estimates = {} if test.posterior is None else test.posterior.parameters(0)
        se, u = ({name: getattr(estimates.get(name), key, None) for name in names} for key in ("se", "u"))
        after_se, after_u = (None, None) if order is None else self._after(i, order)
        evidence = {"log_bayes": self.over.get(i)} if self.between is None else self.between.row(i, order)
        response = test.response_m
        return PlannedTest(
            rank=None if order is None else len(order),
            frequency_ratio=candidate.frequency_ratio,
            normal_force_n=candidate.normal_force_n,
            base_amplitude_m=candidate.base_amplitude_m,
            duration_s=candidate.duration_s,
            regime=None if test.state is None else test.state.regime,
            response_m=response if math.isfinite(response) else None,
            expected=se,
            expected_u=u,
            cumulative=after_se,
            cumulative_u=after_u,
            laboratory_s=float(self.time.more([] if order is None else order[:-1])[i]),
            total_s=None if order is None else self.time.total(order),
            drive_frequency_hz=candidate.frequency_ratio * self.lab.natural_frequency_hz,
            values={name: values[name] for name in names},
            told={name: bool(estimates and estimates[name].told) for name in names},
            **evidence,
        )

    def _after(self, i: int, order: Sequence[int]) -> tuple[dict[str, float | None], dict[str, float | None]]:
        """Standard errors and combined uncertainties of the shared parameters after some tests, in test i's units."""
        plan = self.lab.scene.plan
        chosen = [self.tests[k] for k in order if self.tests[k].posterior is not None]
        names = self.lab.free
        if not chosen:
            return dict.fromkeys(names), dict.fromkeys(names)
        drift = 0.5 * plan.drift_per_hour * max(t.candidate.duration_s for t in chosen) / HOUR
        scatter = {"beta": math.hypot(plan.repeatability, drift)}
        values, here = (values_in(self.lab, self.reference, t.candidate) for t in (chosen[0], self.tests[i]))
        whole, held = (together(chosen, scatter, rig=rig) for rig in (True, False))
        errors = []
        for joint in (whole, held):
            known = known_before(self.lab, joint.unknowns, values, self.measured)
            covariance = np.linalg.inv(np.linalg.inv(joint.covariance) + known)
            errors.append({u.name: math.sqrt(c) for u, c in zip(joint.unknowns, np.diag(covariance), strict=True)})
        se, u = dict[str, float | None](), dict[str, float | None]()
        for unknown, c in zip(held.unknowns, held.fit.point, strict=True):
            name, first = unknown.name, values[unknown.name]
            times = abs(unknown.slope(float(c))) * (abs(here[name] / first) if first else 1.0)
            u[name] = times * errors[0][name]
            se[name] = times * min(errors[1][name], errors[0][name])
        return se, u
