"""Recording + scene -> measurement: what `analyze` does to a sample, in its order.

1. Even stretches: gaps and clock breaks part them; declared lags and filters are taken back (`stretches`, `channels`).
2. The transient is cut off: as given, or where the motion settles (`steadiness`).
3. Cycles: drive frequency and hum (`spectrum`), cut by the base's phase (`cycles`), laid under each other (`layout`).
4. The answer of each cycle: loop area (`energy`), amplitude, stops (`stops`), regime (`response`).
5. Means with errors (`energy`, `signals`), the budget of sensors and rig (`uncertainty`), and what a reader must know
   of them (`doubts`).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from frictionlab.analysis import channels, cycles, doubts, energy, response, steadiness
from frictionlab.analysis.layout import Layout, lay_out
from frictionlab.analysis.response import Cycle, CycleSeries, Response, Traces, mean_cycle, traces
from frictionlab.analysis.signals import Stretch
from frictionlab.analysis.steadiness import Trend
from frictionlab.analysis.stretches import FEWEST_SAMPLES, channels_of, even_stretches, is_force
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError, UsageError
from frictionlab.estimate import NOT_KNOWN, Estimate, Flat, FlatKnown
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.scene.keys import window_of
from frictionlab.schema import AMPLITUDE, ESTIMATED, MEASUREMENTS, RATIO, Result
from frictionlab.uncertainty import FILTER, LINES, STATISTICAL, Shares, Sources, combined, cycle_budget, sources_of

NO_NATURAL_FREQUENCY = (
    "frequency_ratio: the natural frequency is not known: give natural_frequency_hz in [rig] of the scene or"
    " --natural-frequency; `frictionlab free-vibration` measures it"
)
LONG_TEST_S = 300.0  # from this length on a trend of the energy is fitted
BUDGETED = ("ratio", "base_amplitude", "energy", "amplitude")  # those with a combined uncertainty


@dataclass(frozen=True, repr=False)
class Measurement(Result):
    """What one recording says. ``None`` is not known; lengths are over Y, energies over k Y^2 unless a name says more.

    Numbers with errors are estimates (``energy.value``, ``energy.se``, ``energy.u``); each has flat names too, which
    are the contract's keys: ``energy_per_cycle``, ``energy_per_cycle_se``, ``energy_per_cycle_u``. All of them
    are described in `frictionlab.schema`.

    ``drive`` Hz; ``ratio``: drive over natural frequency; ``base_amplitude`` m; ``energy``, ``amplitude`` by the energy
    rule, ``steady_energy``, ``steady_amplitude`` over all settled cycles; ``energy_trend`` (k Y^2 per hour): long tests
    only. By a load cell: ``force_energy`` (k Y^2), ``force_energy_j``, ``measured_force`` N, ``measured_coefficient``.
    ``cycle``, ``series``, ``trend``, ``traces``: what stands behind the numbers.
    """

    source: str
    status: str
    reason: str | None
    warnings: tuple[str, ...]
    material: str | None
    normal_force_n: float | None
    sampling_rate_hz: float
    duration_s: float
    transient_s: float
    drive: Estimate
    natural_frequency_hz: float | None
    ratio: Estimate
    base_amplitude: Estimate
    base_distortion: float
    cycles: int
    energy: Estimate
    energy_per_cycle_j: float | None
    energy_rule: str
    amplitude: Estimate
    irregularity_index: float | None
    irregularity_floor: float | None
    base_irregularity_index: float | None
    stops_per_cycle: float
    stuck_fraction: float
    regime: str
    asymmetry: float | None
    energy_input_per_cycle: float
    energy_trend: Estimate
    steady_energy: Estimate
    steady_amplitude: Estimate
    settled_s: float | None
    shortest_stop: float
    smallest_slip: float
    mass_noise_m: float
    base_noise_m: float
    accuracy: str
    cycle: Cycle
    series: CycleSeries
    trend: Trend | None
    traces: Traces
    force_energy: Estimate
    force_energy_j: Estimate
    measured_force: Estimate
    measured_coefficient: Estimate
    budget: Mapping[str, Shares]
    sources: Sources
    slides_one_way: bool = False

    drive_frequency_hz = FlatKnown("drive")
    drive_frequency_hz_se = Flat("drive", "se")
    frequency_ratio = Flat("ratio")
    frequency_ratio_se = Flat("ratio", "se")
    frequency_ratio_u = Flat("ratio", "u")
    base_amplitude_m = FlatKnown("base_amplitude")
    base_amplitude_m_se = FlatKnown("base_amplitude", "se")
    base_amplitude_m_u = Flat("base_amplitude", "u")
    energy_per_cycle = FlatKnown("energy")
    energy_per_cycle_se = FlatKnown("energy", "se")
    energy_per_cycle_u = Flat("energy", "u")
    response_amplitude = FlatKnown("amplitude")
    response_amplitude_se = FlatKnown("amplitude", "se")
    response_amplitude_u = Flat("amplitude", "u")
    energy_trend_per_hour = Flat("energy_trend")
    energy_trend_per_hour_se = Flat("energy_trend", "se")
    steady_energy_per_cycle = FlatKnown("steady_energy")
    steady_energy_per_cycle_se = FlatKnown("steady_energy", "se")
    steady_response_amplitude = FlatKnown("steady_amplitude")
    steady_response_amplitude_se = FlatKnown("steady_amplitude", "se")

    force_energy_per_cycle = Flat("force_energy")
    force_energy_per_cycle_j = Flat("force_energy_j")
    measured_friction_force_n = Flat("measured_force")
    measured_friction_coefficient = Flat("measured_coefficient")
    measured_friction_coefficient_u = Flat("measured_coefficient", "u")

    def row(self) -> dict[str, object]:
        """The numbers alone, in the contract's order: a line of JSON or of a table."""
        return MEASUREMENTS.row(self)

    def __repr__(self) -> str:
        ratio = "r not known" if self.ratio.value is None else f"r = {self.ratio.value:.4g}"
        said = f", {len(self.warnings)} warnings" if self.warnings else ""
        return f"<Measurement {self.source}: {ratio}, energy {self.energy} kY², {self.regime}{said}>"


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
    parts, warnings = even_stretches(recording, scene)
    begin = float(recording.time[0])
    found, settled = steadiness.transient(parts, begin)
    transient = found if scene.analysis.transient_s is None else scene.analysis.transient_s
    layout = _laid_out(parts, transient, recording, scene)
    of_mass, of_base = channels_of(scene)
    channels.check_drive(layout.drive.frequency, (of_mass, of_base))
    natural, unit = scene.rig.natural_frequency, layout.drive.amplitude
    wall_moves, prescribed = scene.model.wall == "base", scene.rig.kind == "prescribed"
    r, rate = layout.drive.frequency / natural if natural else None, 1.0 / parts[0].step
    joules = scene.rig.stiffness * unit**2 if scene.rig.stiffness else None  # k Y^2
    answer = response.response(layout, wall_moves=wall_moves)
    used = used_cycles(np.append(layout.time, layout.end[-1]), scene.analysis.cycles)
    cycle = mean_cycle(layout, answer, used, of_mass)
    steady_from = begin + (settled or 0.0)
    estimates: dict[str, Any] = _estimates(layout, answer, used, steady_from, natural, prescribed=prescribed)
    sources, loop = sources_of_test(recording, scene, rate), estimates["energy"]
    cut, slides = 0.0, abs(loop.value or 0.0) / (4.0 * max(answer.size, 1e-12))
    if not answer.is_stuck:
        cut = channels.cut_away(cycle.mass_smooth, layout.drive.frequency, of_mass, friction=slides, r=r)
    budget = _budget(cycle, estimates, sources, layout, {FILTER: cut} if of_mass.cutoff else {})
    estimates |= {n: estimates[n].with_u(combined(budget[ESTIMATED[n]])) for n in BUDGETED if estimates[n].known}
    friction = energy.by_load_cell(
        *(layout, answer, used, sources),
        normal_force_n=normal_force_of(recording, scene),
        inertia_kg=scene.sensors.force_inertia_kg,
        wall_moves=wall_moves,
        has_metres=scene.rig.radius_m is not None or not channels.is_angular(recording.measured()),
    )
    warnings += doubts.warnings(
        layout, answer, settled, transient, loop=loop, r=r, wall_moves=wall_moves, prescribed=prescribed
    )
    if friction is not None:
        taken = energy.taken_by_the_frame(cycle.mass_smooth - cycle.base, scene.rig.damping or 0.0, r or 0.0)
        warnings += doubts.of_the_load_cell(friction, loop, joules, taken)
        cycle = replace(cycle, force=friction.cycle, cell=friction.cell)
        estimates |= {
            "force_energy": friction.energy.over(joules),
            "force_energy_j": friction.energy,
            "measured_force": friction.force,
            "measured_coefficient": friction.coefficient,
        }
    unknown = () if natural or prescribed else (NO_NATURAL_FREQUENCY,)
    warnings += (*unknown, *doubts.of_the_filter(cut, answer.size, of_mass))
    is_long = not prescribed and layout.time[-1] - layout.time[0] >= LONG_TEST_S
    trend = steadiness.trend_of(layout.time, answer.energy) if is_long else None
    return Measurement(
        **_facts(recording, scene, layout, parts),
        **_of_the_answer(layout, answer, used),
        **estimates,
        warnings=(*scene.rig.doubts, *warnings),
        transient_s=transient,
        energy_per_cycle_j=loop.scaled(joules).value,
        energy_trend=Estimate(trend.slope, trend.slope_se).scaled(3600.0) if trend else NOT_KNOWN,
        settled_s=settled,
        cycle=cycle,
        sources=sources,
        trend=trend,
        traces=traces(layout, answer.found, used),
        budget=budget,
    )


