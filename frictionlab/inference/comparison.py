"""A measured steady cycle over its prediction: the result, with the contract's keys."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from frictionlab.estimate import Estimate, Flat, FlatKnown
from frictionlab.inference.contact_force import ContactForce
from frictionlab.inference.whole_record import WholeRecord
from frictionlab.schema import COMPARISONS
from frictionlab.schema.result import Result

FloatArray = NDArray[np.float64]

Verdict = Literal["explained", "strained", "misfit"]


def _nothing() -> FloatArray:
    return np.zeros(0)


@dataclass(frozen=True)
class OverFrequency:
    """A table over frequency and the law's curve: r, amplitude (Y) and phase (rad behind the base), as seen.

    ``r``, ``amplitude``, ``amplitude_u``, ``phase``, ``phase_u`` (n,), NaN where not measured; ``curve_r``,
    ``curve_amplitude``, ``curve_phase`` (m,), NaN where there is no steady state.
    """

    source: str
    law: str
    r: FloatArray
    amplitude: FloatArray
    amplitude_u: FloatArray
    phase: FloatArray
    phase_u: FloatArray
    curve_r: FloatArray
    curve_amplitude: FloatArray
    curve_phase: FloatArray
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, repr=False, kw_only=True)
class Comparison(Result):
    """A measured steady cycle and its prediction; the contract's keys, ``None`` is not known.

    ``friction`` (the friction ratio), ``force`` (N), ``coefficient`` are estimates, with the contract's keys as flat
    names. Energies in k Y^2, amplitudes in Y; ``energy_difference`` = predicted / measured - 1; ``response_nrmse``: rms
    of measured minus predicted cycle over the rms of the measured cycle about its mean; ``response_floor``: standard
    error of the measured mean cycle over its rms; ``misfit``: their ratio; ``verdict``: whether the law explains the
    cycle, "strained" if only with sensors or rig unlike what the scene declares.
    ``_se``: standard error with sensors and rig as they are known, ``_u``: with what is not known of them.
    ``parameters``: name -> value with its errors and limits; ``nuisances``: what else the fit moved, name -> value,
    uncertainty, and what was known before; ``levels``: unknown -> "rig", "material" or "test"; ``budget``: quantity ->
    source -> standard uncertainty; ``laws``: the ladder in the order climbed (law "auto" alone). ``tau`` (p,) rad from
    the top of the base's fundamental, ``base``, ``measured``, ``predicted`` (p,) in Y stand behind them.
    ``record_nrmse``, ``record_energy_difference``: the same of the whole record (``record``), where it was asked for;
    ``cycle_law``, ``record_laws``: with law "auto", what the steady cycle requires, and the ladder that the record
    climbed (fit "whole"): ``law`` is then its top.
    A record without a steady cycle (a sweep, a start-up) has None for all that is a cycle's, and empty arrays: its law
    is told over the largest displacement of the base from its first value and, of speeds, over omega_n times that.
    Of a table over frequency (``over_frequency``) the nrmse is of amplitudes relative, of phases in radians.
    """

    source: str
    status: str
    reason: str | None
    warnings: tuple[str, ...]
    law: str
    friction: Estimate
    force: Estimate
    coefficient: Estimate
    parameters: Mapping[str, Mapping[str, Any]]
    model: str
    solver: str
    closure_error: float | None
    nuisances: Mapping[str, Mapping[str, float]]
    levels: Mapping[str, str]
    budget: Mapping[str, Mapping[str, float]]
    accuracy: str
    material: str | None
    normal_force_n: float | None

    frequency_ratio: float | None = None
    energy_per_cycle: float | None = None
    response_amplitude: float | None = None
    stops_per_cycle: float | None = None
    regime: str | None = None
    predicted_energy_per_cycle: float | None = None
    predicted_response_amplitude: float | None = None
    predicted_stops_per_cycle: float | None = None
    predicted_regime: str | None = None
    energy_difference: float | None = None
    response_nrmse: float | None = None
    response_floor: float | None = None
    misfit: float | None = None
    verdict: Verdict | None = None
    laws: tuple[Mapping[str, object], ...] | None = None
    tau: FloatArray = field(default_factory=_nothing)
    base: FloatArray = field(default_factory=_nothing)
    measured: FloatArray = field(default_factory=_nothing)
    predicted: FloatArray | None = None
    contact: ContactForce | None = None

    over_frequency: OverFrequency | None = None
    record_nrmse: float | None = None
    record_energy_difference: float | None = None
    record: WholeRecord | None = None
    cycle_law: str | None = None
    record_laws: tuple[Mapping[str, object], ...] | None = None

    friction_ratio = FlatKnown("friction")
    friction_ratio_se = Flat("friction", "se")
    friction_ratio_u = Flat("friction", "u")
    friction_force_n = Flat("force")
    friction_force_n_se = Flat("force", "se")
    friction_force_n_u = Flat("force", "u")
    friction_coefficient = Flat("coefficient")
    friction_coefficient_se = Flat("coefficient", "se")
    friction_coefficient_u = Flat("coefficient", "u")

    def row(self) -> dict[str, object]:
        """The contract's keys alone: a line of JSON or of a table."""
        return COMPARISONS.row(self)

    def __repr__(self) -> str:
        left = "no prediction" if self.response_nrmse is None else f"nrmse {self.response_nrmse:.2g}, {self.verdict}"
        if not len(self.tau) and self.record_nrmse is not None:
            left = f"record nrmse {self.record_nrmse:.2g}"
        said = f", {len(self.warnings)} warnings" if self.warnings else ""
        ratio = "no steady cycle" if self.frequency_ratio is None else f"r = {self.frequency_ratio:.4g}"
        ratio = "over frequency" if self.over_frequency else ratio
        named = f"{self.source}: {ratio}, {self.law}"
        return f"<Comparison {named}, beta {self.friction}, {left}{said}>"
