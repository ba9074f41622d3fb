"""What is told of a whole record over its prediction; `whole` makes it, and is loaded where that is asked for."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Fitted = Literal["cycle", "whole"]
SURE = 4.0  # errors between the least and the largest friction from which it is said to wander
LIKELY = 5.0  # the logarithm by which friction that wanders is more likely, from which it is said
SHOWN = 5  # stretches told one by one


@dataclass(frozen=True)
class WholeRecord:
    """A record over its prediction, from the first sample to the last.

    Parameters
    ----------
    time : ndarray of shape (n,)
        s, by the recording's clock.
    base, measured, predicted : ndarray of shape (n,)
        Over Y; the mass about the mean of its measured record.
    nrmse : float
        Rms of measured minus predicted over the rms of the measured about its mean.
    energy_difference : float
        Predicted / measured - 1, of the loop's area over the whole record, eq. (2.18).
    cycle_time, cycle_measured, cycle_predicted, cycle_nrmse : ndarray of shape (c,)
        Start of each period of the drive; its energy (k Y^2) as measured and as predicted; its own nrmse.
    cycle_friction, cycle_friction_se : ndarray of shape (c,)
        Friction ratio of each period as a random walk about the fitted one, and the standard error of its changes;
        their common level is as sure as the friction ratio itself.
    wanders : float
        Logarithm of how much more likely friction that changes is than friction that does not.
    left : tuple of (float, float, float)
        Where the prediction leaves the measurement: from, to (s), and the largest nrmse of a period there.
    """

    time: FloatArray
    base: FloatArray
    measured: FloatArray
    predicted: FloatArray
    nrmse: float
    energy_difference: float
    cycle_time: FloatArray
    cycle_measured: FloatArray
    cycle_predicted: FloatArray
    cycle_nrmse: FloatArray
    cycle_friction: FloatArray
    cycle_friction_se: FloatArray
    wanders: float
    left: tuple[tuple[float, float, float], ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on where the prediction leaves the measurement."""
        return tuple(self._said())

    def _said(self) -> Iterator[str]:
        usual = 100.0 * float(np.median(self.cycle_nrmse)) if len(self.cycle_nrmse) else math.nan
        for begin, end, worst in self.left[:SHOWN]:
            yield (
                f"record: the prediction leaves the measurement from {begin:.4g} s to {end:.4g} s: {100 * worst:.2g} %"
                f" of the response there, {usual:.2g} % in the usual period: friction that wanders, a jump, or a start"
                " that the law does not know"
            )
        yield from self._wanders()
        if len(self.left) > SHOWN:
            yield f"record: the prediction leaves the measurement in {len(self.left) - SHOWN} more places"

    def _wanders(self) -> Iterator[str]:
        """Say between which values friction wanders, where that is sure."""
        friction, error, time = self.cycle_friction, self.cycle_friction_se, self.cycle_time
        if self.friction_wanders:
            ends = int(np.argmin(friction)), int(np.argmax(friction))
            least, most = (f"{friction[i]:.4g} +- {error[i]:.1g} at {time[i]:.4g} s" for i in ends)
            yield f"record: friction wanders between {least} and {most}"

    @property
    def friction_wanders(self) -> bool:
        """Whether it is beyond doubt that friction was not the same all the time."""
        friction, error = self.cycle_friction, self.cycle_friction_se
        if len(friction) < 2 or self.wanders < LIKELY:
            return False
        low, high = int(np.argmin(friction)), int(np.argmax(friction))
        return bool(friction[high] - friction[low] > SURE * math.hypot(float(error[low]), float(error[high])))
