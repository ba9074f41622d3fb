"""What the sensor did to the values: error codes, range, held values, and the step that betrays the measuring range.

optoNCDT 1420: d = (102/65520 x - 1) MR/100, so one step is 1.02 MR / 65520, values are valid from -0.01 MR to 1.01 MR,
and the error codes 262075 to 262082 read as about 4.07 MR (instruction manual; MR = measuring range).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from frictionlab.arrays import runs
from frictionlab.log_options import LASERS
from frictionlab.recording import Quality
from frictionlab.units import LENGTH, UNIT

RANGES_M = (0.010, 0.025, 0.050, 0.100, 0.200, 0.500)
_STEP = 1.02 / 65520
_CODES = tuple((102 / 65520 * code - 1) / 100 for code in (262075, 262082))
_SAMPLE = 20_000
_SPIKES = 0.02
"""Share of the distances between levels that spikes, which fall on no level, may spoil."""
_SHORTEST_HOLD = 4
_MOST_RUNS = 100
_NEAR = 2000
_DEPTHS = (1, 4, 16)
_EARLY = 3
_SHARPEST = 2.7
_BLOCK = 256  # samples, of which the median says how the motion usually bends
_FAR = 10.0  # times that, and as many steps, from which a sample may be a spike
_SHARP = 4.0  # of what is farthest off: a part that counts as being on the curve
_REACHES = (2, 2, 2, 4, 8, 16)  # samples on either side of what may be a spike
_JUMPS: dict[str, dict[str, float]] = {"displacement": {}, "angle": {}, "velocity": {"at_most": 0.01}}
"""Of a quantity: what `_flag_spikes` is told; of others `_ANY_JUMP`."""
_ANY_JUMP = {"beyond": 0.75, "at_most": 0.01}
_DIFFER = 2.0  # per cent of the motion, from which lasers of one place are said to disagree
_DEAD_S = 1.0
_DEAD_NOISE = 0.5  # of a step, from which no sensor that lives shows one number for long


@dataclass
class Sensed:
    """Values (n,) of one sensor in SI units, of the channel ``role``, their flags, and what their step says."""

    role: str
    values: NDArray[np.float64]
    quality: NDArray[np.uint8]
    step: float | None = None
    range: float | None = None
    warnings: list[str] = field(default_factory=list)
    evidence: list[str] = field(default_factory=list)

    def flag(self, where: NDArray[np.generic] | slice, fault: Quality, why: str = "") -> None:
        """Mark some samples, and say why."""
        self.quality[where] |= np.uint8(fault)
        self.warnings += [f"{self.role}: {why}"] if why else []

    @property
    def sound(self) -> NDArray[np.bool_]:
        """Which samples (n,) have a value that the sensor measured."""
        return np.asarray((self.quality & np.uint8(Quality.NO_VALUE | Quality.ERROR_CODE)) == 0)


def examine(
    values: NDArray[np.float64],
    role: str,
    quantity: str = "displacement",
    *,
    measuring_range: float | None = None,
    warnings: Sequence[str] = (),
) -> Sensed:
    """Flag what is wrong with the values of one sensor, SI units; nan where the log has no value. No value is changed.

    A laser of mass or base has a step and a measuring range [m] too, error codes, and holds its value at their ends.
    """
    none, is_laser = np.isnan(values), role in LASERS
    channel = Sensed(role, values, none * np.uint8(Quality.NO_VALUE), warnings=[*warnings])
    if none.all():
        return channel
    step, found = step_and_range(values)
    if is_laser:
        channel.step, channel.range = step, found
        _examine_laser(channel, measuring_range)
    if step is not None or not is_laser:
        _flag_spikes(channel, step or 0.0, quantity, **_JUMPS.get(quantity, _ANY_JUMP))
    return channel


def _examine_laser(channel: Sensed, measuring_range: float | None) -> None:
    if channel.range is not None and channel.step is not None:
        apart = f"{channel.role}: values are {channel.step * 1e6:.4g} um apart"
        channel.evidence.append(f"{apart}: an optoNCDT of {channel.range * 1e3:g} mm range")
    channel.range = measuring_range or channel.range
    ends = float(np.nanmin(channel.values)), float(np.nanmax(channel.values))
    if max(-ends[0], ends[1]) > 4.0 * RANGES_M[0]:
        _flag_error_codes(channel)
    if channel.range is not None and not -0.01 * channel.range <= ends[0] < ends[1] <= 1.01 * channel.range:
        _flag_out_of_range(channel, channel.range)
    _flag_held(channel)


def step_and_range(values: NDArray[np.float64]) -> tuple[float | None, float | None]:
    """Find the smallest step between values [m] and the measuring range [m] it betrays, where it does."""
    levels = np.unique(_sample(values))
    apart = np.diff(levels)
    apart = apart[apart > 1e-13 + 1e-9 * np.abs(levels[-1])]
    if len(apart) < 20:
        return None, None
    found = next((measuring_range for measuring_range in RANGES_M if _is_comb(apart, measuring_range * _STEP)), None)
    return (found * _STEP if found else float(np.quantile(apart, _SPIKES))), found


def _sample(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Some values in a row, from the middle of a long log; those that are none left out."""
    some = values[len(values) // 2 :][:_SAMPLE] if len(values) > _SAMPLE else values
    return some[~np.isnan(some)]


def _is_comb(apart: NDArray[np.float64], step: float) -> bool:
    """Whether neighbouring levels are whole steps apart, most of them one, as far as the printed digits show."""
    if not 0.4 * step <= np.quantile(apart, _SPIKES) < 1.5 * step:
        return False
    small = apart[apart < 20 * step] / step
    steps = np.rint(small)
    if len(small) < 20 or np.median(np.abs(steps - 1)) > 3:
        return False
    off = np.abs(small - steps)
    odd = np.count_nonzero(steps % 2 == 1)  # all even: a coarser sensor's, whatever a few spikes say
    return bool(np.quantile(off, 0.9) < 0.1 and odd > 0.2 * len(steps))


def unit_by_step(values: NDArray[np.float64], per_unit: float = 1.0) -> tuple[str, float] | None:
    """Unit of numbers (values times ``per_unit``) by the sensor's step: (unit, measuring range [m]), or ``None``."""
    some = _sample(values) * per_unit
    for unit in ("mm", "um", "m"):
        seen = some / LENGTH[unit]
        _, measuring_range = step_and_range(seen)
        if measuring_range is not None and np.ptp(seen) <= 1.02 * measuring_range:
            return unit, measuring_range
    return None


def _flag_error_codes(channel: Sensed) -> None:
    size = np.abs(channel.values)
    wrong = np.zeros(len(size), bool)
    slack = 0.02 if channel.range else 2e-4
    for measuring_range in (channel.range,) if channel.range else RANGES_M:
        low, high = (code * measuring_range for code in _CODES)
        reach = slack * measuring_range
        wrong |= (channel.values > low - reach) & (channel.values < high + reach)
    rest = size[~wrong & ~np.isnan(size)]
    if not wrong.any() or (len(rest) and np.quantile(rest, 0.999) > 0.5 * size[wrong].min()):
        return
    near = f"near {1e3 * float(channel.values[wrong][0]):.2f} mm"
    channel.flag(wrong, Quality.ERROR_CODE, f"{np.count_nonzero(wrong)} values {near} are error codes of the sensor")


def _flag_out_of_range(channel: Sensed, measuring_range: float) -> None:
    """Flag values outside the range; a sensor set to zero inside its range has an unknown offset and is left alone."""
    sound, values = channel.sound, channel.values
    some = values[sound][:: max(1, len(values) // _SAMPLE)]
    if len(some) == 0 or np.median(some) < 0.05 * measuring_range or np.quantile(some, 0.005) < 0.0:
        return
    wrong = sound & ((values < -0.01 * measuring_range) | (values > 1.01 * measuring_range))
    if wrong.any():
        why = f"{np.count_nonzero(wrong)} values lie outside the sensor's range"
        channel.flag(wrong, Quality.OUT_OF_RANGE, why)


def _flag_spikes(channel: Sensed, step: float, quantity: str, *, beyond: float = 0.0, at_most: float = 1.0) -> None:
    """Flag runs of samples that leave the curve through those around them, and come back to it, within one sample.

    A motion bends and has corners, but does not jump. Reaching farther and farther around, longer runs are found.
    ``beyond``: how far from the middle of all else a spike lies at least, over the range of that; ``at_most``: share of
    the samples, above which it is not the sensor that jumps.
    """
    values, n = channel.values, len(channel.values)
    if n < _BLOCK:
        return
    if channel.quality.any():
        values = np.where(channel.quality == 0, values, np.nan)
    bends, whole = _bends(values), n - n % _BLOCK
    blocks, middle = bends[:whole].reshape(-1, _BLOCK), _BLOCK // 8
    usual = np.partition(blocks[:, ::4], (middle - 1, middle), axis=1)[:, middle - 1 : middle + 1].mean(axis=1)
    around = np.max([usual, np.append(usual[1:], 0.0), np.append(0.0, usual[:-1])], axis=0)
    limits = _FAR * (around + step)
    if max(np.max(blocks.max(axis=1) - limits), bends[whole:].max(initial=0.0) - limits[-1]) <= 0.0:
        return
    most, wrong = np.pad(np.repeat(limits, _BLOCK), (0, n - whole), "edge"), np.zeros(n, bool)
    for reach in _REACHES:
        if not (far := bends > most).any():
            break
        wide = np.convolve(far, np.ones(2 * reach + 1), "same") > 0.5
        known = np.flatnonzero(~wide & np.isfinite(values))
        if len(known) < n // 2:
            break
        off = np.zeros(n)
        off[wide] = values[wide] - cubic(np.flatnonzero(wide).astype(float), known.astype(float), values[known])
        new = np.zeros(n, bool)
        for start, stop in np.transpose(runs(wide)).tolist():
            new[start:stop] = _jumps(off[start:stop])
        values, wrong = np.where(new, values - off, values), wrong | new
        bends = _bends(values)
    if beyond:
        low, high = np.nanmin(values), np.nanmax(values)
        wrong &= np.abs(channel.values - 0.5 * (low + high)) > beyond * (high - low)
    if wrong.any() and np.mean(wrong) <= at_most:
        share, largest = 100.0 * np.mean(wrong), np.nanmax(np.abs(values - channel.values)[wrong])
        by = f"{1e3 * largest:.3g} mm" if quantity == "displacement" else f"{largest:.3g} {UNIT[quantity]}"
        why = f"{np.count_nonzero(wrong)} values ({share:.2g} %) jump off the motion and back (spikes), by up to"
        look = "set aside as missing; look at plugs, cables and what crosses the beam"
        channel.flag(wrong, Quality.ERROR_CODE, f"{why} {by}: {look}")


def _bends(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far each sample (n,) is off the cubic through two on either side; 0 where these are not known."""
    bends = np.zeros(len(values))
    for first in range(0, len(values) - 4, _SAMPLE):  # so many stay in the cache
        some = np.abs(np.diff(values[first : first + _SAMPLE + 4], 4)) / 6.0
        bends[first + 2 : first + 2 + len(some)] = np.nan_to_num(some, copy=False)
    return bends


def _jumps(off: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which of some samples, given how far each is off a curve, jump off it; none where it is the motion that bends."""
    size = np.abs(off)
    far = size > size.max() / _SHARP
    is_motion = far[[0, 1, -2, -1]].any() or 2 * np.count_nonzero(far) > len(far) + 1
    for first, last in [] if is_motion else np.transpose(runs(far)).tolist():
        steps = np.abs(np.diff(off[first - 1 : last + 1]))
        is_motion |= 2.0 * min(steps[0], steps[-1]) < size[first:last].max()
    return np.asarray(far & (not is_motion))


def cubic(at: NDArray[np.float64], time: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values at other times, by the cubic through four neighbours; of repeated times the first counts."""
    apart = np.diff(time, prepend=-np.inf) > 0.0
    time, values = time[apart], values[apart]
    first = np.clip(np.searchsorted(time, at, side="right") - 2, 0, max(len(time) - 4, 0))
    nodes = first[:, None] + np.arange(min(4, len(time)))
    t, v = time[nodes], values[nodes]
    result = np.zeros(len(at))
    for j in range(nodes.shape[1]):
        weight = np.ones(len(at))
        for k in range(nodes.shape[1]):
            if k != j:
                weight *= (at - t[:, k]) / (t[:, j] - t[:, k])
        result += weight * v[:, j]
    return result


def _white_noise(values: NDArray[np.float64]) -> float:
    return float(np.nanmedian(np.abs(np.diff(values, 6)))) / 20.5  # 0.6745 sqrt(924)


def together(lasers: Sequence[Sensed]) -> Sensed:
    """One channel of lasers that see one place: the mean of those with a value, weighted by noise; the first's zero."""
    first = lasers[0]
    about = np.ma.masked_array([laser.values - np.nanmedian(laser.values) for laser in lasers])
    about.mask = [laser.quality != 0 for laser in lasers]
    mean = np.ma.average(about, axis=0, weights=[1.0 / max(_white_noise(laser.values), 1e-15) ** 2 for laser in lasers])
    apart = 100.0 * float(np.max((about - about[0]).std(axis=1)) / about[0].std())
    said = f"{first.role}: {len(lasers)} lasers see it, which differ by {apart:.2g} % (rms): it rocks, or a gain is off"
    first.values = np.where(np.ma.getmaskarray(mean), first.values, np.asarray(mean) + np.nanmedian(first.values))
    first.quality = np.bitwise_and.reduce([laser.quality for laser in lasers])
    first.warnings = [*(w for laser in lasers for w in laser.warnings), *([said] if apart > _DIFFER else [])]
    return first


def flag_dead(time: NDArray[np.float64], channels: Mapping[str, Sensed]) -> None:
    """Flag where a sensor shows one number for long, without the noise that it had, while the other one moves."""
    for role, other in (("mass", "base"), ("base", "mass")):
        if not channels.keys() >= {role, other}:
            continue
        channel, moving = channels[role], channels[other].values
        still = np.transpose(runs(np.diff(channel.values) == 0.0))
        for start, stop in still[time[still[:, 1]] - time[still[:, 0]] >= _DEAD_S].tolist():
            if not np.ptp(moving[start:stop]) > 0.1 * np.ptp(moving):
                continue
            rest = max(channel.values[:start], channel.values[stop + 1 :], key=len)[:_SAMPLE]
            noise = _white_noise(rest) if len(rest) > _NEAR else 0.0
            if channel.step is not None and noise > _DEAD_NOISE * channel.step:
                still_s = f"from {time[start]:.4g} to {time[stop]:.4g} s while the {other} moves"
                why = f"the value does not change {still_s}: dead or disconnected? That part is left out"
                channel.flag(slice(start, stop + 1), Quality.HELD, why)


def _flag_held(channel: Sensed) -> None:
    """Flag runs of one value at the channel's extremes that the motion enters and leaves at speed; the most decide."""
    values, held = np.where(channel.sound, channel.values, np.nan), np.zeros(len(channel.values), bool)
    if np.isnan(values).all():
        return
    for end in (np.nanmax(values), np.nanmin(values)):
        long = [run for run in np.transpose(runs(values == end)).tolist() if run[1] - run[0] >= _SHORTEST_HOLD]
        some = long[:: max(1, len(long) // _MOST_RUNS)]
        if 2 * sum(_cut_off(values, run[0], run[1], channel.step or 0.0) for run in some) <= len(some):
            continue
        for start, stop in long:
            held[start:stop] = True
    if held.any():
        why = "no stops, and no cycle is cut across them: enlarge the sensor's range or move it"
        channel.flag(held, Quality.HELD, f"{np.count_nonzero(held)} values are held at the end of the range: {why}")


def _cut_off(values: NDArray[np.float64], start: int, stop: int, step: float) -> bool:
    """Whether the motion comes into a run of one value and leaves it at speed."""
    sides = (values[max(0, start - _NEAR) : start][::-1], values[stop : stop + _NEAR])
    corners = [_is_corner(np.abs(some - values[start]), step) for side in sides if len(some := side[np.isfinite(side)])]
    if None not in corners or not corners:
        return bool(corners) and all(corners)
    # too few samples: whether a whole step into and out of the run is as large as those of the motion around it
    around = np.abs(np.diff(values[max(0, start - _NEAR) : stop + _NEAR]))
    usual = float(np.nanquantile(around[around > 0.0], 0.5)) if np.any(around > 0.0) else 0.0
    into, out = (np.abs(np.diff(some[:2], prepend=values[start])).max(initial=0.0) or np.inf for some in sides)
    return bool(min(into, out) > 0.5 * usual > 0.0)


def _is_corner(depth: NDArray[np.float64], step: float) -> bool | None:
    """Whether the distance from a run's value grows with time, not its square: 1 to 4 to 16; None: too few samples."""
    unit = 2.0 * max(step, float(depth[:_EARLY].max()) / _EARLY)
    if not depth.max() > _DEPTHS[-1] * unit:
        return None if unit > 4.0 * step else False
    passed = list[float]()
    for level in (unit * times for times in _DEPTHS):  # when the distance, which starts from 0, passes it, in samples
        after = int(np.argmax(depth > level))
        before = float(depth[after - 1]) if after else 0.0
        passed.append(after + (level - before) / (float(depth[after]) - before))
    return passed[2] - passed[1] > _SHARPEST * (passed[1] - passed[0])


def bridge(time: NDArray[np.float64], channel: Sensed, longest: float) -> None:
    """Draw cubics across values that are none, up to ``longest`` [s]; longer holes become nan, not bridged."""
    bad = ~channel.sound
    if not bad.any():
        return
    start, stop = runs(bad)
    inside = (start > 0) & (stop < len(time))
    is_short = inside & (time[stop.clip(max=len(time) - 1)] - time[start - 1] <= longest)
    bridged, values = np.zeros(len(time), bool), channel.values
    bridged[bad] = np.repeat(is_short, stop - start)
    channel.values = np.where(bad, np.nan, values)
    channel.values[bridged] = cubic(time[bridged], time[~bad], values[~bad])
    if bridged.any():
        why = f"{np.count_nonzero(bridged)} values without measurement are bridged (interpolated)"
        channel.flag(bridged, Quality.INTERPOLATED, why)
    if (lost := bad & ~bridged).any():
        left = f"lie in holes longer than {longest:.3g} s: left empty, and no cycle is cut across them"
        channel.flag(lost, Quality.NOT_BRIDGED, f"{np.count_nonzero(lost)} values without measurement {left}")
