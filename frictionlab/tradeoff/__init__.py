"""What accuracy costs: error and time of every knob, measured together on this machine, with the truth that judges it.

Each of `KNOBS` measures the settings of one; errors are the same each time, seconds are this machine's. Steady states
are judged by orbits of 50 digits (`tests/extremes/reference`) or of another method; what is measured, by synthetic
recordings of the exact orbit with the noise of an optoNCDT 1420. The README of this folder says what was found and why
the defaults are where they are.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from timeit import timeit

import numpy as np

from frictionlab.analysis import cycles, spectrum
from frictionlab.analysis.measurement import measure
from frictionlab.arrays import FloatArray
from frictionlab.inference.compare import compare_measurement
from frictionlab.recording import Recording
from frictionlab.scene import Analysis, Rig, Scene
from frictionlab.scene.keys import LEVELS
from frictionlab.schema import ENERGY
from frictionlab.simulator import Motion, Problem, Solver, SteadyState, last_cycle, steady_state, thesis_run
from frictionlab.simulator.numeric import RTOL, Integrated

ROUNDING = 1e-14  # errors below this are all the same: rounding
BETTER = 0.95  # an error is smaller if it is below this share of the other
FASTER = 0.6  # a time is shorter if it is below this share of the other: two runs differ by less
FIRST_TWICE = 1.5  # seconds; up to this a first run is repeated, for it may have loaded or compiled something
LAPS = 7  # runs of one setting, at most
WORTH_REPEATING = 0.8  # seconds spent on the repetitions of one setting, at most about


@dataclass(frozen=True)
class Setting:
    """One setting of one knob: the contract's keys, then what helps.

    ``error`` relative, of ``quantity``, against ``reference``; ``seconds``: the shortest of several runs;
    ``default``: what commands use by default; ``dominated``: another setting of the knob beats it in both;
    ``over_bound``: the error in units of the Cramer-Rao bound; ``None`` where it has none.
    """

    knob: str
    setting: str
    quantity: str
    error: float
    seconds: float
    default: bool = False
    dominated: bool = False
    over_bound: float | None = None
    reference: str = ""

    def row(self) -> dict[str, object]:
        """A line of JSON or of a table."""
        return asdict(self)


@dataclass(frozen=True)
class Run:
    """A setting before it is run: ``run`` does the work, ``error_of`` judges what it returned."""

    setting: str
    run: Callable[[], object]
    error_of: Callable[[object], float]
    default: bool = False


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


def run_trials(knob: str, quantity: str, reference: str, trials: Sequence[Run]) -> tuple[Setting, ...]:
    """Run all settings of a knob in turn, several rounds of them, and judge each by its result and its shortest time.

    Going round keeps a slow minute of the machine from being one setting's bad luck; the collector of garbage waits.
    """
    shortest, spent, errors = ([start] * len(trials) for start in (math.inf, 0.0, math.nan))
    results: list[object] = []
    for lap in range(LAPS):
        for i, trial in enumerate(trials):
            if spent[i] > (WORTH_REPEATING if lap > 1 else FIRST_TWICE):
                continue
            seconds = timeit("results.append(run())", globals={"results": results, "run": trial.run}, number=1)
            shortest[i], spent[i] = min(shortest[i], seconds), spent[i] + seconds
            if math.isnan(errors[i]):
                errors[i] = trial.error_of(results[-1])
    return marked(
        [
            Setting(knob, trial.setting, quantity, error, seconds, trial.default, reference=reference)
            for trial, error, seconds in zip(trials, errors, shortest, strict=True)
        ]
    )


Knob = Callable[[], tuple[Setting, ...]]
Measured = tuple[str, Callable[[Recording], float | FloatArray], bool]
"""The name of a setting, what measures a recording with it, and whether it is the default."""
# Energy per cycle (r, beta) from 50-digit orbits: tests/simulator/reference/make_reference.py, rounded to 25 digits.
CONTINUOUS, CONTINUOUS_ENERGY = Problem(0.7, 0.5), 3.488507872497761966686743
STICK_SLIP, STICK_SLIP_ENERGY = Problem(0.5, 0.4), 2.126042266393348841691811
SLOW, SLOW_ENERGY = Problem(0.95, 0.1), 4.070974217426422039358113
DIGITS = "50-digit orbit (tests/extremes/reference)"
SOFT = {"stiffness_ratio": 100.0}
CURVE = {"static_ratio": 1.2, "stribeck_speed": 0.1}
AGE = {"direct_effect": 0.05, "evolution_effect": 0.03, "slip_distance": 0.01, "reference_speed": 0.1}
CONTACTS: dict[str, tuple[Problem, float]] = {  # and its energy per cycle, by scipy's DOP853 on its own orbit
    name: (Problem(0.3, 0.6, law=f"coulomb+{name}", parameters=parameters), truth)
    for name, parameters, truth in (
        ("stribeck", CURVE, 1.993360043181),
        ("lugre", SOFT | CURVE | {"bristle_damping": 0.1}, 1.888145795724),
        ("rate-state", SOFT | AGE, 1.892207367962),
    )
}
R, BETA, NATURAL_HZ, BASE_M = 0.3, 0.6, 3.13, 1.8e-3
DRIVE_HZ = R * NATURAL_HZ  # 0.939 Hz
NOISE = 4.4e-4  # rms over Y: 0.8 um on 1.8 mm
DURATION_S, RATE_HZ = 70.0, 250.0
RECORDINGS, FEW = 12, 4  # of each kind, each with its own noise and phase; where recordings are long
TRUTH = "synthetic recordings of the exact orbit"
SCENE = Scene(rig=Rig(natural_frequency_hz=NATURAL_HZ), analysis=Analysis(transient_s=20.0, cycles="all"))


def _off(truth: float) -> Callable[[object], float]:
    """What judges a steady state, an energy or measured numbers by their relative rms distance from the truth."""

    def error(result: object) -> float:
        found = result.energy_per_cycle if isinstance(result, SteadyState) else result
        return float(np.sqrt(np.mean((np.asarray(found, dtype=float) / truth - 1.0) ** 2)))

    return error


def solver_of(name: str, problem: Problem, truth: float, *tolerances: float) -> tuple[Setting, ...]:
    """The exact orbit, and the thesis's RK45 over 100 cycles from rest at relative tolerances."""
    solvers: tuple[Solver, ...] = ("auto", "closed-form", "exact") if problem is CONTINUOUS else ("auto", "exact")
    trials = [Run(one, partial(steady_state, problem, solver=one), _off(truth), one == "auto") for one in solvers]
    for rtol in tolerances:
        run = partial(thesis_run, problem, rtol=rtol, atol=1e-3 * rtol)
        trials.append(Run(f"thesis, rtol {rtol:.0e}", run, _off(truth)))
    return run_trials(f"solver, {name}", ENERGY, DIGITS, trials)


