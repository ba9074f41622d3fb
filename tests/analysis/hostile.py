"""Motions and sensors that mislead: recordings made from exact motions, each with its truth.

Every case is a motion that the simulator solves exactly, put through two lasers, and one fault: of the drive, of a
sensor, of the clock, of the columns. `CASES` maps a name to a function that makes the case.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.logs.clock import time_base
from frictionlab.logs.sensor import examine
from frictionlab.recording import Recording
from frictionlab.scene import Analysis, Rig, Scene
from frictionlab.simulator import Base, Problem, steady_state
from tests.analysis.seen import BASE_M, NATURAL_HZ, NOISE_M, STEP_M

LAST = Scene(rig=Rig(natural_frequency_hz=NATURAL_HZ), analysis=Analysis(transient_s=20.0, cycles="last"))
ALL = Scene(rig=Rig(natural_frequency_hz=NATURAL_HZ), analysis=Analysis(transient_s=20.0, cycles="all"))
Signal = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Motion:
    """An exact motion: ``mass`` and ``base`` over Y as functions of time [s], and what is true of it.

    ``energy`` (k Y^2) and ``amplitude`` (Y): means over the true period; ``stops``: per cycle; ``hz``: of the drive.
    """

    mass: Signal
    base: Signal
    energy: float
    amplitude: float
    stops: float
    hz: float


@dataclass(frozen=True)
class Case:
    """A recording that misleads, the scene it is measured by, and its truth."""

    recording: Recording
    scene: Scene
    truth: Motion


def motion(r: float, beta: float, *, base: tuple[float, ...] = (1.0,), fundamental: int = 1) -> Motion:
    """The steady state of a base ``sum_k base[k-1] cos(k tau)``; the drive is its harmonic ``fundamental``."""
    state = steady_state(Problem(r / fundamental, beta, base=Base(cosine=base)))
    orbit, energy, stops = state.orbit, state.energy_per_cycle, state.stops_per_cycle
    if orbit is None or energy is None or stops is None:
        raise ValueError(f"no steady state at r = {r}, beta = {beta}")
    hz = r * NATURAL_HZ
    turn = 2.0 * math.pi * hz / fundamental
    period = 2.0 * math.pi * (state.period_cycles or 1)
    tau = np.linspace(0.0, 2.0 * math.pi, 4096 * fundamental, endpoint=False) - 0.5 * math.pi / fundamental
    cycles = orbit.at(np.mod(tau, period))[0].reshape(fundamental, -1)
    return Motion(
        mass=lambda t: orbit.at(np.mod(turn * t, period))[0],
        base=lambda t: np.asarray(Base(cosine=base).at(turn * t)),
        energy=energy / fundamental,
        amplitude=float(np.mean(np.ptp(cycles, axis=1) / 2.0)),
        stops=stops / fundamental,
        hz=hz,
    )


def seen(
    of: Motion,
    *,
    noise: float = NOISE_M,
    step: float = STEP_M,
    size: float = BASE_M,
    seconds: float = 90.0,
    rate: float = 500.0,
    seed: int = 1,
    phase: float = 0.0731,
) -> Recording:
    """A motion through two lasers; ``size``: amplitude of the base [m]."""
    t = np.arange(round(seconds * rate)) / rate
    return through(t, size * of.mass(t + phase), size * of.base(t + phase), noise=noise, step=step, seed=seed)


def through(
    t: FloatArray, mass: FloatArray, base: FloatArray, *, noise: float = NOISE_M, step: float = STEP_M, seed: int = 1
) -> Recording:
    """Displacements [m] with the lasers' noise and step."""
    generator = np.random.default_rng(seed)
    values = [
        np.round((s + 0.3 * step + noise * generator.standard_normal(len(t))) / step) * step for s in (mass, base)
    ]
    return Recording(t, values[0], values[1])


def as_read(recording: Recording, *, name: str = "test") -> Recording:
    """A recording with the flags and the clock that reading its log would give it."""
    clock = time_base(np.array(recording.time), name, bridge_s=0.02)
    channels = [
        examine(np.array(v), role)
        for v, role in ((recording.mass_displacement, "mass"), (recording.base_displacement, "base"))
    ]
    said = (*clock.warnings, *channels[0].warnings, *channels[1].warnings)
    return replace(
        recording,
        time=clock.time,
        quality=clock.quality | channels[0].quality | channels[1].quality,
        source=replace(recording.source, warnings=tuple(said)),
    )


