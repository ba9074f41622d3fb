"""Recording + scene -> measurement: the one place where the kernels meet."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from frictionlab.accuracy import accuracy_of
from frictionlab.analysis import cycles, drift, energy, irregularity, judgement, response, restoring, steadiness, traces
from frictionlab.analysis.facts import (
    channels_of,
    material_of,
    normal_force_of,
    of_sensors_and_rig,
    of_the_force,
    source_of,
)
from frictionlab.analysis.layout import Layout, approach, lay_out, wander_of
from frictionlab.analysis.measurement import Cycle, CycleSeries, Measurement
from frictionlab.analysis.response import Response
from frictionlab.analysis.stretches import Stretch
from frictionlab.errors import AnalysisError
from frictionlab.estimate import Estimate
from frictionlab.recording import Recording
from frictionlab.sampling import clock_breaks
from frictionlab.scene import Scene
from frictionlab.uncertainty import FILTER, LINES, STATISTICAL, Shares, Sources, combined, cycle_budget

FloatArray = NDArray[np.float64]
NO_NATURAL_FREQUENCY = (
    "frequency_ratio: the natural frequency is not known: give natural_frequency_hz in [rig] of the scene or"
    " --natural-frequency; `frictionlab free-vibration` measures it"
)
MOST_GAPS = 5  # named one by one
MOST_SINGLE, MOST_HARMONICS = 400, 128  # of the single cycles that tell the scatter
SHARED = {
    "ratio": "frequency_ratio",
    "base_amplitude": "base_amplitude_m",
    "energy": "energy_per_cycle",
    "amplitude": "response_amplitude",
}  # fields whose uncertainty has a budget, and their keys
FIELDS = {key: name for name, key in SHARED.items()}
LONG_TEST_S = 300.0  # from this length on a trend of the energy is fitted


def measure(recording: Recording, scene: Scene) -> Measurement:
    """Measure one recording: drive, response, energy per cycle, irregularity, stops, regime.

    Base motion is Y cos(omega t + phase), displacements are over Y, energies over k Y^2 and positive when dissipated.

    Parameters
    ----------
    recording : Recording
    scene : Scene
        ``[analysis]`` says which part is measured and how; ``[rig]`` gives natural frequency and stiffness where known.

    Raises
    ------
    AnalysisError
        The recording holds no measurement: no drive, shorter than its transient, no full cycle.

    Examples
    --------
    >>> from frictionlab.scene import Analysis, Rig
    >>> t = np.arange(0.0, 30.0, 0.004)
    >>> x, y = 1e-3 * np.sin(2 * np.pi * t), 2e-3 * np.cos(2 * np.pi * t)
    >>> scene = Scene(rig=Rig(natural_frequency_hz=4.0), analysis=Analysis(transient_s=5.0, cycles="all"))
    >>> m = measure(Recording(t, x, y), scene)
    >>> print(f"{m.frequency_ratio:.6f} {m.energy_per_cycle:.6f} {m.response_amplitude:.4f} {m.regime}")
    0.250000 1.570796 0.5000 continuous
    """
    parts, warnings = _stretches(recording, scene)
    warnings += of_the_force(recording)
    begin = float(recording.time[0]) + scene.analysis.transient_s
    how = scene.analysis
    try:
        layout = lay_out(
            _steady(parts, begin, recording),
            padding=how.padding,
            least_points=how.least_points,
            most_points=how.most_points,
        )
    except AnalysisError as error:
        raise _for_its_cause(error, recording) from error
    restoring.check_drive(layout.drive.frequency, channels_of(scene))
    answer = response.response(layout, wall_moves=scene.model.wall == "base")
    return _Composition(recording, scene, layout, answer, parts, (*scene.rig.doubts, *warnings)).measurement()


def _for_its_cause(error: AnalysisError, recording: Recording) -> AnalysisError:
    """Name the sensor's range where it is what cuts the cycles; advice on the transient would lead elsewhere."""
    held = recording.flag_counts()["held"]
    if not held:
        return error
    return AnalysisError(
        f"analysis: {held} values are held at the end of a sensor's range, and between them no cycle is whole: move the"
        f" sensor or enlarge its range, and test again ({error})"
    )


