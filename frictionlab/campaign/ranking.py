"""How the energy of long tests drifts (thesis 4.4.3), and which material is best: by energy, by consistency, by drift.

Materials are compared only where they were tested alike: at the *cells* (normal force x frequency ratio) that all have
in common. A rank is one more than the number of materials that are better *beyond doubt* (95 %), so neighbours that the
evidence does not distinguish share a rank; within a rank the better value stands first.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr

from frictionlab.analysis.steadiness import Trend
from frictionlab.arrays import FloatArray
from frictionlab.campaign.friction import SHARED, TRANSIENT, FrictionFit, Verdict
from frictionlab.campaign.trials import Trial, levels, nearest
from frictionlab.uncertainty import NOT_KNOWN, Estimate, Flat

SURE = 0.05
CRITERIA = ("energy", "consistency", "drift")
SURVIVES = (
    "errors of gain, lag and rig that all tests share cancel here; the error of each material's normal force does not"
)
UNITS = {
    "energy": "mean energy per cycle, kY²",
    "consistency": "irregularity index beyond noise, geometric mean",
    "drift": "relative change of the energy per hour, mean of its magnitude",
}
STUCK = ", a test in which the mass never slips as 0"
UNLIKE = "no short test is common to all materials: test all under one normal force at the same frequency ratios"
GIVEN = "motions are given and forces measured: no frame answers, so nothing is ranked; friction.csv has coefficients"
HOUR = 3600.0
Cell = tuple[float, float]
Tests = Sequence[tuple[Verdict, FrictionFit]]
Cells = Mapping[str, Mapping[Cell, Tests]]


@dataclass(frozen=True)
class Drift:
    """The drift of one long test.

    ``slope``: of the energy per cycle (k Y^2 per hour), ``slope_per_hour_low``, ``slope_per_hour_high``: its 95 %
    interval; ``relative``: the same over the mean energy; ``trend``: the points behind the slope where the recording
    is at hand. ``None`` is not known, and ``note`` says why.
    """

    trial: Trial
    slope: Estimate
    slope_per_hour_low: float | None
    slope_per_hour_high: float | None
    trend: Trend | None
    note: str

    slope_per_hour, slope_per_hour_se = Flat("slope"), Flat("slope", "se")
    relative_slope_per_hour, relative_slope_per_hour_se = Flat("relative"), Flat("relative", "se")

    @property
    def relative(self) -> Estimate:
        """Slope over the test's mean energy."""
        return self.slope.over(self.trend.level if self.trend is not None else self.trial.energy.value)

    @property
    def verdict(self) -> str:
        """``rises``, ``falls``, ``no drift shown`` (the interval holds zero) or ``not known``."""
        if self.slope_per_hour_low is None or self.slope_per_hour_high is None:
            return "not known"
        if self.slope_per_hour_low <= 0 <= self.slope_per_hour_high:
            return "no drift shown"
        return "rises" if self.slope_per_hour_low > 0 else "falls"


def drift_of(trial: Trial, trend: Trend | None = None) -> Drift:
    """Return the drift of a long test: from its trend, where its recording is at hand, else its row's own slope."""
    low: float | None = None
    high: float | None = None
    value, error = (trial.row.get(f"energy_trend_per_hour{end}") for end in ("", "_se"))
    slope = NOT_KNOWN
    jumped = [] if trend is None else trend.jumps.tolist()
    if trend is not None and not jumped:
        slope, low, high = Estimate(trend.slope, trend.slope_se).scaled(HOUR), trend.low * HOUR, trend.high * HOUR
    elif not jumped and isinstance(value, (int, float)) and isinstance(error, (int, float)):
        slope = Estimate(float(value), float(error))
        low, high = slope.low, slope.high
    note = "" if trend is not None else "its recording is not at hand: no points are drawn"
    if jumped:
        note = f"it jumps at {', '.join(f'{at:.4g} s' for at in jumped)}: cut the log there"
    elif not slope.known:
        note = "no slope: its recording is not at hand and its measurement holds no energy_trend_per_hour"
    return Drift(trial, slope, low, high, trend, note)


@dataclass(frozen=True)
class Rank:
    """One line of the ranking. ``rank`` None: not known. ``tied_with``: materials not distinguished from this one."""

    criterion: str
    rank: int | None
    material: str
    value: float | None
    value_se: float | None
    value_u: float | None
    tied_with: tuple[str, ...]
    evidence: str

    @property
    def unit(self) -> str:
        """What the value is."""
        return UNITS[self.criterion]


