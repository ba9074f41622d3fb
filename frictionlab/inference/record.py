"""A whole record as an observation: the measured mass, driven by the measured base without its noise."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from frictionlab.analysis.channels import best_penalty, gain_kept, restored, spline
from frictionlab.analysis.measure import channels_of
from frictionlab.analysis.measurement import Measurement
from frictionlab.analysis.signals import student, variance_inflation, white_noise
from frictionlab.arrays import FloatArray
from frictionlab.base_motion import sound_base
from frictionlab.errors import AnalysisError, FrictionlabError
from frictionlab.inference.fit import Fit, Model, Test, fit_from, reweighed
from frictionlab.inference.observation import BENDS, SENSORS, Observation, Reached, Values
from frictionlab.inference.observations import at_least, of_few
from frictionlab.inference.unknowns import Unknown, of_law, of_rig
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.simulator.laws import Law
from frictionlab.simulator.problem import Wall
from frictionlab.simulator.record import BaseRecord, Response, prepare, respond
from frictionlab.uncertainty import Sources

DENSE = 120.0  # samples per period of drive or frame, whichever is shorter, that a fit needs at most
STEP = 1e-3  # of a prior's standard deviation: finite differences of the simulated record
FEWEST, FEWEST_PERIODS = 64, 4.0  # samples, and periods of the frame, that a record without a cycle has at least
ROUGHER = 10.0  # the penalty's share: noise is left up to a frequency 1.3 times as high
REST = 5.0  # times its sensor's noise from its first value: the base moves
MOVES = 5.0  # times its sensor's noise is a motion
ROUNDS = 3  # of weighing the residual by what it is
MOST_STEPS = 40
RUNS = 150  # simulated for one fit, about
SHAKES, FEW_SHAKES = 30, 6  # simulated with noise on the base: errors are known to a seventh
FEW_PERIODS = 4  # below so many they say nothing of their scatter
SMALLEST = 1e-9  # of the record's rms: no sensor is better


@dataclass(frozen=True)
class Track:
    """One record.

    Parameters
    ----------
    time : ndarray of shape (n,)
        s, from the recording's first sample.
    base, mass : ndarray of shape (n,)
        Over Y: the base without its noise about its mean, the mass as measured about its mean.
    noise : float
        Rms of the white noise of the mass's sensor over Y, of one sample.
    scale : float
        Y [m]: the amplitude of the base's fundamental in the steady cycles, so that beta means the same there and here;
        without a steady cycle the largest displacement of the base from its first value.
    period : float
        Of the drive, s; of the stretches that a record without a steady cycle is told in.
    base_noise : float
        Rms of the white noise of the base's sensor over Y, of one sample, before it was smoothed away.
    penalty : float
        By which it was smoothed; what is left of the noise shakes the simulated mass.
    thin : int
        One of so many samples was kept after that.
    natural_frequency : float
        As it is known, Hz.
    start : float
        s, the first sample by the recording's clock.
    swing, middle : float
        Half the swing of the steady mass, and its middle, over Y: of the whole record where nothing is steady. A sensor
        that bends is told by them.
    scale_u : float
        Relative error of Y, where it is the size of one motion and no mean of many cycles.
    """

    time: FloatArray
    base: FloatArray
    mass: FloatArray
    noise: float
    scale: float
    period: float
    base_noise: float
    penalty: float
    thin: int
    natural_frequency: float
    start: float
    swing: float
    middle: float
    scale_u: float = 0.0

    def noise_left(self, generator: np.random.Generator) -> FloatArray:
        """Draw what is left in the base (n,) of its sensor's noise, over Y."""
        noise = self.base_noise * generator.standard_normal(self.thin * len(self.base))
        return (spline(noise, self.penalty) if self.penalty else noise)[:: self.thin]

    @property
    def rms(self) -> float:
        """Rms of the measured mass about its mean, over Y."""
        return float(np.std(self.mass))

    @property
    def periods(self) -> int:
        """Whole periods in the record."""
        return int(float(self.time[-1]) / self.period + 1e-6)

    @property
    def per_period(self) -> int:
        """Samples per period of the drive."""
        return max(8, round(self.period * (len(self.time) - 1) / float(self.time[-1] - self.time[0])))


