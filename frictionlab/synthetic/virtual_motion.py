"""How the base of a virtual test moves, and its mass.

The base: a sine, a sweep, random, or as recorded; a motor that starts up and wanders. The mass: from rest or steadily,
cycle by cycle, under a plain sine or any other base.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from frictionlab.arrays import FloatArray
from frictionlab.base_motion import sound_base
from frictionlab.errors import FrictionlabError, SceneError
from frictionlab.hdf5 import read_recording
from frictionlab.logs import read_base_log
from frictionlab.recording import Recording
from frictionlab.scene import Scene, VirtualBase
from frictionlab.simulator import Motion, Problem, simulate, steady_state
from frictionlab.simulator.record import BaseRecord, Response, respond
from frictionlab.simulator.several import follow, steady
from frictionlab.synthetic.virtual_rig import SyntheticTest

Draws = Callable[[str], np.random.Generator]
FINE = 200  # points per period of the fastest part: a spline through them errs by 3e-9 of it
HOUR = 3600.0
PHASES = 64  # points per cycle of the true irregularity


def highest_hz(base: VirtualBase, drive_hz: float) -> float:
    """The fastest frequency in a motion, Hz; 0 where a recording says it all."""
    if base.motion == "sweep":
        return max(base.sweep_hz or [0.0])
    if base.motion == "random":
        return base.band_hz[1] if base.band_hz else (base.spectrum or [[0.0, 0.0]])[-1][0]
    return drive_hz if base.motion == "sine" else 0.0


def base_motion(
    base: VirtualBase, time: FloatArray, drive_hz: float, scene: Scene, draws: Draws, *, name: str
) -> FloatArray:
    """Displacement of the base (m) at even times (n,) from 0.

    Parameters
    ----------
    base : VirtualBase
    time : ndarray of shape (n,)
    drive_hz : float
        Of a sine.
    scene : Scene
        ``[synthetic] base_amplitude_m``, and where recorded motions are looked for.
    draws : callable
        A generator of random numbers for each purpose.
    name : str
        What an error calls the test.

    Raises
    ------
    SceneError
        A recorded motion cannot be read or is too short.
    """
    step = float(time[1] - time[0])
    size = np.ones(len(time))
    if base.ramp_s:
        size = ramp(time / base.ramp_s)
    if base.amplitude_wander:
        size = size * (1 + wander(len(time), step, base.amplitude_wander, base.amplitude_wander_s, draws("amplitude")))
    if base.motion == "file":
        return np.asarray(size * _recorded(base, time, scene, name))
    if base.motion == "random":
        return np.asarray(size * _random(base, time, scene.synthetic.base_amplitude_m, draws("base")))
    frequency = _frequency(base, time, drive_hz)
    if base.frequency_wander:
        more = wander(len(time), step, base.frequency_wander, base.frequency_wander_s, draws("frequency"))
        frequency = frequency * (1 + more)
    turns = np.concatenate([[0.0], np.cumsum(0.5 * (frequency[1:] + frequency[:-1]) * np.diff(time))])
    return np.asarray(scene.synthetic.base_amplitude_m * size * np.cos(2 * math.pi * turns))


def ramp(share: FloatArray) -> FloatArray:
    """From 0 to 1 with two derivatives that vanish at both ends.

    Examples
    --------
    >>> ramp(np.array([-1.0, 0.0, 0.5, 1.0, 2.0])).tolist()
    [0.0, 0.0, 0.5, 1.0, 1.0]
    """
    s = np.clip(share, 0.0, 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


def _frequency(base: VirtualBase, time: FloatArray, drive_hz: float) -> FloatArray:
    """Frequency at each time, Hz."""
    if base.sweep_hz is None:
        return np.full(len(time), drive_hz)
    first, last = base.sweep_hz
    share = time / time[-1]
    if base.sweep_scale == "log":
        return np.asarray(first * (last / first) ** share)
    return np.asarray(first + (last - first) * share)


def wander(n: int, step: float, rms: float, correlation_s: float, generator: np.random.Generator) -> FloatArray:
    """A smooth Gaussian motion (n,) whose autocorrelation is ``rms^2 exp(-(t / correlation_s)^2)``.

    Its one-sided density is ``2 sqrt(pi) T rms^2 exp(-(pi f T)^2)``.
    """

    def density(f: FloatArray) -> FloatArray:
        return np.asarray(
            2 * math.sqrt(math.pi) * correlation_s * rms**2 * np.exp(-((math.pi * f * correlation_s) ** 2))
        )

    return random_motion(n, step, density, generator)


def random_motion(
    n: int, step: float, density: Callable[[FloatArray], FloatArray], generator: np.random.Generator
) -> FloatArray:
    """A Gaussian motion (n,) of a one-sided power density: random lines, twice as close as the motion is long.

    Examples
    --------
    >>> white = random_motion(20_000, 0.01, lambda f: np.where(f < 10.0, 0.1, 0.0), np.random.default_rng(1))
    >>> round(float(np.std(white)), 1)  # the root of 0.1 times 10
    1.0
    """
    whole = 2 * n
    places: FloatArray = np.asarray(np.fft.rfftfreq(whole, step), dtype=np.float64)
    lines = np.sqrt(density(places) / (whole * step)) * (
        generator.standard_normal(len(places)) + 1j * generator.standard_normal(len(places))
    )
    lines[0] = lines[0].real * math.sqrt(2.0)  # half as wide, and counted once
    return np.asarray(np.fft.irfft(0.5 * whole * lines, whole)[:n])


def _random(base: VirtualBase, time: FloatArray, amplitude: float, generator: np.random.Generator) -> FloatArray:
    if base.band_hz:
        low, high = base.band_hz
        known = ([low, high], [1.0 / (high - low)] * 2)
        rms = base.rms_m or amplitude / math.sqrt(2.0)
    else:
        table = np.array(base.spectrum)
        power = float(np.trapezoid(table[:, 1], table[:, 0]))
        known = (table[:, 0].tolist(), (table[:, 1] / power).tolist())
        rms = base.rms_m or math.sqrt(power)

    def density(f: FloatArray) -> FloatArray:
        inside = (f >= known[0][0]) & (f <= known[0][-1]) & (f > 0.0)
        return np.where(inside, rms**2 * np.interp(f, *known), 0.0)

    return random_motion(len(time), float(time[1] - time[0]), density, generator)


def _recorded(base: VirtualBase, time: FloatArray, scene: Scene, name: str) -> FloatArray:
    """A recorded base at other times, from its first value."""
    path = scene.folder / (base.file or "")
    try:
        recording = _read(path, base, scene)
    except FrictionlabError as error:
        raise SceneError(f"synthetic.bases: {base.name}: {error}") from error
    known = recording.time - recording.time[0]
    if known[-1] < time[-1] - 0.5 * (time[1] - time[0]):
        raise SceneError(
            f"synthetic.bases: {base.name}: {path} lasts {known[-1]:.6g} s; expected at least the {time[-1]:.6g} s of"
            f" {name}: set duration_s"
        )
    curve = CubicSpline(known, base.factor * (recording.base_displacement - recording.base_displacement[0]))
    return np.asarray(curve(np.minimum(time, known[-1])))


def _read(path: Path, base: VirtualBase, scene: Scene) -> Recording:
    """The sound part of a recorded base."""
    if path.suffix.lower() in (".h5", ".hdf5"):
        return sound_base(read_recording(path))[0]
    given = {key: value for key, value in (("base", base.column), ("unit", base.unit)) if value is not None}
    return sound_base(read_base_log(path, scene.changed(log=given).log))[0]


def cycle_friction_ratios(test: SyntheticTest, scene: Scene) -> FloatArray:
    """Friction ratio of each cycle: drift, jump, scatter and wandering as the test's material has them; (cycles,)."""
    cycles = math.ceil(test.duration_s * test.drive_frequency_hz)
    start = np.arange(cycles) / test.drive_frequency_hz
    factor = 1 + test.friction_drift_per_hour * start / HOUR
    if test.jump_s is not None:
        factor = np.where(start >= test.jump_s, test.jump_factor, 1.0) * factor
    if test.friction_scatter:
        factor = factor * (1 + test.friction_scatter * test.draws(scene, "friction").standard_normal(cycles))
    if test.friction_wander:
        step, draws = 1.0 / test.drive_frequency_hz, test.draws(scene, "friction over time")
        factor = factor * (1 + wander(cycles, step, test.friction_wander, test.friction_wander_s or HOUR, draws))
    return test.friction_ratio * np.maximum(factor, 0.0)


