"""The weights that a fit finds from the scatter of as few cycles as a test has, and what it costs that they are found.

A fit weighs harmonics by the covariance that its cycles show, shrunk because they are few. Such weights are off: a
parameter's error is larger than the best it could be, and two laws are less far apart than the noise alone would leave
them. By how much is seen by drawing cycles of the noise to expect and weighing by what they show, as the fit does.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.identification.observed import (
    FEW,
    FEWEST_CYCLES,
    ROUNDING,
    by_base,
    harmonics_told,
    of_mean,
)
from frictionlab.planning.information import (
    Noise,
    Told,
    after_cuts,
    friction_slope,
    noise_of,
    of_contact,
    sensor_noise,
    told_by,
    unexplained,
)
from frictionlab.planning.outlook import Outlook

FloatArray = NDArray[np.float64]
DRAWS = 16
MOST_CYCLES = 400  # of more, weights are as good as known
HANGS = 0.25  # correlation of neighbouring cycles where friction changes at some place in them, roughly
PROVEN = 12  # cycles from which a fit takes it for more than chance


@dataclass(frozen=True)
class Seen:
    """One test with the harmonics that a fit keeps, and draws of the covariance that the fit will find.

    ``outlook``, ``told``: of this test alone; ``found`` (d, 2 K, 2 K): of the mean cycle; ``true`` (2 K, 2 K).
    """

    outlook: Outlook
    told: Told
    found: FloatArray
    true: FloatArray


def seen_by_fit(outlook: Outlook, some: Iterable[int]) -> dict[int, Seen]:
    """Return some tests as a fit will see them, by their numbers."""
    return {i: _seen(outlook, i) for i in some}


def _seen(outlook: Outlook, i: int) -> Seen:
    rate = outlook.lab.scene.plan.sampling_rate_hz
    ratio, drive = float(outlook.columns.r[i]), float(outlook.columns.drive_hz[i])
    one = replace(outlook.only([i]), harmonics=harmonics_told(ratio, rate / drive))
    told = told_by(one)
    cycle = _Cycle(one, told)
    generator = np.random.default_rng(cycle.cycles)
    found = np.stack([cycle.found(generator, cut) for cut in range(DRAWS)])
    return Seen(one, told, found, cycle.of_mean())


class _Cycle:
    """Noise of the single cycles of one test; friction changes from one to the next, and not where they begin."""

    def __init__(self, outlook: Outlook, told: Told) -> None:
        plan, columns = outlook.lab.scene.plan, outlook.columns
        self.cycles, self.mean = int(columns.cycles[0]), told.here.mean[0]
        self.white = float(sensor_noise(outlook)[0])
        by_friction = plan.cycle_scatter * friction_slope(outlook, told.slopes)
        self.scatter, self.after = by_friction[0], after_cuts(by_friction, DRAWS)[0]
        self.of_base = by_base(self.mean, np.sqrt(self.white / max(self.cycles, 1)))
        self.least = self.white + float(_rounding(self.mean))

    def of_mean(self) -> FloatArray:
        """Covariance of the mean of all cycles."""
        cycles = max(self.cycles, 1)
        alike = np.outer(self.scatter, self.scatter) / cycles
        alike += 2.0 / (DRAWS * cycles**2) * self.after @ self.after.T
        return np.asarray(self.white / cycles * np.eye(len(self.mean)) + alike + self.of_base)

    def found(self, generator: np.random.Generator, cut: int) -> FloatArray:
        """Covariance of the mean that a fit would find from as many cycles; friction changes at one of the cuts."""
        if self.cycles < FEWEST_CYCLES:
            return np.asarray(self.least / max(self.cycles, 1) * np.eye(len(self.mean)) + self.of_base)
        count = min(self.cycles, MOST_CYCLES)
        drawn = np.sqrt(self.white) * generator.standard_normal((count, len(self.mean)))
        friction, after = generator.standard_normal((count + 1, 1)), self.after[:, cut]
        drawn += friction[:-1] * (self.scatter - after) + friction[1:] * after
        return np.asarray(of_mean(drawn, self.least, self.cycles)[0] + self.of_base)


def _rounding(mean: FloatArray) -> FloatArray:
    """Variance that a fit adds because no interpolation between samples is better."""
    return np.asarray(2.0 * ROUNDING**2 * (mean**2).sum(axis=-1) / mean.shape[-1])


def losses(seen: Seen) -> FloatArray:
    """Error of the law's parameters (l,) by the weights that a fit finds, over the least possible error.

    1 where the test tells nothing, or has too few cycles to weigh by.
    """
    slopes, true = seen.told.slopes[0][:, seen.outlook.law], seen.true
    if seen.outlook.columns.cycles[0] < FEWEST_CYCLES or not seen.told.tells[0]:
        return np.ones(slopes.shape[1])
    best = np.linalg.inv(_precision(slopes, np.asarray(np.linalg.inv(true))))
    gains = [np.linalg.solve(_precision(slopes, weights), slopes.T @ weights) for weights in np.linalg.inv(seen.found)]
    variances = np.mean([np.diag(gain @ true @ gain.T) for gain in gains], axis=0)
    least = np.diag(best @ slopes.T @ np.linalg.solve(true, slopes) @ best)
    return np.asarray(np.sqrt(np.maximum(variances / least, 1.0)))


def _precision(slopes: FloatArray, weights: FloatArray) -> FloatArray:
    return np.asarray(slopes.T @ weights @ slopes + np.eye(slopes.shape[1]))


def joint_information(seen: Seen) -> FloatArray:
    """What one test tells (m, m) where sensors and rig are found beside the law, by the weights that a fit finds.

    Of errors e of the data and c of what was known before, a fit of all leaves ``K e + P c``. The law's values are
    found with sensors and rig as known, and their error holds the distance ``(K - K_law) e`` of the two as well.
    """
    slopes, law, errors = seen.told.slopes[0], seen.outlook.law, np.zeros((len(seen.outlook.law),) * 2)
    for weights in np.linalg.inv(seen.found):
        left, held = (np.linalg.inv(_precision(some, weights)) for some in (slopes, slopes[:, law]))
        gain = left @ slopes.T @ weights
        errors += (gain @ seen.true @ gain.T + left @ left.T) / DRAWS
        apart = gain[law] - held @ slopes[:, law].T @ weights
        errors[np.ix_(law, law)] += apart @ seen.true @ apart.T / DRAWS
    values, turns = np.linalg.eigh(np.linalg.inv(errors) - np.eye(len(errors)))
    return np.asarray(turns * np.maximum(values, 0.0) @ turns.T)


def weighed(outlook: Outlook, told: Told, seen: Mapping[int, Seen]) -> Told:
    """Return what tests tell with the weights that a fit will find; of the tests it sees, the others roughly."""
    own, joint = told.own.copy(), as_weighed(outlook, told).own
    for i, test in seen.items():
        share = np.ones(len(outlook.law))
        share[outlook.law] = 1.0 / losses(test)
        own[i] *= np.outer(share, share)
        joint[i] = joint_information(test) if told.tells[i] else 0.0
    return replace(told, information=of_contact(outlook, own), own=own, joint=joint)


def as_weighed(outlook: Outlook, told: Told) -> Told:
    """Return what tests tell if noise were what a fit takes it for, roughly and of all tests at once.

    What shrinking makes of the expected scatter, in place of draws [Schäfer and Strimmer 2005].
    """
    n = np.maximum(outlook.columns.cycles, 1.0)
    alike, white = _scattered(outlook, told), sensor_noise(outlook)
    of_friction = (alike**2).sum(axis=2)
    variance = white[:, None] + of_friction
    kept, hang = 1.0 - _shrunk_by(alike / np.sqrt(variance)[:, :, None], n), _hangs(of_friction, variance, n)
    floor = white + _rounding(told.here.mean) + FEW / n * variance.mean(axis=1)
    own = (hang / n)[:, None] * (variance - kept[:, None] * of_friction + floor[:, None])
    base = noise_of(outlook, told.here, friction_slope(outlook, told.slopes)).columns
    own = own + unexplained(outlook, told.here.mean)[:, None]
    columns = np.sqrt(kept * hang / n)[:, None, None] * alike
    noise = Noise(np.nan_to_num(own, nan=1.0), np.nan_to_num(np.concatenate([base[:, :, :2], columns], axis=2)))
    found = noise.within(told.slopes, told.slopes)
    return replace(told, noise=noise, information=found, own=found, joint=found)


def _scattered(outlook: Outlook, told: Told) -> FloatArray:
    """Friction's part in a single cycle (n, 2 K, 2): that of its own, and that of the next one's in a quarter of it."""
    by_friction = outlook.lab.scene.plan.cycle_scatter * friction_slope(outlook, told.slopes)
    after = after_cuts(by_friction, 2)[:, :, :1]
    return np.concatenate([by_friction[:, :, None] - after, after], axis=2)


def _shrunk_by(unit: FloatArray, n: FloatArray) -> FloatArray:
    """Share (n,) by which correlations are shrunk, of cycles whose common part (n, 2 K, q) is over their deviation."""
    size = float(unit.shape[1])
    squares = ((np.swapaxes(unit, 1, 2) @ unit) ** 2).sum(axis=(1, 2)) - ((unit**2).sum(axis=2) ** 2).sum(axis=1)
    pairs = size * (size - 1.0)
    spread = (pairs + squares) / n
    return np.asarray(np.clip(spread / (squares + np.maximum(pairs - squares, 0.0) / n), 0.0, 1.0))


def _hangs(of_friction: FloatArray, variance: FloatArray, n: FloatArray) -> FloatArray:
    """By how much a fit raises the variance of the mean (n,) because neighbouring cycles hang together."""
    rho = HANGS * of_friction.sum(axis=1) / variance.sum(axis=1)
    return np.where(n < PROVEN, 1.0, (1.0 + rho) / (1.0 - rho))
