"""What the noise of a record looks like over frequency, and the filter that makes it white.

The simulation is driven by the measured base. What is left in it of its sensor's noise shakes the simulated mass, near
the natural frequency most. So the difference of measured and predicted is not white, although both sensors' noise is: a
fit that weighs all its frequencies alike lets that peak move the natural frequency. Filtered by what makes it white
(generalised least squares), a record tells as much as it can.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz

FloatArray = NDArray[np.float64]
ORDER = 120  # of the prediction from the past: beyond, nothing is gained
LEAST = 8  # samples for each tap, at least


@dataclass(frozen=True)
class Whitener:
    """A causal filter under which a record's noise is white, of unit variance.

    ``taps`` (k,): its response to one sample.

    Examples
    --------
    >>> Whitener(np.array([2.0, -1.0]))(np.array([1.0, 0.0, 3.0])).tolist()
    [2.0, -1.0, 6.0]
    """

    taps: FloatArray

    def __call__(self, values: FloatArray) -> FloatArray:
        """Filter records (n,) or columns (n, m), from their first sample on."""
        if len(self.taps) == 1:
            return np.asarray(self.taps[0] * values)
        n = len(values)
        size = 1 << (n + len(self.taps) - 2).bit_length()
        lines = np.fft.rfft(self.taps, size)
        shaped = lines.reshape(-1, *[1] * (values.ndim - 1))
        return np.asarray(np.fft.irfft(shaped * np.fft.rfft(values, size, axis=0), size, axis=0)[:n])

    def transposed(self, values: FloatArray) -> FloatArray:
        """The same against the course of time: what each sample does to what comes after it."""
        return np.asarray(self(values[::-1])[::-1])


def white(noise: float) -> Whitener:
    """The whitener of noise that is white already."""
    return Whitener(np.array([1.0 / noise]))


def whitener_of(noise: float, shakes: FloatArray) -> Whitener:
    """Return the whitener of a sensor's white noise and of what shakes the record beside it.

    A sample is predicted from those before it (Yule and Walker's equations, by the mean autocovariance of the draws);
    what that leaves is white.

    Parameters
    ----------
    noise : float
        Rms of the sensor's noise.
    shakes : ndarray of shape (d, n)
        Draws of what is added to it.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> slow = np.convolve(rng.standard_normal(4000), np.ones(10))
    >>> made = whitener_of(1.0, slow[None])(slow + rng.standard_normal(len(slow)))
    >>> bool(abs(np.std(made) - 1.0) < 0.05), bool(abs(np.corrcoef(made[1:], made[:-1])[0, 1]) < 0.05)
    (True, True)
    """
    if not len(shakes):
        return white(noise)
    n = shakes.shape[1]
    order = min(ORDER, n // LEAST)
    power = np.mean(np.abs(np.fft.rfft(shakes, 2 * n, axis=1)) ** 2, axis=0)
    covariance = np.fft.irfft(power, 2 * n)[: order + 1] / n
    covariance[0] += noise**2
    taps = np.concatenate([[1.0], -solve_toeplitz(covariance[:-1], covariance[1:])])
    return Whitener(taps / np.sqrt(float(taps @ covariance)))