def _stretches(recording: Recording, scene: Scene) -> tuple[list[Stretch], list[str]]:
    """The recording's sound parts, evenly sampled, and what had to be said about them."""
    of_mass, of_base = channels_of(scene)
    step = 1.0 / recording.sampling_rate_hz
    warnings = list(recording.source.warnings)
    parts, strays = [], 0.0
    for part in recording.stretches():
        if cycles.stray(part.time, step) < cycles.EVEN:
            mass = restoring.restored(part.mass_displacement, step, of_mass)
            base = restoring.restored(part.base_displacement, step, of_base)
            parts.append(Stretch(float(part.time[0]), step, mass, base))
            continue
        breaks = clock_breaks(part.time, step)
        warnings += _of_the_clock(part.time, breaks, step)
        for piece in np.split(np.arange(len(part)), breaks):
            time, mass, base = (v[piece] for v in (part.time, part.mass_displacement, part.base_displacement))
            if len(time) > 1:
                mass, base, off = cycles.evenly(time, mass, base, step)
                mass, base = restoring.restored(mass, step, of_mass), restoring.restored(base, step, of_base)
                parts.append(Stretch(float(time[0]), step, mass, base))
                strays = max(strays, off)
    if strays > 0.0:
        warnings.append(
            f"time: stamps stray by up to {strays:.2g} sampling intervals from an even clock; values were interpolated"
        )
    return parts, [*warnings, *_gaps(recording)]


def _of_the_clock(time: FloatArray, breaks: NDArray[np.intp], step: float) -> Iterator[str]:
    for i in breaks[:MOST_GAPS].tolist():
        passed = float(time[i] - time[i - 1]) / step
        yield (
            f"time: the clock passes {passed:.4g} sampling intervals at {time[i]:.6g} s: it was set, or the logger"
            " paused; no cycle is cut across it"
        )
    if len(breaks) > MOST_GAPS:
        yield f"time: {len(breaks) - MOST_GAPS} more such places"


def _gaps(recording: Recording) -> Iterator[str]:
    """A sentence for each of the first gaps, and one for the rest."""
    gaps = recording.gaps
    for start, end in gaps[:MOST_GAPS]:
        yield f"gap: no samples from {start:.4g} s to {end:.4g} s; no cycle is cut across it"
    if len(gaps) > MOST_GAPS:
        yield f"gap: {len(gaps) - MOST_GAPS} more, up to {gaps[-1][1]:.4g} s; no cycle is cut across them"


def _steady(parts: list[Stretch], begin: float, recording: Recording) -> list[Stretch]:
    steady = [part for part in (p.after(begin) for p in parts) if len(part.mass) >= 32]
    if not steady:
        raise AnalysisError(
            f"analysis: the test is shorter than its transient: expected more than {begin - recording.time[0]:g} s; got"
            f" {recording.duration_s:.4g} s: shorten transient_s (--transient) or record longer"
        )
    return steady


