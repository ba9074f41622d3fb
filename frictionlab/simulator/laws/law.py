"""What a contact law is made of: parameters, terms, and their sum; validated by name, then frozen."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass
from math import inf, isfinite
from typing import Any, Literal

from frictionlab.arrays import FloatArray
from frictionlab.errors import ParameterError

Kind = Literal["rigid", "elastic", "smooth", "inner"]
Scale = Literal["linear", "log"]
Values = Mapping[str, float]

Contact = tuple[float, ...]
"""What a contact does, 16 numbers: its force n, and the slopes of that over friction force, z, v and w; the speed at
which it slips; the rate of w, and its slopes over friction force, v, w and age; the same of the age."""
ContactForce = Callable[[FloatArray, float, float, float, float, float, float], Contact]
"""A law's formula: its own parameters in order, side, friction force ``beta (1 + q z)``, z, v, w and age to `Contact`.
side is the sign of v, or of n where the contact has an age. It is compiled: it uses numbers and `math` only."""
NO_AGE = (0.0,) * 5
STILL = (0.0,) * 10  # of a contact without a state of its own


@dataclass(frozen=True)
class Parameter:
    """One number of a contact law: dimensionless (displacement over Y, force over k Y, speed over omega Y).

    Parameters
    ----------
    name, symbol, words : str
        The key on the command line, in scenes and in JSON; as it stands in figures and equations; what it is.
    low, high : float
        Its domain, ends included unless `open_low`: by default all that is not negative. The value must be finite.
    usual : (float, float)
        Where it lies in 95 of 100 contacts, before anything is measured: the interval of its prior, normal on `scale`.
    scale : {"linear", "log"}
    open_low : bool
        Whether `low` itself is outside the domain.
    default : float or None
        Taken where nothing is given; None: it must be given.
    neutral : float or None
        Value at which its term does nothing (a gradient of 0, a stiffness of infinity): there the law meets the simpler
        one. None: there is no such value.
    whole : bool
        Whether it must be a whole number.
    lengths, rates : int
        Powers of Y and of omega in its unit: 1 and 1 for a speed, -1 and 0 for a change over a way of Y, 0 and -1 for a
        damping over k / omega.
    first, expected : float or None
        Value at which a fit tries it first; the one that a plan expects where nobody says it (else amid `usual`).
    reseated : float
        Scale of its scatter in standard deviations of the prior, where re-seating the contact changes it: it is then
        another in each test. 0: a material has one value of it.
    physical : str
        Its name in newtons, metres and seconds where that is not its own with the unit.
    shown : (float, str, str), optional
        As people read it: times its size in newtons, metres and seconds; the unit; words.
    determined_by : str
        What to measure where a test does not determine it.
    """

    name: str
    symbol: str
    words: str
    _: KW_ONLY
    low: float = 0.0
    high: float = inf
    usual: tuple[float, float]
    scale: Scale = "linear"
    open_low: bool = False
    default: float | None = None
    neutral: float | None = None
    whole: bool = False
    lengths: int = 0
    rates: int = 0
    first: float | None = None
    expected: float | None = None
    reseated: float = 0.0
    physical: str = ""
    shown: tuple[float, str, str] | None = None
    determined_by: str = "tests at another amplitude and another speed; frictionlab plan says which"

    @property
    def domain(self) -> str:
        """The domain in words.

        Examples
        --------
        >>> Parameter("beta", "beta", "friction ratio", usual=(0.05, 1.0)).domain
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
        except (TypeError, ValueError, OverflowError):
            number = inf
        inside = self.low < number <= self.high if self.open_low else self.low <= number <= self.high
        if not (inside and isfinite(number)) or (self.whole and number != round(number)):
            raise ParameterError(f"simulation: {self.name}; expected {self.domain}; got {value!r}")
        return number