def cycles_waited() -> tuple[Setting, ...]:
    """Cycles run from rest before the last is read, against the orbit solved for (r = 0.95, beta = 0.1)."""
    waited = (10, 100, 1000, 3000)
    trials = [Run(f"{n} cycles waited", partial(last_cycle, SLOW, cycles=n), _off(SLOW_ENERGY)) for n in waited]
    solved = partial(steady_state, SLOW, solver="exact")
    trials.append(Run("orbit solved for", solved, _off(SLOW_ENERGY), default=True))
    return run_trials("cycles waited", ENERGY, DIGITS, trials)


def tolerance_of(name: str) -> tuple[Setting, ...]:
    """The integrator's tolerance under a law without exact slides (r = 0.3, beta = 0.6)."""
    problem, truth = CONTACTS[name]
    steady_state(problem)  # what loading and compiling costs is no matter of the tolerance
    trials = [
        Run(f"rtol {rtol:.0e}", Integrated(problem, rtol).steady, _off(truth), default=rtol == RTOL)
        for rtol in (1e-4, 1e-6, 1e-8, 1e-10)
    ]
    return run_trials(f"tolerance, {name}", ENERGY, "scipy's DOP853 at rtol 1e-13 on its own orbit", trials)


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


def _each(knob: str, quantity: str, truth: float, *settings: Measured, count: int = FEW) -> tuple[Setting, ...]:
    """Measure every recording with each setting."""
    those = [recording(seed) for seed in range(count)]
    trials = [Run(name, partial(_joined, way, those), _off(truth), default) for name, way, default in settings]
    return tuple(replace(s, seconds=s.seconds / count) for s in run_trials(knob, quantity, TRUTH, trials))


