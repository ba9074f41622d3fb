"""A whole record as an observation: the measured mass, driven by the measured base without its noise."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from frictionlab.analysis.channels import best_penalty, gain_kept, restored, spline
from frictionlab.analysis.measure import channels_of
from frictionlab.analysis.measurement import Measurement
from frictionlab.analysis.signals import student, variance_inflation, white_noise
from frictionlab.arrays import FloatArray
from frictionlab.base_motion import sound_base
from frictionlab.errors import AnalysisError, FrictionlabError
from frictionlab.inference.fit import Fit, fit_from, tempered
from frictionlab.inference.observation import BENDS, SENSORS, Observation, Reached, Values, at_least, of_few
from frictionlab.inference.posterior import model_of
from frictionlab.inference.unknowns import Unknown
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.simulator.laws import Law
from frictionlab.simulator.record import BaseRecord, Response, respond

DENSE = 120.0  # samples per period of drive or frame, whichever is shorter, that a fit needs at most
STEP = 1e-3  # of a prior's standard deviation: finite differences of the simulated record
FEWEST, FEWEST_PERIODS = 64, 4.0  # samples, and periods of the frame, that a record without a cycle has at least
ROUGHER = 10.0  # the penalty's share: noise is left up to a frequency 1.3 times as high
REST = 5.0  # times its sensor's noise from its first value: the base moves
MOVES = 5.0  # times its sensor's noise is a motion
MOST_STEPS = 40
RUNS = 150  # simulated for one fit, about
SHAKES, FEW_SHAKES = 30, 6  # simulated with noise on the base: errors are known to a seventh
FEW_PERIODS = 4  # below so many they say nothing of their scatter
SMALLEST = 1e-9  # of the record's rms: no sensor is better


@dataclass(frozen=True)
class Track:
    """One record.

    ``time`` (n,) s, from the recording's first sample; ``base``, ``mass`` (n,) over Y: the base without its noise about
    its mean, the mass as measured about its mean; ``noise``, ``base_noise``: rms of the white noise of both sensors
    over Y, of one sample, that of the base before it was smoothed away by a ``penalty``: what is left of it shakes the
    simulated mass; ``thin``: one of so many samples was kept after that. ``scale``: Y [m], the amplitude of the base's
    fundamental in the steady cycles, so that beta means the same there and here; without a steady cycle the largest
    displacement of the base from its first value, known to ``scale_u`` (relative). ``period`` of the drive, s; of the
    stretches that a record without a steady cycle is told in. ``natural_frequency``: as it is known, Hz; ``start``: s,
    the first sample by the recording's clock. ``swing``, ``middle``: half the swing of the steady mass, and its middle,
    over Y (of the whole record where nothing is steady): a sensor that bends is told by them.
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
    recording: Recording, scene: Scene, natural_frequency: float, measurement: Measurement | None = None
) -> tuple[Track, tuple[str, ...]]:
    """Return a recording as a fit sees it, and what must be said of it.

    What is known of sensors and log is taken back. The base is smoothed, but less than would bring it nearest to the
    truth: errors hold the noise that is left, not what smoothing takes of the motion. A wall that moves feels the
    base's acceleration, and there noise counts more.

    Without a measurement of its steady cycles Y is the largest displacement of the base from its first value, and the
    record is told in stretches of its base's mean period, at least one of the frame (natural_frequency, Hz).

    Raises
    ------
    RecordingError
        Its base has a gap or jumps: nothing can be simulated across.
    AnalysisError
        Without steady cycles: base or mass do not move, or the record is shorter than four periods of the frame.
    """
    part, said = sound_base(recording)
    step = 1.0 / part.sampling_rate_hz
    mass, base = (
        restored(channel, step, way)
        for channel, way in zip((part.mass_displacement, part.base_displacement), channels_of(scene), strict=True)
    )
    time, rms = part.time - part.time[0], white_noise(base)
    best = best_penalty(base, rms)
    penalty = best / (ROUGHER if scene.model.wall == "fixed" else 1.0)
    smooth = spline(base, penalty) if penalty else base
    if measurement is None:
        noise = white_noise(mass), rms
        _refuse(part, {"mass": (mass, noise[0]), "base": (base, rms)}, natural_frequency)
        usual = float(np.std(np.gradient(smooth, time)) / (2.0 * math.pi * np.std(smooth)))  # Hz
        fastest, drive = max(natural_frequency, usual), min(natural_frequency, usual)
        curve, share = (spline(base, best), gain_kept(best)) if best else (base, 1.0)
        still = max(1, int(np.argmax(np.abs(curve - curve[0]) > REST * rms)))
        zero = float(base[:still].mean())  # while the base still stands
        scale = float(np.abs(curve - zero).max())  # of a hundred tops noise makes one the largest: it counts thrice
        scale_u = rms * math.hypot(3.0 * math.sqrt(share), 1.0 / math.sqrt(still)) / scale
    else:
        noise = measurement.mass_noise_m, measurement.base_noise_m
        drive, scale, scale_u = measurement.drive_frequency_hz, measurement.base_amplitude_m, 0.0
        fastest = max(drive, natural_frequency)
    thin = max(1, int(part.sampling_rate_hz / (DENSE * fastest)))
    time, smooth, mass = time[::thin], smooth[::thin], mass[::thin]
    steady = np.ones(len(time), dtype=bool)
    if measurement is not None:  # the mean of the base is that of whole, settled periods
        settled = max(float(time[-1]) - measurement.transient_s, 1.0 / drive)
        steady = time >= time[-1] - max(1, int(settled * drive)) / drive
        zero = float(smooth[steady].mean())
    mass = (mass - mass.mean()) / scale
    track = Track(
        time=time,
        base=(smooth - zero) / scale,
        mass=mass,
        noise=noise[0] / scale,
        scale=scale,
        period=1.0 / drive,
        base_noise=noise[1] / scale,
        penalty=penalty,
        thin=thin,
        natural_frequency=natural_frequency,
        start=float(part.time[0]),
        swing=max(0.5 * float(np.ptp(mass[steady])), 1e-300),
        middle=0.5 * float(mass[steady].max() + mass[steady].min()),
        scale_u=scale_u,
    )
    return track, tuple(s for s in said if s not in part.source.warnings)


