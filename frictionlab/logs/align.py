"""Two logs, two clocks: the base's samples brought to the mass's stamps, and how sure that is.

The clocks are related by absolute time where both logs have it, else by the lag given, else by the lag at which the
two motions resemble each other most. The last takes the mechanical phase between mass and base for a clock's lag,
and says so. Their relative drift is found from the phase between the motions, which one drive makes, over the
whole record. Whatever the way, ``lag_s_u`` says how well the lag is known: energy per cycle depends on it.
"""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import FloatArray, jump_in
from frictionlab.errors import LogError
from frictionlab.log_options import LogOptions
from frictionlab.logs.clock import Clock
from frictionlab.logs.sensor import Sensed, cubic
from frictionlab.recording import Fact, Quality

Sensor = tuple[Clock, Sensed]
Arrays = tuple[FloatArray, FloatArray, FloatArray, NDArray[np.uint8]]
"""Stamps of the mass [s], displacements of mass and base [m], quality bits, (n,) each."""
_WINDOWS = (8, 16)  # fewest and most
_CYCLES = 4  # in a window at least
_MOST_DRIFT = 5e-3
_MOST_OF_CLOCKS = 3e-4
"""Between clocks that both show absolute time: quartz does not drift more; a phase that moves faster is mechanical."""
_CERTAIN = 5.0  # standard errors
_MOST_LAG_S = 10.0
_SAME = 1e-4
"""Stamps that differ by less than this share of a step are one moment."""
_UNIFORM = math.sqrt(12.0)
"""Full width of a uniform distribution over its standard deviation."""


def align(
    mass: Sensor, base: Sensor, options: LogOptions, *, one_clock: bool = False
) -> tuple[Arrays, dict[str, Fact], list[str]]:
    """Bring the base's samples to the stamps of the mass: the arrays, how they were aligned, and what to say of it.

    ``one_clock``: columns of one file; equal stamps are one too. Logs with less than two samples in common are refused.
    """
    no_start = mass[0].start_s is None or base[0].start_s is None
    written = mass[0].written and base[0].written and options.lag_s is None and not one_clock
    same_stamps = written and no_start and np.array_equal(mass[0].time, base[0].time)
    one_clock = one_clock or same_stamps
    if one_clock:
        options = options.but(lag_s=options.lag_s or 0.0, clock_drift=options.clock_drift or 0.0)
    how, lag, unsure, warnings = ("equal stamps", 0.0, 0.0, []) if same_stamps else _lag(mass, base, options)
    if same_stamps and abs(mass[0].time[0]) <= mass[0].interval:
        warnings.append(
            "both logs count from 0 and are taken to have begun together: give --lag, or lag_s in [log], where they did"
            " not"
        )
    facts: dict[str, Fact] = {"alignment": how, "lag_s": lag}
    unsure = unsure if options.lag_s_u is None else options.lag_s_u
    moved, drift = base[0].time - lag, options.clock_drift
    if drift is None:
        drift, drift_lag = _drift(mass, base, moved, facts, warnings, absolute=how == "absolute time")
        unsure = math.hypot(unsure, drift_lag)
    elif drift:
        facts |= {"clock_drift": drift, "clock_drift_applied": "as given"}
    if drift:
        moved = moved[0] + (moved - moved[0]) / (1.0 + drift)
    if not one_clock or options.lag_s_u is not None:
        facts["lag_s_u"] = unsure
        if unsure > max(mass[0].interval, base[0].interval):
            warnings.append(
                f"mass and base are aligned ({how}) to +- {unsure:.2g} s only: energy per cycle, phase and friction "
                "depend on it; give lag_s and lag_s_u in [log], or log both sensors on one clock"
            )
    return _on_mass_stamps(mass, base, moved, facts, warnings), facts, warnings


