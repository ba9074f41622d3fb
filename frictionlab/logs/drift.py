"""Two clocks drift apart: how fast, from the phase between two motions that one drive makes, over the whole record."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.recording import Fact

FloatArray = NDArray[np.float64]
Series = tuple[FloatArray, FloatArray]
_WINDOWS = (8, 16)  # fewest and most
_CYCLES = 4  # in a window at least
_MOST_DRIFT = 5e-3
_MOST_OF_CLOCKS = 3e-4
"""Between clocks that both show absolute time: quartz does not drift more; a phase that moves faster is mechanical."""
_CERTAIN = 5.0  # standard errors
_LONGEST = 20  # times its samples that a record may last before it has a jump


@dataclass(frozen=True)
class Drift:
    """By how much the base's clock gains on the mass's (share) where that is to be taken off, and what is known of it.

    ``lag_s_u``: what the drift's own uncertainty does to the lag, at an end of the record whose middle is right [s].
    """

    applied: float
    facts: dict[str, Fact] = field(default_factory=dict)
    lag_s_u: float = 0.0
    warnings: tuple[str, ...] = ()


def find_drift(mass: Series, base: Series, step: float, *, absolute: bool) -> Drift:
    """Find the relative drift of two clocks.

    The phase between the drive's fundamental in both motions is followed window by window; a straight line through it,
    windows that stand off left out (a start-up beats), gives the drift.

    Parameters
    ----------
    mass, base : (time, values)
        Stamps [s] and displacements [m] of each, the base's lag taken off.
    step
        Sampling interval of the mass [s].
    absolute
        Whether both clocks show absolute time: then only what quartz can do is taken for drift.
    """
    start, end = max(mass[0][0], base[0][0]), min(mass[0][-1], base[0][-1])
    if end <= start:
        return Drift(0.0)
    frequency = _frequency(base, step)
    windows = min(_WINDOWS[1], int((end - start) * frequency / _CYCLES))
    if windows < _WINDOWS[0]:
        return Drift(0.0, {"clock_drift_applied": "no: too few cycles to find it"})
    edges = np.linspace(start, end, windows + 1)
    apart = np.unwrap(_phases(*base, edges, frequency) - _phases(*mass, edges, frequency))
    slope, spread = _robust_slope(0.5 * (edges[1:] + edges[:-1]), apart)
    drift, uncertainty = slope / (2 * np.pi * frequency), spread / (2 * np.pi * frequency)
    return _judged(drift, uncertainty, end - start, step, absolute=absolute)


def _judged(drift: float, uncertainty: float, duration: float, step: float, *, absolute: bool) -> Drift:
    facts: dict[str, Fact] = {"clock_drift": drift, "clock_drift_u": uncertainty}
    felt = abs(drift) > _CERTAIN * uncertainty and abs(drift) * duration > 0.25 * step
    unsure = 0.5 * uncertainty * duration
    if not felt:
        return Drift(0.0, facts | {"clock_drift_applied": "no"}, unsure)
    if abs(drift) <= (_MOST_OF_CLOCKS if absolute else _MOST_DRIFT):
        said = (
            f"the clocks drift apart by {drift * 1e6:.3g} parts in a million (+- {uncertainty * 1e6:.2g}), found from "
            "the drive in both logs: the base's stamps are stretched accordingly; clock_drift = 0 in [log] leaves them"
        )
        return Drift(drift, facts | {"clock_drift_applied": "yes"}, unsure, (said,))
    said = (
        f"the phase between mass and base moves as if the clocks drifted apart by {drift * 1e6:.3g} parts in a "
        "million, more than clocks do: the stamps are left; if it is the clocks, give clock_drift in [log]"
    )
    return Drift(0.0, facts | {"clock_drift_applied": "no"}, 0.5 * abs(drift) * duration, (said,))


def _frequency(series: Series, step: float) -> float:
    """Frequency of the strongest line [Hz]."""
    even = evenly(*series, step)
    spectrum = np.abs(np.fft.rfft(even * np.hanning(len(even)), 4 * len(even)))
    return float((np.argmax(spectrum[4:]) + 4) / (4 * len(even) * step))


def evenly(time: FloatArray, values: FloatArray, step: float) -> FloatArray:
    """Resample by straight lines at even steps, mean removed; for finding lag and drift only.

    Raises
    ------
    LogError
        The stamps jump by so much that even steps would fill the memory.
    """
    count = (time[-1] - time[0]) / step
    if count > max(1e6, _LONGEST * len(time)):
        at = int(np.argmax(np.diff(time)))
        raise LogError(
            f"the stamps jump from {time[at]:.6g} to {time[at + 1]:.6g} s: {len(time)} samples would stand among "
            f"{count:.3g} steps of {step:.3g} s: cut the log at the jump, or correct its clock"
        )
    sound = np.isfinite(values)
    resampled = np.interp(np.arange(time[0], time[-1], step), time[sound], values[sound])
    return np.asarray(resampled - resampled.mean())


def _robust_slope(at: FloatArray, values: FloatArray) -> tuple[float, float]:
    """Slope of a line and its standard error; points four deviations off the median line are left out."""
    rises = [(v2 - v1) / (t2 - t1) for i, (t1, v1) in enumerate(zip(at, values, strict=True))
             for t2, v2 in zip(at[i + 1 :], values[i + 1 :], strict=True)]  # fmt: skip
    off = values - float(np.median(rises)) * at
    off = np.abs(off - np.median(off))
    keep = off <= 4.0 * 1.4826 * np.median(off) + 1e-9
    keep = keep if np.count_nonzero(keep) >= _WINDOWS[0] // 2 + 1 else np.ones(len(at), bool)
    (slope, _), covariance = np.polyfit(at[keep], values[keep], 1, cov=True)
    return float(slope), float(np.sqrt(covariance[0, 0]))


def _phases(
    time: NDArray[np.float64], values: NDArray[np.float64], edges: NDArray[np.float64], frequency: float
) -> NDArray[np.float64]:
    """Phase of the fundamental in each window, by least squares on the stamps as they are."""
    phases = []
    for low, high in pairwise(edges):
        inside = (time >= low) & (time < high) & np.isfinite(values)
        angle = 2 * np.pi * frequency * time[inside]
        model = np.column_stack([np.cos(angle), np.sin(angle), np.ones_like(angle)])
        (cosine, sine, _), *_ = np.linalg.lstsq(model, values[inside], rcond=None)
        phases.append(np.arctan2(sine, cosine))
    return np.array(phases)
