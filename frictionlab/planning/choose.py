"""Which tests to run: one after the other, the one that tells most for its laboratory time beside those before it."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import SceneError, UsageError
from frictionlab.identification.coordinates import doubts, pulled
from frictionlab.identification.identify import SURE, TOLD
from frictionlab.identification.ladder import REQUIRED
from frictionlab.planning.apart import Apart, apart_of, known_or_none, over_coulomb
from frictionlab.planning.candidates import candidates, check_free, laboratory, told_together
from frictionlab.planning.hours import LaboratoryTime, laboratory_time
from frictionlab.planning.information import Told, of_contact, told_by
from frictionlab.planning.outlook import Outlook, outlook_of
from frictionlab.planning.plan import Plan, PlannedTest
from frictionlab.planning.weights import Seen, as_weighed, joint_information, seen_by_fit, weighed
from frictionlab.scene import Scene
from frictionlab.simulator.engine import choose
from frictionlab.simulator.kernel import layout
from frictionlab.simulator.sweep import named

FloatArray = NDArray[np.float64]
SLIDES = 100.0  # to see what one candidate tells, roughly
SWEEPS = 2  # through the tests chosen, each put to the test again
SLOW = 1.0  # s that a law without exact slides takes to see what one candidate tells, roughly
ROUNDS = 3  # of a choice by what tests tell roughly and of a closer look at those chosen
NEAR = 40  # candidates of a choice between two laws to which both are fitted, at least
AGAIN = 1e-9  # of what a test tells: a tie goes to one not chosen yet
HOUR = 3600.0


def plan_tests(
    scene: Scene,
    *,
    law: str | None = None,
    against: str | None = None,
    tests: int = 10,
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
        How many at most.
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
    if tests < 1:
        raise UsageError(f"tests: expected at least 1; got {tests}")
    lab = laboratory(scene, law, measured)
    check_free(lab, aim)
    possible = candidates(lab)
    choose(SLIDES * _work(len(possible), tests, between=against is not None))
    outlook, time = outlook_of(lab, possible), laboratory_time(scene, possible)
    told = told_by(outlook)
    allowed = _allowed(outlook, told)
    known = np.eye(len(outlook.coordinates)) + _told_before(measured, outlook)
    limits = _Limits(time, allowed, tests, math.inf if hours is None else hours * HOUR, scene.plan.most_repeats)
    if against is None:
        order, seen = _best_known(outlook, told, known, _aimed(outlook, aim), limits)
        some = np.flatnonzero(allowed) if everything else np.unique(order)
        seen |= seen_by_fit(outlook, [i for i in some.tolist() if i not in seen])
        row = _alone(over_coulomb(outlook, told, seen))
    else:
        open_to, between = _near(apart_of(outlook, told, against), limits)
        order = _pick(between.gain, open_to)
        some = np.flatnonzero(open_to.allowed) if everything else np.unique(order)
        seen = seen_by_fit(outlook, some.tolist())
        row = between.fitted(some).judged(seen).row
    every = _Every(outlook, weighed(outlook, told, seen), time, known, row)
    rest = [int(i) for i in np.flatnonzero(allowed) if i not in set(order)]
    chosen = tuple(every.test(i, order[: rank + 1]) for rank, i in enumerate(order))
    notes = _notes(outlook, chosen, against)
    return Plan(outlook.lab.law.name, against, chosen, tuple(every.test(i) for i in rest), notes)


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
    minutes = SLOW * len(slow) * (count + (3 * min(count, NEAR) if against is not None else 0)) / 60.0
    if minutes < 0.5:
        return None
    lists = "shorter lists in [plan] take less"
    return f"plan: {count} candidates under {' and '.join(slow)} take some {minutes:.0f} minutes: {lists}"


def _work(count: int, tests: int, *, between: bool) -> float:
    """What a plan simulates, over what one candidate's information takes, roughly."""
    chosen = min(count, tests)
    return 3.0 * count + 14.0 * min(count, NEAR) + 4.0 * chosen if between else count + 8.0 * chosen