def sample_times(test: SyntheticTest, scene: Scene) -> FloatArray:
    """Times of the log's samples (n,), s."""
    rate = scene.synthetic.sampling_rate_hz
    return np.asarray(np.arange(round(test.duration_s * rate)) / rate)


def motion(test: SyntheticTest, time: FloatArray, scene: Scene) -> FloatArray:
    """Displacement of the mass (m) at the given times (s), before any sensor."""
    tau = 2 * math.pi * test.drive_frequency_hz * time
    x = v = 0.0
    if scene.synthetic.start == "steady":
        orbit, period = _steady_orbit(test)
        if test.is_plain_coulomb:
            return test.base_amplitude_m * orbit.at(np.mod(tau, period))[0]
        x, v = (float(state[0]) for state in orbit.at(np.zeros(1)))
    if test.is_plain_coulomb:
        cycles = max(1, math.ceil(test.duration_s * test.drive_frequency_hz))
        return test.base_amplitude_m * simulate(test.problem(), cycles=cycles).at(tau)[0]
    displacement = np.empty_like(time)
    for cycle, beta in enumerate(cycle_friction_ratios(test, scene)):
        trajectory = simulate(test.problem(float(beta)), cycles=1, x0=x, v0=v)
        inside = slice(*np.searchsorted(tau, [2 * math.pi * cycle, 2 * math.pi * (cycle + 1)]))
        displacement[inside] = trajectory.at(tau[inside] - 2 * math.pi * cycle)[0]
        x, v = (float(state[0]) for state in trajectory.at(np.array([2 * math.pi])))
    return test.base_amplitude_m * displacement


