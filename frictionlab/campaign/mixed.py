"""Many quadratic forms in unknowns that tests share: one solution, with the scatter from test to test.

Test i says ``-1/2 c' H c + g' c`` of its own unknowns ``c = A s + b + L l + e tau d``: s are shared, l its own, and d
is how far its friction ratio stands from the shared one, in units of the scatter tau. All of s, l, d have a normal
prior of mean 0 and deviation 1. How far other parameters stand from the shared ones is in l, where they scatter. What
is a test's own is integrated out; tau is what makes the tests likeliest (REML, [Patterson and Thompson 1971]); unknowns
that may not fall below a bound are held there.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from frictionlab.campaign.shared import Place

FloatArray = NDArray[np.float64]
SMALLEST, LARGEST = 1e-5, 1.0  # scatter tried, in deviations of the prior of a friction ratio
NONE = 1e-3  # logarithm of the likelihood that a scatter must gain to count at all


@dataclass(frozen=True)
class Piece:
    """What one test says: ``information`` H (n, n) and ``score`` g (n,) at 0, where its unknowns stand (``place``).

    ``level``: logarithm of its likelihood with all its unknowns at 0.
    """

    information: FloatArray
    score: FloatArray
    place: Place
    level: float = 0.0

    @property
    def constant(self) -> float:
        """Logarithm of its likelihood with all shared unknowns at 0."""
        offset = self.place.offset
        return self.level + float(self.score @ offset - 0.5 * offset @ self.information @ offset)

    def about_shared(self) -> tuple[FloatArray, FloatArray, int]:
        """Information and score of shared unknowns, its own ones and d (last), and the number of the first."""
        place, n = self.place, len(self.score)
        scatter = np.eye(n)[:, [] if place.friction is None else [place.friction]]
        basis = np.hstack([place.scale, place.own, scatter])
        score = basis.T @ (self.score - self.information @ place.offset)
        return basis.T @ self.information @ basis, score, place.scale.shape[1]


@dataclass(frozen=True)
class Others:
    """What tests that are not here say of the shared unknowns s: ``-1/2 s' P s + g' s`` (``precision``, ``score``)."""

    precision: FloatArray
    score: FloatArray

    def cost(self, point: FloatArray) -> float:
        """Minus twice the logarithm of their likelihood at a point (S,), up to a constant."""
        return float(point @ self.precision @ point - 2.0 * self.score @ point)


def no_others(size: int) -> Others:
    """Nothing is said of so many shared unknowns."""
    return Others(np.zeros((size, size)), np.zeros(size))


@dataclass(frozen=True)
class Solution:
    """The best shared unknowns.

    ``point``, ``hold`` (S,): where they stand, and how firmly their priors hold them; ``precision`` (S, S): inverse of
    their posterior covariance; ``scatter``: tau; ``own``: the unknowns of each test there (n,); ``beyond``: how far
    each test's friction ratio stands from the shared one, in deviations of its prior; ``volume``: logarithm of the
    determinants of all precisions, halved; ``strain``: sum of squares of all unknowns, halved.
    """

    point: FloatArray
    precision: FloatArray
    scatter: float
    own: tuple[FloatArray, ...]
    beyond: FloatArray
    volume: float
    strain: float
    hold: FloatArray


@dataclass(frozen=True)
class Summed:
    """What tests say of the shared unknowns: ``precision`` (S, S) and ``score`` (S,).

    ``volume``: half the logarithm of the determinants of what was integrated out; ``quadratic``: what is left of that.
    """

    precision: FloatArray
    score: FloatArray
    volume: float
    quadratic: float


class Mixed:
    """Tests, the bounds of what they share, how firmly priors hold that (1 but for one with tails), and other tests."""

    def __init__(
        self,
        pieces: Sequence[Piece],
        low: FloatArray,
        hold: FloatArray | None = None,
        others: Others | None = None,
    ) -> None:
        self.pieces, self.low, self.size = pieces, low, len(low)
        self.hold = np.ones(len(low)) if hold is None else hold
        self.others = no_others(len(low)) if others is None else others
        self._about = [piece.about_shared() for piece in pieces]
        self._plain, self._scattered = _without_local(self._about, [p.place.own.shape[1] for p in pieces], self.size)

    def solve(self, scatter: float | None = None) -> Solution:
        """Return the best shared unknowns; the scatter is found unless it is given."""
        tau = self.likeliest_scatter() if scatter is None else scatter
        precision, score, volume, _ = _sums(self, tau)
        point = self._bounded(precision, score)
        own, beyond, strain = [], [], 0.5 * float(self.hold @ point**2)
        for piece, (information, at, shared) in zip(self.pieces, self.scaled(tau), strict=True):
            inner = information[shared:, shared:] + np.eye(len(at) - shared)
            q = np.linalg.solve(inner, at[shared:] - information[shared:, :shared] @ point)
            place = piece.place
            unknown = place.scale @ point + place.offset + place.own @ q[: place.own.shape[1]]
            far = 0.0 if place.friction is None else tau * float(q[-1])
            if place.friction is not None:
                unknown[place.friction] += far
            own.append(unknown)
            beyond.append(far)
            strain += 0.5 * float(q @ q)
        return Solution(point, precision, tau, tuple(own), np.array(beyond), volume, strain, self.hold)

    def likeliest_scatter(self) -> float:
        """The scatter by which the tests are likeliest; 0 where none is shown, or a single test has none to show."""
        if len(self.pieces) < 2 or all(piece.place.friction is None for piece in self.pieces):
            return 0.0
        found = minimize_scalar(
            lambda log: -self.log_likelihood(math.exp(log)),
            bounds=(math.log(SMALLEST), math.log(LARGEST)),
            method="bounded",
            options={"xatol": 0.05},
        )
        return math.exp(found.x) if -found.fun > self.log_likelihood(0.0) + NONE else 0.0

    def log_likelihood(self, tau: float) -> float:
        """Logarithm of the likelihood of all tests, all unknowns integrated out, up to what does not depend on them."""
        precision, score, volume, quadratic = _sums(self, tau)
        return 0.5 * float(score @ np.linalg.solve(precision, score)) + quadratic - volume

    def scaled(self, tau: float) -> list[tuple[FloatArray, FloatArray, int]]:
        """Information and score of each test with its scatter in units of tau, and the number of shared unknowns."""
        found: list[tuple[FloatArray, FloatArray, int]] = []
        for information, score, shared in self._about:
            unit = np.ones(len(score))
            unit[shared + self._locals(len(found)) :] = tau
            found.append((information * np.outer(unit, unit), score * unit, shared))
        return found

    def told(self, tau: float) -> Summed:
        """What all tests say of the shared unknowns, without their priors; what is a test's own is integrated out."""
        cross, square, at = self._scattered
        firm = 1.0 + tau**2 * square
        share = tau**2 / firm
        return Summed(
            self._plain.precision - (cross * share[:, None]).T @ cross,
            self._plain.score - cross.T @ (share * at),
            self._plain.volume + 0.5 * float(np.log(firm).sum()),
            self._plain.quadratic + 0.5 * float(share @ at**2),
        )

    def _locals(self, i: int) -> int:
        return int(self.pieces[i].place.own.shape[1])

    def left_out(self, tau: float, folds: Sequence[NDArray[np.intp]]) -> FloatArray:
        """Logarithm of each test's likelihood (n,) as predicted by the tests outside its fold, as `log_likelihood`."""
        found = np.zeros(len(self.pieces))
        for fold in folds:
            rest = Mixed([p for i, p in enumerate(self.pieces) if i not in set(fold.tolist())], self.low, self.hold)
            precision, score, _, _ = _sums(rest, tau)
            for i in map(int, fold):
                found[i] = self._predicted(i, tau, precision, np.asarray(np.linalg.solve(precision, score)))
        return found

    def _predicted(self, i: int, tau: float, precision: FloatArray, mean: FloatArray) -> float:
        one = Mixed([self.pieces[i]], self.low, self.hold)
        information, score, volume, quadratic = _sums(one, tau)
        told = information - np.diag(self.hold)
        volume -= 0.5 * float(np.linalg.slogdet(information)[1])  # of what it has for itself alone
        total = precision + told
        gap = score - told @ mean
        volume += 0.5 * float(np.linalg.slogdet(total)[1] - np.linalg.slogdet(precision)[1])
        shared = float(score @ mean - 0.5 * mean @ told @ mean + 0.5 * gap @ np.linalg.solve(total, gap))
        return quadratic + shared - volume + self.pieces[i].constant

    def _bounded(self, precision: FloatArray, score: FloatArray) -> FloatArray:
        """The best point with no coordinate below its bound: those that would fall below are held at it."""
        held = np.zeros(self.size, dtype=bool)
        point = np.linalg.solve(precision, score)
        while (point < self.low - 1e-12).any():
            held |= point < self.low
            free = ~held
            point = np.where(held, self.low, 0.0)
            rest = score[free] - precision[np.ix_(free, held)] @ self.low[held]
            point[free] = np.linalg.solve(precision[np.ix_(free, free)], rest)
        return np.asarray(point)


