"""The tests of a campaign: one row of a measurement table each, failed ones too, with the facts of each test."""

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from frictionlab.analysis.steadiness import Trend
from frictionlab.cycle_rule import EXPECTED, window_of
from frictionlab.errors import UsageError
from frictionlab.estimate import NOT_KNOWN, Estimate, Flat
from frictionlab.tables import Row, plain
from frictionlab.tables.texts import encodable

MOST = sys.float_info.max
CUT = 0.01  # relative: what cutting and sampling the cycles a little differently does to an irregularity index
UNKNOWN_ERROR = 0.05  # relative: of an energy or amplitude whose measurement tells no error; wide, and said
NEARLY_NONE = 0.01  # kY^2: an energy below minus this and five errors is no contact's
TURNED = (
    "energy_per_cycle is {:.3g} kY^2: a contact takes energy: a channel is inverted, or mass and base are swapped: read"
    " the log again with the right columns (--mass, --base)"
)
POSSIBLE: Mapping[str, tuple[float, float]] = {
    "normal_force_n": (1e-6, 1e9),
    "sampling_rate_hz": (1e-6, 1e9),
    "natural_frequency_hz": (1e-6, 1e6),
    "duration_s": (0.0, 1e8),
    "transient_s": (0.0, 1e8),
    "settled_s": (0.0, 1e8),
    "drive_frequency_hz": (1e-6, 1e6),
    "base_amplitude_m": (1e-9, 10.0),
    "base_amplitude_m_se": (0.0, 10.0),
    "base_amplitude_m_u": (0.0, 10.0),
    "frequency_ratio": (0.005, 50.0),
    "frequency_ratio_se": (0.0, 1.0),
    "energy_per_cycle": (-1e4, 1e4),
    "energy_per_cycle_se": (0.0, 1e4),
    "energy_per_cycle_u": (0.0, 1e4),
    "response_amplitude_u": (0.0, 1e4),
    "frequency_ratio_u": (0.0, 1.0),
    "response_amplitude": (0.0, 1e4),
    "response_amplitude_se": (0.0, 1e4),
    "steady_energy_per_cycle": (-1e4, 1e4),
    "steady_energy_per_cycle_se": (0.0, 1e4),
    "steady_response_amplitude": (0.0, 1e4),
    "steady_response_amplitude_se": (0.0, 1e4),
    "irregularity_index": (0.0, 1e4),
    "irregularity_floor": (0.0, 1e4),
    "base_irregularity_index": (0.0, 1e4),
    "stops_per_cycle": (0.0, 1e4),
    "asymmetry": (0.0, 1e4),
    "energy_trend_per_hour": (-1e6, 1e6),
    "energy_trend_per_hour_se": (0.0, 1e6),
}
"""What a measurement can be, generously: beyond, a table was edited wrongly or a sensor is connected wrongly."""
LONGEST_NAME = 60  # characters of a material: it stands in tables, figures and names of files
LONG_S = 300.0  # from this duration on a test is a long one: it tells drift, and the fit over r leaves it to that