def _facts(recording: Recording, scene: Scene, layout: Layout, parts: list[Stretch]) -> dict[str, Any]:
    """Fields of a measurement that say which test it is of, and what its sensors are like."""
    return {
        "source": source_of(recording),
        "status": "ok",
        "reason": None,
        "material": material_of(recording, scene),
        "normal_force_n": normal_force_of(recording, scene),
        "sampling_rate_hz": 1.0 / parts[0].step,
        "slides_one_way": any(part.one_way for part in parts),
        "duration_s": recording.duration_s,
        "natural_frequency_hz": scene.rig.natural_frequency,
        "base_distortion": float(np.linalg.norm(layout.drive.harmonics[1:])),
        "cycles": len(layout),
        "energy_rule": scene.analysis.cycles,
        "mass_noise_m": layout.of_mass.noise * layout.drive.amplitude,
        "base_noise_m": layout.of_base.noise * layout.drive.amplitude,
        "accuracy": scene.accuracy,
    }


def _of_the_answer(layout: Layout, answer: Response, used: slice) -> dict[str, Any]:
    """Fields of a measurement that say how the mass answers, those without an error, and its series."""
    is_used, still = np.zeros(len(layout), dtype=bool), answer.is_stuck
    is_used[used] = True
    noise = layout.of_mass.noise * math.sqrt(cycles.INTERPOLATED)
    index = None if still else steadiness.irregularity_index(layout.mass, layout.blocks)
    per_cycle = (answer.energy, answer.amplitude, answer.position, answer.stops, answer.stuck)
    return {
        "stops_per_cycle": answer.stops_per_cycle,
        "stuck_fraction": answer.stuck_fraction,
        "regime": answer.regime,
        "shortest_stop": answer.shortest_stop,
        "smallest_slip": answer.smallest_slip,
        "irregularity_index": index,
        "irregularity_floor": None if index is None else steadiness.irregularity_floor(layout.mass, noise),
        "base_irregularity_index": steadiness.irregularity_index(layout.base, layout.blocks),
        "asymmetry": None if still else answer.asymmetry,
        "energy_input_per_cycle": float(energy.energy_input(layout.mass[used]).mean()),
        "series": CycleSeries(layout.time, is_used, *per_cycle),
    }


