"""What each candidate would tell: Fisher's information on the shared coordinates, nuisances beside the law.

The noise of a test's mean cycle has the form ``a 1 + U U^T``: white noise and steps of the mass sensor in a, and what
no law explains; in the columns of U the base sensor's noise, friction that scatters from cycle to cycle, and friction
that differs from test to test.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.identification.observed import harmonics_of, parts
from frictionlab.planning.outlook import HARMONICS, SAMPLES, Outlook, Shown, later

FloatArray = NDArray[np.float64]
HOUR = 3600.0
CUTS = 8  # ways in which the change of friction may lie in the cycles
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)  # of a turn: it spreads places evenly


@dataclass(frozen=True)
class Noise:
    """Covariance of mean cycles: ``white`` (n,) times 1, and ``columns`` (n, 2 K, q) times their transpose."""

    white: FloatArray
    columns: FloatArray

    def within(self, one: FloatArray, other: FloatArray) -> FloatArray:
        """``one^T C^-1 other`` for each test: (n, 2 K, p) and (n, 2 K, s) give (n, p, s)."""
        turned = np.swapaxes(self.columns, 1, 2)
        inner = turned @ self.columns + self.white[:, None, None] * np.eye(self.columns.shape[2])
        left, right = turned @ one, turned @ other
        found = np.swapaxes(one, 1, 2) @ other - np.swapaxes(left, 1, 2) @ np.linalg.solve(inner, right)
        return np.asarray(found / self.white[:, None, None])


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
    plan, columns = outlook.lab.scene.plan, outlook.columns
    cycles, samples = np.maximum(columns.cycles, 1.0), plan.sampling_rate_hz / columns.drive_hz
    one = (plan.noise_m**2 + plan.step_m**2 / 12.0) / columns.amplitude**2
    base = np.sqrt(2.0 * one / (samples * cycles))[:, None, None]
    scatter = (plan.cycle_scatter / np.sqrt(cycles))[:, None, None]
    directions = [
        base * np.stack([here.mean, later(here.mean)], axis=2),
        scatter * by_friction[:, :, None],
        scatter * np.sqrt(2.0 / (CUTS * cycles))[:, None, None] * after_cuts(by_friction),
    ]
    if repeated and (plan.repeatability or plan.drift_per_hour):
        directions.append(_between(outlook)[:, None, None] * by_friction[:, :, None])
    unexplained = plan.model_error**2 * (here.mean**2).sum(axis=1) / here.mean.shape[1]
    return Noise(2.0 * one / (samples * cycles) + unexplained, np.concatenate(directions, axis=2))


def _between(outlook: Outlook) -> FloatArray:
    """Relative rms by which the friction of a test is off the contact's: it differs, and it drifts on the way."""
    plan = outlook.lab.scene.plan
    drifted = 0.5 * plan.drift_per_hour * outlook.columns.duration / HOUR
    return np.hypot(plan.repeatability, drifted)


def after_cuts(by_friction: FloatArray, cuts: int = CUTS) -> FloatArray:
    """The part of a cycle's change by friction that the next one's friction makes: (n, 2 K, cuts).

    Where cycles are cut and where friction changes in them is chance: each of the cuts has a place and a share of its
    own.
    """
    count, lines = HARMONICS, np.zeros((len(by_friction), SAMPLES // 2 + 1), dtype=np.complex128)
    lines[:, 1 : count + 1] = 0.5 * SAMPLES * (by_friction[:, :count] - 1j * by_friction[:, count:])
    cycle = np.fft.irfft(lines, SAMPLES, axis=1)
    number = np.arange(cuts)[:, None]
    since = (np.arange(SAMPLES) / SAMPLES - GOLDEN * number) % 1.0
    after = since >= (number + 0.5) / cuts
    return np.swapaxes(parts(harmonics_of(cycle[:, None, :] * after, count)), 1, 2)


@dataclass(frozen=True)
class Told:
    """What each test tells on the shared coordinates; zero where it tells nothing.

    ``information`` (n, m, m): of the contact; ``own`` (n, m, m): of the friction that this very test has.
    """

    here: Shown
    slopes: FloatArray
    noise: Noise
    information: FloatArray
    own: FloatArray

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
    return Told(here, slopes, noise, of_contact(outlook, own), own)


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
