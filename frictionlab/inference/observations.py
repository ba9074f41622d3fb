"""What was observed of one test, and what a law predicts of it: the mean cycle as harmonics, with its covariance.

The noise of a fit is not the sensor's: friction differs a little from cycle to cycle, and then all harmonics move
together. So the covariance comes from the cycles, shrunk towards a smooth diagonal (there are fewer cycles than
harmonics) [Schäfer and Strimmer 2005], and is never below the sensor's white noise.

The base's harmonics are those that its sensor shows. What may differ from them is what the sensor's declared linearity
and crosstalk allow, and that is an unknown of the rig.
"""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np
from scipy.linalg import eigh

from frictionlab.analysis.measurement import Cycle, Measurement, OtherMass
from frictionlab.analysis.signals import student, variance_inflation
from frictionlab.arrays import ComplexArray, FloatArray
from frictionlab.errors import AnalysisError, FrictionlabError, UsageError
from frictionlab.inference.comparison import AtContact, contact_force
from frictionlab.inference.observation import BENDS, SENSORS, Observation, Reached, Values
from frictionlab.inference.unknowns import Unknown, of_rig
from frictionlab.scene import Scene
from frictionlab.simulator import COSINE, Base, Problem, SteadyState, steady_state
from frictionlab.simulator.laws import Law, law_of
from frictionlab.simulator.meter import Meter, OverspentError
from frictionlab.simulator.problem import Wall

Motion = tuple[SteadyState, ComplexArray]

FEWEST_CYCLES = 3  # below so many the cycles say nothing of their own scatter
MOST_HARMONICS = 128
FEW = 3.0  # over the number of cycles: the share of the mean variance below which no variance is known
PARTS = 8  # that the cycles are left out in, one after the other
POINTS = 4.0  # of a cycle for each harmonic: with fewer, interpolation takes part of it away
MOST_RAISED = 4.0  # of a covariance by autocorrelation: a drift is no noise
ROUNDING = 1e-6  # of the response: interpolation between samples is no better
SEEN = 1e-3  # of Y: smaller harmonics of the base are left out, for each makes a steady state dearer
LEAST_POINTS = 128  # of a simulated cycle: what folds back from beyond is below 1e-6 of it
STATES = 150.0  # steady states of one fit, about
COST = {"rigid": 5.0, "elastic": 100.0}  # steps of integration that an exact steady state costs, about
STEP = 1e-4  # of a prior's standard deviation: finite differences of the simulated cycle
STRETCHES = 512  # points of a cycle, at least, at which the stretch of the spring is known
SPRING_HARMONICS = 16  # of the force of a spring that is not linear


def prepare(law: Law, r: float, states: float) -> None:
    """Load the compiled simulator if so many steady states are worth it; it changes nothing but their time."""
    from frictionlab.simulator.engine import choose  # noqa: PLC0415 - a measurement alone has no use for it

    choose(states * (20.0 if law.has("breakaway") else 1.0) * (10.0 + 4.0 / r))
    if law.kind == "elastic":
        from frictionlab.simulator.elastic import engine as elastic_engine  # noqa: PLC0415 - for such laws alone

        elastic_engine.choose(states * 200.0 / r)


def steady(problem: Problem, meter: Meter, near: SteadyState | None = None) -> SteadyState | None:
    """Return the steady state of a problem; None where the simulator has none: these values are no candidate.

    Raises
    ------
    OverspentError
        The work that the search may do is used up: the same search ends at the same place on every machine.
    """
    meter.take(COST.get(problem.law.kind, 0.0))
    try:
        if problem.law.kind in COST:
            return steady_state(problem)
        from frictionlab.simulator import numeric  # noqa: PLC0415 - 10 ms, for such laws alone

        return numeric.steady(problem, near=near, meter=meter if math.isfinite(meter.left) else None)
    except OverspentError:
        raise
    except (FrictionlabError, ArithmeticError, np.linalg.LinAlgError, ValueError):
        return None


