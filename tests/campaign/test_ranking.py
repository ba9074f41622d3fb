"""Long tests and rankings: slopes, the right order, ties called ties, and what cannot be known said."""

import math
from dataclasses import replace

import numpy as np
import pytest

from frictionlab.analysis.steadiness import linear_trend
from frictionlab.campaign import Campaign, evaluate
from frictionlab.campaign.prediction import Model
from frictionlab.campaign.ranking import Rank, drift_of
from frictionlab.campaign.trials import trial_of
from frictionlab.scene import Scene
from frictionlab.simulator import Problem, steady_state
from tests.campaign.fabricate import AMPLITUDE, COEFFICIENTS, RATIOS, STIFFNESS, fit_of, row

LAW = Model()


def test_the_energys_drift_gives_back_the_frictions() -> None:
    """Friction grows by 4 % an hour; the energy of each cycle is the simulator's own."""
    fit = fit_of([trial_of(row("steel", 1.25, r, 0.6, noise=0.0)) for r in (0.3, 0.7, 1.2)])
    beta = 0.6 * 1.25 / (STIFFNESS * AMPLITUDE)
    time = np.arange(20.0, 1800.0, 10.0)
    states = [steady_state(Problem(0.3, beta * (1 + 0.04 * (t - 910) / 3600))) for t in time]
    energy = np.array([s.energy_per_cycle for s in states], dtype=float)
    long = trial_of({**row("steel", 1.25, 0.3, 0.6, noise=0.0), "duration_s": 1800.0})
    found = drift_of(replace(long, trend=linear_trend(time, energy)), None, Scene(), LAW, [fit])
    assert found.friction_slope_per_hour == pytest.approx(0.04, rel=0.01)
    assert found.verdict == "rises"
    assert found.relative_slope_per_hour == pytest.approx((found.slope_per_hour or 0) / energy.mean())


def test_a_drift_is_told_by_the_friction_of_its_own_test() -> None:
    """By its group's friction, 4 % lower, a slope of 19.3 % an hour came out as 18.6 %."""
    others = [trial_of(row("steel", 1.25, r, 0.6, noise=0.0)) for r in (0.3, 0.7, 1.2)]
    long = trial_of({**row("steel", 1.25, 0.3, 0.7, noise=0.0), "duration_s": 1800.0, "source": "long"})
    beta = 0.7 * 1.25 / (STIFFNESS * AMPLITUDE)
    time = np.arange(20.0, 1800.0, 10.0)
    states = [steady_state(Problem(0.3, beta * (1 + 0.04 * (t - 910) / 3600))) for t in time]
    long = replace(long, trend=linear_trend(time, np.array([s.energy_per_cycle for s in states], dtype=float)))
    found = drift_of(long, None, Scene(), LAW, [fit_of([*others, long])])
    assert found.friction_slope_per_hour == pytest.approx(0.04, rel=0.01)


def test_an_energy_below_zero_tells_no_drift_of_friction() -> None:
    """Its power is a complex number, and a campaign ended in a TypeError."""
    long = {**row("steel", 1.25, 0.3, 0.6), "energy_per_cycle": -0.004, "energy_per_cycle_se": 0.002}
    slope = {"duration_s": 900.0, "energy_trend_per_hour": 0.1, "energy_trend_per_hour_se": 0.01}
    fit = fit_of([trial_of(row("steel", 1.25, r, 0.6, noise=0.0)) for r in (0.3, 0.7, 1.2)])
    assert drift_of(trial_of({**long, **slope}), None, Scene(), LAW, [fit]).friction_slope_per_hour is None


def test_without_points_the_measurements_own_slope_serves(campaign: Campaign) -> None:
    slopes = {d.trial.material: d.slope_per_hour for d in campaign.drifts}
    assert slopes == {"steel": 0.05, "aramid": 0.001, "rubber": -0.2}
    verdicts = {d.trial.material: d.verdict for d in campaign.drifts}
    assert verdicts == {"steel": "rises", "aramid": "no drift shown", "rubber": "falls"}


def test_without_any_slope_it_says_so() -> None:
    found = drift_of(trial_of({**row("steel", 1.25, 0.3, 0.6), "duration_s": 900.0}), None, Scene(), LAW, [])
    assert found.slope_per_hour is None
    assert found.verdict == "not known"
    assert "its recording is not at hand" in found.note


def ranks_of(campaign: Campaign, criterion: str) -> list[Rank]:
    return [rank for rank in campaign.ranking if rank.criterion == criterion]


def order(campaign: Campaign, criterion: str) -> list[tuple[int | None, str]]:
    return [(rank.rank, rank.material) for rank in ranks_of(campaign, criterion)]


def test_each_criterion_ranks_by_its_own_mean_over_the_common_tests(campaign: Campaign) -> None:
    assert list(dict.fromkeys(rank.criterion for rank in campaign.ranking)) == ["energy", "consistency", "drift"]
    assert order(campaign, "energy") == [(1, "rubber"), (2, "steel"), (3, "aramid")]
    assert order(campaign, "consistency") == [(1, "aramid"), (2, "rubber"), (3, "steel")]
    assert order(campaign, "drift") == [(1, "aramid"), (2, "steel"), (3, "rubber")]
    best = ranks_of(campaign, "energy")[0]
    means = [t.mean[0] for t in campaign.trials if t.material == "rubber" and not t.is_long]
    assert best.value == pytest.approx(math.fsum(means) / len(means))
    assert "15 tests (at 1, 1.25, 1.5 N)" in best.evidence


def test_equal_materials_tie_in_everything(scene: Scene) -> None:
    rows = [
        {**row(m, 1.5, r, 0.6, seed=seed), "material": m} for seed, m in enumerate(("steel", "iron")) for r in RATIOS
    ]
    found = evaluate([trial_of(r) for r in rows], scene)
    for criterion in ("energy", "consistency"):
        assert {rank for rank, _ in order(found, criterion)} == {1}
        assert [r.tied_with for r in ranks_of(found, criterion)] in ([("iron",), ("steel",)], [("steel",), ("iron",)])


def test_only_the_common_tests_count(scene: Scene) -> None:
    """Steel's extra tests would put it first; where both were tested, rubber dissipates more."""
    rows = [row("rubber", 1.0, r, 0.95) for r in RATIOS] + [row("steel", 1.0, r, 0.6) for r in RATIOS]
    rows += [row("steel", 2.5, r, 0.6) for r in (0.6, 0.7, 0.8)]
    assert order(evaluate([trial_of(r) for r in rows], scene), "energy") == [(1, "rubber"), (2, "steel")]


def test_without_common_tests_the_coefficient_stands_in_and_says_so(scene: Scene) -> None:
    rows = [row("rubber", 0.5, r, 0.95) for r in RATIOS] + [row("steel", 2.0, r, 0.6) for r in RATIOS]
    found = evaluate([trial_of(r) for r in rows], scene)
    assert order(found, "energy") == [(1, "rubber"), (2, "steel")]
    assert ranks_of(found, "energy")[0].value == pytest.approx(0.95, rel=0.01)
    assert "friction coefficient instead" in ranks_of(found, "energy")[0].evidence
    assert order(found, "consistency") == [(None, "rubber"), (None, "steel")]


def test_without_long_tests_nobody_has_a_rank_in_drift(scene: Scene) -> None:
    rows = [row(m, 1.5, r, mu) for m, mu in COEFFICIENTS.items() for r in RATIOS]
    found = evaluate([trial_of(r) for r in rows], scene)
    assert order(found, "drift") == [(None, m) for m in sorted(COEFFICIENTS)]
    assert any("nothing is said of drift" in note for note in found.notes)
