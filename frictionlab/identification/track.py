"""A whole record as a fit sees it: the measured mass, and the denoised base that drives the simulation."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.filters import restored
from frictionlab.analysis.integration import best_penalty, gain_kept, spline
from frictionlab.analysis.measure import channels_of
from frictionlab.analysis.measurement import Measurement
from frictionlab.analysis.noise import white_noise
from frictionlab.base_motion import sound_base
from frictionlab.errors import AnalysisError, SimulationError
from frictionlab.identification.coordinates import Coordinate, values_of
from frictionlab.identification.family import Family
from frictionlab.identification.forward import BENDS
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.simulator import Problem
from frictionlab.simulator.record import BaseRecord, Response, prepare, respond

FloatArray = NDArray[np.float64]
DENSE = 120.0  # samples per period of drive or frame, whichever is shorter, that a fit needs at most
STEP = 1e-3  # of a prior's width: finite differences of the simulated record
FEWEST, FEWEST_PERIODS = 64, 4.0  # samples, and periods of the frame, that a record without a cycle has at least
ROUGHER = 10.0  # the penalty's share: noise is left up to a frequency 1.3 times as high
REST = 5.0  # times its sensor's noise from its first value: the base moves
MOVES = 5.0  # times its sensor's noise is a motion
SHOWN = ("gain", "lag", "base_in_mass", "parabola", "cubic")  # what sensors do to a motion that stays the same
SIMULATED = ("natural_frequency", "frame_damping_ratio", "mass_in_base")
WIDE = 1.0  # Y: prior of what nobody knows of the start, in the response's own size


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
class RecordForward:
    """Unknowns -> the record that would be measured; the same coordinates as for a cycle, and the start's three.

    ``fixed``: values of what is not sought, by name.
    """

    family: Family
    coordinates: tuple[Coordinate, ...]
    track: Track
    fixed: Mapping[str, float] = field(default_factory=dict)

    def values(self, point: FloatArray) -> dict[str, float]:
        """All values at a point, those that are fixed included."""
        return {**self.fixed, **values_of(self.coordinates, point)}

    def prepare(self, runs: int) -> None:
        """Load the compiled simulator if so many runs are worth it."""
        values = self.values(np.array([max(0.0, c.low) for c in self.coordinates]))
        prepare(self.problem(values), self.base(values), runs)

    def problem(self, values: Mapping[str, float]) -> Problem:
        """The problem at some values, its time counted in omega_n t."""
        names = {p.name for p in self.family.law.parameters}
        own = {n: v for n, v in values.items() if n in names}
        return self.family.problem(own, detuning=values.get("natural_frequency", 0.0)).in_frame_time()

    def base(self, values: Mapping[str, float]) -> BaseRecord:
        """The record's base in the time of the frame."""
        frequency = self.track.natural_frequency * (1.0 + values.get("natural_frequency", 0.0))
        return BaseRecord(2.0 * math.pi * frequency * self.track.time, self._moved(values), rest=0.0, scale=1.0)

    def _moved(self, values: Mapping[str, float]) -> FloatArray:
        """The base over its own size, without what its channel shows of the mass."""
        mixed, base = values.get("mass_in_base", 0.0), self.track.base
        if mixed == 0.0:
            return base
        own = base - mixed * self.track.mass
        return np.asarray(own * float(np.dot(base, base) / np.dot(own, base)))

    def response(self, values: Mapping[str, float]) -> Response | None:
        """The simulated motion at some values; None where the simulator has none."""
        start = values.get("start_displacement", 0.0), values.get("start_velocity", 0.0)
        try:
            return respond(self.problem(values), self.base(values), x0=start[0], v0=start[1])
        except SimulationError:
            return None  # no motion to compare with: these values are no candidate

    def predict(self, point: FloatArray) -> FloatArray | None:
        """The record (n,) at a point, through the sensors, over Y; None where there is no motion."""
        values = self.values(point)
        response = self.response(values)
        return None if response is None else self.seen(response, values)

    def seen(self, response: Response, values: Mapping[str, float]) -> FloatArray:
        """A motion through the sensors: gain, lag of the base's channel behind the mass's, offset, crosstalk, bends.

        A bend grows with the place, from -1 to 1 in the steady motion.
        """
        frequency = self.track.natural_frequency * (1.0 + values.get("natural_frequency", 0.0))
        late = values.get("lag", 0.0) * self.track.period * frequency  # rad of the drive -> rad of the frame
        moved = response.displacement
        if late != 0.0:
            from scipy.interpolate import CubicHermiteSpline  # noqa: PLC0415 - heavy, and most often not needed

            moved = CubicHermiteSpline(response.time, moved, response.velocity)(response.time + late)
        shown = (1.0 + values.get("gain", 0.0)) * moved + values.get("offset", 0.0)
        if values.get("base_in_mass"):
            shown = shown + values["base_in_mass"] * self.track.base
        place = (shown - self.track.middle) / self.track.swing
        for power, name in BENDS.items():
            if values.get(name):
                shown = shown + values[name] * self.track.swing * place**power
        return np.asarray(shown)

    def shaken(self, point: FloatArray, runs: int) -> FloatArray:
        """Changes (runs, n) of the record at a point by what is left in the base of its sensor's noise."""
        here, rng = self.predict(point), np.random.default_rng(runs)
        if here is None:
            return np.zeros((0, len(self.track.time)))
        changes = []
        for _ in range(runs):
            noisy = replace(self.track, base=self.track.base + self.track.noise_left(rng))
            there = replace(self, track=noisy).predict(point)
            changes += [] if there is None else [there - here]
        return np.array(changes).reshape(-1, len(here))

    def jacobian(self, point: FloatArray, here: FloatArray) -> FloatArray:
        """Derivatives (n, m) by the coordinates, by differences; zero where neither neighbour has a motion."""
        motion = self.response(self.values(point))
        return np.stack([self._column(i, c, point, here, motion) for i, c in enumerate(self.coordinates)], axis=1)

    def _column(
        self, i: int, c: Coordinate, point: FloatArray, here: FloatArray, motion: Response | None
    ) -> FloatArray:
        if c.name == "offset":
            return np.full(len(here), c.width)
        for step in (STEP, -STEP):
            if point[i] + step < c.low:
                continue
            moved = point.copy()
            moved[i] += step
            if c.name in SHOWN and motion is not None:
                return np.asarray((self.seen(motion, self.values(moved)) - here) / step)
            there = self.predict(moved)
            if there is not None:
                return np.asarray((there - here) / step)
        return np.zeros(len(here))


