"""The force of the contact recovered from the motion: no law assumed."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measurement import Measurement
from frictionlab.simulator import Problem, SteadyState

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
FADE = 25.0  # harmonics above this fade out: noise times k^2 rules there


def contact_force(
    measurement: Measurement, frame_damping_ratio: float = 0.0, *, found: Problem | None = None, lag: float = 0.0
) -> FloatArray:
    """Force of the contact on the mass over the measured cycle: what the equation of motion leaves for it.

    ``n = y - x - 2 zeta_f r (x' - y') - r^2 x''`` of the mean cycle without its noise.

    Parameters
    ----------
    measurement : Measurement
        With a frequency ratio.
    frame_damping_ratio : float
        Of the frame's own dashpot.
    found : Problem, optional
        Whose frequency ratio and base motion are taken in place of the measured ones: a rig as a fit has found it.
    lag : float
        By which the mass is seen early, rad of the drive.

    Returns
    -------
    ndarray of shape (p,)
        Over k Y, at the phases of ``measurement.cycle.tau``; positive against a motion in the positive direction.
    """
    cycle, r = measurement.cycle, (found.r if found else measurement.frequency_ratio) or math.nan
    moved = found.base.at(cycle.tau + lag) if found else cycle.base
    mass, base = np.fft.rfft(cycle.mass_smooth), np.fft.rfft(moved)
    k = np.arange(len(mass))
    return np.asarray(np.fft.irfft(fade(k) * left_for_contact(mass, base, k, r, frame_damping_ratio), len(cycle.tau)))


def left_for_contact(
    mass: ComplexArray, base: ComplexArray, order: NDArray[np.intp], r: float, frame_damping_ratio: float
) -> ComplexArray:
    """Return what the equation of motion leaves for the contact, harmonic by harmonic (k,) of mass and base."""
    rate = r * order
    dashpot = 1.0 + 2.0j * frame_damping_ratio * rate
    return np.asarray(base * dashpot - mass * (dashpot - rate**2))


def fade(order: NDArray[np.intp]) -> FloatArray:
    """Return by how much harmonics fade out, so that noise does not rule."""
    return np.asarray(np.exp(-((order / FADE) ** 2)))


@dataclass(frozen=True)
class ContactForce:
    """The contact's force over one cycle: recovered from the motion, and as the identified law has it.

    Arrays (p,) on the phases of the mean cycle: ``displacement`` x/Y about its mean, ``velocity`` over omega Y,
    ``force`` over k Y as recovered, with lag, natural frequency and base motion as the fit has found them;
    ``law_displacement``, ``law_velocity``, ``law_force``: the same of the law, None
    without a prediction; ``residual`` x/Y: measured minus predicted; ``floor``: what noise alone leaves of it, rms,
    Y. ``law``: its name; ``laws``: the ladder's rungs, name -> (parameters, nrmse, logarithm of the evidence).
    """

    source: str
    law: str
    tau: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    force: FloatArray
    law_displacement: FloatArray | None
    law_velocity: FloatArray | None
    law_force: FloatArray | None
    residual: FloatArray | None
    floor: float
    laws: Mapping[str, tuple[int, float, float]]


def contact_of(
    measurement: Measurement,
    state: SteadyState,
    *,
    predicted: FloatArray | None,
    lag: float,
    floor: float,
    laws: Mapping[str, tuple[int, float, float]],
) -> ContactForce:
    """Return the force of a test's contact beside that of the law identified.

    Parameters
    ----------
    measurement : Measurement
    state : SteadyState
        The prediction.
    predicted : ndarray of shape (p,), optional
        The predicted cycle as the sensors would show it.
    lag : float
        Lag between the channels that the fit found, rad.
    floor : float
        Standard error of the measured mean cycle, Y.
    laws : mapping
        The ladder's rungs.
    """
    cycle, orbit = measurement.cycle, state.orbit
    x, v = (None, None) if orbit is None else orbit.at(cycle.tau + lag)
    return ContactForce(
        source=measurement.source,
        law=state.problem.law.name,
        tau=cycle.tau,
        displacement=cycle.mass_smooth,
        velocity=cycle.mass_velocity,
        force=contact_force(measurement, state.problem.frame_damping_ratio, found=state.problem, lag=lag),
        law_displacement=None if x is None else x - x.mean(),
        law_velocity=v,
        law_force=None if orbit is None else orbit.force(cycle.tau + lag),
        residual=None if predicted is None else cycle.mass - predicted,
        floor=floor,
        laws=laws,
    )
