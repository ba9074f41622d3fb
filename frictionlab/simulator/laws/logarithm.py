"""Friction that changes with the logarithm of the speed, in either direction (steady rate-and-state friction)."""

from math import inf, log1p

from frictionlab.arrays import FloatArray
from frictionlab.simulator.laws.law import STILL, Contact, Parameter, Term, slip_speed


def logarithm(own: FloatArray, side: float, friction: float, _z: float, v: float, _w: float, _age: float) -> Contact:
    """Friction by speed; against the direction of the slide (a trial step) it goes on straight."""
    strength, speed, u = own[0], own[1], side * v
    factor, slope = 1.0 + strength * u / speed, strength / speed
    if u > 0.0:
        factor, slope = 1.0 + strength * log1p(u / speed), strength / (speed + u)
    return (side * friction * factor, side * factor, 0.0, friction * slope, 0.0, side, *STILL)


LOGARITHM = Term(
    name="logarithm",
    words="friction by the logarithm of speed",
    equation="n = s beta (1 + a ln(1 + |v| / V)), |n| <= beta in a stop",
    parameters=(
        Parameter(
            "rate_strength",
            "a",
            "relative change of friction for a speed e times as large",
            low=-inf,
            usual=(-0.1, 0.1),
            neutral=0.0,
        ),
        slip_speed(
            *("rate_speed", "V", "speed from which friction changes, over omega Y"),
            usual=(0.001, 1.0),
            shown=(1e3, "mm/s", "speed from which friction changes"),
        ),
    ),
    kind="smooth",
    contact=logarithm,
    narrow=lambda p: p["rate_speed"] if p["rate_strength"] else 0.0,
    weakens=lambda p: p["rate_strength"] < 0.0,
)
