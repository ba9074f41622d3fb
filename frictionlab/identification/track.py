"""A whole record as a fit sees it: the measured mass, and the denoised base that drives the simulation."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.denoise import best_penalty, smoothed
from frictionlab.analysis.measurement import Measurement
from frictionlab.analysis.noise import white_noise
from frictionlab.base_motion import sound_base
from frictionlab.errors import SimulationError
from frictionlab.identification.coordinates import Coordinate, values_of
from frictionlab.identification.family import Family
from frictionlab.recording import Recording
from frictionlab.simulator import Problem
from frictionlab.simulator.record import BaseRecord, Response, prepare, respond

FloatArray = NDArray[np.float64]
DENSE = 120.0  # samples per period of drive or frame, whichever is shorter, that a fit needs at most
STEP = 1e-3  # of a prior's width: finite differences of the simulated record
NUISANCES = ("natural_frequency", "gain", "lag", "frame_damping_ratio")  # that a record is simulated with
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
        Y [m]: the amplitude of the base's fundamental in the steady cycles, so that beta means the same there and here.
    period : float
        Of the drive, s.
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

    def noise_left(self, generator: np.random.Generator) -> FloatArray:
        """Draw what is left in the base (n,) of its sensor's noise, over Y."""
        noise = self.base_noise * generator.standard_normal(self.thin * len(self.base))
        return (smoothed(noise, self.penalty) if self.penalty else noise)[:: self.thin]

    @property
    def rms(self) -> float:
        """Rms of the measured mass about its mean, over Y."""
        return float(np.std(self.mass))

    @property
    def per_period(self) -> int:
        """Samples per period of the drive."""
        return max(8, round(self.period * (len(self.time) - 1) / float(self.time[-1] - self.time[0])))


def track_of(recording: Recording, measurement: Measurement, natural_frequency: float) -> tuple[Track, tuple[str, ...]]:
    """Return a recording as a fit sees it, and what must be said of it.

    Raises
    ------
    RecordingError
        Its base has a gap or jumps: nothing can be simulated across.
    """
    part, said = sound_base(recording)
    drive = measurement.drive_frequency_hz
    thin = max(1, int(part.sampling_rate_hz / (DENSE * max(drive, natural_frequency))))
    penalty = best_penalty(part.base_displacement, white_noise(part.base_displacement))
    base = (smoothed(part.base_displacement, penalty) if penalty else part.base_displacement)[::thin]
    time = (part.time - part.time[0])[::thin]
    mass = part.mass_displacement[::thin]
    scale = measurement.base_amplitude_m
    steady = max(float(time[-1]) - measurement.transient_s, 1.0 / drive)
    whole = max(1, int(steady * drive))  # periods: the mean of the base is that of whole, settled ones
    last = time >= time[-1] - whole / drive
    track = Track(
        time=time,
        base=(base - base[last].mean()) / scale,
        mass=(mass - mass.mean()) / scale,
        noise=measurement.mass_noise_m / scale,
        scale=scale,
        period=1.0 / drive,
        base_noise=measurement.base_noise_m / scale,
        penalty=penalty,
        thin=thin,
        natural_frequency=natural_frequency,
        start=float(part.time[0]),
    )
    return track, tuple(s for s in said if s not in part.source.warnings)


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
        return BaseRecord(2.0 * math.pi * frequency * self.track.time, self.track.base, rest=0.0, scale=1.0)

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
        """A motion through the sensors: gain, a lag of the base's channel behind the mass's, an offset."""
        frequency = self.track.natural_frequency * (1.0 + values.get("natural_frequency", 0.0))
        late = values.get("lag", 0.0) * self.track.period * frequency  # rad of the drive -> rad of the frame
        moved = response.displacement
        if late != 0.0:
            from scipy.interpolate import CubicHermiteSpline  # noqa: PLC0415 - heavy, and most often not needed

            moved = CubicHermiteSpline(response.time, moved, response.velocity)(response.time + late)
        return np.asarray((1.0 + values.get("gain", 0.0)) * moved + values.get("offset", 0.0))

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
        return np.stack([self._column(i, c, point, here) for i, c in enumerate(self.coordinates)], axis=1)

    def _column(self, i: int, c: Coordinate, point: FloatArray, here: FloatArray) -> FloatArray:
        if c.name == "offset":
            return np.full(len(here), c.width)
        for step in (STEP, -STEP):
            if point[i] + step < c.low:
                continue
            moved = point.copy()
            moved[i] += step
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
    return {"start_displacement": float(level), "start_velocity": float(slope) / omega, "offset": 0.0}


def of_a_record(coordinates: tuple[Coordinate, ...]) -> tuple[Coordinate, ...]:
    """The unknowns of a cycle that `RecordForward` has too: its base is the measured one, and no sensor bends."""
    return tuple(c for c in coordinates if c.law or c.name in NUISANCES)