def _refuse(part: Recording, channels: dict[str, tuple[FloatArray, float]], natural_frequency: float) -> None:
    """Refuse a record without a cycle that is too short, or in which mass or base stand still."""
    least = FEWEST_PERIODS / natural_frequency
    if len(part) < FEWEST or part.duration_s < least:
        raise AnalysisError(
            f"record: too short to be compared: expected {FEWEST_PERIODS:g} periods of the frame ({least:.3g} s) and"
            f" {FEWEST} samples; got {part.duration_s:.3g} s and {len(part)} samples: record longer"
        )
    for name, (channel, rms) in channels.items():
        if not float(np.std(channel)) > MOVES * rms:
            raise AnalysisError(
                f"record: the {name} does not move: its {1e6 * float(np.std(channel)):.3g} um rms are its sensor's"
                f" noise: check the {name} column (--{name})"
            )


@dataclass(frozen=True, kw_only=True)
class RecordObservation(Observation):
    """A whole record under a law: unknowns -> the record that would be measured, driven by the measured base.

    Parameters
    ----------
    track : Track
    noise : float
        Rms of the mass sensor's noise, Y; never nothing.
    """

    track: Track
    noise: float
    steps: ClassVar = (STEP, -STEP)
    by_sensors: ClassVar = (*SENSORS, "offset")

    @classmethod
    def of(cls, track: Track, law: Law, held: Values, **known: Any) -> Self:
        """Of a track under a law; `known`: what else an observation is made of."""
        noise = max(track.noise, SMALLEST * track.rms)
        return cls(
            track=track,
            noise=noise,
            law=law,
            held=held,
            unit=track.scale,
            turn=2.0 * math.pi / track.period,
            swing=track.swing,
            data=track.mass,
            variances=noise**2,
            powers=track.rms**2,
            floor=noise / track.rms,
            **known,
        )

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of sensors and rig, of where the mass begins and how fast, and of its sensor's zero."""
        width = max(1.0, 2.0 * self.track.rms)
        words = {
            "start_displacement": "displacement of the mass at the first sample, over Y",
            "start_velocity": "velocity of the mass at the first sample, over omega_n Y",
            "offset": "zero of the mass's sensor, over Y",
        }
        return (*super().rig_unknowns, *(Unknown(name, said, "test", sd=width) for name, said in words.items()))

    @property
    def start(self) -> dict[str, float]:
        """First guesses for the start and the sensor's zero, from the first samples."""
        track = self.track
        few = min(len(track.time), max(4, track.per_period // 40))
        slope, level = np.polyfit(track.time[:few], track.mass[:few], 1)
        zero = -float(track.base.mean())  # of the mass's own mean, which lies where the base's does
        speed = float(slope) / (2.0 * math.pi * track.natural_frequency)
        return {"start_displacement": float(level) - zero, "start_velocity": speed, "offset": zero}

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
        track, here, rng = self.track, self.predict(values), np.random.default_rng(runs)
        if here is None or not track.base_noise:
            return np.zeros((0, len(track.time)))
        changes = []
        for _ in range(runs):
            noise = track.base_noise * rng.standard_normal(track.thin * len(track.base))
            left = (spline(noise, track.penalty) if track.penalty else noise)[:: track.thin]
            there = replace(self, track=replace(track, base=track.base + left)).predict(values)
            changes += [] if there is None else [there - here]
        return np.array(changes).reshape(-1, len(here))

    def share_missed(self, residual: FloatArray, values: Values) -> float:
        """Return the share of its power by which a sample's variance is larger than the noise's.

        What a law leaves is autocorrelated over many samples: one of them then counts with the residual's variance
        times its integrated autocorrelation time.
        """
        changes = self.shaken(values, FEW_SHAKES)
        by_base = float(np.mean(changes**2, axis=1).max()) if len(changes) else 0.0
        spread = spread_of(self.gap(residual), self.noise, by_base)
        return (spread**2 - self.noise**2) / self.track.rms**2

    def covariance(self, at: Reached) -> FloatArray:
        """Return the covariance (m, m) that noise, misfit and the base's noise leave in the coordinates of a fit."""
        gap, per_period = self.gap(at.residual), self.track.per_period
        over = self.over_gap(at.gain)
        covariance = self.noise**2 * (over @ over.T)
        blocks = len(gap) // per_period
        if self.sd[0] > 1.001 * self.noise:
            covariance = at.gain @ at.gain.T
            if blocks >= FEW_PERIODS:
                whole = blocks * per_period
                each = (over[:, :whole] * gap[:whole]).reshape(-1, blocks, per_period).sum(axis=2).T
                few = blocks / max(blocks - 3.0, 1.0)
                grown = each * np.sqrt(few * np.maximum(variance_inflation(each) * student(blocks - 1.0), 1.0))
                covariance = at_least(of_few(grown, covariance), np.diag(covariance))
        shakes = self.shaken(at.values, SHAKES) @ over.T
        return np.asarray(covariance + shakes.T @ shakes / max(len(shakes), 1))


def record_of(found: Fit) -> RecordObservation:
    """Return the observation of a fit to a record.

    Raises
    ------
    TypeError
        It is a fit to another kind of observation.
    """
    observation = found.model.tests[0].observation
    if not isinstance(observation, RecordObservation):
        raise TypeError(f"expected the observation of a record; got {type(observation).__name__}")
    return observation


def fit_record(observation: RecordObservation, starts: Sequence[Values], *, tries: int = 1) -> Fit:
    """Return the best fit of a law to a record, by the solver of cycles.

    All samples count alike with what a start leaves, then with the noise, or with what the law misses.

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
    model = replace(model_of([observation]), most=MOST_STEPS)
    begun: list[tuple[float, FloatArray]] = []
    for start in starts:
        point = np.array([u.at(start[u.name]) if u.name in start else 0.0 for u in model.unknowns])
        point = np.clip(point, *model.bounds)
        predicted = observation.predict(model.values(0, point))
        if predicted is not None:
            begun.append((float(np.var(observation.data - predicted)), point))  # the offset is free
    best: Fit | None = None
    for cost, point in sorted(begun, key=lambda one: one[0])[:tries]:
        share = max(cost - observation.noise**2, 0.0) / observation.track.rms**2
        test = replace(model.tests[0], observation=observation.missing(share))
        found = tempered(fit_from(replace(model, tests=(test,)), [point], tempers=False), np.array([share]))
        if best is None or record_of(found).missed < record_of(best).missed:
            best = found
        if record_of(found).missed <= 0.0:
            break
    if best is None:
        raise AnalysisError(f"record: law {observation.law.name} has no motion at the values tried")
    return best


def spread_of(residual: FloatArray, noise: float, shaken: float = 0.0) -> float:
    """Return the standard deviation that one sample counts with: the noise's, or the residual's with autocorrelation.

    The integrated autocorrelation time in samples is 1 + 2 sum rho, up to the first zero of rho [Geyer 1992]; `shaken`:
    mean square that the base's noise may add; its share of the errors is counted by itself.

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal(4000)
    >>> bool(spread_of(white, 0.1) < 1.1), bool(spread_of(np.repeat(white, 10), 0.1) > 2.8)
    (True, True)
    """
    about, n = residual - residual.mean(), len(residual)
    variance = float(np.mean(about**2))
    if variance <= noise**2 * (1.0 + 3.0 * math.sqrt(2.0 / n)) + shaken:
        return noise
    power = np.abs(np.fft.rfft(about, 1 << (2 * n - 1).bit_length())) ** 2
    rho = np.fft.irfft(power)[: n // 2]
    below = np.flatnonzero(rho <= 0.0)
    end = int(below[0]) if len(below) else len(rho)
    time = max(1.0, 1.0 + 2.0 * float(rho[1:end].sum() / rho[0]))
    return math.sqrt(max(variance * time, noise**2))
