"""What accuracy costs: error and time of every knob that a user sets, measured together on this machine.

Each of `KNOBS` measures the settings of one; errors are the same each time, seconds are this machine's. Steady states
are judged by orbits of 50 digits (`tests/extremes/reference`); what is measured, by synthetic recordings of the exact
orbit with the noise of an optoNCDT 1420. The README of this folder says what was found and why the defaults are where
they are.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from timeit import timeit

import numpy as np

from frictionlab.analysis.measurement import measure
from frictionlab.arrays import FloatArray
from frictionlab.inference.compare import compare_measurement
from frictionlab.recording import Recording
from frictionlab.scene import Analysis, Rig, Scene
from frictionlab.scene.keys import LEVELS
from frictionlab.schema import ENERGY
from frictionlab.simulator import Motion, Problem, Solver, SteadyState, last_cycle, steady_state

ROUNDING = 1e-14  # errors below this are all the same: rounding
BETTER = 0.95  # an error is smaller if it is below this share of the other
FASTER = 0.6  # a time is shorter if it is below this share of the other: two runs differ by less
LAPS = 7  # timed runs of one setting, at most
WORTH_REPEATING = 0.8  # seconds spent on the repetitions of one setting, at most about


@dataclass(frozen=True)
class Setting:
    """One setting of one knob: the contract's keys, then what its error is against.

    ``error`` relative, of ``quantity``, against ``reference``; ``seconds``: the shortest of several runs;
    ``default``: what commands use by default; ``dominated``: another setting of the knob beats it in both.
    """

    knob: str
    setting: str
    quantity: str
    error: float
    seconds: float
    default: bool = False
    dominated: bool = False
    reference: str = ""

    def row(self) -> dict[str, object]:
        """A line of JSON or of a table."""
        return asdict(self)


def beats(one: Setting, other: Setting) -> bool:
    """Whether one setting is better than another in both error and time, by more than rounding and a run's scatter."""
    smaller = max(one.error, ROUNDING) < BETTER * max(other.error, ROUNDING)
    return smaller and one.seconds < FASTER * other.seconds


def marked(settings: Sequence[Setting]) -> tuple[Setting, ...]:
    """Mark the settings of a knob that others beat.

    Examples
    --------
    >>> slow, fast = Setting("k", "slow", "q", 1e-3, 2.0), Setting("k", "fast", "q", 1e-6, 1.0)
    >>> [s.dominated for s in marked([slow, fast])]
    [True, False]
    """
    return tuple(replace(s, dominated=any(beats(other, s) for other in settings)) for s in settings)


def run_trials(
    knob: str, quantity: str, truth: float, reference: str, runs: Mapping[str, Callable[[], object]], default: str
) -> tuple[Setting, ...]:
    """Run all settings of a knob in turn, several rounds of them, and judge each by its result and its shortest time.

    ``runs``: setting -> what returns a steady state or measured numbers, whose relative rms distance from the truth is
    the error. A first run, which may load or compile something, is not timed. Going round keeps a slow minute of the
    machine from being one setting's bad luck; the collector of garbage waits.
    """
    ends = {name: run() for name, run in runs.items()}
    found = {name: end.energy_per_cycle if isinstance(end, SteadyState) else end for name, end in ends.items()}
    errors = {name: float(np.sqrt(np.mean((np.asarray(e, float) / truth - 1.0) ** 2))) for name, e in found.items()}
    seconds: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(LAPS):
        for name, run in runs.items():
            if sum(seconds[name]) <= WORTH_REPEATING:
                seconds[name].append(timeit(run, number=1))
    return marked([
        Setting(knob, name, quantity, errors[name], min(seconds[name]), name == default, reference=reference)
        for name in runs
    ])  # fmt: skip


Knob = Callable[[], tuple[Setting, ...]]
# Energy per cycle (r, beta) from 50-digit orbits: tests/simulator/reference/make_reference.py, rounded to 25 digits.
CONTINUOUS, CONTINUOUS_ENERGY = Problem(0.7, 0.5), 3.488507872497761966686743
STICK_SLIP, STICK_SLIP_ENERGY = Problem(0.5, 0.4), 2.126042266393348841691811
SLOW, SLOW_ENERGY = Problem(0.95, 0.1), 4.070974217426422039358113
DIGITS = "50-digit orbit (tests/extremes/reference)"
R, BETA, NATURAL_HZ, BASE_M = 0.3, 0.6, 3.13, 1.8e-3
DRIVE_HZ = R * NATURAL_HZ  # 0.939 Hz
NOISE = 4.4e-4  # rms over Y: 0.8 um on 1.8 mm
DURATION_S, RATE_HZ = 70.0, 250.0
RECORDINGS = 4  # each with its own noise and phase
TRUTH = "synthetic recordings of the exact orbit"
SCENE = Scene(rig=Rig(natural_frequency_hz=NATURAL_HZ), analysis=Analysis(transient_s=20.0, cycles="all"))


