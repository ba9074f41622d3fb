"""Dahl's contact with a corner as sharp as one likes (Bouc and Wen, with A = 1 and gamma = 0)."""

from math import exp, log

from frictionlab.arrays import FloatArray
from frictionlab.simulator.laws.law import NO_AGE, STIFFNESS, Contact, Parameter, Term


def bouc_wen(own: FloatArray, side: float, friction: float, _z: float, v: float, n: float, _age: float) -> Contact:
    """The contact's force n is its state."""
    stiffness, exponent, share = own[0], own[1], n / friction
    size, power = abs(share), 1.0
    if exponent != 1.0:
        power = exp(min((exponent - 1.0) * log(size), 600.0)) if size > 0.0 else 0.0
    slip, steep = side * v * power * share, stiffness * side * v * exponent * power / friction
    rate = stiffness * (v - slip), steep * share, stiffness * (1.0 - side * power * share), -steep
    return (n, 0.0, 0.0, 0.0, 1.0, slip, rate[0], rate[1], rate[2], rate[3], 0.0, *NO_AGE)


BOUC_WEN = Term(
    name="bouc-wen",
    words="Bouc-Wen friction",
    equation="n' = kappa (v - |v| |n / beta|^(m - 1) n / beta); m = 1 is Dahl's, m to infinity is Jenkins's",
    parameters=(
        STIFFNESS,
        Parameter("exponent", "m", "sharpness of the corner between yielding and slip", low=1.0, usual=(1.0, 5.0)),
    ),
    kind="inner",
    excludes=frozenset({"breakaway"}),
    states=1,
    contact=bouc_wen,
)
