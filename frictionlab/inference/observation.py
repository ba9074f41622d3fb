"""What a fit asks of one test, whatever was observed of it: its data, their noise, and what a law predicts of them.

The noise is independent along some directions, with a variance along each; what a law misses counts beside it as a
share of the test's power. From these follow whitening, chi-square and evidence, and slopes are differences of the
simulated motion. A kind of observation (the mean cycle of one mass or of several, the whole record, a table over
frequency) adds how it is simulated, how the sensors show that, and its covariance.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError, FrictionlabError
from frictionlab.inference.unknowns import Unknown, of_law, of_rig
from frictionlab.scene.physical import to_physical
from frictionlab.simulator import COSINE, Base, Problem, SteadyState, steady_state
from frictionlab.simulator.laws import Law, Parameter
from frictionlab.simulator.problem import Meter, OverspentError, Wall
from frictionlab.uncertainty import Sources

Values = Mapping[str, float]
BENDS = {"parabola": 2, "cubic": 3}  # powers of its place by which the mass's sensor bends a motion
NO_MOTION = (FrictionlabError, ArithmeticError, ValueError, np.linalg.LinAlgError)
"""What the simulator raises at values that are no candidate: there is no motion to compare with."""
OF_ONE = 1.5e4  # steps that one steady state may take of a meter: where there is one, nearly all take a third
SENSORS = ("gain", "lag_s", "base_in_mass", *BENDS)  # what is done to a motion that stays the same


def steady(problem: Callable[[], Problem], meter: Meter, near: SteadyState | None = None) -> SteadyState | None:
    """Return the steady state of a problem; None where there is none, or no such problem: no candidate.

    Nor are values at which a search that has so much work left would need a large share of it to find one.
    """
    try:
        with meter.keeping(max(meter.left - OF_ONE, 0.0) if math.isfinite(meter.left) else 0.0):
            return steady_state(problem(), near=near, meter=meter)
    except OverspentError:
        if meter.left > 0.0:
            return None
        raise
    except NO_MOTION:
        return None


def simulated(
    law: Law, held: Values, wall: Wall, values: Values, r: float, base: Base = COSINE, times: Values | None = None
) -> Problem:
    """Return what is simulated of a contact at a frequency ratio: the law's defaults, what is held, and values.

    ``times``: factors of the law's parameters; ``natural_frequency`` among the values detunes the frame.
    """
    given = {p.name: p.default for p in law.parameters if p.default is not None} | dict(held)
    given |= {p.name: values[p.name] for p in law.parameters if p.name in values}
    for name, factor in (times or {}).items():
        given[name] *= factor
    beta, frame = given.pop("beta"), given.pop("frame_damping_ratio", 0.0)
    detuned = r / (1.0 + values.get("natural_frequency", 0.0))
    return Problem(detuned, beta, wall=wall, base=base, law=law, parameters=given, frame_damping_ratio=frame)


def carried(parameter: Parameter, there: Mapping[str, float], here: Mapping[str, float]) -> float:
    """Return by how much a parameter's dimensionless value is larger here than there, by what both are over."""
    return (to_physical(parameter, **there)[0] or 1.0) / (to_physical(parameter, **here)[0] or 1.0)


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


