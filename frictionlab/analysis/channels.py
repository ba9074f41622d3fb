"""From what is measured to what is needed: lag and filters taken back, displacements of whatever channels there are.

A filter is taken back where it leaves enough to take back. What it cuts away beyond is gone: `kept` says how much of
each harmonic is still there, for whoever compares a motion with it, and `cut_away` how much that may be of an
amplitude.

A velocity is integrated once, an acceleration twice, in the frequency domain: what moves slower than a fifth of the
drive is taken off, and with it drift and any static offset. The ends, where a record's past and
future are missing, are cut.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import count, islice, takewhile

import numpy as np

from frictionlab.analysis import spectrum
from frictionlab.analysis.signals import line, white_noise
from frictionlab.arrays import ComplexArray, FloatArray
from frictionlab.errors import AnalysisError

LEAST_GAIN = 0.3  # a filter is taken back up to here: beyond, noise would grow more than the signal


@dataclass(frozen=True)
class SensorChannel:
    """One sensor's way into the log.

    ``lag`` s: its sample at t shows the motion at t - lag; ``cutoff`` Hz (None: no filter) and ``order`` of
    its low-pass filter (Butterworth).
    """

    lag: float = 0.0
    cutoff: float | None = None
    order: int = 1


def low_pass(frequency: FloatArray, cutoff: float, order: int) -> ComplexArray:
    """Transfer function (n,) of a Butterworth low-pass filter at frequencies in Hz."""
    poles = np.exp(1j * math.pi * (2.0 * np.arange(1, order + 1) + order - 1.0) / (2.0 * order))
    return np.asarray(np.prod([-pole / (1j * frequency / cutoff - pole) for pole in poles], axis=0))


def restored(signal: FloatArray, step: float, channel: SensorChannel) -> FloatArray:
    """Return the motion behind samples (n,), one every ``step`` s: through the inverse of filter and lag.

    The ends are mirrored, so that within a few time constants of them the result is less good.
    """
    if channel.lag == 0.0 and channel.cutoff is None:
        return signal
    ends = np.linspace(signal[0], signal[-1], len(signal))
    about = signal - ends
    mirrored = np.concatenate([-about[:0:-1], about, -about[-2::-1]])
    frequency = np.asarray(np.fft.rfftfreq(len(mirrored), step), dtype=np.float64)
    lines = np.fft.rfft(mirrored) * np.exp(2j * math.pi * frequency * channel.lag)
    if channel.cutoff is not None:
        transfer = low_pass(frequency, channel.cutoff, channel.order)
        lines = lines / (transfer * np.maximum(1.0, LEAST_GAIN / np.abs(transfer)))
    first = len(signal) - 1
    return np.asarray(np.fft.irfft(lines, len(mirrored))[first : first + len(signal)] + ends)


def kept(frequency: FloatArray, channel: SensorChannel) -> FloatArray:
    """Return how much of a motion at frequencies in Hz (n,) is there once a channel's filter is taken back."""
    if channel.cutoff is None:
        return np.ones_like(frequency)
    size = np.abs(low_pass(frequency, channel.cutoff, channel.order))
    return np.asarray(size / np.maximum(size, LEAST_GAIN))


def in_band(cycle: FloatArray, share: FloatArray) -> FloatArray:
    """Return a cycle (p,) with so much of each of its harmonics 1 to p // 2 as is kept."""
    if bool(np.all(share == 1.0)):
        return cycle
    return np.asarray(np.fft.irfft(np.fft.rfft(cycle) * np.concatenate([[1.0], share]), len(cycle)))


def cut_away(cycle: FloatArray, drive: float, channel: SensorChannel, *, friction: float, r: float | None) -> float:
    """Return how much of the amplitude (Y) of a restored mean cycle (p,) its channel's filter may have cut away.

    The larger of what a filter of half the cut-off would cut away, and the third harmonic of a mass that slides:
    friction of a ratio ``friction`` has one of ``4 friction / (3 pi)`` kY, answered by ``1 / |1 - 9 r^2|`` (of an r
    that is not known: at resonance). In 80 tests with cut-offs of 0.6 to 2 natural frequencies the error was at most
    1.4 times the combined uncertainty (rms 0.52).
    """
    lines = np.fft.rfft(cycle)
    share = kept(np.arange(0.0, len(lines)) * (2.0 * drive), channel)
    share[:2] = 1.0
    narrower = 0.5 * abs(float(np.ptp(np.fft.irfft(lines * share, len(cycle))) - np.ptp(cycle)))
    lost = 1.0 - float(kept(np.array([3.0 * drive]), channel)[0])
    stiff = 0.0 if r is None else abs(1.0 - 9.0 * r * r)
    return max(narrower, lost * 4.0 * friction / (3.0 * math.pi) / max(stiff, LEAST_GAIN))