@dataclass(frozen=True)
class Trial:
    """One test as its measurement tells it; ``None`` is not known. Units as the contract's keys; ``row`` is all of it.

    ``ratio`` (the frequency ratio), ``energy`` (k Y^2 per cycle), ``amplitude`` (Y) are estimates, dimensionless;
    ``steady_energy``, ``steady_amplitude``: the same over all settled cycles, where ``energy`` is of the last only;
    ``nominal_frequency_ratio``: what the test was set to, where its facts say so.
    """

    source: str
    reason: str | None = None
    warnings: tuple[str, ...] = ()
    material: str | None = None
    normal_force_n: float | None = None
    nominal_frequency_ratio: float | None = None
    duration_s: float = math.nan
    transient_s: float = 0.0
    energy_rule: str = "last"
    settled_s: float | None = None
    drive_frequency_hz: float = math.nan
    base_amplitude_m: float = math.nan
    ratio: Estimate = NOT_KNOWN
    energy: Estimate = NOT_KNOWN
    amplitude: Estimate = NOT_KNOWN
    steady_energy: Estimate = NOT_KNOWN
    steady_amplitude: Estimate = NOT_KNOWN
    irregularity: float | None = None
    irregularity_floor: float = 0.0
    base_irregularity: float = 0.0
    stops: float | None = None
    regime: str | None = None
    asymmetry: float = 0.0
    trend: Trend | None = field(default=None, repr=False)
    row: Row = field(default_factory=dict, repr=False)

    frequency_ratio = Flat("ratio")
    frequency_ratio_se = Flat("ratio", "se")

    @property
    def failed(self) -> bool:
        """Whether it has no measurement, or lacks a fact without which it belongs nowhere; ``reason`` says which."""
        return self.reason is not None

    @property
    def is_long(self) -> bool:
        """Whether it lasts long enough to tell drift."""
        return self.duration_s >= LONG_S

    @property
    def is_averaged(self) -> bool:
        """Whether its energy and amplitude over all settled cycles are known."""
        return self.steady_energy.known and self.steady_amplitude.known

    @property
    def mean(self) -> tuple[float, float]:
        """Energy and amplitude over all settled cycles, or else as the measurement's rule has them; nan if unknown."""
        energy, amplitude = self.means
        return energy.value or math.nan, amplitude.value or math.nan

    @property
    def means(self) -> tuple[Estimate, Estimate]:
        """Energy and amplitude that the campaign rests on; `mean` is their values."""
        if self.is_averaged:
            return self.steady_energy, self.steady_amplitude
        return self.energy, self.amplitude

    @property
    def mean_se(self) -> tuple[float, float]:
        """Standard errors of `mean`; where the measurement tells none, `UNKNOWN_ERROR` of the number."""
        energy, amplitude = (UNKNOWN_ERROR * abs(e.value or math.nan) if e.se is None else e.se for e in self.means)
        return energy, amplitude

    @property
    def tells_errors(self) -> bool:
        """Whether its measurement says how sure energy and amplitude are."""
        return all(e.se is not None for e in self.means)

    @property
    def systematic(self) -> tuple[float | None, float | None]:
        """Relative uncertainty of energy and amplitude by what their cycles share: sensors, clock; None: not told."""
        energy, amplitude = (_beyond_scatter(e) for e in (self.energy, self.amplitude))
        return energy, amplitude

    @property
    def cycles_before(self) -> float:
        """Cycles that have passed before the ones its `mean` is of."""
        if self.is_averaged:
            return max(self.transient_s, self.settled_s or 0.0) * self.drive_frequency_hz
        kind, _, seconds = self.energy_rule.partition(":")
        before = {"all": self.transient_s, "window": self.duration_s - float(seconds or 0)}
        passed = before.get(kind, self.duration_s) * self.drive_frequency_hz
        return passed if math.isfinite(passed) else math.inf

    @property
    def r(self) -> float:
        """Frequency ratio, nan if not known."""
        return math.nan if self.ratio.value is None else self.ratio.value

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

    @property
    def irregularity_interval(self) -> tuple[float | None, float | None]:
        """Where the motion's own irregularity lies.

        Noise can add at most its floor, by the triangle inequality; how the cycles are cut and sampled moves it by 1 %.
        """
        if self.irregularity is None:
            return None, None
        low = max(self.irregularity - self.irregularity_floor, 0.0)
        return (1.0 - CUT) * low, (1.0 + CUT) * self.irregularity


