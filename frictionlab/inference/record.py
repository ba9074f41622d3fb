"""A whole record: the measured mass, driven by the measured base without its noise; and its friction over time.

A small change of beta during a period moves the record by its sensitivity dx/dbeta there; the residual shows how large
it was. The changes are smoothed as a random walk from period to period, whose step is the one that makes the values
most likely (Kalman's filter; Rauch, Tung and Striebel 1965). A motion needs some periods to follow (near resonance
many): what friction did shows so much later, and is put where it happened. Where friction changes by more than a
little, the record is simulated at several friction ratios.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from frictionlab.analysis.channels import best_penalty, gain_kept, restored, spline
from frictionlab.analysis.measurement import Measurement, material_of, normal_force_of, source_of, sources_of_test
from frictionlab.analysis.signals import student, variance_inflation, white_noise
from frictionlab.analysis.stretches import channels_of
from frictionlab.arrays import FloatArray
from frictionlab.base_motion import sound_base
from frictionlab.errors import NO_FREQUENCY, AnalysisError
from frictionlab.inference.comparison import MATTERS, WholeRecord
from frictionlab.inference.observation import BENDS, NO_MOTION, SENSORS, Observation, Reached, Values, at_least, of_few
from frictionlab.inference.unknowns import Unknown
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator.laws import Law
from frictionlab.simulator.record import BaseRecord, Response, respond

DENSE = 120.0  # samples per period of drive or frame, whichever is shorter, that a fit needs at most
STEP = 1e-3  # of a prior's standard deviation: finite differences of the simulated record
FEWEST, FEWEST_PERIODS = 64, 4.0  # samples, and periods of the frame, that a record without a cycle has at least
ROUGHER = 10.0  # the penalty's share: noise is left up to a frequency 1.3 times as high
REST = 5.0  # times its sensor's noise from its first value: the base moves
MOVES = 5.0  # times its sensor's noise is a motion
SEARCH = (1.0, 0.5, 0.7, 0.85, 1.2, 1.5, 2.0)  # friction ratios that a fit tries, over the cycle's
TRIED = tuple(np.geomspace(0.01, 2.0, 12).tolist())  # friction ratios to begin from without a cycle, ...
OFF = 0.003  # ... and what its natural frequency begins off by, relative
SHAKES, FEW_SHAKES = 30, 6  # simulated with noise on the base: errors are known to a seventh
FEW_PERIODS = 4  # below so many they say nothing of their scatter
COST = 0.12  # steps of integration that a sample costs; half as much again under a contact that yields
SMALLEST = 1e-9  # of the record's rms: no sensor is better
STEPS = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 41)])  # of the walk, over beta, that are tried
WIDE = 10.0  # over beta: what is known of the first value
SMALL = 1e-3  # relative change of beta for its derivative
LINEAR, UNTOLD = 0.5, 10.0  # times beta: the largest change that is believed, and the error where none is
SHAKES_OVER_TIME = 10  # draws of the base's noise, for what it does to single periods
BAD = 3.0  # times the usual rms of what is left of a period, from which its own counts
SETTLES = 200  # periods, at most, that a motion is followed after a step of friction
GRID = (-2.0, -1.0, 0.0, 1.0, 2.0)  # friction ratios simulated where it changes, in rms of its changes
NOTABLE = 3e-3  # relative rms of the changes from which one derivative does not do
LEAVES = 2.0  # times the usual misfit of a period at which the prediction has left the measurement
ABOVE_NOISE = 3.0  # times the sensor's noise, at least
FEW_SHOWN = 3  # periods, at most, that show no usual one
CALM = 3  # periods below that end such a stretch
SPEEDS = 3.0  # times what a mass is seen to move at first, and how fast: what its first velocity may be


@dataclass(frozen=True, kw_only=True)
class RecordObservation(Observation):
    """A whole record under a law: unknowns -> the record that would be measured, driven by the measured base.

    The data are the mass as measured, about its mean. Y (`unit`, known to ``unit_u``, relative) is the amplitude of the
    base's fundamental in the steady cycles, so that beta means the same there and here; without a steady cycle the
    largest displacement of the base from its first value.

    ``time`` (n,) s, from the sample that the recording's clock has at ``begin``; ``base`` (n,) over Y, without its
    noise, about its mean; ``noise``, ``base_noise``: rms of the white noise of one sample of both sensors, Y, that of
    the base before it was smoothed away by a ``penalty``: what is left of it shakes the simulated mass; ``thin``: one
    of so many samples was kept after that. ``period`` of the drive, s; of the stretches that a record without a steady
    cycle is reported in. ``natural_frequency``: as it is known, Hz. ``middle`` of the steady mass (of the whole record
    where nothing is steady), Y: a sensor bends about it.
    """

    time: FloatArray
    base: FloatArray
    noise: float
    base_noise: float
    penalty: float
    thin: int
    unit_u: float
    period: float
    natural_frequency: float
    begin: float
    middle: float
    kind: ClassVar = "record"
    noise_words: ClassVar = "noise of its sensor"
    steps: ClassVar = (STEP, -STEP)
    by_sensors: ClassVar = (*SENSORS, "offset")
    shows_rig: ClassVar = True

    @property
    def rms(self) -> float:
        """Rms of the measured mass about its mean, over Y."""
        return float(np.std(self.data))

    @property
    def periods(self) -> int:
        """Whole periods in the record."""
        return int(float(self.time[-1]) / self.period + 1e-6)

    @property
    def per_period(self) -> int:
        """Samples per period of the drive."""
        return max(8, round(self.period * (len(self.time) - 1) / float(self.time[-1] - self.time[0])))

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of sensors and rig, of where the mass begins and how fast, and of its sensor's zero."""
        width = max(1.0, 2.0 * self.rms)
        words = {
            "start_displacement": "displacement of the mass at the first sample, over Y",
            "start_velocity": "velocity of the mass at the first sample, over omega_n Y",
            "offset": "zero of the mass's sensor, over Y",
        }
        first = self.data[self.time * self.natural_frequency < 1.0]  # a mass that is seen to rest begins without speed
        widths = dict.fromkeys(words, width) | {
            "start_velocity": SPEEDS * (abs(self.start["start_velocity"]) + float(np.std(first)))
        }
        return (*super().rig_unknowns, *(Unknown(name, said, "test", sd=widths[name]) for name, said in words.items()))

    def tried(self, near: Values) -> list[dict[str, float]]:
        """Return values to begin at: friction about that of a cycle, or any, with a frame that is a little off."""
        known, free = self.start | dict(near), "beta" not in self.held
        if near:
            return [known | {"beta": times * known["beta"]} for times in SEARCH] if free else [known]
        betas, sides = TRIED if free else (self.held["beta"],), (0.0, -1.0, 1.0)
        return [known | {"beta": b, "natural_frequency": side * OFF} for b in betas for side in sides]

    def begun(self, values: Values) -> Self:
        """Return the record with what some values leave counted beside its noise, in all samples alike."""
        predicted = self.predict(values)
        left = math.inf if predicted is None else float(np.var(self.data - predicted))  # the offset is free
        return self.missing(max(left - self.noise**2, 0.0) / self.rms**2)

    @property
    def start(self) -> dict[str, float]:
        """First guesses for the start and the sensor's zero, from the first samples."""
        few = min(len(self.time), max(4, self.per_period // 40))
        slope, level = np.polyfit(self.time[:few], self.data[:few], 1)
        zero = -float(self.base.mean())  # of the mass's own mean, which lies where the base's does
        speed = float(slope) / (2.0 * math.pi * self.natural_frequency)
        return {"start_displacement": float(level) - zero, "start_velocity": speed, "offset": zero}

    def _turn_of_frame(self, values: Values) -> float:
        """Angular frequency of the frame, rad/s."""
        return 2.0 * math.pi * (self.natural_frequency * (1.0 + values.get("natural_frequency", 0.0)))

    def drive(self, values: Values) -> BaseRecord:
        """Return the record's base in the time of the frame, without what its channel shows of the mass."""
        mixed, base = values.get("mass_in_base", 0.0), self.base
        if mixed:
            own = base - mixed * self.data
            base = np.asarray(own * float(np.dot(base, base) / np.dot(own, base)))
        return BaseRecord(self._turn_of_frame(values) * self.time, base, rest=0.0, scale=1.0)

    def motion(self, values: Values, near: Response | None = None) -> Response | None:  # noqa: ARG002 - from the start
        """Return the simulated motion at some values; None where the simulator has none."""
        start = values.get("start_displacement", 0.0), values.get("start_velocity", 0.0)
        self.work.take((COST if self.law.kind == "rigid" else 1.5 * COST) * len(self.time))
        try:
            return respond(self.problem(values).in_frame_time(), self.drive(values), x0=start[0], v0=start[1])
        except NO_MOTION:
            return None

    def seen(self, motion: Response, values: Values) -> FloatArray:
        """Return a motion through the sensors: gain, lag of the base's channel, offset, crosstalk, bends.

        A bend grows with the place, from -1 to 1 in the steady motion.
        """
        late = values.get("lag_s", 0.0) * self._turn_of_frame(values)  # rad of the frame
        moved = motion.displacement
        if late != 0.0:
            from scipy.interpolate import CubicHermiteSpline  # noqa: PLC0415 - heavy, and most often not needed

            moved = CubicHermiteSpline(motion.time, moved, motion.velocity)(motion.time + late)
        shown = (1.0 + values.get("gain", 0.0)) * moved + values.get("offset", 0.0)
        shown = shown + values.get("base_in_mass", 0.0) * self.base
        place = (shown - self.middle) / self.swing
        for name, power in BENDS.items():
            if values.get(name):
                shown = shown + values[name] * self.swing * place**power
        return np.asarray(shown)

    @property
    def friction_by_energy(self) -> float | None:
        """Friction ratio as energy over the path slid, from the first sample to the last, the rig as it is known.

        What the base puts in, ``int y dx``, less what spring and mass hold at the end and the frame's dashpot takes.
        What a dashpot at the contact takes in counts. None for a wall that moves.
        """
        if self.wall != "fixed":
            return None
        time, penalty = self._turn_of_frame({}) * self.time, best_penalty(self.data, self.noise)
        x = self.data - self.start["offset"] if not penalty else spline(self.data - self.start["offset"], penalty)
        speed, rate = np.gradient(x, time), np.gradient(self.base, time)
        taken = 2.0 * self.held.get("frame_damping_ratio", 0.0) * (speed - rate) * speed
        stored = 0.5 * float(x[-1] ** 2 - x[0] ** 2 + speed[-1] ** 2 - speed[0] ** 2)
        path = float(np.abs(np.diff(x)).sum())
        return (float(np.trapezoid(self.base * speed - taken, time)) - stored) / path if path else None

    def shaken(self, values: Values, runs: int) -> FloatArray:
        """Return changes (runs, n) of the record by what is left in the base of its sensor's noise."""
        here, rng, changes = self.predict(values), np.random.default_rng(runs), []
        for _ in range(runs if here is not None and self.base_noise else 0):
            noise = self.base_noise * rng.standard_normal(self.thin * len(self.base))
            left = (spline(noise, self.penalty) if self.penalty else noise)[:: self.thin]
            there = replace(self, base=self.base + left).predict(values)
            changes += [] if there is None or here is None else [there - here]
        return np.array(changes).reshape(-1, len(self.data))

    def share_missed(self, residual: FloatArray, values: Values) -> float:
        """Return the share of its power by which a sample's variance is larger than the noise's.

        What a law leaves is autocorrelated over many samples: one of them then counts with the residual's variance
        times its integrated autocorrelation time.
        """
        gap = self.gap(residual)
        spread = spread_of(gap, self.noise)
        if spread > self.noise:  # or the base's noise need not be asked
            changes = self.shaken(values, FEW_SHAKES)
            spread = spread_of(gap, self.noise, float(np.mean(changes**2, axis=1).max(initial=0.0)))
        return (spread**2 - self.noise**2) / self.rms**2

    def left_out(self, residual: FloatArray, slopes: FloatArray, gain: FloatArray) -> tuple[FloatArray, float | None]:
        """Return the sum of squares over the noise's of what a fit leaves in each period, and the nrmse.

        One period moves no value.
        """
        del slopes, gain
        whole = max(len(self.data) // self.per_period, 1)
        parts = np.array_split(self.gap(residual)[: whole * self.per_period] / self.noise, whole)
        return np.array([float(part @ part) for part in parts]), self.nrmse(residual)

    def covariance(self, at: Reached) -> FloatArray:
        """Return the covariance (m, m) that noise, misfit and the base's noise leave in the coordinates of a fit."""
        gap, over, per_period = self.gap(at.residual), self.over_gap(at.gain), self.per_period
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


def observe_record(
    recording: Recording, scene: Scene, law: Law, held: Values, measurement: Measurement | None = None
) -> tuple[RecordObservation, tuple[str, ...]]:
    """Return a recording as a fit sees it, and what must be said of it; its base without a gap, mass and base moving.

    What is known of sensors and log is taken back. The base is smoothed, but less than would bring it nearest to the
    truth: errors hold the noise that is left, not what smoothing takes of the motion. A wall that moves feels the
    base's acceleration, and there noise counts more. Without a ``measurement`` of steady cycles the record is reported
    in stretches of its base's mean period, at least one of the frame.
    """
    natural = scene.rig.natural_frequency or math.nan
    part, said = sound_base(recording)
    mass, base = (
        restored(channel, 1.0 / part.sampling_rate_hz, way)
        for channel, way in zip((part.mass_displacement, part.base_displacement), channels_of(scene), strict=True)
    )
    time, rms = part.time - part.time[0], white_noise(base)
    best = best_penalty(base, rms)
    penalty = best / (ROUGHER if scene.model.wall == "fixed" else 1.0)
    smooth = spline(base, penalty) if penalty else base
    unit_u, zero = 0.0, 0.0
    if measurement is None:
        noise = white_noise(mass), rms
        _refuse(part, {"mass": (mass, noise[0]), "base": (base, rms)}, natural)
        usual = float(np.std(np.gradient(smooth, time)) / (2.0 * math.pi * np.std(smooth)))  # Hz
        fastest, drive = max(natural, usual), min(natural, usual)
        zero, unit, unit_u = _largest(base, rms, best)
    else:
        noise = measurement.mass_noise_m, measurement.base_noise_m
        drive, unit = measurement.drive_frequency_hz, measurement.base_amplitude_m
        fastest = max(drive, natural)
    thin = max(1, int(part.sampling_rate_hz / (DENSE * fastest)))
    time, smooth, mass = time[::thin], smooth[::thin], mass[::thin]
    steady = np.ones(len(time), dtype=bool)
    if measurement is not None:  # the mean of the base is that of whole, settled periods
        settled = max(float(time[-1]) - measurement.transient_s, 1.0 / drive)
        steady = time >= time[-1] - max(1, int(settled * drive)) / drive
        zero = float(smooth[steady].mean())
    mass = (mass - mass.mean()) / unit
    size, power = max(noise[0] / unit, SMALLEST * float(np.std(mass))), float(np.std(mass)) ** 2
    observation = RecordObservation(
        source=source_of(recording),
        law=law,
        held=held,
        wall=scene.model.wall,
        material=material_of(recording, scene),
        normal_force=normal_force_of(recording, scene),
        r=1.0 if measurement is None else drive / natural,
        sources=sources_of_test(recording, scene, recording.sampling_rate_hz),
        unit=unit,
        turn=2.0 * math.pi * drive,
        swing=max(0.5 * float(np.ptp(mass[steady])), 1e-300),
        data=mass,
        variances=size**2,
        powers=power,
        floor=size / math.sqrt(power),
        time=time,
        base=(smooth - zero) / unit,
        noise=size,
        base_noise=noise[1] / unit,
        penalty=penalty,
        thin=thin,
        unit_u=unit_u,
        period=1.0 / drive,
        natural_frequency=natural,
        begin=float(part.time[0]),
        middle=0.5 * float(mass[steady].max() + mass[steady].min()),
    )
    return observation, tuple(s for s in said if s not in part.source.warnings)


def _largest(base: FloatArray, rms: float, penalty: float) -> tuple[float, float, float]:
    """First value of the base, its largest displacement from there (m), and what that is known to (relative)."""
    curve, share = (spline(base, penalty), gain_kept(penalty)) if penalty else (base, 1.0)
    still = max(1, int(np.argmax(np.abs(curve - curve[0]) > REST * rms)))
    zero = float(base[:still].mean())  # while the base still stands
    largest = float(np.abs(curve - zero).max())  # of a hundred tops noise makes one the largest: it counts thrice
    return zero, largest, rms * math.hypot(3.0 * math.sqrt(share), 1.0 / math.sqrt(still)) / largest


def _refuse(part: Recording, channels: dict[str, tuple[FloatArray, float]], natural_frequency: float) -> None:
    """Refuse a record without a cycle that is too short, or in which mass or base stand still."""
    if math.isnan(natural_frequency):
        raise AnalysisError(f"record: {NO_FREQUENCY}")
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


def spread_of(residual: FloatArray, noise: float, shaken: float = 0.0) -> float:
    """Return the standard deviation that one sample counts with: the noise's, or the residual's with autocorrelation.

    The integrated autocorrelation time in samples is 1 + 2 sum rho, up to the first zero of rho [Geyer 1992]; `shaken`:
    mean square that the base's noise may add; its share of the errors is counted by itself.
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


def follow(observation: RecordObservation, values: Mapping[str, float], *, fits_start: bool) -> WholeRecord:
    """Return the record over its prediction at some values; its start is fitted where it was not.

    AnalysisError: the law has no motion under the measured base at these values.
    """
    from scipy.integrate import cumulative_trapezoid  # noqa: PLC0415 - for whole records alone

    if fits_start:  # where and how fast the mass begins, by least squares, all else given
        names, far = tuple(observation.start), np.full(len(observation.data), 10.0 * observation.rms)

        def residual(point: FloatArray) -> FloatArray:
            made = observation.predict({**values, **dict(zip(names, point.tolist(), strict=True))})
            return far if made is None else observation.data - made

        begun, steps = [values[name] for name in names], [1e-6] * len(names)
        found = least_squares(residual, begun, method="trf", max_nfev=25, diff_step=steps)
        values = {**values, **dict(zip(names, found.x.tolist(), strict=True))}
    predicted = observation.predict(values)
    if predicted is None:
        raise AnalysisError(f"record: law {observation.law.name} has no motion at the values found")
    friction = friction_over_time(observation, values, predicted)
    time, gap = observation.time, observation.data - predicted
    edges = np.minimum(observation.period * np.arange(observation.periods + 1), time[-1])
    area, area_predicted = (  # what the loop takes in (2.18), from the first sample to each
        cumulative_trapezoid(observation.base, mass, initial=0) for mass in (observation.data, predicted)
    )
    power = cumulative_trapezoid(gap**2, time, initial=0)
    each = np.sqrt(np.diff(np.interp(edges, time, power)) / np.diff(edges)) / observation.rms
    limit = math.inf
    if len(each) > FEW_SHOWN:
        limit = max(LEAVES * float(np.median(each)), ABOVE_NOISE * observation.noise / observation.rms, MATTERS)
    out, starts = np.flatnonzero(each > limit), observation.begin + edges
    apart = [p for p in np.split(out, np.flatnonzero(np.diff(out) > CALM) + 1) if len(p)]  # a short calm ends none
    return WholeRecord(
        time=observation.begin + time,
        base=observation.base,
        measured=observation.data,
        predicted=predicted,
        nrmse=math.sqrt(float(np.mean(gap**2))) / observation.rms,
        energy_difference=float(area_predicted[-1] / area[-1] - 1.0),
        cycle_time=starts[:-1],
        cycle_measured=np.diff(np.interp(edges, time, area)),
        cycle_predicted=np.diff(np.interp(edges, time, area_predicted)),
        cycle_nrmse=each,
        cycle_friction=friction.values,
        cycle_friction_se=friction.errors,
        wanders=friction.sure,
        left=tuple((float(starts[p[0]]), float(starts[p[-1] + 1]), float(each[p].max())) for p in apart),
    )


@dataclass(frozen=True)
class Walk:
    """A random walk: its values (c,), their errors (c,), its step from one to the next.

    ``sure``: logarithm of how much more likely what was seen is than if nothing changed.
    """

    values: FloatArray
    errors: FloatArray
    step: float
    sure: float


def walk(values: FloatArray, errors: FloatArray, size: float) -> Walk:
    """Return the smoothed walk behind values (c,) seen with errors (c,); ``size``: what its step is over (beta)."""

    def filtered(step: float) -> tuple[float, FloatArray, FloatArray]:  # log-likelihood, means and variances (c,)
        mean, variance, likelihood = 0.0, (WIDE * size) ** 2, 0.0
        means, variances = np.zeros(len(values)), np.zeros(len(values))
        for c, (value, error) in enumerate(zip(values, errors, strict=True)):
            variance += step**2 if c else 0.0
            total = variance + error**2
            likelihood -= 0.5 * (math.log(total) + (value - mean) ** 2 / total)
            mean += variance / total * (value - mean)
            variance *= error**2 / total
            means[c], variances[c] = mean, variance
        return likelihood, means, variances

    tried = {float(step): filtered(float(step)) for step in STEPS * size}
    best = max(tried, key=lambda step: tried[step][0])
    likely, mean, variance = tried[best]
    for c in range(len(values) - 2, -1, -1):
        ahead = variance[c] + best**2
        share = variance[c] / ahead
        mean[c] += share * (mean[c + 1] - mean[c])
        variance[c] += share**2 * (variance[c + 1] - ahead)
    return Walk(mean, np.sqrt(np.maximum(variance, 0.0)), best, float(likely - tried[0.0][0]))


def changes(gap: FloatArray, slope: FloatArray, periods: NDArray[np.intp], count: int) -> tuple[FloatArray, FloatArray]:
    """Return the change of a parameter in each of c periods (c,), by least squares, and the weight <s, s> of each.

    ``gap``, ``slope`` (n,): measured minus predicted, and the prediction's derivative by the parameter; ``periods``
    (n,): number of the period that each sample is in, from 0.
    """
    weight = np.asarray(np.bincount(periods, slope * slope, minlength=count)[:count], dtype=np.float64)
    moved = np.asarray(np.bincount(periods, slope * gap, minlength=count)[:count], dtype=np.float64)
    return moved / np.maximum(weight, 1e-300), weight


def friction_over_time(observation: RecordObservation, values: Mapping[str, float], predicted: FloatArray) -> Walk:
    """Return the friction ratio of each period of a record as a random walk about the fitted one.

    Where it changes by more than a little, the record is simulated at some friction ratios, and each period takes the
    derivative at the nearest. What a record does not show (the mass stands) keeps the fitted value, with a wide error.
    The error of a period's change is by both sensors' noise, and by what is left where that is more.
    """
    beta, count, gap = observation.problem(values).beta, observation.periods, observation.data - predicted

    def at(friction: float) -> FloatArray:
        made = observation.predict({**values, "beta": friction})
        return predicted if made is None else made

    def walked(change: FloatArray) -> Walk:
        far = np.abs(change) > LINEAR * beta
        return walk(np.where(far, 0.0, change), np.where(far, UNTOLD * beta, error), beta)

    slope = (at(beta * (1.0 + SMALL)) - predicted) / (SMALL * max(beta, 1e-300))
    if count < 2 or not slope.any():
        return Walk(np.full(count, beta), np.full(count, np.nan), 0.0, 0.0)
    periods = (observation.time / observation.period).astype(np.intp)
    change, weight = changes(gap, slope, periods, count)
    left = gap - change[np.minimum(periods, count - 1)] * slope
    shakes, by_base, power = observation.shaken(values, SHAKES_OVER_TIME), np.zeros(count), 0.0
    if len(shakes):
        moved = np.array([changes(shake, slope, periods, count)[0] for shake in shakes])
        by_base, power = np.sqrt(np.mean(moved**2, axis=0)), float(np.mean(shakes**2, axis=1).max())
    own = np.sqrt(np.bincount(periods, left**2)[:count] / np.bincount(periods)[:count])
    spread = np.where(own > BAD * float(np.median(own)), own, spread_of(left, observation.noise, power))
    error = np.hypot(spread / np.sqrt(np.maximum(weight, 1e-6 * float(weight.max()))), by_base)
    found = walked(change)
    size = float(np.std(found.values))
    if size > NOTABLE * beta:  # the derivative at the friction ratio nearest to the first guess
        offsets = size * np.array(GRID)
        records = [at(beta + off) for off in offsets]
        near = []
        for k, off in enumerate(offsets):
            low, high = max(k - 1, 0), min(k + 1, len(offsets) - 1)
            steep = (records[high] - records[low]) / (offsets[high] - offsets[low])
            near.append(off + changes(observation.data - records[k], steep, periods, count)[0])
        nearest = np.argmin(np.abs(found.values[None, :] - offsets[:, None]), axis=0)
        found = walked(np.array(near)[nearest, np.arange(count)])
    delay, each = _delay(observation, values, slope), np.arange(count)
    late = np.maximum(each + delay - (count - 1.0), 0.0)  # what has not shown yet is the last value, less sure
    earlier, errors = (np.interp(each + delay, each, part) for part in (found.values, found.errors))
    blurred = found.step**2 * (0.25 * delay + late)  # what changes within the delay shows as its mean
    return replace(found, values=beta + earlier, errors=np.sqrt(errors**2 + blurred))


def _delay(observation: RecordObservation, values: Mapping[str, float], slope: FloatArray) -> float:
    """Periods by which the motion is late behind friction: how it answers to a step of beta in the record's middle.

    With the share g of the settled answer that each period after the step shows, ``sum (1 - g)``.
    """
    here, time = observation.motion(values), observation.time
    law = observation.problem(values).in_frame_time()
    if here is None or law.law.kind != "rigid":
        return 0.0  # an inner state cannot be begun anew
    k = len(time) // 2
    base = BaseRecord(here.time[k:], here.base.values[k:], rest=0.0, scale=1.0)
    stepped = law.with_parameters({"beta": law.beta * (1.0 + SMALL)})
    there = respond(stepped, base, x0=float(here.displacement[k]), v0=float(here.velocity[k]))
    step = (there.displacement - here.displacement[k:]) / (SMALL * law.beta)
    since = ((time[k:] - time[k]) / observation.period).astype(np.intp)
    shown, weight = changes(step, slope[k:], since, int(since[-1]) + 1)
    shown = shown[weight > 0.1 * float(np.median(weight))][:SETTLES]
    settled = np.flatnonzero(np.abs(shown - 1.0) < 0.05)
    return float(np.clip(np.sum(1.0 - shown[: settled[0] if len(settled) else len(shown)]), 0.0, SETTLES))
