"""Long tests and rankings: slopes, the right order, ties called ties, and what cannot be known said."""

import math
import re

import numpy as np
import pytest

from frictionlab.analysis.steadiness import linear_trend
from frictionlab.campaign import Campaign, evaluate
from frictionlab.campaign.ranking import Rank, drift_of
from frictionlab.campaign.trials import trial_of
from frictionlab.figures.plates import plates
from frictionlab.report import page
from frictionlab.scene import Scene
from frictionlab.schema import GRAVE
from frictionlab.simulator import Problem, steady_state
from tests.campaign.fabricate import AMPLITUDE, COEFFICIENTS, RATIOS, STIFFNESS, row
from tests.desk import present


def test_an_energy_that_grows_rises_by_its_trend() -> None:
    """Friction grows by 4 % an hour; the energy of each cycle is the simulator's."""
    beta, time = 0.6 * 1.25 / (STIFFNESS * AMPLITUDE), np.arange(20.0, 1800.0, 10.0)
    states = [steady_state(Problem(0.3, beta * (1 + 0.04 * (t - 910) / 3600))) for t in time]
    energy = np.array([s.energy_per_cycle for s in states], dtype=float)
    long = trial_of({**row("steel", 1.25, 0.3, 0.6, noise=0.0), "duration_s": 1800.0, "source": "long"})
    found = drift_of(long, linear_trend(time, energy))
    assert found.verdict == "rises"
    assert found.slope_per_hour == pytest.approx(np.polyfit(time, energy, 1)[0] * 3600.0, rel=1e-6)
    assert found.relative_slope_per_hour == pytest.approx((found.slope_per_hour or 0) / energy.mean())


def test_a_jump_is_no_drift() -> None:
    """A line over two plateaus, 25 % of friction apart, was "no drift shown: -50 +- 45 %/h"."""
    time = np.arange(900.0, 1800.0, 10.0)
    long = {**row("steel", 1.25, 0.3, 0.6, noise=0.0), "duration_s": 1800.0, "energy_trend_per_hour": -1.7}
    trend = linear_trend(time, np.where(time < 1100.0, 3.54, 3.12) + 1e-3 * np.sin(time))
    found = drift_of(trial_of(long), trend)
    assert (found.verdict, found.slope_per_hour) == ("not known", None)
    assert found.note == "it jumps at 1100 s: cut the log there"


def test_without_points_the_measurements_own_slope_serves(campaign: Campaign) -> None:
    slopes = {d.trial.material: d.slope_per_hour for d in campaign.drifts}
    assert slopes == {"steel": 0.05, "aramid": 0.001, "rubber": -0.2}
    verdicts = {d.trial.material: d.verdict for d in campaign.drifts}
    assert verdicts == {"steel": "rises", "aramid": "no drift shown", "rubber": "falls"}


def test_without_any_slope_it_says_so() -> None:
    found = drift_of(trial_of({**row("steel", 1.25, 0.3, 0.6), "duration_s": 900.0}))
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


def test_an_irregularity_that_noise_hides_is_known_to_the_noise(scene: Scene) -> None:
    """Half the floor stood as 2.392e-4 +- 9e-7: the scatter from test to test of what noise had left."""
    rows = [
        row(m, 1.5, r, 0.6, irregularity=1e-3) | {"irregularity_index": 1.1e-3}
        for m in ("iron", "zinc")
        for r in RATIOS
    ]
    for rank in ranks_of(evaluate([trial_of(r) for r in rows], scene), "consistency"):
        assert present(rank.value) < 1e-3
        assert present(rank.value_se) > 0.2e-3


def test_materials_whose_names_differ_in_capitals_only_are_named(scene: Scene) -> None:
    rows = [row(m, 1.5, r, 0.6) for m in ("brass", "Brass", "zinc") for r in RATIOS]
    (said,) = (n for n in evaluate([trial_of(r) for r in rows], scene).notes if "capitals" in n)
    assert said.startswith("Brass, brass: names that differ in capitals only")
    assert GRAVE.search(said), "it reaches the screen"


