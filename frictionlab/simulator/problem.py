"""What is simulated: frequency ratio, contact law, wall and motion of the base; validated once, then frozen."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot, isfinite
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.errors import ParameterError, SimulationError
from frictionlab.simulator.laws import Law, law_of

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

    @property
    def lines(self) -> NDArray[np.complex128]:
        """Complex amplitudes (K,): the motion is the real part of their sum, each times exp(i k tau), k from 1 on."""
        return np.asarray(np.array(self.cosine) - 1j * np.array(self.sine))

    def at(self, tau: ArrayLike) -> NDArray[np.float64]:
        """Return the displacement of the base over Y at times tau (rad)."""
        phase = np.multiply.outer(np.asarray(tau, dtype=np.float64), np.arange(1, self.harmonics + 1))
        return np.asarray(np.cos(phase) @ np.array(self.cosine) + np.sin(phase) @ np.array(self.sine))

    def rate_at(self, tau: ArrayLike) -> NDArray[np.float64]:
        """Return the derivative of the displacement with respect to tau at times tau (rad)."""
        k = np.arange(1, self.harmonics + 1)
        phase = np.multiply.outer(np.asarray(tau, dtype=np.float64), k)
        return np.asarray(np.cos(phase) @ (k * np.array(self.sine)) - np.sin(phase) @ (k * np.array(self.cosine)))


COSINE = Base()


@dataclass(frozen=True, init=False)
class Problem:
    """One dimensionless friction oscillator: ``r^2 x'' + 2 zeta_f r (x' - f') + (x - f) + n = 0``, eq. (2.9) extended.

    n is the force of the contact on the mass, as its law says; in plain Coulomb friction ``n = beta sgn(v)``.

    Parameters
    ----------
    r : float
        Frequency ratio, drive over natural frequency (2.7); > 0.
    beta : float
        Friction ratio, kinetic friction force over k Y (2.8); >= 0.
    mu : float, optional
        Static over kinetic friction force (2.4) in both directions; other than 1 it adds the term ``breakaway``.
    zeta : float, optional
        Damping ratio of a dashpot that stands where the friction stands; other than 0 it adds the term ``speed``.
    wall : {"fixed", "base"}
        What the mass rubs against: a fixed wall (thesis), or one that moves with the base.
    base : Base
        Motion of the base over Y.
    law : str or Law
        A sum of terms that starts with ``coulomb``: ``coulomb+place+speed``.
    parameters : mapping of str to float, optional
        Further parameters of the law, by the names that `Law.parameters` lists.
    frame_damping_ratio : float
        Damping ratio of the frame's own dashpot, between mass and base (what a free decay measures).

    Raises
    ------
    ParameterError
        The law does not exist, lacks a parameter that is given, or a value is missing or outside its domain.
    SimulationError
        r is outside its domain.

    Examples
    --------
    >>> Problem(r=0.5, beta=0.4).mu
    1.0
    >>> Problem(r=0.5, beta=0.4, law="coulomb+place", parameters={"gradient": 0.02}).parameters
    {'beta': 0.4, 'gradient': 0.02, 'frame_damping_ratio': 0.0}
    """

    r: float
    law: Law
    numbers: tuple[float, ...]
    wall: Wall
    base: Base

    def __init__(
        self,
        r: float,
        beta: float,
        mu: float | None = None,
        zeta: float | None = None,
        wall: Wall = "fixed",
        base: Base = COSINE,
        *,
        law: str | Law = "coulomb",
        parameters: Mapping[str, float] | None = None,
        frame_damping_ratio: float = 0.0,
    ) -> None:
        try:
            r = float(r)
        except (TypeError, ValueError, OverflowError) as error:
            raise ParameterError(f"simulation: r; expected a finite number > 0; got {r!r}") from error
        if not (r > 0.0 and isfinite(r)):
            raise ParameterError(f"simulation: r; expected a finite number > 0; got {r!r}")
        if not 1e-6 <= r <= 1e6:
            raise ParameterError(f"simulation: r; expected between 1e-6 and 1e6; got {r!r}")
        if wall not in ("fixed", "base"):
            raise ParameterError(f"simulation: wall; expected 'fixed' or 'base'; got {wall!r}")
        _check_shorthands(mu, zeta)
        law = _with_shorthands(law_of(law), mu, zeta)
        given = {"beta": beta, "frame_damping_ratio": frame_damping_ratio, **_written_out(law, mu, zeta)}
        self._set(r=r, law=law, numbers=law.complete(given | dict(parameters or {})), wall=wall, base=base)

    def _set(self, **values: object) -> None:
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        told = ", ".join(f"{name} {value:g}" for name, value in self.parameters.items())
        base = "" if self.base == COSINE else f", base of {self.base.harmonics} harmonics"
        return f"<Problem r = {self.r:g}, {self.law.name}: {told}, {self.wall} wall{base}>"

    @property
    def parameters(self) -> dict[str, float]:
        """All parameters of the law by name."""
        return dict(zip((p.name for p in self.law.parameters), self.numbers, strict=True))

    def parameter(self, name: str, otherwise: float = 0.0) -> float:
        """Return a parameter of the law, or `otherwise` where the law lacks it."""
        return self.parameters.get(name, otherwise)

    @property
    def beta(self) -> float:
        """Friction ratio (2.8)."""
        return self.numbers[0]

    @property
    def mu(self) -> float:
        """Static over kinetic friction force (2.4): the larger one of the two directions."""
        return max(self.static_ratios)

    @property
    def static_ratios(self) -> tuple[float, float]:
        """Static over kinetic friction force for a start up and for one down."""
        return self.parameter("static_ratio_up", 1.0), self.parameter("static_ratio_down", 1.0)

    @property
    def has_mirror_image(self) -> bool:
        """Whether the problem is its own mirror image half a cycle later: then its steady state is, or has a twin."""
        even = any(self.base.cosine[1::2]) or any(self.base.sine[1::2])
        return not even and self.parameter("gradient") == 0.0 and len(set(self.static_ratios)) == 1

    @property
    def zeta(self) -> float:
        """Damping ratio of the contact's dashpot."""
        return self.parameter("contact_damping_ratio")

    @property
    def frame_damping_ratio(self) -> float:
        """Damping ratio of the frame's own dashpot."""
        return self.numbers[-1]

    def with_parameters(self, changes: Mapping[str, float]) -> Self:
        """Return the problem with some of its law's parameters replaced, by name.

        Raises
        ------
        ParameterError
            The law lacks one of them, or a value is outside its domain.

        Examples
        --------
        >>> Problem(r=0.5, beta=0.4).with_parameters({"beta": 0.3}).beta
        0.3
        """
        return self._but(numbers=self.law.complete(self.parameters | dict(changes)))

    def with_r(self, r: float) -> Self:
        """Return the problem at another frequency ratio."""
        return self._but(r=Problem(r, self.beta).r)

    def in_frame_time(self) -> Self:
        """Return the same oscillator with time counted in omega_n t (r = 1): what its law says of speeds is scaled.

        Examples
        --------
        >>> law = {"rate_strength": 0.1, "rate_speed": 0.2}
        >>> Problem(r=0.5, beta=0.4, law="coulomb+logarithm", parameters=law).in_frame_time().parameter("rate_speed")
        0.1
        """
        numbers = (n * self.r**p.rates for p, n in zip(self.law.parameters, self.numbers, strict=True))
        return self._but(r=1.0, numbers=tuple(numbers))

    def _but(self, **changes: object) -> Self:
        twin = object.__new__(type(self))
        names = ("r", "law", "numbers", "wall", "base")
        twin._set(**({name: getattr(self, name) for name in names} | changes))
        return twin

    @property
    def force(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Fourier coefficients of the force F in the displacement relative to the wall.

        A fixed wall: ``f + 2 zeta_f r f'``; a wall that moves with the base: ``-r^2 f''``, and the frame's dashpot does
        not see the base move.
        """
        pairs = [
            self._harmonic(k + 1, *pair) for k, pair in enumerate(zip(self.base.cosine, self.base.sine, strict=True))
        ]
        return tuple(c for c, _ in pairs), tuple(s for _, s in pairs)

    def _harmonic(self, k: int, cosine: float, sine: float) -> tuple[float, float]:
        if self.wall == "base":
            scale = (self.r * k) ** 2
            return scale * cosine, scale * sine
        lead = 2.0 * self.frame_damping_ratio * self.r * k
        return cosine + lead * sine, sine - lead * cosine

    @property
    def force_size(self) -> float:
        """Bound of |F|: the sum of its harmonics' amplitudes."""
        return sum(hypot(c, s) for c, s in zip(*self.force, strict=True))


def _check_shorthands(mu: float | None, zeta: float | None) -> None:
    """Refuse mu and zeta by the names under which they were given."""
    for name, value, least in (("mu", mu, 1), ("zeta", zeta, 0)):
        if value is not None and not (value >= least and isfinite(value)):
            raise ParameterError(f"simulation: {name}; expected a finite number >= {least}; got {value!r}")


def _with_shorthands(law: Law, mu: float | None, zeta: float | None) -> Law:
    """The law with the terms that mu and zeta stand for, where it lacks them."""
    name = law.name
    if mu not in (None, 1.0) and not (law.has("breakaway") or "static_ratio" in {p.name for p in law.own}):
        for term in law.terms:
            if "breakaway" in term.excludes:
                raise ParameterError(
                    f"law {name}: mu stands for the term breakaway, and {term.name} and breakaway exclude each other: "
                    "leave one out"
                )
        name += "+breakaway"
    if zeta not in (None, 0.0) and not law.has("speed"):
        name += "+speed"
    return law_of(name)


def _written_out(law: Law, mu: float | None, zeta: float | None) -> dict[str, float]:
    """The parameters that mu and zeta stand for in this law, where they are given."""
    stands_for: dict[str, float | None] = dict.fromkeys(("static_ratio_up", "static_ratio_down", "static_ratio"), mu)
    stands_for["contact_damping_ratio"] = zeta
    names = {parameter.name for parameter in law.own}
    return {name: value for name, value in stands_for.items() if name in names and value is not None}
