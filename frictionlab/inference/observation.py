"""What a fit asks of one test, whatever was observed of it: its data, their noise, and what a law predicts of them.

The noise is independent along some directions, with a variance along each; what a law misses counts beside it as a
share of the test's power. From these follow whitening, chi-square and evidence, and slopes are differences of the
simulated motion: a kind of observation adds how it is simulated, how the sensors show that, and its covariance.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError
from frictionlab.inference.unknowns import Unknown, of_law
from frictionlab.simulator import COSINE, Base, Problem
from frictionlab.simulator.laws import Law
from frictionlab.simulator.problem import Wall

Values = Mapping[str, float]
BENDS = {"parabola": 2, "cubic": 3}  # powers of its place by which the mass's sensor bends a motion
SENSORS = ("gain", "lag_s", "base_in_mass", *BENDS)  # what is done to a motion that stays the same


@dataclass(frozen=True)
class Reached:
    """What a fit has reached in one test.

    ``residual`` (N,) and ``slopes`` (N, n), whitened; ``gain`` (n, N): coordinates over residual; ``hold`` (n, n): what
    priors and other tests say of the coordinates; ``values``: by name; ``is_noise``: whether the residual is.
    """

    residual: FloatArray
    slopes: FloatArray
    gain: FloatArray
    hold: FloatArray
    values: Values
    is_noise: bool


class Observation(ABC):
    """One test in a fit; its kinds are frozen dataclasses.

    Attributes
    ----------
    law : Law
    held : mapping of str to float
        Parameters of the law that the scene holds.
    wall : {"fixed", "base"}
    material : str or None
        Of the contact: what the law misses is alike in its tests.
    missed : float
        Share of the test's power that the law cannot explain: it counts beside the noise.
    """

    law: Law
    held: Values
    wall: Wall
    material: str | None
    missed: float
    steps: ClassVar[tuple[float, ...]]
    """Of a prior's standard deviation, one after the other where there is no motion: differences of the simulation."""
    by_sensors: ClassVar[tuple[str, ...]] = ()
    """Unknowns that leave the motion as it is."""

    @property
    @abstractmethod
    def data(self) -> FloatArray:
        """What is fitted (N,)."""

    @property
    @abstractmethod
    def variances(self) -> FloatArray | float:
        """Of the noise (N,), along its independent directions."""

    @property
    @abstractmethod
    def powers(self) -> FloatArray | float:
        """Mean square (N,) of what a share is missed of."""

    @property
    def directions(self) -> FloatArray | None:
        """Independent directions of the noise, as columns (N, N); None where the data themselves are."""
        return None

    @property
    @abstractmethod
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of sensors and rig."""

    @property
    def law_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of the law."""
        return of_law(self.law, self.held)

    @abstractmethod
    def motion(self, values: Values, near: Any = None) -> Any:
        """Return the simulated motion, before the sensors; None where there is none. ``near``: one to begin from."""

    @abstractmethod
    def seen(self, motion: Any, values: Values) -> FloatArray:
        """Return a motion (N,) as the sensors show it."""

    @abstractmethod
    def covariance(self, at: Reached) -> FloatArray:
        """Return the covariance (n, n) that noise and misfit leave in the coordinates of a fit."""

    @cached_property
    def sd(self) -> FloatArray:
        """Standard deviations (N,) of noise and misfit, along the noise's directions."""
        return np.asarray(np.sqrt(self.variances + self.missed * self.powers))

    @property
    def log_scale(self) -> float:
        """Logarithm of the whitener's determinant."""
        return -float(np.log(self.sd).sum())

    @property
    def whitener(self) -> FloatArray | None:
        """Matrix (N, N) that makes noise and misfit independent with unit variance; None where that is division."""
        return None

    def white(self, vectors: FloatArray) -> FloatArray:
        """Make noise and misfit of unit variance of residuals (N,) or slopes (N, n)."""
        if self.whitener is not None:
            return np.asarray(self.whitener @ vectors)
        return np.asarray(vectors / (self.sd if vectors.ndim == 1 else self.sd[:, None]))

    def gap(self, residual: FloatArray) -> FloatArray:
        """Return the residual itself (N,) of a whitened one."""
        return np.asarray(residual * self.sd if self.directions is None else self.directions @ (residual * self.sd))

    def chi_square(self, residual: FloatArray, missed: float = 0.0) -> float:
        """Return the sum of squares of a whitened residual over the noise and a share that the law misses."""
        along = residual * self.sd  # the noise's directions
        return float(np.sum(along**2 / (self.variances + missed * self.powers)))

    def nrmse(self, residual: FloatArray) -> float:
        """Return the rms of a whitened residual over that of what was measured."""
        return float(np.sqrt(np.mean(self.gap(residual) ** 2 / self.powers)))

    def missing(self, share: float) -> Self:
        """Return the test with a share of its power counted as what the law misses; 0: nothing but noise."""
        return replace(self, missed=share)  # type: ignore[type-var] # its kinds are dataclasses

    def under(self, law: Law, held: Values | None = None) -> Self:
        """Return the same test under another law; what that law lacks is no longer held."""
        names = {p.name for p in law.parameters}
        known = self.held if held is None else held
        kept = {name: value for name, value in known.items() if name in names}
        return replace(self, law=law, held=kept)  # type: ignore[type-var] # as above

    def simulated(self, values: Values, r: float, base: Base = COSINE, times: Values | None = None) -> Problem:
        """Return what is simulated at a frequency ratio: the law's defaults, what is held, and values.

        ``times``: factors of the law's parameters; ``natural_frequency`` among the values detunes the frame.
        """
        given = {p.name: p.default for p in self.law.parameters if p.default is not None} | dict(self.held)
        given |= {p.name: values[p.name] for p in self.law.parameters if p.name in values}
        for name, factor in (times or {}).items():
            given[name] *= factor
        beta, frame = given.pop("beta"), given.pop("frame_damping_ratio", 0.0)
        detuned = r / (1.0 + values.get("natural_frequency", 0.0))
        return Problem(
            detuned, beta, wall=self.wall, base=base, law=self.law, parameters=given, frame_damping_ratio=frame
        )

    @abstractmethod
    def problem(self, values: Values) -> Problem:
        """Return what is simulated at some values, dimensionless in this test, sensors and rig included."""

    def predict(self, values: Values, near: Any = None) -> FloatArray | None:
        """Return what would be measured (N,); None where there is no motion."""
        motion = self.motion(values, near)
        return None if motion is None else self.seen(motion, values)

    def slopes(self, unknowns: Sequence[Unknown], values: Sequence[float], factors: Sequence[float]) -> FloatArray:
        """Return derivatives (N, n) by the unknowns' coordinates, by differences of the simulated motion.

        A column is zero where neither neighbour has a motion.

        Parameters
        ----------
        unknowns : sequence of Unknown
        values : sequence of float
            In this test, in the same order.
        factors : sequence of float
            Value in this test over that of the unknown.

        Raises
        ------
        AnalysisError
            There is no motion at the values.
        """
        here = dict(zip((u.name for u in unknowns), values, strict=True))
        motion = self.motion(here)
        if motion is None:
            raise AnalysisError(f"law {self.law.name}: the values found have no steady state, nor another motion")
        at = self.seen(motion, here)
        columns = np.zeros((len(at), len(unknowns)))
        for column, u, value, times in zip(columns.T, unknowns, values, factors, strict=True):
            c = u.at(value / times)
            for step in self.steps:
                if c + step < u.low:
                    continue
                moved = here | {u.name: u.value(c + step) * times}
                there = self.seen(motion, moved) if u.name in self.by_sensors else self.predict(moved, motion)
                if there is not None:
                    column[:] = (there - at) / step
                    break
        return columns
