"""What tests fitted together say of a material: friction by normal force, the law's parameters, each test's own.

As for a single test, the values are those of the law alone where it leaves no more than noise, and their errors hold
how far the fit that moves sensors and rig stands from them. Where the values given need sensors or rig far from what is
known of them, the distance counts as well.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from frictionlab.campaign.cycles import Cycle
from frictionlab.campaign.joint import Joint, fit_together
from frictionlab.campaign.rig import Rig
from frictionlab.campaign.shared import FRICTION
from frictionlab.campaign.sharing import CROSSTALK, FREQUENCY, GAIN, LAG
from frictionlab.campaign.singles import SURE, Singles, Uneven
from frictionlab.campaign.spread import influence
from frictionlab.estimate import Estimate
from frictionlab.identification.causes import AS_KNOWN
from frictionlab.identification.coordinates import suspicion
from frictionlab.identification.fit import LEVEL, excess_of, most_of_noise, suspected
from frictionlab.identification.identify import CORRECTED, is_told
from frictionlab.simulator.laws import Law

FloatArray = NDArray[np.float64]
SOURCES: Mapping[str, tuple[str, ...]] = {
    GAIN: ("gain", "parabola", "cubic"),
    LAG: ("lag",),
    CROSSTALK: ("base_in_mass", "mass_in_base"),
    FREQUENCY: ("natural_frequency",),
    "damping of the frame": ("frame_damping_ratio",),
}
"""What tests share, and the unknowns that stand for it; the first of them gives the sign."""


@dataclass(frozen=True)
class Told:
    """One parameter of the law as all tests tell it, of the test that stands for all; as a single comparison's.

    ``scatter``: from test to test, beyond their own errors; ``p``: how often equal ones would look as uneven; None
    where too few tests tell.
    """

    name: str
    value: Estimate
    told: bool
    scatter: float | None = None
    p: float | None = None

    @property
    def differs(self) -> bool:
        """Whether the tests differ in it beyond doubt."""
        return self.told and self.p is not None and self.p < SURE and bool(self.scatter)


@dataclass(frozen=True)
class TestTold:
    """One test among the others: its own friction ratio with sensors and rig as all tests find them.

    ``misfit``: root of chi-square per degree of freedom; ``nrmse``: of its cycle; ``floor``: what noise alone leaves.
    """

    friction: Estimate
    misfit: float
    nrmse: float
    floor: float


@dataclass(frozen=True)
class Joined:
    """Tests of one material fitted together: ``held`` with sensors and rig as they are known, ``moved`` beside them.

    ``rig``: that which it shares with other materials, where there are others.
    """

    held: Joint
    moved: Joint
    rig: Rig | None = None

    @cached_property
    def is_held(self) -> bool:
        """Whether the law alone leaves no more than noise, so that its values are given."""
        if set(self.held.lost) != set(self.moved.lost):
            return False
        points = sum(len(found.residual) for found in self.held.fits)
        unknowns = len(self.held.shared.coordinates) + len(self.held.fits) - len(self.held.shared.groups)
        freedom = max(1, points - unknowns)
        noise = self.held.chi_square / freedom <= most_of_noise(points)
        return noise and not self._needs_rig

    @property
    def _needs_rig(self) -> bool:
        """Whether the tests need sensors and rig corrected, and that does more to the values than their errors say.

        Many tests find a lag of microseconds for certain. Where it hardly matters the values are those with sensors and
        rig as they are known, and their errors hold what it would do.
        """
        moved, law = self.moved, self.moved.shared.is_law
        if not self._gains_by_rig or (len(self.held.fits) == 1 and self.rig is None):
            return self._gains_by_rig
        gap = np.abs(self.held.solution.point - moved.solution.point[law])
        return bool((gap > np.sqrt(np.diag(moved.spread.total)[law])).any())

    @property
    def _gains_by_rig(self) -> bool:
        """Whether the tests, those of other materials too, fit better than by chance with sensors and rig corrected."""
        if self.rig is not None:
            return self.rig.gained >= float(chi2.isf(LEVEL, self.rig.unknowns))
        nuisances = len(self.moved.shared.coordinates) - len(self.held.shared.coordinates)
        alone = len(self.held.fits) == 1
        limit = CORRECTED if alone else float(chi2.isf(LEVEL, max(nuisances, 1)))
        return self.held.cost(self.moved) - self.moved.cost(self.moved) >= limit

    @property
    def suspicion(self) -> float:
        """How sure it is (0 to 1) that sensors and rig, which all tests share, were moved for something else's sake."""
        if len(self.moved.fits) == 1 and self.rig is None:
            return suspected(self.moved.fits[0])
        return suspicion(self.moved.shared.coordinates, self.moved.solution.point)

    @property
    def best(self) -> Joint:
        """The fit whose values are given."""
        return self.held if self.is_held else self.moved

    @property
    def scatter(self) -> float | None:
        """Relative standard deviation of friction from test to test; None where each group has one test."""
        if not self.freedom:
            return None
        return self.best.solution.scatter * self.best.shared.coordinates[0].width

    @property
    def freedom(self) -> int:
        """Tests that tell the scatter."""
        return max(0, len(self.best.fits) - len(self.best.shared.groups))

    @cached_property
    def statistical(self) -> FloatArray:
        """Variance (P,) of the law's unknowns by noise, misfit and scatter, in deviations squared."""
        spread, law = self.best.spread, self.best.shared.is_law
        own = (spread.prior[:, law] ** 2).sum(axis=1)
        return np.asarray((np.diag(spread.noise) + np.diag(spread.scatter) + own)[law] + self._extra(of_rig=False) ** 2)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance (P, P) of the law's unknowns with all that is not known of sensors and rig."""
        spread, law = self.moved.spread, self.moved.shared.is_law
        found = spread.total[np.ix_(law, law)] + np.outer(self.apart, self.apart)
        extra = self._extra(of_rig=True)
        found = found + np.outer(extra, extra)
        np.fill_diagonal(found, np.maximum(np.diag(found), self.statistical))
        return np.asarray(found)

    @cached_property
    def apart(self) -> FloatArray:
        """How far (P,) the fit that holds sensors and rig is from the one that moves them, where that counts."""
        law = self.moved.shared.is_law
        moved = self.moved.solution.point[law]
        counts = 1.0 if self.is_held else self.suspicion
        return np.asarray(counts * (self.held.solution.point - moved) if counts else np.zeros(len(moved)))

    def shares(self, k: int) -> dict[str, float]:
        """Relative shift of the friction ratio of a group by one standard uncertainty of what tests share."""
        names, left = self.moved.shared.names, self.moved.spread.prior[k]
        width = self.moved.shared.coordinates[k].width
        found = {}
        for source, members in SOURCES.items():
            shifts = [float(left[names.index(name)]) for name in members if name in names]
            sign = math.copysign(1.0, shifts[0]) if shifts else 1.0
            found[source] = sign * width * math.hypot(*shifts)
        return found | ({AS_KNOWN: apart} if (apart := width * float(self.apart[k])) else {})

    def _extra(self, *, of_rig: bool) -> FloatArray:
        """What single tests add for valleys that fit as well, or for a law that does not explain them (P,)."""
        best = self.best
        found = np.zeros(int(best.shared.is_law.sum()))
        for i, (cycle, piece) in enumerate(zip(best.cycles, best.pieces, strict=True)):
            error = self._bent(i) if cycle.alone is None else _beyond(cycle, best.shared.law, of_rig=of_rig)
            if error:
                found += np.abs(influence(best.solution, piece)[: len(found)]) * error
        return found

    def _bent(self, i: int) -> float:
        """What the mean cycle of a friction that scatters may be off by: its relative variance from cycle to cycle."""
        found, k = self.best.fits[i], self.best.places[i].friction
        return 0.0 if k is None else found.coordinates[k].width * self._noises[i] * found.observed.used

    def friction(self, k: int) -> Estimate:
        """Friction ratio of a group, of the test that stands for all."""
        return self._estimate(k)

    def parameters(self) -> list[Told]:
        """The law's other parameters."""
        own = [(k, c) for k, c in enumerate(self.best.shared.coordinates) if c.law and c.name != FRICTION]
        return [Told(c.name, self._estimate(k), self._is_told(k), *self._scattered(k)) for k, c in own]

    def _scattered(self, k: int) -> tuple[float, float] | tuple[None, None]:
        c, one = self.best.shared.coordinates[k], self.uneven.get(self.best.shared.coordinates[k].name)
        return (None, None) if one is None else (one.scatter * c.slope(float(self.best.solution.point[k])), one.p)

    def _estimate(self, k: int) -> Estimate:
        c, point = self.best.shared.coordinates[k], float(self.best.solution.point[k])
        errors = (math.sqrt(v) * c.slope(point) for v in (self.statistical[k], self.covariance[k, k]))
        return Estimate(c.value(point), *errors)

    def _is_told(self, k: int) -> bool:
        c, shared = self.best.shared.coordinates[k], self.best.shared
        point, spread = float(self.best.solution.point[k]), math.sqrt(self.covariance[k, k])
        return is_told(c, shared.law.parameter(c.name), point, spread)

    def tests(self) -> dict[str, TestTold]:
        """What each test says among the others, by its source."""
        return {cycle.source: self._test(i) for i, cycle in enumerate(self.best.cycles)}

    def _test(self, i: int) -> TestTold:
        found, place = self.best.fits[i], self.best.places[i]
        told = (math.sqrt(excess_of(found)), found.nrmse, found.observed.floor)
        k = place.friction
        if k is None:
            return TestTold(Estimate(), *told)
        c, slopes = found.coordinates[k], found.jacobian / math.sqrt(found.excess)
        weight = slopes[:, k] / max(float(slopes[:, k] @ slopes[:, k]), 1e-300)
        point = float(found.point[k] + weight @ found.residual / math.sqrt(found.excess))
        se = math.sqrt(self._noises[i])
        rest = [n for n in range(len(found.coordinates)) if n != k and not found.coordinates[n].law]
        rig = float(((weight @ slopes[:, rest]) ** 2).sum())
        return TestTold(_scaled(c.value(point), c.slope(point), se, math.hypot(se, math.sqrt(rig))), *told)

    @cached_property
    def _noises(self) -> list[float]:
        """Variance of each test's friction by its own noise, in deviations squared, with Student's factor."""
        return [own.cautious for own in self.singles.frictions]

    @cached_property
    def singles(self) -> Singles:
        """What each test says by itself."""
        return Singles(self.best, self.moved)

    @cached_property
    def uneven(self) -> dict[str, Uneven]:
        """How the law's parameters other than friction differ from test to test, those that the tests tell."""
        shared = self.best.shared
        own = [(k, c.name) for k, c in enumerate(shared.coordinates) if c.law and c.name != FRICTION]
        found = {name: self.singles.parameter(k) for k, name in own}
        return {name: one for name, one in found.items() if one is not None}

    @property
    def shown(self) -> dict[str, float]:
        """Scatter of the parameters that differ from test to test beyond doubt, in deviations, by name."""
        return {name: one.cautious for name, one in self.uneven.items() if one.is_shown}

    def evenness(self, group: tuple[str, float]) -> tuple[float, int, float | None]:
        """Chi-square of a group's tests about its friction by their own errors, degrees of freedom, and p."""
        return self.singles.evenness(group)


