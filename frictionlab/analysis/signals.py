"""Uninterrupted samples of mass and base on an even clock."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import AnalysisError

FloatArray = NDArray[np.float64]
EVEN = 0.02  # of a step: stamps that stray no further from an even clock are even
COARSE_STEPS = 4
MOST_EVEN = 1e6  # samples on an even clock, or 20 times those there are
_CHUNK = 1 << 16


@dataclass(frozen=True)
class Stretch:
    """Uninterrupted samples (n,): ``time`` of the first [s], ``step`` [s], ``mass`` and ``base`` [m], evenly spaced.

    ``more``: further channels by their names, (n,) each.
    """

    time: float
    step: float
    mass: FloatArray
    base: FloatArray
    more: Mapping[str, FloatArray] = field(default_factory=dict)

    def after(self, time: float) -> "Stretch":
        """The part from a time on; empty if there is none."""
        passed = min((time - self.time) / self.step, float(len(self.mass)))
        first = min(max(0, math.ceil(passed - 1e-6)), len(self.mass))
        return self.part(first, len(self.mass))

    def part(self, first: int, last: int) -> "Stretch":
        """The samples from one number up to another, not included."""
        some = slice(first, last)
        more = {name: values[some] for name, values in self.more.items()}
        return Stretch(self.time + first * self.step, self.step, self.mass[some], self.base[some], more)


def stray(time: FloatArray, step: float) -> float:
    """How far stamps (n,) stray from an even clock that starts with them, in steps."""
    most = 0.0
    for first in range(0, len(time), _CHUNK):  # in parts: a copy of a long recording would be dear
        part = time[first : first + _CHUNK] - time[0]
        part -= step * np.arange(first, first + len(part))
        most = max(most, float(np.max(np.abs(part, out=part))))
    return most / step


def evenly(time: FloatArray, step: float, signals: Mapping[str, FloatArray]) -> tuple[Mapping[str, FloatArray], float]:
    """Signals on an even clock, and how far the stamps strayed from it (0 when nothing was changed).

    Stamps within 2 % of a step of an even clock count as even, and so do stamps that are merely written coarsely (few
    different steps, none missing). Anything else is interpolated linearly.

    Parameters
    ----------
    time : (n,) array
        Strictly increasing stamps [s].
    step : float
        Sampling interval, s.
    signals : mapping
        Name -> (n,) array.
    """
    off = stray(time, step)
    if off < EVEN or (off < 1.0 and _coarsely_written(time, step)):
        return signals, 0.0
    _check_span(time, step)
    even = np.arange(time[0], time[-1] + 1e-9 * step, step)
    steps = np.rint((time - time[0]) / step)
    strays = float(np.max(np.abs(time - time[0] - step * steps))) / step
    return {name: np.interp(even, time, values) for name, values in signals.items()}, max(strays, 0.02)


def _check_span(time: FloatArray, step: float) -> None:
    """Refuse stamps that jump so far that even steps would fill the memory."""
    count = float(time[-1] - time[0]) / step
    if count > max(MOST_EVEN, 20.0 * len(time)):
        at = int(np.argmax(np.diff(time)))
        raise AnalysisError(
            f"the stamps jump from {time[at]:.6g} to {time[at + 1]:.6g} s, unflagged: {len(time)} samples would become "
            f"{count:.3g} of {step:.3g} s, accepted are {max(MOST_EVEN, 20.0 * len(time)):.3g}: ingest the log again, "
            "which flags the jump, or cut the recording there"
        )


def _coarsely_written(time: FloatArray, step: float) -> bool:
    """Whether the steps between stamps take at most four values, as stamps rounded to few digits do."""
    found: set[float] = set()
    for first in range(0, len(time) - 1, _CHUNK):
        found.update(np.unique(np.rint(np.diff(time[first : first + _CHUNK + 1]) / (1e-3 * step))).tolist())
        if len(found) > COARSE_STEPS:
            return False
    return True