def changed(recording: Recording, mass: FloatArray | None = None, base: FloatArray | None = None) -> Recording:
    """The same stamps with another mass or base."""
    old = recording.mass_displacement, recording.base_displacement
    return Recording(recording.time, old[0] if mass is None else mass, old[1] if base is None else base)


def subharmonic(parts: int, r: float = 0.5, beta: float = 0.3, scene: Scene = LAST) -> Case:
    """A base with 5 % of its amplitude at a half or a third of the drive's frequency."""
    of = motion(r, beta, base=(0.05, *(0.0,) * (parts - 2), 1.0), fundamental=parts)
    return Case(seen(of), scene, of)


def second_tone(share: float, r: float = 0.7, beta: float = 0.3, scene: Scene = LAST) -> Case:
    """A base that beats: a second tone at 1.04 times the drive; mass by its linear share (a bound, not exact)."""
    of = motion(r, beta)
    one = seen(of, noise=0.0, step=1e-12)
    turn = 2.0 * math.pi * 1.04 * of.hz * (one.time + 0.0731)
    gain = 1.0 / (1.0 - (1.04 * r) ** 2)
    mass = one.mass_displacement + share * gain * BASE_M * np.cos(turn)
    base = one.base_displacement + share * BASE_M * np.cos(turn)
    return Case(through(one.time, mass, base), scene, of)


def hum(size: float, r: float = 0.5, beta: float = 0.4, hz: float = 50.0, scene: Scene = LAST) -> Case:
    """Mains hum of this amplitude [m] on the mass's sensor."""
    of = motion(r, beta)
    one = seen(of, noise=0.0, step=1e-12)
    mass = one.mass_displacement + size * np.sin(2.0 * math.pi * hz * one.time + 0.4)
    return Case(through(one.time, mass, one.base_displacement), scene, of)


def clipped(share: float, r: float, beta: float, scene: Scene = LAST, *, before_noise: bool = False) -> Case:
    """A mass whose sensor ends at this share of the motion's amplitude, on one side or both."""
    of = motion(r, beta)
    one = seen(of, noise=0.0, step=1e-12) if before_noise else seen(of)
    x = one.mass_displacement
    middle, half = 0.5 * (x.max() + x.min()), 0.5 * float(np.ptp(x))
    end = np.round(share * half / STEP_M) * STEP_M
    cut = np.clip(x, middle - end, middle + end)
    if before_noise:
        return Case(through(one.time, cut, one.base_displacement), scene, of)
    return Case(changed(one, np.round(cut / STEP_M) * STEP_M), scene, of)


def quiet(
    r: float, beta: float, size: float, rate: float, noise: float, scene: Scene = ALL, seconds: float = 60.0
) -> Case:
    """A sensor with less noise than its step, as after averaging."""
    of = motion(r, beta)
    return Case(as_read(seen(of, noise=noise, size=size, rate=rate, seconds=seconds)), scene, of)


