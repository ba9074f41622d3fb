"""Where in a record a mass swings freely: each tap or release, found from its turning points.

Where the frame has several masses, one free decay gives its modes: frequencies, damping ratios, shapes. Every mass
moves by ``sum_k e^(-zeta_k omega_k t) (a_k cos + b_k sin)(omega_dk t)`` with frequencies and damping of the
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
from frictionlab.analysis.signals import white_noise
from frictionlab.analysis.spectrum import amplitude_spectrum
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError

LEAST_SWINGS = 6  # half-cycles
_ABOVE_NOISE = 10.0  # what turns back by less is no turning point
_RISE = 1.1  # a swing so much larger than the smallest before it begins another tap
_UNEVEN = 1.5  # a half-cycle so much longer than the one before: the mass had come to rest
_FALLS_TO = 0.7  # of its first swing, at least, in a free decay
_LEAST_SHARE = 0.5  # of all half-cycles that belong to free decays


@dataclass(frozen=True)
class Turnings:
    """Turning points of a record: ``time`` (n,) s and ``height`` (n,) m."""

    time: FloatArray
    height: FloatArray

    @property
    def swing(self) -> FloatArray:
        """Half the way from each turning point to the next (n - 1,) m; the sensor's zero does not matter."""
        return 0.5 * np.abs(np.diff(self.height))

    def part(self, begin: int, end: int) -> "Turnings":
        """The turning points from one number up to another, not included."""
        return Turnings(self.time[begin:end], self.height[begin:end])


def find_taps(time: FloatArray, displacement: FloatArray) -> tuple[Turnings, ...]:
    """Find the free decays of a record, each by its turning points.

    The first turning point of a tap is left out: a hand or a hammer may still have been there.

    Parameters
    ----------
    time, displacement : (n,) arrays
        s, increasing; m. The record may begin before the release and go on after the motion died.

    Raises
    ------
    AnalysisError
        No decay of at least six half-cycles; or the motion is steady or grows, so that something drives it.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.01)
    >>> x = np.exp(-0.5 * np.mod(t, 10.0)) * np.cos(2 * np.pi * np.mod(t, 10.0))
    >>> [round(float(tap.time[0]), 1) for tap in find_taps(t, x)]
    [0.5, 10.5]
    """
    turnings = turning_points(time, displacement)
    runs = [_from_its_largest(turnings, begin, end) for begin, end in _runs(turnings)]
    long = [run for run in runs if len(run.swing) >= LEAST_SWINGS]
    decays = tuple(run for run in long if run.swing[-1] <= _FALLS_TO * run.swing[0])
    swings = turnings.swing
    share = sum(len(run.swing) + 1 for run in decays) / max(1, len(swings))
    if decays and share >= _LEAST_SHARE:
        return decays
    raise AnalysisError(_what_else(swings, long, share))


def turning_points(time: FloatArray, displacement: FloatArray) -> Turnings:
    """Extremes between which the record moves by ten times its noise; each refined by a parabola."""
    noise = white_noise(displacement) if len(displacement) >= 16 else 0.0
    at = _zigzag(displacement, max(_ABOVE_NOISE * noise, 1e-9 * float(np.ptp(displacement))))
    found = [
        _vertex(time, displacement, here, max(1, min(here - before, after - here) // 8))
        for before, here, after in zip(at[:-2], at[1:-1], at[2:], strict=True)
    ]
    if at:
        found.insert(0, (float(time[at[0]]), float(displacement[at[0]])))
    if len(at) > 1:
        found.append(_vertex(time, displacement, at[-1], max(1, (at[-1] - at[-2]) // 8)))
    return Turnings(np.array([t for t, _ in found]), np.array([h for _, h in found]))


def _zigzag(x: FloatArray, least: float) -> list[int]:
    """Samples at which the record turns back by more than ``least``, tops and bottoms in turn."""
    bends = np.flatnonzero(np.diff(np.sign(np.diff(x)))) + 1
    candidates = [0, *bends.tolist(), len(x) - 1]
    heights = x[candidates].tolist()
    found: list[int] = []
    top = bottom = 0
    rising: bool | None = None
    for here, height in enumerate(heights):
        top = here if height > heights[top] else top
        bottom = here if height < heights[bottom] else bottom
        if rising is not False and heights[top] - height > least:
            found.append(candidates[top])
            rising, bottom = False, here
        elif rising is not True and height - heights[bottom] > least:
            found.append(candidates[bottom])
            rising, top = True, here
        if rising is True:
            bottom = here
        elif rising is False:
            top = here
    return found


def _vertex(time: FloatArray, x: FloatArray, top: int, reach: int) -> tuple[float, float]:
    """Vertex of the least-squares parabola through the samples about a turning point: time and height."""
    reach = min(reach, top, len(x) - 1 - top)
    if reach < 1:
        return float(time[top]), float(x[top])
    part = slice(top - reach, top + reach + 1)
    u = time[part] - time[top]
    c, b, a = np.polynomial.polynomial.polyfit(u, x[part], 2)
    offset = float(np.clip(-b / (2.0 * a), u[0], u[-1])) if a else 0.0
    return float(time[top]) + offset, float(c + offset * (b + a * offset))


def _runs(turnings: Turnings) -> list[tuple[int, int]]:
    """(first, last + 1) turning points of each run in which no swing rises and the mass never rests."""
    swing, wait = turnings.swing, np.diff(turnings.time)
    runs, begin, smallest = [], 0, np.inf
    for number in range(len(swing)):
        rests = number > begin and wait[number] > _UNEVEN * wait[number - 1]
        if swing[number] > _RISE * smallest or rests:
            runs.append((begin, number + 1))
            begin, smallest = number, np.inf
        smallest = min(smallest, float(swing[number]))
    return [*runs, (begin, len(swing) + 1)] if len(swing) else []


def _from_its_largest(turnings: Turnings, begin: int, end: int) -> Turnings:
    """A run from the turning point after its largest swing began; a last one before a new tap is left out too."""
    part = turnings.part(begin, end)
    first = int(np.argmax(part.swing)) + 1
    last = len(part.time) - (end < len(turnings.time))
    return part.part(first, last)


def _what_else(swings: FloatArray, long: list[Turnings], share: float) -> str:
    """What a record without free decays shows instead."""
    do = "displace the mass, let go, and record until it rests"
    if len(swings) <= 2 * LEAST_SWINGS and not long:
        most = max(0, len(swings) - 1)
        return f"free vibration: expected at least {LEAST_SWINGS} half-cycles above the noise; got {most}: {do}"
    quarter = max(1, len(swings) // 4)
    early, late = float(np.median(swings[:quarter])), float(np.median(swings[-quarter:]))
    told = f"its half-cycles swing by {1e3 * early:.3g} mm at first and {1e3 * late:.3g} mm at the end"
    if late > 1.3 * early:
        return (
            f"free vibration: the motion grows ({told}), which is negative damping or a drive, not a free decay: {do}"
        )
    return (
        f"free vibration: this is a driven motion, not a free decay ({told}; {share:.0%} of {len(swings)} half-cycles "
        f"belong to a decay): {do}, with the base at rest"
    )


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
