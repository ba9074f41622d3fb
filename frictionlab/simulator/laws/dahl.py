"""A contact that yields and slips without a corner between the two (Dahl)."""

from frictionlab.arrays import FloatArray
from frictionlab.simulator.laws.law import NO_AGE, STIFFNESS, Contact, Term


def dahl(own: FloatArray, side: float, friction: float, _z: float, v: float, n: float, _age: float) -> Contact:
    """The contact's force n is its state."""
    stiffness, share, u = own[0], side * n / friction, side * v
    slip = v * share
    rate = stiffness * (v - slip), stiffness * slip / friction, stiffness * (1.0 - share), -stiffness * u / friction
    return (n, 0.0, 0.0, 0.0, 1.0, slip, rate[0], rate[1], rate[2], rate[3], 0.0, *NO_AGE)


DAHL = Term(
    name="dahl",
    words="Dahl friction",
    equation="n' = kappa (v - |v| n / beta)",
    parameters=(STIFFNESS,),
    kind="inner",
    excludes=frozenset({"breakaway"}),
    states=1,
    contact=dahl,
)