def solver_of(name: str, problem: Problem, truth: float, *solvers: Solver) -> tuple[Setting, ...]:
    """The solvers that ``--solver`` names, of those that take the problem."""
    runs: dict[str, Callable[[], object]] = {one: partial(steady_state, problem, solver=one) for one in solvers}
    return run_trials(f"solver, {name}", ENERGY, truth, DIGITS, runs, "auto")


def cycles_waited() -> tuple[Setting, ...]:
    """Cycles run from rest before the last is read, against the orbit solved for (r = 0.95, beta = 0.1)."""
    waited = {f"{n} cycles waited": partial(last_cycle, SLOW, cycles=n) for n in (10, 100, 1000, 3000)}
    solved = "orbit solved for"
    runs = {**waited, solved: partial(steady_state, SLOW, solver="exact")}
    return run_trials("cycles waited", ENERGY, SLOW_ENERGY, DIGITS, runs, solved)


@cache
def orbit() -> tuple[Motion, float]:
    """The motion that all recordings are of, and its energy per cycle."""
    state = steady_state(Problem(R, BETA), solver="exact")
    if state.orbit is None or state.energy_per_cycle is None:
        raise ArithmeticError(f"tradeoff: no orbit at r = {R}, beta = {BETA}: {state.outcome}")
    return state.orbit, state.energy_per_cycle


@cache
def recording(seed: int) -> Recording:
    """One recording of the orbit; noise (rms over Y) and phase its own, so that no sampling grid is favoured."""
    time = np.arange(round(DURATION_S * RATE_HZ)) / RATE_HZ
    tau = 2 * math.pi * (DRIVE_HZ * time + np.random.default_rng([seed, round(RATE_HZ)]).uniform())
    off = NOISE * np.random.default_rng([seed, round(RATE_HZ), 1]).standard_normal((2, len(time)))
    mass = orbit()[0].at(np.mod(tau, 2 * math.pi))[0]
    return Recording(time, BASE_M * (mass + off[0]), BASE_M * (np.cos(tau) + off[1]))


def _each(
    knob: str,
    quantity: str,
    truth: float,
    settings: Mapping[str, Scene],
    default: str,
    measured: Callable[[Recording, Scene], float | FloatArray],
) -> tuple[Setting, ...]:
    """Measure every recording with each setting."""
    those = [recording(seed) for seed in range(RECORDINGS)]

    def run(scene: Scene) -> FloatArray:
        return np.hstack([measured(one, scene) for one in those])

    runs = {name: partial(run, scene) for name, scene in settings.items()}
    found = run_trials(knob, quantity, truth, TRUTH, runs, default)
    return tuple(replace(s, seconds=s.seconds / RECORDINGS) for s in found)


def _analysis(**keys: object) -> Scene:
    return SCENE.changed(analysis=keys)


def padding() -> tuple[Setting, ...]:
    """Padding of the FFT that the drive is looked for in, before the phases of all cycles say it."""
    settings = {f"{n}x": _analysis(padding=n) for n in (1, 4, 16)}
    return _each(
        "fft padding", "drive_frequency_hz", DRIVE_HZ, settings, "4x",
        lambda one, scene: measure(one, scene).drive_frequency_hz,
    )  # fmt: skip


def cycles_averaged() -> tuple[Setting, ...]:
    """Cycles that the energy is the mean of; the thesis takes the last."""
    settings = {rule: _analysis(cycles=rule) for rule in ("last", "window:15", "all")}
    return _each(
        "cycles averaged", ENERGY, orbit()[1], settings, "all", lambda one, scene: measure(one, scene).energy_per_cycle
    )


def accuracy_of(command: str) -> tuple[Setting, ...]:
    """The three levels of ``--accuracy`` of ``analyze`` or ``compare-numeric``."""

    def run(one: Recording, scene: Scene) -> float | FloatArray:
        measured = measure(one, scene)
        return measured.series.energy if command == "analyze" else compare_measurement(measured, scene).friction_ratio

    quantity, truth = (f"{ENERGY} of one cycle", orbit()[1]) if command == "analyze" else ("friction_ratio", BETA)
    settings = {level: _analysis(accuracy=level) for level in LEVELS}
    return _each(f"{command} --accuracy", quantity, truth, settings, "balanced", run)


KNOBS: tuple[Knob, ...] = (
    partial(solver_of, "continuous motion", CONTINUOUS, CONTINUOUS_ENERGY, "auto", "closed-form", "exact", "thesis"),
    partial(solver_of, "stick-slip", STICK_SLIP, STICK_SLIP_ENERGY, "auto", "exact", "numeric", "thesis"),
    cycles_waited,
    padding,
    cycles_averaged,
    partial(accuracy_of, "analyze"),
    partial(accuracy_of, "compare-numeric"),
)
"""What measures the settings of each; about a minute in all."""
