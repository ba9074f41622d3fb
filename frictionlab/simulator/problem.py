"""What is asked: frequency ratio, law, wall and motion of the base, validated once; and the work it may cost."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from math import isfinite
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.errors import FrictionlabError, ParameterError, SimulationError
from frictionlab.simulator.laws import Friction, Law, Parameter, law_of

Wall = Literal["fixed", "base"]

R = Parameter("r", "r", "drive over natural frequency", low=1e-6, high=1e6, usual=(0.1, 3.0))
MU = Parameter("mu", "μ", "static over kinetic friction force", low=1.0, usual=(1.0, 2.0))
ZETA = Parameter("zeta", "ζ", "damping ratio of the contact's dashpot", usual=(0.0, 0.1))
STATE = 100.0  # steps of integration that an integrated steady state costs beside its own
EXACT_STATE, LOOKS = 50.0, 13.0  # what an exact one costs beside its evaluations, and how many of these cost a step


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
    def is_odd(self) -> bool:
        """Whether half a cycle later the motion is its own negative."""
        return not (any(self.cosine[1::2]) or any(self.sine[1::2]))

    @property
    def lines(self) -> NDArray[np.complex128]:
        """Complex amplitudes (K,): the motion is the real part of their sum, each times exp(i k tau), k from 1 on."""
        return np.asarray(np.array(self.cosine) - 1j * np.array(self.sine))

    def at(self, tau: ArrayLike) -> NDArray[np.float64]:
        """Return the displacement of the base over Y at times tau (rad)."""
        return self._series(tau, self.lines)

    def rate_at(self, tau: ArrayLike) -> NDArray[np.float64]:
        """Return the derivative of the displacement with respect to tau at times tau (rad)."""
        return self._series(tau, 1j * np.arange(1, self.harmonics + 1) * self.lines)

    def _series(self, tau: ArrayLike, lines: NDArray[np.complex128]) -> NDArray[np.float64]:
        phase = np.multiply.outer(np.asarray(tau, dtype=np.float64), np.arange(1, self.harmonics + 1))
        return np.asarray(np.cos(phase) @ lines.real - np.sin(phase) @ lines.imag)


COSINE = Base()


@dataclass(frozen=True, init=False)
class Problem(Friction):
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
        if wall not in ("fixed", "base"):
            raise ParameterError(f"simulation: wall; expected 'fixed' or 'base'; got {wall!r}")
        law, meant = _with_shorthands(law_of(law), mu, zeta)
        given = {"beta": beta, "frame_damping_ratio": frame_damping_ratio} | meant | dict(parameters or {})
        vars(self).update(r=R.checked(r), law=law, numbers=law.complete(given), wall=wall, base=base)

    def __repr__(self) -> str:
        said = ", ".join(f"{name} {value:g}" for name, value in self.parameters.items())
        base = "" if self.base == COSINE else f", base of {self.base.harmonics} harmonics"
        return f"<Problem r = {self.r:g}, {self.law.name}: {said}, {self.wall} wall{base}>"

    @property
    def is_exact(self) -> bool:
        """Whether every phase of its motion has a closed form."""
        return self.law.is_exact

    @property
    def has_mirror_image(self) -> bool:
        """Whether the problem is its own mirror image half a cycle later: then its steady state is, or has a twin."""
        return self.base.is_odd and self.is_even

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
        vars(twin).update(vars(self) | changes)
        return twin

    @property
    def force(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Fourier coefficients of the force F in the displacement relative to the wall.

        A fixed wall: ``f + 2 zeta_f r f'``; a wall that moves with the base: ``-r^2 f''``, and the frame's dashpot does
        not see the base move.
        """
        k = np.arange(1, self.base.harmonics + 1)
        share = (self.r * k) ** 2 if self.wall == "base" else 1.0 + 2j * self.frame_damping_ratio * self.r * k
        lines = share * self.base.lines
        return tuple(lines.real.tolist()), tuple((-lines.imag).tolist())

    @property
    def force_size(self) -> float:
        """Bound of |F|: the sum of its harmonics' amplitudes."""
        return float(bound_of_force(self.r, self.frame_damping_ratio, self.wall, self.base))


def bound_of_force(r: Any, frame: Any, wall: Wall, base: Base) -> Any:
    """Return the bound of |F|, the sum of its harmonics' amplitudes, at a number or an array of r and frame damping."""
    total = 0.0
    for k, line in enumerate(base.lines.tolist(), 1):
        total = total + abs(line) * ((k * r) ** 2 if wall == "base" else (1.0 + (2.0 * k * frame * r) ** 2) ** 0.5)
    return total


def _with_shorthands(law: Law, mu: float | None, zeta: float | None) -> tuple[Law, dict[str, float]]:
    """The law with the terms that mu and zeta stand for, where it lacks them, and the parameters that they are."""
    mu, zeta = None if mu is None else MU.checked(mu), None if zeta is None else ZETA.checked(zeta)
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
    stands_for: dict[str, float | None] = dict.fromkeys(("static_ratio_up", "static_ratio_down", "static_ratio"), mu)
    stands_for["contact_damping_ratio"] = zeta
    law = law_of(name)
    return law, {p.name: value for p in law.own if (value := stands_for.get(p.name)) is not None}


class OverspentError(FrictionlabError, RuntimeError):
    """The work that a search may do is used up; no fault of what was asked last."""


class Meter:
    """Work left to a search, in steps of integration: the same on every machine, so that it ends at the same place."""

    def __init__(self, steps: float) -> None:
        self.left = steps

    @contextmanager
    def keeping(self, steps: float) -> Iterator[None]:
        """Within it, so many steps are out of reach: what comes after has them."""
        self.left -= steps
        try:
            yield
        finally:
            self.left += steps

    def take(self, steps: float) -> None:
        """Book so many steps; OverspentError where no work is left."""
        self.left -= steps
        if self.left < 0.0:
            raise OverspentError("the steps of integration allowed are used up")