def test_only_the_common_tests_count(scene: Scene) -> None:
    """Steel's extra tests would put it first; where both were tested, rubber dissipates more."""
    rows = [row("rubber", 1.0, r, 0.95) for r in RATIOS] + [row("steel", 1.0, r, 0.6) for r in RATIOS]
    rows += [row("steel", 2.5, r, 0.6) for r in (0.6, 0.7, 0.8)]
    assert order(evaluate([trial_of(r) for r in rows], scene), "energy") == [(1, "rubber"), (2, "steel")]


def test_without_common_tests_nobody_has_a_rank_and_why_is_said(scene: Scene) -> None:
    rows = [row("rubber", 0.5, r, 0.95) for r in RATIOS] + [row("steel", 2.0, r, 0.6) for r in RATIOS]
    found = evaluate([trial_of(r) for r in rows], scene)
    for criterion in ("energy", "consistency"):
        assert order(found, criterion) == [(None, "rubber"), (None, "steel")]
    assert "test all under one normal force" in ranks_of(found, "energy")[0].evidence


def test_a_test_that_never_slips_counts_as_no_energy_and_that_is_said(scene: Scene) -> None:
    rows = [row(m, 1.5, r, 0.6) for m in ("steel", "rubber") for r in RATIOS]
    rows[0] |= {"regime": "stuck", "energy_per_cycle": 0.0}
    (rank, *_) = ranks_of(evaluate([trial_of(r) for r in rows], scene), "energy")
    assert rank.evidence.partition(";")[0].endswith("in common, a test in which the mass never slips as 0")


def test_without_long_tests_nobody_has_a_rank_in_drift(scene: Scene) -> None:
    rows = [row(m, 1.5, r, mu) for m, mu in COEFFICIENTS.items() for r in RATIOS]
    found = evaluate([trial_of(r) for r in rows], scene)
    assert order(found, "drift") == [(None, m) for m in sorted(COEFFICIENTS)]
    assert any("nothing is said of drift" in note for note in found.notes)


def test_a_campaign_without_recordings_has_all_its_figures(campaign: Campaign) -> None:
    drawn = {plate.name: plate.draw() for plate in plates(campaign)}
    every = ("friction", "irregularity", "stops")
    assert set(drawn) == {*every, *(f"energy_{material}" for material in campaign.materials)}
    for figure in drawn.values():
        assert all(ax.has_data() or ax.texts for ax in figure.axes)
        assert any(ax.get_xlabel() for ax in figure.axes)


def test_a_campaign_of_one_force_has_lines_in_place_of_maps_and_no_caption_of_absent_panels(scene: Scene) -> None:
    few = evaluate([trial_of(row("steel", 1.0, r, 0.6)) for r in (0.3, 0.45, 0.7)], scene)
    drawn = {plate.name: plate for plate in plates(few)}
    assert not any(ax.collections for ax in drawn["stops"].draw().axes)
    assert len(drawn["friction"].draw().axes) == 1
    assert "Right" not in drawn["friction"].caption
    one = evaluate([trial_of(row("steel", 1.0, 0.3, 0.6))], scene)
    assert not {"stops", "irregularity"} & {plate.name for plate in plates(one)}


def test_tests_of_one_frequency_ratio_are_drawn_over_normal_force_with_space_around(scene: Scene) -> None:
    rows = [row("steel", force, 0.31978 + 1e-5 * force, 0.6) for force in (1.0, 1.5, 2.0)]
    campaign = evaluate([trial_of(one) for one in rows], scene)
    drawn = {plate.name: plate.draw().axes[0] for plate in plates(campaign)}
    assert drawn["energy_steel"].get_xlabel() == "normal force [N]"
    assert drawn["energy_steel"].get_xlim() == pytest.approx((0.0, 2.2))
    captions = " ".join(plate.caption for plate in plates(campaign))
    assert not any(word in captions for word in ("dotted lines", "Blank"))
    text = page(campaign, [], {})
    assert "energy per cycle [kY²] over normal force [N]" in text
    low, *_, high = re.findall(r'<circle class="group0" cx="([0-9.]+)"', text)
    assert 62.0 + 10.0 < float(low) < float(high) < 908.0 - 10.0
