"""The measurement's knobs, on synthetic recordings whose truth is the exact orbit: noise as an optoNCDT 1420 has it."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from frictionlab.accuracy import LEVELS, with_accuracy
from frictionlab.analysis import cycles, energy, spectrum
from frictionlab.analysis.measure import measure
from frictionlab.identification import compare
from frictionlab.recording import Recording
from frictionlab.scene import Analysis, Rig, Scene
from frictionlab.simulator import Motion, Problem, steady_state
from frictionlab.tradeoff.setting import Setting, Trial, run_trials

FloatArray = NDArray[np.float64]
R, BETA, NATURAL_HZ, BASE_M = 0.3, 0.6, 3.13, 1.8e-3
DRIVE_HZ = R * NATURAL_HZ  # 0.939 Hz
NOISE = 4.4e-4  # rms over Y: 0.8 um on 1.8 mm
RECORDINGS = 12  # of each kind, each with its own noise and phase
FEW = 4  # where recordings are long
DURATION_S, RATE_HZ = 70.0, 250.0
TRUTH = "synthetic recordings of the exact orbit"
SCENE = Scene(rig=Rig(natural_frequency_hz=NATURAL_HZ), analysis=Analysis(cycles="all"))


@cache
def _orbit() -> tuple[Motion, float]:
    """The motion that all recordings are of, and its energy per cycle."""
    state = steady_state(Problem(R, BETA), solver="exact")
    if state.orbit is None or state.energy_per_cycle is None:
        raise ArithmeticError(f"tradeoff: no orbit at r = {R}, beta = {BETA}: {state.outcome}")
    return state.orbit, state.energy_per_cycle


def recordings(rate: float = RATE_HZ, count: int = RECORDINGS) -> list[Recording]:
    """Recordings that differ by noise and by the phase they start at, so that no sampling grid is favoured."""
    return [recording(rate, seed) for seed in range(count)]


@cache
def recording(rate: float, seed: int) -> Recording:
    """One recording of the orbit at a sampling rate, with noise and phase of its own."""
    clean = noiseless(rate, seed)
    noise = NOISE * BASE_M * np.random.default_rng([seed, round(rate), 1]).standard_normal((2, len(clean.time)))
    return Recording(clean.time, clean.mass_displacement + noise[0], clean.base_displacement + noise[1])


def noiseless(rate: float, seed: int) -> Recording:
    """The same without noise."""
    time = np.arange(round(DURATION_S * rate)) / rate
    tau = 2 * math.pi * (DRIVE_HZ * time + np.random.default_rng([seed, round(rate)]).uniform())
    x = _orbit()[0].at(np.mod(tau, 2 * math.pi))[0]
    return Recording(time, BASE_M * x, BASE_M * np.cos(tau))


def truth() -> tuple[float, float]:
    """Energy per cycle and response amplitude of the motion."""
    orbit, area = _orbit()
    return area, 0.5 * float(np.ptp(orbit.turning_points[1]))


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _each(
    run: Callable[[Recording], float | FloatArray], rate: float = RATE_HZ, count: int = RECORDINGS
) -> Callable[[], FloatArray]:
    """Run a job on every recording; its time is that of all of them."""
    return lambda: np.hstack([run(one) for one in recordings(rate, count)])


def _off(truth: float) -> Callable[[object], float]:
    return lambda found: _rms(np.asarray(found) / truth - 1.0)


def _per_recording(settings: tuple[Setting, ...], count: int = RECORDINGS) -> tuple[Setting, ...]:
    return tuple(replace(s, seconds=s.seconds / count) for s in settings)


def padding() -> tuple[Setting, ...]:
    """Padding of the FFT that finds the drive, without and with interpolation, and the phases that analyze adds."""
    trials = [
        Trial(f"{n}x, highest bin", _each(partial(_highest_bin, padding=n)), _off(DRIVE_HZ)) for n in (1, 4, 16, 64)
    ]
    trials += [
        Trial(f"{n}x, interpolated", _each(partial(_interpolated, padding=n)), _off(DRIVE_HZ)) for n in (1, 4, 16)
    ]
    trials += [
        Trial(f"{n}x, interpolated, phases", _each(partial(_phases, padding=n)), _off(DRIVE_HZ), n == 4)
        for n in (1, 4, 16)
    ]
    bound = spectrum.cramer_rao(1.0, NOISE, round(DURATION_S * RATE_HZ), 1 / RATE_HZ) / DRIVE_HZ
    found = _per_recording(run_trials("fft padding", "drive_frequency_hz", TRUTH, trials))
    return tuple(replace(s, over_bound=s.error / bound) for s in found)


def _highest_bin(recording: Recording, *, padding: int) -> float:
    lines = spectrum.amplitude_spectrum(recording.base_displacement, 1 / RATE_HZ, padding=padding)
    first = 2 * padding
    return float(lines.frequency[first + int(np.argmax(lines.amplitude[first:]))])


def _interpolated(recording: Recording, *, padding: int) -> float:
    return spectrum.strongest_tone(recording.base_displacement, 1 / RATE_HZ, padding=padding).frequency


def _phases(recording: Recording, *, padding: int) -> float:
    guess = _interpolated(recording, padding=padding)
    cut = cycles.cut(recording.base_displacement, guess / RATE_HZ, noise=NOISE * BASE_M)
    return cut.frequency * RATE_HZ


def points_per_cycle() -> tuple[Setting, ...]:
    """Points a cycle is laid out on before its loop's area is taken; the default is one per sample."""
    one_each = cycles.points_per_cycle(RATE_HZ / DRIVE_HZ)
    trials = [
        Trial(str(n), _each(partial(_loop_energy, points=n)), _off(_orbit()[1]), n == one_each)
        for n in (32, 64, 128, one_each, 512, 1024)
    ]
    return _per_recording(run_trials("points per cycle", "energy_per_cycle of one cycle", TRUTH, trials))