@dataclass(frozen=True)
class Cycles:
    """A measured mean cycle about its mean, as harmonics, and its covariance.

    Parameters
    ----------
    mean : ndarray of shape (2 K,)
        Cosine parts of harmonics 1 to K of x/Y, then the sine parts.
    each : ndarray of shape (n, 2 K)
        The same of single steady cycles.
    covariance : ndarray of shape (2 K, 2 K)
        Of the mean cycle.
    sensor : float
        Variance of one part of the mean cycle from the sensor's white noise alone.
    used : int
        Cycles that the mean is of.
    scatters : bool
        Whether the covariance is known from the cycles' own scatter.
    power : float
        Mean square of the measured mean cycle.
    beyond : float
        Mean square of the sensor's noise in the harmonics that are not kept.
    of_base : ndarray of shape (2 K, 2 K)
        The part of the covariance that all cycles share: the base's noise.
    raised : float
        By how much the autocorrelation of the cycles raises the covariance of the mean.
    """

    mean: FloatArray
    each: FloatArray
    covariance: FloatArray
    sensor: float
    used: int
    scatters: bool
    power: float
    beyond: float
    of_base: FloatArray
    raised: float = 1.0

    @cached_property
    def spectrum(self) -> tuple[FloatArray, FloatArray]:
        """Variances (2 K,) of the mean cycle's independent directions, and these as columns (2 K, 2 K)."""
        variances, directions = np.linalg.eigh(self.covariance)
        return np.maximum(variances, 1e-300), directions

    @cached_property
    def left_out(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Parts of the cycles about their mean (m, 2 K), each with the covariance of the mean by all others.

        A weight that is found from some cycles lets those scatter too little: this is how the others see them. Nothing
        where the cycles are too few to tell their own scatter.
        """
        n, about = len(self.each), self.each - self.each.mean(axis=0)
        if n < FEWEST_CYCLES + 1 or not self.scatters:
            return ()
        rows = np.array_split(np.arange(n), min(n, PARTS))
        least = self.sensor * self.used + 4.0 * ROUNDING**2 * self.power / len(self.mean)
        others = (np.delete(self.each, part, axis=0) for part in rows)
        return tuple(
            (about[part], shrunk(rest, least) * (self.raised / self.used) + self.of_base)
            for part, rest in zip(rows, others, strict=True)
        )

    @property
    def floor(self) -> float:
        """Standard error of the mean cycle over its rms: what no model can undercut."""
        return math.sqrt((0.5 * float(np.trace(self.covariance)) + self.beyond) / self.power)


@dataclass(frozen=True)
class CycleObservation(Observation):
    """The mean cycle of one test, under a law: unknowns -> harmonics that would be measured.

    Parameters
    ----------
    measurement : Measurement
    cycles : Cycles
    law : Law
    held : mapping of str to float
        Parameters of the law that the scene holds.
    wall : {"fixed", "base"}
    base : Base
        Motion of the base over Y, as its sensor shows it.
    kept : ndarray of shape (K,)
        How much of each harmonic the mass's filter leaves.
    missed : float
        Share of the cycle's power, in each part of each harmonic, that the law cannot explain.
    spring_harmonics : int
        Of the force of a spring that is not linear.
    work : Meter
        What steady states may still cost.
    """

    measurement: Measurement
    cycles: Cycles
    law: Law
    held: Values
    wall: Wall
    base: Base
    kept: FloatArray
    missed: float = 0.0
    spring_harmonics: int = SPRING_HARMONICS
    work: Meter = field(default_factory=lambda: Meter(math.inf), compare=False)
    steps: ClassVar = (STEP, -STEP, 0.1 * STEP)
    by_sensors: ClassVar = (*SENSORS, "mass_in_base")
    single: ClassVar[bool] = True
    """One mass with one contact: the loop's energy is its contact's, and a spring stands between mass and base."""

    @property
    def r(self) -> float:
        """Frequency ratio, as the scene's natural frequency makes it."""
        return self.measurement.frequency_ratio or math.nan

    @property
    def unit(self) -> float:
        """Amplitude Y of the base, m."""
        return self.measurement.base_amplitude_m

    @property
    def material(self) -> str | None:  # type: ignore[override] # read alone: its kinds are frozen
        """Material of the contact."""
        return self.measurement.material

    @property
    def normal_force(self) -> float | None:
        """Normal force, N; None where it is not known."""
        return self.measurement.normal_force_n

    @property
    def rig_unknowns(self) -> tuple[Unknown, ...]:
        """What is not known of sensors and rig."""
        return of_rig(
            self.measurement.sources,
            self.held,
            amplitude=self.measurement.response_amplitude,
            unit=self.unit,
            distorted=self.base.harmonics > 1,
        )

    @property
    def place_words(self) -> str:
        """Where the contact is, as words."""
        return f"{self.wall} wall"

    @property
    def turn(self) -> float:
        """Angular frequency of the drive, rad/s."""
        return 2.0 * math.pi * self.measurement.drive_frequency_hz

    @property
    def data(self) -> FloatArray:
        """What is fitted (2 K,)."""
        return self.cycles.mean

    @property
    def count(self) -> int:
        """Number of harmonics."""
        return len(self.cycles.mean) // 2

    @property
    def variances(self) -> FloatArray:
        """Of the noise (2 K,), along its independent directions."""
        return self.cycles.spectrum[0]

    @cached_property
    def whitener(self) -> FloatArray:
        """Matrix (2 K, 2 K) that makes noise and misfit independent with unit variance."""
        return np.asarray(self.directions.T / self.sd[:, None])

    @property
    def directions(self) -> FloatArray:
        """Independent directions of the noise, as columns (2 K, 2 K)."""
        return self.cycles.spectrum[1]

    @property
    def powers(self) -> float:
        """Mean square of the mean cycle."""
        return self.cycles.power

    def problem(self, values: Values) -> Problem:
        """Return what is simulated at some values, dimensionless in this test, sensors and rig included."""
        return self.simulated(values, self.r, self._driven(values))

    def _driven(self, values: Values) -> Base:
        """The base without what its sensor bends, and with the force of a spring that is not linear."""
        bent = {2: 0.5 * values.get("base_parabola", 0.0), 3: 0.25 * values.get("base_cubic", 0.0)}
        cubic, play = values.get("spring_cubic", 0.0), values.get("play", 0.0)
        if not any(bent.values()) and not cubic and not play:
            return self.base
        count = max(self.base.harmonics, self.spring_harmonics if cubic or play else 3)
        lines = np.zeros(count, dtype=np.complex128)
        lines[: self.base.harmonics] = self.base.lines
        for order, size in bent.items():
            lines[order - 1] -= size
        if cubic or play:
            stretch = self.stretch
            force = np.clip(stretch, -play, play) - cubic * stretch**3
            lines += harmonics_of(force, count)
        return Base(tuple(lines.real.tolist()), tuple((-lines.imag).tolist()))

    @cached_property
    def stretch(self) -> FloatArray:
        """Measured motion of the mass over the base (p,), Y: what the frame's spring is stretched by."""
        cycle = self.measurement.cycle
        order, points = np.arange(1, len(cycle.base_cosine) + 1), max(len(cycle.tau), STRETCHES)
        phase = np.outer(2.0 * np.pi * np.arange(points) / points, order)
        mass = np.fft.irfft(np.fft.rfft(cycle.mass_smooth), points) * (points / len(cycle.tau))
        return np.asarray(mass - np.cos(phase) @ cycle.base_cosine - np.sin(phase) @ cycle.base_sine)

    def state(self, values: Values, near: SteadyState | None = None) -> SteadyState | None:
        """Return the steady state at some values; None where there is none."""
        try:
            problem = self.problem(values)
        except FrictionlabError:
            return None  # values outside a law's domain are no candidate
        return steady(problem, self.work, near)

    def motion(self, values: Values, near: Motion | None = None) -> Motion | None:
        """Return the steady state at some values and its harmonics (K,), before the sensors; None where it has none."""
        state = self.state(values, None if near is None else near[0])
        if state is None or (state.orbit is None and state.outcome != "stuck"):
            return None
        if state.orbit is None:
            return state, np.zeros(self.count, dtype=np.complex128)
        points, periods = max(LEAST_POINTS, 4 * self.count), state.period_cycles or 1
        tau = 2.0 * np.pi * np.arange(points * periods) / points
        cycle = state.orbit.at(tau)[0].reshape(periods, points).mean(axis=0)
        return state, harmonics_of(cycle, self.count)

    def seen(self, motion: Motion, values: Values) -> FloatArray:
        """Return harmonics as the sensors show them (2 K,): gain, lag, crosstalk, nonlinearity, filter."""
        lines = motion[1]
        gain, late = self.gain_and_phase(complex(lines[0]), values)
        shown = gain * np.exp(1j * np.arange(1, self.count + 1) * late) * lines
        shown[0] += values.get("base_in_mass", 0.0)
        for name, power in BENDS.items():
            if values.get(name):
                shown = shown + values[name] * _bent_lines(shown, power)
        return parts(np.asarray(self.kept * shown))

    def measured_contact(self, state: SteadyState, late: float) -> AtContact | None:
        """Return the motion of the contact and its force (over k Y) by the measured cycle; None: not measured.

        ``late``: phase by which the base's channel is behind, rad.
        """
        cycle = self.measurement.cycle
        return AtContact(cycle.mass_smooth, cycle.mass_velocity, contact_force(self.measurement, state.problem, late))

    def law_at_contact(self, state: SteadyState, tau: FloatArray) -> AtContact | None:
        """Return the same in the prediction, at phases tau (p,); None where nothing moves."""
        return None if state.orbit is None else AtContact(*state.orbit.at(tau), state.orbit.force(tau))

    def left(self, predicted: FloatArray, values: Values) -> float:  # noqa: ARG002 - of several masses it takes these
        """Return the rms of measured minus predicted cycle (p,), about their means, over the rms of the measured."""
        return nrmse_of(self.measurement.cycle.mass, predicted)

    def gain_and_phase(self, first: complex, values: Values) -> tuple[float, float]:
        """Return gain, and phase (rad of the drive) by which a cycle is shown; ``first``: its first harmonic, over Y.

        A base's channel that is behind by ``lag_s`` shows the mass ahead. What stands of the mass in the base's channel
        changes the amplitude that all is over, and the phase it is measured from.
        """
        seen_base = 1.0 + values.get("mass_in_base", 0.0) * first
        late = self.turn * values.get("lag_s", 0.0) - float(np.angle(seen_base))
        return (1.0 + values.get("gain", 0.0)) / abs(seen_base), late

    def covariance(self, at: Reached) -> FloatArray:
        """Return the covariance (n, n) that noise, scatter of the cycles and misfit leave in the coordinates of a fit.

        Of each coordinate the largest variance counts of: the sensors' noise; single cycles carried through the fit
        that the others ask for; what the law cannot explain, harmonic by harmonic (MacKinnon and White's HC3), where
        that is more than noise. The correlations are those of the larger of the two.
        """
        cycles, bare, assumed = self.cycles, np.linalg.solve(self.whitener, at.slopes), at.gain @ at.gain.T
        if cycles.left_out:
            white, share = at.gain @ self.whitener, self.missed * cycles.power * np.eye(len(bare))
            sensor = cycles.sensor * (white @ white.T)
            moved = []
            for part, covariance in cycles.left_out:
                weighed = np.linalg.solve(covariance + share, bare)
                moved.append(part @ np.linalg.solve(bare.T @ weighed + at.hold, weighed.T).T)
            each = np.concatenate(moved)
            freedom = len(each) - 1.0
            grown = each * np.sqrt(variance_inflation(each) * student(freedom) / freedom / cycles.used)
            shown = at_least(of_few(grown, assumed), np.diag(sensor)) + white @ cycles.of_base @ white.T
        else:
            shown = assumed
        if at.is_noise:
            return shown
        leverage = np.clip(np.diag(at.slopes @ at.gain), 0.0, 0.9)
        missed = at.gain * (at.residual / (1.0 - leverage))
        by_misfit = of_few(missed.T, assumed)
        larger, other = sorted((shown, by_misfit), key=lambda c: -float(np.log(np.diag(c) + 1e-300).sum()))
        return at_least(larger, np.maximum(np.diag(other), np.diag(assumed)))

    def nrmse(self, residual: FloatArray) -> float:
        """Return the rms of a whitened residual (2 K,) over the rms of the measured mean cycle."""
        gap = self.gap(residual)
        return math.sqrt(0.5 * float(gap @ gap) / self.cycles.power)


def nrmse_of(measured: FloatArray, predicted: FloatArray) -> float:
    """Return the rms of measured minus predicted, both about their means, over the rms of the measured."""
    about = measured - measured.mean()
    gap = about - (predicted - predicted.mean())
    return float(np.sqrt(np.mean(gap**2) / np.mean(about**2)))


def of_few(each: FloatArray, assumed: FloatArray) -> FloatArray:
    """Return the covariance (n, n) that samples (m, n) sum up to, so large that its inverse does not promise too much.

    The inverse of a covariance from m samples is too large by ``(m - 1) / (m - n - 2)`` [Hartlap et al., A&A 464 (2007)
    399]. Where they are fewer than ``2 n + 4`` they say little of correlations: these are drawn to those of an assumed
    covariance (n, n).
    """
    (samples, size), shown = each.shape, each.T @ each
    if samples > 2 * size + 3:
        return np.asarray(shown * (samples - 1.0) / (samples - size - 2.0))
    share = min(1.0, (size + 2.0) / samples)
    times = np.sqrt(np.diag(shown) / np.maximum(np.diag(assumed), 1e-300))
    return np.asarray((1.0 - share) * shown + share * assumed * np.outer(times, times))


def at_least(covariance: FloatArray, variance: FloatArray) -> FloatArray:
    """Return a covariance (n, n) with its correlations, and variances that are at least so large (n,)."""
    own = np.diag(covariance)
    times = np.sqrt(np.maximum(own, variance) / np.maximum(own, 1e-300))
    return np.asarray(covariance * np.outer(times, times))


def cycle_of(test: object) -> CycleObservation:
    """Return the observation of a fit's test, which is one of a cycle.

    Raises
    ------
    TypeError
        It is another kind of observation.
    """
    observation = getattr(test, "observation", None)
    if not isinstance(observation, CycleObservation):
        raise TypeError(f"expected the observation of a cycle; got {type(observation).__name__}")
    return observation


def parts(coefficients: ComplexArray) -> FloatArray:
    """Return cosine and sine parts (..., 2 K) of complex harmonics (..., K)."""
    return np.concatenate([coefficients.real, -coefficients.imag], axis=-1)


def harmonics_of(cycle: FloatArray, count: int) -> ComplexArray:
    """Return complex amplitudes of harmonics 1 to count of a cycle on equally spaced phases from 0, over the last axis.

    Examples
    --------
    >>> tau = np.arange(8) * np.pi / 4
    >>> np.allclose(harmonics_of(np.cos(tau) + 2 * np.sin(2 * tau), 2), [1.0, -2.0j])
    True
    """
    return np.asarray(np.fft.rfft(cycle, axis=-1)[..., 1 : count + 1] * (2.0 / cycle.shape[-1]))


def bent(cycle: FloatArray, power: int) -> FloatArray:
    """Return the swing of a cycle (p,) times a power of its place along it, from -1 to 1."""
    swing = 0.5 * float(np.ptp(cycle))
    return np.asarray(swing * ((cycle - cycle.min()) / swing - 1.0) ** power) if swing > 0.0 else np.zeros_like(cycle)


def _bent_lines(lines: ComplexArray, power: int) -> ComplexArray:
    """The same of harmonics (K,)."""
    points = max(LEAST_POINTS, 4 * len(lines))
    half = np.zeros(points // 2 + 1, dtype=np.complex128)
    half[1 : len(lines) + 1] = 0.5 * points * lines
    return harmonics_of(bent(np.fft.irfft(half, points), power), len(lines))


def refuse_several(scene: Scene) -> None:
    """Refuse a frame of several masses or contacts where only one mass with one contact can be fitted.

    Raises
    ------
    UsageError
        The scene has ``[[rig.masses]]`` or ``[[rig.contacts]]``.
    """
    masses, contacts = len(scene.rig.masses), len(scene.rig.contacts)
    if masses or contacts:
        raise UsageError(
            "rig: expected one mass with one contact, as [rig] and [model] say, for campaigns, plans, whole records and"
            f" tables over frequency; got {masses} [[rig.masses]] and {contacts} [[rig.contacts]]; simulate,"
            " synthesize, analyze, free-vibration and compare-numeric know several"
        )


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
    ratio = measurement.frequency_ratio
    if ratio is None or not math.isfinite(ratio):
        raise AnalysisError(
            "no frequency ratio: the natural frequency is not known: give rig.natural_frequency_hz in the scene, or"
            " mass_kg and stiffness_n_per_m; `frictionlab free-vibration` measures it"
        )
    if scene.rig.masses or scene.rig.contacts:
        from frictionlab.inference.storey_cycle import observe_storeys  # noqa: PLC0415 - for frames of several masses alone

        return observe_storeys(measurement, scene, law)
    chosen, held = law_and_held(scene, law)
    base = measured_base(measurement, scene.model.base_harmonics)
    cycles = cycles_of(measurement)
    kept = measurement.cycle.kept[: len(cycles.mean) // 2]
    return CycleObservation(measurement, cycles, chosen, held, scene.model.wall, base, kept)


def measured_base(measurement: Measurement, least: int = 1) -> Base:
    """Return the base motion: its measured harmonics up to the last that is no noise, at least so many.

    Raises
    ------
    UsageError
        More harmonics are asked for than are measured.
    """
    cycle = measurement.cycle
    if least > len(cycle.base_cosine):
        raise UsageError(
            f"model.base_harmonics: expected at most {len(cycle.base_cosine)}, as many as are measured; got {least}"
        )
    noise = measurement.base_amplitude_m_se / measurement.base_amplitude_m
    size = np.hypot(cycle.base_cosine, cycle.base_sine)
    told = np.flatnonzero(size > max(3.0 * noise, SEEN))
    count = max(least, int(told[-1]) + 1 if len(told) else 1)
    if count == 1:
        return COSINE
    keep = (size > max(3.0 * noise, SEEN)) | (np.arange(len(size)) < least)
    cosine, sine = (np.where(keep, side, 0.0)[:count] for side in (cycle.base_cosine, cycle.base_sine))
    return Base(tuple(cosine.tolist()), tuple(sine.tolist()))


def cycles_of(measurement: Measurement, *, every: bool = False, masses: int = 1) -> Cycles:
    """Return the measured mean cycle with the covariance that its steady cycles show.

    ``every``: the mean of all steady cycles, not of those that the energy rule takes; ``masses``: how many masses of a
    frame, one after the other. The noise of the first one's sensor stands for all.
    """
    cycle = measurement.cycle
    samples = measurement.sampling_rate_hz / measurement.drive_frequency_hz
    points = min(samples, len(cycle.tau))
    count = min(cycle.each.shape[1], harmonics_worth_keeping(measurement.frequency_ratio or 1.0, points))
    moved: tuple[Cycle | OtherMass, ...] = (cycle, *cycle.others[: masses - 1])
    single = np.concatenate([parts(one.each[:, :count]) for one in moved], axis=1)
    means = np.concatenate([parts(harmonics_of(one.mass, count)) for one in moved])
    mean = single.mean(axis=0) if every else means
    used = len(single) if every else max(1, int(measurement.series.used.sum()))
    power = sum(float(np.mean(one.mass**2)) for one in moved)
    sensor = 2.0 * (measurement.mass_noise_m / measurement.base_amplitude_m) ** 2 / samples
    least = sensor + 2.0 * ROUNDING**2 * power / count
    beyond = masses * sensor / used * max(0.0, 0.5 * samples - count)
    scatters = len(single) >= FEWEST_CYCLES
    raised = _raised(single) if scatters else 1.0
    single_covariance = shrunk(single, least) if scatters else np.eye(len(mean)) * least
    of_base = _by_base(mean, masses, measurement.base_amplitude_m_se / measurement.base_amplitude_m)
    covariance = single_covariance * (raised / used) + of_base
    return Cycles(mean, single, covariance, sensor / used, used, scatters, power, beyond, of_base, raised)


def harmonics_worth_keeping(ratio: float, points: float) -> int:
    """Return the harmonics worth keeping of a cycle of so many points at a frequency ratio.

    A stop's corner is sharp, and a slow drive wakes high harmonics at the frame's own.

    Examples
    --------
    >>> harmonics_worth_keeping(0.5, 160.0), harmonics_worth_keeping(0.2, 400.0), harmonics_worth_keeping(2.0, 40.0)
    (32, 50, 10)
    """
    wanted = min(MOST_HARMONICS, max(32, math.ceil(10.0 / ratio)))
    return max(2, min(wanted, int(points / POINTS)))


def shrunk(single: FloatArray, least: float) -> FloatArray:
    """Return the covariance of one cycle: its correlations shrunk, its variances never below some share.

    Parameters
    ----------
    single : ndarray of shape (n, d)
        n cycles; d may be larger than n.
    least : float
        No variance is below this one.

    Examples
    --------
    >>> draws = np.random.default_rng(1).standard_normal((40, 3)) * [1.0, 2.0, 3.0]
    >>> bool(np.all(np.linalg.eigvalsh(shrunk(draws, 1e-6)) > 0))
    True
    """
    n = len(single)
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
    return np.asarray(together * np.outer(deviation, deviation)) + np.eye(len(correlation)) * (
        least + FEW / n * float(variance.mean())
    )


def _raised(single: FloatArray) -> float:
    """By how much autocorrelation raises the variance of a mean, by the cycles' main direction."""
    about = single - single.mean(axis=0)
    few = len(about) <= about.shape[1]  # the same, and cheaper where cycles are many
    product = about @ about.T if few else about.T @ about
    last = len(product) - 1
    main = eigh(product, subset_by_index=[last, last])[1][:, 0]
    series = main if few else about @ main
    return min(max(1.0, float(variance_inflation(series[:, None])[0])), MOST_RAISED)


def _by_base(mean: FloatArray, masses: int, relative: float) -> FloatArray:
    """Covariance (d, d) that the noise of the base sensor adds: all is over its amplitude, from its phase on.

    `relative` is the standard error of the base's amplitude over it, which is also that of its phase in rad.
    """
    lines = mean.reshape(masses, 2, -1)
    order = np.arange(1, lines.shape[2] + 1)
    later = np.stack([order * lines[:, 1], -order * lines[:, 0]], axis=1).ravel()
    return np.asarray(relative**2 * (np.outer(mean, mean) + np.outer(later, later)))
