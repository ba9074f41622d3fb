"""Logs of virtual tests, each through two virtual lasers, and their truth beside them."""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import SceneError
from frictionlab.files import check_replaceable, make_folder, write_whole
from frictionlab.scene import Scene
from frictionlab.simulator import Structure, steady_state
from frictionlab.simulator.several import steady
from frictionlab.synthetic.virtual_motion import (
    HOUR,
    channels,
    cycle_friction_ratios,
    driven,
    motion,
    motion_at,
    motion_of_masses,
    phase_times,
    sample_times,
)
from frictionlab.synthetic.virtual_rig import SyntheticTest, virtual_tests

MILLIMETRES = 1e3  # the logs are written in the sensor's unit
MARK = b"# SYNTHETIC: "
_FIRST = ("log", "material", "normal_force_n", "frequency_ratio", "friction_ratio")  # keys of a truth, in order
PREAMBLE = (
    "# SYNTHETIC: simulated by frictionlab, not measured\n"
    "# material {material}, normal force {force:g} N, {motion}; its truth is in truth.jsonl\n"
    "{columns}\n"
)
HEADS = {
    "contact_force": "friction force [N]",
    "normal_force": "normal force [N]",
    "mass_velocity": "mass velocity [m/s]",
    "base_velocity": "base velocity [m/s]",
    "mass_acceleration": "mass acceleration [m/s^2]",
    "base_acceleration": "base acceleration [m/s^2]",
}
"""Channel -> the head of its column."""


def synthesize(scene: Scene, folder: Path) -> Iterator[SyntheticTest]:
    """Write one log per virtual test into a folder, and their truth beside them (``truth.jsonl``, last).

    Parameters
    ----------
    scene : Scene
        Its ``[rig]``, ``[model]`` and ``[synthetic]`` tables say all; the same scene gives the same bytes.
    folder : Path
        Made if it is not there. Synthetic logs of the same names are replaced, measured ones never.

    Yields
    ------
    SyntheticTest
        Each test when its log stands.

    Raises
    ------
    SceneError
        As :func:`virtual_tests`.
    OutputError
        The folder cannot be written, or a log that is not synthetic stands there.
    """
    tests = virtual_tests(scene)
    make_folder(folder)
    check_replaceable(folder / "truth.jsonl", replace=is_truth)
    for test in tests:
        check_replaceable(folder / test.log, replace=is_synthetic)
    truths = []
    for test in tests:
        text, more = log_of(test, scene)
        write_whole(folder / test.log, text.encode(), replace=is_synthetic)
        truths.append(json.dumps({**truth(test), **more}) + "\n")
        yield test
    write_whole(folder / "truth.jsonl", "".join(truths).encode(), replace=is_truth)


def is_truth(path: Path) -> bool:
    """Whether a file tells the truth of synthetic logs: its first line has the numbers that `truth` gives."""
    with path.open("rb") as file:
        first = file.readline(1 << 20)
    try:
        row = json.loads(first)
    except (ValueError, RecursionError):
        return False
    return isinstance(row, dict) and tuple(row)[: len(_FIRST)] == _FIRST


def is_synthetic(log: Path) -> bool:
    """Whether a log says in its first line that it is synthetic."""
    with log.open("rb") as file:
        return file.readline(len(MARK) + 1).startswith(MARK)


def log_of(test: SyntheticTest, scene: Scene) -> tuple[str, dict[str, object]]:
    """The log of one test, and what is true of it beyond `truth` where its friction or its base changes.

    The log: preamble, header, one line per sample; time in s, displacements in mm. A test whose base is no sine, or
    that more than lasers watch, is simulated as the response to a sampled base.
    """
    if test.frame is not None and scene.synthetic.channels:
        raise SceneError(
            f"synthetic.channels: expected none for a frame with [[rig.masses]] or [[rig.contacts]]; got"
            f" {', '.join(scene.synthetic.channels)}"
        )
    if scene.synthetic.channels or not test.base.is_plain:
        return _driven_log(test, scene)
    time = sample_times(test, scene)
    base = np.asarray(test.base_amplitude_m * np.cos(2 * math.pi * test.drive_frequency_hz * time))
    if test.is_plain_coulomb:
        move = motion if test.frame is None else motion_of_masses
        return _lines(test, scene, time, move(test, time, scene), base), {}
    transient = scene.analysis.planned_transient_s
    phases = phase_times(test, transient)
    mass, exact = motion_at(test, scene, time, phases.ravel())
    behaviour: dict[str, object] = {
        "irregularity_index": irregularity_index(exact.reshape(phases.shape)),
        "energy_slope_per_hour": energy_slope(test, transient),
    }
    return _lines(test, scene, time, mass, base), behaviour | _over_time(test, scene)


def _over_time(test: SyntheticTest, scene: Scene) -> dict[str, object]:
    """The friction ratio of each cycle, where it wanders."""
    if not test.friction_wander:
        return {}
    return {"friction_ratio_of_cycles": [float(f"{beta:.8g}") for beta in cycle_friction_ratios(test, scene)]}


def _driven_log(test: SyntheticTest, scene: Scene) -> tuple[str, dict[str, object]]:
    """The log of a test whose base is no plain sine, and the totals of its motion."""
    run, every, base = driven(test, scene)
    time, mass = sample_times(test, scene), test.base_amplitude_m * run.displacement[::every]
    omega = 2 * math.pi * test.natural_frequency_hz
    totals = run.totals(test.base_amplitude_m, omega, test.stiffness_n_per_m)
    told = {key: twelve_digits(value) for key, value in totals.items()}
    more = {name: values[::every] for name, values in channels(test, scene, run).items()}
    return _lines(test, scene, time, mass, base[::every], more), told | _over_time(test, scene)


