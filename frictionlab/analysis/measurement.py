"""What one recording says: the measurement, and the cycles that stand behind its numbers."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from frictionlab.analysis.drift import Trend

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Cycle:
    """The mean of the cycles used, on points equally spaced in phase from tau = 0 (the base's fundamental at its top).

    ``tau`` (p,) rad; ``mass`` (p,) x/Y about its mean, ``base`` (p,) y/Y about its mean: as measured;
    ``mass_smooth``, ``mass_velocity`` (p,): without the noise, and its derivative by tau;
    ``base_cosine``, ``base_sine`` (9,): Fourier series of y/Y, harmonics 1 to 9 (the first is 1 and 0).
    """

    tau: FloatArray
    mass: FloatArray
    base: FloatArray
    mass_smooth: FloatArray
    mass_velocity: FloatArray
    base_cosine: FloatArray
    base_sine: FloatArray


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


@dataclass(frozen=True)
class Measurement:
    """What one recording says; the fields up to ``asymmetry`` are the contract's keys, ``None`` is not known.

    ``energy_per_cycle`` in k Y^2 (``_j`` in joules), ``response_amplitude`` in Y; names say the other units.

    Beyond the contract: ``energy_input_per_cycle`` eq. (2.16); ``energy_trend_per_hour`` (k Y^2 per hour, long tests
    only) with its standard error; ``steady_...``: energy and amplitude over all settled cycles, whatever the rule;
    ``settled_s``: when the motion had settled, from the recording's start;
    ``shortest_stop``: the shortest stop that could be told from a slow passage, in cycles; ``mass_noise_m``,
    ``base_noise_m``: rms of the sensors' white noise;
    ``accuracy``: the level of the knobs (`frictionlab.accuracy`); ``cycle``, ``series``, ``trend``, ``traces``: what
    stands behind the numbers.
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
    drive_frequency_hz: float
    drive_frequency_hz_se: float | None
    natural_frequency_hz: float | None
    frequency_ratio: float | None
    frequency_ratio_se: float | None
    base_amplitude_m: float
    base_amplitude_m_se: float
    base_distortion: float
    cycles: int
    energy_per_cycle: float
    energy_per_cycle_se: float
    energy_per_cycle_j: float | None
    energy_rule: str
    response_amplitude: float
    response_amplitude_se: float
    irregularity_index: float | None
    irregularity_floor: float | None
    base_irregularity_index: float | None
    stops_per_cycle: float
    stuck_fraction: float
    regime: str
    asymmetry: float | None
    energy_input_per_cycle: float
    energy_trend_per_hour: float | None
    energy_trend_per_hour_se: float | None
    steady_energy_per_cycle: float
    steady_energy_per_cycle_se: float
    steady_response_amplitude: float
    steady_response_amplitude_se: float
    settled_s: float | None
    shortest_stop: float
    mass_noise_m: float
    base_noise_m: float
    accuracy: str
    cycle: Cycle
    series: CycleSeries
    trend: Trend | None
    traces: Traces

    def row(self) -> dict[str, object]:
        """The numbers alone, in the contract's order: a line of JSON or of a table."""
        behind = ("cycle", "series", "trend", "traces")
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name not in behind}
