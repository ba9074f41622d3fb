"""Two laws told apart: the evidence to expect if the one holds and the other is fitted to what it shows, both ways.

For each test the gap between what the law that holds shows and what the other says, and the other's slopes, whitened
by the noise, give three sums: gap^2, slopes x gap, slopes^2. They add up over tests, so that the misfit of the other
law's best values for several tests together, which share them, and with it the evidence, is known at once.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from frictionlab.errors import UsageError
from frictionlab.planning.information import Told, told_by
from frictionlab.planning.outlook import Outlook

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
STEPS = 12  # of Gauss and Newton to the other law's best values, at most
DONE = 0.01  # share of the cost that a step must save to be followed by another
FARTHEST = 2.0  # deviations a step goes at most


@dataclass(frozen=True)
class Sums:
    """Of each test, or of some together: ``gap2`` (...), ``slope_gap`` (..., m), ``slope2`` (..., m, m)."""

    gap2: FloatArray
    slope_gap: FloatArray
    slope2: FloatArray

    def of(self, order: Sequence[int]) -> "Sums":
        """Some tests together."""
        some = np.asarray(order, dtype=np.intp)
        return Sums(self.gap2[some].sum(axis=0), self.slope_gap[some].sum(axis=0), self.slope2[some].sum(axis=0))

    def plus(self, more: "Sums") -> "Sums":
        """These and others together."""
        return Sums(self.gap2 + more.gap2, self.slope_gap + more.slope_gap, self.slope2 + more.slope2)

    def step(self, point: FloatArray) -> FloatArray:
        """Way (..., m) from a point to the best values."""
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
    """One law holds (``truth``, ``told``), the other is fitted (``rival``), its slopes taken at ``point`` (m,)."""

    truth: Outlook
    told: Told
    rival: Outlook
    point: FloatArray
    sums: Sums

    def moved(self, order: Sequence[int]) -> "Way":
        """The same about the rival's best values for some tests together."""
        some = np.asarray(order, dtype=np.intp)
        point = _best(_only(self.told, some), self.rival.only(some), self.point, together=True)
        return replace(self, point=point, sums=_sums(self.told, self.rival, point))

    def evidence(self, order: Sequence[int], *, more: bool = False) -> FloatArray:
        """Logarithm of the Bayes factor for the law that holds, of some tests; `more`: with each candidate (n,)."""
        some = np.asarray(order, dtype=np.intp)
        sums, own = self.sums.of(order), self.told.information[some].sum(axis=0)
        if more:
            sums, own = sums.plus(self.sums), own + self.told.information
        return _log_bayes(self.truth, own, self.rival, self.point, sums)

    def alone(self, some: NDArray[np.intp]) -> FloatArray:
        """The same of each test alone (n,), the rival at its own best values for it; NaN where not asked for."""
        told, rival = _only(self.told, some), self.rival.only(some)
        points = _best(told, rival, np.tile(self.point, (len(some), 1)), together=False)
        found = np.full(len(self.told.information), np.nan)
        found[some] = _log_bayes(self.truth, told.information, rival, points, _sums(told, rival, points))
        return found


def _only(told: Told, some: NDArray[np.intp]) -> Told:
    here = replace(told.here, rows=told.here.rows[some], mean=told.here.mean[some])
    noise = replace(told.noise, white=told.noise.white[some], columns=told.noise.columns[some])
    return Told(here, told.slopes[some], noise, told.information[some], told.own[some])


def _sums(told: Told, rival: Outlook, points: FloatArray) -> Sums:
    """What each test says of the rival at some values: nothing where either law has no steady motion."""
    shown = rival.show(points)
    usable = told.tells & shown.moves
    gap = np.where(usable[:, None], told.here.mean - shown.mean, 0.0)[:, :, None]
    slopes = rival.slopes(points, shown) * usable[:, None, None]
    within = told.noise.within
    return Sums(within(gap, gap)[:, 0, 0], within(slopes, gap)[:, :, 0], within(slopes, slopes))


def _costs(told: Told, rival: Outlook, points: FloatArray) -> FloatArray:
    """Misfit (n,) of each test at points; infinite where only the rival has no steady motion."""
    shown = rival.show(points)
    gap = np.where(shown.moves[:, None], told.here.mean - shown.mean, 0.0)[:, :, None]
    return np.where(told.tells, np.where(shown.moves, told.noise.within(gap, gap)[:, 0, 0], math.inf), 0.0)


