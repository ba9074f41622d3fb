"""Bristles that bend and slip, with a Stribeck curve (LuGre; C. Canudas de Wit et al. 1995)."""

from math import exp, inf

from frictionlab.simulator.laws.exact import STIFFNESS, YIELDING
from frictionlab.simulator.laws.law import Parameter, Term
from frictionlab.simulator.laws.stribeck import STATIC_RATIO, STRIBECK_SPEED

LUGRE = Term(
    name="lugre",
    words="LuGre friction",
    equation=(
        "w' = v - sigma0 |v| w / g, g = beta [1 + (mu - 1) exp(-(v / nu_s)^2)], n = sigma0 w + sigma1 w'; sigma0 ="
        " kappa, the viscous part is the term speed; passive only if 2 zeta_c r > sigma1 (mu - 1)"
    ),
    parameters=(
        STIFFNESS,
        Parameter(
            name="bristle_damping",
            symbol="σ_1",
            words="damping of the bristles, over k / omega",
            low=0.0,
            high=inf,
            usual=(0.0, 1.0),
            neutral=0.0,
            rates=-1,
        ),
        STATIC_RATIO,
        STRIBECK_SPEED,
    ),
    kind="inner",
    excludes=YIELDING - {"lugre"} | {"breakaway", "stribeck", "logarithm"},
)


def lugre_curve(static_ratio: float, speed: float, v: float) -> tuple[float, float]:
    """The Stribeck curve g over beta at speed v, and its slope over v."""
    ratio = v / speed
    part = (static_ratio - 1.0) * exp(-ratio * ratio) if abs(ratio) < 26.0 else 0.0
    return 1.0 + part, -2.0 * part * ratio / speed


def lugre_flow(
    stiffness: float, curve: float, slope: float, side: float, friction: float, v: float, w: float
) -> tuple[float, float, float, float]:
    """Rate of the bristles' bend w, its slopes over the friction force, v and w; curve and slope by `lugre_curve`."""
    u, top = side * v, friction * curve
    share = stiffness * w / top
    return v - u * share, u * share / friction, 1.0 - side * share + u * share * slope / curve, -stiffness * u / top
