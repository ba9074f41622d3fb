"""Rankings: the right order, ties called ties, and what cannot be known said."""

import math

import pytest

from frictionlab.campaign import Campaign, Rank, evaluate, trial_of
from frictionlab.scene import Scene
from tests.campaign.fabricate import COEFFICIENTS, RATIOS, row


def ranks_of(campaign: Campaign, criterion: str) -> list[Rank]:
    return [rank for rank in campaign.ranking if rank.criterion == criterion]


def order(campaign: Campaign, criterion: str) -> list[tuple[int | None, str]]:
    return [(rank.rank, rank.material) for rank in ranks_of(campaign, criterion)]


def test_the_criteria_come_in_the_contracts_order(campaign: Campaign) -> None:
    assert list(dict.fromkeys(rank.criterion for rank in campaign.ranking)) == ["energy", "consistency", "drift"]


def test_energy_ranks_by_its_mean_over_the_common_tests(campaign: Campaign) -> None:
    assert order(campaign, "energy") == [(1, "rubber"), (2, "steel"), (3, "aramid")]
    best = ranks_of(campaign, "energy")[0]
    means = [t.mean[0] for t in campaign.trials if t.material == "rubber" and not t.is_long]
    assert best.value == pytest.approx(math.fsum(means) / len(means))
    assert "15 tests (at 1, 1.25, 1.5 N)" in best.evidence


def test_consistency_ranks_by_irregularity(campaign: Campaign) -> None:
    assert order(campaign, "consistency") == [(1, "aramid"), (2, "rubber"), (3, "steel")]


def test_drift_ranks_by_the_magnitude_of_the_slope(campaign: Campaign) -> None:
    assert order(campaign, "drift") == [(1, "aramid"), (2, "steel"), (3, "rubber")]


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
