"""What every solver's motion offers, whatever it is made of."""

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from frictionlab.simulator.problem import Problem

__all__ = ["Motion"]

Floats = NDArray[np.float64]


class Motion(Protocol):
    """A motion of one problem, to be asked at any time between its start and its end; at all times if periodic."""

    @property
    def problem(self) -> Problem:
        """What moves."""

    @property
    def start(self) -> float:
        """Begin of the motion, rad."""

    @property
    def end(self) -> float:
        """End of the motion (or of its first period), rad."""

    @property
    def periodic(self) -> bool:
        """Whether the motion repeats after its end."""

    @property
    def stops(self) -> Floats:
        """Begin and end of each stop, rad, shape (m, 2): times in which the contact does not slip."""

    @property
    def turning_points(self) -> tuple[Floats, Floats]:
        """Times (rad) at which the mass turns relative to the wall, and the displacement x there."""

    def at(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> tuple[Floats, Floats]:
        """Return displacement x over Y (absolute) and velocity x' at times tau (rad), counted from a cycle's start."""

    def force(self, tau: ArrayLike, *, cycle: ArrayLike | None = None) -> Floats:
        """Return the force of the contact on the mass, against the motion, over k Y, at times tau."""