@dataclass(frozen=True, kw_only=True)
class Observation(ABC):
    """One test in a fit.

    ``source``: what was read; ``law``; ``held``: parameters of it that the scene holds; ``wall``; ``material`` of the
    contact: what the law misses is alike in its tests; ``normal_force`` N, None where it is not known; ``r``: frequency
    ratio that speeds are over;
    ``unit``: Y [m]; ``turn``: angular frequency of the drive, rad/s; ``sources``: what is not known of sensors and rig;
    ``swing``: half the swing of the mass, over Y; ``distorted``: whether the base's sensor shows harmonics.
    ``data`` (N,): what is fitted; ``directions`` (N, N): independent directions of the noise, as columns, None where
    the data themselves are; ``variances`` (N,) of the noise along them; ``powers`` (N,): mean square of what a share is
    missed of; ``missed``: share of the test's power that the law cannot explain, which counts beside the noise;
    ``unsure``: part of each variance that is assumed for want of cycles; ``floor``: the nrmse that noise alone leaves;
    ``guess``: about what the friction ratio is, None where the loop or a search says it; ``left_out_s``: transient;
    ``settles_later_s``: when its motion settled, where that is after it (infinite: never); ``starting``: whether some
    of a start may be left; ``work``: what its motions may still cost.
    """

    source: str
    law: Law
    held: Values
    wall: Wall
    material: str | None
    normal_force: float | None
    r: float
    unit: float
    turn: float
    sources: Sources
    swing: float
    data: FloatArray
    variances: FloatArray | float
    powers: FloatArray | float
    floor: float
    directions: FloatArray | None = None
    distorted: bool = False
    missed: float = 0.0
    unsure: float = 0.0
    guess: float | None = None
    left_out_s: float = 0.0
    settles_later_s: float | None = None
    starting: bool = False
    work: Meter = field(default_factory=lambda: Meter(math.inf), compare=False)
    kind: ClassVar[str] = "cycle"
    noise_words: ClassVar[str] = "standard error of the measured mean cycle"
    """What was observed, and what its misfit is over."""
    steps: ClassVar[tuple[float, ...]]
    """Of a prior's standard deviation, one after the other where there is no motion: differences of the simulation."""
    by_sensors: ClassVar[tuple[str, ...]] = ()
    """Unknowns that leave the motion as it is."""
    single: ClassVar[bool] = True
    """One mass with one contact: the loop's energy is its contact's, and a spring stands between mass and base."""
    shows_rig: ClassVar[bool] = False
    """Its start and its transient show sensors and rig: these are fitted from the first, not held as they are known."""

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of sensors and rig."""
        unit = self.unit if math.isfinite(self.unit) else 1e-3
        return of_rig(self.sources, self.held, amplitude=self.swing, unit=unit, distorted=self.distorted)

    @property
    def law_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of the law."""
        return of_law(self.law, self.held, self.sources.infer)

    @property
    def friction_by_energy(self) -> float | None:
        """Friction ratio as energy over the path slid, which needs no law but Coulomb's; None: not known."""
        return None

    @property
    def frame(self) -> dict[str, float]:
        """What the law's numbers are over, as `to_physical` takes it; the stiffness is that of all tests: 1."""
        frequency = self.turn / (2.0 * math.pi * self.r)
        return {"stiffness": 1.0, "frequency": frequency, "amplitude": self.unit, "turn": self.turn}

    def factor(self, unknown: Unknown, reference: "Observation", *, amontons: bool = True) -> float:
        """Return by how much an unknown's dimensionless value is larger in this test than in a reference test.

        ``amontons``: whether friction is in proportion to the normal force.
        """
        if self is reference:
            return 1.0
        if not unknown.law:
            length = self.unit / reference.unit
            return {"spring_cubic": length**2, "play": 1.0 / length}.get(unknown.name, 1.0)
        parameter, own, load = self.law.parameter(unknown.name), self.normal_force, reference.normal_force
        force = own / load if amontons and own and load and unknown.name == "beta" else 1.0
        return carried(parameter, reference.frame, self.frame) * force

    @abstractmethod
    def motion(self, values: Values, near: Any = None) -> Any:
        """Return the simulated motion, before the sensors; None where there is none. ``near``: one to begin from."""

    def seen(self, motion: Any, values: Values) -> FloatArray:  # noqa: ARG002 - by kind
        """Return a motion (N,) as the sensors show it; here it is simulated so."""
        return np.asarray(motion)

    def covariance(self, at: Reached) -> FloatArray:
        """Return the covariance (n, n) that noise and misfit leave in the coordinates of a fit: as it is weighed."""
        return np.asarray(at.gain @ at.gain.T)

    def problem(self, values: Values) -> Problem:
        """Return what is simulated at some values, dimensionless in this test, sensors and rig included."""
        return simulated(self.law, self.held, self.wall, values, self.r)

    def in_newtons(self, found: Any) -> dict[str, Any]:  # noqa: ARG002 - by kind
        """Return friction force (N) and coefficient of a posterior by a measured force; nothing without one."""
        return {}

    def disagreement(self, found: Any) -> tuple[str, ...]:  # noqa: ARG002 - by kind
        """Say where a measured force and the motion give different friction."""
        return ()

    def tried(self, near: Values) -> list[dict[str, float]]:  # noqa: ARG002 - by kind
        """Return values at which a fit is tried, about those of another fit; none: by the loop of a cycle."""
        return []

    def begun(self, values: Values) -> Self:  # noqa: ARG002 - by kind
        """Return the test as the first descent from some values weighs it."""
        return self

    def settled(self, values: Values) -> Self:  # noqa: ARG002 - most know their noise before
        """Return the test with what the values of a first fit show of its noise."""
        return self

    def share_missed(self, residual: FloatArray, values: Values) -> float | None:  # noqa: ARG002 - by kind
        """Return the share of its power that a law misses by a whitened residual; None: by the sum of squares."""
        return None

    def left_out(self, residual: FloatArray, slopes: FloatArray, gain: FloatArray) -> tuple[FloatArray, float | None]:
        """Return the score (a sum of squares) of each part of the data by a fit to the others, and their nrmse.

        Of whitened residual (N,) and slopes (N, n); ``gain`` (n, N): coordinates over residual. Nothing without parts.
        """
        del residual, slopes, gain
        return np.zeros(0), None

    @cached_property
    def sd(self) -> FloatArray:
        """Standard deviations (N,) of noise and misfit, along the noise's directions."""
        return np.sqrt(self.variances + self.missed * self.powers) * np.ones(len(self.data))

    def white(self, vectors: FloatArray) -> FloatArray:
        """Make noise and misfit of unit variance of residuals (N,) or slopes (N, n)."""
        along = vectors if self.directions is None else self.directions.T @ vectors
        return np.asarray(along / (self.sd if vectors.ndim == 1 else self.sd[:, None]))

    def gap(self, white: FloatArray) -> FloatArray:
        """Return the residual (N,) or slopes (N, n) themselves of whitened ones."""
        along = white * (self.sd if white.ndim == 1 else self.sd[:, None])
        return np.asarray(along if self.directions is None else self.directions @ along)

    def over_gap(self, gain: FloatArray) -> FloatArray:
        """Return the gain (n, N) of coordinates over a residual itself, of that over a whitened one."""
        return np.asarray(gain / self.sd if self.directions is None else gain / self.sd @ self.directions.T)

    @property
    def effective_data(self) -> float:
        """Number of data whose noise is shown, and not assumed for want of cycles."""
        return float(np.sum(1.0 - self.unsure / (self.variances * np.ones(len(self.data)))))

    def chi_square(self, residual: FloatArray, missed: float = 0.0) -> float:
        """Return the sum of squares of a whitened residual over the noise and a share that the law misses."""
        along = residual * self.sd  # the noise's directions
        return float(np.sum(along**2 / (self.variances + missed * self.powers)))

    def nrmse(self, residual: FloatArray) -> float:
        """Return the rms of a whitened residual over that of what was measured."""
        return float(np.sqrt(np.mean(self.gap(residual) ** 2 / self.powers)))

    def missing(self, share: float) -> Self:
        """Return the test with a share of its power counted as what the law misses; 0: nothing but noise."""
        return replace(self, missed=share)

    def metered(self, work: Meter) -> Self:
        """Return the test whose steady states take their cost from a meter."""
        return replace(self, work=work)

    def under(self, law: Law, held: Values | None = None) -> Self:
        """Return the same test under another law; what that law lacks is no longer held."""
        names = {p.name for p in law.parameters}
        known = self.held if held is None else held
        kept = {name: value for name, value in known.items() if name in names}
        return replace(self, law=law, held=kept)

    def state(self, values: Values, near: SteadyState | None = None) -> SteadyState | None:
        """Return the steady state at some values; None where there is none."""
        return steady(lambda: self.problem(values), self.work, near)

    def predict(self, values: Values, near: Any = None) -> FloatArray | None:
        """Return what would be measured (N,); None where there is no motion."""
        motion = self.motion(values, near)
        return None if motion is None else self.seen(motion, values)

    def slopes(
        self, unknowns: Sequence[Unknown], factors: Sequence[float], values: Values, motion: Any = None
    ) -> FloatArray:
        """Return derivatives (N, n) by some unknowns' coordinates, by differences of the simulated motion.

        A column is zero where neither neighbour has a motion. ``factors``: value in this test over that of the unknown;
        ``values``: of all unknowns in this test; ``motion``: the one there, where it is known.
        """
        motion = self.motion(values) if motion is None else motion
        if motion is None:
            raise AnalysisError(f"law {self.law.name}: the values found have no steady state, nor another motion")
        at = self.seen(motion, values)
        columns = np.zeros((len(at), len(unknowns)))
        for column, u, times in zip(columns.T, unknowns, factors, strict=True):
            c = u.at(values[u.name] / times)
            for step in self.steps:
                if c + step < u.low:
                    continue
                moved = {**values, u.name: u.value(c + step) * times}
                there = self.seen(motion, moved) if u.name in self.by_sensors else self.predict(moved, motion)
                if there is not None:
                    column[:] = (there - at) / step
                    break
        return columns


