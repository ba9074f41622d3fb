"""The simulator seen through a laser: logs of a virtual rig whose truth is known.

It runs each test of ``[[synthetic.tests]]``, from rest or steadily, cycle by cycle; two virtual optoNCDT sensors add
noise and round to their step, and further sensors may show more. Nothing here is measured, and every log says so in its
first lines.
"""

import json
import math
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Literal

import numpy as np

from frictionlab.arrays import FloatArray
from frictionlab.errors import ParameterError, SceneError
from frictionlab.files import as_disks_see, check_replaceable, make_folder, write_whole
from frictionlab.recording import quantity_named
from frictionlab.scene import Scene, VirtualTests
from frictionlab.scene.physical import structure_of, to_physical
from frictionlab.schema import AMPLITUDE, ENERGY, REGIME, STOPS, value_of
from frictionlab.simulator import Motion, Problem, Structure, simulate, steady_state
from frictionlab.simulator.laws import law_of
from frictionlab.units import UNIT

HOUR_S, TURN = 3600.0, 2.0 * math.pi
MOST_SAMPLES = 20_000_000  # of a log, written from memory: some 4 GB
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


@dataclass(frozen=True)
class SyntheticTest:
    """One test of the virtual rig, all numbers known.

    ``group``: its table of ``[[synthetic.tests]]``, which says how its friction behaves; ``friction_ratio`` (beta),
    ``frequency_ratio`` (r), ``damping_ratio`` (the frame's own) and the law's ``parameters`` dimensionless; ``frame``:
    of several masses or contacts.
    """

    log: str
    group: VirtualTests
    normal_force_n: float
    frequency_ratio: float
    friction_ratio: float
    natural_frequency_hz: float
    base_amplitude_m: float
    stiffness_n_per_m: float
    static_ratio: float
    damping_ratio: float
    wall: Literal["fixed", "base"]
    law: str
    parameters: Mapping[str, float]
    duration_s: float
    frame: Structure | None

    @property
    def drive_frequency_hz(self) -> float:
        """Frequency of the base in Hz, eq. (2.7)."""
        return self.frequency_ratio * self.natural_frequency_hz

    @property
    def cycles(self) -> int:
        """Cycles that are begun, one at least."""
        return max(1, math.ceil(self.duration_s * self.drive_frequency_hz))

    @property
    def is_plain_coulomb(self) -> bool:
        """Whether the friction force is the same in every cycle."""
        group = self.group
        return not (group.friction_drift_per_hour or group.friction_scatter) and group.jump_s is None

    def draws(self, scene: Scene, purpose: str) -> np.random.Generator:
        """A stream of random numbers of its own for each test and purpose: adding a test changes no other."""
        return np.random.default_rng([scene.synthetic.seed, zlib.crc32(f"{self.log}/{purpose}".encode())])

    def problem(self, friction_ratio: float | None = None) -> Problem:
        """The dimensionless problem (eq. 2.9) of this test, or of it with another friction ratio."""
        beta = self.friction_ratio if friction_ratio is None else friction_ratio
        return Problem(
            self.frequency_ratio,
            beta,
            mu=self.static_ratio,
            wall=self.wall,
            law=self.law,
            parameters=self.parameters,
            frame_damping_ratio=self.damping_ratio,
        )


def virtual_tests(scene: Scene) -> tuple[SyntheticTest, ...]:
    """All tests that a scene's ``[[synthetic.tests]]`` asks for, in its order; SceneError if one cannot be."""
    rig, synthetic = scene.rig, scene.synthetic
    if not synthetic.tests:
        raise SceneError("synthetic.tests: expected at least one [[synthetic.tests]] table; got none")
    if rig.natural_frequency is None or rig.stiffness is None:
        two = "natural_frequency_hz, mass_kg, stiffness_n_per_m"
        raise SceneError(f"rig: a virtual rig needs natural frequency and stiffness: give two of {two}")
    if not 0.0 < rig.stiffness * synthetic.base_amplitude_m < math.inf:
        got = f"got {synthetic.base_amplitude_m:g} m, times {rig.stiffness:g} N/m"
        raise SceneError(f"synthetic.base_amplitude_m: expected an amplitude that makes a finite force; {got}")
    tests = []
    for number, group in enumerate(synthetic.tests):
        law = group.law or ("coulomb" if scene.model.law == "auto" else scene.model.law)
        _check_group(scene, group, law, f"synthetic.tests.{number}")
        for force, ratio in product(group.normal_forces_n, group.frequency_ratios):
            tests.append(_virtual_test(scene, group, law, force, ratio))
            _check_test(tests[-1], f"synthetic.tests.{number}")
    many = Counter(as_disks_see(test.log) for test in tests)
    twice = sorted({test.log for test in tests if many[as_disks_see(test.log)] > 1})
    if twice:
        raise SceneError(f"synthetic.tests: the same test stands twice: {', '.join(twice)}; leave one out")
    return tuple(tests)


