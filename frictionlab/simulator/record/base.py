"""A sampled motion of the base: what drives the mass where it is no periodic cosine.

Its cubics are coefficients (n, 4) of a polynomial a piece, over the time from the begin of each.
"""

from dataclasses import dataclass
from functools import cached_property
from math import factorial
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from frictionlab.arrays import FloatArray
from frictionlab.errors import SimulationError

Quantity = Literal["displacement", "acceleration"]


@dataclass(frozen=True)
class BaseRecord:
    """A motion of the base, sampled; between its samples a cubic spline (not-a-knot).

    Parameters
    ----------
    time : array_like of shape (n,)
        tau = omega_n t, rad, strictly increasing; steps need not be equal.
    displacement : array_like of shape (n,)
        Displacement of the base in any one unit. With smooth motions the spline errs with the fourth power of the
        sampling interval.
    rest : float, optional
        Displacement at which the spring of a mass at x = 0 is relaxed; left out, that of the first sample.
    scale : float, optional
        The displacement Y that everything is measured in; left out, the largest distance from `rest`.
    quantity : {"displacement", "acceleration"}
        What the samples are. An acceleration is d2y/dtau2, in a unit of length: it drives a wall that moves with the
        base as it is, without any integration; its `rest` is 0, and Y its largest size.

    Raises
    ------
    SimulationError
        Fewer than two samples, lengths that differ, values that are not finite, times that do not increase, or a base
        that never moves.

    Examples
    --------
    >>> base = BaseRecord([0.0, 1.0, 2.0, 3.0], [5.0, 6.0, 4.0, 5.0])
    >>> base.scale, base.values.tolist()
    (1.0, [0.0, 1.0, -1.0, 0.0])
    """

    time: FloatArray
    displacement: FloatArray
    rest: float = float("nan")
    scale: float = float("nan")
    quantity: Quantity = "displacement"

    def __init__(
        self,
        time: ArrayLike,
        displacement: ArrayLike,
        *,
        rest: float | None = None,
        scale: float | None = None,
        quantity: Quantity = "displacement",
    ) -> None:
        times, values = _column(time), _column(displacement)
        _check(times, values)
        if rest is None:
            rest = 0.0 if quantity == "acceleration" else float(values[0])
        zero = float(rest)
        size = float(max(values.max() - zero, zero - values.min())) if scale is None else float(scale)
        if not (size > 0.0 and np.isfinite(size) and np.isfinite(zero)):
            raise SimulationError(
                f"base motion: its size; expected a finite number > 0; got {size!r} about {zero!r}: a base at rest "
                "drives nothing"
            )
        vars(self).update(time=times, displacement=values, rest=zero, scale=size, quantity=quantity)

    @cached_property
    def values(self) -> FloatArray:
        """Displacement from `rest` over `scale`, shape (n,)."""
        values = (self.displacement - self.rest) / self.scale
        values.setflags(write=False)
        return values

    @cached_property
    def motion(self) -> FloatArray:
        """Displacement and its rate at the samples (2, n); none where the acceleration alone is known."""
        known = self.quantity == "displacement"
        return np.asarray((self.values, self._spline(self.time, 1)) if known else np.zeros((2, len(self.time))))

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline  # noqa: PLC0415 - 0.2 s that other work need not wait for

        return CubicSpline(self.time, self.values)

    def pieces(self, parts: int = 1, *, acceleration: bool = False) -> tuple[FloatArray, FloatArray]:
        """Return begins and end (k + 1,) and cubics (k, 4) of what drives, a sampling interval in so many parts.

        `acceleration`: of a displacement that of its second derivative.
        """
        time, cubics = self.time.copy(), self._spline.c[::-1].T.copy()
        if parts > 1:
            begins = (time[:-1, None] + np.outer(np.diff(time), np.arange(parts) / parts)).ravel()
            cubics = np.column_stack([self._spline(begins, order) / factorial(order) for order in range(4)])
            time = np.append(begins, time[-1])
        if acceleration and self.quantity == "displacement":
            cubics = np.column_stack((2.0 * cubics[:, 2], 6.0 * cubics[:, 3], np.zeros((len(cubics), 2))))
        return time, cubics


def _column(values: ArrayLike) -> FloatArray:
    array = np.ascontiguousarray(values, dtype=np.float64).view()
    array.setflags(write=False)
    return array


def _check(times: FloatArray, values: FloatArray) -> None:
    if times.ndim != 1 or times.shape != values.shape or len(times) < 2:
        raise SimulationError(
            f"base motion: expected times and displacements of one length, at least 2; got shapes {times.shape} and "
            f"{values.shape}"
        )
    for name, column in (("time", times), ("displacement", values)):
        if not np.isfinite(column.sum()):
            wrong = int(np.argmax(~np.isfinite(column)))
            raise SimulationError(
                f"base motion: {name}; expected finite numbers; got {column[wrong]} at sample {wrong}"
            )
    steps = np.diff(times)
    if not steps.min() > 0.0:
        wrong = int(np.argmax(~(steps > 0.0)))
        raise SimulationError(
            f"base motion: time; expected to increase; got {float(times[wrong])!r} then "
            f"{float(times[wrong + 1])!r} at sample {wrong + 1}"
        )