def noise_of(covariance: FloatArray) -> dict[str, Any]:
    """Return variances and directions of an observation's noise, by its covariance (N, N)."""
    variances, directions = np.linalg.eigh(covariance)
    return {"variances": np.maximum(variances, 1e-300), "directions": directions}


def of_few(each: FloatArray, assumed: FloatArray) -> FloatArray:
    """Return the covariance (n, n) that samples (m, n) sum up to, so large that its inverse does not promise too much.

    The inverse of a covariance from m samples is too large by ``(m - 1) / (m - n - 2)`` [Hartlap et al., A&A 464 (2007)
    399]. Where they are fewer than ``2 n + 4`` they say little of correlations: these are drawn to those of an assumed
    covariance (n, n).
    """
    (samples, size), shown = each.shape, each.T @ each
    if samples > 2 * size + 3:
        return np.asarray(shown * (samples - 1.0) / (samples - size - 2.0))
    share = min(1.0, (size + 2.0) / samples)
    times = np.sqrt(np.diag(shown) / np.maximum(np.diag(assumed), 1e-300))
    return np.asarray((1.0 - share) * shown + share * assumed * np.outer(times, times))


def at_least(covariance: FloatArray, variance: FloatArray) -> FloatArray:
    """Return a covariance (n, n) with its correlations, and variances that are at least so large (n,)."""
    own = np.diag(covariance)
    times = np.sqrt(np.maximum(own, variance) / np.maximum(own, 1e-300))
    return np.asarray(covariance * np.outer(times, times))
