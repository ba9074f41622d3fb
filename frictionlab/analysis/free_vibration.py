"""Free decay: natural frequency from the spectrum, damping from the way the swing dies."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.noise import white_noise
from frictionlab.analysis.spectrum import strongest_tone
from frictionlab.errors import AnalysisError

FloatArray = NDArray[np.float64]
LEAST_SWINGS = 6  # half-cycles
SPECTRUM_PADDING = 16  # decays are short: the padding costs nothing


@dataclass(frozen=True)
class FreeVibration:
    """One free decay.

    ``damped_frequency_hz`` as the spectrum shows it, ``natural_frequency_hz`` without the damping, with its standard
    error; ``damping_ratio`` (viscous, from the logarithmic decrement) with its standard error; ``coulomb_m``: friction
    force over stiffness F/k [m], from the linear decay, with its standard error; ``decay``: which of the two fits
    better, ``viscous`` or ``Coulomb``; ``viscous_misfit``, ``coulomb_misfit``: rms over the first swing; ``swings``:
    half-cycles used; ``amplitude_m``: of the first one.
    """

    natural_frequency_hz: float
    natural_frequency_hz_se: float
    damped_frequency_hz: float
    damping_ratio: float
    damping_ratio_se: float
    coulomb_m: float
    coulomb_m_se: float
    decay: str
    viscous_misfit: float
    coulomb_misfit: float
    swings: int
    amplitude_m: float


@dataclass(frozen=True)
class Average:
    """Mean over tests, spread (standard deviation, None for one test) and standard error of the mean."""

    mean: float
    spread: float | None
    se: float | None


@dataclass(frozen=True)
class _Line:
    """A weighted straight line: value at 0, slope, its standard error, and the fitted values (n,)."""

    start: float
    slope: float
    slope_se: float
    fitted: FloatArray


def free_vibration(displacement: FloatArray, step: float) -> FreeVibration:
    """Natural frequency and damping from a free decay.

    The swing h_j is half the distance between neighbouring extremes, so the sensor's zero does not matter. Viscous
    damping makes it h_0 exp(-zeta omega_n t), Coulomb friction h_0 - 2 (F/k) j for the j-th half-cycle.

    Parameters
    ----------
    displacement : (n,) array
        Mass, m; may begin before the release and end after the motion died.
    step : float
        Sampling interval, s.

    Raises
    ------
    AnalysisError
        Fewer than six half-cycles stand above the noise.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.004)
    >>> decay = free_vibration(5e-3 * np.exp(-0.01 * 2 * np.pi * 3.0 * t) * np.cos(2 * np.pi * 3.0 * t), 0.004)
    >>> print(f"{decay.natural_frequency_hz:.3f} {decay.damping_ratio:.4f} {decay.decay}")
    3.000 0.0100 viscous
    """
    noise = white_noise(displacement) if len(displacement) >= 16 else 0.0
    rest = float(np.median(displacement[-max(1, len(displacement) // 4) :]))
    x = displacement - rest
    at, height = _extremes(x, noise)
    if len(at) - 1 < LEAST_SWINGS:
        raise AnalysisError(
            f"free vibration: expected at least {LEAST_SWINGS} half-cycles above the noise; got {max(0, len(at) - 1)}:"
            " displace the mass, let go, and record until it rests"
        )
    swing = 0.5 * np.abs(np.diff(height))
    middle = 0.5 * (at[1:] + at[:-1]) * step
    first, last = int(at[0]), int(at[-1]) + 1
    part = x[first:last]
    frequency = strongest_tone(part, step, padding=SPECTRUM_PADDING).frequency
    viscous, coulomb = _exponential(middle, swing), _weighted_line(np.arange(len(swing), dtype=np.float64), swing, None)
    decrement = -viscous.slope / frequency  # per cycle
    zeta = decrement / math.hypot(2.0 * math.pi, decrement)
    misfit = [float(np.sqrt(np.mean((f.fitted - swing) ** 2))) / swing[0] for f in (viscous, coulomb)]
    return FreeVibration(
        natural_frequency_hz=frequency / math.sqrt(1.0 - zeta * zeta),
        natural_frequency_hz_se=_frequency_error(at * step, frequency),
        damped_frequency_hz=frequency,
        damping_ratio=zeta,
        damping_ratio_se=viscous.slope_se / frequency / (2.0 * math.pi),
        coulomb_m=-0.5 * coulomb.slope,
        coulomb_m_se=0.5 * coulomb.slope_se,
        decay="viscous" if misfit[0] <= misfit[1] else "Coulomb",
        viscous_misfit=misfit[0],
        coulomb_misfit=misfit[1],
        swings=len(swing),
        amplitude_m=float(swing[0]),
    )


def _extremes(x: FloatArray, noise: float) -> tuple[FloatArray, FloatArray]:
    """Turning points after the release: fractional sample numbers and heights, between crossings of rest.

    The release is where the mass is farthest from rest for the last time within 2 %; what is below ten times the noise
    is left out.
    """
    size = np.abs(x)
    release = int(np.flatnonzero(size >= 0.98 * size.max())[0])
    crossing = release + np.flatnonzero(np.diff(x[release:] >= 0.0))
    at, height = [], []
    for begin, end in zip(crossing[:-1] + 1, crossing[1:] + 1, strict=True):
        top = begin + int(np.argmax(size[begin:end]))
        if size[top] < 10.0 * noise:
            break
        if end - begin < 4 or not 0 < top < len(x) - 1:
            continue
        place, value = _vertex(x, top, max(1, (end - begin) // 8))
        at.append(place)
        height.append(value)
    return np.array(at), np.array(height)


def _vertex(x: FloatArray, top: int, reach: int) -> tuple[float, float]:
    """Vertex of the least-squares parabola through the samples about a turning point."""
    reach = min(reach, top, len(x) - 1 - top)
    u = np.arange(-reach, reach + 1, dtype=np.float64)
    if reach < 1:
        return float(top), float(x[top])
    c, b, a = np.polynomial.polynomial.polyfit(u, x[top - reach : top + reach + 1], 2)
    if a == 0.0:
        return float(top), float(c)
    offset = float(np.clip(-b / (2.0 * a), -reach, reach))
    return top + offset, float(c + offset * (b + a * offset))


def _exponential(time: FloatArray, swing: FloatArray) -> _Line:
    """Line through the logs, weighted so that each swing counts with the same absolute error."""
    line = _weighted_line(time, np.log(swing), swing)
    return _Line(line.start, line.slope, line.slope_se, np.exp(line.fitted))


def _weighted_line(at: FloatArray, value: FloatArray, weight: FloatArray | None) -> _Line:
    w = np.ones_like(value) if weight is None else weight / weight.max()
    design = np.stack([np.ones_like(at), at], axis=1) * w[:, None]
    (start, slope), *_ = np.linalg.lstsq(design, value * w, rcond=None)
    fitted = start + slope * at
    variance = float(np.sum((w * (value - fitted)) ** 2)) / max(1, len(at) - 2)
    covariance = np.linalg.inv(design.T @ design) * variance
    return _Line(float(start), float(slope), math.sqrt(float(covariance[1, 1])), fitted)


def _frequency_error(turning: FloatArray, frequency: float) -> float:
    """Standard error of the frequency, from the scatter of the turning points about even spacing."""
    line = _weighted_line(np.arange(len(turning), dtype=np.float64), turning, None)
    return 2.0 * frequency * frequency * line.slope_se


def average(values: Sequence[float]) -> Average:
    """Mean over tests with its spread.

    Examples
    --------
    >>> average([1.0, 2.0, 3.0]).spread
    1.0
    """
    data = np.asarray(values, dtype=np.float64)
    if len(data) < 2:
        return Average(float(data.mean()), None, None)
    spread = float(data.std(ddof=1))
    return Average(float(data.mean()), spread, spread / math.sqrt(len(data)))


def scene_snippet(natural_frequency: float, damping_ratio: float) -> str:
    """The lines of a scene that say what was found, to paste.

    Examples
    --------
    >>> print(scene_snippet(3.1261, 0.0055))
    [rig]
    natural_frequency_hz = 3.1261
    damping_ratio = 0.0055
    """
    return f"[rig]\nnatural_frequency_hz = {natural_frequency:.6g}\ndamping_ratio = {damping_ratio:.4g}"
