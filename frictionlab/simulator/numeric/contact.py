"""The right-hand side: the contact's force with its slopes, by the law's code, and the mass's rate of change.

    z' = v,   r^2 v' = F - z - 2 zeta_f r v - n(z, v, w, p),   w', p' as the law says

The formulas of a law stand in its own file (`frictionlab.simulator.laws`); here they are put together with place and
dashpots. `side` is the sign of v, or of n in rate-and-state friction, and stays what it is within a phase.
"""

from math import cos, sin

from frictionlab.simulator.laws.bouc_wen import bouc_wen_flow
from frictionlab.simulator.laws.dahl import dahl_flow
from frictionlab.simulator.laws.logarithm import logarithm_factor
from frictionlab.simulator.laws.lugre import lugre_curve, lugre_flow
from frictionlab.simulator.laws.rate_state import rate_state_age, rate_state_slip
from frictionlab.simulator.laws.stribeck import stribeck_factor
from frictionlab.simulator.numeric.layout import (
    DAHL,
    LOGARITHM,
    LUGRE,
    RATE_STATE,
    STRIBECK,
    WIDTH,
    Buffer,
    Rig,
)

__all__ = ["acceleration", "age", "contact", "factor", "inner", "rates", "series", "slip_speed"]

Inner = tuple[float, float, float, float, float, float, float, float, float, float]


def series(cosine: Buffer, sine: Buffer, t: float) -> tuple[float, float]:
    """Value and rate at t of a Fourier series; without sine parts, of the polynomial with these coefficients."""
    value, rate = 0.0, 0.0
    if len(sine) == 0:
        for i in range(len(cosine)):
            rate = rate * t + value
            value = value * t + cosine[len(cosine) - 1 - i]
        return value, rate
    for i in range(len(cosine)):
        k = i + 1.0
        c, s = cos(k * t), sin(k * t)
        value += cosine[i] * c + sine[i] * s
        rate += k * (sine[i] * c - cosine[i] * s)
    return value, rate


def factor(rig: Rig, u: float) -> tuple[float, float]:
    """Friction over beta (1 + gradient z) at speed u along the slide, and its slope: laws without an inner state."""
    code = rig[0]
    if code == STRIBECK:
        return stribeck_factor(rig[6], rig[7], rig[8], u)
    if code == LOGARITHM:
        return logarithm_factor(rig[6], rig[7], u)
    return 1.0, 0.0


def inner(rig: Rig, side: float, z: float, v: float, w: float) -> Inner:
    """Force n and rate w' of a law with one inner state, each with its slopes over z, v and w, dashpot left out."""
    code, slope = rig[0], rig[2] * rig[3]
    friction = rig[2] + slope * z
    if code == LUGRE:
        curve, bend = lugre_curve(rig[8], rig[9], v)
        f, f_b, f_v, f_w = lugre_flow(rig[6], curve, bend, side, friction, v, w)
        f_z = f_b * slope
        return rig[6] * w + rig[7] * f, rig[7] * f_z, rig[7] * f_v, rig[6] + rig[7] * f_w, 0.0, f, f_z, f_v, f_w, 0.0
    if code == DAHL:
        f, f_b, f_v, f_w = dahl_flow(rig[6], side, friction, v, w)
    else:
        f, f_b, f_v, f_w = bouc_wen_flow(rig[6], rig[7], side, friction, v, w)
    return w, 0.0, 0.0, 1.0, 0.0, f, f_b * slope, f_v, f_w, 0.0


def contact(rig: Rig, side: float, z: float, v: float, w: float) -> tuple[float, float, float, float]:
    """Force of the contact on the mass with its slopes over z, v and w, its dashpot included."""
    dashpot = 2.0 * rig[4] * rig[1]
    if rig[0] == RATE_STATE:
        return w + dashpot * v, 0.0, dashpot, 1.0
    if rig[0] >= DAHL:
        n, n_z, n_v, n_w = inner(rig, side, z, v, w)[:4]
        return n + dashpot * v, n_z, n_v + dashpot, n_w
    height, rise = factor(rig, side * v)
    friction = rig[2] * (1.0 + rig[3] * z)
    return side * friction * height + dashpot * v, side * rig[2] * rig[3] * height, friction * rise + dashpot, 0.0