def track_of(
    recording: Recording, scene: Scene, measurement: Measurement, natural_frequency: float
) -> tuple[Track, tuple[str, ...]]:
    """Return a recording with a steady cycle as a fit sees it, and what must be said of it.

    Raises
    ------
    RecordingError
        Its base has a gap or jumps: nothing can be simulated across.
    """
    drive = measurement.drive_frequency_hz
    part, said = _sound(recording, scene)
    drawn = _Drawn.of(part, scene).thinned(max(drive, natural_frequency), part.sampling_rate_hz)
    steady = max(float(drawn.time[-1]) - measurement.transient_s, 1.0 / drive)
    whole = max(1, int(steady * drive))  # periods: the mean of the base is that of whole, settled ones
    middle = float(drawn.base[drawn.time >= drawn.time[-1] - whole / drive].mean())
    noise = measurement.mass_noise_m, measurement.base_noise_m
    return drawn.track(natural_frequency, middle, measurement.base_amplitude_m, drive, noise, steady=whole), said


def unsteady_track(recording: Recording, scene: Scene, natural_frequency: float) -> tuple[Track, tuple[str, ...]]:
    """Return a recording without a steady cycle as a fit sees it, and what must be said of it.

    Y is the largest displacement of the base from its first value; the record is told in stretches of its base's mean
    period, at least one of the frame.

    Raises
    ------
    RecordingError
        Its base has a gap or jumps: nothing can be simulated across.
    AnalysisError
        Base or mass do not move, or the record is shorter than four periods of the frame.
    """
    part, said = _sound(recording, scene)
    _refuse_short(part, natural_frequency)
    noise = white_noise(part.mass_displacement), white_noise(part.base_displacement)
    _refuse_still(part, noise)
    drawn = _Drawn.of(part, scene)
    usual = float(np.std(np.gradient(drawn.base, drawn.time)) / (2.0 * math.pi * np.std(drawn.base)))  # Hz
    drawn = drawn.thinned(max(natural_frequency, usual), part.sampling_rate_hz)
    first, size, error = _size(part.base_displacement, noise[1])
    track = drawn.track(natural_frequency, first, size, min(natural_frequency, usual), noise)
    return replace(track, scale_u=error / size), said


def _size(base: FloatArray, noise: float) -> tuple[float, float, float]:
    """First value of the base, its largest displacement from there, and the error of that (m).

    The mean is taken while the base still stands. Of a hundred tops noise makes one the largest: it counts thrice.
    """
    penalty = best_penalty(base, noise)
    curve, share = (spline(base, penalty), gain_kept(penalty)) if penalty else (base, 1.0)
    still = max(1, int(np.argmax(np.abs(curve - curve[0]) > REST * noise)))
    first = float(base[:still].mean())
    size = float(np.abs(curve - first).max())
    return first, size, noise * math.hypot(3.0 * math.sqrt(share), 1.0 / math.sqrt(still))


def _refuse_short(part: Recording, natural_frequency: float) -> None:
    least = FEWEST_PERIODS / natural_frequency
    if len(part) < FEWEST or part.duration_s < least:
        raise AnalysisError(
            f"record: too short to be compared: expected {FEWEST_PERIODS:g} periods of the frame ({least:.3g} s) and"
            f" {FEWEST} samples; got {part.duration_s:.3g} s and {len(part)} samples: record longer"
        )


def _refuse_still(part: Recording, noise: tuple[float, float]) -> None:
    channels = {"mass": part.mass_displacement, "base": part.base_displacement}
    for (name, channel), rms in zip(channels.items(), noise, strict=True):
        if not float(np.std(channel)) > MOVES * rms:
            raise AnalysisError(
                f"record: the {name} does not move: its {1e6 * float(np.std(channel)):.3g} um rms are its sensor's"
                f" noise: check the {name} column (--{name})"
            )


def _sound(recording: Recording, scene: Scene) -> tuple[Recording, tuple[str, ...]]:
    """The part that can be simulated, what is known of sensors and log taken back, and what must be said of it."""
    part, said = sound_base(recording)
    of_mass, of_base = channels_of(scene)
    step = 1.0 / part.sampling_rate_hz
    back = replace(
        part,
        mass_displacement=restored(part.mass_displacement, step, of_mass),
        base_displacement=restored(part.base_displacement, step, of_base),
    )
    return back, tuple(s for s in said if s not in part.source.warnings)


