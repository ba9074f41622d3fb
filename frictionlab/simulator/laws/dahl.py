"""A contact that yields and slips without a corner between the two (Dahl)."""

from frictionlab.simulator.laws.exact import STIFFNESS, YIELDING
from frictionlab.simulator.laws.law import Term

DAHL = Term(
    name="dahl",
    words="Dahl friction",
    equation="n' = kappa (v - |v| n / beta)",
    parameters=(STIFFNESS,),
    kind="inner",
    excludes=YIELDING - {"dahl"} | {"breakaway", "stribeck", "logarithm"},
)


def dahl_flow(stiffness: float, side: float, friction: float, v: float, n: float) -> tuple[float, float, float, float]:
    """Rate of the contact's force n, and its slopes over the friction force, v and n; side is the sign of v."""
    u = side * v
    return (
        stiffness * (v - u * n / friction),
        stiffness * u * n / (friction * friction),
        stiffness * (1.0 - side * n / friction),
        -stiffness * u / friction,
    )
