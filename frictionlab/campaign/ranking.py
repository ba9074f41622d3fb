"""Which material is best: by energy, by consistency, by drift; with the evidence, and ties called ties.

Materials are compared only where they were tested alike: at the *cells* (normal force x frequency ratio) that all have
in common. A rank is one more than the number of materials that are better *beyond doubt* (95 %), so neighbours that the
evidence does not tell apart share a rank; within a rank the better value stands first.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from frictionlab.arrays import FloatArray
from frictionlab.campaign.drift import Drift
from frictionlab.campaign.friction import TRANSIENT, FrictionFit, Verdict
from frictionlab.campaign.prediction import GAIN, LAG, RIG
from frictionlab.campaign.trials import levels, nearest

SURE = 0.05
CRITERIA = ("energy", "consistency", "drift")
Cell = tuple[float, float]
SHARED = (GAIN, LAG)
SURVIVES = (
    "errors of gain, lag and rig that all tests share cancel here; the error of each material's normal force does not"
)
UNITS = {
    "energy": "mean energy per cycle, kY²",
    "consistency": "irregularity index beyond noise, geometric mean",
    "drift": "relative change of the energy per hour, mean of its magnitude",
}


@dataclass(frozen=True)
class Rank:
    """One line of the ranking. ``rank`` None: not known. ``tied_with``: materials not told apart from this one."""

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
class _Standing:
    """Value and errors of each material, and how sure it is that one is better than another (p of a tie).

    ``u``: combined standard uncertainty; None where sensors and rig do to all materials alike what they do.
    """

    value: Mapping[str, float]
    error: Mapping[str, float | None]
    tie: Callable[[str, str], float]
    evidence: str
    u: Mapping[str, float | None] | None = None


@dataclass(frozen=True)
class _Level:
    """A mean of one material: ``value``, its own ``error`` (None: not known), and what sensors and rig do to it.

    ``shared``: its error by sources that are the same for all materials, as a vector over these, so that they fall out
    of a difference; ``apart``: what each material has for itself (its normal force, set anew).
    """

    value: float
    error: float | None
    shared: FloatArray
    apart: float

    @property
    def own(self) -> float:
        """What no other material has a part in, beside what it is apart by."""
        return self.error or 0.0

    @property
    def u(self) -> float | None:
        """Combined standard uncertainty."""
        return None if self.error is None else math.hypot(self.own, self.apart, *self.shared)

    def tie(self, other: "_Level") -> float:
        """How often two equal materials would look at least this different."""
        if self.error is None or other.error is None:
            return 1.0
        shared = self.shared - other.shared
        return _normal_p(self.value - other.value, self.own, other.own, self.apart, other.apart, *shared)


def _standing(levels_of: Mapping[str, _Level], evidence: str) -> _Standing:
    return _Standing(
        {m: level.value for m, level in levels_of.items()},
        {m: level.error for m, level in levels_of.items()},
        lambda a, b: levels_of[a].tie(levels_of[b]),
        evidence,
        {m: level.u for m, level in levels_of.items()},
    )


def rank_all(
    fits: Sequence[FrictionFit],
    drifts: Sequence[Drift],
    materials: Sequence[str],
) -> tuple[Rank, ...]:
    """Rank all materials by the three criteria, in the contract's order, best first."""
    cells = _cells(fits)
    return (
        *_ranks("energy", materials, _by_energy(cells, fits, materials), best=-1),
        *_ranks("consistency", materials, _by_consistency(cells, materials), best=1),
        *_ranks("drift", materials, _by_drift(drifts), best=1),
    )


def _ranks(criterion: str, materials: Sequence[str], standing: _Standing, *, best: int) -> list[Rank]:
    value = standing.value
    known = sorted((m for m in materials if m in value), key=lambda m: (best * value[m], m))
    better = {m: [o for o in known if best * (value[o] - value[m]) < 0 and standing.tie(o, m) < SURE] for m in known}
    lines = [
        Rank(
            criterion=criterion,
            rank=1 + len(better[m]),
            material=m,
            value=value[m],
            value_se=standing.error.get(m),
            value_u=(standing.error if standing.u is None else standing.u).get(m),
            tied_with=tuple(o for o in known if o != m and o not in better[m] and m not in better[o]),
            evidence=standing.evidence,
        )
        for m in known
    ]
    unknown = [m for m in sorted(materials) if m not in value]
    lines.sort(key=lambda line: line.rank or 0)
    return [*lines, *(Rank(criterion, None, m, None, None, None, (), standing.evidence) for m in unknown)]