@dataclass(frozen=True)
class _Level:
    """A mean of one material, its own error (None: not known), and what sensors and rig do to it.

    ``shared``: by sources that are the same for all materials (over `SHARED`), so that they fall out of a difference;
    ``apart``: what each material has for itself (its normal force, set anew).
    """

    value: float
    error: float | None
    shared: FloatArray = field(default_factory=lambda: np.zeros(len(SHARED)))
    apart: float = 0.0

    @property
    def u(self) -> float | None:
        """Combined standard uncertainty."""
        return None if self.error is None else math.hypot(self.error, self.apart, *self.shared)

    def tie(self, other: "_Level") -> float:
        """How often two equal materials would look at least this different."""
        if self.error is None or other.error is None:
            return 1.0
        size = math.hypot(self.error, other.error, self.apart, other.apart, *(self.shared - other.shared))
        gap = abs(self.value - other.value)
        return 2.0 * float(ndtr(-gap / size)) if size > 0 else float(gap == 0)


Standing = tuple[Mapping[str, _Level], Callable[[str, str], float], str]
"""Level of each material, how often two equal ones would look that different, and the evidence in words."""


def rank_all(fits: Sequence[FrictionFit], drifts: Sequence[Drift], materials: Sequence[str]) -> tuple[Rank, ...]:
    """Rank all materials by the three criteria, in the contract's order, best first."""
    short = [(v, f) for f in fits for v in f.verdicts if not (v.trial.is_long or v.is_misread)]
    tests = [(v, f) for v, f in short if math.isfinite(v.trial.r)]
    ratios = levels([v.trial.r for v, _ in tests])
    cells: dict[str, dict[Cell, list[tuple[Verdict, FrictionFit]]]] = {m: {} for m in materials}
    for verdict, fit in tests:
        cell = (fit.normal_force_n, nearest(verdict.trial.r, ratios))
        cells[fit.material].setdefault(cell, []).append((verdict, fit))
    standings: tuple[Standing, ...] = (_by_energy(cells), _by_consistency(cells), _by_drift(drifts))
    if short and all(v.trial.is_given for v, _ in short):
        standings = (({}, lambda _a, _b: 1.0, GIVEN),) * 3
    signs = (-1, 1, 1)  # of the best: most energy, least irregularity, least drift
    return tuple(
        rank
        for criterion, standing, sign in zip(CRITERIA, standings, signs, strict=True)
        for rank in _ranks(criterion, materials, standing, sign)
    )


def _ranks(criterion: str, materials: Sequence[str], standing: Standing, sign: int) -> list[Rank]:
    found, tie, evidence = standing
    known = sorted((m for m in materials if m in found), key=lambda m: (sign * found[m].value, m))
    better = {m: [o for o in known if sign * (found[o].value - found[m].value) < 0 and tie(o, m) < SURE] for m in known}
    lines = [
        Rank(
            criterion=criterion,
            rank=1 + len(better[m]),
            material=m,
            value=found[m].value,
            value_se=found[m].error,
            value_u=found[m].u,
            tied_with=tuple(o for o in known if o != m and o not in better[m] and m not in better[o]),
            evidence=evidence,
        )
        for m in known
    ]
    lines.sort(key=lambda line: line.rank or 0)
    unknown = [m for m in sorted(materials) if m not in found]
    return [*lines, *(Rank(criterion, None, m, None, None, None, (), evidence) for m in unknown)]


def _by_energy(cells: Cells) -> Standing:
    """Mean energy over the common cells; its error is what a repeated campaign would scatter by."""
    common = _common(cells)
    if not common:
        return {}, lambda _a, _b: 1.0, UNLIKE
    found = {m: _mean([_mean([_energy(*test) for test in own[c]]) for c in common]) for m, own in cells.items()}
    rests = any(v.trial.regime == "stuck" for own in cells.values() for cell in common for v, _ in own[cell])
    evidence = f"mean over {_count(common)} that all materials have in common{STUCK if rests else ''}; {SURVIVES}"
    return found, lambda a, b: found[a].tie(found[b]), evidence


def _mean(each: Sequence[_Level]) -> _Level:
    """The mean: own errors fall with the number, what is shared and the normal force's do not."""
    n, errors = len(each), [level.error for level in each if level.error is not None]
    return _Level(
        math.fsum(level.value for level in each) / n,
        math.hypot(*errors) / n if len(errors) == n else None,
        np.sum([level.shared for level in each], axis=0) / n,
        math.fsum(level.apart for level in each) / n,
    )


