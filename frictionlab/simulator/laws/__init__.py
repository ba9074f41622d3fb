"""The contact laws; a law is a sum of terms that starts with Coulomb friction.

    law_of("coulomb+place+speed") -> Law, its parameters with symbol, words, domain and usual range

A new law that is integrated is a file with its formula and what is said of it, and a line in TERMS. Those whose phases
are exact stand here; their forces stand in the exact flow.

Friction that varies along the path: R. J. Anderson and A. A. Ferri, Behavior of a single-degree-of-freedom system with
a generalized friction law (1990). Sliders side by side: W. D. Iwan; D. J. Segalman's distribution.
"""

from difflib import get_close_matches
from math import inf

from frictionlab.arrays import FloatArray
from frictionlab.errors import ParameterError
from frictionlab.simulator.laws.bouc_wen import BOUC_WEN
from frictionlab.simulator.laws.dahl import DAHL
from frictionlab.simulator.laws.law import STIFFNESS, STILL, Contact, Friction, Kind, Law, Parameter, Term
from frictionlab.simulator.laws.logarithm import LOGARITHM
from frictionlab.simulator.laws.lugre import LUGRE
from frictionlab.simulator.laws.rate_state import RATE_STATE
from frictionlab.simulator.laws.stribeck import STRIBECK

__all__ = ["TERMS", "Friction", "Kind", "Law", "Parameter", "Term", "excluded_by", "formula_of", "law_of", "tried_of"]


def coulomb(_own: FloatArray, side: float, friction: float, _z: float, _v: float, _w: float, _age: float) -> Contact:
    """Plain friction, where the integrated flow is asked for it."""
    return (side * friction, side, 0.0, 0.0, 0.0, side, *STILL)


COULOMB = Term(
    "coulomb",
    "Coulomb friction",
    "n = s beta in sliding, |n| <= beta in a stop; s = sgn v (thesis eqs 2.3, 2.9)",
    (
        Parameter(
            "beta",
            "β",
            "friction ratio, friction force over k Y",
            usual=(0.02, 1.5),
            scale="log",
            neutral=0.0,
            lengths=1,
            physical="friction_coefficient",
        ),
    ),
    contact=coulomb,
)

PLACE = Term(
    "place",
    "friction varying along the path",
    "n = s beta (1 + q z), |n| <= beta (1 + q z) in a stop; z relative to the wall, 0 where the spring is relaxed",
    (
        Parameter(
            "gradient",
            "q",
            "relative change of the friction force over a way of Y",
            low=-inf,
            usual=(-0.1, 0.1),
            neutral=0.0,
            lengths=-1,
            expected=0.03,
            reseated=1.0,
            shown=(0.1, "%/mm", "change of friction along the path"),
            determined_by="a larger amplitude of the base, or several loads in one campaign",
        ),
    ),
    weakens=lambda p: p["gradient"] != 0.0,
    is_even=lambda p: p["gradient"] == 0.0,
)

SPEED = Term(
    "speed",
    "contact dashpot",
    "n = s beta + 2 zeta_c r v, v = dz/dtau; the dashpot stands between mass and wall",
    (
        Parameter(
            "contact_damping_ratio",
            "ζ_c",
            "damping ratio of a dashpot between mass and wall",
            usual=(0.0, 0.1),
            neutral=0.0,
            first=0.02,
            expected=0.03,
            physical="contact_damping_n_s_per_m",
            shown=(1.0, "N s/m", "dashpot in the contact"),
            determined_by="rig.damping_ratio and sensors.lag_s measured, or a test nearer to resonance",
        ),
    ),
)

BREAKAWAY = Term(
    "breakaway",
    "break-away force",
    "-mu_down beta <= n <= mu_up beta in a stop (thesis eq. 2.4 with one mu for both directions)",
    tuple(
        Parameter(
            f"static_ratio_{way}",
            f"μ_{way}",
            f"static over kinetic friction force, for a start towards {'more' if way == 'up' else 'less'} displacement",
            low=1.0,
            usual=(1.0, 1.5),
            neutral=1.0,
            expected=1.1,
            determined_by="a slower test, in which the mass stops for longer",
        )
        for way in ("up", "down")
    ),
    weakens=lambda p: (p["static_ratio_up"] > 1.0) | (p["static_ratio_down"] > 1.0),
    is_even=lambda p: p["static_ratio_up"] == p["static_ratio_down"],
)

COMPLIANCE = Term(
    "compliance",
    "elastic contact (Jenkins)",
    "n' = kappa v while |n| < beta, n = s beta in slip",
    (STIFFNESS,),
    kind="elastic",
)

IWAN = Term(
    "iwan",
    "sliders in parallel (Iwan)",
    "n = sum n_i, each a Jenkins slider; their slip lengths phi are distributed as phi^chi up to phi_max"
    " (Segalman's four-parameter model without its final jump)",
    (
        STIFFNESS,
        Parameter(
            "sliders", "N", "number of sliders", low=1.0, high=200.0, usual=(10.0, 100.0), default=20.0, whole=True
        ),
        Parameter(
            "chi",
            "χ",
            "exponent of the distribution of slip lengths; 0 is an even distribution",
            low=-1.0,
            high=0.0,
            open_low=True,
            usual=(-0.9, 0.0),
            default=0.0,
        ),
    ),
    kind="elastic",
    effort=0,
)

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
