"""Friction that falls with speed from its static to its kinetic value (Stribeck)."""

from math import exp, log

from frictionlab.arrays import FloatArray
from frictionlab.simulator.laws.law import STILL, Contact, Parameter, Term, slip_speed

STATIC_RATIO = Parameter(
    "static_ratio", "μ", "static over kinetic friction force", low=1.0, usual=(1.0, 2.0), neutral=1.0, first=1.2
)
STRIBECK_SPEED = slip_speed(
    *("stribeck_speed", "ν_s", "speed at which the static part has fallen to 1/e, over omega Y"),
    usual=(0.01, 1.0),
    shown=(1e3, "mm/s", "speed at which friction has weakened"),
)


def stribeck(own: FloatArray, side: float, friction: float, _z: float, v: float, _w: float, _age: float) -> Contact:
    """Friction by speed; against the direction of the slide (a trial step) it goes on straight."""
    static_ratio, speed, exponent, u = own[0], own[1], own[2], side * v
    factor, slope = static_ratio, -(static_ratio - 1.0) / speed if exponent == 1.0 else 0.0
    if u > 0.0:
        ratio = exp(min(exponent * log(u / speed), 6.6))
        part = (static_ratio - 1.0) * exp(-ratio)
        factor, slope = 1.0 + part, -part * exponent * ratio / u
    return (side * friction * factor, side * factor, 0.0, friction * slope, 0.0, side, *STILL)


STRIBECK = Term(
    name="stribeck",
    words="Stribeck friction",
    equation="n = s beta [1 + (mu - 1) exp(-(|v| / nu_s)^d)], |n| <= mu beta in a stop",
    parameters=(
        STATIC_RATIO,
        STRIBECK_SPEED,
        Parameter(
            "stribeck_exponent",
            "d",
            "exponent of the Stribeck curve, 1 or 2 in most texts",
            low=0.5,  # Bo and Pavelescu, Wear 82 (1982) 277: 1/2 to 1
            high=10.0,  # beyond it friction falls at once, as in a break-away
            usual=(0.5, 3.0),
            scale="log",
            default=2.0,
        ),
    ),
    kind="smooth",
    excludes=frozenset({"breakaway"}),
    contact=stribeck,
    narrow=lambda p: p["stribeck_speed"] if p["static_ratio"] > 1.0 else 0.0,
    weakens=lambda p: p["static_ratio"] > 1.0,
)