def _lag(mass: Sensor, base: Sensor, options: LogOptions) -> tuple[str, float, float, list[str]]:
    """How the base's clock relates to the mass's: in words, its lag [s], the standard uncertainty, what to say."""
    starts = mass[0].start_s, base[0].start_s
    if options.lag_s is not None:
        return "lag as given", options.lag_s, base[0].interval / _UNIFORM, []
    if starts[0] is not None and starts[1] is not None:
        unsure = math.hypot(mass[0].resolution_s, base[0].resolution_s) / _UNIFORM
        return "absolute time", round(starts[0] - starts[1], 6), unsure, []
    lag, unsure = _likeness(mass, base)
    said = (
        f"the logs have no common clock: the lag of {lag:.6g} s is where the two motions resemble each other most, "
        f"which looks the same as their mechanical phase (uncertain by {unsure:.3g} s): give --lag if it is known"
    )
    return "estimated from the motions", lag, unsure, [said]


def _likeness(mass: Sensor, base: Sensor) -> tuple[float, float]:
    """Lag of the base's clock at the peak of the cross-correlation [s], and a quarter of the drive's period."""
    step = max(mass[0].interval, base[0].interval)
    x, y = (_evenly(sensor[0].time, sensor[1].values, step) for sensor in (mass, base))
    size = 1 << (len(x) + len(y) - 1).bit_length()
    spectrum = np.fft.rfft(y, size)
    product = np.fft.irfft(spectrum * np.conj(np.fft.rfft(x, size)), size)
    most = min(int(_MOST_LAG_S / step), min(len(x), len(y)) // 2)
    shifts = np.arange(-most, most + 1)
    best = int(shifts[np.argmax(product[shifts])])
    left, here, right = (float(product[(best + k) % size]) for k in (-1, 0, 1))
    bend = left - 2.0 * here + right
    part = 0.5 * (left - right) / bend if bend else 0.0
    peak = int(np.argmax(np.abs(spectrum[1:]))) + 1
    origin = float(base[0].time[0] - mass[0].time[0])
    return (best + part) * step + origin, 0.25 * size * step / peak


def _evenly(time: FloatArray, values: FloatArray, step: float) -> FloatArray:
    """Resample by straight lines at even steps, mean removed; for finding lag and drift only."""
    if jump := jump_in(time, step):
        raise LogError(f"{jump}: cut the log at the jump, or correct its clock")
    sound = np.isfinite(values)
    resampled = np.interp(np.arange(time[0], time[-1], step), time[sound], values[sound])
    return np.asarray(resampled - resampled.mean())


def _drift(
    mass: Sensor, base: Sensor, moved: FloatArray, facts: dict[str, Fact], warnings: list[str], *, absolute: bool
) -> tuple[float, float]:
    """By how much the base's clock gains on the mass's (share), and what its uncertainty does to the lag [s].

    The phase between the drive's fundamental in both motions is followed window by window; a straight line through it,
    windows that stand off left out (a start-up beats), gives the drift. It is 0 where it is not felt, or more than
    clocks drift: ``absolute``, that both show absolute time, lets it be only what quartz can do. ``moved``: stamps of
    the base, its lag taken off.
    """
    step, x = mass[0].interval, (mass[0].time, mass[1].values)
    y = (moved, base[1].values)
    start, end = max(x[0][0], moved[0]), min(x[0][-1], moved[-1])
    if end <= start:
        return 0.0, 0.0
    even = _evenly(*y, step)
    spectrum = np.abs(np.fft.rfft(even * np.hanning(len(even)), 4 * len(even)))
    frequency = float((np.argmax(spectrum[4:]) + 4) / (4 * len(even) * step))
    windows = min(_WINDOWS[1], int((end - start) * frequency / _CYCLES))
    if windows < _WINDOWS[0]:
        facts["clock_drift_applied"] = "no: too few cycles to find it"
        return 0.0, 0.0
    edges, duration = np.linspace(start, end, windows + 1), end - start
    apart = np.unwrap(_phases(*y, edges, frequency) - _phases(*x, edges, frequency))
    at, (one, other) = 0.5 * (edges[1:] + edges[:-1]), np.triu_indices(windows, 1)
    off = apart - float(np.median((apart[other] - apart[one]) / (at[other] - at[one]))) * at
    off = np.abs(off - np.median(off))  # from the median line
    keep = off <= 4.0 * 1.4826 * np.median(off) + 1e-9
    keep = keep if np.count_nonzero(keep) >= _WINDOWS[0] // 2 + 1 else np.ones(windows, bool)
    (slope, _), covariance = np.polyfit(at[keep], apart[keep] / (2 * np.pi * frequency), 1, cov=True)
    drift, uncertainty = float(slope), float(np.sqrt(covariance[0, 0]))
    felt = abs(drift) > _CERTAIN * uncertainty and abs(drift) * duration > 0.25 * step
    applied = felt and abs(drift) <= (_MOST_OF_CLOCKS if absolute else _MOST_DRIFT)
    facts |= {"clock_drift": drift, "clock_drift_u": uncertainty, "clock_drift_applied": "yes" if applied else "no"}
    if applied:
        warnings.append(
            f"the clocks drift apart by {drift * 1e6:.3g} parts in a million (+- {uncertainty * 1e6:.2g}), found from "
            "the drive in both logs: the base's stamps are stretched accordingly; clock_drift = 0 in [log] leaves them"
        )
        return drift, 0.5 * uncertainty * duration
    if felt:
        warnings.append(
            f"the phase between mass and base moves as if the clocks drifted apart by {drift * 1e6:.3g} parts in a "
            "million, more than clocks do: the stamps are left; if it is the clocks, give clock_drift in [log]"
        )
    return 0.0, 0.5 * (abs(drift) if felt else uncertainty) * duration


def _phases(time: FloatArray, values: FloatArray, edges: FloatArray, frequency: float) -> FloatArray:
    """Phase of the fundamental in each window, by least squares on the stamps as they are."""
    phases = []
    for low, high in pairwise(edges):
        inside = (time >= low) & (time < high) & np.isfinite(values)
        angle = 2 * np.pi * frequency * time[inside]
        model = np.column_stack([np.cos(angle), np.sin(angle), np.ones_like(angle)])
        (cosine, sine, _), *_ = np.linalg.lstsq(model, values[inside], rcond=None)
        phases.append(np.arctan2(sine, cosine))
    return np.array(phases)


def _on_mass_stamps(
    mass: Sensor, base: Sensor, moved: FloatArray, facts: dict[str, Fact], warnings: list[str]
) -> Arrays:
    time = mass[0].time
    close = _SAME * base[0].interval
    inside = (time >= moved[0] - close) & (time <= moved[-1] + close)
    if np.count_nonzero(inside) < 2:
        raise LogError(
            f"the two logs do not overlap: on the mass's clock it runs from {time[0]:.6g} to {time[-1]:.6g} s, "
            f"the base from {moved[0]:.6g} to {moved[-1]:.6g} s: check the files, or give --lag"
        )
    stamps = time[inside]
    nearby = _SAME * (moved[-1] - moved[0]) / len(moved)
    at = np.clip(np.searchsorted(moved, stamps - nearby), 0, len(moved) - 1)
    same = bool(np.abs(moved[at] - stamps).max() <= nearby)
    values = base[1].values[at] if same else cubic(stamps, moved, base[1].values)
    quality = mass[0].quality[inside] | mass[1].quality[inside]
    # flags of the two base samples around each stamp; a hole before a base sample marks the stamps inside it
    flags, right = base[0].quality | base[1].quality, np.maximum(at, 1)
    left = np.where(np.abs(moved[right] - stamps) <= nearby, right, right - 1)
    quality |= flags[right] | (flags[left] & ~np.uint8(Quality.GAP_BEFORE | Quality.NOT_BRIDGED))
    quality[~np.isfinite(values)] |= np.uint8(Quality.NOT_BRIDGED)
    used = int(np.count_nonzero((moved >= stamps[0] - close) & (moved <= stamps[-1] + close)))
    facts |= {
        "trimmed_mass_samples": int(len(time) - len(stamps)),
        "trimmed_base_samples": int(len(moved) - used),
        "base_resampled": "no" if same else "cubic",
    }
    if not same:
        warnings.append(
            f"the base ({1 / base[0].interval:.6g} Hz) is interpolated to the stamps of the mass "
            f"({1 / mass[0].interval:.6g} Hz)"
        )
    return stamps, mass[1].values[inside], values, quality
