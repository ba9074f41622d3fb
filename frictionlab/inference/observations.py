"""The mean cycle of a test as harmonics, with its covariance, and what a law predicts of it.

The noise of a fit is not the sensor's: friction differs a little from cycle to cycle, and then all harmonics move
together. So the covariance comes from the cycles, shrunk towards a smooth diagonal (there are fewer cycles than
harmonics) [Schäfer and Strimmer 2005], and is never below the sensor's white noise.

The base's harmonics are those that its sensor shows. What may differ from them is what the sensor's declared linearity
and crosstalk allow, and that is an unknown of the rig.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, cast

import numpy as np
from scipy.linalg import eigh

from frictionlab.analysis.channels import in_band
from frictionlab.analysis.measurement import Measurement
from frictionlab.analysis.response import Cycle
from frictionlab.analysis.signals import student, variance_inflation
from frictionlab.analysis.steadiness import AS_A_DRIFT, CLEAR
from frictionlab.arrays import ComplexArray, FloatArray, shifted
from frictionlab.errors import NO_FREQUENCY, AnalysisError, UsageError
from frictionlab.inference.comparison import AtContact, contact_force, harmonics_of, loop_energy
from frictionlab.inference.observation import (
    BENDS,
    SENSORS,
    Observation,
    Reached,
    Values,
    at_least,
    noise_of,
    of_few,
    simulated,
)
from frictionlab.scene import Scene, Solver
from frictionlab.simulator import COSINE, Base, Problem, SteadyState, steady_state
from frictionlab.simulator.laws import Law, law_of
from frictionlab.simulator.problem import Wall
from frictionlab.uncertainty import Estimate, bends

Motion = tuple[SteadyState, ComplexArray]

GAIN = "gain_{}"  # of the sensor of a mass, from the second on
FEWEST_CYCLES = 3  # below so many the cycles say nothing of their own scatter
MOST_HARMONICS = 128
FEW = 3.0  # over the number of cycles: the share of the mean variance below which no variance is known
FEW_LEFT_OUT = 15  # below so many cycles they are left out in two halves, else in five parts
PARTS = 8  # that the cycles are left out in, one after the other
POINTS = 4.0  # of a cycle for each harmonic: with fewer, interpolation takes part of it away
MOST_OF_IT = 0.01  # of the motion: how much of a start an error may hold
MOST_LEFT = 0.85  # of a third's change in the next: slower decays look like drifts
MOST_RAISED = 4.0  # of a covariance by autocorrelation: a drift is no noise
ROUNDING = 1e-6  # of the response: interpolation between samples is no better
SEEN = 1e-3  # of Y: smaller harmonics of the base are left out, for each makes a steady state dearer
LEAST_POINTS = 512  # of a simulated cycle: what folds back from beyond is below 3e-8 of Y
STEP = 1e-4  # of a prior's standard deviation: finite differences of the simulated cycle
UNDAMPED = ("thesis", "closed-form")  # solvers that know no frame's dashpot
RESTS = 0.01  # of the mass's largest speed: below it, it may stand
FINE = 2048  # points of a cycle, at least, on which a turn is timed
CURVED, SHARP = 16, 64  # harmonics of the force of a cubic spring, and of what turns round as fast as the mass


@dataclass(frozen=True, kw_only=True)
class OfCycles(Observation):
    """What single cycles were observed of, with their scatter: their mean is fitted.

    ``each`` (n, N): single steady cycles; ``used``: how many the mean is of; ``power``: mean square of the mean cycle;
    ``sensor``: variance of one of the data from the sensor's white noise alone; ``of_all`` (N, N): the part of the
    covariance that all cycles share, the base's noise and what is left of the start; ``by_others``: parts of the
    cycles about their mean (m, N), each with the covariance of the mean by all others, which is how these see them: a
    weight that is found from some cycles lets them scatter too little. None where cycles are too few to say.
    """

    each: FloatArray
    used: int
    power: float
    sensor: float
    of_all: FloatArray
    by_others: tuple[tuple[FloatArray, FloatArray], ...]
    steps: ClassVar = (STEP, -STEP, 0.1 * STEP)

    def start_seen(self, values: Values) -> float:
        """Return what the cycles show of the start in their mean, over its rms, by how far their halves are apart.

        A cycle leaves a share of a disturbance of the steady state at some values; 0 where there is none.
        """
        state, n = self.state(values), len(self.each)
        kept, h = 0.0 if state is None else state.memory, n // 2
        if not 0.0 < kept < 1.0 or not h:
            return 0.0
        apart = self.each[:h].mean(axis=0) - self.each[h:].mean(axis=0)
        in_mean = h * (1.0 - kept**n) / (n * (1.0 - kept**h) * (1.0 - kept ** (n - h)))
        return in_mean * math.sqrt(0.5 * float(apart @ apart) / self.power)

    def covariance(self, at: Reached) -> FloatArray:
        """Return the covariance (n, n) that noise, scatter of the cycles and misfit leave in the coordinates of a fit.

        Of each coordinate the largest variance counts of: the sensors' noise; single cycles carried through the fit
        that the others ask for; what the law cannot explain, harmonic by harmonic (MacKinnon and White's HC3), where
        that is more than noise. The correlations are those of the larger of the two.
        """
        bare, assumed = self.gap(at.slopes), at.gain @ at.gain.T
        if self.by_others:
            white, share = self.over_gap(at.gain), self.missed * self.power * np.eye(len(bare))
            sensor = self.sensor * (white @ white.T)
            moved = []
            for part, covariance in self.by_others:
                weighed = np.linalg.solve(covariance + share, bare)
                moved.append(part @ np.linalg.solve(bare.T @ weighed + at.hold, weighed.T).T)
            each = np.concatenate(moved)
            freedom = len(each) - 1.0
            grown = each * np.sqrt(variance_inflation(each) * student(freedom) / freedom / self.used)
            shown = at_least(of_few(grown, assumed), np.diag(sensor)) + white @ self.of_all @ white.T
        else:
            shown = assumed
        if at.is_noise:
            return shown
        leverage = np.clip(np.diag(at.slopes @ at.gain), 0.0, 0.9)
        missed = at.gain * (at.residual / (1.0 - leverage))
        by_misfit = of_few(missed.T, assumed)
        larger, other = sorted((shown, by_misfit), key=lambda c: -float(np.log(np.diag(c) + 1e-300).sum()))
        return at_least(larger, np.maximum(np.diag(other), np.diag(assumed)))

    def left_out(self, residual: FloatArray, slopes: FloatArray, gain: FloatArray) -> tuple[FloatArray, float | None]:
        """Return the score of each part of the cycles by the fit to the others, one linear step, and their nrmse.

        Every second cycle (or fifth, of many) is a part.
        """
        n = len(self.each)
        count = 2 if n < FEW_LEFT_OUT else 5
        if n < count:
            return np.zeros(0), None
        scores, squares = [], []
        for first in range(count):
            block = np.arange(first, n, count)
            others = self.white(np.delete(self.each, block, axis=0).mean(axis=0) - self.data)
            here = self.white(self.each[block].mean(axis=0) - self.data)
            left = residual + here - slopes @ (gain @ others)
            scores.append(float(left @ left))
            squares.append(self.nrmse(left) ** 2)
        return np.array(scores), math.sqrt(float(np.mean(squares)))


@dataclass(frozen=True, kw_only=True)
class CycleObservation(OfCycles):
    """The mean cycle of one test, under a law: unknowns -> harmonics that would be measured.

    ``cycle``: as it was measured; ``energy`` (k Y^2), ``amplitude`` (Y), ``regime`` of it; ``rate``: of sampling, Hz;
    ``base``: its motion over Y, as its sensor shows it; ``kept`` (K,): how much of each harmonic the mass's filter
    leaves; ``stands``: where the mass stands on average by a law, Y, which no sensor shows; ``seen_masses``: how many
    of a frame's masses were measured, whose harmonics follow each other in the data.
    """

    cycle: Cycle
    energy: Estimate
    amplitude: Estimate
    regime: str
    rate: float
    base: Base
    kept: FloatArray
    stands: float = 0.0
    seen_masses: int = 1
    by_sensors: ClassVar = (*SENSORS, "mass_in_base")

    @property
    def place_words(self) -> str:
        """Where the contact is, as words."""
        return f"{self.wall} wall" + ("" if self.pressed_more is None else ", momentary normal force")

    @property
    def count(self) -> int:
        """Number of harmonics."""
        return len(self.kept)

    def problem(self, values: Values) -> Problem:
        """Return what is simulated at some values, dimensionless in this test, sensors and rig included.

        The base is without what its sensor bends, and has the force of a spring that is not linear.
        """
        bent = {2: 0.5 * values.get("base_parabola", 0.0), 3: 0.25 * values.get("base_cubic", 0.0)}
        cubic, play, load = (values.get(name, 0.0) for name in ("spring_cubic", "play", "load_by_base"))
        varies = self.pressed_more is not None or bool(load)
        if not any((*bent.values(), cubic, play, varies)):
            return simulated(self.law, self.held, self.wall, values, self.r, self.base)
        count = max(self.base.harmonics, SHARP if play or varies else CURVED if cubic else 3)
        lines = np.zeros(count, dtype=np.complex128)
        lines[: self.base.harmonics] = self.base.lines
        for order, size in bent.items():
            lines[order - 1] -= size
        if cubic or play or varies:
            force = np.clip(self.stretch, -play, play) - (cubic * self.stretch**3 if cubic else 0.0)
            if varies:
                force = force - values.get("beta", self.held.get("beta", 0.0)) * self.limit_moved(load)
            by_displacement = (self.r * np.arange(1, count + 1)) ** 2 if self.wall == "base" else 1.0
            lines += harmonics_of(force, count) / by_displacement
        base = Base(tuple(lines.real.tolist()), tuple((-lines.imag).tolist()))
        return simulated(self.law, self.held, self.wall, values, self.r, base)

    @property
    def finer(self) -> int:
        """How many times the points of the measured cycle a turn is timed on."""
        return -(-FINE // len(self.cycle.tau))

    @cached_property
    def stretch(self) -> FloatArray:
        """Measured motion of the mass over the base (p,), Y: what the frame's spring is stretched by."""
        return shifted(slid_of(self.cycle, "base"), times=self.finer) + self.stands

    @cached_property
    def pressed_more(self) -> FloatArray | None:
        """By how much the normal force is above its mean (p,), over that, where it is measured and varies."""
        each = self.cycle.pressed if self.single else None
        return None if each is None else shifted(each.mean(axis=0) / each.mean(), times=self.finer) - 1.0

    @cached_property
    def way(self) -> FloatArray:
        """To which side the mass slides (p,); in a stop that of the next slide, where friction lets go."""
        speed = shifted(self.slid, order=1, times=self.finer)
        way = np.sign(np.where(np.abs(speed) > RESTS * np.abs(speed).max(), speed, 0.0))
        slides = np.flatnonzero(way)
        return way[slides[np.searchsorted(slides, np.arange(len(way))) % len(slides)]] if len(slides) else way

    def limit_moved(self, load: float) -> FloatArray:
        """Return how far a normal force that varies moves the limit of friction (p,), over its mean.

        ``load``: share that follows the base's acceleration.
        """
        order, more = np.arange(1, self.base.harmonics + 1), np.zeros(len(self.way))
        if load:
            half = np.concatenate([[0.0], -0.5 * len(more) * order**2 * self.base.lines])
            more = load * np.fft.irfft(half, len(more))
        return self.way * (more if self.pressed_more is None else more + self.pressed_more)

    def motion(self, values: Values, near: Motion | None = None) -> Motion | None:
        """Return the steady state at some values, and harmonics (n, K) before the sensors; None where it has none."""
        state = self.state(values, None if near is None else near[0])
        if state is None or (state.orbit is None and state.outcome != "stuck"):
            return None
        state = self.as_measured(state)
        cycles = mean_cycles(state, max(LEAST_POINTS, 4 * self.count), self.seen_masses)
        return state, harmonics_of(cycles, self.count)

    def as_measured(self, state: SteadyState) -> SteadyState:
        """Return a state whose motion is not its own mirror image as the twin of the two that the cycle shows.

        A rig that starts the other way round runs on the other one: they have the even harmonics of opposite sign.
        """
        if state.symmetric is not False or state.orbit is None or not (self.single and state.problem.has_mirror_image):
            return state
        even = harmonics_of(mean_cycle(state, max(LEAST_POINTS, 4 * self.count)), self.count)[1::2]
        is_twin = np.vdot(lines_of(self.data[: 2 * self.count])[1::2], even).real < 0.0
        return replace(state, orbit=replace(state.orbit, twin=True)) if is_twin else state

    def seen(self, motion: Motion, values: Values) -> FloatArray:
        """Return harmonics as the sensors show them (2 n K,): gain, lag, crosstalk, nonlinearity, filters.

        Of masses above the first gain, lag and filters.
        """
        lines, *above = motion[1]
        gain, late = self.gain_and_phase(complex(lines[0]), values)
        order = np.arange(1, self.count + 1)
        turned = np.exp(1j * order * late)
        shown = gain * turned * lines
        shown[0] += values.get("base_in_mass", 0.0)
        for name, power in BENDS.items():
            if values.get(name):
                points = max(LEAST_POINTS, 4 * self.count)
                half = np.concatenate([[0.0], 0.5 * points * shown, np.zeros(points // 2 - self.count)])
                shown = shown + values[name] * harmonics_of(bends(np.fft.irfft(half, points))[power - 1], self.count)
        for name in {"mass_filter_s", "filter_s"} & values.keys():
            passed = 1.0 / (1.0 + 1j * order * self.turn * values[name])
            if name == "filter_s":  # the base, that all is over and timed by, is smaller and behind too
                passed *= np.exp(-1j * order * np.angle(passed[0])) / abs(passed[0])
            shown = shown * passed
        gains = (1.0 + values.get(GAIN.format(i), 0.0) for i in range(2, self.seen_masses + 1))
        others = (self.kept * turned * own * line for own, line in zip(gains, above, strict=True))
        return np.concatenate([parts(np.asarray(one)) for one in (self.kept * shown, *others)])

    def solved(self, values: Values, solver: Solver = "auto") -> SteadyState:
        """Return the state predicted by a solver; one without a frame's dashpot leaves out one that was only fitted."""
        plain = solver in UNDAMPED and "frame_damping_ratio" not in self.held
        kept = {name: value for name, value in values.items() if not (plain and name == "frame_damping_ratio")}
        return self.as_measured(steady_state(self.problem(kept), solver=solver))

    def shown(self, state: SteadyState, values: Values) -> tuple[FloatArray | None, float | None, float | None]:
        """Return what the sensors show of a state: the cycle (p,) about its mean, energy and amplitude.

        The cycle is None where nothing moves.
        """
        energy, amplitude, measured = state.energy_per_cycle, state.response_amplitude, self.cycle
        if state.orbit is None:
            return None, energy, amplitude
        points = len(measured.tau)
        plain = mean_cycle(state, points)
        gain, late = self.gain_and_phase(complex(harmonics_of(plain, 1)[0]), values)
        cycle = gain * mean_cycle(state, points, late) + values.get("base_in_mass", 0.0) * np.cos(measured.tau)
        for name, power in BENDS.items():
            cycle = cycle + values.get(name, 0.0) * bends(cycle)[power - 1]
        if energy is not None:
            energy += loop_energy(harmonics_of(cycle - plain, points // 2 - 1), state.problem.base.lines)
        return in_band(cycle - cycle.mean(), measured.kept), energy, None if amplitude is None else gain * amplitude

    @property
    def sums(self) -> tuple[Estimate, ...]:
        """The measured numbers that a test is predicted by: energy and amplitude, as of `summed`."""
        return self.energy, self.amplitude

    def summed(self, lines: FloatArray, late: float = 0.0) -> FloatArray:
        """Return energy (k Y^2, eq. 2.18) and amplitude (Y) of a cycle by its harmonics (2 K,).

        ``late``: phase (rad) by which the mass is shown ahead, taken off.
        """
        cycle, a = self.cycle, lines_of(lines)
        x = np.fft.irfft(np.concatenate([[0.0], 0.5 * LEAST_POINTS * a]), LEAST_POINTS)
        return np.array([loop_energy(a, cycle.base_cosine - 1j * cycle.base_sine, -late), 0.5 * float(np.ptp(x))])

    def energy_by_lag(self, late: float) -> float:
        """Return the part of the measured energy (k Y^2) that is due to a base's channel behind by a phase (rad)."""
        lines, base = lines_of(self.data[: 2 * self.count]), self.cycle.base_cosine - 1j * self.cycle.base_sine
        return loop_energy(lines, base) - loop_energy(lines, base, -late)

    def measured_contact(self, state: SteadyState, late: float) -> AtContact | None:
        """Return the motion of the contact and its force (over k Y) by the measured cycle; None: not measured.

        ``late``: phase by which the base's channel is behind, rad.
        """
        cycle = self.cycle
        return AtContact(cycle.mass_smooth, cycle.mass_velocity, contact_force(cycle, state.problem, late))

    def law_at_contact(self, state: SteadyState, tau: FloatArray) -> AtContact | None:
        """Return the same in the prediction, at phases tau (p,); None where nothing moves."""
        return None if state.orbit is None else AtContact(*state.orbit.at(tau), state.orbit.force(tau))

    def left(self, predicted: FloatArray, values: Values) -> float:  # noqa: ARG002 - of several masses it takes these
        """Return the rms of measured minus predicted cycle (p,), about their means, over the rms of the measured."""
        return nrmse_of(self.cycle.mass, predicted)

    @cached_property
    def slid(self) -> FloatArray:
        """Motion (p,) of the mass over its wall, in Y, without the noise."""
        return slid_of(self.cycle, self.wall)

    @property
    def loop_energy(self) -> float:
        """Energy (k Y^2) that the motion over the wall takes in; a moving wall makes the force r^2 as large."""
        if self.regime == "stuck":
            raise AnalysisError(
                "no friction ratio: the mass stands still, which shows only that friction is at least the spring's"
                " force: measure with less normal force or more base amplitude"
            )
        energy = self.energy.value or 0.0
        if not energy > 0.0:
            cause = "are mass and base the right way round, and does no sensor count the other way (ingest --units)?"
            if (self.energy.u or 0.0) > abs(energy):
                cause = "known as it is, the channels' clocks may make it anything: give lag_s and lag_s_u in [log]"
            raise AnalysisError(
                f"no friction ratio: the loop's energy is {self.energy} k Y^2; expected more than 0: {cause}"
            )
        return energy if self.wall == "fixed" else self.r**2 * energy

    @property
    def loop_friction_ratio(self) -> float:
        """Friction ratio as energy over the path slid, eq. (2.23)."""
        return self.loop_energy / float(np.abs(np.diff(self.slid, append=self.slid[:1])).sum())

    @property
    def friction_by_energy(self) -> float | None:
        """Friction ratio as energy over the path slid, what a dashpot takes in counted; None of several masses."""
        by_mean = 1.0 if self.cycle.pressed is None else float(self.cycle.pressed.mean())
        return self.loop_friction_ratio * by_mean if self.single else None

    def gain_and_phase(self, first: complex, values: Values) -> tuple[float, float]:
        """Return gain, and phase (rad of the drive) by which a cycle is shown; ``first``: its first harmonic, over Y.

        A base's channel that is behind by ``lag_s`` shows the mass ahead. What stands of the mass in the base's channel
        changes the amplitude that all is over, and the phase it is measured from.
        """
        seen_base = 1.0 + values.get("mass_in_base", 0.0) * first
        late = self.turn * values.get("lag_s", 0.0) - float(np.angle(seen_base))
        return (1.0 + values.get("gain", 0.0)) / abs(seen_base), late

    def nrmse(self, residual: FloatArray) -> float:
        """Return the rms of a whitened residual (2 K,) over the rms of the measured mean cycle."""
        gap = self.gap(residual)
        return math.sqrt(0.5 * float(gap @ gap) / self.power)


def nrmse_of(measured: FloatArray, predicted: FloatArray) -> float:
    """Return the rms of measured minus predicted, both about their means, over the rms of the measured."""
    about = measured - measured.mean()
    gap = about - (predicted - predicted.mean())
    return float(np.sqrt(np.mean(gap**2) / np.mean(about**2)))


def cycle_of(test: Any) -> CycleObservation:
    """Return the observation of a fit's test, which is one of a cycle."""
    return cast("CycleObservation", test.observation)


def parts(coefficients: ComplexArray) -> FloatArray:
    """Return cosine and sine parts (..., 2 K) of complex harmonics (..., K)."""
    return np.concatenate([coefficients.real, -coefficients.imag], axis=-1)


def lines_of(parts: FloatArray) -> ComplexArray:
    """Return the complex harmonics (K,) of cosine and sine parts (2 K,)."""
    cosine, sine = parts.reshape(2, -1)
    return np.asarray(cosine - 1j * sine)


def mean_cycle(state: SteadyState, points: int, late: float = 0.0) -> FloatArray:
    """Return the displacement (p,) of a steady motion over a cycle, the mean over its period, from a phase on."""
    return np.asarray(mean_cycles(state, points, late=late)[0])


def mean_cycles(state: SteadyState, points: int, masses: int = 1, late: float = 0.0) -> FloatArray:
    """Return the same of the first so many masses (n, p)."""
    periods = state.period_cycles or 1
    if state.orbit is None:
        return np.zeros((masses, points))
    tau = 2.0 * np.pi * np.arange(points * periods) / points + late
    q = state.orbit.all_at(tau)[0][:, :masses]
    return np.asarray(q.reshape(periods, points, masses).mean(axis=0).T)


def refuse_several(scene: Scene) -> None:
    """Refuse a frame of several masses or contacts where only one mass with one contact can be fitted."""
    masses, contacts = len(scene.rig.masses), len(scene.rig.contacts)
    if masses or contacts:
        raise UsageError(
            "rig: expected one mass with one contact, as [rig] and [model] say, for campaigns, plans, whole records and"
            f" tables over frequency; got {masses} [[rig.masses]] and {contacts} [[rig.contacts]]; simulate,"
            " synthesize, analyze, free-vibration and compare-numeric know several"
        )


def slid_of(cycle: Cycle, wall: Wall) -> FloatArray:
    """Return the motion (p,) of the mass over its wall in a mean cycle, in Y, without the noise."""
    if wall == "fixed":
        return cycle.mass_smooth
    phase = np.outer(cycle.tau, np.arange(1, len(cycle.base_cosine) + 1))
    return np.asarray(cycle.mass_smooth - np.cos(phase) @ cycle.base_cosine - np.sin(phase) @ cycle.base_sine)


def law_and_held(scene: Scene, law: str | Law | None = None) -> tuple[Law, dict[str, float]]:
    """Return the law that a scene (or the caller) names, and the parameters that the scene holds fixed.

    ``static_ratio`` of ``[model]`` is the static ratio of both directions; a `damping_ratio` of the rig is simulated.

    Raises
    ------
    UsageError
        The scene holds a parameter that the law lacks, or has several masses or contacts.
    """
    model = scene.model
    refuse_several(scene)
    chosen = law_of(model.law if law is None else law)
    held = dict(model.parameters) if law is None or law_of(law).name == law_of(model.law).name else {}
    names = {p.name for p in chosen.own}
    if model.static_ratio != 1.0 and "static_ratio" not in names and not chosen.has("breakaway"):
        chosen = law_of(f"{chosen.name}+breakaway")
        held |= dict.fromkeys(("static_ratio_up", "static_ratio_down"), model.static_ratio)
    if scene.rig.damping_ratio is not None:
        held.setdefault("frame_damping_ratio", scene.frame_damping_ratio)
    strangers = sorted(set(held) - {p.name for p in chosen.parameters})
    if strangers:
        known = ", ".join(p.name for p in chosen.parameters)
        raise UsageError(f"model.parameters: law {chosen.name} has no {', '.join(strangers)}; expected {known}")
    return chosen, held


def observe(measurement: Measurement, scene: Scene, law: str | Law | None = None) -> CycleObservation:
    """Return a measured test as a fit sees it.

    Raises
    ------
    AnalysisError
        The natural frequency is not known.
    """
    if not math.isfinite(measurement.frequency_ratio or math.nan):
        raise AnalysisError(f"no frequency ratio: {NO_FREQUENCY}")
    if scene.rig.masses or scene.rig.contacts:
        from frictionlab.inference.storey_cycle import observe_storeys  # noqa: PLC0415 - for frames alone

        return observe_storeys(measurement, scene, law)
    chosen, held = law_and_held(scene, law)
    return CycleObservation(law=chosen, held=held, wall=scene.model.wall, **of_measurement(measurement, scene))


def of_test(measurement: Measurement) -> dict[str, Any]:
    """Return what any observation of cycles takes from a measurement: a start may be left where more was cut."""
    used = measurement.series.used.sum() / measurement.drive_frequency_hz
    return {
        "source": measurement.source,
        "material": measurement.material,
        "normal_force": measurement.normal_force_n,
        "unit": measurement.base_amplitude_m,
        "turn": 2.0 * math.pi * measurement.drive_frequency_hz,
        "sources": measurement.sources,
        "rate": measurement.sampling_rate_hz,
        "left_out_s": measurement.transient_s,
        "settles_later_s": measurement.settles_later_s,
        "starting": measurement.settles_later_s is not None or measurement.transient_s > used,
    }


def of_measurement(measurement: Measurement, scene: Scene, masses: int = 1) -> dict[str, Any]:
    """Return what the observation of a cycle takes from a measurement, of the first so many masses of a frame."""
    test = of_test(measurement)
    return test | of_cycle(
        *(measurement.cycle, measurement.energy, measurement.amplitude, measurement.regime),
        r=measurement.frequency_ratio or math.nan,
        samples=measurement.sampling_rate_hz / measurement.drive_frequency_hz,
        used=max(1, int(measurement.series.used.sum())),
        noise=measurement.mass_noise_m / measurement.base_amplitude_m,
        rounding=measurement.layout.of_mass.shared,
        unit_u=measurement.base_amplitude_m_se / measurement.base_amplitude_m,
        least=scene.model.base_harmonics,
        masses=masses,
        settled=not test["starting"],
        folded=measurement.layout.folded_into(MOST_HARMONICS),
    )


def of_cycle(
    cycle: Cycle,
    energy: Estimate,
    amplitude: Estimate,
    regime: str,
    *,
    r: float,
    samples: float,
    used: int,
    noise: float,
    unit_u: float,
    rounding: float = 0.0,
    least: int = 1,
    masses: int = 1,
    settled: bool = True,
    folded: FloatArray | None = None,
) -> dict[str, Any]:
    """Return what an observation takes from a mean cycle: its base, and harmonics with the covariance of its cycles.

    ``samples`` of a cycle; ``used``: cycles that the mean is of; ``noise``: rms of the first mass's sensor, Y, which
    stands for all; ``unit_u``: relative error of Y; ``least``: harmonics of the base; ``masses`` of a frame, one after
    the other; ``settled``: no start is known to be left; ``folded``: as of `Layout.folded_into`. A stop's corner is
    sharp, and a slow drive wakes high harmonics at the frame's own: so many are kept as that needs and the samples
    allow. What the base's noise adds is shared by all cycles: all is over its amplitude, from its phase on.
    """
    wanted = min(MOST_HARMONICS, max(32, math.ceil(10.0 / r)))
    count = min(cycle.each.shape[1], max(2, min(wanted, int(min(samples, len(cycle.tau)) / POINTS))))
    moved = [(cycle.mass, cycle.each), *((one.mass, one.each) for one in cycle.others[: masses - 1])]
    single = np.concatenate([parts(each[:, :count]) for _, each in moved], axis=1)
    mean = np.concatenate([parts(harmonics_of(mass, count)) for mass, _ in moved])
    power = sum(float(np.mean(mass**2)) for mass, _ in moved) or 1e-300  # of a column that never changes
    sensor = 2.0 * noise**2 / samples
    lines, order = mean.reshape(masses, 2, -1), np.arange(1, count + 1)
    later = np.stack([order * lines[:, 1], -order * lines[:, 0]], axis=1).ravel()
    start = left_of_start(single, sensor, settled=settled)
    of_all = unit_u**2 * (np.outer(mean, mean) + np.outer(later, later)) + start.T @ start
    of_all += 2.0 * rounding**2 / samples * np.eye(len(mean))
    if folded is not None:
        of_all += np.diag(np.tile(0.5 * folded[:count] ** 2, 2 * masses))
    of_noise = sensor + 2.0 * ROUNDING**2 * power / count
    known, variance = of_mean(mean, single, of_noise, used, power=power, white=sensor, of_all=of_all)
    beyond = masses * sensor / used * max(0.0, 0.5 * samples - count)
    base = base_of(cycle, unit_u, least, r)
    return known | {
        "floor": math.sqrt((0.5 * variance + beyond) / power),
        "cycle": cycle,
        "energy": energy,
        "amplitude": amplitude,
        "regime": regime,
        "r": r,
        "base": base,
        "swing": amplitude.value or math.nan,
        "distorted": base.harmonics > 1,
        "kept": cycle.kept[:count],
    }


def base_of(cycle: Cycle, unit_u: float, least: int = 1, r: float = 0.0) -> Base:
    """Return the base motion: its measured harmonics that are no noise, of the first so many those that are small too.

    A contact that remembers its start answers to a noise in an even harmonic by far more than its own. Near its
    resonance (``r`` times its order is 1) a harmonic that is smaller still moves the mass as much.
    """
    sizes, order = np.hypot(cycle.base_cosine, cycle.base_sine), np.arange(len(cycle.base_cosine))
    seen = SEEN * np.minimum(1.0, np.abs(1.0 - ((order + 1.0) * r) ** 2))
    shown = sizes > np.maximum(3.0 * unit_u, np.where(order < least, 0.0, seen))
    shown[0] = True
    count = int(np.flatnonzero(shown)[-1]) + 1
    if count == 1:
        return COSINE
    cosine, sine = (np.where(shown, side, 0.0)[:count] for side in (cycle.base_cosine, cycle.base_sine))
    return Base(tuple(cosine.tolist()), tuple(sine.tolist()))


def left_of_start(single: FloatArray, sensor: float, *, settled: bool) -> FloatArray:
    """Return what is left of a recording's start in the mean of its cycles (n, d), (2, d): zeros where none shows.

    Each third is nearer to the steady state than the one before; what is still to come follows as in a geometric series
    [Aitken 1926], and what turns about with it, in the second row, has its share. A drift, as strong in the last third,
    is none where the motion is ``settled``. ``sensor``: variance of a part by its white noise.
    """
    n, none = len(single), np.zeros((2, single.shape[1]))
    length = n // 3
    if length < 2:  # too few to show their own scatter
        return none
    three = np.array([single[first : first + length].mean(axis=0) for first in (0, (n - length) // 2, n - length)])
    change, bend = three[0] - three[2], three[0] - 2.0 * three[1] + three[2]
    size = float(np.linalg.norm(change))
    if size == 0.0:
        return none
    along = change / size
    early, late = -np.diff(three @ along)
    scatter = float(np.mean(np.diff(single @ along, 2) ** 2)) / 6.0
    clear = CLEAR * math.sqrt(max(sensor, scatter) / length)
    if early - (AS_A_DRIFT if settled else -1.0) * late < clear or early < clear:
        return none
    late = max(late, 0.0)
    less = min(late / early, MOST_LEFT)
    left = (early + 2.0 * late) / 3.0 + late * less / (1.0 - less)
    if left > MOST_OF_IT * float(np.linalg.norm(single.mean(axis=0))):  # such a motion is not steady, and that is said
        return none
    return np.asarray(left / size * np.array([change, bend - along * (bend @ along)]))


def of_mean(
    mean: FloatArray, single: FloatArray, least: float, used: int, *, power: float, white: float, of_all: FloatArray
) -> tuple[dict[str, Any], float]:
    """Return what an observation takes from the mean (d,) of so many cycles and single ones (n, d), and its variance.

    No variance of a single cycle is below ``least``; ``white``: that of one of its parts by the sensor's white noise.
    """
    n, about = len(single), single - single.mean(axis=0)
    of_each = 1.0 / used
    if n >= FEWEST_CYCLES:  # the mean is less sure as far as cycles, along their main direction, are autocorrelated
        few = n <= len(mean)  # the same, and cheaper where cycles are many
        product = about @ about.T if few else about.T @ about
        main = eigh(product, subset_by_index=[len(product) - 1] * 2)[1][:, 0]
        inflated = variance_inflation((main if few else about @ main)[:, None])
        of_each *= min(max(1.0, float(inflated[0])), MOST_RAISED)
    noise, (covariance, unsure) = white + 4.0 * ROUNDING**2 * power / len(mean), shrunk(single, least)
    covariance = covariance * of_each + of_all
    others = tuple(
        (about[part], shrunk(np.delete(single, part, axis=0), noise)[0] * of_each + of_all)
        for part in (np.array_split(np.arange(n), min(n, PARTS)) if n > FEWEST_CYCLES else ())
    )
    known = {"data": mean, "powers": power, "power": power, "each": single, "used": used, "sensor": white / used}
    known |= {"of_all": of_all, "by_others": others, "unsure": unsure * of_each}
    return known | noise_of(covariance), float(np.trace(covariance))


def shrunk(single: FloatArray, least: float) -> tuple[FloatArray, float]:
    """Return the covariance (d, d) of one cycle of n (n, d), its correlations shrunk, and what of it is assumed.

    No variance is below ``least``, or known below a share of their mean; few cycles say nothing.
    """
    n = len(single)
    if n < FEWEST_CYCLES:
        return np.eye(single.shape[1]) * least, 0.0
    about = single - single.mean(axis=0)
    variance = np.maximum((about**2).sum(axis=0) / (n - 1), 1e-300)
    unit = about / np.sqrt(variance)
    correlation = unit.T @ unit / (n - 1)
    np.fill_diagonal(correlation, 1.0)
    off = ~np.eye(len(correlation), dtype=bool)
    second, mean = (unit**2).T @ (unit**2), correlation * (n - 1) / n
    spread = n / (n - 1.0) ** 3 * (second - n * mean**2)  # variance of each sample correlation
    share = float(np.clip(spread[off].sum() / max((correlation[off] ** 2).sum(), 1e-300), 0.0, 1.0))
    deviation = np.sqrt(variance)
    together = (1.0 - share) * correlation + share * np.eye(len(correlation))
    unsure = FEW / n * float(variance.mean())
    return np.asarray(together * np.outer(deviation, deviation) + np.eye(len(correlation)) * (least + unsure)), unsure
