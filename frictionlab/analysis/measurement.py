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

from frictionlab.analysis import channels, doubts, response, steadiness
from frictionlab.analysis.layout import Layout, lay_out
from frictionlab.analysis.response import ByForce, Cycle, Response, mean_cycle
from frictionlab.analysis.signals import Stretch
from frictionlab.analysis.steadiness import Trend
from frictionlab.analysis.stretches import SHORTEST_PART, channels_of, even_stretches, is_force
from frictionlab.arrays import FloatArray
from frictionlab.errors import AnalysisError, UsageError
from frictionlab.recording import Recording
from frictionlab.scene import Scene
from frictionlab.scene.keys import window_of
from frictionlab.schema import AMPLITUDE, ENERGY, ESTIMATED, MEASUREMENTS, RATIO, Result
from frictionlab.uncertainty import (
    FILTER,
    LINES,
    NOT_KNOWN,
    STATISTICAL,
    Estimate,
    Flat,
    FlatKnown,
    Shares,
    Sources,
    combined,
    cycle_budget,
    sources_of,
)

Means = Mapping[str, Any]
"""Estimates by their names in a `Measurement`."""

MANY_HELD = 0.01  # of the samples: so many leave no cycle whole


@dataclass(frozen=True, repr=False, kw_only=True)
class Measurement(Response, ByForce, Result):
    """What one recording says. ``None`` is not known; lengths are over Y, energies over k Y^2 unless a name says more.

    Numbers with errors are estimates (``energy.value``, ``energy.se``, ``energy.u``), means over the cycles used; each
    has flat names too, which are the contract's keys: ``energy_per_cycle``, ``energy_per_cycle_se``,
    ``energy_per_cycle_u``. All of them are described in `frictionlab.schema`; `Response` (how the mass answers) and
    `ByForce` (by a load cell) describe theirs.

    ``energy_trend`` (k Y^2 per hour): long tests only. ``cycle``, ``series``, ``trend``, ``layout``: what stands behind
    the numbers.
    """

    drive: Estimate
    ratio: Estimate
    base_amplitude: Estimate
    energy: Estimate
    amplitude: Estimate
    source: str
    warnings: tuple[str, ...]
    material: str | None
    normal_force_n: float | None
    sampling_rate_hz: float
    duration_s: float
    transient_s: float
    settled_s: float | None
    natural_frequency_hz: float | None
    base_distortion: float
    cycles: int
    energy_rule: str
    energy_joules: Estimate
    mass_noise_m: float
    base_noise_m: float
    accuracy: str
    cycle: Cycle
    trend: Trend | None
    layout: Layout
    budget: Mapping[str, Shares]
    sources: Sources
    slides_one_way: bool = False
    status: str = "ok"
    reason: str | None = None

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
    energy_per_cycle_j, energy_per_cycle_j_u = Flat("energy_joules"), Flat("energy_joules", "u")
    response_amplitude = FlatKnown("amplitude")
    response_amplitude_se = FlatKnown("amplitude", "se")
    response_amplitude_u = Flat("amplitude", "u")
    energy_trend_per_hour = Flat("energy_trend")
    energy_trend_per_hour_se = Flat("energy_trend", "se")

    force_energy_per_cycle, force_energy_per_cycle_u = Flat("force_energy"), Flat("force_energy", "u")
    force_energy_per_cycle_j, force_energy_per_cycle_j_u = Flat("force_energy_j"), Flat("force_energy_j", "u")
    measured_friction_force_n, measured_friction_force_n_u = Flat("measured_force"), Flat("measured_force", "u")
    measured_friction_coefficient = Flat("measured_coefficient")
    measured_friction_coefficient_u = Flat("measured_coefficient", "u")

    @property
    def settles_later_s(self) -> float | None:
        """When the motion settled, where that is after the cycles measured begin; infinite: not in this recording."""
        at = math.inf if self.settled_s is None else self.settled_s
        late = at > self.transient_s + 1.0 / self.drive_frequency_hz
        return at if late and not self.is_stuck and len(self.layout) >= doubts.FEW_CYCLES else None

    @property
    def energy_trend(self) -> Estimate:
        """Change of the energy, k Y^2 per hour; known of long tests only."""
        return Estimate(self.trend.slope, self.trend.slope_se).scaled(3600.0) if self.trend else NOT_KNOWN

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
    begin, prescribed = float(recording.time[0]), scene.rig.kind == "prescribed"
    try:
        parts, warnings, transient, settled, layout = _laid_out(recording, scene, begin)
    except AnalysisError as error:
        if (held := recording.flag_counts()["held"]) < MANY_HELD * len(recording):
            raise
        what = f"{held} values are held at the end of a sensor's range, which cuts every cycle"
        raise AnalysisError(f"analysis: {what}: move it or enlarge its range") from error
    drive, natural, of_mass = layout.drive, scene.rig.natural_frequency, channels_of(scene)[0]
    channels.check_drive(drive.frequency, channels_of(scene))
    wall_moves, r = scene.model.wall == "base", drive.frequency / natural if natural else None
    joules = scene.rig.stiffness * drive.amplitude**2 if scene.rig.stiffness else None  # k Y^2
    is_long = layout.duration >= steadiness.LONG_S
    one_way, normal_force_n = any(part.one_way for part in parts), normal_force_of(recording, scene)
    used = used_cycles(np.append(layout.time, layout.end[-1]), scene.analysis.cycles)
    answer = response.response(layout, used, wall_moves=wall_moves)
    cycle = mean_cycle(layout, answer, used, of_mass)
    means = _means(layout, answer, used, natural, prescribed=prescribed)
    sources = sources_of_test(recording, scene, 1.0 / parts[0].step)
    smooth, slides = cycle.mass_smooth, abs(means["energy"].value or 0.0) / (4.0 * max(answer.size, 1e-12))
    cut = 0.0 if answer.is_stuck else channels.cut_away(smooth, drive.frequency, of_mass, friction=slides, r=r)
    means, budget = _budgeted(cycle, means, sources, layout, {FILTER: cut} if of_mass.cutoff else {})
    by_force, force, cell, said = response.by_load_cell(
        *(layout, answer, used, sources, joules),
        normal_force_n=normal_force_n,
        inertia_kg=scene.sensors.force_inertia_kg,
        wall_moves=wall_moves,
        has_metres=scene.rig.radius_m is not None or not channels.is_angular(recording.measured()),
        one_way=one_way,
    )
    measured = Measurement(
        **means,
        **vars(answer),
        **vars(by_force),
        source=source_of(recording),
        warnings=(),
        material=material_of(recording, scene),
        normal_force_n=normal_force_n,
        sampling_rate_hz=1.0 / parts[0].step,
        duration_s=recording.duration_s,
        transient_s=transient,
        settled_s=settled,
        natural_frequency_hz=natural,
        base_distortion=drive.distortion,
        cycles=len(layout),
        energy_rule=scene.analysis.cycles,
        energy_joules=means["energy"].scaled(joules).widened(sources.stiffness),
        mass_noise_m=layout.of_mass.noise * drive.amplitude,
        base_noise_m=layout.of_base.noise * drive.amplitude,
        accuracy=scene.accuracy,
        cycle=replace(cycle, force=force, cell=cell),
        trend=steadiness.trend_of(layout.time, answer.series.energy) if is_long and not prescribed else None,
        layout=layout,
        budget=budget,
        sources=sources,
        slides_one_way=one_way,
    )
    known = of_mass.cutoff, scene.rig.damping or 0.0, wall_moves, not scene.rig.masses
    said += doubts.warnings(measured, parts, cut, known, recording.experiment.get("nominal_frequency_ratio"))
    return replace(measured, warnings=(*scene.rig.doubts, *warnings, *said))


