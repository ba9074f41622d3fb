"""How the virtual base moves: a sine, a sweep, random, or as recorded; a motor that starts up and wanders."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from frictionlab.base_motion import sound_base
from frictionlab.errors import FrictionlabError, SceneError
from frictionlab.hdf5 import read_recording
from frictionlab.logs import read_base_log
from frictionlab.recording import Recording
from frictionlab.scene import Scene, VirtualBase

FloatArray = NDArray[np.float64]
Draws = Callable[[str], np.random.Generator]
FINE = 200  # points per period of the fastest part: a spline through them errs by 3e-9 of it


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
