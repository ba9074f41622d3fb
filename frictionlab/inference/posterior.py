"""Tests and a law -> posterior: values with one covariance, from which errors, budgets and limits follow.

Data errors e and prior errors c leave ``K e + (1 - K J) c`` in the values found, and ``1 - K J`` is the posterior
covariance P. So the variance of a value is ``(P A P)_ii`` by the data and ``P_ik^2`` by the prior of each unknown k:
the standard error `se` counts the data and the law's priors, the combined uncertainty `u` all of them, and the budget
is the list of these terms.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import gammaincinv, ndtr, ndtri

from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError
from frictionlab.inference.fit import (
    Fit,
    Model,
    Test,
    beside_deviations,
    cost,
    fit_at,
    fit_from,
    let_apart,
    tempered,
    with_scatter,
)
from frictionlab.inference.observation import Observation, Reached, at_least
from frictionlab.inference.starts import starting_points
from frictionlab.inference.unknowns import STRAINED, Unknown
from frictionlab.simulator.laws import Law
from frictionlab.uncertainty import LEVEL, NORMAL, NOT_KNOWN, Estimate

EXPLAINED = 2.0  # misfit up to which a law explains a cycle: the cycles' own scatter is known to a factor of 2 at most
NOISE_LEVEL = 0.01  # of chi-square, beyond which a misfit is no noise
TOLD = 0.5  # a parameter is determined if its variance has fallen below this share of its prior's ...
SURE = 2.0  # ... and it lies so many errors from where its term does nothing
CORRECTED = 9.0  # by which correcting sensors and rig must lower the sum of squares: three errors of one of them
SAME = 0.1  # standard deviations of a prior, or share of those moved: two ends of a descent so close are one minimum
RIVAL = 9.0  # chi-square within which another minimum is a rival
NOISE = "noise and misfit"
AS_KNOWN = "sensors and rig as known, or as fitted"
MISSED = "the law itself"
PRIOR = "prior of the friction ratio"
WIDER = 4.0  # times: prior of a lag that nobody has declared, where several tests determine it
SAYS = 1e-9  # of what is known with the data: a direction of which they say less is left out
BENDS = ("parabola", "cubic", "base_parabola", "base_cubic")  # of sensors: as large as the cycle fills their range


@dataclass(frozen=True, slots=True)
class ParameterEstimate(Estimate):
    """One parameter of a law; ``se``: with sensors and rig as they are known, None (as `u`) for a value that was given.

    ``told``: whether the data determine it; ``lower``, ``upper``: 95 % limits, None where there is no limit.
    """

    value: float
    told: bool = False
    lower: float | None = None
    upper: float | None = None


@dataclass(frozen=True)
class Posterior:
    """What tests say of their laws, sensors and rig.

    ``fit``: best values; ``information``: what each test's data say of its own coordinates, with the scatter of the
    cycles and the misfit counted; ``scatter`` (m,): from test to test, that errors count (`Fit.scatter_to_count`), in
    coordinates; ``shifts``: source -> systematic distance (m,), in coordinates, that errors hold in quadrature;
    ``held_se`` (m,): standard errors of the coordinates where sensors and rig are held as they are known.
    """

    fit: Fit
    information: tuple[FloatArray, ...]
    scatter: FloatArray
    shifts: Mapping[str, FloatArray] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    held_se: FloatArray | None = None

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """All unknowns, in the order of the covariance."""
        return self.fit.model.unknowns

    @property
    def tests(self) -> tuple[Test, ...]:
        """The tests."""
        return self.fit.model.tests

    @cached_property
    def observations(self) -> tuple[Any, ...]:
        """What was observed of each test, of whatever kind."""
        return tuple(test.observation for test in self.tests)

    def law(self, i: int = 0) -> Law:
        """Law of test i."""
        return self.tests[i].observation.law

    def values(self, i: int = 0) -> dict[str, float]:
        """Best values of test i by name, dimensionless in this test."""
        return self.fit.values(i)

    @cached_property
    def _eliminated(self) -> tuple[FloatArray, tuple[FloatArray, ...]]:
        """Information of all tests on the unknowns (m, m), deviations from test to test integrated over, and each's."""
        m = len(self.unknowns)
        total, each = np.zeros((m, m)), []
        for test, information in zip(self.tests, self.information, strict=True):
            size, axes = np.linalg.eigh(information)
            root = np.sqrt(np.maximum(size, 0.0))[:, None] * axes.T
            white, _ = beside_deviations(root, root * self.scatter[test.index])
            left = white.T @ white
            total[np.ix_(test.index, test.index)] += left
            each.append(left)
        return total, tuple(each)

    @cached_property
    def plain(self) -> FloatArray:
        """Posterior covariance (m, m) of the coordinates by curvature."""
        return np.asarray(np.linalg.inv(self._eliminated[0] + np.diag(self.fit.model.holds(self.fit.point))))

    @cached_property
    def _doubts(self) -> FloatArray:
        """Standard deviations (m,) that errors of the priors have in the normal equations."""
        return np.array([u.doubt(float(c)) for u, c in zip(self.unknowns, self.fit.point, strict=True)])

    @cached_property
    def _of_data(self) -> FloatArray:
        """Covariance (m, m) of the coordinates by the data's own errors; of many tests at least what these show.

        `shown_by_scores` of more tests than unknowns holds, whatever each test assumes of its own noise.
        """
        of_each = np.asarray(self.plain @ self._eliminated[0] @ self.plain)
        tests, m = len(self.tests), len(self.unknowns)
        if tests <= m:
            return of_each
        scores = np.zeros((tests, m))
        for score, test, (_, pull) in zip(scores, self.tests, self.fit.reduced.each, strict=True):
            score[test.index] = pull
        return at_least(of_each, shown_by_scores(scores, self.fit.precision))

    @cached_property
    def covariance(self) -> FloatArray:
        """Posterior covariance (m, m) of the coordinates: data, priors with their tails, systematic distances.

        What is known of sensors and rig makes no value surer than where it is held as known.
        """
        left = self.plain * self._doubts
        shifted = sum((np.outer(s, s) for s in self.shifts.values()), np.zeros_like(self.plain))
        whole = np.asarray(self._of_data + left @ left.T + shifted)
        if len(self.tests) > 1:
            whole = at_least(whole, self._by_weights)
        return whole if self.held_se is None else at_least(whole, self.held_se**2)

    @cached_property
    def _by_weights(self) -> FloatArray:
        """Variances (m,) that noise and priors leave in the coordinates as the fit has weighed several tests.

        `plain` is what the best weights would leave: tests that assume too much noise would seem sure of each other.
        """
        of_scores, back = np.diag(self._doubts**2), np.linalg.inv(self.fit.precision)
        for test, (weight, _), information in zip(self.tests, self.fit.reduced.each, self.information, strict=True):
            noise = weight @ np.linalg.pinv(information, rcond=1e-12, hermitian=True) @ weight.T
            of_scores[np.ix_(test.index, test.index)] += noise
        return np.asarray(np.diag(back @ of_scores @ back))

    def own_covariance(self, i: int = 0) -> FloatArray:
        """Posterior covariance of test i's own coordinates, in the order of its index."""
        test = self.tests[i]
        s = self.fit.model.scatter[test.index]
        whole = self.covariance[np.ix_(test.index, test.index)]
        inner = np.eye(len(s)) + (s[:, None] * self.information[i]) * s
        local = (s[:, None] * np.linalg.inv(inner)) * s  # of S d, the mean known
        share = np.eye(len(s)) - local @ self.information[i]  # how the mean's error goes into the test's own
        return np.asarray(share @ whole @ share.T + local)

    def statistical(self, i: int = 0) -> FloatArray:
        """Standard errors of test i's own coordinates, sensors and rig as they are known."""
        index = self.tests[i].index
        if self.held_se is not None:
            return np.asarray(self.held_se[index])
        law = np.array([u.law for u in self.unknowns], dtype=bool)
        own = np.diag(self._of_data) + (self.plain[:, law] ** 2).sum(axis=1)
        share = own[index] / np.maximum(np.diag(self.covariance)[index], 1e-300)
        whole = np.diag(self.own_covariance(i))
        return np.asarray(np.where(law[index], np.sqrt(np.clip(share, 0.0, 1.0) * whole), 0.0))

    def shares(self, name: str, i: int = 0) -> dict[str, float]:
        """Return what each source adds to the uncertainty of a parameter of test i, in quadrature."""
        k = self.fit.find(name, i)
        if k is None:
            return {}
        place, slope = self.tests[i].place(k), self.slope(k, i)
        along = slope * (np.arange(len(self.unknowns)) == k)
        return self.shares_along(along, slope**2 * float(self.own_covariance(i)[place, place]))

    def shares_along(self, along: FloatArray, variance: float) -> dict[str, float]:
        """Return the same of a number that changes with the coordinates by ``along`` (m,), and has this variance."""
        each = zip(self.unknowns, (along @ self.plain).tolist(), self._doubts.tolist(), strict=True)
        shares = {u.name: abs(moved) * doubt for u, moved, doubt in each if not u.law}
        shares |= {source: size for source, s in self.shifts.items() if (size := abs(float(along @ s)))}
        return {NOISE: math.sqrt(max(variance - sum(share**2 for share in shares.values()), 0.0)), **shares}

    def slope(self, k: int, i: int = 0) -> float:
        """Return the change of an unknown's value in test i with its coordinate."""
        own = float(self.fit.own(i)[self.tests[i].place(k)])
        return self.unknowns[k].slope(own) * self.tests[i].factor(k)

    def shared(self, k: int, i: int) -> tuple[float, float]:
        """Return what all its tests share of an unknown, as a value in test i, and its change with the coordinate."""
        u, c, times = self.unknowns[k], float(self.fit.point[k]), self.tests[i].factor(k)
        return u.value(c) * times, u.slope(c) * times

    def relative(self, k: int) -> float:
        """Return the relative change of what all its tests share of an unknown with the coordinate."""
        u, c = self.unknowns[k], float(self.fit.point[k])
        return u.slope(c) / u.value(c)

    def estimate(self, name: str, i: int) -> Estimate:
        """Return what all its tests share of a law's unknown as a value in test i; not known where it is given.

        Its standard error is with sensors and rig as they are known.
        """
        k = self.fit.find(name, i)
        if k is None:
            return NOT_KNOWN
        value, slope = self.shared(k, i)
        law = np.flatnonzero([u.law for u in self.unknowns])
        known = self._eliminated[0] + np.diag(self.fit.model.holds(self.fit.point))
        alone = np.linalg.inv(known[np.ix_(law, law)])[np.ix_(law == k, law == k)]
        whole = math.sqrt(self.covariance[k, k])
        return Estimate(value, slope * min(math.sqrt(float(alone[0, 0])), whole), slope * whole)

    def parameters(self, i: int = 0) -> dict[str, ParameterEstimate]:
        """Return the parameters of test i's law with errors and limits, dimensionless in this test.

        One is ``told`` if it is known better than before, off its upper bound, and not where its term does nothing.
        """
        law, test, slopes = self.law(i), self.tests[i], self.fit.slopes[i]
        covariance, statistical, own = self.own_covariance(i), self.statistical(i), self.fit.own(i)
        given = test.observation.problem(self.values(i)).parameters
        found = {p.name: ParameterEstimate(given[p.name]) for p in law.parameters}
        for place, k in enumerate(test.index):
            u = self.unknowns[k]
            if not u.law:
                continue
            spread, c, times = math.sqrt(covariance[place, place]), float(own[place]), float(test.factors[place])
            neutral, apart = law.parameter(u.name).neutral, math.inf
            if neutral is not None and math.isfinite(neutral) and u.scale == "linear":
                apart = abs(c - u.at(neutral)) / spread
            told = spread**2 < TOLD and apart > SURE and c < u.high - 1e-3 and bool(slopes[:, place].any())
            limits = _limits(u, c, spread, told=told)
            if k in self.unseen:
                told, limits = False, (None, u.value(c + NORMAL * spread))
            lower, upper = (None if x is None else x * times for x in limits)
            slope = u.slope(c) * times
            found[u.name] = ParameterEstimate(
                u.value(c) * times, slope * float(statistical[place]), slope * spread, told, lower, upper
            )
        return found

    def nuisances(self, i: int = 0) -> dict[str, dict[str, float]]:
        """Return sensors and rig as found: name -> value, u, and what was known to (standard uncertainty)."""
        variance = np.diag(self.own_covariance(i))
        return {
            self.unknowns[k].name: {
                "value": self.unknowns[k].value(float(c)),
                "u": self.unknowns[k].slope(float(c)) * math.sqrt(variance[place]),
                "known_to": self.unknowns[k].sd * self.unknowns[k].known_to,
            }
            for place, (k, c) in enumerate(zip(self.tests[i].index, self.fit.own(i), strict=True))
            if self.unknowns[k].level == "rig"
        }

    @cached_property
    def unseen(self) -> tuple[int, ...]:
        """Friction ratios so far below what is usual that their priors keep them from 0 by more than their errors."""
        off = np.sqrt(np.diag(self.plain)) * self.fit.point
        return tuple(k for k, u in enumerate(self.unknowns) if (u.name, u.scale) == ("beta", "log") and off[k] < -1.0)

    @property
    def may_leave(self) -> float:
        """Chi-square by which values with sensors and rig as known may leave more than a fit that moves them."""
        return 0.0 if self.held_se is None else CORRECTED

    @property
    def strained(self) -> tuple[int, ...]:
        """Unknowns of sensors and rig that the fit had to move over three standard uncertainties."""
        law = self.fit.point
        return tuple(k for k, u in enumerate(self.unknowns) if not u.law and abs(float(law[k])) > STRAINED * u.known_to)

    def with_shift(self, source: str, shift: FloatArray) -> "Posterior":
        """Return the posterior with one more systematic distance (m,) in its errors."""
        old = self.shifts.get(source)
        return replace(self, shifts={**self.shifts, source: shift if old is None else np.hypot(old, shift)})

    def with_doubt(self, source: str, share: float) -> "Posterior":
        """Return the posterior whose friction ratio has one more error, a share of it."""
        shift, beta = np.zeros(len(self.unknowns)), self.fit.find("beta")
        if beta is None or not share:
            return self
        shift[beta] = share / self.relative(beta)
        return self.with_shift(source, shift)

    def left_out(self, i: int) -> tuple[FloatArray, FloatArray]:
        """Return what the other tests say of test i's coordinates: mean and covariance, its own scatter included.

        One linear step from the fit of all: without test i the normal equations lack its pull and its information.
        """
        test, model = self.tests[i], self.fit.model
        curvature, pull = self.fit.precision.copy(), np.zeros(len(self.unknowns))
        curvature[np.ix_(test.index, test.index)] -= self.fit.reduced.each[i][0]
        pull[test.index] = self.fit.reduced.each[i][1]
        moved = self.fit.point - np.linalg.solve(curvature, pull)
        without = self._eliminated[0] + np.diag(model.holds(self.fit.point))
        without[np.ix_(test.index, test.index)] -= self._eliminated[1][i]
        covariance = at_least(np.asarray(np.linalg.inv(without)), np.diag(self.covariance))
        s = self.scatter[test.index]
        return np.clip(moved, *model.bounds)[test.index], covariance[np.ix_(test.index, test.index)] + np.diag(s**2)