def trial_of(row: Row, facts: Mapping[str, object] | None = None) -> Trial:
    """A trial from one row of measurements, and from facts that the file's name or a sheet gives.

    What the row says is taken; a fact that ``facts`` tells differently becomes a warning.

    Examples
    --------
    >>> row = {"source": "a.h5", "status": "ok", "frequency_ratio": 0.5, "energy_per_cycle": 2.1,
    ...        "response_amplitude": 1.3}
    >>> trial_of(row).reason
    'no material, no normal_force_n: name them in the scene ([experiment], name_pattern or sheet)'
    >>> trial_of(row, {"material": "steel", "normal_force_n": 1.25}).group
    ('steel', 1.25)
    """
    known = {key: plain(value) for key, value in (facts or {}).items()}
    merged = {**known, **{key: value for key, value in row.items() if value is not None}}
    merged["warnings"] = (*_sentences(row.get("warnings")), *_contradictions(row, known))
    number = _Numbers(merged)
    return Trial(
        source=str(merged.get("source", "?")),
        reason=_reason(merged, number),
        warnings=_sentences(merged["warnings"]),
        material=_text(merged.get("material")),
        normal_force_n=number.positive("normal_force_n"),
        nominal_frequency_ratio=number.positive("nominal_frequency_ratio"),
        duration_s=number("duration_s", math.nan),
        transient_s=number("transient_s", 0.0),
        energy_rule=_text(merged.get("energy_rule")) or "last",
        settled_s=number.known("settled_s"),
        drive_frequency_hz=number("drive_frequency_hz", math.nan),
        base_amplitude_m=number("base_amplitude_m", math.nan),
        ratio=number.estimate("frequency_ratio"),
        energy=number.estimate("energy_per_cycle"),
        amplitude=number.estimate("response_amplitude"),
        steady_energy=number.estimate("steady_energy_per_cycle"),
        steady_amplitude=number.estimate("steady_response_amplitude"),
        irregularity=number.known("irregularity_index"),
        irregularity_floor=number("irregularity_floor", 0.0),
        base_irregularity=number("base_irregularity_index", 0.0),
        stops=number.known("stops_per_cycle"),
        regime=_text(merged.get("regime")),
        asymmetry=number("asymmetry", 0.0),
        trend=trend if isinstance(trend := merged.get("trend"), Trend) else None,
        row={key: value for key, value in merged.items() if key != "trend"},
    )


class _Numbers:
    """Finite numbers of a row; anything else counts as not known."""

    def __init__(self, row: Row) -> None:
        self._row = row

    def known(self, key: str) -> float | None:
        value = self._row.get(key)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or abs(value) > MOST:
            return None
        return float(value) if math.isfinite(value) else None

    def estimate(self, key: str) -> Estimate:
        """A number with its errors; one below zero is no error."""
        errors = (error if (error := self.known(key + end)) is None or error >= 0 else None for end in ("_se", "_u"))
        return Estimate(self.known(key), *errors)

    def positive(self, key: str) -> float | None:
        value = self.known(key)
        return value if value is not None and value > 0 else None

    def __call__(self, key: str, default: float) -> float:
        value = self.known(key)
        return default if value is None else value


def _beyond_scatter(number: Estimate) -> float | None:
    """What the combined uncertainty holds beyond the standard error, over the number."""
    if number.u is None or not number.value:
        return None
    return math.sqrt(max(number.u**2 - (number.se or 0.0) ** 2, 0.0)) / abs(number.value)


def _reason(merged: Row, number: _Numbers) -> str | None:
    """Why a row cannot take part in the campaign, or None."""
    if merged.get("status") == "failed":
        return _text(merged.get("reason")) or "its measurement failed and gives no reason"
    if not _text(merged.get("material")) or number.positive("normal_force_n") is None:
        gone = [
            *([] if _text(merged.get("material")) else ["no material"]),
            *([] if number.positive("normal_force_n") is not None else ["no normal_force_n"]),
        ]
        return f"{', '.join(gone)}: name them in the scene ([experiment], name_pattern or sheet)"
    if len(name := _text(merged.get("material")) or "") > LONGEST_NAME:
        return f"material: expected a name of at most {LONGEST_NAME} characters; got {len(name)}: shorten it"
    impossible = [_beyond(key, value) for key in POSSIBLE if (value := _outside(merged, key)) is not None]
    if impossible:
        return f"{'; '.join(impossible)}: correct the measurement, or leave it out"
    wanting = [
        key for key in ("frequency_ratio", "energy_per_cycle", "response_amplitude") if number.known(key) is None
    ]
    if wanting == ["frequency_ratio"]:
        return "no frequency_ratio: give [rig] natural_frequency_hz in the scene when analyzing"
    if wanting:
        return f"no {', no '.join(wanting)} in the measurement: analyze it again"
    if (rule := _text(merged.get("energy_rule"))) is not None and not _is_rule(rule):
        return f"energy_rule: expected {EXPECTED}; got {rule[:LONGEST_NAME]!r}: analyze it again"
    energy, error = number("energy_per_cycle", 0.0), number("energy_per_cycle_se", 0.0)
    return TURNED.format(energy) if energy < -max(5.0 * error, NEARLY_NONE) else None


