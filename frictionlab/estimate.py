"""A number with its errors: one type for all of them, and one way to say that a number is not known.

A result holds its numbers as estimates; the flat names of the contract (``energy_per_cycle``, ``energy_per_cycle_se``,
``energy_per_cycle_u``) are read off them by `Flat` and `FlatKnown`, so that a number and its errors cannot part.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal, Self, overload

Part = Literal["value", "se", "u"]


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number with its standard error and its combined standard uncertainty; ``None`` is not known, and so is NaN.

    Attributes
    ----------
    value
        The number.
    se
        Standard error: what its own scatter and the sensors' noise do to it (GUM, type A).
    u
        Combined standard uncertainty: the standard error and what sensors, clock and rig do to it (type A and B).

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
        errors = (None if error is None else error * abs(factor) for error in (self.se, self.u))
        return Estimate(self.value * factor, *errors)

    def over(self, divisor: float | None) -> "Estimate":
        """The number over an exact one; not known where that is not, or is 0."""
        if not divisor or self.value is None:
            return Estimate()
        errors = (None if error is None else error / abs(divisor) for error in (self.se, self.u))
        return Estimate(self.value / divisor, *errors)

    def with_u(self, u: float | None) -> "Estimate":
        """The same number with its combined standard uncertainty."""
        return replace(self, u=u)

    def with_relative(self, share: float) -> "Estimate":
        """The same number, its uncertainty of its standard error and a share of itself."""
        return self if self.value is None else self.with_u(math.hypot(self.se or 0.0, share * self.value))

    def __str__(self) -> str:
        if self.value is None:
            return "not known"
        if not self.error:
            return f"{self.value:.6g}"
        digits = 1 - math.floor(math.log10(self.error))
        if not 0 <= digits <= 12:
            return f"{self.value:.6g} ± {self.error:.2g}"
        return f"{self.value:.{digits}f} ± {self.error:.{digits}f}"


NOT_KNOWN = Estimate()


class Flat:
    """A flat name of one part of an estimate that a result holds; ``None`` where it is not known.

    Parameters
    ----------
    estimate
        Name of the result's field.
    part
        ``value``, ``se`` or ``u``.
    """

    def __init__(self, estimate: str, part: Part = "value") -> None:
        self._estimate, self._part = estimate, part

    @overload
    def __get__(self, result: None, kind: type) -> Self: ...

    @overload
    def __get__(self, result: object, kind: type) -> float | None: ...

    def __get__(self, result: object, kind: type) -> Self | float | None:
        """Return the part of the estimate."""
        if result is None:
            return self
        number: float | None = getattr(getattr(result, self._estimate), self._part)
        return number


class FlatKnown:
    """As `Flat`, of a number that every such result has, to reckon with: NaN where it is not known after all."""

    def __init__(self, estimate: str, part: Part = "value") -> None:
        self._estimate, self._part = estimate, part

    @overload
    def __get__(self, result: None, kind: type) -> Self: ...

    @overload
    def __get__(self, result: object, kind: type) -> float: ...

    def __get__(self, result: object, kind: type) -> Self | float:
        """Return the part of the estimate."""
        if result is None:
            return self
        number: float | None = getattr(getattr(result, self._estimate), self._part)
        return math.nan if number is None else number