def check_drive(drive: float, channels: tuple[SensorChannel, SensorChannel]) -> None:
    """Refuse (`AnalysisError`) a channel, of mass or base, whose filter leaves too little of the drive (Hz)."""
    for role, channel in zip(("mass", "base"), channels, strict=True):
        cutoff = channel.cutoff or math.inf
        left = float(np.abs(low_pass(np.array([drive]), cutoff, channel.order))[0])
        if left < LEAST_GAIN:
            raise AnalysisError(
                f"analysis: the {role}'s low-pass filter of {cutoff:.4g} Hz and order {channel.order} leaves too little"
                f" of the drive ({100.0 * left:.2g} %): check {role}_filter_hz and {role}_filter_order in [sensors]"
            )


# Noise taken off -----------------------------------------------------------------------------------------------------

ORDER = 4  # of the differences that a spline keeps small


def denoised(signal: FloatArray, noise: float) -> FloatArray:
    """Return the smooth curve behind evenly sampled values (n,): a discrete smoothing spline of seventh degree.

    It minimises ``sum (y - s)^2 + p sum (fourth difference of s)^2`` [Whittaker 1923; Eilers 2003], with the penalty of
    `best_penalty`. ``noise``: rms of the sensor's white noise; 0: the signal is returned as it is.
    """
    penalty = best_penalty(signal, noise)
    return spline(signal, penalty) if penalty else signal


def best_penalty(signal: FloatArray, noise: float) -> float:
    """Return the penalty whose curve is expected to be nearest to the truth; 0 where no smoothing helps.

    The expected square of its error is ``mean (y - s)^2 - noise^2 + 2 noise^2 mean H`` (Stein 1981), with
    ``H = 1 / (1 + p (2 sin(w / 2))^8)`` the curve's gain at frequency w; noise^2 without any smoothing.
    """
    from scipy.optimize import minimize_scalar  # noqa: PLC0415 - for noise to be taken off alone

    def risk(digits: float) -> float:
        left = float(np.mean((signal - spline(signal, 10.0**digits)) ** 2)) / noise**2
        return left - 1.0 + 2.0 * gain_kept(10.0**digits)

    if not noise > 0.0 or len(signal) < 8:
        return 0.0
    found = minimize_scalar(risk, bounds=(-3.0, 10.0), method="bounded", options={"xatol": 0.1})  # as far as doubles do
    return float(10.0**found.x) if found.fun < 1.0 else 0.0


def spline(signal: FloatArray, penalty: float, order: int = ORDER) -> FloatArray:
    """Return the curve of a penalty: the normal equations, unit plus penalty times D'D, as a band of its order."""
    from scipy.linalg import solveh_banded  # noqa: PLC0415 - 0.1 s that only noise to be taken off needs

    n = len(signal)
    weights = np.array([(-1) ** k * math.comb(order, k) for k in range(order + 1)], dtype=np.float64)
    bands = np.zeros((order + 1, n))
    for lag in range(order + 1):
        for k in range(order + 1 - lag):
            first = k + lag  # row of the upper band, column j = i + lag, i = k, k + 1, ..., k + n - 1 - order
            bands[order - lag, first : first + n - order] += penalty * weights[k] * weights[k + lag]
    bands[order] += 1.0
    return np.asarray(solveh_banded(bands, signal, overwrite_ab=True, check_finite=False))


def gain_kept(penalty: float) -> float:
    """Mean of the curve's gain over all frequencies: the share of white noise's freedom that it keeps."""
    w = np.pi * (np.arange(4096) + 0.5) / 4096
    # the cut-off may be far below the grid: frequencies are taken evenly in the logarithm there
    w = np.concatenate([np.geomspace(1e-6, w[0], 2000), w[1:]])
    gain = 1.0 / (1.0 + penalty * (2.0 * np.sin(0.5 * w)) ** (2 * ORDER))
    return float(np.trapezoid(gain, w) / np.pi)


# Integration ---------------------------------------------------------------------------------------------------------

