"""What each candidate would tell: Fisher's information on the shared coordinates, nuisances beside the law.

The noise of a test's mean cycle has the form ``D + U U^T``: white noise and steps of the mass sensor in the diagonal D,
and what no law explains; in the columns of U the base sensor's noise, friction that scatters from cycle to cycle, and
friction that differs from test to test.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.identification.observed import harmonics_of, parts
from frictionlab.planning.outlook import POINTS, Outlook, Shown, later

FloatArray = NDArray[np.float64]
HOUR = 3600.0
CUTS = 8  # places at which friction may change in a cycle
RISES = 0.75  # of a turn of the base's cosine: where a cycle begins


@dataclass(frozen=True)
class Noise:
    """Covariance of mean cycles: ``own`` (n, 2 K or 1) on its diagonal, and ``columns`` (n, 2 K, q) squared."""

    own: FloatArray
    columns: FloatArray

    def within(self, one: FloatArray, other: FloatArray) -> FloatArray:
        """``one^T C^-1 other`` for each test: (n, 2 K, p) and (n, 2 K, s) give (n, p, s)."""
        share = 1.0 / self.own[:, :, None]
        turned = np.swapaxes(self.columns * share, 1, 2)
        inner = turned @ self.columns + np.eye(self.columns.shape[2])
        left, right = turned @ one, turned @ other
        found = np.swapaxes(one * share, 1, 2) @ other - np.swapaxes(left, 1, 2) @ np.linalg.solve(inner, right)
        return np.asarray(found)

    def only(self, some: NDArray[np.intp]) -> "Noise":
        """The same of some tests."""
        return Noise(self.own[some], self.columns[some])


def noise_of(outlook: Outlook, here: Shown, by_friction: FloatArray, *, repeated: bool = True) -> Noise:
    """Return the noise to expect of each test's mean cycle.

    Parameters
    ----------
    outlook, here
        The tests, and what they show.
    by_friction : ndarray of shape (n, 2 K)
        Change of the cycle by the relative friction.
    repeated : bool
        Whether friction that differs from test to test counts: it does for the contact, not for this test's own.
    """
    plan = outlook.lab.scene.plan
    cycles = np.maximum(outlook.columns.cycles, 1.0)
    of_mean = sensor_noise(outlook) / cycles
    base = np.sqrt(of_mean)[:, None, None]
    scatter = (plan.cycle_scatter / np.sqrt(cycles))[:, None, None]
    directions = [
        base * np.stack([here.mean, later(here.mean)], axis=2),
        scatter * by_friction[:, :, None],
        scatter * np.sqrt(2.0 / (CUTS * cycles))[:, None, None] * after_cuts(by_friction),
    ]
    if repeated and (plan.repeatability or plan.drift_per_hour):
        directions.append(_between(outlook)[:, None, None] * by_friction[:, :, None])
    return Noise((of_mean + unexplained(outlook, here.mean))[:, None], np.concatenate(directions, axis=2))


def sensor_noise(outlook: Outlook) -> FloatArray:
    """Variance (n,) of a part of a single cycle's harmonics by the noise and the steps of a sensor alone."""
    plan, columns = outlook.lab.scene.plan, outlook.columns
    one = (plan.noise_m**2 + plan.step_m**2 / 12.0) / columns.amplitude**2
    return np.asarray(2.0 * one * columns.drive_hz / plan.sampling_rate_hz)


def unexplained(outlook: Outlook, mean: FloatArray) -> FloatArray:
    """Variance (n,) of a part of mean cycles (n, 2 K) by what no law explains (``model_error``)."""
    return np.asarray(outlook.lab.scene.plan.model_error**2 * (mean**2).mean(axis=1))


def _between(outlook: Outlook) -> FloatArray:
    """Relative rms by which the friction of a test is off the contact's: it differs, and it drifts on the way."""
    plan = outlook.lab.scene.plan
    drifted = 0.5 * plan.drift_per_hour * outlook.columns.duration / HOUR
    return np.hypot(plan.repeatability, drifted)


