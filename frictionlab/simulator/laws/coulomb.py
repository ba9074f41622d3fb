"""Dry friction that knows only its direction (Coulomb; thesis eqs 2.3, 2.8)."""

from math import inf

from frictionlab.simulator.laws.law import Parameter, Term

COULOMB = Term(
    name="coulomb",
    words="Coulomb friction",
    equation="n = s beta in sliding, |n| <= beta in a stop; s = sgn v (thesis eqs 2.3, 2.9)",
    parameters=(
        Parameter(
            name="beta",
            symbol="β",
            words="friction ratio, friction force over k Y",
            low=0.0,
            high=inf,
            usual=(0.02, 1.5),
            scale="log",
            neutral=0.0,
            lengths=1,
        ),
    ),
)
