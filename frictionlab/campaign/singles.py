"""What each test says by itself, among the others: of its friction, and of the law's other parameters.

Tests of one contact have the same parameters. Where they differ by more than each one's own error says, friction's
scatter is a part of the fit (`mixed`); that of another parameter is told here, and carried into all errors (`spread`).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.autocorrelation import student
from frictionlab.analysis.pooling import scatter_beyond
from frictionlab.campaign.evenness import Own, agreement, own_of
from frictionlab.campaign.joint import Joint

FloatArray = NDArray[np.float64]
TINY = 1e-16  # a variance in squared deviations of a prior: as good as none
SINGULAR = 1e10  # condition beyond which a test does not tell its unknowns apart
SURE = 0.05  # p from which tests may be said to agree


@dataclass(frozen=True)
class Uneven:
    """How one parameter differs from test to test, in deviations of its prior.

    ``p``: how often equal ones would look at least this uneven; ``scatter``: beyond the tests' own errors; ``tests``:
    so many tell it.
    """

    p: float
    scatter: float
    tests: int

    @property
    def is_shown(self) -> bool:
        """Whether the tests differ beyond doubt."""
        return self.p < SURE and self.scatter > 0.0

    @property
    def cautious(self) -> float:
        """The scatter with Student's factor: so few tests tell it badly."""
        return self.scatter * math.sqrt(student(self.tests - 1.0))


@dataclass(frozen=True)
class _Alone:
    """One test's own estimate of an unknown; ``by_rig`` (R,): how much a rig that is off by one deviation moves it."""

    value: float
    own: Own
    by_rig: FloatArray


@dataclass(frozen=True)
class Singles:
    """The tests of a material one by one: ``best``: the fit whose values are given; ``moved``: that with the rig."""

    best: Joint
    moved: Joint

    @cached_property
    def frictions(self) -> list[Own]:
        """How sure each test's friction is by its own noise, all else held, in deviations squared."""
        return [self._own(i, [self.best.places[i].friction or 0], 0) for i in range(len(self.best.fits))]

    def evenness(self, group: tuple[str, float]) -> tuple[float, int, float | None]:
        """Chi-square of a group's tests about its friction by their own errors, degrees of freedom, and p."""
        told = [
            self._alone(i, [place.friction], 0, self._shared_friction(i))
            for i, (cycle, place) in enumerate(zip(self.best.cycles, self.best.places, strict=True))
            if cycle.group == group and place.friction is not None
        ]
        return self._agreement([one for one in told if one is not None])

    def parameter(self, k: int) -> Uneven | None:
        """How a shared unknown other than friction differs from test to test; None where too few tests tell it."""
        told = []
        for i, (found, place) in enumerate(zip(self.best.fits, self.best.places, strict=True)):
            own = [n for n, c in enumerate(found.coordinates) if c.law]
            at = int(np.argmax(np.abs(place.scale[:, k])))
            scale = float(place.scale[at, k])
            one = self._alone(i, own, own.index(at), place.offset[at] + scale * self.best.solution.point[k])
            if one is not None:
                told.append(
                    _Alone(one.value / scale, Own(one.own.variance / scale**2, one.own.freedom), one.by_rig / scale)
                )
        p = self._agreement(told)[2]
        if p is None:
            return None
        value, owns = np.array([one.value for one in told]), [one.own for one in told]
        scatter = scatter_beyond(value, np.sqrt([each.cautious for each in owns]))
        return Uneven(p, scatter, len(told))

    def _agreement(self, told: Sequence[_Alone]) -> tuple[float, int, float | None]:
        shared = np.array([one.by_rig for one in told]) @ self._rig if told else None
        return agreement([one.value for one in told], [one.own for one in told], shared)

    @cached_property
    def _rig(self) -> FloatArray:
        """Root (R, R) of how far off the rig may be: as all tests leave it unknown, and as far as they move it."""
        rig = ~self.moved.shared.is_law
        off = self.moved.solution.point[rig]
        spread = self.moved.spread.total[np.ix_(rig, rig)] + np.outer(off, off) + TINY * np.eye(len(off))
        root: FloatArray = np.asarray(np.linalg.cholesky(spread))
        return root

    @cached_property
    def _fit_with_rig(self) -> dict[str, int]:
        return {cycle.source: i for i, cycle in enumerate(self.moved.cycles)}

    def _shared_friction(self, i: int) -> float:
        place = self.best.places[i]
        n = place.friction or 0
        return float(place.scale[n] @ self.best.solution.point + place.offset[n])

    def _alone(self, i: int, unknowns: Sequence[int], k: int, shared: float) -> _Alone | None:
        """The k-th of some unknowns as one test tells them, from where the shared one stands; None if it does not."""
        found = self.best.fits[i]
        gain = _gain(found.jacobian[:, unknowns])
        if gain is None:
            return None
        value = float(found.point[unknowns[k]] + gain[k] @ found.residual) - shared
        return _Alone(value, self._own(i, unknowns, k), self._by_rig(i, unknowns, k))

    def _own(self, i: int, unknowns: Sequence[int], k: int) -> Own:
        found = self.best.fits[i]
        slopes: FloatArray = np.asarray(np.linalg.solve(found.observed.whitener, found.jacobian[:, unknowns]))
        own = own_of(found.observed, slopes, k)
        return Own(found.excess * own.variance, own.freedom)

    def _by_rig(self, i: int, unknowns: Sequence[int], k: int) -> FloatArray:
        names = [c.name for c in self.moved.shared.coordinates if not c.law]
        slopes, there = np.zeros(len(names)), self._fit_with_rig.get(self.best.cycles[i].source)
        if there is None:
            return slopes
        found = self.moved.fits[there]
        gain = _gain(found.jacobian[:, unknowns])
        for n, c in enumerate(found.coordinates):
            if gain is not None and c.name in names:
                slopes[names.index(c.name)] = gain[k] @ found.jacobian[:, n]
        return slopes


def _gain(slopes: FloatArray) -> FloatArray | None:
    """What least squares makes of whitened data (n, 2 K); None where the unknowns cannot be told apart."""
    information = slopes.T @ slopes
    size = np.sqrt(np.diag(information))
    if not (size > 0.0).all() or np.linalg.cond(information / np.outer(size, size)) > SINGULAR:
        return None
    return np.asarray(np.linalg.solve(information, slopes.T))