def _is_rule(rule: str) -> bool:
    """Whether a text is a rule of which cycles an energy is of."""
    try:
        window_of(rule)
    except ValueError:
        return False
    return True


def _outside(row: Row, key: str) -> float | None:
    """A number of a row that cannot be, or None."""
    value, (low, high) = row.get(key), POSSIBLE[key]
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return value if is_number and isinstance(value, (int, float)) and (value < low or value > high) else None


def _beyond(key: str, value: float) -> str:
    low, high = POSSIBLE[key]
    said = f"{value:g}" if abs(value) <= MOST else "a number beyond all bounds"
    return f"{key} = {said}: expected {low:g} to {high:g}"


def _contradictions(row: Row, facts: Row) -> list[str]:
    return [
        f"{key} is {row[key]!r} in the measurement, {facts[key]!r} by the scene: {row[key]!r} is taken"
        for key in facts
        if _differ(facts[key], row.get(key))
    ]


def _differ(ours: object, theirs: object) -> bool:
    if ours is None or theirs is None:
        return False
    if isinstance(ours, (int, float)) and isinstance(theirs, (int, float)):
        return not math.isclose(ours, theirs, rel_tol=1e-6)
    return str(ours) != str(theirs)


def _text(value: object) -> str | None:
    return encodable(str(value)) if value is not None and str(value) else None


def _sentences(value: object) -> tuple[str, ...]:
    if isinstance(value, (list, tuple)):
        return tuple(str(item) for item in value)
    return (str(value),) if value else ()


def in_order(trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """Trials sorted by material, normal force, frequency ratio and source, failed ones last; each source once.

    Raises
    ------
    UsageError
        A source stands twice: its test would count twice.
    """
    sources = [trial.source for trial in trials]
    twice = sorted({source for source in sources if sources.count(source) > 1})
    if twice:
        raise UsageError(
            f"campaign: measured twice: {', '.join(twice[:5])}{' ...' if len(twice) > 5 else ''}; expected one"
            " measurement per test: leave one file out"
        )
    return tuple(sorted(trials, key=_place))


def _place(trial: Trial) -> tuple[bool, str, float, float, str]:
    return trial.failed, trial.material or "", trial.normal_force_n or 0.0, trial.frequency_ratio or 0.0, trial.source


def levels(ratios: Sequence[float], *, reach: float = 0.02, least: float = 0.008) -> tuple[float, ...]:
    """The frequency ratios a campaign was set to, from the measured ones: neighbours within ``reach`` belong together.

    Examples
    --------
    >>> [round(level, 5) for level in levels([0.2999, 0.3002, 0.35, 1.2, 1.201])]
    [0.30005, 0.35, 1.2005]
    """
    rest = sorted(ratios)
    found = []
    while rest:
        near = [r for r in rest if r <= rest[0] + max(reach * rest[0], least)]
        found.append(math.fsum(near) / len(near))
        rest = rest[len(near) :]
    return tuple(found)


def nearest(value: float, among: Sequence[float]) -> float:
    """The level a measured ratio belongs to."""
    return min(among, key=lambda level: abs(level - value))


def short_name(source: str) -> str:
    """A source without its folders and suffix, for tables and figures."""
    return Path(source).stem
