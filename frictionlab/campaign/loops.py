"""The loop of a material's contact: its force over displacement and speed, as recovered and as the law has it."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.campaign.cycles import Cycle
from frictionlab.campaign.joining import Material
from frictionlab.identification.contact_force import FittedRig, fade
from frictionlab.identification.fit import Fit

FloatArray = NDArray[np.float64]
POINTS = 720  # of a loop
SHOWN = 3  # tests of a material


@dataclass(frozen=True)
class Loop:
    """One test's contact over a cycle, arrays (p,): ``place`` m, ``speed`` m/s, ``force`` N (k Y without stiffness).

    These as recovered from the motion, no law assumed but for the force's mean, which a sensor does not tell whose zero
    is not the spring's; ``law_place``, ``law_speed``, ``law_force``: as the law has it.
    """

    material: str
    normal_force_n: float
    r: float
    place: FloatArray
    speed: FloatArray
    force: FloatArray
    law_place: FloatArray
    law_speed: FloatArray
    law_force: FloatArray


def loops_of(material: Material, stiffness: float | None) -> tuple[Loop, ...]:
    """Return the loops of a few tests that the law explains best, slow, middling and fast."""
    best = material.joined.best
    order = sorted(range(len(best.fits)), key=lambda i: best.cycles[i].family.r)
    parts = [part for part in np.array_split(np.array(order), SHOWN) if len(part)]
    chosen = [min(map(int, part), key=lambda i: best.fits[i].nrmse / best.fits[i].observed.floor) for part in parts]
    found = (_loop(best.cycles[i], best.fits[i], stiffness) for i in chosen)
    return tuple(loop for loop in found if loop is not None)


def _loop(cycle: Cycle, found: Fit, stiffness: float | None) -> Loop | None:
    values = found.values
    state = found.forward.state(values)
    if state is None or state.orbit is None:
        return None
    tau = 2.0 * math.pi * np.arange(POINTS) / POINTS
    x, v = state.orbit.at(tau + values.get("lag", 0.0))
    newtons = 1.0 if stiffness is None else stiffness * cycle.amplitude
    seen, of_law = _recovered(found, tau), state.orbit.force(tau + values.get("lag", 0.0))
    length, rate = cycle.amplitude, cycle.amplitude * cycle.turn
    material, force = cycle.group
    return Loop(
        material,
        force,
        cycle.family.r,
        length * seen[0],
        rate * seen[1],
        newtons * (seen[2] + of_law.mean()),
        length * (x - x.mean()),
        rate * v,
        newtons * of_law,
    )


def _recovered(found: Fit, tau: FloatArray) -> list[FloatArray]:
    """Displacement, speed and force (p,) by the measured harmonics, with sensors and rig as the fit has found them."""
    cosine, sine = np.split(found.observed.cosine_sine, 2)
    k = np.arange(1, len(cosine) + 1)
    x = cosine - 1j * sine
    turning, faded = np.exp(1j * np.outer(tau, k)), fade(k)
    return [
        np.asarray((turning @ lines).real) for lines in (faded * x, faded * 1j * k * x, FittedRig.of(found).force(x))
    ]