def _lines(
    test: SyntheticTest,
    scene: Scene,
    time: FloatArray,
    mass: FloatArray,
    base: FloatArray,
    more: Mapping[str, FloatArray] | None = None,
) -> str:
    """The text of a log: ``time`` (n,) s, ``mass`` (n,) or (n, masses), ``base`` (n,) m and more, before any sensor."""
    synthetic, others = scene.synthetic, more or {}
    noise, further = test.draws(scene, "noise"), test.draws(scene, "channels")
    masses = [mass] if mass.ndim == 1 else list(mass.T)
    heads = ["mass [mm]"] if len(masses) == 1 else [f"mass {number} [mm]" for number in range(1, len(masses) + 1)]
    lasers = [*masses, base]
    seen = [MILLIMETRES * _through_laser(one, synthetic.noise_m, synthetic.step_m, noise) for one in lasers]
    for values in others.values():
        rms = synthetic.channel_noise * float(np.sqrt(np.mean(values**2)))
        seen.append(values + rms * further.standard_normal(len(values)))
    words = f"r {test.frequency_ratio:g}" if test.is_periodic else f"base {test.base.motion}"
    columns = ",".join(["time [s]", *heads, "base [mm]", *(HEADS[name] for name in others)])
    head = PREAMBLE.format(material=test.material, force=test.normal_force_n, motion=words, columns=columns)
    line = "%.6f" + ",%.6f" * len(lasers) + ",%.9g" * len(others) + "\n"
    return head + (line * len(time)) % tuple(np.column_stack([time, *seen]).ravel().tolist())


def _through_laser(signal: FloatArray, noise: float, step: float, generator: np.random.Generator) -> FloatArray:
    """What a sensor makes of a displacement (m): noise of the given rms, then rounding to its step."""
    noisy = signal + noise * generator.standard_normal(len(signal))
    return np.round(noisy / step) * step if step else noisy


def truth(test: SyntheticTest) -> dict[str, object]:
    """What is known of a test: its parameters and the steady state of its (undisturbed) problem, as sensors show it.

    ``energy_per_cycle`` is the loop's (2.18); where the wall moves with the base, or the frame has a dashpot, the
    energy dissipated is another number and stands beside it. Numbers have twelve digits, which are the same on every
    machine; the last four of a double are not.
    """
    given = {key: value for key, value in asdict(replace(test, frame=None)).items() if value is not None}
    del given["base"]
    known = given | {
        "drive_frequency_hz": test.drive_frequency_hz,
        "friction_force_n": test.friction_coefficient * test.normal_force_n,
    }
    if not test.base.is_plain:
        known["base"] = {"motion": test.base.motion} | test.base.model_dump(exclude_defaults=True)
    if test.is_periodic:
        known |= _steady_truth(test)
    else:
        known |= {"frequency_ratio": None, "drive_frequency_hz": None}
    return {key: twelve_digits(value) for key, value in known.items()}


def _steady_truth(test: SyntheticTest) -> dict[str, object]:
    if test.frame is not None:
        return _truth_of_masses(test.frame, test.natural_frequency_hz)
    state = steady_state(test.problem())
    return {
        "outcome": state.outcome,
        "energy_per_cycle": state.energy_per_cycle,
        "energy_dissipated_per_cycle": state.energy_taken,
        "response_amplitude": state.response_amplitude,
        "stops_per_cycle": state.stops_per_cycle,
        "stuck_fraction": state.stuck_fraction,
        "regime": state.regime,
    }


def _truth_of_masses(frame: Structure, first_hz: float) -> dict[str, object]:
    state = steady(frame)
    keys = ("outcome", "energy_per_cycle", "response_amplitude", "stops_per_cycle", "stuck_fraction", "regime")
    row, taken = state.row(), (state.contact_energy_per_cycle, state.frame_energy_per_cycle)
    return {key: row[key] for key in keys} | {
        "energy_dissipated_per_cycle": None if None in taken else sum(each or 0.0 for each in taken),
        "response_amplitudes": row["response_amplitudes"],
        "contacts": row["contacts"],
        "natural_frequencies_hz": [first_hz * float(ratio) for ratio in frame.natural_frequencies],
    }


def twelve_digits(value: object) -> object:
    """A number, or those of a table or list, with the digits that are the same on every machine."""
    if isinstance(value, dict):
        return {key: twelve_digits(each) for key, each in value.items()}
    if isinstance(value, list):
        return [twelve_digits(each) for each in value]
    return float(f"{value:.12g}") if isinstance(value, float) else value


def irregularity_index(cycles: FloatArray) -> float | None:
    """Eq. (4.1) of the motion itself, one cycle a row: what a sensor without noise would give."""
    if len(cycles) < 2 or not np.ptp(cycles):
        return None
    about = cycles - cycles.mean()
    return float(np.mean(np.abs(np.diff(about, axis=0)).sum(axis=1) / np.abs(about[:-1]).sum(axis=1)))


def energy_slope(test: SyntheticTest, transient: float) -> float | None:
    """Change of the steady energy per cycle (k Y^2 per hour) from the end of the transient to the end of the test."""
    if test.jump_s is not None or test.duration_s <= transient:
        return None
    times = (transient, test.duration_s)
    betas = [test.friction_ratio * (1 + test.friction_drift_per_hour * time / HOUR) for time in times]
    energies = [steady_state(test.problem(beta)).energy_per_cycle for beta in betas]
    if energies[0] is None or energies[1] is None:
        return None
    return (energies[1] - energies[0]) / (times[1] - times[0]) * HOUR