def _scaled(value: float, slope: float, se: float, u: float) -> Estimate:
    return Estimate(value, slope * se, slope * u)


def _beyond(cycle: Cycle, law: Law, *, of_rig: bool) -> float:
    """What a single comparison's error of the friction ratio holds beyond noise and rig, in deviations."""
    alone = cycle.alone
    if alone is None or alone.family.law.name != law.name:
        return 0.0
    names = [c.name for c in alone.fit.coordinates]
    told = alone.parameters.get(FRICTION)
    if told is None or told.se is None or told.u is None or FRICTION not in names:
        return 0.0
    k = names.index(FRICTION)
    slope = alone.fit.coordinates[k].slope(float(alone.fit.point[k]))
    of_fit = alone.errors.combined[k, k] if of_rig else alone.errors.statistical[k] ** 2
    whole = told.u if of_rig else told.se
    return math.sqrt(max(0.0, (whole / slope) ** 2 - float(of_fit)))


def join(
    cycles: Sequence[Cycle],
    law: Law,
    start: Mapping[str, float],
    frictions: Mapping[tuple[str, float], float],
) -> Joined:
    """Fit one law to the tests of a material, with sensors and rig as they are known and beside them.

    Raises
    ------
    AnalysisError
        No test has a steady state near where the fit begins.
    """
    held = fit_together(cycles, law, start, frictions, rig=False)
    moved = fit_together(cycles, law, {**start, **held.values}, held.frictions, rig=True)
    return Joined(held, moved)


def joined_again(joined: Joined) -> Joined:
    """Fit the same tests again, each with its own value of the parameters that differ from test to test.

    Else the tests that tell a parameter best would give its value alone, and what they do not have in common would look
    like friction that scatters, or like a rig that is off.
    """
    law, uneven = joined.moved.shared.law, joined.shown
    if not uneven:
        return joined
    one, two = (
        fit_together(fit.cycles, law, fit.start, fit.frictions, rig=fit.shared.rig, apart=fit.apart, uneven=uneven)
        for fit in (joined.held, joined.moved)
    )
    return Joined(one, two)