def start_coordinates(track: Track) -> tuple[Coordinate, ...]:
    """What nobody knows of a record's start: where the mass stands against its spring, how fast it is, the zero."""
    width = WIDE * max(1.0, 2.0 * track.rms)
    return (
        Coordinate("start_displacement", "displacement of the mass at the first sample, over Y", width=width),
        Coordinate("start_velocity", "velocity of the mass at the first sample, over omega_n Y", width=width),
        Coordinate("offset", "zero of the mass's sensor, over Y", width=width),
    )


def start_values(track: Track) -> dict[str, float]:
    """First guesses for them, from the first samples."""
    few = min(len(track.time), max(4, track.per_period // 40))
    omega = 2.0 * math.pi * track.natural_frequency
    slope, level = np.polyfit(track.time[:few], track.mass[:few], 1)
    zero = -float(track.base.mean())  # of the mass's own mean, which lies where the base's does
    return {"start_displacement": float(level) - zero, "start_velocity": float(slope) / omega, "offset": zero}


def of_a_record(coordinates: tuple[Coordinate, ...]) -> tuple[Coordinate, ...]:
    """The unknowns of a cycle that `RecordForward` has too: its base is the measured one, with all its harmonics."""
    return tuple(c for c in coordinates if c.law or c.name in (*SIMULATED, *SHOWN))
