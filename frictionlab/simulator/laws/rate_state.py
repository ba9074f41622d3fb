"""Rate-and-state friction, ageing law, regularised, in series with the contact's stiffness.

A. Cabboi, T. Putelat and J. Woodhouse, The frequency response of dynamic friction: enhanced rate-and-state models, JMPS
(2016). Thesis section 4.3.1 asks whether aramid and rubber follow it.
"""

from math import inf

from frictionlab.simulator.laws.law import Parameter, Term
from frictionlab.simulator.laws.stiffness import STIFFNESS, YIELDING


def _positive(
    name: str, symbol: str, words: str, usual: tuple[float, float], *, may_be_zero: bool = False
) -> Parameter:
    return Parameter(name, symbol, words, 0.0, inf, usual=usual, scale="log", open_low=not may_be_zero)


RATE_STATE = Term(
    name="rate-state",
    words="rate-and-state friction in series with the contact's stiffness",
    equation=(
        "n = A s asinh(|v_c| / (2 V0) exp(Psi / A)), Psi' = (B V0 / Dc) (exp((beta - Psi) / B) - |v_c| / V0), with"
        " A = a beta, B = b beta and v_c = v - n' / kappa the speed of the contact"
    ),
    parameters=(
        _positive(
            "direct_effect", "a", "instant change of friction with the logarithm of speed, over beta", (0.005, 0.1)
        ),
        _positive(
            "evolution_effect",
            "b",
            "change of friction with the logarithm of age, over beta",
            (0.005, 0.1),
            may_be_zero=True,
        ),
        _positive("slip_distance", "D_c", "way over which the contact renews itself, over Y", (0.0005, 0.05)),
        _positive("reference_speed", "V_0", "speed at which the steady friction is beta, over omega Y", (0.001, 1.0)),
        STIFFNESS,
    ),
    kind="inner",
    excludes=YIELDING - {"rate-state"} | {"breakaway", "stribeck", "logarithm"},
)
