"""The contact laws; a law is a sum of terms that starts with Coulomb friction.

    law_of("coulomb+place+speed") -> Law, its parameters with symbol, words, domain and usual range

A new law that is integrated is a file with its formula and what is said of it, and a line in TERMS. `exact.py` holds
those whose phases have a closed form.
"""

from difflib import get_close_matches

from frictionlab.errors import ParameterError
from frictionlab.simulator.laws.bouc_wen import BOUC_WEN
from frictionlab.simulator.laws.dahl import DAHL
from frictionlab.simulator.laws.exact import BREAKAWAY, COMPLIANCE, COULOMB, IWAN, PLACE, SPEED
from frictionlab.simulator.laws.law import Friction, Kind, Law, Parameter, Term
from frictionlab.simulator.laws.logarithm import LOGARITHM
from frictionlab.simulator.laws.lugre import LUGRE
from frictionlab.simulator.laws.rate_state import RATE_STATE
from frictionlab.simulator.laws.stribeck import STRIBECK

__all__ = [
    "TERMS",
    "Friction",
    "Kind",
    "Law",
    "Parameter",
    "Scale",
    "Term",
    "excluded_by",
    "formula_of",
    "law_of",
    "tried_of",
]

TERMS = {
    term.name: term
    for term in (
        *(COULOMB, PLACE, SPEED, BREAKAWAY, COMPLIANCE, IWAN),
        *(STRIBECK, LOGARITHM, DAHL, BOUC_WEN, LUGRE, RATE_STATE),
    )
}


def excluded_by(term: Term) -> list[str]:
    """Return the terms that cannot stand in one law with a term: at most one is more than rigid, and as each says."""
    return sorted(
        other.name
        for other in TERMS.values()
        if other is not term
        and ("rigid" not in (term.kind, other.kind) or other.name in term.excludes or term.name in other.excludes)
    )


def tried_of(*kinds: Kind, effort: int = 1) -> tuple[str, ...]:
    """Return the terms beside Coulomb's that a ladder of laws tries, of some kinds and an effort."""
    return tuple(t.name for t in TERMS.values() if t.kind in kinds and t.effort == effort and t is not COULOMB)


def formula_of(contact: Friction) -> Term | None:
    """Return the term whose formula is the contact's; without friction every law is none. None: it is elastic."""
    kinds = ("smooth", "inner") if contact.beta > 0.0 else ()
    if contact.law.kind == "elastic":
        return None
    return next((term for term in contact.law.terms if term.kind in kinds), COULOMB)


def law_of(name: str | Law) -> Law:
    """Return the law of a name like ``coulomb+place+speed``.

    Raises
    ------
    ParameterError
        It does not start with ``coulomb``, names a term that does not exist or stands twice, or two terms that exclude
        each other.

    Examples
    --------
    >>> [parameter.name for parameter in law_of("coulomb+place").parameters]
    ['beta', 'gradient', 'frame_damping_ratio']
    """
    if isinstance(name, Law):
        return name
    if not isinstance(name, str):
        raise ParameterError(f"law {name!r}: expected a text like 'coulomb+place'")
    names = [part.strip() for part in name.split("+")]
    for part in names:
        if part not in TERMS:
            meant = "".join(f"; did you mean {near}?" for near in get_close_matches(part, TERMS, n=1))
            every = ", ".join(TERMS)
            raise ParameterError(f"law {name!r}: {part!r} is no term; expected coulomb or a sum of {every}{meant}")
    if names[0] != "coulomb" or len(set(names)) < len(names):
        raise ParameterError(f"law {name!r}: expected a sum that starts with coulomb and has each term once")
    terms = tuple(TERMS[part] for part in names)
    for term in terms:
        for other in excluded_by(term):
            if other in names:
                raise ParameterError(f"law {name!r}: {term.name} and {other} exclude each other: leave one out")
    return Law(terms)
