"""What one recording says: the measurement, and the cycles that stand behind its numbers."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.steadiness import Trend
from frictionlab.arrays import FloatArray
from frictionlab.estimate import Estimate, Flat, FlatKnown
from frictionlab.schema import MEASUREMENTS, Result
from frictionlab.uncertainty import Shares, Sources

if TYPE_CHECKING:
    from frictionlab.analysis.layout import Layout

SHOWN_CYCLES, SHOWN_LOOPS = 6, 30
SHOWN_POINTS, SHOWN_LINES = 512, 8000  # a cycle, a spectrum


@dataclass(frozen=True)
class Cycle:
    """The mean of the cycles used, on points equally spaced in phase from tau = 0 (the base's fundamental at its top).

    ``tau`` (p,) rad; ``mass`` (p,) x/Y about its mean, ``base`` (p,) y/Y about its mean: as measured;
    ``mass_smooth``, ``mass_velocity`` (p,): without the noise, and its derivative by tau;
    ``base_cosine``, ``base_sine`` (9,): Fourier series of y/Y, harmonics 1 to 9 (the first is 1 and 0);
    ``kept`` (p // 2,): how much of the mass's harmonics 1 to p // 2 its filter leaves once it is taken back;
    ``each`` (n, K): complex amplitudes of harmonics 1 to K of x/Y in single steady cycles, up to 400 of them evenly
    chosen: how far one cycle may be from another;
    ``force`` (p,) N (a torque: N m): at the contact, about its mean, known inertia taken off; None: not measured;
    ``cell``: the same of single cycles;
    ``others``: the masses from the second on, of a frame of several.
    """

    tau: FloatArray
    mass: FloatArray
    base: FloatArray
    mass_smooth: FloatArray
    mass_velocity: FloatArray
    base_cosine: FloatArray
    base_sine: FloatArray
    each: NDArray[np.complex128]
    kept: FloatArray
    force: FloatArray | None = None
    cell: "LoadCell | None" = None
    others: "tuple[OtherMass, ...]" = ()


@dataclass(frozen=True)
class LoadCell:
    """The measured force in single steady cycles ``each`` (n, p) N, as `Cycle.force`, and what pressed the contact.

    ``normal_force``: mean over the way, N; None: not known; ``normal_is_measured``: by a channel of its own.
    """

    each: FloatArray
    normal_force: float | None
    normal_is_measured: bool


@dataclass(frozen=True)
class OtherMass:
    """A further mass in the same cycles: its mean cycle ``mass`` (p,) and single cycles ``each`` (n, K), as `Cycle`."""

    mass: FloatArray
    each: NDArray[np.complex128]


@dataclass(frozen=True)
class CycleSeries:
    """One value per full steady cycle, arrays (n,): ``time`` of its start [s]; ``used``: by the energy rule.

    ``energy`` (k Y^2), ``amplitude`` (Y), ``position``: mean of x/Y in the cycle about the whole mean,
    ``stops``: stops that begin in the cycle, ``stuck``: fraction of the cycle standing.
    """

    time: FloatArray
    used: NDArray[np.bool_]
    energy: FloatArray
    amplitude: FloatArray
    position: FloatArray
    stops: FloatArray
    stuck: FloatArray


@dataclass(frozen=True)
class Traces:
    """What a figure of the measurement shows; thinned, never computed on.

    ``time`` (t,) s, ``mass``, ``base`` (t,) in Y: the last cycles used; ``stops`` (k, 2) s: from when to when the mass
    stands in them; ``loop_mass``, ``loop_base`` (c, p): up to 30 of the cycles used, each closed; ``mass_frequency``,
    ``base_frequency`` Hz, ``mass_spectrum``, ``base_spectrum`` m: amplitude spectra up to ten times the drive.
    """

    time: FloatArray
    mass: FloatArray
    base: FloatArray
    stops: FloatArray
    loop_mass: FloatArray
    loop_base: FloatArray
    mass_frequency: FloatArray
    mass_spectrum: FloatArray
    base_frequency: FloatArray
    base_spectrum: FloatArray


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


def traces(layout: "Layout", found: FloatArray, used: slice) -> Traces:
    """Cut out what a figure shows of the cycles used; ``found`` (2, m): stops, radians of tau."""
    points, last = layout.mass.shape[1], slice(max(0, used.stop - SHOWN_CYCLES), used.stop)
    thin = math.ceil(points / SHOWN_POINTS)
    loops = np.unique(np.linspace(used.start, used.stop - 1, SHOWN_LOOPS).round().astype(np.intp))
    inside = np.arange(points)[::thin] / points
    time = layout.time[last, None] + (layout.end[last] - layout.time[last])[:, None] * inside
    shown = found.T / (2.0 * math.pi)
    shown = np.clip(shown[(shown[:, 1] > last.start) & (shown[:, 0] < last.stop)], last.start, last.stop)
    cycles = (layout.mass[loops], layout.base[loops])
    closed = [np.concatenate([rows[:, ::thin], rows[:, :1]], axis=1) for rows in cycles]
    spectra = []
    for lines in (layout.mass_spectrum, layout.base_spectrum):  # the highest of a few neighbours: no peak is lost
        first = np.arange(0, len(lines.frequency), math.ceil(len(lines.frequency) / SHOWN_LINES))
        spectra += [lines.frequency[first], np.maximum.reduceat(lines.amplitude, first)]
    return Traces(
        time.ravel(),
        layout.mass[last, ::thin].ravel(),
        layout.base[last, ::thin].ravel(),
        np.asarray(np.interp(shown, np.arange(len(layout) + 1.0), np.append(layout.time, layout.end[-1]))),
        *closed,
        *spectra,
    )