def _laid_out(
    recording: Recording, scene: Scene, begin: float
) -> tuple[list[Stretch], list[str], float, float | None, Layout]:
    """The driven parts, what is said of them, the transient [s], when it settled [s], and the steady cycles."""
    parts, warnings = even_stretches(recording, scene)
    parts, stands = steadiness.driven(parts)
    found, settled = steadiness.transient(parts, begin, scene.rig.natural_frequency)
    transient = found if scene.analysis.transient_s is None else scene.analysis.transient_s
    steady = [part for part in (p.after(begin + transient) for p in parts) if len(part.mass) >= SHORTEST_PART]
    if not steady:
        got = f"expected more than {transient:g} s; got {recording.duration_s:.4g} s: shorten transient_s (--transient)"
        raise AnalysisError(f"analysis: the test is shorter than its transient: {got}")
    return parts, warnings + stands, transient, settled, lay_out(steady, **scene.analysis.knobs)


def used_cycles(end_time: FloatArray, rule: str) -> slice:
    """Which cycles a rule uses (``last``, ``all``, ``window:S``), by each cycle's start and the last end (n + 1,).

    `UsageError`: There is no such rule. `AnalysisError`: The window is shorter than a cycle.
    """
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


def _means(layout: Layout, answer: Response, used: slice, natural: float | None, *, prescribed: bool) -> Means:
    """All means with their standard errors, by their names."""
    drive, noise, shared = layout.drive, answer.energy_noise, answer.energy_shared
    frequency = Estimate(drive.frequency, drive.frequency_se)
    found = {"drive": frequency, "ratio": frequency.over(natural)}
    found["base_amplitude"] = Estimate(drive.amplitude, drive.amplitude_se)
    found["energy"] = steadiness.mean_over(answer.series.energy, used, noise=noise, shared=shared)
    size = steadiness.mean_over(answer.series.amplitude, used)
    found["amplitude"] = Estimate(size.value, math.hypot(size.se or 0.0, answer.amplitude_noise))
    # a mass that drives itself has no loop and no ratio
    return found | (dict.fromkeys(("ratio", "energy"), NOT_KNOWN) if prescribed else {})


def _budgeted(
    cycle: Cycle, means: Means, sources: Sources, layout: Layout, of_filter: Shares
) -> tuple[Means, dict[str, Shares]]:
    """The means with combined uncertainties, and what each source adds, scatter first; of the filter to amplitude."""
    turn, unit = 2.0 * math.pi * layout.drive.frequency, layout.drive.amplitude
    mass, base = (
        math.hypot(1.0 - s, s) for s in (c.by_second(layout.samples) for c in (layout.of_mass, layout.of_base))
    )
    sources = replace(sources, mass_gain=mass * sources.mass_gain, base_gain=base * sources.base_gain)
    found = dict(cycle_budget(cycle.mass_smooth, cycle.base, sources, turn=turn, unit=unit))
    found[RATIO] = {"natural frequency": (means["ratio"].value or 0.0) * sources.natural_frequency}
    folded = float(layout.folded_into(1)[0])  # of any phase
    found[ENERGY] = {**found[ENERGY], **({LINES: math.pi * folded / math.sqrt(2.0)} if folded else {})}
    found[AMPLITUDE] = {**found[AMPLITUDE], LINES: math.hypot(layout.hidden, folded), **of_filter}
    whole, budget = dict[str, Estimate](), dict[str, Shares]()
    for name in ("ratio", "base_amplitude", "energy", "amplitude"):
        number, key = means[name], ESTIMATED[name]
        if number.known:
            budget[key] = {STATISTICAL: number.se or 0.0, **found[key]}
            whole[name] = number.with_u(combined(budget[key]))
    return {**means, **whole}, budget


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
