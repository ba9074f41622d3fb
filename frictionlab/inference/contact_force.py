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


@dataclass(frozen=True)
class ContactForce:
    """The contact's force over one cycle: recovered from the motion, and as the identified law has it.

    Arrays (p,) on the phases of the mean cycle: ``displacement`` x/Y about its mean, ``velocity`` over omega Y,
    ``force`` over k Y as recovered, with lag, natural frequency and base motion as the fit has found them. Its mean is
    the law's, for sensors do not tell where the spring is without force. ``law_displacement``, ``law_velocity``,
    ``law_force``: the same of the law, None without a prediction; ``residual`` x/Y: measured minus predicted;
    ``floor``: what noise alone leaves of it, rms, Y. ``law``: its name;
    ``laws``: the ladder's rungs, name -> (parameters, nrmse, logarithm of the evidence).
    ``unit_m``: Y [m]; ``turn``: omega [rad/s]; ``unit_n``: k Y [N], None where the stiffness is not known; ``said``:
    law and verdict in words; ``warnings``: sentences of the comparison.
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
    unit_m: float
    turn: float
    unit_n: float | None = None
    said: str = ""
    warnings: tuple[str, ...] = ()


def contact_force(measurement: Measurement, problem: Problem | None = None, late: float = 0.0) -> FloatArray:
    """Return the force of the contact on the mass over the measured cycle: what the equation of motion leaves for it.

    ``n = y - x - 2 zeta_f r (x' - y') - r^2 x''`` of the mean cycle without its noise.

    Parameters
    ----------
    measurement : Measurement
        With a frequency ratio.
    problem : Problem, optional
        Whose frequency ratio, damping and base motion, as a fit has found them, are taken in place of those measured.
    late : float
        Phase by which the base's channel is behind the mass's, rad.

    Returns
    -------
    ndarray of shape (p,)
        Over k Y, at the phases of ``measurement.cycle.tau``; positive against a motion in the positive direction.
    """
    cycle, half = measurement.cycle, 0.5 * len(measurement.cycle.tau)
    mass = np.fft.rfft(cycle.mass_smooth)[1:] / half
    order = np.arange(1, len(mass) + 1)
    if problem is None:
        base, r, damping = np.fft.rfft(cycle.base)[1:] / half, measurement.frequency_ratio or math.nan, 0.0
    else:
        base, r, damping = np.zeros(len(mass), dtype=np.complex128), problem.r, problem.frame_damping_ratio
        count = min(problem.base.harmonics, len(mass))
        base[:count] = problem.base.lines[:count]
        base = base * np.exp(1j * late * order)
    left = np.exp(-((order / FADE) ** 2)) * left_for_contact(mass, base, order, r, damping)
    return np.asarray(np.fft.irfft(np.concatenate([[0.0], half * left]), len(cycle.tau)))


def left_for_contact(
    mass: ComplexArray, base: ComplexArray, order: NDArray[np.intp], r: float, frame_damping_ratio: float
) -> ComplexArray:
    """Return what the equation of motion leaves for the contact, harmonic by harmonic (k,) of mass and base."""
    rate = r * order
    dashpot = 1.0 + 2.0j * frame_damping_ratio * rate
    return np.asarray(base * dashpot - mass * (dashpot - rate**2))


def contact_of(
    measurement: Measurement,
    state: SteadyState,
    *,
    predicted: FloatArray | None,
    late: float,
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
    late : float
        Phase by which the base's channel is behind the mass's, rad.
    floor : float
        Standard error of the measured mean cycle, Y.
    laws : mapping
        The ladder's rungs.
    """
    cycle, orbit = measurement.cycle, state.orbit
    x, v = (None, None) if orbit is None else orbit.at(cycle.tau + late)
    of_law = None if orbit is None else orbit.force(cycle.tau + late)
    return ContactForce(
        source=measurement.source,
        law=state.problem.law.name,
        tau=cycle.tau,
        displacement=cycle.mass_smooth,
        velocity=cycle.mass_velocity,
        force=contact_force(measurement, state.problem, late) + (0.0 if of_law is None else of_law.mean()),
        law_displacement=None if x is None else x - x.mean(),
        law_velocity=v,
        law_force=of_law,
        residual=None if predicted is None else cycle.mass - predicted,
        floor=floor,
        laws=laws,
        unit_m=measurement.base_amplitude_m,
        turn=2.0 * math.pi * measurement.drive_frequency_hz,
    )