def shown_by_scores(scores: FloatArray, precision: FloatArray) -> FloatArray:
    """Return the variances (m,) that the scores (tests, m) at a fit show of its unknowns, precision (m, m).

    Each test has a score for every unknown, and a fit makes those of each sum to nothing: one test less, however many
    unknowns there are [K.-Y. Liang and S. L. Zeger, Biometrika 73 (1986) 13].
    """
    moved = scores @ np.linalg.inv(precision)
    return np.asarray((moved**2).sum(axis=0) * len(scores) / (len(scores) - 1))


def _limits(unknown: Unknown, c: float, spread: float, *, told: bool) -> tuple[float | None, float | None]:
    """95 % limits of a coordinate's value, its bound counted; a side that the data say nothing of has none."""
    mass = float(ndtr((c - unknown.low) / spread)) if unknown.low > -10.0 else 1.0  # posterior above the bound
    one = c + spread * float(ndtri(1.0 - (1.0 - LEVEL) * mass))
    two = [c + spread * float(ndtri(1.0 - q * mass)) for q in (0.5 + 0.5 * LEVEL, 0.5 - 0.5 * LEVEL)]
    if told or unknown.low <= -10.0:
        lower, upper = two
        if not told and unknown.scale == "log":  # toward where the term does nothing there is no limit
            return unknown.value(c - spread * float(ndtri(LEVEL))), None
        return unknown.value(max(lower, unknown.low)), unknown.value(upper)
    return None, unknown.value(one)