HIGH_PASS = 8  # of the high-pass: |H| = 1 / (1 + (f_c / f)^8), without a shift of phase
DOUBTFUL = 2.5  # periods of the slowest motion kept, at either end: the high-pass rings there; 0.3 % is left after
RATES = ("displacement", "velocity", "acceleration")
FORCES = ("contact_force", "torque")
CLEARLY, APART = 3.0, 12.0  # standard uncertainties of two sensors that disagree; times the power of their noise
FEWEST_LINES, HARMONICS = 5, 20  # that show their noise; of the drive, where they are compared


def _transfer(f: FloatArray, highpass_hz: float, times: int) -> FloatArray:
    """Size of the integral over that of the signal at frequencies f [Hz]: ``|H| / (2 pi f)^times``."""
    share = f / highpass_hz
    return np.asarray(share ** (HIGH_PASS - times) / (1.0 + share**HIGH_PASS) / (2.0 * np.pi * highpass_hz) ** times)


def displacement(measured: Mapping[str, FloatArray], place: str, step: float) -> tuple[FloatArray, list[str], int, int]:
    """Displacement (n,) of ``mass`` or ``base``, measured or integrated, from channels (n,) by their names, SI units.

    With it what to say of it, how many samples at either end are doubtful, and how often it was integrated.
    `AnalysisError`: Neither displacement, velocity nor acceleration was measured.
    """
    known = f"{place}_displacement"
    rates = {f"{place}_{of}": times for times, of in enumerate(RATES)}
    if place == "mass":
        rates = {known: 0, "angle": 0, **rates, "angular_velocity": 1}
    name = next((name for name in rates if name in measured), None)
    if name is None:
        raise AnalysisError(
            f"analysis: the {place}'s motion was not measured: expected its displacement, velocity or acceleration; got"
            f' {", ".join(measured)}: name its column (--{place}), or set [rig] kind = "prescribed" if it is given'
        )
    signal, rate, times = measured[name], 1.0 / step, rates[name]
    if times == 0:
        return signal, [], 0, 0
    # a harmonic near resonance may be the strongest line of the mass's acceleration, hardly one of the base's
    names = (n for n in (f"base_{of}" for of in RATES) if place == "mass" and np.ptp(measured.get(n, 0.0)) > 0.0)
    some = (signal, *(measured[n] for n in islice(names, 1)))
    tones = [spectrum.strongest_tone(spectrum.amplitude_spectrum(each, step, padding=1)) for each in some]
    slowest = 0.2 * min(tone.frequency for tone in tones)
    moved, _, said = integrated(signal, rate, slowest, times=times)
    words = f"{known}: integrated {'once' if times == 1 else 'twice'} from {name.replace('_', ' ')}: {said}"
    words += "".join(f"; {other.replace('_', ' ')} is not used" for other in rates if other in measured.keys() - {name})
    return moved, [words], min(round(DOUBTFUL * rate / slowest), len(signal) // 4), times


def integrated(signal: FloatArray, rate: float, highpass_hz: float, *, times: int = 2) -> tuple[FloatArray, float, str]:
    """Return a signal (n,) of ``rate`` samples a second integrated over time, without what is slower than a frequency.

    Mean and straight line are taken off first; then each frequency is divided by ``2 pi i f`` once (a velocity) or
    twice (an acceleration) and multiplied by the high-pass. What a record holds before its start and after its end is
    not known: rest is put there, and some periods of the slowest motion kept are doubtful at either end. With it
    the rms [m] that the sensor's noise makes of it, and both in words.
    """
    n, around = len(signal), math.ceil(6.0 * rate / highpass_hz)  # so much rest
    padded = np.pad(line(np.arange(n, dtype=np.float64), signal)[1], around)
    f = np.asarray(np.fft.rfftfreq(len(padded), 1.0 / rate), dtype=np.float64)
    moved = np.fft.irfft(np.fft.rfft(padded) * (-1j) ** times * _transfer(f, highpass_hz, times), len(padded))
    moved = np.asarray(moved[around : around + n])
    noise, f = white_noise(signal) if n >= 16 else 0.0, np.geomspace(1e-2 * highpass_hz, 0.5 * rate, 4000)
    u = math.sqrt(2.0 * noise**2 / rate * float(np.trapezoid(_transfer(f, highpass_hz, times) ** 2, f)))
    share = 100.0 * u / max(float(np.std(moved)), 1e-300)
    said = (
        f"what moves slower than {highpass_hz:.3g} Hz, drift and offset are gone, {DOUBTFUL / highpass_hz:.3g} s at"
        f" either end are doubtful, and its sensor's noise makes {1e6 * u:.3g} um rms of displacement ({share:.2g} %)"
    )
    return moved, u, said


def by_two_sensors(
    laser: FloatArray, rate: FloatArray, step: float, gain: float, times: int
) -> tuple[FloatArray, float]:
    """Return the displacement (n,) that a laser and a second sensor of one place show, and the penalty of its noise.

    Least squares of both, ``sum (x - laser)^2 + p sum (D x - t)^2``: of a velocity (``times`` 1) D are first
    differences, of an acceleration (2) second ones, and t are those of its integral, that of a cubic spline. p is the
    laser's power of noise over that of ``D laser - t`` below the drive, where no motion is left. At an angle w a sample
    ``1 / (1 + p (2 sin(w / 2))^(2 times))`` of the laser's noise is left: an offset is the laser's alone.
    ``gain``: relative standard uncertainty of each sensor's. `AnalysisError`: They disagree at the drive by clearly
    more, or too few cycles show their noise.
    """
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - half a second that only two sensors need

    place = np.arange(float(len(rate)))
    moved = CubicSpline(place, rate - rate.mean()).antiderivative(times)(place)
    shown, wanted = np.diff(laser, times), step**times * (np.diff(moved, times) + rate.mean())
    n, drive = len(shown), spectrum.strongest_tone(spectrum.amplitude_spectrum(laser, 1.0, padding=1)).frequency
    lines = spectrum.amplitude_spectrum(shown - wanted, 1.0, padding=1)
    power, order = n / (6.0 * math.log(2.0)) * lines.amplitude**2, lines.frequency / drive  # by medians
    bend = (2.0 * np.sin(math.pi * lines.frequency)) ** (2 * times)
    below, above = (order > 0.1) & (order < 0.6), (lines.frequency > 0.25) & (np.abs(order - np.rint(order)) > 0.25)
    low, high = (float(np.median(each)) for each in (power[below], power[above] / bend[above]))
    if np.count_nonzero(below) < FEWEST_LINES or not high > 0.0:
        raise AnalysisError("too few cycles show its noise: record longer")
    tone = spectrum.hann(n) * np.exp(-2j * math.pi * drive * np.arange(n)) * (2.0 / n)
    one, other = (complex(tone @ (signal - signal.mean())) for signal in (shown, wanted))
    noise = low + high * float(np.interp(drive, lines.frequency, bend))
    u, lag = math.hypot(math.sqrt(2.0) * gain, math.sqrt(1.5 * noise / n) / abs(one)), math.pi / math.sqrt(3.0) * drive
    if abs(abs(other / one) - 1.0) > CLEARLY * u or abs(np.angle(other / one)) > CLEARLY * math.hypot(u, lag):
        off = f"{abs(other / one):.4g} times its motion, {math.degrees(np.angle(other / one)):+.3g} degrees"
        raise AnalysisError(f"at the drive it shows {off}; expected 1 +- {u:.2g}: check its gain and sign")
    harmonic = np.arange(1.0, min(HARMONICS, 0.25 / drive))
    apart = np.array([power[np.abs(order - k) * drive * n < 2.0].max() for k in harmonic])
    of_laser = high * np.interp(harmonic * drive, lines.frequency, bend)
    clear = apart > APART * (low + of_laser)  # of that, at most half of what is left of the noise comes in
    ratio = apart[clear] / of_laser[clear]
    share = (np.sqrt(0.0625 + ratio) - 0.25) / (2.0 * ratio)
    most = share / (1.0 - share) * high / of_laser[clear]
    penalty = min(high / max(low, 1e-300), float(most.min(initial=1e10)))
    back = np.diff(np.pad(wanted, times), times) * (-1.0) ** times  # the transpose of D
    return spline(laser + penalty * back, penalty, times), penalty


def is_angular(measured: Mapping[str, FloatArray]) -> bool:
    """Whether the motion is known as an angle alone, or not at all: nothing gives metres then but a radius."""
    still = "mass_displacement" if not np.any(np.ptp(measured.get("mass_displacement", np.zeros(1)))) else ""
    return not any(name.startswith("mass_") and name != still for name in measured)


def other_masses(names: Iterable[str]) -> tuple[str, ...]:
    """Return the displacements of a frame's masses from the second on, as far as they follow each other."""
    known = set(names)
    return tuple(takewhile(known.__contains__, (f"mass_{number}_displacement" for number in count(2))))
