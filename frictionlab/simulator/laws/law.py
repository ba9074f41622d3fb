"""What a contact law is made of: parameters, terms, and their sum; validated by name, then frozen."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf, isfinite
from typing import Any, Literal

from frictionlab.errors import ParameterError

Kind = Literal["rigid", "elastic", "smooth", "inner"]
Scale = Literal["linear", "log"]
Check = Callable[[Mapping[str, float]], str | None]


@dataclass(frozen=True)
class Parameter:
    """One number of a contact law: dimensionless (displacement over Y, force over k Y, speed over omega Y).

    Parameters
    ----------
    name : str
        The key on the command line, in scenes and in JSON.
    symbol : str
        As it stands in figures and equations.
    words : str
        What it is.
    low, high : float
        Its domain, ends included unless `open_low`; `high` may be infinite, the value itself must be finite.
    open_low : bool
        Whether `low` itself is outside the domain.
    default : float or None
        Taken where nothing is given; None: it must be given.
    neutral : float or None
        Value at which its term does nothing (a gradient of 0, a stiffness of infinity): there the law meets the simpler
        one. None: there is no such value.
    usual : (float, float)
        Where it lies in 95 of 100 contacts, before anything is measured: the interval of its prior, normal on `scale`.
    scale : {"linear", "log"}
    whole : bool
        Whether it must be a whole number.
    lengths, rates : int
        Powers of Y and of omega in its unit: 1 and 1 for a speed, -1 and 0 for a change over a way of Y, 0 and -1 for a
        damping over k / omega.
    """

    name: str
    symbol: str
    words: str
    low: float
    high: float
    usual: tuple[float, float]
    scale: Scale = "linear"
    open_low: bool = False
    default: float | None = None
    neutral: float | None = None
    whole: bool = False
    lengths: int = 0
    rates: int = 0

    @property
    def domain(self) -> str:
        """The domain in words.

        Examples
        --------
        >>> Parameter("beta", "beta", "friction ratio", 0.0, inf, usual=(0.05, 1.0)).domain
        'a finite number >= 0'
        """
        kind = "a whole number" if self.whole else "a finite number"
        above = f"{'>' if self.open_low else '>='} {self.low:g}" if self.low > -inf else ""
        below = f"<= {self.high:g}" if self.high < inf else ""
        return " ".join([kind, *filter(None, (above, "and" if above and below else "", below))])

    def checked(self, value: float) -> float:
        """Return the value as a float.

        Raises
        ------
        ParameterError
            It lies outside the domain.
        """
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError) as error:
            raise ParameterError(f"simulation: {self.name}; expected {self.domain}; got {value!r}") from error
        inside = self.low < number <= self.high if self.open_low else self.low <= number <= self.high
        if not (inside and isfinite(number)) or (self.whole and number != round(number)):
            raise ParameterError(f"simulation: {self.name}; expected {self.domain}; got {value!r}")
        return number


@dataclass(frozen=True)
class Term:
    """One summand of a contact law.

    Parameters
    ----------
    name : str
        As in ``coulomb+place``.
    words : str
        What it adds, as it stands in a result's `model`.
    equation : str
        Its force, with its source.
    parameters : tuple of Parameter
    kind : {"rigid", "elastic", "smooth", "inner"}
        "rigid": slides stay exact and a stop stands still; "elastic": exact, but the contact yields in a stop;
        "smooth": slides are integrated, stops stand still; "inner": the contact has a state of its own, and everything
        is integrated.
    excludes : frozenset of str
        Terms that say the same thing otherwise: they cannot stand in one law.
    check : callable, optional
        Says what is wrong with the parameters together, or None.
    """

    name: str
    words: str
    equation: str
    parameters: tuple[Parameter, ...]
    kind: Kind = "rigid"
    excludes: frozenset[str] = frozenset()
    check: Check | None = None


@dataclass(frozen=True)
class Law:
    """A sum of terms that starts with Coulomb friction; what it does not name is neither simulated nor paid for.

    Parameters
    ----------
    terms : tuple of Term
    common : tuple of Parameter
        Parameters that go with every law (the frame's own dashpot).
    """

    terms: tuple[Term, ...]
    common: tuple[Parameter, ...] = ()

    def __repr__(self) -> str:
        return f"<Law {self.name}>"

    @property
    def name(self) -> str:
        """The sum as it is written: ``coulomb+place``."""
        return "+".join(term.name for term in self.terms)

    @property
    def words(self) -> str:
        """The sum in words."""
        return ", ".join(term.words for term in self.terms)

    @functools.cached_property
    def own(self) -> tuple[Parameter, ...]:
        """The parameters of its terms, in order: those that say what the contact does."""
        return tuple(parameter for term in self.terms for parameter in term.parameters)

    @functools.cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters: its terms' and those that go with every law."""
        return (*self.own, *self.common)

    @property
    def is_exact(self) -> bool:
        """Whether every phase of its motion has a closed form."""
        return all(term.kind in ("rigid", "elastic") for term in self.terms)

    @property
    def kind(self) -> Kind:
        """The kind of its hardest term, which says what solves it."""
        order: tuple[Kind, ...] = ("rigid", "elastic", "smooth", "inner")
        return max((term.kind for term in self.terms), key=order.index)

    def has(self, term: str) -> bool:
        """Whether a term stands in this law."""
        return any(each.name == term for each in self.terms)

    def parameter(self, name: str) -> Parameter:
        """Return a parameter by its name.

        Raises
        ------
        ParameterError
            The law has no such parameter.
        """
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise self._stranger(name)

    def complete(self, given: Mapping[str, float]) -> tuple[float, ...]:
        """Return one number per parameter, in order: as given, else its default.

        Raises
        ------
        ParameterError
            A name that the law lacks, a value that is missing or outside its domain, or values that contradict.

        Examples
        --------
        >>> from frictionlab.simulator.laws import law_of
        >>> law_of("coulomb+place").complete({"beta": 0.4, "gradient": 0.02})
        (0.4, 0.02, 0.0)
        """
        names = [parameter.name for parameter in self.parameters]
        for name in given:
            if name not in names:
                raise self._stranger(name)
        values = {parameter.name: self._value(parameter, given) for parameter in self.parameters}
        for term in self.terms:
            fault = term.check(values) if term.check else None
            if fault:
                raise ParameterError(f"law {self.name}: {fault}")
        return tuple(values.values())

    def _value(self, parameter: Parameter, given: Mapping[str, float]) -> float:
        value = given.get(parameter.name, parameter.default)
        if value is None:
            raise ParameterError(
                f"law {self.name}: {parameter.name} ({parameter.words}); expected {parameter.domain}; got none; "
                f"do: give it, for example --parameter {parameter.name}={parameter.usual[1]:g}"
            )
        return parameter.checked(value)

    def _stranger(self, name: str) -> ParameterError:
        known = ", ".join(parameter.name for parameter in self.parameters)
        return ParameterError(f"law {self.name}: {name!r} is none of its parameters; expected {known}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel between processes by name."""
        from frictionlab.simulator.laws import law_of  # noqa: PLC0415 - the registry stands above its parts

        return law_of, (self.name,)
