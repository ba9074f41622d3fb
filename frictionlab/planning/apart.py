"""Two laws told apart: the evidence to expect if the one holds and the other is fitted to what it shows, both ways.

For each test the gap between what the law that holds shows and what the other says, and the other's slopes, whitened
by the noise that a fit finds, give three sums: gap^2, slopes x gap, slopes^2. With them the misfit of the other law's
best values, and with it the evidence, is known at once. Each test has parameters of its own, as in a ladder of laws,
and the evidence of several tests is their sum, as a campaign takes it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import UsageError
from frictionlab.identification.fit import half_priors
from frictionlab.planning.information import Told, told_by, unexplained
from frictionlab.planning.outlook import Outlook
from frictionlab.planning.weights import Seen, as_weighed, seen_by_fit

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IndexArray = NDArray[np.intp]
Slopes = Mapping[str, FloatArray]
STEPS = 12  # of Gauss and Newton to the other law's best values, at most
DONE = 0.03  # share of the cost that a step must save to be followed by another
FARTHEST = 2.0  # deviations a step goes at most


@dataclass(frozen=True)
class Sums:
    """Of each test (or of each draw of its weights): ``gap2`` (n,), ``slope_gap`` (n, m), ``slope2`` (n, m, m)."""

    gap2: FloatArray
    slope_gap: FloatArray
    slope2: FloatArray

    def step(self, point: FloatArray) -> FloatArray:
        """Way (n, m) from a point to the best values."""
        return np.asarray(np.linalg.solve(_precision(self.slope2), (self.slope_gap - point)[..., None])[..., 0])

    def cost(self, point: FloatArray) -> FloatArray:
        """Misfit and prior at the best values, by the slopes at a point."""
        return np.asarray(
            self.gap2 + (point**2).sum(axis=-1) - ((self.slope_gap - point) * self.step(point)).sum(axis=-1)
        )


def _precision(slope2: FloatArray) -> FloatArray:
    return np.asarray(slope2 + np.eye(slope2.shape[-1]))


@dataclass(frozen=True)
class Way:
    """One law holds (``truth``, ``told``), the other is fitted (``rival``), to each test about ``points`` (n, m).

    ``evidence`` (n,): logarithm of the Bayes factor to expect for the law that holds, of each test.
    """

    truth: Outlook
    told: Told
    rival: Outlook
    points: FloatArray
    evidence: FloatArray

    def fitted(self, some: IndexArray) -> "Way":
        """The same with the rival at its own best values for some tests."""
        told, rival, points, evidence = self.told.only(some), self.rival.only(some), self.points, self.evidence
        best = _best(told, rival, points[some])
        if rival.lab.law.has("breakaway"):  # near where it does nothing it may act on nothing, and by jumps beyond
            more = _best(told, rival, np.tile(rival.expected, (len(some), 1)))
            better = _costs(told, rival, more) < _costs(told, rival, best)
            best = np.where(better[:, None], more, best)
        points, evidence = points.copy(), evidence.copy()
        points[some], evidence[some] = best, _evidence(self.truth, told, rival, best)
        return replace(self, points=points, evidence=evidence)

    def judged(self, seen: Mapping[int, Seen]) -> "Way":
        """The same with the weights that a fit may find, of tests as it will see them: the median over their draws."""
        evidence = self.evidence.copy()
        for i, test in seen.items():
            evidence[i] = np.median(_drawn(test, self.rival, self.points[i], i))
        return replace(self, evidence=evidence)


def sums_of(told: Told, rival: Outlook, points: FloatArray, known: Slopes | None = None) -> Sums:
    """What each test says of the rival at some values: nothing where either law has no steady motion."""
    gap, slopes = _apart(told, rival, points, known)
    within = told.noise.within
    return Sums(within(gap, gap)[:, 0, 0], within(slopes, gap)[:, :, 0], within(slopes, slopes))


def _apart(
    told: Told, rival: Outlook, points: FloatArray, known: Slopes | None = None
) -> tuple[FloatArray, FloatArray]:
    """Gap (n, 2 K, 1) to what the rival shows at some values, and its slopes (n, 2 K, m) there."""
    shown = rival.show(points)
    usable = told.tells & shown.moves
    gap = np.where(usable[:, None], told.here.mean - shown.mean, 0.0)[:, :, None]
    return gap, rival.slopes(points, shown, known) * usable[:, None, None]


def _costs(told: Told, rival: Outlook, points: FloatArray) -> FloatArray:
    """Misfit and prior (n,) of each test at points (n, m); infinite where only the rival has no steady motion."""
    shown = rival.show(points)
    gap = np.where(shown.moves[:, None], told.here.mean - shown.mean, 0.0)[:, :, None]
    misfit = np.where(shown.moves, told.noise.within(gap, gap)[:, 0, 0], math.inf)
    return np.asarray(np.where(told.tells, misfit, 0.0) + (points**2).sum(axis=-1))


def _best(told: Told, rival: Outlook, points: FloatArray) -> FloatArray:
    """The rival's best values (n, m) for each test alone, by damped steps of Gauss and Newton."""
    points, cost, left = points.copy(), _costs(told, rival, points), np.arange(len(points))
    for _ in range(STEPS):
        some, others = told.only(left), rival.only(left)
        points[left], now = _stepped(some, others, points[left], cost[left])
        worth, cost[left] = now < (1.0 - DONE) * cost[left], now
        left = left[worth]
        if not len(left):
            break
    return points


