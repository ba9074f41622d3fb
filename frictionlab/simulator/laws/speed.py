"""Friction that grows in proportion to the speed: a dashpot beside the contact."""

from math import inf

from frictionlab.simulator.laws.law import Parameter, Term

SPEED = Term(
    name="speed",
    words="contact dashpot",
    equation="n = s beta + 2 zeta_c r v, v = dz/dtau; the dashpot stands between mass and wall",
    parameters=(
        Parameter(
            name="contact_damping_ratio",
            symbol="ζ_c",
            words="damping ratio of a dashpot between mass and wall",
            low=0.0,
            high=inf,
            usual=(0.0, 0.1),
            neutral=0.0,
        ),
    ),
)