def _without_local(
    about: Sequence[tuple[FloatArray, FloatArray, int]], local: Sequence[int], size: int
) -> tuple[Summed, tuple[FloatArray, FloatArray, FloatArray]]:
    """What tests without scatter say, their local unknowns integrated out; and for each what its d has in it.

    That is: of d and the shared unknowns (n, S), of d alone (n,), and the score of d (n,); zero where d is held.
    """
    precision, total, volume, quadratic = np.zeros((size, size)), np.zeros(size), 0.0, 0.0
    cross, square, at = np.zeros((len(about), size)), np.zeros(len(about)), np.zeros(len(about))
    for i, (one, count) in enumerate(zip(about, local, strict=True)):
        shared, (left, score, lost, gained) = one[2], _integrated(*one, count)
        volume, quadratic = volume + lost, quadratic + gained
        precision += left[:shared, :shared]
        total += score[:shared]
        if len(score) > shared:
            cross[i], square[i], at[i] = left[-1, :shared], left[-1, -1], score[-1]
    return Summed(precision, total, volume, quadratic), (cross, square, at)


def _integrated(
    information: FloatArray, score: FloatArray, first: int, count: int
) -> tuple[FloatArray, FloatArray, float, float]:
    """Information and score without so many unknowns from the first on; half their log determinant, what is left."""
    if not count:
        return information, score, 0.0, 0.0
    own, rest = np.arange(first, first + count), np.delete(np.arange(len(score)), np.s_[first : first + count])
    inner = information[np.ix_(own, own)] + np.eye(count)
    taken = np.linalg.solve(inner, np.column_stack([information[np.ix_(own, rest)], score[own]]))
    cross = information[np.ix_(rest, own)]
    left, at = information[np.ix_(rest, rest)] - cross @ taken[:, :-1], score[rest] - cross @ taken[:, -1]
    return left, at, 0.5 * float(np.linalg.slogdet(inner)[1]), 0.5 * float(score[own] @ taken[:, -1])


def _sums(mixed: Mixed, tau: float) -> tuple[FloatArray, FloatArray, float, float]:
    """Precision and score of the shared unknowns, half the logarithm of all determinants, and what is left."""
    told = mixed.told(tau)
    precision = told.precision + np.diag(mixed.hold) + mixed.others.precision
    volume = told.volume + 0.5 * float(np.linalg.slogdet(precision)[1])
    return precision, told.score + mixed.others.score, volume, told.quadratic
