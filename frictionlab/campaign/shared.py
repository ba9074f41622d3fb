"""Which unknowns the tests of a material share, and how each test's own follow from them.

A test tells its parameters over its own Y and omega. In newtons, metres and seconds they are the material's: friction
force by normal force, so beta goes as 1 / Y; a gradient per metre, so q goes as Y; a slip distance as 1 / Y; a speed
as 1 / (omega Y): each parameter of a law says its own powers. The dashpot and the contact's stiffness are over the
rig's, which is one. Gain, lag, natural frequency and the frame's damping are the rig's: the same in all tests, in
deviations of what is known of them.

Shared coordinates are those of a test at the mean Y and omega, so that one test alone has its own.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from frictionlab.campaign.cycles import LOCAL, Cycle
from frictionlab.identification.coordinates import Coordinate, of_parameter
from frictionlab.simulator.laws import Law, Parameter

FloatArray = NDArray[np.float64]
FRICTION = "beta"


@dataclass(frozen=True)
class Place:
    """Where the unknowns of one test stand: own = ``scale @ shared + offset`` for all but its local ones.

    ``scale`` (n, S), ``offset`` (n,); ``local``: which of its own (n,) no other test has; ``friction``: which of them
    is its friction ratio, that may scatter from test to test; None where it is held. ``uneven`` (n, q): by how much
    other parameters of the law scatter, each in a column of its own.
    """

    scale: FloatArray
    offset: FloatArray
    local: NDArray[np.intp]
    friction: int | None
    uneven: FloatArray | None = None

    @cached_property
    def own(self) -> FloatArray:
        """What the test has for itself beside its friction (n, m): each column is one deviation of one unknown."""
        alone: FloatArray = np.eye(len(self.offset))[:, self.local]
        return alone if self.uneven is None else np.hstack([alone, self.uneven])

    def strain(self, point: FloatArray, shared: FloatArray) -> float:
        """Sum of squares, in deviations, of what the test has for itself at its own unknowns (n,)."""
        far = (point - self.scale @ shared - self.offset) @ self.own
        return float(((far / (self.own**2).sum(axis=0)) ** 2).sum())


@dataclass(frozen=True)
class Shared:
    """The unknowns that tests share.

    ``coordinates``: first a friction ratio for each of ``groups``, then the law's other parameters, then the nuisances;
    ``amplitude`` (m), ``turn`` (rad/s): of the test that stands for all; ``rig``: whether the nuisances are among them;
    ``uneven``: by how much parameters of the law scatter from test to test, in deviations, by name.
    """

    law: Law
    groups: tuple[tuple[str, float], ...]
    coordinates: tuple[Coordinate, ...]
    amplitude: float
    turn: float
    rig: bool = True
    uneven: Mapping[str, float] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Names of the shared coordinates, in order."""
        return [c.name for c in self.coordinates]

    @property
    def is_law(self) -> NDArray[np.bool_]:
        """Which belong to the law."""
        return np.array([c.law for c in self.coordinates], dtype=bool)

    def place(self, cycle: Cycle) -> Place:
        """Return where the unknowns of one test stand."""
        own = cycle.forward(self.law, rig=self.rig).coordinates
        scale, offset = np.zeros((len(own), len(self.coordinates))), np.zeros(len(own))
        names, local = self.names, []
        for i, c in enumerate(own):
            if c.name in LOCAL:
                local.append(i)
                continue
            k = self.groups.index(cycle.group) if c.name == FRICTION else names.index(c.name)
            scale[i, k], offset[i] = self._scaled(c, cycle) if c.law else (1.0, 0.0)
        friction = next((i for i, c in enumerate(own) if c.name == FRICTION), None)
        columns = [tau * scale[:, names.index(name)] for name, tau in self.uneven.items()]
        uneven = np.stack(columns, axis=1) if columns else None
        return Place(scale, offset, np.array(local, dtype=np.intp), friction, uneven)

    def _scaled(self, c: Coordinate, cycle: Cycle) -> tuple[float, float]:
        """Slope and offset of a test's own coordinate over the shared one."""
        factor = self.factor(self.law.parameter(c.name), cycle)
        if c.is_log:
            return 1.0, math.log(factor) / c.width
        return factor, (factor - 1.0) * c.middle / c.width

    def factor(self, parameter: Parameter, cycle: Cycle) -> float:
        """A test's own value over that of the test which stands for all."""
        length, rate = self.amplitude / cycle.amplitude, self.turn / cycle.turn
        return float(length**parameter.lengths * rate**parameter.rates)


def shared_by(
    cycles: Sequence[Cycle], law: Law, *, rig: bool = True, uneven: Mapping[str, float] | None = None
) -> Shared:
    """Return what these tests share under a law; without `rig`, sensors and rig are as they are known."""
    groups = tuple(sorted({cycle.group for cycle in cycles}))
    free = cycles[0].forward(law).family.free
    own = [of_parameter(law.parameter(name)) for name in free]
    friction = [c for c in own if c.name == FRICTION for _ in groups]
    rest = [c for c in own if c.name != FRICTION]
    nuisances = {c.name: c for cycle in cycles for c in cycle.nuisances if rig and c.name not in LOCAL}
    return Shared(
        law=law,
        groups=groups,
        coordinates=(*friction, *rest, *nuisances.values()),
        amplitude=float(np.mean([cycle.amplitude for cycle in cycles])),
        turn=float(np.mean([cycle.turn for cycle in cycles])),
        rig=rig,
        uneven=uneven or {},
    )
