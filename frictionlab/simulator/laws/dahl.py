"""A contact that yields and slips without a corner between the two (Dahl)."""

from frictionlab.simulator.laws.law import Term
from frictionlab.simulator.laws.stiffness import STIFFNESS, YIELDING

DAHL = Term(
    name="dahl",
    words="Dahl friction",
    equation="n' = kappa (v - |v| n / beta)",
    parameters=(STIFFNESS,),
    kind="inner",
    excludes=YIELDING - {"dahl"} | {"breakaway", "stribeck", "logarithm"},
)
