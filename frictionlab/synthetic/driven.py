"""The virtual mass under a base that is no plain sine: by the simulator of records, its friction changed as it runs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.simulator import Problem
from frictionlab.simulator.record import BaseRecord, Response, respond

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Driven:
    """A motion, over Y, at even times; its parts are those of one friction ratio each.

    ``time`` (n,) tau = omega_n t; ``displacement`` (n,) of the mass.
    """

    time: FloatArray
    displacement: FloatArray
    parts: Sequence[Response]

    def totals(self, amplitude_m: float, omega: float, stiffness: float) -> dict[str, object]:
        """What is true of the whole motion."""
        energy = sum(part.energy for part in self.parts)
        base = np.concatenate([part.base.values for part in self.parts])
        return {
            "base_largest_m": amplitude_m * float(np.abs(base).max()),
            "base_rms_m": amplitude_m * float(np.std(base)),
            "total_energy": energy,
            "total_energy_j": energy * stiffness * amplitude_m**2,
            "total_friction_energy": sum(part.friction_energy for part in self.parts),
            "total_path": sum(part.path for part in self.parts),
            "total_stops": sum(part.stops for part in self.parts),
            "total_time_stuck_s": sum(part.time_stuck for part in self.parts) / omega,
            "peak_displacement": max(part.peaks["displacement"] for part in self.parts),
        }


def drive(
    problem_of: Callable[[float], Problem], betas: FloatArray, length: float, tau: FloatArray, base: FloatArray
) -> Driven:
    """Return the motion from rest under a sampled base; friction has one value for so long, then the next.

    Parameters
    ----------
    problem_of : callable
        The problem with a friction ratio, its time counted in omega_n t.
    betas : ndarray of shape (m,)
        Friction ratios, one after the other; one alone stays.
    length : float
        Of each, rad.
    tau, base : ndarray of shape (n,)
        Times, rad, and displacement of the base over Y; its zero is where the spring is relaxed.
    """
    ends = np.searchsorted(tau, length * np.arange(1, len(betas))).tolist() if len(betas) > 1 else []
    x, v, first = 0.0, 0.0, 0
    displacement, parts = np.zeros(len(tau)), []
    for beta, end in zip(betas.tolist(), [*ends, len(tau) - 1], strict=True):
        if end - first < 1:
            continue
        part = slice(first, end + 1)
        record = BaseRecord(tau[part], base[part], rest=0.0, scale=1.0)
        parts.append(respond(problem_of(beta), record, x0=x, v0=v))
        displacement[part] = parts[-1].displacement
        x, v, first = float(parts[-1].displacement[-1]), float(parts[-1].velocity[-1]), end
    return Driven(tau, displacement, tuple(parts))