def slip_speed(rig: Rig, side: float, z: float, v: float, w: float, p: float) -> float:
    """Speed at which the contact slips: what is left of v when its springs have taken their share."""
    if rig[0] == RATE_STATE:
        return rate_state_slip(rig[6], rig[9], w / (rig[2] * (1.0 + rig[3] * z)), p)[0]
    if rig[0] == LUGRE:
        return v - inner(rig, side, z, v, w)[5]
    if rig[0] >= DAHL:
        return v - inner(rig, side, z, v, w)[5] / rig[6]
    return v


def acceleration(rig: Rig, side: float, pull: float, z: float, v: float, w: float) -> float:
    """Acceleration of the mass under the force `pull`."""
    n = contact(rig, side, z, v, w)[0]
    return (pull - z - 2.0 * rig[5] * rig[1] * v - n) / (rig[1] * rig[1])


def age(rig: Rig, side: float, at: tuple[float, float, float, float], out: tuple[Buffer, Buffer, int]) -> None:
    """Write the rates of n and psi of rate-and-state friction in series with a spring, and their slopes."""
    z, v, w, p = at
    rate, slopes, stage = out
    i, j = stage * WIDTH, stage * WIDTH * WIDTH
    share, wear = w / (rig[2] * (1.0 + rig[3] * z)), side * rig[7] / rig[8]
    slip, by_share, by_psi = rate_state_slip(rig[6], rig[9], share, p)
    heal, by_age = rate_state_age(rig[7], rig[8], rig[9], p)
    share_z, share_w = -share * rig[3] / (1.0 + rig[3] * z), 1.0 / (rig[2] * (1.0 + rig[3] * z))
    rate[i + 2], rate[i + 3] = rig[10] * (v - slip), heal - wear * slip
    slopes[j + 8], slopes[j + 9] = -rig[10] * by_share * share_z, rig[10]
    slopes[j + 10], slopes[j + 11] = -rig[10] * by_share * share_w, -rig[10] * by_psi
    slopes[j + 12], slopes[j + 13] = -wear * by_share * share_z, 0.0
    slopes[j + 14], slopes[j + 15] = -wear * by_share * share_w, by_age - wear * by_psi


def rates(rig: Rig, side: float, pull: float, at: tuple[Buffer, int], out: tuple[Buffer, Buffer, int]) -> None:
    """Write the rates of the state at a node, and their slopes row by row."""
    values, first = at
    rate, slopes, stage = out
    z, v, w, p = values[first], values[first + 1], values[first + 2], values[first + 3]
    n, n_z, n_v, n_w = contact(rig, side, z, v, w)
    mass, lead = 1.0 / (rig[1] * rig[1]), 2.0 * rig[5] * rig[1]
    i, j = stage * WIDTH, stage * WIDTH * WIDTH
    rate[i], rate[i + 1] = v, (pull - z - lead * v - n) * mass
    slopes[j], slopes[j + 1], slopes[j + 2], slopes[j + 3] = 0.0, 1.0, 0.0, 0.0
    slopes[j + 4], slopes[j + 5], slopes[j + 6], slopes[j + 7] = (
        (-1.0 - n_z) * mass,
        -(lead + n_v) * mass,
        -n_w * mass,
        0.0,
    )
    if rig[0] == RATE_STATE:
        age(rig, side, (z, v, w, p), out)
    elif rig[0] >= DAHL:
        rate[i + 2], slopes[j + 8], slopes[j + 9], slopes[j + 10], slopes[j + 11] = inner(rig, side, z, v, w)[5:]