def after_cuts(by_friction: FloatArray, cuts: int = CUTS) -> FloatArray:
    """The part of a cycle's change by friction that the next one's friction makes: (n, 2 K, cuts).

    Cycles begin where the base rises through zero; where friction changes in them is chance: one place for each cut.
    """
    count = by_friction.shape[1] // 2
    samples, number = POINTS * count, np.arange(cuts)[:, None]
    lines = np.zeros((len(by_friction), samples // 2 + 1), dtype=np.complex128)
    lines[:, 1 : count + 1] = 0.5 * samples * (by_friction[:, :count] - 1j * by_friction[:, count:])
    cycle = np.fft.irfft(lines, samples, axis=1)
    since = (np.arange(samples) / samples - RISES) % 1.0
    after = since >= (number + 0.5) / cuts
    return np.swapaxes(parts(harmonics_of(cycle[:, None, :] * after, count)), 1, 2)


@dataclass(frozen=True)
class Told:
    """What each test tells on the shared coordinates; zero where it tells nothing.

    ``information`` (n, m, m): of the contact; ``own`` (n, m, m): of the friction that this very test has; ``joint``
    (n, m, m): of that where sensors and rig are found beside it, by the weights that a fit finds.
    """

    here: Shown
    slopes: FloatArray
    noise: Noise
    information: FloatArray
    own: FloatArray
    joint: FloatArray

    def only(self, some: NDArray[np.intp]) -> "Told":
        """The same of some tests."""
        here = Shown(self.here.rows[some], self.here.mean[some])
        parts_of = (self.slopes[some], self.noise.only(some), self.information[some], self.own[some], self.joint[some])
        return Told(here, *parts_of)

    @property
    def tells(self) -> NDArray[np.bool_]:
        """Whether each test tells anything."""
        return np.asarray(self.information.any(axis=(1, 2)))


def told_by(outlook: Outlook) -> Told:
    """Return what each candidate would tell at the values that are expected."""
    here = outlook.show(outlook.expected)
    usable = here.moves & ~_may_stand(outlook) & (outlook.columns.cycles >= 1.0)
    slopes = outlook.slopes(outlook.expected, here) * usable[:, None, None]
    mean = np.where(usable[:, None], here.mean, 0.0)
    by_friction = friction_slope(outlook, slopes)
    shown = Shown(here.rows, mean)
    noise, single = (noise_of(outlook, shown, by_friction, repeated=way) for way in (True, False))
    own = single.within(slopes, slopes)
    return Told(here, slopes, noise, of_contact(outlook, own), own, own)


def of_contact(outlook: Outlook, own: FloatArray) -> FloatArray:
    """What tests tell of the contact (n, m, m), by what they tell of the friction that they themselves have.

    The two are apart by the variance v of friction from test to test, in the first coordinate alone [Sherman and
    Morrison]: ``I - v I e e^T I / (1 + v I_00)``.
    """
    first = outlook.coordinates[0]
    if first.name != "beta":
        return own
    apart = (_between(outlook) / first.width) ** 2
    share = apart / (1.0 + apart * own[:, 0, 0])
    return np.asarray(own - share[:, None, None] * own[:, :, :1] * own[:, :1, :])


def friction_slope(outlook: Outlook, slopes: FloatArray) -> FloatArray:
    """Change (n, 2 K) of the cycle by the relative friction; zero where the friction ratio is held."""
    first = outlook.coordinates[0]
    return slopes[:, :, 0] / first.width if first.name == "beta" else np.zeros(slopes.shape[:2])


def _may_stand(outlook: Outlook) -> NDArray[np.bool_]:
    """Whether the mass would stand still if friction were one standard error higher: then a test may tell nothing."""
    value, error = outlook.lab.coefficient
    more = outlook.values(outlook.expected)
    beta = more.get("beta", np.zeros(len(outlook.scales))) * (1.0 + error / value)
    static = max(1.0, *(v for n, v in outlook.lab.expected.items() if n.startswith("static_ratio")), 1.0)
    force = outlook.columns.r**2 if outlook.lab.scene.model.wall == "base" else np.ones(len(beta))
    return np.asarray(static * beta >= force)
