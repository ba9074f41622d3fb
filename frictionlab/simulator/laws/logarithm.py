"""Friction that changes with the logarithm of the speed, in either direction (steady rate-and-state friction)."""

from math import inf, log1p

from frictionlab.simulator.laws.law import Parameter, Term

LOGARITHM = Term(
    name="logarithm",
    words="friction by the logarithm of speed",
    equation="n = s beta (1 + a ln(1 + |v| / V)), |n| <= beta in a stop",
    parameters=(
        Parameter(
            name="rate_strength",
            symbol="a",
            words="relative change of friction for a speed e times as large",
            low=-inf,
            high=inf,
            usual=(-0.1, 0.1),
            neutral=0.0,
        ),
        Parameter(
            name="rate_speed",
            symbol="V",
            words="speed from which friction changes, over omega Y",
            low=0.0,
            high=inf,
            open_low=True,
            usual=(0.001, 1.0),
            scale="log",
            lengths=1,
            rates=1,
        ),
    ),
    kind="smooth",
    excludes=frozenset({"stribeck", "compliance", "iwan", "dahl", "bouc-wen", "lugre", "rate-state"}),
)


def logarithm_factor(strength: float, speed: float, u: float) -> tuple[float, float]:
    """Friction at speed u along the slide over that at rest, and its slope; u < 0 (a trial step) goes on straight."""
    if u <= 0.0:
        return 1.0 + strength * u / speed, strength / speed
    return 1.0 + strength * log1p(u / speed), strength / (speed + u)
