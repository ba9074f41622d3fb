"""Friction that falls with speed from its static to its kinetic value (Stribeck)."""

from math import exp, inf, log

from frictionlab.simulator.laws.law import Parameter, Term

STATIC_RATIO = Parameter(
    name="static_ratio",
    symbol="μ",
    words="static over kinetic friction force",
    low=1.0,
    high=inf,
    usual=(1.0, 2.0),
    neutral=1.0,
)
STRIBECK_SPEED = Parameter(
    name="stribeck_speed",
    symbol="ν_s",
    words="speed at which the static part has fallen to 1/e, over omega Y",
    low=0.0,
    high=inf,
    open_low=True,
    usual=(0.01, 1.0),
    scale="log",
    lengths=1,
    rates=1,
)

STRIBECK = Term(
    name="stribeck",
    words="Stribeck friction",
    equation="n = s beta [1 + (mu - 1) exp(-(|v| / nu_s)^d)], |n| <= mu beta in a stop",
    parameters=(
        STATIC_RATIO,
        STRIBECK_SPEED,
        Parameter(
            name="stribeck_exponent",
            symbol="d",
            words="exponent of the Stribeck curve, 1 or 2 in most texts",
            low=0.0,
            high=inf,
            open_low=True,
            usual=(1.0, 2.0),
            default=2.0,
        ),
    ),
    kind="smooth",
    excludes=frozenset({"breakaway", "logarithm", "compliance", "iwan", "dahl", "bouc-wen", "lugre", "rate-state"}),
)


def stribeck_factor(static_ratio: float, speed: float, exponent: float, u: float) -> tuple[float, float]:
    """Friction at speed u along the slide over beta, and its slope; u < 0 (a trial step) goes on straight."""
    if u <= 0.0:
        return static_ratio, -(static_ratio - 1.0) / speed if exponent == 1.0 else 0.0
    ratio = exp(min(exponent * log(u / speed), 6.6))
    part = (static_ratio - 1.0) * exp(-ratio)
    return 1.0 + part, -part * exponent * ratio / u
