"""Rate-and-state friction, ageing law, regularised, in series with the contact's stiffness.

A. Cabboi, T. Putelat and J. Woodhouse, The frequency response of dynamic friction: enhanced rate-and-state models, JMPS
(2016). Thesis section 4.3.1 asks whether aramid and rubber follow it.
"""

from math import exp

from frictionlab.arrays import FloatArray
from frictionlab.simulator.laws.law import STIFFNESS, Contact, Parameter, Term, Values, positive, slip_speed


def rate_state(own: FloatArray, side: float, friction: float, _z: float, v: float, n: float, psi: float) -> Contact:
    """The contact's force n and its age psi = Psi / beta are its states; side is the sign of n.

    It slips at ``v_c = 2 V0 sinh(n / A) exp(-psi / a)``, with the exponents summed before they are raised.
    """
    direct, evolution, distance, speed, stiffness = own[0], own[1], own[2], own[3], own[4]
    share = n / friction
    forth, back = exp(min((share - psi) / direct, 600.0)), exp(min((-share - psi) / direct, 600.0))
    slip, steep = speed * (forth - back), speed * (forth + back) / direct
    by_friction, by_n, by_psi = -steep * share / friction, steep / friction, -slip / direct
    heal = speed / distance * exp(min((1.0 - psi) / evolution, 600.0)) if evolution > 0.0 else 0.0
    wear = side * evolution / distance
    rate = stiffness * (v - slip), -stiffness * by_friction, stiffness, -stiffness * by_n, -stiffness * by_psi
    age = evolution * heal - wear * slip, -wear * by_friction, 0.0, -wear * by_n, -heal - wear * by_psi
    return (n, 0.0, 0.0, 0.0, 1.0, slip, *rate, *age)


def _jumps(p: Values) -> str:
    """Why the contact runs away below ``kappa = (b - a) beta / D_c``, as A. Ruina (J. Geophys. Res. 88, 1983) has it.

    For the ageing law: K. Ranjith and J. R. Rice, JMPS 47 (1999).
    """
    stiffness = p["stiffness_ratio"]
    critical = (p["evolution_effect"] - p["direct_effect"]) * p["beta"] / p["slip_distance"]
    if stiffness >= critical:
        return ""
    return (
        "the contact slips in jumps; expected stiffness_ratio above (evolution_effect - direct_effect) beta / "
        f"slip_distance = {critical:.4g}; got {stiffness:.4g}: slip speeds up without bound in a finite time, for this "
        "contact has no mass of its own; do: a larger stiffness_ratio or slip_distance, a smaller evolution_effect, or "
        "jumps by static friction (coulomb+breakaway)"
    )


RATE_STATE = Term(
    name="rate-state",
    words="rate-and-state friction in series with the contact's stiffness",
    equation=(
        "n = A s asinh(|v_c| / (2 V0) exp(Psi / A)), Psi' = (B V0 / Dc) (exp((beta - Psi) / B) - |v_c| / V0), with"
        " A = a beta, B = b beta and v_c = v - n' / kappa the speed of the contact"
    ),
    parameters=(
        positive(
            "direct_effect",
            "a",
            "instant change of friction with the logarithm of speed, over beta",
            usual=(0.005, 0.1),
        ),
        Parameter(
            "evolution_effect",
            "b",
            "change of friction with the logarithm of age, over beta",
            usual=(0.005, 0.1),
            scale="log",
        ),
        positive(
            *("slip_distance", "D_c", "way over which the contact renews itself, over Y"),
            usual=(0.0005, 0.05),
            lengths=1,
            shown=(1e6, "um", "way in which the contact is renewed"),
        ),
        slip_speed(
            "reference_speed", "V_0", "speed at which the steady friction is beta, over omega Y", usual=(0.001, 1.0)
        ),
        STIFFNESS,
    ),
    kind="inner",
    excludes=frozenset({"breakaway"}),
    states=2,
    contact=rate_state,
    weakens=lambda p: p["evolution_effect"] > p["direct_effect"],
    breaks=_jumps,
    effort=2,
)
