"""Least squares over any number of tests: Gauss-Newton with the tests eliminated one by one (Schur complement).

The coordinates c of the unknowns hold for all tests; a test's own are ``e = c + S d``: S the scatter from test to test
(zero for the rig's), d standard normal. With the whitened residual r and slopes ``J = Q R`` of a test, elimination of
d leaves the test's say on c

    W = R^T (1 + R S S R^T)^-1 R,        v = R^T (1 + R S S R^T)^-1 (Q^T r + R S d),

so that 457 tests cost 457 times one. Between two steps slopes are not computed again but corrected by what the step
has shown (C. G. Broyden, Math. Comp. 19 (1965) 577); they are where a step disappoints, and at the end.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.special import log_ndtr, logsumexp, ndtr, ndtri_exp

from frictionlab.arrays import FloatArray, IntArray
from frictionlab.errors import AnalysisError
from frictionlab.inference.observation import Observation
from frictionlab.inference.unknowns import Unknown
from frictionlab.uncertainty import LEVEL, NORMAL

ENOUGH = 1e-7  # of the sum of squares: a step that is foretold to gain less is not made ...
MISSED = 100.0  # ... times squares over data up to this: values that miss the data are so much less sure
GOOD, POOR = 0.75, 0.25  # gained over foretold, from which steps may be longer, and below which they must be shorter
REACH = 1.0  # standard deviations of its prior that any coordinate may go in the first step
LEAST_REACH = 1e-9
MOST_STEPS, FOLLOWED_STEPS = 60, 200  # of a descent, and of one that is followed to its end
NODES = 40  # of an integral over one coordinate that may only grow from a bound
ROUNDS, SETTLED = 4, 0.2  # of weighing down what the law cannot explain, until its share changes by no more
FARTHEST = 3.0  # scales of its prior beyond which a scatter is no scatter but a misfit of the law
SCATTERS = np.concatenate([[0.0], np.geomspace(0.05, 40.0, 22)])  # over its prior's scale, that are tried
STEPS = np.diff(np.concatenate([[0.0], 0.5 * (SCATTERS[1:] + SCATTERS[:-1]), SCATTERS[-1:]]))
LOG_PRIOR = -np.log1p(2.0 * SCATTERS) - 0.5 * (SCATTERS / 15.0) ** 2  # of a scatter of any size, for errors
NOT_SEEN = 8.0  # scales: the scatter to count where no two tests show it
NO_BOUND = ": near resonance the motion may have no bound; check rig.natural_frequency_hz (--natural-frequency)"


@dataclass(frozen=True)
class Test:
    """One test in a fit: its observation, which of all unknowns it has, and their values over the reference test's."""

    observation: Observation
    index: NDArray[np.intp]
    factors: FloatArray

    __test__ = False  # not pytest's

    def place(self, k: int) -> int:
        """Return where unknown k stands among the test's own."""
        return int(np.flatnonzero(self.index == k)[0])

    def factor(self, k: int) -> float:
        """Return the value of unknown k in this test over that in the reference test."""
        return float(self.factors[self.place(k)])