def _energy(verdict: Verdict, fit: FrictionFit) -> _Level:
    """One test's energy: its own error, and the scatter from test to test carried over from the friction."""
    trial = verdict.trial
    if trial.regime == "stuck":
        return _Level(0.0, 0.0)
    energy, measured = verdict.energy.value or math.nan, trial.mean[0]
    by_sensors, by_gain, _ = trial.systematic
    gain = abs(fit.shares.get("gain", 0.0)) if by_gain is None else by_gain
    late = abs(fit.shares.get("lag_s", 0.0)) if by_sensors is None else math.sqrt(max(by_sensors**2 - gain**2, 0.0))
    late *= measured / energy
    return _Level(
        energy,
        math.hypot(trial.mean_se[0], (fit.scatter_counted or 0.0) * energy),
        energy * np.array([gain, late, 0.0, 0.0]),
        abs(verdict.elasticity * energy) * fit.normal_force_u,
    )


def _by_consistency(cells: Cells) -> Standing:
    """Geometric mean of the excess irregularity over the common cells; ties by a paired t-test of its logarithm.

    Its error holds how far it may lie from the excess of each test, all of them up or down: noise is of the sensors.
    """
    seen = {
        m: {c: x for c, tests in own.items() if (x := _irregularity(tests)) is not None} for m, own in cells.items()
    }
    common = _common(seen)
    if not common:
        return {}, lambda _a, _b: 1.0, "no test with a known irregularity is common to all materials"
    table = np.array([[own[c][0] for c in common] for own in seen.values()])
    freedom = (len(table) - 1) * (len(common) - 1)
    left = table - table.mean(axis=1, keepdims=True) - table.mean(axis=0) + table.mean()
    spread = math.sqrt(float(np.sum(left**2)) / freedom / len(common)) if freedom else None
    rows = dict(zip(seen, table, strict=True))
    found = {}
    for m, row in rows.items():
        value, noise = math.exp(float(row.mean())), math.fsum(seen[m][c][1] for c in common) / len(common)
        found[m] = _Level(value, None if spread is None else value * math.hypot(spread, noise))

    def tie(a: str, b: str) -> float:
        from scipy.stats import ttest_rel  # noqa: PLC0415 - half a second, for rankings alone

        p = ttest_rel(rows[a], rows[b]).pvalue if len(common) > 1 else math.nan
        return 1.0 if math.isnan(p) else float(p)

    return found, tie, f"{_count(common)} that all materials have in common, compared in pairs"


def _irregularity(tests: Tests) -> tuple[float, float] | None:
    """Mean logarithm of the irregularity beyond noise, and the standard deviation that noise gives it.

    Nothing is seen below a third of the noise itself; between its least and its most any excess is as likely.
    """
    logs, widths = [], []
    for verdict, _ in tests:
        trial = verdict.trial
        is_transient = verdict.excluded is not None and verdict.excluded.cause in TRANSIENT
        if is_transient or trial.excess_irregularity is None or trial.regime == "stuck":
            continue
        floor = max(trial.irregularity_floor, trial.base_irregularity, 1e-9)
        excess = max(trial.excess_irregularity, floor / 3.0)
        logs.append(math.log(excess))
        widths.append(trial.irregularity_floor / math.sqrt(12.0) / excess)
    return (math.fsum(logs) / len(logs), math.fsum(widths) / len(widths)) if logs else None


def _by_drift(drifts: Sequence[Drift]) -> Standing:
    """Mean magnitude of the relative slope over the long tests of each material."""
    each: dict[str, list[_Level]] = {}
    for d in drifts:
        if d.relative_slope_per_hour is not None and d.relative_slope_per_hour_se is not None:
            each.setdefault(d.trial.group[0], []).append(
                _Level(abs(d.relative_slope_per_hour), d.relative_slope_per_hour_se)
            )
    found = {m: _mean(own) for m, own in each.items()}
    count = sum(map(len, each.values()))
    evidence = f"{count} long tests; the sign of each drift is in drift.csv; no gain changes a relative slope"
    return found, lambda a, b: found[a].tie(found[b]), evidence if count else "no long test with a known slope"


def _common(cells: Mapping[str, Mapping[Cell, object]]) -> list[Cell]:
    every = [set(own) for own in cells.values()]
    return sorted(set.intersection(*every)) if every else []


def _count(common: Sequence[Cell]) -> str:
    forces = sorted({force for force, _ in common})
    tests = "1 test" if len(common) == 1 else f"{len(common)} tests"
    return f"{tests} (at {', '.join(f'{f:g}' for f in forces)} N)"
