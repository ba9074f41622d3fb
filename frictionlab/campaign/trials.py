"""The tests of a campaign: one row of a measurement table each, failed ones too, with the facts of each test."""

import math
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from frictionlab.analysis.steadiness import LONG_S
from frictionlab.errors import UsageError
from frictionlab.scene.keys import CYCLES, window_of
from frictionlab.schema import AMPLITUDE, BASE, ENERGY, ESTIMATED, MEASUREMENTS, RATIO, STOPS
from frictionlab.tables import Row, plain
from frictionlab.tables.texts import encodable
from frictionlab.uncertainty import NOT_KNOWN, Estimate, Flat, FlatKnown

MOST = sys.float_info.max
UNKNOWN_ERROR = 0.05  # relative: of an energy or amplitude whose measurement gives no error; wide, and said
NEARLY_NONE = 0.01  # kY^2: an energy below minus this and five errors is no contact's
TURNED = (
    f"{ENERGY} is {{:.3g}} kY^2: a contact takes energy: a channel is inverted, or mass and base are swapped: read"
    " the log again with the right columns (--mass, --base)"
)
NO_COEFFICIENT = (
    "no frequency_ratio of a frame, no measured_friction_coefficient of a given motion: a campaign of forces needs the"
    " contact's (--force; a torque gives no coefficient) and, when analyzing, its normal force"
)
MEASURED_FORCE, MEASURED_COEFFICIENT = "measured_friction_force_n", "measured_friction_coefficient"
NO_FACTS = ("its facts are not known", "is taken as a remark")  # of sentences on a name or a sheet
LONGEST_NAME = 60  # characters of a material: it stands in tables, figures and names of files
NEEDED = (RATIO, ENERGY, AMPLITUDE)
ESTIMATES = ("ratio", "energy", "energy_joules", "amplitude")
NUMBERS = {
    **{key: key for key in ("duration_s", "transient_s", "settled_s", "drive_frequency_hz", BASE)},
    "irregularity": "irregularity_index",
    "irregularity_floor": "irregularity_floor",
    "base_irregularity": "base_irregularity_index",
    "stops": STOPS,
    "asymmetry": "asymmetry",
}
"""Fields of a test: estimates as `frictionlab.schema.ESTIMATED` has them, numbers with their column."""


@dataclass(frozen=True)
class Trial:
    """One test as its measurement has it; ``None`` is not known. Units as the contract's keys; ``row`` is all of it.

    ``ratio`` (the frequency ratio), ``energy`` (k Y^2 per cycle), ``amplitude`` (Y) are estimates, dimensionless;
    ``energy_joules``: the energy in J, where the measurement knew the stiffness;
    ``coefficient``: friction by the measured force over the normal force, where that was measured.
    """

    source: str
    reason: str | None = None
    warnings: tuple[str, ...] = ()
    material: str | None = None
    normal_force_n: float | None = None
    duration_s: float = math.nan
    transient_s: float = 0.0
    energy_rule: str = "last"
    settled_s: float | None = None
    drive_frequency_hz: float = math.nan
    base_amplitude_m: float = math.nan
    ratio: Estimate = NOT_KNOWN
    energy: Estimate = NOT_KNOWN
    energy_joules: Estimate = NOT_KNOWN
    amplitude: Estimate = NOT_KNOWN
    coefficient: Estimate = NOT_KNOWN
    irregularity: float | None = None
    irregularity_floor: float = 0.0
    base_irregularity: float = 0.0
    stops: float | None = None
    regime: str | None = None
    asymmetry: float = 0.0
    row: Row = field(default_factory=dict, repr=False)

    r = FlatKnown("ratio")
    frequency_ratio = Flat("ratio")
    frequency_ratio_se = Flat("ratio", "se")

    @property
    def failed(self) -> bool:
        """Whether it has no measurement, or lacks a fact without which it belongs nowhere; ``reason`` says which."""
        return self.reason is not None

    @property
    def is_given(self) -> bool:
        """Whether its motion was given and its force measured, as on a tribometer: no frame answers."""
        return not self.energy.known and self.coefficient.known

    @property
    def speed_mm_per_s(self) -> float:
        """Largest speed of a motion that is given."""
        return 2e3 * math.pi * self.drive_frequency_hz * self.base_amplitude_m

    @property
    def is_long(self) -> bool:
        """Whether it lasts long enough to show drift: the fit over r leaves it to that."""
        return self.duration_s >= LONG_S and not self.is_given

    @property
    def mean(self) -> tuple[float, float]:
        """Energy and amplitude, over the cycles of the measurement's rule; nan if unknown."""
        return self.energy.value or math.nan, self.amplitude.value or math.nan

    @property
    def mean_se(self) -> tuple[float, float]:
        """Their standard errors; where the measurement has none, `UNKNOWN_ERROR` of the number."""
        both = zip((self.energy, self.amplitude), self.mean, strict=True)
        energy, amplitude = (UNKNOWN_ERROR * abs(value) if e.se is None else e.se for e, value in both)
        return energy, amplitude

    @property
    def systematic(self) -> tuple[float | None, float | None, float | None]:
        """Relative uncertainty of energy, amplitude and r by what sensors, clock and rig do; None: not known."""
        energy, amplitude, ratio = (
            None if e.u is None or not e.value else math.sqrt(max(e.u**2 - (e.se or 0.0) ** 2, 0.0)) / abs(e.value)
            for e in (self.energy, self.amplitude, self.ratio)
        )
        return energy, amplitude, ratio

    @property
    def cycles_before(self) -> float:
        """Cycles that have passed before the ones its energy is of."""
        kind, _, seconds = self.energy_rule.partition(":")
        before = {"all": self.transient_s, "window": self.duration_s - float(seconds or 0)}
        passed = before.get(kind, self.duration_s) * self.drive_frequency_hz
        return passed if math.isfinite(passed) else math.inf

    @property
    def group(self) -> tuple[str, float]:
        """Material and normal force (N).

        Raises
        ------
        UsageError
            The facts are not known (``failed`` says so beforehand).
        """
        if self.material is None or self.normal_force_n is None:
            raise UsageError(f"{self.source}: expected material and normal force; got neither or only one of them")
        return self.material, self.normal_force_n

    @property
    def excess_irregularity(self) -> float | None:
        """Irregularity beyond what sensor noise and the base's own irregularity give, taken off in quadrature."""
        if self.irregularity is None:
            return None
        expected = max(self.irregularity_floor, self.base_irregularity)
        return math.sqrt(max(self.irregularity**2 - expected**2, 0.0))


