"""Friction that varies along the path: a plate that is not level, and the normal force with it.

R. J. Anderson and A. A. Ferri, Behavior of a single-degree-of-freedom system with a generalized friction law (1990).
"""

from math import inf

from frictionlab.simulator.laws.law import Parameter, Term

PLACE = Term(
    name="place",
    words="friction varying along the path",
    equation=(
        "n = s beta (1 + q z), |n| <= beta (1 + q z) in a stop; z relative to the wall, 0 where the spring is relaxed"
    ),
    parameters=(
        Parameter(
            name="gradient",
            symbol="q",
            words="relative change of the friction force over a way of Y",
            low=-inf,
            high=inf,
            usual=(-0.1, 0.1),
            neutral=0.0,
            lengths=-1,
        ),
    ),
)
