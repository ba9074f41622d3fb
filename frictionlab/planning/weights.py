"""What it costs that a fit finds its weights from the scatter of as few cycles as a test has.

A fit weighs harmonics by the covariance that its cycles show, shrunk because they are few. Weights that are off leave a
parameter's error larger than the best it could be. By how much is found by drawing cycles of the noise to expect,
weighing by what they show, and carrying the true noise through the fit.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.identification.observed import FEWEST_CYCLES, by_base, shrunk
from frictionlab.planning.information import Told, after_cuts, friction_slope, of_contact
from frictionlab.planning.outlook import Outlook

FloatArray = NDArray[np.float64]
DRAWS = 16
MOST_CYCLES = 400  # of more, weights are as good as known


def losses(outlook: Outlook, told: Told, i: int) -> FloatArray:
    """Error of the law's parameters (l,) by the weights that a fit finds, over the least possible error, of one test.

    1 where the test tells nothing, or has too few cycles to weigh by.
    """
    slopes, cycles = told.slopes[i][:, outlook.law], int(outlook.columns.cycles[i])
    if cycles < FEWEST_CYCLES or not told.tells[i]:
        return np.ones(slopes.shape[1])
    generator, single = np.random.default_rng(cycles), _Cycle(outlook, told, i)
    true = single.of_mean(cycles)
    best = np.linalg.inv(_precision(slopes, np.asarray(np.linalg.inv(true))))
    variances = np.zeros(len(best))
    for cut in range(DRAWS):
        weights = np.asarray(np.linalg.inv(single.weighed_by(generator, cycles, cut)))
        gain = np.linalg.solve(_precision(slopes, weights), slopes.T @ weights)
        variances += np.diag(gain @ true @ gain.T) / DRAWS
    least = np.diag(best @ slopes.T @ np.linalg.solve(true, slopes) @ best)
    return np.asarray(np.sqrt(np.maximum(variances / least, 1.0)))


def _precision(slopes: FloatArray, weights: FloatArray) -> FloatArray:
    return np.asarray(slopes.T @ weights @ slopes + np.eye(slopes.shape[1]))


class _Cycle:
    """Noise of the single cycles of one test; friction changes from one to the next, and not where they are cut."""

    def __init__(self, outlook: Outlook, told: Told, i: int) -> None:
        plan, columns = outlook.lab.scene.plan, outlook.columns
        one = (plan.noise_m**2 + plan.step_m**2 / 12.0) / columns.amplitude[i] ** 2
        self.white = float(2.0 * one * columns.drive_hz[i] / plan.sampling_rate_hz)
        by_friction = plan.cycle_scatter * friction_slope(outlook, told.slopes)[i]
        self.after = after_cuts(by_friction[None, :], DRAWS)[0]
        self.scatter = by_friction
        self.mean = told.here.mean[i]

    def of_mean(self, cycles: int) -> FloatArray:
        """Covariance of the mean of so many cycles."""
        white = self.white / cycles
        alike = np.outer(self.scatter, self.scatter) / cycles
        alike += 2.0 / (DRAWS * cycles**2) * self.after @ self.after.T
        return np.asarray(white * np.eye(len(self.mean)) + alike + by_base(self.mean, np.sqrt(white)))

    def weighed_by(self, generator: np.random.Generator, cycles: int, cut: int) -> FloatArray:
        """Covariance of the mean that a fit would find from as many cycles, parted at one of the cuts."""
        count = min(cycles, MOST_CYCLES)
        drawn = np.sqrt(self.white) * generator.standard_normal((count, len(self.mean)))
        friction, after = generator.standard_normal((count + 1, 1)), self.after[:, cut]
        drawn += friction[:-1] * (self.scatter - after) + friction[1:] * after
        white = self.white / cycles
        return np.asarray(shrunk(drawn, self.white) / cycles + by_base(self.mean, np.sqrt(white)))


def weighed(outlook: Outlook, told: Told, some: Sequence[int]) -> Told:
    """Return what tests tell with the weights that a fit will find; of the tests named, the others as they are."""
    own = told.own.copy()
    for i in set(some):
        share = np.ones(len(outlook.law))
        share[outlook.law] = 1.0 / losses(outlook, told, i)
        own[i] *= np.outer(share, share)
    return replace(told, information=of_contact(outlook, own), own=own)
