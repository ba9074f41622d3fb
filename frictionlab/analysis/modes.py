"""Modes of a frame of several masses from one free decay: frequencies, damping ratios and shapes.

Every mass moves by ``sum_k e^(-zeta_k omega_k t) (a_k cos + b_k sin)(omega_dk t)`` with frequencies and damping of the
frame. For given ones the amplitudes are linear and follow by least squares (variable projection [Golub and Pereyra
1973]), so that only two numbers a mode are searched for. Friction of the frame is no part of it.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import find_peaks

from frictionlab.analysis.hum import without_high_lines
from frictionlab.analysis.spectrum import amplitude_spectrum
from frictionlab.errors import AnalysisError

FloatArray = NDArray[np.float64]
FALLEN = 0.02  # of the largest displacement: what is below is not fitted
DAMPING = 0.01  # ratio from which the fit starts
PER_PERIOD = 12  # samples of the fastest mode that a fit needs
CLEAR = 0.01  # of the highest peak of a spectrum: lower ones are no mode
ODD = 0.1  # rms left over the rms measured: no motion of so many modes


@dataclass(frozen=True)
class Mode:
    """One mode of a frame.

    ``natural_frequency_hz``, ``damping_ratio`` and their standard errors; ``shape``: displacement of each mass over the
    largest of them, from mass 1 up, negative where it moves against it.
    """

    natural_frequency_hz: float
    natural_frequency_hz_se: float
    damping_ratio: float
    damping_ratio_se: float
    shape: tuple[float, ...]


def modes(time: FloatArray, displacements: FloatArray) -> tuple[Mode, ...]:
    """Fit as many modes as there are masses to a free decay, hum taken out.

    Parameters
    ----------
    time : (n,) array
        s, evenly spaced.
    displacements : (m, n) array
        Of each mass, m, from mass 1 up; may begin before the release.

    Raises
    ------
    AnalysisError
        Fewer modes show than there are masses, or the motion is none of that kind.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.005)
    >>> slow, fast = np.exp(-0.1 * t) * np.cos(12.0 * t), np.exp(-0.3 * t) * np.cos(31.0 * t)
    >>> found = modes(t, 1e-3 * np.array([0.6 * slow + fast, slow - 0.6 * fast]))
    >>> [(round(m.natural_frequency_hz, 3), [round(s, 3) for s in m.shape]) for m in found]
    [(1.91, [0.6, 1.0]), (4.934, [1.0, -0.6])]
    """
    step = float(time[-1] - time[0]) / (len(time) - 1)
    signals = np.array([without_high_lines(x, step) for x in displacements])
    about = signals - np.median(signals[:, -max(1, len(time) // 10) :], axis=1)[:, None]
    size = np.abs(about).max(axis=0)
    first = int(np.argmax(size))
    last = int(np.flatnonzero(size > FALLEN * size[first])[-1]) + 1
    guess = _frequencies(about[:, first:last], step)
    thin = max(1, int(1.0 / (max(guess) * PER_PERIOD * step)))
    t, x = time[first:last:thin] - time[first], about[:, first:last:thin]

    def columns(p: FloatArray) -> FloatArray:
        omega, zeta = 2.0 * math.pi * p[0::2], np.clip(p[1::2], -0.5, 0.9)
        turn = np.outer(omega * np.sqrt(1.0 - zeta**2), t)
        fade = np.exp(-np.outer(zeta * omega, t))
        return np.concatenate([fade * np.cos(turn), fade * np.sin(turn), np.ones((1, len(t)))]).T

    def left(p: FloatArray) -> FloatArray:
        basis = columns(p)
        share, *_ = np.linalg.lstsq(basis, x.T, rcond=None)
        return np.asarray((basis @ share - x.T).ravel() / size[first])

    start = np.array([value for f in guess for value in (f, DAMPING)])
    found = least_squares(left, start, x_scale=np.array([value for f in guess for value in (0.01 * f, DAMPING)]))
    share, *_ = np.linalg.lstsq(columns(found.x), x.T, rcond=None)
    slopes = np.asarray(found.jac)
    misfit = float(np.std(found.fun)) * float(size[first]) / float(np.std(x))
    if misfit > ODD:
        raise AnalysisError(
            f"free vibration: {len(x)} damped modes leave {100.0 * misfit:.2g} % of the motion: expected a free decay"
            " of as many masses as there are columns: displace, let go, touch nothing"
        )
    variance = float(found.fun @ found.fun) / max(1, len(found.fun) - len(start))
    error = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)) * variance)
    return tuple(
        Mode(float(f), float(f_se), float(zeta), float(zeta_se), _shape(share[k] - 1j * share[k + len(guess)]))
        for k, ((f, zeta), (f_se, zeta_se)) in enumerate(zip(found.x.reshape(-1, 2), error.reshape(-1, 2), strict=True))
    )


def _frequencies(x: FloatArray, step: float) -> list[float]:
    """The highest peaks, one for each mass, of the spectra (m, n) taken together [Hz], ascending."""
    spectra = [amplitude_spectrum(row, step) for row in x]
    power = np.sqrt(np.sum([s.amplitude**2 for s in spectra], axis=0))
    apart = max(1, round(2.0 * spectra[0].resolution / float(spectra[0].frequency[1])))
    peaks, _ = find_peaks(power, distance=apart, prominence=CLEAR * float(power.max()))
    peaks = peaks[np.argsort(-power[peaks])][: len(x)]
    if len(peaks) < len(x):
        raise AnalysisError(
            f"free vibration: expected {len(x)} modes, one for each mass; got {len(peaks)} clear in the spectrum:"
            " displace the frame in another place, so that all modes move"
        )
    return sorted(spectra[0].frequency[peaks].tolist())


def _shape(amplitudes: NDArray[np.complex128]) -> tuple[float, ...]:
    """Complex amplitudes of the masses (m,) over the largest of them."""
    over = amplitudes / amplitudes[int(np.argmax(np.abs(amplitudes)))]
    return tuple(float(value) for value in over.real)