def limits_in_words(lower: float | None, upper: float | None) -> str:
    """Return the limits of a parameter as words; a side without one is not named."""
    if lower is None or upper is None:
        return "no limit" if lower is upper else f"at most {upper:.3g}" if lower is None else f"at least {lower:.3g}"
    return f"from {lower:.3g} to {upper:.3g}"


def misfit_is_noise(fit: Fit, i: int = 0) -> bool:
    """Whether what a fit leaves of test i is no more than noise would leave."""
    share = fit.model.tests[i].observation.share_missed(fit.residuals[i], fit.values(i))
    if share is not None:
        return share <= 0.0
    points = len(fit.residuals[i])
    return fit.excess(i) <= 2.0 * float(gammaincinv(0.5 * points, 1.0 - NOISE_LEVEL)) / points


def model_of(observations: Sequence[Observation], *, amontons: bool = True, rig: bool = True) -> Model:
    """Return tests and unknowns: one rig, for each material its law, scatters not yet known.

    ``amontons``: whether one friction coefficient serves all normal forces of a material, else a force at each;
    ``rig``: whether sensors and rig are unknown too.
    """
    unknowns: list[Unknown] = []
    places: dict[tuple[object, ...], int] = {}
    references: dict[object, Observation] = {}
    common, widths = _rig_unknowns(observations)
    tests = []
    for o, width in zip(observations, widths, strict=True):
        index, factors = [], []
        reference = references.setdefault(o.material, o)
        for u in (*o.law_unknowns, *(common if rig else ())):
            key: tuple[object, ...] = (u.name, o.material) if u.law else (u.name,)
            if u.name == "beta" and not amontons:
                key = (*key, o.normal_force)
            if key not in places:
                places[key] = len(unknowns)
                unknowns.append(u)
            index.append(places[key])
            factors.append(o.factor(u, reference, amontons=amontons) * width.get(u.name, 1.0))
        tests.append(Test(o, np.array(index, dtype=np.intp), np.array(factors)))
    return Model(tuple(tests), tuple(unknowns), np.zeros(len(unknowns)))


