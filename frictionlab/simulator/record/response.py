"""What a sampled motion of the base does to the mass: the motion at the samples, events, energies, stops."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.simulator.problem import Problem
from frictionlab.simulator.record.base import BaseRecord


@dataclass(frozen=True)
class Response:
    """The motion of the mass under a sampled motion of the base, from its first sample to its last.

    Lengths are over Y = `base.scale`, times are tau = omega_n t in rad, forces over k Y, energies over k Y^2.

    Parameters
    ----------
    problem : Problem
    base : BaseRecord
    displacement, velocity : ndarray of shape (n,)
        Absolute displacement x of the mass from where the spring is relaxed, and dx/dtau, at the samples; relative to
        the base where that is given by its acceleration: how far it went is not known.
    contact_force : ndarray of shape (n,)
        Force of the contact on the mass, n, at the samples.
    events : ndarray of shape (m, 3)
        What begins, when, where: tau; 1 (slip up), -1 (slip down) or 0 (a stop); displacement relative to the wall.
    energy : float
        All that is dissipated: by friction, by the contact's dashpot and by the frame's.
    friction_energy : float
        By dry friction alone.
    energy_input : float
        Work of the force that drives the motion relative to the wall, by an independent integral.
    closure_error : float
        |energy put in - energy dissipated - energy stored|.
    path : float
        Way of the mass along the wall while the contact slips.
    stops : int
        Times that the slipping contact came to hold.
    time_stuck : float
        Time in which the contact does not slip, rad.
    solver : {"exact", "numeric"}
        Closed forms, or numerical integration for the laws that have none. A contact with an inner state always creeps:
        a stop is then slow slip (`frictionlab.simulator.numeric.motion.stop_limits`), and `path` is the way slipped.
    """

    problem: Problem
    base: BaseRecord
    displacement: FloatArray
    velocity: FloatArray
    contact_force: FloatArray
    events: FloatArray
    energy: float
    friction_energy: float
    energy_input: float
    closure_error: float
    path: float
    stops: int
    time_stuck: float
    solver: Literal["exact", "numeric"] = "exact"

    @property
    def time(self) -> FloatArray:
        """Times of the samples, tau in rad."""
        return self.base.time

    @property
    def stuck_fraction(self) -> float:
        """Share of the time in which the contact does not slip."""
        return self.time_stuck / float(self.time[-1] - self.time[0])

    @property
    def relative_displacement(self) -> FloatArray:
        """Displacement of the mass from the base (n,)."""
        if self.base.quantity == "acceleration":
            return self.displacement
        return np.asarray(self.displacement - self.base.values)

    @property
    def peaks(self) -> dict[str, float]:
        """Largest sizes at the samples: displacement, velocity, displacement from the base, contact force."""
        return {
            "displacement": _largest(self.displacement),
            "velocity": _largest(self.velocity),
            "relative_displacement": _largest(self.relative_displacement),
            "contact_force": _largest(self.contact_force),
        }

    @property
    def intervals_stuck(self) -> FloatArray:
        """Begin and end of each time in which the contact does not slip, rad, shape (k, 2)."""
        begins = self.events[:, 0]
        ends = np.append(begins[1:], self.time[-1])
        held = self.events[:, 1] == 0.0
        return np.column_stack((begins[held], ends[held]))


def _largest(values: FloatArray) -> float:
    return float(max(values.max(), -values.min()))