EvidenceRow = Callable[[int, Sequence[int] | None], dict[str, float | None]]


def _alone(evidence: FloatArray) -> EvidenceRow:
    """Evidence of single tests for the rows of a plan."""
    return lambda i, order: {"log_bayes": known_or_none(float(evidence[i]))}  # noqa: ARG005


def _best_known(
    outlook: Outlook, told: Told, known: FloatArray, aim: NDArray[np.bool_], limits: "_Limits"
) -> tuple[list[int], dict[int, Seen]]:
    """Tests for the least error, and those looked at: what all tell roughly chooses them, and a closer look again."""
    joint, looked_at = as_weighed(outlook, told).own.copy(), dict[int, Seen]()
    for _ in range(ROUNDS):
        order = _pick(_least_error(of_contact(outlook, joint), known, aim), limits)
        new = seen_by_fit(outlook, sorted(set(order) - looked_at.keys()))
        if not new:
            break
        looked_at |= new
        for i, seen in new.items():
            joint[i] = joint_information(seen) if told.tells[i] else 0.0
    return _pick(_least_error(of_contact(outlook, joint), known, aim), limits), looked_at


def _near(between: Apart, limits: "_Limits") -> tuple["_Limits", Apart]:
    """Two laws, each at its own best values for the candidates that promise most about their first values."""
    limits = replace(limits, allowed=limits.allowed & between.tells)
    if not limits.allowed.any():
        raise UsageError(
            f"against: the candidates that plan.largest_response_m allows tell nothing of {between.against}: allow a"
            " larger response, or change the ranges of [plan]"
        )
    rate = np.where(limits.allowed, between.gain([]) / limits.time.more([]), -math.inf)
    return limits, between.fitted(np.argsort(-rate)[: max(NEAR, 4 * limits.tests)])


def _aimed(outlook: Outlook, aim: Sequence[str]) -> NDArray[np.bool_]:
    return np.array([c.law and (not aim or c.name in aim) for c in outlook.coordinates])


def _allowed(outlook: Outlook, told: Told) -> NDArray[np.bool_]:
    """Which candidates the rig allows, if any of them tells anything."""
    largest, law = outlook.lab.scene.plan.largest_response_m, outlook.lab.law.name
    response = _responses(outlook, told)
    inside = np.ones(len(response), dtype=bool) if largest is None else ~(response > largest)
    if not inside.any():
        raise SceneError(
            f"plan.largest_response_m: {largest:g} m forbids all candidates; the least response expected is"
            f" {np.nanmin(response):.3g} m"
        )
    if not (inside & told.tells).any():
        raise UsageError(
            f"law {law}: no candidate tells anything: the mass stands still or has no steady state in all of them, or"
            " would if friction were one standard error higher; change normal_forces_n, base_amplitudes_m or"
            " frequency_ratios of [plan], or narrow friction_coefficient"
        )
    return inside


def _responses(outlook: Outlook, told: Told) -> FloatArray:
    return np.asarray(told.here.rows[:, layout.AMPLITUDE] * outlook.columns.amplitude)


Gain = Callable[[Sequence[int]], FloatArray]


def _least_error(information: FloatArray, known: FloatArray, aim: NDArray[np.bool_]) -> Gain:
    """What each candidate adds to tests chosen: the fall of the logarithm of the parameters' joint uncertainty."""

    def gain(order: Sequence[int]) -> FloatArray:
        total = known + information[np.asarray(order, dtype=np.intp)].sum(axis=0)
        return _spread(total, aim) - _spread(total + information, aim)

    return gain


def _spread(precision: FloatArray, aim: NDArray[np.bool_]) -> FloatArray:
    """Half the log determinant of the covariance's block that counts."""
    left = np.linalg.inv(precision)[..., aim, :][..., aim]
    return np.asarray(0.5 * np.linalg.slogdet(left)[1])