def _rig_unknowns(observations: Sequence[Observation]) -> tuple[tuple[Unknown, ...], list[dict[str, float]]]:
    """The rig's unknowns of some tests, and for each test how large a sensor's bend is over the largest one's.

    A lag that nobody has declared is known less than a single test assumes (it looks like a detuned frame there):
    several tests say what it is, and two of few would be pulled off by the narrow prior.
    """
    each = [{u.name: u for u in observation.rig_unknowns} for observation in observations]
    for known in each if len(observations) > 1 else ():
        lag = known.get("lag_s")
        if lag is not None and lag.assumed:
            known["lag_s"] = replace(lag, sd=WIDER * lag.sd, known_to=lag.known_to / WIDER, scatter=lag.scatter / WIDER)
    largest: dict[str, Unknown] = {}
    for known in each:
        largest |= {n: u for n, u in known.items() if n not in largest or u.sd > largest[n].sd}
    bends = {n: u.sd for n, u in largest.items() if n in BENDS}
    return tuple(largest.values()), [
        {n: (known[n].sd if n in known else 0.0) / sd for n, sd in bends.items()} for known in each
    ]


def information_of(fit: Fit, i: int) -> FloatArray:
    """Return what test i's data say of its own coordinates, in a fit: ``J A^-1 J`` of curvature J (Godambe).

    The weights of a fit are found from the cycles themselves and let these scatter too little, and a law's misfit is no
    white noise: ``A = (J + H) V (J + H)``, with the variance V that both really leave in the coordinates, and H what
    holds these beside the data. Where white noise is all there is, it is J itself. Directions of which the data say
    nothing say nothing here either.
    """
    slopes, test = fit.slopes[i], fit.model.tests[i]
    curvature = slopes.T @ slopes
    others: FloatArray = np.diag(fit.model.holds(fit.point))[np.ix_(test.index, test.index)]
    if len(fit.model.tests) > 1:
        rest = fit.precision.copy()
        rest[np.ix_(test.index, test.index)] -= fit.reduced.each[i][0]
        s = fit.model.scatter[test.index]
        others = np.asarray(np.linalg.inv(np.linalg.inv(rest)[np.ix_(test.index, test.index)] + np.diag(s**2)))
    gain: FloatArray = np.asarray(np.linalg.solve(curvature + others, slopes.T))
    shown = test.observation.covariance(
        Reached(fit.residuals[i], slopes, gain, others, fit.values(i), is_noise=misfit_is_noise(fit, i))
    )
    lower = np.linalg.cholesky(curvature + others)
    half = np.linalg.solve(lower, np.linalg.solve(lower, curvature).T)
    size, axes = np.linalg.eigh(0.5 * (half + half.T))
    kept = size > SAYS
    root = axes[:, kept] * np.sqrt(size[kept])
    inverse = axes[:, kept] / np.sqrt(size[kept])
    excess = inverse.T @ (lower.T @ shown @ lower) @ inverse
    back = lower @ root
    return np.asarray(back @ np.linalg.solve(excess, back.T))


