"""The simulator seen through a laser: logs whose truth is known.

A virtual rig runs each test of ``[[synthetic.tests]]``; two virtual optoNCDT sensors add noise and round to their step.
Nothing here is measured, and every log says so in its first lines. Here logs, and what is true of them, go into files;
``virtual_rig`` says what each test is, how base and mass move, and what changes while a test runs.
"""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from frictionlab.errors import SceneError
from frictionlab.files import check_replaceable, make_folder, write_whole
from frictionlab.recording import quantity_named
from frictionlab.scene import Scene
from frictionlab.schema import AMPLITUDE, ENERGY, REGIME, STOPS, value_of
from frictionlab.simulator import steady_state
from frictionlab.synthetic.virtual_rig import SyntheticTest as SyntheticTest
from frictionlab.synthetic.virtual_rig import motion
from frictionlab.synthetic.virtual_rig import virtual_tests as virtual_tests
from frictionlab.units import UNIT

MILLIMETRES = 1e3  # the logs are written in the sensor's unit
MARK = b"# SYNTHETIC: "
GIVEN = (
    *("log", "material", "normal_force_n", "frequency_ratio", "friction_ratio", "friction_coefficient"),
    *("natural_frequency_hz", "base_amplitude_m", "stiffness_n_per_m", "static_ratio", "damping_ratio", "wall", "law"),
    *("parameters", "duration_s", "friction_drift_per_hour", "friction_scatter", "jump_s", "jump_factor"),
)
"""Keys of a truth, in order: of a test, and of its table in the scene; the first five are its mark."""
PREAMBLE = (
    "# SYNTHETIC: simulated by frictionlab, not measured\n"
    "# material {test.group.material}, normal force {test.normal_force_n:g} N, r {test.frequency_ratio:g}; its truth is"
    " in truth.jsonl\n"
    "{columns}\n"
)


def synthesize(scene: Scene, folder: Path) -> Iterator[SyntheticTest]:
    """Write one log per virtual test into a folder, each given when it stands; their truth last (``truth.jsonl``).

    ``[rig]``, ``[model]`` and ``[synthetic]`` say all: the same scene gives the same bytes. Synthetic logs of the same
    names are replaced, measured ones never (OutputError).
    """
    tests = virtual_tests(scene)
    make_folder(folder)
    check_replaceable(folder / "truth.jsonl", replace=is_truth)
    for test in tests:
        check_replaceable(folder / test.log, replace=is_synthetic)
    truths = []
    for test in tests:
        write_whole(folder / test.log, log_of(test, scene).encode(), replace=is_synthetic)
        truths.append(json.dumps(truth(test)) + "\n")
        yield test
    write_whole(folder / "truth.jsonl", "".join(truths).encode(), replace=is_truth)


def is_truth(path: Path) -> bool:
    """Whether a file holds the truth of synthetic logs: its first line has the numbers that `truth` gives."""
    with path.open("rb") as file:
        first = file.readline(1 << 20)
    try:
        row = json.loads(first)
    except (ValueError, RecursionError):
        return False
    return isinstance(row, dict) and tuple(row)[:5] == GIVEN[:5]


def is_synthetic(log: Path) -> bool:
    """Whether a log says in its first line that it is synthetic."""
    with log.open("rb") as file:
        return file.readline(len(MARK) + 1).startswith(MARK)


def log_of(test: SyntheticTest, scene: Scene) -> str:
    """The log of one test through its lasers: noise, then rounding to their step; time in s and displacements in mm."""
    synthetic, rate = scene.synthetic, scene.synthetic.sampling_rate_hz
    names, radius_m = synthetic.channels, scene.rig.radius_m
    if test.frame is not None and names:
        raise SceneError(f"synthetic.channels: expected none for a frame with [[rig.masses]]; got {', '.join(names)}")
    if "angle" in names and radius_m is None:
        raise SceneError("synthetic.channels: an angle needs [rig] radius_m: give it, or leave angle out")
    time = np.arange(round(test.duration_s * rate)) / rate
    moved = motion(test, time, scene)
    masses, base = test.base_amplitude_m * moved.mass.T, test.base_amplitude_m * moved.base
    heads = ["mass [mm]"] if len(masses) == 1 else [f"mass {number} [mm]" for number in range(1, len(masses) + 1)]
    more = moved.channels([name for name in names if name != "angle"])
    if "angle" in names and radius_m is not None:
        heads, more, masses = [], {"angle": masses[0] / radius_m, **more}, masses[:0]
    noise, further = test.draws(scene, "noise"), test.draws(scene, "channels")
    seen = []
    for signal in (*masses, base):
        noisy = signal + synthetic.noise_m * noise.standard_normal(len(signal))
        step = synthetic.step_m
        seen.append(MILLIMETRES * (np.round(noisy / step) * step if step else noisy))
    line = "%.6f" + ",%.6f" * len(seen) + ",%.9g" * len(more) + "\n"
    for values in more.values():
        rms = synthetic.channel_noise * float(np.sqrt(np.mean(values**2)))
        seen.append(values + rms * further.standard_normal(len(values)))
    further_heads = [f"{name.replace('_', ' ')} [{UNIT[quantity_named(name)]}]" for name in more]
    head = PREAMBLE.format(test=test, columns=",".join(["time [s]", *heads, "base [mm]", *further_heads]))
    return head + (line * len(time)) % tuple(np.column_stack([time, *seen]).ravel().tolist())


def truth(test: SyntheticTest) -> dict[str, object]:
    """What is known of a test: its parameters and the steady state of its (undisturbed) problem, as sensors show it.

    The energy per cycle is the loop's (2.18); where the wall moves with the base, or the frame has a dashpot, the
    energy dissipated is another number and stands beside it. Numbers have twelve digits, which are the same on every
    machine; the last four of a double are not.
    """
    said, state = test.group.model_dump() | vars(test), steady_state(test.frame or test.problem())
    known: dict[str, object] = {key: said[key] for key in GIVEN if said[key] is not None} | {
        "drive_frequency_hz": test.drive_frequency_hz,
        "friction_force_n": test.group.friction_coefficient * test.normal_force_n,
        "outcome": state.outcome,
        ENERGY: state.energy_per_cycle,
        "energy_dissipated_per_cycle": state.energy_taken,
        **{key: value_of(state, key) for key in (AMPLITUDE, STOPS, "stuck_fraction", REGIME)},
    }
    if test.frame is not None:
        ratios = test.frame.natural_frequencies
        known |= {key: state.row()[key] for key in ("response_amplitudes", "contacts")}
        known["natural_frequencies_hz"] = [test.natural_frequency_hz * float(ratio) for ratio in ratios]
    return {key: _twelve_digits(value) for key, value in known.items()}


def _twelve_digits(value: object) -> object:
    """A number, or those of a table or list, with the digits that are the same on every machine."""
    if isinstance(value, dict):
        return {key: _twelve_digits(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_twelve_digits(each) for each in value]
    return float(f"{value:.12g}") if isinstance(value, float) else value