positive = functools.partial(Parameter, open_low=True, scale="log")
"""A parameter above zero, of which the order of magnitude is known."""
slip_speed = functools.partial(positive, lengths=1, rates=1)
"""One that is a speed, over omega Y."""
STIFFNESS = positive(
    "stiffness_ratio",
    "κ",
    "tangential contact stiffness over the frame's stiffness k",
    usual=(10.0, 1000.0),
    neutral=inf,
    first=100.0,
    physical="contact_stiffness_n_per_m",
    shown=(1e-3, "N/mm", "stiffness of the contact"),
    determined_by="a smaller amplitude of the base, in which the contact bends more than it slides",
)


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
        is integrated. A law has one term at most that is more than rigid.
    excludes : frozenset of str
        Rigid terms that say the same thing otherwise.
    contact : callable, optional
        The formula of a law that is integrated (`ContactForce`).
    states : int
        States of an "inner" contact: 1, its force or bend w; 2, its force w, and its age.
    narrow : callable
        The speed within which friction changes; 0 where it does not.
    weakens : callable
        Whether friction may fall, with speed or along the path: then motions may coexist; also of arrays of values.
    is_even : callable
        Whether friction is the same both ways and at all places; also of arrays of values.
    gives : callable
        Whether the contact may give energy back; r is among the values that it is given.
    breaks : callable
        Why such a contact cannot be integrated, as a sentence; empty where it can.
    effort : int
        What a ladder of laws spends on it: 0, nothing (it is not tried); 1; 2: up to a second a steady state.
    """

    name: str
    words: str
    equation: str
    parameters: tuple[Parameter, ...]
    kind: Kind = "rigid"
    excludes: frozenset[str] = frozenset()
    contact: ContactForce | None = None
    states: int = 0
    narrow: Callable[[Values], float] = lambda _: 0.0
    weakens: Callable[[Any], Any] = lambda _: False
    is_even: Callable[[Any], Any] = lambda _: True
    gives: Callable[[Values], bool] = lambda _: False
    breaks: Callable[[Values], str] = lambda _: ""
    effort: int = 1


FRAME_DAMPING = Parameter(
    *("frame_damping_ratio", "ζ_f", "damping ratio of the frame itself, between mass and base"),
    usual=(0.0, 0.02),
    default=0.0,
    neutral=0.0,
)


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
    common: tuple[Parameter, ...] = (FRAME_DAMPING,)

    def __repr__(self) -> str:
        return f"<Law {self.name}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel between processes by name."""
        from frictionlab.simulator.laws import law_of  # noqa: PLC0415 - the registry stands above its parts

        return law_of, (self.name,)

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
        return self.kind in ("rigid", "elastic")

    @property
    def kind(self) -> Kind:
        """The kind of its term that is more than rigid, which says what solves it."""
        return next((term.kind for term in self.terms if term.kind != "rigid"), "rigid")

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
        found = next((parameter for parameter in self.parameters if parameter.name == name), None)
        if found is None:
            known = ", ".join(parameter.name for parameter in self.parameters)
            raise ParameterError(f"law {self.name}: {name!r} is none of its parameters; expected {known}")
        return found

    def complete(self, given: Values) -> tuple[float, ...]:
        """Return one number per parameter, in order: as given, else its default.

        Raises
        ------
        ParameterError
            A name that the law lacks, or a value that is missing or outside its domain.

        Examples
        --------
        >>> from frictionlab.simulator.laws import law_of
        >>> law_of("coulomb+place").complete({"beta": 0.4, "gradient": 0.02})
        (0.4, 0.02, 0.0)
        """
        for name in given:
            self.parameter(name)
        missing = [p for p in self.parameters if given.get(p.name, p.default) is None]
        if missing:
            asked = (
                f"{p.name} ({p.words}); expected {p.domain}, usually {p.usual[0]:g} to {p.usual[1]:g}" for p in missing
            )
            do = " ".join(f"--parameter {p.name}={p.usual[1]:g}" for p in missing)
            raise ParameterError(f"law {self.name}: {'; '.join(asked)}; got none; do: give them, for example {do}")
        return tuple(p.checked(given.get(p.name, p.default or 0.0)) for p in self.parameters)


class Friction:
    """A law and its numbers: what a contact does."""

    law: Law
    numbers: tuple[float, ...]

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
    def static_ratios(self) -> tuple[float, float]:
        """Static over kinetic friction force for a start up and for one down."""
        return self.parameter("static_ratio_up", 1.0), self.parameter("static_ratio_down", 1.0)

    @property
    def mu(self) -> float:
        """Static over kinetic friction force (2.4): the larger one of the two directions."""
        return max(self.static_ratios)

    @property
    def is_even(self) -> bool:
        """Whether friction is the same both ways and at all places."""
        return all(term.is_even(self.parameters) for term in self.law.terms)

    @property
    def weakens(self) -> bool:
        """Whether friction is larger at rest, falls with speed or varies along the path: then motions may coexist."""
        return self.beta > 0.0 and any(term.weakens(self.parameters) for term in self.law.terms)

    @property
    def zeta(self) -> float:
        """Damping ratio of the contact's dashpot."""
        return self.parameter("contact_damping_ratio")

    @property
    def frame_damping_ratio(self) -> float:
        """Damping ratio of the frame's own dashpot."""
        return self.numbers[-1]