def lost_sample(r: float = 1.2, beta: float = 0.4, scene: Scene = LAST) -> Case:
    """One sample lost in the mass's channel in the middle of the test: from there on it comes a sample early."""
    of = motion(r, beta)
    one = seen(of)
    x = np.delete(one.mass_displacement, len(one) // 2)
    return Case(Recording(one.time[:-1], x, one.base_displacement[:-1]), scene, of)


def set_back(by: float = 1e-3, r: float = 0.5, beta: float = 0.4, rate: float = 250.0) -> Case:
    """A clock that is set back in the middle of the test, by less than a step."""
    of = motion(r, beta)
    one = seen(of, rate=rate)
    t = np.array(one.time)
    t[len(t) // 2 :] -= by
    return Case(as_read(replace(one, time=t)), ALL, of)


def paused(pause: float = 0.7413, r: float = 0.5, beta: float = 0.4, rate: float = 250.0) -> Case:
    """A logger that pauses for no whole number of samples."""
    of = motion(r, beta)
    t = np.arange(round(90.0 * rate)) / rate
    t[len(t) // 2 :] += pause
    return Case(as_read(through(t, BASE_M * of.mass(t), BASE_M * of.base(t))), ALL, of)


def jitter(rms: float, r: float = 0.5, beta: float = 0.4, *, both: bool = True, rate: float = 500.0) -> Case:
    """A clock that jitters (rms in steps) under stamps that are even."""
    of = motion(r, beta)
    t = np.arange(round(90.0 * rate)) / rate
    generator = np.random.default_rng(5)
    true = t + rms / rate * generator.standard_normal(len(t))
    other = true if both else t
    return Case(through(t, BASE_M * of.mass(true + 1.0), BASE_M * of.base(other + 1.0)), ALL, of)


def drifting_base(by: float = 1e-3, r: float = 0.5, beta: float = 0.4) -> Case:
    """A base sensor whose zero drifts by so much [m] in the test."""
    of = motion(r, beta)
    one = seen(of)
    return Case(changed(one, base=one.base_displacement + by * one.time / one.time[-1]), ALL, of)


def drifting_gain(by: float = 0.02, role: str = "base", r: float = 0.5, beta: float = 0.4, scene: Scene = ALL) -> Case:
    """A sensor whose gain grows by this share in the test."""
    of = motion(r, beta)
    one = seen(of)
    gain = 1.0 + by * one.time / one.time[-1]
    if role == "base":
        return Case(changed(one, base=one.base_displacement * gain), scene, of)
    return Case(changed(one, mass=one.mass_displacement * gain), scene, of)


def wrong_columns(how: str, r: float = 0.5, beta: float = 0.4) -> Case:
    """Channels inverted, swapped, copied, or a mass of noise."""
    of = motion(r, beta)
    one = seen(of)
    x, y = one.mass_displacement, one.base_displacement
    noise = NOISE_M * np.random.default_rng(9).standard_normal(len(x))
    mass, base = {
        "inverted": (-x, y),
        "swapped": (y, x),
        "copy": (y, y),
        "second copy": (np.round((y + noise) / STEP_M) * STEP_M, y),
        "noise": (1e-4 * np.random.default_rng(3).standard_normal(len(x)), y),
    }[how]
    return Case(changed(one, mass, base), LAST, of)


CASES: dict[str, Callable[[], Case]] = {
    "clipped at 99 %, continuous": lambda: clipped(0.99, 0.8, 0.3),
    "clipped at 99 % before its noise, continuous": lambda: clipped(0.99, 0.8, 0.3, before_noise=True),
    "clipped at 95 %, r = 0.5": lambda: clipped(0.95, 0.5, 0.4),
    "clipped at 95 % before its noise, r = 0.5": lambda: clipped(0.95, 0.5, 0.4, before_noise=True),
    "clipped at 95 %, r = 0.3": lambda: clipped(0.95, 0.3, 0.6),
    "clipped at 95 %, r = 0.1": lambda: clipped(0.95, 0.1, 0.4),
    "clipped at 95 % before its noise, r = 0.1": lambda: clipped(0.95, 0.1, 0.4, before_noise=True),
    "one sample lost in the mass, r = 1.2": lost_sample,
    "clock jitters by 0.1 steps, stamps even": lambda: jitter(0.1),
    "clock of the mass alone jitters by 0.1 steps": lambda: jitter(0.1, both=False),
    "clock of the mass alone jitters, r = 1.2": lambda: jitter(0.3, 1.2, 0.4, both=False),
    "base's gain drifts by 2 %": drifting_gain,
    "mass's gain drifts by 2 %": lambda: drifting_gain(role="mass"),
    "mass inverted": lambda: wrong_columns("inverted"),
    "mass and base swapped": lambda: wrong_columns("swapped"),
    "mass and base swapped, r = 1.2": lambda: wrong_columns("swapped", 1.2),
    "mass is a copy of the base": lambda: wrong_columns("copy"),
    "mass is a second sensor on the base": lambda: wrong_columns("second copy"),
    "mass is noise of 0.1 mm": lambda: wrong_columns("noise"),
}