def posterior_of(fit: Fit) -> Posterior:
    """Return the posterior about a fit; what a prior does to friction that is not seen is in its error."""
    found = Posterior(fit, tuple(information_of(fit, i) for i in range(len(fit.model.tests))), fit.scatter_to_count)
    for k in found.unseen:
        found = found.with_shift(PRIOR, found.plain[k] * fit.point[k])
    return found


def infer(
    observations: Sequence[Observation],
    *,
    near: Mapping[str, float] | None = None,
    at: FloatArray | None = None,
    most: int | None = None,
) -> Posterior:
    """Return what some tests, each under its law (`Observation.under`), say together of laws, sensors and rig.

    Sensors and rig are fitted beside the law, each held by what is known of it. Where the law alone leaves no more than
    noise, and correcting them gains little, the values with sensors and rig as they are known are given; their errors
    hold how far the other values stand from them. ``near``: values (of the first test) that a fit begins at too;
    ``at``: coordinates in `model_of` these tests, at which alone it begins; ``most``: steps.

    Raises
    ------
    AnalysisError
        The mass stands still, the loop takes in no energy, or no value tried has a steady state.
    """
    model = model_of(observations)
    model = model if most is None else replace(model, most=most)
    starts = starting_points(model, near) if at is None else [at]
    first = observations[0]
    law = [k for k, u in enumerate(model.unknowns) if u.law]
    held = None
    if len(observations) == 1 and not first.shows_rig:
        held, model, starts = _held(model, starts, law)
    fits, ends = list[Fit](), list[FloatArray]()
    missed = AnalysisError(f"law {first.law.name} has no motion at the values tried")
    for start in starts:
        try:
            begun = model
            if first.shows_rig:  # weighed by what this start leaves
                begun_at = first.begun(model.values(0, start))
                begun = replace(model, tests=(replace(model.tests[0], observation=begun_at),))
            fit = fit_from(begun, [start], tempers=False)
            if first.shows_rig:
                if any((np.abs(fit.point - end) < SAME * np.maximum(np.abs(end), 1.0)).all() for end in ends):
                    continue
                ends.append(fit.point)
                fit = tempered(fit)
        except AnalysisError as fault:
            missed = fault  # no steady state there; another start may have one
            continue
        if first.shows_rig or not fits or fit.cost <= 4.0 * min(f.cost for f in fits) + RIVAL:
            fits.append(fit)
        if first.shows_rig and misfit_is_noise(fit):
            break
    if not fits:
        raise missed
    moved = sorted((f if first.shows_rig else tempered(f) for f in fits), key=lambda f: f.chi_square)
    return of_several(moved[0]) if len(observations) > 1 else _of_one(held, moved, law)