@dataclass(frozen=True)
class _Limits:
    """What a choice keeps to: laboratory time, bounds of the rig, ``tests`` and ``budget`` (s) at most."""

    time: LaboratoryTime
    allowed: NDArray[np.bool_]
    tests: int
    budget: float
    most_repeats: int | None

    def free(self, order: Sequence[int]) -> NDArray[np.bool_]:
        """Which candidates may follow tests chosen."""
        fits = self.time.total(order) + self.time.more(order) <= self.budget
        return np.asarray(self.allowed & fits & (self.often(order) < (self.most_repeats or math.inf)))

    def often(self, order: Sequence[int]) -> NDArray[np.intp]:
        """How often each candidate is chosen."""
        return np.bincount(np.asarray(order, dtype=np.intp), minlength=len(self.allowed))


def _pick(gain: Gain, limits: _Limits) -> list[int]:
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


def _filled(order: list[int], gain: Gain, limits: _Limits) -> list[int]:
    """Tests chosen, and more as long as number and time allow."""
    order = list(order)
    while len(order) < limits.tests and (free := limits.free(order)).any():
        order.append(_next(order, gain, limits, free))
    return order


def _next(order: list[int], gain: Gain, limits: _Limits, free: NDArray[np.bool_]) -> int:
    """The candidate that tells most beside tests chosen, for the time it adds."""
    more, told = limits.time.more(order), gain(order) * (1.0 - AGAIN * limits.often(order))
    rate = np.where(told > 0.0, told / more, told * more)
    return int(np.argmax(np.where(free, rate, -math.inf)))


def _ranked(chosen: list[int], gain: Gain, limits: _Limits) -> list[int]:
    """The tests chosen, best first."""
    order: list[int] = []
    while len(order) < len(chosen):
        left = limits.often(chosen) > limits.often(order)
        order.append(_next(order, gain, limits, left))
    return order


def _notes(outlook: Outlook, tests: Sequence[PlannedTest], against: str | None) -> tuple[str, ...]:
    """What is assumed, and what the plan will not do."""
    plan, notes = outlook.lab.scene.plan, outlook.lab.notes
    if len(tests) > 1 and not plan.repeatability and not plan.drift_per_hour:
        notes = (*notes, "plan.repeatability: not given: friction is taken to be the same in every test")
    if against is not None and "breakaway" in f"{outlook.lab.law.name}+{against}":
        notes = (*notes, "against: motions jump with break-away: the evidence may come out some ten times lower")
    after = tests[-1].log_bayes_after
    if against is not None and after is not None and after < REQUIRED:
        laws = f"{outlook.lab.law.name} from {against}"
        said = f"{REQUIRED:g} decides, {after:.2g} is expected; allow more tests, or larger values in plan.expected"
        notes = (*notes, f"against: these tests are not expected to tell {laws}: {said}")
    return notes


