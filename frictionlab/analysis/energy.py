"""Energy per cycle: the area of the hysteresis loop, eq. (2.18), and the energy input, eq. (2.16), beside it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.autocorrelation import variance_of_mean
from frictionlab.cycle_rule import window_of
from frictionlab.errors import AnalysisError, UsageError

FloatArray = NDArray[np.float64]
FEW = 8  # cycles that tell their own scatter; fewer take that of all
CLEAR = 2.0  # deviations by which scatter must exceed what noise explains


def loop_area(mass: FloatArray, base: FloatArray) -> FloatArray:
    """Area of closed loops, the integral of base d(mass) once round; positive when energy is dissipated.

    The polygon through all points and the two through every second one are combined (Richardson), which removes the
    second-order error of a polygon in a smooth curve: 3e-6 at 64 points a cycle where the polygon alone is 1.6e-3 off.

    Parameters
    ----------
    mass, base : (n, points) arrays
        One cycle a row, equally spaced in phase; the last point is joined to the first. At least 5 points.

    Returns
    -------
    (n,) array
        In the product of the units given; dimensionless (k Y^2) for x/Y and y/Y.

    Examples
    --------
    >>> tau = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    >>> float(loop_area(0.5 * np.sin(tau)[None], np.cos(tau)[None])[0] / (0.5 * np.pi))
    0.99999...
    """
    fine = _polygon(mass, base, 1)
    coarse = 0.5 * _polygon(mass, base, 2)  # both polygons of every second point, halved
    return np.asarray((4.0 * fine - coarse) / 3.0)


def _polygon(mass: FloatArray, base: FloatArray, stride: int) -> FloatArray:
    """Sum of base_i (mass_{i+stride} - mass_{i-stride}) / 2 round the loop."""
    inner = np.einsum("ij,ij->i", base[:, stride:-stride], mass[:, 2 * stride :] - mass[:, : -2 * stride])
    ahead = np.concatenate([mass[:, -2 * stride :], mass[:, : 2 * stride]], axis=1)
    ends = np.concatenate([base[:, -stride:], base[:, :stride]], axis=1)
    edge = np.einsum("ij,ij->i", ends, ahead[:, 2 * stride :] - ahead[:, : 2 * stride])
    return np.asarray(0.5 * (inner + edge))


def energy_input(mass: FloatArray) -> FloatArray:
    """Energy input of a pure cosine base, eq. (2.16): the integral of x' cos(tau), as pi times x's sine part.

    Parameters
    ----------
    mass : (n, points) array
        x/Y, one cycle a row, from tau = -pi/2 (the base rises through zero).
    """
    points = mass.shape[1]
    tau = 2.0 * math.pi * np.arange(points) / points - 0.5 * math.pi
    return np.asarray(np.einsum("ij,j->i", mass, np.sin(tau)) * (2.0 * math.pi / points))


def loop_area_noise(mass: FloatArray, base: FloatArray, mass_noise: float, base_noise: float, samples: float) -> float:
    """Standard error of one loop's area from white sensor noise, to first order.

    Parameters
    ----------
    mass, base : (points,) arrays
        The (mean) cycle, dimensionless.
    mass_noise, base_noise : float
        Rms of the noise of one sample, in the same units.
    samples : float
        Samples the sensor took in the cycle.
    """
    d_mass, d_base = _tangent(mass), _tangent(base)
    variance = mass_noise**2 * float(np.mean(d_base**2)) + base_noise**2 * float(np.mean(d_mass**2))
    variance += 0.9 * (mass_noise * base_noise * samples / (2.0 * math.pi)) ** 2  # noise times noise, 5-point slope
    return 2.0 * math.pi * math.sqrt(variance / samples)


def _tangent(cycle: FloatArray) -> FloatArray:
    """Derivative by tau, central differences round the cycle."""
    return (np.roll(cycle, -1) - np.roll(cycle, 1)) * (len(cycle) / (4.0 * math.pi))


@dataclass(frozen=True)
class Mean:
    """A mean over cycles: ``value``, its standard error ``se``, and the number of cycles it used."""

    value: float
    se: float
    cycles: int


def used_cycles(end_time: FloatArray, rule: str, period: int = 1) -> slice:
    """Which cycles a rule uses: ``last``, ``all``, or ``window:S`` (those that lie in the last S seconds).

    A motion that repeats every ``period`` cycles is taken in whole periods, one at least where there is one.

    Parameters
    ----------
    end_time : (n + 1,) array
        Start of each cycle and the end of the last, s.

    Raises
    ------
    UsageError
        Another rule.
    AnalysisError
        A window shorter than a cycle.
    """
    some = _cycles_of(end_time, rule)
    count = max(some.stop - some.start, min(period, some.stop))
    return slice(some.stop - max(count // period * period, min(count, period)), some.stop)


def _cycles_of(end_time: FloatArray, rule: str) -> slice:
    n = len(end_time) - 1
    try:
        window = window_of(rule)
    except ValueError as error:
        raise UsageError(f"cycles: {error}") from error
    if window is None:
        return slice(n - 1 if rule == "last" else 0, n)
    first = int(np.searchsorted(end_time[:-1], end_time[-1] - window - 1e-9 * abs(window)))
    if first >= n:
        length = end_time[-1] - end_time[-2]
        raise AnalysisError(f"cycles: window of {window:g} s is shorter than one cycle ({length:g} s): widen it")
    return slice(first, n)


def mean_over(
    values: FloatArray, used: slice, *, noise: float, shared: float = 0.0, drift: float = 0.0, period: int = 1
) -> Mean:
    """Mean of a per-cycle series over the cycles used, with its standard error.

    Parameters
    ----------
    values : (n,) array
        One value per steady cycle, all of them: their scatter tells how far one cycle may be from the steady mean.
    used : slice
        The cycles the mean is taken over.
    noise : float
        Standard error of one cycle's value from sensor noise alone: the error is never stated below it.
    shared : float
        Standard error that all cycles have in common, and no mean takes away.
    drift : float
        Relative change from the first to the last cycle (`steadiness.growth`): a steady drift is no scatter.
    period : int
        Cycles after which the motion repeats: whole periods are compared, not cycles.
    """
    count, mean = used.stop - used.start, float(values[used].mean())
    if period > 1 and len(values) >= 2 * period:
        values = values[len(values) % period :].reshape(-1, period).mean(axis=1)
        used, noise = slice(len(values) - max(1, count // period), len(values)), noise / math.sqrt(period)
    part = values[used]
    some = part if len(part) >= FEW else values
    square = noise * noise / len(part)
    if len(some) > 2 and float(some.var(ddof=1)) > noise * noise * (1.0 + CLEAR * math.sqrt(2.0 / (len(some) - 1))):
        alone = float(some.var(ddof=1)) / len(part)
        square = max(alone if len(part) == 1 else variance_of_mean(some) * len(some) / len(part), square)
    return Mean(mean, math.hypot(math.sqrt(square), shared, drift * mean / math.sqrt(12.0)), count)