def _laid_out(parts: list[Stretch], transient: float, recording: Recording, scene: Scene) -> Layout:
    """The steady cycles; refused where there are none, by what is the cause."""
    begin, how = float(recording.time[0]) + transient, scene.analysis
    steady = [part for part in (p.after(begin) for p in parts) if len(part.mass) >= FEWEST_SAMPLES]
    if not steady:
        raise AnalysisError(
            f"analysis: the test is shorter than its transient: expected more than {transient:g} s; got"
            f" {recording.duration_s:.4g} s: shorten transient_s (--transient) or record longer"
        )
    try:
        return lay_out(steady, padding=how.padding, least_points=how.least_points, most_points=how.most_points)
    except AnalysisError as error:
        held = recording.flag_counts()["held"]
        if not held:
            raise
        raise AnalysisError(
            f"analysis: {held} values are held at the end of a sensor's range, and between them no cycle is whole: move"
            f" the sensor or enlarge its range, and test again ({error})"
        ) from error


def used_cycles(end_time: FloatArray, rule: str) -> slice:
    """Which cycles a rule uses (``last``, ``all``, ``window:S``), by each cycle's start and the last end (n + 1,)."""
    n = len(end_time) - 1
    try:
        window = window_of(rule)
    except ValueError as error:
        raise UsageError(f"cycles: {error}") from error
    first = n - 1 if rule == "last" else 0
    if window is not None:
        first = int(np.searchsorted(end_time[:-1], end_time[-1] - window - 1e-9 * abs(window)))
    if first >= n:
        length = end_time[-1] - end_time[-2]
        raise AnalysisError(f"cycles: window of {window:g} s is shorter than one cycle ({length:g} s): widen it")
    return slice(first, n)


