"""The simulator seen through a laser: logs whose truth is known.

A virtual rig runs each test of ``[[synthetic.tests]]`` from rest (or from its steady state), cycle by cycle, so that
the friction force may drift, scatter or jump as the scene says. Two virtual optoNCDT sensors add noise and round to
their step. Nothing here is measured, and every log says so in its first lines.
"""

import json
import math
import re
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from frictionlab.errors import ParameterError, SceneError
from frictionlab.files import check_replaceable, write_whole
from frictionlab.scene import Scene, VirtualTests
from frictionlab.simulator import Motion, Problem, observe, simulate, steady_state

FloatArray = NDArray[np.float64]
HOUR = 3600.0
PHASES = 64  # points per cycle of the true irregularity
MILLIMETRES = 1e3  # the logs are written in the sensor's unit
MARK = b"# SYNTHETIC: "
MOST_SAMPLES = 100_000_000  # of a log: some 3 GB of text
_FIRST = ("log", "material", "normal_force_n", "frequency_ratio", "friction_ratio")  # keys of a truth, in order
_NAME = re.compile(r'[^/\\:*?"<>|\x00-\x1f\x7f-\x9f\ud800-\udfff]{1,100}')
PREAMBLE = (
    "# SYNTHETIC: simulated by frictionlab, not measured\n"
    "# material {material}, normal force {force:g} N, r {ratio:g}; its truth is in truth.jsonl\n"
    "time [s],mass [mm],base [mm]\n"
)


@dataclass(frozen=True)
class VirtualTest:
    """One test of the virtual rig, all numbers known.

    ``friction_ratio`` (beta), ``frequency_ratio`` (r), ``damping_ratio`` (the frame's own) and the law's ``parameters``
    dimensionless; the behaviours as in ``[[synthetic.tests]]``.
    """

    log: str
    material: str
    normal_force_n: float
    frequency_ratio: float
    friction_ratio: float
    friction_coefficient: float
    natural_frequency_hz: float
    base_amplitude_m: float
    stiffness_n_per_m: float
    static_ratio: float
    damping_ratio: float
    wall: Literal["fixed", "base"]
    law: str
    parameters: Mapping[str, float]
    duration_s: float
    friction_drift_per_hour: float
    friction_scatter: float
    jump_s: float | None
    jump_factor: float

    @property
    def drive_frequency_hz(self) -> float:
        """Frequency of the base in Hz, eq. (2.7)."""
        return self.frequency_ratio * self.natural_frequency_hz

    @property
    def is_plain_coulomb(self) -> bool:
        """Whether the friction force is the same in every cycle."""
        return self.friction_drift_per_hour == 0 and self.friction_scatter == 0 and self.jump_s is None

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


def virtual_tests(scene: Scene) -> tuple[VirtualTest, ...]:
    """All tests that a scene's ``[[synthetic.tests]]`` asks for, in its order.

    Raises
    ------
    SceneError
        No tests, no natural frequency or no stiffness in the scene, or a law that cannot be.
    """
    rig, synthetic = scene.rig, scene.synthetic
    if not synthetic.tests:
        raise SceneError("synthetic.tests: expected at least one [[synthetic.tests]] table; got none")
    if rig.natural_frequency is None or rig.stiffness is None:
        raise SceneError(
            "rig: a virtual rig needs natural frequency and stiffness: give two of natural_frequency_hz, mass_kg and"
            " stiffness_n_per_m"
        )
    for number, group in enumerate(synthetic.tests):
        _check_words(group, number)
        _check_length(group.duration_s or synthetic.duration_s, synthetic.sampling_rate_hz, number)
    tests = tuple(
        _checked(_virtual_test(scene, group, force, ratio), group, number)
        for number, group in enumerate(synthetic.tests)
        for force in group.normal_forces_n
        for ratio in group.frequency_ratios
    )
    names = [test.log for test in tests]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise SceneError(f"synthetic.tests: the same test stands twice: {', '.join(twice)}; leave one out")
    return tests


def _check_words(group: VirtualTests, number: int) -> None:
    """Refuse a material or label that cannot stand in the name of a log."""
    for key, word in (("material", group.material), ("label", group.label)):
        if word is not None and not _NAME.fullmatch(word):
            raise SceneError(
                f"synthetic.tests.{number}.{key}: expected a word that can name a file (1 to 100 characters, none of"
                f' / \\ : * ? " < > | and no control characters); got {word!r}'
            )


def _check_length(duration_s: float, rate: float, number: int) -> None:
    """Refuse a log that no memory holds."""
    if duration_s * rate > MOST_SAMPLES:
        raise SceneError(
            f"synthetic.tests.{number}: {duration_s:g} s at {rate:g} Hz are {duration_s * rate:.3g} samples: expected"
            f" at most {MOST_SAMPLES}: shorten duration_s, or lower sampling_rate_hz"
        )