@dataclass(frozen=True)
class _Drawn:
    """A sound part of a recording (m): the base without its noise, thinned to what a fit needs; ``time`` from 0."""

    time: FloatArray
    base: FloatArray
    mass: FloatArray
    penalty: float
    thin: int
    start: float

    @classmethod
    def of(cls, part: Recording, scene: Scene) -> Self:
        """Smooth the base, but less than would bring it nearest to the truth.

        The fit's errors hold the noise that is left, not what smoothing takes of the motion. A wall that moves feels
        the base's acceleration, and there noise counts more.
        """
        penalty = best_penalty(part.base_displacement, white_noise(part.base_displacement))
        penalty /= ROUGHER if scene.model.wall == "fixed" else 1.0
        base = spline(part.base_displacement, penalty) if penalty else part.base_displacement
        return cls(part.time - part.time[0], base, part.mass_displacement, penalty, 1, float(part.time[0]))

    def thinned(self, highest: float, rate: float) -> Self:
        """Keep what the highest frequency needs; both in Hz."""
        k = max(1, int(rate / (DENSE * highest)))
        return replace(self, time=self.time[::k], base=self.base[::k], mass=self.mass[::k], thin=k)

    def track(
        self,
        natural_frequency: float,
        zero: float,
        scale: float,
        drive: float,
        noise: tuple[float, float],
        *,
        steady: float = math.inf,
    ) -> Track:
        """The same over a scale (m), the base from its zero (m), the mass from its mean.

        `drive`: Hz; `steady`: so many of its last periods are of a steady motion, if any are.
        """
        mass = (self.mass - self.mass.mean()) / scale
        last = mass[self.time >= self.time[-1] - steady / drive]
        return Track(
            time=self.time,
            base=(self.base - zero) / scale,
            mass=mass,
            noise=noise[0] / scale,
            scale=scale,
            period=1.0 / drive,
            base_noise=noise[1] / scale,
            penalty=self.penalty,
            thin=self.thin,
            natural_frequency=natural_frequency,
            start=self.start,
            swing=max(0.5 * float(np.ptp(last)), 1e-300),
            middle=0.5 * float(last.max() + last.min()),
        )