def _held(model: Model, starts: list[FloatArray], law: list[int]) -> tuple[Fit | None, Model, list[FloatArray]]:
    """The best fit of one test with sensors and rig as they are known (None: no start has a steady state).

    With it the model, its noise as that fit shows, and where a fit of all begins: there, or at a lag that leaves less.
    """
    plain = model_of([model.tests[0].observation], rig=False)
    try:
        if not plain.unknowns:
            return fit_at(plain, np.zeros(0)), model, starts
        held = fit_from(plain, [start[law] for start in starts])
    except AnalysisError:
        return None, model, starts
    before = held.model.tests[0].observation
    settled = before.settled(held.values())
    if settled is not before:
        model, plain = (replace(m, tests=(replace(m.tests[0], observation=settled),)) for m in (model, plain))
        held = fit_from(plain, [held.point])
    if settled is not before or misfit_is_noise(held) or held.cost <= cost(model, starts[0]):
        whole = np.clip(np.zeros(len(model.unknowns)), *model.bounds)
        whole[law] = held.point
        starts = [whole] if settled is not before else [whole, *starts[1:]]
    return held, model, starts


def of_several(found: Fit) -> Posterior:
    """The posterior about the fit with the likeliest scatter from test to test.

    What differs from test to test was counted as misfit of the law at first. Where the law with its scatter explains
    every test, it was none, and the weights are found anew. Where it does not, tests that differ much may have hidden
    their scatter: they are fitted once more from values of their own, and what is left then is misfit.
    """
    first, tests = with_scatter(found), range(len(found.model.tests))
    again = with_scatter(tempered(first, shown=True), lifts=True)
    if explains(again, tests):
        return posterior_of(again)
    apart = with_scatter(tempered(with_scatter(let_apart(found)), shown=True), lifts=True)
    more = sum(explains(apart, [i]) - explains(first, [i]) for i in tests)
    return posterior_of(apart if more > 0 else first)