def _virtual_test(scene: Scene, group: VirtualTests, force: float, ratio: float) -> VirtualTest:
    rig, model, synthetic = scene.rig, scene.model, scene.synthetic
    stiffness, natural_frequency = rig.stiffness or 0.0, rig.natural_frequency or 0.0
    beta = group.friction_coefficient * force / (stiffness * synthetic.base_amplitude_m)
    duration = group.duration_s or synthetic.duration_s
    return VirtualTest(
        log=f"{group.material}_N{force:g}_r{ratio:g}{_label(group)}.csv",
        material=group.material,
        normal_force_n=force,
        frequency_ratio=ratio,
        friction_ratio=beta,
        friction_coefficient=group.friction_coefficient,
        natural_frequency_hz=natural_frequency,
        base_amplitude_m=synthetic.base_amplitude_m,
        stiffness_n_per_m=stiffness,
        static_ratio=model.static_ratio,
        damping_ratio=scene.frame_damping_ratio,
        wall=model.wall,
        law=group.law or ("coulomb" if model.law == "auto" else model.law),
        parameters=dict(group.parameters) if group.law else dict(model.parameters) | dict(group.parameters),
        duration_s=duration,
        friction_drift_per_hour=group.friction_drift_per_hour,
        friction_scatter=group.friction_scatter,
        jump_s=group.jump_s,
        jump_factor=group.jump_factor,
    )


def _checked(test: VirtualTest, group: VirtualTests, number: int) -> VirtualTest:
    """The test, if its law and parameters make sense and its friction may change as it is said to."""
    place = f"synthetic.tests.{number}.{'law' if group.law else 'parameters'}"
    place = place if group.law or group.parameters else "model.law"
    try:
        law = test.problem().law
    except ParameterError as error:
        raise SceneError(f"{place}: {error}") from error
    if law.kind in ("elastic", "inner") and not test.is_plain_coulomb:
        raise SceneError(
            f"{place}: law {law.name} remembers more than where the mass is: its friction cannot drift, scatter or"
            " jump here; expected a law without memory, or friction that stays the same"
        )
    return test


def _label(group: VirtualTests) -> str:
    return f"_{group.label}" if group.label else ""


def synthesize(scene: Scene, folder: Path) -> Iterator[VirtualTest]:
    """Write one log per virtual test into a folder, and their truth beside them (``truth.jsonl``, last).

    Parameters
    ----------
    scene : Scene
        Its ``[rig]``, ``[model]`` and ``[synthetic]`` tables say all; the same scene gives the same bytes.
    folder : Path
        Made if it is not there. Synthetic logs of the same names are replaced, measured ones never.

    Yields
    ------
    VirtualTest
        Each test when its log stands.

    Raises
    ------
    SceneError
        As :func:`virtual_tests`.
    OutputError
        The folder cannot be written, or a log that is not synthetic stands there.
    """
    tests = virtual_tests(scene)
    folder.mkdir(parents=True, exist_ok=True)
    check_replaceable(folder / "truth.jsonl", replace=is_truth)
    for test in tests:
        check_replaceable(folder / test.log, replace=is_synthetic)
    truths = []
    for test in tests:
        text, more = _log_and_behaviour(test, scene)
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


def _log_and_behaviour(test: VirtualTest, scene: Scene) -> tuple[str, dict[str, object]]:
    """The log of one test, and what is true of it beyond `truth` where its friction changes; simulated once."""
    if test.is_plain_coulomb:
        return log_text(test, scene), {}
    transient = scene.analysis.transient_s
    time, phases = _sample_times(test, scene), _phase_times(test, transient)
    mass, exact = _motion_at(test, scene, time, phases.ravel())
    behaviour: dict[str, object] = {
        "irregularity_index": _irregularity_index(exact.reshape(phases.shape)),
        "energy_slope_per_hour": _energy_slope(test, transient),
    }
    return _lines(test, scene, time, mass), behaviour


def log_text(test: VirtualTest, scene: Scene) -> str:
    """The log of one test: preamble, header, one line per sample; time in s, displacements in mm."""
    time = _sample_times(test, scene)
    return _lines(test, scene, time, motion(test, time, scene))


def _sample_times(test: VirtualTest, scene: Scene) -> FloatArray:
    rate = scene.synthetic.sampling_rate_hz
    return np.asarray(np.arange(round(test.duration_s * rate)) / rate)


def _lines(test: VirtualTest, scene: Scene, time: FloatArray, mass: FloatArray) -> str:
    """The text of a log: ``time`` (n,) s, ``mass`` (n,) m before any sensor."""
    synthetic = scene.synthetic
    noise = _generator(test, scene, "noise")
    base = test.base_amplitude_m * np.cos(2 * math.pi * test.drive_frequency_hz * time)
    seen = [_through_laser(signal, synthetic.noise_m, synthetic.step_m, noise) for signal in (mass, base)]
    table = np.column_stack([time, *(MILLIMETRES * signal for signal in seen)])
    head = PREAMBLE.format(material=test.material, force=test.normal_force_n, ratio=test.frequency_ratio)
    return head + ("%.6f,%.6f,%.6f\n" * len(time)) % tuple(table.ravel().tolist())