def _joined(measured: Callable[[Recording], float | FloatArray], those: Sequence[Recording]) -> FloatArray:
    return np.hstack([measured(one) for one in those])


def padding() -> tuple[Setting, ...]:
    """Padding of the FFT that finds the drive, its highest bin interpolated, and the phases that analyze adds."""
    ways, many = {"interpolated": _interpolated, "phases": _phases}, (1, 4, 16)
    settings: list[Measured] = [
        (f"{n}x, {name}", partial(way, padding=n), (name, n) == ("phases", 4))
        for name, way in ways.items()
        for n in many
    ]
    n = round(DURATION_S * RATE_HZ)
    bound = math.sqrt(6.0 / (n * (n * n - 1.0))) * NOISE * RATE_HZ / math.pi / DRIVE_HZ  # [Rife and Boorstyn 1974]
    found = _each("fft padding", "drive_frequency_hz", DRIVE_HZ, *settings, count=RECORDINGS)
    return tuple(replace(s, over_bound=s.error / bound) for s in found)


def _interpolated(one: Recording, *, padding: int) -> float:
    lines = spectrum.amplitude_spectrum(one.base_displacement, 1 / RATE_HZ, padding=padding)
    return spectrum.strongest_tone(lines).frequency


def _phases(one: Recording, *, padding: int) -> float:
    guess = _interpolated(one, padding=padding)
    return cycles.cut(one.base_displacement, guess / RATE_HZ, noise=NOISE * BASE_M).frequency * RATE_HZ


def _energy(one: Recording, rule: str) -> float:
    scene = SCENE.model_copy(update={"analysis": Analysis(transient_s=20.0, cycles=rule)})
    return measure(one, scene).energy_per_cycle


def cycles_averaged() -> tuple[Setting, ...]:
    """Cycles that the energy is the mean of; the thesis takes the last."""
    rules = ("last", "window:15", "all")
    settings: list[Measured] = [(rule, partial(_energy, rule=rule), rule == "all") for rule in rules]
    return _each("cycles averaged", ENERGY, orbit()[1], *settings)


def accuracy_of(command: str) -> tuple[Setting, ...]:
    """The three levels of ``--accuracy`` of ``analyze`` or ``compare-numeric``."""

    def run(one: Recording, level: str) -> float | FloatArray:
        scene = SCENE.with_accuracy(level)
        measured = measure(one, scene)
        return measured.series.energy if command == "analyze" else compare_measurement(measured, scene).friction_ratio

    quantity, truth = (f"{ENERGY} of one cycle", orbit()[1]) if command == "analyze" else ("friction_ratio", BETA)
    settings: list[Measured] = [(name, partial(run, level=name), name == "balanced") for name in LEVELS]
    return _each(f"{command} --accuracy", quantity, truth, *settings)


KNOBS: tuple[Knob, ...] = (
    partial(solver_of, "continuous motion", CONTINUOUS, CONTINUOUS_ENERGY, 1e-3),
    partial(solver_of, "stick-slip", STICK_SLIP, STICK_SLIP_ENERGY, 1e-3, 1e-6, 1e-10),
    cycles_waited,
    *(partial(tolerance_of, name) for name in CONTACTS),
    padding,
    cycles_averaged,
    partial(accuracy_of, "analyze"),
    partial(accuracy_of, "compare-numeric"),
)
"""What measures the settings of each; about a minute in all."""
