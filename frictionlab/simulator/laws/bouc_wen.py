"""Dahl's contact with a corner as sharp as one likes (Bouc and Wen, with A = 1 and gamma = 0)."""

from math import inf

from frictionlab.simulator.laws.law import Parameter, Term
from frictionlab.simulator.laws.stiffness import STIFFNESS, YIELDING

BOUC_WEN = Term(
    name="bouc-wen",
    words="Bouc-Wen friction",
    equation="n' = kappa (v - |v| |n / beta|^(m - 1) n / beta); m = 1 is Dahl's, m to infinity is Jenkins's",
    parameters=(
        STIFFNESS,
        Parameter(
            name="exponent",
            symbol="m",
            words="sharpness of the corner between yielding and slip",
            low=1.0,
            high=inf,
            usual=(1.0, 5.0),
        ),
    ),
    kind="inner",
    excludes=YIELDING - {"bouc-wen"} | {"breakaway", "stribeck", "logarithm"},
)
