"""The measured cycle of each test of a campaign, and what a law says of it at given values."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.measurement import Measurement
from frictionlab.identification.coordinates import Coordinate, of_parameter
from frictionlab.identification.family import HIGHER, Family, family_of
from frictionlab.identification.fit import Fit
from frictionlab.identification.forward import Forward
from frictionlab.identification.identify import Identified, coordinates_of, identify
from frictionlab.identification.observed import Observed, observe_cycle
from frictionlab.scene import Scene
from frictionlab.simulator.laws import Law

FloatArray = NDArray[np.float64]
LOCAL = ("second_cosine", "second_sine", HIGHER)  # nuisances that each test has for itself


@dataclass(frozen=True)
class Cycle:
    """The mean steady cycle of one test, ready to be fitted under any law.

    ``amplitude``: of the base, Y, m; ``turn``: the drive's angular frequency, rad/s; ``family``: the test under the
    scene's law; ``nuisances``: what may be off in its sensors and its rig; ``alone``: its own fit under the scene's
    law, where it was made.
    """

    source: str
    group: tuple[str, float]
    amplitude: float
    turn: float
    family: Family
    nuisances: tuple[Coordinate, ...]
    observed: Observed
    alone: Identified | None = None

    @property
    def material(self) -> str:
        """What the contact is made of."""
        return self.group[0]

    def forward(self, law: Law, *, rig: bool = True) -> Forward:
        """What turns the unknowns of this test under a law into its cycle; without `rig` it is as it is known."""
        family = self.family if law.name == self.family.law.name else self.family.under(law)
        own = (of_parameter(family.law.parameter(name)) for name in family.free)
        return Forward(
            family, (*own, *(self.nuisances if rig else ())), self.observed.harmonics, kept=self.observed.kept
        )

    def at(self, forward: Forward, point: FloatArray, excess: float = 1.0) -> Fit | None:
        """What is left of the cycle at a point, and its slopes; None where there is no steady state."""
        residual = self.residual(forward, point)
        if residual is None:
            return None
        return self.sloped(Fit(forward, self.observed, point, residual, np.zeros((len(residual), len(point))), excess))

    def residual(self, forward: Forward, point: FloatArray) -> FloatArray | None:
        """What is left of the cycle at a point, whitened; None where there is no steady state."""
        predicted = forward.predict(point)
        return None if predicted is None else self.observed.whitener @ (self.observed.cosine_sine - predicted)

    def sloped(self, found: Fit) -> Fit:
        """Return a fit with its slopes found anew."""
        white = self.observed.whitener
        predicted = self.observed.cosine_sine - np.linalg.solve(white, found.residual)
        return replace(found, jacobian=white @ found.forward.jacobian(found.point, predicted))

    def fresh(self) -> "Cycle":
        """The same without what was reckoned from it on the way: a campaign holds many."""
        return replace(self, observed=replace(self.observed))


def cycle_of(
    source: str,
    group: tuple[str, float],
    measurement: Measurement,
    scene: Scene,
    *,
    alone: bool = False,
    law: str | None = None,
) -> Cycle:
    """Return the cycle of a test.

    Parameters
    ----------
    source : str
        Its name in the campaign.
    group : tuple of str and float
        Material and normal force (N).
    measurement : Measurement
        Of its recording.
    scene : Scene
    alone : bool
        Fit it for itself as well, as a single comparison does; else its cycle is the mean of all steady ones.
    law : str, optional
        In place of the scene's.

    Raises
    ------
    AnalysisError
        The natural frequency is not known; with `alone`, the test tells no friction ratio.
    """
    family, sources = family_of(measurement, scene, law), measurement.sources
    found = coordinates_of(family, measurement, sources)
    return Cycle(
        source=source,
        group=group,
        amplitude=measurement.base_amplitude_m,
        turn=2.0 * math.pi * measurement.drive_frequency_hz,
        family=family,
        nuisances=tuple(c for c in found if not c.law),
        observed=observe_cycle(measurement, every=not alone),
        alone=identify(measurement, family, sources) if alone else None,
    )