def _check_group(scene: Scene, group: VirtualTests, law: str, place: str) -> None:
    """Refuse physical parameters that its law lacks, and a log that no memory holds."""
    for name in group.physical:
        try:
            law_of(law).parameter(name)
        except ParameterError as error:
            raise SceneError(f"{place}.physical: {error}") from error
    duration_s, rate = group.duration_s or scene.synthetic.duration_s, scene.synthetic.sampling_rate_hz
    if duration_s * rate > MOST_SAMPLES:
        got = f"{duration_s:g} s at {rate:g} Hz are {duration_s * rate:.3g} samples: expected at most {MOST_SAMPLES}"
        raise SceneError(f"{place}: {got}: shorten duration_s, or lower sampling_rate_hz")


def _virtual_test(scene: Scene, group: VirtualTests, law: str, force: float, ratio: float) -> SyntheticTest:
    rig, model, synthetic = scene.rig, scene.model, scene.synthetic
    stiffness, natural, amplitude = rig.stiffness or 0.0, rig.natural_frequency or 0.0, synthetic.base_amplitude_m
    beta = group.friction_coefficient * force / (stiffness * amplitude)
    # a friction ratio fixed in [model.parameters] is for fits: a virtual contact has its friction coefficient
    fixed = {} if group.law else {name: value for name, value in model.parameters.items() if name != "beta"}
    parameters = fixed | group.parameters
    for name, value in group.physical.items():  # over the test's own Y and omega
        turn = 2.0 * math.pi * ratio * natural
        factor, _ = to_physical(law_of(law).parameter(name), stiffness, natural, amplitude=amplitude, turn=turn)
        parameters[name] = value / (factor or 1.0)
    named = [group.material, f"N{force:g}", f"r{ratio:g}", *([group.label] if group.label else [])]
    return SyntheticTest(
        log="_".join(named) + ".csv",
        group=group,
        normal_force_n=force,
        frequency_ratio=ratio,
        friction_ratio=beta,
        natural_frequency_hz=natural,
        base_amplitude_m=amplitude,
        stiffness_n_per_m=stiffness,
        static_ratio=model.static_ratio,
        damping_ratio=scene.frame_damping_ratio,
        wall=model.wall,
        law=law,
        parameters=parameters,
        duration_s=group.duration_s or synthetic.duration_s,
        frame=structure_of(scene, ratio, amplitude, beta=beta) if scene.rig.masses or scene.rig.contacts else None,
    )


def _check_test(test: SyntheticTest, place: str) -> None:
    """Refuse a law that cannot be, friction that cannot change as it is said to, and what a frame of several cannot."""
    group = test.group
    if test.frame is not None:
        own = group.law or group.parameters or group.physical
        asked = {
            "law, parameters or physical (they stand in [[rig.contacts]])": own,
            "friction that drifts, scatters or jumps": not test.is_plain_coulomb,
        }
        for what in (what for what, is_asked in asked.items() if is_asked):
            raise SceneError(f"{place}: a frame with [[rig.masses]] or [[rig.contacts]]; got {what}: leave it out")
        return
    place = f"{place}.{'law' if group.law else 'parameters'}" if group.law or group.parameters else "model.law"
    try:
        law = test.problem().law
    except ParameterError as error:
        raise SceneError(f"{place}: {error}") from error
    if law.kind in ("elastic", "inner") and not test.is_plain_coulomb:
        what = f"law {law.name} remembers more than where the mass is"
        raise SceneError(f"{place}: {what}: expected a law without memory, or friction that stays the same")


