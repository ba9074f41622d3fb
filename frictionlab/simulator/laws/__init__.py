"""The contact laws; a law is a sum of terms that starts with Coulomb friction.

    law_of("coulomb+place+speed") -> Law, its parameters with symbol, words, domain and usual range

A new term is a line in TERMS: with its formula in a file of its own if it is integrated, else in `exact.py`.
"""

from frictionlab.errors import ParameterError
from frictionlab.simulator.laws.bouc_wen import BOUC_WEN
from frictionlab.simulator.laws.dahl import DAHL
from frictionlab.simulator.laws.exact import (
    BREAKAWAY,
    COMPLIANCE,
    COULOMB,
    FRAME_DAMPING,
    IWAN,
    PLACE,
    SPEED,
)
from frictionlab.simulator.laws.law import Kind, Law, Parameter, Scale, Term
from frictionlab.simulator.laws.logarithm import LOGARITHM
from frictionlab.simulator.laws.lugre import LUGRE
from frictionlab.simulator.laws.rate_state import RATE_STATE
from frictionlab.simulator.laws.stribeck import STRIBECK

__all__ = ["TERMS", "Kind", "Law", "Parameter", "Scale", "Term", "law_of"]

TERMS = {
    term.name: term
    for term in (
        *(COULOMB, PLACE, SPEED, BREAKAWAY, COMPLIANCE, IWAN),
        *(STRIBECK, LOGARITHM, DAHL, BOUC_WEN, LUGRE, RATE_STATE),
    )
}


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
            raise ParameterError(f"law {name!r}: {part!r} is no term; expected coulomb or a sum of {', '.join(TERMS)}")
    if names[0] != "coulomb" or len(set(names)) < len(names):
        raise ParameterError(f"law {name!r}: expected a sum that starts with coulomb and has each term once")
    terms = tuple(TERMS[part] for part in names)
    for term in terms:
        for other in sorted(term.excludes.intersection(names)):
            raise ParameterError(f"law {name!r}: {term.name} and {other} exclude each other: leave one out")
    return Law(terms, (FRAME_DAMPING,))