def _cells(fits: Sequence[FrictionFit]) -> dict[str, dict[Cell, list[tuple[Verdict, FrictionFit]]]]:
    """The short tests of each material by normal force and frequency ratio."""
    tests = [(v, f) for f in fits for v in f.verdicts if not v.trial.is_long and math.isfinite(v.trial.r)]
    known = levels([v.trial.r for v, _ in tests])
    cells: dict[str, dict[Cell, list[tuple[Verdict, FrictionFit]]]] = {}
    for verdict, fit in tests:
        cell = (fit.normal_force_n, nearest(verdict.trial.r, known))
        cells.setdefault(fit.material, {}).setdefault(cell, []).append((verdict, fit))
    return cells


def _common(cells: Mapping[str, Mapping[Cell, object]], materials: Sequence[str]) -> list[Cell]:
    every = [set(cells.get(m, {})) for m in materials]
    return sorted(set.intersection(*every)) if every else []


def _by_energy(
    cells: Mapping[str, Mapping[Cell, list[tuple[Verdict, FrictionFit]]]],
    fits: Sequence[FrictionFit],
    materials: Sequence[str],
) -> _Standing:
    """Mean energy over the common cells; its error is what a repeated campaign would scatter by."""
    common = _common(cells, materials)
    if not common:
        return _by_coefficient(fits, materials)
    found = {m: _mean_level([_cell_energy(cells[m][cell]) for cell in common]) for m in materials}
    return _standing(found, f"mean over {_count(common)} that all materials have in common; {SURVIVES}")


def _mean_level(each: Sequence[_Level]) -> _Level:
    """The mean: own errors fall with the number, what is shared and the normal force's do not."""
    n = len(each)
    errors = [level.error for level in each if level.error is not None]
    return _Level(
        math.fsum(level.value for level in each) / n,
        math.hypot(*errors) / n if len(errors) == n else None,
        np.sum([level.shared for level in each], axis=0) / n,
        math.fsum(level.apart for level in each) / n,
    )


def _cell_energy(tests: Sequence[tuple[Verdict, FrictionFit]]) -> _Level:
    return _mean_level([_test_energy(verdict, fit) for verdict, fit in tests])


def _test_energy(verdict: Verdict, fit: FrictionFit) -> _Level:
    """One test's energy: its own error, and the scatter from test to test carried over from the friction."""
    trial = verdict.trial
    if trial.regime == "stuck":
        return _Level(0.0, 0.0, np.zeros(len(SHARED)), 0.0)
    energy = trial.mean[0]
    own = math.hypot(trial.mean_se[0], (fit.scatter or 0.0) * energy)
    apart = abs(verdict.elasticity * energy) * fit.normal_force_u
    return _Level(energy, own, _by_two_numbers(verdict, fit), apart)


def _by_two_numbers(verdict: Verdict, fit: FrictionFit) -> FloatArray:
    """What gain and lag do to a test's energy, by its own uncertainties."""
    by_sensors, by_gain = verdict.trial.systematic
    gain = abs(fit.shares.get(GAIN, 0.0)) if by_gain is None else by_gain
    late = abs(fit.shares.get(LAG, 0.0)) if by_sensors is None else math.sqrt(max(by_sensors**2 - gain**2, 0.0))
    return verdict.trial.mean[0] * np.array([gain, late])


def _by_coefficient(fits: Sequence[FrictionFit], materials: Sequence[str]) -> _Standing:
    """Without common cells, the friction coefficient stands for the energy: it governs it (thesis 4.3.2)."""
    found, known = dict[str, _Level](), [f for f in fits if f.coefficient.known]
    for m in materials:
        own = [_coefficient(f) for f in known if f.material == m]
        if own:
            found[m] = _mean_level(own)
    evidence = "no test is common to all materials: friction coefficient instead, mean over their normal forces"
    return _standing(found, f"{evidence}; {SURVIVES}")


