"""What is simulated: the four numbers, the wall and the motion of the base; validated once, then frozen."""

from dataclasses import dataclass, field
from math import hypot, isfinite
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.errors import SimulationError

__all__ = ["COSINE", "Base", "Problem", "Wall"]

Wall = Literal["fixed", "base"]


@dataclass(frozen=True)
class Base:
    """The motion of the base over its amplitude Y, as a Fourier series of the drive.

    ``f(tau) = sum_k cosine[k-1] cos(k tau) + sine[k-1] sin(k tau)``; the default is the pure cosine of the thesis.

    Parameters
    ----------
    cosine, sine : tuple of float
        Coefficients of harmonics 1, 2, ...; the shorter one is filled with zeros.

    Raises
    ------
    SimulationError
        If there is no coefficient, or one is not finite, or all are zero.

    Examples
    --------
    >>> Base(cosine=(1.0, 0.0, 0.05), sine=(0.0, 0.01)).harmonics
    3
    """

    cosine: tuple[float, ...] = (1.0,)
    sine: tuple[float, ...] = (0.0,)

    def __post_init__(self) -> None:
        """Fill the shorter series, refuse what is no motion."""
        count = max(len(self.cosine), len(self.sine))
        for name in ("cosine", "sine"):
            given = tuple(float(c) for c in getattr(self, name))
            if not all(isfinite(c) for c in given):
                raise SimulationError(f"base motion: coefficients in {name}; expected finite numbers; got {given}")
            object.__setattr__(self, name, given + (0.0,) * (count - len(given)))
        if not any(self.cosine) and not any(self.sine):
            raise SimulationError(
                f"base motion: {count} harmonics; expected at least one that is not zero; got none: "
                "a base at rest drives nothing"
            )

    @property
    def harmonics(self) -> int:
        """Number of harmonics kept."""
        return len(self.cosine)

    def at(self, tau: ArrayLike) -> NDArray[np.float64]:
        """Return the displacement of the base over Y at times tau (rad)."""
        phase = np.multiply.outer(np.asarray(tau, dtype=np.float64), np.arange(1, self.harmonics + 1))
        return np.asarray(np.cos(phase) @ np.array(self.cosine) + np.sin(phase) @ np.array(self.sine))


COSINE = Base()


@dataclass(frozen=True)
class Problem:
    """One dimensionless friction oscillator: ``r^2 x'' + 2 zeta r x' + x = f(tau) - beta n(tau)``, eq. (2.9) extended.

    Parameters
    ----------
    r : float
        Frequency ratio, drive over natural frequency (2.7); > 0.
    beta : float
        Friction ratio, kinetic friction force over k Y (2.8); >= 0.
    mu : float
        Static over kinetic friction force (2.4); >= 1.
    zeta : float
        Viscous damping ratio (3.5) of a dashpot that stands where the friction stands; >= 0.
    wall : {"fixed", "base"}
        What the mass rubs against: a fixed wall (thesis), or one that moves with the base.
    base : Base
        Motion of the base over Y.

    Raises
    ------
    SimulationError
        If a number is outside its domain.

    Examples
    --------
    >>> Problem(r=0.5, beta=0.4).mu
    1.0
    """

    r: float
    beta: float
    mu: float = 1.0
    zeta: float = 0.0
    wall: Wall = "fixed"
    base: Base = field(default=COSINE)

    def __post_init__(self) -> None:
        """Refuse numbers outside their domain, by name."""
        limits = {"r": (self.r > 0.0, "> 0"), "beta": (self.beta >= 0.0, ">= 0")}
        limits |= {"mu": (self.mu >= 1.0, ">= 1"), "zeta": (self.zeta >= 0.0, ">= 0")}
        for name, (valid, domain) in limits.items():
            value = float(getattr(self, name))
            if not (valid and isfinite(value)):
                raise SimulationError(f"simulation: {name}; expected a finite number {domain}; got {value!r}")
            object.__setattr__(self, name, value)
        if not 1e-6 <= self.r <= 1e6:
            raise SimulationError(f"simulation: r; expected between 1e-6 and 1e6; got {self.r!r}")
        if self.wall not in ("fixed", "base"):
            raise SimulationError(f"simulation: wall; expected 'fixed' or 'base'; got {self.wall!r}")

    @property
    def force(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Fourier coefficients of the force F in the displacement relative to the wall: f, or -r^2 f'' if it moves."""
        if self.wall == "fixed":
            return self.base.cosine, self.base.sine
        scale = [(self.r * (k + 1)) ** 2 for k in range(self.base.harmonics)]
        cosine = tuple(s * c for s, c in zip(scale, self.base.cosine, strict=True))
        return cosine, tuple(s * c for s, c in zip(scale, self.base.sine, strict=True))

    @property
    def force_size(self) -> float:
        """Bound of |F|: the sum of its harmonics' amplitudes."""
        return sum(hypot(c, s) for c, s in zip(*self.force, strict=True))
