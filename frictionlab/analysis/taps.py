"""Where in a record a mass swings freely: each tap or release, found from its turning points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.noise import white_noise
from frictionlab.errors import AnalysisError

FloatArray = NDArray[np.float64]
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