def _best(told: Told, rival: Outlook, start: FloatArray, *, together: bool) -> FloatArray:
    """The rival's best values, for all tests together (m,) or for each alone (n, m), by damped Gauss-Newton steps."""
    low, high = (np.array(side) for side in zip(*((c.low, c.high) for c in rival.coordinates), strict=True))
    points, cost = start, _joined(_costs(told, rival, start), start, together=together)
    for _ in range(STEPS):
        sums = _sums(told, rival, points)
        step = (sums.of(range(len(sums.gap2))) if together else sums).step(points)
        step, before = step / np.maximum(1.0, np.abs(step).max(axis=-1, keepdims=True) / FARTHEST), cost
        for share in (1.0, 0.25):
            trial = np.clip(points + share * step, low, high)
            there = _joined(_costs(told, rival, trial), trial, together=together)
            better = there < cost
            points, cost = np.where(better[..., None], trial, points), np.where(better, there, cost)
        if not np.any(cost < (1.0 - DONE) * before):
            break
    return points


def _joined(costs: FloatArray, points: FloatArray, *, together: bool) -> FloatArray:
    return np.asarray((costs.sum() if together else costs) + (points**2).sum(axis=-1))


def _log_bayes(truth: Outlook, own: FloatArray, rival: Outlook, point: FloatArray, sums: Sums) -> FloatArray:
    """Expected logarithm of the Bayes factor: Laplace's evidence of both laws, the noise's share of the fits counted.

    ``ln Z = -cost/2 - ln|precision|/2`` and for each half-normal prior ``ln 2 Phi(distance from the bound)``; fitted
    noise lowers the cost by one for each unknown that is told.
    """
    expected = truth.expected
    mine = _precision(own)
    held = (expected**2).sum() - ((expected * np.linalg.solve(mine, _column(expected, mine))[..., 0]).sum(axis=-1))
    other = _precision(sums.slope2)
    here = _weight(truth, mine, expected) - 0.5 * held
    there = _weight(rival, other, np.asarray(point + sums.step(point))) - 0.5 * sums.cost(point)
    return np.asarray(here - there)


def _column(vector: FloatArray, like: FloatArray) -> FloatArray:
    return np.broadcast_to(vector[:, None], (*like.shape[:-1], 1))


def _weight(outlook: Outlook, precision: FloatArray, best: FloatArray) -> FloatArray:
    """Part of a law's log evidence that does not hang on the misfit."""
    covariance = np.linalg.inv(precision)
    variances = np.diagonal(covariance, axis1=-2, axis2=-1)
    told = 0.5 * (1.0 - variances).sum(axis=-1)
    folded = np.array([c.folded for c in outlook.coordinates])
    low = np.array([c.low if c.folded else 0.0 for c in outlook.coordinates])
    inside = np.where(folded, math.log(2.0) + log_ndtr((best - low) / np.sqrt(variances)), 0.0).sum(axis=-1)
    return np.asarray(told + inside - 0.5 * np.linalg.slogdet(precision)[1])


@dataclass(frozen=True)
class Apart:
    """Two laws between which tests are to decide: ``ways``: the first holds, the second holds."""

    against: str
    ways: tuple[Way, Way]
    alone: tuple[FloatArray, FloatArray] | None = None

    @property
    def tells(self) -> BoolArray:
        """Which tests tell anything under either law."""
        return np.asarray(self.ways[0].told.tells & self.ways[1].told.tells)

    def gain(self, order: Sequence[int]) -> FloatArray:
        """What each candidate (n,) adds to tests chosen: growth of the evidence in proportion, both ways alike.

        A law that holds may be told from the other a million times as easily as the other from it; neither way shall
        be bought for the other.
        """
        more = [_size(way.evidence(order, more=True)) - _size(way.evidence(order)) for way in self.ways]
        return np.asarray(more[0] + more[1])

    def settled(self, order: Sequence[int]) -> "Apart":
        """The same about the best values for the tests chosen."""
        one, other = self.ways
        return replace(self, ways=(one.moved(order), other.moved(order)))

    def judged(self, some: NDArray[np.intp]) -> "Apart":
        """The same with the evidence of some tests, each alone."""
        one, other = self.ways
        return replace(self, alone=(one.alone(some), other.alone(some)))

    def row(self, i: int, order: Sequence[int] | None) -> dict[str, float | None]:
        """Evidence of a test for the columns of a plan."""
        one, other = (None, None) if self.alone is None else (_known(side[i]) for side in self.alone)
        after = None if order is None else min(float(way.evidence(order)) for way in self.ways)
        return {"log_bayes": one, "log_bayes_against": other, "log_bayes_after": after}


def _size(evidence: FloatArray) -> FloatArray:
    return np.log1p(np.maximum(evidence, 0.0))


def _known(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


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
    return Apart(lab.law.name, (_way(outlook, told, other), _way(other, there, outlook)))


def _way(truth: Outlook, told: Told, rival: Outlook) -> Way:
    """One way, the rival where it is nearest at once: what both laws have as it holds, its further terms at rest."""
    shared = dict(zip((c.name for c in truth.coordinates), truth.expected, strict=True))
    point = np.array([shared.get(c.name, c.low if c.folded else 0.0) for c in rival.coordinates])
    return Way(truth, told, rival, point, _sums(told, rival, point))