def _generator(test: VirtualTest, scene: Scene, purpose: str) -> np.random.Generator:
    """A stream of its own for each test and purpose: adding a test changes no other."""
    return np.random.default_rng([scene.synthetic.seed, zlib.crc32(f"{test.log}/{purpose}".encode())])


def _through_laser(signal: FloatArray, noise: float, step: float, generator: np.random.Generator) -> FloatArray:
    """What a sensor makes of a displacement (m): noise of the given rms, then rounding to its step."""
    noisy = signal + noise * generator.standard_normal(len(signal))
    return np.round(noisy / step) * step if step else noisy


def _phase_times(test: VirtualTest, transient: float) -> FloatArray:
    """Times (s) of 64 phases in each full cycle after the transient, cut where the base rises through zero."""
    first = math.ceil(transient * test.drive_frequency_hz + 0.25)
    last = math.floor(test.duration_s * test.drive_frequency_hz + 0.25)
    cycles = np.arange(first, max(first, last))[:, None] - 0.25
    return np.asarray((cycles + np.arange(PHASES) / PHASES) / test.drive_frequency_hz)


def _motion_at(test: VirtualTest, scene: Scene, *times: FloatArray) -> list[FloatArray]:
    """The motion at several sets of times, simulated once."""
    every = np.concatenate(times)
    order = np.argsort(every, kind="stable")
    displacement = np.empty_like(every)
    displacement[order] = motion(test, every[order], scene)
    return np.split(displacement, np.cumsum([len(t) for t in times])[:-1])


def _irregularity_index(cycles: FloatArray) -> float | None:
    """Eq. (4.1) of the motion itself, one cycle a row: what a sensor without noise would give."""
    if len(cycles) < 2 or not np.ptp(cycles):
        return None
    about = cycles - cycles.mean()
    return float(np.mean(np.abs(np.diff(about, axis=0)).sum(axis=1) / np.abs(about[:-1]).sum(axis=1)))


def motion(test: VirtualTest, time: FloatArray, scene: Scene) -> FloatArray:
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


def _steady_orbit(test: VirtualTest) -> tuple[Motion, float]:
    """The steady orbit of a test and its period (rad)."""
    state = steady_state(test.problem())
    if state.orbit is None or state.period_cycles is None:
        raise SceneError(f"synthetic.tests: {test.log}: start = 'steady' needs a steady state; got {state.outcome}")
    return state.orbit, 2 * math.pi * state.period_cycles


def cycle_friction_ratios(test: VirtualTest, scene: Scene) -> FloatArray:
    """Friction ratio of each cycle: drift, jump and scatter as the test's material has them; shape (cycles,)."""
    cycles = math.ceil(test.duration_s * test.drive_frequency_hz)
    start = np.arange(cycles) / test.drive_frequency_hz
    factor = 1 + test.friction_drift_per_hour * start / HOUR
    if test.jump_s is not None:
        factor = np.where(start >= test.jump_s, test.jump_factor, 1.0) * factor
    if test.friction_scatter:
        factor = factor * (1 + test.friction_scatter * _generator(test, scene, "friction").standard_normal(cycles))
    return test.friction_ratio * np.maximum(factor, 0.0)


def truth(test: VirtualTest) -> dict[str, object]:
    """What is known of a test: its parameters and the steady state of its (undisturbed) problem, as sensors show it.

    ``energy_per_cycle`` is the loop's (2.18); where the wall moves with the base, or the frame has a dashpot, the
    energy dissipated is another number and stands beside it. Numbers have twelve digits, which are the same on every
    machine; the last four of a double are not.
    """
    state = steady_state(test.problem())
    seen = observe(state)
    known = {
        **{key: value for key, value in asdict(test).items() if value is not None},
        "drive_frequency_hz": test.drive_frequency_hz,
        "friction_force_n": test.friction_coefficient * test.normal_force_n,
        "outcome": state.outcome,
        "energy_per_cycle": seen.energy_per_cycle,
        "energy_dissipated_per_cycle": state.energy_per_cycle,
        "response_amplitude": seen.response_amplitude,
        "stops_per_cycle": seen.stops_per_cycle,
        "stuck_fraction": state.stuck_fraction,
        "regime": seen.regime,
    }
    return {key: _twelve_digits(value) for key, value in known.items()}


def _twelve_digits(value: object) -> object:
    if isinstance(value, dict):
        return {key: _twelve_digits(each) for key, each in value.items()}
    return float(f"{value:.12g}") if isinstance(value, float) else value


def _energy_slope(test: VirtualTest, transient: float) -> float | None:
    """Change of the steady energy per cycle (k Y^2 per hour) from the end of the transient to the end of the test."""
    if test.jump_s is not None or test.duration_s <= transient:
        return None
    times = (transient, test.duration_s)
    betas = [test.friction_ratio * (1 + test.friction_drift_per_hour * time / HOUR) for time in times]
    energies = [observe(steady_state(test.problem(beta))).energy_per_cycle for beta in betas]
    if energies[0] is None or energies[1] is None:
        return None
    return (energies[1] - energies[0]) / (times[1] - times[0]) * HOUR