def motion_of_masses(test: SyntheticTest, time: FloatArray, scene: Scene) -> FloatArray:
    """Displacements (n, masses) in m of a frame of several masses, from rest or steadily, before any sensor."""
    frame = test.frame
    if frame is None:
        raise SceneError(f"synthetic.tests: {test.log}: expected [[rig.masses]] or [[rig.contacts]]; got none")
    tau = 2 * math.pi * test.drive_frequency_hz * time
    if scene.synthetic.start == "steady":
        found = steady(frame)
        if found.motion is None:
            raise SceneError(f"synthetic.tests: {test.log}: start = 'steady' needs a steady state; got {found.outcome}")
        return np.asarray(test.base_amplitude_m * found.motion.at(tau)[0])
    cycles = max(1, math.ceil(test.duration_s * test.drive_frequency_hz))
    return np.asarray(test.base_amplitude_m * follow(frame, cycles).at(tau)[0])


def _steady_orbit(test: SyntheticTest) -> tuple[Motion, float]:
    """The steady orbit of a test and its period (rad)."""
    state = steady_state(test.problem())
    if state.orbit is None or state.period_cycles is None:
        raise SceneError(f"synthetic.tests: {test.log}: start = 'steady' needs a steady state; got {state.outcome}")
    return state.orbit, 2 * math.pi * state.period_cycles


@dataclass(frozen=True)
class Driven:
    """A motion, over Y, at even times; its parts are those of one friction ratio each.

    ``time`` (n,) tau = omega_n t; ``base`` and ``displacement`` (n,) over Y, ``velocity`` (n,) of the mass over
    omega_n Y, ``force`` (n,) of the contact over k Y.
    """

    time: FloatArray
    base: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    force: FloatArray
    parts: Sequence[Response]

    def totals(self, amplitude_m: float, omega: float, stiffness: float) -> dict[str, object]:
        """What is true of the whole motion."""
        energy = sum(part.energy for part in self.parts)
        base = np.concatenate([part.base.values for part in self.parts])
        return {
            "base_largest_m": amplitude_m * float(np.abs(base).max()),
            "base_rms_m": amplitude_m * float(np.std(base)),
            "total_energy": energy,
            "total_energy_j": energy * stiffness * amplitude_m**2,
            "total_friction_energy": sum(part.friction_energy for part in self.parts),
            "total_path": sum(part.path for part in self.parts),
            "total_stops": sum(part.stops for part in self.parts),
            "total_time_stuck_s": sum(part.time_stuck for part in self.parts) / omega,
            "peak_displacement": max(part.peaks["displacement"] for part in self.parts),
        }


