"""What is known to lie between a motion and its samples, taken back: a lag between the channels, low-pass filters."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
LEAST_GAIN = 0.3  # a filter is taken back up to here: beyond, noise would grow more than the signal


@dataclass(frozen=True)
class Channel:
    """One sensor's way into the log.

    ``late`` s: its samples are taken so much later than their stamps; ``cutoff`` Hz (None: no filter) and ``order`` of
    its low-pass filter (Butterworth).
    """

    late: float = 0.0
    cutoff: float | None = None
    order: int = 1

    @property
    def is_plain(self) -> bool:
        """Whether there is nothing to take back."""
        return self.late == 0.0 and self.cutoff is None


def restored(signal: FloatArray, step: float, channel: Channel) -> FloatArray:
    """Return the motion behind evenly spaced samples: through the inverse of filter and lag, by its spectrum.

    Parameters
    ----------
    signal : ndarray of shape (n,)
        Samples; the ends are mirrored, so that within a few time constants of them the result is less good.
    step : float
        Sampling interval, s.
    channel : Channel

    Examples
    --------
    >>> t = np.arange(2000) * 0.004
    >>> seen = np.sin(2 * np.pi * 1.3 * (t + 0.001))
    >>> motion = restored(seen, 0.004, Channel(late=0.001))
    >>> float(np.abs(motion - np.sin(2 * np.pi * 1.3 * t))[300:-300].max()) < 2e-4
    True
    """
    if channel.is_plain:
        return signal
    line = np.linspace(signal[0], signal[-1], len(signal))
    about = signal - line
    mirrored = np.concatenate([-about[:0:-1], about, -about[-2::-1]])
    frequency = np.asarray(np.fft.rfftfreq(len(mirrored), step), dtype=np.float64)
    lines = np.fft.rfft(mirrored) * np.exp(-2j * math.pi * frequency * channel.late)
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
