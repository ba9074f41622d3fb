"""Whether a sensor clipped: a mass cannot reach its highest place at full speed, a cut-off signal does."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
LEVELS = (0.01, 0.04, 0.16)  # depths below an extreme, as shares of the whole stroke
SCALES = {1.0: 2.5, 1 / 4: 2.3, 1 / 16: 2.35}  # of the levels, and the sharpness no motion has
FINE = {1 / 4: 2.6, 1 / 16: 2.6}  # near enough to the extreme that stops on the way there do not count
"""2 for any motion whose speed passes through zero (2.2 at most for 1,900 motions of the simulator), 4 for a corner."""
BACK = 0.5  # of the first level: a flank that comes back by more is a motion that rings beside its extreme
POINTS = 20.0  # of a cycle over the root of the scale; below it the levels lie within a point of the extreme


def is_clipped(cycle: FloatArray, *, noise: float, stops_on_its_way: bool = False) -> bool:
    """Tell whether a mean cycle is cut off at one of its extremes.

    Near a true extreme, a stop included, the depth grows with the square of the time, so that from 4 to 16 % of the
    stroke takes twice as long as from 1 to 4 %; where the signal is cut off it arrives with its full speed and takes up
    to four times as long. Both flanks of the extreme must have the corner. A signal of which little is cut off shows it
    only close to its extreme: the same is asked at a quarter and a sixteenth of these depths, where the cycle has
    points enough to tell (40 and 80).

    Parameters
    ----------
    cycle : (p,) array
        One cycle, equally spaced in phase.
    noise : float
        Rms of the noise left in one point, in the cycle's unit; where it hides the levels, nothing is found.
    stops_on_its_way : bool
        The mass slows or stops between its extremes: its flanks are steep everywhere.

    Examples
    --------
    >>> x = np.sin(2 * np.pi * np.arange(400) / 400)
    >>> is_clipped(x, noise=0.0), is_clipped(np.minimum(x, 0.9), noise=0.0)
    (False, True)
    """
    stroke = float(np.ptp(cycle))
    if not stroke > 0.0:
        return False
    asked = [
        (scale, sharpest)
        for scale, sharpest in (FINE if stops_on_its_way else SCALES).items()
        if 8.0 * noise <= scale * LEVELS[0] * stroke and cycle.size * scale**0.5 >= POINTS
    ]
    return any(_is_cut_off(side, asked) for side in (cycle / stroke, -cycle / stroke))


def _is_cut_off(side: FloatArray, asked: list[tuple[float, float]]) -> bool:
    """Whether both flanks of the highest point have a corner; the second is looked at only where the first has."""
    for flank in (side, side[::-1]):
        depth = _depths(flank)
        asked = [(scale, sharpest) for scale, sharpest in asked if _sharpness(depth, scale) > sharpest]
        if not asked:
            return False
    return True


def _depths(cycle: FloatArray) -> FloatArray:
    """Depths below the highest point, from there on."""
    top = int(np.argmax(cycle))
    return np.asarray(cycle[top] - np.concatenate([cycle[top:], cycle[:top]]))


def _sharpness(depth: FloatArray, scale: float) -> float:
    """Time from the second to the third level over the time from the first to the second, after the highest point.

    A signal that was cut off falls all the way. An elastic contact rings about its extreme and comes back: no flank.
    """
    first, second, third = (_crossing(depth, scale * level) for level in LEVELS)
    flank = depth[int(first) : int(third) + 1]
    if np.any(np.maximum.accumulate(flank) - flank > BACK * scale * LEVELS[0]):
        return 0.0
    return (third - second) / max(second - first, 1e-300)


def _crossing(depth: FloatArray, level: float) -> float:
    """Where the depth last passes the level on its first way down to the next, in points."""
    below = int(np.argmax(depth > 1.5 * level))
    above = below - 1 - int(np.argmax(depth[:below][::-1] <= level))
    rise = depth[above + 1] - depth[above]
    return float(above + (level - depth[above]) / rise)