@dataclass(frozen=True)
class _Composition:
    """All that the numbers of one measurement are made of."""

    recording: Recording
    scene: Scene
    layout: Layout
    response: Response
    parts: list[Stretch]
    said: tuple[str, ...]

    @property
    def sources(self) -> Sources:
        """What is not known of sensors and rig."""
        return of_sensors_and_rig(self.recording, self.scene, 1.0 / self.parts[0].step)

    def measurement(self) -> Measurement:
        """Put the numbers together."""
        layout, response_, scene = self.layout, self.response, self.scene
        edges, period = np.append(layout.time, layout.end[-1]), layout.foreign.period
        used = energy.used_cycles(edges, scene.analysis.cycles, period)
        series, settled = self._series(used), self._settled()
        trend = self._trend(series)
        index, stuck = self._irregularity(), response_.is_stuck
        drive = layout.drive
        loop = self._loop(series, used)
        cycle, estimates = self._cycle(used), self._estimates(series, used, loop, self._steady(settled), trend)
        cut = 0.0 if stuck else self._cut_away(cycle, loop.value)
        budget = self._budget(cycle, estimates, {FILTER: cut} if self._of_mass.cutoff else {})
        return Measurement(
            source=source_of(self.recording),
            status="ok",
            reason=None,
            warnings=(*self.said, *self._warnings(settled, loop), *restoring.said_of(cut, self._size, self._of_mass)),
            material=material_of(self.recording, scene),
            normal_force_n=normal_force_of(self.recording, scene),
            sampling_rate_hz=1.0 / self.parts[0].step,
            duration_s=self.recording.duration_s,
            transient_s=scene.analysis.transient_s,
            natural_frequency_hz=scene.rig.natural_frequency,
            base_distortion=float(np.linalg.norm(drive.harmonics[1:])),
            cycles=len(layout),
            energy_rule=scene.analysis.cycles,
            irregularity_index=None if stuck else index[0],
            irregularity_floor=None if stuck else index[1],
            base_irregularity_index=index[2],
            stops_per_cycle=response_.stops_per_cycle,
            stuck_fraction=response_.stuck_fraction,
            regime=response_.regime,
            asymmetry=None if stuck else response_.asymmetry,
            energy_input_per_cycle=float(energy.energy_input(layout.mass[used]).mean()),
            settled_s=settled,
            shortest_stop=response_.shortest_stop,
            smallest_slip=response_.smallest_slip,
            mass_noise_m=layout.mass_noise * drive.amplitude,
            base_noise_m=layout.base_noise * drive.amplitude,
            accuracy=accuracy_of(scene),
            cycle=cycle,
            sources=self.sources,
            series=series,
            trend=trend,
            traces=traces.traces(layout, response_.found, used),
            energy_per_cycle_j=self._joules(estimates["energy"]),
            budget=budget,
            **{name: _with_u(estimate, budget.get(SHARED.get(name, ""))) for name, estimate in estimates.items()},
        )

    @property
    def _of_mass(self) -> restoring.Channel:
        return channels_of(self.scene)[0]

    def _cut_away(self, cycle: Cycle, energy_: float) -> float:
        """How much of the amplitude the mass's filter may have cut away, Y."""
        drive, natural = self.layout.drive.frequency, self.scene.rig.natural_frequency
        friction, r = abs(energy_) / (4.0 * max(self._size, 1e-12)), drive / natural if natural else 1.0
        third = restoring.third_lost(friction, r, drive, self._of_mass)
        return max(restoring.cut_away(cycle.mass_smooth, drive, self._of_mass), third)

    @property
    def _size(self) -> float:
        return float(np.median(self.response.amplitude))

    def _budget(self, cycle: Cycle, estimates: dict[str, Estimate], of_filter: Shares) -> dict[str, Shares]:
        """What each source adds to each number, its own scatter first; ``of_filter``: to the amplitude."""
        drive = self.layout.drive
        shares = cycle_budget(
            cycle.mass_smooth,
            cycle.base,
            self.sources,
            turn=2.0 * math.pi * drive.frequency,
            unit=drive.amplitude,
        )
        of_ratio = (estimates["ratio"].value or 0.0) * self.sources.natural_frequency
        found: dict[str, Shares] = {"frequency_ratio": {"natural frequency": of_ratio}, **shares}
        found["response_amplitude"] = {**found["response_amplitude"], LINES: self.layout.hidden, **of_filter}
        own = {key: estimates[name].se or 0.0 for name, key in SHARED.items()}
        return {key: {STATISTICAL: own[key], **found[key]} for key in SHARED.values() if estimates[FIELDS[key]].known}

    def _estimates(
        self, series: CycleSeries, used: slice, loop: energy.Mean, steady: slice, trend: drift.Trend | None
    ) -> dict[str, Estimate]:
        """All numbers that have errors, by the names of the measurement's fields."""
        drive, natural = self.layout.drive, self.scene.rig.natural_frequency
        frequency, settled = Estimate(drive.frequency, drive.frequency_se), self._loop(series, steady)
        return {
            "drive": frequency,
            "ratio": frequency.over(natural),
            "base_amplitude": Estimate(drive.amplitude, drive.amplitude_se),
            "energy": Estimate(loop.value, loop.se),
            "amplitude": self._amplitude(series, used),
            "energy_trend": Estimate(trend.slope, trend.slope_se).scaled(3600.0) if trend else Estimate(),
            "steady_energy": Estimate(settled.value, settled.se),
            "steady_amplitude": self._amplitude(series, steady),
        }

    def _loop(self, series: CycleSeries, used: slice) -> energy.Mean:
        noise, shared = self.response.energy_noise, self.response.energy_shared
        return energy.mean_over(series.energy, used, noise=noise, shared=shared, period=self.layout.foreign.period)

    def _amplitude(self, series: CycleSeries, used: slice) -> Estimate:
        mean = energy.mean_over(series.amplitude, used, noise=0.0, period=self.layout.foreign.period)
        return Estimate(mean.value, math.hypot(mean.se, self.response.amplitude_noise))

    def _joules(self, loop: Estimate) -> float | None:
        stiffness = self.scene.rig.stiffness
        return loop.scaled(stiffness).scaled(self.layout.drive.amplitude**2).value if stiffness else None

    def _series(self, used: slice) -> CycleSeries:
        flags = np.zeros(len(self.layout), dtype=bool)
        flags[used] = True
        return CycleSeries(
            time=self.layout.time,
            used=flags,
            energy=self.response.energy,
            amplitude=self.response.amplitude,
            position=self.response.position,
            stops=self.response.stops,
            stuck=self.response.stuck,
        )

    def _cycle(self, used: slice) -> Cycle:
        """Mean of the cycles used, turned so that it starts at tau = 0."""
        points = self.layout.mass.shape[1]
        quarter = points // 4
        rows = self.layout.mass, self.layout.base
        mass, base = (np.roll(r[used].mean(axis=0) - w, -quarter) for r, w in zip(rows, self._level(), strict=True))
        smooth, velocity = (np.roll(c, -quarter) for c in response.mean_cycle(self.layout, used, self.response.how))
        harmonics = self.layout.drive.harmonics
        return Cycle(
            tau=2.0 * math.pi * np.arange(points) / points,
            mass=mass - mass.mean(),
            base=base - base.mean(),
            mass_smooth=smooth - smooth.mean(),
            mass_velocity=velocity,
            base_cosine=harmonics.real.copy(),
            base_sine=-harmonics.imag,
            each=self._single_cycles(),
            kept=restoring.kept(self.layout.drive.frequency * np.arange(1, points // 2 + 1), self._of_mass),
        )

    def _single_cycles(self) -> "NDArray[np.complex128]":
        """Harmonics of single steady cycles, counted from the top of the base's motion."""
        mass = self.layout.mass
        if len(mass) > MOST_SINGLE:
            mass = mass[np.linspace(0, len(mass) - 1, MOST_SINGLE).astype(np.intp)]
        lines = np.fft.rfft(mass, axis=1)[:, 1 : MOST_HARMONICS + 1] * (2.0 / mass.shape[1])
        return np.asarray(lines * 1j ** np.arange(1, lines.shape[1] + 1))

    def _level(self) -> tuple[FloatArray, FloatArray]:
        """What the slow wander of mass and base adds to a mean cycle (p,): a sensor whose zero drifts is no force."""
        layout = self.layout
        if layout.foreign.period > 1:
            return np.zeros_like(layout.base_wander), layout.base_wander
        wander = wander_of(self.response.position, layout.mass.shape[1], layout.blocks)[0]
        return wander, layout.base_wander

    def _irregularity(self) -> tuple[float | None, float | None, float | None]:
        layout = self.layout
        noise = layout.mass_noise * math.sqrt(cycles.interpolated_noise_share())
        mass = irregularity.irregularity_index(layout.mass, layout.blocks)
        base = irregularity.irregularity_index(layout.base, layout.blocks)
        return mass, irregularity.irregularity_floor(layout.mass, noise) if mass is not None else None, base

    def _trend(self, series: CycleSeries) -> drift.Trend | None:
        if series.time[-1] - series.time[0] < LONG_TEST_S:
            return None
        return drift.linear_trend(*drift.every(series.time, series.energy))

    def _steady(self, settled: float | None) -> slice:
        """The cycles after the motion had settled; all of them where that is not known."""
        layout = self.layout
        begin = self.recording.time[0] + (settled or 0.0)
        return slice(min(int(np.searchsorted(layout.time, begin - 1e-9)), len(layout) - 1), len(layout))

    def _settled(self) -> float | None:
        """When the motion had settled [s from the recording's start], from all cycles of the first stretch."""
        layout, first = self.layout, self.parts[0]
        if layout.time[0] > first.time + len(first.mass) * first.step:
            return None
        early, rows = approach(first, layout)
        final = layout.mass[-max(4, len(layout) // 4) :].mean(axis=0)
        size = max(float(final.std()), 1e-300)
        distance = np.concatenate([_distance(rows, final), _distance(layout.mass, final)]) / size
        settled = steadiness.settled_at(distance, floor=2.0 * layout.mass_noise / size)
        return None if settled is None else float(np.append(early, layout.time)[settled] - first.time)

    def _warnings(self, settled: float | None, loop: energy.Mean) -> tuple[str, ...]:
        scene, natural = self.scene, self.scene.rig.natural_frequency
        said = judgement.warnings(
            self.layout,
            self.response,
            settled,
            scene.analysis.transient_s,
            loop=loop,
            r=self.layout.drive.frequency / natural if natural else None,
            wall_moves=scene.model.wall == "base",
        )
        return said if natural else (*said, NO_NATURAL_FREQUENCY)


def _with_u(estimate: Estimate, shares: Shares | None) -> Estimate:
    return estimate if shares is None else estimate.with_u(combined(shares))


def _distance(rows: FloatArray, final: FloatArray) -> FloatArray:
    """Rms distance (n,) of cycles from a final one."""
    return np.concatenate([np.sqrt(np.mean((rows[some] - final) ** 2, axis=1)) for some in cycles.chunks(rows)])