# How the mass moves ---------------------------------------------------------------------------------------------------


def cycle_friction_ratios(test: SyntheticTest, scene: Scene) -> FloatArray:
    """Friction ratio of each cycle: drift, jump and scatter as the test's material has them; (cycles,)."""
    group = test.group
    start = np.arange(test.cycles) / test.drive_frequency_hz
    factor = 1 + group.friction_drift_per_hour * start / HOUR_S
    if group.jump_s is not None:
        factor = np.where(start >= group.jump_s, group.jump_factor, 1.0) * factor
    if group.friction_scatter:
        factor = factor * (1 + group.friction_scatter * test.draws(scene, "friction").standard_normal(len(start)))
    return test.friction_ratio * np.maximum(factor, 0.0)


@dataclass(frozen=True)
class Moved:
    """The true motion of a test at times (n,), before any sensor.

    ``tau`` (n,) rad; ``mass`` (n, masses) over Y, ``velocity`` (n, masses) its derivative by tau, ``force``
    (n, contacts) of the contacts over k Y.
    """

    test: SyntheticTest
    tau: FloatArray
    mass: FloatArray
    velocity: FloatArray
    force: FloatArray

    @property
    def base(self) -> FloatArray:
        """Displacement of the base (n,) over Y; where it is 0 the spring is relaxed."""
        return np.cos(self.tau)

    def channels(self, names: Sequence[str]) -> dict[str, FloatArray]:
        """Further channels of the log (n,), in SI units, of a frame with one mass and one contact.

        The mass's acceleration is that of its equation of motion (2.9), ``r^2 x'' = y - x + 2 zeta r (y' - x') - n``.
        """
        test, amplitude, rate = self.test, self.test.base_amplitude_m, -np.sin(self.tau)
        turn, natural = TURN * test.drive_frequency_hz, TURN * test.natural_frequency_hz
        x, v, n = self.mass[:, 0], self.velocity[:, 0], self.force[:, 0]
        pull = self.base - x + 2.0 * test.damping_ratio * test.frequency_ratio * (rate - v) - n
        known = {
            "contact_force": test.stiffness_n_per_m * amplitude * n,
            "normal_force": np.full(len(n), test.normal_force_n),
            "mass_velocity": amplitude * turn * v,
            "base_velocity": amplitude * turn * rate,
            "mass_acceleration": amplitude * natural**2 * pull,
            "base_acceleration": -amplitude * turn**2 * self.base,
        }
        return {name: known[name] for name in names}


def motion(test: SyntheticTest, time: FloatArray, scene: Scene) -> Moved:
    """How base and mass move at the given times (n,) [s], ascending from 0."""
    tau = TURN * test.drive_frequency_hz * time
    moved = [run.all_at(some) for run, some in _runs(test, tau, scene)]
    mass, velocity, force = (np.concatenate(parts) for parts in zip(*moved, strict=True))
    return Moved(test, tau, mass, velocity, force)


def _runs(test: SyntheticTest, tau: FloatArray, scene: Scene) -> Iterator[tuple[Motion, FloatArray]]:
    """The motions of one friction ratio each, a cycle or all of them, and the times (rad) that each is asked for."""
    what, orbit, x, v = test.frame or test.problem(), None, 0.0, 0.0
    if scene.synthetic.start == "steady":
        settled = steady_state(what)
        orbit = settled.orbit
        if orbit is None:
            raise SceneError(
                f"synthetic.tests: {test.log}: start = 'steady' needs a steady state; got {settled.outcome}"
            )
        x, v = (float(part[0, 0]) for part in orbit.all_at(np.zeros(1))[:2])
    if test.is_plain_coulomb:
        yield orbit or simulate(what, cycles=test.cycles), tau
        return
    edges = np.searchsorted(tau, TURN * np.arange(test.cycles + 1)).tolist()
    for cycle, beta in enumerate(cycle_friction_ratios(test, scene).tolist()):
        run = simulate(test.problem(beta), cycles=1, x0=x, v0=v)
        yield run, tau[slice(*edges[cycle : cycle + 2])] - TURN * cycle
        x, v = (float(part[0]) for part in run.at(np.array([TURN])))


# Logs, and what is true of them ------------------------------------------------------------------------------------


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