@dataclass(frozen=True)
class RecordObservation(Observation):
    """A whole record under a law: unknowns -> the record that would be measured, driven by the measured base.

    Parameters
    ----------
    track : Track
    law : Law
    held : mapping of str to float
        Parameters of the law that the scene holds.
    wall : {"fixed", "base"}
    sources : Sources
        What is not known of sensors and rig.
    r : float
        Frequency ratio that speeds are over; 1 for a record without a steady cycle.
    material : str, optional
    spread : float
        Standard deviation that one sample counts with, Y: the noise's, or what the law leaves, autocorrelation counted.
    """

    track: Track
    law: Law
    held: Values
    wall: Wall
    sources: Sources
    r: float
    material: str | None = None
    spread: float = 0.0
    normal_force: float | None = None
    steps: ClassVar = (STEP, -STEP)
    by_sensors: ClassVar = (*SENSORS, "offset")

    @property
    def noise(self) -> float:
        """Rms of the mass sensor's noise, Y; never nothing."""
        return max(self.track.noise, SMALLEST * self.track.rms)

    @property
    def variances(self) -> float:
        """Of the noise, of one sample."""
        return self.noise**2

    @property
    def powers(self) -> float:
        """Mean square of the measured mass about its mean."""
        return self.track.rms**2

    @cached_property
    def sd(self) -> FloatArray:
        """Standard deviation that each sample counts with (n,), Y."""
        return np.full(len(self.track.mass), max(self.spread, self.noise))

    def missing(self, share: float) -> Self:
        """Return the record with a share of its power counted as what the law misses; 0: nothing but noise."""
        return replace(self, spread=math.hypot(self.noise, math.sqrt(share) * self.track.rms))

    @property
    def unit(self) -> float:
        """Y [m]."""
        return self.track.scale

    @property
    def turn(self) -> float:
        """Angular frequency of the drive, rad/s."""
        return 2.0 * math.pi / self.track.period

    @property
    def data(self) -> FloatArray:
        """What is fitted (n,)."""
        return self.track.mass

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of sensors, rig and the start of the motion."""
        made = of_rig(self.sources, self.held, amplitude=self.track.swing, unit=self.track.scale, distorted=False)
        return (*made, *start_unknowns(self.track))

    def problem(self, values: Values) -> Problem:
        """Return the problem at some values, speeds over omega Y."""
        return self.simulated(values, self.r)

    def base(self, values: Values) -> BaseRecord:
        """Return the record's base in the time of the frame, without what its channel shows of the mass."""
        frequency = self.track.natural_frequency * (1.0 + values.get("natural_frequency", 0.0))
        mixed, base = values.get("mass_in_base", 0.0), self.track.base
        if mixed:
            own = base - mixed * self.track.mass
            base = np.asarray(own * float(np.dot(base, base) / np.dot(own, base)))
        return BaseRecord(2.0 * math.pi * frequency * self.track.time, base, rest=0.0, scale=1.0)

    def motion(self, values: Values, near: Response | None = None) -> Response | None:  # noqa: ARG002 - from the start
        """Return the simulated motion at some values; None where the simulator has none."""
        start = values.get("start_displacement", 0.0), values.get("start_velocity", 0.0)
        try:
            return respond(self.problem(values).in_frame_time(), self.base(values), x0=start[0], v0=start[1])
        except (FrictionlabError, ArithmeticError, ValueError, np.linalg.LinAlgError):
            return None  # no motion to compare with: these values are no candidate

    def seen(self, motion: Response, values: Values) -> FloatArray:
        """Return a motion through the sensors: gain, lag of the base's channel, offset, crosstalk, bends.

        A bend grows with the place, from -1 to 1 in the steady motion.
        """
        frequency = self.track.natural_frequency * (1.0 + values.get("natural_frequency", 0.0))
        late = 2.0 * math.pi * values.get("lag_s", 0.0) * frequency  # rad of the frame
        moved = motion.displacement
        if late != 0.0:
            from scipy.interpolate import CubicHermiteSpline  # noqa: PLC0415 - heavy, and most often not needed

            moved = CubicHermiteSpline(motion.time, moved, motion.velocity)(motion.time + late)
        shown = (1.0 + values.get("gain", 0.0)) * moved + values.get("offset", 0.0)
        if values.get("base_in_mass"):
            shown = shown + values["base_in_mass"] * self.track.base
        place = (shown - self.track.middle) / self.track.swing
        for name, power in BENDS.items():
            if values.get(name):
                shown = shown + values[name] * self.track.swing * place**power
        return np.asarray(shown)

    def shaken(self, values: Values, runs: int) -> FloatArray:
        """Return changes (runs, n) of the record by what is left in the base of its sensor's noise."""
        here, rng, changes = self.predict(values), np.random.default_rng(runs), []
        if here is None or not self.track.base_noise:
            return np.zeros((0, len(self.track.time)))
        for _ in range(runs):
            noisy = replace(self.track, base=self.track.base + self.track.noise_left(rng))
            there = replace(self, track=noisy).predict(values)
            changes += [] if there is None else [there - here]
        return np.array(changes).reshape(-1, len(here))

    def covariance(self, at: Reached) -> FloatArray:
        """Return the covariance (m, m) that noise, misfit and the base's noise leave in the coordinates of a fit."""
        gain, gap, per_period = at.gain, self.gap(at.residual), self.track.per_period
        over = gain / self.sd
        covariance = self.noise**2 * (over @ over.T)
        blocks = len(gap) // per_period
        if self.spread > 1.001 * self.noise:
            covariance = gain @ gain.T
            if blocks >= FEW_PERIODS:
                whole = blocks * per_period
                each = (over[:, :whole] * gap[:whole]).reshape(-1, blocks, per_period).sum(axis=2).T
                few = blocks / max(blocks - 3.0, 1.0)
                grown = each * np.sqrt(few * np.maximum(variance_inflation(each) * student(blocks - 1.0), 1.0))
                covariance = at_least(of_few(grown, covariance), np.diag(covariance))
        shakes = self.shaken(at.values, SHAKES) @ over.T
        return np.asarray(covariance + shakes.T @ shakes / max(len(shakes), 1))


def record_of(test: Test) -> RecordObservation:
    """Return the observation of a fit's test, which is one of a record.

    Raises
    ------
    TypeError
        It is another kind of observation.
    """
    if not isinstance(test.observation, RecordObservation):
        raise TypeError(f"expected the observation of a record; got {type(test.observation).__name__}")
    return test.observation


def fit_record(observation: RecordObservation, starts: Sequence[Mapping[str, float]], *, tries: int = 1) -> Fit:
    """Return the best fit of a law to a record, by the solver of cycles.

    What a law leaves is autocorrelated over many samples: one of them then counts with the residual's variance times
    its integrated autocorrelation time.

    Parameters
    ----------
    observation : RecordObservation
    starts : sequence of mapping
        Values to begin at.
    tries : int
        So many of the best starts are followed, until one leaves nothing but noise.

    Raises
    ------
    AnalysisError
        No start has a motion.
    """
    law = observation.law
    unknowns = (*of_law(law, observation.held), *observation.rig_unknowns)
    test = Test(observation, np.arange(len(unknowns)), np.ones(len(unknowns)))
    model = Model((test,), unknowns, np.zeros(len(unknowns)), most=MOST_STEPS)
    points = [_point(model, start) for start in starts]
    values = model.values(0, points[0])
    prepare(observation.problem(values).in_frame_time(), observation.base(values), RUNS)
    gaps = [_gap(model, point) for point in points]
    costs = np.array([math.inf if gap is None else float(np.var(gap)) for gap in gaps])  # the offset is free
    if not np.isfinite(costs).any():
        raise AnalysisError(f"record: law {law.name} has no motion at the values tried")
    best: Fit | None = None
    for k in np.argsort(costs)[:tries]:
        if not math.isfinite(costs[k]):
            continue
        found = _followed(model, points[k], math.sqrt(float(costs[k])))
        own = record_of(found.model.tests[0])
        if best is None or own.sd[0] < record_of(best.model.tests[0]).sd[0]:
            best = found
        if own.spread <= own.noise:
            break
    if best is None:
        raise AnalysisError(f"record: law {law.name} has no motion at the values tried")
    return best