class _Every:
    """Candidates as rows of a plan; what they share is computed once."""

    def __init__(self, outlook: Outlook, told: Told, time: LaboratoryTime, known: FloatArray, row: EvidenceRow) -> None:
        self.outlook, self.told, self.time, self.known, self.row = outlook, told, time, known, row
        self.names = [c.name for c in outlook.coordinates if c.law]
        self.units, self.values = _units(outlook), outlook.values(outlook.expected)
        self.law = law = np.flatnonzero(outlook.law)
        held = _deviations((np.eye(len(known)) + told.own)[:, law[:, None], law])
        self.doubt = doubts(outlook.coordinates, outlook.expected)
        joint = np.maximum(_combined(np.eye(len(known)) + told.joint, self.doubt)[:, law], held)
        self.expected, self.expected_u, self.is_told = held * self.units, joint * self.units, self._sure(joint)
        self.of_contact = of_contact(outlook, told.joint)
        self.tells = told.tells
        self.regimes = named(told.here.rows)["regime"]
        self.responses = _responses(outlook, told)
        self.more = time.more([])

    def _sure(self, spread: FloatArray) -> NDArray[np.bool_]:
        """Whether tests tell the law's parameters, by the rule of a fit: known better, and away from doing nothing."""
        outlook, law = self.outlook, self.law
        away = np.array([_from_neutral(outlook, int(i)) for i in law])
        at_all = np.array([outlook.coordinates[i].name == "beta" or outlook.coordinates[i].is_log for i in law])
        return np.asarray((spread**2 < TOLD) & (at_all | (np.abs(away) > SURE * spread)))

    def test(self, i: int, order: Sequence[int] | None = None) -> PlannedTest:
        """One candidate as a row; `order`: the tests up to it, if it is chosen."""
        columns, tells = self.outlook.columns, bool(self.tells[i])
        return PlannedTest(
            rank=None if order is None else len(order),
            frequency_ratio=float(columns.r[i]),
            normal_force_n=float(columns.force[i]),
            base_amplitude_m=float(columns.amplitude[i]),
            duration_s=float(columns.duration[i]),
            regime=str(self.regimes[i]) or None,
            response_m=float(self.responses[i]) if math.isfinite(self.responses[i]) else None,
            expected=self._named(self.expected[i], tells=tells),
            expected_u=self._named(self.expected_u[i], tells=tells),
            cumulative=None if order is None else self._after(i, order, held=True),
            cumulative_u=None if order is None else self._after(i, order, held=False),
            laboratory_s=float(self.more[i] if order is None else self.time.more(order[:-1])[i]),
            total_s=None if order is None else self.time.total(order),
            drive_frequency_hz=float(columns.drive_hz[i]),
            values={name: float(self.values[name][i]) for name in self.names},
            told={name: bool(told) for name, told in zip(self.names, self.is_told[i], strict=True)},
            **self.row(i, order),
        )

    def _named(self, errors: FloatArray, *, tells: bool) -> dict[str, float | None]:
        return {name: float(e) if tells else None for name, e in zip(self.names, errors, strict=True)}

    def _after(self, i: int, order: Sequence[int], *, held: bool) -> dict[str, float | None]:
        some, law = np.asarray(order), self.law
        spread = _deviations((self.known + self.told.information[some].sum(axis=0))[np.ix_(law, law)])
        if not held:
            spread = np.maximum(spread, _combined(self.known + self.of_contact[some].sum(axis=0), self.doubt)[law])
        return self._named(spread * self.units[i], tells=True)


def _units(outlook: Outlook) -> FloatArray:
    """Change (n, l) of the law's parameters, in each test's own units, by one deviation of their coordinates."""
    values = outlook.values(outlook.expected)
    law = [(i, c) for i, c in enumerate(outlook.coordinates) if c.law]
    return np.stack([c.width * (values[c.name] if c.is_log else outlook.scales[:, i]) for i, c in law], axis=1)


def _deviations(precision: FloatArray) -> FloatArray:
    return _combined(precision, np.ones(precision.shape[-1]))


def _combined(precision: FloatArray, doubt: FloatArray) -> FloatArray:
    """Deviations to state: of the covariance, with what priors whose tails reach farther add to it (`pulled`).

    As a fit states them (`frictionlab.identification.fit_errors.errors_of`).
    """
    left: FloatArray = np.asarray(np.linalg.inv(precision))
    more = (pulled(left, doubt) ** 2 - left**2).sum(axis=-1)
    return np.asarray(np.sqrt(np.diagonal(left, axis1=-2, axis2=-1) + more))


def _from_neutral(outlook: Outlook, i: int) -> float:
    """Coordinate of the expected value, counted from where its term does nothing."""
    c, expected = outlook.coordinates[i], float(outlook.expected[i])
    return expected - (c.low if c.folded else 0.0 if not c.is_log else -3.0)


def _told_before(measured: Sequence[Mapping[str, object]], outlook: Outlook) -> FloatArray:
    """Information of comparisons at hand, by the uncertainties that they state."""
    known = np.zeros((len(outlook.coordinates), len(outlook.coordinates)))
    told = told_together(measured, outlook.lab.scene.plan.repeatability)
    for i, c in enumerate(outlook.coordinates):
        name = "friction_coefficient" if c.name == "beta" and "friction_coefficient" in told else c.name
        if c.law and name in told and told[name].value != 0.0:
            known[i, i] = (c.width * (abs(told[name].value) if c.is_log else 1.0) / told[name].u) ** 2
    return known
