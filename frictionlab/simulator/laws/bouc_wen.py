"""Dahl's contact with a corner as sharp as one likes (Bouc and Wen, with A = 1 and gamma = 0)."""

from math import exp, inf, log

from frictionlab.simulator.laws.exact import STIFFNESS, YIELDING
from frictionlab.simulator.laws.law import Parameter, Term

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


def bouc_wen_flow(
    stiffness: float, exponent: float, side: float, friction: float, v: float, n: float
) -> tuple[float, float, float, float]:
    """Rate of the contact's force n, and its slopes over the friction force, v and n; side is the sign of v."""
    u, share = side * v, n / friction
    size = abs(share)
    power = 1.0
    if exponent != 1.0:
        power = exp(min((exponent - 1.0) * log(size), 600.0)) if size > 0.0 else 0.0
    return (
        stiffness * (v - u * power * share),
        stiffness * u * exponent * power * share / friction,
        stiffness * (1.0 - side * power * share),
        -stiffness * u * exponent * power / friction,
    )