def drive(
    problem_of: Callable[[float], Problem], betas: FloatArray, length: float, tau: FloatArray, base: FloatArray
) -> Driven:
    """Return the motion from rest under a sampled base; friction has one value for so long, then the next.

    Parameters
    ----------
    problem_of : callable
        The problem with a friction ratio, its time counted in omega_n t.
    betas : ndarray of shape (m,)
        Friction ratios, one after the other; one alone stays.
    length : float
        Of each, rad.
    tau, base : ndarray of shape (n,)
        Times, rad, and displacement of the base over Y; its zero is where the spring is relaxed.
    """
    ends = np.searchsorted(tau, length * np.arange(1, len(betas))).tolist() if len(betas) > 1 else []
    x, v, first = 0.0, 0.0, 0
    motion, parts = np.zeros((3, len(tau))), []
    for beta, end in zip(betas.tolist(), [*ends, len(tau) - 1], strict=True):
        if end - first < 1:
            continue
        part = slice(first, end + 1)
        record = BaseRecord(tau[part], base[part], rest=0.0, scale=1.0)
        parts.append(respond(problem_of(beta), record, x0=x, v0=v))
        motion[:, part] = parts[-1].displacement, parts[-1].velocity, parts[-1].contact_force
        x, v, first = float(parts[-1].displacement[-1]), float(parts[-1].velocity[-1]), end
    return Driven(tau, base, motion[0], motion[1], motion[2], tuple(parts))


def driven(test: SyntheticTest, scene: Scene) -> tuple[Driven, int, FloatArray]:
    """The motion under a base that is no plain sine; which of its times are the log's; the base (m) at all of them.

    Raises
    ------
    SceneError
        A start from the steady state, which only a plain sine has; a recorded base that cannot be read.
    """
    if scene.synthetic.start == "steady":
        raise SceneError(
            f"synthetic.tests: {test.log}: start = 'steady' needs a plain sine; got base {test.base.name!r}"
            + (f", channels {', '.join(scene.synthetic.channels)}" if scene.synthetic.channels else "")
        )
    rate = scene.synthetic.sampling_rate_hz
    top = max(highest_hz(test.base, test.drive_frequency_hz), test.natural_frequency_hz)
    every = max(1, math.ceil(FINE * top / rate))
    time = np.arange((round(test.duration_s * rate) - 1) * every + 1) / (rate * every)
    base = base_motion(
        *(test.base, time, test.drive_frequency_hz, scene), lambda purpose: test.draws(scene, purpose), name=test.log
    )
    constant = np.array([test.friction_ratio])
    betas = constant if test.is_plain_coulomb else cycle_friction_ratios(test, scene)
    run = drive(
        lambda beta: test.problem(beta).in_frame_time(),
        betas,
        2 * math.pi * test.natural_frequency_hz / test.drive_frequency_hz,
        2 * math.pi * test.natural_frequency_hz * time,
        base / test.base_amplitude_m,
    )
    return run, every, base


def channels(test: SyntheticTest, scene: Scene, run: Driven) -> dict[str, FloatArray]:
    """The further channels of a log, in SI, at all times of a motion, before any sensor.

    The mass's acceleration is that of its equation of motion, (2.9) in the frame's time:
    ``x'' = y - x + 2 zeta (y' - x') - n``.
    """
    omega = 2 * math.pi * test.natural_frequency_hz
    spline = CubicSpline(run.time, run.base)
    base_rate = spline(run.time, 1)
    pull = run.base - run.displacement + 2.0 * test.damping_ratio * (base_rate - run.velocity)
    known = {
        "contact_force": test.stiffness_n_per_m * test.base_amplitude_m * run.force,
        "normal_force": np.full(len(run.time), test.normal_force_n),
        "mass_velocity": test.base_amplitude_m * omega * run.velocity,
        "base_velocity": test.base_amplitude_m * omega * base_rate,
        "mass_acceleration": test.base_amplitude_m * omega**2 * (pull - run.force),
        "base_acceleration": test.base_amplitude_m * omega**2 * spline(run.time, 2),
    }
    return {name: known[name] for name in scene.synthetic.channels}


def phase_times(test: SyntheticTest, transient: float) -> FloatArray:
    """Times (s) of 64 phases in each full cycle after the transient, cut where the base rises through zero."""
    first = math.ceil(transient * test.drive_frequency_hz + 0.25)
    last = math.floor(test.duration_s * test.drive_frequency_hz + 0.25)
    cycles = np.arange(first, max(first, last))[:, None] - 0.25
    return np.asarray((cycles + np.arange(PHASES) / PHASES) / test.drive_frequency_hz)


def motion_at(test: SyntheticTest, scene: Scene, *times: FloatArray) -> list[FloatArray]:
    """The motion at several sets of times, simulated once."""
    every = np.concatenate(times)
    order = np.argsort(every, kind="stable")
    displacement = np.empty_like(every)
    displacement[order] = motion(test, every[order], scene)
    return np.split(displacement, np.cumsum([len(t) for t in times])[:-1])