def _loop_energy(recording: Recording, *, points: int) -> FloatArray:
    """Area of each loop, as `frictionlab.analysis` takes it."""
    period = RATE_HZ / DRIVE_HZ
    start = 1.0 + period * np.arange(math.floor(DURATION_S * DRIVE_HZ) - 1, dtype=np.float64)
    mass = cycles.fold(recording.mass_displacement, start, start + period, points)
    base = cycles.fold(recording.base_displacement, start, start + period, points)
    return energy.loop_area(mass, base) / BASE_M**2


def _measured(recording: Recording, scene: Scene) -> float:
    return measure(recording, scene).energy_per_cycle


def _measured_each(recording: Recording, scene: Scene) -> FloatArray:
    return measure(recording, scene).series.energy


def cycles_averaged() -> tuple[Setting, ...]:
    """Cycles that the energy is the mean of; the default is the thesis's, the last."""
    trials = [
        Trial(rule, _each(partial(_measured, scene=_averaging(rule)), count=FEW), _off(_orbit()[1]), rule == "last")
        for rule in ("last", "window:15", "all")
    ]
    return _per_recording(run_trials("cycles averaged", "energy_per_cycle", TRUTH, trials), FEW)


def _averaging(rule: str) -> Scene:
    return SCENE.model_copy(update={"analysis": Analysis(cycles=rule)})


def sampling_rate() -> tuple[Setting, ...]:
    """Samples per second of the sensor; the default is that of `synthesize`."""
    rates = (25.0, 50.0, 100.0, RATE_HZ, 1000.0, 4000.0)
    for rate in rates:
        recordings(rate, FEW)
    trials = [
        Trial(
            f"{rate:g} Hz", _each(partial(_measured_each, scene=SCENE), rate, FEW), _off(_orbit()[1]), rate == RATE_HZ
        )
        for rate in rates
    ]
    return _per_recording(run_trials("sampling rate", "energy_per_cycle of one cycle", TRUTH, trials), FEW)


def accuracy_of_analyze() -> tuple[Setting, ...]:
    """The three levels of ``analyze --accuracy``."""
    trials = [
        Trial(
            level,
            _each(partial(_measured_each, scene=with_accuracy(SCENE, level)), count=FEW),
            _off(_orbit()[1]),
            _usual(level),
        )
        for level in LEVELS
    ]
    return _per_recording(run_trials("analyze --accuracy", "energy_per_cycle of one cycle", TRUTH, trials), FEW)


def accuracy_of_compare_numeric() -> tuple[Setting, ...]:
    """The three levels of ``compare-numeric --accuracy``."""
    trials = [
        Trial(level, _each(partial(_friction, scene=with_accuracy(SCENE, level)), count=FEW), _off(BETA), _usual(level))
        for level in LEVELS
    ]
    return _per_recording(run_trials("compare-numeric --accuracy", "friction_ratio", TRUTH, trials), FEW)


def _friction(recording: Recording, scene: Scene) -> float:
    return compare(recording, scene).friction_ratio


def _usual(level: str) -> bool:
    return level == "balanced"
