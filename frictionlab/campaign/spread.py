"""How sure the unknowns are that many tests share: what the noise and the scatter of each test do to them.

The error of a shared unknown is a sum over tests: each test's score is off by its own noise, its friction by the
scatter from test to test, and where other parameters differ from test to test, by those. All of it goes through the
fit as it was made. What a test's friction scatters is found beside the covariance that weighs its cycles; where the
cycles themselves show more noise than that, the same spread is not counted twice.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from frictionlab.campaign.mixed import Piece, Solution
from frictionlab.campaign.scores import Noise
from frictionlab.identification.coordinates import pulled

FloatArray = NDArray[np.float64]
CHANCE = 0.05  # how often tests whose errors are right may show as much more than these


@dataclass(frozen=True)
class Spread:
    """How sure shared unknowns are, as covariances (S, S).

    ``noise``: by noise and misfit of the tests; ``scatter``: by how far tests stand from each other; ``own``: by what
    each test has for itself of its rig; ``prior`` (not itself a covariance): the share of each prior's error by column.
    """

    noise: FloatArray
    scatter: FloatArray
    own: FloatArray
    prior: FloatArray

    @property
    def total(self) -> FloatArray:
        """All of it as one covariance (S, S)."""
        return self.noise + self.scatter + self.own + self.prior @ self.prior.T

    def part(self, at: NDArray[np.intp]) -> "Spread":
        """The same of some of the unknowns; what the priors of the others add to them counts as ``own``."""
        square = np.ix_(at, at)
        rest = np.delete(self.prior, at, axis=1)[at]
        return Spread(self.noise[square], self.scatter[square], self.own[square] + rest @ rest.T, self.prior[square])


@dataclass(frozen=True)
class _Of:
    """What one test does to the shared unknowns, as covariances (S, S), and how far (S,) it pulls them in truth.

    ``weighed``: its noise by the covariance that weighs it; ``scatter``: of its friction, ``uneven``: of the law's
    other parameters.
    """

    noise: FloatArray
    weighed: FloatArray
    scatter: FloatArray
    uneven: FloatArray
    own: FloatArray
    pull: FloatArray


def spread_of(
    solution: Solution,
    pieces: Sequence[Piece],
    noise: Sequence[Noise],
    doubt: FloatArray | None = None,
    *,
    robust: bool = False,
    scatters: Sequence[float] | None = None,
) -> Spread:
    """Carry the errors of each test into the shared unknowns.

    Parameters
    ----------
    solution, pieces
        As found, and of what.
    noise : sequence of Noise
        What its own noise does to each test's score.
    doubt : ndarray of shape (S,), optional
        How far priors may have pulled what is shared (`Coordinate.doubt`): 1 but for one with tails.
    robust : bool
        Tests are many: they show by themselves, as clusters [Liang and Zeger 1986], where they pull farther.
    scatters : sequence of float, optional
        Of friction from test to test, for each test; by default the solution's.
    """
    taus = [solution.scatter] * len(pieces) if scatters is None else scatters
    left: FloatArray = np.asarray(np.linalg.inv(solution.precision))
    tests = [
        _of_test(piece, of_test, tau, solution.point, left)
        for piece, of_test, tau in zip(pieces, noise, taus, strict=True)
    ]
    noise_, scatter = _summed([one.noise for one in tests]), _summed([one.scatter for one in tests])
    others, own = _summed([one.uneven for one in tests]), _summed([one.own for one in tests])
    if robust:
        scatter = _beyond(scatter, noise_ - _summed([one.weighed for one in tests]))
    scatter = scatter + others
    if robust:
        more = _shown_over(noise_ + scatter + own, tests, len(tests) / max(1, len(tests) - _groups(pieces)))
        noise_, scatter, own = (part * np.outer(more, more) for part in (noise_, scatter, own))
    return Spread(noise_, scatter, own, left if doubt is None else pulled(left, doubt))


def _of_test(piece: Piece, noise: Noise, tau: float, point: FloatArray, left: FloatArray) -> _Of:
    into, own, scatter = _response(piece, tau)
    way = into @ left
    gap = piece.score - piece.information @ (piece.place.scale @ point + piece.place.offset)
    return _Of(
        noise.carried(way),
        np.asarray(way.T @ piece.information @ way),
        _square(left @ scatter),
        _square(left @ own[:, len(piece.place.local) :]),
        _square(left @ own[:, : len(piece.place.local)]),
        np.asarray(way.T @ gap),
    )


def _summed(parts: Sequence[FloatArray]) -> FloatArray:
    return np.asarray(np.sum(parts, axis=0))


def _square(root: FloatArray) -> FloatArray:
    return np.asarray(root @ root.T)


def _beyond(scatter: FloatArray, lacks: FloatArray) -> FloatArray:
    """The scatter (S, S) of friction without noise that the weights lack, which looked like it."""
    lack = np.maximum(np.diag(lacks), 0.0)
    kept = np.sqrt(np.maximum(0.0, 1.0 - lack / np.maximum(np.diag(scatter), 1e-300)))
    return np.asarray(scatter * np.outer(kept, kept))


def _shown_over(stated: FloatArray, tests: Sequence[_Of], few: float) -> FloatArray:
    """Factors (S,) by which the tests' own pulls are beyond what is stated, 1 where chance may have done it.

    Few tests tell much of an unknown, so that what they show is rough: it has the degrees of freedom of a sum of
    squares of unequal size (Satterthwaite).
    """
    each = np.array([np.diag(one.noise + one.scatter + one.uneven + one.own) for one in tests])
    freedom = np.maximum(each.sum(axis=0) ** 2 / np.maximum((each**2).sum(axis=0), 1e-300), 1.0)
    shown = few * (np.array([one.pull for one in tests]) ** 2).sum(axis=0)
    ratio = shown / np.maximum(np.diag(stated), 1e-300)
    return np.sqrt(np.where(ratio > chi2.isf(CHANCE, freedom) / freedom, ratio, 1.0))


def _groups(pieces: Sequence[Piece]) -> int:
    return len({int(np.argmax(piece.place.scale[piece.place.friction or 0])) for piece in pieces})


def _response(piece: Piece, tau: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """What a test's score (n, S), its own unknowns' priors and its scatter (S, k) do to the shared score."""
    place, n, own = piece.place, len(piece.score), piece.place.own
    inner = np.hstack([own, tau * np.eye(n)[:, [] if place.friction is None else [place.friction]]])
    block = inner.T @ piece.information @ inner + np.eye(inner.shape[1])
    cross = inner.T @ piece.information @ place.scale
    taken: FloatArray = np.asarray(np.linalg.solve(block, cross))
    back = taken.T
    return place.scale - inner @ taken, back[:, : own.shape[1]], back[:, own.shape[1] :]


def influence(solution: Solution, piece: Piece) -> FloatArray:
    """By how much the shared unknowns (S,) move if a test's friction ratio says one deviation more."""
    if piece.place.friction is None:
        return np.zeros(len(solution.point))
    into, _, _ = _response(piece, solution.scatter)
    return np.asarray(np.linalg.solve(solution.precision, into.T @ piece.information[:, piece.place.friction]))