def _point(model: Model, values: Values) -> FloatArray:
    point = np.array([u.at(values[u.name]) if u.name in values else 0.0 for u in model.unknowns])
    inside: FloatArray = np.clip(point, *model.bounds)
    return inside


def _gap(model: Model, point: FloatArray) -> FloatArray | None:
    observation = model.tests[0].observation
    predicted = observation.predict(model.values(0, point))
    return None if predicted is None else observation.data - predicted


def _followed(model: Model, point: FloatArray, spread: float) -> Fit:
    """The fit with all samples alike, each counting with the noise, if that is all, or with what the law leaves."""
    test = model.tests[0]
    first = (replace(test, observation=replace(record_of(test), spread=spread)),)
    fit = fit_from(replace(model, tests=first), [point], tempers=False)
    changes = record_of(fit.model.tests[0]).shaken(fit.values(), FEW_SHAKES)
    shaken = float(np.mean(changes**2, axis=1).max()) if len(changes) else 0.0
    for _ in range(ROUNDS):
        own = record_of(fit.model.tests[0])
        before, spread = spread, spread_of(own.gap(fit.residual()), own.noise, shaken)
        if abs(spread / before - 1.0) < 0.05:
            break
        fit = reweighed(fit, (replace(test, observation=replace(own, spread=spread)),))
    return fit


def spread_of(residual: FloatArray, noise: float, shaken: float = 0.0) -> float:
    """Return the standard deviation that one sample counts with: the noise's, or the residual's with autocorrelation.

    `shaken`: mean square that the base's noise may add; its share of the errors is counted by itself.
    """
    about = residual - residual.mean()
    variance = float(np.mean(about**2))
    if variance <= noise**2 * (1.0 + 3.0 * math.sqrt(2.0 / len(residual))) + shaken:
        return noise
    return math.sqrt(max(variance * autocorrelation_time(about), noise**2))


def autocorrelation_time(about: FloatArray) -> float:
    """Return the integrated autocorrelation time in samples: 1 + 2 sum rho, up to the first zero of rho [Geyer 1992].

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal(4000)
    >>> bool(autocorrelation_time(white) < 1.2), bool(autocorrelation_time(np.repeat(white, 10)) > 8.0)
    (True, True)
    """
    n = len(about)
    size = 1 << (2 * n - 1).bit_length()
    power = np.abs(np.fft.rfft(about, size)) ** 2
    rho = np.fft.irfft(power, size)[: n // 2]
    rho = rho / rho[0]
    below = np.flatnonzero(rho <= 0.0)
    end = int(below[0]) if len(below) else len(rho)
    return max(1.0, 1.0 + 2.0 * float(rho[1:end].sum()))


def start_unknowns(track: Track) -> tuple[Unknown, ...]:
    """Return what nobody knows of a record's start: where the mass stands and how fast it is, and the sensor's zero."""
    width = max(1.0, 2.0 * track.rms)
    return (
        Unknown("start_displacement", "displacement of the mass at the first sample, over Y", "test", sd=width),
        Unknown("start_velocity", "velocity of the mass at the first sample, over omega_n Y", "test", sd=width),
        Unknown("offset", "zero of the mass's sensor, over Y", "test", sd=width),
    )


def start_values(track: Track) -> dict[str, float]:
    """Return first guesses for them, from the first samples."""
    few = min(len(track.time), max(4, track.per_period // 40))
    omega = 2.0 * math.pi * track.natural_frequency
    slope, level = np.polyfit(track.time[:few], track.mass[:few], 1)
    zero = -float(track.base.mean())  # of the mass's own mean, which lies where the base's does
    return {"start_displacement": float(level) - zero, "start_velocity": float(slope) / omega, "offset": zero}