def _stepped(told: Told, rival: Outlook, points: FloatArray, cost: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points one step on, and their cost: as they were where no share of the step is better."""
    low, high = (np.array(side) for side in zip(*((c.low, c.high) for c in rival.coordinates), strict=True))
    step, here = sums_of(told, rival, points).step(points), points
    step = step / np.maximum(1.0, np.abs(step).max(axis=-1, keepdims=True) / FARTHEST)
    points, cost, left = points.copy(), cost.copy(), np.arange(len(points))
    for share in (1.0, 0.25):
        trial = np.clip(here[left] + share * step[left], low, high)
        there = _costs(told.only(left), rival.only(left), trial)
        better = there < cost[left]
        points[left[better]], cost[left[better]] = trial[better], there[better]
        left = left[~better]
        if not len(left):
            break
    return points, cost


def _evidence(
    truth: Outlook, told: Told, rival: Outlook, points: FloatArray, known: Slopes | None = None
) -> FloatArray:
    """Logarithm of the Bayes factor (n,) to expect of each test, by what all tests are roughly weighed by."""
    sums = sums_of(told, rival, points, known)
    return _log_bayes(truth, told.own, told.own, rival, points, sums, sums.slope2)


def _drawn(seen: Seen, rival: Outlook, point: FloatArray, i: int) -> FloatArray:
    """The same (d,) of one test, for each draw of the weights that a fit may find."""
    truth, told = seen.outlook, seen.told
    other = replace(rival.only([i]), harmonics=truth.harmonics)
    gap, slopes = (part[0] for part in _apart(told, other, point[None, :]))
    more = unexplained(truth, told.here.mean) * np.eye(len(seen.true))
    weights = np.linalg.inv(seen.found + more)
    points = np.broadcast_to(point, (len(weights), len(point)))
    turned = weights @ slopes
    sums = Sums((gap.T @ (weights @ gap))[:, 0, 0], (slopes.T @ (weights @ gap))[:, :, 0], slopes.T @ turned)
    true, mine = seen.true + more, weights @ told.slopes[0]
    own, own_noise = told.slopes[0].T @ mine, np.swapaxes(mine, 1, 2) @ true @ mine
    return _log_bayes(truth, own, own_noise, other, points, sums, np.swapaxes(turned, 1, 2) @ true @ turned)


def _log_bayes(
    truth: Outlook,
    own: FloatArray,
    own_noise: FloatArray,
    rival: Outlook,
    points: FloatArray,
    sums: Sums,
    noise: FloatArray,
) -> FloatArray:
    """Expected logarithm of the Bayes factor (n,): Laplace's evidence of both laws, noise that fits take in counted.

    ``ln Z = -cost/2 - ln|precision|/2`` and for each half-normal prior ``ln 2 Phi(distance from the bound)``; fitted
    noise lowers the cost by the trace of the posterior covariance over what noise adds to the slopes.
    """
    expected = np.broadcast_to(truth.expected, (len(own), len(truth.expected)))
    mine = _precision(own)
    held = (expected**2).sum(axis=-1) - (expected * np.linalg.solve(mine, expected[..., None])[..., 0]).sum(axis=-1)
    other = _precision(sums.slope2)
    here = _weight(truth, mine, own_noise, expected) - 0.5 * held
    there = _weight(rival, other, noise, points + sums.step(points)) - 0.5 * sums.cost(points)
    return np.asarray(here - there)


def _weight(outlook: Outlook, precision: FloatArray, noise: FloatArray, best: FloatArray) -> FloatArray:
    """Part of a law's log evidence that does not hang on the misfit."""
    covariance: FloatArray = np.asarray(np.linalg.inv(precision), dtype=np.float64)
    fitted = 0.5 * np.einsum("...ij,...ji->...", covariance, noise)
    inside = half_priors(outlook.coordinates, np.broadcast_to(best, covariance.shape[:-1]), covariance)
    return np.asarray(fitted + inside - 0.5 * np.linalg.slogdet(precision)[1])


@dataclass(frozen=True)
class Apart:
    """Two laws to be told apart: ``ways``: the first holds, the second holds.

    ``at_best`` (n,): tests to which both are fitted; ``known`` (n,): tests that are judged.
    """

    against: str
    ways: tuple[Way, Way]
    at_best: BoolArray
    known: BoolArray

    @property
    def tells(self) -> BoolArray:
        """Which tests tell anything under either law."""
        return np.asarray(self.ways[0].told.tells & self.ways[1].told.tells)

    def gain(self, order: Sequence[int]) -> FloatArray:
        """What each candidate (n,) adds to tests chosen: growth of the evidence in proportion, both ways alike.

        A law that holds may be told from the other a million times as easily as the other from it; neither way shall
        be bought for the other.
        """
        before = [way.evidence[np.asarray(order, dtype=np.intp)].sum() for way in self.ways]
        more = [_size(so_far + way.evidence) - _size(so_far) for so_far, way in zip(before, self.ways, strict=True)]
        return np.asarray(np.where(self.tells, more[0] + more[1], -math.inf))

    def fitted(self, some: IndexArray) -> "Apart":
        """The same with each law at its own best values for some tests."""
        (one, other), at_best = self.ways, self.at_best.copy()
        some, at_best[some] = some[~at_best[some]], True
        return replace(self, ways=(one.fitted(some), other.fitted(some)), at_best=at_best) if len(some) else self

    def judged(self, seen: Mapping[int, Seen]) -> "Apart":
        """The same with the evidence of some tests, as a fit will see them, as the fits will find it."""
        (one, other), known = self.ways, self.known.copy()
        known[list(seen)] = True
        rest = seen_by_fit(other.truth, seen)
        return replace(self, ways=(one.judged(seen), other.judged(rest)), known=known)

    def row(self, i: int, order: Sequence[int] | None) -> dict[str, float | None]:
        """Evidence of a test for the columns of a plan."""
        one, other = (known_or_none(float(way.evidence[i])) if self.known[i] else None for way in self.ways)
        after = None if order is None else min(float(way.evidence[list(order)].sum()) for way in self.ways)
        return {"log_bayes": one, "log_bayes_against": other, "log_bayes_after": after}


def _size(evidence: FloatArray) -> FloatArray:
    return np.log1p(np.maximum(evidence, 0.0))


def apart_of(outlook: Outlook, told: Told, against: str) -> Apart:
    """Return the laboratory's law and another one, ready to be told apart.

    Raises
    ------
    UsageError
        The other law cannot be, is the same, or nothing tells of it.
    """
    lab = outlook.lab.under(against)
    if lab.law.name == outlook.lab.law.name:
        raise UsageError(f"against: law {against} is the one that is planned for: name another one")
    other = outlook.under(lab)
    there = told_by(other)
    if not (told.tells & there.tells).any():
        raise UsageError(
            f"against: no candidate has a steady motion under both {outlook.lab.law.name} and {lab.law.name}:"
            " change normal_forces_n, base_amplitudes_m or frequency_ratios of [plan]"
        )
    ways = _way(outlook, told, other), _way(other, there, outlook)
    none = np.zeros(len(told.tells), dtype=bool)
    return Apart(lab.law.name, ways, none, none)


def known_or_none(value: float) -> float | None:
    """A number for a row; None where it is not finite."""
    return value if math.isfinite(value) else None


def over_coulomb(outlook: Outlook, told: Told, seen: Mapping[int, Seen]) -> FloatArray:
    """Logarithm of the Bayes factor (n,) to expect for the law over plain Coulomb friction, of tests that a fit sees.

    NaN of all others, and where the law is plain Coulomb friction itself.
    """
    lab, evidence = outlook.lab.under("coulomb"), np.full(len(told.tells), np.nan)
    some = np.array([i for i in seen if told.tells[i]], dtype=np.intp)
    if lab.law.name != outlook.lab.law.name and len(some):
        one = outlook.only(some)
        way, every = _way(one, told.only(some), one.under(lab)), np.arange(len(some))
        evidence[some] = way.fitted(every).judged({k: seen[i] for k, i in enumerate(some.tolist())}).evidence
    return evidence


def _way(truth: Outlook, told: Told, rival: Outlook) -> Way:
    """One way, the rival where it is nearest at once: what both laws have as it holds, its further terms at rest.

    What both have is taken to act alike under both, until the rival is fitted.
    """
    shared = dict(zip((c.name for c in truth.coordinates), truth.expected, strict=True))
    point = np.array([shared.get(c.name, c.low if c.folded else 0.0) for c in rival.coordinates])
    points, weighed = np.tile(point, (len(told.tells), 1)), as_weighed(truth, told)
    alike = {c.name: told.slopes[:, :, k] for k, c in enumerate(truth.coordinates) if c in rival.coordinates}
    return Way(truth, weighed, rival, points, _evidence(truth, weighed, rival, points, alike))
