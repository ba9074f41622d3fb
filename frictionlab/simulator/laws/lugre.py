"""Bristles that bend and slip, with a Stribeck curve (LuGre; C. Canudas de Wit et al. 1995)."""

from math import exp

from frictionlab.arrays import FloatArray
from frictionlab.simulator.laws.law import NO_AGE, STIFFNESS, Contact, Parameter, Term
from frictionlab.simulator.laws.stribeck import STATIC_RATIO, STRIBECK_SPEED


def lugre(own: FloatArray, side: float, friction: float, _z: float, v: float, w: float, _age: float) -> Contact:
    """The bristles' bend w is the contact's state; the Stribeck curve goes through speed 0 without a corner."""
    stiffness, damping, static_ratio, speed = own[0], own[1], own[2], own[3]
    ratio = v / speed
    part = (static_ratio - 1.0) * exp(-ratio * ratio) if abs(ratio) < 26.0 else 0.0
    curve, bend = 1.0 + part, -2.0 * part * ratio / speed
    u, top = side * v, friction * curve
    share = stiffness * w / top
    slip = u * share
    rate, by_friction = v - slip, slip / friction
    by_v, by_w = 1.0 - side * share + slip * bend / curve, -stiffness * u / top
    n, n_w = stiffness * w + damping * rate, stiffness + damping * by_w
    force = n, damping * by_friction, 0.0, damping * by_v, n_w
    return (*force, slip, rate, by_friction, by_v, by_w, 0.0, *NO_AGE)


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
            *("bristle_damping", "σ_1", "damping of the bristles, over k / omega"),
            usual=(0.0, 1.0),
            neutral=0.0,
            first=0.2,
            rates=-1,
            physical="bristle_damping_n_s_per_m",
        ),
        STATIC_RATIO,
        STRIBECK_SPEED,
    ),
    kind="inner",
    excludes=frozenset({"breakaway"}),
    states=1,
    contact=lugre,
    narrow=lambda p: p["stribeck_speed"] if p["static_ratio"] > 1.0 else 0.0,
    weakens=lambda p: p["static_ratio"] > 1.0,
    gives=lambda p: (
        2.0 * p.get("contact_damping_ratio", 0.0) * p["r"] < p["bristle_damping"] * (p["static_ratio"] - 1.0)
    ),
    effort=2,
)