@dataclass(frozen=True)
class Model:
    """Tests and unknowns of one fit.

    ``scatter`` (m,): standard deviation from test to test, in coordinates; ``most``: steps; ``tolerance``: on the sum
    of squares, over the usual one.
    """

    tests: tuple[Test, ...]
    unknowns: tuple[Unknown, ...]
    scatter: FloatArray
    most: int = MOST_STEPS
    tolerance: float = 1.0

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Bounds (m,) of the coordinates."""
        return np.array([u.low for u in self.unknowns]), np.array([u.high for u in self.unknowns])

    def values(self, i: int, own: FloatArray) -> dict[str, float]:
        """Values of test i by name, from its own coordinates; nothing lies beyond its bounds."""
        test, (low, high) = self.tests[i], self.bounds
        inside = np.clip(own, low[test.index], high[test.index])
        return {
            self.unknowns[k].name: self.unknowns[k].value(float(c)) * float(times)
            for k, c, times in zip(test.index, inside, test.factors, strict=True)
        }

    def own(self, i: int, point: FloatArray, local: FloatArray) -> FloatArray:
        """Coordinates of test i."""
        index = self.tests[i].index
        return np.asarray(point[index] + self.scatter[index] * local)

    def look(self, i: int, own: FloatArray, near: Any = None) -> tuple[FloatArray, Any] | None:
        """Whitened residual of test i, and the motion it is of (``near``: begun at); None where there is no motion."""
        observation, values = self.tests[i].observation, self.values(i, own)
        motion = observation.motion(values, near)
        predicted = None if motion is None else observation.seen(motion, values)
        if predicted is None or not np.all(np.isfinite(predicted)):
            return None
        return observation.white(observation.data - predicted), motion

    def slopes(self, i: int, own: FloatArray, motion: Any = None, by: int | None = None) -> FloatArray:
        """Whitened slopes of test i's prediction by its own coordinates, or by one alone; ``motion``: the one there."""
        test, some = self.tests[i], slice(None) if by is None else self.tests[i].index == by
        unknowns, factors = [self.unknowns[k] for k in test.index[some]], test.factors[some].tolist()
        return test.observation.white(test.observation.slopes(unknowns, factors, self.values(i, own), motion))

    def strains(self, point: FloatArray) -> FloatArray:
        """Residuals (m,) of the priors."""
        return np.array([u.strain(float(c)) for u, c in zip(self.unknowns, point, strict=True)])

    def holds(self, point: FloatArray) -> FloatArray:
        """How firmly the priors hold the coordinates (m,)."""
        return np.array([u.hold(float(c)) for u, c in zip(self.unknowns, point, strict=True)])


class Reduced(NamedTuple):
    """Normal equations of all unknowns, the tests' own deviations eliminated.

    ``precision`` (m, m) and ``pull`` (m,): without the priors; ``each``: the same of every test on its own index;
    ``log_volume``: half the logarithm of the determinants that elimination leaves.
    """

    precision: FloatArray
    pull: FloatArray
    each: tuple[tuple[FloatArray, FloatArray], ...]
    log_volume: float


