"""A number with its errors: one type for all of them, and one way to say that a number is not known.

A result holds its numbers as estimates; the flat names of the contract (a column's, with ``_se`` and ``_u``) are read
off them by `Flat` and `FlatKnown`, so that a number and its errors cannot part.
`average` and `weighted_mean` make one number of several that scatter by more than their errors.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Generic, Literal, Self, TypeVar, overload

import numpy as np

from frictionlab.arrays import FloatArray

Part = Literal["value", "se", "u"]


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number with its errors; ``None`` is not known, and so is NaN.

    ``se``: standard error, what its own scatter and the sensors' noise do to it (GUM, type A); ``u``: combined standard
    uncertainty, with what sensors, clock and rig do to it (type A and B).

    Examples
    --------
    >>> energy = Estimate(2.1260, 0.0031)
    >>> print(energy, energy.known, energy.scaled(1000.0).se)
    2.1260 ± 0.0031 True 3.1
    >>> Estimate(math.nan).known, str(Estimate())
    (False, 'not known')
    """

    value: float | None = None
    se: float | None = None
    u: float | None = None

    def __post_init__(self) -> None:
        for part in ("value", "se", "u"):
            number = getattr(self, part)
            if number is not None and not math.isfinite(number):
                object.__setattr__(self, part, None)

    @property
    def known(self) -> bool:
        """Whether there is a number."""
        return self.value is not None

    @property
    def error(self) -> float | None:
        """The widest error that is known: the combined uncertainty, else the standard error."""
        return self.se if self.u is None else self.u

    @property
    def relative_se(self) -> float | None:
        """Standard error over the number; None where one of them is not known, or the number is 0."""
        return abs(self.se / self.value) if self.value and self.se is not None else None

    def scaled(self, factor: float | None) -> "Estimate":
        """The number times an exact one; not known where that is not."""
        if factor is None or self.value is None:
            return Estimate()
        se, u = (None if error is None else error * abs(factor) for error in (self.se, self.u))
        return Estimate(self.value * factor, se, u)

    def over(self, divisor: float | None) -> "Estimate":
        """The number over an exact one; not known where that is not, or is 0."""
        found = self.scaled(1.0 / divisor if divisor else None)
        return found if self.value is None or not divisor else replace(found, value=self.value / divisor)

    def with_u(self, u: float | None) -> "Estimate":
        """The same number with its combined standard uncertainty."""
        return replace(self, u=u)

    def with_relative(self, share: float) -> "Estimate":
        """The same number, its uncertainty of its standard error and a share of itself."""
        return self if self.value is None or self.se is None else self.with_u(math.hypot(self.se, share * self.value))

    def __str__(self) -> str:
        if self.value is None:
            return "not known"
        if not self.error:
            return f"{self.value:.6g}"
        digits = 1 - math.floor(math.log10(self.error))
        if not 0 <= digits <= 12:
            return f"{self.value:.6g} ± {self.error:.2g}"
        return f"{self.value:.{digits}f} ± {self.error:.{digits}f}"


def with_digits(value: float, u: float) -> str:
    """A number as it is declared: two digits of its standard uncertainty are left, or four of itself where u is 0."""
    digits = max(1, 2 + math.ceil(math.log10(abs(value) / u))) if value and u else 4
    return f"{value:.{digits}g}"


NOT_KNOWN = Estimate()
T = TypeVar("T")


class _Flat(Generic[T]):
    """A flat name of one part (``value``, ``se`` or ``u``) of an estimate that a result holds, by its field's name."""

    missing: T

    def __init__(self, estimate: str, part: Part = "value") -> None:
        self._estimate, self._part = estimate, part

    @overload
    def __get__(self, result: None, kind: type) -> Self: ...

    @overload
    def __get__(self, result: object, kind: type) -> T: ...

    def __get__(self, result: object, kind: type) -> Self | T:
        """Return the part of the estimate."""
        if result is None:
            return self
        number: T | None = getattr(getattr(result, self._estimate), self._part)
        return self.missing if number is None else number


class Flat(_Flat[float | None]):
    """A flat name of one part of an estimate; ``None`` where it is not known."""

    missing = None


class FlatKnown(_Flat[float]):
    """As `Flat`, of a number that every such result has, to reckon with: NaN where it is not known after all."""

    missing = math.nan


def errors_of(estimate: str) -> tuple[Flat, Flat]:
    """Return the flat names of an estimate's ``se`` and ``u``."""
    return Flat(estimate, "se"), Flat(estimate, "u")


class FrictionNames:
    """Flat names of the estimates ``friction`` (the friction ratio), ``force`` (N) and ``coefficient`` of a result.

    That of the friction ratio itself is the result's own: some have it always.
    """

    friction_ratio_se, friction_ratio_u = errors_of("friction")
    friction_force_n, friction_coefficient = Flat("force"), Flat("coefficient")
    friction_force_n_se, friction_force_n_u = errors_of("force")
    friction_coefficient_se, friction_coefficient_u = errors_of("coefficient")


@dataclass(frozen=True)
class Average:
    """Mean of several estimates, its standard error, and their scatter beyond their own errors (None for one alone)."""

    mean: float
    se: float
    spread: float | None


def average(values: Sequence[float], errors: Sequence[float]) -> Average:
    """Mean weighted by the errors and by the scatter beyond them [Paule and Mandel 1982].

    The standard error is the larger of what the errors and what the values themselves say.

    Examples
    --------
    >>> average([1.0, 2.0, 3.0], [0.1, 0.1, 0.1]).mean
    2.0
    >>> average([3.0], [0.1])
    Average(mean=3.0, se=0.1, spread=None)
    """
    value, error = np.asarray(values, dtype=np.float64), np.asarray(errors, dtype=np.float64)
    if len(value) == 1:
        return Average(float(value[0]), float(error[0]), None)
    error = np.maximum(error, 1e-12 * float(np.abs(value).max(initial=1e-300)))
    spread = scatter_beyond(value, error)
    weight = 1.0 / (error**2 + spread**2)
    mean = weighted_mean(value, error, spread)
    seen = math.sqrt(float(np.sum(weight * (value - mean) ** 2)) / (len(value) - 1) / float(weight.sum()))
    return Average(mean, max(1.0 / math.sqrt(float(weight.sum())), seen), spread)


def weighted_mean(value: FloatArray, error: FloatArray, spread: float) -> float:
    """Mean of values (n,) with errors (n,), each weighted by 1 / (error^2 + spread^2)."""
    weight = 1.0 / (error**2 + spread**2)
    return float(np.sum(weight * value) / np.sum(weight))


def scatter_beyond(value: FloatArray, error: FloatArray) -> float:
    """Scatter beyond the errors: where chi-square meets its degrees of freedom; 0 where it is below them already."""
    freedom = len(value) - 1

    def excess(spread: float) -> float:
        mean = weighted_mean(value, error, spread)
        return float(np.sum((value - mean) ** 2 / (error**2 + spread**2))) - freedom

    if freedom < 1 or excess(0.0) <= 0.0:
        return 0.0
    from scipy.optimize import brentq  # noqa: PLC0415 - for means of several alone

    high = float(np.ptp(value))
    while excess(high) > 0.0:
        high *= 2.0
    return float(brentq(excess, 0.0, high, xtol=1e-15 * high))