def _estimates(
    layout: Layout, answer: Response, used: slice, steady_from: float, natural: float | None, *, prescribed: bool
) -> dict[str, Estimate]:
    """All numbers that have errors, by the names of the measurement's fields; from a time [s] on cycles are steady."""
    first = int(np.searchsorted(layout.time, steady_from - 1e-9))
    frequency = Estimate(layout.drive.frequency, layout.drive.frequency_se)
    found = {
        "drive": frequency,
        "ratio": frequency.over(natural),
        "base_amplitude": Estimate(layout.drive.amplitude, layout.drive.amplitude_se),
    }
    for kind, some in (("", used), ("steady_", slice(min(first, len(layout) - 1), len(layout)))):
        found[f"{kind}energy"] = energy.mean_over(
            answer.energy, some, noise=answer.energy_noise, shared=answer.energy_shared
        )
        mean = energy.mean_over(answer.amplitude, some)
        found[f"{kind}amplitude"] = Estimate(mean.value, math.hypot(mean.se or 0.0, answer.amplitude_noise))
    by_force = ("force_energy", "force_energy_j", "measured_force", "measured_coefficient")
    unknown = (*by_force, "ratio", "energy", "steady_energy") if prescribed else by_force
    return found | dict.fromkeys(unknown, NOT_KNOWN)  # a mass that drives itself has no loop and no ratio


def _budget(
    cycle: Cycle, estimates: dict[str, Estimate], sources: Sources, layout: Layout, of_filter: Shares
) -> dict[str, Shares]:
    """What each source adds to each number, its own scatter first; ``of_filter``: to the amplitude."""
    turn, unit = 2.0 * math.pi * layout.drive.frequency, layout.drive.amplitude
    found = dict(cycle_budget(cycle.mass_smooth, cycle.base, sources, turn=turn, unit=unit))
    found[RATIO] = {"natural frequency": (estimates["ratio"].value or 0.0) * sources.natural_frequency}
    found[AMPLITUDE] = {**found[AMPLITUDE], LINES: layout.hidden, **of_filter}
    known = ((ESTIMATED[name], estimates[name]) for name in BUDGETED)
    return {key: {STATISTICAL: number.se or 0.0, **found[key]} for key, number in known if number.known}


# What a recording, and else its scene, say about a test --------------------------------------------------------------


def source_of(recording: Recording) -> str:
    """The names of the logs that a recording was made of."""
    return ", ".join(f.name for f in recording.source.files)


def material_of(recording: Recording, scene: Scene) -> str | None:
    """Material of a test's contact, as the recording has it, else the scene."""
    value = recording.experiment.get("material", scene.experiment.material)
    return None if value is None else str(value)


def normal_force_of(recording: Recording, scene: Scene) -> float | None:
    """Normal force of a test [N], as the recording has it, else the scene."""
    value = recording.experiment.get("normal_force_n", scene.experiment.normal_force_n)
    return float(value) if value is not None and is_force(value) else None


def sources_of_test(recording: Recording, scene: Scene, sampling_rate_hz: float) -> Sources:
    """What is not known of the sensors and the rig of a test."""
    lag = recording.source.dialect.get("lag_s_u")
    lag_s_u = lag if isinstance(lag, float) else None
    return sources_of(scene, sampling_rate_hz, normal_force_n=normal_force_of(recording, scene), lag_s_u=lag_s_u)
