"""Two logs, two clocks: the base's samples brought to the mass's stamps, and how sure that is.

The clocks are related by absolute time where both logs have it, else by the lag given, else by the lag at which the
two motions resemble each other most. The last cannot tell a clock's lag from the mechanical phase between mass and
base, and says so. Where no absolute time ties the clocks, their relative drift is found from the drive: both sensors
see the same frequency.
"""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import LogError
from frictionlab.logs.clock import TimeBase
from frictionlab.logs.sensor import Channel
from frictionlab.logs.timing import Timing
from frictionlab.recording import Fact, Quality

Sensor = tuple[TimeBase, Timing, Channel]
_WINDOWS = 8
_MOST_LAG_S = 10.0
_MOST_DRIFT = 5e-3
_SAME = 1e-4
"""Stamps that differ by less than this share of a step are one moment."""


@dataclass(frozen=True)
class Aligned:
    """Both channels on the mass's stamps (n,): s, m, m, quality bits; how they were aligned."""

    time: NDArray[np.float64]
    mass: NDArray[np.float64]
    base: NDArray[np.float64]
    quality: NDArray[np.uint8]
    facts: dict[str, Fact] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)


def align(mass: Sensor, base: Sensor, lag_s: float | None) -> Aligned:
    """Bring the base's samples to the stamps of the mass.

    Raises
    ------
    LogError
        If the two logs have less than two samples in common.
    """
    facts, warnings = _relation(mass, base, lag_s)
    lag = float(facts["lag_s"])
    moved = base[0].time - lag
    drift = 0.0
    if facts["alignment"] != "absolute time":
        drift, facts_of_drift = _drift(mass, moved, base[2])
        facts |= facts_of_drift
    if drift:
        moved = moved[0] + (moved - moved[0]) / (1.0 + drift)
        warnings.append(
            f"the clocks drift apart by {drift * 1e6:.3g} parts in a million, found from the drive frequency in both "
            "logs: the base's stamps are stretched accordingly"
        )
    return _on_mass_stamps(mass, base, moved, facts, warnings)


def _relation(mass: Sensor, base: Sensor, lag_s: float | None) -> tuple[dict[str, Fact], list[str]]:
    starts = mass[1].start_s, base[1].start_s
    if lag_s is not None:
        return {"alignment": "lag as given", "lag_s": lag_s, "lag_se_s": 0.0}, []
    if starts[0] is not None and starts[1] is not None:
        spread = float(np.hypot(mass[1].resolution_s, base[1].resolution_s) / np.sqrt(12.0))
        return {"alignment": "absolute time", "lag_s": round(starts[0] - starts[1], 6), "lag_se_s": spread}, []
    lag, spread = _likeness(mass, base)
    said = (
        f"the logs have no common clock: the lag of {lag:.6g} s is where the two motions resemble each other most, "
        f"which cannot be told from their mechanical phase (uncertain by {spread:.3g} s): give --lag if it is known"
    )
    return {"alignment": "estimated from the motions", "lag_s": lag, "lag_se_s": spread}, [said]


def _likeness(mass: Sensor, base: Sensor) -> tuple[float, float]:
    """Lag of the base's clock at the peak of the cross-correlation [s], and a quarter of the drive's period."""
    step = max(mass[0].interval, base[0].interval)
    x, y = (_even(sensor[0].time, sensor[2], step) for sensor in (mass, base))
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


def _even(time: NDArray[np.float64], channel: Channel, step: float) -> NDArray[np.float64]:
    """Resample by straight lines at even steps, mean removed; for finding lag and drift only."""
    sound = np.isfinite(channel.values)
    grid = np.arange(time[0], time[-1], step)
    values = np.interp(grid, time[sound], channel.values[sound])
    return np.asarray(values - values.mean())


