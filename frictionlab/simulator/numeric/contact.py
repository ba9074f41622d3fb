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
    Room,
)

Inner = tuple[float, float, float, float, float, float, float, float, float]


def drive(room: Room, t: float) -> tuple[float, float]:
    """Value and rate of the force F at t: of a Fourier series, or without sine parts of a polynomial."""
    cosine, sine = room.cosine, room.sine
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
    if rig.code == STRIBECK:
        static_ratio, speed, exponent, _, _ = rig.law
        return stribeck_factor(static_ratio, speed, exponent, u)
    if rig.code == LOGARITHM:
        strength, speed, _, _, _ = rig.law
        return logarithm_factor(strength, speed, u)
    return 1.0, 0.0


def inner(rig: Rig, side: float, z: float, v: float, w: float) -> Inner:
    """Force n with its slopes over z, v and w, and rate w' with its, of a law with one inner state; no dashpot.

    The rate is followed by its slopes over z, v, w and 0, that over the age.
    """
    slope = rig.beta * rig.gradient
    friction = rig.beta + slope * z
    if rig.code == LUGRE:
        stiffness, damping, static_ratio, speed, _ = rig.law
        curve, bend = lugre_curve(static_ratio, speed, v)
        f, f_b, f_v, f_w = lugre_flow(stiffness, curve, bend, side, friction, v, w)
        f_z = f_b * slope
        n, n_w = stiffness * w + damping * f, stiffness + damping * f_w
        return n, damping * f_z, damping * f_v, n_w, f, f_z, f_v, f_w, 0.0
    stiffness, exponent, _, _, _ = rig.law
    if rig.code == DAHL:
        f, f_b, f_v, f_w = dahl_flow(stiffness, side, friction, v, w)
    else:
        f, f_b, f_v, f_w = bouc_wen_flow(stiffness, exponent, side, friction, v, w)
    return w, 0.0, 0.0, 1.0, f, f_b * slope, f_v, f_w, 0.0


def contact(rig: Rig, side: float, z: float, v: float, w: float) -> tuple[float, float, float, float]:
    """Force of the contact on the mass with its slopes over z, v and w, its dashpot included."""
    dashpot = rig.dashpot
    if rig.code == RATE_STATE:
        return w + dashpot * v, 0.0, dashpot, 1.0
    if rig.code >= DAHL:
        n, n_z, n_v, n_w = inner(rig, side, z, v, w)[:4]
        return n + dashpot * v, n_z, n_v + dashpot, n_w
    height, rise = factor(rig, side * v)
    friction = rig.beta * (1.0 + rig.gradient * z)
    slope = side * rig.beta * rig.gradient * height
    return side * friction * height + dashpot * v, slope, friction * rise + dashpot, 0.0


def slip_speed(rig: Rig, side: float, z: float, v: float, w: float, p: float) -> float:
    """Speed at which a contact with an inner state slips: what is left of v when its springs have taken their share."""
    if rig.code == RATE_STATE:
        direct, _, _, speed, _ = rig.law
        return rate_state_slip(direct, speed, w / (rig.beta * (1.0 + rig.gradient * z)), p)[0]
    rate = inner(rig, side, z, v, w)[4]
    return v - rate if rig.code == LUGRE else v - rate / rig.law[0]


def contacts(rig: Rig, sides: Buffer, states: Buffer, force: Buffer, slip: Buffer) -> None:
    """Write the contact's force and its slip at each of many states; at rest (side 0) there is neither.

    Where the contact has no state of its own its slip is told by its direction alone.
    """
    for i in range(len(sides)):
        k, side = i * WIDTH, sides[i]
        if side != 0.0:
            z, v, w, p = states[k], states[k + 1], states[k + 2], states[k + 3]
            force[i] = contact(rig, side, z, v, w)[0]
            slip[i] = side if rig.code < DAHL else slip_speed(rig, side, z, v, w, p)


def acceleration(rig: Rig, side: float, pull: float, z: float) -> float:
    """Acceleration of a mass at rest under the force `pull`, about to slide."""
    return (pull - z - contact(rig, side, z, 0.0, 0.0)[0]) / (rig.r * rig.r)


def age(rig: Rig, room: Room, side: float, values: Buffer, first: int, stage: int) -> None:
    """Write the rates of n and psi of rate-and-state friction in series with a spring, and their slopes."""
    z, v, w, p = values[first], values[first + 1], values[first + 2], values[first + 3]
    direct, evolution, distance, speed, stiffness = rig.law
    rate, slopes, i, j = room.rate, room.jacobian, stage * WIDTH, stage * WIDTH * WIDTH
    share, wear = w / (rig.beta * (1.0 + rig.gradient * z)), side * evolution / distance
    slip, by_share, by_psi = rate_state_slip(direct, speed, share, p)
    heal, by_age = rate_state_age(evolution, distance, speed, p)
    share_z = -share * rig.gradient / (1.0 + rig.gradient * z)
    share_w = 1.0 / (rig.beta * (1.0 + rig.gradient * z))
    rate[i + 2], rate[i + 3] = stiffness * (v - slip), heal - wear * slip
    slopes[j + 8], slopes[j + 9] = -stiffness * by_share * share_z, stiffness
    slopes[j + 10], slopes[j + 11] = -stiffness * by_share * share_w, -stiffness * by_psi
    slopes[j + 12], slopes[j + 13] = -wear * by_share * share_z, 0.0
    slopes[j + 14], slopes[j + 15] = -wear * by_share * share_w, by_age - wear * by_psi


def rates(rig: Rig, room: Room, side: float, pull: float, values: Buffer, first: int, stage: int) -> None:
    """Write the rates of the state that stands in `values` from `first` on, and their slopes row by row."""
    z, v, w = values[first], values[first + 1], values[first + 2]
    n, n_z, n_v, n_w = contact(rig, side, z, v, w)
    mass = 1.0 / (rig.r * rig.r)
    rate, slopes, i, j = room.rate, room.jacobian, stage * WIDTH, stage * WIDTH * WIDTH
    rate[i], rate[i + 1] = v, (pull - z - rig.lead * v - n) * mass
    slopes[j], slopes[j + 1], slopes[j + 2], slopes[j + 3] = 0.0, 1.0, 0.0, 0.0
    slopes[j + 4], slopes[j + 5] = (-1.0 - n_z) * mass, -(rig.lead + n_v) * mass
    slopes[j + 6], slopes[j + 7] = -n_w * mass, 0.0
    if rig.code == RATE_STATE:
        age(rig, room, side, values, first, stage)
    elif rig.code >= DAHL:
        rate[i + 2], slopes[j + 8], slopes[j + 9], slopes[j + 10], slopes[j + 11] = inner(rig, side, z, v, w)[4:]
