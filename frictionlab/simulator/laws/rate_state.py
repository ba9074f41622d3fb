"""Rate-and-state friction, ageing law, regularised, in series with the contact's stiffness.

A. Cabboi, T. Putelat and J. Woodhouse, The frequency response of dynamic friction: enhanced rate-and-state models, JMPS
(2016). Thesis section 4.3.1 asks whether aramid and rubber follow it.
"""

from math import exp, inf

from frictionlab.simulator.laws.exact import STIFFNESS, YIELDING
from frictionlab.simulator.laws.law import Parameter, Term


def _positive(
    name: str,
    symbol: str,
    words: str,
    usual: tuple[float, float],
    *,
    may_be_zero: bool = False,
    lengths: int = 0,
    rates: int = 0,
) -> Parameter:
    open_low = not may_be_zero
    return Parameter(
        name, symbol, words, 0.0, inf, usual=usual, scale="log", open_low=open_low, lengths=lengths, rates=rates
    )


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
        _positive(
            "slip_distance", "D_c", "way over which the contact renews itself, over Y", (0.0005, 0.05), lengths=1
        ),
        _positive(
            "reference_speed",
            "V_0",
            "speed at which the steady friction is beta, over omega Y",
            (0.001, 1.0),
            lengths=1,
            rates=1,
        ),
        STIFFNESS,
    ),
    kind="inner",
    excludes=YIELDING - {"rate-state"} | {"breakaway", "stribeck", "logarithm"},
)


def rate_state_slip(direct: float, speed: float, share: float, psi: float) -> tuple[float, float, float]:
    """Speed of the contact v_c, and its slopes over share = n over the friction force, and over psi = Psi / beta.

    ``v_c = 2 V0 sinh(share / a) exp(-psi / a)``, with the exponents summed before they are raised.
    """
    forth, back = exp(min((share - psi) / direct, 600.0)), exp(min((-share - psi) / direct, 600.0))
    slip = speed * (forth - back)
    return slip, speed * (forth + back) / direct, -slip / direct


def rate_state_age(evolution: float, distance: float, speed: float, psi: float) -> tuple[float, float]:
    """Healing ``b V0 / D_c exp((1 - psi) / b)`` of psi = Psi / beta, and its slope; wear is -b |v_c| / D_c."""
    if evolution == 0.0:
        return 0.0, 0.0
    heal = speed / distance * exp(min((1.0 - psi) / evolution, 600.0))
    return evolution * heal, -heal


def critical_stiffness(direct: float, evolution: float, beta: float, distance: float) -> float:
    """Contact stiffness over k below which sliding is unstable, (b - a) beta / D_c; 0 where friction does not fall.

    A contact without mass then slips faster and faster without bound, in a finite time: A. Ruina, J. Geophys. Res. 88
    (1983); for the ageing law K. Ranjith and J. R. Rice, JMPS 47 (1999).

    Parameters
    ----------
    direct, evolution : float
        a and b, over beta.
    beta : float
        Friction ratio.
    distance : float
        D_c over Y.

    Examples
    --------
    >>> round(critical_stiffness(0.05, 0.2, 0.4, 1e-3), 9)
    60.0
    """
    return max(0.0, evolution - direct) * beta / distance