def explains(fit: Fit, tests: Iterable[int]) -> bool:
    """Return whether a fit leaves of each of some tests no more than `EXPLAINED` times what noise leaves."""
    return all((o := fit.model.tests[i].observation).nrmse(fit.residuals[i]) <= EXPLAINED * o.floor for i in tests)


def _of_one(held: Fit | None, moved: Sequence[Fit], law: list[int]) -> Posterior:
    """The posterior of one test: from its fit with sensors and rig as known, and from those that move them, best first.

    `law`: places of the unknowns of `held` among those of the others.
    """
    best = moved[0]
    found = posterior_of(best)
    if held is not None and misfit_is_noise(held):
        squares = [f.chi_square + float((f.model.strains(f.point) ** 2).sum()) for f in (held, best)]
        if squares[0] - squares[1] < CORRECTED:  # as known; errors hold the distance to the others
            point, held_se = np.clip(np.zeros(len(best.point)), *best.model.bounds), np.zeros(len(best.point))
            point[law], held_se[law] = held.point, np.sqrt(np.diag(posterior_of(held).covariance))
            found = replace(found, fit=fit_at(best.model, point), held_se=held_se)
            return found.with_shift(AS_KNOWN, point - best.point)
    found = _with_rivals(found, moved[1:])
    if held is None or not found.strained:
        return found
    worst = 0.0  # how sure it is that sensors and rig were moved for something else's sake: by the worst of them
    for u, c in zip(found.unknowns, np.abs(best.point).tolist(), strict=True):
        if u.level == "rig" and not u.law:
            worst = max(worst, min(1.0, max(0.0, 0.5 * (c - 2.0))) if u.assumed else float(c > STRAINED))
    apart = np.zeros(len(best.point))  # what is declared, or the law, is wrong: data do not say which
    apart[law] = worst * (best.point[law] - held.point)
    return found.with_shift(AS_KNOWN, apart)


def _with_rivals(found: Posterior, others: Sequence[Fit]) -> Posterior:
    """The posterior with errors that span other minima that fit nearly as well."""
    best = found.fit
    if best.find("beta") is None:
        return found
    own = best.values()["beta"]
    near = [f for f in others if (f.chi_square - best.chi_square) / best.excess() < RIVAL]
    near = [f for f in near if abs(f.values()["beta"] / own - 1.0) > 0.01]
    if not near:
        return found
    for other in near:
        found = found.with_shift("other minima", other.point - best.point)
    named = " and ".join(f"{f.values()['beta']:.4g}" for f in near)
    said = f"friction_ratio: not unique: {named} fits nearly as well as {own:.4g}; its error spans them"
    return replace(found, warnings=(*found.warnings, said))
