"""Energy per cycle: the area of the hysteresis loop, eq. (2.18), and the energy input, eq. (2.16), beside it."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.neighbours import lag_one, raised_by_lag_one
from frictionlab.cycle_rule import window_of
from frictionlab.errors import AnalysisError, UsageError

FloatArray = NDArray[np.float64]
MOST = 0.99  # correlation of neighbouring cycles: such a drift hardly has a mean


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


def mean_over(values: FloatArray, used: slice, *, noise: float, shared: float = 0.0, period: int = 1) -> Mean:
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
    period : int
        Cycles after which the motion repeats: whole periods are compared, not cycles.
    """
    if period > 1 and len(values) >= 2 * period:
        whole = values[len(values) % period :].reshape(-1, period).mean(axis=1)
        blocks = slice(len(whole) - max(1, (used.stop - used.start) // period), len(whole))
        return replace(
            mean_over(whole, blocks, noise=noise / math.sqrt(period), shared=shared), cycles=used.stop - used.start
        )
    part = values[used]
    count = len(part)
    told_by = part if count >= 8 else values
    each = _long_run_deviation(told_by, pooled=count > 1) if _is_irregular(told_by, noise) else noise
    return Mean(float(part.mean()), math.hypot(max(each, noise) / math.sqrt(count), shared), count)


def _is_irregular(values: FloatArray, noise: float) -> bool:
    """Whether cycles scatter, or hang together, by more than noise explains (two, and two and a half, deviations)."""
    n = len(values)
    if n < 3:
        return False
    excess = float(values.var(ddof=1)) > noise * noise * (1.0 + 2.0 * math.sqrt(2.0 / (n - 1)))
    return excess or (n >= 12 and lag_one(values) > 2.5 / math.sqrt(n))


def _long_run_deviation(values: FloatArray, *, pooled: bool) -> float:
    """Deviation per cycle whose square over n is the variance of a mean of n: neighbours that hang together count.

    A lag-one correlation rho that is significant takes n independent cycles to n (1 - rho) / (1 + rho).
    """
    hang = raised_by_lag_one(values, most=MOST) if pooled else 1.0
    return math.sqrt(float(values.var(ddof=1)) * hang)
