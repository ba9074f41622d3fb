"""What is known to lie between a motion and its samples, taken back: a lag between the channels, low-pass filters.

A filter is taken back where it leaves enough to take back. What it cuts away beyond is gone: `kept` says how much of
each harmonic is still there, for whoever compares a motion with it, and `cut_away` how much that may be of an
amplitude.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import AnalysisError

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
LEAST_GAIN = 0.3  # a filter is taken back up to here: beyond, noise would grow more than the signal
NARROWER = 2.0  # times: a cycle through so much narrower a filter shows how much this one may have cut away
MATTERS = 0.002  # of the amplitude: from so much on it is said


@dataclass(frozen=True)
class SensorChannel:
    """One sensor's way into the log.

    ``late`` s: its sample at t shows the motion at t - late; ``cutoff`` Hz (None: no filter) and ``order`` of
    its low-pass filter (Butterworth).
    """

    late: float = 0.0
    cutoff: float | None = None
    order: int = 1

    @property
    def is_plain(self) -> bool:
        """Whether there is nothing to take back."""
        return self.late == 0.0 and self.cutoff is None


def restored(signal: FloatArray, step: float, channel: SensorChannel) -> FloatArray:
    """Return the motion behind evenly spaced samples: through the inverse of filter and lag, by its spectrum.

    Parameters
    ----------
    signal : ndarray of shape (n,)
        Samples; the ends are mirrored, so that within a few time constants of them the result is less good.
    step : float
        Sampling interval, s.
    channel : SensorChannel

    Examples
    --------
    >>> t = np.arange(2000) * 0.004
    >>> seen = np.sin(2 * np.pi * 1.3 * (t - 0.001))
    >>> motion = restored(seen, 0.004, SensorChannel(late=0.001))
    >>> float(np.abs(motion - np.sin(2 * np.pi * 1.3 * t))[300:-300].max()) < 2e-4
    True
    """
    if channel.is_plain:
        return signal
    line = np.linspace(signal[0], signal[-1], len(signal))
    about = signal - line
    mirrored = np.concatenate([-about[:0:-1], about, -about[-2::-1]])
    frequency = np.asarray(np.fft.rfftfreq(len(mirrored), step), dtype=np.float64)
    lines = np.fft.rfft(mirrored) * np.exp(2j * math.pi * frequency * channel.late)
    if channel.cutoff is not None:
        lines = lines / _limited(low_pass(frequency, channel.cutoff, channel.order))
    first = len(signal) - 1
    return np.asarray(np.fft.irfft(lines, len(mirrored))[first : first + len(signal)] + line)


def low_pass(frequency: FloatArray, cutoff: float, order: int) -> ComplexArray:
    """Transfer function (n,) of a Butterworth low-pass filter at frequencies in Hz."""
    s = 1j * frequency / cutoff
    angles = math.pi * (2.0 * np.arange(1, order + 1) + order - 1.0) / (2.0 * order)
    poles = np.exp(1j * angles)
    return np.asarray(np.prod([-pole / (s - pole) for pole in poles], axis=0))


def _limited(transfer: ComplexArray) -> ComplexArray:
    size = np.abs(transfer)
    return np.asarray(transfer / size * np.maximum(size, LEAST_GAIN))


def kept(frequency: FloatArray, channel: SensorChannel) -> FloatArray:
    """Return how much of a motion at frequencies in Hz (n,) is there once a channel's filter is taken back.

    Examples
    --------
    >>> kept(np.array([5.0, 10.0, 30.0]), SensorChannel(cutoff=10.0, order=4)).round(3)
    array([1.   , 1.   , 0.041])
    """
    if channel.cutoff is None:
        return np.ones_like(frequency)
    size = np.abs(low_pass(frequency, channel.cutoff, channel.order))
    return np.asarray(size / np.maximum(size, LEAST_GAIN))


def cut_away(cycle: FloatArray, drive: float, channel: SensorChannel) -> float:
    """Return how much of the amplitude of a restored mean cycle (p,) its channel's filter may have cut away.

    The estimate is what a filter of half the cut-off would cut away; the drive itself is not cut (`check_drive`). With
    `third_lost`, in 80 tests with cut-offs of 0.6 to 2 natural frequencies, the error was at most 1.4 times the
    combined uncertainty (rms 0.52).
    """
    lines = np.fft.rfft(cycle)
    share = kept(np.arange(0.0, len(lines)) * (NARROWER * drive), channel)
    share[:2] = 1.0
    return 0.5 * abs(float(np.ptp(np.fft.irfft(lines * share, len(cycle))) - np.ptp(cycle)))


def third_lost(friction: float, r: float, drive: float, channel: SensorChannel) -> float:
    """Return how much of an amplitude (Y) the third harmonic is that a filter takes away from a mass that slides.

    Where only the drive is left, the cycle tells nothing of the rest. Friction of a ratio ``friction`` against the
    motion has a third harmonic of ``4 friction / (3 pi)`` kY, and the frame answers it by ``1 / |1 - 9 r^2|``.

    Examples
    --------
    >>> round(third_lost(0.4, 0.5, 1.565, SensorChannel(cutoff=2.6, order=8)), 3)
    0.132
    """
    share = float(kept(np.array([3.0 * drive]), channel)[0])
    return (1.0 - share) * 4.0 * friction / (3.0 * math.pi) / max(abs(1.0 - 9.0 * r * r), LEAST_GAIN)


def in_band(cycle: FloatArray, share: FloatArray) -> FloatArray:
    """Return a cycle (p,) with so much of each of its harmonics 1 to p // 2 as is kept."""
    if bool(np.all(share == 1.0)):
        return cycle
    return np.asarray(np.fft.irfft(np.fft.rfft(cycle) * np.concatenate([[1.0], share]), len(cycle)))


def check_drive(drive: float, channels: tuple[SensorChannel, SensorChannel]) -> None:
    """Refuse a channel, of mass or base, whose filter leaves too little of the drive itself (Hz) to take it back.

    Raises
    ------
    AnalysisError
        Less than `LEAST_GAIN` of it is left.
    """
    for role, channel in zip(("mass", "base"), channels, strict=True):
        if channel.cutoff is None:
            continue
        left = float(np.abs(low_pass(np.array([drive]), channel.cutoff, channel.order))[0])
        if left < LEAST_GAIN:
            raise AnalysisError(
                f"analysis: the {role}'s low-pass filter of {channel.cutoff:.4g} Hz and order {channel.order} would"
                f" leave {100.0 * left:.2g} % of the drive at {drive:.4g} Hz, too little to take the motion back from:"
                f" check filter_hz and filter_order, or {role}_filter_hz and {role}_filter_order, in [sensors]; a test"
                " needs filters well above the drive and the natural frequency"
            )


def said_of(cut: float, amplitude: float, channel: SensorChannel) -> tuple[str, ...]:
    """Say that a filter cuts what an answer needs, if it does; ``cut``: by `cut_away`, like the amplitude over Y."""
    if channel.cutoff is None or cut < MATTERS * amplitude:
        return ()
    said = (
        f"response_amplitude: the mass's low-pass filter ({channel.cutoff:.4g} Hz, order {channel.order}: filter_hz,"
        f" mass_filter_hz in [sensors]) cuts away the fast part of the motion: amplitude (by some {cut:.1g} Y, which"
        " its error holds), stops_per_cycle and regime may be wrong by it: record with a filter of a higher cut-off"
    )
    return (said,)