@dataclass(frozen=True)
class Fit:
    """Laws with values for some tests: a model at a point, with the residuals and slopes there.

    ``point`` (m,): coordinates of the unknowns; by test ``local``: its deviations, ``residuals``, whitened, ``slopes``,
    and ``motions``, at which slopes are taken; ``true``: whether slopes are simulated, not corrected by steps.
    """

    model: Model
    point: FloatArray
    local: tuple[FloatArray, ...]
    residuals: tuple[FloatArray, ...]
    slopes: tuple[FloatArray, ...]
    motions: tuple[Any, ...] = ()
    true: bool = True

    def own(self, i: int = 0) -> FloatArray:
        """Coordinates of test i."""
        return self.model.own(i, self.point, self.local[i])

    def values(self, i: int = 0) -> dict[str, float]:
        """Values of test i, by name."""
        return self.model.values(i, self.own(i))

    @cached_property
    def cost(self) -> float:
        """Sum of squares, priors counted: what is made least."""
        own = sum(float(r @ r) + float(d @ d) for r, d in zip(self.residuals, self.local, strict=True))
        return own + float(np.sum(self.model.strains(self.point) ** 2))

    @cached_property
    def chi_square(self) -> float:
        """Sum of squares of the residuals over the noise alone."""
        return sum(t.observation.chi_square(r) for t, r in zip(self.model.tests, self.residuals, strict=True))

    def nrmse(self, tests: Iterable[int] | None = None) -> float:
        """Rms over some tests (all) of what is left of each."""
        some = range(len(self.model.tests)) if tests is None else tests
        each = [self.model.tests[i].observation.nrmse(self.residuals[i]) for i in some]
        return math.sqrt(math.fsum(e * e for e in each) / len(each))

    @cached_property
    def scatter_to_count(self) -> FloatArray:
        """Scatters (m,) from test to test that errors are to count.

        What tests share is a mixture of normal distributions over every scatter that they leave possible, with long
        tails where they are few: each scatter is the one with which 1.96 standard errors reach as far as 95 % of it.
        """
        counted = self.model.scatter.copy()
        for group, scales in _scattering(self):
            weight, away, errors = _over_scatter(self, self.model.scatter, group, scales, LOG_PRIOR)
            for k, scale, off, sd in zip(group, scales, away.T, errors.T, strict=True):
                reach = NORMAL * sd[:, None]
                held = (ndtr((reach - off) / sd) - ndtr((-reach - off) / sd)) @ weight
                counted[k] = scale * float(np.interp(LEVEL, held, SCATTERS))
        return counted

    @cached_property
    def roots(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Of each test the triangular root R (k, n) of its slopes, and the residual (k,) along their directions Q."""
        made = (np.linalg.qr(slopes) for slopes in self.slopes)
        return tuple((root, q.T @ residual) for (q, root), residual in zip(made, self.residuals, strict=True))

    @cached_property
    def reduced(self) -> Reduced:
        """Normal equations of the unknowns."""
        m = len(self.model.unknowns)
        precision, pull, each, volume = np.zeros((m, m)), np.zeros(m), [], 0.0
        parts = zip(self.model.tests, self.roots, self.local, strict=True)
        for test, (root, own), local in parts:
            spread = root * self.model.scatter[test.index]
            white, log_volume = beside_deviations(np.column_stack([root, own + spread @ local]), spread)
            information, force = white[:, :-1].T @ white[:, :-1], white[:, :-1].T @ white[:, -1]
            volume += float(log_volume)
            precision[np.ix_(test.index, test.index)] += information
            pull[test.index] += force
            each.append((information, force))
        return Reduced(precision, pull, tuple(each), volume)

    @cached_property
    def precision(self) -> FloatArray:
        """Inverse of the posterior covariance (m, m), by the curvature."""
        return np.asarray(self.reduced.precision + np.diag(self.model.holds(self.point)))

    def freedom(self, i: int = 0, *, shown: bool = False) -> float:
        """Degrees of freedom of test i: its data (or `effective_data`, if ``shown``), less the unknowns it determines.

        Of unknowns that tests share, half.
        """
        data = self.model.tests[i].observation.effective_data if shown else len(self.residuals[i])
        determined = float((np.abs(self.slopes[i]).max(axis=0, initial=0.0) > 1.0).sum())
        share = 1.0 if len(self.model.tests) == 1 else 0.5
        return max(1.0, data - share * determined)

    def excess(self, i: int = 0) -> float:
        """Chi-square of test i per degree of freedom, at least 1."""
        return max(1.0, self.model.tests[i].observation.chi_square(self.residuals[i]) / self.freedom(i))

    def shares_missed(self, *, shown: bool = False) -> FloatArray:
        """Return the share (n,) of each test's power that its law misses: one for all tests of a material.

        With it chi-square of these tests is what their number of data lets expect. ``shown``: of those whose noise the
        cycles show; what is assumed of others for want of cycles is so much that a sum over all hides a misfit.
        """
        tests, shares = self.model.tests, np.zeros(len(self.model.tests))
        for material in {t.observation.material for t in tests}:
            some = [i for i, t in enumerate(tests) if t.observation.material == material]
            own = tests[some[0]].observation.share_missed(self.residuals[some[0]], self.values(some[0]))
            if own is not None:
                shares[some] = own
                continue
            wanted = sum(self.freedom(i, shown=shown) for i in some)

            def left(share: float, some: list[int] = some, wanted: float = wanted) -> float:
                return sum(tests[i].observation.chi_square(self.residuals[i], share) for i in some) - wanted

            if left(0.0) > 0.0:
                low, high = -40.0, 5.0  # of the logarithm
                while high - low > 1e-3:
                    middle = 0.5 * (low + high)
                    low, high = (middle, high) if left(math.exp(middle)) > 0.0 else (low, middle)
                shares[some] = math.exp(high)
        return shares

    @cached_property
    def log_evidence(self) -> float:
        """Logarithm of the evidence: Laplace's approximation about a fit by the noise alone.

        The scatter from test to test is marginalised by the deviations' determinants at its likeliest size. Unknowns at
        a bound that they may only grow from have the normal distribution's peak beyond: with the slope g there it is at
        ``point + P g``, and higher by ``g P g / 2``. The part inside all bounds counts, and each half of a prior twice.
        """
        model, reduced, precision, point = self.model, self.reduced, self.precision, self.point
        total = -0.5 * self.cost - reduced.log_volume - 0.5 * float(np.linalg.slogdet(precision)[1])
        for test in model.tests:
            sd = test.observation.sd
            total -= float(np.log(sd).sum()) + 0.5 * len(sd) * math.log(2.0 * math.pi)
        total -= 0.5 * math.log(math.pi) * sum(bool(u.assumed) for u in model.unknowns)  # Cauchy's peak over normal's
        folded = [k for k, u in enumerate(model.unknowns) if u.folded]
        if not folded:
            return total
        slope = reduced.pull - point * model.holds(point)
        covariance: FloatArray = np.asarray(np.linalg.inv(precision))
        low, pushed = np.array([model.unknowns[k].low for k in folded]), np.zeros(len(point))
        pushed[folded] = np.where(point[folded] - low < 1e-6, np.minimum(slope[folded], 0.0), 0.0)
        beyond = covariance @ pushed
        peak = (point + beyond)[folded] - low
        inside_bounds = float(log_orthant(peak, covariance[np.ix_(folded, folded)]))
        return total + 0.5 * float(pushed @ beyond) + inside_bounds + len(folded) * math.log(2)

    def find(self, name: str, i: int = 0) -> int | None:
        """Place of an unknown of test i among all unknowns; None where it has none of that name."""
        return next((int(k) for k in self.model.tests[i].index if self.model.unknowns[k].name == name), None)

    def simulated(self) -> "Fit":
        """Return the same with true slopes."""
        motions = self.motions or (None,) * len(self.local)
        slopes = tuple(self.model.slopes(i, self.own(i), motion) for i, motion in enumerate(motions))
        return replace(self, slopes=slopes, true=True)


def placed(model: Model, point: FloatArray, residuals: Iterable[FloatArray], slopes: Iterable[FloatArray]) -> Fit:
    """Return the fit that stands at a point, with these residuals and slopes; no test deviates from the others."""
    return Fit(model, point, tuple(np.zeros(len(t.index)) for t in model.tests), tuple(residuals), tuple(slopes))


def fit_at(model: Model, point: FloatArray, local: Sequence[FloatArray] | None = None) -> Fit:
    """Return the fit that stands at a point; AnalysisError where a test has no motion there."""
    here = looked(model, point, local)
    if here is None:
        raise AnalysisError("the values that a fit was to begin at have no steady state")
    return here.simulated()


def looked(
    model: Model, point: FloatArray, local: Sequence[FloatArray] | None = None, near: Fit | None = None
) -> Fit | None:
    """Return the fit at a point, drawn within bounds, without slopes; None where a test has no motion.

    ``near``: whose motions they begin at.
    """
    point = np.clip(point, *model.bounds)
    here, found = placed(model, point, (), ()) if local is None else Fit(model, point, tuple(local), (), ()), []
    for i in range(len(model.tests)):
        looked = model.look(i, here.own(i), near.motions[i] if near is not None and near.motions else None)
        if looked is None:
            return None
        found.append(looked)
    residuals, motions = zip(*found, strict=True) if found else ((), ())
    return replace(here, residuals=residuals, motions=motions, true=False)


def cost(model: Model, point: FloatArray, local: Sequence[FloatArray] | None = None) -> float:
    """Return the sum of squares at a point, priors counted; infinite where a test has no motion."""
    here = looked(model, point, local)
    return math.inf if here is None else here.cost


def beside(here: Fit, other: Fit, k: int) -> Fit:
    """Return a fit with the slopes of another fit of its tests; those by unknown k are simulated."""
    slopes = []
    for i, test in enumerate(here.model.tests):
        made = np.empty((len(here.residuals[i]), len(test.index)))
        made[:, test.index != k] = other.slopes[i][:, other.model.tests[i].index != k]
        made[:, test.index == k] = here.model.slopes(i, here.own(i), here.motions[i], by=k)
        slopes.append(made)
    return replace(here, slopes=tuple(slopes), true=False)


def descend(here: Fit, *, true: bool = True) -> Fit:
    """Return the best fit near a start; not ``true``: as far as slopes lead that steps have corrected."""
    model, reach, data = here.model, REACH, sum(len(r) for r in here.residuals)
    for _ in range(model.most):
        step, moves, foretold = _step(here, reach)
        missed = min(max(here.cost / data, 1.0), MISSED)
        if foretold <= ENOUGH * model.tolerance * missed * here.cost or reach < LEAST_REACH:
            if here.true or not true:
                return here
            here, reach = here.simulated(), max(reach, LEAST_REACH)
            continue
        there = looked(model, here.point + step, [d + move for d, move in zip(here.local, moves, strict=True)], here)
        length = float(np.abs(step).max(initial=0.0))
        gained = -math.inf if there is None else (here.cost - there.cost) / foretold
        if there is None or gained <= 0.0:
            shorter = 0.25 * max(min(length, reach), LEAST_REACH)
            here, reach = (here, shorter) if here.true else (here.simulated(), reach)
        elif gained < POOR:
            here, reach = there.simulated(), 0.25 * length if here.true else reach
        else:
            here, reach = _corrected(here, there), max(reach, 2.0 * length) if gained > GOOD else reach
    return here if here.true or not true else here.simulated()


def _corrected(here: Fit, there: Fit) -> Fit:
    """The fit after a step, the slopes before it corrected by what it has shown."""
    slopes = []
    for i, (before, after) in enumerate(zip(here.residuals, there.residuals, strict=True)):
        own = there.own(i) - here.own(i)
        size = float(own @ own)
        shown = before - after - here.slopes[i] @ own
        slopes.append(here.slopes[i] + np.outer(shown, own / size) if size > 0.0 else here.slopes[i])
    return replace(there, slopes=tuple(slopes))


def _step(here: Fit, reach: float) -> tuple[FloatArray, list[FloatArray], float]:
    """The step of the unknowns, those of each test's deviations, and by how much the sum of squares should fall."""
    model, strains = here.model, here.model.strains(here.point)
    bent = np.array([u.strain_slope(float(c)) for u, c in zip(model.unknowns, here.point, strict=True)])
    curvature, slope = here.reduced.precision + np.diag(bent**2), bent * strains - here.reduced.pull
    low, high = (np.clip(end - here.point, -reach, reach) for end in model.bounds)
    step: FloatArray = np.asarray(np.linalg.solve(curvature, -slope))
    if (step < low).any() or (step > high).any():
        root = np.linalg.cholesky(curvature).T
        step = lsq_linear(root, -np.linalg.solve(root.T, slope), (low, high), method="bvls", tol=1e-14).x
    moves, foretold = [], -float(2.0 * (bent * strains) @ step + (bent * step) @ (bent * step))
    for i, test in enumerate(model.tests):
        s = model.scatter[test.index]
        left, scaled = here.residuals[i] - here.slopes[i] @ step[test.index], here.slopes[i] * s
        move = np.linalg.solve(np.eye(len(s)) + scaled.T @ scaled, scaled.T @ left - here.local[i])
        longest = float(np.abs(s * move).max(initial=0.0))
        move *= min(1.0, max(reach, 1e-3) / longest) if longest > 0.0 else 1.0
        left, after = left - scaled @ move, here.local[i] + move
        foretold += float(here.residuals[i] @ here.residuals[i] - left @ left)
        foretold += float(here.local[i] @ here.local[i] - after @ after)
        moves.append(np.asarray(move))
    return step, moves, foretold


def fit_from(
    model: Model, starts: Sequence[FloatArray], local: Sequence[FloatArray] | None = None, *, tempers: bool = True
) -> Fit:
    """Return the best fit from the best of some starts; ``tempers``: what the law cannot explain counts as noise."""
    places = [p for start in starts if (p := looked(model, start, local)) is not None]
    if not places:
        raise AnalysisError(f"no value tried has a steady state{NO_BOUND}")
    found = descend(min(places, key=lambda place: place.cost).simulated())
    return tempered(found) if tempers else found


def followed(found: Fit) -> Fit:
    """Return the fit at its minimum: a descent along a curved valley may have ended before, at the steps allowed.

    Errors are those of a minimum, so none may be stated before it is reached.
    """
    further = replace(found.model, most=max(found.model.most, FOLLOWED_STEPS))
    return replace(descend(replace(found, model=further)), model=found.model)


def tempered(found: Fit, *, shown: bool = False) -> Fit:
    """Return the fit whose weights count what its laws cannot explain, and no more (`Fit.shares_missed`)."""
    for _ in range(ROUNDS):
        before = np.array([test.observation.missed for test in found.model.tests])
        wanted = found.shares_missed(shown=shown)
        if np.allclose(wanted, before, rtol=SETTLED, atol=0.0):
            break
        found = weighed(found, wanted)
    return found


def weighed(found: Fit, shares: FloatArray, *, follows: bool = True) -> Fit:
    """Return the fit whose weights count a share of each test's power as what its law misses.

    ``follows``: to its new minimum; else it stays where it stands.
    """
    tests, residuals, slopes = [], [], []
    each = zip(found.model.tests, shares.tolist(), found.residuals, found.slopes, strict=True)
    for test, share, residual, slope in each:
        observation = test.observation.missing(share)
        tests.append(replace(test, observation=observation))
        residuals.append(observation.white(test.observation.gap(residual)))
        slopes.append(observation.white(test.observation.gap(slope)))
    model = replace(found.model, tests=tuple(tests))
    moved = replace(found, model=model, residuals=tuple(residuals), slopes=tuple(slopes))
    return descend(moved) if follows else moved


def with_scatter(found: Fit, farthest: float = FARTHEST, *, lifts: bool = False) -> Fit:
    """Return the fit weighed by the scatter from test to test that is to be expected of it.

    Each scatter is tried on a grid, the others held, until nothing moves: the marginal likelihood of all tests by their
    linear slopes, times a half-Cauchy prior. One test gives no scatter. ``farthest``: scales of its prior beyond which
    scatter is misfit; ``lifts``: not so of a scatter found there, for a law that explains its tests has no misfit.
    """
    model = found.model
    if len(model.tests) < 2:
        return found
    for _ in range(2):
        found = descend(scattered(found, farthest))
    bounds = [FARTHEST * u.scatter_scale(c) for u, c in zip(model.unknowns, found.point.tolist(), strict=True)]
    return with_scatter(found, math.inf) if lifts and (found.model.scatter > bounds).any() else found


def scattered(found: Fit, farthest: float = FARTHEST) -> Fit:
    """Return the fit with the scatter that its linear slopes ask for, its tests where they are."""
    log_prior = -np.log1p(SCATTERS**2) - 0.5 * (SCATTERS / farthest) ** 2
    scatter, old = found.model.scatter.copy(), found.model.scatter
    for _ in range(2):
        for group, scales in _scattering(found):
            weight, _, _ = _over_scatter(found, scatter, group, scales, log_prior)
            scatter[group] = float(weight @ SCATTERS) * scales
    local = tuple(
        np.divide(old[t.index] * d, scatter[t.index], out=np.zeros(len(d)), where=scatter[t.index] > 0.0)
        for t, d in zip(found.model.tests, found.local, strict=True)
    )
    return replace(found, model=replace(found.model, scatter=scatter), local=local)


def stepped(found: Fit) -> Fit:
    """Return the fit with what tests share where linear slopes have their minimum; nothing is simulated."""
    step = np.linalg.solve(found.precision, found.reduced.pull - found.point * found.model.holds(found.point))
    there = np.clip(found.point + step, *found.model.bounds)
    each = zip(found.residuals, found.slopes, found.model.tests, strict=True)
    left = tuple(r - slopes @ (there - found.point)[test.index] for r, slopes, test in each)
    return replace(found, point=there, residuals=left)


def let_apart(found: Fit) -> Fit:
    """Return the fit whose tests may differ as far as any scatter goes, weighed by the noise alone."""
    model, scatter = found.model, found.model.scatter.copy()
    for k, unknown in enumerate(model.unknowns):
        if sum(k in t.index for t in model.tests) > 1:
            scatter[k] = max(scatter[k], FARTHEST * unknown.scatter_scale(float(found.point[k])))
    return weighed(replace(found, model=replace(model, scatter=scatter), true=False), np.zeros(len(model.tests)))


def _scattering(found: Fit) -> Iterator[tuple[IntArray, FloatArray]]:
    """The unknowns that may differ between tests, and the scale of each one's scatter.

    What stands for one parameter of a material under several normal forces scatters alike, and is one group.
    """
    groups: defaultdict[tuple[object, str], list[int]] = defaultdict(list)
    for test in found.model.tests:
        for k in test.index.tolist():
            u = found.model.unknowns[k]
            groups[test.observation.material if u.law else "", u.name].append(k)
    for tests in groups.values():
        group = np.unique(tests)
        scales = np.array([found.model.unknowns[k].scatter_scale(float(found.point[k])) for k in group.tolist()])
        if scales.min() > 0.0 and len(tests) > len(group):
            yield group, scales


def beside_deviations(columns: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return columns (..., k, m), white but for a test's n deviations, made white with these, and half the log volume.

    ``spread`` (..., k, n): what each deviation does, by its scatter.
    """
    lower = np.linalg.cholesky(np.eye(columns.shape[-2]) + spread @ spread.mT)
    log_volume = np.log(np.diagonal(lower, axis1=-2, axis2=-1)).sum(axis=-1)
    return np.asarray(np.linalg.solve(lower, columns)), np.asarray(log_volume)


def _over_scatter(
    found: Fit, scatter: FloatArray, group: IntArray, scales: FloatArray, log_prior: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Over the grid of a group's scatter (g,): its probability, how far off each unknown then is (g, k), its error.

    By the marginal likelihood of all tests, the other scatters held and all else integrated over.
    """
    scatters = np.tile(scatter, (len(SCATTERS), 1))
    scatters[:, group] = np.outer(SCATTERS, scales)
    model, hold = found.model, found.model.holds(found.point)
    precision, pull = np.tile(np.diag(hold), (len(scatters), 1, 1)), np.tile(-hold * found.point, (len(scatters), 1))
    total = log_prior.copy()
    for test, (root, own), local in zip(model.tests, found.roots, found.local, strict=True):
        spread = root * scatters[:, None, test.index]
        as_one = own + root @ (model.scatter[test.index] * local)  # as if no test deviated
        both, log_volume = beside_deviations(np.column_stack([root, as_one])[None], spread)
        white, left = both[:, :, :-1], both[:, :, -1:]
        precision[:, test.index[:, None], test.index] += white.mT @ white
        pull[:, test.index] += (white.mT @ left)[:, :, 0]
        total -= 0.5 * np.sum(left**2, axis=(1, 2)) + log_volume
    covariance: FloatArray = np.asarray(np.linalg.inv(precision))
    moved = (covariance @ pull[:, :, None])[:, :, 0]
    total += 0.5 * np.sum(pull * moved, axis=1) - 0.5 * np.linalg.slogdet(precision)[1]
    weight = np.exp(total - total.max()) * STEPS
    return weight / weight.sum(), moved[:, group], np.sqrt(covariance[:, group, group])


def log_orthant(mean: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the logarithm of the probability that no coordinate of a normal distribution is negative.

    ``mean`` (..., n), ``covariance`` (n, n). The coordinate that is least likely above zero is integrated by Gauss's
    rule over its own distribution there, the others given it [Genz, J. Comput. Graph. Stat. 1 (1992) 141]: another
    one's nodes would miss the few values that it leaves where the two are correlated.
    """
    sds = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    order = np.argsort((mean / sds).reshape(-1, mean.shape[-1]).mean(axis=0))
    mean, covariance, sd = mean[..., order], covariance[np.ix_(order, order)], float(sds[order[0]])
    first = np.asarray(log_ndtr(mean[..., 0] / sd))
    if mean.shape[-1] == 1:
        return first
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    at = -sd * ndtri_exp(np.log(0.5 * (nodes + 1.0)) + first[..., None])
    share = covariance[1:, 0] / sd**2
    rest = log_orthant(mean[..., None, 1:] + at[..., None] * share, covariance[1:, 1:] - sd**2 * np.outer(share, share))
    return np.asarray(first + logsumexp(rest, b=0.5 * weights, axis=-1))