def trial_of(row: Row, facts: Mapping[str, object] | None = None) -> Trial:
    """A trial from one row of measurements, and from facts that the file's name or a sheet gives.

    What the row says is taken; a fact that ``facts`` gives differently becomes a warning.

    Examples
    --------
    >>> row = {"source": "a.h5", "status": "ok", RATIO: 0.5, ENERGY: 2.1, AMPLITUDE: 1.3}
    >>> trial_of(row).reason
    'no material, no normal_force_n: name them in the scene ([experiment], name_pattern or sheet)'
    >>> trial_of({**row, "warnings": ["no row for a: its facts are not known"]}).reason.split(": name them")[0]
    'no material, no normal_force_n: no row for a: its facts are not known'
    >>> trial_of(row, {"material": "steel", "normal_force_n": 1.25}).group
    ('steel', 1.25)
    """
    known = {key: plain(value) for key, value in (facts or {}).items()}
    merged = {**known, **{key: value for key, value in row.items() if value is not None}}

    def number(key: str) -> float | None:
        """A finite number of the row; anything else counts as not known."""
        value = merged.get(key)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or abs(value) > MOST:
            return None
        return float(value) if math.isfinite(value) else None

    def estimate(key: str) -> Estimate:
        """A number with its errors; one below zero is no error."""
        errors = (e if (e := number(key + end)) is None or e >= 0 else None for end in ("_se", "_u"))
        return Estimate(number(key), *errors)

    def text(key: str) -> str | None:
        value = merged.get(key)
        return encodable(str(value)) if value is not None and str(value) else None

    own, coefficient = row.get("warnings"), estimate(MEASURED_COEFFICIENT)
    force = number("normal_force_n") or Estimate(number(MEASURED_FORCE)).over(coefficient.value).value
    sentences = own if isinstance(own, (list, tuple)) else [own] if own else []
    merged["warnings"] = warnings = (*map(str, sentences), *_contradictions(row, known))
    numbers: dict[str, Any] = {name: value for name, key in NUMBERS.items() if (value := number(key)) is not None}
    estimates: dict[str, Any] = {name: estimate(ESTIMATED[name]) for name in ESTIMATES}
    trial = Trial(
        source=str(merged.get("source", "?")),
        warnings=warnings,
        material=text("material"),
        normal_force_n=force if force is not None and force > 0 else None,
        energy_rule=text("energy_rule") or "last",
        regime=text("regime"),
        coefficient=coefficient,
        row=merged,
        **numbers,
        **estimates,
    )
    return replace(trial, reason=_reason(trial))