def _coefficient(fit: FrictionFit) -> _Level:
    value = fit.friction_coefficient or 0.0
    shared = value * np.array([fit.shares.get(source, 0.0) for source in RIG])
    return _Level(value, fit.friction_coefficient_se, shared, value * fit.normal_force_u)


def _by_consistency(
    cells: Mapping[str, Mapping[Cell, list[tuple[Verdict, FrictionFit]]]], materials: Sequence[str]
) -> _Standing:
    """Geometric mean of the excess irregularity over the common cells; ties by a paired t-test of its logarithm."""
    logs = {
        m: {c: x for c, tests in cells.get(m, {}).items() if (x := _log_irregularity(tests)) is not None}
        for m in materials
    }
    common = _common(logs, materials)
    if not common:
        return _Standing({}, {}, lambda _a, _b: 1.0, "no test with a known irregularity is common to all materials")
    table = {m: np.array([logs[m][c] for c in common]) for m in materials}
    left = _without_rows_and_columns(np.array([table[m] for m in materials]))
    value = {m: math.exp(float(table[m].mean())) for m in materials}
    error = {m: None if left is None else value[m] * left / math.sqrt(len(common)) for m in materials}
    evidence = f"{_count(common)} that all materials have in common, compared in pairs"
    return _Standing(value, error, lambda a, b: _paired_p(table[a] - table[b]), evidence)


def _log_irregularity(tests: Sequence[tuple[Verdict, FrictionFit]]) -> float | None:
    """Mean logarithm of the irregularity beyond noise; nothing is seen below a third of the noise itself."""
    logs = []
    for verdict, _ in tests:
        trial = verdict.trial
        if _is_transient(verdict) or trial.excess_irregularity is None or trial.regime == "stuck":
            continue
        floor = max(trial.irregularity_floor, trial.base_irregularity, 1e-9)
        logs.append(math.log(max(trial.excess_irregularity, floor / 3.0)))
    return math.fsum(logs) / len(logs) if logs else None


def _is_transient(verdict: Verdict) -> bool:
    return verdict.excluded is not None and verdict.excluded.cause in TRANSIENT


def _without_rows_and_columns(table: FloatArray) -> float | None:
    """Standard deviation of what is left of a (materials, cells) table without the means of both."""
    rows, columns = table.shape
    freedom = (rows - 1) * (columns - 1)
    if freedom < 1:
        return None
    left = table - table.mean(axis=1, keepdims=True) - table.mean(axis=0) + table.mean()
    return math.sqrt(float(np.sum(left**2)) / freedom)


def _by_drift(drifts: Sequence[Drift]) -> _Standing:
    """Mean magnitude of the relative slope over the long tests of each material."""
    known = [d for d in drifts if d.relative_per_hour is not None and d.relative_per_hour_se is not None]
    if not known:
        return _Standing({}, {}, lambda _a, _b: 1.0, "no long test with a known slope")
    value: dict[str, float] = {}
    error: dict[str, float] = {}
    for m in {d.trial.group[0] for d in known}:
        own = [d for d in known if d.trial.group[0] == m]
        value[m] = math.fsum(abs(d.relative_per_hour or 0.0) for d in own) / len(own)
        error[m] = math.hypot(*(d.relative_per_hour_se or 0.0 for d in own)) / len(own)
    evidence = f"{len(known)} long tests; the sign of each drift is in drift.csv; no gain changes a relative slope"
    return _Standing(value, error, lambda a, b: _normal_p(value[a] - value[b], error[a], error[b]), evidence)


def _normal_p(difference: float, *errors: float) -> float:
    size = math.hypot(*errors)
    return 2.0 * float(stats.norm.sf(abs(difference) / size)) if size > 0 else float(difference == 0)


def _paired_p(difference: FloatArray) -> float:
    n = len(difference)
    if n < 2:
        return 1.0
    error = float(difference.std(ddof=1)) / math.sqrt(n)
    return (
        2.0 * float(stats.t.sf(abs(float(difference.mean())) / error, n - 1))
        if error > 0
        else float(not difference.any())
    )


def _count(common: Sequence[Cell]) -> str:
    forces = sorted({force for force, _ in common})
    tests = "1 test" if len(common) == 1 else f"{len(common)} tests"
    return f"{tests} (at {', '.join(f'{f:g}' for f in forces)} N)"