def _drift(mass: Sensor, moved: NDArray[np.float64], base: Channel) -> tuple[float, dict[str, Fact]]:
    """Find the relative drift of the base's clock from the phase between the two motions, window by window."""
    start, end = max(mass[0].time[0], moved[0]), min(mass[0].time[-1], moved[-1])
    start += 0.2 * (end - start)
    step = mass[0].interval
    y = _even(moved, base, step)
    spectrum = np.abs(np.fft.rfft(y * np.hanning(len(y)), 4 * len(y)))
    peak = int(np.argmax(spectrum[4:])) + 4
    frequency = peak / (4 * len(y) * step)
    if (end - start) * frequency < 4 * _WINDOWS:
        return 0.0, {}
    edges = np.linspace(start, end, _WINDOWS + 1)
    x_phase = _phases(mass[0].time, mass[2].values, edges, frequency)
    y_phase = _phases(moved, base.values, edges, frequency)
    middle = 0.5 * (edges[1:] + edges[:-1])
    apart = np.unwrap(y_phase - x_phase)
    (slope, _), covariance = np.polyfit(middle, apart, 1, cov=True)
    drift, spread = slope / (2 * np.pi * frequency), float(np.sqrt(covariance[0, 0])) / (2 * np.pi * frequency)
    facts: dict[str, Fact] = {"clock_drift": float(drift), "clock_drift_se": spread}
    felt = abs(drift) * (end - start) > 0.25 * step
    if abs(drift) > _MOST_DRIFT or abs(drift) < 5 * spread or not felt:
        return 0.0, facts | {"clock_drift_applied": "no"}
    return float(drift), facts | {"clock_drift_applied": "yes"}


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


def _on_mass_stamps(
    mass: Sensor, base: Sensor, moved: NDArray[np.float64], facts: dict[str, Fact], warnings: list[str]
) -> Aligned:
    time = mass[0].time
    close = _SAME * base[0].interval
    inside = (time >= moved[0] - close) & (time <= moved[-1] + close)
    if np.count_nonzero(inside) < 2:
        raise LogError(
            f"the two logs do not overlap: on the mass's clock it runs from {time[0]:.6g} to {time[-1]:.6g} s, "
            f"the base from {moved[0]:.6g} to {moved[-1]:.6g} s: check the files, or give --lag"
        )
    stamps = time[inside]
    values, same = _interpolated(stamps, moved, base[2].values)
    quality = mass[0].quality[inside] | mass[2].quality[inside]
    quality |= _flags_between(stamps, moved, base[0].quality | base[2].quality)
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
    return Aligned(stamps, mass[2].values[inside], values, quality, facts, warnings)


def _interpolated(
    stamps: NDArray[np.float64], time: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], bool]:
    """Values at the stamps: as they are where all stamps coincide, else by the cubic through four neighbours."""
    close = _SAME * (time[-1] - time[0]) / len(time)
    at = np.clip(np.searchsorted(time, stamps - close), 0, len(time) - 1)
    if np.abs(time[at] - stamps).max() <= close:
        return values[at], True
    keep = np.concatenate([[True], np.diff(time) > 0.0])
    time, values = time[keep], values[keep]
    first = np.clip(np.searchsorted(time, stamps, side="right") - 2, 0, max(len(time) - 4, 0))
    nodes = first[:, None] + np.arange(min(4, len(time)))
    t, v = time[nodes], values[nodes]
    result = np.zeros(len(stamps))
    for j in range(nodes.shape[1]):
        weight = np.ones(len(stamps))
        for k in range(nodes.shape[1]):
            if k != j:
                weight *= (stamps - t[:, k]) / (t[:, j] - t[:, k])
        result += weight * v[:, j]
    return result, False


def _flags_between(
    stamps: NDArray[np.float64], time: NDArray[np.float64], quality: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Flags of the two base samples around each stamp; a hole before a base sample marks the stamps inside it."""
    close = _SAME * (time[-1] - time[0]) / len(time)
    right = np.clip(np.searchsorted(time, stamps - close), 1, len(time) - 1)
    exact = np.abs(time[right] - stamps) <= close
    left = np.where(exact, right, right - 1)
    hole = np.uint8(Quality.GAP_BEFORE | Quality.NOT_BRIDGED)
    return np.asarray(quality[right] | (quality[left] & ~hole), dtype=np.uint8)