def _reason(trial: Trial) -> str | None:
    """Why a test cannot take part in the campaign, or None."""
    row = trial.row
    if row.get("status") == "failed":
        said = row.get("reason")
        return encodable(str(said)) if said else "its measurement failed and gives no reason"
    gone = [key for key in ("material", "normal_force_n") if not getattr(trial, key)]
    if gone:
        why = next((f"{said}: " for said in trial.warnings if any(word in said for word in NO_FACTS)), "")
        return f"no {', no '.join(gone)}: {why}name them in the scene ([experiment], name_pattern or sheet)"
    if len(trial.material or "") > LONGEST_NAME:
        got = len(trial.material or "")
        return f"material: expected a name of at most {LONGEST_NAME} characters; got {got}: shorten it"
    if impossible := list(_impossible(row)):
        return f"{'; '.join(impossible)}: correct the measurement, or leave it out"
    wanting = [key for name in ESTIMATES if (key := ESTIMATED[name]) in NEEDED and not getattr(trial, name).known]
    if wanting and not trial.is_given:
        if {RATIO, ENERGY} <= {*wanting}:
            return NO_COEFFICIENT
        lacks_frame = "no frequency_ratio: give [rig] natural_frequency_hz in the scene when analyzing"
        return lacks_frame if wanting == [RATIO] else f"no {', no '.join(wanting)} in the measurement: analyze it again"
    try:
        window_of(trial.energy_rule)
    except ValueError:
        return f"energy_rule: expected {CYCLES}; got {trial.energy_rule[:LONGEST_NAME]!r}: analyze it again"
    energy, error = trial.energy.value or 0.0, trial.energy.se or 0.0
    return TURNED.format(energy) if energy < -max(5.0 * error, NEARLY_NONE) else None


def _impossible(row: Row) -> Iterator[str]:
    """Numbers of a row that cannot be, in words."""
    for column in MEASUREMENTS.columns:
        value, (low, high) = row.get(column.name), (*column.range, -math.inf, math.inf)[:2]
        if isinstance(value, (int, float)) and not isinstance(value, bool) and (value < low or value > high):
            said = f"{value:g}" if abs(value) <= MOST else "a number beyond all bounds"
            yield f"{column.name} = {said}: expected {low:g} to {high:g}"


def _contradictions(row: Row, facts: Row) -> Iterator[str]:
    for key, ours in facts.items():
        theirs = row.get(key)
        if ours is None or theirs is None:
            continue
        numbers = isinstance(ours, (int, float)) and isinstance(theirs, (int, float))
        same = math.isclose(ours, theirs, rel_tol=1e-6) if numbers else str(ours) == str(theirs)  # type: ignore[arg-type]
        if not same:
            yield f"{key} is {theirs!r} in the measurement, {ours!r} by the scene: {theirs!r} is taken"


def in_order(trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """Trials sorted by material, normal force, frequency ratio and source, failed ones last; each source once.

    Normal forces that were measured, and differ by 2 % at most, are one setting.

    Raises
    ------
    UsageError
        A source stands twice: its test would count twice.
    """
    twice = sorted(source for source, times in Counter(trial.source for trial in trials).items() if times > 1)
    if twice:
        raise UsageError(
            f"campaign: measured twice: {', '.join(twice[:5])}{' ...' if len(twice) > 5 else ''}; expected one"
            " measurement per test: leave one file out"
        )
    measured = [t.row.get("normal_force_n") is None and t.normal_force_n is not None for t in trials]
    every = levels([t.normal_force_n or 0.0 for t, of_channel in zip(trials, measured, strict=True) if of_channel])
    return tuple(
        sorted(
            (
                replace(t, normal_force_n=float(f"{nearest(t.normal_force_n or 0.0, every):.3g}")) if of_channel else t
                for t, of_channel in zip(trials, measured, strict=True)
            ),
            key=lambda t: (t.failed, t.material or "", t.normal_force_n or 0.0, t.frequency_ratio or 0.0, t.source),
        )
    )


def levels(ratios: Sequence[float]) -> tuple[float, ...]:
    """The frequency ratios a campaign was set to, from the measured ones: neighbours within 2 % belong together.

    Examples
    --------
    >>> [round(level, 5) for level in levels([0.2999, 0.3002, 0.35, 1.2, 1.201])]
    [0.30005, 0.35, 1.2005]
    """
    rest = sorted(ratios)
    found = []
    while rest:
        near = [r for r in rest if r <= rest[0] + max(0.02 * rest[0], 0.008)]
        found.append(math.fsum(near) / len(near))
        rest = rest[len(near) :]
    return tuple(found)


def nearest(value: float, among: Sequence[float]) -> float:
    """The level a measured ratio belongs to."""
    return min(among, key=lambda level: abs(level - value))


def short_name(source: str) -> str:
    """A source without its folders and suffix, for tables and figures."""
    return Path(source).stem
